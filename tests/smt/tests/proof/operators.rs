//! The operator table: that every interval rule holds what an operator computes.
//!
//! The verifier takes an operator's meaning at the corners of its operands' intervals. That holds
//! all results where the meaning is monotone in each operand by itself, whichever way: what lies
//! between two operands goes to what lies between their results. So the claim is of one operand at
//! a time, with the others anywhere, over integers without bounds; it is about the very functions
//! of the table (`compiler/kernel/src/op.rs`), run with terms.

use std::path::Path;

use whippen_kernel::op::Integer;
use whippen_kernel::{Op, ROWS, op::Row, op::Sort as Operand, op::Transfer};
use whippen_smt::solver::Solver;
use whippen_smt::{Query, Sort, Term, Unbounded, Verdict, ask, check};

/// Immediates that a row is asked with: shifts are asked with each of them.
fn forms(row: &Row) -> Vec<Op> {
    // A dividend moved up is an integer like any other, and the claim is of all integers.
    let most = if row.transfer == Transfer::Divide {
        1
    } else {
        64
    };
    match row.immediates {
        [] => (row.make)(&[]).into_iter().collect(),
        [_] => (0..most).filter_map(|n| (row.make)(&[n])).collect(),
        _ => Vec::new(),
    }
}

fn free(name: &str) -> Unbounded {
    Unbounded(Term::free(name, Sort::Integer))
}

fn is_bool(value: Unbounded) -> Term {
    let is = |number: i128| value.0.equals(Term::integer(number));
    is(0).or(is(1))
}

/// Whether a second operand lies in a piece by itself: below 0, 0, or above 0.
fn in_piece(piece: usize, value: Unbounded) -> Term {
    let (one, minus) = (Unbounded::of(1), Unbounded::of(-1));
    match piece {
        0 => value.at_most(minus),
        1 => value.0.equals(Term::integer(0)),
        _ => one.at_most(value),
    }
}

/// That `middle` lies between `low` and `high`, whichever is less.
fn between(low: Unbounded, middle: Unbounded, high: Unbounded) -> Term {
    Term::all([
        low.least(high).at_most(middle),
        middle.at_most(low.most(high)),
    ])
}

/// The claim for one operand of a row, in one piece of the second operand.
fn monotone(row: &Row, ops: &[Op], operand: usize, piece: Option<usize>) -> Query {
    Term::forget_all();
    let names = ["a", "b", "c"];
    let moved = ["least", "middle", "most"].map(free);
    let others: [Unbounded; 3] = std::array::from_fn(|at| free(names[at]));
    let mut assumed = vec![moved[0].at_most(moved[1]), moved[1].at_most(moved[2])];
    let mut all = Vec::new();
    for (at, sort) in row.args.iter().enumerate() {
        let own: &[Unbounded] = if at == operand {
            &moved
        } else {
            &others[at..=at]
        };
        if *sort == Operand::I1 {
            assumed.extend(own.iter().map(|value| is_bool(*value)));
        }
        if let (1, Some(piece)) = (at, piece) {
            assumed.extend(own.iter().map(|value| in_piece(piece, *value)));
        }
    }
    for op in ops {
        let results = moved.map(|value| {
            let mut args = others;
            args[operand] = value;
            op.exact(args)
        });
        let [Some(low), Some(middle), Some(high)] = results else {
            return Query::unasked(row.name, "computes nothing");
        };
        all.push(between(low, middle, high));
    }
    let piece = piece.map_or(String::new(), |piece| {
        format!("/{}", ["below", "zero", "above"][piece])
    });
    let name = format!("{}/{}{piece}", row.name, names[operand]);
    Query::new(name, &assumed, Term::all(all))
}

/// Rows whose interval is spanned by corners.
fn of_corners() -> impl Iterator<Item = (&'static Row, &'static [Option<usize>])> {
    ROWS.iter().filter_map(|row| match row.transfer {
        Transfer::Corners | Transfer::Wrapping if !row.args.is_empty() => Some((row, &[None][..])),
        Transfer::Divide => Some((row, &[Some(0), Some(1), Some(2)][..])),
        _ => None,
    })
}

/// A product of unknown signs does not rise with its operand.
#[test]
fn a_wrong_interval_is_refuted_with_numbers() {
    let Some(solvers) = Solver::all() else { return };
    Term::forget_all();
    let [a, b, c] = ["a", "b", "c"].map(free);
    let [low, high] = [a, b].map(|value| Op::Mul.exact([value, c, c]).expect("a product"));
    let query = Query::new("fault", &[a.at_most(b)], low.at_most(high));
    let answer = ask(&solvers, &query, 20);
    assert_eq!(answer.verdict, Verdict::Refuted, "{answer:?}");
    assert!(answer.numbers.contains("(c (- "), "{answer:?}");
}

#[test]
fn intervals_of_operators_hold_their_results() {
    let mut queries = Vec::new();
    for (row, pieces) in of_corners() {
        let ops = forms(row);
        for operand in 0..row.args.len() {
            let own = pieces
                .iter()
                .map(|piece| monotone(row, &ops, operand, *piece));
            queries.extend(own);
        }
    }
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/proof/operators.txt");
    check(&file, &queries);
}
