//! The best of some ways to make the code of each mode.
//!
//! A way is how many values may be alive at once in the schedule, and for how long what can be
//! loaded again keeps its register. Every mode is made in one way; then the dearest is put in
//! order, and made in others, as long as there is another to try, because only the longest path of
//! all counts.

use super::allocate::{Allocated, allocate};
use super::frame::{ALL_FREE, Frame};
use super::literal::Literals;
use super::pins::{self, Pins};
use super::reorder::Known;
use super::select::Select;
use super::shared::Shared;
use super::vcode::Func;
use super::{ThumbError, agree, hoist, path, reorder, schedule, v6m};
use whippen_deterministic::parallel;
use whippen_isa::Arch;
use whippen_isa::timing::Core;
use whippen_kernel::Kernel;
use whippen_modes::Modes;

/// A way to make code.
#[derive(Debug, Clone, Copy)]
struct Way {
    /// Decisions over which a loaded value stays in its register.
    near: usize,
    /// Values alive at once, as far as that can be had; none for the order of selection.
    alive: Option<usize>,
}

const fn way(near: usize, alive: usize) -> Way {
    Way {
        near,
        alive: Some(alive),
    }
}

/// The ways, in the order in which they are tried.
const WAYS: [Way; 8] = [
    way(1, 9),
    way(0, 9),
    way(3, 9),
    way(20, 9),
    way(1, 7),
    way(0, 7),
    way(1, 5),
    Way {
        near: 1,
        alive: None,
    },
];

/// Code and the cycles of its longest path.
struct Made {
    code: Allocated,
    cycles: u64,
    /// The way that it was made in, and whether it was put in order.
    chosen: Chosen,
    /// How many ways were tried to the end; the first of them is only begun with where this is
    /// none.
    tried: usize,
}

/// How the code of a mode came about.
#[derive(Debug, Clone, Copy)]
pub(super) struct Chosen {
    way: Way,
    ordered: bool,
}

/// How many ways are tried, at most, beside the first of each mode.
const TRIES: usize = 8;
/// So many are tried at once: what comes next if those before do not change which mode is the
/// dearest.
const AHEAD: usize = 2;
/// What a better order saves about, so many cycles.
const SAVED: u64 = 4;

/// Modes that are so many cycles below the dearest are made as well as that one.
const CLOSE: u64 = 3;

/// So many of the longest modes tell how many words stay in registers.
const LONG: usize = 8;

/// The code of all modes.
pub(super) struct MadeModes {
    pub code: Vec<Allocated>,
    /// How it came about, by mode.
    pub chosen: Vec<Chosen>,
    /// What stays in registers from key to key.
    pub pins: Pins,
}

/// The code of all modes, and what stays in registers from key to key.
pub(super) fn modes(
    modes: &Modes,
    frame: &Frame,
    literals: &mut Literals,
    core: &Core,
) -> Result<MadeModes, ThumbError> {
    let select = |index: usize, way: Way, literals: &mut Literals| {
        selected(modes, index, way, frame, literals, core)
    };
    let funcs: Vec<Func> = (0..modes.modes.len())
        .map(|index| select(index, WAYS[0], literals))
        .collect();
    let pins = if core.arch == Arch::V6M {
        Pins::default()
    } else {
        best_pins(&funcs, core)?
    };
    let select =
        |index: usize, way: Way, literals: &mut Literals| pins.keep(select(index, way, literals));
    let funcs: Vec<Func> = funcs.into_iter().map(|func| pins.keep(func)).collect();
    let first = |func: Func| {
        let (code, cycles) = made(func, WAYS[0].alive, core)?;
        Ok(Made {
            code,
            cycles,
            chosen: Chosen {
                way: WAYS[0],
                ordered: false,
            },
            tried: 0,
        })
    };
    let mut all = parallel::map(funcs, first)
        .into_iter()
        .collect::<Result<Vec<Made>, ThumbError>>()?;
    if core.arch == Arch::V6M {
        // Nothing waits there, so one order is as good as another.
        return Ok(MadeModes::of(all, pins));
    }
    let known = Known::default();
    let mut left = TRIES + all.len();
    while left > 0 {
        let ahead = ahead(&all, left.min(AHEAD));
        if ahead.is_empty() {
            break;
        }
        let begun = ahead.iter().map(|&(index, tried)| {
            let before = literals.clone();
            let func = (tried > 0).then(|| select(index, WAYS[tried], literals));
            ((func, tried, &all[index].code), before)
        });
        let (begun, before): (Vec<_>, Vec<Literals>) = begun.unzip();
        let ended = parallel::map(begun, |(func, tried, code)| {
            let mut code = match func {
                Some(func) => made(func, WAYS[tried].alive, core)?.0,
                None => code.clone(),
            };
            let cycles = ordered(&mut code, core, &known)?;
            Ok((code, cycles))
        });
        for ((&(index, tried), before), ended) in ahead.iter().zip(before).zip(ended) {
            if dearest(&standing(&all)) != Some((index, tried)) {
                // One before has changed what comes next: nobody has tried this.
                *literals = before;
                break;
            }
            let (best, (code, cycles)) = (&mut all[index], ended?);
            if tried == 0 || cycles < best.cycles {
                (best.code, best.cycles) = (code, cycles);
                best.chosen = Chosen {
                    way: WAYS[tried],
                    ordered: true,
                };
            }
            best.tried += 1;
            left -= 1;
        }
    }
    Ok(MadeModes::of(all, pins))
}

