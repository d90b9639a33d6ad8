//! Lines of bodies and of strings.

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

/// A line of a `string`.
#[derive(Debug, Clone, PartialEq)]
pub enum StringPart {
    /// `position u in a .. b, rate in a .. b`
    Coordinate {
        /// Name of the displacement; its prime is the rate.
        name: Name,
        /// Range of the displacement.
        range: RangeExpr,
        /// Range of the rate.
        rate_range: RangeExpr,
        /// The line.
        span: Span,
    },
    /// `density expr`
    Density {
        /// Mass per length.
        value: Expr,
        /// The line.
        span: Span,
    },
    /// `load expr`: the terms are added.
    Load {
        /// Force per length, all along.
        value: Expr,
        /// The line.
        span: Span,
    },
    /// `force expr at place`: the terms are added.
    Force {
        /// Its value.
        value: Expr,
        /// Where it acts.
        place: Expr,
        /// The line.
        span: Span,
    },
    /// `ends word` or `ends word, word`
    Ends {
        /// How the first end is held.
        first: Name,
        /// How the second one is held; as the first if absent.
        second: Option<Name>,
        /// The line.
        span: Span,
    },
    /// `tuned tension to pitch`
    Tuned {
        /// The tension, which this line defines.
        name: Name,
        /// The frequency of the first mode.
        pitch: Expr,
        /// The line.
        span: Span,
    },
    /// `friction f(v) at place against w = law`
    Friction {
        /// Its name.
        name: Name,
        /// The slip, by the name that it has in the law.
        slip: Name,
        /// Where it rubs.
        place: Expr,
        /// The speed that the slip is relative to.
        against: Expr,
        /// The force against the slip.
        law: Expr,
        /// The line.
        span: Span,
    },
    /// `points expr`
    Points {
        /// How many points there are between the ends.
        value: Expr,
        /// The line.
        span: Span,
    },
}

impl StringPart {
    /// The line.
    pub fn span(&self) -> Span {
        match self {
            StringPart::Coordinate { span, .. }
            | StringPart::Density { span, .. }
            | StringPart::Load { span, .. }
            | StringPart::Force { span, .. }
            | StringPart::Ends { span, .. }
            | StringPart::Tuned { span, .. }
            | StringPart::Friction { span, .. }
            | StringPart::Points { span, .. } => *span,
        }
    }
}
