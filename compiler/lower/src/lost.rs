//! Dead bands: changes of what is kept that may be too small for its last bit.
//!
//! An integer stays as it is only where what a tick adds is no more than what it rounds. Of what
//! goes part of the way to a target in every tick (a first-order lag), that is so within the
//! rounding over the part; of what adds up, while less than the rounding is added in a tick. A word
//! of a sensor or a drive has 16 bits, so it is a warning where the band is wider than a 65536th
//! part of what there is to follow or to add.
//!
//! Not here: how much is rounded (`update`), what it comes to over time (`recurrence`).

use super::gradient::gradients;
use super::paths::Path;
use super::update::{Update, Writer};
use crate::simplify::Step;
use whippen_lang::diag::{Code, Diagnostic};
use whippen_lang::model::{CellId, Interval, Model, Node, NodeId};
use whippen_lang::range::Ranges;
use whippen_lang::units::{Dim, shown};
use whippen_source::Span;

/// Parts of what there is to follow or to add that may be lost without a word: those of a 16-bit
/// word.
const PARTS: f64 = 65_536.0;

/// Changes that may be lost.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DeadBand {
    /// How wide it is to one side (SI): of a lag how far it may stay from where it goes, else what
    /// may be missed at a time.
    pub width: f64,
    /// Of a lag, the least part of the way that it goes in a tick.
    pub part: Option<f64>,
    /// How many times wider it is than a 65536th part of what there is to follow or to add.
    pub excess: f64,
}

/// Warns of the updates of a Model, as checked, that may be lost.
pub fn warnings(
    model: &Model,
    step: &Step,
    ranges: &Ranges,
    updates: &[Update],
) -> Vec<Diagnostic> {
    dead_bands(step, ranges, updates)
        .into_iter()
        .filter(|(_, band)| band.excess > 1.0)
        .map(|(update, band)| warning(model, update, band))
        .collect()
}

/// The dead band of every update that adds to what it replaces.
pub fn dead_bands<'u>(
    step: &Step,
    ranges: &Ranges,
    updates: &'u [Update],
) -> Vec<(&'u Update, DeadBand)> {
    let gradients = gradients(step, ranges);
    let widest = |update: &'u Update| {
        // What is lost is told from what is solved by nothing that is known.
        if update.error.is_infinite() {
            return None;
        }
        let paths = || update.paths.iter();
        let most = paths().filter_map(|path| added(step, ranges, update.cell, path));
        let most = most.fold(0.0, f64::max);
        let followed = paths().map(|path| path.followed).fold(0.0, f64::max);
        let of = |path: &Path| {
            let own = path.gradient(&gradients).get(&update.cell).copied()?;
            dead_band(path, own, most, followed)
        };
        let band = paths().filter_map(of);
        Some((update, band.max_by(|a, b| a.width.total_cmp(&b.width))?))
    };
    updates.iter().filter_map(widest).collect()
}

/// The dead band of what rounds, keeps the part `own` of itself, and adds as much as `added` to
/// that; none where nothing rounds, or nothing is added. What a lag follows may be wrong itself:
/// then it goes elsewhere, but it gets there. The bound of the error is that of all ways together,
/// so what is lost for sure is less than it by the most that one `followed`.
fn dead_band(path: &Path, own: Interval, added: f64, followed: f64) -> Option<DeadBand> {
    let part = 1.0 - own.magnitude();
    let part = (part > 0.0).then_some(part);
    let (lost, sure) = match part {
        Some(_) => (path.error - path.followed, path.error - followed),
        None => (path.error, path.error),
    };
    (lost > 0.0 && added > 0.0).then(|| DeadBand {
        width: part.map_or(lost, |part| lost / part),
        part,
        excess: sure * PARTS / added,
    })
}

/// By how much what is added to a cell varies, or, where it does not, how large it is. None of what
/// keeps nothing of the cell.
fn added(step: &Step, ranges: &Ranges, cell: CellId, path: &Path) -> Option<f64> {
    let is_own = |x: &NodeId| *step.model.dag.get(*x) == Node::Cell(cell);
    let (_, kept) = path.terms.iter().find(|(x, _)| is_own(x))?;
    if path.terms.len() > 1 {
        let others = path.terms.iter().filter(|(x, _)| !is_own(x));
        let width = others.map(|(x, c)| c.abs() * ranges.get(*x).width());
        return Some(width.sum());
    }
    let fading = (1.0 - kept).abs() * step.model.cells[cell].range.width();
    Some(if fading > 0.0 {
        fading
    } else {
        path.constant.abs()
    })
}

