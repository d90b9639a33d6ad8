//! Random programs against other people's emulators, cycle by cycle: `rp2040py` for several
//! machines with queues, flags, waits and dividers, `rp2040-pio-emulator` for automatic pushes and
//! pulls. What neither is asked is in `forms`, by hand; the emulator's manual lists it.

use std::fmt::Write as _;
use std::io::Write as _;
use std::path::PathBuf;
use std::process::{Command, Stdio};

use super::*;

/// Programs for each judge.
const CASES: u64 = 300;
const CYCLES: u64 = 240;
/// Pins from here on are inputs, those below outputs.
const INPUTS: u32 = 16;

/// The same numbers in every run.
struct Random(u64);

impl Random {
    fn new(case: u64) -> Self {
        Self(0x9e37_79b9_7f4a_7c15 ^ (case + 1).wrapping_mul(0xd134_2543_de82_ef95))
    }

    fn below(&mut self, end: u32) -> u32 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (((self.0 >> 32) * u64::from(end)) >> 32) as u32
    }

    fn word(&mut self) -> u32 {
        self.below(1 << 16) << 16 | self.below(1 << 16)
    }

    fn of(&mut self, choices: &[u32]) -> u32 {
        choices[self.below(choices.len() as u32) as usize]
    }
}

/// What is done to a block, and when: register writes (or reads), and levels of inputs.
#[derive(Default, Debug)]
struct Case {
    ops: Vec<(u64, u32, Option<u32>)>,
    inputs: Vec<(u64, u32)>,
    /// Cycles until a machine sees an input.
    late: u64,
}

/// An instruction that the first judge knows as the datasheet has it, for a machine with so many
/// bits for delays.
fn instruction(random: &mut Random, len: u32) -> u32 {
    let field = random.below(32) << 8;
    let count = random.below(32);
    field
        | match random.below(16) {
            0..3 => random.below(8) << 5 | random.below(len),
            3 => {
                let pin = random.below(14);
                0x2000 | random.below(2) << 7 | random.of(&[INPUTS + pin, 1 << 5 | pin])
            }
            4 => 0x2000 | random.below(2) << 7 | 2 << 5 | random.below(8) | random.below(2) << 4,
            5 => 0x4000 | (1 + random.below(14)),
            6 => 0x4000 | random.of(&[1, 2, 3, 6, 7]) << 5 | count,
            // Of 32 bits it leaves the OSR as it was; the datasheets shift it empty.
            7..9 => 0x6000 | random.of(&[0, 1, 2, 3, 4, 6]) << 5 | count.max(1),
            9 => 0x8000 | random.below(2) << 5,
            10 => 0x8080 | random.below(2) << 5,
            11 | 12 => {
                let source = random.of(&[1, 2, 3, 5, 6, 7]);
                0xa000 | random.of(&[0, 1, 2, 6, 7]) << 5 | random.below(3) << 3 | source
            }
            13 => 0xc000 | random.below(4) << 5 | random.below(8) | random.below(2) << 4,
            _ => 0xe000 | random.of(&[0, 1, 2, 4]) << 5 | random.below(32),
        }
}

fn pinctrl(random: &mut Random) -> u32 {
    let side = random.below(4);
    let [out, set, side_base] = [0; 3].map(|_| random.below(10));
    let (outs, sets) = (random.below(7), random.below(6));
    side << 29 | sets << 26 | outs << 20 | INPUTS << 15 | side_base << 10 | set << 5 | out
}

/// A block with up to four machines. With a `divider` no machine can stall, as the judge begins a
/// divider anew after a stall.
fn block(case: u64, divider: Option<u32>) -> Case {
    let random = &mut Random::new(case);
    let mut ops = Vec::new();
    let len = 4 + random.below(28);
    for i in 0..len {
        let word = loop {
            let word = instruction(random, len);
            let stalls = [1, 4].contains(&(word >> 13)) || word & 0xe020 == 0xc020;
            if divider.is_none() || !stalls {
                break word;
            }
        };
        ops.push((0, 0x48 + 4 * i, Some(word)));
    }
    for machine in 0..4 {
        let at = |register: u32| 0xc8 + STRIDE * machine + register;
        let wrap = random.below(len);
        let exec =
            random.below(2) << 30 | random.below(2) << 29 | (INPUTS + random.below(14)) << 24;
        let status = random.below(2) << 4 | random.below(6);
        let exec = exec | (len - 1) << 12 | wrap << 7 | status;
        let pins = pinctrl(random);
        // A side-set that is optional takes one bit for that.
        let pins = if pins >> 29 == 0 {
            pins
        } else {
            pins.max(2 << 29)
        };
        ops.push((0, at(4), Some(exec)));
        ops.push((
            0,
            at(8),
            Some(random.below(4) << 18 | random.below(32) << 25),
        ));
        ops.push((0, at(0x14), Some(pins)));
        if let Some(divider) = divider {
            ops.push((3, at(0), Some(divider)));
        }
    }
    ops.push((1, 0, Some(0xf0)));
    ops.push((3, 0, Some(1 + random.below(15))));
    let inputs = traffic(random, &mut ops);
    let bypass = random.below(2);
    ops.push((0, 0x38, Some(bypass * u32::MAX)));
    let late = if bypass == 1 { 2 } else { 4 };
    Case { ops, inputs, late }
}

