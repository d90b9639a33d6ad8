//! What a place needs and what stands there: types asked for, and messages that name both and a way
//! from one to the other.

use super::elaborate::Elaborator;
use super::types::{Ty, Value};
use crate::diag::{Advice, Code, Diagnostic, nearest};
use crate::model::{Node, NodeId};
use crate::syntax::ast::{Expr, ExprKind, Name};
use crate::units::{Dim, Unit, dimension, dimension_names, parse_unit, usual_unit};

/// What is said of an angle where a way is needed.
const ROTARY: &str =
    "terms of the library for what turns begin with `rotary_`, such as `rotary_detents`";

/// So many operators deep a value is followed to what is declared.
const REACH_DEPTH: u32 = 8;

impl Elaborator<'_, '_> {
    /// The node of a value that must have a type.
    pub fn expect(
        &mut self,
        value: Value,
        expr: &Expr,
        wanted: Ty,
        what: impl FnOnce() -> String,
    ) -> Option<NodeId> {
        if value.ty == wanted {
            return Some(value.node);
        }
        let what = what();
        if bare_number(expr).is_some() && wanted != Ty::Bool {
            self.missing_unit(expr, wanted, &what, None);
            return None;
        }
        let message = format!(
            "{what} must be {}, not {}",
            wanted.words(),
            value.ty.words()
        );
        let diagnostic = Diagnostic::new(
            Code::WrongType,
            expr.span,
            message,
            format!("this is {}", value.ty.words()),
        );
        let hint = match self.is_sensed_angle(value.node) && wanted == Ty::Real(Dim::LENGTH) {
            true => Some(ROTARY.to_string()),
            false => conversion(value.ty, wanted),
        };
        self.report(diagnostic.hint(hint.unwrap_or_else(|| LOOK_AT_UNITS.to_string())));
        None
    }

    /// Reports a number without unit where a dimension is needed; `reach` is how large what it
    /// stands beside can be (SI), if that is declared.
    fn missing_unit(&mut self, expr: &Expr, wanted: Ty, what: &str, reach: Option<f64>) {
        let number = bare_number(expr).unwrap_or_default();
        let size = number.parse().map_or(0.0, f64::abs);
        let unit = wanted.dim().map(|dim| usual_unit(size, dim, reach));
        let message = format!(
            "{what} must be {}, and `{number}` has no unit",
            wanted.words()
        );
        let hint = match wanted.dim() == Some(Dim::PER_TIME) {
            true => format!(
                "write it with a unit, such as `{number} Hz` for a frequency or a pitch, `{number} rad/s` for a rate"
            ),
            false => format!(
                "write it with a unit, such as `{number} {}`",
                unit.unwrap_or_default()
            ),
        };
        let diagnostic = Diagnostic::new(Code::MissingUnit, expr.span, message, "a plain number");
        self.report(diagnostic.hint(hint));
    }

    /// Whether a value is an angle that is sensed.
    fn is_sensed_angle(&self, node: NodeId) -> bool {
        match self.model.dag.get(node) {
            Node::Sense(sense) => self.model.senses[*sense as usize].dim.is_number(),
            _ => false,
        }
    }

    /// How large a value can be by what is declared (SI), as far as sums and choices say so.
    fn reach(&self, node: NodeId, depth: u32) -> Option<f64> {
        let model = &self.model;
        let part = |node| self.reach(node, depth.checked_sub(1)?);
        match *model.dag.get(node) {
            Node::Sense(sense) => Some(model.senses[sense as usize].range.magnitude()),
            Node::Live(live) => Some(model.lives[live as usize].range.magnitude()),
            Node::Keyed(keyed) => Some(model.keyed[keyed as usize].range.magnitude()),
            Node::Cell(cell) => Some(model.cells[cell].range.magnitude()),
            Node::Add(a, b) | Node::Sub(a, b) => Some(part(a)? + part(b)?),
            Node::Min(a, b) | Node::Max(a, b) => Some(part(a)?.max(part(b)?)),
            Node::Neg(a) | Node::Abs(a) => part(a),
            _ => model.dag.real(node).map(f64::abs),
        }
    }

    /// Reports two operands that do not go together; `problem` says so of their kinds.
    pub fn mismatch(
        &mut self,
        problem: impl FnOnce(&str, &str) -> String,
        a: (&Expr, Value),
        b: (&Expr, Value),
    ) {
        let (first, second) = (a.1.ty, b.1.ty);
        if let Some(hint) = exponent(a.0, b.0) {
            let message = problem(&first.words(), &second.words());
            let span = a.0.span.to(b.0.span);
            self.report(Diagnostic::new(Code::Mismatch, span, message, "a difference").hint(hint));
            return;
        }
        for (bare, other) in [(a.0, b.1), (b.0, a.1)] {
            if bare_number(bare).is_some() && other.ty != Ty::Bool {
                self.missing_unit(bare, other.ty, "this", self.reach(other.node, REACH_DEPTH));
                return;
            }
        }
        let message = problem(&first.words(), &second.words());
        let hint = conversion(second, first).or_else(|| conversion(first, second));
        self.report(
            Diagnostic::new(Code::Mismatch, b.0.span, message, second.words())
                .also(a.0.span, first.words())
                .hint(hint.unwrap_or_else(|| LOOK_AT_UNITS.to_string())),
        );
    }

