//! Search over compilation strategies for the modes whose worst-case path is longest.
//!
//! A strategy is the register-pressure limit of the scheduler and how far rematerializable values
//! keep their registers. Every mode is compiled by the first; then the worst mode, of those that
//! have candidates left, is reordered and compiled by the others, because only the longest path of
//! all modes counts. Candidates are tried one after the other: each may change which mode is the
//! worst.

use std::sync::Arc;

use super::ThumbError;
use super::code_cache::Compiled;
use super::compile::{CompileUnit, Compiler, Strategy};
use super::func::{Allocated, Func};
use super::literal::Literals;
use super::promote::{self, Promotions};
use super::reorder::OrderCache;
use super::tick_invariant::TickInvariants;
use super::tuning::{CANDIDATES_MAX, CLOSE_CYCLES, LONG_BLOCK, PROMOTION_MODES, REMAT_WITHIN};
use whippen_deterministic::parallel;
use whippen_ids::IdMap;
use whippen_modes::ModeId;

const fn strategy(remat_distance: usize, pressure_limit: usize) -> Strategy {
    Strategy {
        remat_distance,
        remat_within: usize::MAX,
        addresses_within: 0,
        pressure_limit: Some(pressure_limit),
    }
}

/// The strategy that keeps the order of selection.
const UNSCHEDULED: Strategy = Strategy {
    remat_distance: 1,
    remat_within: usize::MAX,
    addresses_within: 0,
    pressure_limit: None,
};

/// What is loaded is loaded again in the same block, too: for blocks whose values wait long.
const LOADED_OFTEN: Strategy = Strategy {
    remat_distance: 1,
    remat_within: REMAT_WITHIN,
    addresses_within: 0,
    pressure_limit: Some(9),
};

/// And the address of a table's row stays in its register, for tables that are read over and over.
const ADDRESSES_KEPT: Strategy = Strategy {
    addresses_within: usize::MAX,
    ..LOADED_OFTEN
};

/// How many of the last strategies are for long blocks.
const FOR_LONG: usize = 2;

/// The strategies, in the order in which they are tried.
const STRATEGIES: [Strategy; 10] = [
    strategy(1, 9),
    strategy(0, 9),
    strategy(3, 9),
    strategy(20, 9),
    strategy(1, 7),
    strategy(0, 7),
    strategy(1, 5),
    UNSCHEDULED,
    LOADED_OFTEN,
    ADDRESSES_KEPT,
];

/// A mode's best code so far.
struct CompiledMode {
    /// With the cycles of its longest path.
    code: Compiled,
    chosen: Chosen,
    /// How many strategies were tried to the end; the first is not yet reordered where this is 0.
    tried: usize,
    /// The code by the first strategy, reordered.
    first: Option<Compiled>,
}

impl CompiledMode {
    fn cycles(&self) -> u64 {
        self.code.1
    }
}

/// How the code of a mode came about.
#[derive(Debug, Clone, Copy)]
pub(super) struct Chosen {
    pub strategy: Strategy,
    pub reordered: bool,
}

/// The code of all modes.
#[derive(Clone)]
pub(super) struct CompiledModes {
    pub code: IdMap<ModeId, Allocated>,
    /// How it came about.
    pub chosen: IdMap<ModeId, Chosen>,
    /// The literals that were tried for it.
    pub literals: Literals,
    /// The tick constants in registers.
    pub promotions: Promotions,
}

/// Compiles all modes.
pub(super) fn compile_modes(compiler: &Compiler) -> Result<CompiledModes, ThumbError> {
    let mut literals = Literals::new(compiler.modes.len() + compiler.kernel.tables.len());
    let modes = compiler.modes.ids();
    let funcs: IdMap<ModeId, Func> = modes
        .map(|mode| compiler.select(CompileUnit::Mode(mode), STRATEGIES[0], &mut literals))
        .collect();
    let (promotions, mut all) = compile_first(compiler, funcs)?;
    if compiler.reorders() {
        improve_worst(compiler, &promotions, &mut literals, &mut all)?;
    }
    Ok(CompiledModes {
        chosen: all.iter().map(|mode| mode.chosen).collect(),
        code: all.into_iter().map(|mode| code(mode.code)).collect(),
        literals,
        promotions,
    })
}

/// Compiles `init`, of which only the size counts.
pub(super) fn compile_init(
    compiler: &Compiler,
    literals: &mut Literals,
) -> Result<Allocated, ThumbError> {
    let func = compiler.select(CompileUnit::Init, UNSCHEDULED, literals);
    let none = Promotions::default();
    let compiled = compiler.allocate_scheduled(func, &none, UNSCHEDULED)?;
    Ok(code(compiled))
}

/// Compiles what a tick computes at its entry, if there is such.
pub(super) fn compile_invariants(
    compiler: &Compiler,
    literals: &mut Literals,
    invariants: &TickInvariants,
) -> Result<Option<Allocated>, ThumbError> {
    if invariants.results.is_empty() {
        return Ok(None);
    }
    let func = compiler.select(CompileUnit::Invariants(invariants), STRATEGIES[0], literals);
    let none = Promotions::default();
    let compiled = compiler.allocate_scheduled(func, &none, STRATEGIES[0])?;
    let reordered = compiler.reorder(&compiled.0, &OrderCache::default())?;
    Ok(Some(code(reordered)))
}

/// The code alone.
fn code(compiled: Compiled) -> Allocated {
    Arc::unwrap_or_clone(compiled).0
}

