//! Operators without regions, for sixteen keys: an arm for each.

use super::encoder::{Form, Mask, MaskOp, Operand, Shift, Zmm, forms};
use super::registers::{Bank, Node};
use super::{EVEN, HALF, Writer};
use whippen_kernel::{Inst, Op, Type, Value};

/// How two words are compared.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Order {
    Equal = 0,
    Less = 1,
    LessOrEqual = 2,
    GreaterOrEqual = 5,
    Greater = 6,
}

impl Order {
    /// The same of the operands in the other order.
    fn turned(self) -> Order {
        match self {
            Order::Equal => Order::Equal,
            Order::Less => Order::Greater,
            Order::LessOrEqual => Order::GreaterOrEqual,
            Order::GreaterOrEqual => Order::LessOrEqual,
            Order::Greater => Order::Less,
        }
    }
}

impl Writer<'_> {
    /// Writes an operator without regions.
    pub(super) fn operator(&mut self, inst: &Inst) {
        let [a, b, c] =
            std::array::from_fn(|at| inst.args.get(at).map_or(0, |arg| self.node(*arg)));
        let to = inst.results.first().map_or(0, |result| self.node(*result));
        match inst.op {
            Op::Add | Op::AddWrap => self.commutative(forms::PADDD, to, a, b),
            Op::Sub | Op::SubWrap => self.binary(forms::PSUBD, to, a, b),
            Op::Mul | Op::MulWrap => self.commutative(forms::PMULLD, to, a, b),
            Op::Min => self.commutative(forms::PMINSD, to, a, b),
            Op::Max => self.commutative(forms::PMAXSD, to, a, b),
            Op::MulTop => {
                self.top_words(to, a, b);
            }
            Op::MacTop => {
                let top = self.top_words(to, b, c);
                let sum = self.r.operand(a);
                self.r.e.vector(forms::PADDD, top, top, sum);
            }
            Op::Shl(n) | Op::ShlWrap(n) => self.shifted(Shift::Left, to, a, n),
            Op::Sar(n) => self.shifted(Shift::Right, to, a, n),
            Op::SarRound(n) => self.sar_round(inst, n),
            Op::Eq if self.ty(inst.args[0]) == Type::I1 => self.masks(MaskOp::Equal, to, a, b),
            Op::Eq => self.compared(Order::Equal, to, a, b),
            Op::Lt => self.compared(Order::Less, to, a, b),
            Op::Le => self.compared(Order::LessOrEqual, to, a, b),
            Op::And => self.masks(MaskOp::And, to, a, b),
            Op::Or => self.masks(MaskOp::Or, to, a, b),
            Op::Not => {
                let a = self.r.mask(a);
                let to = self.r.define(to);
                self.r.e.mask(MaskOp::Not, to, a, Operand::Mask(a));
            }
            Op::Select if self.ty(inst.args[1]) == Type::I1 => self.selected_mask(to, a, b, c),
            Op::Select => self.selected(to, a, b, c),
            _ => self.memory(inst, to, a),
        }
    }

    fn ty(&self, value: Value) -> Type {
        self.kernel.values[value].ty
    }

    /// Both in a register, the second where it stands.
    fn binary(&mut self, form: Form, to: Node, a: Node, b: Node) {
        let (a, b) = (self.r.word(a), self.r.operand(b));
        let to = Zmm(self.r.define(to));
        self.r.e.vector(form, to, a, b);
    }

    /// The same, a known operand second.
    fn commutative(&mut self, form: Form, to: Node, a: Node, b: Node) {
        match self.r.facts[a].known {
            Some(_) => self.binary(form, to, b, a),
            None => self.binary(form, to, a, b),
        }
    }

    fn shifted(&mut self, shift: Shift, to: Node, a: Node, n: u8) {
        let a = Operand::Zmm(self.r.word(a));
        let to = Zmm(self.r.define(to));
        self.r.e.shift(shift, to, a, n);
    }

    /// `floor(a / 2^n + 1/2)`
    fn sar_round(&mut self, inst: &Inst, n: u8) {
        let (a, to) = (self.node(inst.args[0]), self.node(inst.results[0]));
        let a_word = self.r.word(a);
        let result = Zmm(self.r.define(to));
        if n == 0 {
            let last = Operand::Zmm(a_word);
            return self.r.e.vector_of(forms::MOVDQA32, result, last);
        }
        // The half that is added may not fit: the shifted value plus the bit below.
        let below = Zmm(self.r.temporary(Bank::Words));
        let one = Operand::Broadcast(self.r.constant(1));
        self.r
            .e
            .shift(Shift::Right, below, Operand::Zmm(a_word), n - 1);
        self.r.e.vector(forms::PANDD, below, below, one);
        self.r
            .e
            .shift(Shift::Right, result, Operand::Zmm(a_word), n);
        let below = Operand::Zmm(below);
        self.r.e.vector(forms::PADDD, result, result, below);
    }

    /// The top words of products, rounded half up: of the even words, and of the odd ones where
    /// they stand.
    fn top_words(&mut self, to: Node, a: Node, b: Node) -> Zmm {
        let (a, b) = match self.r.facts[a].known {
            Some(_) => (b, a),
            None => (a, b),
        };
        let first = self.r.word(a);
        let second = match (a == b, self.r.facts[b].known) {
            (true, _) => Operand::Zmm(first),
            (_, Some(number)) => Operand::Broadcast(self.r.constant(number as i32)),
            _ => Operand::Zmm(self.r.word(b)),
        };
        let even = Zmm(self.r.temporary(Bank::Words));
        let odd = Zmm(self.r.define(to));
        let e = &mut self.r.e;
        e.vector(forms::PMULDQ, even, first, second);
        e.vector_of(forms::MOVSHDUP, odd, Operand::Zmm(first));
        let second = match second {
            Operand::Zmm(zmm) if zmm == first => Operand::Zmm(odd),
            Operand::Zmm(zmm) => {
                let other = Zmm(self.r.temporary(Bank::Words));
                let last = Operand::Zmm(zmm);
                self.r.e.vector_of(forms::MOVSHDUP, other, last);
                Operand::Zmm(other)
            }
            other => other,
        };
        let (e, half) = (&mut self.r.e, Operand::Zmm(HALF));
        e.vector(forms::PMULDQ, odd, odd, second);
        e.vector(forms::PADDQ, even, even, half);
        e.vector(forms::PADDQ, odd, odd, half);
        let even = Operand::Zmm(even);
        e.masked(forms::MOVSHDUP, odd.0, 0, even, (EVEN, true));
        odd
    }

    fn compared(&mut self, order: Order, to: Node, a: Node, b: Node) {
        let (order, a, b) = match self.r.facts[a].known {
            Some(_) => (order.turned(), b, a),
            None => (order, a, b),
        };
        let (a, b) = (self.r.word(a), self.r.operand(b));
        let to = self.r.define(to);
        self.r.e.masked(forms::PCMPD, to, a.0, b, (Mask(0), true));
        self.r.e.bytes.push(order as u8);
    }

    fn masks(&mut self, op: MaskOp, to: Node, a: Node, b: Node) {
        let (a, b) = (self.r.mask(a), self.r.mask(b));
        let to = self.r.define(to);
        self.r.e.mask(op, to, a, Operand::Mask(b));
    }

    /// Words where a mask holds, else others.
    fn selected(&mut self, to: Node, mask: Node, a: Node, b: Node) {
        let mask = self.r.mask(mask);
        let (b, a) = (self.r.word(b), self.r.operand(a));
        let to = self.r.define(to);
        self.r.e.masked(forms::PBLENDMD, to, b.0, a, (mask, true));
    }

    fn selected_mask(&mut self, to: Node, mask: Node, a: Node, b: Node) {
        let (mask, a, b) = (self.r.mask(mask), self.r.mask(a), self.r.mask(b));
        let own = self.r.temporary(Bank::Masks);
        let to = self.r.define(to);
        let e = &mut self.r.e;
        e.mask(MaskOp::And, own, mask, Operand::Mask(a));
        e.mask(MaskOp::AndNot, to, mask, Operand::Mask(b));
        e.mask(MaskOp::Or, to, Mask(to), Operand::Mask(Mask(own)));
    }
}
