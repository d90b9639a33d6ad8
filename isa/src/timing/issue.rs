//! One instruction through the pipeline.

use super::cost::{Cost, Reason};
use super::facts::{Core, Takers};
use super::outcome::Outcome;
use super::pipe::Pipe;
use super::timed::Timed;
use crate::reg::RegSet;

impl Core {
    /// Issues one instruction at `address`: the pipeline after it, and what it cost.
    ///
    /// `timed` must come from [`Core::prepare`] of the same core. Of the address only bit 1 counts.
    pub fn issue(
        &self,
        pipe: Pipe,
        timed: &Timed,
        address: u32,
        outcome: &Outcome,
    ) -> (Pipe, Cost) {
        let mut cost = Cost::default();
        let branch = timed.is(Timed::BRANCHES);
        // CBZ has no condition to skip it: when it is not taken, it has still looked.
        let skipped = outcome.skipped && timed.is(Timed::CONDITIONAL);
        if !skipped {
            self.own_cycles(timed, outcome, &mut cost);
            self.wait_for_operands(&pipe, timed, &mut cost);
        } else if !branch {
            cost.add(Reason::Skipped, i32::from(self.skipped.cycles));
        }
        wait_for_flags(&pipe, timed, &mut cost);
        if branch {
            self.refill(&pipe, timed, outcome, &mut cost);
        }
        let folded = self.fold(&pipe, timed, outcome, &mut cost);
        self.overlap(&pipe, timed, outcome, &mut cost);
        if self.rules.at_worst {
            self.open_questions(&pipe, timed, address, skipped, &mut cost);
        }
        cost.add(Reason::Bus, i32::from(outcome.waits));
        (
            self.after(&pipe, timed, address, outcome, folded, &cost),
            cost,
        )
    }

    fn own_cycles(&self, timed: &Timed, outcome: &Outcome, cost: &mut Cost) {
        if is_not_taken(timed, outcome) {
            return;
        }
        cost.add(Reason::Issue, i32::from(timed.cycles));
        if timed.is(Timed::DIVIDES) && self.rules.at_worst && self.worst.divide.cycles != 0 {
            cost.add(Reason::Divide, i32::from(self.worst.divide.cycles));
        } else if timed.is(Timed::DIVIDES) && outcome.quotient_bits >= 0 {
            let per_cycle = i32::from(self.divide.bits_per_cycle.cycles.max(1));
            let more =
                i32::from(self.divide.start.cycles) + i32::from(outcome.quotient_bits) / per_cycle;
            cost.add(Reason::Divide, more);
        }
    }

    fn wait_for_operands(&self, pipe: &Pipe, timed: &Timed, cost: &mut Cost) {
        if pipe.late != 0 && !has_expired(pipe, timed) {
            let late_for = |taker: Takers, registers: u16| {
                if pipe.late_for & taker.0 != 0 {
                    registers
                } else {
                    0
                }
            };
            let waits = late_for(Takers::OPERAND, timed.operands)
                | late_for(Takers::ADDRESS, timed.addresses)
                | late_for(timed.sums_as, timed.sums);
            if waits & pipe.late != 0 {
                cost.wait_for(RegSet::core_list(waits & pipe.late), self.late.cycles);
            }
        }
        if timed.is(Timed::FLOAT) {
            wait_for_float_unit(pipe, timed, cost);
        }
    }

    fn refill(&self, pipe: &Pipe, timed: &Timed, outcome: &Outcome, cost: &mut Cost) {
        let Some(target) = outcome.target else {
            if outcome.skipped || is_not_taken(timed, outcome) {
                cost.add(Reason::Issue, i32::from(self.branches.not_taken.cycles));
            }
            return;
        };
        cost.add(Reason::Refill, i32::from(self.branches.taken.cycles));
        if timed.is(Timed::LOADS_PC) {
            cost.add(
                Reason::LoadedTarget,
                i32::from(self.branches.from_load.cycles),
            );
        }
        if target.wide && target.address & 2 != 0 && !pipe.is(Pipe::STACK) {
            cost.add(
                Reason::SplitTarget,
                i32::from(self.branches.split_target.cycles),
            );
        }
    }

