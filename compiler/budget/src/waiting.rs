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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cores::tests::{section, whole};
    use crate::parts::tests::of_cycles;

    /// Sections of a core, by their names.
    fn program() -> Program {
        let names = [
            ".bss.core0.histories",
            ".bss.events",
            ".bss.core1.guards",
            ".bss.words",
            ".data.block",
            ".rodata.programs",
            ".rodata.records",
            ".bss.core0_state",
        ];
        let at = (0x2000_0000..).step_by(0x100);
        let sections = names
            .iter()
            .zip(at)
            .map(|(name, at)| section(name, at, 0x100));
        Program::of(&whole(1, sections.collect()).image)
    }

    /// A path of one step, which accesses that and waits a cycle for each of two.
    fn path(accessed: Accessed) -> Vec<Step> {
        let waits = Waits {
            fetches: 1,
            dma: 2,
            ..Waits::default()
        };
        vec![Step {
            address: 0x100,
            cycles: 9,
            waits,
            accessed,
            times: 1,
        }]
    }

    fn bound(accessed: Accessed) -> Bound {
        Bound {
            path: path(accessed),
            ..of_cycles(9)
        }
    }

    /// Of an access in the frame's own code, and three times in that of keys.
    fn told(accessed: Accessed) -> [&'static str; 2] {
        let program = program();
        let (mut frame, mut keys) = (Tally::default(), Tally::default());
        frame.add_frame(&program, &path(accessed));
        keys.add_path_of_keys(&program, &bound(accessed), 3);
        [(frame, 1), (keys, 3)].map(|(tally, times)| {
            let found = tally.list();
            let data = found[0].data;
            let of = |cause, cycles| Waited {
                cause,
                data,
                cycles,
            };
            let both = [of(WaitCause::Dma, 2 * times), of(WaitCause::Fetches, times)];
            assert_eq!(found, both);
            data
        })
    }

    #[test]
    fn what_is_waited_for_is_told_by_what_points_there() {
        let pointers = "what the frame's pointers lead to";
        let Points {
            state,
            histories,
            words,
        } = thumb::POINTS;
        for (accessed, data) in [
            (Accessed::Nothing, ["code"; 2]),
            (Accessed::Constant, ["constants beside the code"; 2]),
            (Accessed::By(reg::SP), ["the stack"; 2]),
            (Accessed::By(histories), [pointers, "histories"]),
            (Accessed::By(words), [pointers, "the converter's words"]),
            (Accessed::By(state[0]), [pointers, "state of the keys"]),
            (Accessed::By(state[1]), [pointers, "state of the keys"]),
            (Accessed::Unknown, [pointers, "events"]),
        ] {
            assert_eq!(told(accessed), data, "{accessed:?}");
        }
    }

    #[test]
    fn what_is_waited_for_is_told_by_the_section_that_it_lies_in() {
        let at = (0x2000_0000..).step_by(0x100);
        for (at, data) in at.zip([
            "histories",
            "events",
            "guards",
            "the converter's words",
            "the core's block",
            "tables",
            "tables",
            "state of the keys",
            "devices",
        ]) {
            assert_eq!(told(Accessed::At(at)), [data; 2], "{at:#x}");
        }
    }

    /// What nobody waits for is not told; the longest is told first, and causes add up.
    #[test]
    fn waiting_is_summed_by_cause_and_data() {
        let mut tally = Tally::default();
        tally.add_cycles(WaitCause::Visits, "", 0);
        tally.add_cycles(WaitCause::Visits, "", 5);
        let others = Waits {
            others: 2,
            ..Waits::default()
        };
        tally.add("events", others, 4);
        tally.add("guards", others, 1);
        tally.add("events", others, 1);
        let found = tally.list().into_iter();
        let found: Vec<_> = found.map(|own| (own.cause, own.data, own.cycles)).collect();
        let others = WaitCause::Others;
        let expected = [
            (others, "events", 10),
            (WaitCause::Visits, "", 5),
            (others, "guards", 2),
        ];
        assert_eq!(found, expected);
    }
}
