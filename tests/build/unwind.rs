//! `.debug_frame` as binutils reads it, against what really happened: the emulator steps through a
//! whole firmware, calls and exceptions are written down, and at every instruction all frames are
//! unwound.

use std::collections::{BTreeMap, BTreeSet};

use whippen_emulator::elf::Elf;
use whippen_emulator::{
    Activity, BoardKind, Converter, ConverterSetup, Machine, Observer, Register, Step, build,
};
use whippen_isa::{Op, reg};

use crate::tools::{Folder, WHIPPEN};

/// Instructions whose frames are unwound, of each image.
const INSTRUCTIONS: usize = 150_000;
/// R4 to R11: what functions keep for their callers.
const KEPT: std::ops::Range<usize> = 4..12;

/// Where a register's value at the entry of the function is.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Rule {
    Same,
    Slot(i32),
    Register(usize),
    Undefined,
}

/// What one row says: the CFA above the stack pointer, and the rules of R0 to LR.
#[derive(Debug, Clone)]
struct Row {
    cfa: i32,
    rules: [Rule; 15],
}

impl Row {
    /// What the common entry says, which is where functions begin.
    fn common() -> Row {
        let mut rules = [Rule::Same; 15];
        for changed in [0, 1, 2, 3, 12] {
            rules[changed] = Rule::Undefined;
        }
        Row { cfa: 0, rules }
    }
}

/// The rows of all functions: by address, with the end of the function.
struct Frames(BTreeMap<u32, (u32, Row)>);

impl Frames {
    /// From `readelf --debug-dump=frames-interp`.
    fn read(text: &str) -> Frames {
        let (mut rows, mut end, mut columns) = (BTreeMap::new(), 0, Vec::new());
        let hex = |text: &str| u32::from_str_radix(text, 16).ok();
        for line in text.lines() {
            let words: Vec<&str> = line.split_whitespace().collect();
            match words[..] {
                [.., pc] if pc.starts_with("pc=") => {
                    let (first, last) = pc[3..].split_once("..").expect("a range");
                    end = hex(last).expect("an address");
                    // One without instructions has the common row alone.
                    rows.insert(hex(first).expect("an address"), (end, Row::common()));
                }
                ["LOC", "CFA", ..] => columns = words[2..].iter().map(|w| number(w)).collect(),
                [at, cfa, ..] if end != 0 && cfa.starts_with("r13") => {
                    let mut rules = Row::common().rules;
                    for (column, word) in columns.iter().zip(&words[2..]) {
                        rules[*column] = rule(word);
                    }
                    let cfa = cfa[3..].parse().expect("an offset");
                    rows.insert(hex(at).expect("an address"), (end, Row { cfa, rules }));
                }
                _ => {}
            }
        }
        Frames(rows)
    }

    fn at(&self, pc: u32) -> Option<&Row> {
        let (_, (end, row)) = self.0.range(..=pc).next_back()?;
        (pc < *end).then_some(row)
    }
}

fn number(name: &str) -> usize {
    match name {
        "ra" | "lr" => 14,
        name => name[1..].parse().expect("a register"),
    }
}

fn rule(word: &str) -> Rule {
    match word {
        "u" => Rule::Undefined,
        "s" => Rule::Same,
        word => match word.strip_prefix('c') {
            Some(offset) => Rule::Slot(offset.parse().expect("an offset")),
            None => Rule::Register(number(word)),
        },
    }
}

/// R0 to PC of a core.
fn registers(machine: &Machine, core: usize) -> [u32; 16] {
    std::array::from_fn(|r| machine.cpu(core).get(Register::core(r as u8)))
}

/// A call, or an exception that was taken.
#[derive(Debug, Clone)]
struct Call {
    sp: u32,
    return_address: u32,
    kept: [u32; 8],
}

/// What happened on each core.
#[derive(Default)]
struct Truth {
    calls: Vec<Vec<Call>>,
    /// Instructions and exceptions since somebody looked.
    events: Vec<(usize, Event)>,
}

#[derive(Clone, Copy)]
enum Event {
    Called { return_address: u32 },
    Taken,
    Left,
    Other,
}

impl Observer for Truth {
    fn instruction(&mut self, step: &Step<'_>) {
        let behind = step.address + step.inst.size();
        let called = matches!(step.inst.op(), Op::BL | Op::BLX);
        self.events.push((
            step.core,
            if called {
                Event::Called {
                    return_address: behind | 1,
                }
            } else {
                Event::Other
            },
        ));
    }

    fn exception(&mut self, core: usize, _: u32, _: u64) {
        self.events.push((core, Event::Taken));
    }

    fn exception_return(&mut self, core: usize, _: u32, _: u64) {
        self.events.push((core, Event::Left));
    }
}

