//! Translation of what is kept from one tick to the next, for one key.

use super::Translator;
use crate::loop_context::Buffer;
use crate::memo::{Memo, Plan, Step};
use crate::zero::reads;
use cranelift_codegen::ir::InstBuilder;
use cranelift_codegen::ir::types::{I8, I64};
use cranelift_codegen::ir::{Block, Value};
use whippen_kernel::{Inst, Region, Type, Walk};

impl Translator<'_> {
    /// Translates a tick by a plan.
    pub(super) fn planned(&mut self, region: &Region, plan: &Plan) {
        for step in &plan.front {
            match step {
                Step::Inst(place) => {
                    self.read_kept(&region.insts[*place]);
                    self.inst(&region.insts[*place]);
                }
                Step::Memo(memo) => self.memo(region, memo),
            }
        }
        self.region(&plan.rest);
    }

    /// Computes the results of a memo and keeps them, where a source has changed.
    fn memo(&mut self, region: &Region, memo: &Memo) {
        let [changed, after] = [(); 2].map(|()| self.f.create_block());
        let sources: Vec<Value> = memo.sources.iter().map(|it| self.wide(*it)).collect();
        self.compare(&sources, memo.first_word, changed, after);
        self.f.switch_to_block(changed);
        self.f.set_cold_block(changed);
        let unread = self.unread.clone();
        for place in &memo.members {
            self.read_kept(&region.insts[*place]);
            self.inst(&region.insts[*place]);
        }
        self.unread = unread;
        let results: Vec<Value> = memo.results.iter().map(|it| self.wide(*it)).collect();
        for (word, value) in (memo.first_word..).zip(sources.iter().chain(&results)) {
            let kept = self.base(Buffer::Kept);
            let access = self.access.kept;
            self.f.ins().store(access, *value, kept, 8 * word as i32);
        }
        self.f.ins().jump(after, &[]);
        self.f.switch_to_block(after);
        let first = memo.first_word + memo.sources.len();
        self.unread
            .extend(memo.results.iter().copied().zip(first..));
    }

    /// Goes on after a memo where its sources are what is kept.
    fn compare(&mut self, sources: &[Value], first_word: usize, changed: Block, after: Block) {
        let mut any = self.f.ins().iconst(I64, 0);
        for (word, value) in (first_word..).zip(sources) {
            let kept = self.kept(word);
            let differs = self.f.ins().bxor(kept, *value);
            any = self.f.ins().bor(any, differs);
        }
        self.f.ins().brif(any, changed, &[], after, &[]);
    }

    /// Loads what an instruction, or one inside it, reads first of what is kept.
    pub(super) fn read_kept(&mut self, inst: &Inst) {
        for value in reads(inst) {
            let Some(word) = self.unread.remove(&value) else {
                continue;
            };
            let loaded = self.kept(word);
            self.values[value] = match self.ty(value) {
                Type::I1 => self.f.ins().ireduce(I8, loaded),
                Type::I32 | Type::I64 => loaded,
            };
        }
    }

    fn kept(&mut self, word: usize) -> Value {
        let kept = self.base(Buffer::Kept);
        let access = self.access.kept;
        self.f.ins().load(I64, access, kept, 8 * word as i32)
    }

    /// A value as a word that is kept.
    fn wide(&mut self, value: whippen_kernel::Value) -> Value {
        match self.ty(value) {
            Type::I1 => {
                let value = self.value(value);
                self.f.ins().uextend(I64, value)
            }
            Type::I32 | Type::I64 => self.value(value),
        }
    }
}
