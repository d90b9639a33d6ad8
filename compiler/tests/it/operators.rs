//! Scalar operators against the `fixed` crate, and their intervals against every combination of
//! small operands.

use fixed::traits::Fixed;
use fixed::types::extra::{U0, U27, U32};
use fixed::types::{I5F27, I64F64};
use fixed::{FixedI64, FixedI128};
use whippen_compiler::kernel::op::{ROWS, Sort, Transfer};
use whippen_compiler::kernel::random::{Draw, Rng};
use whippen_compiler::kernel::{Kernel, Op, OpError, Range, Type, ValueInfo};

/// Pairs of edges of the type, then random numbers of all sizes.
fn pairs(ty: Type, count: usize) -> Vec<(i64, i64)> {
    let Range { low, high } = ty.range();
    let edges = [
        low,
        low + 1,
        low / 2,
        -3,
        -2,
        -1,
        0,
        1,
        2,
        3,
        high / 2,
        high / 2 + 1,
        high - 1,
        high,
    ];
    let all = edges.iter().flat_map(|a| edges.iter().map(|b| (*a, *b)));
    let mut rng = Rng::new(7);
    all.chain((0..count).map(|_| (rng.interesting(ty.range()), rng.interesting(ty.range()))))
        .collect()
}

fn evaluate(op: Op, ty: Type, args: [i64; 3]) -> i64 {
    op.evaluate(ty, args).expect("works on values")
}

/// `floor(x + 1/2)`, by the crate.
fn half_up<F: Fixed>(x: F) -> i128 {
    let half = F::from_num(0.5);
    x.checked_add(half).expect("room").floor().to_num()
}

#[test]
fn products_are_those_of_fixed() {
    for (a, b) in pairs(Type::I32, 20_000) {
        let (x, y) = (I5F27::from_bits(a as i32), I5F27::from_bits(b as i32));
        let wide = evaluate(Op::MulWide, Type::I64, [a, b, 0]);
        assert_eq!(wide, x.wide_mul(y).to_bits(), "{a} {b}");
        let floor = evaluate(Op::Sar(27), Type::I64, [wide, 0, 0]);
        assert_eq!(
            evaluate(Op::Narrow, Type::I32, [floor, 0, 0]),
            i64::from(x.wrapping_mul(y).to_bits()),
            "{a} {b}"
        );
        let sum = evaluate(Op::MacWide, Type::I64, [b, a, b]);
        let expected = FixedI64::<U27>::from_bits(b)
            .to_bits()
            .wrapping_add(x.wide_mul(y).to_bits());
        assert_eq!(sum, expected, "{a} {b}");
        let top = (x.wide_mul(y).to_bits() + (1 << 31)) >> 32;
        assert_eq!(evaluate(Op::MulTop, Type::I32, [a, b, 0]), top, "{a} {b}");
        assert_eq!(
            evaluate(Op::MacTop, Type::I32, [a, a, b]),
            i64::from((a as i32).wrapping_add(top as i32)),
            "{a} {b}"
        );
    }
}

#[test]
fn shifts_round_as_fixed_does() {
    for (a, n) in pairs(Type::I64, 20_000) {
        let n = n.rem_euclid(64) as u8;
        let x = I64F64::from_num(a) >> u32::from(n);
        let floor: i128 = x.floor().to_num();
        assert_eq!(
            i128::from(evaluate(Op::Sar(n), Type::I64, [a, 0, 0])),
            floor,
            "{a} {n}"
        );
        if let Some(sum) = x.checked_add(I64F64::from_num(0.5)) {
            assert_eq!(
                i128::from(evaluate(Op::SarRound(n), Type::I64, [a, 0, 0])),
                sum.floor().to_num::<i128>()
            );
        }
    }
}

