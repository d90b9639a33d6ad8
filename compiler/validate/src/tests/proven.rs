//! Normal forms keep the number, whatever the registers hold: every step after every other step is
//! a claim about the term that the constructors really make, and is proven by a solver.
//!
//! A claim is of what the steps mean, run with the integers of the operator table, against the
//! term that they have made. Steps that are proven for all numbers here are tried with numbers,
//! many in a row, in `super`.

use std::path::Path;

use whippen_kernel::op::Integer;
use whippen_smt::solver::Solver;
use whippen_smt::{Query, Sort, Unbounded, Verdict, ask, check};

use crate::bounds::{FAR, WORD};
use crate::stop::Told;
use crate::term::{Atom, Kind, Term, Terms};
use crate::truth::Truth;

/// An integer as solvers have it.
type Number = Unbounded;

/// Something that a constructor does, and what it means; the second operands are registers.
type Step = (
    &'static str,
    fn(&mut Terms, [Term; 3]) -> Told<Term>,
    fn([Number; 3]) -> Number,
);

fn number(value: i128) -> Number {
    Number::of(value)
}

fn modulo(a: Number, bits: i128) -> Number {
    a - ((a >> number(bits)) << number(bits))
}

fn wrapped(a: Number, bits: i128) -> Number {
    let half = number(1 << (bits - 1));
    modulo(a + half, bits) - half
}

/// 1 where it is at least so much.
fn at_least(a: Number, least: i128) -> Number {
    a.less(number(least)).opposite()
}

const STEPS: &[Step] = &[
    ("sum", |t, [a, b, _]| t.add(a, b), |[a, b, _]| a + b),
    ("difference", |t, [a, b, _]| t.sub(b, a), |[a, b, _]| b - a),
    (
        "scaled",
        |t, [a, b, _]| t.add_scaled(a, b, -3),
        |[a, b, _]| a - number(3) * b,
    ),
    (
        "times",
        |t, [a, ..]| t.scale(a, -12),
        |[a, ..]| a * number(-12),
    ),
    ("plus", |t, [a, ..]| t.plus(a, -7), |[a, ..]| a - number(7)),
    (
        "floor_1",
        |t, [a, ..]| t.floor(a, 1),
        |[a, ..]| a >> number(1),
    ),
    (
        "floor_5",
        |t, [a, ..]| t.floor(a, 5),
        |[a, ..]| a >> number(5),
    ),
    (
        "floor_32",
        |t, [a, ..]| t.floor(a, 32),
        |[a, ..]| a >> number(32),
    ),
    ("word", |t, [a, ..]| t.word(a), |[a, ..]| wrapped(a, 32)),
    (
        "unsigned",
        |t, [a, ..]| t.unsigned(a),
        |[a, ..]| modulo(a, 32),
    ),
    (
        "low_bits",
        |t, [a, ..]| t.low_bits(a, 7),
        |[a, ..]| modulo(a, 7),
    ),
    (
        "positive",
        |t, [a, ..]| t.positive(a),
        |[a, ..]| a.most(number(0)),
    ),
    ("max", |t, [a, b, _]| t.max(a, b), |[a, b, _]| a.most(b)),
    ("min", |t, [a, b, _]| t.min(b, a), |[a, b, _]| a.least(b)),
    (
        "clamp",
        |t, [a, ..]| t.clamp(a, (-100, 31)),
        |[a, ..]| a.most(number(-100)).least(number(31)),
    ),
    (
        "saturated",
        |t, [a, ..]| t.saturate(a),
        |[a, ..]| a.most(number(WORD.0)).least(number(WORD.1)),
    ),
    (
        "chosen_by_itself",
        |t, [a, b, _]| {
            let holds = t.at_least(a, 17)?;
            t.select(holds, a, b)
        },
        |[a, b, _]| at_least(a, 17).choose(a, b),
    ),
    (
        "chosen_by_another",
        |t, [a, b, c]| {
            let holds = t.at_least(c, -2)?;
            t.select(holds, b, a)
        },
        |[a, b, c]| at_least(c, -2).choose(b, a),
    ),
    (
        "gate_of_a_limit",
        |t, [a, ..]| {
            let holds = t.at_least(a, 5)?;
            let over = t.plus(a, -5)?;
            t.gate(holds, over)
        },
        |[a, ..]| at_least(a, 5).choose(a - number(5), number(0)),
    ),
    (
        "gate_of_its_opposite",
        |t, [a, b, _]| {
            let holds = t.at_least(a, 5)?;
            let opposite = t.truths.not(holds);
            t.gate(opposite, b)
        },
        |[a, b, _]| at_least(a, 5).choose(number(0), b),
    ),
    (
        "chosen_where_equal",
        |t, [a, b, c]| {
            let same = t.equal(a, b)?;
            t.select(same, c, a)
        },
        |[a, b, c]| a.equal(b).choose(c, a),
    ),
    (
        "truth",
        |t, [a, ..]| {
            let holds = t.at_least(a, 3)?;
            let (one, zero) = (t.constant(1), t.constant(0));
            t.select(holds, one, zero)
        },
        |[a, ..]| at_least(a, 3),
    ),
];

