//! Expressions.

use super::Name;
use whippen_source::Span;

/// An expression.
#[derive(Debug, Clone, PartialEq)]
pub struct Expr {
    /// What it is.
    pub kind: ExprKind,
    /// Where it stands.
    pub span: Span,
}

/// The kinds of expression.
#[derive(Debug, Clone, PartialEq)]
pub enum ExprKind {
    /// A number with or without a unit.
    Number(Number),
    /// `on` or `off`.
    Bool(bool),
    /// A name.
    Name(String),
    /// `base.field`: a result of a term.
    Field(Box<Expr>, Name),
    /// `bank[index]`: a member of a bank.
    Member(Box<Expr>, Box<Expr>),
    /// `callee(a, b, name: c)`: a term, or `min`, `max`, `clamp`, `abs`.
    Call(Name, Vec<Arg>),
    /// `e'`
    Prime(Box<Expr>),
    /// `-e`
    Neg(Box<Expr>),
    /// `not e`
    Not(Box<Expr>),
    /// `a op b`
    Binary(BinOp, Box<Expr>, Box<Expr>),
    /// `machine is state` (`negated`: `machine is not state`)
    Is {
        /// The machine.
        machine: Name,
        /// The state asked for.
        state: Name,
        /// Whether `not` stands before it.
        negated: bool,
    },
    /// `if c then a else b`
    If(Box<Expr>, Box<Expr>, Box<Expr>),
    /// Something that could not be read; a diagnostic has been given already.
    Error,
}

/// An argument of a call.
#[derive(Debug, Clone, PartialEq)]
pub struct Arg {
    /// The parameter's name, where it is given.
    pub name: Option<Name>,
    /// Its value.
    pub value: Expr,
}

/// A number as written.
#[derive(Debug, Clone, PartialEq)]
pub struct Number {
    /// The digits as written (`8e3`).
    pub text: String,
    /// Their value, in the unit as written.
    pub value: f64,
    /// The unit as written (`N*s/m`), if any.
    pub unit: Option<String>,
}

/// Binary operators.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum BinOp {
    /// `+`
    Add,
    /// `-`
    Sub,
    /// `*`
    Mul,
    /// `/`
    Div,
    /// `^`
    Pow,
    /// `<`
    Lt,
    /// `<=`
    Le,
    /// `>`
    Gt,
    /// `>=`
    Ge,
    /// `and`
    And,
    /// `or`
    Or,
}
