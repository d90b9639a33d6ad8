//! Functions of words that have no normal form: what they are of numbers.

use crate::term::{Function, Kind, Term, Terms};

impl Terms {
    /// The function of these words.
    pub fn apply(&mut self, function: Function, args: Vec<Term>) -> Term {
        let numbers: Option<Vec<i128>> = args.iter().map(|arg| self.number(*arg)).collect();
        match numbers.and_then(|numbers| function.of_numbers(&numbers)) {
            Some(number) => self.constant(number),
            None => self.of(Kind::Apply(function, args)),
        }
    }
}

impl Function {
    /// What it is of numbers, as a signed word.
    fn of_numbers(self, args: &[i128]) -> Option<i128> {
        let (a, b) = (*args.first()?, *args.last()?);
        let (x, y) = (a as i32, b as i32);
        // The processor looks at the low byte of what it shifts by.
        let by = b as u32 & 0xff;
        Some(match self {
            Function::And => (x & y).into(),
            Function::Or => (x | y).into(),
            Function::ExclusiveOr => (x ^ y).into(),
            Function::LeadingZeros => x.leading_zeros().into(),
            Function::DivideUnsigned => {
                let quotient = (x as u32).checked_div(y as u32).unwrap_or(0);
                (quotient as i32).into()
            }
            Function::DivideSigned if y == 0 => 0,
            Function::DivideSigned => x.wrapping_div(y).into(),
            Function::ShiftLeft => x.unbounded_shl(by).into(),
            Function::ShiftRight => ((x as u32).unbounded_shr(by) as i32).into(),
            Function::ShiftRightSigned => x.unbounded_shr(by).into(),
            Function::DivideRound(_) if b == 0 => 0,
            Function::DivideRound(n) => {
                // floor(p / q + 1/2) = floor((2 p + q) / 2 q), with a positive q
                let (p, q) = if b > 0 { (a << n, b) } else { (-(a << n), -b) };
                (2 * p + q).div_euclid(2 * q)
            }
            Function::SquareRoot => a.max(0).isqrt(),
            // Addresses are no numbers.
            Function::Held => return None,
        })
    }
}
