//! What a comparison and a condition say of what was compared, and of a result.

use whippen_isa::Cond;

use super::{
    Claims, Ends, covers, hull, intervals, pairs, pairs_of_intervals, run, where_holds, words,
};

/// Comparisons and results keep the words that may be.
pub fn comparisons_and_results<C: Claims>() {
    comparisons::<C>();
    conditions::<C>();
    results::<C>();
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

/// The number of a combination of flags, as one bit.
fn bit(flags: [bool; 4]) -> u16 {
    1 << flags
        .into_iter()
        .fold(0, |number, flag| number << 1 | u16::from(flag))
}

/// Whether no word of one is above one of the other, and each has words of one sign: then
/// the flags of their differences are told exactly.
fn are_apart([a, b]: [[i32; 2]; 2]) -> bool {
    let one_sign = |[low, high]: [i32; 2]| (low < 0) == (high < 0);
    (a[1] <= b[0] || b[1] <= a[0]) && one_sign(a) && one_sign(b)
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
fn comparisons<C: Claims>() {
    let mut cases = [0; 2];
    for [a, b] in pairs_of_intervals() {
        let compared: C = run(&[(0, a), (1, b)], &["cmp r0, r1"]);
        let pairs = pairs([a, b]);
        let possible = pairs.iter().fold(0, |set, &(x, y)| set | bit(flags(x, y)));
        let told = compared.flags();
        assert_eq!(possible & !told, 0, "{a:?} {b:?}: {told:b}");
        assert!(
            told == possible || !are_apart([a, b]),
            "{a:?} {b:?}: {told:b}"
        );
        for cond in Cond::ALL {
            let holds = |&&(x, y): &&(i32, i32)| {
                let [n, z, c, v] = flags(x, y);
                cond.holds(n, z, c, v)
            };
            let kept = || pairs.iter().filter(holds);
            let left = hull(kept().map(|pair| pair.0.into()));
            let right = hull(kept().map(|pair| pair.1.into()));
            let expected = left.zip(right).map(|(left, right)| [left, right]);
            let found = where_holds(&compared, cond, [0, 1]);
            let what = format!("{a:?} {b:?} {cond:?}: {found:?}, not {expected:?}");
            if is_exact(cond, [a, b]) {
                assert_eq!(found, expected, "{what}");
            } else {
                assert_eq!(found.is_some(), expected.is_some(), "{what}");
                let both = found.iter().flatten().zip(expected.iter().flatten());
                both.for_each(|(found, expected)| assert!(covers(*found, *expected), "{what}"));
            }
            cases[usize::from(is_exact(cond, [a, b]))] += 1;
        }
    }
    assert_eq!(cases.iter().sum::<usize>(), 28 * 28 * 15);
    assert!(cases[1] > 6000, "{cases:?}");
}

/// A condition that holds leaves no room for its inverse, and none for what its values exclude.
fn conditions<C: Claims>() {
    let compared: C = run(&[(0, [i32::MIN, i32::MAX]), (1, [5, 7])], &["cmp r0, r1"]);
    for (cond, inverse) in Cond::ALL.into_iter().filter_map(|c| Some((c, c.invert()?))) {
        let mut claims = compared.clone();
        assert!(claims.assume(cond) && claims.clone().assume(cond));
        assert!(!claims.assume(inverse), "{cond:?}");
    }
    let then = |first, second| {
        let mut claims = compared.clone();
        claims.assume(first) && claims.assume(second)
    };
    assert!(!then(Cond::EQ, Cond::MI) && !then(Cond::GT, Cond::VS));
    assert!(!then(Cond::EQ, Cond::CC) && then(Cond::LT, Cond::CS) && then(Cond::LT, Cond::VS));
    let same: C = run(&[(0, [-9, 9])], &["cmp r0, r0"]);
    assert_eq!(where_holds(&same, Cond::NE, [0]), None);
    assert_eq!(where_holds(&same, Cond::EQ, [0]), Some([[-9, 9]]));
    for (known, zero, left) in [
        ([-3, 0], false, Some([-3, -1])),
        ([0, 3], false, Some([1, 3])),
        ([-3, 3], false, Some([-3, 3])),
        ([0, 0], false, None),
        ([-3, 3], true, Some([0, 0])),
        ([1, 3], true, None),
    ] {
        let mut claims = C::of(&[(0, known)]);
        let found = claims.assume_zero(0, zero).then(|| claims.ends(0));
        assert_eq!(found, left, "{known:?}");
    }
    // What is said once is narrowed once more by what is said later.
    let mut twice: C = run(&[(0, [-9, 9]), (1, [0, 5])], &["cmp r0, r1"]);
    assert!(twice.assume(Cond::GE) && twice.assume_zero(1, false) && twice.assume(Cond::GE));
    assert_eq!([twice.ends(0), twice.ends(1)], [[1, 9], [1, 5]]);
}

/// The sign and the zero of a result, and of what it was made of by a subtraction.
fn results<C: Claims>() {
    for a in intervals() {
        for (text, by) in [("adds r2, r0, #0", 0), ("subs r2, r0, #1", 1)] {
            let made: C = run(&[(0, a)], &[text]);
            let wraps = a[0] < i32::MIN + by;
            let of_result = |set: u16, &x: &i32| {
                let [n, z, ..] = flags(x, by);
                set | (bit([n, z, false, false]) * 15)
            };
            let possible = words(a).iter().fold(0, of_result);
            let told = if by == 0 { possible } else { !0 };
            assert!(wraps || made.flags() & !possible == 0, "{text} {a:?}");
            assert_eq!(made.flags() & told, made.flags(), "{text} {a:?}");
            assert!(
                by != 0 || made.flags() == possible,
                "{text} {a:?}: {:b}",
                made.flags()
            );
            for cond in [Cond::MI, Cond::PL, Cond::EQ, Cond::NE] {
                let holds = |&x: &i32| {
                    let [n, z, ..] = flags(x, by);
                    cond.holds(n, z, false, false)
                };
                let words = words(a).into_iter().filter(holds);
                let results = hull(words.map(|x| x.wrapping_sub(by).into()));
                let found = where_holds(&made, cond, [2]).map(|at| at[0]);
                let is_right = match (wraps, results) {
                    (true, Some(results)) => found.is_some_and(|f: Ends| covers(f, results)),
                    (true, None) => true,
                    (false, _) => found == results,
                };
                assert!(
                    is_right,
                    "{text} {a:?} {cond:?}: {found:?}, not {results:?}"
                );
            }
        }
    }
}
