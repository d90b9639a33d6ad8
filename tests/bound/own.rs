//! Boards of one's own: what is refused, and that no board makes a bound lower than what the
//! emulator measures with the same memory.
//!
//! `WHIPPEN_BOARDS=N` tries N random boards instead of some, `WHIPPEN_SEED=N` begins elsewhere:
//! `WHIPPEN_BOARDS=2000 cargo test --release --test bound own -- --nocapture`.

use std::fmt::Write as _;
use std::path::PathBuf;
use std::sync::Arc;

use whippen_compiler::board::{AccessTime, Board, Memory, MemoryKind};
use whippen_compiler::image::Start;
use whippen_compiler::kernel::random::Rng;
use whippen_compiler::pipeline::Compiled;
use whippen_emulator::{Banks, Board as EmulatedBoard, BoardKind, Region};
use whippen_runtime::board;

use crate::board::{Board as Played, Watch};
use crate::image::{Image, instruments};

/// Random boards, where the environment does not say.
const BOARDS: u64 = 24;
/// Keys of all cores.
const KEYS: u32 = 5;
/// Ticks that are played on a board that is accepted.
const TICKS: usize = 120;

/// The text of a bundled board.
fn text(kind: BoardKind) -> String {
    let path = PathBuf::from(env!("CARGO_MANIFEST_DIR"))
        .join("instruments/hardware")
        .join(format!("{}.toml", kind.name()));
    std::fs::read_to_string(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()))
}

/// Reads a board's text as a user's file is read.
fn read(name: &str, text: &str) -> Result<Board, String> {
    let path = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(format!("{name}.toml"));
    std::fs::write(&path, text).expect("the target directory can be written");
    let folder = format!("{}/", env!("CARGO_TARGET_TMPDIR"));
    board::load(&path).map_err(|e| e.to_string().replace(&folder, ""))
}

/// The emulator's board of that kind with the memory of a description: its own ROM and devices.
fn emulated(kind: BoardKind, board: &Board) -> EmulatedBoard {
    let own = kind.board();
    let rom = own.regions.iter().filter(|region| region.name == "rom");
    let region = |memory: &Memory| {
        let wait = memory.access.extra_cycles().unwrap_or(0) as u8;
        Region {
            writable: memory.kind == MemoryKind::Ram,
            read_wait: wait,
            write_wait: wait,
            ..Region::ram(&memory.name, memory.base, memory.size)
        }
    };
    let flash = board.flash().expect("boards have flash").base;
    EmulatedBoard {
        regions: rom
            .cloned()
            .chain(board.memory.iter().map(region))
            .collect(),
        banks: board.memory.iter().flat_map(banks).collect(),
        vector_table: match board.start {
            Start::Boot2 => flash + 0x100,
            Start::Vectors | Start::ImageDef => flash,
        },
        ..own
    }
}

/// The ports of a memory: its banks, by their numbers. What is fetched from flash is not looked at.
fn banks(memory: &Memory) -> Vec<Banks> {
    let count = memory.banks.len() as u32;
    if let (true, Some(first)) = (memory.striped, memory.banks.first()) {
        let in_a_row = memory.banks.windows(2).all(|two| two[0] + 1 == two[1]);
        assert!(in_a_row, "stripes are over banks in a row");
        return vec![Banks {
            base: memory.base,
            bytes: memory.size,
            first_port: u32::from(*first),
            ports: count,
        }];
    }
    let bytes = memory.size / count.max(1);
    let bank = |(at, bank): (u32, &u8)| Banks {
        base: memory.base + at * bytes,
        bytes,
        first_port: u32::from(*bank),
        ports: 1,
    };
    (0..).zip(&memory.banks).map(bank).collect()
}

/// Replaces the value of a key in a table of a board's text.
fn with(text: &str, table: &str, key: &str, value: &str) -> String {
    let (before, rest) = match table {
        "" => ("", text),
        _ => {
            let header = format!("[{table}]\n");
            let at = text.find(&header).expect("the table is there") + header.len();
            text.split_at(at)
        }
    };
    let mut lines = rest.lines().scan(false, |done, line| {
        let is_key = line.split('=').next().is_some_and(|own| own.trim() == key);
        if is_key && !*done {
            *done = true;
            return Some(format!("{key} = \"{value}\"\n"));
        }
        Some(format!("{line}\n"))
    });
    format!("{before}{}", lines.by_ref().collect::<String>())
}

