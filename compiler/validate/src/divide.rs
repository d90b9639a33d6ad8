//! Exact quotients by long division in digits of 16 bits: Knuth, The Art of Computer Programming 2,
//! 4.3.1, algorithm D.
//!
//! `floor(a 2^n / b + 1/2)` is `floor((a 2^n + floor(b / 2)) / b)`, and of a negative dividend `y`
//! it is `-1 - floor((-1 - y) / b)`. Where it fits a word it is two digits, each guessed from the
//! upper half of the divisor, whose top bit is set, and taken back twice at most. The steps are
//! written down here so that code which divides like this falls together with them; that they are
//! the quotient is tested with numbers (`tests`).
//!
//! Not here: divisors that may be negative, and other ways to divide.

use whippen_isa::ShiftType;
use whippen_kernel::{Inst, Range};

use crate::alu::{exclusive_or, or, shift};
use crate::kernel::KernelRun;
use crate::stop::Told;
use crate::term::{Function, Term, Terms};

/// The upper and lower half of a divisor, and it.
#[derive(Clone, Copy)]
struct Divisor {
    whole: Term,
    upper: Term,
    lower: Term,
}

impl KernelRun<'_> {
    /// `floor(a 2^n / b + 1/2)`, 0 where `b` is 0.
    pub(crate) fn divide_round(&self, terms: &mut Terms, inst: &Inst, n: u8) -> Told<Term> {
        let [of, by] = [0, 1].map(|at| self.values[inst.args[at]].range);
        let a = self.whole(terms, inst.args[0])?;
        let b = self.whole(terms, inst.args[1])?;
        let are_numbers = terms.number(a).is_some() && terms.number(b).is_some();
        if by.low < 0 || are_numbers {
            return Ok(terms.apply(Function::DivideRound(n), vec![a, b]));
        }
        steps(terms, [a, b], n, [of, by])
    }
}

/// The same, step by step, where `b` is not negative.
pub(crate) fn steps(
    terms: &mut Terms,
    [a, b]: [Term; 2],
    n: u8,
    [of, by]: [Range; 2],
) -> Told<Term> {
    let scaled = terms.scale(a, 1 << n)?;
    let half = terms.floor(b, 1)?;
    let dividend = terms.add(scaled, half)?;
    let (low, high) = (terms.word(dividend)?, terms.floor(dividend, 32)?);
    let high = terms.word(high)?;
    let quotient = if of.low < 0 {
        let sign = terms.floor(high, 31)?;
        let low = exclusive_or(terms, low, sign)?;
        let high = exclusive_or(terms, high, sign)?;
        let quotient = divide([high, low], terms, b, by)?;
        exclusive_or(terms, quotient, sign)?
    } else {
        divide([high, low], terms, b, by)?
    };
    if by.low > 0 {
        return Ok(quotient);
    }
    let (is_zero, zero) = (terms.constant(0), terms.constant(0));
    let is_zero = terms.equal(b, is_zero)?;
    terms.select(is_zero, zero, quotient)
}

/// Two words over one, all unsigned, where the upper word is less than the divisor.
fn divide([high, low]: [Term; 2], terms: &mut Terms, b: Term, by: Range) -> Told<Term> {
    let zeros = |word: i64| (word as u32).leading_zeros();
    let (whole, [high, low]) = if by.low > 0 && zeros(by.low) == zeros(by.high) {
        let up = zeros(by.low);
        (up_by(terms, b, up)?, up_pair(terms, [high, low], up)?)
    } else {
        let up = terms.apply(Function::LeadingZeros, vec![b]);
        let whole = terms.apply(Function::ShiftLeft, vec![b, up]);
        let negative = terms.scale(up, -1)?;
        let rest = terms.plus(negative, 32)?;
        let upper = terms.apply(Function::ShiftLeft, vec![high, up]);
        let carried = terms.apply(Function::ShiftRight, vec![low, rest]);
        let high = or(terms, upper, carried)?;
        let high = terms.word(high)?;
        let low = terms.apply(Function::ShiftLeft, vec![low, up]);
        (whole, [high, low])
    };
    let divisor = Divisor {
        whole,
        upper: shift(terms, whole, ShiftType::LSR, 16)?.0,
        lower: terms.low_bits(whole, 16)?,
    };
    let (next, last) = (
        shift(terms, low, ShiftType::LSR, 16)?.0,
        terms.low_bits(low, 16)?,
    );
    let (first, remainder) = digit(terms, high, next, divisor)?;
    let (second, _) = digit(terms, remainder, last, divisor)?;
    let up = up_by(terms, first, 16)?;
    let sum = terms.add(second, up)?;
    terms.word(sum)
}

fn up_by(terms: &mut Terms, word: Term, by: u32) -> Told<Term> {
    Ok(shift(terms, word, ShiftType::LSL, by)?.0)
}

fn up_pair(terms: &mut Terms, [high, low]: [Term; 2], by: u32) -> Told<[Term; 2]> {
    if by == 0 {
        return Ok([high, low]);
    }
    let upper = up_by(terms, high, by)?;
    let (carried, _) = shift(terms, low, ShiftType::LSR, 32 - by)?;
    let high = or(terms, upper, carried)?;
    Ok([terms.word(high)?, up_by(terms, low, by)?])
}

/// One digit and what remains, of `high 2^16 + next`.
fn digit(terms: &mut Terms, high: Term, next: Term, by: Divisor) -> Told<(Term, Term)> {
    let mut digit = terms.apply(Function::DivideUnsigned, vec![high, by.upper]);
    let product = terms.mul(digit, by.upper)?;
    let rest = terms.sub(high, product)?;
    let mut rest = terms.word(rest)?;
    for _ in 0..2 {
        (digit, rest) = correct(terms, [digit, rest, next], by)?;
    }
    let up = up_by(terms, high, 16)?;
    let dividend = terms.add(next, up)?;
    let dividend = terms.word(dividend)?;
    let product = terms.mul(digit, by.whole)?;
    let remainder = terms.sub(dividend, product)?;
    Ok((digit, terms.word(remainder)?))
}

/// One less where `digit lower > rest 2^16 + next`.
fn correct(terms: &mut Terms, [digit, rest, next]: [Term; 3], by: Divisor) -> Told<(Term, Term)> {
    let up = up_by(terms, rest, 16)?;
    let have_low = terms.add(next, up)?;
    let have_low = terms.word(have_low)?;
    let (have_high, _) = shift(terms, rest, ShiftType::LSR, 16)?;
    let (one, other) = (terms.unsigned(digit)?, terms.unsigned(by.lower)?);
    let need = terms.mul(one, other)?;
    let (need_low, need_high) = (terms.word(need)?, terms.floor(need, 32)?);
    let need_high = terms.word(need_high)?;
    let lower = less(terms, have_low, need_low)?;
    let borrow = terms.floor(lower, 32)?;
    let upper = less(terms, have_high, need_high)?;
    let over = terms.add(upper, borrow)?;
    let is_enough = terms.at_least(over, 0)?;
    let is_less = terms.truths.not(is_enough);
    let fewer = terms.plus(digit, -1)?;
    let fewer = terms.word(fewer)?;
    let more = terms.add(rest, by.upper)?;
    let more = terms.word(more)?;
    Ok((
        terms.select(is_less, fewer, digit)?,
        terms.select(is_less, more, rest)?,
    ))
}

/// The difference of two unsigned words.
fn less(terms: &mut Terms, a: Term, b: Term) -> Told<Term> {
    let (a, b) = (terms.unsigned(a)?, terms.unsigned(b)?);
    terms.sub(a, b)
}
