//! What an instruction makes of the words of two intervals.

use whippen_isa::Cond;

use super::{ANY, Claims, Ends, covers, hull, pairs, pairs_of_intervals, run, where_holds};

/// Instructions make what their words make.
pub fn instructions<C: Claims>() {
    made::<C>();
    products::<C>();
    loads_and_constants::<C>();
    flags_of_texts::<C>();
}

/// What is told of a result.
#[derive(Clone, Copy)]
enum Told {
    /// From the least to the greatest, or any word where one may wrap.
    Ends,
    /// The same where it is one word or all lie between these, else these.
    Reach(i64, i64),
    /// The same of one word, else these.
    Mask(i64, i64),
    /// The same of words above 0, else any word.
    Positive,
    /// These.
    Always(i64, i64),
}

/// A text that makes R2 of R0 and R1, the result as a number of any size, and what is told of it.
type Made = (&'static str, fn(i64, i64) -> i64, Told);

fn unsigned(x: i64) -> i64 {
    x & 0xffff_ffff
}

fn low_bits(x: i64, bits: u32) -> i64 {
    x << (64 - bits) >> (64 - bits)
}

const NOTHING: Told = Told::Always(ANY[0], ANY[1]);

const MADE: &[Made] = &[
    ("mov r2, r0", |x, _| x, Told::Ends),
    ("mov.w r2, #0x1fc0", |_, _| 0x1fc0, Told::Ends),
    ("mvn r2, #5", |_, _| !5, Told::Ends),
    ("add.w r2, r0, #5", |x, _| x + 5, Told::Ends),
    ("sub.w r2, r0, #5", |x, _| x - 5, Told::Ends),
    ("rsb r2, r0, #5", |x, _| 5 - x, Told::Ends),
    ("add.w r2, r0, r1", |x, y| x + y, Told::Ends),
    ("add.w r2, r0, r1, lsl #2", |x, y| x + y * 4, Told::Ends),
    ("sub.w r2, r0, r1", |x, y| x - y, Told::Ends),
    ("add.w r2, r0, r1, lsr #2", |x, y| x + y, NOTHING),
    ("sub.w r2, r0, r1, lsl #1", |x, y| x - y * 2, NOTHING),
    (
        "clz r2, r0",
        |x, _| i64::from((x as u32).leading_zeros()),
        Told::Positive,
    ),
    ("ubfx r2, r0, #0, #32", |x, _| x, NOTHING),
    ("sbfx r2, r0, #0, #32", |x, _| x, NOTHING),
    ("lsls r2, r0, #3", |x, _| x * 8, Told::Ends),
    ("asrs r2, r0, #3", |x, _| x >> 3, Told::Ends),
    ("asrs r2, r0, #32", |x, _| x >> 32, Told::Ends),
    ("lsrs r2, r0, #3", |x, _| unsigned(x) >> 3, Told::Ends),
    ("lsrs r2, r0, #32", |x, _| unsigned(x) >> 32, Told::Ends),
    ("ssat r2, #5, r0", |x, _| x.clamp(-16, 15), Told::Ends),
    ("usat r2, #5, r0", |x, _| x.clamp(0, 31), Told::Ends),
    ("ssat r2, #3, r0", |x, _| x.clamp(-4, 3), Told::Ends),
    ("usat r2, #2, r0", |x, _| x.clamp(0, 3), Told::Ends),
    ("uxtb r2, r0", |x, _| x & 0xff, Told::Reach(0, 0xff)),
    ("uxth r2, r0", |x, _| x & 0xffff, Told::Reach(0, 0xffff)),
    ("sxtb r2, r0", |x, _| low_bits(x, 8), Told::Reach(-128, 127)),
    (
        "sxth r2, r0",
        |x, _| low_bits(x, 16),
        Told::Reach(-32768, 32767),
    ),
    (
        "uxtb.w r2, r0, ror #8",
        |x, _| x >> 8 & 0xff,
        Told::Always(0, 0xff),
    ),
    (
        "ssat r2, #5, r0, lsl #1",
        |x, _| low_bits(x * 2, 32).clamp(-16, 15),
        Told::Always(-16, 15),
    ),
    (
        "ubfx r2, r0, #3, #5",
        |x, _| x >> 3 & 31,
        Told::Always(0, 31),
    ),
    (
        "sbfx r2, r0, #3, #5",
        |x, _| low_bits(x >> 3, 5),
        Told::Always(-16, 15),
    ),
    ("and r2, r0, #255", |x, _| x & 255, Told::Mask(0, 255)),
    (
        "and r2, r0, #0xfe000000",
        |x, _| x & -0x200_0000,
        Told::Mask(ANY[0], ANY[1]),
    ),
    ("eors r2, r1", |_, _| 0, NOTHING),
];

/// From one to the other, or any word where one is no word.
fn wrapped([low, high]: Ends) -> Ends {
    if covers(ANY, [low, high]) {
        [low, high]
    } else {
        ANY
    }
}

/// An instruction makes of intervals what it makes of their words.
fn made<C: Claims>() {
    for &(text, value, told) in MADE {
        for [a, b] in pairs_of_intervals() {
            let found = run::<C>(&[(0, a), (1, b)], &[text]).ends(2);
            let results = pairs([a, b]).into_iter();
            let results = results.map(|(x, y)| value(i64::from(x), i64::from(y)));
            let all = hull(results).expect("words");
            let given = a.map(i64::from);
            let expected = match told {
                Told::Ends => wrapped(all),
                Told::Reach(low, high) if covers([low, high], given) => given,
                Told::Mask(..) if a[0] == a[1] => all,
                Told::Positive if a[0] > 0 => all,
                Told::Positive => ANY,
                Told::Reach(low, high) | Told::Mask(low, high) | Told::Always(low, high) => {
                    [low, high]
                }
            };
            assert_eq!(found, expected, "{text} of {a:?} and {b:?}");
        }
    }
}

/// Sums of products lie between those of their corners.
fn products<C: Claims>() {
    for [a, b] in pairs_of_intervals() {
        let known = [(0, a), (1, b), (3, [10, 20])];
        let found = run::<C>(&known, &["mla r2, r0, r1, r3"]).ends(2);
        let corners = a
            .into_iter()
            .flat_map(|x| b.map(|y| i64::from(x) * i64::from(y)));
        let [least, most] = hull(corners).expect("four");
        assert_eq!(found, wrapped([least + 10, most + 20]), "{a:?} {b:?}");
    }
}

/// Constants in two halves, constants beside the code, what loads of less than a word may read, and
/// what is not known.
fn loads_and_constants<C: Claims>() {
    let of_r2 = |texts: &[&str]| run::<C>(&[(0, [0, 9])], texts).ends(2);
    let halves = ["movw r2, #0x5678", "movt r2, #0x1234"];
    assert_eq!(of_r2(&halves), [0x1234_5678; 2]);
    assert_eq!(of_r2(&["mov r2, r0", "movt r2, #0x1234"]), ANY);
    assert_eq!(of_r2(&["ldr r2, [pc, #4]"]), [0x1234_5678; 2]);
    assert_eq!(of_r2(&["ldr r2, [pc, #8]"]), ANY);
    for (text, reach) in [
        ("ldrb r2, [r0]", [0, 0xff]),
        ("ldrb r2, [r0, r1]", [0, 0xff]),
        ("ldrh r2, [r0]", [0, 0xffff]),
        ("ldrsb r2, [r0, r1]", [-128, 127]),
        ("ldrsh r2, [r0, r1]", [-32768, 32767]),
        ("ldr r2, [r0]", ANY),
        ("umull r2, r3, r0, r1", ANY),
        ("lsl.w r2, r0, r1", ANY),
        ("sub.w r2, r0, r1, lsl #1", ANY),
    ] {
        assert_eq!(of_r2(&["movs r2, #1", text]), reach, "{text}");
    }
    // A base that is written back is another word.
    let claims: C = run(&[(0, [0, 9])], &["ldrb r2, [r0], #1"]);
    assert_eq!([claims.ends(0), claims.ends(2)], [ANY, [0, 0xff]]);
    // What has no result leaves all registers, those that nobody claims anything of included.
    for text in ["tst.w r0, #0x80", "cmp r0, #3", "str r0, [r1]", "nop"] {
        let claims: C = run(&[(0, [0, 9])], &[text]);
        let left = (0..16).map(|register| claims.ends(register));
        assert!(
            left.skip(1).all(|ends| ends == ANY) && claims.ends(0) == [0, 9],
            "{text}"
        );
    }
    let claims: C = run(&[(0, [0, 9]), (1, [5, 5])], &["ldm r0!, {r1, r2}"]);
    assert_eq!([claims.ends(0), claims.ends(1)], [ANY, ANY]);
}

/// What texts compare or show: a condition then narrows R0.
fn flags_of_texts<C: Claims>() {
    for (text, cond, left) in [
        ("cmp r0, #3", Cond::GT, [4, 10]),
        ("subs r2, r0, #3", Cond::LT, [-10, 2]),
        ("subs r0, r0, #3", Cond::MI, [-13, -1]),
        ("rsbs r2, r0, #3", Cond::LT, [4, 10]),
        ("cmp r0, r1", Cond::EQ, [5, 5]),
        ("subs r2, r0, r1", Cond::GE, [5, 10]),
        ("subs.w r2, r0, r1, lsl #1", Cond::GE, [-10, 10]),
        ("cmn r0, #3", Cond::GT, [-10, 10]),
        ("ands r0, r0, #7", Cond::NE, [1, 7]),
        ("orrs r0, r1", Cond::PL, [0, ANY[1]]),
        ("mov r3, r0", Cond::EQ, [-10, 10]),
    ] {
        let claims: C = run(&[(0, [-10, 10]), (1, [5, 5])], &[text]);
        assert_eq!(where_holds(&claims, cond, [0]), Some([left]), "{text}");
    }
    let can = |word, texts: &[&str], cond| run::<C>(&[(0, [word, word])], texts).assume(cond);
    let tested = |word, cond| can(word, &["tst.w r0, #0x80"], cond);
    assert!(tested(0x80, Cond::NE) && !tested(0x80, Cond::EQ));
    assert!(tested(0x7f, Cond::EQ) && !tested(0x7f, Cond::NE));
    // No word is negative and zero.
    let mut claims: C = run(&[(0, [-9, 9])], &["tst.w r0, #0xfe000000"]);
    assert!(claims.assume(Cond::MI) && !claims.assume(Cond::EQ));
    // What sets flags that nobody knows, and what keeps them.
    assert!(can(1, &["cmp r0, #1", "adds r2, r1, r3"], Cond::NE));
    assert!(!can(1, &["cmp r0, #1", "add.w r2, r1, r3"], Cond::NE));
    // PC is another word at each instruction.
    let mut claims: C = run(&[], &["mov r2, pc", "mov r3, pc", "cmp r2, r3"]);
    assert!(claims.assume(Cond::NE));
    // A copy is the word itself: what is said of one is said of the other. So is a word that is
    // extended or limited to more than it may be.
    for text in [
        "mov r3, r0",
        "ssat r3, #5, r0",
        "usat r3, #5, r0",
        "sxtb r3, r0",
        "uxth r3, r0",
    ] {
        let claims: C = run(&[(0, [0, 9])], &[text, "cmp r3, r0"]);
        assert_eq!(where_holds(&claims, Cond::NE, [0]), None, "{text}");
    }
    let mut claims: C = run(&[(0, [-10, 10])], &["mov r3, r0", "cmp r3, #0"]);
    assert!(claims.assume(Cond::GT));
    assert_eq!(claims.ends(0), [1, 10]);
    assert!(claims.assume_zero(0, false) && !claims.assume_zero(3, true));
}