impl MadeModes {
    fn of(all: Vec<Made>, pins: Pins) -> MadeModes {
        let chosen = all.iter().map(|made| made.chosen).collect();
        let code = all.into_iter().map(|made| made.code).collect();
        MadeModes { code, chosen, pins }
    }
}

/// What selection makes of a mode, in instructions that the core has.
fn selected(
    modes: &Modes,
    index: usize,
    way: Way,
    frame: &Frame,
    literals: &mut Literals,
    core: &Core,
) -> Func {
    let mode = &modes.modes[index];
    let func = Select::mode(&modes.kernel, frame, literals, mode, index, way.near);
    legal(func, frame, literals, core)
}

/// A mode's code after each pass.
pub(super) struct Forms {
    pub selected: Func,
    pub promoted: Func,
    pub scheduled: Func,
    pub allocated: Allocated,
    pub reordered: Allocated,
}

/// The forms of a mode on the way on which its code came about; `frame` knows what stays in
/// registers.
pub(super) fn forms(
    modes: &Modes,
    index: usize,
    chosen: Chosen,
    frame: &Frame,
    literals: &mut Literals,
    core: &Core,
) -> Result<Forms, ThumbError> {
    let selected = selected(modes, index, chosen.way, frame, literals, core);
    let promoted = frame.pins.keep(selected.clone());
    let scheduled = scheduled(promoted.clone(), chosen.way.alive, core);
    let allocated = allocate(&scheduled, core.arch).map_err(ThumbError::Bug)?;
    let mut reordered = allocated.clone();
    if chosen.ordered {
        ordered(&mut reordered, core, &Known::default())?;
    }
    Ok(Forms {
        selected: selected.in_order(),
        promoted: promoted.in_order(),
        scheduled,
        allocated,
        reordered,
    })
}

/// The words that stay in registers: as many as make the dearest mode cheapest, the more the better
/// where it is the same. Only modes that may be the dearest are made for that.
fn best_pins(funcs: &[Func], core: &Core) -> Result<Pins, ThumbError> {
    let words = pins::wanted(funcs);
    let mut longest: Vec<&Func> = funcs.iter().collect();
    longest.sort_by_cached_key(|func| std::cmp::Reverse(func.longest()));
    longest.truncate(LONG);
    let mut best: Option<(u64, Pins)> = None;
    for count in 0..=words.len() {
        let pins = Pins::new(&words[..count]);
        let funcs: Vec<Func> = longest
            .iter()
            .map(|func| pins.keep((*func).clone()))
            .collect();
        let cycles = parallel::map(funcs, |func| Ok(made(func, WAYS[0].alive, core)?.1));
        let dearest = cycles
            .into_iter()
            .collect::<Result<Vec<u64>, ThumbError>>()?
            .into_iter()
            .max();
        match (dearest, &best) {
            (Some(dearest), Some((least, _))) if dearest > *least => break,
            (dearest, _) => best = Some((dearest.unwrap_or(0), pins)),
        }
    }
    Ok(best.map_or_else(Pins::default, |(_, pins)| pins))
}

