//! Functions that operators call.

use wasm_encoder::{BlockType, Instruction as I, ValType};

use crate::arithmetic::saturate;
use crate::body::{Body, Local, at};

/// The index of each function, in the order of [`all`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Helper {
    DivRound,
    Quot,
    Sqrt,
    Wave,
}

/// How many there are.
pub(crate) const COUNT: u32 = 4;

/// A function.
pub(crate) struct HelperCode {
    pub params: &'static [ValType],
    pub result: Option<ValType>,
    pub body: Body,
}

const I32: ValType = ValType::I32;
const I64: ValType = ValType::I64;

/// All of them, by [`Helper`].
pub(crate) fn all() -> [HelperCode; COUNT as usize] {
    let helper = |params, result, body| HelperCode {
        params,
        result,
        body,
    };
    [
        helper(&[I64, I64], Some(I32), div_round()),
        helper(&[I32, I32, I32], Some(I32), quot()),
        helper(&[I64], Some(I32), sqrt()),
        helper(&[I32; 10], None, wave()),
    ]
}

/// `floor(a / b + 1/2)`; 0 where `b` is 0. The dividend is a word, shifted by less than a word, so
/// no quotient is beyond its type.
fn div_round() -> Body {
    let mut body = Body::new(2);
    let [quotient, rest] = [(); 2].map(|()| body.local(I64));
    floor_divide(&mut body, [0, 1], [quotient, rest]);
    let b = 1;
    // Up where the rest is at least half of the divisor.
    body.get(quotient);
    for (local, doubled) in [(rest, true), (b, false)] {
        body.op(I::I64Const(0));
        body.get(local);
        body.op(I::I64Sub);
        body.get(local);
        body.get(local);
        body.code([I::I64Const(0), I::I64LtS, I::Select]);
        if doubled {
            body.code([I::I64Const(1), I::I64Shl]);
        }
    }
    body.code([I::I64GeS, I::I64ExtendI32U, I::I64Add, I::I32WrapI64]);
    body
}

/// Quotient and rest of a division to the floor; returns 0 where the divisor is 0.
fn floor_divide(body: &mut Body, [a, b]: [Local; 2], [quotient, rest]: [Local; 2]) {
    body.code([
        I::LocalGet(b),
        I::I64Eqz,
        I::If(BlockType::Empty),
        I::I32Const(0),
        I::Return,
        I::End,
        I::LocalGet(a),
        I::LocalGet(b),
        I::I64DivS,
        I::LocalSet(quotient),
        I::LocalGet(a),
        I::LocalGet(b),
        I::I64RemS,
        I::LocalTee(rest),
        // To the floor: the rest takes the divisor's sign.
        I::I64Const(0),
        I::I64Ne,
        I::LocalGet(rest),
        I::LocalGet(b),
        I::I64Xor,
        I::I64Const(0),
        I::I64LtS,
        I::I32And,
        I::If(BlockType::Empty),
        I::LocalGet(quotient),
        I::I64Const(1),
        I::I64Sub,
        I::LocalSet(quotient),
        I::LocalGet(rest),
        I::LocalGet(b),
        I::I64Add,
        I::LocalSet(rest),
        I::End,
    ]);
}

/// About `a * 2^n / b`, held to 30 bits, 0 where `b` is not positive.
fn quot() -> Body {
    let mut body = Body::new(3);
    let (a, b, n) = (0, 1, 2);
    let [up, up_divisor, down, top, end] = [(); 5].map(|()| body.local(I32));
    body.code([
        I::LocalGet(b),
        I::I32Const(0),
        I::I32LeS,
        I::If(BlockType::Empty),
        I::I32Const(0),
        I::Return,
        I::End,
        // Bits that repeat the sign, but one. Of nothing there are 32, and shifts take five bits.
        I::LocalGet(a),
        I::LocalGet(a),
        I::I32Const(1),
        I::I32Shl,
        I::I32Xor,
        I::I32Clz,
        I::LocalSet(up),
        I::LocalGet(b),
        I::I32Clz,
        I::LocalSet(up_divisor),
    ]);
    // A word divided by half a word.
    body.code([
        I::LocalGet(a),
        I::LocalGet(up),
        I::I32Shl,
        I::LocalGet(b),
        I::LocalGet(up_divisor),
        I::I32Shl,
        I::I32Const(16),
        I::I32ShrU,
        I::I32DivS,
        I::I32Const(15),
        I::I32Shl,
        I::LocalSet(top),
        I::LocalGet(up),
        I::LocalGet(up_divisor),
        I::I32Sub,
        I::I32Const(31),
        I::I32Add,
        I::LocalGet(n),
        I::I32Sub,
        I::LocalSet(down),
    ]);
    hold(&mut body, down, 0, 31, end);
    body.code([
        I::LocalGet(top),
        I::LocalGet(down),
        I::I32ShrS,
        I::LocalSet(top),
    ]);
    hold(&mut body, top, -(1 << 29), (1 << 29) - 1, end);
    body.get(top);
    body
}

