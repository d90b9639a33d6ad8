//! The tick of a string, whose code is a routine.

use whippen_isa::{Arch, parse};
use whippen_kernel::parse as parse_kernel;

use crate::check::compare_memory;
use crate::kernel::{KeyAt, run_init};
use crate::machine::Machine;
use crate::memory::Memory;
use crate::places::{Code, Places, Question, Shared, Symbols};
use crate::prepare::terms;
use crate::stop::Told;
use crate::term::{Base, Kind};
use whippen_ids::IdMap;
use whippen_modes::Modes;

/// Where the code lies.
const CODE: u32 = 0x2000_0000;

/// Where its coefficients are in the state, beyond all that the state has at 0 here.
const LIVES: [u32; 4] = [100, 104, 108, 112];

/// A string of five points, clamped at its first end and pinned at the other.
const KERNEL: &str = "kernel string @44100 {
  in x: u16 [0..65535]
  out f: i16 [-32768..32767]
  cell e: i32 x 6 [-2147483648..2147483647] = 0
  cell v: i32 x 5 [-2147483648..2147483647] = 0
  live k0: i32 [-2147483648..2147483647] = 0
  live k1: i32 [-2147483648..2147483647] = 0
  live k2: i32 [-2147483648..2147483647] = 0
  live k3: i32 [-2147483648..2147483647] = 0
  init {
    v0: i32 [-2147483648..2147483647] = live k0
    v1: i32 [-2147483648..2147483647] = live k1
    v2: i32 [-2147483648..2147483647] = live k2
    v3: i32 [-2147483648..2147483647] = live k3
    v4: i32 [2..2] = const 2
    v5: i32 [0..0] = const 0
    wave e v v0 v1 v2 v3 v4 v5
  }
  tick {
    v6: i32 [0..0] = const 0
    out f v6
  }
}
";

/// `straight_line` of `compiler/arm/src/thumb/wave.rs` for it, slopes from 16 and rates from 40 on
/// in the record.
const ROUTINE: &[&str] = &[
    "push {r4, r5, r6, r8, r9, r10, r11, r12, lr}",
    "ldr r4, [r7, #16]",
    "ldr r5, [r7, #20]",
    "ldr r6, [r7, #40]",
    "ldr r8, [r7, #24]",
    "ldr r9, [r7, #44]",
    "qsub r10, r5, r4",
    "qadd r11, r4, r4",
    "smmulr r12, r2, r6",
    "smmulr r11, r1, r11",
    "smmlar r12, r1, r10, r12",
    "smmlar r11, r0, r10, r11",
    "smmlar r11, r3, r6, r11",
    "qsub r10, r8, r5",
    "smmulr lr, r2, r9",
    "smmlar r12, r0, r10, r12",
    "smmlar lr, r1, r10, lr",
    "ldr r10, [r7, #48]",
    "qadd r11, r11, lr",
    "smmlar r12, r3, r9, r12",
    "qadd r6, r6, r11",
    "ldr r11, [r7, #28]",
    "add r4, r4, r6, lsl #1",
    "str r4, [r7, #16]",
    "sub r4, r5, r6, lsl #1",
    "str r6, [r7, #40]",
    "qsub r5, r11, r8",
    "smmulr r6, r2, r10",
    "smmlar lr, r0, r5, lr",
    "smmlar r6, r1, r5, r6",
    "ldr r5, [r7, #52]",
    "qadd r12, r12, r6",
    "smmlar lr, r3, r10, lr",
    "qadd r9, r9, r12",
    "ldr r12, [r7, #32]",
    "add r4, r4, r9, lsl #1",
    "str r4, [r7, #20]",
    "sub r4, r8, r9, lsl #1",
    "str r9, [r7, #44]",
    "qsub r8, r12, r11",
    "smmulr r9, r2, r5",
    "smmlar r6, r0, r8, r6",
    "smmlar r9, r1, r8, r9",
    "ldr r8, [r7, #56]",
    "qadd lr, lr, r9",
    "smmlar r6, r3, r5, r6",
    "qadd r10, r10, lr",
    "ldr lr, [r7, #36]",
    "add r4, r4, r10, lsl #1",
    "str r4, [r7, #24]",
    "sub r4, r11, r10, lsl #1",
    "str r10, [r7, #48]",
    "qsub r11, lr, r12",
    "smmulr r10, r2, r8",
    "smmlar r9, r0, r11, r9",
    "smmlar r10, r1, r11, r10",
    "qadd r6, r6, r10",
    "smmlar r9, r3, r8, r9",
    "qadd r5, r5, r6",
    "add r4, r4, r5, lsl #1",
    "str r4, [r7, #28]",
    "sub r4, r12, r5, lsl #1",
    "str r5, [r7, #52]",
    "qadd r8, r8, r9",
    "add r4, r4, r8, lsl #1",
    "str r4, [r7, #32]",
    "sub r4, lr, r8, lsl #1",
    "str r8, [r7, #56]",
    "str r4, [r7, #36]",
    "pop {r4, r5, r6, r8, r9, r10, r11, r12, pc}",
];

