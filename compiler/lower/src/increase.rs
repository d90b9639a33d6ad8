//! Sums that add up over ticks: what is added is gathered in finer units, so that there is one
//! rounding to the value's own, and nothing of a constant is lost.
//!
//! Not here: which sums those are (`values`, `update`), how a sum is planned (`linear`).

use super::Lowerer;
use super::chain::{PlannedTerm, TermForm};
use super::format::exp2;
use super::linear::{Constant, Factor, HALF, Term};
use super::real::{Real, Scale, power_of_two};
use whippen_kernel::{Op, OpError};

/// Changes of what adds up are gathered in units so many bits finer, at most.
const FINER: i32 = 16;

impl Lowerer<'_> {
    /// A sum that adds up over ticks, such as a new rate: what is added to the old value is
    /// gathered in finer units, so that there is one rounding to the value's own, and nothing of a
    /// constant is lost.
    pub(super) fn increased(
        &mut self,
        c0: f64,
        terms: &[Term],
        scale: Scale,
    ) -> Result<Real, OpError> {
        let old = |t: &Term| match (t.factor, t.operand) {
            (Factor::One(f), Some(real)) if real.scale() == scale && (f - 1.0).abs() < HALF => {
                Some((f, real))
            }
            _ => None,
        };
        let found = terms
            .iter()
            .enumerate()
            .find_map(|(i, t)| Some((i, old(t)?)));
        let Some((place, (factor, real))) = found else {
            return self.sum(c0, terms, scale, Constant::Kept);
        };
        let mut change = terms.to_vec();
        change.remove(place);
        if factor != 1.0 {
            change.insert(0, Term::of(factor - 1.0, real));
        }
        let fine = Scale::plain(scale.lsb * exp2(-FINER));
        let change = self.sum(c0 + 0.5 * scale.lsb, &change, fine, Constant::Kept)?;
        let Some(n @ ..0) = power_of_two(change.lsb / scale.lsb) else {
            return self.sum(c0, terms, scale, Constant::Kept);
        };
        let change_in_units = self.moved(change.value, n)?;
        match self.b.op(Op::Add, &[real.value, change_in_units]) {
            Ok(value) => Ok(Real {
                value,
                error: real.error + change.error + 0.5 * scale.lsb,
                ..real
            }),
            // Only in coarser units.
            Err(OpError::Overflow { .. }) => self.sum(c0, terms, scale, Constant::Kept),
            Err(error) => Err(error),
        }
    }

    /// Whether a sum is made without any rounding.
    pub(super) fn is_exact(&self, c0: f64, terms: &[Term], scale: Scale) -> bool {
        let plan = self.planned(c0 - scale.offset, terms, scale.lsb, 0.0, Constant::Kept);
        plan.is_some_and(|plan| {
            let whole = |w: &PlannedTerm| matches!(w.form, TermForm::Shift(0..));
            plan.error == 0.0 && plan.terms.iter().all(whole)
        })
    }
}
