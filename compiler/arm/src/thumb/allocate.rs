//! Register allocation by `regalloc2`: physical registers for virtual ones.
//!
//! ```text
//!   Func  --regalloc2-->  each operand's register, and moves, loads and stores between instructions  -->  Allocated
//! ```
//!
//! What is spilled lies on the stack at SP, below what the entry has saved. `regalloc2`'s own
//! checker, which follows values through the result, runs in debug builds.

use std::sync::OnceLock;

use super::func::{Allocated, Block, BlockId, Edge, Func, Terminator};
use super::minst::{self, Access, AliasClass, MInst, Reg, Role, template};
use super::registers::FREE;
use crate::features::Features;
use regalloc2::checker::Checker;
use regalloc2::{
    Allocation, Edit, Function, Inst as At, InstOrEdit, InstRange, MachineEnv, Operand,
    OperandConstraint, OperandKind, OperandPos, Output, PReg, PRegSet, RegClass, RegallocOptions,
    VReg,
};
use whippen_ids::Id;
use whippen_isa::reg::SP;
use whippen_isa::{Arch, Inst, Op};

/// Gives every virtual register a place.
///
/// # Errors
/// An instruction needs more registers than there are, or the checker objects: a bug.
pub(super) fn allocate(func: &Func, arch: Arch) -> Result<Allocated, String> {
    let view = View::new(func, arch);
    let env = machine_env(arch, func.free);
    let options = RegallocOptions {
        validate_ssa: cfg!(debug_assertions),
        ..RegallocOptions::default()
    };
    let output = regalloc2::run(&view, &env, &options).map_err(|error| error.to_string())?;
    if cfg!(debug_assertions) {
        check_allocation(&view, &env, &output)?;
    }
    let blocks = (func.blocks.ids())
        .map(|block| view.allocated_block(block, &output))
        .collect();
    Ok(Allocated {
        blocks,
        vregs: 0,
        free: func.free,
        slots: output.num_spillslots,
    })
}

/// Whether every operand finds its value.
fn check_allocation(view: &View, env: &MachineEnv, output: &Output) -> Result<(), String> {
    let mut checker = Checker::new(view, env);
    checker.prepare(output);
    checker
        .run()
        .map_err(|errors| format!("allocation is wrong: {errors:?}"))
}

/// Registers that may be given, the lower ones first; some cores can do little with the others.
fn machine_env(arch: Arch, free: u32) -> MachineEnv {
    let low = |reg: &u8| *reg < 8;
    let takes_high = Features::of(arch).high_registers;
    let usable = |reg: &&u8| free >> **reg & 1 != 0 && (low(reg) || takes_high);
    let set = |wanted: &dyn Fn(&u8) -> bool| {
        FREE.iter()
            .filter(usable)
            .filter(|reg| wanted(reg))
            .fold(PRegSet::empty(), |set, reg| set.with(preg(*reg)))
    };
    MachineEnv {
        preferred_regs_by_class: [set(&low), PRegSet::empty(), PRegSet::empty()],
        non_preferred_regs_by_class: [set(&|reg| !low(reg)), PRegSet::empty(), PRegSet::empty()],
        scratch_by_class: [None; 3],
        fixed_stack_slots: Vec::new(),
    }
}

fn preg(reg: u8) -> PReg {
    PReg::new(reg.into(), RegClass::Int)
}

fn vreg(reg: minst::VReg) -> VReg {
    VReg::new(reg.0 as usize, RegClass::Int)
}

/// A function as `regalloc2` sees it: one row of instructions, the last of each block its end.
struct View<'a> {
    func: &'a Func,
    arch: Arch,
    ranges: Vec<InstRange>,
    operands: Vec<Vec<Operand>>,
    clobbers: Vec<PRegSet>,
    succs: Vec<Vec<regalloc2::Block>>,
    preds: Vec<Vec<regalloc2::Block>>,
    params: Vec<Vec<VReg>>,
    args: Vec<Vec<VReg>>,
    ends: Vec<bool>,
    returns: Vec<bool>,
}

