//! Events: stored where the tick's next one goes; that there is room is looked after once a tick (`entry/events.rs`).
//!
//! ```text
//!   next -> | tick | key, event << 16 | argument | ... |   a power of two
//! ```

use super::Select;
use super::memory::EVENTS;
use crate::kernel::Value;
use crate::thumb::frame::{EVENT_NEXT, K, T, TICK};
use crate::thumb::vcode::Reg;
use crate::thumb::vcode::{Place, VReg};
use whippen_isa::Op as Isa;

impl Select<'_> {
    pub(super) fn event(&mut self, event: u32, args: &[Value]) {
        let (Some(ring), Some(number)) = (self.frame.ring, self.frame.number) else { return };
        let args: Vec<VReg> = args.iter().map(|arg| self.reg(*arg)).collect();
        let state = Self::fixed(T);
        let next = self.load(Isa::LDR_immediate, state, EVENT_NEXT.into(), EVENTS);
        let at = Reg::Virtual(next);
        let tick = self.load(Isa::LDR_immediate, state, TICK.into(), Place::Constant);
        self.store(Isa::STR_immediate, at, 0, EVENTS, tick);
        let key = self.load(Isa::LDR_immediate, Self::fixed(K), number.into(), Place::Constant);
        let about = self.plus(key, i64::from(event) << 16);
        self.store(Isa::STR_immediate, at, 4, EVENTS, about);
        for (index, arg) in args.iter().enumerate() {
            self.store(Isa::STR_immediate, at, 8 + 4 * index as i64, EVENTS, *arg);
        }
        let next = self.plus(next, ring.event.into());
        self.store(Isa::STR_immediate, state, EVENT_NEXT.into(), EVENTS, next);
    }
}
