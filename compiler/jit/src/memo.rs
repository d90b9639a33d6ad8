//! What a tick of one key computes from inputs and live values alone, kept until one of these
//! changes: a device's axes come a thousand times a second, and live values seldom move.
//!
//! ```text
//!   z = in z; a = sub z c; b = mul_top a a; ..; out b       a and b are members, b is a result
//!
//!   z = in z                      z is a source
//!   brif z == kept[0], known, changed
//!   changed: a, b as they are; kept[0] = z; kept[1] = b
//!   known:   b = kept[1], where it is first read
//! ```
//!
//! Equal words give equal results, so nothing is kept that could be another than what would be
//! computed. A cell can be a source, too, until it is written; it is one where nothing but live
//! values and such cells decides what it becomes, as of a live value that glides. Any other seldom
//! is what it was.
//!
//! Not here: several keys, of which each would need words of its own.

use super::zero::results;
use std::collections::BTreeSet;
use whippen_ids::IdMap;
use whippen_kernel::op::Effect;
use whippen_kernel::{Cell, Inst, Kernel, Op, Region, Type, Value};

/// How many instructions a change has to spare, so that looking for one is worth while.
const MEMBERS_MIN: usize = 32;

/// What no source is, though its word may be anything: what is kept before the first tick.
pub(super) const NO_WORD: i64 = i64::MIN;

/// Instructions that are computed where a source has changed.
#[derive(Debug, PartialEq, Eq)]
pub(super) struct Memo {
    /// What is compared.
    pub sources: Vec<Value>,
    /// Where the instructions stand in their region.
    pub members: Vec<usize>,
    /// What other instructions read of them.
    pub results: Vec<Value>,
    /// Where its words begin: one for each source, then one for each result.
    pub first_word: usize,
}

/// A region in the order in which it is translated.
#[derive(Debug, PartialEq, Eq)]
pub(super) struct Plan {
    /// What comes first.
    pub front: Vec<Step>,
    /// The instructions after it.
    pub rest: Region,
    /// How many words all memos need.
    pub words: usize,
}

/// A step of what comes first.
#[derive(Debug, PartialEq, Eq)]
pub(super) enum Step {
    /// The instruction at a place.
    Inst(usize),
    Memo(Memo),
}

/// A read that is compared with the last tick's.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Source {
    /// Of a live value, or of what never differs from tick to tick.
    Live(Value),
    /// Of a cell that only live values move.
    Cell(Value),
    /// Of an input.
    Input(Value),
}

/// What a value depends on.
type Sources = BTreeSet<Source>;

/// Where a value stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Class {
    Constant,
    /// Live values and cells.
    Settings,
    /// Inputs and live values.
    Inputs,
}

impl Source {
    fn value(self) -> Value {
        match self {
            Source::Live(value) | Source::Cell(value) | Source::Input(value) => value,
        }
    }
}

/// None: on both inputs and cells.
fn class(sources: &Sources) -> Option<Class> {
    let any = |is: fn(&Source) -> bool| sources.iter().any(is);
    match (
        any(|source| matches!(source, Source::Input(_))),
        any(|source| matches!(source, Source::Cell(_))),
    ) {
        (true, true) => None,
        (true, false) => Some(Class::Inputs),
        (false, _) if sources.is_empty() => Some(Class::Constant),
        (false, _) => Some(Class::Settings),
    }
}

/// How to translate a kernel's tick for one key; none: nothing is worth being kept.
pub(super) fn plan(kernel: &Kernel) -> Option<Plan> {
    let region = &kernel.tick;
    let sources = sources(kernel, &settled_cells(kernel));
    let class = |inst: &Inst| match inst.results[..] {
        [value] => sources[value].as_ref().and_then(class),
        _ => None,
    };
    let places = |wanted: Class| {
        let all = region.insts.iter().enumerate();
        all.filter(move |(_, inst)| class(inst) == Some(wanted))
            .map(|(place, _)| place)
    };
    let is_read = |place: &usize| region.insts[*place].op.row().effect != Effect::Pure;
    let mut front: Vec<Step> = places(Class::Constant).map(Step::Inst).collect();
    let mut words = 0;
    for wanted in [Class::Settings, Class::Inputs] {
        let (reads, pure): (Vec<usize>, Vec<usize>) = places(wanted).partition(is_read);
        front.extend(reads.into_iter().map(Step::Inst));
        for (sources, members) in groups(region, &pure, &sources) {
            if members.len() < MEMBERS_MIN {
                front.extend(members.into_iter().map(Step::Inst));
                continue;
            }
            let memo = Memo {
                sources: sources.into_iter().map(Source::value).collect(),
                results: results(region, &members),
                members,
                first_word: words,
            };
            words += memo.sources.len() + memo.results.len();
            front.push(Step::Memo(memo));
        }
    }
    let stays = region.insts.iter().filter(|inst| class(inst).is_none());
    (words > 0).then(|| Plan {
        rest: Region {
            insts: stays.cloned().collect(),
            ..region.clone()
        },
        front,
        words,
    })
}

