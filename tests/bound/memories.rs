//! Random programs that go to all memories of a board, and to its devices: nobody waits longer than
//! is charged, whatever the addresses are known by.
//!
//! `WHIPPEN_PROGRAMS=N` tries N programs on each board instead of some, `WHIPPEN_SEED=N` begins
//! elsewhere: `WHIPPEN_PROGRAMS=20000 cargo test --release --test bound memories -- --nocapture`.

use std::collections::BTreeMap;

use whippen_compiler::board::{Board, Memory};
use whippen_compiler::budget::{
    Annotations, Bound, Code, Interference, Lies, Others, Query, Reach, bound,
};
use whippen_compiler::kernel::random::Rng;
use whippen_emulator::{
    Board as EmulatedBoard, BoardKind, ConverterSetup, Machine, Register, Stop, build,
};
use whippen_isa::{Arch, parse, timing::Target};
use whippen_runtime::board::bundled;

/// Programs of each board, where the environment does not say.
const PROGRAMS: u64 = 1000;
/// Runs of each.
const RUNS: usize = 8;
/// Registers that point somewhere: R0 is what encodings without a base look as if they had.
const BASES: [u8; 4] = [0, 5, 6, 7];
/// Where they may point from on: so far behind the beginning of a memory.
const INSIDE: u32 = 0x400;

/// Accesses, by the architecture that is first to have them; others have no such text. `B` is a
/// base, `D` a register for data, `W`, `H`, `C` constants for words, halfwords and bytes, `L` a
/// literal's. R2 and R3 are indices.
const ACCESSES: &[&str] = &[
    "ldr D, [B, #W]",
    "ldrh D, [B, #H]",
    "ldrb D, [B, #C]",
    "str D, [B, #W]",
    "strh D, [B, #H]",
    "strb D, [B, #C]",
    "ldr D, [B, r3]",
    "str D, [B, r3]",
    "ldr D, [r3, B]",
    "ldrsh D, [B, r3]",
    "ldr.w D, [B, r2, lsl #2]",
    "str.w D, [B, r2, lsl #2]",
    "ldr.w D, [B, #-W]",
    "ldrd r1, r4, [B, #W]",
    "strd r1, r4, [B, #W]",
    "ldm B, {r1, r4}",
    "ldmdb B, {r1, r4}",
    "lda D, [B]",
    "stl D, [B]",
    "ldrex D, [B, #W]",
    "vldr s0, [B, #W]",
    "vldr d1, [B, #W]",
    "vstr s0, [B, #-W]",
    "vldmia B, {s0-s3}",
    "ldr D, [pc, #L]",
    "vldr s1, [pc, #L]",
    "ldr D, [sp, #W]",
    "str D, [sp, #W]",
    "ldrb.w D, [sp, r3]",
    "push {r1, r3, r4}\npop {r1, r3, r4}",
];

/// Accesses that move their base, which stays in its memory.
const MOVING: &[&str] = &[
    "ldr D, [B], #4",
    "str D, [B, #-4]!",
    "ldrd r1, r4, [B, #8]!",
    "ldm B!, {r1, r4}",
    "stm B!, {r1, r4}",
    "stmdb B!, {r1, r4}",
    "vldmia B!, {s0-s1}",
];

/// Others, between them.
const BETWEEN: &[&str] = &[
    "adds r4, r4, r1",
    "muls r1, r4, r1",
    "eors r4, r1",
    "movs D, #C",
    "nop",
    "lsls D, D, #3",
];

/// Where a register points, and what the bound is told of it.
struct Pointer {
    at: u32,
    /// A device's registers are no memory to walk in.
    is_device: bool,
    known: Known,
}

#[derive(Clone, Copy)]
enum Known {
    Nothing,
    Address,
    /// That it is one of a few.
    Near,
    /// The memory.
    Memory,
}

struct Bench {
    kind: BoardKind,
    board: Board,
    /// Where code lies.
    code: u32,
    /// A device's registers, where words may be written.
    device: u32,
}

impl Bench {
    fn new(kind: BoardKind) -> Self {
        let board = bundled(kind.name()).expect("bundled");
        let text = board.memory_for(".text").expect("a memory for code").base;
        let device = match board.device("watchdog") {
            // The scratch registers of the chips of Raspberry Pi.
            Some(watchdog) => watchdog + 0xc,
            // Port A of an STM32F4.
            None => 0x4002_0000,
        };
        Self {
            kind,
            board,
            code: text + 0x100,
            device,
        }
    }

