//! Events: appended to a ring that somebody else reads, counted as lost where it is full, never waited for.
//!
//! ```text
//!   head, tail: bytes ever written, ever read     | tick | key, event << 16 | argument | ... |   a power of two
//! ```

use super::memory::EVENTS;
use super::word::shift_code;
use super::{Reg, Select};
use crate::kernel::Value;
use crate::thumb::frame::{EVENT_BYTES, EVENT_HEAD, EVENT_LOST, EVENT_TAIL, K, T, TICK};
use crate::thumb::vcode::{Code, Edge, End, Place, Role, VReg};
use whippen_isa::{Cond, Op as Isa};

impl Select<'_> {
    pub(super) fn event(&mut self, event: u32, args: &[Value]) {
        let args: Vec<VReg> = args.iter().map(|arg| self.reg(*arg)).collect();
        let state = Self::fixed(T);
        let head = self.load(Isa::LDR_immediate, state, EVENT_HEAD.into(), EVENTS);
        let tail = self.load(Isa::LDR_immediate, state, EVENT_TAIL.into(), EVENTS);
        let used = self.three(Isa::SUB_register, head, tail);
        // Where a bit from that of the ring's size on is set, there is no room.
        self.result(shift_code(Isa::LSR_immediate, EVENT_BYTES.trailing_zeros() as u8).reg(Role::M, used).flags());
        let (room, full, after) = (self.func.block(), self.func.block(), self.func.block());
        let end = End::Branch { cond: Cond::EQ, yes: room, no: full, likely: Some(true) };
        self.func.blocks[self.at].end = end;
        self.at = room;
        self.append(event, head, &args);
        self.func.blocks[room].end = End::Jump(Edge { block: after, args: Vec::new() });
        self.at = full;
        self.count(EVENT_LOST);
        self.func.blocks[full].end = End::Jump(Edge { block: after, args: Vec::new() });
        self.at = after;
    }

    fn append(&mut self, event: u32, head: VReg, args: &[VReg]) {
        let state = Self::fixed(T);
        let offset = self.result(Code::new(Isa::UBFX).reg(Role::N, head).imm(EVENT_BYTES.trailing_zeros()));
        let ring = self.apart();
        let at = self.result(Code::new(Isa::ADD_register).with(Role::N, ring).reg(Role::M, offset));
        let at = Reg::Virtual(at);
        let base = i64::from(self.frame.events);
        let tick = self.load(Isa::LDR_immediate, state, TICK.into(), Place::Constant);
        self.store(Isa::STR_immediate, at, base, EVENTS, tick);
        let key = self.load(Isa::LDR_immediate, Self::fixed(K), self.frame.number.unwrap_or(0).into(), Place::Constant);
        let about = self.plus(key, i64::from(event) << 16);
        self.store(Isa::STR_immediate, at, base + 4, EVENTS, about);
        for (index, arg) in args.iter().enumerate() {
            self.store(Isa::STR_immediate, at, base + 8 + 4 * index as i64, EVENTS, *arg);
        }
        let head = self.plus(head, self.frame.event.into());
        self.store(Isa::STR_immediate, state, EVENT_HEAD.into(), EVENTS, head);
    }

    /// Adds one to a word of the state.
    fn count(&mut self, offset: u32) {
        let before = self.load(Isa::LDR_immediate, Self::fixed(T), offset.into(), EVENTS);
        let after = self.plus(before, 1);
        self.store(Isa::STR_immediate, Self::fixed(T), offset.into(), EVENTS, after);
    }
}