impl<'a> View<'a> {
    fn new(func: &'a Func, arch: Arch) -> View<'a> {
        let block = |block: &BlockId| regalloc2::Block::new(block.index());
        let succs: Vec<Vec<_>> = func
            .blocks
            .iter()
            .map(|b| b.end.targets().iter().map(block).collect())
            .collect();
        let mut view = View {
            func,
            arch,
            ranges: Vec::new(),
            operands: Vec::new(),
            clobbers: Vec::new(),
            preds: vec![Vec::new(); succs.len()],
            succs,
            params: func
                .blocks
                .iter()
                .map(|b| b.params.iter().map(|r| vreg(*r)).collect())
                .collect(),
            args: Vec::new(),
            ends: Vec::new(),
            returns: Vec::new(),
        };
        for (index, block) in func.blocks.iter().enumerate() {
            view.add_block(block);
            for target in block.end.targets() {
                view.preds[target.index()].push(regalloc2::Block::new(index));
            }
        }
        view
    }

    fn add_block(&mut self, block: &Block) {
        let first = self.operands.len();
        for code in &block.code {
            self.operands.push(operands_of(code));
            self.clobbers.push(clobbers_of(code));
            self.ends.push(false);
            self.returns.push(false);
        }
        self.operands.push(match &block.end {
            Terminator::NextKey(code) => {
                vec![use_in(*code, Features::of(self.arch).next_key_register)]
            }
            _ => Vec::new(),
        });
        self.clobbers.push(PRegSet::empty());
        let leaves = matches!(block.end, Terminator::NextKey(_) | Terminator::FallThrough);
        self.ends.push(!leaves);
        self.returns.push(leaves);
        self.args.push(match &block.end {
            Terminator::Jump(Edge { args, .. }) => args.iter().map(|r| vreg(*r)).collect(),
            _ => Vec::new(),
        });
        self.ranges
            .push(InstRange::new(At::new(first), At::new(self.operands.len())));
    }

    /// A block with the registers and moves that were found.
    fn allocated_block(&self, id: BlockId, output: &Output) -> Block<minst::PReg> {
        let block = &self.func.blocks[id];
        let first = self.ranges[id.index()].first().index();
        let mut code = Vec::new();
        for item in output.block_insts_and_edits(self, regalloc2::Block::new(id.index())) {
            match item {
                InstOrEdit::Edit(Edit::Move { from, to }) => code.push(move_inst(*from, *to)),
                InstOrEdit::Inst(at) if at.index() - first < block.code.len() => {
                    let source = &block.code[at.index() - first];
                    code.push(assign_registers(source, output.inst_allocs(at)));
                }
                InstOrEdit::Inst(_) => {}
            }
        }
        let end = match &block.end {
            Terminator::Jump(edge) => Terminator::Jump(Edge {
                block: edge.block,
                args: Vec::new(),
            }),
            Terminator::Branch {
                cond,
                yes,
                no,
                likely,
            } => Terminator::Branch {
                cond: *cond,
                yes: *yes,
                no: *no,
                likely: *likely,
            },
            Terminator::NextKey(_) => {
                Terminator::NextKey(minst::PReg(Features::of(self.arch).next_key_register))
            }
            Terminator::FallThrough => Terminator::FallThrough,
        };
        Block {
            params: Vec::new(),
            code: code
                .into_iter()
                .map(|inst: MInst<minst::PReg>| inst.shortened(self.arch))
                .collect(),
            end,
            rounds: block.rounds,
            cycles: OnceLock::new(),
        }
    }
}

/// What is read in a certain register.
fn use_in(of: minst::VReg, reg: u8) -> Operand {
    Operand::new(
        vreg(of),
        OperandConstraint::FixedReg(preg(reg)),
        OperandKind::Use,
        OperandPos::Early,
    )
}

/// What a routine does not keep.
fn clobbers_of(code: &MInst) -> PRegSet {
    let lost = code.convention().map_or(&[][..], |call| call.lost);
    lost.iter()
        .fold(PRegSet::empty(), |set, reg| set.with(preg(*reg)))
}

/// What is read first, in the order of roles, then what is written.
fn operands_of(code: &MInst) -> Vec<Operand> {
    let reads: Vec<(Role, minst::VReg)> = code
        .uses()
        .filter_map(|u| match (u.writes, u.operand.reg, u.operand.old) {
            (true, _, Some(old)) => Some((u.role, old)),
            (false, Reg::Virtual(reg), _) => Some((u.role, reg)),
            _ => None,
        })
        .collect();
    if code.convention().is_some() {
        // Operands in R0 and up, the result in R0.
        let result = code.writes().map(|reg| {
            let at = OperandConstraint::FixedReg(preg(0));
            Operand::new(vreg(reg), at, OperandKind::Def, OperandPos::Late)
        });
        return (0..)
            .zip(&reads)
            .map(|(at, (_, reg))| use_in(*reg, at))
            .chain(result)
            .collect();
    }
    let mut all: Vec<Operand> = reads
        .iter()
        .map(|(_, reg)| Operand::reg_use(vreg(*reg)))
        .collect();
    for u in code.uses().filter(|u| u.writes) {
        let Reg::Virtual(reg) = u.operand.reg else {
            continue;
        };
        let reused = reads
            .iter()
            .position(|(role, old)| *role == u.role && Some(*old) == u.operand.old);
        all.push(match reused {
            Some(at) => Operand::reg_reuse_def(vreg(reg), at),
            None => Operand::reg_def(vreg(reg)),
        });
    }
    all
}

/// The instruction with the registers that were found for its operands.
fn assign_registers(source: &MInst, allocs: &[Allocation]) -> MInst<minst::PReg> {
    let mut inst = source.inst;
    let is_call = source.convention().is_some();
    let register = |at: usize| {
        let reg = allocs.get(at).and_then(|alloc| alloc.as_reg());
        minst::PReg(reg.map_or(0, |reg| reg.hw_enc() as u8))
    };
    let mut operands = [None; 6];
    let mut read = 0;
    let mut written = source.reads().count();
    for u in source.uses() {
        let old = u.operand.old.filter(|_| u.writes);
        let at = if u.writes { &mut written } else { &mut read };
        let reg = match u.operand.reg {
            Reg::Fixed(reg) => minst::PReg(reg),
            Reg::Virtual(_) => {
                *at += 1;
                register(*at - 1)
            }
        };
        read += usize::from(old.is_some());
        operands[u.role as usize] = Some(minst::Operand {
            reg,
            old: old.map(|_| reg),
        });
        if !is_call {
            // A call has its registers by convention, and names none.
            *u.role.of(&mut inst) = reg.0;
        }
    }
    if let Some(role) = source.tied {
        *role.of(&mut inst) = inst.d;
    }
    MInst {
        inst,
        operands,
        access: source.access,
        address: source.address,
        tied: source.tied,
        origin: source.origin,
        inserted: false,
    }
}

/// A move between registers and the stack.
fn move_inst(from: Allocation, to: Allocation) -> MInst<minst::PReg> {
    let register = |a: Allocation| a.as_reg().map(|reg| reg.hw_enc() as u8);
    let slot = |a: Allocation| a.as_stack().map_or(0, |slot| 4 * slot.index() as u32);
    let stack = |op, t, imm| Inst {
        t,
        n: SP,
        imm,
        ..template(op)
    };
    match (register(from), register(to)) {
        (Some(from), Some(to)) => {
            let inst = Inst {
                d: to,
                m: from,
                ..template(Op::MOV_register)
            };
            MInst::inserted(inst, Access::None)
        }
        (Some(from), None) => {
            let access = Access::Write(AliasClass::Slot(slot(to)));
            MInst::inserted(stack(Op::STR_immediate, from, slot(to)), access)
        }
        (None, to) => {
            let access = Access::Read(AliasClass::Slot(slot(from)));
            MInst::inserted(
                stack(Op::LDR_immediate, to.unwrap_or(0), slot(from)),
                access,
            )
        }
    }
}

impl Function for View<'_> {
    fn num_insts(&self) -> usize {
        self.operands.len()
    }

