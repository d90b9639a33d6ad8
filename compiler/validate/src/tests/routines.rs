//! Routines of a core without long products: sums of products of halves are one product.

use whippen_deterministic::Rng;
use whippen_ids::IdMap;
use whippen_isa::{Arch, ItState, Op, parse};
use whippen_kernel::Kernel;
use whippen_modes::Modes;

use crate::contract::shown;
use crate::machine::Machine;
use crate::places::{Called, Code, Places, Question, Shared, Symbols};
use crate::root::loop_at;
use crate::stop::Told;
use crate::term::{Kind, Term, Terms};

/// Where the code lies.
const CODE: u32 = 0x2000_0000;

/// `mul_top` of `compiler/arm/src/thumb/v6m/routines.s`, but for how it ends.
const HALVES: [u16; 17] = [
    0xb282, 0xb28b, 0x1400, 0x1409, 0x4694, 0x435a, 0x4343, 0x4348, 0x0c12, 0x189b, 0x4662, 0x4351,
    0xb29a, 0x1889, 0x141b, 0x18c0, 0x1409,
];
/// `adcs r0, r1` rounds half up; `adds r0, r0, r1` rounds down. `adcs r1, r0` has another result.
const ENDS: [(u16, i128, bool); 4] = [
    (0x4148, 1 << 31, true),
    (0x1840, 0, true),
    (0x4148, 0, false),
    (0x4141, 1 << 31, false),
];

/// A question about some code.
fn asked<T>(halves: &[u16], arch: Arch, ask: impl FnOnce(&Question) -> T) -> T {
    let modes = Modes {
        kernel: Kernel::default(),
        modes: IdMap::new().into(),
        work_limited: false,
    };
    let bytes = halves.iter().flat_map(|half| half.to_le_bytes());
    let code = Code {
        pieces: vec![(CODE, bytes.collect())],
        data: Vec::new(),
    };
    let question = Question {
        modes: &modes,
        shared: &Shared::default(),
        code: &code,
        symbols: &Symbols::default(),
        places: &Places::default(),
        arch,
    };
    ask(&question)
}

/// What a routine leaves in R0.
fn result(halves: &[u16], terms: &mut Terms) -> Told<Term> {
    asked(halves, Arch::V6M, |question| {
        let mut machine = Machine::new(question, terms, CODE);
        machine.run(terms)?;
        Ok(machine.registers[0])
    })
}

/// `divide` and `leading_zeros` of `compiler/arm/src/thumb/v6m/routines.s`.
const DIVIDE: &[&str] = &[
    "movs r2, #0",
    "movs r3, #32",
    "cmp r1, #0",
    "beq .+22",
    "adds r0, r0, r0",
    "adcs r2, r2",
    "bcs .+6",
    "cmp r2, r1",
    "bcc .+6",
    "subs r2, r2, r1",
    "adds r0, #1",
    "subs r3, #1",
    "bne .-16",
    "bx lr",
    "movs r0, #0",
    "bx lr",
];
const LEADING_ZEROS: &[&str] = &[
    "movs r1, #32",
    "cmp r0, #0",
    "beq .+42",
    "movs r1, #0",
    "lsrs r2, r0, #16",
    "bne .+6",
    "adds r1, #16",
    "lsls r0, r0, #16",
    "lsrs r2, r0, #24",
    "bne .+6",
    "adds r1, #8",
    "lsls r0, r0, #8",
    "lsrs r2, r0, #28",
    "bne .+6",
    "adds r1, #4",
    "lsls r0, r0, #4",
    "lsrs r2, r0, #30",
    "bne .+6",
    "adds r1, #2",
    "lsls r0, r0, #2",
    "lsrs r2, r0, #31",
    "bne .+4",
    "adds r1, #1",
    "movs r0, r1",
    "bx lr",
];

/// Code of some lines, some of them with another text.
fn code_of(lines: &[&str], arch: Arch, others: &[(usize, &str)]) -> Vec<u16> {
    let mut it = ItState::OUTSIDE;
    let mut halves = Vec::new();
    for (at, line) in lines.iter().enumerate() {
        let other = others.iter().find(|(own, _)| *own == at);
        let text = other.map_or(*line, |own| own.1);
        let inst = parse(text, arch, it.cond()).unwrap_or_else(|why| panic!("{text}: {why:?}"));
        it = match inst.op() {
            Op::IT => ItState::after_it((inst.imm >> 4) as u8, 8).unwrap_or_default(),
            _ => it.advance(),
        };
        match inst.encode(arch) {
            Ok(whippen_isa::Code::Narrow(half)) => halves.push(half),
            Ok(whippen_isa::Code::Wide(first, second)) => halves.extend([first, second]),
            Err(why) => panic!("{text}: {why:?}"),
        }
    }
    halves
}

