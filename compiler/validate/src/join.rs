//! Branches whose sides soon come together again: both sides are run, and what they leave is chosen
//! by the condition, as if the code had chosen without a branch. So a limit or a correction is no
//! case, and is one with that of a core whose instructions are conditional.
//!
//! Neither side may assume what the condition says; what both learn holds on either. Where sides
//! are long, call or branch again, or store where others may, the condition is a case as ever.

use whippen_isa::{Inst, ItState, Op, decode, is_wide};

use crate::flags::Status;
use crate::machine::{Machine, Next};
use crate::stop::{Stop, Told};
use crate::term::Terms;
use crate::truth::Truth;

/// Instructions of a side, at most.
const SIDE_MAX: usize = 10;

impl Machine<'_> {
    /// A branch to an address where something holds, else behind it.
    pub fn go(&mut self, terms: &mut Terms, holds: Truth, [to, behind]: [u32; 2]) -> Told<Next> {
        let holds = terms.settle(holds);
        if self.joins
            && holds.settled().is_none()
            && let Some(join) = self.join_of(to, behind)
            && self.both_sides(terms, holds, [to, behind], join)?
        {
            return Ok(Next::To(join));
        }
        let target = if terms.decide(holds)? { to } else { behind };
        Ok(Next::To(target))
    }

    /// Where two ways meet, if they do soon.
    fn join_of(&self, one: u32, other: u32) -> Option<u32> {
        let others = self.way_from(other);
        let own = self.way_from(one);
        own.into_iter().find(|at| others.contains(at))
    }

    /// The addresses of the next instructions, until one after which the way is not known.
    fn way_from(&self, mut at: u32) -> Vec<u32> {
        let mut way = Vec::new();
        while way.len() <= SIDE_MAX {
            way.push(at);
            let Some(inst) = self.plain_at(at) else {
                break;
            };
            at = match inst.op() {
                Op::B => at.wrapping_add(4).wrapping_add(inst.imm) & !1,
                _ => at.wrapping_add(inst.size()),
            };
        }
        way
    }

    /// The instruction there, if it always goes on to one place.
    fn plain_at(&self, at: u32) -> Option<Inst> {
        let code = self.question.code;
        let first = code.half(at)?;
        let second = match is_wide(first) {
            true => code.half(at.wrapping_add(2))?,
            false => 0,
        };
        let inst = decode(first, second, self.question.arch, ItState::OUTSIDE).ok()?;
        let leaves = matches!(inst.op(), Op::BL | Op::BX | Op::CBZ | Op::CBNZ | Op::IT)
            || inst.is_conditional()
            || inst.op() != Op::B && inst.defs().core_bits() & (1 << 15 | 1 << 13) != 0;
        (!leaves).then_some(inst)
    }

    /// Runs both sides as far as the join; whether what they leave is one state.
    fn both_sides(
        &mut self,
        terms: &mut Terms,
        holds: Truth,
        [to, behind]: [u32; 2],
        join: u32,
    ) -> Told<bool> {
        let ran = self.side(terms, to, join).and_then(|to| {
            self.unknown = to.unknown;
            let behind = self.side(terms, behind, join)?;
            Ok([to, behind])
        });
        let [to, behind] = match ran {
            Ok(sides) => sides,
            // In a case of its own it may be another thing.
            Err(Stop::Unproven(_)) => return Ok(false),
            Err(other) => return Err(other),
        };
        let Some(memory) = to.memory.or_else(terms, &behind.memory, holds)? else {
            return Ok(false);
        };
        self.looked_at.extend(to.looked_at);
        self.looked_at.extend(behind.looked_at);
        self.unknown = behind.unknown;
        self.memory = memory;
        for (register, own) in self.registers.iter_mut().enumerate() {
            *own = terms.select(holds, to.registers[register], behind.registers[register])?;
        }
        self.read |= to.read | behind.read;
        // What only one side has written may be what it was.
        self.written |= to.written & behind.written;
        self.flags = match terms.by_value || to.flags == behind.flags {
            true => to.flags.or_else(behind.flags, holds),
            false => Status::default(),
        };
        Ok(true)
    }

    /// The state at a join behind one side.
    fn side(&self, terms: &mut Terms, from: u32, join: u32) -> Told<Self> {
        let mut side = Machine {
            memory: self.memory.clone(),
            flags: self.flags.clone(),
            looked_at: Vec::new(),
            pc: from,
            ..*self
        };
        while side.pc != join {
            side.one(terms)?;
        }
        Ok(side)
    }
}
