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
/// R0 to R14, and the flags.
const REGISTERS: u32 = 0x7fff;
const FLAGS: u32 = 0xf << NEGATIVE;

/// What is known when code is emitted.
#[derive(Clone, Copy)]
pub(super) struct Kept {
    /// What is in a value, a bit each.
    known: u32,
    /// What the core's memory does not hold yet.
    dirty: u32,
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
    pub node: Node,
    pub unit: Unit<'b, Block>,
    helpers: Helpers,
    helper: SigRef,
}

/// Fields of the core: whole, in this computer's order.
pub(super) fn fixed() -> MemFlagsData {
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
        let mut emitter = Self {
            f,
            kept: Kept {
                known: 0,
                dirty: 0,
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
            node: Node { block: 0, pipe: 0 },
            unit: Unit::new(blocks, mode),
            helpers,
            helper,
        };
        emitter.know_registers();
        emitter
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
            known: self.in_values(),
            dirty: 0,
            compared: None,
            outcomes: Some(1),
        };
        let none = self.f.ins().iconst(I64, 1);
        self.set(OUTCOMES, none);
        if self.mode == Mode::Apart {
            self.begin_apart();
        }
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
        // Both ways have the old values.
        let flags = if at.inst.s { FLAGS } else { 0 };
        self.know(u32::from(at.inst.defs().core_bits()) & REGISTERS | flags);
        let (met, join) = (self.f.create_block(), self.f.create_block());
        self.f.ins().brif(holds, met, &[], join, &[]);
        self.begin(met);
        let skipped = self.kept;
        if !self.native(at) {
            self.interpret(at.index, at.op, Some(at));
        }
        let mut met = skipped;
        if std::mem::replace(&mut self.goes_on, true) {
            self.flush(!skipped.known);
            self.know(skipped.dirty);
            self.f.ins().jump(join, &[]);
            met = self.kept;
        }
        self.kept = Kept {
            known: skipped.known & met.known,
            dirty: skipped.dirty | met.dirty,
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

    /// What is in values between blocks: for the only core, whose units are loops most often, the
    /// registers.
    fn in_values(&self) -> u32 {
        match self.mode {
            Mode::Alone => REGISTERS,
            Mode::Apart => 0,
        }
    }

    /// Reads what is to be in values between blocks.
    fn know_registers(&mut self) {
        self.know(self.in_values());
    }

    /// Reads what is not in values, of those.
    fn know(&mut self, slots: u32) {
        for slot in members(slots & !self.kept.known) {
            self.read(slot);
        }
    }

    /// What is kept.
    pub fn get(&mut self, slot: usize) -> Value {
        self.know(1 << slot);
        self.f.use_var(self.variables[slot])
    }

    /// Reads what the core's memory holds.
    fn read(&mut self, slot: usize) {
        let (offset, of) = place(slot);
        let value = self.f.ins().load(of, fixed(), self.cpu, offset);
        self.f.def_var(self.variables[slot], value);
        self.kept.known |= 1 << slot;
    }

    /// Changes what is written when the block is left.
    pub fn set(&mut self, slot: usize, value: Value) {
        self.f.def_var(self.variables[slot], value);
        self.kept.known |= 1 << slot;
        self.kept.dirty |= 1 << slot;
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
        self.kept.known |= 1 << slot;
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

    /// Writes what the core's memory does not hold yet, of those.
    fn flush(&mut self, slots: u32) {
        for slot in members(slots & self.kept.dirty) {
            let (offset, _) = place(slot);
            let value = self.f.use_var(self.variables[slot]);
            self.f.ins().store(fixed(), value, self.cpu, offset);
        }
        self.kept.dirty &= !slots;
    }

    /// Leaves the block towards an address, after so many instructions before the last one; nothing
    /// follows.
    pub fn leave_to(&mut self, flow: Flow, index: usize, target: Target) {
        self.goes_on = false;
        self.flush(FLAGS);
        let done = index + usize::from(flow == Flow::Branch);
        let known = match target {
            Target::Known(address) => Some(address),
            Target::Of(_) => None,
        };
        for way in self.unit.ways(self.node, done, self.kept.outcomes, known) {
            let Some(is_it) = self.is_way(&way, target) else {
                return self.go_to(&way, flow);
            };
            let (here, next) = (self.f.create_block(), self.f.create_block());
            self.f.ins().brif(is_it, here, &[], next, &[]);
            self.begin(here);
            self.go_to(&way, flow);
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
    fn go_to(&mut self, way: &Way, flow: Flow) {
        let left_at = offset_of!(Time, left) as i32;
        let left = self.f.ins().load(I64, fixed(), self.time, left_at);
        let room = match self.mode {
            Mode::Alone => None,
            Mode::Apart => Some(self.note_stretch(way, flow, left)),
        };
        let cycles = i64::from(way.link.known.cycles);
        let left = self.f.ins().iadd_imm_s(left, -cycles);
        self.f.ins().store(fixed(), left, self.time, left_at);
        let count_at = offset_of!(Time, instructions) as i32;
        let count = self.f.ins().load(I64, fixed(), self.time, count_at);
        let count = self.f.ins().iadd_imm_u(count, i64::from(way.link.done));
        self.f.ins().store(fixed(), count, self.time, count_at);
        let node = way.node();
        let f = &mut self.f;
        if let Some(block) = self.unit.node(node, || f.create_block()) {
            let kept = self.kept;
            self.know_registers();
            self.kept = kept;
            let needed = self.unit.blocks[node.block].cycles_max as i64;
            let cc = IntCC::SignedGreaterThanOrEqual;
            let mut fits = self.f.ins().icmp_imm_u(cc, left, needed);
            if let Some(room) = room {
                fits = self.f.ins().band(fits, room);
            }
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
        let kept = self.kept;
        self.flush(u32::MAX);
        self.kept = kept;
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
        self.flush(u32::MAX);
        let flow = self.call(index, op, at.is_some_and(|at| at.conditional));
        self.kept.known = 0;
        self.kept.compared = None;
        if at.is_none_or(|at| at.inst.class() == Class::Divide || at.inst.is_conditional()) {
            self.kept.outcomes = None;
        }
        if let Some(known) = self.kept.outcomes {
            let known = self.f.ins().iconst(I64, known as i64);
            self.set(OUTCOMES, known);
            self.kept.dirty &= !(1 << OUTCOMES);
        }
        self.go_on(index, flow);
    }

    /// A load or store by the interpreter, which neither reads nor changes flags.
    pub fn access(&mut self, at: &At) {
        let flow = self.call(at.index, at.op, at.conditional);
        self.go_on(at.index, flow);
        for register in members(u32::from(at.inst.defs().core_bits()) & REGISTERS) {
            self.read(register);
        }
    }

    /// What cannot be done in place, from `slow` on: the interpreter does it, and what it defines
    /// is read again. It neither reads nor changes flags. What was emitted up to now goes on behind
    /// it, too.
    pub fn or_interpret(&mut self, at: &At, slow: Block, before: Kept) {
        let goes_on = std::mem::replace(&mut self.goes_on, true);
        let fast = self.kept;
        let join = self.f.create_block();
        if goes_on {
            self.f.ins().jump(join, &[]);
        }
        self.f.set_cold_block(slow);
        self.begin(slow);
        self.kept = before;
        self.access(at);
        self.f.ins().jump(join, &[]);
        if goes_on {
            self.kept.known &= fast.known;
        }
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

/// The members of a set, lowest first.
pub(super) fn members(set: u32) -> impl Iterator<Item = usize> {
    (0..32).filter(move |slot| set >> slot & 1 != 0)
}
