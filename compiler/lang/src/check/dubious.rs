//! Units that fit by dimension and are surely not meant: a frequency for an angular rate, turns for
//! radians, joules for a torque, kilograms for a hammer.

use super::elaborate::Elaborator;
use crate::diag::{Code, Diagnostic};
use crate::syntax::ast::{Expr, ExprKind, Number, RangeExpr};
use crate::units::parse_unit;

/// What kind of thing a place asks for, beyond its dimension.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum DoubtKind {
    /// rad
    Angle,
    /// rad/s
    AngularRate,
    /// N*m
    Torque,
    /// What a key moves: grams.
    Mass,
}

impl DoubtKind {
    /// The kind that the name of a type says; most names say no more than their dimension.
    pub fn of_type(name: &str) -> Option<DoubtKind> {
        [
            ("angle", DoubtKind::Angle),
            ("angular_rate", DoubtKind::AngularRate),
            ("torque", DoubtKind::Torque),
        ]
        .into_iter()
        .find_map(|(n, kind)| (n == name).then_some(kind))
    }
}

/// A full turn (rad): angles beyond it are written in degrees by mistake for radians.
const TURN_RAD: f64 = std::f64::consts::TAU;

/// Nothing that a finger moves weighs more (kg).
const HEAVY_KG: f64 = 5.0;

impl Elaborator<'_, '_> {
    /// Looks at both ends of a range.
    pub fn doubt_range(&mut self, range: &RangeExpr, kind: DoubtKind) {
        self.doubt(&range.low, kind);
        self.doubt(&range.high, kind);
    }

    /// Warns of a number whose unit fits the place and is surely not meant.
    pub fn doubt(&mut self, expr: &Expr, kind: DoubtKind) {
        let (number, sign) = match &expr.kind {
            ExprKind::Number(number) => (number, ""),
            ExprKind::Neg(inner) => match &inner.kind {
                ExprKind::Number(number) => (number, "-"),
                _ => return,
            },
            _ => return,
        };
        let Some((message, instead)) = doubted(number, kind) else {
            return;
        };
        let written = format!(
            "{sign}{}{}",
            number.text,
            number
                .unit
                .as_ref()
                .map_or(String::new(), |u| format!(" {u}"))
        );
        let message = format!("`{written}` {message}");
        let hint = format!("did you mean `{sign}{instead}`?");
        let diagnostic =
            Diagnostic::new(Code::DubiousUnit, expr.span, message, "surely another unit");
        self.report(diagnostic.hint(crate::diag::Advice::instead(
            hint,
            format!("{sign}{instead}"),
        )));
    }
}

/// Why a number is doubted, and what is likely meant.
fn doubted(number: &Number, kind: DoubtKind) -> Option<(&'static str, String)> {
    let unit = number.unit.as_deref().unwrap_or_default();
    let digits = &number.text;
    match kind {
        DoubtKind::AngularRate if unit.ends_with("Hz") && number.value != 0.0 => Some((
            "is a frequency where an angular rate is due: 1 Hz counts as 1 rad/s here, not as one turn per second",
            format!(
                "{digits} {}",
                unit.replace("MHz", "rad/us")
                    .replace("kHz", "rad/ms")
                    .replace("Hz", "rad/s")
            ),
        )),
        DoubtKind::Torque if unit.ends_with('J') && number.value != 0.0 => {
            let newton = if unit == "mJ" { "mN*m" } else { "N*m" };
            Some((
                "is an energy where a torque is due",
                format!("{digits} {newton}"),
            ))
        }
        DoubtKind::Angle if unit.is_empty() && number.value > TURN_RAD => Some((
            "is an angle of more than a turn: without a unit it is in radians",
            format!("{digits} deg"),
        )),
        DoubtKind::Mass if unit == "kg" && parse_unit(unit)?.to_si(number.value) > HEAVY_KG => {
            Some(("is more than a finger moves", format!("{digits} g")))
        }
        _ => None,
    }
}
