//! Sound on the pins: what a DAC is given is what the interpreter makes of the words that the board
//! had, sample for sample, whatever comes late.

use std::f64::consts::TAU;

use whippen_compiler::board::{Board, SoundPort};
use whippen_compiler::budget::Bounded;
use whippen_compiler::check::Options;
use whippen_compiler::firmware::{OwnTexts, core_block};
use whippen_compiler::front::compile_front;
use whippen_compiler::image::Image;
use whippen_compiler::kernel::{Interp, Kernel};
use whippen_compiler::keyboard::Layout;
use whippen_compiler::modes::INSTRUCTIONS;
use whippen_compiler::pipeline::{self, unobserved};
use whippen_compiler::rate::Rate;
use whippen_compiler::source::SourceMap;
use whippen_emulator::{
    BenchPins, BoardKind, ConverterSetup, DacErrors, DacPins, DeviceId, Finger, Hand, HeardFrame,
    KeyBench, KeyPins, Knob, Machine, SoundDac, Stop, build,
};
use whippen_runtime::board;
use whippen_runtime::device::Device;
use whippen_runtime::image::{self, ImageInstrument};

use crate::{key_bench, knob_bench};

const PERIOD: u64 = 3400;
const BOWED: &str = include_str!("../../examples/bowed-knob/bowed-knob.whip");
const HELD: &str = include_str!("../../instruments/clavichord-heard.whip");
const SIDES: &str = include_str!("../programs/sound.whip");

/// A program for a board, and what it takes.
struct Built {
    image: Image,
    bounded: Option<Bounded>,
    board: Board,
    kernel: Kernel,
    keys: usize,
}

/// Builds the only instrument of a text; proven to be in time, unless texts are one's own.
fn built(text: &str, board: &str, device: &str, keys: u32, own_texts: OwnTexts) -> Built {
    let mut map = SourceMap::default();
    map.add("heard.whip", text);
    let options = Options {
        rate_hz: Rate::new(750_000, 17),
        ..Options::default()
    };
    let (program, diagnostics) = compile_front(&mut map, &options);
    let program = program.unwrap_or_else(|| panic!("{diagnostics:#?}"));
    let model = program.instruments.into_iter().next().expect("one");
    let device = Device::bundled(device).expect("it is bundled");
    let board = board::bundled(board).expect("it is bundled");
    let compiled = pipeline::compile(model, device.scales(), false).expect("it lowers");
    let mut setup = image::setup(&compiled, &device, keys, board.cores, 21).expect("it is set up");
    let is_proven = own_texts.is_empty();
    setup.own_texts = own_texts;
    let parts = [
        ImageInstrument::new(&compiled, INSTRUCTIONS, None, &mut unobserved).expect("it has modes"),
    ];
    let layout = Layout::of_one_instrument("heard", keys, 21);
    let borrowed = ImageInstrument::borrow_all(&parts);
    let made = pipeline::build(&layout, &borrowed, &setup, &board, &mut unobserved);
    let made = made.unwrap_or_else(|e| panic!("{e}"));
    let bounded = is_proven.then(|| {
        let proof = pipeline::prove(&made, &board, setup.rate_hz, &mut unobserved);
        let mut proof = proof.unwrap_or_else(|e| panic!("{e}"));
        let program = &mut proof.programs[0];
        assert!(program.budget.fits(), "{}", program.budget);
        program.cores.swap_remove(0)
    });
    Built {
        image: made.image,
        bounded,
        board,
        kernel: compiled.lowered.kernel,
        keys: keys as usize,
    }
}

/// Attaches a DAC to the wires of a port.
pub fn attach_dac(machine: &mut Machine, port: SoundPort) -> DeviceId {
    let wires = DacPins {
        clock: port.clock,
        side: port.side,
        data: port.data,
    };
    SoundDac::attach(&mut machine.bus, wires, 150e6)
}

