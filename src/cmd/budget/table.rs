//! The budget for people.

use std::fmt::Write;

use whippen_compiler::budget::{Bounded, PartBound};
use whippen_compiler::firmware::Role;

use crate::cmd::count::count_keys;
use crate::cmd::proof::{ImageProof, ProgramReport};
use crate::cmd::setup::symbol_prefix;

impl ImageProof<'_> {
    /// Modes, cores, and the worst-case path through a key's tick, while one program plays.
    pub fn table(&self, played: &ProgramReport) -> String {
        let mut out = String::new();
        let (board, budget) = (&self.setup.board, &played.budget);
        let verdict = if budget.fits() {
            "fits"
        } else {
            "does not fit"
        };
        let _ = writeln!(
            out,
            "{} on {}: {} at {:#} Hz, {} cycles a tick at {} MHz: {verdict}",
            played.program.name,
            board.name,
            count_keys(self.keys, played.is_once()),
            budget.rate_hz,
            budget.period_cycles,
            f64::from(budget.clock_hz) / 1e6
        );
        played.key(&mut out);
        played.around(&mut out);
        played.each_core(&mut out);
        let (image, stack) = (
            &self.image.image,
            budget
                .cores
                .iter()
                .map(|core| core.stack_bytes_max)
                .max()
                .unwrap_or(0),
        );
        let (stored, run) = (image.stored_bytes(), image.run_bytes());
        let _ = writeln!(
            out,
            "{stored} bytes of flash, {run} bytes of RAM, {stack} bytes of stack a core"
        );
        let _ = writeln!(
            out,
            "class: {} for {} alone, {} for a core",
            budget.key_class,
            played.one(),
            budget.class
        );
        if let Some(validated) = &self.validated {
            let _ = writeln!(out, "{}", validated.of_program(played.id));
        }
        self.path(played, &mut out);
        out
    }

    fn path(&self, played: &ProgramReport, out: &mut String) {
        let worst = played.worst_case();
        let _ = writeln!(
            out,
            "\nworst-case path through {}, {} cycles: {}",
            played.one(),
            worst.bound.cycles_max,
            worst.mode
        );
        for (place, cycles) in self.bytes.by_place(&worst.bound.path) {
            let (line, item) = match place {
                Some(place) => (
                    format!("{}:{}", place.file, place.line),
                    place.item.as_str(),
                ),
                None if played.is_once() => ("-".to_string(), "its frame"),
                None => ("-".to_string(), "the key's frame"),
            };
            let _ = writeln!(out, "  {cycles:>6}  {line:<40} {item}");
        }
        let _ = writeln!(out, "by declaration:");
        for (item, cycles) in self.bytes.by_item(&worst.bound.path) {
            let _ = writeln!(out, "  {cycles:>6}  {item}");
        }
    }
}

