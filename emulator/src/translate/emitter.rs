//! Emits a block: where registers, flags and outcomes are while its code runs, how the interpreter
//! is called for an instruction, and how the code is left.

use super::Mode;
use super::host::{Helpers, signature};
use super::unit::{Ended, Node, Time, Unit, Way};
use crate::block::{Block as Decoded, Info};
use crate::bus::Bus;
use crate::cpu::Cpu;
use crate::op::{Flow, Op};
use cranelift_codegen::ir::condcodes::IntCC;
use cranelift_codegen::ir::types::{I8, I32, I64};
use cranelift_codegen::ir::{Block, InstBuilder, MemFlagsData, SigRef, Signature, Type, Value};
use cranelift_codegen::isa::TargetFrontendConfig;
use cranelift_frontend::{FunctionBuilder, Variable};
use std::mem::offset_of;
use whippen_isa::{Class, Inst, Op as I};

/// What is kept in values: registers by number, then these.
pub(super) const NEGATIVE: usize = 16;
pub(super) const ZERO: usize = 17;
pub(super) const CARRY: usize = 18;
pub(super) const OVERFLOW: usize = 19;
pub(super) const OUTCOMES: usize = 20;
const KEPT: usize = 21;

/// What is known when code is emitted.
#[derive(Clone, Copy)]
pub(super) struct Kept {
    /// All flags are those of this difference.
    pub compared: Option<(Value, Value)>,
    /// The outcomes, where they are the same on every way.
    pub outcomes: Option<u64>,
}

/// Where a block is left to.
#[derive(Clone, Copy)]
pub(super) enum Target {
    /// An address.
    Known(u32),
    /// One that is computed.
    Of(Value),
}

/// What is emitted for.
#[derive(Clone, Copy)]
pub(super) struct At<'a> {
    /// The number of the instruction in its block.
    pub index: usize,
    pub op: &'a Op,
    pub inst: &'a Inst,
    /// Its condition has been met.
    pub conditional: bool,
}

/// See the module.
pub(super) struct Emitter<'f, 'b> {
    pub f: FunctionBuilder<'f>,
    pub kept: Kept,
    /// Whether anything can follow what was emitted.
    pub goes_on: bool,
    pub mode: Mode,
    pub cpu: Value,
    pub bus: Value,
    pub reads: Value,
    pub writes: Value,
    pub pages: Value,
    pub time: Value,
    variables: [Variable; KEPT],
    left: Variable,
    instructions: Variable,
    node: Node,
    unit: Unit<'b, Block>,
    helpers: Helpers,
    helper: SigRef,
}

/// Fields of the core: whole, in this computer's order.
fn fixed() -> MemFlagsData {
    MemFlagsData::trusted()
}

/// Where something that is kept stands in the core, and its type.
fn place(slot: usize) -> (i32, Type) {
    let (offset, of) = match slot {
        NEGATIVE => (offset_of!(Cpu, negative), I32),
        ZERO => (offset_of!(Cpu, zero), I32),
        CARRY => (offset_of!(Cpu, carry), I8),
        OVERFLOW => (offset_of!(Cpu, overflow), I8),
        OUTCOMES => (offset_of!(Cpu, outcomes), I64),
        register => (offset_of!(Cpu, r) + 4 * register, I32),
    };
    (offset as i32, of)
}

