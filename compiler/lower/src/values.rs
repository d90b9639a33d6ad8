//! Lowering of values: each node of the graph as integers in its unit.

use super::Lowerer;
use super::clamp;
use super::format::{self, exp2, exponent};
use super::linear::{Constant, Term};
use super::real::{Real, Scale, floored, power_of_two};
use whippen_kernel::{Op, OpError, Range, Type, Value};
use whippen_lang::model::{Cmp, Interval, Node, NodeId};

/// So many bits of a product's precision may go to spare a shift.
const SPARED: i32 = 4;

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
        let lsb = self.units.of(id);
        if let Some((x, limit)) = clamp::symmetric(&self.step.model.dag, id) {
            return self.limited(x, limit);
        }
        match *node {
            Node::Const(c) => self.constant_real(c.0, Scale::plain(lsb)),
            Node::Sense(s) => self
                .sensed(s)
                .map_or_else(|| self.constant_real(0.0, Scale::plain(lsb)), Ok),
            Node::Slope(s) => self
                .slope(s)
                .map_or_else(|| self.constant_real(0.0, Scale::plain(lsb)), Ok),
            Node::Curvature(s) => self
                .curvature(s)
                .map_or_else(|| self.constant_real(0.0, Scale::plain(lsb)), Ok),
            Node::Live(l) => {
                let value = self.b.op(Op::Live(self.lives[l as usize].0), &[])?;
                Ok(set_from_outside(
                    value,
                    self.step.model.lives[l as usize].range,
                ))
            }
            Node::Keyed(k) => {
                let value = self.b.op(Op::Keyed(self.keyed[k as usize].0), &[])?;
                Ok(set_from_outside(
                    value,
                    self.step.model.keyed[k as usize].range,
                ))
            }
            Node::Cell(c) => self.cell(c),
            Node::Noise(n) => self.noise(n),
            Node::Tap(delay, ticks) => self.tap(delay, ticks),
            Node::Tuned(delay, ticks, own) => self.tuned(delay, ticks, own),
            Node::Read(strand, reading, place) => self.read_string(strand, reading, place),
            // Where a string is rubbed it has been ticked already.
            Node::Mean(strand, _) => self.mean_of_string(strand),
            Node::Spread(strand, place) => self.spread_of_string(strand, place),
            Node::Grid(strand, number) => {
                let value = self.step.model.strands[strand].number(number);
                self.constant_real(value, Scale::plain(lsb))
            }
            Node::Linear(c0, ref terms) => {
                let terms: Vec<Term> = terms
                    .iter()
                    .map(|&(c, x)| self.term(c.0, x))
                    .collect::<Result<_, _>>()?;
                let scale = self.units.scale_of(id);
                match self.left[id] {
                    _ if self.is_new_rate(id) => self.increased(c0.0, &terms, scale),
                    _ if self.adds_up[id] && !self.is_exact(c0.0, &terms, scale) => {
                        self.increased(c0.0, &terms, scale)
                    }
                    true => self.sum(c0.0, &terms, scale, Constant::Left),
                    false => self.sum(c0.0, &terms, scale, Constant::Added),
                }
            }
            Node::Add(a, b) => self.pair_sum(1.0, a, b, lsb),
            Node::Sub(a, b) => self.pair_sum(-1.0, a, b, lsb),
            Node::Neg(a) => {
                let a = self.term(-1.0, a)?;
                self.sum(0.0, &[a], Scale::plain(lsb), Constant::Added)
            }
            Node::Mul(a, b) => self.product(a, b, lsb),
            Node::Div(a, b) => self.quotient(a, b, lsb),
            Node::Ratio(a, b, limit) => self.ratio(a, b, lsb.max(limit.0 / exp2(29))),
            Node::Curve(ref curve, x) => Ok(self.curve(curve, x)?[0]),
            Node::Incline(ref curve, x) => Ok(self.curve(curve, x)?[1]),
            Node::Min(a, b) => match self.held_difference(a, b)? {
                Some(held) => Ok(held),
                None => self.of_two(Op::Min, a, b, lsb),
            },
            Node::Max(a, b) => self.of_two(Op::Max, a, b, lsb),
            Node::Abs(a) => self.absolute(a, lsb),
            Node::Power(a, halves) => self.power(a, halves, lsb),
            Node::Select(c, a, b) => {
                let c = self.bool(c)?;
                let (a, b) = self.alike(a, b, lsb)?;
                let value = self.b.op(Op::Select, &[c, a.value, b.value])?;
                Ok(Real {
                    value,
                    error: a.error.max(b.error),
                    ..a
                })
            }
            Node::Function(function, a) => self.function(function, a, lsb),
            // Bools have no integer of their own, and frictions have been written out.
            Node::Trial(..) | Node::Slip(_) => self.constant_real(0.0, Scale::plain(lsb)),
            Node::Bool(_)
            | Node::LiveBool(_)
            | Node::Is(..)
            | Node::Compare(..)
            | Node::And(..)
            | Node::Or(..)
            | Node::Not(_)
            | Node::SelectBool(..) => self.constant_real(0.0, Scale::plain(lsb)),
        }
    }

    /// Whether a node is the new rate of a body, held or not.
    fn is_new_rate(&self, node: NodeId) -> bool {
        let arm = |new: &NodeId| match *self.step.model.dag.get(*new) {
            Node::Select(_, a, b) => [a, b].contains(&node),
            _ => false,
        };
        self.step.rates.contains(&node) || self.step.rates.iter().any(arm)
    }

    fn pair_sum(&mut self, sign: f64, a: NodeId, b: NodeId, lsb: f64) -> Result<Real, OpError> {
        let terms = [self.term(1.0, a)?, self.term(sign, b)?];
        self.sum(0.0, &terms, Scale::plain(lsb), Constant::Added)
    }

    /// Both in one unit: as chosen, or coarser where one does not fit. Sensed values keep their
    /// offset where both can.
    fn alike(&mut self, a: NodeId, b: NodeId, lsb: f64) -> Result<(Real, Real), OpError> {
        let dag = &self.step.model.dag;
        let constants = (dag.real(a), dag.real(b));
        let (mut ra, mut rb) = (self.real(a)?, self.real(b)?);
        // Only shifts keep an offset as it is.
        let kept = |real: Real| power_of_two(real.lsb / lsb).is_some();
        let offset = match constants {
            (None, None) if ra.offset == rb.offset && kept(ra) && kept(rb) => ra.offset,
            (Some(_), None) if kept(rb) => rb.offset,
            (None, Some(_)) if kept(ra) => ra.offset,
            _ => 0.0,
        };
        for (real, constant) in [(&mut ra, constants.0), (&mut rb, constants.1)] {
            if offset == 0.0 && constant.is_none() {
                *real = self.plain(*real)?;
            }
        }
        let mut lsb = lsb;
        loop {
            let both = (
                self.in_unit(ra, constants.0, lsb, offset)?,
                self.in_unit(rb, constants.1, lsb, offset)?,
            );
            if let (Some(a), Some(b)) = both {
                return Ok((a, b));
            }
            lsb *= 2.0;
        }
    }

    /// A constant, or a real with this offset, in units of `lsb`; none if it does not fit.
    fn in_unit(
        &mut self,
        real: Real,
        constant: Option<f64>,
        lsb: f64,
        offset: f64,
    ) -> Result<Option<Real>, OpError> {
        if let Some(constant) = constant {
            let fits = (constant - offset).abs() <= format::TOP * lsb;
            return if fits {
                self.constant_real(constant, Scale { lsb, offset })
                    .map(Some)
            } else {
                Ok(None)
            };
        }
        let Some(n) = power_of_two(real.lsb / lsb) else {
            let real = self.plain(real)?;
            let moved = self.rescaled(real, lsb)?;
            return Ok((moved.lsb == lsb && offset == 0.0).then_some(moved));
        };
        if n > self.headroom(real.value) {
            return Ok(None);
        }
        Ok(Some(Real {
            value: self.moved(real.value, n)?,
            lsb,
            error: real.error + lsb * floored(n),
            ..real
        }))
    }

    fn of_two(&mut self, op: Op, a: NodeId, b: NodeId, lsb: f64) -> Result<Real, OpError> {
        let (a, b) = self.alike(a, b, lsb)?;
        let value = self.b.op(op, &[a.value, b.value])?;
        Ok(Real {
            value,
            error: a.error.max(b.error),
            ..a
        })
    }

    fn absolute(&mut self, a: NodeId, lsb: f64) -> Result<Real, OpError> {
        let a = self.real(a)?;
        let a = self.rescaled(a, lsb)?;
        let zero = self.constant(0)?;
        let negated = self.b.op(Op::Sub, &[zero, a.value])?;
        let value = self.b.op(Op::Max, &[a.value, negated])?;
        // Intervals do not see that one of the two is not negative.
        let value = self
            .b
            .op(Op::Assume(0, self.b.range(value).high), &[value])?;
        Ok(Real { value, ..a })
    }

    fn product(&mut self, a: NodeId, b: NodeId, lsb: f64) -> Result<Real, OpError> {
        let (ra, rb) = (self.real(a)?, self.real(b)?);
        let (ra, rb) = (self.plain(ra)?, self.plain(rb)?);
        let (ma, mb) = (
            self.ranges.get(a).magnitude(),
            self.ranges.get(b).magnitude(),
        );
        self.multiplied(ra, rb, lsb, (ma, mb))
    }

    /// The product of two values, of at most these magnitudes, by its top word. What is far from
    /// filling a word is moved up first.
    fn multiplied(
        &mut self,
        a: Real,
        b: Real,
        lsb: f64,
        (ma, mb): (f64, f64),
    ) -> Result<Real, OpError> {
        let squared = a.value == b.value;
        let (mut u, mut v) = (a, b);
        for real in [&mut u, &mut v] {
            if a.lsb * b.lsb * exp2(32) > lsb * exp2(SPARED) {
                let up = self.headroom(real.value);
                *real = Real {
                    value: self.moved(real.value, up)?,
                    lsb: real.lsb * exp2(-up),
                    ..*real
                };
            }
        }
        let mut value = self.b.op(Op::MulTop, &[u.value, v.value])?;
        if squared {
            // Intervals do not see that a square is not negative; the Model does, and has dropped
            // clamps that say so.
            value = self
                .b
                .op(Op::Assume(0, self.b.range(value).high), &[value])?;
        }
        let lsb = u.lsb * v.lsb * exp2(32);
        Ok(Real::new(
            value,
            lsb,
            ma * b.error + mb * a.error + a.error * b.error + 0.5 * lsb,
        ))
    }

    fn quotient(&mut self, a: NodeId, b: NodeId, lsb: f64) -> Result<Real, OpError> {
        let (ra, rb) = (self.real(a)?, self.real(b)?);
        let (ra, rb) = (self.plain(ra)?, self.plain(rb)?);
        // The divisor's proven interval leaves out zero; its rounded end must too.
        let rb = self.away_from_zero(rb, self.ranges.get(b).low > 0.0)?;
        let (value, lsb, dividend) = self.divided(ra, rb, lsb)?;
        let divisor = self.ranges.get(b);
        let smallest = divisor.low.abs().min(divisor.high.abs());
        let quotient = self.ranges.get(a).magnitude() / smallest;
        let inherited =
            (dividend.error + quotient * rb.error) / (smallest - rb.error).max(f64::MIN_POSITIVE);
        Ok(Real::new(value, lsb, inherited + 0.5 * lsb))
    }

    /// The quotient in units of about `lsb`, or as much coarser as its integers need; also the
    /// dividend it was made from.
    fn divided(&mut self, a: Real, b: Real, lsb: f64) -> Result<(Value, f64, Real), OpError> {
        let mut shift = exponent(a.lsb / (b.lsb * lsb)).min(31);
        loop {
            let down = (-shift).max(0);
            let error = a.error + if down > 0 { a.lsb * exp2(down) } else { 0.0 };
            let dividend = Real {
                value: self.moved(a.value, -down)?,
                lsb: a.lsb * exp2(down),
                error,
                ..a
            };
            match self
                .b
                .op(Op::DivRound(shift.max(0) as u8), &[dividend.value, b.value])
            {
                Err(OpError::Overflow { .. }) => shift -= 1,
                other => return other.map(|value| (value, a.lsb / b.lsb * exp2(-shift), dividend)),
            }
        }
    }

    /// A quotient with 14 significant bits, of what is divided by something above zero, in units
    /// in which 30 bits hold its limit. Its error is none: it is the step of a search, whose
    /// outcome has no bound.
    fn ratio(&mut self, a: NodeId, b: NodeId, lsb: f64) -> Result<Real, OpError> {
        let (ra, rb) = (self.real(a)?, self.real(b)?);
        let (ra, rb) = (self.plain(ra)?, self.plain(rb)?);
        let rb = self.away_from_zero(rb, true)?;
        let shift = exponent(ra.lsb / (rb.lsb * lsb)).min(31);
        let dividend = self.moved(ra.value, shift.min(0))?;
        let up = shift.max(0);
        let value = self.b.op(Op::Quot(up as u8), &[dividend, rb.value])?;
        let down = shift.min(0);
        Ok(Real::new(value, ra.lsb / rb.lsb * exp2(-up - down), 0.0))
    }

    fn away_from_zero(&mut self, real: Real, positive: bool) -> Result<Real, OpError> {
        let range = self.b.range(real.value);
        let kept = if positive {
            Range::new(1, range.high.max(1))
        } else {
            Range::new(range.low.min(-1), -1)
        };
        Ok(Real {
            value: self.clamped(real.value, kept)?,
            ..real
        })
    }

    /// `a^0.5` (in primes), `a^1.5` and `a^2.5`: the square root in integers, then products.
    fn power(&mut self, a: NodeId, halves: u8, lsb: f64) -> Result<Real, OpError> {
        let real = self.real(a)?;
        let real = self.plain(real)?;
        let magnitude = self.ranges.get(a).magnitude();
        // The root of an integer of up to 31 bits, moved up by 30: a word of result.
        let wide = self.b.op(Op::Widen, &[real.value])?;
        let wide = self.b.op(Op::Shl(30), &[wide])?;
        let root = self.b.op(Op::Sqrt, &[wide])?;
        let root_lsb = (real.lsb * exp2(-30)).sqrt();
        // Steep near zero, where the error's own root bounds what comes of it.
        let low = self.ranges.get(a).low - real.error;
        let inherited = if low > 0.0 {
            (real.error / (2.0 * low.sqrt())).min(real.error.sqrt())
        } else {
            real.error.sqrt()
        };
        let root = Real::new(root, root_lsb, inherited + root_lsb);
        if halves == 1 {
            return Ok(root);
        }
        if halves == 3 {
            return self.multiplied(real, root, lsb, (magnitude, magnitude.sqrt()));
        }
        let square = magnitude * magnitude;
        let squared = self.multiplied(real, real, square / format::TOP, (magnitude, magnitude))?;
        self.multiplied(squared, root, lsb, (square, magnitude.sqrt()))
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
        let lsb = self.units.of(a).max(self.units.of(b));
        let (a, b) = self.alike(a, b, lsb)?;
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

    /// An integer against the real threshold, exactly: the threshold becomes the nearest integer on
    /// the right side.
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

/// A value that the host rounded to its format.
fn set_from_outside(value: Value, range: Interval) -> Real {
    let bits = format::fraction_bits(range);
    Real::new(value, exp2(-bits), 0.5 * exp2(-bits))
}
