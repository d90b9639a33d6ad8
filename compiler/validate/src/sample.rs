//! Runs with numbers: whether code that could not be validated is wrong.
//!
//! What a tick reads for the first time is then a random number of the interval that the Kernel
//! declares of it, or that the case which could not be shown assumes. Kernel and code are run as
//! ever; as nothing depends on what is not known, they leave numbers, and numbers that differ are
//! a witness. A run that leaves a declared interval is none.
//!
//! Not here: every state that numbers in their intervals make up counts, whether keys come to it or
//! not, as the code is made for all of them.

use rustc_hash::{FxHashMap, FxHashSet};
use whippen_deterministic::Rng;
use whippen_modes::ModeId;

use crate::bounds::{Interval, WORD, meet};
use crate::check::run_case;
use crate::end::check_end;
use crate::entry::check_entry;
use crate::memory::Address;
use crate::places::Question;
use crate::prepare::check_routine;
use crate::stop::{Doubt, Stop};
use crate::term::{Base, Kind, Term, Terms};
use crate::{Routine, Verdict};

/// Ticks that are tried.
pub(crate) const TICKS: u64 = 96;

/// Runs of a routine that are tried: what it does depends on a key's number and words alone.
const RUNS: u64 = 16;

/// The bytes that a run with numbers has found.
#[derive(Clone)]
pub(crate) struct Sample {
    rng: Rng,
    bytes: FxHashMap<Address, u8>,
    /// By address and bytes: what is assumed.
    assumed: FxHashMap<(Term, u8), Interval>,
    /// What the Kernel declares of what it reads next.
    declared: Option<Interval>,
    /// Addresses of words that stay what they are: pointers, and the code of other keys.
    kept: FxHashSet<Term>,
}

impl Sample {
    fn number(&mut self, (low, high): Interval) -> i128 {
        let width = (high - low + 1).max(1);
        let near = i128::from(self.rng.below(16)).min(width - 1);
        match self.rng.below(8) {
            0 => low + near,
            1 => high - near,
            2 => near.clamp(low, high),
            3 => (-near).clamp(low, high),
            _ => low + i128::from(self.rng.next()).rem_euclid(width),
        }
    }
}

impl Terms {
    /// What memory holds at an address before anything is stored there.
    pub fn unread(&mut self, address: Term, bytes: u8) -> Term {
        match self.sampled(address, bytes) {
            Some(number) => self.constant(number),
            None => self.of(Kind::Load(address, bytes)),
        }
    }

    /// Whether this is a run with numbers.
    pub fn is_sampling(&self) -> bool {
        self.sample.is_some()
    }

    /// What is read next lies in an interval.
    pub fn declare(&mut self, range: Option<Interval>) {
        if let Some(sample) = &mut self.sample {
            sample.declared = range;
        }
    }

    /// A number of an interval, in a run with numbers.
    pub fn drawn(&mut self, range: Interval) -> Option<i128> {
        self.sample.as_mut().map(|sample| sample.number(range))
    }

    fn sampled(&mut self, address: Term, bytes: u8) -> Option<i128> {
        let place = self.address(address);
        let load = self.of(Kind::Load(address, bytes));
        let always = (bytes <= 4).then(|| self.bounds(load));
        let is_pointer = self.pointers.contains(&address);
        // Only where all but a base and pointers is a number two places are known to be two.
        let is_plain = self.sum(place.moving).parts.iter().all(|(atom, _)| {
            let kind = self.kind(*atom);
            matches!(kind, Kind::Base(_) | Kind::Load(..))
        });
        let sample = self.sample.as_mut()?;
        if is_pointer || !is_plain || sample.kept.contains(&address) {
            return None;
        }
        let all = match bytes {
            4 => WORD,
            8 => (-(1 << 63), (1 << 63) - 1),
            _ => (0, (1 << (8 * bytes)) - 1),
        };
        let of = [
            sample.assumed.get(&(address, bytes)).copied(),
            sample.declared,
            always,
        ];
        let range = of.into_iter().flatten().fold(all, |range, more| {
            let both = meet(range, more);
            if both.0 <= both.1 { both } else { range }
        });
        let number = sample.number(range);
        let mut found = 0;
        for byte in 0..i128::from(bytes) {
            let at = Address {
                at: place.at + byte,
                ..place
            };
            let own = sample
                .bytes
                .entry(at)
                .or_insert((number >> (8 * byte)) as u8);
            found |= i128::from(*own) << (8 * byte);
        }
        let is_negative = bytes >= 4 && found > all.1;
        Some(found - if is_negative { 1 << (8 * bytes) } else { 0 })
    }