impl<'f, 'b> Emitter<'f, 'b> {
    pub fn new(
        mut f: FunctionBuilder<'f>,
        helpers: Helpers,
        mode: Mode,
        blocks: &'b [Decoded],
    ) -> Self {
        let entry = f.create_block();
        f.append_block_params_for_function_params(entry);
        f.switch_to_block(entry);
        f.seal_block(entry);
        let parameters: Vec<Value> = f.block_params(entry).to_vec();
        let variables = std::array::from_fn(|slot| f.declare_var(place(slot).1));
        let call = f.func.signature.call_conv;
        let helper = f.import_signature(signature(Signature::new(call), 3));
        let (left, instructions) = (f.declare_var(I64), f.declare_var(I64));
        let mut emitter = Self {
            f,
            kept: Kept {
                compared: None,
                outcomes: None,
            },
            goes_on: true,
            mode,
            cpu: parameters[0],
            bus: parameters[1],
            reads: parameters[2],
            writes: parameters[3],
            pages: parameters[4],
            time: parameters[5],
            variables,
            left,
            instructions,
            node: Node { block: 0, pipe: 0 },
            unit: Unit::new(blocks),
            helpers,
            helper,
        };
        for (variable, offset) in emitter.times() {
            let value = emitter.f.ins().load(I64, fixed(), emitter.time, offset);
            emitter.f.def_var(variable, value);
        }
        emitter.read_all();
        emitter
    }

    /// What is kept of time, and where it is.
    fn times(&self) -> [(Variable, i32); 2] {
        [
            (self.left, offset_of!(Time, left) as i32),
            (self.instructions, offset_of!(Time, instructions) as i32),
        ]
    }

    /// Emits what begins with a node.
    pub fn unit(mut self, first: Node, config: TargetFrontendConfig) {
        let start = self.f.create_block();
        self.f.ins().jump(start, &[]);
        self.unit.node(first, || start);
        while let Some((node, block)) = self.unit.next() {
            self.f.switch_to_block(block);
            self.block(node);
        }
        self.f.seal_all_blocks();
        self.f.finalize(config);
    }

    /// Emits all instructions of a block.
    fn block(&mut self, node: Node) {
        self.node = node;
        self.goes_on = true;
        self.kept = Kept {
            compared: None,
            outcomes: Some(1),
        };
        let none = self.f.ins().iconst(I64, 1);
        self.set(OUTCOMES, none);
        let block = &self.unit.blocks[node.block];
        for (index, (op, info)) in block.ops.iter().zip(&block.infos).enumerate() {
            self.instruction(index, op, info);
            if !self.goes_on {
                return;
            }
        }
        self.leave_to(Flow::Next, block.ops.len(), Target::Known(block.end));
    }

    fn instruction(&mut self, index: usize, op: &Op, info: &Info) {
        let Ok((inst, _)) = &info.inst else {
            return self.interpret(index, op, None);
        };
        let conditional = inst.is_conditional() && inst.op() != I::B;
        let at = At {
            index,
            op,
            inst,
            conditional,
        };
        if conditional {
            self.conditional(&at);
        } else if !self.native(&at) {
            self.interpret(index, op, Some(&at));
        }
    }

    /// Emits an instruction in place; false, and nothing is emitted, where that cannot be done.
    fn native(&mut self, at: &At) -> bool {
        self.data(at)
            || self.bits(at)
            || self.multiply(at)
            || self.memory(at)
            || self.multiple(at)
            || self.branch(at)
            || matches!(at.inst.op(), I::IT | I::NOP)
    }

    /// An instruction in an IT block.
    fn conditional(&mut self, at: &At) {
        let Some(cond) = at.inst.cond else {
            return self.interpret(at.index, at.op, Some(at));
        };
        let holds = self.holds(cond);
        self.remember(holds);
        let (met, join) = (self.f.create_block(), self.f.create_block());
        self.f.ins().brif(holds, met, &[], join, &[]);
        self.begin(met);
        if !self.native(at) {
            self.interpret(at.index, at.op, Some(at));
        }
        if std::mem::replace(&mut self.goes_on, true) {
            self.f.ins().jump(join, &[]);
        }
        self.kept = Kept {
            compared: None,
            outcomes: None,
        };
        self.begin(join);
    }

    /// Continues in a block to which nothing leads that is not there yet.
    pub fn begin(&mut self, block: Block) {
        self.f.switch_to_block(block);
        self.f.seal_block(block);
    }

    /// What is kept.
    pub fn get(&mut self, slot: usize) -> Value {
        self.f.use_var(self.variables[slot])
    }