/// What the system and the world do while the machines run.
fn traffic(random: &mut Random, ops: &mut Vec<(u64, u32, Option<u32>)>) -> Vec<(u64, u32)> {
    let mut inputs = Vec::new();
    for cycle in 4..CYCLES {
        let machine = 4 * random.below(4);
        match random.below(24) {
            0..3 => ops.push((cycle, 0x10 + machine, Some(random.word()))),
            3..6 => ops.push((cycle, 0x20 + machine, None)),
            6 => ops.push((cycle, 0x30, Some(random.below(256)))),
            7 => ops.push((cycle, 0x34, Some(1 << random.below(8)))),
            8..11 => inputs.push((cycle, random.word() >> 18 << INPUTS)),
            _ => {}
        }
    }
    inputs
}

/// What a block does in a case: a line a cycle, then what was read. As the judge prints it.
fn ours(case: &Case) -> String {
    let mut bench = Bench::new(BoardKind::Rp2040);
    for pin in 0..INPUTS {
        bench.write(0x4001_c004 + 4 * pin, 0);
    }
    let id = bench.pio();
    let (mut lines, mut reads) = (Vec::new(), Vec::new());
    for cycle in 0..CYCLES {
        bench.run(cycle);
        for (_, levels) in case.inputs.iter().filter(|(at, _)| *at == cycle) {
            let mask = u64::from(u32::MAX >> 2 << INPUTS);
            let pins = &mut bench.machine.bus.pins;
            pins.set_outside(mask, Some(u64::from(*levels)), cycle + 1);
            bench.machine.bus.give_notice(cycle);
        }
        let pio = bench.machine.bus.device_mut::<Pio>(id).expect("a block");
        let mut words = vec![pio.levels, pio.directions, u32::from(pio.flags)];
        words.push(pio.fill_levels());
        words.extend(pio.machines.iter().flat_map(|m| [m.pc, m.x, m.y, m.osr]));
        lines.push(hexadecimal(&words, ","));
        for (_, offset, value) in case.ops.iter().filter(|(at, ..)| *at == cycle) {
            match value {
                Some(value) => bench.write(PIO + offset, *value),
                None => reads.push(bench.read(PIO + offset)),
            }
        }
    }
    format!("{}|{}", lines.join(" "), hexadecimal(&reads, " "))
}

fn hexadecimal(words: &[u32], between: &str) -> String {
    let words: Vec<String> = words.iter().map(|word| format!("{word:x}")).collect();
    words.join(between)
}

/// What a judge prints of cases: a line each. None where it is not installed, and the test counts
/// as skipped.
fn asked(module: &str, script: &str, cases: &str) -> Option<Vec<String>> {
    let python = whippen_need::python(module)?;
    let script = PathBuf::from(env!("CARGO_MANIFEST_DIR"))
        .join("tests/judges")
        .join(script);
    let mut running = Command::new(python)
        .arg(script)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .expect("Python starts");
    let mut input = running.stdin.take().expect("a pipe");
    let cases = cases.to_string();
    let writer = std::thread::spawn(move || input.write_all(cases.as_bytes()));
    let output = running.wait_with_output().expect("it ends");
    writer.join().expect("it writes").expect("it reads");
    assert!(output.status.success(), "the judge failed");
    let text = String::from_utf8(output.stdout).expect("text");
    Some(text.lines().map(str::to_string).collect())
}