    fn num_blocks(&self) -> usize {
        self.func.blocks.len()
    }

    fn entry_block(&self) -> regalloc2::Block {
        regalloc2::Block::new(0)
    }

    fn block_insns(&self, block: regalloc2::Block) -> InstRange {
        self.ranges[block.index()]
    }

    fn block_succs(&self, block: regalloc2::Block) -> &[regalloc2::Block] {
        &self.succs[block.index()]
    }

    fn block_preds(&self, block: regalloc2::Block) -> &[regalloc2::Block] {
        &self.preds[block.index()]
    }

    fn block_params(&self, block: regalloc2::Block) -> &[VReg] {
        &self.params[block.index()]
    }

    fn is_ret(&self, at: At) -> bool {
        self.returns[at.index()]
    }

    fn is_branch(&self, at: At) -> bool {
        self.ends[at.index()]
    }

    fn branch_blockparams(&self, block: regalloc2::Block, _: At, _: usize) -> &[VReg] {
        &self.args[block.index()]
    }

    fn inst_operands(&self, at: At) -> &[Operand] {
        &self.operands[at.index()]
    }

    fn inst_clobbers(&self, at: At) -> PRegSet {
        self.clobbers[at.index()]
    }

    fn num_vregs(&self) -> usize {
        self.func.vregs as usize
    }

