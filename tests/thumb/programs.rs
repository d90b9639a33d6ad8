//! Random programs on every engine that makes machine code, against the interpreter: `jit` with
//! one key and with several, generated code on emulated cores, in modes and as one piece; and no
//! tick above its bound.
//!
//! ```text
//! cargo test --test thumb programs                       a few
//! WHIPPEN_PROGRAMS=20000 WHIPPEN_TICKS=10000 WHIPPEN_RESUME=search.txt cargo test --release --test thumb programs -- --nocapture
//! ```
//!
//! The second counts a thousand million ticks of a key; broken off, it goes on where it was.

use crate::common;
use crate::progress::Progress;
use crate::target::{CORES, Target};
use crate::text::program;
use whippen_compiler::jit::{JitCode, Options};
use whippen_compiler::kernel::random::{Draw, Rng};
use whippen_compiler::kernel::{Interp, Kernel, without_probes};
use whippen_compiler::modes::{Modes, specialize};
use whippen_compiler::parallel;
use whippen_emulator::CoreKind;

/// Four in lanes and one alone.
const KEYS: usize = 5;
/// How many programs, and ticks of each, where nobody asks for more.
const PROGRAMS: u64 = 24;
const TICKS: usize = 400;
/// Ticks of one kind of words, and between live values that are set.
const KIND_TICKS: usize = 100;
const LIVE_TICKS: usize = 130;
/// Ticks from one look at all of the memory to the next.
const MEMORY_TICKS: usize = 50;
/// Instructions that modes may have.
const INSTRUCTIONS: usize = 4000;
/// Every so many programs are run on the other cores, too, or as one piece.
const ON_OTHERS: u64 = 8;
const WHOLE: u64 = 5;

/// What keys are given: strokes, each behind the one before it, noise, jumps between the ends.
struct Words {
    strokes: Vec<u16>,
    random: Rng,
}

impl Words {
    fn new(seed: u64) -> Words {
        Words {
            strokes: common::words(&common::gesture()),
            random: Rng::new(seed ^ 0x5eed),
        }
    }

    fn of_tick(&mut self, tick: usize) -> Vec<u16> {
        let (strokes, random) = (&self.strokes, &mut self.random);
        let word = |key: usize| match tick / KIND_TICKS % 4 {
            0 | 2 => strokes[(7 * tick + 9973 * key + 80_000) % strokes.len()],
            1 => random.next() as u16,
            _ => [0, u16::MAX][(tick / 9 + key) % 2],
        };
        (0..KEYS).map(word).collect()
    }
}

/// A core and the code on it.
struct OnCore {
    target: Target,
    core: CoreKind,
    cycles_max: u64,
}

impl OnCore {
    fn new(modes: &Modes, core: CoreKind) -> OnCore {
        let target = Target::new(modes, KEYS as u32, core);
        let cycles_max = target.cycles_max();
        OnCore {
            target,
            core,
            cycles_max,
        }
    }
}

/// All engines with one program.
struct Engines {
    kernel: Kernel,
    interp: Interp,
    lanes: JitCode,
    /// The first key.
    alone: JitCode,
    cores: Vec<OnCore>,
    drive: Vec<i16>,
}

impl Engines {
    fn new(kernel: Kernel, seed: u64) -> Engines {
        let options = Options { probes: false };
        let jit = |keys| JitCode::build(&kernel, keys, options).expect("compiles");
        let modes = specialize(&kernel, INSTRUCTIONS);
        let on = if seed.is_multiple_of(ON_OTHERS) {
            &CORES[..]
        } else {
            &CORES[..1]
        };
        let mut cores: Vec<OnCore> = on.iter().map(|core| OnCore::new(&modes, *core)).collect();
        if seed.is_multiple_of(WHOLE) {
            cores.push(OnCore::new(&Modes::single(&kernel), CORES[0]));
        }
        Engines {
            interp: Interp::new(&kernel, KEYS).expect("verifies"),
            lanes: jit(KEYS),
            alone: jit(1),
            cores,
            drive: vec![0; KEYS * kernel.outputs.len()],
            kernel,
        }
    }