#[test]
fn quotients_round_as_fixed_does() {
    let mut compared = 0;
    for (at, (a, b)) in pairs(Type::I32, 50_000).into_iter().enumerate() {
        let n = (at % 32) as u8;
        if b == 0 {
            assert_eq!(evaluate(Op::DivRound(n), Type::I32, [a, b, 0]), 0);
            continue;
        }
        // 32 bits of fraction tell every quotient by a 32-bit number from a half.
        let quotient = FixedI128::<U32>::from_num(a << n) / FixedI128::<U32>::from_num(b);
        let expected = half_up(quotient);
        if Type::I32.range().has(expected as i64) {
            compared += 1;
            assert_eq!(
                i128::from(evaluate(Op::DivRound(n), Type::I32, [a, b, 0])),
                expected,
                "{a} {b} {n}"
            );
        }
    }
    assert!(compared > 20_000, "only {compared} quotients fit");
}

#[test]
fn quotients_for_searches_are_as_near_as_that() {
    let mut compared = 0;
    for (at, (a, b)) in pairs(Type::I32, 50_000).into_iter().enumerate() {
        let n = (at % 32) as u8;
        let quotient = evaluate(Op::Quot(n), Type::I32, [a, b, 0]) as f64;
        if b <= 0 {
            assert_eq!(quotient, 0.0);
            continue;
        }
        let exact = a as f64 * 2.0_f64.powi(n.into()) / b as f64;
        let held = exact.clamp(-2.0_f64.powi(29), 2.0_f64.powi(29) - 1.0);
        let off = (quotient - held).abs();
        assert!(
            off <= 1.0 + held.abs() / 8192.0,
            "{a} {b} {n}: {quotient}, not {held}"
        );
        compared += 1;
    }
    assert!(compared > 20_000, "only {compared} divisors are positive");
}

#[test]
fn intervals_of_quotients_for_searches_hold_them() {
    let kernel = Kernel::default();
    let mut rng = Rng::new(3);
    for (at, (a, b)) in pairs(Type::I32, 4_000).into_iter().enumerate() {
        let op = Op::Quot((at % 32) as u8);
        let around = |rng: &mut Rng, middle: i64| {
            let reach = 1 << rng.range(Range::new(0, 30)).low;
            let all = Type::I32.range();
            Range::new(
                (middle - reach).max(all.low),
                (middle + reach).min(all.high),
            )
        };
        let ranges = [around(&mut rng, a), around(&mut rng, b)];
        let args = ranges.map(|range| ValueInfo {
            ty: Type::I32,
            range,
        });
        let interval = op
            .apply(&kernel, &args)
            .expect("all fit")
            .expect("a result")
            .range;
        for _ in 0..20 {
            let [a, b] = ranges.map(|range| rng.range(range).low);
            let quotient = evaluate(op, Type::I32, [a, b, 0]);
            assert!(
                interval.has(quotient),
                "{a} {b}: {quotient} is not in {interval:?}"
            );
        }
    }
}

#[test]
fn roots_are_those_of_fixed() {
    let squares =
        (0..2000).flat_map(|k| [-1, 0, 1].map(|d| ((i64::from(i32::MAX) - k).pow(2) + d, 0)));
    for (a, _) in pairs(Type::I64, 20_000).into_iter().chain(squares) {
        let expected = FixedI64::<U0>::from_bits(a.max(0)).sqrt().to_bits();
        if expected <= i64::from(i32::MAX) {
            assert_eq!(evaluate(Op::Sqrt, Type::I32, [a, 0, 0]), expected, "{a}");
        }
    }
}

