//! What runs between ticks: the longest of its instructions, which a tick lets finish.

use whippen_isa::Class;
use whippen_isa::timing::{Outcome, Pipe, Target};

use super::graph::{Control, Graph, Tables};
use super::memory::{GraphMemory, SOMEWHERE};
use super::{NotBounded, Query, stack};

/// What the tick interrupts.
pub struct Idle {
    /// The longest instruction: it is finished first.
    pub cycles_max: u64,
    /// Bytes of stack.
    pub stack_bytes_max: u32,
}

impl Idle {
    /// Of what is between ticks.
    pub fn of(query: &Query) -> Result<Self, NotBounded> {
        let graph = Graph::build(query, &Tables::default())?;
        let memory = GraphMemory::of(&query.annotations.bases, &graph, query.interference);
        let items = graph.blocks.iter().flat_map(|block| &block.items);
        let mut cycles_max = 0;
        for item in items {
            if item.inst.class().is_floating_point() {
                return Err(NotBounded::FloatingPoint {
                    address: item.address,
                });
            }
            let taken = Target {
                address: SOMEWHERE,
                wide: true,
            };
            let target = (item.control != Control::Next).then_some(taken);
            let waits = match query.interference {
                Some(interference) => interference
                    .waits_max(&item.inst, item.address, &memory)?
                    .cycles(),
                None => 0,
            };
            let quotient_bits = if item.inst.class() == Class::Divide {
                31
            } else {
                0
            };
            let outcome = Outcome {
                target,
                waits,
                quotient_bits,
                ..Outcome::NEXT
            };
            let (_, cost) = query
                .core
                .issue(Pipe::default(), &item.timed, item.address, &outcome);
            let cycles = u64::from(cost.cycles()) + u64::from(query.core.late.cycles);
            cycles_max = cycles_max.max(cycles);
        }
        Ok(Self {
            cycles_max,
            stack_bytes_max: stack::follow(query, &graph)?.deepest,
        })
    }
}
