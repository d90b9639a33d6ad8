//! The emulator's cycles: published loops executed, and the micro-programs of `isa` that need no
//! invented outcomes.
//!
//! The texts are those of `isa/tests/timing`; there a driver walks through them, here they run, by
//! blocks and step by step.

use whippen_emulator::{Board, CoreKind, Machine, Observer, Region, Register, Step, Stop};
use whippen_isa::Arch;
use whippen_isa::timing::rules;

/// A program of a text: its code, the registers it starts with and the count on paper.
struct Program {
    title: String,
    code: Vec<(u32, Vec<u8>)>,
    registers: Vec<(String, u32)>,
    /// Whether the text says what its instructions do.
    annotated: bool,
    want: u64,
}

fn programs(text: &str) -> Vec<Program> {
    text.split("\n== ").skip(1).map(program).collect()
}

fn program(block: &str) -> Program {
    let mut lines = block.lines();
    let title = lines.next().unwrap_or_default().to_string();
    let mut program = Program {
        title,
        code: Vec::new(),
        registers: Vec::new(),
        annotated: false,
        want: 0,
    };
    for line in lines {
        if let Some(count) = line.strip_prefix("= ") {
            program.want = count.parse().expect("a count");
        } else if let Some(registers) = line.strip_prefix("registers ") {
            program.registers = registers.split_whitespace().filter_map(register).collect();
        } else if let Some((address, code)) = instruction(line) {
            program.code.push((address, code));
            program.annotated |= [" > ", " skip", " bits ", " wait ", " near"]
                .iter()
                .any(|word| line.contains(word));
        }
    }
    program
}

/// As in `r6=20001001`.
fn register(word: &str) -> Option<(String, u32)> {
    let (name, value) = word.split_once('=')?;
    Some((name.to_string(), u32::from_str_radix(value, 16).ok()?))
}

/// As in `20001002 e890 1f0e ldm.w ...`: the address and the bytes.
fn instruction(line: &str) -> Option<(u32, Vec<u8>)> {
    let address = line
        .get(..8)
        .filter(|_| line.as_bytes().get(8) == Some(&b' '))?;
    let address = u32::from_str_radix(address, 16).ok()?;
    let hex = |from: usize| {
        line.get(from..from + 4)
            .and_then(|h| u16::from_str_radix(h, 16).ok())
    };
    let first = hex(9)?;
    let second = if whippen_isa::is_wide(first) {
        hex(14)
    } else {
        None
    };
    Some((
        address,
        [Some(first), second]
            .into_iter()
            .flatten()
            .flat_map(u16::to_le_bytes)
            .collect(),
    ))
}

/// RAM at the two places where code is, full of addresses of RAM; every register an address of RAM,
/// unless given.
fn machine(kind: CoreKind, program: &Program) -> Machine {
    let flash = Region::ram("flash", 0x1000_0000, 1 << 20);
    let board = Board {
        regions: vec![flash, Region::ram("ram", 0x2000_0000, 1 << 20)],
        ..Board::generic(kind)
    };
    let mut machine = Machine::new(board).expect("a board");
    let pointers: Vec<u8> = (0..0x8_0000 / 4)
        .flat_map(|_| 0x2004_0000_u32.to_le_bytes())
        .collect();
    machine
        .bus
        .memory
        .write(0x2000_0000, &pointers)
        .expect("RAM");
    for (address, code) in &program.code {
        machine.bus.memory.write(*address, code).expect("RAM");
    }
    machine
        .bus
        .memory
        .write(ENABLE_FLOAT, &enable_float())
        .expect("RAM");
    assert!(
        kind == CoreKind::CortexM0Plus
            || matches!(
                machine.call(ENABLE_FLOAT, [0; 4], 100),
                Stop::Returned { .. }
            )
    );
    for register in Register::all().take(15) {
        let given = program
            .registers
            .iter()
            .find(|(name, _)| name == register.name());
        machine
            .cpu_mut(0)
            .set(register, given.map_or(0x2004_0000, |(_, value)| *value));
    }
    machine
}

