//! `if`, `loop`, blocks of modes, and the way to the next key.

use super::memory::MODE;
use super::{Binding, Select};
use crate::thumb::func::{BlockId, Edge, Terminator};
use crate::thumb::minst::{Access, MInst, Role, VReg};
use crate::thumb::registers::{HISTORY, RECORD};
use whippen_ids::IdMap;
use whippen_isa::{Cond, Op as Isa};
use whippen_kernel::{Inst, Region, Type, Value, Walk};
use whippen_modes::{End as ModeEnd, Mode, ModeId, Target};

/// Slots of a line that a round fills, at most.
const FILLED: u32 = 8;
/// How far a store reaches.
const OFFSET_MAX: u32 = 4095;

/// The first block of machine code of each block of a mode.
type Heads = IdMap<whippen_modes::BlockId, BlockId>;

impl Walk for Select<'_> {
    fn plain(&mut self, inst: &Inst) {
        self.select_inst(inst);
    }

    fn if_else(&mut self, inst: &Inst, first: &Region, second: &Region) {
        let (then, other, after) = (self.func.block(), self.func.block(), self.func.block());
        let rare = second.insts.is_empty() && !first.insts.is_empty();
        self.branch(inst.args[0], then, other, rare.then_some(false));
        for (block, region) in [(then, first), (other, second)] {
            self.at = block;
            self.select_insts(&region.insts);
            let args = self.words_of(&region.yields);
            self.jump(after, args);
        }
        self.at = after;
        self.func.blocks[after].params = self.params(&inst.results);
    }

    fn repeat(&mut self, inst: &Inst, rounds: u32, region: &Region) {
        let mut starts = vec![self.load_constant(0)];
        starts.extend(self.words_of(&inst.args));
        let (head, again, after) = (self.func.block(), self.func.block(), self.func.block());
        self.jump(head, starts);
        self.at = head;
        let params = self.params(&region.params);
        let index = params[0];
        self.func.blocks[head].params = params;
        self.func.blocks[head].rounds = Some(rounds);
        self.last_event = None;
        self.select_insts(&region.insts);
        self.last_event = None;
        let yields = self.words_of(&region.yields);
        let next = self.add_constant(index, 1);
        let end = self.load_constant(rounds as i32);
        self.emit(
            MInst::new(Isa::CMP_register)
                .reg(Role::N, next)
                .reg(Role::M, end),
        );
        self.func.blocks[self.at].end = Terminator::Branch {
            cond: Cond::LT,
            yes: again,
            no: after,
            likely: Some(true),
        };
        self.at = again;
        self.jump(
            head,
            std::iter::once(next)
                .chain(yields.iter().copied())
                .collect(),
        );
        self.at = after;
        let mut words = yields.into_iter();
        for result in &inst.results {
            let (low, wide) = (
                words.next().unwrap_or(VReg(0)),
                self.info(*result).ty == Type::I64,
            );
            let bound = if wide {
                Binding::Pair(low, words.next().unwrap_or(VReg(0)))
            } else {
                Binding::Word(low)
            };
            self.bind(*result, bound);
        }
    }
}

