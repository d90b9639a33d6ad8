//! Normal forms keep the number: random terms are built twice, as terms and as numbers. What
//! instructions mean is compared with the emulator in `meaning`.

mod meaning;
mod proven;
mod routines;
mod strings;
mod within;

use whippen_deterministic::Rng;
use whippen_kernel::{Range, Type};

use crate::divide::steps;
use crate::stop::Told;
use crate::term::{Atom, Function, Kind, Term, Terms};
use crate::truth::Truth;

/// Registers whose words are known to the test.
const REGISTERS: u8 = 4;

/// How many terms are built of the same registers.
const STEPS: usize = 14;

/// A term and the number that it is.
type Pair = (Term, i128);

fn word(rng: &mut Rng) -> i128 {
    let word = rng.next() as i32;
    let small = rng.pick(&[0, 8, 16, 24, 31]);
    i128::from(word >> small)
}

/// A truth by what registers hold; none where a number has more than 127 bits.
fn holds(terms: &Terms, truth: Truth, words: &[i128]) -> Option<bool> {
    match terms.truths.split(truth) {
        None => Some(truth == Truth::YES),
        Some((asks, yes, no)) => {
            let is_so = number(terms, asks.primitive, words)? >= asks.least;
            holds(terms, if is_so { yes } else { no }, words)
        }
    }
}

/// A term by what registers hold; none where a number has more than 127 bits.
fn number(terms: &Terms, term: Term, words: &[i128]) -> Option<i128> {
    let sum = terms.sum(term);
    let of_kind = |kind: &Kind| -> Option<i128> {
        Some(match kind {
            Kind::Register(register) => words[usize::from(*register)],
            Kind::Times(a, b) => {
                number(terms, *a, words)?.checked_mul(number(terms, *b, words)?)?
            }
            Kind::Floor(inner, n) => number(terms, *inner, words)? >> n,
            Kind::Positive(inner) => number(terms, *inner, words)?.max(0),
            Kind::Gate(truth, inner) => match holds(terms, *truth, words)? {
                true => number(terms, *inner, words)?,
                false => 0,
            },
            Kind::Apply(function, args) => {
                let first = number(terms, *args.first()?, words)? as i32;
                let last = number(terms, *args.last()?, words)? as i32;
                applied(*function, first, last).into()
            }
            other => panic!("{other:?} is not built here"),
        })
    };
    let mut all = sum.constant;
    for (atom, by) in &sum.parts {
        let factors: &[Atom] = match terms.kind(*atom) {
            Kind::Product(factors) => factors,
            _ => std::slice::from_ref(atom),
        };
        let mut product = *by;
        for factor in factors {
            product = product.checked_mul(of_kind(terms.kind(*factor))?)?;
        }
        all = all.checked_add(product)?;
    }
    Some(all)
}

/// A function of words.
fn applied(function: Function, a: i32, b: i32) -> i32 {
    let shift = b as u32 & 0xff;
    match function {
        Function::And => a & b,
        Function::Or => a | b,
        Function::ExclusiveOr => a ^ b,
        Function::LeadingZeros => a.leading_zeros() as i32,
        Function::DivideUnsigned => (a as u32).checked_div(b as u32).unwrap_or(0) as i32,
        Function::DivideSigned if b == 0 => 0,
        Function::DivideSigned => a.wrapping_div(b),
        Function::ShiftLeft => (a as u32).unbounded_shl(shift) as i32,
        Function::ShiftRight => (a as u32).unbounded_shr(shift) as i32,
        Function::ShiftRightSigned => a.unbounded_shr(shift),
        other => panic!("{other:?} is no instruction's"),
    }
}

fn wrapped(number: i128, bits: u32) -> i128 {
    let up = 128 - bits;
    number << up >> up
}

