//! `sense`: what is measured, and the window of its differentiators.

use super::elaborate::Elaborator;
use super::scope::{Made, ScopeId, Thing};
use super::types::Value;
use crate::diag::{Code, Diagnostic};
use crate::model::{Interval, Moves, Node, Sense};
use crate::syntax::ast::{Expr, Name, RangeExpr};
use crate::units::{Dim, unit_of_dimension};
use whippen_rate::Rate;

/// The window where the program does not say `over`: 31 ticks at 44.1 kHz.
pub const DEFAULT_WINDOW_S: f64 = 0.7e-3;
/// The longest window in ticks: 93 ms at 44.1 kHz, far beyond what a player would accept.
const MAX_WINDOW: u32 = 4095;

impl<'a> Elaborator<'a, '_> {
    /// Enters a sensed value.
    pub fn declare_sense(&mut self, scope: ScopeId, name: &'a Name, ty: &Name) -> Made {
        let Some(dim) = self.real_type(ty, "a sensed value", "sense a length and compare it")
        else {
            self.enter(scope, name, Thing::Broken);
            return Made::Nothing;
        };
        let index = self.model.senses.len();
        let range = Interval {
            low: 0.0,
            high: 0.0,
        };
        self.model.senses.push(Sense {
            name: name.node.clone(),
            dim,
            unit: unit_of_dimension(&ty.node).unwrap_or_default(),
            moves: moves(dim, ty),
            range,
            window: 3,
            slew_per_s: None,
            span: name.span,
        });
        let node = self.node(Node::Sense(index as u32), name.span);
        self.enter(scope, name, Thing::Sense(Value::real(node, dim)));
        Made::Sense(index)
    }

    /// Its range, its slew limit and its window.
    pub fn sense(
        &mut self,
        scope: ScopeId,
        index: usize,
        range: &'a RangeExpr,
        slew: Option<&'a Expr>,
        over: Option<&'a Expr>,
    ) {
        let (name, dim) = (
            self.model.senses[index].name.clone(),
            self.model.senses[index].dim,
        );
        let range = self.range(scope, range, dim, &format!("the range of `{name}`"));
        let slew = slew.map(|s| {
            self.positive(
                scope,
                s,
                dim.div(Dim::TIME),
                &format!("the slew limit of `{name}`"),
            )
        });
        let window = match over {
            Some(over) => self.window(scope, over, &name),
            None => window_ticks(DEFAULT_WINDOW_S, self.model.rate_hz),
        };
        let sense = &mut self.model.senses[index];
        sense.range = range.unwrap_or(sense.range);
        sense.slew_per_s = slew.flatten();
        sense.window = window.unwrap_or(sense.window);
    }

    fn window(&mut self, scope: ScopeId, over: &'a Expr, name: &str) -> Option<u32> {
        let seconds = self.positive(scope, over, Dim::TIME, &format!("the window of `{name}`"))?;
        let rate_hz = self.model.rate_hz;
        let window = window_ticks(seconds, rate_hz);
        if window.is_none() {
            let longest = f64::from(MAX_WINDOW) / f64::from(rate_hz) * 1e3;
            let message = format!("the window of `{name}` is longer than {MAX_WINDOW} ticks");
            self.report(
                Diagnostic::new(Code::WindowTooLong, over.span, message, "too long").hint(format!(
                    "at {rate_hz} Hz it may be up to {longest:.0} ms; 0.5 to 2 ms are usual"
                )),
            );
        }
        window
    }
}

/// How that moves which is sensed. An angle has the dimension of a number, which alone says nothing
/// of what is measured.
fn moves(dim: Dim, ty: &Name) -> Moves {
    if dim == Dim::LENGTH {
        Moves::Slides
    } else if dim.is_number() && ty.node == "angle" {
        Moves::Turns
    } else {
        Moves::Not
    }
}

/// The odd number of ticks nearest to a time, at least 3; `None` beyond the longest window.
fn window_ticks(seconds: f64, rate_hz: Rate) -> Option<u32> {
    let half = ((seconds * f64::from(rate_hz) - 1.0) / 2.0)
        .round()
        .max(1.0);
    let ticks = 2.0 * half + 1.0;
    (ticks <= f64::from(MAX_WINDOW)).then_some(ticks as u32)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn windows_are_odd_and_nearest() {
        let ticks = [0.7e-3, 1e-3, 1e-6, 2.9 / 44_100.0, 4.1 / 44_100.0]
            .map(|s| window_ticks(s, 44_100.into()));
        assert_eq!(ticks, [Some(31), Some(45), Some(3), Some(3), Some(5)]);
        assert_eq!(window_ticks(1.0, 44_100.into()), None);
        assert_eq!(window_ticks(1e300, (u32::MAX).into()), None);
    }
}
