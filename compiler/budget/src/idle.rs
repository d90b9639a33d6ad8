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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Annotations, Code};
    use whippen_isa::Arch;
    use whippen_isa::timing::Core;
    use whippen_words::assembled;

    /// Of instructions before a branch back to the first.
    fn of(texts: &[&str]) -> Result<(u64, u32), NotBounded> {
        let core = Core::cortex_m33();
        let mut bytes = assembled(texts, Arch::V8M);
        let back = 0xe000 | (0x7ff & (-(bytes.len() as i32) / 2 - 2)) as u16;
        bytes.extend(back.to_le_bytes());
        let (code, annotations) = (
            Code::new(0x100, bytes),
            Annotations {
                sleeps: true,
                ..Annotations::default()
            },
        );
        let idle = Idle::of(&Query {
            core: &core,
            code: &code,
            entry: 0x100,
            annotations: &annotations,
            interference: None,
        })?;
        Ok((idle.cycles_max, idle.stack_bytes_max))
    }

    /// What is behind it may be late by a cycle more. A branch goes to a 32-bit instruction across
    /// two words, which is a cycle more than to any other.
    #[test]
    fn the_longest_instruction_is_finished_with_what_it_makes_late() {
        let branch = Core::cortex_m33().branches;
        let back = u64::from(branch.taken.cycles + branch.split_target.cycles);
        assert_eq!((back, of(&["wfe"])), (3, Ok((3 + 1, 0))));
        assert_eq!(of(&["udiv r0, r1, r2"]), Ok((11 + 1, 0)));
        assert_eq!(
            of(&["push {r0, r1, r2, r3, r4}", "add sp, #20"]),
            Ok((5 + 1, 20))
        );
        assert_eq!(of(&["push {r0-r7}", "add sp, #32"]), Ok((8 + 1, 32)));
    }

    #[test]
    fn the_floating_point_unit_has_more_to_be_saved() {
        let refused = NotBounded::FloatingPoint { address: 0x102 };
        assert_eq!(of(&["nop", "vadd.f32 s0, s1, s2"]), Err(refused));
    }
}