    fn init(&mut self, words: &[u16]) {
        self.interp.init(words);
        self.lanes.init(words);
        self.alone.init(&words[..1]);
        for on in &mut self.cores {
            on.target.init(words);
        }
    }

    fn set_live(&mut self, live: usize, value: i32) {
        self.interp.set_live(live, value).expect("in range");
        self.lanes.set_live(live, value).expect("in range");
        self.alone.set_live(live, value).expect("in range");
        for on in &mut self.cores {
            on.target.set_live(live, value);
        }
    }

    /// Drive words, events and cycles of a tick.
    fn tick(&mut self, words: &[u16], told: &str) {
        let mut found = self.drive.clone();
        self.interp.tick(words, &mut self.drive);
        let events = self.interp.drain_events();
        self.lanes.tick(words, &mut found);
        assert_eq!(found, self.drive, "jit, {told}");
        assert_eq!(self.lanes.drain_events(), events, "jit, {told}");
        let of_first = self.kernel.outputs.len();
        self.alone.tick(&words[..1], &mut found[..of_first]);
        assert_eq!(
            found[..of_first],
            self.drive[..of_first],
            "jit, one key, {told}"
        );
        let first: Vec<_> = events.iter().filter(|event| event.key == 0).collect();
        let alone = self.alone.drain_events();
        assert_eq!(
            alone.iter().collect::<Vec<_>>(),
            first,
            "jit, one key, {told}"
        );
        for OnCore {
            target,
            core,
            cycles_max,
        } in &mut self.cores
        {
            let name = core.name();
            assert_eq!(target.tick(words), self.drive, "{name}, {told}");
            assert_eq!(target.drain_events(), (events.clone(), 0), "{name}, {told}");
            let cycles = target.cycles;
            assert!(
                cycles <= *cycles_max,
                "{cycles} of {cycles_max} cycles, {name}, {told}"
            );
        }
    }

    /// Everything that `jit` and the first key alone remember.
    fn compare_memory(&self, told: &str) {
        let memory = self.interp.memory();
        assert_eq!(self.lanes.memory(), memory, "jit, {told}");
        for (cell, about) in self.kernel.cells.iter().enumerate() {
            for word in 0..about.len as usize {
                let [found, wanted] = [
                    self.alone.cell(0, cell, word),
                    self.interp.cell(0, cell, word),
                ];
                assert_eq!(found, wanted, "jit, one key, `{}`, {told}", about.name);
            }
        }
    }
}

/// Runs a program, and gives how many ticks of a key that were.
fn run(seed: u64, ticks: usize) -> u64 {
    let compiled = common::compiled(&format!("random {seed}"), &program(seed), &[]).remove(0);
    let mut engines = Engines::new(without_probes(&compiled.lowered.kernel), seed);
    let mut words = Words::new(seed);
    let mut random = Rng::new(seed);
    for tick in 0..ticks {
        let told = format!("program {seed}, tick {tick}");
        let of_tick = words.of_tick(tick);
        if tick == 0 {
            engines.init(&of_tick);
        }
        if tick % LIVE_TICKS == LIVE_TICKS - 1 {
            let live = random.below(engines.kernel.lives.len() as u64) as usize;
            let value = random.interesting(engines.kernel.lives[live].range);
            engines.set_live(live, value as i32);
        }
        engines.tick(&of_tick, &told);
        if tick % MEMORY_TICKS == MEMORY_TICKS - 1 {
            engines.compare_memory(&told);
        }
    }
    (ticks * KEYS) as u64
}

#[test]
fn programs() {
    let ticks = whippen_need::count("WHIPPEN_TICKS", TICKS);
    let all = whippen_need::count("WHIPPEN_PROGRAMS", PROGRAMS);
    let mut progress = Progress::resume();
    while progress.programs < all {
        let batch: Vec<u64> = (progress.programs..all).take(8).collect();
        let programs = batch.len() as u64;
        let done = parallel::map(batch, |seed| run(seed, ticks));
        progress.add(programs, done.iter().sum());
        println!("{} programs, {} ticks", progress.programs, progress.ticks);
    }
    assert!(progress.ticks > 0);
}
