//! What a lowered instrument gives to the outside, and what its integers mean there.

use super::delay::Fed;
use super::format::{self, exp2};
use super::origin;
use super::real::{Real, Scale, power_of_two};
use super::strand::LoweredStrand;
use super::update::Update;
use super::{Lowerer, OpError};
use whippen_kernel::{Kernel, Op, Range, Value};
use whippen_lang::model::{CellId, Interval, MachineId, Node, NodeId};
use whippen_lang::units::Dim;
use whippen_source::Origin;

/// An instrument in integers.
#[derive(Debug, Clone)]
pub struct Lowered {
    /// One tick.
    pub kernel: Kernel,
    /// What each probe means, in the order of the kernel's probes; empty where it was lowered
    /// without observation.
    pub exports: Vec<Export>,
    /// What each kernel event means.
    pub events: Vec<LoweredEvent>,
    /// What each live value means.
    pub lives: Vec<LoweredLive>,
    /// What the kernel's integers of the Model's cells and values per key mean, by their names.
    pub memory: Vec<LoweredCell>,
    /// Memory and ports whose clamp could not be proved away.
    pub clamps: Vec<String>,
    /// Every write to memory, with what it rounds.
    pub updates: Vec<Update>,
    /// What is fed to the Model's delay lines, and what it rounds.
    pub fed: Vec<Fed>,
    /// The Model's strings, what is proven of them, and what they round.
    pub strands: Vec<LoweredStrand>,
    /// What instructions were made for: [`whippen_kernel::Inst::origin`] is an index.
    pub origins: Vec<Origin>,
}

/// What kind of value a probe shows.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ExportKind {
    /// A sensed value (index into the Model's senses).
    Sense(u32),
    /// Its first derivative, where the program uses the differentiators of that sense.
    Slope(u32),
    /// Its second derivative, where the program uses it.
    Curvature(u32),
    /// The sum of the force terms on a driven port (N or N*m; index into the Model's
    /// [drives](whippen_lang::model::Model::drives)), before the drive word clips it.
    Total(u32),
    /// A force term (index into the Model's forces).
    Force(u32),
    /// A cell at the tick's start.
    Cell(CellId),
    /// A machine's state at the tick's start, as an index.
    Machine(MachineId),
    /// A `let` or a result of a term (index into the Model's named values).
    Named(u32),
    /// A term of the sound (index into the Model's).
    Sound(u32),
    /// What is heard (index into the Model's channels).
    Channel(u32),
}

impl ExportKind {
    /// What stands before the name in the Kernel: forces and machines have name spaces of their
    /// own.
    fn prefix(self) -> &'static str {
        match self {
            ExportKind::Sense(_) | ExportKind::Slope(_) | ExportKind::Curvature(_) => "sense",
            ExportKind::Total(_) => "total",
            ExportKind::Force(_) => "force",
            ExportKind::Cell(_) => "cell",
            ExportKind::Machine(_) => "states",
            ExportKind::Named(_) => "let",
            ExportKind::Sound(_) => "sound",
            ExportKind::Channel(_) => "channel",
        }
    }
}

/// The meaning of a probe: `real = lsb * integer + offset`.
#[derive(Debug, Clone, PartialEq)]
pub struct Export {
    /// Name, as in the source.
    pub name: String,
    /// What it shows.
    pub kind: ExportKind,
    /// Its dimension; `None` for bools and states.
    pub dim: Option<Dim>,
    /// Value of one unit (SI).
    pub lsb: f64,
    /// Value at integer 0 (SI).
    pub offset: f64,
    /// Fraction bits, where the format is a plain one; the format's name is `I{32-n}F{n}`.
    pub fraction_bits: Option<i32>,
    /// Proven range (SI).
    pub range: Interval,
    /// Bound on the error of one tick (SI), from the state the integers hold at its start and the
    /// same words; infinite behind a friction.
    pub error: f64,
}

impl Export {
    /// The value an integer stands for (SI).
    pub fn value(&self, integer: i64) -> f64 {
        self.lsb * integer as f64 + self.offset
    }

    /// Name of its format; `~` where one unit is not a power of two, but between that of the name
    /// and twice that.
    pub fn format(&self) -> String {
        match (self.dim, self.fraction_bits) {
            (None, _) => "state".to_string(),
            (_, Some(bits)) => format::name(bits),
            (_, None) if matches!(self.kind, ExportKind::Sense(_)) => "word".to_string(),
            (_, None) => format!("~{}", format::name(-format::exponent(self.lsb))),
        }
    }
}

/// What kind of event a kernel event is.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum LoweredEventKind {
    /// An emission (index into the Model's emissions).
    Emission(u32),
    /// A rule of this name acted.
    Rule(String),
}

/// The meaning of a kernel event.
#[derive(Debug, Clone, PartialEq)]
pub struct LoweredEvent {
    /// What it is.
    pub kind: LoweredEventKind,
    /// Value of one unit of each argument (SI).
    pub arg_lsbs: Vec<f64>,
}

