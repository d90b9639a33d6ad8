//! The tick of a core's keys: a bound for each mode of a key, and for what surrounds the keys.
//!
//! ```text
//!   NAME_tick --> mode of key 0 --> mode of key 1 --> ... --> NAME.end --> return
//!   '- frame -'   '- key -------'                             '- frame -------'
//! ```
//!
//! A key's mode is where its tick begins, so two modes never add up for one key, and the bound of a
//! key is the largest of its modes'. Every piece begins behind a taken branch, where the pipeline
//! holds nothing of the piece before ([`Bound::settled`] says so), so the pieces' sums are exact.

use std::collections::{BTreeMap, BTreeSet};

use whippen_deterministic::parallel;
use whippen_isa::timing::{Core, Evidence, Target};

use super::memory::{Interference, Reach};
use super::program::Program;
use super::tick_handler::find;
use super::{
    Annotations, Bound, ByContention, Known, NotBounded, Query, bound, bound_by_contention,
};

/// The bounds of a tick.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Tick {
    /// Each mode: its symbol and its bound, dispatch to the next key included.
    pub modes: Vec<(String, Bound)>,
    /// From the entry to the first key.
    pub entry: Bound,
    /// From the last key to the return.
    pub end: Bound,
}

/// Where the tick of `name` begins, its modes, and its end: the symbols that `thumb` gives them.
pub(super) struct Places {
    pub tick: u32,
    pub modes: Vec<(String, u32)>,
    pub end: u32,
}

impl Places {
    pub(super) fn find(program: &Program, name: &str) -> Result<Self, NotBounded> {
        let of = |name: String| {
            program
                .symbols
                .get(&name)
                .copied()
                .ok_or(NotBounded::NoSymbol { name })
        };
        let prefix = format!("{name}.mode.");
        let number = |symbol: &str| symbol.strip_prefix(&prefix)?.parse::<usize>().ok();
        let mut modes: Vec<(usize, String, u32)> = program
            .symbols
            .iter()
            .filter_map(|(symbol, &at)| Some((number(symbol)?, symbol.clone(), at)))
            .collect();
        modes.sort();
        let modes = modes
            .into_iter()
            .map(|(_, symbol, at)| (symbol, at))
            .collect();
        Ok(Self {
            tick: of(format!("{name}_tick"))?,
            modes,
            end: of(format!("{name}.end"))?,
        })
    }

    /// Where its pieces end: where the next one begins.
    fn stops(&self) -> BTreeSet<u32> {
        let modes = self.modes.iter().map(|(_, at)| *at);
        modes.chain([self.end]).collect()
    }
}

/// Bounds the tick of `name` with each of two interferences. It returns to where it was called,
/// `entered` is what registers hold then ([`Annotations::entered`]); `bases` are the registers that
/// point into known memory while keys are ticked, with the banks of that memory.
///
/// # Errors
/// What cannot be bounded, or is not there.
pub fn ticks(
    program: &Program,
    name: &str,
    core: &Core,
    interferences: ByContention<&Interference>,
    return_to: Option<Target>,
    entered: BTreeMap<u8, [u32; 2]>,
    bases: BTreeMap<u8, Reach>,
) -> Result<ByContention<Tick>, NotBounded> {
    let places = Places::find(program, name)?;
    let annotations = Annotations {
        return_to,
        bases,
        stops: places.stops(),
        ..program.annotations.clone()
    };
    let called = Annotations {
        entered,
        ..annotations.clone()
    };
    let inside = Annotations {
        inside: true,
        ..annotations.clone()
    };
    let of = |entry, annotations| {
        let query = Query {
            core,
            code: &program.code,
            entry,
            annotations,
            interference: None,
        };
        bound_by_contention(&query, interferences)
    };
    let (entry, end) = (of(places.tick, &called)?, of(places.end, &inside)?);
    let mut ticks = entry.zip(end).map(|(entry, end)| Tick {
        modes: Vec::new(),
        entry,
        end,
    });
    let modes = places.modes.iter().collect();
    let bounds = parallel::map(modes, |(_, at)| of(*at, &annotations));
    for ((symbol, _), bounds) in places.modes.iter().zip(bounds) {
        let bounds = bounds?;
        ticks.alone.modes.push((symbol.clone(), bounds.alone));
        ticks
            .contended
            .modes
            .push((symbol.clone(), bounds.contended));
    }
    ticks.map(|tick| tick.checked(&places)).both()
}

/// Bounds the tick of `name` wherever it is called from, where each access and each fetch takes one
/// cycle, nobody else is at the memory, and all data lie in one memory.
///
/// # Errors
/// What cannot be bounded, or is not there.
pub fn tick_without_waiting(
    program: &Program,
    name: &str,
    core: &Core,
) -> Result<Tick, NotBounded> {
    let places = Places::find(program, name)?;
    let annotations = Annotations {
        stops: places.stops(),
        ..program.annotations.clone()
    };
    let inside = Annotations {
        inside: true,
        ..annotations.clone()
    };
    let of = |entry, annotations| {
        bound(&Query {
            core,
            code: &program.code,
            entry,
            annotations,
            interference: None,
        })
    };
    let mut modes = Vec::new();
    for (symbol, at) in &places.modes {
        modes.push((symbol.clone(), of(*at, &annotations)?));
    }
    let tick = Tick {
        modes,
        entry: of(places.tick, &annotations)?,
        end: of(places.end, &inside)?,
    };
    tick.checked(&places)
}

