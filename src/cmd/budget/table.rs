//! The budget for people.

use std::fmt::Write;

use super::Proof;

impl Proof {
    /// Modes, cores, and the dearest way through a key's tick.
    pub fn table(&self) -> String {
        let mut out = String::new();
        let (deadline, budget) = (&self.deadline, &self.budget);
        let _ = writeln!(
            out,
            "{} on {}: {} keys, {} cores, {} Hz, {} cycles a tick",
            self.name, self.board.name, deadline.keys, deadline.cores, deadline.rate_hz, budget.period_cycles
        );
        self.modes(&mut out);
        self.around(&mut out);
        self.cores(&mut out);
        self.path(&mut out);
        out
    }

    fn modes(&self, out: &mut String) {
        let _ = writeln!(out, "  {:>6}  {:>6}  mode", "cycles", "code");
        for (name, (_, bound)) in self.modes.iter().zip(&self.tick.modes) {
            let _ = writeln!(out, "  {:>6}  {:>6}  {name}", bound.cycles_max, bound.code_bytes);
        }
    }

    fn around(&self, out: &mut String) {
        let _ = writeln!(
            out,
            "  {} cycles around the keys of a core: {} to enter and leave, {} of the firmware as given",
            self.budget.frame_cycles_max,
            self.tick.frame_cycles_max(),
            self.deadline.firmware_cycles
        );
        let waits = self.crowded.key_cycles_max().saturating_sub(self.tick.key_cycles_max());
        let _ = writeln!(out, "  up to {waits} more a key if another core uses the same banks (not in the sums)");
        let (flash, ram) = self.bytes();
        let stack = self.tick.stack_bytes_max();
        let _ = writeln!(out, "  {flash} bytes stored, {ram} bytes of RAM, {stack} bytes of stack a core");
        let _ = writeln!(out, "  class: {}", self.budget.class);
    }

    fn cores(&self, out: &mut String) {
        for (number, core) in self.budget.cores.iter().enumerate() {
            let (percent, slack) = (core.utilization() * 100.0, core.slack_cycles);
            let _ = writeln!(
                out,
                "  core {number}: {} keys, at most {} cycles, {percent:.1} % of the tick, {slack} left, {} more keys fit",
                core.keys, core.cycles_max, core.more_keys
            );
        }
    }

    fn path(&self, out: &mut String) {
        let (mode, bound) = self.dearest();
        let _ = writeln!(out, "dearest way through a key, {} cycles in mode `{mode}`:", bound.cycles_max);
        for (place, cycles) in self.program.by_place(&bound.path) {
            let (line, item) = match place {
                Some(place) => (format!("{}:{}", place.file, place.line), place.item.as_str()),
                None => ("-".to_string(), "the key's frame"),
            };
            let _ = writeln!(out, "  {cycles:>6}  {line:<40} {item}");
        }
        let _ = writeln!(out, "by declaration:");
        for (item, cycles) in self.program.by_item(&bound.path) {
            let _ = writeln!(out, "  {cycles:>6}  {item}");
        }
    }
}
