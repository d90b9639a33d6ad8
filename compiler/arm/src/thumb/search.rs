//! The best of some ways to make the code of each mode.
//!
//! A way is how many values may be alive at once in the schedule, and for how long what can be
//! loaded again keeps its register. Every mode is made in one way; then the worst is put in
//! order, and made in others, as long as there is another to try, because only the longest path of
//! all counts.

use super::allocate::{Allocated, allocate};
use super::literal::Literals;
use super::minst::Func;
use super::promote::{self, Promotions};
use super::registers::ALL_FREE;
use super::reorder::OrderCache;
use super::select::Select;
use super::state_layout::StateLayout;
use super::tick_invariant::TickInvariants;
use super::tuning::{
    CANDIDATES_AT_ONCE, CANDIDATES_MAX, CLOSE_CYCLES, PROMOTION_MODES, REORDER_SAVING,
};
use super::{ThumbError, critical_path, hoist, reorder, schedule, v6m, validate};
use whippen_deterministic::parallel;
use whippen_isa::Arch;
use whippen_isa::timing::Core;
use whippen_kernel::Kernel;
use whippen_modes::Modes;

/// A way to make code.
#[derive(Debug, Clone, Copy)]
struct Strategy {
    /// Decisions over which a loaded value stays in its register.
    remat_distance: usize,
    /// Values alive at once, as far as that can be had; none for the order of selection.
    pressure_limit: Option<usize>,
}

const fn strategy(remat_distance: usize, pressure_limit: usize) -> Strategy {
    Strategy {
        remat_distance,
        pressure_limit: Some(pressure_limit),
    }
}

/// The ways, in the order in which they are tried.
const STRATEGIES: [Strategy; 8] = [
    strategy(1, 9),
    strategy(0, 9),
    strategy(3, 9),
    strategy(20, 9),
    strategy(1, 7),
    strategy(0, 7),
    strategy(1, 5),
    Strategy {
        remat_distance: 1,
        pressure_limit: None,
    },
];

/// Code and the cycles of its longest path.
struct CompiledMode {
    code: Allocated,
    cycles: u64,
    /// How many ways were tried to the end; the first of them is only begun with where this is
    /// none.
    tried: usize,
}

/// The code of all modes, and what stays in registers from key to key.
pub(super) fn compile_modes(
    modes: &Modes,
    layout: &StateLayout,
    literals: &mut Literals,
    core: &Core,
) -> Result<(Vec<Allocated>, Promotions), ThumbError> {
    let select = |index: usize, strategy: Strategy, literals: &mut Literals| {
        let func = Select::mode(
            &modes.kernel,
            layout,
            literals,
            &modes.modes[index],
            index,
            strategy.remat_distance,
        );
        legalize(func, layout, literals, core)
    };
    let funcs: Vec<Func> = (0..modes.modes.len())
        .map(|index| select(index, STRATEGIES[0], literals))
        .collect();
    let promotions = if core.arch == Arch::V6M {
        Promotions::default()
    } else {
        choose_promotions(&funcs, core)?
    };
    let select = |index: usize, strategy: Strategy, literals: &mut Literals| {
        promotions.promote_in(select(index, strategy, literals))
    };
    let funcs: Vec<Func> = funcs
        .into_iter()
        .map(|func| promotions.promote_in(func))
        .collect();
    let first = |func: Func| {
        let (code, cycles) = compile_variant(func, STRATEGIES[0].pressure_limit, core)?;
        Ok(CompiledMode {
            code,
            cycles,
            tried: 0,
        })
    };
    let mut all = parallel::map(funcs, first)
        .into_iter()
        .collect::<Result<Vec<CompiledMode>, ThumbError>>()?;
    if core.arch == Arch::V6M {
        // Nothing waits there, so one order is as good as another.
        return Ok((all.into_iter().map(|made| made.code).collect(), promotions));
    }
    let known = OrderCache::default();
    let mut left = CANDIDATES_MAX + all.len();
    while left > 0 {
        let ahead = next_candidates(&all, left.min(CANDIDATES_AT_ONCE));
        if ahead.is_empty() {
            break;
        }
        let begun = ahead.iter().map(|&(index, tried)| {
            let before = literals.clone();
            let func = (tried > 0).then(|| select(index, STRATEGIES[tried], literals));
            ((func, tried, &all[index].code), before)
        });
        let (begun, before): (Vec<_>, Vec<Literals>) = begun.unzip();
        let ended = parallel::map(begun, |(func, tried, code)| {
            let mut code = match func {
                Some(func) => compile_variant(func, STRATEGIES[tried].pressure_limit, core)?.0,
                None => code.clone(),
            };
            let cycles = reorder_and_hoist(&mut code, core, &known)?;
            Ok((code, cycles))
        });
        for ((&(index, tried), before), ended) in ahead.iter().zip(before).zip(ended) {
            if worst(&standing(&all)) != Some((index, tried)) {
                // One before has changed what comes next: nobody has tried this.
                *literals = before;
                break;
            }
            let (best, (code, cycles)) = (&mut all[index], ended?);
            if tried == 0 || cycles < best.cycles {
                (best.code, best.cycles) = (code, cycles);
            }
            best.tried += 1;
            left -= 1;
        }
    }
    let code = all.into_iter().map(|made| made.code).collect();
    Ok((code, promotions))
}

