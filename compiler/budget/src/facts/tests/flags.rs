//! What a comparison and a condition say of what was compared, against words tried one by one.

use std::collections::BTreeMap;

use whippen_isa::{Arch, Cond, parse};

use super::{Facts, Interval};
use crate::Code;

/// Where signed and unsigned order begin and end, and some words between.
const ENDS: [i32; 7] = [i32::MIN, -3, -1, 0, 1, 4, i32::MAX];

pub(super) fn intervals() -> impl Iterator<Item = [i32; 2]> {
    let from = |at: usize| ENDS[at..].iter().map(move |&high| [ENDS[at], high]);
    (0..ENDS.len()).flat_map(from)
}

/// Words of an interval: its ends, and all that lie beside an end of any.
pub(super) fn words([low, high]: [i32; 2]) -> Vec<i32> {
    let beside = |end: i32| [end.saturating_sub(1), end, end.saturating_add(1)];
    let mut words: Vec<i32> = ENDS.into_iter().flat_map(beside).collect();
    words.retain(|word| (low..=high).contains(word));
    words.sort_unstable();
    words.dedup();
    words
}

pub(super) fn after(known: &[(u8, [i32; 2])], text: &str) -> Facts {
    let known: BTreeMap<u8, [u32; 2]> = known
        .iter()
        .map(|&(register, ends)| (register, ends.map(|end| end as u32)))
        .collect();
    let mut facts = Facts::of_registers(&known);
    let inst = parse(text, Arch::V8M, None).expect("an instruction");
    facts.execute(&inst, 0, &Code::default());
    facts
}

/// N, Z, C, V of a difference.
fn flags(x: i32, y: i32) -> [bool; 4] {
    let (difference, overflow) = x.overflowing_sub(y);
    [
        difference < 0,
        difference == 0,
        x as u32 >= y as u32,
        overflow,
    ]
}

fn hull(words: impl Iterator<Item = i32>) -> Option<Interval> {
    words.map(Interval::point).reduce(Interval::hull)
}

/// Where a condition leaves two values that were compared; nothing where it cannot hold.
fn where_holds(compared: &Facts, cond: Cond, [left, right]: [u8; 2]) -> Option<[Interval; 2]> {
    let mut facts = compared.clone();
    let possible = facts.assume(cond);
    possible.then(|| [facts.interval(left), facts.interval(right)])
}

/// Whether a comparison is told exactly: by signed order always, by unsigned order where what is
/// not the lower is not negative. Of the sign of the difference and its overflow only whether they
/// can be is told.
fn is_exact(cond: Cond, [a, b]: [[i32; 2]; 2]) -> bool {
    match cond {
        Cond::CC | Cond::LS => b[0] >= 0,
        Cond::CS | Cond::HI => a[0] >= 0,
        Cond::MI | Cond::PL | Cond::VS | Cond::VC => false,
        _ => true,
    }
}

/// Whatever pair of words a condition holds for is kept, and nothing else where it is told.
#[test]
fn a_comparison_and_a_condition_keep_the_words_they_hold_for() {
    let mut cases = [0; 2];
    for (a, b) in intervals().flat_map(|a| intervals().map(move |b| (a, b))) {
        let compared = after(&[(0, a), (1, b)], "cmp r0, r1");
        let of_left = |x: i32| words(b).into_iter().map(move |y| (x, y));
        let pairs: Vec<(i32, i32)> = words(a).into_iter().flat_map(of_left).collect();
        for cond in Cond::ALL {
            let holds = |&&(x, y): &&(i32, i32)| {
                let [n, z, c, v] = flags(x, y);
                cond.holds(n, z, c, v)
            };
            let kept = || pairs.iter().filter(holds);
            let left = hull(kept().map(|pair| pair.0));
            let right = hull(kept().map(|pair| pair.1));
            let expected = left.zip(right).map(|(left, right)| [left, right]);
            let found = where_holds(&compared, cond, [0, 1]);
            let what = format!("{a:?} {b:?} {cond:?}: {found:?}, not {expected:?}");
            if is_exact(cond, [a, b]) {
                assert_eq!(found, expected, "{what}");
            } else {
                assert_eq!(found.is_some(), expected.is_some(), "{what}");
                let both = found.iter().flatten().zip(expected.iter().flatten());
                both.for_each(|(found, expected)| assert!(found.covers(*expected), "{what}"));
            }
            cases[usize::from(is_exact(cond, [a, b]))] += 1;
        }
    }
    assert_eq!(cases.iter().sum::<usize>(), 28 * 28 * 15);
    assert!(cases[1] > 6000, "{cases:?}");
}

/// A condition that holds leaves no room for its inverse, and none for what its values exclude.
#[test]
fn what_a_condition_says_stays_known() {
    let compared = after(&[(0, [i32::MIN, i32::MAX]), (1, [5, 7])], "cmp r0, r1");
    for (cond, inverse) in Cond::ALL.into_iter().filter_map(|c| Some((c, c.invert()?))) {
        let mut facts = compared.clone();
        assert!(facts.assume(cond) && facts.clone().assume(cond));
        assert!(!facts.assume(inverse), "{cond:?}");
    }
    let then = |first, second| {
        let mut facts = compared.clone();
        facts.assume(first) && facts.assume(second)
    };
    assert!(!then(Cond::EQ, Cond::MI) && !then(Cond::GT, Cond::VS));
    assert!(!then(Cond::EQ, Cond::CC) && then(Cond::LT, Cond::CS) && then(Cond::LT, Cond::VS));
    let same = after(&[(0, [-9, 9])], "cmp r0, r0");
    assert!(where_holds(&same, Cond::NE, [0, 0]).is_none());
    assert_eq!(
        where_holds(&same, Cond::EQ, [0, 0]).map(|at| at[0]),
        Some(Interval { low: -9, high: 9 })
    );
}

/// The sign and the zero of a result, and of what it was made of by a subtraction.
#[test]
fn a_result_shows_its_sign_and_whether_it_is_zero() {
    for a in intervals() {
        for (text, by) in [("adds r2, r0, #0", 0), ("subs r2, r0, #1", 1)] {
            let made = after(&[(0, a)], text);
            let wraps = a[0] < i32::MIN + by;
            for cond in [Cond::MI, Cond::PL, Cond::EQ, Cond::NE] {
                let holds = |&x: &i32| {
                    let [n, z, ..] = flags(x, by);
                    cond.holds(n, z, false, false)
                };
                let words = words(a).into_iter().filter(holds);
                let results = hull(words.map(|x| x.wrapping_sub(by)));
                let found = where_holds(&made, cond, [2, 0]).map(|at| at[0]);
                let what = format!("{text} {a:?} {cond:?}: {found:?}, not {results:?}");
                match (wraps, results) {
                    (true, Some(results)) => assert!(found.is_some_and(|f| f.covers(results))),
                    (true, None) => {}
                    (false, _) => assert_eq!(found, results, "{what}"),
                }
            }
        }
    }
}
