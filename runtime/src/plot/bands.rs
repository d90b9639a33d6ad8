//! The panel of states: one row per machine, one band per visit.

use super::Machine;
use super::decimate::{changes, runs};
use super::drawing::{Anchor, Drawing};
use super::font;
use super::frame::{
    BLACK, DARK, HEADING, LEFT, LEGEND, TEXT, WIDTH, band_colour, shortened, upright_grid,
};
use super::time::Clock;

/// Height of a band.
const BAND: f64 = 22.0;
/// Distance of the lines of a row's legend.
const LINE: f64 = 14.0;

/// The height of the panel.
pub fn height(machines: &[Machine]) -> f64 {
    machines.iter().map(row_height).sum()
}

fn row_height(machine: &Machine) -> f64 {
    (BAND + 8.0).max((1.0 + keys(machine).last().map_or(0.0, |k| k.1 + 1.0)) * LINE + 6.0)
}

/// The panel, from `top` down.
pub fn draw(page: &mut Drawing, clock: &Clock, top: f64, machines: &[Machine]) {
    page.text((LEFT, top - 7.0), Anchor::Start, HEADING, BLACK, "states");
    upright_grid(page, &clock.axis, top, top + height(machines));
    let mut y = top;
    for machine in machines {
        row(page, clock, y, machine);
        y += row_height(machine);
    }
}

fn row(page: &mut Drawing, clock: &Clock, top: f64, machine: &Machine) {
    let states = machine.states.len();
    let changes = changes(machine.record.points(), states);
    let length = (machine.record.ticks(), states);
    for (from, to, state) in runs(&changes, length, |tick| clock.place(tick)) {
        page.rect(
            (from, top + 2.0),
            (to, top + 2.0 + BAND),
            band_colour(state),
        );
        let name = &machine.states[state];
        if font::width(name, TEXT) + 10.0 <= to - from {
            page.text(
                ((from + to) / 2.0, top + 17.0),
                Anchor::Middle,
                TEXT,
                BLACK,
                name,
            );
        }
    }
    page.text(
        (LEGEND, top + 12.0),
        Anchor::Start,
        TEXT,
        BLACK,
        shortened(machine.name, WIDTH - LEGEND - 6.0),
    );
    for ((x, line), (i, name)) in keys(machine)
        .into_iter()
        .zip(machine.states.iter().enumerate())
    {
        let baseline = top + 12.0 + (1.0 + line) * LINE;
        page.rect(
            (x, baseline - 8.0),
            (x + 9.0, baseline + 1.0),
            band_colour(i),
        );
        page.text(
            (x + 13.0, baseline),
            Anchor::Start,
            TEXT,
            DARK,
            shortened(name, WIDTH - x - 19.0),
        );
    }
}

/// Where the names of the states stand in the legend: abscissa and line, wrapped at the edge of the
/// page.
fn keys(machine: &Machine) -> Vec<(f64, f64)> {
    let (mut x, mut line) = (LEGEND, 0.0);
    let mut places = Vec::with_capacity(machine.states.len());
    for name in machine.states {
        let width = 13.0 + font::width(name, TEXT) + 10.0;
        if x > LEGEND && x + width > WIDTH {
            (x, line) = (LEGEND, line + 1.0);
        }
        places.push((x, line));
        x += width;
    }
    places
}
