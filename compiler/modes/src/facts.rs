//! Backward interval propagation: from the range of a decided condition to ranges of the values it
//! compares, and on to their operands.

use super::graph::{Graph, NodeId};
use super::tuning;
use rustc_hash::FxHashMap;
use whippen_kernel::{Op, Range, Type};

/// Where nodes lie on a path; what is not listed is as its operands say.
pub(super) type Facts = FxHashMap<NodeId, Range>;

/// The facts that come with `node` lying in `range`, and the nodes of which something new is known;
/// none if that cannot be. `known` tells the ranges on the path so far.
pub(super) fn with(
    graph: &Graph,
    known: &dyn Fn(NodeId) -> Range,
    facts: &Facts,
    node: NodeId,
    range: Range,
) -> Option<(Facts, Vec<NodeId>)> {
    let mut narrowing = Narrowing {
        graph,
        known,
        facts: facts.clone(),
        latest: Vec::new(),
        open: vec![(node, range)],
    };
    for _ in 0..tuning::NARROWING_STEPS {
        let Some((node, range)) = narrowing.open.pop() else {
            break;
        };
        narrowing.narrow(node, range)?;
    }
    Some((narrowing.facts, narrowing.latest))
}

struct Narrowing<'a, 'k> {
    graph: &'a Graph<'k>,
    known: &'a dyn Fn(NodeId) -> Range,
    facts: Facts,
    latest: Vec<NodeId>,
    open: Vec<(NodeId, Range)>,
}

impl Narrowing<'_, '_> {
    fn range(&self, id: NodeId) -> Range {
        let known = self
            .graph
            .constant(id)
            .map_or_else(|| (self.known)(id), Range::point);
        self.facts.get(&id).map_or(known, |fact| meet(known, *fact))
    }

    /// None if nothing is left.
    fn narrow(&mut self, id: NodeId, range: Range) -> Option<()> {
        let old = self.range(id);
        let new = meet(old, range);
        if new.is_empty() {
            return None;
        }
        if new != old {
            self.facts.insert(id, new);
            self.latest.push(id);
            if let Some(op) = self.graph.op(id) {
                self.operands(op, id, new);
            }
        }
        Some(())
    }

    /// What follows for the operands.
    fn operands(&mut self, op: Op, id: NodeId, range: Range) {
        let args = self.graph.args(id);
        let mut ranges = [range; 3];
        ranges
            .iter_mut()
            .zip(args)
            .for_each(|(range, arg)| *range = self.range(*arg));
        match (op, args, &ranges[..args.len().min(3)]) {
            (Op::Lt, [a, b], [x, y]) => self.less(*a, *b, *x, *y, range),
            (Op::Eq, [a, b], [x, y]) if range == Range::point(1) => {
                self.open.extend([(*a, *y), (*b, *x)])
            }
            (Op::Eq, [a, b], [x, y]) if range == Range::point(0) => {
                self.open
                    .extend([(*a, without(*x, *y)), (*b, without(*y, *x))]);
            }
            (Op::Not, [a], _) => self
                .open
                .push((*a, Range::new(1 - range.high, 1 - range.low))),
            (Op::And, [a, b], [x, y]) => self.both(*a, *b, *x, *y, range, 1),
            (Op::Or, [a, b], [x, y]) => self.both(*a, *b, *x, *y, range, 0),
            (Op::Select, [c, a, b], [_, x, y]) => self.chosen(*c, *a, *b, *x, *y, range),
            (Op::Min, [a, b], [x, y]) => self.extreme(*a, *b, *x, *y, range, true),
            (Op::Max, [a, b], [x, y]) => self.extreme(*a, *b, *x, *y, range, false),
            (Op::Add, [a, b], [x, y]) => self
                .open
                .extend([(*a, minus(range, *y)), (*b, minus(range, *x))]),
            (Op::Sub, [a, b], [x, y]) => self
                .open
                .extend([(*a, plus(range, *y)), (*b, minus(*x, range))]),
            (Op::Assume(..) | Op::Widen | Op::Narrow, [a], _) => self.open.push((*a, range)),
            (Op::Shl(n), [a], _) => self
                .open
                .push((*a, Range::new(up(range.low, n), range.high >> n))),
            (Op::Sar(n), [a], _) => self.open.push((
                *a,
                Range::new(times(range.low, n, 0), times(range.high, n, 1)),
            )),
            (Op::Mul | Op::MulWide, [a, b], [x, y]) => {
                self.factor(*a, *y, range);
                self.factor(*b, *x, range);
            }
            (Op::SarRound(n), [a], _) if n > 0 => {
                let half = 1_i64 << (n - 1);
                let all = Range::new(times(range.low, n, 0), times(range.high, n, 1));
                self.open.push((*a, minus(all, Range::point(half))));
            }
            (Op::MulTop, [a, b], [x, y]) => {
                self.top_factor(*a, *y, range);
                self.top_factor(*b, *x, range);
            }
            (Op::MacTop, [z, a, b], [w, x, y]) => {
                if z == a {
                    // `z + top(z * y)` is the top word of `z * (2^32 + y)`.
                    self.top_factor(*z, plus(*y, Range::point(1 << 32)), range);
                }
                self.open.push((*z, minus(range, top(*x, *y))));
                let product = minus(range, *w);
                self.top_factor(*a, *y, product);
                self.top_factor(*b, *x, product);
            }
            (Op::MacWide, [_, a, b], [z, x, y]) => {
                let product = minus(range, *z);
                self.factor(*a, *y, product);
                self.factor(*b, *x, product);
            }
            _ => {}
        }
    }

