//! The worst-case path through a key as assembly: one instruction after the other, as it is
//! executed.

use std::fmt::Write;

use whippen_compiler::pipeline::Compiled;
use whippen_isa::{Class, Inst, ItState};

use crate::cmd::proof::{ImageProof, ProgramReport};
use crate::cmd::setup::symbol_prefix;

impl ImageProof<'_> {
    /// A text for an assembler; branches lead to one label, because what they cost is not where
    /// they go.
    pub fn path_as_assembly(&self) -> String {
        let by_cycles = self
            .programs
            .iter()
            .max_by_key(|played| played.worst_case().bound.cycles_max);
        let Some((worst, name)) =
            by_cycles.map(|played| (played.worst_case(), symbol_prefix(slowest(played))))
        else {
            return String::new();
        };
        let mut text = format!(
            "@ {}: {} cycles, {}\n        .syntax unified\n        .thumb\nkey:\n",
            name, worst.bound.cycles_max, worst.mode
        );
        let mut it = ItState::OUTSIDE;
        for step in &worst.bound.path {
            let Some(Ok(inst)) = self
                .bytes
                .code
                .decode(step.address, self.setup.board.arch, it)
            else {
                continue;
            };
            it = inst.it_behind(it).unwrap_or_default();
            let _ = writeln!(
                text,
                "        {:<40}@ {:08x} {}",
                assembly(&inst),
                step.address,
                step.cycles
            );
        }
        text
    }
}

/// What the keys play that take the most cycles.
fn slowest<'a>(played: &ProgramReport<'a>) -> &'a Compiled {
    played.zone(played.slowest_zone()).compiled
}

/// An instruction without the address it branches to.
fn assembly(inst: &Inst) -> String {
    let text = inst.to_string();
    let before = match inst.class() {
        Class::Branch => text.split_once(' ').map(|(name, _)| format!("{name} ")),
        Class::CompareBranch => text
            .rsplit_once(' ')
            .map(|(before, _)| format!("{before} ")),
        _ => None,
    };
    before.map_or(text, |before| before + "key")
}