/// Places all sections of a kind elsewhere.
fn placed(text: &str, part: &str, memory: &str) -> String {
    let is_part = |line: &str| line.starts_with(&format!("\"{part}"));
    let lines = text.lines().map(|line| match line.split_once(" = ") {
        Some((pattern, _)) if is_part(line) => format!("{pattern} = \"{memory}\"\n"),
        _ => format!("{line}\n"),
    });
    lines.collect()
}

/// What a bound of this instrument says on a board's text.
fn judged(
    kind: BoardKind,
    name: &str,
    text: &str,
    compiled: &Arc<Compiled>,
) -> Result<Image, String> {
    let board = read(name, text)?;
    let emulated = emulated(kind, &board);
    Image::for_board(kind, (board, emulated), compiled.clone(), KEYS)
}

fn refused(text: &str, compiled: &Arc<Compiled>) -> String {
    match judged(BoardKind::Rp2350, "own", text, compiled) {
        Ok(image) => panic!("{} was accepted:\n{text}", image.board.name),
        Err(why) => why,
    }
}

#[test]
fn boards_that_lie_are_refused_and_say_what_to_write() {
    let all: Vec<Arc<Compiled>> = instruments().into_iter().map(Arc::new).collect();
    let spring = &all[0];
    let rp2350 = &text(BoardKind::Rp2350);
    let flash = placed(&placed(rp2350, ".text", "flash"), ".rodata", "flash");
    let mut told = String::new();
    let cases: &[(&str, String)] = &[
        ("code and constants in flash", flash),
        ("constants in flash", placed(rp2350, ".rodata", "flash")),
        (
            "code of core 1 in flash",
            placed(rp2350, ".text.core1", "flash"),
        ),
        (
            "RAM that cannot be fetched from",
            with(rp2350, "memory.sram4", "fetch", "none"),
        ),
        (
            "data without a known time",
            with(rp2350, "memory.sram8", "access", "not bounded"),
        ),
        (
            "a memory without banks",
            rp2350.replacen("banks  = \"SRAM8\"\n", "", 1),
        ),
        (
            "banks that do not cover",
            with(rp2350, "memory.sram0", "banks", "SRAM0 SRAM1 SRAM2"),
        ),
        (
            "a bank named twice",
            with(rp2350, "memory.sram0", "banks", "SRAM0 SRAM0"),
        ),
        (
            "no access time",
            rp2350.replacen("access = \"1 cycle\"\n", "", 1),
        ),
        (
            "slow fetches",
            with(rp2350, "memory.sram0", "fetch", "2 cycles"),
        ),
        (
            "memories that overlap",
            with(rp2350, "memory.sram4", "base", "0x2003f000"),
        ),
        (
            "memory on a bus",
            with(rp2350, "memory.sram4", "base", "0x40000000"),
        ),
        (
            "a stack outside memory",
            with(rp2350, "", "stacks", "0x20081000 0x30000000"),
        ),
        (
            "a stack in flash",
            with(rp2350, "", "stacks", "0x20081000 0x10001000"),
        ),
        ("a start in RAM", placed(rp2350, ".text.start", "sram0")),
        (
            "two cores on one stack",
            with(rp2350, "", "stacks", "0x20081000 0x20081000"),
        ),
        (
            "one stack for two cores",
            with(rp2350, "", "stacks", "0x20081000"),
        ),
        ("another clock", with(rp2350, "", "clock", "200 MHz")),
        ("one port", with(rp2350, "", "ports", "1")),
        (
            "a device on no bus",
            with(rp2350, "device", "converter", "0x60000000"),
        ),
        (
            "no converter",
            rp2350.replacen("converter = \"0x40170000\"\n", "", 1),
        ),
        ("no bus", with(rp2350, "bus.apb", "base", "0x50000000")),
        (
            "a core that cannot be",
            with(rp2350, "", "core", "cortex-m4"),
        ),
    ];
    for (name, text) in cases {
        let why = refused(text, spring);
        let _ = writeln!(told, "{name}\n  {why}");
    }
    insta::assert_snapshot!(told);
}

