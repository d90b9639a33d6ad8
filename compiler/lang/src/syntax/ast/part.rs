//! Lines of bodies.

use super::{Expr, Name, RangeExpr};
use whippen_source::Span;

/// A line of a `body`.
#[expect(clippy::large_enum_variant, reason = "a program has a handful of them")]
#[derive(Debug, Clone, PartialEq)]
pub enum BodyPart {
    /// `angle phi in a .. b [= init], rate in a .. b [= init]`, or `position` for a body that
    /// slides.
    Coordinate {
        /// `true` for `angle`, `false` for `position`.
        angle: bool,
        /// Name of the coordinate; its prime is the rate.
        name: Name,
        /// Range of the coordinate.
        range: RangeExpr,
        /// First value; zero if absent.
        init: Option<Expr>,
        /// Range of the rate.
        rate_range: RangeExpr,
        /// First rate; zero if absent.
        rate_init: Option<Expr>,
        /// The line.
        span: Span,
    },
    /// `inertia expr` of a body with an angle, `mass expr` of one with a position.
    Inertia {
        /// `true` for `inertia`, `false` for `mass`.
        angle: bool,
        /// Its value.
        value: Expr,
        /// The line.
        span: Span,
    },
    /// `torque expr` or `force expr`: the terms are added.
    Torque {
        /// `true` for `torque`, `false` for `force`.
        angle: bool,
        /// Its value.
        value: Expr,
        /// The line.
        span: Span,
    },
    /// `friction f(v) against w = law`
    Friction {
        /// Its name.
        name: Name,
        /// The slip, by the name that it has in the law.
        slip: Name,
        /// The speed that the slip is relative to.
        against: Expr,
        /// The force against the slip.
        law: Expr,
        /// The line.
        span: Span,
    },
}
