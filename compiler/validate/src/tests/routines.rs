//! Routines of a core without long products: sums of products of halves are one product.

use whippen_ids::IdMap;
use whippen_isa::Arch;
use whippen_kernel::Kernel;
use whippen_modes::Modes;

use crate::machine::Machine;
use crate::places::{Code, Places, Question, Shared, Symbols};
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

/// What a routine leaves in R0.
fn result(halves: &[u16], terms: &mut Terms) -> Told<Term> {
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
    let mut machine = Machine::new(&question, terms, CODE);
    machine.run(terms)?;
    Ok(machine.registers[0])
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
