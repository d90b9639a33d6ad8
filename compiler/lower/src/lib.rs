//! Lowering: equations over the reals become integers.
//!
//! The units of all values are chosen together, so that few sums need more than additions. Sums of
//! scaled values gather in one 32-bit word, products by their top words; clamps stand only where
//! the ranges do not prove them away. Each value carries a bound on the error that one tick adds to
//! it.
//!
//! ```text
//!   Step + Ranges + Scales -> [ units | sense | values | rules | commit ] -> Kernel + what its values mean
//! ```
//!
//! Not here: algebra (`simplify`), the meaning of operators (`kernel::op`), layout in memory.

pub mod ideal;
pub mod lost;
pub mod scales;
pub mod simplify;
pub mod slow_port;

mod chain;
mod clamp;
mod commit;
mod convert;
mod curve;
mod delay;
mod export;
mod format;
mod friction;
mod function;
mod gradient;
mod increase;
mod linear;
mod noise;
mod origin;
mod paths;
mod real;
mod recurrence;
mod rules;
mod sense;
mod sound;
mod strand;
mod table;
mod units;
mod update;
mod values;

pub use delay::Fed;
pub use export::{Export, ExportKind, Lowered, LoweredEvent, LoweredEventKind, LoweredLive};
pub use paths::Path;
pub use recurrence::OverTime;
pub use strand::LoweredStrand;
pub use update::{Update, Writer};

use std::collections::HashMap;

use crate::scales::{PortScales, Scales};
use crate::simplify::Step;
use real::Real;
use whippen_ids::IdMap;
use whippen_kernel::{self as kernel, Builder, OpError, Type, Value};
use whippen_lang::model::{NodeId, NoiseId};
use whippen_lang::range::Ranges;

/// Lowers one instrument.
///
/// `observe` adds what traces need and a keyboard does not: a probe per named value, an event per
/// rule.
///
/// # Errors
/// An operator refused its operands: a defect of this module (ranges are given), reported with the
/// operator.
pub fn lower(
    step: &Step,
    ranges: &Ranges,
    scales: &PortScales,
    observe: bool,
) -> Result<Lowered, OpError> {
    let scales = scales.of(&step.model);
    Lowerer::new(step, ranges, &scales, observe).run()
}

/// What is known while lowering.
struct Lowerer<'a> {
    step: &'a Step,
    ranges: &'a Ranges,
    /// By sense.
    scales: &'a [Scales],
    observe: bool,
    b: Builder,
    units: units::Units,
    /// By node: whether the constant of a sum is left to its users.
    left: IdMap<NodeId, bool>,
    /// By node: whether it is a sum that adds up in a `state`.
    adds_up: IdMap<NodeId, bool>,
    /// Reals computed so far; entries made inside a branch are dropped at its end.
    reals: HashMap<NodeId, Real>,
    bools: HashMap<NodeId, Value>,
    /// Values times a power of two.
    moved: HashMap<(Value, i32), Value>,
    /// Cells read so far, kept and dropped alike: memory is written when everything has been read.
    loads: HashMap<u32, Value>,
    inputs: sense::Inputs,
    cells: commit::Cells,
    lines: delay::Lines,
    /// Cells of noises.
    noises: IdMap<NoiseId, u32>,
    /// Cells and words of strings.
    strands: strand::Strands,
    /// What is heard.
    channels: Vec<sound::Channel>,
    /// Curves so far, with their slopes.
    curves: curve::Curves,
    /// Tables of functions, by their columns and what is in them.
    tables: HashMap<(u32, Vec<i32>), u32>,
    lives: Vec<(u32, f64)>,
    keyed: Vec<(u32, f64)>,
    clamps: Vec<String>,
    updates: Vec<Update>,
    origins: origin::Origins,
}

impl<'a> Lowerer<'a> {
    fn new(step: &'a Step, ranges: &'a Ranges, scales: &'a [Scales], observe: bool) -> Lowerer<'a> {
        Lowerer {
            step,
            ranges,
            scales,
            observe,
            b: Builder::new(&step.model.name, step.model.rate_hz),
            units: units::choose(step, ranges, scales),
            left: units::left(step),
            adds_up: update::adds_up(step),
            reals: HashMap::new(),
            bools: HashMap::new(),
            moved: HashMap::new(),
            loads: HashMap::new(),
            inputs: sense::Inputs::default(),
            cells: commit::Cells::default(),
            lines: delay::Lines::default(),
            noises: IdMap::new(),
            strands: strand::Strands::default(),
            channels: Vec::new(),
            curves: curve::Curves::default(),
            tables: HashMap::new(),
            lives: Vec::new(),
            keyed: Vec::new(),
            clamps: Vec::new(),
            updates: Vec::new(),
            origins: origin::Origins::default(),
        }
    }

    fn run(mut self) -> Result<Lowered, OpError> {
        self.declare();
        self.declare_noises();
        self.declare_delays();
        self.declare_strings();
        self.declare_channels();
        let events = self.declare_events();
        let model = &self.step.model;
        let mut drives = Vec::new();
        for port in model.drives() {
            let name = model.name_of_driven("drive", port);
            drives.push(self.b.output(&name, format::DRIVE_WORD));
        }
        self.b.begin_init();
        self.seed_noises()?;
        self.declare_senses()?;

        self.b.begin_tick();
        let exports = self.from_all(|s| s.tick(&drives, &events))?;
        let (lives, memory) = (self.live_meanings(), self.memory_meanings());
        recurrence::judge(self.step, self.ranges, &mut self.updates);
        let (events, clamps, origins) = (events.meanings, self.clamps, self.origins.list);
        let (updates, fed) = (self.updates, self.lines.fed);
        let strands = self.strands.lowered;
        let mut kernel = self.b.finish();
        kernel::sweep(&mut kernel);
        Ok(Lowered {
            kernel,
            exports,
            events,
            lives,
            memory,
            clamps,
            updates,
            fed,
            strands,
            origins,
        })
    }

    fn tick(&mut self, drives: &[u32], events: &rules::Events) -> Result<Vec<Export>, OpError> {
        self.tick_senses()?;
        self.begin_strings()?;
        self.heard()?;
        for (number, &drive) in drives.iter().enumerate() {
            let word = self.drive_word(number)?;
            self.b.effect(kernel::Op::Out(drive), &[word])?;
        }
        let exports = if self.observe {
            self.probes()?
        } else {
            Vec::new()
        };
        let fed = self.fed()?;
        let strings = self.string_words()?;
        let mut writes = self.integrated()?;
        self.rules(events, &mut writes)?;
        self.commit(writes)?;
        self.keep_allpasses()?;
        self.stir_noises()?;
        self.feed(&fed)?;
        self.tick_strings(&strings)?;
        self.tick_histories()?;
        Ok(exports)
    }

    fn constant(&mut self, value: i64) -> Result<Value, OpError> {
        self.b.constant(Type::I32, value)
    }
}
