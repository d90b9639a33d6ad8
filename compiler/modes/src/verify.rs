//! Verifier of modes by forward interval analysis: what passes cannot overflow, reads no undefined
//! value, and enters no mode with cells outside the ranges that the mode assumes.
//!
//! Ranges are proven again along the blocks, as in a Kernel, together with what branches say: a
//! block begins with what all edges that lead to it have in common. What a cell holds is followed
//! the same way, from the mode's ranges over what is stored to the ranges of the next mode. That a
//! cell which the next mode stands for would hold just that is not visible in code; the engine of
//! `run` tests it in every tick.

mod widen;

use super::facts::{self, Facts, meet};
use super::graph::{Graph, Kind, NodeId};
use super::{Block, BlockId, End, Mode, ModeId, Modes, Target};
use whippen_ids::IdMap;
use whippen_kernel::{Inst, Op, Range, Region, Type, Value, ValueInfo, VerifyError};

pub use widen::widen;

/// Checks all modes.
///
/// # Errors
/// All that is wrong. A failure is a bug of whoever made the modes.
pub fn verify(modes: &Modes) -> Result<(), Vec<VerifyError>> {
    let mut errors = Vec::new();
    for mode in modes.modes.iter() {
        Checker::of(modes, mode, &mut errors, false).mode();
    }
    if errors.is_empty() {
        Ok(())
    } else {
        Err(errors)
    }
}

/// What is known somewhere.
#[derive(Debug, Clone)]
struct State {
    /// Nodes of values that are defined on every path to here.
    visible: IdMap<NodeId, bool>,
    facts: Facts,
    /// What word 0 of each cell holds.
    held: Vec<Held>,
}

impl State {
    fn sees(&self, id: NodeId) -> bool {
        self.visible.get(id).copied().unwrap_or(false)
    }
}

/// What a cell holds in memory.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Held {
    /// Anything; the mode knows better.
    Stale,
    Within(Range),
    /// This value.
    Node(NodeId),
}

struct Checker<'a> {
    modes: &'a Modes,
    mode: &'a Mode,
    graph: Graph<'a>,
    nodes: IdMap<Value, Option<NodeId>>,
    /// What values are declared.
    values: IdMap<Value, ValueInfo>,
    /// Whether a value of which too much is declared is declared anew.
    widens: bool,
    /// Declared ranges by node.
    declared: IdMap<NodeId, Range>,
    entries: IdMap<BlockId, Option<State>>,
    errors: &'a mut Vec<VerifyError>,
    /// What modes are left for, where ranges are widened: where each cell is then.
    left: Vec<(ModeId, usize, Range)>,
    place: String,
}

type Fault = String;