impl Truth {
    /// Everything that happened is taken in; calls that have come back are left.
    fn settle(&mut self, machine: &Machine) {
        for (core, event) in std::mem::take(&mut self.events) {
            let now = registers(machine, core);
            let calls = &mut self.calls[core];
            let call = |return_address| Call {
                sp: now[13],
                return_address,
                kept: std::array::from_fn(|nth| now[KEPT.start + nth]),
            };
            match event {
                Event::Called { return_address } => calls.push(call(return_address)),
                Event::Taken => calls.push(call(now[14])),
                Event::Left => drop(calls.pop()),
                Event::Other => {}
            }
            while let Some(last) = calls.last()
                && now[15] == last.return_address & !1
                && now[13] == last.sp
            {
                calls.pop();
            }
        }
    }
}

/// Registers as far as they are known: R0 to LR.
type Known = [Option<u32>; 15];

fn word(machine: &Machine, at: u32) -> u32 {
    let mut bytes = [0; 4];
    machine.bus.memory.read(at, &mut bytes).expect("memory");
    u32::from_le_bytes(bytes)
}

/// Unwinds all frames of a core; what is wrong, if something is.
fn unwind(frames: &Frames, machine: &Machine, core: usize, calls: &[Call]) -> Result<(), String> {
    let now = registers(machine, core);
    let mut known: Known = std::array::from_fn(|r| Some(now[r]));
    let (mut pc, mut exact) = (now[15], true);
    for call in calls.iter().rev() {
        let row = frames.at(if exact { pc } else { pc - 1 });
        let row = row.ok_or_else(|| format!("{pc:#x}: no row"))?;
        let sp = known[13].ok_or("no stack pointer")?;
        let cfa = sp.wrapping_add_signed(row.cfa);
        if cfa != call.sp {
            return Err(format!("{pc:#x}: the CFA is {cfa:#x}, not {:#x}", call.sp));
        }
        let value = |rule: Rule, register: usize| match rule {
            Rule::Same => known[register],
            Rule::Slot(offset) => Some(word(machine, cfa.wrapping_add_signed(offset))),
            Rule::Register(other) => known[other],
            Rule::Undefined => None,
        };
        let mut before: Known = std::array::from_fn(|r| value(row.rules[r], r));
        before[13] = Some(cfa);
        if before[14] != Some(call.return_address) {
            let found = before[14];
            return Err(format!(
                "{pc:#x}: returns to {found:x?}, not {:#x}",
                call.return_address
            ));
        }
        for register in KEPT {
            let was = call.kept[register - KEPT.start];
            if before[register].is_some_and(|found| found != was) {
                return Err(format!(
                    "{pc:#x}: r{register} is {:x?}, not {was:#x}",
                    before[register]
                ));
            }
        }
        known = before;
        exact = call.return_address >= 0xff00_0000;
        if exact {
            interrupted(machine, cfa, &mut known);
            pc = word(machine, cfa + 24);
        } else {
            pc = call.return_address & !1;
        }
    }
    match frames.at(if exact { pc } else { pc - 1 }) {
        Some(row) if row.rules[usize::from(reg::LR)] == Rule::Undefined => Ok(()),
        _ => Err(format!(
            "{pc:#x}: nobody called this, but a caller is named"
        )),
    }
}

/// What an exception has stored.
fn interrupted(machine: &Machine, at: u32, known: &mut Known) {
    for (nth, register) in [0, 1, 2, 3, 12, 14].into_iter().enumerate() {
        known[register] = Some(word(machine, at + 4 * nth as u32));
    }
    let aligned = word(machine, at + 28) >> 9 & 1;
    known[13] = Some(at + 32 + 4 * aligned);
}

/// An image on its board, by its file.
fn board(kind: BoardKind, file: &[u8], keys: u32) -> (Machine, whippen_emulator::Ports) {
    let rate_hz = 44_100;
    let (mut machine, ports) = build(
        kind,
        kind.board(),
        ConverterSetup {
            keys,
            rate: [rate_hz, 1],
        },
    )
    .expect("a board");
    let elf = Elf::parse(file, false).expect("an image");
    elf.load(&mut machine.bus.memory, false).expect("memory");
    machine.reset();
    (machine, ports)
}

