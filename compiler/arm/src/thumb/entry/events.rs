//! Room for the events of a tick, and telling the reader of them.
//!
//! ```text
//!   ring | ... read | waiting | this tick's go here ... | spare: a tick that has no room |
//!                    ^ tail    ^ head
//! ```
//!
//! Events of a tick never go round the ring's end: where fewer bytes are left than a tick may need,
//! a mark stands there and they begin at the ring's beginning. Head moves at the end of the tick,
//! so a reader finds whole events only.

use super::EntryWriter;
use crate::thumb::emit::{Item, Label};
use crate::thumb::minst::template;
use crate::thumb::registers::STATE;
use crate::thumb::state_layout::{EVENT_HEAD, EVENT_LOST, EVENT_NEXT, EVENT_TAIL, Ring};
use whippen_isa::{Cond, Inst, Op};

impl EntryWriter<'_> {
    /// Where this tick's events go. Uses R0 to R5, and three labels from `label`
    /// on.
    pub(super) fn open_events(&mut self, label: Label) {
        let Some(ring) = self.layout.ring else { return };
        let (fits, full, done) = (label, label + 1, label + 2);
        let [head, used, at, base, most, left] = [0, 1, 2, 3, 4, 5];
        self.ring_base(base, &ring);
        self.load(head, EVENT_HEAD);
        self.load(used, EVENT_TAIL);
        self.difference(used, head, used);
        self.shifted(
            Op::LSL_immediate,
            at,
            head,
            32 - ring.bytes.trailing_zeros(),
        );
        self.shifted(Op::LSR_immediate, at, at, 32 - ring.bytes.trailing_zeros());
        self.offset(most, ring.bytes - ring.tick_bytes_max);
        self.go(at, most, Cond::LS, fits);
        self.offset(left, ring.bytes);
        self.difference(left, left, at);
        self.sum(used, used, left);
        self.go(used, most, Cond::HI, full);
        self.sum(head, head, left);
        self.sum(at, at, base);
        // The mark is an event that no kernel has.
        self.offset(left, 0);
        self.flagged(Inst {
            d: left,
            m: left,
            ..template(Op::MVN_register)
        });
        self.op(Inst {
            t: left,
            n: at,
            imm: 4,
            ..template(Op::STR_immediate)
        });
        self.store(head, EVENT_HEAD);
        self.offset(at, 0);
        self.items.push(Item::Label(fits));
        self.go(used, most, Cond::HI, full);
        self.sum(at, at, base);
        self.items.push(Item::Branch {
            cond: None,
            to: done,
        });
        self.items.push(Item::Label(full));
        self.offset(at, ring.spare());
        self.sum(at, at, base);
        self.items.push(Item::Label(done));
        self.store(at, EVENT_NEXT);
    }

    /// This tick's events are for the reader, or lost. Uses R0 to R3, and two labels from `label`
    /// on.
    pub(super) fn close_events(&mut self, label: Label) {
        let Some(ring) = self.layout.ring else { return };
        let (lost, done) = (label, label + 1);
        let [next, word, bytes, base] = [0, 1, 2, 3];
        self.ring_base(base, &ring);
        self.load(next, EVENT_NEXT);
        self.load(word, EVENT_HEAD);
        self.difference(next, next, base);
        self.offset(bytes, ring.bytes);
        self.go(next, bytes, Cond::HI, lost);
        self.shifted(Op::LSR_immediate, word, word, ring.bytes.trailing_zeros());
        self.shifted(Op::LSL_immediate, word, word, ring.bytes.trailing_zeros());
        self.sum(word, word, next);
        self.store(word, EVENT_HEAD);
        self.items.push(Item::Branch {
            cond: None,
            to: done,
        });
        self.items.push(Item::Label(lost));
        self.offset(bytes, ring.spare());
        self.difference(next, next, bytes);
        self.shifted(Op::LSR_immediate, next, next, ring.event.trailing_zeros());
        self.load(word, EVENT_LOST);
        self.sum(word, word, next);
        self.store(word, EVENT_LOST);
        self.items.push(Item::Label(done));
    }

    fn ring_base(&mut self, d: u8, ring: &Ring) {
        match self.layout.apart {
            Some(at) => self.load(d, at + 4),
            None => {
                self.offset(d, ring.at);
                self.sum(d, d, STATE);
            }
        }
    }

    /// Low registers, flags set: so every architecture has it, in 16 bits.
    fn flagged(&mut self, inst: Inst) {
        self.op(Inst { s: true, ..inst });
    }

    /// `d = n + m`
    fn sum(&mut self, d: u8, n: u8, m: u8) {
        self.flagged(Inst {
            d,
            n,
            m,
            ..template(Op::ADD_register)
        });
    }

    /// `d = n - m`
    fn difference(&mut self, d: u8, n: u8, m: u8) {
        self.flagged(Inst {
            d,
            n,
            m,
            ..template(Op::SUB_register)
        });
    }

    fn shifted(&mut self, op: Op, d: u8, m: u8, amount: u32) {
        self.flagged(Inst {
            d,
            m,
            amount: amount as u8,
            ..template(op)
        });
    }

    /// On to a label if two registers compare so.
    fn go(&mut self, n: u8, m: u8, cond: Cond, to: Label) {
        self.op(Inst {
            n,
            m,
            ..template(Op::CMP_register)
        });
        self.items.push(Item::Branch {
            cond: Some(cond),
            to,
        });
    }
}
