//! A string of one key in vectors over points: right sides are those before the tick, so no point
//! waits for another.
//!
//! ```text
//!   first:   what each point does to its neighbours, with both ends, and to itself    on the stack
//!   second:  rates and the slopes before them, in place, by four words
//!            1 .. 4 | 5 .. 8 | ..
//!                        | the last four |    blocks may overlap: the last is read before the others
//!                                             are written, and written behind them
//! ```
//!
//! Vectors have no sums that saturate. Where all slopes and rates are small no sum can leave the
//! words ([`SMALL_BITS`]), so the first pass is made with plain sums and looks at them; only where
//! one is large it is made again, and both passes with sums that are held.

use super::Points;
use crate::saturate;
use cranelift_codegen::ir::condcodes::IntCC;
use cranelift_codegen::ir::types::{I32, I32X4, I64};
use cranelift_codegen::ir::{InstBuilder, StackSlotData, StackSlotKind, Value};

/// Points of a block.
const WIDTH: i64 = 4;

/// Bits of the magnitudes of slopes and rates with which no sum of a tick leaves its word.
///
/// Bends are below 2^29 (of an end, twice a slope). Coefficients are words, so the upper word of a
/// product is at most half of its other factor: 2^28 of a bend, 2^27 of a rate. What a point does
/// to itself or to a neighbour is at most 3 * 2^27; three of these and the rate are at most
/// 11 * 2^27, which is less than 2^31.
pub(super) const SMALL_BITS: u32 = 28;

/// Whether a string whose points are so many bytes apart is ticked in vectors: where they are
/// tested, and lie side by side.
pub(super) fn suits(step: i64) -> bool {
    cfg!(target_arch = "x86_64") && step == 4
}

/// Where it stands on the stack what points do.
#[derive(Clone, Copy)]
struct Done {
    /// To their neighbours: the end's, then those of the points, then the other end's.
    beside: Value,
    /// To themselves.
    own: Value,
}

impl Points<'_, '_> {
    /// One tick of all points.
    pub(super) fn tick_in_vectors(mut self) {
        let done = self.done_at_ends();
        // Were it known that all words are the same, they would be widened outside of the loop, and
        // products of words in it would become those of 64 bits.
        self.k = self.k.map(|k| {
            let first = self.ins().scalar_to_vector(I32X4, k);
            self.words_of(first, first, [0; 4])
        });
        self.ty = I32X4;
        self.saturates = false;
        let seen = self.first_pass(done);
        let large = self.constant_words(-1 << SMALL_BITS);
        let large = self.ins().band(seen, large);
        let large = self.ins().vany_true(large);
        let [plain, held, after] = [(); 3].map(|()| self.f.create_block());
        self.f.set_cold_block(held);
        self.ins().brif(large, held, &[], plain, &[]);
        self.f.switch_to_block(plain);
        self.second_pass(done);
        self.ins().jump(after, &[]);
        self.saturates = true;
        self.f.switch_to_block(held);
        self.first_pass(done);
        self.second_pass(done);
        self.ins().jump(after, &[]);
        self.f.switch_to_block(after);
        self.last_slope();
    }

    /// Leaves what all points do; gives a word whose upper bits are set where a magnitude has them.
    fn first_pass(&mut self, done: Done) -> Value {
        let tail = self.tail();
        let nothing = self.constant_words(0);
        let seen = self.blocks(nothing, |points, at, seen| points.products(done, at, seen));
        self.products(done, tail, seen)
    }

    /// Ticks all points and the slopes before them.
    fn second_pass(&mut self, done: Done) {
        let (tail, last) = (self.tail(), 4 * (self.count - WIDTH) as i32);
        let [e, v] = self.start;
        let access = self.access.columns;
        let nothing = self.constant_words(0);
        let rates = self.rates(done, tail);
        let slopes = self.ins().load(I32X4, access, e, last);
        self.blocks(nothing, |points, at, before| {
            let rates = points.rates(done, at);
            let at_slopes = points.ins().iadd(e, at);
            let slopes = points.ins().load(I32X4, access, at_slopes, 0);
            let left = points.words_of(before, rates, [3, 4, 5, 6]);
            let slopes = points.moved(slopes, left, rates);
            points.ins().store(access, slopes, at_slopes, 0);
            let at_rates = points.ins().iadd(v, at);
            points.ins().store(access, rates, at_rates, 0);
            rates
        });
        self.ins().store(access, rates, v, last);
        let left = self.ins().load(I32X4, access, v, last - 4);
        let slopes = self.moved(slopes, left, rates);
        self.ins().store(access, slopes, e, last);
    }

