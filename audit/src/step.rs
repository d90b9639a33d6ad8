//! One instruction in one state: where it may lead, in which states, after how many cycles.
//!
//! All outcomes are followed: a condition is met or not, a table's entry is any that the facts
//! allow, a division is as long as they allow. Cycles are those of `isa::timing::Core::issue`, the
//! function that the emulator counts with.

mod calls;
#[cfg(test)]
mod tests;

use std::cell::RefCell;
use std::rc::Rc;

use whippen_isa::timing::{Core, Evidence, Outcome, Pipe, Target, Timed};
use whippen_isa::{Class, Cond, Inst, ItState, Op, RegSet, decode, is_wide, reg};

use crate::Refusal;
use crate::certificate::{Certificate, Function, Kind};
use crate::effect::execute;
use crate::elf::Elf;
use crate::facts::Facts;
use crate::memory::{Access, Around};
use crate::overlap::Last;
use crate::place::{Place, Tag};

/// Entries of a table of branches at most.
const TABLE_MAX: i64 = 1024;

/// An instruction in a call.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Node {
    /// The number of the call.
    pub context: u32,
    /// Its address.
    pub at: u32,
    /// The state of IT in front of it, as the register has it.
    pub it: u8,
}

/// The state in front of an instruction.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct State {
    /// The pipeline.
    pub pipe: Pipe,
    /// Registers and flags.
    pub facts: Facts,
    /// The stack.
    pub place: Place,
    /// The access right before; forgotten at points.
    pub last: Last,
}

/// An instruction, and what of it follows from its bytes alone.
#[derive(Debug)]
pub(crate) struct Decoded {
    inst: Inst,
    control: Control,
    timed: Timed,
    hands_stack: bool,
}

/// Where an instruction leads.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum To {
    /// To an instruction.
    Node(Node),
    /// Out of the function, by its return.
    Return,
}

/// What a call costs whose callee is bounded as a function of its own.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Cost {
    /// Cycles from its first instruction to the one behind the call.
    pub cycles: u64,
    /// Bytes of stack.
    pub stack: u32,
    /// Where it is bounded to return to; none for what is never called.
    pub returns: Option<(u32, bool)>,
    /// Banks that are fetched from while it runs.
    pub fetched: u32,
}

/// What was met on the way.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Seen {
    /// As sure as the least sure number.
    pub class: Evidence,
    /// Bytes of stack.
    pub stack: u32,
    /// Whether an address of the stack was handed out.
    pub hands_stack: bool,
}

/// A function with all that its steps depend on.
pub struct Stepper<'a> {
    /// Its core.
    pub core: &'a Core,
    /// Memory around it.
    pub around: &'a Around<'a>,
    /// What is claimed of the image.
    pub certificate: &'a Certificate,
    /// The function.
    pub function: &'a Function,
    /// What its calls cost, in their order.
    pub costs: &'a [Option<Cost>],
    /// Room for walks, which one leaves to the next.
    pub room: RefCell<Room>,
}

/// What a walk has still to go on from, and where one instruction leads.
#[derive(Debug, Default)]
pub struct Room {
    pub(crate) open: Vec<(Node, State, u64)>,
    pub(crate) next: Steps,
}

#[derive(Debug, Clone, Copy)]
enum Control {
    Next,
    Jump(u32),
    Call(u32),
    CallIndirect,
    Return,
    Table,
    Indirect,
}