/// Chooses the tick constants in registers, and compiles all modes by the first strategy: as many
/// constants as make the worst mode cheapest, the more the better where it is the same. Only the
/// longest modes are compiled for each number of constants; the rest once it is chosen.
fn compile_first(
    compiler: &Compiler,
    funcs: IdMap<ModeId, Func>,
) -> Result<(Promotions, IdMap<ModeId, CompiledMode>), ThumbError> {
    let candidates = if compiler.reorders() {
        promote::rank_candidates(&funcs)
    } else {
        Vec::new()
    };
    let mut longest: Vec<ModeId> = funcs.ids().collect();
    longest.sort_by_cached_key(|mode| std::cmp::Reverse(funcs[mode].longest_path_len()));
    longest.truncate(PROMOTION_MODES);
    let mut best: Option<(u64, Promotions, Vec<CompiledMode>)> = None;
    for count in 0..=candidates.len() {
        let promotions = Promotions::new(&candidates[..count]);
        let compiled = compile_each(compiler, &promotions, &funcs, &longest)?;
        let worst = compiled.iter().map(CompiledMode::cycles).max().unwrap_or(0);
        match &best {
            Some((least, ..)) if worst > *least => break,
            _ => best = Some((worst, promotions, compiled)),
        }
    }
    let (_, promotions, compiled) = best.unwrap_or_default();
    let rest: Vec<ModeId> = (funcs.ids())
        .filter(|mode| !longest.contains(mode))
        .collect();
    let others = compile_each(compiler, &promotions, &funcs, &rest)?;
    let modes = longest.into_iter().chain(rest);
    let mut all: Vec<(ModeId, CompiledMode)> =
        modes.zip(compiled.into_iter().chain(others)).collect();
    all.sort_by_key(|(mode, _)| *mode);
    Ok((promotions, all.into_iter().map(|(_, mode)| mode).collect()))
}

/// Compiles these modes by the first strategy.
fn compile_each(
    compiler: &Compiler,
    promotions: &Promotions,
    funcs: &IdMap<ModeId, Func>,
    modes: &[ModeId],
) -> Result<Vec<CompiledMode>, ThumbError> {
    let compile = |mode: ModeId| {
        let func = funcs[mode].clone();
        Ok(CompiledMode {
            code: compiler.allocate_scheduled(func, promotions, STRATEGIES[0])?,
            chosen: Chosen {
                strategy: STRATEGIES[0],
                reordered: false,
            },
            tried: 0,
            first: None,
        })
    };
    parallel::map(modes.to_vec(), compile).into_iter().collect()
}

/// Tries candidates for the worst mode until there are none.
fn improve_worst(
    compiler: &Compiler,
    promotions: &Promotions,
    literals: &mut Literals,
    all: &mut IdMap<ModeId, CompiledMode>,
) -> Result<(), ThumbError> {
    let orders = OrderCache::default();
    let attempts = CANDIDATES_MAX + all.len();
    for attempt in 0..attempts {
        let Some(mode) = worst_open_mode(all) else {
            break;
        };
        if all[mode].tried == 0 && all[mode].first.is_none() {
            reorder_first(compiler, all, attempts - attempt, &orders)?;
        }
        let best = &mut all[mode];
        let strategy = STRATEGIES[best.tried];
        let code = match best.first.take() {
            Some(first) => first,
            None => {
                let func = compiler.select(CompileUnit::Mode(mode), strategy, literals);
                let compiled = compiler.allocate_scheduled(func, promotions, strategy)?;
                compiler.reorder(&compiled.0, &orders)?
            }
        };
        if best.tried == 0 || code.1 < best.cycles() {
            best.code = code;
            best.chosen = Chosen {
                strategy,
                reordered: true,
            };
        }
        best.tried += 1;
    }
    Ok(())
}

/// Reorders so many modes at most of those whose turn it will be: each that is close to the worst
/// stays so, as the worst only gets better.
fn reorder_first(
    compiler: &Compiler,
    all: &mut IdMap<ModeId, CompiledMode>,
    modes_max: usize,
    orders: &OrderCache,
) -> Result<(), ThumbError> {
    let mut close: Vec<ModeId> = open_modes(all).collect();
    close.retain(|mode| all[mode].tried == 0 && all[mode].first.is_none());
    close.sort_by_key(|mode| std::cmp::Reverse(all[mode].cycles()));
    close.truncate(modes_max);
    let reordered = parallel::map(close.clone(), |mode| {
        compiler.reorder(&all[mode].code.0, orders)
    });
    for (mode, found) in close.into_iter().zip(reordered) {
        all[mode].first = Some(found?);
    }
    Ok(())
}

/// How many strategies a mode has.
fn candidates(mode: &CompiledMode) -> usize {
    let mut blocks = mode.code.0.blocks.iter();
    let has_long = blocks.any(|block| block.code.len() > LONG_BLOCK);
    STRATEGIES.len() - if has_long { 0 } else { FOR_LONG }
}

/// The modes that have a candidate left and come close to the worst.
fn open_modes(all: &IdMap<ModeId, CompiledMode>) -> impl Iterator<Item = ModeId> {
    let worst = all.iter().map(CompiledMode::cycles).max().unwrap_or(0);
    let is_open = move |mode: &CompiledMode| {
        mode.tried < candidates(mode) && mode.cycles() + CLOSE_CYCLES >= worst
    };
    all.ids().filter(move |mode| is_open(&all[mode]))
}

/// The one of these with most cycles, the first of several.
fn worst_open_mode(all: &IdMap<ModeId, CompiledMode>) -> Option<ModeId> {
    open_modes(all).max_by_key(|mode| (all[mode].cycles(), std::cmp::Reverse(*mode)))
}
