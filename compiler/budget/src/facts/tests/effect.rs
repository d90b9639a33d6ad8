//! What an instruction makes of the words of two intervals, against words tried one by one.

use whippen_isa::{Arch, Cond, parse};

use super::flags::{after, intervals, words};
use super::{Facts, Interval};
use crate::Code;

/// What is told of a result.
#[derive(Clone, Copy)]
enum Told {
    /// From the least to the greatest, or any word where one may wrap.
    Ends,
    /// The same where it is one word or all lie between these, else these.
    Reach(i64, i64),
    /// The same of one word, else these.
    Mask(i64, i64),
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
        Told::Mask(i32::MIN as i64, i32::MAX as i64),
    ),
    (
        "eors r2, r1",
        |_, _| 0,
        Told::Always(i32::MIN as i64, i32::MAX as i64),
    ),
];

#[test]
fn an_instruction_makes_what_its_words_make() {
    for &(text, value, told) in MADE {
        for (a, b) in intervals().flat_map(|a| intervals().map(move |b| (a, b))) {
            let found = after(&[(0, a), (1, b)], text).interval(2);
            let of_left = |x: i32| words(b).into_iter().map(move |y| (x, y));
            let results = words(a).into_iter().flat_map(of_left);
            let results = results.map(|(x, y)| value(i64::from(x), i64::from(y)));
            let all = results.map(|at| Interval { low: at, high: at });
            let all = all.reduce(Interval::hull).expect("words");
            let given = Interval {
                low: a[0].into(),
                high: a[1].into(),
            };
            let of = |low, high| Interval { low, high };
            let expected = match told {
                Told::Ends => Interval::of(all.low, all.high),
                Told::Reach(low, high) if of(low, high).covers(given) => given,
                Told::Mask(..) if a[0] == a[1] => all,
                Told::Reach(low, high) | Told::Mask(low, high) | Told::Always(low, high) => {
                    of(low, high)
                }
            };
            assert_eq!(found, expected, "{text} of {a:?} and {b:?}");
        }
    }
}

/// Several texts, from what is known of R0 to R3.
fn run(known: &[(u8, [i32; 2])], texts: &[&str]) -> Facts {
    let known = known.iter();
    let known = known.map(|&(register, ends)| (register, ends.map(|end| end as u32)));
    texts
        .iter()
        .fold(Facts::of_registers(&known.collect()), |mut facts, text| {
            let inst = parse(text, Arch::V8M, None).expect("an instruction");
            facts.execute(
                &inst,
                0x100,
                &Code::new(0x108, vec![0x78, 0x56, 0x34, 0x12]),
            );
            facts
        })
}

fn ends(facts: &Facts, register: u8) -> [i64; 2] {
    let found = facts.interval(register);
    [found.low, found.high]
}

#[test]
fn sums_of_products_lie_between_their_corners() {
    for (a, b) in intervals().flat_map(|a| intervals().map(move |b| (a, b))) {
        let facts = run(&[(0, a), (1, b), (3, [10, 20])], &["mla r2, r0, r1, r3"]);
        let corners = a
            .into_iter()
            .flat_map(|x| b.map(|y| i64::from(x) * i64::from(y)));
        let products: Vec<i64> = corners.collect();
        let [least, most] = [products.iter().min(), products.iter().max()].map(|p| *p.expect("4"));
        assert_eq!(
            facts.interval(2),
            Interval::of(least + 10, most + 20),
            "{a:?} {b:?}"
        );
    }
}

/// Constants in two halves, constants beside the code, and what loads of less than a word may read.
#[test]
fn constants_and_loads() {
    let of_r2 = |texts: &[&str]| ends(&run(&[(0, [0, 9])], texts), 2);
    assert_eq!(
        of_r2(&["movw r2, #0x5678", "movt r2, #0x1234"]),
        [0x1234_5678; 2]
    );
    let any = [i64::from(i32::MIN), i64::from(i32::MAX)];
    assert_eq!(of_r2(&["mov r2, r0", "movt r2, #0x1234"]), any);
    assert_eq!(of_r2(&["ldr r2, [pc, #4]"]), [0x1234_5678; 2]);
    assert_eq!(of_r2(&["ldr r2, [pc, #8]"]), any);
    for (text, reach) in [
        ("ldrb r2, [r0]", [0, 0xff]),
        ("ldrb r2, [r0, r1]", [0, 0xff]),
        ("ldrh r2, [r0]", [0, 0xffff]),
        ("ldrsb r2, [r0, r1]", [-128, 127]),
        ("ldrsh r2, [r0, r1]", [-32768, 32767]),
        ("ldr r2, [r0]", any),
        ("umull r2, r3, r0, r1", any),
        ("lsl.w r2, r0, r1", any),
    ] {
        assert_eq!(of_r2(&["movs r2, #1", text]), reach, "{text}");
    }
    // A base that is written back is another word.
    let facts = run(&[(0, [0, 9])], &["ldrb r2, [r0], #1"]);
    assert_eq!([ends(&facts, 0), ends(&facts, 2)], [any, [0, 0xff]]);
    let facts = run(&[(0, [0, 9]), (1, [5, 5])], &["ldm r0!, {r1, r2}"]);
    assert_eq!([ends(&facts, 0), ends(&facts, 1)], [any, any]);
}

/// What is compared, by text: a condition then narrows R0.
#[test]
fn which_instructions_compare() {
    let narrowed = |text: &str, cond| {
        let mut facts = run(&[(0, [-10, 10]), (1, [5, 5])], &[text]);
        facts.assume(cond).then(|| ends(&facts, 0))
    };
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
        ("orrs r0, r1", Cond::PL, [0, i64::from(i32::MAX)]),
        ("mov r3, r0", Cond::EQ, [-10, 10]),
    ] {
        assert_eq!(narrowed(text, cond), Some(left), "{text}");
    }
    let tested = |word, cond| {
        let mut facts = run(&[(0, [word, word])], &["tst.w r0, #0x80"]);
        facts.assume(cond)
    };
    assert!(tested(0x80, Cond::NE) && !tested(0x80, Cond::EQ));
    assert!(tested(0x7f, Cond::EQ) && !tested(0x7f, Cond::NE));
    // What sets flags that nobody knows, and what keeps them.
    let mut facts = run(&[(0, [1, 1])], &["cmp r0, #1", "adds r2, r1, r3"]);
    assert!(facts.assume(Cond::NE));
    let mut facts = run(&[(0, [1, 1])], &["cmp r0, #1", "add.w r2, r1, r3"]);
    assert!(!facts.assume(Cond::NE));
    // A copy is the word itself: what is said of one is said of the other.
    let mut facts = run(&[(0, [-10, 10])], &["mov r3, r0", "cmp r3, #0"]);
    assert!(facts.assume(Cond::GT));
    assert_eq!(ends(&facts, 0), [1, 10]);
    assert!(facts.assume_zero(0, false) && !facts.assume_zero(3, true));
}
