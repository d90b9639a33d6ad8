//! Cases of a value by itself: what is made again is the same number, and what is said to be
//! nothing is 0 for numbers.

use whippen_deterministic::Rng;

use super::{Pair, REGISTERS, STEPS, number, step, word};
use crate::flags::{Flags, Status};
use crate::term::{Kind, Term, Terms};
use crate::truth::Truth;
use crate::within::Anew;

/// Terms of registers that hold these words, some of which are known to lie near.
fn made(terms: &mut Terms, rng: &mut Rng, words: &[i128]) -> Vec<Pair> {
    let mut known: Vec<Pair> = vec![(terms.constant(5), 5), (terms.constant(-1 << 20), -1 << 20)];
    for (register, word) in (0..).zip(words) {
        let term = terms.of(Kind::Register(register));
        let range = i128::from(rng.next() as u32 >> 12);
        if rng.chance(1, 2) {
            let told = terms.learn(term, (word - range, word + range));
            told.expect("it holds");
        }
        known.push((term, *word));
    }
    for _ in 0..STEPS {
        let Ok((term, wanted)) = step(terms, rng, &known) else {
            break;
        };
        if wanted.abs() > 1 << 80 || number(terms, term, words).is_none() {
            break;
        }
        known.push((term, wanted));
    }
    known
}

fn words(rng: &mut Rng) -> Vec<i128> {
    (0..REGISTERS).map(|_| word(rng)).collect()
}

#[test]
fn a_term_that_is_made_again_keeps_the_number() {
    let mut rng = Rng::new(5);
    let mut made_other = 0;
    for case in 0..whippen_need::count("WHIPPEN_CASES", 2000) {
        let mut terms = Terms::default();
        let words = words(&mut rng);
        for (term, wanted) in made(&mut terms, &mut rng, &words) {
            let Ok(Some(asks)) = terms.outer_question_in(term) else {
                continue;
            };
            let Some(found) = number(&terms, asks.primitive, &words) else {
                continue;
            };
            let assumed = terms.assume(asks, found >= asks.least);
            assumed.expect("it holds");
            terms.known.refresh();
            let Ok(again) = terms.anew(term, &mut Anew::default()) else {
                continue;
            };
            made_other += usize::from(again != term);
            let text = terms.show(again);
            assert_eq!(
                number(&terms, again, &words),
                Some(wanted),
                "{case}: {text}"
            );
            let (low, high) = terms.bounds(again);
            assert!(low <= wanted && wanted <= high, "{case}: {text}");
        }
    }
    assert!(made_other > 1000, "{made_other}");
}

#[test]
fn what_is_nothing_is_0_for_numbers() {
    let mut rng = Rng::new(6);
    let (mut nothing, mut others) = (0, 0);
    for case in 0..whippen_need::count("WHIPPEN_CASES", 2000) {
        let mut terms = Terms::default();
        terms.by_value = true;
        let words = words(&mut rng);
        let known = made(&mut terms, &mut rng, &words);
        let [(a, x), (b, y)] = [(); 2].map(|()| rng.pick(&known));
        let (low, high) = (-100, 1 << (1 + rng.below(31)));
        let wrong = i128::from(rng.chance(1, 3));
        // A limit in two ways, the second with a fault in some cases.
        let limited = terms.clamp(a, (low, high));
        let other = chosen(&mut terms, a, (low, high + wrong));
        for (one, another, is_one) in [
            (
                limited,
                other,
                x.clamp(low, high) == x.clamp(low, high + wrong),
            ),
            (Ok(a), Ok(b), x == y),
        ] {
            let (Ok(one), Ok(another)) = (one, another) else {
                continue;
            };
            let Ok(difference) = terms.sub(one, another) else {
                continue;
            };
            if terms.is_nothing(difference).unwrap_or(false) {
                nothing += 1;
                assert!(is_one, "{case}: {}", terms.show(difference));
            } else {
                others += 1;
            }
        }
    }
    assert!(nothing > 500 && others > 500, "{nothing} {others}");
}

/// A limit by one choice within another one.
fn chosen(terms: &mut Terms, a: Term, (low, high): (i128, i128)) -> crate::stop::Told<Term> {
    let (is_over, is_enough) = (terms.at_least(a, high)?, terms.at_least(a, low)?);
    let (low, high) = (terms.constant(low), terms.constant(high));
    let held = terms.select(is_over, high, a)?;
    terms.select(is_enough, held, low)
}

#[test]
fn a_limit_that_is_another_one_is_found() {
    let mut terms = Terms::default();
    terms.by_value = true;
    let a = terms.of(Kind::Register(0));
    for (range, is_one) in [((-7, 90), true), ((-7, 91), false), ((-8, 90), false)] {
        let (wanted, found) = (terms.clamp(a, (-7, 90)), chosen(&mut terms, a, range));
        let difference = terms.sub(wanted.expect("short"), found.expect("short"));
        let told = terms.is_nothing(difference.expect("short"));
        assert_eq!(told, Ok(is_one), "{range:?}");
        // Nothing of a case is known behind it.
        assert_eq!(terms.bounds(a), crate::bounds::WORD);
    }
}

/// Flags of an instruction that takes place where something holds.
#[test]
fn flags_elsewhere_are_those_before() {
    let mut terms = Terms::default();
    let [a, b, c] = [0, 1, 2].map(|register| terms.of(Kind::Register(register)));
    let of = |exact| {
        Status::Of(Flags {
            result: Some(exact),
            exact: Some(exact),
            is_of_exact: true,
            carry: Some(exact),
            unsigned: Some(exact),
        })
    };
    let guard = terms.at_least(c, 1).expect("short");
    let mut flags = of(a).or_else(of(b), guard);
    let found = flags.holds(&mut terms, whippen_isa::Cond::GE);
    let [own, others] = [a, b].map(|own| terms.at_least(own, 0).expect("short"));
    assert_ne!(own, others);
    assert_eq!(found, Ok(terms.truths.choose(guard, own, others)));
    let carry = flags.carry(&mut terms);
    assert_eq!(carry, terms.select(guard, a, b));
    // A result that is set whatever holds is both sides'.
    flags.change(&|flags| (flags.result, flags.is_of_exact) = (Some(c), false));
    let minus = flags.holds(&mut terms, whippen_isa::Cond::MI);
    let plus = terms.at_least(c, 0).expect("short");
    assert_eq!(minus, Ok(terms.truths.not(plus)));
    assert_ne!(minus, Ok(Truth::YES));
}