/// `mul_top` of the same file; `mul_high` has another end.
const MUL_TOP: &[&str] = &[
    "uxth r2, r0",
    "uxth r3, r1",
    "asrs r0, r0, #16",
    "asrs r1, r1, #16",
    "mov r12, r2",
    "muls r2, r3, r2",
    "muls r3, r0, r3",
    "muls r0, r1, r0",
    "lsrs r2, r2, #16",
    "adds r3, r3, r2",
    "mov r2, r12",
    "muls r1, r2, r1",
    "uxth r2, r3",
    "adds r1, r1, r2",
    "asrs r3, r3, #16",
    "adds r0, r0, r3",
    "asrs r1, r1, #16",
    "adcs r0, r1",
    "bx lr",
];
/// `add_sat` of `compiler/arm/src/thumb/v6m/saturate.s`; `sub_sat` begins otherwise.
const ADD_SAT: &[&str] = &[
    "adds r0, r0, r1",
    "bvc .+10",
    "asrs r0, r0, #31",
    "movs r1, #1",
    "lsls r1, r1, #31",
    "eors r0, r1",
    "bx lr",
];

/// How many contracts are shown of a routine, with one of its lines as another text.
fn contracts(lines: &[&str], other: Option<(usize, &str)>, called: Called) -> usize {
    let halves = code_of(lines, Arch::V6M, other.as_slice());
    asked(&halves, Arch::V6M, |question| {
        let symbols = Symbols {
            called: vec![(called, CODE)],
            ..Symbols::default()
        };
        let question = Question {
            symbols: &symbols,
            ..question.clone()
        };
        shown(&question).len()
    })
}

#[test]
fn routines_give_what_they_are_called_for() {
    for (lines, called, faults) in [
        (
            DIVIDE,
            Called::Quotient,
            &[
                (0, "movs r2, #1"),
                (1, "movs r3, #31"),
                (2, "cmp r0, #0"),
                (5, "adds r2, r2, r2"),
                (6, "bcc .+6"),
                (8, "bcs .+6"),
                (8, "bls .+6"),
                (9, "subs r2, r2, r0"),
                (10, "adds r0, #2"),
                (11, "subs r3, #2"),
                (12, "beq .-16"),
                (14, "movs r0, #1"),
            ][..],
        ),
        (
            LEADING_ZEROS,
            Called::LeadingZeros,
            &[
                (0, "movs r1, #31"),
                (3, "movs r1, #1"),
                (4, "lsrs r2, r0, #15"),
                (5, "beq .+6"),
                (7, "lsls r0, r0, #15"),
                (10, "adds r1, #7"),
                (22, "adds r1, #2"),
                (23, "movs r0, r2"),
            ],
        ),
    ] {
        assert_eq!(contracts(lines, None, called), 1, "{called:?}");
        for fault in faults {
            let shown = contracts(lines, Some(*fault), called);
            assert_eq!(shown, 0, "{called:?}, {fault:?}");
        }
    }
}

/// What is shown of a round, 32 times, is a quotient.
#[test]
fn rounds_of_a_division_are_the_quotient() {
    let mut rng = Rng::new(5);
    for _ in 0..20_000 {
        let [of, by] = [0; 2].map(|_| rng.next() as u32 >> rng.pick(&[0, 1, 8, 16, 24, 31]));
        let by = by.max(1);
        let (mut digits, mut rest) = (of, 0_u64);
        for _ in 0..32 {
            let dividend = 2 * rest + u64::from(digits >> 31);
            let goes = dividend >= u64::from(by);
            rest = dividend - if goes { u64::from(by) } else { 0 };
            digits = digits << 1 | u32::from(goes);
        }
        assert_eq!((digits, rest), (of / by, u64::from(of % by)));
    }
}

#[test]
fn products_of_halves_are_the_top_word_of_a_product() {
    for (end, added, is_so) in ENDS {
        let halves = [&HALVES[..], &[end, 0x4770]].concat();
        let mut terms = Terms::default();
        let found = result(&halves, &mut terms).expect("it is followed");
        let [a, b] = [0, 1].map(|register| terms.of(Kind::Register(register)));
        let product = terms.mul(a, b).expect("it is no large number");
        let sum = terms.plus(product, added).expect("it is no large number");
        let top = terms.floor(sum, 32).expect("it is no large number");
        assert_eq!(found == top, is_so, "{}", terms.show(found));
    }
}