    fn less(&mut self, a: NodeId, b: NodeId, x: Range, y: Range, result: Range) {
        if result == Range::point(1) {
            self.open
                .push((a, Range::new(i64::MIN, y.high.saturating_sub(1))));
            self.open
                .push((b, Range::new(x.low.saturating_add(1), i64::MAX)));
        } else if result == Range::point(0) {
            self.open.push((a, Range::new(y.low, i64::MAX)));
            self.open.push((b, Range::new(i64::MIN, x.high)));
        }
    }

    /// `and` where `strong` is 1, `or` where it is 0: the strong result needs both, the other one
    /// of them.
    fn both(&mut self, a: NodeId, b: NodeId, x: Range, y: Range, result: Range, strong: i64) {
        let (strong, weak) = (Range::point(strong), Range::point(1 - strong));
        if result == strong {
            self.open.extend([(a, strong), (b, strong)]);
        } else if result == weak && x == strong {
            self.open.push((b, weak));
        } else if result == weak && y == strong {
            self.open.push((a, weak));
        }
    }

    fn chosen(&mut self, c: NodeId, a: NodeId, b: NodeId, x: Range, y: Range, result: Range) {
        let condition = self.range(c);
        if condition == Range::point(1) || meet(y, result).is_empty() {
            self.open.extend([(c, Range::point(1)), (a, result)]);
        } else if condition == Range::point(0) || meet(x, result).is_empty() {
            self.open.extend([(c, Range::point(0)), (b, result)]);
        }
    }

    /// `min` (or `max`): neither lies below (above) the result; where one lies beyond it, it was
    /// the other.
    fn extreme(&mut self, a: NodeId, b: NodeId, x: Range, y: Range, result: Range, smaller: bool) {
        let side = if smaller {
            Range::new(result.low, i64::MAX)
        } else {
            Range::new(i64::MIN, result.high)
        };
        for (one, range, other) in [(a, y, x), (b, x, y)] {
            let beyond = if smaller {
                range.low > result.high
            } else {
                range.high < result.low
            };
            let inside = if beyond { meet(side, result) } else { side };
            if meet(inside, other) != other {
                self.open.push((one, inside));
            }
        }
    }

    /// A factor, given the other and the product.
    fn factor(&mut self, id: NodeId, other: Range, product: Range) {
        let (Range { low, high }, k) = (product, other.low);
        if other.low != other.high || k == 0 || k == i64::MIN || low == i64::MIN {
            return;
        }
        let (low, high) = if k > 0 { (low, high) } else { (-high, -low) };
        let k = k.abs();
        let ceiling = low.div_euclid(k) + i64::from(low.rem_euclid(k) != 0);
        self.open
            .push((id, Range::new(ceiling, high.div_euclid(k))));
    }

    /// A factor, given the other and the top word of the product, rounded half up.
    fn top_factor(&mut self, id: NodeId, other: Range, top: Range) {
        // A top word is a word, so nothing is lost here.
        let Range { low, high } = meet(top, Type::I32.range());
        if low <= high {
            let (half, one) = (1 << 31, 1 << 32);
            self.factor(
                id,
                other,
                Range::new((low * one).saturating_sub(half), high * one + (half - 1)),
            );
        }
    }
}