    /// Reads what the core's memory holds.
    fn read(&mut self, slot: usize) {
        let (offset, of) = place(slot);
        let value = self.f.ins().load(of, fixed(), self.cpu, offset);
        self.f.def_var(self.variables[slot], value);
    }

    /// Reads all registers and flags.
    fn read_all(&mut self) {
        (0..15)
            .chain(NEGATIVE..=OVERFLOW)
            .for_each(|slot| self.read(slot));
    }

    /// Changes what is written when the code is left.
    pub fn set(&mut self, slot: usize, value: Value) {
        self.f.def_var(self.variables[slot], value);
    }

    /// A register as an operand.
    pub fn register(&mut self, op: &Op, number: u8) -> Value {
        match number & 15 {
            15 => self.constant(op.pc()),
            number => self.get(number as usize),
        }
    }

    /// Writes a register, at once.
    pub fn set_register(&mut self, number: u8, value: Value) {
        let slot = (number & 15) as usize;
        self.f.def_var(self.variables[slot], value);
        let (offset, _) = place(slot);
        self.f.ins().store(fixed(), value, self.cpu, offset);
    }

    pub fn constant(&mut self, word: u32) -> Value {
        self.f.ins().iconst(I32, i64::from(word))
    }

    /// A field of the core.
    pub fn field(&mut self, of: Type, offset: usize) -> Value {
        self.f.ins().load(of, fixed(), self.cpu, offset as i32)
    }

    /// Sets a field of the core.
    pub fn set_field(&mut self, offset: usize, value: Value) {
        self.f.ins().store(fixed(), value, self.cpu, offset as i32);
    }

    /// Remembers for timing whether something was passed.
    pub fn remember(&mut self, passed: Value) {
        self.kept.outcomes = None;
        let outcomes = self.get(OUTCOMES);
        let moved = self.f.ins().ishl_imm_u(outcomes, 1);
        let bit = self.f.ins().uextend(I64, passed);
        let outcomes = self.f.ins().bor(moved, bit);
        self.set(OUTCOMES, outcomes);
    }

    /// Remembers what is passed on every way that goes on.
    pub fn remember_known(&mut self, passed: bool) {
        let outcomes = self
            .kept
            .outcomes
            .map(|known| known << 1 | u64::from(passed));
        let value = match outcomes {
            Some(known) => self.f.ins().iconst(I64, known as i64),
            None => {
                let moved = self.get(OUTCOMES);
                let moved = self.f.ins().ishl_imm_u(moved, 1);
                self.f.ins().bor_imm_u(moved, i64::from(passed))
            }
        };
        self.set(OUTCOMES, value);
        self.kept.outcomes = outcomes;
    }

    /// Writes flags and outcomes.
    fn flush(&mut self) {
        for slot in NEGATIVE..=OUTCOMES {
            let (offset, _) = place(slot);
            let value = self.get(slot);
            self.f.ins().store(fixed(), value, self.cpu, offset);
        }
    }

    /// Leaves the block towards an address, after so many instructions before the last one; nothing
    /// follows.
    pub fn leave_to(&mut self, flow: Flow, index: usize, target: Target) {
        self.goes_on = false;
        let done = index + usize::from(flow == Flow::Branch);
        let known = match target {
            Target::Known(address) => Some(address),
            Target::Of(_) => None,
        };
        let ways = match self.mode {
            Mode::Alone => self.unit.ways(self.node, done, self.kept.outcomes, known),
            Mode::Apart => Vec::new(),
        };
        for way in ways {
            let Some(is_it) = self.is_way(&way, target) else {
                return self.go_to(&way);
            };
            let (here, next) = (self.f.create_block(), self.f.create_block());
            self.f.ins().brif(is_it, here, &[], next, &[]);
            self.begin(here);
            self.go_to(&way);
            self.begin(next);
        }
        if flow == Flow::Branch {
            let pc = match target {
                Target::Known(address) => self.constant(address),
                Target::Of(address) => address,
            };
            self.set_field(offset_of!(Cpu, pc), pc);
        }
        let ended = self.ended(Some(flow), index).word();
        let ended = self.f.ins().iconst(I64, ended);
        self.leave(ended);
    }

