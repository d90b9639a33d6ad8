//! Panels of quantities over time.

use whippen_compiler::rate::Rate;
use whippen_compiler::units::Dim;

use super::axis::Axis;
use super::decimate::line;
use super::drawing::{Anchor, Colour, Drawing};
use super::frame::{
    BLACK, DARK, GREY, LEADING, LEFT, LEGEND, MARK, RIGHT, TEXT, felt, heading, legend, level_grid,
    line_colour, moved, shown, upright_grid,
};
use super::{Mark, Series, font};
use crate::titles::unit_of_suffix;

/// A line of a panel.
struct Line<'a> {
    series: &'a Series<'a>,
    colour: Colour,
    width: f64,
}

/// Time on the page: tick `i` stands at `place(i)`.
#[derive(Debug, Clone, Copy)]
pub struct Clock {
    /// The axis (s).
    pub axis: Axis,
    /// The time of the first tick (s).
    pub start_s: f64,
    /// Ticks per second.
    pub rate_hz: f64,
}

impl Clock {
    /// For a figure of that many ticks from a time on (s).
    pub fn new(start_s: f64, ticks: usize, rate_hz: Rate) -> Clock {
        let rate_hz = f64::from(rate_hz);
        let end_s = start_s + (ticks.max(2) - 1) as f64 / rate_hz;
        Clock {
            axis: Axis::exact(start_s, end_s, LEFT, RIGHT),
            start_s,
            rate_hz,
        }
    }

    /// The abscissa of a tick.
    pub fn place(&self, tick: usize) -> f64 {
        self.axis.place(self.start_s + tick as f64 / self.rate_hz)
    }
}

/// The height of a panel with that many lines in its legend.
pub fn height(lines: usize, least: f64) -> f64 {
    least.max(lines as f64 * LEADING + 8.0)
}

/// The travel of a key or a port; `place` is the panel's upper edge and height, here and below.
pub fn travel(
    page: &mut Drawing,
    clock: &Clock,
    place: (f64, f64),
    (port, series): (Option<&str>, &Series),
) {
    let (name, unit, factor) = moved(port, series.unit);
    panel(
        page,
        clock,
        place,
        (&name, unit, factor),
        &[Line {
            series,
            colour: BLACK,
            width: 1.5,
        }],
    );
}

/// Force terms, over their total.
pub fn forces(
    page: &mut Drawing,
    clock: &Clock,
    place: (f64, f64),
    (port, terms, total): (Option<&str>, &[Series], Option<&Series>),
) {
    let total = total.into_iter().map(|series| Line {
        series,
        colour: BLACK,
        width: 2.2,
    });
    let terms = terms.iter().enumerate().map(|(i, series)| Line {
        series,
        colour: line_colour(i),
        width: 1.3,
    });
    let lines: Vec<Line> = total.chain(terms).collect();
    let (unit, factor) = shown(unit_of(&lines));
    panel(
        page,
        clock,
        place,
        (&felt(port, unit_of(&lines)), unit, factor),
        &lines,
    );
}

/// Coordinates and other values of one unit.
pub fn coordinates(page: &mut Drawing, clock: &Clock, place: (f64, f64), series: &[&Series]) {
    let line = |(i, series)| Line {
        series,
        colour: line_colour(i),
        width: 1.5,
    };
    let lines: Vec<Line> = series.iter().copied().enumerate().map(line).collect();
    let name = match lines.iter().all(|line| is_heard(line.series.name)) {
        true => "sound",
        false => quantity(unit_of(&lines)),
    };
    let (unit, factor) = shown(unit_of(&lines));
    panel(page, clock, place, (name, unit, factor), &lines);
}

/// Whether a value of this name is a channel of the sound.
fn is_heard(name: &str) -> bool {
    ["sound", "channel left", "channel right"].contains(&name)
}

/// What has a unit; where several have it, what is most likely beside a key.
fn quantity(unit: &str) -> &'static str {
    match unit {
        "" => "number",
        "rad" => "angle",
        "rad_per_s" => "angular rate",
        "m" => "position",
        "per_s" => "frequency",
        "n_m" => "torque",
        _ => {
            let dim = unit_of_suffix(unit).map(|unit| unit.dim);
            let name = dim.and_then(Dim::name);
            name.filter(|name| !name.contains('_')).unwrap_or("value")
        }
    }
}

fn unit_of<'a>(lines: &[Line<'a>]) -> &'a str {
    lines.first().map_or("", |line| line.series.unit)
}

/// A panel of lines; what they are, their unit as shown, and the factor from SI.
fn panel(
    page: &mut Drawing,
    clock: &Clock,
    (top, height): (f64, f64),
    (name, unit, factor): (&str, String, f64),
    lines: &[Line],
) {
    let bottom = top + height;
    let y = Axis::around(lines.iter().map(|l| l.series.record), bottom, top).in_units(factor);
    upright_grid(page, &clock.axis, top, bottom);
    level_grid(page, &y, top, heading(name, &unit));
    for (
        i,
        Line {
            series,
            colour,
            width,
        },
    ) in lines.iter().enumerate()
    {
        let row = top + 6.0 + i as f64 * LEADING;
        if lines.len() > 1 && series.record.points().all(|p| p.1 == 0.0) {
            legend(page, row, &format!("{} (zero)", series.name), None, *width);
            continue;
        }
        for points in line(series.record.points(), |tick| clock.place(tick), &y) {
            page.line(points, *colour, *width);
        }
        legend(page, row, series.name, Some(*colour), *width);
    }
    page.line(vec![(LEFT, top), (LEFT, bottom)], GREY, 0.8);
}

/// Room for the heading of the uppermost panel, beside which the labels of marks stand.
const HEADING_ROOM: f64 = 90.0;

/// Marks from `top` to `bottom`, labelled above as far as there is room.
pub fn marks(
    page: &mut Drawing,
    clock: &Clock,
    (top, bottom): (f64, f64),
    name: &str,
    marks: &[Mark],
) {
    let (mut line_from, mut label_from) = (f64::NEG_INFINITY, LEFT + HEADING_ROOM);
    for mark in marks {
        let (x, half) = (
            clock.axis.place(mark.t_s),
            font::width(&mark.label, TEXT) / 2.0,
        );
        if !(LEFT..=RIGHT).contains(&x) {
            continue;
        }
        if x >= line_from {
            page.line(vec![(x, top), (x, bottom)], MARK, 0.8);
            line_from = x + 1.0;
        }
        if x - half >= label_from {
            page.text(
                (x, top - 4.0),
                Anchor::Middle,
                TEXT,
                DARK,
                mark.label.clone(),
            );
            label_from = x + half + 5.0;
        }
    }
    if !marks.is_empty() {
        page.line(
            vec![(LEGEND + 8.0, top - 19.0), (LEGEND + 8.0, top - 7.0)],
            MARK,
            0.8,
        );
        page.text((LEGEND + 22.0, top - 9.0), Anchor::Start, TEXT, DARK, name);
    }
}