    /// Whether the instruction shares the cycle of the one before it; if that saves one, it is
    /// taken off.
    fn fold(&self, pipe: &Pipe, timed: &Timed, outcome: &Outcome, cost: &mut Cost) -> bool {
        let joins = pipe.is(Pipe::EMPTY) && timed.is(Timed::NARROW);
        let folds =
            pipe.is(Pipe::HOST) && (timed.is(Timed::IT) || timed.is(Timed::FOLDS) && self.folds());
        let waits_for_flags =
            timed.is(Timed::CONDITIONAL) && pipe.is(Pipe::FLAGS) && outcome.target.is_some();
        if joins || folds && !waits_for_flags {
            let saved = if timed.is(Timed::IT) {
                self.branches.folded_it
            } else {
                self.branches.folded
            };
            cost.add(Reason::Folded, -i32::from(saved.cycles));
        }
        joins || folds
    }

    fn folds(&self) -> bool {
        self.branches.folded.cycles != 0
    }

    /// What memory makes shorter, on cores where an access takes more than one cycle.
    fn overlap(&self, pipe: &Pipe, timed: &Timed, outcome: &Outcome, cost: &mut Cost) {
        if outcome.skipped {
            return;
        }
        let apart = outcome.apart && cost.part(Reason::LateResult) == 0;
        if timed.is(Timed::OVERLAPS) && pipe.is(Pipe::OVERLAPPED) && !apart {
            cost.add(Reason::Pipelined, -i32::from(self.overlap.cycles));
        }
        if timed.is(Timed::MEMORY) && outcome.near {
            cost.add(Reason::Near, -i32::from(self.near.cycles));
        }
    }

    /// What an instruction may take more, as far as the sources leave it open.
    fn open_questions(
        &self,
        pipe: &Pipe,
        timed: &Timed,
        address: u32,
        skipped: bool,
        cost: &mut Cost,
    ) {
        if !timed.is(Timed::NARROW) && address & 2 != 0 {
            cost.add(Reason::Misaligned, i32::from(self.worst.misaligned.cycles));
        }
        if skipped || !timed.is(Timed::LOADS) {
            return;
        }
        if pipe.is(Pipe::STORED) {
            let more = self.worst.load_after_store;
            cost.add(Reason::AfterStore, i32::from(more.cycles));
        }
        if pipe.is(Pipe::OVERLAPPED) && cost.part(Reason::LateResult) != 0 {
            let more = self.worst.dependent_load;
            cost.add(Reason::DependentLoad, i32::from(more.cycles));
        }
    }

    fn after(
        &self,
        pipe: &Pipe,
        timed: &Timed,
        at: u32,
        outcome: &Outcome,
        folded: bool,
        cost: &Cost,
    ) -> Pipe {
        let elapsed = cost.cycles().min(u32::from(u8::MAX)) as u8;
        let mut next = Pipe::default();
        if timed.float_hold != 0 && !outcome.skipped {
            occupy_float_unit(&mut next, timed);
        } else {
            next.float_busy = pipe.float_busy.saturating_sub(elapsed);
            let singles_in = pipe.singles_in.saturating_sub(elapsed);
            if singles_in != 0 {
                (next.singles_in, next.late_singles) = (singles_in, pipe.late_singles);
                next.about |= pipe.about & Pipe::OF_SINGLES;
            }
        }
        if outcome.target.is_some() {
            return next;
        }
        let waits_for_company = timed.is(Timed::EMPTY) && !folded && self.folds();
        let no_time = elapsed == 0 && !pipe.is(Pipe::EMPTY) || waits_for_company;
        if no_time {
            (next.late, next.late_for) = (pipe.late, pipe.late_for);
            next.about |= pipe.about & Pipe::LATE_FLAGS;
        } else if !outcome.skipped {
            (next.late, next.late_for) = (timed.late, timed.late_for.0);
            next.about |= if timed.is(Timed::LATE_FLAGS) {
                Pipe::LATE_FLAGS
            } else {
                0
            };
        }
        next.about |= self.neighbourhood(pipe, timed, at, outcome, folded);
        next
    }