/// Moves a local to the nearest end of an interval if it is outside.
fn hold(body: &mut Body, local: Local, low: i32, high: i32, end: Local) {
    for (limit, smaller) in [(low, false), (high, true)] {
        body.word(limit);
        body.set(end);
        body.extreme(I32, smaller, [local, end]);
        body.set(local);
    }
}

/// `floor(sqrt(a))`, 0 where `a` is negative. The machine's square root, cut to an integer, may be
/// one too large where `a` was rounded up on the way; it is never too small.
fn sqrt() -> Body {
    let mut body = Body::new(1);
    let a = 0;
    let root = body.local(I64);
    body.code([
        I::LocalGet(a),
        I::I64Const(0),
        I::I64LtS,
        I::If(BlockType::Empty),
        I::I32Const(0),
        I::Return,
        I::End,
        I::LocalGet(a),
        I::F64ConvertI64S,
        I::F64Sqrt,
        I::I64TruncSatF64S,
        I::LocalTee(root),
        I::LocalGet(root),
        I::LocalGet(root),
        I::I64Mul,
        I::LocalGet(a),
        I::I64GtS,
        I::I64ExtendI32U,
        I::I64Sub,
        I::I32WrapI64,
    ]);
    body
}

/// The parameters of [`wave`]: addresses of the first slope and the first rate, bytes from one word
/// to the next, how many rates, coefficients, ends.
const SLOPES: Local = 0;
const RATES: Local = 1;
const STEP: Local = 2;
const COUNT_OF_RATES: Local = 3;
const K: [Local; 4] = [4, 5, 6, 7];
const ENDS: [Local; 2] = [8, 9];

/// The locals of a string's tick.
struct Wave {
    body: Body,
    /// Slopes on both sides of the point; its rate, and the new one of the point before.
    e: [Local; 2],
    v: Local,
    before: Local,
    /// The bend of the point; what the point before does to it, and it to others.
    w: Local,
    p: [Local; 2],
    /// The same of the point behind.
    e_after: Local,
    v_after: Local,
    w_after: Local,
    p_after: Local,
    /// For sums.
    sum: Local,
    beyond: Local,
    zero: Local,
}

/// One tick of a string (`whippen_kernel::wave`).
fn wave() -> Body {
    let mut body = Body::new(10);
    let mut local = || body.local(I32);
    let [e0, e1, v, before, w, p0, p1] = std::array::from_fn(|_| local());
    let [e_after, v_after, w_after, p_after, sum, beyond, zero] = std::array::from_fn(|_| local());
    let mut wave = Wave {
        body,
        e: [e0, e1],
        v,
        before,
        w,
        p: [p0, p1],
        e_after,
        v_after,
        w_after,
        p_after,
        sum,
        beyond,
        zero,
    };
    wave.enter();
    wave.body.op(I::Loop(BlockType::Empty));
    wave.point();
    wave.body.get(COUNT_OF_RATES);
    wave.body.code([I::BrIf(0), I::End]);
    wave.leave();
    wave.body
}

impl Wave {
    /// What is known before the first point.
    fn enter(&mut self) {
        let body = &mut self.body;
        for (local, steps) in [(self.e[0], 0), (self.e[1], 1)] {
            body.get(SLOPES);
            (0..steps).for_each(|_| body.code([I::LocalGet(STEP), I::I32Add]));
            body.op(I::I32Load(at(0, 2)));
            body.set(local);
        }
        body.get(RATES);
        body.op(I::I32Load(at(0, 2)));
        body.set(self.v);
        self.sat([self.e[1], self.e[0]], I::I32Sub, self.w);
        self.end(ENDS[0], self.e[0], self.w_after);
        self.beside(self.w_after, self.zero, self.p[0]);
        self.beside(self.w, self.v, self.p[1]);
    }