/// Steps that are two by themselves, for rules that look into what they are made of.
const WITHIN: &[Step] = &[
    (
        "floor_of_a_sum",
        |t, [a, b, _]| {
            let sum = t.add(a, b)?;
            t.floor(sum, 5)
        },
        |[a, b, _]| (a + b) >> number(5),
    ),
    (
        "word_of_a_sum",
        |t, [a, b, _]| {
            let sum = t.add(a, b)?;
            t.word(sum)
        },
        |[a, b, _]| wrapped(a + b, 32),
    ),
    (
        "low_bits_of_a_difference",
        |t, [a, b, _]| {
            let difference = t.sub(b, a)?;
            t.low_bits(difference, 9)
        },
        |[a, b, _]| modulo(b - a, 9),
    ),
    (
        "positive_over",
        |t, [a, ..]| {
            let over = t.plus(a, -5)?;
            t.positive(over)
        },
        |[a, ..]| (a - number(5)).most(number(0)),
    ),
    (
        "positive_below",
        |t, [a, ..]| {
            let below = t.scale(a, -3)?;
            let below = t.plus(below, 7)?;
            t.positive(below)
        },
        |[a, ..]| (number(7) - number(3) * a).most(number(0)),
    ),
    (
        "with_a_positive",
        |t, [a, b, _]| {
            let positive = t.positive(b)?;
            t.add(a, positive)
        },
        |[a, b, _]| a + b.most(number(0)),
    ),
    (
        "gate_by_another",
        |t, [a, b, _]| {
            let holds = t.at_least(b, 5)?;
            t.gate(holds, a)
        },
        |[a, b, _]| at_least(b, 5).choose(a, number(0)),
    ),
    (
        "gate_where_another_is_less",
        |t, [a, b, _]| {
            let holds = t.at_least(b, -3)?;
            let opposite = t.truths.not(holds);
            t.gate(opposite, a)
        },
        |[a, b, _]| at_least(b, -3).choose(number(0), a),
    ),
    (
        "truth_of_a_multiple",
        |t, [a, ..]| {
            let times = t.scale(a, -6)?;
            let holds = t.at_least(times, 20)?;
            let (one, zero) = (t.constant(1), t.constant(0));
            t.select(holds, one, zero)
        },
        |[a, ..]| at_least(number(-6) * a, 20),
    ),
];

/// Steps whose claims are of products, which are harder.
const PRODUCTS: &[Step] = &[
    ("product", |t, [a, b, _]| t.mul(a, b), |[a, b, _]| a * b),
    (
        "product_of_sums",
        |t, [a, b, c]| {
            let (x, y) = (t.add(a, c)?, t.sub(b, c)?);
            t.mul(x, y)
        },
        |[a, b, c]| (a + c) * (b - c),
    ),
    ("square", |t, [a, ..]| t.mul(a, a), |[a, ..]| a * a),
];