    /// Memories that data may lie in.
    fn memories(&self) -> Vec<&Memory> {
        let known = |memory: &&Memory| memory.access.extra_cycles().is_some();
        self.board.memory.iter().filter(known).collect()
    }

    /// A register at a device, between two memories or in one.
    fn pointer(&self, rng: &mut Rng) -> Pointer {
        if rng.chance(1, 6) {
            return Pointer {
                at: self.device,
                is_device: true,
                known: Known::Address,
            };
        }
        let memory = rng.pick(&self.memories());
        let before = memory.base.wrapping_sub(4);
        if rng.chance(1, 4) && self.memories().iter().any(|own| own.contains(before)) {
            return Pointer {
                at: memory.base,
                is_device: false,
                known: rng.pick(&[Known::Address, Known::Near]),
            };
        }
        // Behind the code, where that is; before the stack.
        let word = rng.below(u64::from((memory.size - 2 * INSIDE) / 4)) as u32;
        Pointer {
            at: memory.base + INSIDE + 4 * word,
            is_device: false,
            known: rng.pick(&[Known::Nothing, Known::Address, Known::Near, Known::Memory]),
        }
    }

    fn stack(&self) -> u32 {
        self.board.stacks[0] - 0x100
    }

    fn reach(&self, of: impl Iterator<Item = u32>) -> Reach {
        let memories = of.filter_map(|at| self.board.memory_at(at));
        Reach {
            banks: memories.fold(0, |set, memory| set | memory.bank_set()),
            unknown: None,
        }
    }

    /// The bound of a program, with what is told of its pointers.
    fn bound(&self, code: &[u8], pointers: &BTreeMap<u8, Pointer>) -> Bound {
        let of = |pointer: &Pointer| self.reach([pointer.at].into_iter());
        let mut annotations = Annotations {
            return_to: Some(Target {
                address: 0,
                wide: false,
            }),
            ..Annotations::default()
        };
        for (register, pointer) in pointers {
            let at = pointer.at;
            match pointer.known {
                Known::Nothing => {}
                Known::Address => _ = annotations.entered.insert(*register, [at, at]),
                Known::Near => _ = annotations.entered.insert(*register, [at - 32, at + 64]),
                Known::Memory => _ = annotations.bases.insert(*register, of(pointer)),
            }
        }
        let lies = Lies {
            code: self.reach([self.code].into_iter()).banks,
            data: self.reach(
                pointers
                    .values()
                    .flat_map(|pointer| [pointer.at - 4, pointer.at]),
            ),
            stack: self.reach([self.stack()].into_iter()),
        };
        // Where the emulated board has no banks, nothing meets a fetch: what is charged for that
        // would hide what is left out.
        let others = Others {
            fetches: self.board.fetches_apart && !self.kind.board().banks.is_empty(),
            ..Others::default()
        };
        let query = Query {
            core: &self.board.timing(),
            code: &Code::new(self.code, code.to_vec()),
            entry: self.code,
            annotations: &annotations,
            interference: Some(&Interference::new(&self.board, &[], lies, others)),
        };
        bound(&query).expect("a bound")
    }

    /// The emulated board with a program, and nobody else there.
    fn machine(&self, code: &[u8]) -> Machine {
        let alone = EmulatedBoard {
            cores: 1,
            ..self.kind.board()
        };
        let (mut machine, _) =
            build(self.kind, alone, ConverterSetup::default()).expect("the board can be");
        machine.bus.memory.write(self.code, code).expect("RAM");
        machine
    }

    /// Cycles of one run.
    fn observed(
        &self,
        machine: &mut Machine,
        pointers: &BTreeMap<u8, Pointer>,
        rng: &mut Rng,
    ) -> u64 {
        let stack = self.stack();
        let core = machine.cpu_mut(0);
        for (register, pointer) in pointers {
            core.set(Register::core(*register), pointer.at);
        }
        core.set(Register::core(13), stack);
        core.set(Register::core(4), rng.next() as u32);
        let (index, bytes) = (rng.below(8) as u32, 4 * rng.below(8) as u32);
        let arguments = [pointers[&0].at, rng.next() as u32, index, bytes];
        let stop = machine.call(self.code | 1, arguments, 1_000_000);
        let Stop::Returned { cycles, .. } = stop else {
            panic!("{stop}")
        };
        cycles
    }
}