/// What two ranges have in common.
pub(super) fn meet(a: Range, b: Range) -> Range {
    Range::new(a.low.max(b.low), a.high.min(b.high))
}

/// `a` without the point `b`, if that is at its end.
fn without(a: Range, b: Range) -> Range {
    match b.low == b.high {
        true if a.low == b.low => Range::new(a.low.saturating_add(1), a.high),
        true if a.high == b.low => Range::new(a.low, a.high.saturating_sub(1)),
        _ => a,
    }
}

fn plus(a: Range, b: Range) -> Range {
    Range::new(a.low.saturating_add(b.low), a.high.saturating_add(b.high))
}

fn minus(a: Range, b: Range) -> Range {
    Range::new(a.low.saturating_sub(b.high), a.high.saturating_sub(b.low))
}

/// The top words of products of words, rounded half up.
fn top(a: Range, b: Range) -> Range {
    let word = |x: i64, y: i64| ((i128::from(x) * i128::from(y) + (1 << 31)) >> 32) as i64;
    let ends = [
        word(a.low, b.low),
        word(a.low, b.high),
        word(a.high, b.low),
        word(a.high, b.high),
    ];
    ends.into_iter().fold(Range::point(ends[0]), |all, end| {
        all.union(Range::point(end))
    })
}

/// `ceil(value / 2^n)`
fn up(value: i64, n: u8) -> i64 {
    (value >> n) + i64::from((value >> n) << n != value)
}

/// The first (`last` 0) or last (1) number that gives `value` when shifted right by `n`.
fn times(value: i64, n: u8, last: i128) -> i64 {
    let number = ((i128::from(value) + last) << n) - last;
    number.clamp(i64::MIN.into(), i64::MAX.into()) as i64
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::graph::Kind;
    use whippen_kernel::Kernel;
    use whippen_kernel::random::Rng;

    /// A number of any size, at random.
    fn number(rng: &mut Rng) -> i64 {
        i64::from(rng.next() as u32 as i32) >> rng.below(31)
    }

    #[test]
    fn top_words_tell_of_their_factors_and_leave_room_for_what_they_were_made_of() {
        let (kernel, mut rng, mut narrowed) = (Kernel::default(), Rng::new(5), 0);
        let top = |a: i64, b: i64| ((i128::from(a) * i128::from(b) + (1 << 31)) >> 32) as i64;
        for _ in 0..20_000 {
            let mut graph = Graph::new(&kernel);
            let values = [number(&mut rng), number(&mut rng), number(&mut rng)];
            let reach = rng.below(2) as i64 * values[1].abs();
            let ids = [0, 1, 2].map(|live| graph.node(Kind::Op(Op::Live(live)), Type::I32, &[]));
            let ([z, a, k], [vz, va, vk]) = (ids, values);
            let shape = rng.below(4);
            let (op, args, result) = match shape {
                0 => (Op::MulTop, vec![a, k], top(va, vk)),
                1 => (Op::MacTop, vec![z, a, k], vz + top(va, vk)),
                2 => (Op::MacTop, vec![a, a, k], va + top(va, vk)),
                _ => (Op::SarRound(7), vec![a], (va + 64) >> 7),
            };
            let node = graph.node(Kind::Op(op), Type::I32, &args);
            let known = |id: NodeId| match ids.iter().position(|known| *known == id) {
                Some(0) => Range::new(vz - reach, vz + reach),
                Some(1) => Type::I32.range(),
                Some(_) => Range::point(vk),
                None => Range::new(i64::MIN, i64::MAX),
            };
            let wanted = Range::new(
                result - rng.below(100) as i64,
                result + rng.below(100) as i64,
            );
            let (facts, _) =
                with(&graph, &known, &Facts::default(), node, wanted).expect("it can be");
            for (id, value) in ids.into_iter().zip(values) {
                assert!(
                    facts.get(&id).is_none_or(|range| range.has(value)),
                    "{op:?} of {values:?} in {wanted}: {facts:?}"
                );
            }
            narrowed += usize::from(facts.contains_key(&a));
        }
        assert!(narrowed > 5000, "{narrowed}");
    }
}
