//! No image makes the emulator panic: random halfwords as code, random registers, on all cores.

use crate::support::{CODE, Count, Random, machine};
use whippen_emulator::{CoreKind, Register, Stop};
use whippen_isa::{ItState, decode};

/// Random halfwords, mostly such that they decode.
fn noise(core: CoreKind, random: &mut Random) -> Vec<u16> {
    let mut code = Vec::new();
    while code.len() < 400 {
        let (hw1, hw2) = (random.word() as u16, random.word() as u16);
        if random.word().is_multiple_of(16)
            || decode(hw1, hw2, core.arch(), ItState::OUTSIDE).is_ok()
        {
            code.extend([hw1, hw2]);
        }
    }
    code
}

#[test]
fn random_code_never_panics() {
    let mut stops = std::collections::BTreeMap::<String, usize>::new();
    for seed in 1..900 {
        let mut random = Random(seed);
        let core = CoreKind::ALL[seed as usize % 3];
        let mut m = machine(core, &noise(core, &mut random));
        m.semihosting.enabled = seed % 2 == 0;
        for register in Register::all() {
            let near = [
                CODE,
                CODE + 0x1000,
                0x2003_fff0,
                0xffff_fff0,
                0,
                0xe000_e000,
                0xe000_ed00,
            ];
            let value = if random.word().is_multiple_of(2) {
                random.word()
            } else {
                near[(random.word() % 7) as usize]
            };
            m.cpu_mut(0).set(register, value);
        }
        let start = CODE + 2 * (random.word() % 300);
        m.cpu_mut(0).set(Register::PC, start);
        m.start(
            0,
            whippen_emulator::Start {
                vector_table: CODE,
                stack: CODE + 0x3000,
                address: start | 1,
            },
        );
        let stop = if seed % 3 == 0 {
            m.run_observed(20_000, &mut Count::default())
        } else {
            m.run(20_000)
        };
        let name = match stop {
            Stop::Fault(fault) => format!("{:?}", fault.reason),
            stop => format!("{stop:?}")
                .split([' ', '{'])
                .next()
                .unwrap_or_default()
                .to_string(),
        };
        *stops.entry(name).or_default() += 1;
    }
    println!("{stops:?}");
    assert!(stops.len() > 5, "{stops:?}");
}

#[test]
fn the_ends_of_the_address_space_are_no_trap() {
    for kind in CoreKind::ALL {
        for address in [0xffff_fffe, 0xffff_fffc, 0, 2, 0x7fff_fffe, 0xffff_fff0] {
            let mut m = machine(kind, &[0x4700]);
            m.cpu_mut(0).set(Register::SP, address);
            let stop = m.call(CODE, [address | 1, 0, 0, 0], 1000);
            assert!(matches!(stop, Stop::Fault(_)), "{address:#x}: {stop}");
        }
    }
}
