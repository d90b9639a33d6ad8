//! Both readings of the operators are one: what the checker computes of whole numbers is what the
//! compiler's table says, for all of them (`docs/proofs.md`).

use std::path::Path;

use whippen_kernel::op::{Integer, Op, ROWS, Sort as Operand};
use whippen_smt::solver::Solver;
use whippen_smt::{Query, Sort, Term, Unbounded, Verdict, ask, check};

use super::{Whole, exact};

impl Whole for Unbounded {
    fn of(number: i128) -> Self {
        Integer::of(number)
    }

    fn least(self, other: Self) -> Self {
        Integer::least(self, other)
    }

    fn most(self, other: Self) -> Self {
        Integer::most(self, other)
    }

    fn is_less(self, other: Self) -> Self {
        self.less(other)
    }

    fn unless_zero(self, other: Self, zero: Self) -> Self {
        self.equal(number(0)).choose(zero, other)
    }

    fn up(self, by: i128) -> Self {
        self << Integer::of(by)
    }

    fn down(self, by: i128) -> Self {
        self >> Integer::of(by)
    }

    fn by(self, divisor: Self) -> Self {
        self.floor_quotient(divisor)
    }

    fn root(self) -> Self {
        Integer::root(self)
    }
}

fn number(value: i128) -> Unbounded {
    Integer::of(value)
}

/// That both compute the same of all operands, with every shift.
fn claim(row: &whippen_kernel::op::Row) -> Option<Query> {
    Term::forget_all();
    // A dividend moved up is an integer like any other.
    let is_shifted = !row.immediates.is_empty() && row.name != "div_round";
    let shifts = if is_shifted { 64 } else { 1 };
    let mut assumed = Vec::new();
    let mut args = [number(0); 3];
    for (at, sort) in row.args.iter().enumerate() {
        args[at] = Unbounded(Term::free(["a", "b", "c"][at], Sort::Integer));
        let is = |value: i128| args[at].0.equals(Term::integer(value));
        if *sort == Operand::I1 {
            assumed.push(is(0).or(is(1)));
        }
        if row.name == "div_round" && at == 1 {
            assumed.push(is(0).negated());
        }
    }
    let mut all = Vec::new();
    for n in 0..shifts {
        let immediates: Vec<i64> = row.immediates.iter().map(|_| n).collect();
        let op = (row.make)(&immediates)?;
        let own = exact(row.name, n.into(), &args[..row.args.len()])?;
        all.push(own.0.equals(op.exact(args)?.0));
    }
    Some(Query::new(row.name, &assumed, Term::all(all)))
}

/// A rounding that is left out.
#[test]
fn another_reading_is_refuted_with_numbers() {
    let Some(solvers) = Solver::all() else { return };
    Term::forget_all();
    let a = Unbounded(Term::free("a", Sort::Integer));
    let down = exact("sar", 3, &[a]).expect("a shift");
    let rounded = Op::SarRound(3).exact([a; 3]).expect("a shift");
    let query = Query::new("fault", &[], down.0.equals(rounded.0));
    let answer = ask(&solvers, &query, 20);
    assert_eq!(answer.verdict, Verdict::Refuted, "{answer:?}");
    assert!(answer.numbers.contains("(a "), "{answer:?}");
}

#[test]
fn both_readings_of_operators_are_one() {
    let with_operands = ROWS.iter().filter(|row| (1..=3).contains(&row.args.len()));
    let queries: Vec<Query> = with_operands.filter_map(claim).collect();
    assert!(queries.len() > 20, "{}", queries.len());
    check(
        &Path::new(env!("CARGO_MANIFEST_DIR")).join("src/ranges/rule/tests.txt"),
        &queries,
    );
}