/// The words that stay in registers: as many as make the worst mode cheapest, the more the better
/// where it is the same. Only modes that may be the worst are made for that.
fn choose_promotions(funcs: &[Func], core: &Core) -> Result<Promotions, ThumbError> {
    let words = promote::rank_candidates(funcs);
    let mut longest: Vec<&Func> = funcs.iter().collect();
    longest.sort_by_cached_key(|func| std::cmp::Reverse(func.longest_path_len()));
    longest.truncate(PROMOTION_MODES);
    let mut best: Option<(u64, Promotions)> = None;
    for count in 0..=words.len() {
        let promotions = Promotions::new(&words[..count]);
        let funcs: Vec<Func> = longest
            .iter()
            .map(|func| promotions.promote_in((*func).clone()))
            .collect();
        let cycles = parallel::map(funcs, |func| {
            Ok(compile_variant(func, STRATEGIES[0].pressure_limit, core)?.1)
        });
        let worst = cycles
            .into_iter()
            .collect::<Result<Vec<u64>, ThumbError>>()?
            .into_iter()
            .max();
        match (worst, &best) {
            (Some(worst), Some((least, _))) if worst > *least => break,
            (worst, _) => best = Some((worst.unwrap_or(0), promotions)),
        }
    }
    Ok(best.map_or_else(Promotions::default, |(_, promotions)| promotions))
}

/// The cycles of each mode, and how many ways were tried.
fn standing(all: &[CompiledMode]) -> Vec<(u64, usize)> {
    all.iter().map(|made| (made.cycles, made.tried)).collect()
}

/// The worst mode, with its way that is to be tried; none if there is no other.
fn worst(standing: &[(u64, usize)]) -> Option<(usize, usize)> {
    let most = standing.iter().map(|(cycles, _)| *cycles).max()?;
    // What comes close may take more cycles once it has addresses.
    let is_open = |(_, (cycles, tried)): &(usize, &(u64, usize))| {
        *tried < STRATEGIES.len() && cycles + CLOSE_CYCLES >= most
    };
    let by_cycles =
        |(index, (cycles, _)): &(usize, &(u64, usize))| (*cycles, std::cmp::Reverse(*index));
    let (index, (_, tried)) = standing
        .iter()
        .enumerate()
        .filter(is_open)
        .max_by_key(by_cycles)?;
    Some((index, *tried))
}

/// What is tried next, and then, as long as orders save what is expected of them and no other way
/// helps.
fn next_candidates(all: &[CompiledMode], count: usize) -> Vec<(usize, usize)> {
    let mut standing = standing(all);
    let next = || {
        let next = worst(&standing)?;
        let (cycles, tried) = &mut standing[next.0];
        *cycles -= if *tried == 0 {
            REORDER_SAVING.min(*cycles)
        } else {
            0
        };
        *tried += 1;
        Some(next)
    };
    std::iter::from_fn(next).take(count).collect()
}

/// The code of `init`, of which only the size counts.
pub(super) fn compile_init(
    modes: &Modes,
    layout: &StateLayout,
    literals: &mut Literals,
    core: &Core,
) -> Result<Allocated, ThumbError> {
    let func = legalize(
        Select::init(&modes.kernel, layout, literals),
        layout,
        literals,
        core,
    );
    Ok(compile_variant(func, None, core)?.0)
}

/// The code of what a tick computes at its entry, if there is such.
pub(super) fn compile_shared(
    kernel: &Kernel,
    layout: &StateLayout,
    literals: &mut Literals,
    shared: &TickInvariants,
    core: &Core,
) -> Result<Option<Allocated>, ThumbError> {
    if shared.results.is_empty() {
        return Ok(None);
    }
    let func = legalize(
        Select::shared(kernel, layout, literals, shared),
        layout,
        literals,
        core,
    );
    let (mut code, _) = compile_variant(func, STRATEGIES[0].pressure_limit, core)?;
    if core.arch != Arch::V6M {
        reorder_and_hoist(&mut code, core, &OrderCache::default())?;
    }
    Ok(Some(code))
}

/// Instructions that the core has.
fn legalize(func: Func, layout: &StateLayout, literals: &mut Literals, core: &Core) -> Func {
    if core.arch == Arch::V6M {
        v6m::legal(func, layout, literals)
    } else {
        func
    }
}

/// Code with registers, and about the cycles of its longest path.
fn compile_variant(
    func: Func,
    pressure_limit: Option<usize>,
    core: &Core,
) -> Result<(Allocated, u64), ThumbError> {
    let mut func = func.into_reverse_postorder();
    if let Some(pressure_limit) = pressure_limit.filter(|_| core.arch != Arch::V6M) {
        let promoted = (ALL_FREE & !func.free).count_ones() as usize;
        schedule::schedule_blocks(
            &mut func,
            core,
            pressure_limit.saturating_sub(promoted).max(2),
        );
    }
    let code = allocate(&func, core.arch).map_err(ThumbError::Bug)?;
    let cycles = critical_path::estimate_cycles(&code, core);
    Ok((code, cycles))
}

/// The same in a better order; gives its cycles. In debug builds a checker compares what it does
/// with what it did.
fn reorder_and_hoist(
    code: &mut Allocated,
    core: &Core,
    known: &OrderCache,
) -> Result<u64, ThumbError> {
    let before = cfg!(debug_assertions).then(|| code.clone());
    reorder::reorder_blocks(code, core, known);
    hoist::hoist_over_branches(code, core);
    if let Some(before) = before {
        validate::validate(&before, code, core.arch).map_err(ThumbError::Bug)?;
    }
    Ok(critical_path::worst_case_cycles(code, core))
}
