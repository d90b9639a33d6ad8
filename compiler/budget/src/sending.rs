//! Columns of converters: that a tick within its bound is neither too late to send what the one
//! before has made, nor looks for words before they lie in memory. Either would be a missed tick.
//!
//! ```text
//!   request --> how late it is, is read: up to `SEND_CYCLES_MAX` it sends --> words are looked for
//!           at most `Sending::cycles_max`                            no sooner than `instructions_min`
//! ```

use super::graph::{Control, Destination, Graph, Item, Tables};
use super::tick_handler::{Around, OnCore, find};
use super::{Annotations, NotBounded, Query, bound};
use whippen_firmware::{LOOKS, SEND_CYCLES_MAX, TIMED};
use whippen_isa::Op;

/// When a tick reads how late it is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Sending {
    /// Cycles from the request until it has read that, at most.
    pub cycles_max: u64,
    /// Cycles up to which it sends.
    pub until_cycles: u64,
}

impl OnCore<'_> {
    /// Of the core that sends, where the board has columns.
    pub(super) fn bound_sending(
        &self,
        handler: u32,
        around: &Around,
    ) -> Result<Option<Sending>, NotBounded> {
        let columns = self.interference.board.columns.as_ref();
        let Some(columns) = columns.filter(|_| self.number == 0) else {
            return Ok(None);
        };
        let whole = Annotations {
            handler: true,
            ends_apart: true,
            bases: self.stack_base()?,
            ..self.program.annotations.clone()
        };
        let graph = Graph::build(&self.query(handler, &whole), &Tables::default())?;
        let until = |symbol: &str| {
            let at = find(self.program, symbol)?;
            let mut items = graph.blocks.iter().flat_map(|block| &block.items);
            let missing = NotBounded::NoSymbol {
                name: symbol.to_string(),
            };
            items.find(|item| item.address == at).ok_or(missing)?;
            Ok::<_, NotBounded>(Annotations {
                stops: [at].into(),
                ..whole.clone()
            })
        };
        let (timed, looks) = (until(TIMED)?, until(LOOKS)?);
        let looks_min = instructions_min(&self.query(handler, &looks))?;
        let words_cycles = columns.words_cycles().into();
        if looks_min < words_cycles {
            return Err(NotBounded::LooksEarly {
                cycles_min: looks_min,
                words_cycles,
            });
        }
        let timed = bound(&self.query(handler, &timed))?.cycles_max;
        let cycles_max = self.cycles_before(around) + timed;
        let until_cycles = SEND_CYCLES_MAX.into();
        match cycles_max <= until_cycles {
            true => Ok(Some(Sending {
                cycles_max,
                until_cycles,
            })),
            false => Err(NotBounded::SendsLate {
                cycles_max,
                until_cycles,
            }),
        }
    }
}

/// The fewest instructions on any path to an end that take a cycle at least: branches, NOP and IT
/// may share that of another one (`docs/timing.md`).
fn instructions_min(query: &Query) -> Result<u64, NotBounded> {
    let graph = Graph::build(query, &Tables::default())?;
    let mut fewest = vec![u64::MAX; graph.blocks.len()];
    let mut at_end = u64::MAX;
    let mut open = vec![(0, 0)];
    while let Some((block, before)) = open.pop() {
        if before >= fewest[block] {
            continue;
        }
        fewest[block] = before;
        let items = graph.blocks[block].items.iter();
        let takes = |item: &&Item| {
            item.control == Control::Next && ![Op::IT, Op::NOP].contains(&item.inst.op())
        };
        let own = items.filter(takes).count() as u64;
        for edge in &graph.blocks[block].edges {
            match edge.to {
                Destination::Block(next) => open.push((next, before + own)),
                Destination::Stop => at_end = at_end.min(before + own),
            }
        }
    }
    Ok(at_end)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Code;
    use whippen_isa::Arch;
    use whippen_isa::timing::Core;
    use whippen_words::assembled;

    /// Up to the last of some texts.
    fn fewest(texts: &[&str]) -> u64 {
        let bytes = assembled(texts, Arch::V8M);
        let end = 0x100 + bytes.len() as u32 - 2;
        let annotations = Annotations {
            stops: [end].into(),
            ..Annotations::default()
        };
        let query = Query {
            core: &Core::cortex_m33(),
            code: &Code::new(0x100, bytes),
            entry: 0x100,
            annotations: &annotations,
            interference: None,
        };
        instructions_min(&query).expect("a number")
    }

    #[test]
    fn instructions_of_the_shortest_way_are_counted() {
        let add = "adds r1, #1";
        assert_eq!(fewest(&["bx lr"]), 0);
        assert_eq!(fewest(&[add, add, add, "bx lr"]), 3);
        // They may share the cycle of another one.
        assert_eq!(fewest(&[add, "nop", "it eq", "addeq r1, #1", "bx lr"]), 2);
        assert_eq!(fewest(&["b .+2", add, "b .+2", "bx lr"]), 1);
        // Past two of three, whichever way is found first, and back to where it was.
        assert_eq!(fewest(&["cbz r0, .+6", add, add, add, "bx lr"]), 1);
        assert_eq!(fewest(&["cbz r0, .+4", "b .+6", add, add, "bx lr"]), 0);
        let twice = [
            "cbz r0, .+6",
            add,
            add,
            "cbz r0, .+6",
            add,
            add,
            add,
            "bx lr",
        ];
        assert_eq!(fewest(&twice), 1);
        assert_eq!(fewest(&[add, add, "bne .-2", "bx lr"]), 2);
    }
}