impl Stepper<'_> {
    fn elf(&self) -> &Elf {
        self.around.elf
    }

    /// The instruction at a node, which is decoded once.
    fn decoded(&self, node: Node) -> Result<Rc<Decoded>, Refusal> {
        let key = (node.at, node.it);
        if let Some(known) = self.around.decoded.borrow().get(&key) {
            return Ok(known.clone());
        }
        let inst = self.decode(node)?;
        let decoded = Rc::new(Decoded {
            control: self.control(&inst, node.at)?,
            timed: self.core.prepare(&inst),
            hands_stack: inst.hands_stack(),
            inst,
        });
        let mut all = self.around.decoded.borrow_mut();
        Ok(all.entry(key).or_insert(decoded).clone())
    }

    fn decode(&self, node: Node) -> Result<Inst, Refusal> {
        let at = node.at;
        let half = |at| {
            self.around.is_own_code(at)?;
            self.elf()
                .half(at)
                .ok_or_else(|| Refusal::at(at, "is no code"))
        };
        let first = half(at)?;
        let second = if is_wide(first) {
            half(at.wrapping_add(2))?
        } else {
            0
        };
        let it = ItState::from_bits(node.it).unwrap_or_default();
        decode(first, second, self.core.arch, it)
            .map_err(|_| Refusal::at(at, "is no instruction that may be executed"))
    }

    /// What an instruction does to the flow of control.
    fn control(&self, inst: &Inst, at: u32) -> Result<Control, Refusal> {
        let relative = at.wrapping_add(4).wrapping_add(inst.imm);
        let (class, told) = (inst.class(), self.targets(at).is_some());
        Ok(match class {
            Class::Branch | Class::CompareBranch => Control::Jump(relative),
            Class::BranchLink if inst.op() == Op::BL => Control::Call(relative),
            Class::BranchLink => Control::CallIndirect,
            Class::TableBranch => Control::Table,
            Class::Exception | Class::Security => {
                return Err(Refusal::at(at, "leaves the code's own hands"));
            }
            // How many words, only the coprocessor knows.
            Class::Coprocessor if inst.is_of_coprocessor_memory() => {
                return Err(Refusal::at(at, "accesses memory for a coprocessor"));
            }
            Class::BranchRegister if inst.m == reg::LR && !told => Control::Return,
            _ if !inst.defs().contains(RegSet::core(reg::PC)) => Control::Next,
            _ if told => Control::Indirect,
            Class::LoadMultiple | Class::Load if inst.n == reg::SP && inst.wback => Control::Return,
            _ if inst.op() == Op::MOV_register && inst.m == reg::LR => Control::Return,
            _ => Control::Indirect,
        })
    }

    fn targets(&self, at: u32) -> Option<&[u32]> {
        let all = &self.certificate.targets;
        let found = all.binary_search_by_key(&at, |(branch, _)| *branch);
        found.ok().map(|found| &all[found].1[..])
    }

    /// Everywhere that an instruction may lead from a state, added to `steps`.
    ///
    /// # Errors
    /// What cannot be followed.
    pub fn step(
        &self,
        node: Node,
        state: State,
        seen: &mut Seen,
        steps: &mut Steps,
    ) -> Result<(), Refusal> {
        let decoded = self.decoded(node)?;
        let (inst, control) = (decoded.inst, decoded.control);
        seen.hands_stack |= decoded.hands_stack;
        if matches!(inst.op(), Op::WFE | Op::WFI) && self.function.kind != Kind::Idle {
            return Err(Refusal::at(node.at, "sleeps"));
        }
        if decoded.hands_stack && !self.function.hands_stack {
            return Err(Refusal::at(node.at, "hands out an address of the stack"));
        }
        let mut step = Stepping {
            own: self,
            node,
            inst,
            timed: &decoded.timed,
            seen,
            steps,
        };
        let cond = inst.cond.filter(|_| inst.is_conditional());
        if cond.is_none() && inst.class() != Class::CompareBranch {
            return step.branches(&control, cond, state);
        }
        step.branches(&control, cond, state.clone())?;
        step.falls_through(cond, state)
    }

    /// The section that a register's interval lies in: in the code of keys alone, where pointers
    /// are moved by what selection knows; elsewhere addresses are known or they are not.
    pub fn derived(&self, facts: &Facts, register: u8) -> Option<Tag> {
        let keys = self.function.kind == Kind::Keys;
        let section = keys.then(|| self.around.section_of(facts.of(register)));
        section.flatten().map(Tag::Section)
    }

    fn target(&self, to: u32) -> Target {
        Target {
            address: to,
            wide: self.elf().is_wide(to),
        }
    }
}

