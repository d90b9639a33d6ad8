//! What the checker tells apart: a function made by hand, and errors put into those of random
//! kernels.

use std::sync::OnceLock;

use super::*;
use crate::features::Features;
use crate::image::timing;
use crate::thumb::Options;
use crate::thumb::allocate::allocate;
use crate::thumb::func::{Allocated, Block, Edge};
use crate::thumb::hoist::hoist_over_branches;
use crate::thumb::literal::Literals;
use crate::thumb::liveness::compute_live_in;
use crate::thumb::minst::{PReg, template};
use crate::thumb::registers::{ALL_FREE, FREE};
use crate::thumb::reorder::{OrderCache, reorder_blocks};
use crate::thumb::select::plan::plan_mode;
use crate::thumb::select::{Near, Select};
use crate::thumb::state_layout::StateLayout;
use whippen_isa::{Arch, Class, Inst};
use whippen_kernel::random::kernel;
use whippen_kernel::sweep;
use whippen_modes::{ModeId, Modes};

/// How many kernels errors are put into.
const KERNELS: u64 = 12;

type Fixed = MInst<PReg>;

/// An instruction as selection would have made it.
fn selected(inst: Inst, access: Access) -> Fixed {
    MInst {
        inserted: false,
        ..MInst::inserted(inst, access)
    }
}

fn memory_at(op: Op, t: u8, access: Access) -> Fixed {
    let inst = Inst {
        t,
        n: RECORD,
        ..template(op)
    };
    selected(inst, access)
}

fn load(t: u8, cell: u32) -> Fixed {
    memory_at(Op::LDR_immediate, t, Access::Read(AliasClass::Cell(cell)))
}

fn store(t: u8, cell: u32) -> Fixed {
    memory_at(Op::STR_immediate, t, Access::Write(AliasClass::Cell(cell)))
}

fn alu(op: Op, s: bool, d: u8, n: u8, m: u8) -> Fixed {
    let inst = Inst {
        s,
        d,
        n,
        m,
        ..template(op)
    };
    selected(inst, Access::None)
}

/// A decision, one of two sides, and the same end; r2 is kept over all of it.
///
/// ```text
///   0: r0 = a, r1 = b, r2 = c, r0 < r1  ->  1: r3 = d, d = r2, r2 = r2 + r3   or   2: c = r1   ->  3: e = r2
/// ```
fn decision() -> Allocated {
    let on = || {
        Terminator::Jump(Edge {
            block: BlockId(3),
            args: Vec::new(),
        })
    };
    let ends = [
        Terminator::Branch {
            cond: Cond::LT,
            yes: BlockId(1),
            no: BlockId(2),
            likely: None,
        },
        on(),
        on(),
        Terminator::NextKey(PReg(Features::of(Arch::V8M).next_key_register)),
    ];
    let next = memory_at(Op::LDR_immediate, 14, Access::Read(AliasClass::Constant));
    let codes = [
        vec![
            load(0, 0),
            load(1, 1),
            load(2, 2),
            alu(Op::CMP_register, true, 0, 0, 1),
        ],
        vec![
            load(3, 3),
            store(2, 3),
            alu(Op::ADD_register, false, 2, 2, 3),
        ],
        vec![store(1, 2)],
        vec![next, store(2, 4)],
    ];
    let placed = |(code, end)| Block {
        params: Vec::new(),
        code,
        end,
        rounds: None,
        cycles: OnceLock::new(),
    };
    Allocated {
        blocks: codes.into_iter().zip(ends).map(placed).collect(),
        vregs: 0,
        slots: 0,
        free: ALL_FREE,
    }
}