/// The meaning of a kernel's live value.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LoweredLive {
    /// Value of one unit (SI).
    pub lsb: f64,
    /// Integers it takes.
    pub range: Range,
}

/// The meaning of an integer that a key remembers or is given.
#[derive(Debug, Clone, PartialEq)]
pub struct LoweredCell {
    /// Its name, in the Model as in the Kernel.
    pub name: String,
    /// Value of one unit (SI).
    pub lsb: f64,
    /// Value of 0 (SI).
    pub zero: f64,
    /// Its dimension.
    pub dim: Dim,
}

impl LoweredLive {
    /// The integer for a value (SI), clamped to the range.
    pub fn quantize(&self, value: f64) -> i32 {
        format::quantize(value, self.lsb).clamp(self.range.low, self.range.high) as i32
    }
}

impl Lowerer<'_> {
    pub(super) fn live_meanings(&self) -> Vec<LoweredLive> {
        let range = |index: u32| self.b.kernel().lives[index as usize].range;
        self.lives
            .iter()
            .map(|&(index, lsb)| LoweredLive {
                lsb,
                range: range(index),
            })
            .collect()
    }

    pub(super) fn memory_meanings(&self) -> Vec<LoweredCell> {
        let model = &self.step.model;
        let cells = model.cells.enumerated().map(|(id, cell)| {
            let Scale { lsb, offset } = self.units.scale_of_cell(id);
            LoweredCell {
                name: cell.name.clone(),
                lsb,
                zero: offset,
                dim: cell.dim,
            }
        });
        let keyed = model.keyed.iter().zip(&self.keyed);
        let keyed = keyed.map(|(keyed, (_, lsb))| LoweredCell {
            name: keyed.name.clone(),
            lsb: *lsb,
            zero: 0.0,
            dim: keyed.dim,
        });
        cells.chain(keyed).collect()
    }

    /// The sum of the forces on a driven port as a drive word, clipped to what the device takes.
    pub(super) fn drive_word(&mut self, number: usize) -> Result<Value, OpError> {
        let (model, drive) = (&self.step.model, self.step.drives[number]);
        let port = model.drives()[number];
        let lsb = self.scales[port].drive_lsb;
        let node = model.dag.get(drive).clone();
        let (c0, terms) = match node {
            Node::Linear(c0, terms) => (c0.0, terms),
            _ => (0.0, vec![(whippen_lang::model::dag::Real(1.0), drive)]),
        };
        let mut reals = Vec::new();
        let mut forces = Vec::new();
        for (c, x) in terms {
            reals.push(self.term(c.0, x)?);
            forces.push(origin::force_of(&self.step.model, port, x));
        }
        let reach = self.ranges.get(drive).magnitude() / lsb;
        if reach > format::DRIVE_WORD.high as f64 {
            let clamp = self.step.model.name_of_driven("drive word", port);
            self.clamps.push(clamp);
        }
        self.sum_within(c0, &reals, &forces, lsb, format::DRIVE_WORD)
    }

    /// A probe for everything with a name.
    pub(super) fn probes(&mut self) -> Result<Vec<Export>, OpError> {
        let mut exports = Vec::new();
        let model = &self.step.model;
        self.sense_probes(&mut exports)?;
        self.total_probes(&mut exports)?;
        for (index, force) in model.forces.iter().enumerate() {
            let kind = ExportKind::Force(index as u32);
            let (real, range) = (self.exported(force.value)?, self.ranges.get(force.value));
            exports.push(self.probe(&force.name, kind, Some(force.dim), real, range)?);
        }
        for (index, value) in model.named.iter().enumerate() {
            let kind = ExportKind::Named(index as u32);
            exports.push(if model.dag.get(value.value).is_bool() {
                let bit = self.bool(value.value)?;
                self.state_probe(&value.name, kind, bit, 1)?
            } else {
                let real = self.exported(value.value)?;
                self.probe(
                    &value.name,
                    kind,
                    value.dim,
                    real,
                    self.ranges.get(value.value),
                )?
            });
        }
        self.sound_probes(&mut exports)?;
        self.memory_probes(&mut exports)?;
        Ok(exports)
    }

    /// A value with the bound of its error, which there is none of behind a friction.
    fn exported(&mut self, node: NodeId) -> Result<Real, OpError> {
        let real = self.real(node)?;
        let error = match self.step.behind_friction[node] {
            true => f64::INFINITY,
            false => real.error,
        };
        Ok(Real { error, ..real })
    }

    /// The sum of the forces on each driven port.
    fn total_probes(&mut self, exports: &mut Vec<Export>) -> Result<(), OpError> {
        let model = &self.step.model;
        for (number, port) in model.drives().into_iter().enumerate() {
            let drive = self.step.drives[number];
            let (real, range) = (self.exported(drive)?, self.ranges.get(drive));
            let acts = model.forces.iter().find(|force| force.port == port);
            let dim = acts.map(|force| force.dim);
            let what = if dim == Some(Dim::TORQUE) {
                "torque"
            } else {
                "force"
            };
            let name = model.name_of_driven(what, port);
            exports.push(self.probe(&name, ExportKind::Total(number as u32), dim, real, range)?);
        }
        Ok(())
    }

    /// What is sensed, and its derivatives where they are computed.
    fn sense_probes(&mut self, exports: &mut Vec<Export>) -> Result<(), OpError> {
        let model = &self.step.model;
        for (index, sense) in model.senses.iter().enumerate() {
            let index = index as u32;
            let range = |node: Node| {
                let found = model.dag.nodes().find(|(_, n)| **n == node);
                found.map(|(id, _)| self.ranges.get(id))
            };
            let (slope, curvature) = (range(Node::Slope(index)), range(Node::Curvature(index)));
            let speed = sense.dim.div(Dim::TIME);
            let all = [
                (
                    "",
                    ExportKind::Sense(index),
                    sense.dim,
                    self.sensed(index),
                    Some(sense.range),
                ),
                (
                    "'",
                    ExportKind::Slope(index),
                    speed,
                    self.slope(index),
                    slope,
                ),
                (
                    "''",
                    ExportKind::Curvature(index),
                    speed.div(Dim::TIME),
                    self.curvature(index),
                    curvature,
                ),
            ];
            for (primes, kind, dim, real, range) in all {
                if let (Some(real), Some(range)) = (real, range) {
                    let name = format!("{}{primes}", sense.name);
                    exports.push(self.probe(&name, kind, Some(dim), real, range)?);
                }
            }
        }
        Ok(())
    }

    /// The terms of the sound, and what is heard of them.
    fn sound_probes(&mut self, exports: &mut Vec<Export>) -> Result<(), OpError> {
        let model = &self.step.model;
        for (index, sound) in model.sounds.iter().enumerate() {
            let (name, kind) = (
                format!("sound {}", sound.name),
                ExportKind::Sound(index as u32),
            );
            let (real, range) = (self.real(sound.value)?, self.ranges.get(sound.value));
            exports.push(self.probe(&name, kind, Some(Dim::NUMBER), real, range)?);
        }
        let names = super::sound::channel_names(model.channels.len());
        for (index, (name, node)) in names.iter().zip(&model.channels).enumerate() {
            // The very word that a firmware plays.
            if let Some(sample) = self.channels[index].sample {
                let kind = ExportKind::Channel(index as u32);
                let range = self.ranges.get(*node);
                exports.push(self.probe(name, kind, Some(Dim::NUMBER), sample, range)?);
            }
        }
        Ok(())
    }

    fn memory_probes(&mut self, exports: &mut Vec<Export>) -> Result<(), OpError> {
        let model = &self.step.model;
        for (id, cell) in model.cells.enumerated() {
            let real = self.cell(id)?;
            exports.push(self.probe(
                &cell.name,
                ExportKind::Cell(id),
                Some(cell.dim),
                real,
                cell.range,
            )?);
        }
        for (id, machine) in model.machines.enumerated() {
            if let Some(state) = self.machine(id)? {
                let last = machine.states.len() - 1;
                exports.push(self.state_probe(
                    &machine.name,
                    ExportKind::Machine(id),
                    state,
                    last,
                )?);
            }
        }
        Ok(())
    }

    fn probe(
        &mut self,
        name: &str,
        kind: ExportKind,
        dim: Option<Dim>,
        real: Real,
        range: Interval,
    ) -> Result<Export, OpError> {
        let probe = self
            .b
            .probe(&format!("{} {name}", kind.prefix()), self.b.ty(real.value));
        self.b.effect(Op::Probe(probe), &[real.value])?;
        let Real {
            lsb, offset, error, ..
        } = real;
        let fraction_bits = if offset == 0.0 {
            power_of_two(lsb).map(|n| -n)
        } else {
            None
        };
        Ok(Export {
            name: name.to_string(),
            kind,
            dim,
            lsb,
            offset,
            fraction_bits,
            range,
            error,
        })
    }

    fn state_probe(
        &mut self,
        name: &str,
        kind: ExportKind,
        state: Value,
        last: usize,
    ) -> Result<Export, OpError> {
        let probe = self
            .b
            .probe(&format!("{} {name}", kind.prefix()), self.b.ty(state));
        self.b.effect(Op::Probe(probe), &[state])?;
        let range = Interval {
            low: 0.0,
            high: last as f64,
        };
        let (name, fraction_bits) = (name.to_string(), Some(0));
        Ok(Export {
            name,
            kind,
            dim: None,
            lsb: exp2(0),
            offset: 0.0,
            fraction_bits,
            range,
            error: 0.0,
        })
    }
}
