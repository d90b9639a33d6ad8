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
//! | `term`, `normal` | terms and their normal forms |
//! | `truth` | comparisons, as decision diagrams |
//! | `bounds` | what is known of a term in a case |
//! | `memory` | loads and stores by address |
//! | `kernel`, `effects` | the run of a mode |
//! | `machine`, `alu`, `multiply`, `access` | the run of bytes |
//! | `check`, `entry` | the comparison of modes, and of the tick's entry |
//!
//! It knows neither selection nor registers' allocation; what an instruction means is written here
//! again. What is believed all the same: docs/validate.md. Not here: cycles (`budget`), what modes
//! have to do with the Kernel's tick (`modes::verify`).

mod access;
mod alu;
mod bounds;
mod check;
mod effects;
mod entry;
mod kernel;
mod machine;
mod memory;
mod multiply;
mod normal;
pub mod places;
mod show;
mod stop;
mod term;
#[cfg(test)]
mod tests;
mod truth;

pub use places::{Code, LinePlace, Places, Question, Shared, Symbols};

use std::fmt;

use whippen_modes::ModeId;

use check::{Used, all_cases, check_case};
use term::Terms;
use whippen_deterministic::parallel;

/// Cases of a mode, at most.
const CASES_MAX: usize = 20_000;

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
        /// Why, with the first value that differs or the first instruction that is not followed.
        why: String,
    },
}

impl Verdict {
    /// Whether it is validated.
    pub fn is_validated(&self) -> bool {
        matches!(self, Verdict::Validated { .. })
    }
}

impl fmt::Display for Verdict {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Verdict::Validated { cases } => write!(f, "validated, {cases} cases"),
            Verdict::Unproven { why } => write!(f, "unproven: {why}"),
        }
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
}

/// Compares the code of all modes with the modes.
///
/// A verdict on a mode holds for a tick of a key that begins with registers and shared words as the
/// tick's entry should leave them.
pub fn validate(question: &Question) -> Report {
    let mut terms = entry::terms(question);
    let (entry, shared) = match entry::check_entry(question, &mut terms) {
        Ok((_, shared)) => (Verdict::Validated { cases: 1 }, shared),
        Err(why) => {
            let unknown = || Verdict::Unproven {
                why: "the tick's entry is unproven".to_string(),
            };
            let shared = question.shared.results.iter().map(|_| unknown());
            let shared = shared.collect();
            (Verdict::Unproven { why }, shared)
        }
    };
    let ids: Vec<ModeId> = question.modes.modes.ids().collect();
    let checked = parallel::map(ids, |mode| check_mode(question, mode));
    let (mut modes, used): (Vec<Verdict>, Vec<Used>) = checked.into_iter().unzip();
    refuse_clobbered(&mut modes, &used);
    Report {
        entry,
        shared,
        tables: entry::check_tables(question),
        modes,
    }
}

/// Compares the code of one mode with the mode, without what modes leave to each other in
/// registers.
pub fn validate_mode(question: &Question, mode: ModeId) -> Verdict {
    check_mode(question, mode).0
}

/// One mode, with terms of its own.
fn check_mode(question: &Question, mode: ModeId) -> (Verdict, Used) {
    let mut terms = entry::terms(question);
    let start = match entry::check_entry(question, &mut terms) {
        Ok((start, _)) => start,
        Err(_) => {
            let why = "the tick's entry is unproven".to_string();
            return (Verdict::Unproven { why }, Used::default());
        }
    };
    let run = |terms: &mut Terms| check_case(question, terms, mode, &start);
    match all_cases(&mut terms, CASES_MAX, run) {
        Err(why) => (Verdict::Unproven { why }, Used::default()),
        Ok(all) => {
            let used = all.iter().fold(Used::default(), |sum, own| Used {
                read: sum.read | own.read,
                changed: sum.changed | own.changed,
            });
            (Verdict::Validated { cases: all.len() }, used)
        }
    }
}

/// A register that one mode changes and another one finds is not what the entry left there.
fn refuse_clobbered(modes: &mut [Verdict], used: &[Used]) {
    let read = used.iter().fold(0, |all, own| all | own.read);
    for (verdict, own) in modes.iter_mut().zip(used) {
        let both = own.changed & read;
        if both != 0 {
            let why = format!("it changes r{}, which a mode reads", both.trailing_zeros());
            *verdict = Verdict::Unproven { why };
        }
    }
}