    /// The type of that name.
    pub fn any_type(&mut self, ty: &Name) -> Option<Ty> {
        if ty.node == "bool" {
            return Some(Ty::Bool);
        }
        if let Some(dim) = dimension(&ty.node) {
            return Some(Ty::Real(dim));
        }
        if let Some(unit) = type_as_unit(&ty.node) {
            return self.dimension_of_unit(ty, unit);
        }
        let hint = match nearest(&ty.node, dimension_names().chain(["bool"])) {
            Some(near) => Advice::did_you_mean(near),
            None => {
                "types are `bool` and the names of dimensions, such as `length` or `force`".into()
            }
        };
        let message = format!("`{}` is not a type", ty.node);
        self.report(
            Diagnostic::new(Code::UnknownType, ty.span, message, "unknown type").hint(hint),
        );
        None
    }

    /// The type that is written as a unit, which must be one of SI: a type has no size.
    fn dimension_of_unit(&mut self, ty: &Name, unit: Unit) -> Option<Ty> {
        if unit.to_si(1.0) == 1.0 {
            return Some(Ty::Real(unit.dim));
        }
        let meant = Ty::Real(unit.dim).unit();
        let message = format!("`{}` says a size, and a type is a dimension alone", ty.node);
        let hint = Advice::instead(format!("write it in SI units: `{meant}`"), meant);
        let label = "a unit with a prefix or a factor";
        self.report(Diagnostic::new(Code::UnknownType, ty.span, message, label).hint(hint));
        None
    }

    /// The dimension of that name; `what` cannot be a bool.
    pub fn real_type(&mut self, ty: &Name, what: &str, hint: &str) -> Option<Dim> {
        let found = self.any_type(ty)?;
        if found == Ty::Bool {
            let message = format!("{what} cannot be a bool");
            self.report(
                Diagnostic::new(Code::WrongType, ty.span, message, "a number is needed").hint(hint),
            );
        }
        found.dim()
    }
}

/// The unit that a type is written as, if it is written as a product or quotient of units.
fn type_as_unit(text: &str) -> Option<Unit> {
    let text: String = text.split_whitespace().collect();
    if !text.contains(['*', '/', '^']) {
        return None;
    }
    match text.strip_prefix("1/") {
        // What is divided by comes behind the first factor of a unit.
        Some(divisors) => {
            let over = parse_unit(&format!("s/{divisors}"))?;
            Some(over.times(parse_unit("s^-1")?))
        }
        None => parse_unit(&text),
    }
}

const LOOK_AT_UNITS: &str = "look at the units of everything it is made of";

/// How one type becomes another, where this can be said in few words.
fn conversion(found: Ty, wanted: Ty) -> Option<String> {
    let words = |dim| Ty::Real(dim).words();
    match (found, wanted) {
        // Touch weights are told in grams.
        (Ty::Real(Dim::MASS), Ty::Real(Dim::FORCE)) => Some(
            "a gram is a mass; the force with which it weighs is the unit `gf`, as in `50 gf`, \
             or the mass times `gravity`"
                .to_string(),
        ),
        (Ty::Bool, Ty::Bool) => None,
        (Ty::Bool, Ty::Real(_)) => {
            Some("choose numbers by the bool: `if .. then .. else ..`".to_string())
        }
        (Ty::Real(_), Ty::Bool) => Some("compare it: `.. > ..`".to_string()),
        (Ty::Real(found), Ty::Real(wanted)) => {
            let (factor, divisor) = (wanted.div(found), found.div(wanted));
            if factor == Dim::PER_TIME {
                Some(format!(
                    "the prime of {} is {}",
                    words(found),
                    words(wanted)
                ))
            } else if wanted.is_number() || (divisor.name().is_some() && factor.name().is_none()) {
                Some(format!(
                    "{} divided by {} is {}",
                    words(found),
                    words(divisor),
                    words(wanted)
                ))
            } else if factor.name().is_some() {
                Some(format!(
                    "{} times {} is {}",
                    words(found),
                    words(factor),
                    words(wanted)
                ))
            } else {
                None
            }
        }
    }
}

/// Where a unit's exponent was written without its sign (`1 ms-1`), how it is written.
fn exponent(left: &Expr, right: &Expr) -> Option<String> {
    let (ExprKind::Number(left_number), ExprKind::Number(right_number)) = (&left.kind, &right.kind)
    else {
        return None;
    };
    let unit = left_number.unit.as_ref()?;
    let touches = right.span.start == left.span.end + 1 && right_number.unit.is_none();
    touches.then(|| {
        format!(
            "a unit's exponent has a `^`, and units are joined by `*` and `/`: \
             `{unit}^-{}`, `m/s`, `m*s^-1`",
            right_number.text
        )
    })
}

/// The digits of a number that is written without unit, also behind a minus.
pub fn bare_number(expr: &Expr) -> Option<String> {
    match &expr.kind {
        ExprKind::Number(number) if number.unit.is_none() => Some(number.text.clone()),
        ExprKind::Neg(inner) => match &inner.kind {
            ExprKind::Number(number) if number.unit.is_none() => Some(format!("-{}", number.text)),
            _ => None,
        },
        _ => None,
    }
}