    /// What is assumed now of what memory holds.
    fn assumed(&mut self) -> FxHashMap<(Term, u8), Interval> {
        let loads = self.loads();
        let known = loads.into_iter().map(|(address, bytes)| {
            let load = self.of(Kind::Load(address, bytes));
            ((address, bytes), self.bounds(load))
        });
        known.collect()
    }
}

/// Tries random ticks of a mode, after a case of it that could not be shown; tells one in which
/// the code leaves something else than the mode.
pub(crate) fn refute(question: &Question, terms: &mut Terms, mode: ModeId) -> Option<String> {
    let assumed = terms.assumed();
    let found = (0..TICKS).find_map(|tick| {
        let assumed = if tick % 2 == 0 {
            assumed.clone()
        } else {
            FxHashMap::default()
        };
        begin_tick(question, terms, tick, assumed);
        let (start, _) = check_entry(question, terms).ok()?;
        terms.known.forget();
        witness(run_case(question, terms, mode, &start))
    });
    terms.sample = None;
    found
}

/// Tries random ticks; tells one in which the entry leaves something else in a shared word.
pub(crate) fn refute_shared(question: &Question, terms: &mut Terms, word: usize) -> Option<String> {
    refute_run(question, terms, TICKS, |terms| {
        let (_, shared) = check_entry(question, terms).ok()?;
        match shared.into_iter().nth(word)? {
            Verdict::Refuted { why } => Some(why),
            _ => None,
        }
    })
}

/// Tries random ticks; tells one in which the tick's entry or its end leaves something else.
pub(crate) fn refute_around(question: &Question, terms: &mut Terms) -> Option<String> {
    refute_run(question, terms, TICKS, |terms| {
        let certain = |doubt: Doubt| doubt.is_certain.then_some(doubt.why);
        match check_entry(question, terms) {
            Err(doubt) => certain(doubt),
            // The last word that it takes is where the tick returns to.
            Ok((start, _)) => certain(check_end(question, terms, start.stack_bytes + 4).err()?),
        }
    })
}

/// Tries random numbers; tells those with which a routine leaves something else.
pub(crate) fn refute_routine(
    question: &Question,
    terms: &mut Terms,
    routine: Routine,
) -> Option<String> {
    refute_run(question, terms, RUNS, |terms| {
        let doubt = check_routine(question, terms, routine).err()?;
        doubt.is_certain.then_some(doubt.why)
    })
}

/// The first witness of some runs with numbers.
fn refute_run(
    question: &Question,
    terms: &mut Terms,
    runs: u64,
    run: impl Fn(&mut Terms) -> Option<String>,
) -> Option<String> {
    let found = (0..runs).find_map(|tick| {
        begin_tick(question, terms, tick, FxHashMap::default());
        run(terms)
    });
    terms.sample = None;
    found
}

/// Begins a run with numbers.
pub(crate) fn begin_tick(
    question: &Question,
    terms: &mut Terms,
    seed: u64,
    assumed: FxHashMap<(Term, u8), Interval>,
) {
    terms.known.forget();
    let places = question.places;
    let [state, record] = [Base::State, Base::Record].map(|base| terms.of(Kind::Base(base)));
    let kept = [
        (record, places.record_bytes),
        (state, places.records),
        (state, places.row),
    ];
    let mut all: FxHashSet<Term> = FxHashSet::default();
    for (base, at) in kept {
        all.extend(terms.plus(base, at.into()));
    }
    // The address of the first record leads to the code of its key.
    let first = terms.plus(state, places.records.into());
    all.extend(first);
    terms.sample = Some(Sample {
        rng: Rng::new(seed),
        bytes: FxHashMap::default(),
        assumed,
        declared: None,
        kept: all,
    });
}

/// What differs for certain, where something does.
pub(crate) fn witness<T>(told: Result<T, Stop>) -> Option<String> {
    match told {
        Err(Stop::Unproven(Doubt {
            is_certain: true,
            why,
            ..
        })) => Some(why),
        _ => None,
    }
}
