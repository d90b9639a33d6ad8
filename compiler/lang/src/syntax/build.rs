//! What the actions of the grammar are made of: nodes with their places, expressions with their
//! depth, errors.

use lalrpop_util::ErrorRecovery;

use super::ast::*;
use super::token::{Literal, Token};
use crate::diag::{Code, Diagnostic};
use whippen_source::Span;

/// Expressions may be nested this deeply, so that every pass over the tree may recurse.
pub const DEEPEST: usize = 256;

/// A syntax error as the generated parser reports it.
pub(super) type Error<'s> = ErrorRecovery<u32, Token<'s>, &'static str>;

/// What the grammar's actions share.
pub(super) struct Build<'s> {
    pub file: u32,
    /// Syntax errors recovered from.
    pub errors: Vec<Error<'s>>,
    /// What the actions themselves found wrong.
    pub diagnostics: Vec<Diagnostic>,
}

/// An expression with the depth of its tree.
pub(super) struct Deep {
    expr: Expr,
    depth: usize,
}

impl From<Deep> for Expr {
    fn from(deep: Deep) -> Expr {
        deep.expr
    }
}

/// An argument before its depth is forgotten.
pub(super) type DeepArg = (Option<Name>, Deep);

impl<'s> Build<'s> {
    pub fn span(&self, start: u32, end: u32) -> Span {
        Span {
            file: self.file,
            start,
            end,
        }
    }

    pub fn name(&self, start: u32, text: &str, end: u32) -> Name {
        Spanned {
            node: text.to_string(),
            span: self.span(start, end),
        }
    }

    pub fn decl(&self, start: u32, kind: DeclKind, end: u32) -> Decl {
        Decl {
            kind,
            span: self.span(start, end),
        }
    }

    pub fn action(&self, start: u32, kind: ActionKind, end: u32) -> Action {
        Action {
            kind,
            span: self.span(start, end),
        }
    }

    pub fn range(&self, start: u32, low: Deep, high: Deep, end: u32) -> RangeExpr {
        RangeExpr {
            low: low.into(),
            high: high.into(),
            span: self.span(start, end),
        }
    }

    /// Keeps a syntax error for later.
    pub fn failed(&mut self, error: Error<'s>) {
        self.errors.push(error);
    }

    /// Keeps a syntax error and gives an expression for the place.
    pub fn failed_expr(&mut self, start: u32, error: Error<'s>, end: u32) -> Expr {
        self.errors.push(error);
        Expr {
            kind: ExprKind::Error,
            span: self.span(start, end),
        }
    }

    /// Keeps a syntax error and gives a range for the place.
    pub fn failed_range(&mut self, start: u32, error: Error<'s>, end: u32) -> RangeExpr {
        let low = self.failed_expr(start, error, end);
        RangeExpr {
            high: low.clone(),
            span: low.span,
            low,
        }
    }

    pub fn number(&self, start: u32, literal: Literal, end: u32) -> Deep {
        let unit = (!literal.unit.is_empty()).then(|| literal.unit.to_string());
        let value = literal.digits.parse().unwrap_or_default();
        let number = Number {
            text: literal.digits.to_string(),
            value,
            unit,
        };
        self.leaf(start, ExprKind::Number(number), end)
    }

    /// A number as it is written, with its unit if it has one.
    pub fn count(&self, start: u32, literal: Literal, end: u32) -> Name {
        let text = [literal.digits, literal.unit].join(" ");
        self.name(start, text.trim_end(), end)
    }

    pub fn leaf(&self, start: u32, kind: ExprKind, end: u32) -> Deep {
        Deep {
            expr: Expr {
                kind,
                span: self.span(start, end),
            },
            depth: 1,
        }
    }

    /// Makes round brackets part of the place of an expression.
    pub fn enclosed(&self, start: u32, mut inner: Deep, end: u32) -> Deep {
        inner.expr.span = self.span(start, end);
        inner
    }

    pub fn unary(
        &mut self,
        start: u32,
        kind: fn(Box<Expr>) -> ExprKind,
        inner: Deep,
        end: u32,
    ) -> Deep {
        let depth = inner.depth;
        self.deeper(start, kind(Box::new(inner.expr)), depth, end)
    }

    pub fn binary(&mut self, start: u32, op: BinOp, a: Deep, b: Deep, end: u32) -> Deep {
        let depth = a.depth.max(b.depth);
        self.deeper(
            start,
            ExprKind::Binary(op, Box::new(a.expr), Box::new(b.expr)),
            depth,
            end,
        )
    }

    pub fn conditional(&mut self, start: u32, c: Deep, a: Deep, b: Deep, end: u32) -> Deep {
        let depth = c.depth.max(a.depth).max(b.depth);
        self.deeper(
            start,
            ExprKind::If(Box::new(c.expr), Box::new(a.expr), Box::new(b.expr)),
            depth,
            end,
        )
    }

    pub fn field(&mut self, start: u32, base: Deep, field: Name, end: u32) -> Deep {
        let depth = base.depth;
        self.deeper(
            start,
            ExprKind::Field(Box::new(base.expr), field),
            depth,
            end,
        )
    }

    pub fn member(&mut self, start: u32, bank: Deep, index: Deep, end: u32) -> Deep {
        let depth = bank.depth.max(index.depth);
        self.deeper(
            start,
            ExprKind::Member(Box::new(bank.expr), Box::new(index.expr)),
            depth,
            end,
        )
    }

    pub fn call(&mut self, start: u32, callee: Name, args: Vec<DeepArg>, end: u32) -> Deep {
        let depth = args.iter().map(|(_, value)| value.depth).max().unwrap_or(0);
        let args = args
            .into_iter()
            .map(|(name, value)| Arg {
                name,
                value: value.expr,
            })
            .collect();
        self.deeper(start, ExprKind::Call(callee, args), depth, end)
    }

    /// One level above its parts. What is too deep is dropped here and reported once.
    fn deeper(&mut self, start: u32, kind: ExprKind, depth: usize, end: u32) -> Deep {
        if depth < DEEPEST {
            return Deep {
                depth: depth + 1,
                ..self.leaf(start, kind, end)
            };
        }
        if !self.diagnostics.iter().any(|d| d.code == Code::TooDeep) {
            let message = format!("this expression is nested more than {DEEPEST} deep");
            let diagnostic = Diagnostic::new(
                Code::TooDeep,
                self.span(start, start),
                message,
                "left out from here on",
            );
            self.diagnostics
                .push(diagnostic.hint("give a part of it a name with `let`"));
        }
        self.leaf(start, ExprKind::Error, end)
    }
}

/// The items that could be read.
pub(super) fn known<T>(items: Vec<Option<T>>) -> Vec<T> {
    items.into_iter().flatten().collect()
}