/// One more term, of two or three that there are.
fn step(terms: &mut Terms, rng: &mut Rng, known: &[Pair]) -> Told<Pair> {
    let [(a, x), (b, y), (c, z)] = [(); 3].map(|()| rng.pick(known));
    let n = 1 + rng.below(31) as u32;
    let small = |number: i128| number.abs() < 1 << 40;
    Ok(match rng.below(12) {
        0 => (terms.add(a, b)?, x + y),
        1 => (terms.sub(a, b)?, x - y),
        2 if small(x) && small(y) => (terms.mul(a, b)?, x * y),
        3 => (terms.floor(a, n)?, x >> n),
        4 => (terms.word(a)?, wrapped(x, 32)),
        5 => (terms.low_bits(a, n)?, x & ((1 << n) - 1)),
        6 => (terms.positive(a)?, x.max(0)),
        7 => (terms.max(a, b)?, x.max(y)),
        8 => (terms.clamp(a, (-100, 1 << n))?, x.clamp(-100, 1 << n)),
        9 => {
            let truth = terms.at_least(c, 17)?;
            (terms.select(truth, a, b)?, if z >= 17 { x } else { y })
        }
        10 => {
            let [first, second] = [terms.at_least(c, 3)?, terms.equal(a, b)?];
            let both = terms.truths.or(first, second);
            (
                terms.select(both, c, a)?,
                if z >= 3 || x == y { z } else { x },
            )
        }
        _ if small(x) => (terms.scale(a, -(1 << (n & 7)))?, -(x << (n & 7))),
        _ => (a, x),
    })
}

/// A quotient as it is defined, on numbers.
fn quotient(a: i128, b: i128, n: u8) -> i128 {
    match b {
        0 => 0,
        _ => ((a << (n + 1)) + b).div_euclid(2 * b),
    }
}

#[test]
fn long_division_is_the_quotient() {
    let mut rng = Rng::new(11);
    let mut tried = 0;
    while tried < 4000 {
        let (a, b) = (word(&mut rng), word(&mut rng).abs().min((1 << 31) - 1));
        let n = rng.below(32) as u8;
        let wanted = quotient(a, b, n);
        if i32::try_from(wanted).is_err() {
            continue;
        }
        tried += 1;
        let (wide, number) = (Type::I32.range(), |k: i128| Range::new(k as i64, k as i64));
        let dividend = rng.pick(&[wide, number(a)]);
        let divisor = rng.pick(&[Range::new(0, wide.high), number(b)]);
        let mut terms = Terms::default();
        let words = [terms.constant(a), terms.constant(b)];
        let found = steps(&mut terms, words, n, [dividend, divisor]).expect("it is small");
        assert_eq!(terms.number(found), Some(wanted), "{a} {b} {n}");
    }
}

#[test]
fn normal_forms_keep_the_number() {
    let mut rng = Rng::new(3);
    let count = whippen_need::count("WHIPPEN_CASES", 3000);
    let mut terms = Terms::default();
    for case in 0..count {
        // What holds of these numbers need not hold of the next ones, which share the terms.
        match case % 8 {
            0 => terms = Terms::default(),
            _ => terms.known.forget(),
        }
        let words: Vec<i128> = (0..REGISTERS).map(|_| word(&mut rng)).collect();
        let mut known: Vec<Pair> =
            vec![(terms.constant(5), 5), (terms.constant(-1 << 20), -1 << 20)];
        for (register, word) in (0..).zip(&words) {
            let term = terms.of(Kind::Register(register));
            // What is known of it is true.
            let [under, over] = [(); 2].map(|()| i128::from(rng.next() as u32 >> 12));
            if rng.chance(1, 2) {
                terms
                    .learn(term, (word - under, word + over))
                    .expect("it holds");
            }
            known.push((term, *word));
        }
        for _ in 0..STEPS {
            let Ok((term, wanted)) = step(&mut terms, &mut rng, &known) else {
                break;
            };
            if wanted.abs() > 1 << 80 {
                break;
            }
            let Some(found) = number(&terms, term, &words) else {
                break;
            };
            assert_eq!(found, wanted, "case {case}: {}", terms.show(term));
            let (low, high) = terms.bounds(term);
            assert!(
                low <= wanted && wanted <= high,
                "case {case}: {}",
                terms.show(term)
            );
            if rng.chance(1, 3) {
                let slack = i128::from(rng.next() as u16);
                terms
                    .learn(term, (wanted - slack, wanted + slack))
                    .expect("it holds");
            }
            known.push((term, wanted));
        }
    }
}
