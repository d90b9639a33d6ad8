//! Values per key: linear in the note number between the given notes, constant beyond them.

use super::elaborate::Elaborator;
use super::types::Ty;
use crate::diag::{Code, Diagnostic};
use crate::model::Interval;
use crate::syntax::ast::Name;
use crate::units::Dim;
use whippen_keyboard::InstrumentId;
use whippen_source::Span;

/// A value at a note.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Point {
    /// MIDI number of the note.
    pub note: u8,
    /// The value (SI).
    pub value: f64,
    /// Its type.
    pub ty: Ty,
    /// Where it stands.
    pub span: Span,
}

/// `instrument.param = { A0: v, C8: v }`
#[derive(Debug, Clone)]
pub struct PerKey<'a> {
    /// The instrument.
    pub instrument: InstrumentId,
    /// Its parameter, as named in the keyboard.
    pub param: &'a Name,
    /// The given values by rising note; empty if one of them is in error.
    pub points: Vec<Point>,
}

impl Elaborator<'_, '_> {
    /// Fills in a parameter that the keyboard sets per key.
    pub fn fill_keyed(
        &mut self,
        index: usize,
        name: &str,
        dim: Dim,
        range: Option<(Interval, Span)>,
    ) -> Option<()> {
        let per_key = self.settings.per_key.get(name)?;
        let (points, span) = (per_key.points.clone(), per_key.param.span);
        let mut good = !points.is_empty();
        for point in &points {
            good &= self.check_point(point, name, dim, range);
        }
        if !good {
            return None;
        }
        let (first, last) = self.settings.keys;
        let values: Vec<f64> = (first..=last).map(|note| at(&points, note)).collect();
        let ends = values
            .iter()
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| {
                (l.min(*v), h.max(*v))
            });
        let keyed = &mut self.model.keyed[index];
        keyed.range = range.map_or(
            Interval {
                low: ends.0,
                high: ends.1,
            },
            |(range, _)| range,
        );
        (keyed.dim, keyed.values, keyed.span) = (dim, values, span);
        Some(())
    }

    fn check_point(
        &mut self,
        point: &Point,
        name: &str,
        dim: Dim,
        range: Option<(Interval, Span)>,
    ) -> bool {
        if point.ty == Ty::Real(dim) {
            return self
                .in_range(point.value, dim, point.span, range, name)
                .is_some();
        }
        let wanted = Ty::Real(dim);
        let message = format!("`{name}` is {}, not {}", wanted.words(), point.ty.words());
        let hint = if dim.is_number() {
            "write a plain number".to_string()
        } else {
            format!("write it in {dim}")
        };
        self.report(
            Diagnostic::new(Code::WrongType, point.span, message, point.ty.words()).hint(hint),
        );
        false
    }
}

/// The value at a note, from points by rising note.
fn at(points: &[Point], note: u8) -> f64 {
    let above = points.partition_point(|p| p.note < note);
    match (
        above.checked_sub(1).map(|below| points[below]),
        points.get(above),
    ) {
        (_, Some(exact)) if exact.note == note => exact.value,
        (Some(low), Some(high)) => {
            let part = f64::from(note - low.note) / f64::from(high.note - low.note);
            low.value + part * (high.value - low.value)
        }
        (Some(end), None) => end.value,
        (None, end) => end.map_or(0.0, |end| end.value),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn linear_between_and_constant_beyond() {
        let point = |note, value| Point {
            note,
            value,
            ty: Ty::Real(Dim::FORCE),
            span: Span::default(),
        };
        let points = [point(40, 1.0), point(44, 3.0), point(54, 3.5)];
        let values: Vec<f64> = [21, 40, 41, 43, 44, 49, 54, 108]
            .map(|n| at(&points, n))
            .to_vec();
        assert_eq!(values, [1.0, 1.0, 1.5, 2.5, 3.0, 3.25, 3.5, 3.5]);
    }
}
