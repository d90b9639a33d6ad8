//! Translation of `wave`: one point after the other, in words of one key or in lanes of several
//! keys.
//!
//! ```text
//!   slopes:  before | behind | after        all but what is behind the next point stays in registers,
//!   points:         here   next             so every word is loaded once, before it is stored
//!            ^ is stored with the point
//! ```
//!
//! The last point is written out, since there the string ends. A key alone, whose points lie side
//! by side, is ticked by Rust (`string`), which machine code calls.

use super::loop_context::Access;
use super::{saturate, string_routine};
use cranelift_codegen::ir::condcodes::IntCC;
use cranelift_codegen::ir::types::{I8X16, I32, I32X4, I64, I64X2};
use cranelift_codegen::ir::{
    self, AbiParam, BlockArg, Endianness, InstBuilder, MemFlagsData, Signature, Value,
};
use cranelift_frontend::{FuncInstBuilder, FunctionBuilder};

/// A string whose points are ticked.
pub(super) struct Points<'f, 'a> {
    pub f: &'f mut FunctionBuilder<'a>,
    pub access: Access,
    /// What holds a word: `I32`, or `I32X4` for keys in lanes.
    pub ty: ir::Type,
    /// Where the first slope and the first rate stand.
    pub start: [Value; 2],
    /// Bytes from a point to the next.
    pub step: i64,
    /// How many points there are.
    pub count: i64,
    /// The coefficients.
    pub k: [Value; 4],
    /// How the ends are held.
    pub ends: [i64; 2],
    /// Lanes that are ticked; none: all.
    pub mask: Option<Value>,
    /// Where there is room for a tick of one key.
    pub room: Value,
}

/// What stays in registers from point to point.
#[derive(Clone, Copy)]
struct Window {
    /// The slopes before and behind it.
    e: [Value; 2],
    w: Value,
    v: Value,
    /// What the point before and it itself do to their neighbours.
    p: [Value; 2],
    /// The new rate of the point before.
    rate_before: Value,
}

/// What a point reads of the one behind it.
#[derive(Clone, Copy)]
struct Next {
    /// The slope behind it.
    e: Value,
    w: Value,
    v: Value,
    /// What it does to its neighbours.
    p: Value,
}

impl Window {
    const LEN: usize = 7;

    fn values(self) -> [Value; Window::LEN] {
        let Window {
            e,
            w,
            v,
            p,
            rate_before,
        } = self;
        [e[0], e[1], w, v, p[0], p[1], rate_before]
    }

    fn of([e0, e1, w, v, p0, p1, rate_before]: [Value; Window::LEN]) -> Window {
        Window {
            e: [e0, e1],
            w,
            v,
            p: [p0, p1],
            rate_before,
        }
    }
}

