//! Where the cycles of an instruction come from, and how sure they are.

use super::cost::{Cost, Reason};
use super::facts::{Core, Evidence, Fact};
use super::timed::Timed;

impl Core {
    /// The number behind one part of a cost of `timed`, with its source and class.
    ///
    /// Of a late result it is the rule about late results; which of them are late is said by the
    /// lines of the instructions that make them.
    pub fn source(&self, timed: &Timed, reason: Reason) -> Fact {
        let line = self.lines.get(timed.line());
        let own = line.map(|line| Fact::new(line.cycles, line.evidence, line.source));
        let unit = line.map(|line| Fact::new(line.float_hold, line.evidence, line.source));
        let unknown = Fact::new(0, Evidence::Estimate, "no source");
        match reason {
            Reason::Issue => own.unwrap_or(unknown),
            Reason::Skipped => self.skipped,
            Reason::Divide => self.divide.start,
            Reason::Folded if timed.is(Timed::IT) => self.branches.folded_it,
            Reason::Folded => self.branches.folded,
            Reason::Pipelined => self.overlap,
            Reason::Near => self.near,
            Reason::LateResult => self.late,
            Reason::LateFlags => Fact::new(1, Evidence::Rule, "as a late result"),
            Reason::FloatBusy => unit.unwrap_or(unknown),
            Reason::Refill => self.branches.taken,
            Reason::LoadedTarget => self.branches.from_load,
            Reason::SplitTarget => self.branches.split_target,
            Reason::Misaligned => self.worst.misaligned,
            Reason::AfterStore => self.worst.load_after_store,
            Reason::DependentLoad => self.worst.dependent_load,
            Reason::Bus => Fact::new(1, Evidence::Rule, "the board's memory"),
        }
    }

    /// How sure a cost of `timed` is: as sure as its least sure part.
    pub fn evidence(&self, timed: &Timed, cost: &Cost) -> Evidence {
        cost.parts()
            .map(|(reason, _)| self.source(timed, reason).evidence)
            .max()
            .unwrap_or(Evidence::Exact)
    }
}
