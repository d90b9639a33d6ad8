//! Values of the graph as integers.

use super::format::{self, exp2};
use super::real::Real;
use super::{Lowerer, plan};
use crate::kernel::{Op, OpError, Range, Type, Value};
use crate::model::{Cmp, Interval, Node, NodeId};

impl Lowerer<'_> {
    /// Computes everything `nodes` need, operands first, without recursion.
    pub(super) fn need(&mut self, nodes: &[NodeId]) -> Result<(), OpError> {
        let mut open = std::collections::BTreeSet::new();
        let mut stack = nodes.to_vec();
        while let Some(id) = stack.pop() {
            if !self.reals.contains_key(&id) && !self.bools.contains_key(&id) && open.insert(id) {
                stack.extend(self.step.model.dag.get(id).operands());
            }
        }
        for id in open {
            let node = self.step.model.dag.get(id).clone();
            if node.is_bool() {
                let value = self.from_node(id, |s| s.bool_node(&node))?;
                self.bools.insert(id, value);
            } else {
                let real = self.from_node(id, |s| s.real_node(id, &node))?;
                self.reals.insert(id, real);
            }
        }
        Ok(())
    }

    /// The integer of a real node.
    pub(super) fn real(&mut self, id: NodeId) -> Result<Real, OpError> {
        self.need(&[id])?;
        Ok(self.reals[&id])
    }

    /// The value of a bool node.
    pub(super) fn bool(&mut self, id: NodeId) -> Result<Value, OpError> {
        self.need(&[id])?;
        Ok(self.bools[&id])
    }

    fn real_node(&mut self, id: NodeId, node: &Node) -> Result<Real, OpError> {
        let bits = self.plan[id.0 as usize];
        match *node {
            Node::Const(c) => self.constant_real(c.0, bits),
            Node::Sense(s) => self.sensed(s).map_or_else(|| self.constant_real(0.0, 0), Ok),
            Node::Slope(s) => self.slope(s).map_or_else(|| self.constant_real(0.0, 0), Ok),
            Node::Curvature(s) => self.curvature(s).map_or_else(|| self.constant_real(0.0, 0), Ok),
            Node::Live(l) => {
                let value = self.b.op(Op::Live(self.lives[l as usize].0), &[])?;
                Ok(set_from_outside(value, self.step.model.lives[l as usize].range))
            }
            Node::Keyed(k) => {
                let value = self.b.op(Op::Keyed(self.keyed[k as usize].0), &[])?;
                Ok(set_from_outside(value, self.step.model.keyed[k as usize].range))
            }
            Node::Cell(c) => self.cell(c),
            Node::Linear(c0, ref terms) => {
                let mut reals = Vec::new();
                for (c, x) in terms {
                    reals.push((c.0, self.real(*x)?));
                }
                self.sum(c0.0, &reals, bits)
            }
            Node::Add(a, b) => self.pair_sum(1.0, a, b, bits),
            Node::Sub(a, b) => self.pair_sum(-1.0, a, b, bits),
            Node::Neg(a) => {
                let a = self.real(a)?;
                self.sum(0.0, &[(-1.0, a)], bits)
            }
            Node::Mul(a, b) => self.product(a, b, bits),
            Node::Div(a, b) => self.quotient(a, b, bits),
            Node::Min(a, b) => self.of_two(Op::Min, a, b, bits),
            Node::Max(a, b) => self.of_two(Op::Max, a, b, bits),
            Node::Abs(a) => self.absolute(a, bits),
            Node::Power(a, halves) => self.power(a, halves, bits),
            Node::Select(c, a, b) => {
                let c = self.bool(c)?;
                let (a, b) = self.alike(a, b, bits)?;
                let value = self.b.op(Op::Select, &[c, a.value, b.value])?;
                Ok(Real { value, error: a.error.max(b.error), ..a })
            }
            _ => self.constant_real(0.0, 0),
        }
    }

    fn pair_sum(&mut self, sign: f64, a: NodeId, b: NodeId, bits: i32) -> Result<Real, OpError> {
        let (a, b) = (self.real(a)?, self.real(b)?);
        self.sum(0.0, &[(1.0, a), (sign, b)], bits)
    }

    /// Both in one format: as planned, but not finer than the coarser of the two.
    fn alike(&mut self, a: NodeId, b: NodeId, bits: i32) -> Result<(Real, Real), OpError> {
        let (ra, rb) = (self.real(a)?, self.real(b)?);
        let (ra, rb) = (self.fixed(ra)?, self.fixed(rb)?);
        let dag = &self.step.model.dag;
        let limit = |node: NodeId, real: Real| match dag.get(node) {
            Node::Const(_) => i32::MAX,
            _ => real.bits.unwrap_or(bits),
        };
        let bits = bits.min(limit(a, ra)).min(limit(b, rb));
        let operand = |s: &mut Self, node: NodeId, real: Real| match *s.step.model.dag.get(node) {
            Node::Const(c) if format::fits(s.ranges.get(node), bits) => s.constant_real(c.0, bits),
            _ => s.with_bits(real, bits),
        };
        Ok((operand(self, a, ra)?, operand(self, b, rb)?))
    }

    fn of_two(&mut self, op: Op, a: NodeId, b: NodeId, bits: i32) -> Result<Real, OpError> {
        let (a, b) = self.alike(a, b, bits)?;
        let value = self.b.op(op, &[a.value, b.value])?;
        Ok(Real { value, error: a.error.max(b.error), ..a })
    }

    fn absolute(&mut self, a: NodeId, bits: i32) -> Result<Real, OpError> {
        let a = self.real(a)?;
        let a = self.fixed(a)?;
        let a = self.with_bits(a, bits.min(a.bits.unwrap_or(bits)))?;
        let zero = self.constant(0)?;
        let negated = self.b.op(Op::Sub, &[zero, a.value])?;
        let value = self.b.op(Op::Max, &[a.value, negated])?;
        // Intervals do not see that one of the two is not negative.
        let value = self.b.op(Op::Assume(0, self.b.range(value).high), &[value])?;
        Ok(Real { value, ..a })
    }

    fn product(&mut self, a: NodeId, b: NodeId, bits: i32) -> Result<Real, OpError> {
        let (ra, rb) = (self.real(a)?, self.real(b)?);
        let (ra, rb) = (self.fixed(ra)?, self.fixed(rb)?);
        let (ma, mb) = (self.ranges.get(a).magnitude(), self.ranges.get(b).magnitude());
        self.multiplied(ra, rb, bits, (ma, mb))
    }

    /// The product of two fixed values, of at most these magnitudes, with so many fraction bits.
    fn multiplied(&mut self, a: Real, b: Real, bits: i32, (ma, mb): (f64, f64)) -> Result<Real, OpError> {
        let wide = self.b.op(Op::MulWide, &[a.value, b.value])?;
        let own = a.bits.unwrap_or(0) + b.bits.unwrap_or(0);
        // The integers' range may be wider than the Model's, which knows more of how values hang together.
        let shift = (own - bits).clamp(0, 63).max(shift_to_word(self.b.range(wide)));
        let bits = own - shift;
        let shifted = if shift > 0 { self.b.op(Op::SarRound(shift as u8), &[wide])? } else { wide };
        let mut value = self.b.op(Op::Narrow, &[shifted])?;
        if a.value == b.value {
            // Intervals do not see that a square is not negative; the Model does, and has dropped clamps that say so.
            value = self.b.op(Op::Assume(0, self.b.range(value).high), &[value])?;
        }
        let rounding = if shift > 0 { 0.5 * exp2(-bits) } else { 0.0 };
        Ok(Real::fixed(value, bits, ma * b.error + mb * a.error + a.error * b.error + rounding))
    }

    fn quotient(&mut self, a: NodeId, b: NodeId, bits: i32) -> Result<Real, OpError> {
        let (ra, rb) = (self.real(a)?, self.real(b)?);
        let (ra, rb) = (self.fixed(ra)?, self.fixed(rb)?);
        // The divisor's proven interval leaves out zero; its rounded end must too.
        let rb = self.away_from_zero(rb, self.ranges.get(b).low > 0.0)?;
        let (value, bits, dividend) = self.divided(ra, rb, bits)?;
        let divisor = self.ranges.get(b);
        let smallest = divisor.low.abs().min(divisor.high.abs());
        let quotient = self.ranges.get(a).magnitude() / smallest;
        let inherited = (dividend.error + quotient * rb.error) / (smallest - rb.error).max(f64::MIN_POSITIVE);
        Ok(Real::fixed(value, bits, inherited + 0.5 * exp2(-bits)))
    }

    /// The quotient with so many fraction bits, or as many fewer as its integers need; also the dividend it was made from.
    fn divided(&mut self, a: Real, b: Real, bits: i32) -> Result<(Value, i32, Real), OpError> {
        let divisor_bits = b.bits.unwrap_or(0);
        let mut bits = bits.min(a.bits.unwrap_or(0) - divisor_bits + 31);
        loop {
            let dividend = self.with_bits(a, (bits + divisor_bits).min(a.bits.unwrap_or(0)))?;
            let shift = bits + divisor_bits - dividend.bits.unwrap_or(0);
            match self.b.op(Op::DivRound(shift as u8), &[dividend.value, b.value]) {
                Err(OpError::Overflow { .. }) => bits -= 1,
                other => return other.map(|value| (value, bits, dividend)),
            }
        }
    }

    fn away_from_zero(&mut self, real: Real, positive: bool) -> Result<Real, OpError> {
        let range = self.b.range(real.value);
        let kept = if positive { Range::new(1, range.high.max(1)) } else { Range::new(range.low.min(-1), -1) };
        Ok(Real { value: self.clamped(real.value, kept)?, ..real })
    }

    /// `a^0.5` (in primes), `a^1.5` and `a^2.5`: the square root in integers, then products.
    fn power(&mut self, a: NodeId, halves: u8, bits: i32) -> Result<Real, OpError> {
        let real = self.real(a)?;
        let real = self.fixed(real)?;
        let magnitude = self.ranges.get(a).magnitude();
        let own = real.bits.unwrap_or(0);
        // The root of an integer of up to 31 bits, moved up by 29 or 30: an even number of fraction bits, a word of result.
        let up = if (own + 30) % 2 == 0 { 30 } else { 29 };
        let wide = self.b.op(Op::Widen, &[real.value])?;
        let wide = self.b.op(Op::Shl(up as u8), &[wide])?;
        let root = self.b.op(Op::Sqrt, &[wide])?;
        let root_bits = (own + up) / 2;
        let root = Real::fixed(root, root_bits, real.error.sqrt() + exp2(-root_bits));
        if halves == 1 {
            return self.with_bits(root, bits.min(root_bits));
        }
        if halves == 3 {
            return self.multiplied(real, root, bits, (magnitude, magnitude.sqrt()));
        }
        let square = magnitude * magnitude;
        let interval = Interval { low: 0.0, high: square };
        let squared = self.multiplied(real, real, format::fraction_bits(interval), (magnitude, magnitude))?;
        self.multiplied(squared, root, bits, (square, magnitude.sqrt()))
    }

    fn bool_node(&mut self, node: &Node) -> Result<Value, OpError> {
        match *node {
            Node::Bool(b) => self.b.constant(Type::I1, i64::from(b)),
            Node::LiveBool(l) => {
                let value = self.b.op(Op::Live(self.lives[l as usize].0), &[])?;
                let zero = self.constant(0)?;
                self.b.op(Op::Lt, &[zero, value])
            }
            Node::Is(m, s) => self.is(m, s),
            Node::Compare(cmp, a, b) => self.compare(cmp, a, b),
            Node::And(a, b) => self.both(Op::And, a, b),
            Node::Or(a, b) => self.both(Op::Or, a, b),
            Node::Not(a) => {
                let a = self.bool(a)?;
                self.b.op(Op::Not, &[a])
            }
            Node::SelectBool(c, a, b) => {
                let (c, a, b) = (self.bool(c)?, self.bool(a)?, self.bool(b)?);
                self.b.op(Op::Select, &[c, a, b])
            }
            _ => self.b.constant(Type::I1, 0),
        }
    }

    fn both(&mut self, op: Op, a: NodeId, b: NodeId) -> Result<Value, OpError> {
        let (a, b) = (self.bool(a)?, self.bool(b)?);
        self.b.op(op, &[a, b])
    }

    fn compare(&mut self, cmp: Cmp, a: NodeId, b: NodeId) -> Result<Value, OpError> {
        if let Node::Const(c) = *self.step.model.dag.get(b) {
            let a = self.real(a)?;
            return self.against(cmp, a, c.0);
        }
        let bits = plan::coarser(&self.plan, a, b);
        let (a, b) = self.alike(a, b, bits)?;
        self.ordered(cmp, a.value, b.value)
    }

    fn ordered(&mut self, cmp: Cmp, a: Value, b: Value) -> Result<Value, OpError> {
        match cmp {
            Cmp::Lt => self.b.op(Op::Lt, &[a, b]),
            Cmp::Le => self.b.op(Op::Le, &[a, b]),
            Cmp::Gt => self.b.op(Op::Lt, &[b, a]),
            Cmp::Ge => self.b.op(Op::Le, &[b, a]),
        }
    }

    /// An integer against the real threshold, exactly: the threshold becomes the nearest integer on the right side.
    fn against(&mut self, cmp: Cmp, a: Real, threshold: f64) -> Result<Value, OpError> {
        let scaled = (threshold - a.offset) / a.lsb;
        let integer = match cmp {
            Cmp::Lt | Cmp::Ge => scaled.ceil(),
            Cmp::Le | Cmp::Gt => scaled.floor(),
        };
        let range = Type::I32.range();
        let kept = (integer.clamp(-exp2(40), exp2(40)) as i64).clamp(range.low, range.high);
        let threshold = self.constant(kept)?;
        self.ordered(cmp, a.value, threshold)
    }
}

/// By how much a 64-bit value must be shifted right to fit into 32 bits, rounding included.
fn shift_to_word(range: Range) -> i32 {
    let magnitude = range.low.unsigned_abs().max(range.high.unsigned_abs());
    (0..32).find(|&n| magnitude >> n < (1 << 31) - 1).unwrap_or(32)
}

/// A value that the host rounded to its format.
fn set_from_outside(value: Value, range: Interval) -> Real {
    let bits = format::fraction_bits(range);
    Real::fixed(value, bits, 0.5 * exp2(-bits))
}
