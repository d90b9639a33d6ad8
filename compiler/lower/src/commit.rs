//! Memory of a key: declared once, read at the tick's start, written and clamped at its end.

use std::collections::HashMap;

use super::Lowerer;
use super::convert::Kept;
use super::format::{self, exp2};
use super::real::{Real, Scale};
use super::update::Writer;
use whippen_ids::IdMap;
use whippen_kernel::{Op, OpError, Range, Type, Value};
use whippen_lang::model::{
    Action, Body, CellId, CellKind, Interval, MachineId, NodeId, PulseId, RuleKind,
};

/// Kernel cells of the Model's memory.
#[derive(Debug, Default)]
pub(super) struct Cells {
    /// Per cell of the Model.
    reals: IdMap<CellId, u32>,
    /// Per machine; none for a machine of one state.
    machines: IdMap<MachineId, Option<u32>>,
    /// Per pulse: the tick at whose end it ends, or, where it counts, how many ticks are left.
    pulse_left: IdMap<PulseId, u32>,
    /// Per rule: whether an event's guard held in the tick before.
    held: Vec<Option<u32>>,
}

/// New values of a tick, before clamps, as SSA values.
#[derive(Debug, Clone, Default)]
pub(super) struct Writes {
    pub cells: HashMap<u32, Value>,
    pub machines: HashMap<u32, Value>,
    pub pulse_left: HashMap<u32, Value>,
}

