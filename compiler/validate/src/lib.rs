//! Translation validation by symbolic execution with normal forms: whether the bytes of an image
//! do what the modes say.
//!
//! ```text
//!   Mode  --kernel----> cells, words out, events, next mode  --.
//!                         the same terms on every path?          check --> Verdict
//!   bytes --machine---> memory, registers, next code          --'
//! ```
//!
//! Both are run with terms for contents, in exact integers: what wraps, wraps in the term. Where a
//! branch or a choice depends on what is not known there are two cases, each with what it assumes;
//! all cases together are all inputs.
//!
//! | part | what it settles |
//! | --- | --- |
//! | [`places`] | the question: modes, bytes, and where the state keeps what |
//! | `term`, `normal`, `apply` | terms and their normal forms |
//! | `truth` | comparisons, as decision diagrams |
//! | `bounds` | what is known of a term in a case |
//! | `choices` | what a term chooses |
//! | `within` | cases of a value by itself |
//! | `memory` | loads and stores by address |
//! | `kernel`, `effects`, `quotient`, `divide` | the run of a mode |
//! | `machine`, `alu`, `multiply`, `access` | the run of bytes |
//! | `flags` | the condition flags |
//! | `join` | branches whose sides come together again |
//! | `contract` | routines that are called, each shown once |
//! | `root` | loops that find a square root |
//! | `check`, `entry`, `end` | the comparison of modes, and of the tick's entry and end |
//! | `around` | rings, pointers and the tick's number at both |
//! | `room` | how many events a tick can have |
//! | `prepare`, `first` | the routines that prepare keys, and what memory holds before |
//! | `again` | validated code with some of its bytes changed |
//! | `sample` | what is not shown is tried with numbers: whether it is wrong |
//!
//! It knows neither selection nor registers' allocation; what an instruction means is written here
//! again. What is believed all the same: docs/validate.md. Not here: cycles (`budget`), what modes
//! have to do with the Kernel's tick (`modes::verify`).

mod access;
mod again;
mod alu;
mod apply;
mod around;
mod bounds;
mod check;
mod choices;
mod contract;
mod divide;
mod effects;
mod end;
mod entry;
mod first;
mod flags;
mod join;
mod kernel;
mod machine;
mod memory;
mod multiply;
mod normal;
pub mod places;
mod prepare;
mod quotient;
mod room;
mod root;
mod sample;
mod show;
mod stop;
mod strings;
mod term;
#[cfg(test)]
mod tests;
mod truth;
mod within;

pub use again::{Proven, Ticks};
pub use places::{Called, Code, LinePlace, Places, Question, RingPlace, Shared, Symbols};
pub use stop::Reason;

use std::fmt;

use whippen_modes::ModeId;

use check::{Assumed, Path, Start, Used, again_with_facts, all_cases, run_case};
use prepare::{Shown, check_routine};
use sample::{refute, refute_around, refute_routine, refute_shared};
use stop::Doubt;
use term::Terms;
use whippen_deterministic::parallel;

/// Cases of a mode, at most.
const CASES_MAX: usize = 4_000;

/// What is known of a piece of code.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Verdict {
    /// It does what the modes say, in so many cases.
    Validated {
        /// Cases that were run.
        cases: usize,
    },
    /// It could not be shown.
    Unproven {
        /// The kind of reason.
        reason: Reason,
        /// Why, with the first value that differs or the first instruction that is not followed.
        why: String,
    },
    /// It does something else for some numbers.
    Refuted {
        /// What, for these numbers.
        why: String,
    },
}

impl Verdict {
    /// Whether it is validated.
    pub fn is_validated(&self) -> bool {
        matches!(self, Verdict::Validated { .. })
    }

    fn of(doubt: Doubt) -> Verdict {
        let Doubt {
            reason,
            why,
            is_certain,
        } = doubt;
        if is_certain {
            Verdict::Refuted { why }
        } else {
            Verdict::Unproven { reason, why }
        }
    }
}

impl fmt::Display for Verdict {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Verdict::Validated { cases } => write!(f, "validated, {cases} cases"),
            Verdict::Unproven { reason, why } => write!(f, "unproven ({reason}): {why}"),
            Verdict::Refuted { why } => write!(f, "refuted: {why}"),
        }
    }
}

/// A routine that prepares keys.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Routine {
    /// All, for the first tick.
    Init,
    /// One, while others play.
    Begin,
}

impl Routine {
    /// Both.
    pub const ALL: [Routine; 2] = [Routine::Init, Routine::Begin];

    /// Its name, as symbols end in it.
    pub fn name(self) -> &'static str {
        match self {
            Routine::Init => "init",
            Routine::Begin => "begin",
        }
    }
}

impl fmt::Display for Routine {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// What is known of the code of a core's keys.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Report {
    /// The registers and the memory that the tick's entry leaves to modes.
    pub entry: Verdict,
    /// Each word that the tick's entry computes for all keys.
    pub shared: Vec<Verdict>,
    /// The tables.
    pub tables: Verdict,
    /// Each mode.
    pub modes: Vec<Verdict>,
    /// What each routine leaves keys to begin with.
    pub routines: [Verdict; 2],
}

