//! Emits a block: where registers, flags and outcomes are while its code runs, how the interpreter
//! is called for an instruction, and how the code is left.

use super::Mode;
use super::host::{Helpers, signature};
use crate::block::Info;
use crate::bus::Bus;
use crate::cpu::Cpu;
use crate::op::{Flow, Op};
use cranelift_codegen::ir::condcodes::IntCC;
use cranelift_codegen::ir::types::{I8, I32, I64};
use cranelift_codegen::ir::{Block, InstBuilder, MemFlagsData, SigRef, Signature, Type, Value};
use cranelift_codegen::isa::TargetFrontendConfig;
use cranelift_frontend::{FunctionBuilder, Variable};
use std::mem::offset_of;
use whippen_isa::{Inst, Op as I};

/// What is kept in values: registers by number, then these.
pub(super) const NEGATIVE: usize = 16;
pub(super) const ZERO: usize = 17;
pub(super) const CARRY: usize = 18;
pub(super) const OVERFLOW: usize = 19;
pub(super) const OUTCOMES: usize = 20;
const KEPT: usize = 21;

/// What translated code knows of the core at some instruction.
#[derive(Clone, Copy)]
pub(super) struct Kept {
    /// What is in a value, a bit each.
    pub known: u32,
    /// What the core's memory does not hold yet.
    pub dirty: u32,
    /// All flags are those of this difference.
    pub compared: Option<(Value, Value)>,
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
pub(super) struct Emitter<'f> {
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
    variables: [Variable; KEPT],
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

impl<'f> Emitter<'f> {
    pub fn new(mut f: FunctionBuilder<'f>, helpers: Helpers, mode: Mode) -> Self {
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
            },
            goes_on: true,
            mode,
            cpu: parameters[0],
            bus: parameters[1],
            reads: parameters[2],
            writes: parameters[3],
            pages: parameters[4],
            variables,
            helpers,
            helper,
        };
        let none = emitter.f.ins().iconst(I64, 1);
        emitter.set(OUTCOMES, none);
        emitter
    }

    /// Emits all instructions of a block.
    pub fn block(mut self, ops: &[Op], infos: &[Info], config: TargetFrontendConfig) {
        for (index, (op, info)) in ops.iter().zip(infos).enumerate() {
            let Ok((inst, _)) = &info.inst else {
                self.interpret(index, op, false);
                continue;
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
                self.interpret(index, op, false);
            }
            if !self.goes_on {
                break;
            }
        }
        if self.goes_on {
            self.leave_with(Flow::Next, ops.len());
        }
        self.f.seal_all_blocks();
        self.f.finalize(config);
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
            return self.interpret(at.index, at.op, false);
        };
        let holds = self.holds(cond);
        self.remember(holds);
        if at.inst.s {
            for slot in NEGATIVE..=OVERFLOW {
                self.get(slot);
            }
        }
        // Both ways have the old values.
        for register in registers(at.inst.defs().core_bits() & 0x7fff) {
            self.get(register);
        }
        let (met, join) = (self.f.create_block(), self.f.create_block());
        self.f.ins().brif(holds, met, &[], join, &[]);
        self.begin(met);
        let skipped = self.kept;
        if !self.native(at) {
            self.interpret(at.index, at.op, true);
        }
        if std::mem::replace(&mut self.goes_on, true) {
            self.flush(self.kept.dirty & !skipped.known);
            for slot in registers32(skipped.dirty & !self.kept.known) {
                self.get(slot);
            }
            self.f.ins().jump(join, &[]);
            self.kept.known &= skipped.known;
            self.kept.dirty |= skipped.dirty;
        } else {
            self.kept = skipped;
        }
        self.kept.compared = None;
        self.begin(join);
    }

    /// Continues in a block to which nothing leads that is not there yet.
    pub fn begin(&mut self, block: Block) {
        self.f.switch_to_block(block);
        self.f.seal_block(block);
    }

    /// What is kept, read if need be.
    pub fn get(&mut self, slot: usize) -> Value {
        if self.kept.known >> slot & 1 == 0 {
            self.read(slot);
        }
        self.f.use_var(self.variables[slot])
    }

    /// Reads what the core's memory holds.
    pub fn read(&mut self, slot: usize) {
        let (offset, of) = place(slot);
        let value = self.f.ins().load(of, fixed(), self.cpu, offset);
        self.f.def_var(self.variables[slot], value);
        self.kept.known |= 1 << slot;
    }

    /// Changes what is written when the code is left.
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
        let outcomes = self.get(OUTCOMES);
        let moved = self.f.ins().ishl_imm_u(outcomes, 1);
        let bit = self.f.ins().uextend(I64, passed);
        let outcomes = self.f.ins().bor(moved, bit);
        self.set(OUTCOMES, outcomes);
    }

    /// Writes what the core's memory does not hold yet, of those.
    fn flush(&mut self, slots: u32) {
        for slot in registers32(slots & self.kept.dirty) {
            let (offset, _) = place(slot);
            let value = self.f.use_var(self.variables[slot]);
            self.f.ins().store(fixed(), value, self.cpu, offset);
        }
        self.kept.dirty &= !slots;
    }

    /// Leaves the code; nothing follows.
    pub fn leave_with(&mut self, flow: Flow, index: usize) {
        self.goes_on = false;
        let ended = (index as i64) << 8 | flow as i64;
        let ended = self.f.ins().iconst(I64, ended);
        self.leave(ended);
    }

    /// Leaves the code with a flow of the interpreter's and the instruction's number.
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
        let ended = self.f.ins().bor_imm_u(flow, (index as i64) << 8);
        self.leave(ended);
        self.begin(next);
    }

    /// An instruction by the interpreter, which may read and change everything.
    pub fn interpret(&mut self, index: usize, op: &Op, body: bool) {
        self.flush(u32::MAX);
        let flow = self.call(index, op, body);
        self.kept = Kept {
            known: 0,
            dirty: 0,
            compared: None,
        };
        self.go_on(index, flow);
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
        let flow = self.call(at.index, at.op, at.conditional);
        self.go_on(at.index, flow);
        for register in registers(at.inst.defs().core_bits() & 0x7fff) {
            self.read(register);
        }
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
        let ended = self.f.ins().bor_imm_u(flow, (at.index as i64) << 8);
        self.leave(ended);
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
