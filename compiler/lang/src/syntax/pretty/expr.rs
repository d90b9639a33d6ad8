//! Prints expressions with no more round brackets than the grammar needs.

use std::fmt;

use crate::syntax::ast::*;

/// How tightly an expression holds together; the rules of the grammar, from the loosest.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Tightness {
    If,
    Or,
    And,
    Not,
    Comparison,
    Sum,
    Product,
    Unary,
    Power,
    Postfix,
}

/// An expression as it is written.
pub(super) struct Shown<'a>(pub &'a Expr);

impl fmt::Display for Shown<'_> {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match &self.0.kind {
            ExprKind::Number(Number {
                text,
                unit: Some(unit),
                ..
            }) => write!(f, "{text} {unit}"),
            ExprKind::Number(number) => f.write_str(&number.text),
            ExprKind::Bool(on) => f.write_str(if *on { "on" } else { "off" }),
            ExprKind::Name(name) => f.write_str(name),
            ExprKind::Field(base, field) => {
                write!(f, "{}.{}", Within(Tightness::Postfix, base), field.node)
            }
            ExprKind::Member(bank, index) => {
                write!(f, "{}[{}]", Within(Tightness::Postfix, bank), Shown(index))
            }
            ExprKind::Call(callee, args) => write!(f, "{}({})", callee.node, list(args, arg)),
            ExprKind::Prime(base) => write!(f, "{}'", Within(Tightness::Postfix, base)),
            ExprKind::Neg(operand) => write!(f, "-{}", Within(Tightness::Unary, operand)),
            ExprKind::Not(operand) => write!(f, "not {}", Within(Tightness::Not, operand)),
            ExprKind::Binary(op, a, b) => {
                let (sign, left, right) = binary(*op);
                write!(f, "{}{sign}{}", Within(left, a), Within(right, b))
            }
            ExprKind::Is {
                machine,
                state,
                negated,
            } => {
                write!(
                    f,
                    "{} is {}{}",
                    machine.node,
                    if *negated { "not " } else { "" },
                    state.node
                )
            }
            ExprKind::If(c, a, b) => {
                write!(f, "if {} then {} else {}", Shown(c), Shown(a), Shown(b))
            }
            ExprKind::Error => f.write_str("<error>"),
        }
    }
}

/// An expression in a place that takes only what is at least so tight.
struct Within<'a>(Tightness, &'a Expr);

impl fmt::Display for Within<'_> {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        if tightness(self.1) < self.0 {
            write!(f, "({})", Shown(self.1))
        } else {
            Shown(self.1).fmt(f)
        }
    }
}

fn tightness(expr: &Expr) -> Tightness {
    match &expr.kind {
        ExprKind::If(..) => Tightness::If,
        ExprKind::Binary(BinOp::Or, ..) => Tightness::Or,
        ExprKind::Binary(BinOp::And, ..) => Tightness::And,
        ExprKind::Not(_) => Tightness::Not,
        ExprKind::Binary(BinOp::Lt | BinOp::Le | BinOp::Gt | BinOp::Ge, ..)
        | ExprKind::Is { .. } => Tightness::Comparison,
        ExprKind::Binary(BinOp::Add | BinOp::Sub, ..) => Tightness::Sum,
        ExprKind::Binary(BinOp::Mul | BinOp::Div, ..) => Tightness::Product,
        ExprKind::Neg(_) => Tightness::Unary,
        // A number is bracketed before `.` and `'`, which would else seem to belong to it or to its
        // unit.
        ExprKind::Binary(BinOp::Pow, ..) | ExprKind::Number(_) => Tightness::Power,
        _ => Tightness::Postfix,
    }
}

/// Sign of an operator and how tight its sides must be.
fn binary(op: BinOp) -> (&'static str, Tightness, Tightness) {
    use Tightness::*;
    match op {
        BinOp::Or => (" or ", Or, And),
        BinOp::And => (" and ", And, Not),
        BinOp::Lt => (" < ", Sum, Sum),
        BinOp::Le => (" <= ", Sum, Sum),
        BinOp::Gt => (" > ", Sum, Sum),
        BinOp::Ge => (" >= ", Sum, Sum),
        BinOp::Add => (" + ", Sum, Product),
        BinOp::Sub => (" - ", Sum, Product),
        BinOp::Mul => (" * ", Product, Unary),
        BinOp::Div => (" / ", Product, Unary),
        BinOp::Pow => ("^", Postfix, Unary),
    }
}

fn arg(arg: &Arg) -> String {
    match &arg.name {
        Some(name) => format!("{}: {}", name.node, Shown(&arg.value)),
        None => Shown(&arg.value).to_string(),
    }
}

/// Things side by side with commas.
pub(super) fn list<T>(things: &[T], show: impl Fn(&T) -> String) -> String {
    things.iter().map(show).collect::<Vec<_>>().join(", ")
}