impl<'a> Checker<'a> {
    fn of(
        modes: &'a Modes,
        mode: &'a Mode,
        errors: &'a mut Vec<VerifyError>,
        widens: bool,
    ) -> Checker<'a> {
        Checker {
            modes,
            mode,
            graph: Graph::unshared(&modes.kernel),
            nodes: IdMap::filled(None, mode.values.len()),
            values: mode.values.clone(),
            widens,
            declared: IdMap::new(),
            entries: IdMap::filled(None, mode.blocks.len()),
            errors,
            left: Vec::new(),
            place: String::new(),
        }
    }

    fn mode(&mut self) {
        let mode = self.mode;
        let cells = mode.cells.iter().zip(&mode.known);
        let held = cells
            .map(|(range, known)| {
                if *known {
                    Held::Stale
                } else {
                    Held::Within(*range)
                }
            })
            .collect();
        let start = State {
            visible: IdMap::new(),
            facts: Facts::default(),
            held,
        };
        if let Some(entry) = self.entries.first_mut() {
            *entry = Some(start);
        }
        for (at, block) in mode.blocks.enumerated() {
            self.place = format!("{}: {at}", mode.name);
            // What nobody can come to need not be right.
            let Some(state) = self.entries[at].take() else {
                continue;
            };
            if let Err(fault) = self.block(at, block, state) {
                self.errors.push(VerifyError {
                    place: self.place.clone(),
                    message: fault,
                });
            }
        }
    }

    fn block(&mut self, at: BlockId, block: &Block, mut state: State) -> Result<(), Fault> {
        for param in &block.params {
            self.define(*param, Kind::Result(param.0), &[], &mut state)?;
        }
        for inst in &block.insts {
            self.place = format!("{}: {at}: {}", self.mode.name, inst.op.row().name);
            self.inst(inst, &mut state)?;
        }
        match &block.end {
            End::Next(next) => self.next(*next, &state),
            End::Jump(target) => self.go(at, target, state),
            End::Branch {
                condition, yes, no, ..
            } => {
                let id = self.read(*condition, &state)?;
                for (holds, target) in [(1, yes), (0, no)] {
                    let known = |id: NodeId| self.declared[id];
                    if let Some((facts, _)) =
                        facts::with(&self.graph, &known, &state.facts, id, Range::point(holds))
                    {
                        let mut state = State {
                            facts,
                            ..state.clone()
                        };
                        self.settle(&mut state);
                        self.go(at, target, state)?;
                    }
                }
                Ok(())
            }
        }
    }

    /// What the facts about operands say of what was computed from them before.
    fn settle(&self, state: &mut State) {
        let visible: Vec<NodeId> = (0..self.graph.len() as u32)
            .map(NodeId)
            .filter(|id| state.sees(*id))
            .collect();
        for id in visible {
            let Some(op) = self.graph.op(id).filter(|op| !matches!(op, Op::Const(_))) else {
                continue;
            };
            let info = |arg: &NodeId| ValueInfo {
                ty: self.graph.ty(*arg),
                range: self.range(*arg, state),
            };
            let args: Vec<ValueInfo> = self.graph.args(id).iter().map(info).collect();
            if let Ok(Some(natural)) = op.apply(&self.modes.kernel, &args) {
                let (old, new) = (
                    self.range(id, state),
                    meet(natural.range, self.range(id, state)),
                );
                if new != old && !new.is_empty() {
                    state.facts.insert(id, new);
                }
            }
        }
    }

    /// What holds on one more edge to a block.
    fn go(&mut self, at: BlockId, target: &Target, state: State) -> Result<(), Fault> {
        let block = self
            .mode
            .blocks
            .get(target.block)
            .filter(|_| target.block > at);
        let block = block.ok_or_else(|| format!("leads to {}", target.block))?;
        let args = self.infos(&target.args, &state)?;
        self.hold(&block.params, &args)?;
        let entry = self.entries[target.block].take();
        self.entries[target.block] = Some(match entry {
            None => state,
            Some(other) => self.common(&other, &state),
        });
        Ok(())
    }

    fn common(&self, a: &State, b: &State) -> State {
        let visible = a
            .visible
            .iter()
            .zip(&b.visible)
            .map(|(a, b)| *a && *b)
            .collect();
        let facts = a
            .facts
            .iter()
            .filter_map(|(id, x)| Some((*id, x.union(*b.facts.get(id)?))))
            .collect();
        let join = |(x, y): (&Held, &Held)| match (x, y) {
            _ if x == y => *x,
            (Held::Stale, _) | (_, Held::Stale) => Held::Stale,
            _ => Held::Within(self.within(*x, a).union(self.within(*y, b))),
        };
        State {
            visible,
            facts,
            held: a.held.iter().zip(&b.held).map(join).collect(),
        }
    }

    fn within(&self, held: Held, state: &State) -> Range {
        match held {
            Held::Stale => Type::I64.range(),
            Held::Within(range) => range,
            Held::Node(id) => self.range(id, state),
        }
    }

    fn next(&mut self, next: ModeId, state: &State) -> Result<(), Fault> {
        let mode = self
            .modes
            .modes
            .get(next)
            .ok_or_else(|| format!("there is no mode {next}"))?;
        for (cell, held) in state
            .held
            .iter()
            .enumerate()
            .filter(|(cell, _)| !mode.known[*cell])
        {
            let (name, range) = (&self.modes.kernel.cells[cell].name, mode.cells[cell]);
            let left = self.within(*held, state);
            if self.widens {
                self.left.push((next, cell, left));
            } else if !range.contains(left) {
                return Err(format!(
                    "leaves {name} in {held:?}, where mode {next} takes {range}"
                ));
            }
        }
        Ok(())
    }

    fn inst(&mut self, inst: &Inst, state: &mut State) -> Result<(), Fault> {
        match (inst.op, &inst.regions[..]) {
            (Op::If, [then, other]) => {
                self.region(then, &inst.results, state)?;
                self.region(other, &inst.results, state)?;
                self.opaque(&inst.results, state)
            }
            (Op::Loop(rounds), [body]) => self.repeat(inst, rounds, body, state),
            _ => self.plain(inst, state),
        }
    }

    fn opaque(&mut self, results: &[Value], state: &mut State) -> Result<(), Fault> {
        results.iter().try_for_each(|result| {
            self.define(*result, Kind::Result(result.0), &[], state)
                .map(drop)
        })
    }

    /// A region inside an instruction; what it yields fits the results.
    fn region(
        &mut self,
        region: &Region,
        results: &[Value],
        state: &mut State,
    ) -> Result<(), Fault> {
        let outside = state.visible.clone();
        region
            .insts
            .iter()
            .try_for_each(|inst| self.inst(inst, state))?;
        let yields = self.infos(&region.yields, state)?;
        state.visible = outside;
        self.hold(results, &yields)
    }

    fn repeat(
        &mut self,
        inst: &Inst,
        rounds: u32,
        body: &Region,
        state: &mut State,
    ) -> Result<(), Fault> {
        let (round, carried) = body.params.split_first().ok_or("a loop without round")?;
        let info = |value: &Value| self.values[value];
        if !info(round)
            .range
            .contains(Range::new(0, i64::from(rounds) - 1))
        {
            return Err("the round leaves its range".to_string());
        }
        let declared: Vec<ValueInfo> = carried.iter().map(info).collect();
        hold(&declared, &self.infos(&inst.args, state)?)?;
        self.opaque(&body.params, state)?;
        self.region(body, carried, state)?;
        let yields: Vec<ValueInfo> = body.yields.iter().map(|value| self.values[value]).collect();
        hold(
            &inst
                .results
                .iter()
                .map(|value| self.values[value])
                .collect::<Vec<_>>(),
            &yields,
        )?;
        self.opaque(&inst.results, state)
    }

    fn plain(&mut self, inst: &Inst, state: &mut State) -> Result<(), Fault> {
        let args = inst
            .args
            .iter()
            .map(|arg| self.read(*arg, state))
            .collect::<Result<Vec<NodeId>, Fault>>()?;
        let expected = match (inst.op, &inst.results[..]) {
            (Op::Const(value), [result]) => Op::constant(self.values[result].ty, value).map(Some),
            _ => inst
                .op
                .apply(&self.modes.kernel, &self.infos(&inst.args, state)?),
        };
        let mut expected = expected.map_err(|error| error.to_string())?;
        match (inst.op, &mut expected) {
            (Op::Get(cell), Some(info)) => match state.held[cell as usize] {
                Held::Stale => return Err("reads a cell that memory does not hold".to_string()),
                held => info.range = meet(info.range, self.within(held, state)),
            },
            (Op::Set(cell), _) if self.modes.kernel.cells[cell as usize].len == 1 => {
                state.held[cell as usize] = Held::Node(args[0]);
            }
            _ => {}
        }
        let Some(info) = expected else { return Ok(()) };
        let result = *inst.results.first().ok_or("gives a result")?;
        self.hold(&[result], &[info])?;
        let id = self.define(result, Kind::Op(inst.op), &args, state)?;
        if let Op::Get(cell) = inst.op {
            state.held[cell as usize] = Held::Node(id);
        }
        Ok(())
    }

    /// Whether values can hold what is computed, or can when it is declared anew.
    fn hold(&mut self, values: &[Value], computed: &[ValueInfo]) -> Result<(), Fault> {
        if self.widens {
            for (value, computed) in values.iter().zip(computed) {
                let declared = &mut self.values[*value];
                declared.range = declared.range.union(computed.range);
            }
        }
        let declared: Vec<ValueInfo> = values.iter().map(|value| self.values[*value]).collect();
        hold(&declared, computed)
    }

    fn define(
        &mut self,
        value: Value,
        kind: Kind,
        args: &[NodeId],
        state: &mut State,
    ) -> Result<NodeId, Fault> {
        let info = *self
            .values
            .get(value)
            .ok_or_else(|| format!("nothing is known of {value}"))?;
        if self.nodes[value].is_some() {
            return Err(format!("{value} is defined twice"));
        }
        let id = self.graph.node(kind, info.ty, args);
        self.nodes[value] = Some(id);
        self.declared.resize(self.graph.len(), info.range);
        state.visible.resize(self.graph.len(), false);
        state.visible[id] = true;
        Ok(id)
    }

    fn read(&self, value: Value, state: &State) -> Result<NodeId, Fault> {
        let node = self
            .nodes
            .get(value)
            .copied()
            .flatten()
            .filter(|id| state.sees(*id));
        node.ok_or_else(|| format!("{value} is not defined here"))
    }

    fn range(&self, id: NodeId, state: &State) -> Range {
        state
            .facts
            .get(&id)
            .map_or(self.declared[id], |fact| meet(self.declared[id], *fact))
    }

    fn infos(&self, values: &[Value], state: &State) -> Result<Vec<ValueInfo>, Fault> {
        let info = |value: &Value| {
            let id = self.read(*value, state)?;
            Ok(ValueInfo {
                ty: self.values[value].ty,
                range: self.range(id, state),
            })
        };
        values.iter().map(info).collect()
    }
}

/// Whether values of these types and ranges can hold what is computed.
fn hold(declared: &[ValueInfo], computed: &[ValueInfo]) -> Result<(), Fault> {
    if declared.len() != computed.len() {
        return Err(format!("{} values for {}", computed.len(), declared.len()));
    }
    for (declared, computed) in declared.iter().zip(computed) {
        if declared.ty != computed.ty || !declared.range.contains(computed.range) {
            let (a, b) = (declared, computed);
            return Err(format!(
                "{} {} is declared {} {}",
                b.ty, b.range, a.ty, a.range
            ));
        }
    }
    Ok(())
}