    /// What the next instruction may share with this one.
    fn neighbourhood(
        &self,
        pipe: &Pipe,
        timed: &Timed,
        address: u32,
        outcome: &Outcome,
        folded: bool,
    ) -> u16 {
        let mut about = Pipe::SEQUENTIAL;
        let fetched = pipe.is(Pipe::SEQUENTIAL) || address & 2 == 0;
        if timed.is(Timed::NARROW) && !folded {
            if fetched && (self.folds() || self.branches.folded_it.cycles != 0) {
                about |= Pipe::HOST;
                about |= if timed.is(Timed::SETS_FLAGS) {
                    Pipe::FLAGS
                } else {
                    0
                };
            }
            about |= if timed.is(Timed::EMPTY) && self.folds() {
                Pipe::EMPTY
            } else {
                0
            };
        }
        about |= if timed.is(Timed::STACK) {
            Pipe::STACK
        } else {
            0
        };
        let overlapped = timed.is(Timed::OVERLAPPED) && !outcome.skipped;
        about |= if overlapped { Pipe::OVERLAPPED } else { 0 };
        let delays_loads = self.rules.at_worst && self.worst.load_after_store.cycles != 0;
        let stores = timed.is(Timed::MEMORY) && !timed.is(Timed::LOADS) && !outcome.skipped;
        about |= if delays_loads && stores {
            Pipe::STORED
        } else {
            0
        };
        about
    }
}

/// What was late when a NOP or IT issued is there for whoever does not join it.
fn has_expired(pipe: &Pipe, timed: &Timed) -> bool {
    pipe.is(Pipe::EMPTY) && !timed.is(Timed::NARROW)
}

/// Whether it is a branch that is not taken. What loads PC and is executed leads elsewhere: where
/// there is no target it returns from an exception, and has loaded all its words before.
fn is_not_taken(timed: &Timed, outcome: &Outcome) -> bool {
    timed.is(Timed::BRANCHES) && outcome.target.is_none() && !timed.is(Timed::LOADS_PC)
}

/// The condition itself needs the flags, so a skipped instruction waits too.
fn wait_for_flags(pipe: &Pipe, timed: &Timed, cost: &mut Cost) {
    if pipe.is(Pipe::LATE_FLAGS) && timed.is(Timed::READS_FLAGS) && !has_expired(pipe, timed) {
        cost.add(Reason::LateFlags, 1);
    }
}

fn wait_for_float_unit(pipe: &Pipe, timed: &Timed, cost: &mut Cost) {
    cost.add(Reason::FloatBusy, i32::from(pipe.float_busy));
    let needed = pipe.late_singles & timed.singles_read;
    let chained =
        pipe.is(Pipe::FLOAT_SUM) && timed.is(Timed::FLOAT_SUM) && needed & !timed.singles_late == 0;
    let flags = pipe.is(Pipe::LATE_FPSCR) && timed.is(Timed::READS_FPSCR);
    let wait = pipe
        .singles_in
        .saturating_sub(pipe.float_busy)
        .saturating_sub(u8::from(chained));
    if needed != 0 && wait != 0 {
        cost.wait_for(RegSet::singles_of(needed), wait);
    } else if flags {
        cost.add(Reason::LateFlags, i32::from(wait));
    }
}

/// One cycle of the unit is over when the instruction has issued.
fn occupy_float_unit(next: &mut Pipe, timed: &Timed) {
    next.float_busy = timed.float_hold.saturating_sub(timed.cycles.max(1));
    let result_in = next.float_busy + timed.float_delay;
    let late = result_in != 0 && (timed.singles_late != 0 || timed.is(Timed::WRITES_FPSCR));
    (next.singles_in, next.late_singles) = if late {
        (result_in, timed.singles_late)
    } else {
        (0, 0)
    };
    if late {
        next.about |= if timed.is(Timed::FLOAT_SUM) {
            Pipe::FLOAT_SUM
        } else {
            0
        };
        next.about |= if timed.is(Timed::WRITES_FPSCR) {
            Pipe::LATE_FPSCR
        } else {
            0
        };
    }
}