impl ProgramReport<'_> {
    fn key(&self, out: &mut String) {
        for (number, zone) in self.numbered_zones() {
            let of = zone.notes.as_ref().map_or(String::new(), |keys| {
                format!("{}, {keys}: ", symbol_prefix(zone.compiled))
            });
            let of = format!("{of}{}", self.one());
            let _ = writeln!(out, "\n{of}, cycles at most   alone  contended  code bytes");
            for (index, name) in zone.modes.iter().enumerate() {
                let most = |of: &dyn Fn(&Self) -> Option<u64>| of(self).unwrap_or(0);
                let alone = most(&|s| {
                    s.mode(number, index)
                        .map(|(alone, _)| alone.cycles_max)
                        .max()
                });
                let contended = most(&|s| {
                    s.mode(number, index)
                        .map(|(_, contended)| contended.cycles_max)
                        .max()
                });
                let code = self
                    .mode(number, index)
                    .map(|(alone, _)| alone.code_bytes)
                    .max()
                    .unwrap_or(0);
                let width = of.chars().count() + 24;
                let _ = writeln!(out, "{alone:>width$}  {contended:>9}  {code:>10}  {name}");
            }
        }
    }

    fn around(&self, out: &mut String) {
        let core = &self.cores[0];
        let _ = writeln!(
            out,
            "\naround {} of core 0: {} cycles at most",
            self.all(),
            core.alone.around_cycles_max()
        );
        for (part, cycles) in &core.alone.parts {
            let _ = writeln!(out, "  {cycles:>6}  {part}");
        }
    }

    fn each_core(&self, out: &mut String) {
        let _ = writeln!(out);
        for (number, (core, bounded)) in self.budget.cores.iter().zip(&self.cores).enumerate() {
            let left = match core.slack_cycles {
                late @ ..0 => format!("{} cycles too many", -late),
                slack if self.is_once() => {
                    format!("slack {slack} cycles, {:.1} %", 100.0 * core.slack())
                }
                slack => {
                    // Not how many fit: with more keys more may have to wait for memory.
                    let takes = match core.more_keys {
                        0 => "less than a key takes".to_string(),
                        1 => "what 1 more key takes".to_string(),
                        more => format!("what {more} more keys take"),
                    };
                    format!(
                        "slack {slack} cycles, {:.1} %, {takes}",
                        100.0 * core.slack()
                    )
                }
            };
            let _ = writeln!(
                out,
                "core {number}: {}, {} cycles at most, {:.1} % of the tick; {left}",
                count_keys(core.keys, self.is_once()),
                core.cycles_max,
                100.0 * core.utilization()
            );
            self.keys_of_core(bounded, out);
            print_parts(bounded, out);
            let _ = writeln!(
                out,
                "  {:>6}  around {}\n  {:>6}  waiting for {}its own fetches; \
                 without it {:.1} % of the tick",
                core.around_cycles_max,
                if self.is_once() { "it" } else { "them" },
                core.contention_cycles_max,
                if self.cores.len() > 1 {
                    "the other core and for "
                } else {
                    ""
                },
                100.0 * bounded.alone.cycles_max as f64 / self.budget.period_cycles.max(1) as f64
            );
            print_waiting(bounded, out);
            if let Some(sending) = bounded.contended.sending {
                let (most, until) = (sending.cycles_max, sending.until_cycles);
                let _ = writeln!(
                    out,
                    "  {most:>6}  until it has read how late it is; it sends up to {until}"
                );
            }
        }
    }

    /// What the keys of a core take.
    fn keys_of_core(&self, bounded: &Bounded, out: &mut String) {
        if self.program.is_split() {
            for zone in &bounded.alone.zones {
                let key = zone.tick.key_cycles_max();
                let (cycles, instrument) = (
                    u64::from(zone.keys()) * key,
                    symbol_prefix(self.zone(zone.of.zone).compiled),
                );
                let _ = writeln!(
                    out,
                    "  {cycles:>6}  {} of {instrument}, {key} each",
                    count_keys(zone.keys(), false)
                );
            }
        } else if self.is_once() {
            let all = bounded.alone.keys_cycles_max();
            let _ = writeln!(out, "  {all:>6}  {}", self.all());
        } else {
            let (all, key) = (
                bounded.alone.keys_cycles_max(),
                bounded.alone.key_cycles_max(),
            );
            let _ = writeln!(out, "  {all:>6}  keys, {key} each");
        }
    }
}

/// The parts of an instrument, core by core, alone.
fn print_parts(bounded: &Bounded, out: &mut String) {
    let Some(cut) = &bounded.alone.cut else {
        return;
    };
    for part in &cut.parts {
        let (cycles, role) = (part.code.tick.cycles_max(1), part.role);
        let _ = writeln!(out, "  {cycles:>6}  {role}, on core {}", part.core);
    }
    if let (_, Some(tail)) = (cut, bounded.alone.zones.first()) {
        let _ = writeln!(out, "  {:>6}  tail, on core 0", tail.tick.cycles_max(1));
    }
    if let Some(helped) = &cut.helped {
        let [own, of_core1] = helped.members_cycles_max();
        let is_member = |part: &PartBound| matches!(part.role, Role::Member(_));
        let _ = match cut.parts.iter().any(is_member) {
            true => writeln!(
                out,
                "  {own:>6}  core 0 with its members, {of_core1} until core 1 is done with its own"
            ),
            false => writeln!(
                out,
                "  {own:>6}  until core 0 has done the head, {of_core1} until core 1 has met it"
            ),
        };
        if let Some(sound) = helped.sound_cycles_max() {
            let _ = writeln!(out, "  {sound:>6}  core 1 with what is heard");
        }
    }
}

/// What the waiting of a core's frame consists of.
fn print_waiting(bounded: &Bounded, out: &mut String) {
    for waited in bounded.waiting() {
        let data = match waited.data {
            "" => String::new(),
            data => format!(": {data}"),
        };
        let _ = writeln!(out, "  {:>12}  {}{data}", waited.cycles, waited.cause);
    }
}
