//! Functions that are bounded elsewhere, and the return of an exception's handler.

use whippen_budget::{Annotations, Code, Known};
use whippen_isa::Arch;
use whippen_words::assembled;

use super::{CODE, bound_of, returning};

fn cycles(texts: &[&str], annotations: &Annotations) -> u64 {
    let code = Code::new(CODE, assembled(texts, Arch::V8M));
    let bound = bound_of(&code, CODE, annotations).expect("a bound");
    let sum: u64 = bound.path.iter().map(|step| step.cycles).sum();
    assert_eq!(sum, bound.cycles_max);
    bound.cycles_max
}

/// Where the function is that is bounded elsewhere: there are no bytes.
const ELSEWHERE: u32 = CODE + 0x100;

/// With such a function of so many cycles, wherever it is called from or from there alone.
fn knowing(at: Option<u32>, cycles: u64) -> Annotations {
    let known = Known {
        cycles,
        stack_bytes: 0,
    };
    Annotations {
        known: [((at, ELSEWHERE), known)].into(),
        ..returning()
    }
}

#[test]
fn a_function_that_is_bounded_elsewhere_costs_what_is_said() {
    // BL at 0x20000102, and its target 0x20000200.
    let call = ["push {r4, lr}", "bl .+254", "pop {r4, pc}"];
    let of = |known| cycles(&call, &known);
    let none = of(knowing(None, 0));
    assert_eq!(of(knowing(None, 100)), none + 100);
    assert_eq!(of(knowing(Some(CODE + 2), 7)), none + 7);
    let mut both = knowing(None, 100);
    both.known.extend(knowing(Some(CODE + 2), 7).known);
    assert_eq!(of(both), none + 7, "what is said of the call itself");
    let other = knowing(Some(CODE), 7);
    let code = Code::new(CODE, assembled(&call, Arch::V8M));
    assert!(bound_of(&code, CODE, &other).is_err());
}

/// It may leave anything in registers: a division behind it is not cut.
#[test]
fn what_was_known_is_forgotten_behind_a_call() {
    let division = "udiv r2, r3, r4";
    let around = |call: &str| {
        let texts = ["push {r4, lr}", "movs r0, #0", call];
        let texts = [&texts[..], &["cbz r0, .+6", division, "pop {r4, pc}"]].concat();
        cycles(&texts, &knowing(None, 0))
    };
    // BL at 0x20000104.
    let (called, cut) = (around("bl .+252"), around("mov.w r5, #1"));
    assert!(called >= cut + 10, "{called}, and {cut} without a call");
}

/// In a loop nothing is known behind its call either, not even of what it does not write.
#[test]
fn nothing_is_known_in_a_loop_that_calls() {
    let texts = [
        "push {r4, lr}",
        "movs r0, #0",
        // The head, at 0x20000104.
        "cbz r0, .+6",
        "udiv r2, r3, r4",
        "bl .+246",
        "subs r5, #1",
        "bne .-12",
        "pop {r4, pc}",
    ];
    let of = |rounds| {
        let mut annotations = knowing(None, 0);
        annotations.loops.insert(CODE + 4, rounds);
        cycles(&texts, &annotations)
    };
    let [once, twice, thrice] = [of(1), of(2), of(3)];
    assert!(twice - once > 10, "{once}, {twice}");
    assert_eq!(thrice - twice, twice - once);
}

/// How long an exception takes to return is not the handler's: no pipeline is filled again.
#[test]
fn a_return_from_an_exception_is_no_branch() {
    let handler = Annotations {
        handler: true,
        ..Annotations::default()
    };
    let of = |texts: &[&str]| [&handler, &returning()].map(|how| cycles(texts, how));
    let [own, branch] = of(&["push {r4, lr}", "pop {r4, pc}"]);
    assert!(branch > own, "{own}, {branch}");
    // Each register more is a word more, of which the return loads one.
    let words = |registers: &str| {
        let texts = [
            format!("push {{{registers}, lr}}"),
            format!("pop {{{registers}, pc}}"),
        ];
        cycles(&texts.each_ref().map(String::as_str), &handler)
    };
    assert_eq!([words("r4"), words("r4-r7")], [2 + 2, 5 + 5]);
    // BX LR is a cycle, and two more where it is a branch that is taken.
    assert_eq!(of(&["adds r0, #1", "adds r1, #1", "nop.w", "bx lr"])[0], 4);
}

/// Whether the pipeline holds nothing at any end, and nothing that delays what follows.
#[test]
fn what_is_left_in_the_pipeline_is_told() {
    let left = |texts: &[&str], stop: Option<u32>| {
        let annotations = Annotations {
            stops: stop.into_iter().collect(),
            ..returning()
        };
        let bound = bound_of(
            &Code::new(CODE, assembled(texts, Arch::V8M)),
            CODE,
            &annotations,
        );
        let bound = bound.expect("a bound");
        [bound.settled, bound.delays_nobody]
    };
    assert_eq!(left(&["adds r0, #1", "bx lr"], None), [true; 2]);
    assert_eq!(left(&["vdiv.f32 s0, s1, s2", "bx lr"], None), [false; 2]);
    assert_eq!(left(&["ldr r0, [r1]", "nop"], Some(CODE + 2)), [false; 2]);
    // On one way of two, whichever comes first.
    let divides = ["cbz r0, .+6", "vdiv.f32 s0, s1, s2", "bx lr"];
    assert_eq!(left(&divides, None), [false; 2]);
    let divides = ["cbz r0, .+4", "bx lr", "vdiv.f32 s0, s1, s2", "bx lr"];
    assert_eq!(left(&divides, None), [false; 2]);
}

/// A division is as long as the bits of its quotient: those of the largest dividend without those
/// of the smallest divisor, as words with a sign or without.
#[test]
fn a_division_takes_what_its_operands_allow() {
    let of = |text: &str, r2: [i32; 2], r3: [i32; 2]| {
        let known = [(2, r2), (3, r3)].map(|(at, ends)| (at, ends.map(|end| end as u32)));
        let annotations = Annotations {
            entered: known.into(),
            ..returning()
        };
        cycles(&[text, "bx lr"], &annotations)
    };
    let [udiv, sdiv] = ["udiv r1, r2, r3", "sdiv r1, r2, r3"];
    let divide = whippen_isa::timing::Core::cortex_m33().divide;
    let none = of(udiv, [1, 3], [16, 31]);
    let bits = |bits: u64| {
        let start = u64::from(divide.start.cycles);
        none + start + bits / u64::from(divide.bits_per_cycle.cycles)
    };
    assert_eq!(of(udiv, [0x10, 0xff], [0x10, 0x1f]), bits(7 - 4));
    assert_eq!(of(sdiv, [0x10, 0xff], [0x10, 0x1f]), bits(7 - 4));
    assert_eq!(of(sdiv, [-0x100, -1], [0x10, 0x1f]), bits(8 - 4));
    assert_eq!(of(udiv, [-0x100, -1], [0x10, 0x1f]), bits(31 - 4));
}