const ENABLE_FLOAT: u32 = 0x1008_0000;

/// A function that lets everybody use coprocessors 10 and 11: CPACR.
fn enable_float() -> Vec<u8> {
    // movw r0, #0xed88; movt r0, #0xe000; mov r1, #0xf00000; str r1, [r0]; bx lr
    let code: [u16; 8] = [
        0xf64e, 0x5088, 0xf2ce, 0x0000, 0xf44f, 0x0170, 0x6001, 0x4770,
    ];
    code.into_iter().flat_map(u16::to_le_bytes).collect()
}

struct Sum(u64);

impl Observer for Sum {
    fn instruction(&mut self, step: &Step<'_>) {
        self.0 += u64::from(step.cost.cycles());
    }
}

/// Cycles from the first instruction to behind the last that follows it in memory, or what stopped
/// it before. By blocks and step by step they are the same.
fn cycles(kind: CoreKind, program: &Program) -> Result<u64, Stop> {
    let (by_blocks, by_steps) = (run(kind, program, false)?, run(kind, program, true)?);
    assert_eq!(by_blocks, by_steps, "{}", program.title);
    Ok(by_blocks)
}

fn run(kind: CoreKind, program: &Program, observed: bool) -> Result<u64, Stop> {
    let mut machine = machine(kind, program);
    let start = program.code[0].0;
    let behind = |at, (address, code): &(u32, Vec<u8>)| {
        if *address == at {
            at + code.len() as u32
        } else {
            at
        }
    };
    let end = program.code.iter().fold(start, behind);
    machine.set_breakpoint(end);
    let arguments = ["r0", "r1", "r2", "r3"]
        .map(|name| Register::named(name).map_or(0, |r| machine.cpu(0).get(r)));
    let (begun, mut sum) = (machine.cycle(0), Sum(0));
    let stop = match observed {
        true => machine.call_observed(start, arguments, 100_000, &mut sum),
        false => machine.call(start, arguments, 100_000),
    };
    let cycles = machine.cycle(0) - begun;
    assert!(
        !observed || sum.0 == cycles,
        "{}: the parts make {}, not {cycles}",
        program.title,
        sum.0
    );
    match stop {
        Stop::Breakpoint { address, .. } if address == end => Ok(cycles),
        other => Err(other),
    }
}

#[test]
fn published_loops() {
    let programs = programs(include_str!("../../isa/tests/timing/published-m33.txt"));
    for program in &programs {
        assert_eq!(
            cycles(CoreKind::CortexM33, program),
            Ok(program.want),
            "{}",
            program.title
        );
    }
    assert_eq!(programs.len(), 10);
}

/// Those whose text says nothing that execution would not do by itself, as far as their operands
/// let them run.
fn micro_programs(kind: CoreKind, text: &str, at_least: usize) {
    let plain: Vec<Program> = programs(text)
        .into_iter()
        .filter(|p| !p.annotated)
        .collect();
    let mut ran = 0;
    for program in &plain {
        if let Ok(cycles) = cycles(kind, program) {
            assert_eq!(cycles, program.want, "{}", program.title);
            ran += 1;
        }
    }
    println!("{}: {ran} of {} programs ran", kind.name(), plain.len());
    assert!(ran >= at_least, "only {ran} of {} ran", plain.len());
}

#[test]
fn micro_programs_of_cortex_m33() {
    micro_programs(CoreKind::CortexM33, rules(Arch::V8M), 80);
}

#[test]
fn micro_programs_of_cortex_m4() {
    micro_programs(CoreKind::CortexM4, rules(Arch::V7EM), 20);
}

#[test]
fn micro_programs_of_cortex_m0plus() {
    micro_programs(CoreKind::CortexM0Plus, rules(Arch::V6M), 5);
}
