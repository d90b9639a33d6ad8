//! The page: panels from top to bottom.

use super::drawing::{Anchor, Drawing};
use super::frame::{BLACK, LEFT, WIDTH, abscissa};
use super::time::Clock;
use super::{Figure, Machine, Series, bands, path, spectrum, time, vibration};
use crate::spectrogram::Spectrogram;
use crate::vibration::{Shapes, Vibration};

/// Room for the title.
const TITLE: f64 = 40.0;
/// Room between panels, which holds the heading of the lower one.
const GAP: f64 = 34.0;
/// Room below an abscissa.
const LABELS: f64 = 24.0;

/// Draws a figure.
pub fn draw(figure: &Figure) -> Drawing {
    let mut page = Drawing {
        width: WIDTH,
        ..Drawing::default()
    };
    page.text(
        (LEFT, 24.0),
        Anchor::Start,
        15.0,
        BLACK,
        figure.title.as_str(),
    );
    let clock = Clock::new(figure.start_s, figure.ticks(), figure.rate_hz);
    let mut bottom = over_time(&mut page, figure, &clock);
    for (of, window) in moving(figure) {
        let top = bottom + GAP;
        let time_s = |tick: usize| clock.start_s + tick as f64 / clock.rate_hz;
        vibration::draw(&mut page, top, (of, window), time_s);
        bottom = top + vibration::HEIGHT + LABELS;
    }
    let force = figure.total.as_ref().or(figure.forces.first());
    if let (Some(travel), Some(force)) = (&figure.travel, force) {
        let top = bottom + GAP;
        path::draw(
            &mut page,
            (top, 280.0),
            &clock,
            (figure.port, travel, force),
            (&figure.places, figure.measured),
        );
        bottom = top + 280.0 + LABELS;
    }
    page.height = (bottom + 10.0).ceil();
    page
}

/// So many strings are drawn, the first that move.
const STRINGS_MAX: usize = 6;

/// The strings that move, each in the window in which it moves most.
fn moving<'a>(figure: &'a Figure) -> impl Iterator<Item = (&'a Vibration, &'a Shapes)> {
    let strings = figure.vibrations.iter();
    let moving = strings.filter_map(|string| Some((*string, string.loudest()?)));
    moving.take(STRINGS_MAX)
}

/// The panels that share the axis of time; gives the place below its labels.
fn over_time(page: &mut Drawing, figure: &Figure, clock: &Clock) -> f64 {
    // Between the title and the first panel stand the labels of the marks.
    let first = TITLE + GAP / 2.0 + if figure.marks.is_empty() { 0.0 } else { 18.0 };
    let mut bottom = first;
    let mut placed = Vec::new();
    for panel in panels(figure) {
        let top = if placed.is_empty() {
            first
        } else {
            bottom + GAP
        };
        bottom = top + panel.height();
        placed.push((top, panel));
    }
    // Marks lie behind the data.
    time::marks(
        page,
        clock,
        (first, bottom),
        &figure.mark_name,
        &figure.marks,
    );
    for (top, panel) in &placed {
        panel.draw(page, clock, *top);
    }
    abscissa(page, &clock.axis, bottom, "time (s)".into());
    bottom + LABELS
}

/// One panel over time.
enum Panel<'a> {
    Travel(Option<&'a str>, &'a Series<'a>),
    Forces(Option<&'a str>, &'a [Series<'a>], Option<&'a Series<'a>>),
    Coordinates(Vec<&'a Series<'a>>),
    Spectrum(&'a Spectrogram),
    States(&'a [Machine<'a>]),
}

impl Panel<'_> {
    fn height(&self) -> f64 {
        match self {
            Panel::Travel(..) => 110.0,
            Panel::Forces(_, terms, total) => {
                time::height(terms.len() + usize::from(total.is_some()), 200.0)
            }
            Panel::Coordinates(series) => time::height(series.len(), 150.0),
            Panel::Spectrum(_) => 180.0,
            Panel::States(machines) => bands::height(machines),
        }
    }

    fn draw(&self, page: &mut Drawing, clock: &Clock, top: f64) {
        let place = (top, self.height());
        match self {
            Panel::Travel(port, series) => time::travel(page, clock, place, (*port, series)),
            Panel::Forces(port, terms, total) => {
                time::forces(page, clock, place, (*port, terms, *total));
            }
            Panel::Coordinates(series) => time::coordinates(page, clock, place, series),
            Panel::Spectrum(of) => spectrum::draw(page, clock, place, of),
            Panel::States(machines) => bands::draw(page, clock, top, machines),
        }
    }
}

/// The panels for which a figure has data.
fn panels<'a>(figure: &'a Figure) -> Vec<Panel<'a>> {
    let travel = figure.travel.as_ref();
    let travel = travel.map(|series| Panel::Travel(figure.port, series));
    let has_forces = figure.total.is_some() || !figure.forces.is_empty();
    let forces =
        has_forces.then(|| Panel::Forces(figure.port, &figure.forces, figure.total.as_ref()));
    let coordinates = by_unit(&figure.coordinates)
        .into_iter()
        .map(Panel::Coordinates);
    let spectra = figure.spectrograms.iter().map(|of| Panel::Spectrum(of));
    let states = (!figure.machines.is_empty()).then_some(Panel::States(&figure.machines));
    travel
        .into_iter()
        .chain(forces)
        .chain(coordinates)
        .chain(spectra)
        .chain(states)
        .collect()
}

/// Series in groups of one unit, in the order in which the units first occur.
pub fn by_unit<'a>(series: &'a [Series<'a>]) -> Vec<Vec<&'a Series<'a>>> {
    let mut groups: Vec<Vec<&Series>> = Vec::new();
    for one in series {
        match groups.iter_mut().find(|g| g[0].unit == one.unit) {
            Some(group) => group.push(one),
            None => groups.push(vec![one]),
        }
    }
    groups
}
