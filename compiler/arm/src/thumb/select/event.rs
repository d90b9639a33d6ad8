//! Events: stored where the tick's next one goes; that there is room is looked after once a tick
//! (`entry/events.rs`).
//!
//! ```text
//!   next -> | tick | key, event << 16 | argument | ... |   a power of two
//! ```

use super::Select;
use super::memory::{EVENTS, post_increment};
use crate::thumb::func::BlockId;
use crate::thumb::minst::{Access, AliasClass, MInst, Reg, Role, VReg};
use crate::thumb::registers::{RECORD, STATE};
use crate::thumb::state_layout::{EVENT_NEXT, TICK};
use whippen_isa::Op as Isa;
use whippen_kernel::Value;

/// How far a store can go on.
const WALK_MAX: u32 = 255;

/// What is in registers behind an event.
#[derive(Debug, Clone, Copy)]
pub(super) struct EventEnd {
    block: BlockId,
    /// Where the next one goes.
    next: VReg,
    tick: VReg,
    key: VReg,
}

impl Select<'_> {
    pub(super) fn emit_event(&mut self, event: u32, args: &[Value]) {
        let (Some(ring), Some(number)) = (self.layout.ring, self.layout.number) else {
            return;
        };
        let args: Vec<VReg> = args.iter().map(|arg| self.reg(*arg)).collect();
        let state = Self::fixed(STATE);
        let known = self
            .last_event
            .filter(|written| self.is_near(written.block));
        let EventEnd {
            next, tick, key, ..
        } = known.unwrap_or_else(|| EventEnd {
            block: self.at,
            next: self.load(Isa::LDR_immediate, state, EVENT_NEXT.into(), EVENTS),
            tick: self.load(Isa::LDR_immediate, state, TICK.into(), AliasClass::Constant),
            key: self.load(
                Isa::LDR_immediate,
                Self::fixed(RECORD),
                number.into(),
                AliasClass::Constant,
            ),
        });
        let at = Reg::Virtual(next);
        let about = self.add_constant(key, i64::from(event) << 16);
        self.store(Isa::STR_immediate, at, 4, EVENTS, about);
        for (index, arg) in args.iter().enumerate() {
            self.store(Isa::STR_immediate, at, 8 + 4 * index as i64, EVENTS, *arg);
        }
        let behind = self.begun(next, tick, ring.event);
        self.store(Isa::STR_immediate, state, EVENT_NEXT.into(), EVENTS, behind);
        self.last_event = Some(EventEnd {
            block: self.at,
            next: behind,
            tick,
            key,
        });
    }

    /// Stores the first word of an event, last of all, because that store can go on to the next
    /// event.
    fn begun(&mut self, at: VReg, tick: VReg, bytes: u32) -> VReg {
        if bytes > WALK_MAX {
            self.store(Isa::STR_immediate, Reg::Virtual(at), 0, EVENTS, tick);
            return self.add_constant(at, bytes.into());
        }
        let behind = self.func.fresh();
        let store = MInst::new(Isa::STR_immediate)
            .reg(Role::T, tick)
            .access(Access::Write(EVENTS));
        self.emit(post_increment(store, bytes).both(Role::N, behind, at));
        behind
    }
}
