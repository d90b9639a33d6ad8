//! Nothing makes it panic: broken ELFs, random code, random machines. And what runs block by block
//! runs as it does instruction by instruction.

#[path = "made/elf.rs"]
mod made;

use std::path::Path;

use made::{Part, elf_of};
use whippen_emulator::elf::{Elf, SourceLines, regions_for, vector_table};
use whippen_emulator::{Board, CoreKind, Machine, Observer, Region, Register, Step, Stop};

/// Xorshift.
struct Random(u64);

impl Random {
    fn next(&mut self) -> u32 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 16) as u32
    }

    fn below(&mut self, n: usize) -> usize {
        self.next() as usize % n.max(1)
    }
}

/// Reads, lays out, loads and runs whatever the bytes are; whether they were an image.
fn survives(bytes: &[u8]) -> bool {
    let Ok(elf) = Elf::parse(bytes, true) else {
        return false;
    };
    let lines = SourceLines::read(bytes);
    for segment in &elf.segments {
        let _ = (
            lines.at(segment.run),
            elf.symbols.covering(segment.run),
            elf.symbols.named("main").is_ok(),
        );
    }
    let Ok(runs) = regions_for(&elf, &[]) else {
        return false;
    };
    if runs
        .iter()
        .map(|(_, bytes, _)| u64::from(*bytes))
        .sum::<u64>()
        > 4 << 20
    {
        return false;
    }
    let region = |(base, bytes, writable)| Region {
        writable,
        ..Region::ram("memory", base, bytes)
    };
    let regions = runs.into_iter().map(region).collect();
    let vector_table = vector_table(&elf).unwrap_or(elf.entry & !3);
    let mut machine = Machine::new(Board {
        regions,
        vector_table,
        ..Board::generic(CoreKind::CortexM33)
    })
    .expect("what is laid out is a board");
    machine.semihosting.enabled = true;
    elf.load(&mut machine.bus.memory, true)
        .expect("what is laid out takes the image");
    machine.reset();
    machine.run(3_000);
    true
}

fn mutated(bytes: &[u8], random: &mut Random) -> Vec<u8> {
    let mut copy = bytes.to_vec();
    for _ in 0..1 + random.below(6) {
        let at = random.below(copy.len());
        match random.below(5) {
            0 => copy.truncate(at.max(1)),
            1 => copy[at] ^= 1 << random.below(8),
            2 => copy[at] = [0, 0xff, 0x7f, 0x80][random.below(4)],
            // Fields are words.
            _ => {
                let at = at & !3;
                let value = [
                    0,
                    1,
                    u32::MAX,
                    0x8000_0000,
                    random.next(),
                    random.next() & 0xfff,
                ][random.below(6)];
                let end = copy.len().min(at + 4);
                copy[at..end].copy_from_slice(&value.to_le_bytes()[..end - at]);
            }
        }
    }
    copy
}

#[test]
fn broken_elfs_are_refused_or_run_and_never_panic() {
    let (images, all) = breaks(&[made()]);
    println!("{images} of {all} broken ELFs were images all the same");
    assert!(images > 10, "mutations that break everything test little");
}

#[test]
fn broken_elfs_of_a_compiler_are_refused_or_run_and_never_panic() {
    let Some(gcc) = whippen_need::tool("arm-none-eabi-gcc") else {
        return;
    };
    let (images, all) = breaks(&compiled(&gcc));
    println!("{images} of {all} broken ELFs were images all the same");
    assert!(images > 20, "mutations that break everything test little");
}

/// A small image.
fn made() -> Vec<u8> {
    let text: Vec<u8> = [0x2000_4000_u32, 0x0800_0009, 0x4770_2001, 0xbf00_bf00]
        .iter()
        .flat_map(|w| w.to_le_bytes())
        .collect();
    let parts = [
        Part {
            run: 0x0800_0000,
            load: 0x0800_0000,
            bytes: &text,
            memory_bytes: 16,
            flags: 5,
        },
        Part {
            run: 0x2000_0000,
            load: 0x0800_0010,
            bytes: &[1, 2, 3, 4],
            memory_bytes: 64,
            flags: 6,
        },
    ];
    elf_of(2, 0x0800_0009, &parts)
}

/// Of how many broken copies how many were images.
fn breaks(originals: &[Vec<u8>]) -> (usize, usize) {
    let mut random = Random(0x9e37_79b9_7f4a_7c15);
    let (mut images, mut all) = (0, 0);
    for original in originals {
        assert!(survives(original), "the original runs");
        // Headers and tables are where a change matters: they are hit as often as all the rest.
        for round in 0..1500 {
            let mut copy = mutated(original, &mut random);
            if round % 2 == 0 {
                let head = copy.len().min(180);
                let start = mutated(&original[..head], &mut random);
                let length = start.len().min(copy.len());
                copy[..length].copy_from_slice(&start[..length]);
            }
            all += 1;
            images += usize::from(survives(&copy));
        }
    }
    (images, all)
}

/// A linked image and an object file with symbols, relocations and lines.
fn compiled(gcc: &Path) -> Vec<Vec<u8>> {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let source = folder.path().join("a.c");
    let text = "extern int other(int); int table[4] = {1, 2, 3, 4}; int zero;\n\
                int helper(int x) { return table[x & 3] + zero; }\n\
                int main(int n) { zero = n; return n > 9 ? other(n) : helper(n); }\nint weak(void) { return main(3); }\n";
    std::fs::write(&source, text).expect("writable");
    let build = |options: &[&str]| {
        let image = folder.path().join("a.out");
        let mut gcc = std::process::Command::new(gcc);
        gcc.args(["-mcpu=cortex-m33", "-mthumb", "-O1", "-g", "-nostdlib"])
            .args(options)
            .arg(&source)
            .arg("-o")
            .arg(&image);
        let output = gcc.output().expect("gcc starts");
        let said = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success(), "{said}");
        std::fs::read(image).expect("just made")
    };
    let linked = build(&[
        "-Ttext=0x20000000",
        "-Wl,-e,main",
        "-Wl,--defsym=other=0x20000001",
    ]);
    vec![linked, build(&["-c"])]
}