    /// Whether it is a way, where that is not sure.
    fn is_way(&mut self, way: &Way, target: Target) -> Option<Value> {
        let same = |e: &mut Self, value, known: u64| {
            e.f.ins().icmp_imm_u(IntCC::Equal, value, known as i64)
        };
        let outcomes = match self.kept.outcomes {
            Some(_) => None,
            None => {
                let outcomes = self.get(OUTCOMES);
                Some(same(self, outcomes, way.outcomes))
            }
        };
        let address = match target {
            Target::Known(_) => None,
            Target::Of(address) => Some(same(self, address, way.next.into())),
        };
        match (outcomes, address) {
            (Some(outcomes), Some(address)) => Some(self.f.ins().band(outcomes, address)),
            (one, other) => one.or(other),
        }
    }

    /// Goes on with the block that follows, where it is here and there is room up to the horizon.
    fn go_to(&mut self, way: &Way) {
        let left = self.f.use_var(self.left);
        let cycles = self.f.ins().iconst(I64, i64::from(way.link.known.cycles));
        let left = self.f.ins().isub(left, cycles);
        self.f.def_var(self.left, left);
        let instructions = self.f.use_var(self.instructions);
        let done = i64::from(way.link.done);
        let instructions = self.f.ins().iadd_imm_u(instructions, done);
        self.f.def_var(self.instructions, instructions);
        let node = way.node();
        let f = &mut self.f;
        if let Some(block) = self.unit.node(node, || f.create_block()) {
            let needed = self.unit.blocks[node.block].cycles_max as i64;
            let cc = IntCC::UnsignedGreaterThanOrEqual;
            let fits = self.f.ins().icmp_imm_u(cc, left, needed);
            let out = self.f.create_block();
            self.f.set_cold_block(out);
            self.f.ins().brif(fits, block, &[], out, &[]);
            self.begin(out);
        }
        let (block, pipe) = (node.block, node.pipe);
        let ended = Ended {
            block,
            pipe,
            flow: None,
            done: 0,
        };
        let ended = self.f.ins().iconst(I64, ended.word());
        self.leave(ended);
    }

    fn ended(&self, flow: Option<Flow>, done: usize) -> Ended {
        let Node { block, pipe } = self.node;
        Ended {
            block,
            pipe,
            flow,
            done,
        }
    }

    /// Leaves the code.
    fn leave(&mut self, ended: Value) {
        self.flush();
        for (variable, offset) in self.times() {
            let value = self.f.use_var(variable);
            self.f.ins().store(fixed(), value, self.time, offset);
        }
        self.f.ins().return_(&[ended]);
    }

    /// Calls the interpreter for an instruction: its flow.
    fn call(&mut self, index: usize, op: &Op, body: bool) -> Value {
        if self.mode == Mode::Apart {
            let offset = offset_of!(Bus, trail) + crate::apart::Trail::OP;
            let number = self.f.ins().iconst(I8, index as i64);
            self.f.ins().store(fixed(), number, self.bus, offset as i32);
        }
        let helper = match body {
            false => self.helpers.run,
            true => self.helpers.body,
        };
        let helper = self.f.ins().iconst(I64, helper);
        let op = self.f.ins().iconst(I64, op as *const Op as i64);
        let called = [self.cpu, self.bus, op];
        let call = self.f.ins().call_indirect(self.helper, helper, &called);
        self.f.inst_results(call)[0]
    }

    /// Goes on where the flow is to the next instruction, else leaves.
    fn go_on(&mut self, index: usize, flow: Value) {
        let (out, next) = (self.f.create_block(), self.f.create_block());
        self.f.set_cold_block(out);
        self.f.ins().brif(flow, out, &[], next, &[]);
        self.begin(out);
        self.leave_by(flow, index);
        self.begin(next);
    }

