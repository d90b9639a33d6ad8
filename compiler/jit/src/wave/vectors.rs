//! A string of one key in vectors over points: right sides are those before the tick, so no point
//! waits for another.
//!
//! ```text
//!   bends:  W_0 | W_1 .. W_4 | W_5 .. W_8 | ..     | W_N     kept on the stack, from U
//!                                    | the last four |       blocks may overlap: what is written is the same
//!   points: 1 .. 4 | 5 .. 8 | ..                             in place; the rates to the left of a block are
//!                                    | the last four |       kept, the last block is made first and stored last
//! ```

use super::Points;
use crate::saturate;
use cranelift_codegen::ir::condcodes::IntCC;
use cranelift_codegen::ir::types::{I32, I32X4, I64};
use cranelift_codegen::ir::{InstBuilder, StackSlotData, StackSlotKind, Value};

/// Points of a block.
const WIDTH: i64 = 4;

/// The fewest points that are two blocks, one of them with a neighbour on each side.
const COUNT_MIN: i64 = 8;

/// Whether a string of so many points, so many bytes apart, is ticked in vectors: where they are
/// tested, and lie side by side.
pub(super) fn suits(count: i64, step: i64) -> bool {
    cfg!(target_arch = "x86_64") && count >= COUNT_MIN && step == 4
}

/// The neighbours of a block's words that are not beside them in memory.
#[derive(Clone, Copy)]
enum Beside {
    /// They are in memory.
    Memory,
    /// The word on the left is the last of these.
    Left(Value),
    /// The word on the right is that of the end, which is 0.
    End,
}

impl Points<'_, '_> {
    /// One tick of all points.
    pub(super) fn tick_in_vectors(mut self) {
        // Were it known that all words are the same, they would be widened outside of the loop, and
        // products of words in it would become those of 64 bits.
        self.k = self.k.map(|k| {
            let first = self.ins().scalar_to_vector(I32X4, k);
            self.words_of(first, first, [0; 4])
        });
        self.ty = I32X4;
        let bends = self.bends();
        let [u, v] = self.start;
        let last = 4 * (self.count - WIDTH);
        let at = self.ins().iconst(I64, last);
        let tail = self.block(bends, at, Beside::End);
        let zero = saturate::constant(self.f, self.k[0], 0);
        // Blocks whose right neighbours are in memory: all but the last.
        self.blocks(0, zero, |points, at, rates| {
            let [here, place, rate] = points.block(bends, at, Beside::Left(rates));
            let access = points.access.columns;
            for (start, words) in [(u, place), (v, rate)] {
                let to = points.ins().iadd(start, at);
                points.ins().store(access, words, to, 0);
            }
            here
        });
        let [_, place, rate] = tail;
        let access = self.access.columns;
        for (start, words) in [(u, place), (v, rate)] {
            self.ins().store(access, words, start, last as i32);
        }
    }

    /// The bends of all points and both ends; gives where they stand.
    fn bends(&mut self) -> Value {
        let bytes = 4 * (self.count + 2) as u32;
        let slot = StackSlotData::new(StackSlotKind::ExplicitSlot, bytes, 4);
        let slot = self.f.create_sized_stack_slot(slot);
        let bends = self.ins().stack_addr(I64, slot, 0);
        let u = self.start[0];
        let last = 4 * (self.count - 1);
        for (end, at, to) in [(self.ends[0], 0, 0), (self.ends[1], last, last + 8)] {
            let access = self.access.columns;
            let outermost = self.ins().load(I32, access, u, at as i32);
            let held = self.held(end, outermost);
            self.ins().store(access, held, bends, to as i32);
        }
        let [first, behind] = [0, 4 * (self.count - WIDTH)].map(|at| self.ins().iconst(I64, at));
        let zero = saturate::constant(self.f, self.k[0], 0);
        self.bend(bends, first, Beside::Left(zero));
        self.blocks(1, zero, |points, at, carried| {
            points.bend(bends, at, Beside::Memory);
            carried
        });
        self.bend(bends, behind, Beside::End);
        bends
    }

    /// The bends of a block.
    fn bend(&mut self, bends: Value, at: Value, beside: Beside) {
        let from = self.start[0];
        let [left, here, right] = self.neighbours(from, at, beside);
        let (before, after) = (self.ins().isub(here, left), self.ins().isub(right, here));
        let bend = self.minus(after, before);
        let (to, access) = (self.ins().iadd(bends, at), self.access.columns);
        self.ins().store(access, bend, to, 4);
    }

    /// The rates of a block before the tick, and its `U` and rates behind it.
    fn block(&mut self, bends: Value, at: Value, beside: Beside) -> [Value; 3] {
        let [u, v] = self.start;
        let [left, here, right] = self.neighbours(v, at, beside);
        let [bends, u] = [bends, u].map(|start| self.ins().iadd(start, at));
        let access = self.access.columns;
        let [w_before, w, w_after] =
            [0, 4, 8].map(|offset| self.ins().load(I32X4, access, bends, offset));
        let (bends, rates) = (self.plus(w_before, w_after), self.plus(left, right));
        let a = self.sum_of_tops([w, bends, rates, here]);
        let rate = self.plus(here, a);
        let place = self.ins().load(I32X4, access, u, 0);
        let twice = self.ins().iadd(rate, rate);
        [here, self.ins().iadd(place, twice), rate]
    }

    /// A block's words, and those to their left and right.
    fn neighbours(&mut self, start: Value, at: Value, beside: Beside) -> [Value; 3] {
        let at = self.ins().iadd(start, at);
        let access = self.access.columns;
        let here = self.ins().load(I32X4, access, at, 0);
        let left = match beside {
            Beside::Left(before) => self.words_of(before, here, [3, 4, 5, 6]),
            _ => self.ins().load(I32X4, access, at, -4),
        };
        let right = match beside {
            Beside::End => {
                let zero = saturate::constant(self.f, here, 0);
                self.words_of(here, zero, [1, 2, 3, 4])
            }
            _ => self.ins().load(I32X4, access, at, 4),
        };
        [left, here, right]
    }

    /// All blocks from this one on whose right neighbours are in memory, with a value that is
    /// carried on.
    fn blocks(
        &mut self,
        first: i64,
        carried: Value,
        each: impl FnOnce(&mut Self, Value, Value) -> Value,
    ) {
        let end = 4 * WIDTH * ((self.count - 1) / WIDTH);
        let start = 4 * WIDTH * first;
        if start >= end {
            return;
        }
        let [head, after] = [(); 2].map(|()| self.f.create_block());
        let start = self.ins().iconst(I64, start);
        self.ins().jump(head, &[start.into(), carried.into()]);
        let at = self.f.append_block_param(head, I64);
        let carried = self.f.append_block_param(head, I32X4);
        self.f.switch_to_block(head);
        let carried = each(self, at, carried);
        let next = self.ins().iadd_imm_s(at, 4 * WIDTH);
        let more = self.ins().icmp_imm_s(IntCC::SignedLessThan, next, end);
        let again = [next.into(), carried.into()];
        self.ins().brif(more, head, &again, after, &[]);
        self.f.switch_to_block(after);
    }
}
