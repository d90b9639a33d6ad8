//! Routines of a core without long products: sums of products of halves are one product.

use whippen_deterministic::Rng;
use whippen_ids::IdMap;
use whippen_isa::{Arch, parse};
use whippen_kernel::Kernel;
use whippen_modes::Modes;

use crate::contract::shown;
use crate::machine::Machine;
use crate::places::{Called, Code, Places, Question, Shared, Symbols};
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
fn asked<T>(halves: &[u16], ask: impl FnOnce(&Question) -> T) -> T {
    let modes = Modes {
        kernel: Kernel::default(),
        modes: IdMap::new(),
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
        arch: Arch::V6M,
    };
    ask(&question)
}

/// What a routine leaves in R0.
fn result(halves: &[u16], terms: &mut Terms) -> Told<Term> {
    asked(halves, |question| {
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

/// How many contracts are shown of a routine, with one of its lines as another text.
fn contracts(lines: &[&str], other: Option<(usize, &str)>, called: Called) -> usize {
    let halves = lines.iter().enumerate().map(|(at, line)| {
        let text = other
            .filter(|(own, _)| *own == at)
            .map_or(*line, |own| own.1);
        let inst = parse(text, Arch::V6M, None).unwrap_or_else(|why| panic!("{text}: {why:?}"));
        match inst.encode(Arch::V6M) {
            Ok(whippen_isa::Code::Narrow(half)) => half,
            other => panic!("{text}: {other:?}"),
        }
    });
    asked(&halves.collect::<Vec<u16>>(), |question| {
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
