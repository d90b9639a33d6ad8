//! `floor(sqrt(a))`, 0 where `a` is negative: bit by bit from the top, each kept if the square
//! still fits.

use super::Select;
use crate::thumb::func::{Edge, Terminator};
use crate::thumb::minst::{MInst, Role, VReg};
use whippen_isa::{Cond, Op as Isa};
use whippen_kernel::Value;

impl Select<'_> {
    pub(super) fn square_root(&mut self, value: Value) -> VReg {
        // Roots are words, so they have 31 bits at most.
        let largest = self
            .info(value)
            .range
            .high
            .max(0)
            .isqrt()
            .min(i32::MAX.into());
        let bits = (64 - largest.leading_zeros()).max(1);
        let (low, high) = self.pair(value);
        let (low, high) = self.clear_if_negative(low, high);
        let (zero, top) = (self.load_constant(0), self.load_constant(1 << (bits - 1)));
        let (root, bit) = (self.func.fresh(), self.func.fresh());
        let (head, again, after) = (self.func.block(), self.func.block(), self.func.block());
        self.func.blocks[self.at].end = Terminator::Jump(Edge {
            block: head,
            args: vec![zero, top],
        });
        self.func.blocks[head].params = vec![root, bit];
        self.func.blocks[head].rounds = Some(bits);
        self.at = head;
        let tried = self.emit_rrr(Isa::ADD_register, root, bit);
        let square = self.multiply_long(Isa::UMULL, tried, tried);
        self.compare_pairs((low, high), square);
        let next = self.move_if(Cond::GE, super::Binding::Word(tried), root);
        let lower = self.shift_right_with_flags(bit);
        self.func.blocks[head].end = Terminator::Branch {
            cond: Cond::NE,
            yes: again,
            no: after,
            likely: Some(true),
        };
        self.func.blocks[again].end = Terminator::Jump(Edge {
            block: head,
            args: vec![next, lower],
        });
        self.at = after;
        next
    }

    /// A bit moved down, with flags.
    fn shift_right_with_flags(&mut self, bit: VReg) -> VReg {
        let code = super::shift::shift_code(Isa::LSR_immediate, 1);
        self.result(code.reg(Role::M, bit).flags())
    }

    /// The same, or zero for a negative number.
    fn clear_if_negative(&mut self, low: VReg, high: VReg) -> (VReg, VReg) {
        let sign = self.sign_mask(high);
        let clear = |word| {
            MInst::new(Isa::BIC_register)
                .reg(Role::N, word)
                .reg(Role::M, sign)
        };
        (self.result(clear(low)), self.result(clear(high)))
    }
}