/// All operators on values with these types of operands, with immediates where they need one. The
/// interval of `assume` is a promise, not a result, and that of `quot` is wider than it need be.
fn operators() -> Vec<(Op, Vec<Type>)> {
    let concrete = |sort: &Sort, free: Type| match sort {
        Sort::I1 => Type::I1,
        Sort::I64 => Type::I64,
        Sort::N | Sort::T => free,
        _ => Type::I32,
    };
    let pure = ROWS
        .iter()
        .filter(|row| row.effect.is_pure())
        .filter(|row| !matches!(row.transfer, Transfer::Assumed | Transfer::Quotient));
    pure.filter_map(|row| (row.make)(&vec![2; row.immediates.len()]))
        .filter(|op| {
            !op.row()
                .immediates
                .iter()
                .any(|immediate| immediate.is_declared())
                && !op.row().args.is_empty()
        })
        .flat_map(|op| {
            let free = Type::ALL.into_iter().map(move |free| {
                (
                    op,
                    op.row()
                        .args
                        .iter()
                        .map(|sort| concrete(sort, free))
                        .collect::<Vec<_>>(),
                )
            });
            free.collect::<Vec<_>>()
        })
        .collect()
}

/// Every combination of one number of each range.
fn combinations(ranges: &[Range]) -> Vec<[i64; 3]> {
    let numbers = |at: usize| ranges.get(at).map_or(0..=0, |range| range.low..=range.high);
    numbers(0)
        .flat_map(|a| numbers(1).flat_map(move |b| numbers(2).map(move |c| [a, b, c])))
        .collect()
}

#[test]
fn intervals_are_exact() {
    let kernel = Kernel::default();
    let mut rng = Rng::new(1);
    let mut applied = 0;
    for (op, types) in operators() {
        for _ in 0..40 {
            let small = Range::new(-6, 6);
            let ranges: Vec<Range> = types
                .iter()
                .map(|ty| rng.range(if *ty == Type::I1 { ty.range() } else { small }))
                .collect();
            let args: Vec<ValueInfo> = types
                .iter()
                .zip(&ranges)
                .map(|(ty, range)| ValueInfo {
                    ty: *ty,
                    range: *range,
                })
                .collect();
            let Ok(Some(info)) = op.apply(&kernel, &args) else {
                continue;
            };
            applied += 1;
            let results = combinations(&ranges)
                .into_iter()
                .map(|args| evaluate(op, info.ty, args));
            let exact = results
                .map(Range::point)
                .reduce(Range::union)
                .expect("not empty");
            assert_eq!(info.range, exact, "{op:?} of {ranges:?}");
        }
    }
    assert!(applied > 1000, "only {applied} intervals");
}

#[test]
fn results_that_need_not_fit_are_refused() {
    let kernel = Kernel::default();
    let info = |ty: Type, low, high| ValueInfo {
        ty,
        range: Range::new(low, high),
    };
    let word = info(Type::I32, i32::MIN.into(), i32::MAX.into());
    let wide = info(Type::I64, i64::MIN, i64::MAX);
    let refused = |op: Op, args: &[ValueInfo]| {
        matches!(op.apply(&kernel, args), Err(OpError::Overflow { .. }))
    };
    for op in [Op::Add, Op::Sub, Op::Mul] {
        assert!(
            refused(op, &[word, word]) && refused(op, &[wide, wide]),
            "{op:?}"
        );
    }
    assert!(refused(Op::MacWide, &[wide, word, word]));
    assert!(refused(Op::MacTop, &[word, word, word]) && !refused(Op::MulTop, &[word, word]));
    assert!(
        refused(Op::Shl(1), &[word]) && refused(Op::Narrow, &[wide]) && refused(Op::Sqrt, &[wide])
    );
    assert!(refused(Op::DivRound(1), &[word, info(Type::I32, 1, 1)]));
    assert!(refused(Op::DivRound(0), &[word, info(Type::I32, -1, -1)]));
    assert!(!refused(Op::DivRound(0), &[word, info(Type::I32, 0, 9)]));
    assert!(matches!(
        Op::Shl(32).apply(&kernel, &[info(Type::I32, 0, 0)]),
        Err(OpError::Immediate { .. })
    ));
    assert!(matches!(
        Op::Add.apply(&kernel, &[word, wide]),
        Err(OpError::Operands { .. })
    ));
}
