//! Where a block is left: to the block that follows, where it is known, or out of the code.

use super::RunMode;
use super::emitter::Emitter;
use super::kept::{FLAGS, OUTCOMES, fixed};
use super::unit::{Exit, Node, Time, Way};
use crate::cpu::Cpu;
use crate::op::Flow;
use cranelift_codegen::ir::condcodes::IntCC;
use cranelift_codegen::ir::types::I64;
use cranelift_codegen::ir::{InstBuilder, Value};
use std::mem::offset_of;

/// Where a block is left to.
#[derive(Clone, Copy)]
pub(super) enum Target {
    /// An address.
    Known(u32),
    /// One that is computed.
    Of(Value),
}

impl Emitter<'_, '_> {
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
            RunMode::Alone => None,
            RunMode::Apart => Some(self.note_stretch(way, flow, left)),
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
        let ended = Exit {
            block,
            pipe,
            flow: None,
            done: 0,
        };
        let ended = self.f.ins().iconst(I64, ended.word());
        self.leave(ended);
    }

    pub fn ended(&self, flow: Option<Flow>, done: usize) -> Exit {
        let Node { block, pipe } = self.node;
        Exit {
            block,
            pipe,
            flow,
            done,
        }
    }

    /// Leaves the code.
    pub fn leave(&mut self, ended: Value) {
        let kept = self.kept;
        self.flush(u32::MAX);
        self.kept = kept;
        if self.mode == RunMode::Apart {
            self.write_ports();
        }
        self.f.ins().return_(&[ended]);
    }
}