/// An observer makes a run go instruction by instruction.
struct Idle;

impl Observer for Idle {
    fn instruction(&mut self, _: &Step<'_>) {}
}

/// A handler of faults that goes on two bytes behind the one that faulted, somewhere in the first 8
/// KiB of RAM: finds the frame by EXC_RETURN, changes its return address, and sets its xPSR to
/// Thumb alone.
const HANDLER: [u16; 21] = [
    0x4670, 0x2104, 0x4208, 0xd002, 0xf3ef, 0x8009, 0xe001, 0xf3ef, 0x8008, 0x6981, 0x04c9, 0x0cc9,
    0x3102, 0x2220, 0x0612, 0x4311, 0x6181, 0x2101, 0x0609, 0x61c1, 0x4770,
];

/// A machine full of random code, most of it likely to be valid, with random registers and vectors
/// into the code.
fn wild(core: CoreKind, seed: u64) -> Machine {
    const RAM: u32 = 0x2000_0000;
    let mut random = Random(seed);
    let regions = vec![
        Region::ram("ram", RAM, 16 << 10),
        Region::rom("rom", 0x0800_0000, 4096),
    ];
    let mut machine = Machine::new(Board {
        regions,
        vector_table: 0x0800_0000,
        ..Board::generic(core)
    })
    .expect("a board");
    machine.semihosting.enabled = true;
    let code: Vec<u8> = (0..8000)
        .flat_map(|_| halfword(&mut random).to_le_bytes())
        .collect();
    machine.bus.memory.write(RAM, &code).expect("RAM");
    let mut vectors = vec![RAM + 0x3f00];
    let vector = |number| {
        if (3..7).contains(&number) {
            0x0800_0801
        } else {
            (RAM + random.next() % 0x2000) | 1
        }
    };
    vectors.extend((1..64).map(vector));
    let vectors: Vec<u8> = vectors.into_iter().flat_map(u32::to_le_bytes).collect();
    machine
        .bus
        .memory
        .write(0x0800_0000, &vectors)
        .expect("ROM");
    let handler: Vec<u8> = HANDLER.iter().flat_map(|h| h.to_le_bytes()).collect();
    machine
        .bus
        .memory
        .write(0x0800_0800, &handler)
        .expect("ROM");
    machine.reset();
    for number in 0..13 {
        // Half of them point into RAM, so that loads and stores do something.
        let value = if number % 2 == 0 {
            RAM + random.next() % 0x4000
        } else {
            random.next()
        };
        machine.cpu_mut(0).set(Register::core(number), value);
    }
    machine
        .bus
        .write(0xe000_ed88, 4, 0xf << 20, 0)
        .unwrap_or(());
    machine
}

fn halfword(random: &mut Random) -> u16 {
    let word = random.next();
    match word >> 16 & 7 {
        // 32-bit data processing and loads, short branches, 16-bit anything.
        0 => 0xea00 | word as u16 & 0x1ff,
        1 => 0xf800 | word as u16 & 0x1ff,
        2 => 0xd000 | word as u16 & 0x0f0f,
        3 => 0xfb00 | word as u16 & 0xff,
        4 => 0xb000 | word as u16 & 0xfff,
        _ => word as u16 & 0x7fff,
    }
}

#[test]
fn random_code_runs_the_same_by_blocks_and_by_instructions() {
    let state = |machine: &Machine| -> Vec<u32> {
        Register::all().map(|r| machine.cpu(0).get(r)).collect()
    };
    let (mut cycles, mut programs) = (0, 0);
    for core in CoreKind::ALL {
        for seed in 1..=150_u64 {
            let (mut blocks, mut steps) = (
                wild(core, seed * 0x1234_5678_9abd),
                wild(core, seed * 0x1234_5678_9abd),
            );
            for slice in 1..=6_u64 {
                let until = slice * slice * 100;
                let (one, other) = (blocks.run(until), steps.run_observed(until, &mut Idle));
                assert_eq!(one, other, "{} seed {seed} until {until}", core.name());
                assert_eq!(
                    state(&blocks),
                    state(&steps),
                    "{} seed {seed} until {until}: {one}",
                    core.name()
                );
                assert_eq!(
                    blocks.cycle(0),
                    steps.cycle(0),
                    "{} seed {seed} until {until}",
                    core.name()
                );
                assert_eq!(
                    blocks.instructions(),
                    steps.instructions(),
                    "{} seed {seed} until {until}",
                    core.name()
                );
                if one != Stop::Limit {
                    break;
                }
            }
            let mut memory = [[0; 16 << 10], [0; 16 << 10]];
            blocks
                .bus
                .memory
                .read(0x2000_0000, &mut memory[0])
                .expect("RAM");
            steps
                .bus
                .memory
                .read(0x2000_0000, &mut memory[1])
                .expect("RAM");
            assert!(
                memory[0] == memory[1],
                "{} seed {seed}: memory differs",
                core.name()
            );
            cycles += blocks.cycle(0);
            programs += 1;
        }
    }
    println!("{programs} programs, {cycles} cycles");
    assert!(
        cycles > 50_000,
        "random code that ends at once tests little"
    );
}