/// A random change of a board's memory.
fn changed(rng: &mut Rng, kind: BoardKind, text: &str, board: &Board) -> String {
    let rams: Vec<&Memory> = board
        .memory
        .iter()
        .filter(|memory| memory.kind == MemoryKind::Ram)
        .collect();
    let ram = rams[rng.below(rams.len() as u64) as usize];
    let table = format!("memory.{}", ram.name);
    let anywhere = &board.memory[rng.below(board.memory.len() as u64) as usize].name;
    let parts = [
        ".text",
        ".rodata",
        ".data",
        ".bss",
        ".text.core1",
        ".data.near",
        ".bss.core1",
    ];
    match rng.below(10) {
        0 | 1 => placed(text, rng.pick(&parts), anywhere),
        8 => {
            let base = 0x1000_0000 + 0x1_0000 * rng.below(1 << 8) as u32;
            with(text, "memory.flash", "base", &format!("{base:#010x}"))
        }
        9 => bus_changed(rng, text, board),
        2 => {
            let base = 0x2000_0000 + 0x1000 * rng.below(1 << 14) as u32;
            let moved = with(text, &table, "base", &format!("{base:#010x}"));
            let inside = |end: &&u32| ram.contains(**end - 4);
            let Some(end) = board.stacks.iter().find(inside) else {
                return moved;
            };
            let [from, to] = [*end, end - ram.base + base].map(|at| format!("{at:#010x}"));
            moved.replacen(&from, &to, 1)
        }
        3 => with(
            text,
            &table,
            "access",
            rng.pick(&["1 cycle", "2 cycles", "5 cycles"]),
        ),
        4 => {
            let shared = board.banks[rng.below(board.banks.len() as u64) as usize].clone();
            with(text, &table, "banks", &shared)
        }
        5 => {
            let end = |_: &u32| {
                let ram = rams[rng.below(rams.len() as u64) as usize];
                let end = ram.base + ram.size - 8 * rng.below(64) as u32;
                format!("{end:#010x}")
            };
            let ends: Vec<String> = board.stacks.iter().map(end).collect();
            with(text, "", "stacks", &ends.join(" "))
        }
        6 => {
            let size = 4 * (1 + rng.below(u64::from(ram.size >> 12))) as u32;
            with(text, &table, "size", &format!("{size} KiB"))
        }
        _ => {
            let clock = rng.pick(&["150 MHz", "133 MHz", "168 MHz", "1 GHz"]);
            let clock = if rng.chance(4, 5) {
                format!("{} MHz", kind.board().clock_hz / 1_000_000)
            } else {
                clock.to_string()
            };
            with(text, "", "clock", &clock)
        }
    }
}

/// A random change of a bus: another range, or more cycles than its devices take.
fn bus_changed(rng: &mut Rng, text: &str, board: &Board) -> String {
    let bus = &board.buses[rng.below(board.buses.len() as u64) as usize];
    let table = format!("bus.{}", bus.name);
    match rng.below(4) {
        0 => {
            let down = 0x1_0000 * rng.below(1 << 12) as u32;
            let moved = with(text, &table, "base", &format!("{:#010x}", bus.base - down));
            let size = (bus.size + down) >> 10;
            with(&moved, &table, "size", &format!("{size} KiB"))
        }
        1 => {
            let size = (bus.size >> 10) / (1 + rng.below(200) as u32);
            with(text, &table, "size", &format!("{} KiB", size.max(4)))
        }
        2 => {
            let cycles = u64::from(bus.read_cycles) + 1 + rng.below(9);
            with(text, &table, "read", &format!("{cycles} cycles"))
        }
        _ => {
            let cycles = u64::from(bus.write_cycles) + 1 + rng.below(9);
            with(text, &table, "write", &format!("{cycles} cycles"))
        }
    }
}

