//! What the waiting of a core's frame consists of: for whom, and for which data.

use std::collections::BTreeMap;
use std::fmt;

use whippen_arm::thumb::{self, Points};
use whippen_isa::reg;

use super::memory::{Accessed, Waits};
use super::program::Program;
use super::tick_handler::ZoneBound;
use super::{Bound, Step};

/// Whom an access waits for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum WaitCause {
    /// The core's own fetches.
    Fetches,
    /// Another manager that uses the bank while the core plays.
    Others,
    /// A DMA, behind a bridge to devices or, where the cores do not go first, at memory.
    Dma,
    /// The other core, which looks up a few words of this core's between its ticks.
    Visits,
    /// Nobody: cycles by which the path that takes longest with all waiting differs without it from
    /// the one that takes longest then.
    OtherPath,
}

impl fmt::Display for WaitCause {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            WaitCause::Fetches => "own fetches",
            WaitCause::Others => "the other core",
            WaitCause::Dma => "the DMA",
            WaitCause::Visits => "the other core's visits",
            WaitCause::OtherPath => "another path than without waiting",
        })
    }
}

/// Cycles of waiting in a frame, at most.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Waited {
    /// For whom.
    pub cause: WaitCause,
    /// Which data had to wait, in words; none where it may be any.
    pub data: &'static str,
    /// How long; negative only of [`WaitCause::OtherPath`].
    pub cycles: i64,
}

/// The sum of a frame's waiting, by cause and data.
#[derive(Debug, Default)]
pub struct Tally(BTreeMap<(WaitCause, &'static str), u64>);

impl Tally {
    /// Waiting for some data.
    pub fn add(&mut self, data: &'static str, waits: Waits, times: u64) {
        let causes = [
            (WaitCause::Fetches, waits.fetches),
            (WaitCause::Others, waits.others),
            (WaitCause::Dma, waits.dma),
        ];
        for (cause, cycles) in causes {
            self.add_cycles(cause, data, times * u64::from(cycles));
        }
    }

    /// Cycles of one cause.
    pub fn add_cycles(&mut self, cause: WaitCause, data: &'static str, cycles: u64) {
        if cycles > 0 {
            *self.0.entry((cause, data)).or_default() += cycles;
        }
    }

    /// The frame's own code.
    pub fn add_frame(&mut self, program: &Program, path: &[Step]) {
        for step in path {
            let data = match step.accessed {
                Accessed::At(address) => data_at(program, address),
                other => data_of(other, "what the frame's pointers lead to"),
            };
            self.add(data, step.waits, 1);
        }
    }

    /// The keys of a zone, so many of them.
    pub fn add_keys(&mut self, program: &Program, zone: &ZoneBound, keys: u32) {
        self.add_path_of_keys(program, &zone.tick.entry, 1);
        self.add_path_of_keys(program, &zone.tick.end, 1);
        if let Some((_, worst)) = zone.tick.worst_case() {
            self.add_path_of_keys(program, worst, keys.into());
        }
    }

    fn add_path_of_keys(&mut self, program: &Program, bound: &Bound, times: u64) {
        let Points {
            state,
            histories,
            words,
        } = thumb::POINTS;
        for step in &bound.path {
            let data = match step.accessed {
                Accessed::By(by) if by == histories => HISTORIES,
                Accessed::By(by) if by == words => WORDS,
                Accessed::By(by) if state.contains(&by) => STATE,
                Accessed::At(address) => data_at(program, address),
                other => data_of(other, "events"),
            };
            self.add(data, step.waits, times);
        }
    }

    /// All of it, the longest first.
    pub fn list(self) -> Vec<Waited> {
        let of = |((cause, data), cycles): (_, u64)| Waited {
            cause,
            data,
            cycles: cycles as i64,
        };
        let mut all: Vec<Waited> = self.0.into_iter().map(of).collect();
        all.sort_by_key(|waited| std::cmp::Reverse(waited.cycles));
        all
    }
}

const HISTORIES: &str = "histories";
const WORDS: &str = "the converter's words";
const STATE: &str = "state of the keys";

/// Data that are in no section that is known; `unknown` where the address is not.
fn data_of(accessed: Accessed, unknown: &'static str) -> &'static str {
    match accessed {
        Accessed::Nothing => "code",
        Accessed::Constant => "constants beside the code",
        Accessed::By(reg::SP) => "the stack",
        Accessed::By(_) | Accessed::At(_) | Accessed::Unknown => unknown,
    }
}

/// What the sections of a core hold, by the last part of their names.
const SECTIONS: [(&str, &str); 7] = [
    ("histories", HISTORIES),
    ("events", "events"),
    ("guards", "guards"),
    ("words", WORDS),
    ("block", "the core's block"),
    ("programs", "tables"),
    ("records", "tables"),
];

/// What is at an address.
fn data_at(program: &Program, address: u32) -> &'static str {
    let Some(section) = program.section_at(address) else {
        return "devices";
    };
    let part = section.name.rsplit('.').next().unwrap_or_default();
    let known = SECTIONS.iter().find(|(own, _)| *own == part);
    known.map_or(STATE, |(_, words)| words)
}
