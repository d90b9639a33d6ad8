//! What a core runs while it plays, and nothing else: its tick and what is between ticks, in
//! sections of its own.

use std::mem;

use super::graph::{Graph, Tables};
use super::program::Program;
use super::tick_handler::{OnCore, find};
use super::{NotBounded, Query};
use whippen_firmware::{DEAD, Owner, Running, owner};

/// Whatever a core's table of vectors holds leads to the end, but for the one interrupt that its
/// handler is for.
pub(super) fn only_handler(
    program: &Program,
    running: &Running,
    handler: u32,
) -> Result<(), NotBounded> {
    let (table, dead) = (find(program, running.vectors)?, find(program, DEAD)?);
    // The first two words are not used after the start.
    let mut handled = false;
    for at in program.words_of(table).skip(2) {
        let vector = program.code.word(at).unwrap_or(0) & !1;
        // One interrupt asks for a tick.
        let handles = vector == handler && !mem::replace(&mut handled, true);
        if vector != 0 && !handles && vector != dead {
            return Err(NotBounded::Interrupts { address: vector });
        }
    }
    Ok(())
}

impl OnCore<'_> {
    /// That a core beside another one fetches from its own sections alone: what waits for whom is
    /// worked out by section.
    pub(super) fn runs_only_its_own(&self, query: &Query) -> Result<(), NotBounded> {
        if self.interference.others.contenders.is_empty() {
            return Ok(());
        }
        let graph = Graph::build(query, &Tables::default())?;
        for item in graph.blocks.iter().flat_map(|block| &block.items) {
            let Some(section) = self.program.section_at(item.address) else {
                continue;
            };
            if owner(&section.name) != Owner::Core(self.number) {
                return Err(NotBounded::Elsewhere {
                    address: item.address,
                    section: section.name.clone(),
                    core: self.number,
                });
            }
        }
        Ok(())
    }
}
