//! The compiler of one function on one screen: from instructions over virtual registers to the
//! order in which blocks are laid out.
//!
//! | pass | file | checked, in debug builds, by |
//! | --- | --- | --- |
//! | plan values | `select/plan` | none: an analysis, which changes nothing |
//! | select | `select` | `regalloc2`'s verifier of SSA form, in `allocate` |
//! | legalize for ARMv6-M | `v6m` | the same |
//! | promote tick constants | `promote` | the same |
//! | order blocks | `minst` | the same |
//! | schedule | `schedule` | `validate` |
//! | advance the load of the next key's code | `schedule` | the same as `select` |
//! | allocate registers | `allocate` | `regalloc2`'s checker |
//! | reorder, rename | `reorder`, `rename` | `validate`, with the next |
//! | hoist over branches | `hoist` | `validate` |
//! | lay out blocks, assemble | `block_layout`, `emit` | encoding and decoding, by `isa` |
//!
//! Modes, `init` and what a tick computes at its entry take the same passes. On ARMv6-M nothing
//! waits for results, so nothing is scheduled there, nor reordered.

use super::allocate::allocate;
use super::code_cache::{CodeCache, Compiled, Origin};
use super::func::{Allocated, Func};
use super::hoist::hoist_over_branches;
use super::literal::Literals;
use super::minst::Register;
use super::promote::Promotions;
use super::registers::ALL_FREE;
use super::reorder::{OrderCache, reorder_blocks};
use super::schedule::{advance_next_key_loads, schedule_blocks};
use super::select::plan::{plan_init, plan_invariants, plan_mode};
use super::select::{Near, Select};
use super::state_layout::StateLayout;
use super::tick_invariant::TickInvariants;
use super::validate::validate;
use super::{ThumbError, critical_path, v6m};
use crate::features::Features;
use whippen_ids::IdMap;
use whippen_isa::timing::Core;
use whippen_kernel::{Kernel, Range};
use whippen_modes::{Mode, ModeId};

/// How a function is compiled.
#[derive(Debug, Clone, Copy, Hash)]
pub(super) struct Strategy {
    /// Decisions over which a rematerializable value keeps its register.
    pub remat_distance: usize,
    /// Instructions of a block over which it does.
    pub remat_within: usize,
    /// Instructions of a block over which the address of a table's row does.
    pub addresses_within: usize,
    /// Values alive at once, as far as the scheduler can have that; none keeps selection's order.
    pub pressure_limit: Option<usize>,
}

/// What is compiled.
#[derive(Debug, Clone, Copy)]
pub(super) enum CompileUnit<'a> {
    /// A mode, by its number.
    Mode(ModeId),
    /// What prepares one key.
    Init,
    /// What a tick computes at its entry, once for all keys.
    Invariants(&'a TickInvariants),
}

/// What all functions of a core are compiled for.
#[derive(Clone, Copy)]
pub(super) struct Compiler<'a> {
    /// What the modes are of, for any values of what memory holds at first.
    pub kernel: &'a Kernel,
    pub modes: &'a IdMap<ModeId, Mode>,
    pub layout: &'a StateLayout,
    /// Where the live values lie that a tick adds, even if promises are wrong.
    pub shared: &'a [Range],
    pub core: &'a Core,
    /// What was compiled before.
    pub cache: &'a CodeCache,
}