/// Where an instruction leads, in which state, after how many cycles.
pub type Steps = Vec<(To, State, u64)>;

struct Stepping<'a, 's> {
    own: &'a Stepper<'a>,
    node: Node,
    inst: Inst,
    timed: &'s Timed,
    seen: &'s mut Seen,
    steps: &'s mut Steps,
}

impl Stepping<'_, '_> {
    fn at(&self) -> u32 {
        self.node.at
    }

    fn refusal(&self, why: &str) -> Refusal {
        Refusal::at(self.node.at, format!("`{}` {why}", self.inst))
    }

    /// The instruction behind this one.
    fn next(&self) -> Node {
        let it = ItState::from_bits(self.node.it).unwrap_or_default();
        let it = self.inst.it_behind(it).unwrap_or_default();
        Node {
            at: self.at().wrapping_add(self.inst.size()),
            it: it.bits(),
            ..self.node
        }
    }

    fn jump(&self, context: u32, at: u32) -> To {
        To::Node(Node { context, at, it: 0 })
    }

    /// The condition is met, or there is none.
    fn branches(
        &mut self,
        control: &Control,
        cond: Option<Cond>,
        mut state: State,
    ) -> Result<(), Refusal> {
        let compares = self.inst.class() == Class::CompareBranch;
        let met = match cond {
            Some(cond) => state.facts.assume(cond),
            None if compares => {
                let zero = self.inst.op() == Op::CBZ;
                state.facts.assume_zero(self.inst.n, zero)
            }
            None => true,
        };
        if !met {
            return Ok(());
        }
        let at = self.at();
        match *control {
            Control::Next => {
                let next = To::Node(self.next());
                self.execute(next, None, state)?;
            }
            Control::Jump(to) => self.goes(to, state)?,
            Control::Call(callee) => self.calls(callee, state)?,
            Control::Return => self.comes_back(state)?,
            Control::Table => {
                for to in self.entries(&state)? {
                    self.goes(to, state.clone())?;
                }
            }
            Control::Indirect | Control::CallIndirect => {
                let own = self.own;
                let none = || self.refusal("may lead anywhere");
                for to in own.targets(at).ok_or_else(none)? {
                    match control {
                        Control::Indirect => self.goes(*to, state.clone())?,
                        _ => self.calls(*to, state.clone())?,
                    }
                }
            }
        }
        Ok(())
    }

    /// The condition fails.
    fn falls_through(&mut self, cond: Option<Cond>, mut state: State) -> Result<(), Refusal> {
        let fails = match cond {
            Some(cond) => cond
                .invert()
                .is_some_and(|inverse| state.facts.assume(inverse)),
            None => {
                let zero = self.inst.op() != Op::CBZ;
                state.facts.assume_zero(self.inst.n, zero)
            }
        };
        if fails {
            let next = To::Node(self.next());
            let cycles = self.issue(&mut state, Outcome::SKIPPED)?;
            self.steps.push((next, state, cycles));
        }
        Ok(())
    }

    fn goes(&mut self, to: u32, state: State) -> Result<(), Refusal> {
        let (context, target) = (self.node.context, self.own.target(to));
        self.execute(self.jump(context, to), Some(target), state)
    }

    /// The entries of a table behind its branch that facts allow.
    fn entries(&self, state: &State) -> Result<Vec<u32>, Refusal> {
        let [low, high] = state.facts.of(self.inst.m);
        if self.inst.n != reg::PC || low < 0 || high >= TABLE_MAX {
            return Err(self.refusal("has an index that is not bounded"));
        }
        let (base, elf) = (self.at().wrapping_add(4), self.own.elf());
        let entry = |index: i64| {
            let index = index as u32;
            let entry = match self.inst.op() {
                Op::TBB => elf.byte(base.wrapping_add(index)).map(u32::from),
                _ => elf.half(base.wrapping_add(2 * index)).map(u32::from),
            };
            entry.map(|entry| base.wrapping_add(2 * entry))
        };
        let found: Option<Vec<u32>> = (low..=high).map(entry).collect();
        let mut found = found.ok_or_else(|| self.refusal("has a table outside of the code"))?;
        found.sort_unstable();
        found.dedup();
        Ok(found)
    }

