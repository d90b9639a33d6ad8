//! The unit of a parameter's values, as its text has it: one dimension may have several (a rate of
//! turning, a frequency), and only the text says which is meant.

use super::param::ParamText;
use crate::syntax::ast::{Expr, ExprKind};
use crate::units::{Dim, parse_unit, si_unit};

/// The unit in SI that the ends of its range or its value are written in; where neither has a
/// number of its own, that of its dimension, of which nothing is known to turn.
pub fn unit_of_text(text: &ParamText, dim: Dim) -> String {
    let ends = text.range.map(|range| [&range.low, &range.high]);
    let mut all = ends.into_iter().flatten().chain([text.value]);
    let found = all.find_map(|expr| written(expr, dim));
    found.map_or_else(|| dim.unit_without_angle(), si_unit)
}

/// The first unit of a dimension that is written in an expression.
fn written(expr: &Expr, dim: Dim) -> Option<&str> {
    match &expr.kind {
        ExprKind::Number(number) => {
            let unit = number.unit.as_deref()?;
            (parse_unit(unit)?.dim == dim).then_some(unit)
        }
        ExprKind::Neg(inner) => written(inner, dim),
        ExprKind::Binary(_, a, b) | ExprKind::If(_, a, b) => {
            written(a, dim).or_else(|| written(b, dim))
        }
        ExprKind::Call(_, args) => args.iter().find_map(|arg| written(&arg.value, dim)),
        _ => None,
    }
}