/// Bounds a function around the tick of so many keys of a name, which is bounded, under the
/// conditions of [`tick_without_waiting`].
///
/// # Errors
/// What cannot be bounded, or is not there.
pub fn calling_tick_without_waiting(
    program: &Program,
    function: &str,
    (name, tick, keys): (&str, &Tick, u32),
    core: &Core,
) -> Result<Bound, NotBounded> {
    let called = Known {
        cycles: tick.cycles_max(keys),
        stack_bytes: tick.stack_bytes_max(),
    };
    let annotations = Annotations {
        known: [((None, Places::find(program, name)?.tick), called)].into(),
        ..program.annotations.clone()
    };
    bound(&Query {
        core,
        code: &program.code,
        entry: find(program, function)?,
        annotations: &annotations,
        interference: None,
    })
}

impl Tick {
    /// The worst-case mode.
    pub fn worst_case(&self) -> Option<&(String, Bound)> {
        self.modes.iter().max_by_key(|(_, bound)| bound.cycles_max)
    }

    /// Cycles of a key, at most.
    pub fn key_cycles_max(&self) -> u64 {
        self.worst_case().map_or(0, |(_, bound)| bound.cycles_max)
    }

    /// Cycles around the keys, at most.
    pub fn frame_cycles_max(&self) -> u64 {
        self.entry.cycles_max + self.end.cycles_max
    }

    /// Cycles of a tick with so many keys, at most.
    pub fn cycles_max(&self, keys: u32) -> u64 {
        self.frame_cycles_max() + u64::from(keys) * self.key_cycles_max()
    }

    /// Whether the pieces fit together: each begins with the pipeline and the stack as the one
    /// before leaves them.
    fn checked(self, places: &Places) -> Result<Self, NotBounded> {
        let keys_keep_the_stack = self.modes.iter().all(|(_, bound)| bound.stack_left == 0);
        if !keys_keep_the_stack || self.entry.stack_left + self.end.stack_left != 0 {
            return Err(NotBounded::Stack {
                address: places.end,
            });
        }
        if !self.bounds().all(|bound| bound.settled) {
            return Err(NotBounded::Unsettled {
                address: places.tick,
            });
        }
        Ok(self)
    }

    fn bounds(&self) -> impl Iterator<Item = &Bound> {
        self.modes
            .iter()
            .map(|(_, bound)| bound)
            .chain([&self.entry, &self.end])
    }

    /// As sure as the least sure.
    pub fn class(&self) -> Evidence {
        self.bounds()
            .map(|bound| bound.class)
            .max()
            .unwrap_or(Evidence::Exact)
    }

    /// Bytes of stack: the keys' code finds the stack as the entry leaves it.
    pub fn stack_bytes_max(&self) -> u32 {
        let keys = self
            .modes
            .iter()
            .map(|(_, bound)| bound.stack_bytes_max)
            .max()
            .unwrap_or(0);
        self.entry.stack_bytes_max + keys.max(self.end.stack_bytes_max)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn piece(cycles_max: u64, stack_bytes_max: u32) -> Bound {
        Bound {
            cycles_max,
            path: Vec::new(),
            class: Evidence::Exact,
            settled: true,
            delays_nobody: true,
            stack_bytes_max,
            stack_left: 0,
            infeasible: 0,
            merged: false,
            code_bytes: 0,
        }
    }

    /// Two modes of 30 and 20 cycles, the second with more stack, between 7 and 5.
    fn tick() -> Tick {
        Tick {
            modes: vec![
                ("k.mode.0".into(), piece(30, 8)),
                ("k.mode.1".into(), piece(20, 24)),
            ],
            entry: piece(7, 16),
            end: piece(5, 4),
        }
    }

    #[test]
    fn a_tick_is_its_frame_and_every_key_in_its_worst_mode() {
        let tick = tick();
        assert_eq!(
            tick.worst_case().map(|(name, _)| &name[..]),
            Some("k.mode.0")
        );
        assert_eq!(tick.key_cycles_max(), 30);
        assert_eq!([0, 1, 4].map(|keys| tick.cycles_max(keys)), [12, 42, 132]);
        assert_eq!(tick.stack_bytes_max(), 16 + 24);
        let mut deep = tick.clone();
        deep.end.stack_bytes_max = 40;
        assert_eq!(deep.stack_bytes_max(), 16 + 40);
        assert_eq!(tick.class(), Evidence::Exact);
        let mut rough = tick;
        rough.modes[1].1.class = Evidence::Rule;
        assert_eq!(rough.class(), Evidence::Rule);
        rough.end.class = Evidence::Estimate;
        assert_eq!(rough.class(), Evidence::Estimate);
    }

    /// What the entry leaves on the stack the end takes from it, a mode neither; none remembers
    /// something in the pipeline.
    #[test]
    fn pieces_that_do_not_fit_together_are_refused() {
        let places = Places {
            tick: 0x100,
            modes: Vec::new(),
            end: 0x200,
        };
        let checked = |change: &dyn Fn(&mut Tick)| {
            let mut changed = tick();
            change(&mut changed);
            changed.checked(&places).map(|_| ())
        };
        let stack = Err(NotBounded::Stack { address: 0x200 });
        let unsettled = Err(NotBounded::Unsettled { address: 0x100 });
        assert_eq!(checked(&|_| ()), Ok(()));
        let both = checked(&|tick| (tick.entry.stack_left, tick.end.stack_left) = (-8, 8));
        assert_eq!(both, Ok(()));
        assert_eq!(checked(&|tick| tick.entry.stack_left = -8), stack);
        assert_eq!(checked(&|tick| tick.end.stack_left = 8), stack);
        assert_eq!(checked(&|tick| tick.modes[1].1.stack_left = -8), stack);
        assert_eq!(checked(&|tick| tick.modes[1].1.settled = false), unsettled);
        assert_eq!(checked(&|tick| tick.entry.settled = false), unsettled);
        assert_eq!(checked(&|tick| tick.end.settled = false), unsettled);
    }
}