impl Compiler<'_> {
    /// Plans values and selects instructions; literals are numbered as they are met.
    pub(super) fn select(
        &self,
        piece: CompileUnit,
        strategy: Strategy,
        literals: &mut Literals,
    ) -> Func {
        let kernel = self.kernel;
        let func = match piece {
            CompileUnit::Mode(index) => {
                let mode = &self.modes[index];
                let plan = plan_mode(kernel, mode, self.shared, self.features());
                let near = Near {
                    decisions: strategy.remat_distance,
                    instructions: strategy.remat_within,
                    addresses: strategy.addresses_within,
                };
                Select::select_mode(kernel, self.layout, &plan, literals, mode, index, near)
            }
            CompileUnit::Init => {
                let plan = plan_init(kernel);
                Select::select_init(kernel, self.layout, &plan, literals)
            }
            CompileUnit::Invariants(invariants) => {
                let plan = plan_invariants(kernel, invariants);
                Select::select_invariants(kernel, self.layout, &plan, literals, invariants)
            }
        };
        if self.features().legal_as_selected {
            func
        } else {
            v6m::legal(func, self.layout, literals)
        }
    }

    /// Promotes, schedules and allocates; gives the code and about the cycles of its longest path.
    ///
    /// # Errors
    /// Those of [`Compiler::schedule`] and [`Compiler::allocate`].
    pub(super) fn allocate_scheduled(
        &self,
        func: Func,
        promotions: &Promotions,
        strategy: Strategy,
    ) -> Result<Compiled, ThumbError> {
        let origin = Origin::Selected(&func, promotions, strategy);
        self.cache
            .functions
            .get_or_make(&(origin, self.core.arch), || {
                let func = self.schedule(promotions.promote_in(func.clone()), strategy)?;
                let code = self.allocate(&func)?;
                let cycles = critical_path::estimate_cycles(&code, self.core);
                Ok((code, cycles))
            })
    }

    /// Orders blocks, and the instructions of each.
    ///
    /// # Errors
    /// The order changes what is computed: a bug.
    pub(super) fn schedule(&self, func: Func, strategy: Strategy) -> Result<Func, ThumbError> {
        let mut func = func.into_reverse_postorder();
        if let Some(limit) = strategy.pressure_limit.filter(|_| self.reorders()) {
            let promoted = (ALL_FREE & !func.free).count_ones() as usize;
            let limit = limit.saturating_sub(promoted).max(2);
            validated(&mut func, |func| schedule_blocks(func, self.core, limit))?;
            advance_next_key_loads(&mut func);
        }
        Ok(func)
    }

    /// Allocates registers.
    ///
    /// # Errors
    /// More is spilled than code reaches; there are none, or the allocator's checker objects: a
    /// bug.
    pub(super) fn allocate(&self, func: &Func) -> Result<Allocated, ThumbError> {
        let code = allocate(func, self.core.arch).map_err(ThumbError::Bug)?;
        let (slots, max) = (code.slots, self.features().stack_slots_max);
        if slots > max {
            return Err(ThumbError::Stack { slots, max });
        }
        Ok(code)
    }

    /// Reorders allocated code; gives it with the cycles of its longest path.
    ///
    /// # Errors
    /// A pass changed what is computed: a bug.
    pub(super) fn reorder(
        &self,
        code: &Allocated,
        orders: &OrderCache,
    ) -> Result<Compiled, ThumbError> {
        let origin = Origin::Allocated(code);
        self.cache
            .functions
            .get_or_make(&(origin, self.core.arch), || {
                let mut code = code.clone();
                if self.reorders() {
                    validated(&mut code, |code| {
                        reorder_blocks(code, self.core, orders);
                        hoist_over_branches(code, self.core);
                    })?;
                }
                let cycles = critical_path::worst_case_cycles(&code, self.core);
                Ok((code, cycles))
            })
    }

    /// Whether the order of instructions counts.
    pub(super) fn reorders(&self) -> bool {
        self.features().results_wait
    }

    fn features(&self) -> &'static Features {
        Features::of(self.core.arch)
    }
}

/// Runs passes; in debug builds what comes out is compared with what went in.
fn validated<R: Register>(
    func: &mut Func<R>,
    passes: impl FnOnce(&mut Func<R>),
) -> Result<(), ThumbError> {
    let before = cfg!(debug_assertions).then(|| func.clone());
    passes(func);
    before.map_or(Ok(()), |before| {
        validate(&before, func).map_err(ThumbError::Bug)
    })
}