    /// One point; counts it off.
    fn point(&mut self) {
        self.body.code([
            I::LocalGet(COUNT_OF_RATES),
            I::I32Const(1),
            I::I32Sub,
            I::LocalTee(COUNT_OF_RATES),
            I::If(BlockType::Empty),
        ]);
        for (local, base, steps) in [(self.e_after, SLOPES, 2), (self.v_after, RATES, 1)] {
            self.body.get(base);
            (0..steps).for_each(|_| self.body.code([I::LocalGet(STEP), I::I32Add]));
            self.body.op(I::I32Load(at(0, 2)));
            self.body.set(local);
        }
        self.sat([self.e_after, self.e[1]], I::I32Sub, self.w_after);
        self.body.op(I::Else);
        self.body.word(0);
        self.body.set(self.v_after);
        self.sat([self.zero, self.e[1]], I::I32Sub, self.w_after);
        self.end(ENDS[1], self.w_after, self.w_after);
        self.body.op(I::End);
        self.beside(self.w_after, self.v_after, self.p_after);
        // What accelerates it, then its new rate.
        self.top(K[0], self.w);
        self.top(K[3], self.v);
        self.body.get(self.p[0]);
        self.body.code([I::I32Add, I::I32Add]);
        self.body.set(self.beyond);
        self.sat([self.beyond, self.p_after], I::I32Add, self.beyond);
        self.sat([self.v, self.beyond], I::I32Add, self.beyond);
        self.body.get(RATES);
        self.body.get(self.beyond);
        self.body.op(I::I32Store(at(0, 2)));
        self.slope(self.beyond);
        for base in [SLOPES, RATES] {
            self.body.get(base);
            self.body.code([I::LocalGet(STEP), I::I32Add]);
            self.body.set(base);
        }
        let moves = [
            (self.before, self.beyond),
            (self.e[0], self.e[1]),
            (self.e[1], self.e_after),
            (self.v, self.v_after),
            (self.w, self.w_after),
            (self.p[0], self.p[1]),
            (self.p[1], self.p_after),
        ];
        for (to, from) in moves {
            self.body.get(from);
            self.body.set(to);
        }
    }

    /// The last slope.
    fn leave(&mut self) {
        self.slope(self.zero);
    }

    /// Moves the slope before a point of this new rate.
    fn slope(&mut self, rate: Local) {
        self.body.get(SLOPES);
        self.body.get(self.e[0]);
        self.body.get(rate);
        self.body.get(self.before);
        self.body.code([
            I::I32Sub,
            I::I32Const(1),
            I::I32Shl,
            I::I32Add,
            I::I32Store(at(0, 2)),
        ]);
    }

    /// A sum or difference that saturates.
    fn sat(&mut self, [a, b]: [Local; 2], op: I<'static>, to: Local) {
        saturate(&mut self.body, [a, b, self.sum], op);
        self.body.set(to);
    }

    /// The bend of an end that is pinned (0) or clamped (2).
    fn end(&mut self, end: Local, e: Local, to: Local) {
        saturate(&mut self.body, [e, e, self.sum], I::I32Add);
        self.body.word(0);
        self.body.get(end);
        self.body.op(I::Select);
        self.body.set(to);
    }

    /// What a point of this bend and rate does to its neighbours.
    fn beside(&mut self, w: Local, v: Local, to: Local) {
        self.top(K[1], w);
        self.top(K[2], v);
        self.body.op(I::I32Add);
        self.body.set(to);
    }

    /// The upper word of a product, rounded half up.
    fn top(&mut self, k: Local, x: Local) {
        for factor in [k, x] {
            self.body.get(factor);
            self.body.op(I::I64ExtendI32S);
        }
        self.body.code([
            I::I64Mul,
            I::I64Const(1 << 31),
            I::I64Add,
            I::I64Const(32),
            I::I64ShrU,
            I::I32WrapI64,
        ]);
    }
}