/// What a DAC has been given since it was asked last, nothing of which its datasheet forbids.
pub fn take_frames(machine: &mut Machine, dac: DeviceId) -> Vec<HeardFrame> {
    let dac = machine.bus.device_mut::<SoundDac>(dac).expect("a DAC");
    assert_eq!(dac.errors(), DacErrors::default());
    dac.take_frames()
}

/// What a tick lets hear on both sides, of all keys.
pub fn both_sides(interp: &Interp, kernel: &Kernel, keys: usize) -> [i32; 2] {
    let cells = kernel.channels();
    [0, 1].map(|at: usize| {
        let cell = cells[at.min(cells.len() - 1)];
        let sum: i64 = (0..keys).filter_map(|key| interp.cell(key, cell, 0)).sum();
        sum.clamp(-(1 << 30), (1 << 30) - 1) as i32
    })
}

/// That samples are in the queue before left is taken, by what is proven of the frame up to there,
/// with all that the whole tick may wait for.
pub fn assert_given_in_time(what: &str, bounded: &Bounded) {
    let before = [
        "the instruction in progress",
        "entry of the interrupt",
        "which tick, which words",
        "board_begin",
        "what is heard, of all keys",
    ];
    let bound = &bounded.contended;
    let parts = bound.parts.iter();
    let own = parts.filter(|(name, _)| before.contains(&name.as_str()));
    assert_eq!(own.clone().count(), before.len(), "{:?}", bound.parts);
    let waits = bound.cycles_max - bounded.alone.cycles_max;
    let cycles = own.map(|(_, cycles)| cycles).sum::<u64>() + waits;
    let taken = u64::from(SoundPort::taken_cycles(PERIOD as u32));
    println!("{what}: {cycles} of {taken} cycles");
    assert!(cycles + 100 < taken);
}

/// A board that has power, with its parts and a DAC.
struct Heard<'a> {
    machine: Machine,
    moved: DeviceId,
    dac: DeviceId,
    built: &'a Built,
}