/// The cycles of each mode, and how many ways were tried.
fn standing(all: &[Made]) -> Vec<(u64, usize)> {
    all.iter().map(|made| (made.cycles, made.tried)).collect()
}

/// The dearest mode, with its way that is to be tried; none if there is no other.
fn dearest(standing: &[(u64, usize)]) -> Option<(usize, usize)> {
    let most = standing.iter().map(|(cycles, _)| *cycles).max()?;
    // What comes close may be dearer once it has addresses.
    let is_open = |(_, (cycles, tried)): &(usize, &(u64, usize))| {
        *tried < WAYS.len() && cycles + CLOSE >= most
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
fn ahead(all: &[Made], count: usize) -> Vec<(usize, usize)> {
    let mut standing = standing(all);
    let next = || {
        let next = dearest(&standing)?;
        let (cycles, tried) = &mut standing[next.0];
        *cycles -= if *tried == 0 { SAVED.min(*cycles) } else { 0 };
        *tried += 1;
        Some(next)
    };
    std::iter::from_fn(next).take(count).collect()
}

/// The code of `init`, of which only the size counts.
pub(super) fn init(
    modes: &Modes,
    frame: &Frame,
    literals: &mut Literals,
    core: &Core,
) -> Result<Allocated, ThumbError> {
    let func = legal(
        Select::init(&modes.kernel, frame, literals),
        frame,
        literals,
        core,
    );
    Ok(made(func, None, core)?.0)
}

/// The code of what a tick computes at its entry, if there is such.
pub(super) fn shared(
    kernel: &Kernel,
    frame: &Frame,
    literals: &mut Literals,
    shared: &Shared,
    core: &Core,
) -> Result<Option<Allocated>, ThumbError> {
    if shared.results.is_empty() {
        return Ok(None);
    }
    let func = legal(
        Select::shared(kernel, frame, literals, shared),
        frame,
        literals,
        core,
    );
    let (mut code, _) = made(func, WAYS[0].alive, core)?;
    if core.arch != Arch::V6M {
        ordered(&mut code, core, &Known::default())?;
    }
    Ok(Some(code))
}

/// Instructions that the core has.
fn legal(func: Func, frame: &Frame, literals: &mut Literals, core: &Core) -> Func {
    if core.arch == Arch::V6M {
        v6m::legal(func, frame, literals)
    } else {
        func
    }
}

/// Code with registers, and about the cycles of its longest path.
fn made(func: Func, alive: Option<usize>, core: &Core) -> Result<(Allocated, u64), ThumbError> {
    let func = scheduled(func, alive, core);
    let code = allocate(&func, core.arch).map_err(ThumbError::Bug)?;
    let cycles = path::roughly(&code, core);
    Ok((code, cycles))
}

/// The same in a schedule for so many values alive at once, if there is a limit.
fn scheduled(func: Func, alive: Option<usize>, core: &Core) -> Func {
    let mut func = func.in_order();
    if let Some(alive) = alive.filter(|_| core.arch != Arch::V6M) {
        let pinned = (ALL_FREE & !func.free).count_ones() as usize;
        schedule::schedule(&mut func, core, alive.saturating_sub(pinned).max(2));
    }
    func
}

/// The same in a better order; gives its cycles. In debug builds a checker compares what it does
/// with what it did.
fn ordered(code: &mut Allocated, core: &Core, known: &Known) -> Result<u64, ThumbError> {
    let before = cfg!(debug_assertions).then(|| code.clone());
    reorder::reorder(code, core, known);
    hoist::hoist(code, core);
    if let Some(before) = before {
        agree::agree(&before, code, core.arch).map_err(ThumbError::Bug)?;
    }
    Ok(path::longest(code, core))
}