    fn execute(&mut self, to: To, target: Option<Target>, state: State) -> Result<(), Refusal> {
        let mut state = state;
        let cycles = self.cycles_of(target, &mut state)?;
        self.steps.push((to, state, cycles));
        Ok(())
    }

    /// Executes the instruction: its cycles, and what it does to facts and stack.
    fn cycles_of(&mut self, target: Option<Target>, state: &mut State) -> Result<u64, Refusal> {
        let inst = self.inst;
        let mut outcome = Outcome {
            target,
            ..Outcome::NEXT
        };
        if inst.class() == Class::Divide {
            outcome.quotient_bits = quotient_bits(&inst, &state.facts);
        }
        let cycles = self.issue(state, outcome)?;
        let State { facts, place, .. } = state;
        let moved = place.execute(&inst, || self.own.derived(facts, inst.n));
        moved.map_err(|why| self.refusal(why))?;
        execute(&mut state.facts, &inst, self.at(), self.own.elf());
        state.facts.forget_unused();
        self.seen.stack = self.seen.stack.max(state.place.sp.min(0).unsigned_abs());
        Ok(cycles)
    }

    fn issue(&mut self, state: &mut State, outcome: Outcome) -> Result<u64, Refusal> {
        let (own, inst) = (self.own, self.inst);
        if own.function.kind == Kind::Idle && inst.class().is_floating_point() {
            return Err(self.refusal("makes an interrupt save more"));
        }
        let section = match state.place.tag(inst.n) {
            Some(Tag::Section(section)) => Some(section),
            _ => None,
        };
        let (at, function) = (self.at(), own.function);
        let target = outcome.target.map(|target| target.address);
        let fetched = [Some(at), target].into_iter().flatten();
        if fetched.fold(0, |set, at| set | own.around.fetched_at(at)) & !function.fetched != 0 {
            return Err(self.refusal("is fetched from a bank that is not claimed"));
        }
        let access = Access {
            inst: &inst,
            at,
            facts: &state.facts,
            section,
            fetched: function.fetched,
            hands_stack: function.hands_stack,
            target,
            skipped: outcome.skipped,
        };
        let waits = match function.kind {
            Kind::Idle => own.around.waits_anywhere(&access)?,
            _ => own.around.waits(&access)?,
        };
        let last = match own.core.overlap.cycles {
            0 => Last::default(),
            _ => Last::of(&inst, at, &state.facts, state.place.tag(inst.n), own.around),
        };
        let apart = state.last.is_apart(last, &inst);
        state.last = if outcome.skipped {
            Last::default()
        } else {
            last
        };
        let outcome = Outcome {
            waits,
            apart,
            ..outcome
        };
        let (pipe, cost) = own.core.issue(state.pipe, self.timed, at, &outcome);
        self.seen.class = self.seen.class.max(own.core.evidence(self.timed, &cost));
        state.pipe = pipe;
        Ok(cost.cycles().into())
    }
}

/// The most bits of a quotient: they decide how long a division is.
fn quotient_bits(inst: &Inst, facts: &Facts) -> i8 {
    let signed = inst.op() == Op::SDIV;
    let magnitudes = |register: u8| match (signed, facts.of(register)) {
        (false, value) => crate::facts::unsigned(value),
        (true, [low, high]) if low <= 0 && 0 <= high => [0, (-low).max(high)],
        (true, [low, high]) => [low.abs().min(high.abs()), low.abs().max(high.abs())],
    };
    let top = |magnitude: i64| 63 - magnitude.leading_zeros() as i32;
    let (most, least) = (magnitudes(inst.n)[1], magnitudes(inst.m)[0].max(1));
    (top(most) - top(least)).clamp(-1, 31) as i8
}
