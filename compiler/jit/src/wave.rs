//! Translation of `wave`: one point after the other, in words of one key or in lanes of several
//! keys.
//!
//! ```text
//!   before | here | next | after       U_l, U_(l+1), v_(l-1), v_l and what was made of them stay in
//!            ^ is stored                registers, so every word is loaded once, before it is stored
//! ```
//!
//! The last two points are written out, since there the string ends. A key alone whose points lie
//! side by side is ticked in vectors over points (`vectors`).

mod vectors;

use super::loop_context::Access;
use super::saturate;
use cranelift_codegen::ir::condcodes::IntCC;
use cranelift_codegen::ir::types::{I8X16, I32, I32X4, I64, I64X2};
use cranelift_codegen::ir::{self, BlockArg, Endianness, InstBuilder, MemFlagsData, Value};
use cranelift_frontend::{FuncInstBuilder, FunctionBuilder};

/// A string whose points are ticked.
pub(super) struct Points<'f, 'a> {
    pub f: &'f mut FunctionBuilder<'a>,
    pub access: Access,
    /// What holds a word: `I32`, or `I32X4` for keys in lanes.
    pub ty: ir::Type,
    /// Where the first words of `U` and `v` stand.
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
}

/// What stays in registers from point to point.
#[derive(Clone, Copy)]
struct Window {
    /// `U_l` and `U_(l+1)`
    u: [Value; 2],
    /// Their difference.
    e: Value,
    /// `W_(l-1)` and `W_l`
    w: [Value; 2],
    /// `v_(l-1)` and `v_l`
    v: [Value; 2],
}

/// What a point reads behind the window.
#[derive(Clone, Copy)]
struct Ahead {
    /// `U_(l+2)`
    u: Value,
    /// `v_(l+1)`
    v: Value,
    /// `W_(l+1)`, where that is not the bend there.
    w: Option<Value>,
}

impl Window {
    const LEN: usize = 7;

    fn values(self) -> [Value; Window::LEN] {
        let Window { u, e, w, v } = self;
        [u[0], u[1], e, w[0], w[1], v[0], v[1]]
    }

    fn of([u0, u1, e, w0, w1, v0, v1]: [Value; Window::LEN]) -> Window {
        Window {
            u: [u0, u1],
            e,
            w: [w0, w1],
            v: [v0, v1],
        }
    }
}

impl<'a> Points<'_, 'a> {
    /// One tick of all points.
    pub fn tick(mut self) {
        if self.ty == I32 && vectors::suits(self.count, self.step) {
            return self.tick_in_vectors();
        }
        let [u, v] = self.start;
        let zero = saturate::constant(self.f, self.k[0], 0);
        let (first, second, rate) = (self.load(u, 0), self.load(u, 1), self.load(v, 0));
        let e = self.ins().isub(second, first);
        let w_before = self.held(self.ends[0], first);
        let w = self.minus(e, first);
        let start = Window {
            u: [first, second],
            e,
            w: [w_before, w],
            v: [zero, rate],
        };
        let (window, offset) = self.inner(start);
        let at = [u, v].map(|start| self.ins().iadd(start, offset));
        let v = self.load(at[1], 1);
        let w = None;
        let window = self.point(window, at, Ahead { u: zero, v, w });
        let w = Some(self.held(self.ends[1], window.u[0]));
        let step = self.step;
        let at = at.map(|at| self.ins().iadd_imm_s(at, step));
        self.point(
            window,
            at,
            Ahead {
                u: zero,
                v: zero,
                w,
            },
        );
    }

    /// All points but the last two; gives the window behind them, and the bytes up to there.
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
        let at = self.start.map(|start| self.ins().iadd(start, offset));
        let ahead = Ahead {
            u: self.load(at[0], 2),
            v: self.load(at[1], 1),
            w: None,
        };
        let window = self.point(Window::of(window), at, ahead);
        let (step, end) = (self.step, self.step * (self.count - 2));
        let next = self.ins().iadd_imm_s(offset, step);
        let more = self.ins().icmp_imm_s(IntCC::SignedLessThan, next, end);
        self.ins().brif(more, head, &args(next, window), after, &[]);
        self.f.switch_to_block(after);
        (window, next)
    }

    /// Ticks and stores a point; gives the next one's window.
    fn point(&mut self, window: Window, at: [Value; 2], ahead: Ahead) -> Window {
        let Window { u, e, w, v } = window;
        let e_after = self.ins().isub(ahead.u, u[1]);
        let w_after = match ahead.w {
            Some(w) => w,
            None => self.minus(e_after, e),
        };
        let (bends, rates) = (self.plus(w[0], w_after), self.plus(v[0], ahead.v));
        let a = self.sum_of_tops([w[1], bends, rates, v[1]]);
        let rate = self.plus(v[1], a);
        let twice = self.ins().iadd(rate, rate);
        let place = self.ins().iadd(u[0], twice);
        for (at, new, old) in [(at[0], place, u[0]), (at[1], rate, v[1])] {
            let kept = match self.mask {
                Some(mask) => self.ins().bitselect(mask, new, old),
                None => new,
            };
            let access = self.access.columns;
            self.ins().store(access, kept, at, 0);
        }
        Window {
            u: [u[1], ahead.u],
            e: e_after,
            w: [w[1], w_after],
            v: [v[1], ahead.v],
        }
    }

    /// The bend of an end, by the outermost `U`.
    fn held(&mut self, end: i64, u: Value) -> Value {
        match end {
            0 => saturate::constant(self.f, u, 0),
            _ => self.plus(u, u),
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

    /// The sum of the upper words of the products with all coefficients, each rounded half up.
    fn sum_of_tops(&mut self, of: [Value; 4]) -> Value {
        if self.ty == I32 {
            let tops = [0, 1, 2, 3].map(|k| {
                let [k, x] = [self.k[k], of[k]].map(|word| self.ins().sextend(I64, word));
                let product = self.ins().imul(k, x);
                let sum = self.ins().iadd_imm_s(product, 1 << 31);
                self.ins().sshr_imm_s(sum, 32)
            });
            let [first, rest @ ..] = tops;
            let sum = rest
                .into_iter()
                .fold(first, |sum, top| self.ins().iadd(sum, top));
            return self.ins().ireduce(I32, sum);
        }
        let half = self.ins().iconst(I64, 1 << 31);
        let half = self.ins().splat(I64X2, half);
        // Words are added to words, so nothing is carried into the upper ones.
        let [mut low, mut high] = [None; 2];
        for (k, x) in self.k.into_iter().zip(of) {
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