fn warning(model: &Model, update: &Update, band: DeadBand) -> Diagnostic {
    let cell = &model.cells[update.cell];
    let (name, per_second) = (&cell.name, f64::from(model.rate_hz));
    let every_tick = matches!(update.writer, Writer::Next | Writer::Motion);
    let width = shown(significant(band.width), cell.dim);
    let message = match band.part {
        Some(_) => format!("`{name}` may come to rest up to {width} from where it goes"),
        None if every_tick => {
            let slowest = significant(band.width * per_second);
            // A number a second would be told as an angle's rate.
            let slowest = match cell.dim {
                Dim::NUMBER => format!("{slowest} a second"),
                dim => shown(slowest, dim.div(Dim::TIME)),
            };
            format!("`{name}` may miss what adds less than {slowest} to it")
        }
        None => format!("`{name}` may miss what adds less than {width} to it"),
    };
    let lost = shown(significant(update.error), cell.dim);
    let label = format!("may lose up to {lost} at a time");
    let (span, calls) = place(model, update);
    let found = Diagnostic::new(Code::LostUpdate, span, message, label)
        .also(cell.span, "the range decides how fine its last bit is");
    let found = cures(model, update, band)
        .into_iter()
        .fold(found, Diagnostic::hint);
    calls
        .into_iter()
        .fold(found, |d, call| d.also(call, "in this call"))
}

/// What would bring the band down to a 65536th part.
fn cures(model: &Model, update: &Update, band: DeadBand) -> Vec<String> {
    let cell = &model.cells[update.cell];
    // Units change by up to two with what they count.
    let more = band.part.map(|part| (part, 2.1 * part * band.excess));
    let more = match more {
        Some((part, needed)) if needed < 0.5 => Some(format!(
            "let it go {} of the way in a tick, instead of {}",
            significant(needed),
            significant(part)
        )),
        None if update.writer != Writer::Motion => Some(format!(
            "add {} times as much, less often",
            significant(2.1 * band.excess)
        )),
        _ => None,
    };
    let narrow = shown(
        significant(0.5 * cell.range.width() / band.excess),
        cell.dim,
    );
    let range = format!(
        "a range of `{}` no wider than {narrow} would do too, if it needs no more",
        cell.name
    );
    more.into_iter().chain([range]).collect()
}

/// Three significant digits.
fn significant(value: f64) -> f64 {
    format!("{value:.2e}").parse().unwrap_or(value)
}

/// Where an update stands, and the calls around it.
fn place(model: &Model, update: &Update) -> (Span, Vec<Span>) {
    let declared = model.cells[update.cell].span;
    let body = |b: &&whippen_lang::model::Body| [b.rate, b.coordinate].contains(&update.cell);
    match update.writer {
        Writer::Write(span) | Writer::Fire(span) => (span, Vec::new()),
        Writer::Motion => {
            let body = model.bodies.iter().find(body);
            (body.map_or(declared, |b| b.span), Vec::new())
        }
        Writer::Next => {
            let next = model.nexts.iter().find(|(cell, _)| *cell == update.cell);
            let value = next.map(|(_, value)| *value);
            let span = value.and_then(|v| model.spans.get(v).copied().flatten());
            let calls = value.map(|v| model.calls_around(v).collect());
            (span.unwrap_or(declared), calls.unwrap_or_default())
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const fn slope(own: f64) -> Interval {
        Interval {
            low: own,
            high: own,
        }
    }

    fn rounding(error: f64) -> Path {
        Path {
            constant: 0.0,
            terms: std::collections::BTreeMap::new(),
            error,
            followed: 0.0,
        }
    }

    #[test]
    fn what_a_lag_follows_is_no_loss_of_its_own() {
        let path = Path {
            followed: 0.3,
            ..rounding(0.5)
        };
        let band = dead_band(&path, slope(0.75), 100.0, 0.4).expect("it rounds");
        assert!((band.width - 0.8).abs() < 1e-12);
        assert!((band.excess - 0.1 * PARTS / 100.0).abs() < 1e-9);
        let sum = dead_band(&path, slope(1.0), 100.0, 0.4).expect("it rounds");
        assert_eq!(sum.width, 0.5);
    }

    #[test]
    fn a_lag_stays_within_its_rounding_over_the_part_it_goes() {
        let band = dead_band(&rounding(0.5), slope(0.75), 100.0, 0.0).expect("it rounds");
        assert_eq!((band.width, band.part), (2.0, Some(0.25)));
        assert_eq!(band.excess, 0.5 * PARTS / 100.0);
    }

    #[test]
    fn what_adds_up_misses_what_is_less_than_its_rounding() {
        let band = dead_band(&rounding(0.5), slope(1.0), 100.0, 0.0).expect("it rounds");
        assert_eq!((band.width, band.part), (0.5, None));
    }

    #[test]
    fn what_does_not_round_or_adds_nothing_has_none() {
        assert_eq!(dead_band(&rounding(0.0), slope(1.0), 1.0, 0.0), None);
        assert_eq!(dead_band(&rounding(0.5), slope(1.0), 0.0, 0.0), None);
    }
}