/// The first frames that are wrong, and the addresses that were looked at.
fn wrong(
    kind: BoardKind,
    file: &[u8],
    keys: u32,
    frames: &Frames,
) -> (Option<String>, BTreeSet<u32>) {
    let (mut machine, ports) = board(kind, file, keys);
    let converter: &mut Converter = machine
        .bus
        .device_mut(ports.converter)
        .expect("it is there");
    // Each key goes down and up, the next a little later.
    let travel = |tick: u32, key: u32| (tick * 700 + key * 9000) % 131_072;
    let words = (0..2000).flat_map(|tick| (0..keys).map(move |key| travel(tick, key)));
    let words = words.map(|at| if at > 65_535 { 131_071 - at } else { at } as u16);
    converter.samples.extend(words);
    let cores = machine.cores();
    let mut truth = Truth {
        calls: vec![Vec::new(); cores],
        events: Vec::new(),
    };
    let (mut seen, mut looked) = (BTreeSet::new(), 0);
    while looked < INSTRUCTIONS {
        // One instruction at a time of whoever is furthest behind; sleepers are woken by time.
        let running = |core: &usize| machine.cpu(*core).activity() == Activity::Running;
        let behind = (0..cores)
            .filter(running)
            .map(|core| machine.cycle(core))
            .min();
        let latest = (0..cores).map(|core| machine.cycle(core)).max();
        let now = behind.or(latest).unwrap_or(0);
        machine.run_observed(now + 1, &mut truth);
        let moved: BTreeSet<usize> = truth.events.iter().map(|(core, _)| *core).collect();
        truth.settle(&machine);
        for core in moved {
            let pc = registers(&machine, core)[15];
            // What the ROM does is nobody's here.
            if truth.calls[core].iter().any(|call| {
                call.return_address < 0x8000_0000 && frames.at(call.return_address & !1).is_none()
            }) {
                truth.calls[core].clear();
            }
            if frames.at(pc).is_none() && kind != BoardKind::Stm32f4 && pc < 0x1000_0000 {
                truth.calls[core].clear();
                continue;
            }
            looked += 1;
            seen.insert(pc);
            if let Err(why) = unwind(frames, &machine, core, &truth.calls[core]) {
                return (Some(format!("core {core}: {why}")), seen);
            }
        }
    }
    (None, seen)
}

/// A program of the repository as an ELF for a board, and its frames.
fn built(folder: &Folder, program: &str, board: &str, keys: u32) -> Option<(Vec<u8>, Frames)> {
    let path = format!("{}/instruments/{program}.whip", env!("CARGO_MANIFEST_DIR"));
    let keys = keys.to_string();
    let args = [
        "build",
        &path,
        "--board",
        board,
        "--keys",
        &keys,
        "--modes",
        "2000",
        "--unproven",
        "-o",
        "out.elf",
    ];
    folder.run(WHIPPEN, &args)?;
    let dump = ["--debug-dump=frames-interp", "out.elf"];
    let text = folder.run("arm-none-eabi-readelf", &dump)?;
    assert!(!text.contains("arning"), "{text}");
    let file = std::fs::read(folder.path().join("out.elf")).expect("written");
    Some((file, Frames::read(&text)))
}

/// Every frame is right at every instruction that ran.
fn frames_hold(program: &str, kind: BoardKind, keys: u32) {
    let folder = Folder::new();
    let Some((file, frames)) = built(&folder, program, kind.name(), keys) else {
        return;
    };
    let (wrong, seen) = wrong(kind, &file, keys, &frames);
    assert_eq!(wrong, None, "{program} on {}", kind.name());
    println!("{program} on {}: {} places", kind.name(), seen.len());
    assert!(seen.len() > 400, "{}", seen.len());
}

#[test]
fn frames_unwind_everywhere_on_an_rp2350() {
    frames_hold("grand-piano", BoardKind::Rp2350, 3);
}

#[test]
fn frames_unwind_everywhere_on_an_rp2040() {
    frames_hold("harpsichord", BoardKind::Rp2040, 3);
}

#[test]
fn frames_unwind_everywhere_on_an_stm32f4() {
    frames_hold("hammond", BoardKind::Stm32f4, 3);
}

/// The judge finds a row that is wrong, wherever it is: each that ran is spoiled in turn.
#[test]
fn a_wrong_row_is_found() {
    let folder = Folder::new();
    let kind = BoardKind::Stm32f4;
    let Some((file, mut frames)) = built(&folder, "hammond", kind.name(), 2) else {
        return;
    };
    let (_, seen) = wrong(kind, &file, 2, &frames);
    let rows: Vec<u32> = frames.0.keys().copied().collect();
    let ran = |at: &u32| seen.contains(at);
    for at in rows.into_iter().filter(ran).step_by(7) {
        let right = frames.0[&at].clone();
        let (_, row) = frames.0.get_mut(&at).expect("it is there");
        match row.rules[14] {
            Rule::Undefined => row.rules[14] = Rule::Same,
            _ => row.cfa += 4,
        }
        assert!(wrong(kind, &file, 2, &frames).0.is_some(), "{at:#x}");
        frames.0.insert(at, right);
    }
}