impl<'a> Points<'_, 'a> {
    /// One tick of all points.
    pub fn tick(mut self) {
        if self.ty == I32 && self.step == 4 {
            return self.call();
        }
        let [e, v] = self.start;
        let zero = saturate::constant(self.f, self.k[0], 0);
        let (before, behind, rate) = (self.load(e, 0), self.load(e, 1), self.load(v, 0));
        let end = self.held(self.ends[0], before);
        let w = self.minus(behind, before);
        let start = Window {
            e: [before, behind],
            w,
            v: rate,
            p: [self.beside_end(end), self.beside(w, rate)],
            rate_before: zero,
        };
        let (window, offset) = self.inner(start);
        let at = [e, v].map(|start| self.ins().iadd(start, offset));
        let away = self.minus(zero, window.e[1]);
        let end = self.held(self.ends[1], away);
        let next = Next {
            e: zero,
            w: end,
            v: zero,
            p: self.beside_end(end),
        };
        let window = self.point(window, at, next);
        let slope = self.moved(window.e[0], window.rate_before, zero);
        let step = self.step;
        let last = self.ins().iadd_imm_s(at[0], step);
        self.keep(last, slope, window.e[0]);
    }

    /// Has Rust tick the points.
    fn call(self) {
        let words = |ty: ir::Type, count: usize| std::iter::repeat_n(AbiParam::new(ty), count);
        let mut signature = Signature::new(self.f.func.signature.call_conv);
        signature.params = words(I64, 4).chain(words(I32, 6)).collect();
        let signature = self.f.import_signature(signature);
        let routine = self.f.ins().iconst(I64, string_routine());
        let count = self.f.ins().iconst(I64, self.count);
        let ends = self.ends.map(|end| self.f.ins().iconst(I32, end));
        let [e, v] = self.start;
        let args = [&[e, v, self.room, count][..], &self.k, &ends].concat();
        self.f.ins().call_indirect(signature, routine, &args);
    }

    /// All points but the last; gives the window behind them, and the bytes up to there.
    fn inner(&mut self, start: Window) -> (Window, Value) {
        let [head, after] = [(); 2].map(|()| self.f.create_block());
        let none = self.ins().iconst(I64, 0);
        let args = |offset: Value, window: Window| -> Vec<BlockArg> {
            let all = std::iter::once(offset).chain(window.values());
            all.map(BlockArg::Value).collect()
        };
        self.ins().jump(head, &args(none, start));
        let offset = self.f.append_block_param(head, I64);
        let ty = self.ty;
        let window = std::array::from_fn(|_| self.f.append_block_param(head, ty));
        self.f.switch_to_block(head);
        let window = Window::of(window);
        let at = self.start.map(|start| self.ins().iadd(start, offset));
        let (e, v) = (self.load(at[0], 2), self.load(at[1], 1));
        let w = self.minus(e, window.e[1]);
        let p = self.beside(w, v);
        let window = self.point(window, at, Next { e, w, v, p });
        let (step, end) = (self.step, self.step * (self.count - 1));
        let next = self.ins().iadd_imm_s(offset, step);
        let more = self.ins().icmp_imm_s(IntCC::SignedLessThan, next, end);
        self.ins().brif(more, head, &args(next, window), after, &[]);
        self.f.switch_to_block(after);
        (window, next)
    }

    /// Ticks and stores a point and the slope before it; gives the next one's window.
    fn point(&mut self, window: Window, at: [Value; 2], next: Next) -> Window {
        let Window { e, w, v, p, .. } = window;
        let own = self.own(w, v);
        let rate = self.rate(v, own, [p[0], next.p]);
        let slope = self.moved(e[0], window.rate_before, rate);
        self.keep(at[0], slope, e[0]);
        self.keep(at[1], rate, v);
        Window {
            e: [e[1], next.e],
            w: next.w,
            v: next.v,
            p: [p[1], next.p],
            rate_before: rate,
        }
    }

    /// Stores a word, where it is ticked.
    fn keep(&mut self, at: Value, new: Value, old: Value) {
        let kept = match self.mask {
            Some(mask) => self.ins().bitselect(mask, new, old),
            None => new,
        };
        let access = self.access.columns;
        self.ins().store(access, kept, at, 0);
    }

    /// A rate behind the tick, by what the point does to itself and what its neighbours do.
    fn rate(&mut self, v: Value, own: Value, [before, after]: [Value; 2]) -> Value {
        let sum = self.ins().iadd(own, before);
        let sum = self.plus(sum, after);
        self.plus(v, sum)
    }

    /// A slope between points of such new rates.
    fn moved(&mut self, e: Value, before: Value, after: Value) -> Value {
        let way = self.ins().isub(after, before);
        let twice = self.ins().iadd(way, way);
        self.ins().iadd(e, twice)
    }

    /// What a point does to itself.
    fn own(&mut self, w: Value, v: Value) -> Value {
        let [k0, _, _, k3] = self.k;
        self.sum_of_tops(&[(k0, w), (k3, v)])
    }

    /// What a point does to its neighbours.
    fn beside(&mut self, w: Value, v: Value) -> Value {
        let [_, k1, k2, _] = self.k;
        self.sum_of_tops(&[(k1, w), (k2, v)])
    }

    /// The same of an end.
    fn beside_end(&mut self, w: Value) -> Value {
        self.sum_of_tops(&[(self.k[1], w)])
    }

    /// The bend of an end, by the outermost slope away from it.
    fn held(&mut self, end: i64, e: Value) -> Value {
        match end {
            0 => saturate::constant(self.f, e, 0),
            _ => self.plus(e, e),
        }
    }

    /// The word so many points behind.
    fn load(&mut self, at: Value, points: i64) -> Value {
        let (ty, access, offset) = (self.ty, self.access.columns, points * self.step);
        let at = self.ins().iadd_imm_s(at, offset);
        self.ins().load(ty, access, at, 0)
    }

    fn plus(&mut self, a: Value, b: Value) -> Value {
        saturate::add(self.f, a, b)
    }

    fn minus(&mut self, a: Value, b: Value) -> Value {
        saturate::sub(self.f, a, b)
    }

    /// The sum of the upper words of products, each rounded half up.
    fn sum_of_tops(&mut self, products: &[(Value, Value)]) -> Value {
        if self.ty == I32 {
            let zero = self.ins().iconst(I64, 0);
            let sum = products.iter().fold(zero, |sum, (k, x)| {
                let [k, x] = [*k, *x].map(|word| self.ins().sextend(I64, word));
                let product = self.ins().imul(k, x);
                let product = self.ins().iadd_imm_s(product, 1 << 31);
                let top = self.ins().sshr_imm_s(product, 32);
                self.ins().iadd(sum, top)
            });
            return self.ins().ireduce(I32, sum);
        }
        let half = self.ins().iconst(I64, 1 << 31);
        let half = self.ins().splat(I64X2, half);
        // Words are added to words, so nothing is carried into the upper ones.
        let [mut low, mut high] = [None; 2];
        for (k, x) in products.iter().copied() {
            let lows = [k, x].map(|words| self.ins().swiden_low(words));
            let highs = [k, x].map(|words| self.ins().swiden_high(words));
            for (sum, [k, x]) in [(&mut low, lows), (&mut high, highs)] {
                let product = self.ins().imul(k, x);
                let rounded = self.ins().iadd(product, half);
                let words = self.as_words(rounded);
                *sum = Some(sum.map_or(words, |sum| self.ins().iadd(sum, words)));
            }
        }
        match (low, high) {
            (Some(low), Some(high)) => self.words_of(low, high, [1, 3, 5, 7]),
            _ => half,
        }
    }

    /// Words out of two vectors, by place: 0 to 3 in the first, 4 to 7 in the second.
    fn words_of(&mut self, a: Value, b: Value, places: [u8; 4]) -> Value {
        let flags = MemFlagsData::new().with_endianness(Endianness::Little);
        let [a, b] = [a, b].map(|words| self.ins().bitcast(I8X16, flags, words));
        let places: Vec<u8> = places
            .into_iter()
            .flat_map(|place| (0..4).map(move |byte| 4 * place + byte))
            .collect();
        let places = ir::immediates::V128Imm::from(&places[..]);
        let places = self.f.func.dfg.immediates.push(places.into());
        let shuffled = self.ins().shuffle(a, b, places);
        self.as_words(shuffled)
    }

    fn as_words(&mut self, vector: Value) -> Value {
        let flags = MemFlagsData::new().with_endianness(Endianness::Little);
        self.ins().bitcast(I32X4, flags, vector)
    }

    fn ins(&mut self) -> FuncInstBuilder<'_, 'a> {
        self.f.ins()
    }
}

#[cfg(test)]
mod tests;