impl<'a> Heard<'a> {
    fn new(built: &'a Built) -> Heard<'a> {
        let kind = BoardKind::Rp2350;
        let (mut machine, _) =
            build(kind, kind.board(), ConverterSetup::default()).expect("the board can be");
        for segment in &built.image.segments {
            let memory = &mut machine.bus.memory;
            memory.write(segment.load, &segment.bytes).expect("memory");
        }
        let moved = match &built.board.bench {
            None => Knob::attach(&mut machine.bus, knob_bench::PINS, knob_bench::PARTS),
            Some(bench) => {
                let pins = bench.sensors.iter().zip(&bench.bridges);
                let key = |(sensor, bridge): (&u32, &u32)| KeyPins {
                    sensor: *sensor,
                    bridge: *bridge,
                };
                let pins = BenchPins {
                    keys: pins.map(key).collect(),
                    sleep: bench.sleep,
                    fault: bench.fault,
                };
                KeyBench::attach(&mut machine.bus, pins, key_bench::PARTS)
            }
        };
        let port = built.board.i2s.expect("a sound output");
        let dac = attach_dac(&mut machine, port);
        machine.reset();
        Heard {
            machine,
            moved,
            dac,
            built,
        }
    }

    fn pass(&mut self, cycles: u64) {
        let until = self.machine.cycle(0) + cycles;
        assert_eq!(self.machine.run(until), Stop::Limit);
    }

    /// To where a tick begins; so many have had keys.
    fn begun(&mut self) -> i32 {
        while self.word("core0", core_block::TICK) == 0 {
            self.pass(500);
        }
        for in_tick in [true, false] {
            while (self.machine.cpu(0).exception() != 0) == in_tick {
                self.pass(20);
            }
        }
        self.word("core0_state", 12)
    }

    fn address(&self, symbol: &str) -> u32 {
        let mut symbols = self.built.image.symbols.iter();
        let found = symbols.find(|own| own.name == symbol);
        found.unwrap_or_else(|| panic!("{symbol} is there")).address
    }

    fn word(&self, symbol: &str, at: u32) -> i32 {
        let mut bytes = [0; 4];
        let address = self.address(symbol) + at;
        let memory = &self.machine.bus.memory;
        memory.read(address, &mut bytes).expect("memory");
        i32::from_le_bytes(bytes)
    }

    fn sensed(&self) -> Vec<u16> {
        let word =
            |key: usize| self.word("words0", (2 * key as u32) & !3) as u32 >> (16 * (key % 2));
        (0..self.built.keys).map(|key| word(key) as u16).collect()
    }

    fn frames(&mut self) -> Vec<HeardFrame> {
        take_frames(&mut self.machine, self.dac)
    }

    /// A hand or fingers, as they are at a tick.
    fn move_at(&mut self, tick: usize) {
        if self.built.board.knob.is_some() {
            let turns = (TAU * tick as f64 / 22_000.0).sin();
            let knob = self.machine.bus.device_mut::<Knob>(self.moved);
            knob.expect("a knob").hand = Hand {
                torque_n_m: 0.0,
                stiffness: 0.5,
                damping: 2e-3,
                place_rad: 1.0 + 1.1 * turns,
            };
            return;
        }
        let bench = self.machine.bus.device_mut::<KeyBench>(self.moved);
        let bench = bench.expect("a bench");
        for key in 0..self.built.keys {
            let is_down = (tick + 700 * key) % 3000 > 1500;
            bench.key_mut(key).expect("a key").finger = Finger {
                force_n: if is_down { 1.0 } else { 0.0 },
                ..Finger::default()
            };
        }
    }

    /// Plays so many ticks, and gives what each should let hear, by the interpreter, with the cycle
    /// in which the next tick begins.
    fn play(&mut self, interp: &mut Interp, ticks: usize) -> Vec<(u64, [i32; 2])> {
        let mut drives = vec![0; self.built.keys];
        let tick = |tick: usize| {
            self.move_at(tick);
            self.pass(PERIOD);
            interp.tick(&self.sensed(), &mut drives);
            let both = both_sides(interp, &self.built.kernel, self.built.keys);
            (self.machine.cycle(0), both)
        };
        (0..ticks).map(tick).collect()
    }
}

/// Plays a program; what is heard is the interpreter's, and how late it is.
fn is_heard(text: &str, board: &str, device: &str, keys: u32, ticks: usize) {
    let built = built(text, board, device, keys, OwnTexts::default());
    let mut heard = Heard::new(&built);
    let so_far = heard.begun();
    assert!((0..4).contains(&so_far), "{so_far}");
    let mut interp = Interp::new(&built.kernel, keys as usize).expect("it verifies");
    let rest = heard.sensed();
    interp.init(&rest);
    let mut drives = vec![0; keys as usize];
    (0..so_far).for_each(|_| interp.tick(&rest, &mut drives));
    // The machine starts when ticks are on time for certain.
    heard.play(&mut interp, 80);
    let begun = heard.frames().len();
    assert!((8..20).contains(&begun), "{begun}");
    let wanted = heard.play(&mut interp, ticks);
    heard.pass(4 * PERIOD);
    let frames = heard.frames();
    assert!(frames.len() > ticks + 3, "{}", frames.len());
    let same = |from: usize| {
        let pairs = wanted.iter().zip(&frames[from..]);
        pairs
            .filter(|((_, a), b)| a.map(|side| side << 1) != b.words)
            .count()
    };
    let from = (0..4).find(|from| same(*from) == 0);
    let from = from.unwrap_or_else(|| panic!("{:?}", [0, 1, 2, 3].map(same)));
    let loud = wanted
        .iter()
        .filter(|(_, both)| both[0].abs() > 1 << 20)
        .count();
    let late: Vec<u64> = wanted
        .iter()
        .zip(&frames[from..])
        .map(|((cycle, _), frame)| frame.cycle - cycle)
        .collect();
    println!(
        "{loud} of {ticks} samples are loud; the last bit {} to {} cycles behind the next tick's beginning",
        late.iter().min().expect("some"),
        late.iter().max().expect("some")
    );
    assert!(loud > ticks / 8, "{loud}");
    // A model may notice a change a cycle later; on the pins it is exact (judged/sender.rs).
    let since = |frame: &HeardFrame| frame.cycle - frames[0].cycle;
    let apart = (0..)
        .zip(&frames)
        .map(|(n, frame)| since(frame).abs_diff(n * PERIOD));
    assert!(apart.max() <= Some(1));
    // The tick after it, at its beginning; up to left, and a frame.
    let taken = u64::from(SoundPort::taken_cycles(PERIOD as u32));
    assert!(
        late.iter()
            .all(|late| (PERIOD..PERIOD + taken + 300).contains(late)),
        "{late:?}"
    );
    assert_eq!(heard.word("core0", core_block::MISSED), 0);
    assert_eq!(heard.word("core0", core_block::FAULTS) & !8, 0);
}

#[test]
fn a_string_under_a_knob_is_heard_sample_for_sample() {
    is_heard(BOWED, "pico2_strings", "gimbal", 1, 9000);
}

#[test]
fn keys_of_a_bench_are_heard_sample_for_sample() {
    is_heard(HELD, "rp2350b_bench", "voice_coil", 3, 6000);
}

#[test]
fn samples_are_given_in_time() {
    for (text, board, device, keys) in [
        (BOWED, "pico2_strings", "gimbal", 1),
        (SIDES, "rp2350b_bench", "voice_coil", 2),
    ] {
        let built = built(text, board, device, keys, OwnTexts::default());
        assert_given_in_time(board, &built.bounded.expect("it is proven"));
    }
}

/// Samples that come so late that left has been taken: a few are lost, and no side changes place.
#[test]
fn late_samples_leave_left_where_it_is() {
    let text = include_str!("../../compiler/firmware/src/i2s.s");
    let waits = "board_sound:\n ldr r2, =late\n ldr r3, [r2]\n cbz r3, 8f\n7: subs r3, #1\n bne 7b\n str r3, [r2]\n8:\n";
    let changed = text.replacen("board_sound:\n", waits, 1)
        + "\n .section .bss.near.core0.late, \"aw\", %nobits\n .balign 4\n .global late\nlate: .space 4\n";
    assert!(changed.contains("7b"));
    let own = key_bench::own_text("i2s.s", changed);
    let built = built(SIDES, "rp2350b_bench", "voice_coil", 1, own);
    let mut heard = Heard::new(&built);
    let so_far = heard.begun();
    let mut interp = Interp::new(&built.kernel, 1).expect("it verifies");
    let rest = heard.sensed();
    interp.init(&rest);
    (0..so_far).for_each(|_| interp.tick(&rest, &mut [0]));
    heard.play(&mut interp, 2600);
    for rounds in [300, 500, 600, 700, 800, 900_u32] {
        let late = heard.address("late");
        let memory = &mut heard.machine.bus.memory;
        memory.write(late, &rounds.to_le_bytes()).expect("memory");
        heard.play(&mut interp, 6);
        heard.frames();
        let wanted = heard.play(&mut interp, 300);
        assert_eq!(heard.word("late", 0), 0);
        let frames = heard.frames();
        let differs = wanted.iter().filter(|(_, both)| both[0] != both[1]).count();
        assert!(differs > 200, "{differs}");
        assert!(frames.len() > 294, "{}", frames.len());
        // Wherever the sequence stands now, it is the interpreter's again.
        let is_same = |from: usize| {
            let mut pairs = wanted.iter().zip(&frames[from..]).take(290);
            pairs.all(|((_, a), b)| a.map(|side| side << 1) == b.words)
        };
        assert!((0..4).any(is_same), "after {rounds} rounds");
    }
}
