//! Validated code judged again, with some of its bytes changed.
//!
//! Numbers are tried first: the Kernel's side of each tick is run once for all changes. Then only
//! those cases are run again of which the path has looked at a byte that is changed. Of any other
//! case the run would be the same, instruction by instruction, and all cases that there were are
//! all inputs; so a change is validated here only where every case is.

use std::ops::Range;

use rustc_hash::FxHashMap;
use whippen_deterministic::parallel;
use whippen_modes::ModeId;

use crate::check::{Assumed, Path, Start, Used, Wanted, run_code, run_kernel};
use crate::contract;
use crate::entry::{check_entry, check_tables};
use crate::places::{Code, Question};
use crate::root;
use crate::sample::{TICKS, begin_tick, refute_shared, witness};
use crate::stop::{Doubt, Reason};
use crate::term::Terms;
use crate::{
    Begun, Routine, Verdict, begin, cases_of, check_mode, clobbered, of_around, show_routine,
};

/// Code of keys that is validated, with what each case looked at.
pub struct Proven<'a> {
    question: Question<'a>,
    begun: Begun,
    modes: Vec<Option<ProvenMode>>,
    /// The halfwords of code that each routine looked at, where what it does is shown.
    routines: [Vec<u32>; 2],
}

/// A mode that is validated.
struct ProvenMode {
    /// The terms of what cases assume.
    terms: Terms,
    cases: Vec<(Assumed, Path)>,
}

/// Ticks of a mode with numbers, to be tried with other bytes.
pub struct Ticks {
    mode: ModeId,
    /// Those that are begun; none where the numbers say nothing.
    begun: Vec<Option<Tick>>,
}

/// A tick with numbers of which the Kernel's side has been run.
struct Tick {
    terms: Terms,
    start: Start,
    wanted: Wanted,
}

impl Ticks {
    /// Whether the code leaves something else than the mode with some of the numbers.
    fn refute(&mut self, proven: &Proven, question: &Question) -> Option<String> {
        (0..TICKS).find_map(|tick| {
            let at = tick as usize;
            if at == self.begun.len() {
                self.begun.push(proven.tick(self.mode, tick));
            }
            let Tick {
                terms,
                start,
                wanted,
            } = self.begun[at].as_ref()?;
            witness(run_code(question, &mut terms.clone(), start, wanted))
        })
    }
}

/// Whether a path looked at one of these bytes.
fn meets(looked_at: &[u32], changed: &Range<u32>) -> bool {
    let first = looked_at.partition_point(|half| half + 1 < changed.start);
    looked_at.get(first).is_some_and(|half| *half < changed.end)
}