    /// Leaves the code with a flow of the interpreter's.
    fn leave_by(&mut self, flow: Value, index: usize) {
        // The flow to the next instruction is 0.
        let ended = self.ended(Some(Flow::Next), index).word();
        let ended = self.f.ins().bor_imm_u(flow, ended);
        self.leave(ended);
    }

    /// An instruction by the interpreter, which may read and change everything.
    fn interpret(&mut self, index: usize, op: &Op, at: Option<&At>) {
        self.flush();
        let flow = self.call(index, op, at.is_some_and(|at| at.conditional));
        self.read_all();
        self.read(OUTCOMES);
        self.kept.compared = None;
        if at.is_none_or(|at| at.inst.class() == Class::Divide || at.inst.is_conditional()) {
            self.kept.outcomes = None;
        }
        self.go_on(index, flow);
    }

    /// A load or store by the interpreter, which neither reads nor changes flags.
    pub fn access(&mut self, at: &At) {
        let flow = self.call(at.index, at.op, at.conditional);
        self.go_on(at.index, flow);
        for register in registers(at.inst.defs().core_bits() & 0x7fff) {
            self.read(register);
        }
    }

    /// What cannot be done in place, from `slow` on: the interpreter does it, and what it defines
    /// is read again. It neither reads nor changes flags. What was emitted up to now goes on behind
    /// it, too.
    pub fn or_interpret(&mut self, at: &At, slow: Block, before: Kept) {
        let goes_on = std::mem::replace(&mut self.goes_on, true);
        let join = self.f.create_block();
        if goes_on {
            self.f.ins().jump(join, &[]);
        }
        self.f.set_cold_block(slow);
        self.begin(slow);
        self.kept = before;
        self.access(at);
        self.f.ins().jump(join, &[]);
        self.begin(join);
    }

    /// What can never be done in place, from `slow` on: the interpreter leaves.
    pub fn or_fail(&mut self, at: &At, slow: Block, before: Kept) {
        let (kept, here) = (self.kept, self.f.current_block());
        self.f.set_cold_block(slow);
        self.begin(slow);
        self.kept = before;
        let flow = self.call(at.index, at.op, at.conditional);
        self.leave_by(flow, at.index);
        self.kept = kept;
        if let Some(here) = here {
            self.f.switch_to_block(here);
        }
    }

    /// The new value of SP; where it is below its limit the interpreter raises the fault.
    pub fn checked_sp(&mut self, value: Value, slow: Block) -> Value {
        let value = self.f.ins().band_imm_u(value, i64::from(!3_u32));
        let ipsr = self.field(I32, offset_of!(Cpu, ipsr));
        let control = self.field(I32, offset_of!(Cpu, control));
        let thread = self.f.ins().icmp_imm_u(IntCC::Equal, ipsr, 0);
        let chosen = self.f.ins().band_imm_u(control, 2);
        let chosen = self.f.ins().icmp_imm_u(IntCC::NotEqual, chosen, 0);
        let process = self.f.ins().band(thread, chosen);
        let psplim = self.field(I32, offset_of!(Cpu, psplim));
        let msplim = self.field(I32, offset_of!(Cpu, msplim));
        let limit = self.f.ins().select(process, psplim, msplim);
        let below = self.f.ins().icmp(IntCC::UnsignedLessThan, value, limit);
        let next = self.f.create_block();
        self.f.ins().brif(below, slow, &[], next, &[]);
        self.begin(next);
        value
    }
}

/// The members of a list, lowest first.
pub(super) fn registers(list: u16) -> impl Iterator<Item = usize> {
    registers32(list.into())
}

fn registers32(set: u32) -> impl Iterator<Item = usize> {
    (0..32).filter(move |slot| set >> slot & 1 != 0)
}
