//! The panel of force over travel: pressing and returning in two colours.

use super::axis::Axis;
use super::decimate::path;
use super::drawing::{Anchor, Colour, Drawing};
use super::frame::{
    DARK, GREY, LEADING, LEFT, MARK, RIGHT, TEXT, abscissa, felt, heading, legend, level_grid,
    moved, shown, upright_grid,
};
use super::time::Clock;
use super::{Place, Series};
use crate::measured_loop::{MeasuredLoop, Point};
use crate::record::Record;

/// Turns smaller than this part of the whole travel are taken for noise.
const TURN: f64 = 0.02;
/// Two colours of Paul Tol's "vibrant" scheme.
const PRESS: Colour = 0x00_77_bb;
const RETURN: Colour = 0xee_77_33;
/// The same, light, for what was measured.
const PRESS_MEASURED: Colour = 0xa6_d3_ee;
const RETURN_MEASURED: Colour = 0xf9_d2_b8;

/// The panel, without the labels of its abscissa, which stand below it.
/// Of a long run it shows the first ticks, as many as were kept one by one: a loop through fewer
/// points would show ways that the key never took.
pub fn draw(
    page: &mut Drawing,
    (top, height): (f64, f64),
    clock: &Clock,
    (port, travel, force): (Option<&str>, &Series, &Series),
    (places, measured): (&[Place], Option<&MeasuredLoop>),
) {
    let is_whole = travel.record.values().is_some();
    let seconds = (!is_whole).then(|| travel.record.head().len() as f64 / clock.rate_hz);
    let bottom = top + height;
    let ((moved, x_unit, x_factor), (y_unit, y_factor)) =
        (moved(port, travel.unit), shown(force.unit));
    let beside = measured.map(both_ways);
    let [xs, ys] = [0, 1].map(|at| beside.iter().map(move |records| &records[at]));
    let x = Axis::around(xs.chain([travel.record]), LEFT, RIGHT).in_units(x_factor);
    let y = Axis::around(ys.chain([force.record]), bottom, top).in_units(y_factor);
    upright_grid(page, &x, top, bottom);
    level_grid(
        page,
        &y,
        top,
        heading(&over(port, force.unit, seconds), &y_unit),
    );
    for (number, place) in places.iter().enumerate() {
        // Neighbours are labelled in three rows.
        let (at, row) = (x.place(place.at), 10.0 + LEADING * (number % 3) as f64);
        page.line(vec![(at, top), (at, bottom)], MARK, 0.8);
        page.text(
            (at + 3.0, top + row),
            Anchor::Start,
            TEXT,
            DARK,
            place.label.as_str(),
        );
    }
    if let Some(measured) = measured {
        draw_measured(page, top, (&x, &y), measured);
    }
    let (ways, pushes) = (travel.record.head(), force.record.head());
    let turns = turns(ways);
    for (downward, colour) in [(true, PRESS), (false, RETURN)] {
        // Between stretches of this direction the pen is lifted.
        let points = stretches(&turns, ways.len())
            .filter(|s| s.2 == downward)
            .flat_map(|(from, to, _)| {
                let points = ways[from..to].iter().zip(pushes.iter().skip(from));
                points
                    .map(|(u, v)| (x.place(*u), y.place(*v)))
                    .chain([(f64::NAN, f64::NAN)])
            });
        for points in path(points) {
            page.line(points, colour, 1.4);
        }
    }
    let (there, back) = both_directions(port, travel.unit);
    legend(page, top + 6.0, there, Some(PRESS), 1.4);
    legend(page, top + 6.0 + LEADING, back, Some(RETURN), 1.4);
    page.line(vec![(LEFT, top), (LEFT, bottom)], GREY, 0.8);
    abscissa(page, &x, bottom, heading(&moved, &x_unit));
}

/// What both directions are called.
fn both_directions(port: Option<&str>, unit: &str) -> (&'static str, &'static str) {
    match (unit, port) {
        ("rad", _) => ("right", "left"),
        (_, None) => ("press", "return"),
        (_, Some(_)) => ("forth", "back"),
    }
}