impl<'a> Proven<'a> {
    /// Validates the code; a mode that is not validated is left out.
    ///
    /// # Errors
    /// The verdict on the tick's entry, on one of its words or on the tables, where that is not
    /// validated.
    pub fn new(question: &Question<'a>) -> Result<Proven<'a>, Verdict> {
        let begun = begin(question).map_err(Verdict::of)?;
        let mut before = vec![check_tables(question)];
        before.extend(begun.shared.iter().cloned());
        if let Some(verdict) = before.into_iter().find(|verdict| !verdict.is_validated()) {
            return Err(verdict);
        }
        let modes = parallel::map(question.modes.modes.ids().collect(), |mode| {
            let mut terms = begun.terms.clone();
            let all = vec![Vec::new()];
            let cases = cases_of(question, &mut terms, &begun.start, mode, all).ok()?;
            Some(ProvenMode { terms, cases })
        });
        let routines = Routine::ALL.map(|routine| {
            let shown = show_routine(question, routine);
            shown.map_or_else(|_| Vec::new(), |shown| shown.looked_at)
        });
        Ok(Proven {
            question: question.clone(),
            begun,
            modes,
            routines,
        })
    }

    /// The modes that are validated.
    pub fn modes(&self) -> Vec<ModeId> {
        let ids = self.question.modes.modes.ids().zip(&self.modes);
        ids.filter(|(_, own)| own.is_some())
            .map(|(id, _)| id)
            .collect()
    }

    /// Ticks of a mode.
    pub fn ticks(&self, mode: ModeId) -> Ticks {
        Ticks {
            mode,
            begun: Vec::new(),
        }
    }

    fn tick(&self, mode: ModeId, seed: u64) -> Option<Tick> {
        let mut terms = self.begun.terms.clone();
        begin_tick(&self.question, &mut terms, seed, FxHashMap::default());
        let (start, _) = check_entry(&self.question, &mut terms).ok()?;
        terms.known.forget();
        let wanted = run_kernel(&self.question, &mut terms, mode).ok()?;
        Some(Tick {
            terms,
            start,
            wanted,
        })
    }

    /// Judges code that is other in a range of addresses: the first mode of which it is not shown
    /// that it is as it was. `cases` of what is validated are those that looked at the change.
    ///
    /// It must be the code of the question but for that range, in which there are no tables.
    pub fn judge(&self, ticks: &mut Ticks, code: &Code, changed: &Range<u32>) -> Verdict {
        let question = Question {
            code,
            ..self.question.clone()
        };
        if self.is_unshown(&question, changed) {
            if let Some(why) = ticks.refute(self, &question) {
                return Verdict::Refuted { why };
            }
            let why = "what a called routine or a loop gives is no longer shown";
            return Verdict::of(Doubt::new(Reason::Code, why));
        }
        let mut of_routines = 0;
        for (routine, looked_at) in Routine::ALL.into_iter().zip(&self.routines) {
            if meets(looked_at, changed) {
                match show_routine(&question, routine) {
                    Err(verdict) => return verdict,
                    Ok(shown) => of_routines += shown.cases,
                }
            }
        }
        let others = if meets(&self.begun.start.looked_at, changed) {
            self.judge_entry(&question, changed)
        } else if of_routines == 0
            && let Some(why) = ticks.refute(self, &question)
        {
            Verdict::Refuted { why }
        } else {
            self.judge_modes(&question, changed)
        };
        match others {
            Verdict::Validated { cases } => Verdict::Validated {
                cases: cases + of_routines,
            },
            other => other,
        }
    }

    /// Whether a routine or a loop is changed and not shown to be what it was.
    fn is_unshown(&self, question: &Question, changed: &Range<u32>) -> bool {
        let Terms {
            contracts, roots, ..
        } = &self.begun.terms;
        let called = contracts.iter().map(|own| &own.looked_at);
        let mut all = called.chain(roots.iter().map(|own| &own.looked_at));
        if !all.any(|looked_at| meets(looked_at, changed)) {
            return false;
        }
        let now = contract::shown(question);
        now != *contracts || root::shown(question, &now) != *roots
    }

    fn judge_modes(&self, question: &Question, changed: &Range<u32>) -> Verdict {
        let (mut cases, mut used) = (0, Used::default());
        for (mode, own) in self.question.modes.modes.ids().zip(&self.modes) {
            let Some(own) = own else { continue };
            let is_met = |(_, path): &&(Assumed, Path)| meets(&path.looked_at, changed);
            let (met, others): (Vec<_>, Vec<_>) = own.cases.iter().partition(is_met);
            used = others
                .iter()
                .fold(used, |all, (_, path)| all.and(path.used));
            if met.is_empty() {
                continue;
            }
            let met = met.into_iter().map(|(assumed, _)| assumed.clone());
            let mut terms = own.terms.clone();
            match cases_of(question, &mut terms, &self.begun.start, mode, met.collect()) {
                Err(verdict) => return verdict,
                Ok(all) => {
                    cases += all.len();
                    used = all.iter().fold(used, |all, (_, path)| all.and(path.used));
                }
            }
        }
        match used.changed & used.read {
            0 => Verdict::Validated { cases },
            both => clobbered(both),
        }
    }

    /// The same where the tick's entry looks at what is changed.
    fn judge_entry(&self, question: &Question, changed: &Range<u32>) -> Verdict {
        let mut terms = self.begun.terms.clone();
        let (start, shared) = match check_entry(question, &mut terms) {
            Ok(told) => told,
            Err(doubt) => return of_around(question, &mut terms, &doubt),
        };
        for (word, verdict) in shared.iter().enumerate() {
            if verdict.is_validated() {
                continue;
            }
            let refuted = refute_shared(question, &mut terms, word);
            return refuted.map_or_else(|| verdict.clone(), |why| Verdict::Refuted { why });
        }
        if start.leaves_as(&self.begun.start) {
            return match self.judge_modes(question, changed) {
                Verdict::Validated { cases } => Verdict::Validated { cases: cases + 1 },
                other => other,
            };
        }
        let begun = Ok(Begun {
            terms,
            start,
            shared,
        });
        let (mut cases, mut used) = (1, Used::default());
        for mode in self.modes() {
            let (verdict, own) = check_mode(question, &begun, mode);
            let Verdict::Validated { cases: more } = verdict else {
                return verdict;
            };
            (cases, used) = (cases + more, used.and(own));
        }
        match used.changed & used.read {
            0 => Verdict::Validated { cases },
            both => clobbered(both),
        }
    }
}
