//! Terms are what solvers take them for, and what is wrong is refuted with numbers.

use whippen_kernel::Range;
use whippen_kernel::op::Integer;

use crate::solver::{Solver, Verdict, ask};
use crate::{Bounded, Query, Sort, Term, Unbounded};

const SECONDS: u64 = 20;

#[test]
fn what_holds_is_proven_and_what_does_not_is_refuted_with_numbers() {
    let Some(solvers) = Solver::all() else { return };
    Term::forget_all();
    let word = Range::new(-100, 100);
    let (a, assumed) = Bounded::free("a", 32, word);
    let twice = a + a;
    let claim = twice.word(32).equals((a * Bounded::of(2)).word(32));
    let answer = ask(&solvers, &Query::new("holds", &[assumed], claim), SECONDS);
    assert_eq!(answer.verdict, Verdict::Proven, "{answer:?}");
    let claim = twice.word(32).equals((a * Bounded::of(3)).word(32));
    let answer = ask(&solvers, &Query::new("fails", &[assumed], claim), SECONDS);
    assert_eq!(answer.verdict, Verdict::Refuted, "{answer:?}");
    assert!(answer.numbers.starts_with("((a "), "{answer:?}");
}

/// What is assumed is asked for by itself, so that nothing is proven of no numbers.
#[test]
fn premises_that_no_number_meets_are_found() {
    let Some(solvers) = Solver::all() else { return };
    Term::forget_all();
    let (a, assumed) = Bounded::free("a", 32, Range::new(3, 4));
    let claim = a.word(32).equals(Term::word(3, 32));
    let contrary = a.word(32).equals(Term::word(5, 32));
    for (more, verdict) in [
        (Term::truth(true), Verdict::Refuted),
        (contrary, Verdict::Proven),
    ] {
        let query = Query::new("claim", &[assumed, more], claim);
        let answer = ask(&solvers, &query.premises(), SECONDS);
        assert_eq!(answer.verdict, verdict, "{answer:?}");
    }
}

#[test]
fn integers_are_divided_downwards() {
    let Some(solvers) = Solver::all() else { return };
    Term::forget_all();
    let a = Unbounded(Term::free("a", Sort::Integer));
    let down = a >> Unbounded::of(3);
    let rest = a - down * Unbounded::of(8);
    let claim = Term::all([
        Unbounded::of(0).at_most(rest),
        rest.at_most(Unbounded::of(7)),
    ]);
    let answer = ask(&solvers, &Query::new("floor", &[], claim), SECONDS);
    assert_eq!(answer.verdict, Verdict::Proven, "{answer:?}");
}

/// Every solver folds numbers as terms do.
#[test]
fn terms_of_numbers_are_the_numbers_of_solvers() {
    let Some(solvers) = Solver::all() else { return };
    Term::forget_all();
    let names = [
        "bvadd", "bvsub", "bvmul", "bvand", "bvor", "bvxor", "bvshl", "bvlshr", "bvashr", "bvudiv",
        "bvurem", "bvsdiv", "bvsrem", "bvult", "bvule", "bvslt", "bvsle", "=", "concat",
    ];
    let numbers = [1, 33, 0x8000_0000, 0xffff_fffe];
    for (x, y) in numbers.iter().flat_map(|x| numbers.map(|y| (*x, y))) {
        let [a, b] = ["a", "b"].map(|name| Term::free(name, Sort::Word(32)));
        let [known_a, known_b] = [x, y].map(|number| Term::word(number, 32));
        let functions = names.map(|name| {
            let number = Term::apply(name, &[known_a, known_b]);
            assert!(number.number().is_some(), "{name} {x} {y}");
            Term::apply(name, &[a, b]).equals(number)
        });
        let zeros = known_a.leading_zeros();
        assert_eq!(zeros.number(), Some((x as u32).leading_zeros().into()));
        let zeros = a.leading_zeros().equals(zeros);
        let longer = a.resized(48).equals(known_a.resized(48));
        let assumed = [a.equals(known_a), b.equals(known_b)];
        let all = Term::all(functions.into_iter().chain([zeros, longer]));
        let query = Query::new("numbers", &assumed, all);
        for solver in &solvers {
            let answer = ask(std::slice::from_ref(solver), &query, SECONDS);
            assert_eq!(answer.verdict, Verdict::Proven, "{x} {y} {answer:?}");
        }
    }
}

#[test]
fn bounded_numbers_are_the_numbers_of_the_table() {
    Term::forget_all();
    let numbers = [-(1 << 31), -7, -1, 0, 1, 2, 5, (1 << 31) - 1_i128];
    for a in numbers {
        for b in numbers {
            let [x, y] = [a, b].map(Bounded::of);
            let pairs = [
                (x + y, a + b),
                (x - y, a - b),
                (x * y, a * b),
                (x.least(y), a.least(b)),
                (x.most(y), a.most(b)),
                (x.less(y), a.less(b)),
                (x.equal(y), a.equal(b)),
                (x.quot(y, Bounded::of(3)), a.quot(b, 3)),
            ];
            for (own, number) in pairs {
                assert_eq!(own.number(), Some(number), "{a} {b}");
            }
            if b > 0 {
                let quotient = x.floor_quotient(y);
                assert_eq!(quotient.number(), Some(a.floor_quotient(b)), "{a} {b}");
            }
        }
    }
}
