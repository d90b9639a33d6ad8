//! An image with two programs that switches between them: frames in which a program begins are
//! bounded too.

use whippen_compiler::audit::{Certificate, Elf, audit};
use whippen_compiler::budget::{Bounded, Program, TickHandlerBound, cores};
use whippen_compiler::firmware::{FirmwareImage, build_image};
use whippen_compiler::image::{Board, executable};
use whippen_compiler::keyboard::{InstrumentId, Layout, Program as KeyboardProgram, ProgramId};
use whippen_compiler::pipeline::{Compiled, certify, unobserved};
use whippen_compiler::rate::Rate;
use whippen_emulator::{BoardKind, Converter, ConverterSetup, Observer, Step, Stop, build};
use whippen_isa::timing::Rules;
use whippen_runtime::board;
use whippen_runtime::device::Device;
use whippen_runtime::image::{ImageInstrument, setup};

use crate::common;
use crate::image::instruments;

const KEYS: u32 = 9;
/// Ticks between two switches: a key begins each, so all play before the next.
const APART: u32 = 40;
const SWITCHES: u32 = 12;

/// The longest frame of each core, and how many there were.
#[derive(Default)]
struct Frames {
    began: [Option<u64>; 2],
    longest: [u64; 2],
    count: u32,
}

impl Observer for Frames {
    fn instruction(&mut self, _: &Step<'_>) {}

    fn exception(&mut self, core: usize, _: u32, cycle: u64) {
        self.began[core & 1] = Some(cycle);
    }

    fn exception_return(&mut self, core: usize, _: u32, cycle: u64) {
        let Some(began) = self.began[core & 1].take() else {
            return;
        };
        self.longest[core & 1] = self.longest[core & 1].max(cycle - began);
        self.count += 1;
    }
}

/// An image of two programs, each zones of so many keys of an instrument, that switches between
/// them, and no frame takes longer than its bound. How many zones the cores have in each program.
fn switches(names: &[&str], zones: [&[(u32, usize)]; 2], keys: [u32; 2]) -> [Vec<usize>; 2] {
    let of = |name: &&str| {
        instruments()
            .into_iter()
            .find(|compiled| compiled.model.name == *name)
            .expect("bundled")
    };
    let compiled: Vec<Compiled> = names.iter().map(of).collect();
    let prepare = |compiled| {
        ImageInstrument::new(compiled, 2000, None, &mut unobserved)
            .unwrap_or_else(|e| panic!("{e:?}"))
    };
    let prepared: Vec<ImageInstrument> = compiled.iter().map(prepare).collect();
    let mut setup =
        setup(&compiled[0], &Device::of(&compiled[0].model), KEYS, 2, 21).expect("a setup");
    setup.keys = keys.to_vec();
    let programs = zones.map(|zones| {
        let id = |at: usize| InstrumentId(at as u32);
        KeyboardProgram::of_zones("zones", zones.iter().map(|&(keys, at)| (keys, id(at))))
    });
    let layout = Layout {
        first_note: 21,
        keys: KEYS,
        programs: programs.to_vec().into(),
    };
    let board = board::bundled("rp2350").expect("it is bundled");
    // Not divided anew: both cores have the keys that the case says.
    let instruments = ImageInstrument::borrow_all(&prepared);
    let whole =
        build_image(&layout, &instruments, &setup, &board).unwrap_or_else(|e| panic!("{e}"));
    let image = &whole.image;
    let program = Program::of(image);
    let bounds = [0, 1].map(|playing| {
        cores(&whole, &program, &board, ProgramId(playing)).unwrap_or_else(|e| panic!("{e}"))
    });
    audited(&whole, &board, setup.rate_hz, &bounds);
    let converter = ConverterSetup {
        keys: KEYS,
        rate: setup.rate_hz.fraction(),
    };
    let (mut machine, ports) =
        build(BoardKind::Rp2350, BoardKind::Rp2350.board(), converter).expect("a board");
    for segment in &image.segments {
        machine
            .bus
            .memory
            .write(segment.load, &segment.bytes)
            .expect("memory");
    }
    machine.set_rules(Rules {
        at_worst: true,
        ..Rules::default()
    });
    machine.set_meets_fetches(true);
    machine.reset();
    let words = common::gesture_words(&compiled[0]);
    let row = (0..KEYS * APART * SWITCHES).map(|at| words[(at as usize * 31) % words.len()]);
    machine
        .bus
        .device_mut::<Converter>(ports.converter)
        .expect("the converter")
        .samples
        .extend(row);
    let mut frames = Frames::default();
    let (mailbox, core0) = (program.symbols["mailbox"], program.symbols["core0"]);
    let mut begun = [false; 2];
    for switch in 0..SWITCHES {
        let request = [(4, u32::MAX), (8, switch % 2), (0, switch + 1)];
        for (at, word) in request {
            machine
                .bus
                .memory
                .write(mailbox + at, &word.to_le_bytes())
                .expect("memory");
        }
        let until = machine.cycle(0) + u64::from(APART) * 3401;
        assert!(
            matches!(machine.run_observed(until, &mut frames), Stop::Limit),
            "it plays on"
        );
        let mut code = [0; 4];
        machine.bus.memory.read(core0, &mut code).expect("memory");
        let name = ["core0_tick", "core0_1_tick"][switch as usize % 2];
        begun[switch as usize % 2] |= u32::from_le_bytes(code) & !1 == program.symbols[name];
    }
    assert_eq!(begun, [true; 2], "both have played");
    assert!(frames.count > APART * SWITCHES, "{} frames", frames.count);
    for (core, observed) in frames.longest.into_iter().enumerate() {
        let frames = bounds.each_ref().map(|cores| &cores[core].contended);
        let visits = |frame: &&TickHandlerBound| {
            frame
                .parts
                .iter()
                .find(|(what, _)| what.contains("visits"))
                .map_or(0, |(_, n)| *n)
        };
        let bound = frames
            .iter()
            .map(|frame| frame.handler.cycles_max + visits(frame))
            .max()
            .unwrap_or(0);
        println!("{names:?}, core {core}: frame {observed} of {bound}");
        assert!(observed <= bound, "core {core}: {observed} > {bound}");
        assert!(
            observed * 3 > bound,
            "core {core}: {observed} is far from {bound}"
        );
    }
    [0, 1].map(|program: usize| {
        let cores = &whole.program(ProgramId(program as u32)).cores;
        cores.iter().map(|core| core.zones.len()).collect()
    })
}

/// Both programs on both cores have a certificate that is accepted. Where no core has several
/// zones its cycles are those of the bound; where one has, the certificate plays all keys also
/// while one begins.
fn audited(whole: &FirmwareImage, board: &Board, rate_hz: Rate, bounds: &[Vec<Bounded>; 2]) {
    let file = executable(&whole.image, &[], None);
    let certificate = certify(whole, board, rate_hz, "", &file);
    let certificate = certificate.unwrap_or_else(|why| panic!("{why}"));
    let mut elf = Elf::read(&file).expect("it is an ELF file");
    elf.kernels = Some(String::new());
    let text = certificate.to_string();
    let judged = |text: &str| audit(&elf, &Certificate::read(text).expect("it can be read"));
    let checked = judged(&text).unwrap_or_else(|why| panic!("{why}"));
    assert_eq!(checked.len(), 4);
    // The way that empties lines is certified with a cycle more.
    let mut zones = whole.programs.iter().flat_map(|program| program.zones());
    let empties = zones.any(|zone| !zone.empty_pieces.is_empty());
    for checked in &checked {
        let bound = &bounds[checked.program as usize][checked.core as usize].contended;
        let (own, proven) = (checked.cycles as i64, bound.cycles_max as i64);
        println!(
            "core {}, program {}: certified {own} of {proven}, {} keys of {} at most",
            checked.core, checked.program, checked.keys, checked.key
        );
        let more = match bound.zones.len() {
            1 => i64::from(empties),
            _ => 2 * bound.key_cycles_max() as i64,
        };
        assert!((-4..=more).contains(&(own - proven)), "{own} of {proven}");
        assert_eq!(checked.keys, bound.keys);
        assert_eq!(checked.key, bound.key_cycles_max());
        assert_eq!(checked.stack, bound.stack_bytes_max);
    }
    // In a row of zones, a call that ticks a key less, or costs what another function does, or
    // never comes. (Elsewhere one may be on no longest path, and what is claimed of it changes
    // nothing.)
    let mut function = "";
    for (at, line) in text.lines().enumerate() {
        function = line.strip_prefix("function ").unwrap_or(function);
        if !function.starts_with("zones ") || !line.contains(" costs ") {
            continue;
        }
        let words: Vec<&str> = line.split(' ').collect();
        let [call, function, keys] = [&words[..4], &words[4..5], &words[5..]].map(|w| w.join(" "));
        let [function, keys] = [function, keys].map(|word| word.parse::<u32>().expect("a number"));
        let less = keys.checked_sub(1);
        let lies = [
            less.map(|less| format!("{call} {function} {less}")),
            Some(format!("{call} {} {keys}", function + 1)),
            Some(line.replace(&format!("costs {function} {keys}"), "never")),
        ];
        for lie in lies.into_iter().flatten() {
            let lines = text.lines().enumerate();
            let lines = lines.map(|(own, line)| if own == at { lie.as_str() } else { line });
            let told: Vec<&str> = lines.collect();
            assert!(
                judged(&(told.join("\n") + "\n")).is_err(),
                "{line} as {lie}"
            );
        }
    }
}

#[test]
fn a_program_that_begins_keeps_its_bound() {
    let zones = switches(
        &["hammond", "virtual_spring"],
        [&[(KEYS, 0)], &[(KEYS, 1)]],
        [5, 4],
    );
    assert_eq!(zones, [vec![1, 1], vec![1, 1]]);
}

/// Several instruments on a core, a core that begins in the midst of a zone, an instrument in two
/// zones; and from all keys alike to zones and back.
#[test]
fn zones_that_begin_keep_their_bound() {
    let names = ["hammond", "harpsichord", "virtual_spring"];
    let zones = switches(&names, [&[(2, 0), (5, 1), (2, 0)], &[(KEYS, 2)]], [6, 3]);
    assert_eq!(zones, [vec![2, 2], vec![1, 1]]);
    let zones = switches(
        &names,
        [&[(1, 0), (1, 2), (1, 1), (6, 0)], &[(6, 1), (3, 0)]],
        [4, 5],
    );
    assert_eq!(zones, [vec![4, 1], vec![1, 2]]);
}

/// Lines are emptied before the first key begins, on a core with keys that are alike and on one
/// with two zones.
#[test]
fn programs_with_lines_keep_their_bound() {
    let names = ["clavichord_heard", "virtual_spring"];
    let zones = switches(&names, [&[(1, 0), (8, 1)], &[(KEYS, 1)]], [1, 8]);
    assert_eq!(zones, [vec![1, 1], vec![1, 1]]);
    let zones = switches(&names, [&[(2, 0), (7, 1)], &[(KEYS, 1)]], [4, 5]);
    assert_eq!(zones, [vec![2, 1], vec![1, 1]]);
}