/// What the values of a tick depend on; none: on more than sources.
fn sources(kernel: &Kernel, settled: &[bool]) -> IdMap<Value, Option<Sources>> {
    let mut found: IdMap<Value, Option<Sources>> = IdMap::filled(None, kernel.values.len());
    let mut written = vec![false; kernel.cells.len()];
    for inst in &kernel.tick.insts {
        let of =
            |source: fn(Value) -> Source| Some(inst.results.iter().copied().map(source).collect());
        let own: Option<Sources> = match inst.op {
            Op::In(_) => of(Source::Input),
            Op::Live(_) | Op::Keyed(_) => of(Source::Live),
            Op::Get(cell) if settled[cell as usize] && !written[cell as usize] => of(Source::Cell),
            _ if inst.op.row().effect == Effect::Pure => {
                inst.args.iter().try_fold(Sources::new(), |mut all, arg| {
                    all.extend(found[arg].as_ref()?);
                    Some(all)
                })
            }
            _ => None,
        };
        for result in &inst.results {
            found[result] = own.clone();
        }
        for cell in inst.all_insts().flat_map(written_by) {
            written[cell as usize] = true;
        }
    }
    found
}

fn written_by(inst: &Inst) -> Vec<u32> {
    match inst.op {
        Op::Set(cell) | Op::SetAt(cell) => vec![cell],
        Op::Wave(e, v) => vec![e, v],
        _ => Vec::new(),
    }
}

/// The cells of one word that nothing but live values and such cells moves.
fn settled_cells(kernel: &Kernel) -> Vec<bool> {
    let one_word = |cell: &Cell| cell.len == 1 && cell.ty != Type::I64;
    let mut settled: Vec<bool> = kernel.cells.iter().map(one_word).collect();
    let sets = |inst: &Inst| matches!(inst.op, Op::Set(_));
    for inst in kernel.tick.insts.iter().filter(|inst| !sets(inst)) {
        for cell in inst.all_insts().flat_map(written_by) {
            settled[cell as usize] = false;
        }
    }
    loop {
        let sources = sources(kernel, &settled);
        let by_settings = |value: Value| {
            let class = sources[value].as_ref().and_then(class);
            matches!(class, Some(Class::Constant | Class::Settings))
        };
        let moved = kernel.tick.insts.iter().filter_map(|inst| match inst.op {
            Op::Set(cell) if settled[cell as usize] && !by_settings(inst.args[0]) => Some(cell),
            _ => None,
        });
        let moved: Vec<u32> = moved.collect();
        if moved.is_empty() {
            return settled;
        }
        for cell in moved {
            settled[cell as usize] = false;
        }
    }
}

/// Instructions that share sources, in their order, with all that they read.
fn groups(
    region: &Region,
    places: &[usize],
    sources: &IdMap<Value, Option<Sources>>,
) -> Vec<(Sources, Vec<usize>)> {
    let mut groups: Vec<(Sources, Vec<usize>)> = Vec::new();
    for place in places {
        let mut all = sources[region.insts[*place].results[0]]
            .clone()
            .unwrap_or_default();
        let mut members = vec![*place];
        groups.retain_mut(|(theirs, places)| {
            let apart = theirs.is_disjoint(&all);
            if !apart {
                all.append(theirs);
                members.append(places);
            }
            apart
        });
        members.sort_unstable();
        groups.push((all, members));
    }
    groups
}

#[cfg(test)]
mod tests;