/// What a term is, by what registers hold.
fn meaning(terms: &Terms, term: Term, registers: &[Number]) -> Number {
    let sum = terms.sum(term);
    let of_kind = |kind: &Kind| match kind {
        Kind::Register(register) => registers[usize::from(*register)],
        Kind::Times(a, b) => meaning(terms, *a, registers) * meaning(terms, *b, registers),
        Kind::Floor(inner, n) => meaning(terms, *inner, registers) >> number((*n).into()),
        Kind::Positive(inner) => meaning(terms, *inner, registers).most(number(0)),
        Kind::Gate(truth, inner) => {
            holds(terms, *truth, registers).choose(meaning(terms, *inner, registers), number(0))
        }
        other => panic!("{other:?} is not built here"),
    };
    let parts = sum.parts.iter().map(|(atom, by)| {
        let factors: &[Atom] = match terms.kind(*atom) {
            Kind::Product(factors) => factors,
            _ => std::slice::from_ref(atom),
        };
        let factors = factors.iter().map(|factor| of_kind(terms.kind(*factor)));
        factors.fold(number(*by), |all, factor| all * factor)
    });
    parts.fold(number(sum.constant), |all, part| all + part)
}

/// 1 where a truth holds.
fn holds(terms: &Terms, truth: Truth, registers: &[Number]) -> Number {
    match terms.truths.split(truth) {
        None => number((truth == Truth::YES).into()),
        Some((asks, yes, no)) => {
            let is_so = at_least(meaning(terms, asks.primitive, registers), asks.least);
            is_so.choose(holds(terms, yes, registers), holds(terms, no, registers))
        }
    }
}

/// That two steps mean what the term of them says; and that it lies where `bounds` says.
fn claim(first: &Step, second: &Step) -> Query {
    whippen_smt::Term::forget_all();
    let name = format!("{}/{}", first.0, second.0);
    let registers: Vec<Number> = (0..3)
        .map(|at| Unbounded(whippen_smt::Term::free(&format!("r{at}"), Sort::Integer)))
        .collect();
    let mut terms = Terms::default();
    let own: [Term; 3] = std::array::from_fn(|at| terms.of(Kind::Register(at as u8)));
    let made =
        first.1(&mut terms, own).and_then(|inner| second.1(&mut terms, [inner, own[1], own[2]]));
    let Ok(term) = made else {
        return Query::unasked(name, "it is not made without a case");
    };
    let [a, b, c] = [0, 1, 2].map(|at| registers[at]);
    let wanted = second.2([first.2([a, b, c]), b, c]);
    let found = meaning(&terms, term, &registers);
    let (low, high) = terms.bounds(term);
    let is_word = |own: &Number| {
        number(WORD.0)
            .at_most(*own)
            .and(own.at_most(number(WORD.1)))
    };
    let mut assumed: Vec<whippen_smt::Term> = registers.iter().map(is_word).collect();
    // Bounds end where no word or sum of a run goes; beyond them nothing is said.
    if low <= -FAR || high >= FAR {
        assumed.push(
            number(-FAR)
                .at_most(wanted)
                .and(wanted.at_most(number(FAR))),
        );
    }
    let is_inside = number(low)
        .at_most(wanted)
        .and(wanted.at_most(number(high)));
    Query::new(name, &assumed, wanted.0.equals(found.0).and(is_inside))
}

fn answers() -> std::path::PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("src/tests/proven.txt")
}

/// A floor that is taken for another one.
#[test]
fn another_meaning_is_refuted_with_numbers() {
    let Some(solvers) = Solver::all() else { return };
    let named = |name: &str| STEPS.iter().find(|step| step.0 == name).expect("a step");
    let (floor, other) = (named("floor_1"), named("floor_5"));
    let wrong = ("fault", floor.1, other.2);
    let answer = ask(&solvers, &claim(named("sum"), &wrong), 20);
    assert_eq!(answer.verdict, Verdict::Refuted, "{answer:?}");
    assert!(answer.numbers.contains("(r0 "), "{answer:?}");
}

#[test]
fn normal_forms_keep_every_number() {
    let mut queries = Vec::new();
    let all = || STEPS.iter().chain(WITHIN);
    for second in all() {
        queries.extend(all().map(|first| claim(first, second)));
    }
    for product in PRODUCTS {
        for other in STEPS.iter().chain(PRODUCTS) {
            queries.push(claim(other, product));
        }
        queries.extend(STEPS.iter().map(|other| claim(product, other)));
    }
    check(&answers(), &queries);
}