/// Plays noise on an image and compares with its bounds; how many ticks of a key were seen.
fn holds(image: &Image, seed: u64, told: &str) -> u64 {
    let (mut board, mut watch) = (Played::new(image), Watch::new(image));
    let keys = KEYS as usize;
    board.play(vec![0; 60 * keys], false, &mut Watch::new(image));
    let mut rng = Rng::new(seed);
    let words = (0..TICKS * keys).map(|_| rng.next() as u16).collect();
    board.play(words, false, &mut watch);
    for (core, bounded) in image.cores.iter().enumerate() {
        let frame = &bounded.contended;
        // The other core's looks at this one's memory are charged to the tick, not to a key.
        let memories = image.board.memory.iter();
        let slowest = memories
            .filter_map(|memory| memory.access.extra_cycles())
            .max();
        let looks = image.visits(core) * u64::from(1 + slowest.unwrap_or(0));
        for ((mode, bound), &observed) in frame.zones[0].tick.modes.iter().zip(&watch.keys[core]) {
            assert!(
                observed <= bound.cycles_max + looks,
                "{mode}: {observed} cycles, bound {}\n{told}",
                bound.cycles_max
            );
        }
        assert!(
            watch.frames[core] <= frame.cycles_max,
            "core {core}: {} cycles, bound {}\n{told}",
            watch.frames[core],
            frame.cycles_max
        );
    }
    watch.keys_seen
}

#[test]
fn no_board_makes_a_bound_lower_than_what_is_measured() {
    let all: Vec<Arc<Compiled>> = instruments().into_iter().map(Arc::new).collect();
    let seed = whippen_need::count("WHIPPEN_SEED", 1_u64);
    let (mut accepted, mut refused, mut seen) = (0, 0, 0);
    for case in 0..whippen_need::count("WHIPPEN_BOARDS", BOARDS) {
        let mut rng = Rng::new(seed.wrapping_mul(0x9e37_79b9).wrapping_add(case));
        let kind = rng.pick(&BoardKind::ALL);
        let mut text = text(kind);
        for _ in 0..1 + rng.below(3) {
            // Where an earlier change made no board, the next one starts from there all the same.
            let Ok(board) = read("random", &text) else {
                break;
            };
            text = changed(&mut rng, kind, &text, &board);
        }
        let compiled = &all[rng.below(all.len() as u64) as usize];
        match judged(kind, "random", &text, compiled) {
            Ok(image) => {
                accepted += 1;
                seen += holds(&image, case, &format!("seed {seed}, case {case}\n{text}"));
            }
            Err(_) => refused += 1,
        }
    }
    println!("{accepted} boards accepted, {refused} refused, {seen} ticks of keys measured");
    assert!(accepted > 0 && refused > 0 && seen > 0);
}

/// What the emulator has of a region is what a board's file says, address by address.
#[test]
fn bundled_boards_agree_with_the_emulators_own_tables() {
    for kind in BoardKind::ALL {
        let board = board::bundled(kind.name()).expect("it is bundled");
        let own = kind.board();
        assert_eq!(
            (board.clock_hz, board.cores as usize, board.arch),
            (own.clock_hz, own.cores, own.core.arch()),
            "{}",
            kind.name()
        );
        for memory in &board.memory {
            for step in 0..64 {
                let at = memory.base + ((memory.size / 64 * step) & !3) + 4 * (step % 16);
                let region = own.regions.iter().find(|region| region.contains(at));
                let region = region.unwrap_or_else(|| panic!("{}: {at:#010x}", memory.name));
                assert_eq!(
                    region.writable,
                    memory.kind == MemoryKind::Ram,
                    "{at:#010x}"
                );
                if let AccessTime::Cycles(cycles) = memory.access {
                    let waits = [region.read_wait, region.write_wait];
                    assert_eq!(waits, [cycles as u8 - 1; 2], "{at:#010x}");
                }
            }
        }
        agree_on_banks(&board, &own);
    }
}

/// Two addresses are in one bank of the description just where they are at one port of the
/// emulator, if that has any.
fn agree_on_banks(board: &Board, own: &EmulatedBoard) {
    if own.banks.is_empty() {
        assert_eq!(own.cores, 1, "nobody to wait for");
        return;
    }
    let port = |at: u32| own.banks.iter().find_map(|banks| banks.port(at));
    let bounded = |memory: &&Memory| !memory.banks.is_empty();
    let memories = board.memory.iter().filter(bounded);
    let addresses: Vec<u32> = memories
        .flat_map(|memory| (0..40).map(|n| memory.base + ((memory.size / 40 * n) & !3)))
        .collect();
    let bank = |at: u32| board.memory_at(at).and_then(|memory| memory.bank(at));
    for &one in &addresses {
        for &other in &addresses {
            assert_eq!(
                bank(one) == bank(other),
                port(one) == port(other),
                "{}: {one:#010x} and {other:#010x}",
                board.name
            );
        }
    }
}
