//! Calls and returns.

use whippen_isa::timing::{Pipe, Target};
use whippen_isa::{Class, reg};

use super::{Cost, State, Stepping, To};
use crate::Refusal;
use crate::certificate::Kind;
use crate::facts::Facts;
use crate::memory::SOMEWHERE;
use crate::place::Tag;

impl Stepping<'_, '_> {
    pub(super) fn calls(&mut self, callee: u32, state: State) -> Result<(), Refusal> {
        let (own, caller) = (self.own, self.node.context);
        let back = self.at().wrapping_add(self.inst.size());
        let calls = &own.function.calls;
        let known = calls
            .iter()
            .position(|c| c.site == self.at() && c.callee == callee);
        if let Some(known) = known {
            return match own.costs.get(known) {
                Some(Some(cost)) => self.calls_known(callee, back, cost, state),
                _ => Ok(()),
            };
        }
        let wanted = [caller, back, callee];
        let contexts = own.function.contexts.iter();
        let context = contexts.skip(1).position(|context| *context == wanted);
        let context = context.ok_or_else(|| self.refusal("calls what the certificate has not"))?;
        let context = context as u32 + 1;
        if context <= caller {
            return Err(self.refusal("calls what may lead to it"));
        }
        let mut state = state;
        let target = own.target(callee);
        let cycles = self.cycles_of(Some(target), &mut state)?;
        state.place.registers[usize::from(reg::LR)] = Some(Tag::Return(context, state.place.sp));
        self.steps.push((self.jump(context, callee), state, cycles));
        Ok(())
    }

    /// What the callee leaves in registers is not known; nothing remains in the pipeline.
    fn calls_known(
        &mut self,
        callee: u32,
        back: u32,
        cost: &Cost,
        state: State,
    ) -> Result<(), Refusal> {
        let mut state = state;
        let (own, target) = (self.own, self.own.target(callee));
        let cycles = self.cycles_of(Some(target), &mut state)?;
        let below = state.place.sp.unsigned_abs().saturating_add(cost.stack);
        self.seen.stack = self.seen.stack.max(below);
        self.returns_for_no_more(own.target(back), cost)?;
        state.pipe = Pipe::default();
        state.facts = Facts::default();
        state.place.registers = [None; 16];
        let to = self.jump(self.node.context, back);
        self.steps.push((to, state, cycles + cost.cycles));
        Ok(())
    }

    /// That the way back from a callee costs no more than the one it is bounded with.
    fn returns_for_no_more(&self, to: Target, cost: &Cost) -> Result<(), Refusal> {
        let around = self.own.around;
        let Some((at, wide)) = cost.returns else {
            return Ok(());
        };
        let split = |at: u32, wide: bool| at & 2 != 0 && wide;
        let costs_more = split(to.address, to.wide) && !split(at, wide)
            || around.target_wait(to.address)? > around.target_wait(at)?
            || around.fetched_at(to.address) & !cost.fetched != 0;
        match costs_more {
            true => Err(self.refusal("is returned to at more than is claimed")),
            false => Ok(()),
        }
    }

    pub(super) fn comes_back(&mut self, state: State) -> Result<(), Refusal> {
        let (own, inst, context) = (self.own, self.inst, self.node.context);
        let mut state = state;
        let from_stack = matches!(inst.class(), Class::Load | Class::LoadMultiple);
        let tag = match from_stack {
            true => state.place.loaded_pc(&inst),
            false => state.place.tag(reg::LR),
        };
        let Some(Tag::Return(to, sp)) = tag else {
            return Err(self.refusal("does not return to its caller"));
        };
        let called = own
            .function
            .contexts
            .get(context as usize)
            .copied()
            .unwrap_or_default();
        let root = context == 0;
        let target = match (root, own.function.kind) {
            (true, Kind::Handler) => None,
            (true, _) => own.function.returns.or(Some((SOMEWHERE, true))),
            _ => Some((called[1], own.elf().is_wide(called[1]))),
        };
        let target = target.map(|(address, wide)| Target { address, wide });
        let cycles = self.cycles_of(target, &mut state)?;
        if to != context || sp != state.place.sp {
            return Err(self.refusal("does not return to its caller"));
        }
        let to = match root {
            true => To::Return,
            false => self.jump(called[0], called[1]),
        };
        self.steps.push((to, state, cycles));
        Ok(())
    }
}
