//! Emits a block: where registers, flags and outcomes are while its code runs, how the interpreter
//! is called for an instruction, and how the code is left.

use super::RunMode;
use super::host::{Helpers, signature};
use super::kept::{FLAGS, KEPT, Kept, OUTCOMES, REGISTERS, fixed, members, place};
use super::leave::Target;
use super::unit::{Node, Unit};
use crate::block::{Block as Decoded, Info};
use crate::bus::Bus;
use crate::cpu::Cpu;
use crate::op::{Flow, Op};
use cranelift_codegen::ir::condcodes::IntCC;
use cranelift_codegen::ir::types::{I8, I32, I64};
use cranelift_codegen::ir::{Block, InstBuilder, SigRef, Signature, Value};
use cranelift_codegen::isa::TargetFrontendConfig;
use cranelift_frontend::{FunctionBuilder, Variable};
use std::mem::offset_of;
use whippen_isa::{Class, Inst, Op as I};

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
    pub mode: RunMode,
    pub cpu: Value,
    pub bus: Value,
    pub reads: Value,
    pub writes: Value,
    pub pages: Value,
    pub time: Value,
    pub variables: [Variable; KEPT],
    /// The ports that a core that runs apart has used.
    pub ports: Variable,
    pub node: Node,
    pub unit: Unit<'b, Block>,
    helpers: Helpers,
    helper: SigRef,
}

impl<'f, 'b> Emitter<'f, 'b> {
    pub fn new(
        mut f: FunctionBuilder<'f>,
        helpers: Helpers,
        mode: RunMode,
        blocks: &'b [Decoded],
    ) -> Self {
        let entry = f.create_block();
        f.append_block_params_for_function_params(entry);
        f.switch_to_block(entry);
        f.seal_block(entry);
        let parameters: Vec<Value> = f.block_params(entry).to_vec();
        let variables = std::array::from_fn(|slot| f.declare_var(place(slot).1));
        let ports = f.declare_var(I32);
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
            ports,
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
        if self.mode == RunMode::Apart {
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

    /// Calls the interpreter for an instruction: its flow.
    fn call(&mut self, index: usize, op: &Op, body: bool) -> Value {
        if self.mode == RunMode::Apart {
            let offset = offset_of!(Bus, trail) + crate::apart::Trail::OP;
            let number = self.f.ins().iconst(I8, index as i64);
            self.f.ins().store(fixed(), number, self.bus, offset as i32);
            self.write_ports();
        }
        let helper = match body {
            false => self.helpers.run,
            true => self.helpers.body,
        };
        let helper = self.f.ins().iconst(I64, helper);
        let op = self.f.ins().iconst(I64, op as *const Op as i64);
        let called = [self.cpu, self.bus, op];
        let call = self.f.ins().call_indirect(self.helper, helper, &called);
        if self.mode == RunMode::Apart {
            self.read_ports();
        }
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