#[test]
fn what_cannot_be_told_may_change_and_nothing_else() {
    let notices = |change: &dyn Fn(&mut [Block<PReg>])| {
        let mut after = decision();
        change(&mut after.blocks);
        validate(&decision(), &after).is_err()
    };
    assert!(!notices(&|_| ()));
    // The word goes up over the branch; its register then has another name.
    assert!(!notices(&|blocks| {
        let first = blocks[1].code.remove(0);
        blocks[0].code.insert(3, first);
    }));
    assert!(!notices(&|blocks| {
        blocks[1].code[0] = load(9, 3);
        blocks[1].code[2].set_register(Role::M, PReg(9));
    }));
    // Loads change places.
    assert!(!notices(&|blocks| blocks[0].code.swap(0, 2)));
    assert!(
        notices(&|blocks| blocks[1].code.swap(0, 1)),
        "the word is read behind what is written there"
    );
    assert!(
        notices(&|blocks| blocks[1].code.swap(0, 2)),
        "the sum has what was in r3"
    );
    assert!(
        notices(&|blocks| blocks[1].code[0] = load(9, 3)),
        "the sum reads r3 still"
    );
    assert!(
        notices(&|blocks| blocks[1].code[2].set_register(Role::D, PReg(4))),
        "the end reads r2"
    );
    assert!(
        notices(&|blocks| _ = blocks[2].code.remove(0)),
        "a store is lost"
    );
    assert!(
        notices(&|blocks| blocks[2].code[0] = store(0, 2)),
        "another word is stored"
    );
    assert!(
        notices(&|blocks| blocks[0].code.swap(1, 3)),
        "r0 is compared with what was in r1"
    );
    assert!(
        notices(&|blocks| _ = blocks[0].code.remove(3)),
        "the branch has other flags"
    );
    assert!(
        notices(&|blocks| blocks[0].code[0].inst.imm = 4),
        "another word is compared"
    );
    assert!(
        notices(&|blocks| _ = blocks[3].code.remove(0)),
        "nobody knows what follows"
    );
    assert!(
        notices(&|blocks| blocks[3].code[0].set_register(Role::T, PReg(RECORD))),
        "a register of the layout is lost"
    );
    let swapped = |end: &mut Terminator<PReg>| {
        *end = Terminator::Branch {
            cond: Cond::GE,
            yes: BlockId(1),
            no: BlockId(2),
            likely: None,
        }
    };
    assert!(
        notices(&|blocks| swapped(&mut blocks[0].end)),
        "the other side is gone"
    );
    // Up over the branch into a register that the other side's end wants.
    assert!(notices(&|blocks| {
        let mut sum = blocks[1].code.split_off(2);
        blocks[0].code.append(&mut sum);
    }));
}

/// The tick of a random kernel, before and after the passes.
fn random(seed: u64) -> [Allocated; 2] {
    let mut kernel = kernel(seed);
    sweep(&mut kernel);
    let modes = Modes::single(&kernel);
    let options = Options {
        name: "k".to_string(),
        keys: 2,
        gain: true,
        probes: true,
        arch: Arch::V8M,
    };
    let layout = StateLayout::new(&modes.kernel, &options, None, 0);
    let mut literals = Literals::new(1 + modes.kernel.tables.len());
    let mode = &modes.modes[ModeId(0)];
    let plan = plan_mode(&modes.kernel, mode, &[], Features::of(options.arch));
    let func = Select::select_mode(
        &modes.kernel,
        &layout,
        &plan,
        &mut literals,
        mode,
        ModeId(0),
        Near {
            decisions: 1,
            ..Near::default()
        },
    )
    .into_reverse_postorder();
    let before = allocate(&func, options.arch).expect("there are registers");
    let mut after = before.clone();
    reorder_blocks(&mut after, &timing(options.arch), &OrderCache::default());
    hoist_over_branches(&mut after, &timing(options.arch));
    [before, after]
}

fn is_slot(at: &Location<PReg>) -> bool {
    matches!(at, Location::Slot(_))
}

/// Which instructions compute something that comes out, found backwards from stores and ends.
fn needed(func: &Allocated) -> IdMap<BlockId, Vec<bool>> {
    let mut needed: IdMap<BlockId, Vec<bool>> = func
        .blocks
        .iter()
        .map(|block| vec![false; block.code.len()])
        .collect();
    let mut wanted: IdMap<BlockId, BTreeSet<Location<PReg>>> =
        IdMap::filled(BTreeSet::new(), func.blocks.len());
    loop {
        let known = wanted.clone();
        for (index, block) in func.blocks.enumerated().rev() {
            let mut live: BTreeSet<Location<PReg>> = match block.end {
                Terminator::Branch { cond, .. } => {
                    flag_places(branch_inst(Some(cond), false, 0).flags().reads).collect()
                }
                Terminator::Jump(_) => BTreeSet::new(),
                _ => [
                    STATE,
                    RECORD,
                    SAMPLES,
                    HISTORY,
                    SP,
                    Features::of(Arch::V8M).next_key_register,
                ]
                .map(|reg| Location::Register(PReg(reg)))
                .into(),
            };
            block
                .end
                .targets()
                .into_iter()
                .for_each(|to| live.extend(known[to].iter().chain(&wanted[to])));
            for (at, fixed) in block.code.iter().enumerate().rev() {
                let [from, to] = memory_touched(fixed);
                let written = fixed
                    .registers_written()
                    .map(Location::Register)
                    .chain(flag_places(fixed.inst.flags().writes));
                let written: Vec<Location<PReg>> = written
                    .chain(lost(fixed))
                    .chain(to.iter().copied().filter(is_slot))
                    .collect();
                let goes_out = to.iter().any(|to| !is_slot(to));
                needed[index][at] = goes_out || written.iter().any(|at| live.contains(at));
                if needed[index][at] {
                    written
                        .iter()
                        .filter(|_| !fixed.inst.is_conditional())
                        .for_each(|at| _ = live.remove(at));
                    live.extend(
                        fixed
                            .registers_read()
                            .map(Location::Register)
                            .chain(flag_places(fixed.inst.flags().reads))
                            .chain(from),
                    );
                }
            }
            wanted[index] = live;
        }
        if wanted == known {
            return needed;
        }
    }
}