impl Select<'_> {
    /// All blocks of a mode, each with those that its instructions make.
    pub(super) fn select_blocks(&mut self, mode: &Mode) {
        let heads: Heads = mode.blocks.iter().map(|_| self.func.block()).collect();
        for (index, block) in mode.blocks.enumerated() {
            self.at = heads[index];
            if index == whippen_modes::BlockId(0) {
                self.load_input();
            }
            let params = self.params(&block.params);
            self.func.blocks[heads[index]].params = params;
            self.select_insts(&block.insts);
            match &block.end {
                ModeEnd::Branch {
                    condition,
                    yes,
                    no,
                    likely,
                } => {
                    let (yes, no) = (self.edge_block(yes, &heads), self.edge_block(no, &heads));
                    self.branch(*condition, yes, no, *likely);
                }
                ModeEnd::Jump(target) => {
                    let args = self.words_of(&target.args);
                    self.jump(heads[target.block], args);
                }
                ModeEnd::Next(next) => self.next_key(*next),
            }
        }
    }

    /// Fresh registers for values, which are bound to them.
    fn params(&mut self, values: &[Value]) -> Vec<VReg> {
        let mut all = Vec::new();
        for value in values {
            let low = self.func.fresh();
            all.push(low);
            let bound = if self.info(*value).ty == Type::I64 {
                let high = self.func.fresh();
                all.push(high);
                Binding::Pair(low, high)
            } else {
                Binding::Word(low)
            };
            self.bind(*value, bound);
        }
        all
    }

    /// The registers of values.
    fn words_of(&mut self, values: &[Value]) -> Vec<VReg> {
        let mut all = Vec::new();
        for value in values {
            if self.info(*value).ty == Type::I64 {
                let (low, high) = self.pair(*value);
                all.extend([low, high]);
            } else {
                all.push(self.reg(*value));
            }
        }
        all
    }

    /// A block of its own that hands a target its values; empty where there is nothing to hand
    /// over.
    fn edge_block(&mut self, target: &Target, heads: &Heads) -> BlockId {
        let (here, edge) = (self.at, self.func.block());
        self.at = edge;
        let args = self.words_of(&target.args);
        self.jump(heads[target.block], args);
        self.at = here;
        edge
    }

    fn jump(&mut self, block: BlockId, args: Vec<VReg>) {
        self.func.blocks[self.at].end = Terminator::Jump(Edge { block, args });
    }

    fn branch(&mut self, condition: Value, yes: BlockId, no: BlockId, likely: Option<bool>) {
        if let Some(known) = self.constant(condition) {
            return self.jump(if known == 0 { no } else { yes }, Vec::new());
        }
        let cond = self.condition(condition);
        self.func.blocks[self.at].end = Terminator::Branch {
            cond,
            yes,
            no,
            likely,
        };
    }

    /// The mode of the next tick, then the next key's code.
    fn next_key(&mut self, next: ModeId) {
        if self.own_mode != Some(next) {
            self.change_mode(next);
        }
        if !self.push_walks {
            self.advance_history();
        }
        let record = self.layout.record;
        let code = self.func.fresh();
        let load = MInst::new(Isa::LDR_immediate)
            .reg(Role::T, code)
            .with(Role::N, Self::fixed(RECORD));
        let mut load = load.access(Access::Read(MODE));
        if record < 256 {
            load.inst.wback = true;
            load = load.imm(record);
        } else {
            self.advance(RECORD, record);
        }
        self.emit(load);
        self.func.blocks[self.at].end = Terminator::NextKey(code);
    }

    pub(super) fn init_done(&mut self) {
        self.change_mode(ModeId(0));
        self.advance_history();
        self.advance(RECORD, self.layout.record);
        self.func.blocks[self.at].end = Terminator::FallThrough;
    }

    fn advance_history(&mut self) {
        if let Some(first) = self.layout.first_line {
            self.advance(HISTORY, 1 << self.layout.lines[first as usize].log2());
        }
    }

    /// A fixed register goes on by so many bytes.
    fn advance(&mut self, reg: u8, bytes: u32) {
        let fixed = Self::fixed(reg);
        let code = if bytes < 4096 {
            MInst::new(Isa::ADD_immediate).imm(bytes)
        } else {
            let bytes = self.load_constant(bytes as i32);
            MInst::new(Isa::ADD_register).reg(Role::M, bytes)
        };
        self.emit(code.with(Role::N, fixed).with(Role::D, fixed));
    }

    /// A line full of one value: a loop over its slots, some in each round. A program that begins
    /// waits for it in a tick.
    pub(super) fn fill_line(&mut self, line: u32, value: Value) {
        let word = self.reg(value);
        let place = self.layout.lines[line as usize].clone();
        let mut start = self.first_slot_address(line);
        let slots = FILLED
            .min(1 + OFFSET_MAX / place.row.max(1))
            .min(place.len.max(1));
        let (rounds, over) = (place.len / slots, place.len % slots);
        if over != 0 {
            self.store_slots(line, word, start, over);
            start = self.add_constant(start, (over * place.row).into());
        }
        let count = self.load_constant(rounds as i32);
        let bytes = self.load_constant((slots * place.row) as i32);
        let (at, left) = (self.func.fresh(), self.func.fresh());
        let (head, again, after) = (self.func.block(), self.func.block(), self.func.block());
        self.jump(head, vec![start, count]);
        self.func.blocks[head].params = vec![at, left];
        self.func.blocks[head].rounds = Some(rounds);
        self.at = head;
        self.store_slots(line, word, at, slots);
        let next = self.emit_rrr(Isa::ADD_register, at, bytes);
        let less = self.result(
            MInst::new(Isa::SUB_immediate)
                .reg(Role::N, left)
                .imm(1)
                .flags(),
        );
        self.func.blocks[head].end = Terminator::Branch {
            cond: Cond::NE,
            yes: again,
            no: after,
            likely: Some(true),
        };
        self.at = again;
        self.jump(head, vec![next, less]);
        self.at = after;
    }

    /// So many slots of a line, from an address on.
    fn store_slots(&mut self, line: u32, word: VReg, at: VReg, slots: u32) {
        let place = &self.layout.lines[line as usize];
        let (op, row) = (
            if place.narrow {
                Isa::STRH_immediate
            } else {
                Isa::STR_immediate
            },
            place.row,
        );
        for slot in 0..slots {
            let store = MInst::new(op)
                .reg(Role::N, at)
                .reg(Role::T, word)
                .imm(slot * row);
            self.emit(store.access(Access::Write(crate::thumb::minst::AliasClass::Line(line))));
        }
    }
}
