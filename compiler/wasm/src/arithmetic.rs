//! Operators: which instructions each becomes. Operands are put on the stack, the result is set to
//! the local of its value.

use wasm_encoder::{Instruction as I, ValType};
use whippen_kernel::{Inst, Op, Type, Value};

use crate::body::Local;
use crate::helpers::Helper;
use crate::translate::Translator;

impl Translator<'_> {
    /// An operator without regions. Every operator is named, so that a new one does not compile
    /// before it has its line.
    pub(crate) fn operator(&mut self, inst: &Inst) {
        let args = &inst.args[..];
        match inst.op {
            Op::Const(value) => self.constant(inst, value),
            Op::Add | Op::AddWrap => self.plain_op(args, [I::I32Add, I::I64Add]),
            Op::Sub | Op::SubWrap => self.plain_op(args, [I::I32Sub, I::I64Sub]),
            Op::Mul | Op::MulWrap => self.plain_op(args, [I::I32Mul, I::I64Mul]),
            Op::MulWide => self.product(args),
            Op::MacWide => {
                self.get(args[0]);
                self.product(&args[1..]);
                self.body.op(I::I64Add);
            }
            Op::MulTop => self.top(args),
            Op::MacTop => {
                self.get(args[0]);
                self.top(&args[1..]);
                self.body.op(I::I32Add);
            }
            Op::Min | Op::Max => self.extreme(inst),
            Op::Shl(n) | Op::ShlWrap(n) => self.shifted(args[0], n, [I::I32Shl, I::I64Shl]),
            Op::Sar(n) => self.shifted(args[0], n, [I::I32ShrS, I::I64ShrS]),
            Op::SarRound(n) => self.sar_round(args[0], n),
            Op::DivRound(n) => self.div_round(args, n),
            Op::Quot(n) => {
                args.iter().for_each(|arg| self.get(*arg));
                self.body.word(i32::from(n));
                self.body.op(I::Call(Helper::Quot as u32));
            }
            Op::Sqrt => {
                self.get(args[0]);
                self.body.op(I::Call(Helper::Sqrt as u32));
            }
            Op::Widen => {
                self.get(args[0]);
                self.body.op(I::I64ExtendI32S);
            }
            Op::Assume(..) => self.get(args[0]),
            Op::Narrow | Op::Low => {
                self.get(args[0]);
                self.body.op(I::I32WrapI64);
            }
            Op::AddSat => self.saturated(args, I::I32Add),
            Op::SubSat => self.saturated(args, I::I32Sub),
            Op::Eq => self.plain_op(args, [I::I32Eq, I::I64Eq]),
            Op::Lt => self.plain_op(args, [I::I32LtS, I::I64LtS]),
            Op::Le => self.plain_op(args, [I::I32LeS, I::I64LeS]),
            Op::And => self.plain_op(args, [I::I32And, I::I64And]),
            Op::Or => self.plain_op(args, [I::I32Or, I::I64Or]),
            Op::Not => {
                self.get(args[0]);
                self.body.op(I::I32Eqz);
            }
            Op::Select => {
                [1, 2, 0].into_iter().for_each(|at| self.get(args[at]));
                self.body.op(I::Select);
            }
            Op::In(port) => self.input(port),
            Op::Out(port) => self.output(port, args[0]),
            Op::Live(live) => self.live(live),
            Op::Tick(later) => self.tick(later),
            Op::Keyed(keyed) => self.keyed(keyed),
            Op::Get(cell) => self.load_cell(cell, None),
            Op::Set(cell) => self.store_cell(cell, None, args[0]),
            Op::GetAt(cell) => self.load_cell(cell, Some(args[0])),
            Op::SetAt(cell) => self.store_cell(cell, Some(args[0]), args[1]),
            Op::Wave(slopes, rates) => self.wave([slopes, rates], args),
            Op::Delay(line, ticks) => self.delay(line, ticks),
            Op::DelayAt(line) => self.delay_at(line, args[0]),
            Op::Push(line) => self.push(line, args[0]),
            Op::Fill(line) => self.fill(line, args[0]),
            Op::Lookup(table, column) => self.lookup(table, column, args[0]),
            Op::Emit(event) => self.emit(event, args),
            Op::Probe(probe) => self.probe(probe, args[0]),
            // Those with regions are walked.
            Op::If | Op::Loop(_) => {}
        }
        if let [result] = inst.results[..] {
            let local = self.define(result);
            self.body.set(local);
        }
    }

    fn constant(&mut self, inst: &Inst, value: i64) {
        let ty = inst.results.first().map(|result| self.ty(*result));
        self.body.op(match ty {
            Some(Type::I64) => I::I64Const(value),
            _ => I::I32Const(value as i32),
        });
    }

    /// All operands, and the instruction for their width.
    fn plain_op(&mut self, args: &[Value], [narrow, wide]: [I<'static>; 2]) {
        args.iter().for_each(|arg| self.get(*arg));
        let is_wide = self.ty(args[0]) == Type::I64;
        self.body.op(if is_wide { wide } else { narrow });
    }

    /// The whole product of two words.
    fn product(&mut self, args: &[Value]) {
        for arg in args {
            self.get(*arg);
            self.body.op(I::I64ExtendI32S);
        }
        self.body.op(I::I64Mul);
    }

    /// The top word of the product, rounding half up.
    fn top(&mut self, args: &[Value]) {
        self.product(args);
        self.body.code([
            I::I64Const(1 << 31),
            I::I64Add,
            I::I64Const(32),
            I::I64ShrS,
            I::I32WrapI64,
        ]);
    }

    fn extreme(&mut self, inst: &Inst) {
        let locals = [inst.args[0], inst.args[1]].map(|arg| self.value(arg));
        let ty = match self.ty(inst.args[0]) {
            Type::I64 => ValType::I64,
            _ => ValType::I32,
        };
        self.body.extreme(ty, inst.op == Op::Min, locals);
    }

    /// A shift by a constant.
    fn shifted(&mut self, arg: Value, n: u8, [narrow, wide]: [I<'static>; 2]) {
        self.get(arg);
        if self.ty(arg) == Type::I64 {
            self.body.code([I::I64Const(n.into()), wide]);
        } else {
            self.body.code([I::I32Const(n.into()), narrow]);
        }
    }

    /// `floor(a / 2^n + 1/2)`; where the sum need not fit, what it carries into the result is the
    /// bit below.
    fn sar_round(&mut self, arg: Value, n: u8) {
        let (ty, high) = (self.ty(arg), self.range(arg).high);
        let Some(below) = n.checked_sub(1) else {
            return self.get(arg);
        };
        let half = 1_i64 << below;
        let fits = high
            .checked_add(half)
            .is_some_and(|sum| ty.range().has(sum));
        let is_wide = ty == Type::I64;
        let number = |value: i64| match is_wide {
            true => I::I64Const(value),
            false => I::I32Const(value as i32),
        };
        let [add, shift, and] = match is_wide {
            true => [I::I64Add, I::I64ShrS, I::I64And],
            false => [I::I32Add, I::I32ShrS, I::I32And],
        };
        self.get(arg);
        if fits {
            self.body.code([number(half), add, number(n.into()), shift]);
        } else {
            self.body.code([number(n.into()), shift.clone()]);
            self.get(arg);
            self.body
                .code([number(below.into()), shift, number(1), and, add]);
        }
    }

    fn div_round(&mut self, args: &[Value], n: u8) {
        self.get(args[0]);
        self.body
            .code([I::I64ExtendI32S, I::I64Const(n.into()), I::I64Shl]);
        self.get(args[1]);
        self.body
            .code([I::I64ExtendI32S, I::Call(Helper::DivRound as u32)]);
    }

    /// A sum or a difference, or the end of the type nearest to it.
    fn saturated(&mut self, args: &[Value], op: I<'static>) {
        let [a, b] = [args[0], args[1]].map(|arg| self.value(arg));
        let wrapped = self.body.local(ValType::I32);
        saturate(&mut self.body, [a, b, wrapped], op);
    }
}

/// `a op b`, or the end of the type nearest to it; the third local is used on the way.
pub(crate) fn saturate(body: &mut crate::body::Body, [a, b, wrapped]: [Local; 3], op: I<'static>) {
    let is_sum = matches!(op, I::I32Add);
    // What is beyond has the sign of the first operand.
    body.get(a);
    body.code([
        I::I32Const(31),
        I::I32ShrS,
        I::I32Const(i32::MAX),
        I::I32Xor,
    ]);
    body.get(a);
    body.get(b);
    body.op(op);
    body.tee(wrapped);
    // It is beyond where the result has another sign than the first operand, and the second one
    // moves it that way.
    body.get(a);
    body.get(wrapped);
    body.op(I::I32Xor);
    if is_sum {
        body.get(b);
        body.get(wrapped);
    } else {
        body.get(a);
        body.get(b);
    }
    body.code([I::I32Xor, I::I32And, I::I32Const(0), I::I32LtS, I::Select]);
}