    fn spillslot_size(&self, _: RegClass) -> usize {
        1
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A loop whose blocks are numbered against their order: sums what it reads until that is 0.
    fn summing() -> Func {
        let mut func = Func::new();
        let [entry, after, again, head] = [(); 4].map(|()| func.block());
        let [start, kept, sum, read, next] = [(); 5].map(|()| func.fresh());
        let load = |to| {
            MInst::new(Op::LDR_immediate)
                .reg(Role::T, to)
                .with(Role::N, Reg::Fixed(6))
                .access(Access::None)
        };
        func.blocks[entry].code = vec![load(start), load(kept)];
        func.blocks[entry].end = Terminator::Jump(Edge {
            block: head,
            args: vec![start],
        });
        func.blocks[head].params = vec![sum];
        let add = MInst::new(Op::ADD_register)
            .reg(Role::N, sum)
            .reg(Role::M, read)
            .reg(Role::D, next)
            .flags();
        func.blocks[head].code = vec![load(read), add];
        func.blocks[head].end = Terminator::Branch {
            cond: whippen_isa::Cond::NE,
            yes: again,
            no: after,
            likely: None,
        };
        func.blocks[again].end = Terminator::Jump(Edge {
            block: head,
            args: vec![next],
        });
        func.blocks[after].end = Terminator::NextKey(kept);
        func.into_reverse_postorder()
    }

    #[test]
    fn the_checker_takes_what_is_right_and_nothing_else() {
        let func = summing();
        let (view, env) = (
            View::new(&func, Arch::V8M),
            machine_env(Arch::V8M, func.free),
        );
        let mut output =
            regalloc2::run(&view, &env, &RegallocOptions::default()).expect("there are registers");
        assert_eq!(check_allocation(&view, &env, &output), Ok(()));
        let (found, mut refused) = (output.allocs.clone(), 0);
        for (at, right) in found.iter().enumerate() {
            for reg in FREE
                .into_iter()
                .filter(|reg| right.as_reg() != Some(preg(*reg)))
            {
                output.allocs[at] = Allocation::reg(preg(reg));
                refused += usize::from(check_allocation(&view, &env, &output).is_err());
            }
            output.allocs[at] = *right;
        }
        // Any other register is wrong for what is read, and for what is read later.
        assert_eq!(refused, found.len() * (FREE.len() - 1));
    }
}
