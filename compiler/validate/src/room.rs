//! How many events a tick can have, by its modes: not more than the tick's entry leaves room for.

use whippen_ids::IdMap;
use whippen_kernel::{Inst, Op};
use whippen_modes::{BlockId, Mode};

use crate::places::Question;
use crate::stop::{Doubt, Reason};

impl Question<'_> {
    /// Whether the most events of a tick have room, and an event all its words.
    ///
    /// # Errors
    /// They may have none.
    pub(crate) fn check_room(&self) -> Result<(), Doubt> {
        let mut most = self.modes.modes.iter().map(most_events);
        let most = most.try_fold(0, |all, own| own.map(|own| all.max(own)));
        let Some(most) = most else {
            return Err(doubt("a mode goes round"));
        };
        let Some(ring) = self.places.events.filter(|_| most > 0) else {
            return match most {
                0 => Ok(()),
                _ => Err(doubt("there is no ring of events")),
            };
        };
        let bytes = u64::from(self.places.event_bytes);
        if most * u64::from(self.places.keys) * bytes > u64::from(ring.tick_bytes) {
            return Err(doubt("a tick may have more events than there is room for"));
        }
        let args = self.modes.kernel.events.iter().map(|event| event.args);
        let words = 2 + args.max().unwrap_or(0);
        match 4 * u64::from(words) <= bytes {
            true => Ok(()),
            false => Err(doubt("an event is longer than its room")),
        }
    }
}

fn doubt(why: &str) -> Doubt {
    Doubt::new(Reason::Entry, why)
}

/// The most events on any path of a mode; none where a path has no end.
fn most_events(mode: &Mode) -> Option<u64> {
    let mut known = IdMap::filled(None, mode.blocks.len());
    behind(mode, BlockId(0), &[], &mut known)
}

/// The most from a block on, which some blocks have led to.
fn behind(
    mode: &Mode,
    at: BlockId,
    entered: &[BlockId],
    known: &mut IdMap<BlockId, Option<u64>>,
) -> Option<u64> {
    if let Some(most) = known[at] {
        return Some(most);
    }
    if entered.contains(&at) {
        return None;
    }
    let entered = [entered, &[at]].concat();
    let block = &mode.blocks[at];
    let mut most = 0;
    for target in block.end.targets() {
        most = most.max(behind(mode, target.block, &entered, known)?);
    }
    let most = most + events(&block.insts);
    known[at] = Some(most);
    Some(most)
}

/// The most events of some instructions.
fn events(insts: &[Inst]) -> u64 {
    let of = |inst: &Inst| {
        let inner = inst.regions.iter().map(|region| events(&region.insts));
        match inst.op {
            Op::Emit(_) => 1,
            Op::Loop(rounds) => u64::from(rounds) * inner.sum::<u64>(),
            _ => inner.max().unwrap_or(0),
        }
    };
    insts.iter().map(of).sum()
}