/// The bytes of a template for an architecture, if it has it.
fn filled(rng: &mut Rng, template: &str, base: u8, arch: Arch) -> Option<Vec<u8>> {
    let number = |step: u64, count: u64, rng: &mut Rng| (step * rng.below(count)).to_string();
    let text = template
        .replace('B', &format!("r{base}"))
        .replace('D', rng.pick(&["r1", "r4"]))
        .replace('W', &number(4, 4, rng))
        .replace('H', &number(2, 8, rng))
        .replace('C', &number(1, 16, rng))
        .replace('L', &number(4, 16, rng));
    text.lines()
        .try_fold(Vec::new(), |bytes, line| assembled(bytes, line, arch))
}

/// With the bytes of an instruction.
fn assembled(mut bytes: Vec<u8>, line: &str, arch: Arch) -> Option<Vec<u8>> {
    let inst = parse(line, arch, None).ok()?;
    let (first, second) = inst.encode(arch).ok()?.halfwords();
    let halves = [Some(first), second].into_iter().flatten();
    halves.for_each(|half| bytes.extend(half.to_le_bytes()));
    Some(bytes)
}

/// Some instructions in a row.
fn run(rng: &mut Rng, pointers: &BTreeMap<u8, Pointer>, arch: Arch) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut left = rng.below(5);
    while left > 0 {
        let base = rng.pick(&BASES);
        let walks = !pointers[&base].is_device;
        let templates = match rng.below(8) {
            0 | 1 => BETWEEN,
            2 if walks => MOVING,
            _ => ACCESSES,
        };
        let template = rng.pick(templates);
        // Of a device only words that it has, and none before it.
        let is_word = ["ldr D, [B, #W]", "str D, [B, #W]", "ldm B, {r1, r4}"].contains(&template);
        if !walks && template.contains('B') && !is_word {
            continue;
        }
        if let Some(more) = filled(rng, template, base, arch) {
            bytes.extend(more);
            left -= 1;
        }
    }
    bytes
}

/// Runs, some of which a branch leaves out.
fn program(rng: &mut Rng, pointers: &BTreeMap<u8, Pointer>, arch: Arch) -> Vec<u8> {
    let mut bytes = Vec::new();
    for _ in 0..rng.below(3) {
        bytes.extend(run(rng, pointers, arch));
        let body = run(rng, pointers, arch);
        let over = format!("{} .+{}", rng.pick(&["bmi", "bcs"]), body.len() + 2);
        for line in ["cmp r4, r1", &over] {
            bytes = assembled(bytes, line, arch).expect("it is near");
        }
        bytes.extend(body);
    }
    bytes.extend(run(rng, pointers, arch));
    assembled(bytes, "bx lr", arch).expect("it has bits")
}

#[test]
fn no_memory_is_waited_for_longer_than_is_charged() {
    let programs = whippen_need::count("WHIPPEN_PROGRAMS", PROGRAMS);
    let mut rng = Rng::new(whippen_need::count("WHIPPEN_SEED", 1));
    for kind in BoardKind::ALL {
        let bench = Bench::new(kind);
        let arch = bench.board.arch;
        let mut reached = 0;
        for _ in 0..programs {
            let pointers = BASES
                .map(|register| (register, bench.pointer(&mut rng)))
                .into();
            let code = program(&mut rng, &pointers, arch);
            let most = bench.bound(&code, &pointers).cycles_max;
            let mut machine = bench.machine(&code);
            let longest = (0..RUNS)
                .map(|_| bench.observed(&mut machine, &pointers, &mut rng))
                .max();
            let longest = longest.expect("it ran");
            assert!(longest <= most, "{kind:?}: {longest} > {most}: {code:02x?}");
            reached += u64::from(longest == most);
        }
        println!("{kind:?}: {programs} programs, {reached} bounds reached");
        assert!(
            reached > programs / 10,
            "{kind:?}: {reached} bounds reached"
        );
    }
}
