//! Instructions of one key in Cranelift's form. An `i1` is an `I8` of 0 or 1; every other value is
//! an `I64`.

mod arithmetic;
mod kept;
mod memory;
mod operator;

use super::loop_context::{Access, LoopContext};
use super::memo::Plan;
use super::zero::{self, Branch, WhereZero};
use cranelift_codegen::ir::condcodes::IntCC;
use cranelift_codegen::ir::types::{I8, I64};
use cranelift_codegen::ir::{self, BlockArg, InstBuilder, Value};
use cranelift_frontend::FunctionBuilder;
use std::collections::{BTreeMap, HashMap};
use whippen_ids::IdMap;
use whippen_kernel::layout::Layout;
use whippen_kernel::{Inst, Kernel, Op, Region, Type, Walk};

/// Translates one region into one function.
pub(super) struct Translator<'a> {
    pub kernel: &'a Kernel,
    pub layout: &'a Layout,
    pub f: FunctionBuilder<'a>,
    pub access: Access,
    pub context: LoopContext,
    /// Values of the kernel that are translated.
    values: IdMap<whippen_kernel::Value, Value>,
    /// The words, in the buffer of those that are kept, of values that no instruction has read yet.
    unread: BTreeMap<whippen_kernel::Value, usize>,
    /// Whether anything is `assume`d, so that what could do harm must be looked at again.
    pub assumes: bool,
}

/// How a value of this type is held in a register.
fn register(ty: Type) -> ir::Type {
    match ty {
        Type::I1 => I8,
        Type::I32 | Type::I64 => I64,
    }
}

impl<'a> Translator<'a> {
    /// A translator into an empty function.
    pub fn new(
        kernel: &'a Kernel,
        layout: &'a Layout,
        mut f: FunctionBuilder<'a>,
    ) -> Translator<'a> {
        let none = Value::from_u32(0);
        let bases = [none; super::loop_context::BUFFERS];
        let loop_context = LoopContext {
            base_table: none,
            bases,
            rows: HashMap::new(),
            key: none,
            words: [none; 2],
        };
        let access = Access::new(&mut f);
        Translator {
            kernel,
            layout,
            f,
            access,
            context: loop_context,
            values: IdMap::filled(none, kernel.values.len()),
            unread: BTreeMap::new(),
            assumes: kernel.assumes(),
        }
    }

    /// Translates a region, run for one key after the other, as a whole function; by a plan where
    /// there is one.
    pub fn function(mut self, region: &Region, plan: Option<&Plan>) -> FunctionBuilder<'a> {
        let keys = self.open_keys(region);
        match plan {
            Some(plan) => self.planned(region, plan),
            None => self.region(region),
        }
        self.close_keys(keys, 1);
        self.f
    }

    /// Translates the instructions of a branch for a factor of 0, and as they are.
    fn branch(&mut self, region: &Region, branch: &Branch) {
        for place in &branch.members {
            self.read_kept(&region.insts[*place]);
        }
        let [nothing, other, after] = [(); 3].map(|()| self.f.create_block());
        let factor = self.value(branch.factor);
        self.f.ins().brif(factor, other, &[], nothing, &[]);
        self.f.switch_to_block(nothing);
        self.values[branch.factor] = self.constant(self.ty(branch.factor), 0);
        for one in &branch.where_zero {
            match *one {
                WhereZero::Same(place) => self.inst(&region.insts[place]),
                WhereZero::Zero(value) => self.values[value] = self.constant(self.ty(value), 0),
                WhereZero::Copy(value, other) => self.values[value] = self.value(other),
            }
        }
        let results = self.block_args(&branch.results);
        self.f.ins().jump(after, &results);
        self.f.switch_to_block(other);
        self.values[branch.factor] = factor;
        for place in &branch.members {
            self.inst(&region.insts[*place]);
        }
        let results = self.block_args(&branch.results);
        self.f.ins().jump(after, &results);
        self.f.switch_to_block(after);
        for result in &branch.results {
            self.values[result] = self.f.append_block_param(after, register(self.ty(*result)));
        }
    }

    /// The results of an instruction become parameters of the block after it.
    fn results(&mut self, inst: &Inst, after: ir::Block) {
        for result in &inst.results {
            self.values[result] = self.f.append_block_param(after, register(self.ty(*result)));
        }
    }

    fn block_args(&self, values: &[whippen_kernel::Value]) -> Vec<BlockArg> {
        values
            .iter()
            .map(|value| BlockArg::Value(self.value(*value)))
            .collect()
    }

    fn value(&self, value: whippen_kernel::Value) -> Value {
        self.values[value]
    }

    /// Type of a value of the kernel.
    pub fn ty(&self, value: whippen_kernel::Value) -> Type {
        self.kernel.values[value].ty
    }
}

impl Walk for Translator<'_> {
    fn if_else(&mut self, inst: &Inst, then: &Region, other: &Region) {
        let [first, second, after] = [(); 3].map(|()| self.f.create_block());
        let condition = self.value(inst.args[0]);
        self.f.ins().brif(condition, first, &[], second, &[]);
        self.results(inst, after);
        for (block, region) in [(first, then), (second, other)] {
            self.f.switch_to_block(block);
            // An event is rare, and code that is rare stays out of the way of the rest.
            if region
                .insts
                .iter()
                .any(|inst| matches!(inst.op, Op::Emit(_)))
            {
                self.f.set_cold_block(block);
            }
            self.region(region);
            let yields = self.block_args(&region.yields);
            self.f.ins().jump(after, &yields);
        }
        self.f.switch_to_block(after);
    }

    fn repeat(&mut self, inst: &Inst, rounds: u32, body: &Region) {
        let [head, after] = [(); 2].map(|()| self.f.create_block());
        self.results(inst, after);
        let zero = self.f.ins().iconst(I64, 0);
        let starts: Vec<BlockArg> = std::iter::once(BlockArg::Value(zero))
            .chain(self.block_args(&inst.args))
            .collect();
        self.f.ins().jump(head, &starts);
        for param in &body.params {
            self.values[param] = self.f.append_block_param(head, register(self.ty(*param)));
        }
        self.f.switch_to_block(head);
        self.region(body);
        let round = self.value(body.params[0]);
        let next = self.f.ins().iadd_imm_s(round, 1);
        let more = self
            .f
            .ins()
            .icmp_imm_s(IntCC::SignedLessThan, next, i64::from(rounds));
        let yields = self.block_args(&body.yields);
        let again: Vec<BlockArg> = std::iter::once(BlockArg::Value(next))
            .chain(yields.iter().copied())
            .collect();
        self.f.ins().brif(more, head, &again, after, &yields);
        self.f.switch_to_block(after);
    }

    fn plain(&mut self, inst: &Inst) {
        self.operator(inst);
    }

    fn region(&mut self, region: &Region) {
        let branches = zero::branches(self.kernel, region);
        for place in 0..=region.insts.len() {
            for branch in branches.iter().filter(|branch| branch.before == place) {
                self.branch(region, branch);
            }
            let is_member = |branch: &Branch| branch.members.contains(&place);
            if let Some(inst) = region.insts.get(place)
                && !branches.iter().any(is_member)
            {
                self.read_kept(inst);
                self.inst(inst);
            }
        }
    }
}