impl Lowerer<'_> {
    /// Declares live values, per-key values and memory.
    pub(super) fn declare(&mut self) {
        let model = &self.step.model;
        for live in &model.lives {
            let lsb = live
                .dim
                .map_or(1.0, |_| exp2(-format::fraction_bits(live.range)));
            let range = format::inside(live.range, lsb);
            let init = format::quantize(live.value, lsb).clamp(range.low, range.high) as i32;
            self.lives.push((self.b.live(&live.name, range, init), lsb));
        }
        for keyed in &model.keyed {
            let lsb = exp2(-format::fraction_bits(keyed.range));
            let values: Vec<i32> = keyed
                .values
                .iter()
                .map(|&v| format::quantize(v, lsb) as i32)
                .collect();
            let ends = values.iter().map(|&v| i64::from(v));
            let range = Range::new(ends.clone().min().unwrap_or(0), ends.max().unwrap_or(0));
            self.keyed
                .push((self.b.keyed(&keyed.name, range, values), lsb));
        }
        for (id, cell) in model.cells.enumerated() {
            let range = self.cell_range(id);
            let scale = self.units.scale_of_cell(id);
            let init = scale.quantize(cell.init).clamp(range.low, range.high);
            self.cells
                .reals
                .push(self.b.cell(&cell.name, Type::I32, range, init));
        }
        self.declare_discrete();
    }

    /// Names of cells end in hard keywords here, so that they meet no name of the program.
    fn declare_discrete(&mut self) {
        let model = &self.step.model;
        for machine in &model.machines {
            let last = machine.states.len() as i64 - 1;
            let ty = if last == 1 { Type::I1 } else { Type::I32 };
            let cell = (last > 0).then(|| {
                self.b.cell(
                    &format!("{}.state", machine.name),
                    ty,
                    Range::new(0, last),
                    0,
                )
            });
            self.cells.machines.push(cell);
        }
        for pulse in &model.pulses {
            let counts = self.counts(pulse.level);
            let range = if counts {
                Range::new(0, i64::from(pulse.ticks))
            } else {
                Type::I32.range()
            };
            self.cells.pulse_left.push(self.b.cell(
                &format!("{}.pulse", pulse.name),
                Type::I32,
                range,
                0,
            ));
        }
        for rule in &model.rules {
            let cell = match &rule.kind {
                RuleKind::Event { name } => {
                    Some(
                        self.b
                            .cell(&format!("{name}.event"), Type::I1, Range::new(0, 1), 1),
                    )
                }
                RuleKind::Transition { .. } => None,
            };
            self.cells.held.push(cell);
        }
    }

    /// A cell of the kernel at the tick's start, read once.
    pub(super) fn load(&mut self, cell: u32) -> Result<Value, OpError> {
        if let Some(&value) = self.loads.get(&cell) {
            return Ok(value);
        }
        let value = self.b.op(Op::Get(cell), &[])?;
        self.loads.insert(cell, value);
        Ok(value)
    }

    /// A cell at the tick's start.
    pub(super) fn cell(&mut self, cell: CellId) -> Result<Real, OpError> {
        let value = self.load(self.cells.reals[cell])?;
        let Scale { lsb, offset } = self.units.scale_of_cell(cell);
        Ok(Real {
            value,
            lsb,
            offset,
            error: 0.0,
        })
    }

    pub(super) fn cell_range(&self, cell: CellId) -> Range {
        let range = self.step.model.cells[cell].range;
        let Scale { lsb, offset } = self.units.scale_of_cell(cell);
        let counted = Interval {
            low: range.low - offset,
            high: range.high - offset,
        };
        match self.step.model.cells[cell].kind {
            // As constants of the program are rounded: what is one of the ends needs no clamp.
            CellKind::State => format::nearest(counted, lsb),
            CellKind::Rate | CellKind::Pulse => format::inside_powers(counted, lsb),
            _ => format::inside(counted, lsb),
        }
    }

    /// The state of a machine at the tick's start, as an index (none: it has one state).
    pub(super) fn machine(&mut self, machine: MachineId) -> Result<Option<Value>, OpError> {
        self.cells.machines[machine]
            .map(|cell| self.load(cell))
            .transpose()
    }

    pub(super) fn is(&mut self, machine: MachineId, state: u32) -> Result<Value, OpError> {
        let Some(now) = self.machine(machine)? else {
            return self.b.constant(Type::I1, i64::from(state == 0));
        };
        match (self.b.ty(now), state) {
            (Type::I1, 0) => self.b.op(Op::Not, &[now]),
            (Type::I1, _) => Ok(now),
            _ => {
                let state = self.constant(i64::from(state))?;
                self.b.op(Op::Eq, &[now, state])
            }
        }
    }

    /// Whether an event's guard held in the tick before; remembers this tick's.
    pub(super) fn edge(&mut self, rule: usize, guard: Value) -> Result<Value, OpError> {
        let Some(cell) = self.cells.held[rule] else {
            return Ok(guard);
        };
        let before = self.b.op(Op::Get(cell), &[])?;
        self.b.effect(Op::Set(cell), &[guard])?;
        let not = self.b.op(Op::Not, &[before])?;
        self.b.op(Op::And, &[guard, not])
    }

    /// What bodies, pulses and `next` make of the memory.
    pub(super) fn integrated(&mut self) -> Result<Writes, OpError> {
        let mut writes = Writes::default();
        let model = &self.step.model;
        for (index, body) in model.bodies.iter().enumerate() {
            let (rate, coordinate) = (self.step.rates[index], self.step.coordinates[index]);
            let (rate, coordinate) = self.from_item(&format!("body {}", body.name), |s| {
                Ok((
                    s.new_value(body.rate, rate, Writer::Motion)?,
                    s.new_value(body.coordinate, coordinate, Writer::Motion)?,
                ))
            })?;
            writes.cells.insert(body.rate.0, rate);
            writes.cells.insert(body.coordinate.0, coordinate);
        }
        for action in model.rules.iter().flat_map(|r| &r.actions) {
            // What only actions write keeps its value where none acts.
            if let &Action::Write { cell, .. } = action
                && !writes.cells.contains_key(&cell.0)
            {
                writes.cells.insert(cell.0, self.cell(cell)?.value);
            }
        }
        for &(cell, node) in &model.nexts {
            let item = format!("next {}", model.cells[cell].name);
            writes.cells.insert(
                cell.0,
                self.from_item(&item, |s| s.new_value(cell, node, Writer::Next))?,
            );
        }
        for (id, pulse) in model.pulses.enumerated() {
            let item = format!("pulse {}", pulse.name);
            let (counted, level) = self.from_item(&item, |s| s.run_down(id, pulse.level))?;
            writes.pulse_left.insert(id.0, counted);
            writes.cells.insert(pulse.level.0, level);
        }
        Ok(writes)
    }

    /// Whether a pulse counts its ticks. Others know when they end, which costs a comparison with
    /// the tick's number; but whether one runs whose level is 0 they do not know, and have no need
    /// to where no level lies below.
    pub(super) fn counts(&self, level: CellId) -> bool {
        self.cell_range(level).low < 0
    }

    /// Ticks left, or the end, and level of a pulse after a tick in which it is not fired.
    fn run_down(&mut self, pulse: PulseId, level: CellId) -> Result<(Value, Value), OpError> {
        let (left, one, zero) = (
            self.pulse_left(pulse)?,
            self.constant(1)?,
            self.constant(0)?,
        );
        if !self.counts(level) {
            let now = self.b.op(Op::Tick(0), &[])?;
            let ends = self.b.op(Op::Eq, &[left, now])?;
            let level = self.cell(level)?.value;
            return Ok((left, self.b.op(Op::Select, &[ends, zero, level])?));
        }
        let counted = self.b.op(Op::Sub, &[left, one])?;
        let counted = self.b.op(Op::Max, &[counted, zero])?;
        let ends = self.b.op(Op::Le, &[left, one])?;
        let level = self.cell(level)?.value;
        let level = self.b.op(Op::Select, &[ends, zero, level])?;
        Ok((counted, level))
    }

    pub(super) fn pulse_left(&mut self, pulse: PulseId) -> Result<Value, OpError> {
        self.load(self.cells.pulse_left[pulse])
    }

    /// What is to be stored in a cell: its clamp; for a coordinate one unit beyond, so that being
    /// stopped shows. A rate may be a few of its operand's units beyond, because it is clamped at
    /// the end in any case.
    pub(super) fn new_value(
        &mut self,
        cell: CellId,
        node: NodeId,
        writer: Writer,
    ) -> Result<Value, OpError> {
        let range = self.cell_range(cell);
        let beyond = match self.step.model.cells[cell].kind {
            CellKind::Coordinate => Range::new(range.low - 1, range.high + 1),
            _ => range,
        };
        let scale = self.units.scale_of_cell(cell);
        if let Some(constant) = self.step.model.dag.real(node) {
            let integer = scale.quantize(constant);
            let value = self.constant(integer.clamp(beyond.low, beyond.high))?;
            let error = (constant - scale.offset - integer as f64 * scale.lsb).abs();
            self.note_update(cell, writer, node, Kept::unlimited(value, error));
            return Ok(value);
        }
        let real = self.real(node)?;
        // In the cell's unit: clamped at the end, after the rules.
        let kept = match self.step.model.cells[cell].kind {
            _ if real.scale() == scale => Kept::unlimited(real.value, real.error),
            CellKind::Rate => self.nearly(real, scale, beyond)?,
            _ => self.saturated(real, scale, beyond)?,
        };
        self.note_update(cell, writer, node, kept);
        Ok(kept.value)
    }

    /// Clamps and stores everything.
    pub(super) fn commit(&mut self, mut writes: Writes) -> Result<(), OpError> {
        for body in &self.step.model.bodies {
            self.from_item(&format!("body {}", body.name), |s| {
                s.stop(body, &mut writes)
            })?;
        }
        let ordered = |map: HashMap<u32, Value>| {
            map.into_iter()
                .collect::<std::collections::BTreeMap<_, _>>()
        };
        for (cell, value) in ordered(writes.cells) {
            let range = self.cell_range(CellId(cell));
            if !range.contains(self.b.range(value)) {
                self.clamps
                    .push(self.step.model.cells[CellId(cell)].name.clone());
            }
            self.from_item(&self.item_of(CellId(cell)), |s| {
                let kept = s.clamped(value, range)?;
                s.b.effect(Op::Set(s.cells.reals[CellId(cell)]), &[kept])
            })?;
        }
        for (machine, value) in ordered(writes.machines) {
            let machine = MachineId(machine);
            if let Some(cell) = self.cells.machines[machine] {
                let item = format!("states {}", self.step.model.machines[machine].name);
                self.from_item(&item, |s| s.b.effect(Op::Set(cell), &[value]))?;
            }
        }
        for (pulse, value) in ordered(writes.pulse_left) {
            let pulse = PulseId(pulse);
            let item = format!("pulse {}", self.step.model.pulses[pulse].name);
            let cell = self.cells.pulse_left[pulse];
            self.from_item(&item, |s| s.b.effect(Op::Set(cell), &[value]))?;
        }
        Ok(())
    }

    /// The declaration that a cell belongs to.
    fn item_of(&self, cell: CellId) -> String {
        let model = &self.step.model;
        let own = &model.cells[cell];
        let body = model
            .bodies
            .iter()
            .find(|body| body.rate == cell || body.coordinate == cell);
        match (own.kind, body) {
            (_, Some(body)) => format!("body {}", body.name),
            (CellKind::Pulse, _) => format!("pulse {}", own.name),
            _ => format!("state {}", own.name),
        }
    }

    /// A coordinate beyond an end of its range loses a rate that points outwards (rule 3).
    fn stop(&mut self, body: &Body, writes: &mut Writes) -> Result<(), OpError> {
        let range = self.cell_range(body.coordinate);
        let (coordinate, mut rate) = (writes.cells[&body.coordinate.0], writes.cells[&body.rate.0]);
        let proven = self.b.range(coordinate);
        let zero = self.constant(self.units.scale_of_cell(body.rate).quantize(0.0))?;
        if proven.high > range.high {
            let end = self.constant(range.high)?;
            let beyond = self.b.op(Op::Lt, &[end, coordinate])?;
            let inward = self.b.op(Op::Min, &[rate, zero])?;
            rate = self.b.op(Op::Select, &[beyond, inward, rate])?;
        }
        if proven.low < range.low {
            let end = self.constant(range.low)?;
            let beyond = self.b.op(Op::Lt, &[coordinate, end])?;
            let inward = self.b.op(Op::Max, &[rate, zero])?;
            rate = self.b.op(Op::Select, &[beyond, inward, rate])?;
        }
        writes.cells.insert(body.rate.0, rate);
        Ok(())
    }
}