fn json(case: &Case) -> String {
    let op = |(cycle, offset, value): &(u64, u32, Option<u32>)| {
        let value = value.map_or("null".to_string(), |value| value.to_string());
        format!("[{cycle}, {offset}, {value}]")
    };
    let ops: Vec<String> = case.ops.iter().map(op).collect();
    let inputs: Vec<String> = case
        .inputs
        .iter()
        .map(|(c, l)| format!("[{c}, {l}]"))
        .collect();
    format!(
        "{{\"cycles\": {CYCLES}, \"late\": {}, \"ops\": [{}], \"inputs\": [{}]}}\n",
        case.late,
        ops.join(", "),
        inputs.join(", ")
    )
}

/// Where two lines of a case differ first, in words.
fn difference(ours: &str, theirs: &str) -> String {
    let split =
        |line: &str| -> Vec<String> { line.split([' ', '|']).map(str::to_string).collect() };
    let (ours, theirs) = (split(ours), split(theirs));
    let at = ours.iter().zip(&theirs).position(|(a, b)| a != b);
    let at = at.unwrap_or(ours.len().min(theirs.len()));
    let mut text = format!("cycle {at}: ours, theirs\n");
    for i in at.saturating_sub(6)..(at + 3).min(ours.len()).min(theirs.len()) {
        let _ = writeln!(text, "  {i:3} \n    {}\n    {}", ours[i], theirs[i]);
    }
    text
}

fn cases() -> u64 {
    whippen_need::count("WHIPPEN_CASES", CASES)
}

/// How two lines of one case compare; nothing where they agree.
fn check(judge: &str, cases: &[Case], compare: impl Fn(&str, &str) -> Option<String>) {
    let input: String = cases.iter().map(json).collect();
    let Some(theirs) = asked("rp2040py", "pio_rp2040py.py", &input) else {
        return;
    };
    assert_eq!(theirs.len(), cases.len());
    let compared = cases.iter().zip(&theirs).enumerate();
    let wrong: Vec<String> = compared
        .filter_map(|(number, (case, theirs))| {
            let difference = compare(&ours(case), theirs)?;
            Some(format!("case {number}, {difference}"))
        })
        .collect();
    println!("{judge}: {} cases of {CYCLES} cycles", cases.len());
    let first = wrong.first().map_or("", |text| text);
    assert!(wrong.is_empty(), "{} wrong: {first}", wrong.len());
}

#[test]
fn blocks_do_what_rp2040py_says() {
    let cases: Vec<Case> = (0..cases()).map(|case| block(case, None)).collect();
    check("machines that stall", &cases, |ours, theirs| {
        (ours != theirs).then(|| difference(ours, theirs))
    });
}

#[test]
fn whole_dividers_are_as_rp2040py_says() {
    let divided = |case| block(case, Some((2 + (case as u32) % 5) << 16));
    let cases: Vec<Case> = (0..cases() / 3).map(divided).collect();
    check("divided by integers", &cases, |ours, theirs| {
        (ours != theirs).then(|| difference(ours, theirs))
    });
}

/// States of the machine 0 in their order, each with the cycle in which it began.
fn states(line: &str) -> Vec<(usize, String)> {
    let cycles = line.split('|').next().unwrap_or_default().split(' ');
    let own = |state: &str| -> String {
        let words: Vec<&str> = state.split(',').collect();
        words[4..8].join(",")
    };
    let mut states: Vec<(usize, String)> = cycles.map(own).enumerate().collect();
    states.dedup_by(|later, earlier| later.1 == earlier.1);
    states
}

/// Where fractions add up to a cycle, the judge's periods and the datasheets' are the same but for
/// their phase: what comes, comes in the same order and at most a cycle apart.
#[test]
fn fractions_are_within_a_cycle_of_what_rp2040py_says() {
    let fraction = |case: u64| (2 + case as u32 % 4) << 16 | (case as u32 * 37 % 255 + 1) << 8;
    let quiet = |case| {
        let mut quiet = block(case, Some(fraction(case)));
        quiet.ops.retain(|(cycle, ..)| *cycle < 4);
        quiet.inputs.clear();
        quiet
    };
    let cases: Vec<Case> = (0..cases() / 3).map(quiet).collect();
    check("divided by fractions", &cases, |ours, theirs| {
        let (ours, theirs) = (states(ours), states(theirs));
        let apart = ours.iter().zip(&theirs);
        let mut apart = apart.filter(|(a, b)| a.1 != b.1 || !(a.0..=a.0 + 1).contains(&b.0));
        apart.next().map(|(a, b)| format!("{a:?} for {b:?}"))
    });
}

mod automatic;
mod sender;