    /// Bytes up to the last block.
    fn tail(&mut self) -> Value {
        let last = 4 * (self.count - WIDTH);
        self.ins().iconst(I64, last)
    }

    fn constant_words(&mut self, number: i32) -> Value {
        saturate::constant(self.f, self.k[0], number)
    }

    /// Room for what points do; what both ends do to their neighbours is there.
    fn done_at_ends(&mut self) -> Done {
        let mut room = |words: i64| {
            let slot = StackSlotData::new(StackSlotKind::ExplicitSlot, 4 * words as u32, 4);
            let slot = self.f.create_sized_stack_slot(slot);
            self.f.ins().stack_addr(I64, slot, 0)
        };
        let [beside, own] = [self.count + 2, self.count].map(&mut room);
        let (e, access, last) = (self.start[0], self.access.columns, 4 * self.count as i32);
        let first = self.ins().load(I32, access, e, 0);
        let behind = self.ins().load(I32, access, e, last);
        let zero = self.ins().iconst(I32, 0);
        let away = self.minus(zero, behind);
        for (end, slope, to) in [(0, first, 0), (1, away, last + 4)] {
            let bend = self.held(self.ends[end], slope);
            let done = self.beside_end(bend);
            self.ins().store(access, done, beside, to);
        }
        Done { beside, own }
    }

    /// What a block of points does; gives the bits of their magnitudes with those seen before.
    fn products(&mut self, done: Done, at: Value, seen: Value) -> Value {
        let access = self.access.columns;
        let [e, v] = self.start.map(|start| self.ins().iadd(start, at));
        let [before, after] = [0, 4].map(|offset| self.ins().load(I32X4, access, e, offset));
        let bends = self.minus(after, before);
        let rates = self.ins().load(I32X4, access, v, 0);
        let (beside, own) = (self.beside(bends, rates), self.own(bends, rates));
        let to = self.ins().iadd(done.beside, at);
        self.ins().store(access, beside, to, 4);
        let to = self.ins().iadd(done.own, at);
        self.ins().store(access, own, to, 0);
        if self.saturates {
            return seen;
        }
        let magnitudes = [before, after, rates].map(|words| self.ins().iabs(words));
        magnitudes
            .into_iter()
            .fold(seen, |seen, words| self.ins().bor(seen, words))
    }

    /// The rates of a block behind the tick.
    fn rates(&mut self, done: Done, at: Value) -> Value {
        let access = self.access.columns;
        let [beside, own] = [done.beside, done.own].map(|start| self.ins().iadd(start, at));
        let neighbours = [0, 8].map(|offset| self.ins().load(I32X4, access, beside, offset));
        let own = self.ins().load(I32X4, access, own, 0);
        let start = self.start[1];
        let v = self.ins().iadd(start, at);
        let v = self.ins().load(I32X4, access, v, 0);
        self.rate(v, own, neighbours)
    }

    /// The slope behind the last point, whose neighbour is the end.
    fn last_slope(&mut self) {
        let ([e, v], access, last) = (self.start, self.access.columns, 4 * self.count as i32);
        let slope = self.ins().load(I32, access, e, last);
        let rate = self.ins().load(I32, access, v, last - 4);
        let zero = self.ins().iconst(I32, 0);
        let slope = self.moved(slope, rate, zero);
        self.ins().store(access, slope, e, last);
    }

    /// All blocks but the last four points, in order, with a value that is carried on and given.
    fn blocks(
        &mut self,
        carried: Value,
        each: impl FnOnce(&mut Self, Value, Value) -> Value,
    ) -> Value {
        let end = 4 * (self.count - WIDTH);
        let [head, after] = [(); 2].map(|()| self.f.create_block());
        let start = self.ins().iconst(I64, 0);
        self.ins().jump(head, &[start.into(), carried.into()]);
        let at = self.f.append_block_param(head, I64);
        let carried = self.f.append_block_param(head, I32X4);
        self.f.switch_to_block(head);
        let carried = each(self, at, carried);
        let next = self.ins().iadd_imm_s(at, 4 * WIDTH);
        let more = self.ins().icmp_imm_s(IntCC::SignedLessThan, next, end);
        let again = [next.into(), carried.into()];
        self.ins()
            .brif(more, head, &again, after, &[carried.into()]);
        let carried = self.f.append_block_param(after, I32X4);
        self.f.switch_to_block(after);
        carried
    }
}