/// Errors of one kind in a function: for each instruction the function with it, if there it can be
/// made.
type Errors = dyn Fn(&Allocated, BlockId, usize) -> Option<Allocated>;

/// How many errors of a kind there were in instructions that are needed, and how many of them went
/// unnoticed.
fn unnoticed(all: &[[Allocated; 2]], errors: &Errors) -> (usize, usize) {
    let (mut made, mut missed) = (0, 0);
    for [before, after] in all {
        let needed = needed(after);
        for (block, placed) in after.blocks.enumerated() {
            for at in (0..placed.code.len()).filter(|at| needed[block][*at]) {
                let Some(wrong) = errors(after, block, at) else {
                    continue;
                };
                made += 1;
                missed += usize::from(validate(before, &wrong).is_ok());
            }
        }
    }
    (made, missed)
}

fn with(func: &Allocated, block: BlockId, change: impl FnOnce(&mut Vec<Fixed>)) -> Allocated {
    let mut func = func.clone();
    change(&mut func.blocks[block].code);
    func
}

#[test]
fn errors_in_code_of_random_kernels_are_noticed() {
    let all: Vec<[Allocated; 2]> = (0..KERNELS).map(random).collect();
    for [before, after] in &all {
        assert_eq!(validate(before, after), Ok(()));
    }
    // Two instructions of which the second reads what the first leaves change places.
    let swapped = |func: &Allocated, block: BlockId, at: usize| {
        let code = &func.blocks[block].code;
        let depends = needed(func)[block].get(at + 1)?
            & (code[at].inst.defs().core_bits() & code[at + 1].inst.uses().core_bits() != 0);
        depends.then(|| with(func, block, |code| code.swap(at, at + 1)))
    };
    // The first operand is read in another register.
    let renamed = |func: &Allocated, block: BlockId, at: usize| {
        let first = func.blocks[block].code[at].uses().find(|u| u.reads)?;
        let register = first.operand.reg;
        let place = FREE.iter().position(|free| PReg(*free) == register)?;
        let other = PReg(FREE[(place + 1) % FREE.len()]);
        Some(with(func, block, |code| {
            code[at].set_register(first.role, other)
        }))
    };
    // A store is missing.
    let lost = |func: &Allocated, block: BlockId, at: usize| {
        let is_store = func.blocks[block].code[at].inst.class() == Class::Store;
        is_store.then(|| with(func, block, |code| _ = code.remove(at)))
    };
    // What a block begins with stands before the branch, though the other side wants the register.
    let moved_up = |func: &Allocated, block: BlockId, at: usize| {
        let above = func
            .blocks
            .ids()
            .find(|from| func.blocks[from].end.targets().contains(&block))
            .filter(|_| at == 0)?;
        let other = func.blocks[above]
            .end
            .targets()
            .into_iter()
            .find(|to| *to != block)?;
        let first = func.blocks[block].code[0];
        let wanted = first.register_bits().1 & compute_live_in(func)[other].bits() != 0;
        wanted.then(|| {
            let shorter = with(func, block, |code| _ = code.remove(0));
            with(&shorter, above, |code| code.push(first))
        })
    };
    let kinds: [&Errors; 4] = [&swapped, &renamed, &lost, &moved_up];
    // Those unnoticed find an equal content: a word or flags that were made or loaded twice, a step
    // that two divisions share.
    assert_eq!(
        kinds.map(|errors| unnoticed(&all, errors)),
        [(432, 4), (787, 2), (454, 0), (11, 0)]
    );
}
