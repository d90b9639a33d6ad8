//! Fast and exact ways give the same state and the same cycles.

#[path = "../made/plain.rs"]
mod plain;

use crate::support::{CODE, Count, DATA, Random, machine};
use whippen_emulator::{CoreKind, Machine, Register};
use whippen_isa::is_wide;

/// Random instructions that stay in line and on the data, with loops and branches forward between
/// them.
fn program(core: CoreKind, random: &mut Random) -> Vec<u16> {
    // movs r7, #20
    let mut code = vec![0x2714];
    while code.len() < 200 {
        let (hw1, hw2) = (random.word() as u16, random.word() as u16);
        match random.word() % 8 {
            // b<c> .+4 over a 16-bit instruction
            0 => code.extend([0xd000 | ((random.word() % 14) << 8) as u16, 0x3001]),
            // str r1, [r6, #imm]; ldr r2, [r6, #imm]
            1 => code.extend([0x6031 | hw1 & 0x07c0, 0x6832 | hw2 & 0x07c0]),
            // R6, R7 and R13 to R15 are kept.
            _ if plain::is_plain(core.arch(), [hw1, hw2], 0xe0c0) => {
                code.push(hw1);
                code.extend(is_wide(hw1).then_some(hw2));
            }
            _ => {}
        }
    }
    // subs r7, #1; beq .+4; b start; bx lr
    let back = -(code.len() as i32 + 4 - 1) & 0x7ff;
    code.extend([0x3f01, 0xd000, 0xe000 | back as u16, 0x4770]);
    code
}

fn prepare(core: CoreKind, code: &[u16], random: &mut Random) -> (Machine, [u32; 4]) {
    let mut m = machine(core, code);
    for r in 4..13 {
        m.cpu_mut(0).set(Register::core(r), random.word());
    }
    m.cpu_mut(0).set(Register::core(6), DATA);
    (m, std::array::from_fn(|_| random.word()))
}

fn state(m: &Machine) -> (u64, Vec<u32>, Vec<u8>) {
    let mut data = vec![0; 256];
    m.bus.memory.read(DATA, &mut data).expect("data");
    (
        m.cycle(0),
        Register::all().map(|r| m.cpu(0).get(r)).collect(),
        data,
    )
}

#[test]
fn blocks_steps_and_observed_runs_agree() {
    for seed in 0..120 {
        let core = CoreKind::ALL[seed as usize % 3];
        let code = program(core, &mut Random(seed * 77 + 1));
        let fresh = || prepare(core, &code, &mut Random(seed + 1));
        let (mut fast, arguments) = fresh();
        let (mut observed, _) = fresh();
        let (mut sliced, _) = fresh();
        let stop = fast.call(CODE, arguments, 1_000_000);
        let mut count = Count::default();
        assert_eq!(
            stop,
            observed.call_observed(CODE, arguments, 1_000_000, &mut count),
            "seed {seed}"
        );
        assert_eq!(count.cycles, observed.cycle(0));
        assert_eq!(state(&fast), state(&observed), "seed {seed}");
        // In slices of a few cycles, blocks rarely fit.
        let mut last = sliced.call(CODE, arguments, 1);
        while last == whippen_emulator::Stop::Limit {
            let until = sliced.cycle(0) + 1 + u64::from(Random(sliced.cycle(0) + 9).word() % 50);
            last = sliced.run(until);
        }
        assert_eq!(state(&fast), state(&sliced), "seed {seed}");
    }
}