/// What was measured, with its lines in the legend below those of the run.
fn draw_measured(page: &mut Drawing, top: f64, (x, y): (&Axis, &Axis), measured: &MeasuredLoop) {
    let mut branch = |points: &[Point], colour, row, name| {
        let place = |(at, force): &Point| (x.place(*at), y.place(*force));
        page.line(points.iter().map(place).collect(), colour, 4.0);
        legend(page, top + 6.0 + row * LEADING, name, Some(colour), 4.0);
    };
    branch(&measured.press, PRESS_MEASURED, 2.0, "measured press");
    branch(&measured.back, RETURN_MEASURED, 3.0, "measured return");
}

/// Places and forces of both branches, for the axes.
fn both_ways(measured: &MeasuredLoop) -> [Record; 2] {
    let mut records = [Record::whole(), Record::whole()];
    for (place, force) in measured.points() {
        records[0].push(*place);
        records[1].push(*force);
    }
    records
}

/// The heading: `force at the key over its travel`, `torque over the angle`; of a long run `in the
/// first 11.9 s`.
fn over(port: Option<&str>, unit: &str, first_s: Option<f64>) -> String {
    let way = match (unit, port) {
        ("n_m", _) => "the angle",
        (_, None) => "its travel",
        (_, Some(_)) => "its position",
    };
    let part = first_s.map_or(String::new(), |s| format!(" in the first {s:.1} s"));
    format!("{} over {way}{part}", felt(port, unit))
}

/// The stretches of a way: first tick, one past the last, and whether it goes down.
pub fn stretches_of(travel: &[f64]) -> Vec<(usize, usize, bool)> {
    stretches(&turns(travel), travel.len()).collect()
}

/// The stretches between turns: first tick, one past the last (the turn belongs to both), and
/// whether the key goes down.
fn stretches(turns: &[(usize, bool)], ticks: usize) -> impl Iterator<Item = (usize, usize, bool)> {
    let ends = turns.iter().skip(1).map(|t| t.0 + 1).chain([ticks]);
    turns
        .iter()
        .zip(ends)
        .map(|((from, downward), end)| (*from, end, *downward))
}

/// The ticks at which a new direction begins, and whether it is downward (to greater travel). The
/// first is tick 0.
fn turns(travel: &[f64]) -> Vec<(usize, bool)> {
    let finite = || travel.iter().copied().filter(|x| x.is_finite());
    let (Some(low), Some(high)) = (finite().reduce(f64::min), finite().reduce(f64::max)) else {
        return Vec::new();
    };
    let least = (high - low) * TURN;
    let mut turns = vec![(0, true)];
    let (mut extreme, mut at) = (travel[0], 0);
    for (tick, &now) in travel.iter().enumerate() {
        let downward = turns[turns.len() - 1].1;
        let onward = if downward {
            now - extreme
        } else {
            extreme - now
        };
        if onward >= 0.0 || extreme.is_nan() {
            (extreme, at) = (now, tick);
        } else if -onward > least {
            turns.push((at, !downward));
            (extreme, at) = (now, tick);
        }
    }
    turns
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn turns_are_found_in_noise() {
        let strokes = crate::gesture::Gesture::new()
            .repeated(0.1, 5.0, 3, 0.010)
            .positions(10_000);
        let noisy: Vec<f64> = strokes
            .iter()
            .enumerate()
            .map(|(i, x)| x + 5e-5 * f64::from((i % 3) as u8))
            .collect();
        let turns = turns(&noisy);
        assert_eq!(
            turns.iter().map(|t| t.1).collect::<Vec<_>>(),
            [true, false, true, false, true, false]
        );
        let covered: usize = stretches(&turns, noisy.len())
            .map(|(from, to, _)| to - from)
            .sum();
        assert_eq!(covered, noisy.len() + turns.len() - 1);
    }

    #[test]
    fn data_without_motion_has_no_turns() {
        assert_eq!(turns(&[]), []);
        assert_eq!(turns(&[f64::NAN; 3]), []);
        assert_eq!(turns(&[1.0; 3]), [(0, true)]);
        assert_eq!(turns(&[f64::NAN, 1.0, 0.0]), [(0, true), (1, false)]);
    }
}
