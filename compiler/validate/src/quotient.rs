//! Quotients for searches, as the operator words them: in words, with one division.
//!
//! ```text
//!   up = zeros above the highest bit in which a differs from 2 a      x = a << up
//!   up' = zeros above the highest bit of b                            y = b << up' >> 16
//!   (x / y << 15) >> (up - up' + 31 - n), held to 30 bits
//! ```
//!
//! Its parts are words already: `x / y` has 17 bits with its sign, as `y` has 16 unless `b` is 0,
//! where the quotient is 0 whatever it is moved by.

use whippen_isa::ShiftType;
use whippen_kernel::{Inst, Range};

use crate::alu::{exclusive_or, shift};
use crate::kernel::KernelRun;
use crate::stop::Told;
use crate::term::{Function, Term, Terms};

/// By how many bits the quotient is moved up before it is moved down.
const UP: u32 = 15;

/// What a quotient is held to.
const HELD: (i128, i128) = (-(1 << 29), (1 << 29) - 1);

impl KernelRun<'_> {
    /// About `a * 2^n / b`, 0 where `b` is not positive.
    pub(crate) fn quotient(&self, terms: &mut Terms, inst: &Inst, n: u8) -> Told<Term> {
        let [dividend, divisor] = [0, 1].map(|at| inst.args[at]);
        let (a, b) = (self.whole(terms, dividend)?, self.whole(terms, divisor)?);
        let twice = terms.scale(a, 2)?;
        let twice = terms.word(twice)?;
        let changes = exclusive_or(terms, a, twice)?;
        let up = terms.apply(Function::LeadingZeros, vec![changes]);
        let up_divisor = terms.apply(Function::LeadingZeros, vec![b]);
        let x = terms.apply(Function::ShiftLeft, vec![a, up]);
        let y = terms.apply(Function::ShiftLeft, vec![b, up_divisor]);
        let (y, _) = shift(terms, y, ShiftType::LSR, 16)?;
        let quotient = terms.apply(Function::DivideSigned, vec![x, y]);
        let top = terms.scale(quotient, 1 << UP)?;
        let top = terms.word(top)?;
        let down = terms.sub(up, up_divisor)?;
        let mut down = terms.plus(down, 31 - i128::from(n))?;
        let ranges = [dividend, divisor].map(|value| self.values[value].range);
        let is_large = least_down(ranges, n) < 2;
        if is_large {
            // Moved by more than 31 a word is its sign.
            down = terms.clamp(down, (0, 31))?;
        }
        let mut word = terms.apply(Function::ShiftRightSigned, vec![top, down]);
        if is_large {
            word = terms.clamp(word, HELD)?;
        }
        let zero = terms.constant(0);
        let holds = terms.at_least(b, 0)?;
        terms.select(holds, word, zero)
    }
}

/// By how much a quotient that is not 0 is moved down at least: by 2 or more, it has 30 bits.
fn least_down([dividend, divisor]: [Range; 2], n: u8) -> i64 {
    let repeated = |number: i64| {
        let word = number as i32;
        i64::from((word ^ (word << 1)).leading_zeros())
    };
    let up = repeated(dividend.low).min(repeated(dividend.high));
    let up_divisor = (divisor.low.max(1) as i32).leading_zeros();
    up - i64::from(up_divisor) + 31 - i64::from(n)
}