/// Where it is known that an access lies between two of its size, it is not followed.
#[test]
fn accesses_between_two_others_are_not_followed() {
    for (access, by) in [
        ("ldr r0, [r1]", 4),
        ("str r0, [r1]", 4),
        ("ldrh r0, [r1]", 2),
        ("ldrsb r0, [r1, r2]", 1),
    ] {
        for offset in 0..8 {
            let at = format!("movs r1, #{offset}");
            let lines = ["movs r2, #0", &at, access, "bx lr"];
            let followed = result(&code_of(&lines, Arch::V6M, &[]), &mut Terms::default());
            assert_eq!(followed.is_ok(), offset % by == 0, "{access} behind {at}");
        }
    }
}

#[test]
fn products_and_saturating_sums_are_shown() {
    let with = |lines: &[&'static str], at: usize, text: &'static str| {
        let mut lines = lines.to_vec();
        lines[at] = text;
        lines
    };
    let all = [
        (MUL_TOP.to_vec(), Called::TopRounded),
        (with(MUL_TOP, 17, "adds r0, r0, r1"), Called::Top),
        (ADD_SAT.to_vec(), Called::SumSaturated),
        (
            with(ADD_SAT, 0, "subs r0, r0, r1"),
            Called::DifferenceSaturated,
        ),
    ];
    for (lines, called) in &all {
        for other in Called::ALL {
            let shown = contracts(lines, None, other);
            assert_eq!(shown == 1, other == *called, "{called:?} as {other:?}");
        }
    }
    let of_products = [
        (0, "uxth r2, r1"),
        (4, "mov r11, r2"),
        (4, "mov r12, r3"),
        (7, "muls r0, r3, r0"),
        (8, "lsrs r2, r2, #15"),
        (9, "adds r3, r3, r1"),
        (13, "adds r1, r1, r3"),
        (14, "lsrs r3, r3, #16"),
        (16, "asrs r1, r1, #15"),
        (17, "adcs r1, r0"),
    ];
    let of_sums = [
        (0, "adds r0, r0, r2"),
        (1, "bvs .+10"),
        (1, "bcc .+10"),
        (2, "asrs r0, r0, #30"),
        (3, "movs r2, #1"),
        (4, "lsls r1, r1, #30"),
        (5, "orrs r0, r1"),
    ];
    let faults_of = [
        (MUL_TOP, Called::TopRounded, &of_products[..]),
        (ADD_SAT, Called::SumSaturated, &of_sums[..]),
    ];
    for (lines, called, faults) in faults_of {
        for fault in faults {
            let shown = contracts(lines, Some(*fault), called);
            assert_eq!(shown, 0, "{fault:?}");
        }
    }
}

/// The loop of a root with the number in R0 and R2, as a Cortex-M33 has it.
const ROOT: &[&str] = &[
    "adds r4, r1, r3",
    "umull r12, r5, r4, r4",
    "cmp r0, r12",
    "sbcs.w r5, r2, r5",
    "it ge",
    "movge r1, r4",
    "lsrs r3, r3, #1",
    "bne .-18",
    "bx lr",
];

#[test]
fn a_loop_of_a_root_is_shown() {
    let is_shown = |others: &[(usize, &str)]| {
        asked(&code_of(ROOT, Arch::V8M, others), Arch::V8M, |question| {
            loop_at(question, &[], CODE).is_some()
        })
    };
    assert!(is_shown(&[]));
    let faults: &[&[(usize, &str)]] = &[
        &[(0, "adds r4, r1, r2")],
        &[(0, "subs r4, r1, r3")],
        &[(1, "umull r12, r5, r4, r1")],
        &[(1, "smull r12, r5, r4, r3")],
        &[(2, "cmp r2, r12")],
        &[(2, "cmp r12, r0")],
        &[(3, "sbcs.w r5, r5, r2")],
        &[(3, "subs.w r5, r2, r5")],
        &[(4, "it gt"), (5, "movgt r1, r4")],
        &[(4, "it lt"), (5, "movlt r1, r4")],
        &[(5, "movge r1, r3")],
        &[(5, "movge r0, r4")],
        &[(6, "lsrs r3, r3, #2")],
        &[(6, "asrs r3, r1, #1")],
        &[(7, "beq .-18")],
        &[(7, "bne .-14")],
    ];
    for fault in faults {
        assert!(!is_shown(fault), "{fault:?}");
    }
}

/// What is shown of a round is a root, from a root of 0 and the highest bit that may be on.
#[test]
fn rounds_of_a_root_are_the_root() {
    let mut rng = Rng::new(6);
    for _ in 0..20_000 {
        let bits = 1 + rng.below(31) as u32;
        let number = rng.next() & ((1 << (2 * bits)) - 1);
        let number = number >> rng.pick(&[0, 1, 8, 16, 24, 31]);
        let (mut root, mut bit) = (0_u64, 1_u64 << (bits - 1));
        while bit > 0 {
            let tried = root + bit;
            root = if number >= tried * tried { tried } else { root };
            bit /= 2;
        }
        assert_eq!(root, number.isqrt());
    }
}
