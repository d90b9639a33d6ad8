//! Division by invariant integers using multiplication: rounded quotients by a constant as
//! products, exact.
//!
//! `floor(a * 2^n / b + 1/2)` is `floor((a * m + c) / 2^s)` for some `m` next to `2^(n + s) / b`,
//! if the difference of both before rounding down lies in `[0, 1 / 2b)`: the first is a multiple of
//! `1 / 2b`. `m` has two digits of 31 bits.

use super::PartialEval;
use crate::graph::{Graph, NodeId};
use whippen_kernel::{Op, Type};

#[cfg(test)]
mod proven;

/// Bits of a digit.
const DIGIT: u8 = 31;

/// `(a * m + c) >> s`
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Product {
    m: i128,
    c: i128,
    s: u8,
}

impl Product {
    /// The product for all dividends up to this magnitude; none if there is none of two digits.
    fn of(largest: i128, b: i128, n: u8) -> Option<Product> {
        (DIGIT..=2 * DIGIT).find_map(|s| {
            let one = 1_i128
                .checked_shl(u32::from(n) + u32::from(s))
                .filter(|one| *one > 0)?;
            let m = (one + b / 2) / b;
            // So much, at most, is `a * m / 2^s` wrong, in units of `1 / (b * 2^s)`; adding it
            // makes the error positive.
            let wrong = largest * (one - m * b).abs();
            let added = wrong.div_euclid(b) + 1;
            let exact = 2 * (added * b + wrong) < 1 << s;
            (exact && m < 1 << (2 * DIGIT)).then_some(Product {
                m,
                c: (1 << (s - 1)) + added,
                s,
            })
        })
    }

    #[cfg(test)]
    fn at(self, a: i64) -> i128 {
        (i128::from(a) * self.m + self.c) >> self.s
    }
}

impl PartialEval {
    /// A quotient by a positive constant, if a product is the same.
    pub(super) fn quotient(
        &mut self,
        graph: &mut Graph,
        a: NodeId,
        b: NodeId,
        n: u8,
    ) -> Option<NodeId> {
        let (divisor, range) = (graph.constant(b)?, self.range(a));
        if divisor <= 0 || !Type::I32.range().contains(range) {
            return None;
        }
        let largest = range.low.unsigned_abs().max(range.high.unsigned_abs());
        let Product { m, c, s } = Product::of(largest.into(), divisor.into(), n)?;
        let word = |value: i128| {
            Type::I32
                .range()
                .has(i64::try_from(value).ok()?)
                .then_some(value as i64)
        };
        let ends = [range.low, range.high].map(|a| word((i128::from(a) * m + c) >> s));
        let (Some(_), Some(_)) = (ends[0], ends[1]) else {
            return None;
        };
        let digit = (1_i128 << DIGIT) - 1;
        let [low, high] =
            [m & digit, m >> DIGIT].map(|digit| self.constant(graph, Type::I32, digit as i64));
        let carried = self.constant(graph, Type::I64, (c & digit) as i64);
        let carried = self.fold_pure(graph, Op::MacWide, Type::I64, &[carried, a, low]);
        let carried = self.fold_pure(graph, Op::Sar(DIGIT), Type::I64, &[carried]);
        let rest = self.constant(graph, Type::I64, (c >> DIGIT) as i64);
        let carried = self.fold_pure(graph, Op::Add, Type::I64, &[carried, rest]);
        let sum = self.fold_pure(graph, Op::MacWide, Type::I64, &[carried, a, high]);
        let quotient = self.fold_pure(graph, Op::Sar(s - DIGIT), Type::I64, &[sum]);
        Some(self.fold_pure(graph, Op::Narrow, Type::I32, &[quotient]))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use whippen_kernel::random::Rng;

    #[test]
    fn products_are_the_quotients() {
        let (mut rng, mut found) = (Rng::new(1), 0);
        for _ in 0..20_000 {
            let n = rng.below(31) as u8;
            let (size, bits) = (1 + rng.below(31), 1 + rng.below(31));
            let b = 1 + rng.below(1 << size) as i64;
            // What does not fit a word is no quotient of a kernel.
            let largest =
                (rng.below(1 << bits) as i64).min(((1_i64 << 31) - 2).saturating_mul(b) >> n);
            let Some(product) = Product::of(largest.into(), b.into(), n) else {
                continue;
            };
            found += 1;
            let exact =
                |a: i64| ((i128::from(a) << (n + 1)) + i128::from(b)).div_euclid(2 * i128::from(b));
            // Ends, and what is next to a half: there the quotient changes.
            let mut tried = vec![0, 1, -1, largest, -largest];
            for _ in 0..20 {
                let q = rng.below(1 << 31) as i128 - (1 << 30);
                let edge = ((2 * q + 1) * i128::from(b)) >> (n + 1);
                tried.extend(
                    [edge - 1, edge, edge + 1]
                        .map(|a| a.clamp((-largest).into(), largest.into()) as i64),
                );
            }
            for a in tried {
                assert_eq!(
                    product.at(a),
                    exact(a),
                    "{a} * 2^{n} / {b}, up to {largest}: {product:?}"
                );
            }
        }
        assert!(found > 15_000, "{found}");
    }

    #[test]
    fn unused_ranges_have_no_product() {
        assert_eq!(Product::of(1 << 31, (1 << 31) - 1, 31), None);
    }
}