/// Whether the routine, with one of its lines as another text, does what the operator says.
fn is_shown(other: Option<(usize, &str)>) -> Told<()> {
    let kernel = parse_kernel(KERNEL).unwrap_or_else(|why| panic!("{why:?}"));
    let bytes = ROUTINE.iter().enumerate().flat_map(|(at, line)| {
        let own = other.filter(|(own, _)| *own == at);
        let text = own.map_or(*line, |own| own.1);
        let inst = parse(text, Arch::V8M, None).unwrap_or_else(|why| panic!("{text}: {why:?}"));
        let halves = match inst.encode(Arch::V8M) {
            Ok(whippen_isa::Code::Narrow(half)) => vec![half],
            Ok(whippen_isa::Code::Wide(first, second)) => vec![first, second],
            Err(why) => panic!("{text}: {why:?}"),
        };
        halves.into_iter().flat_map(u16::to_le_bytes)
    });
    let code = Code {
        pieces: vec![(CODE, bytes.collect())],
        data: Vec::new(),
    };
    let modes = Modes {
        kernel,
        modes: IdMap::new().into(),
        work_limited: false,
    };
    let places = Places {
        keys: 1,
        cells: vec![16, 40],
        lives: LIVES.to_vec(),
        ..Places::default()
    };
    let question = Question {
        modes: &modes,
        shared: &Shared::default(),
        code: &code,
        symbols: &Symbols::default(),
        places: &places,
        arch: Arch::V8M,
    };
    let mut terms = terms(&question);
    let t = &mut terms;
    let [record, state, stack] =
        [Base::Record, Base::State, Base::Stack].map(|base| t.of(Kind::Base(base)));
    let at = KeyAt {
        record,
        samples: state,
        history: state,
    };
    let wanted = run_init(&question, t, at, Memory::default())?;
    let mut machine = Machine::new(&question, t, CODE);
    for (register, place) in (0..4).zip(LIVES) {
        let address = t.plus(state, place.into())?;
        machine.registers[register] = t.of(Kind::Load(address, 4));
    }
    machine.registers[7] = record;
    machine.registers[13] = stack;
    let back = machine.registers[14];
    let to = machine.run(t)?;
    assert_eq!(to, back, "{}", t.show(to));
    let mut found = machine.memory.changes(t)?;
    found.apart.retain(|held| held.address.moving != stack);
    compare_memory(&question, t, &wanted, &found)
}

#[test]
fn a_routine_does_what_a_string_does() {
    assert_eq!(is_shown(None), Ok(()));
    // Neither without one of its instructions, but for those that keep registers, nor with another
    // coefficient.
    for (at, line) in ROUTINE.iter().enumerate() {
        let keeps_registers = at == 0 || at + 1 == ROUTINE.len();
        assert!(
            keeps_registers || is_shown(Some((at, "nop"))).is_err(),
            "{line}"
        );
    }
    for (at, line) in ROUTINE.iter().enumerate() {
        let other = line.replace(", r0, ", ", r1, ").replace(", r3, ", ", r2, ");
        if other != *line {
            assert!(is_shown(Some((at, &other))).is_err(), "{other}");
        }
    }
}