/// Compares the code of all modes with the modes.
///
/// A verdict on a mode holds for a tick of a key that begins with registers and shared words as the
/// tick's entry should leave them.
pub fn validate(question: &Question) -> Report {
    let begun = begin(question);
    let (entry, shared) = validate_entry(question, &begun);
    let ids: Vec<ModeId> = question.modes.modes.ids().collect();
    let checked = parallel::map(ids, |mode| check_mode(question, &begun, mode));
    let (mut modes, used): (Vec<Verdict>, Vec<Used>) = checked.into_iter().unzip();
    refuse_clobbered(&mut modes, &used);
    Report {
        entry,
        shared,
        tables: entry::check_tables(question),
        modes,
        routines: Routine::ALL.map(|routine| validate_routine(question, routine)),
    }
}

/// What a routine leaves keys to begin with.
pub fn validate_routine(question: &Question, routine: Routine) -> Verdict {
    match show_routine(question, routine) {
        Err(verdict) => verdict,
        Ok(shown) => Verdict::Validated { cases: shown.cases },
    }
}

/// What is shown of a routine's code.
///
/// # Errors
/// It is unproven or refuted.
fn show_routine(question: &Question, routine: Routine) -> Result<Shown, Verdict> {
    let mut terms = prepare::terms(question);
    check_routine(question, &mut terms, routine).map_err(|doubt| {
        let refuted = refute_routine(question, &mut terms, routine);
        refuted.map_or_else(|| Verdict::of(doubt), |why| Verdict::Refuted { why })
    })
}

/// The tick's entry, and each word that it computes.
fn validate_entry(question: &Question, begun: &Result<Begun, Doubt>) -> (Verdict, Vec<Verdict>) {
    let Begun { terms, shared, .. } = match begun {
        Ok(begun) => begun,
        Err(doubt) => {
            let results = question.shared.results.iter();
            let shared = results.map(|_| unproven_entry()).collect();
            let mut terms = entry::terms(question);
            return (of_around(question, &mut terms, doubt), shared);
        }
    };
    let (mut terms, mut shared) = (terms.clone(), shared.clone());
    for (word, verdict) in shared.iter_mut().enumerate() {
        if !verdict.is_validated()
            && let Some(why) = refute_shared(question, &mut terms, word)
        {
            *verdict = Verdict::Refuted { why };
        }
    }
    (Verdict::Validated { cases: 1 }, shared)
}

/// The verdict on a tick's entry and end that could not be shown.
fn of_around(question: &Question, terms: &mut Terms, doubt: &Doubt) -> Verdict {
    let refuted = refute_around(question, terms);
    refuted.map_or_else(
        || Verdict::of(doubt.clone()),
        |why| Verdict::Refuted { why },
    )
}

fn unproven_entry() -> Verdict {
    Verdict::of(Doubt::new(Reason::Entry, "the tick's entry is unproven"))
}

/// Compares the code of one mode with the mode, without what modes leave to each other in
/// registers.
pub fn validate_mode(question: &Question, mode: ModeId) -> Verdict {
    check_mode(question, &begin(question), mode).0
}

/// What modes begin with.
struct Begun {
    /// The terms of it.
    terms: Terms,
    start: Start,
    /// Each word that the entry computes.
    shared: Vec<Verdict>,
}

/// Runs the tick's entry.
fn begin(question: &Question) -> Result<Begun, Doubt> {
    question.check_room()?;
    let mut terms = entry::terms(question);
    let (start, shared) = entry::check_entry(question, &mut terms)?;
    Ok(Begun {
        terms,
        start,
        shared,
    })
}

/// One mode, with terms of its own, so that no verdict depends on another mode.
fn check_mode(question: &Question, begun: &Result<Begun, Doubt>, mode: ModeId) -> (Verdict, Used) {
    let Ok(Begun { terms, start, .. }) = begun else {
        return (unproven_entry(), Used::default());
    };
    let mut terms = terms.clone();
    match cases_of(question, &mut terms, start, mode, vec![Vec::new()]) {
        Err(verdict) => (verdict, Used::default()),
        Ok(all) => {
            let used = all.iter().map(|(_, path)| path.used);
            let used = used.fold(Used::default(), Used::and);
            (Verdict::Validated { cases: all.len() }, used)
        }
    }
}

/// A mode in some of its cases.
///
/// # Errors
/// What is unproven or refuted.
fn cases_of(
    question: &Question,
    terms: &mut Terms,
    start: &Start,
    mode: ModeId,
    cases: Vec<Assumed>,
) -> Result<Vec<(Assumed, Path)>, Verdict> {
    let run =
        |terms: &mut Terms| again_with_facts(terms, |terms| run_case(question, terms, mode, start));
    let kept = terms.clone();
    let mut told = all_cases(terms, cases.clone(), CASES_MAX, run);
    if told.is_err() && !kept.by_value && !kept.is_sampling() {
        *terms = kept;
        terms.by_value = true;
        // What is said of it is why it is not shown at first.
        told = all_cases(terms, cases, CASES_MAX, run).or(told);
    }
    told.map_err(|doubt| {
        let refuted = refute(question, terms, mode);
        refuted.map_or_else(|| Verdict::of(doubt), |why| Verdict::Refuted { why })
    })
}

/// A register that one mode changes and another one finds is not what the entry left there.
fn refuse_clobbered(modes: &mut [Verdict], used: &[Used]) {
    let read = used.iter().fold(0, |all, own| all | own.read);
    for (verdict, own) in modes.iter_mut().zip(used) {
        let both = own.changed & read;
        if both != 0 {
            *verdict = clobbered(both);
        }
    }
}

fn clobbered(registers: u16) -> Verdict {
    let register = registers.trailing_zeros();
    let why = format!("it changes r{register}, which a mode reads");
    Verdict::of(Doubt::new(Reason::Entry, why))
}
