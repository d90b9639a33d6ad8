//! A product for a quotient is the quotient for every dividend up to its magnitude: a claim for
//! each of these divisors, shifts and magnitudes, with the numbers that the compiler really takes
//! (`docs/proofs.md`).

use std::path::Path;

use whippen_kernel::Op;
use whippen_kernel::op::Integer;
use whippen_smt::solver::Solver;
use whippen_smt::{Query, Sort, Term, Unbounded, Verdict, ask, check};

use super::Product;

const DIVISORS: [i128; 12] = [
    1,
    3,
    5,
    7,
    10,
    100,
    641,
    1000,
    12_345,
    44_100,
    65_535,
    0x7fff_ffff,
];
const SHIFTS: [u8; 4] = [0, 8, 16, 30];
/// Bits of the largest dividend.
const BITS: [u32; 4] = [8, 16, 24, 31];

fn claim(name: String, product: Product, largest: i128, b: i128, n: u8) -> Query {
    Term::forget_all();
    let number = Unbounded::of;
    let a = Unbounded(Term::free("a", Sort::Integer));
    let Product { m, c, s } = product;
    let found = (a * number(m) + number(c)) >> number(s.into());
    let wanted = Op::DivRound(n).exact([a, number(b), number(0)]);
    let same = wanted.expect("a quotient").0.equals(found.0);
    let is_inside = number(-largest).at_most(a).and(a.at_most(number(largest)));
    Query::new(name, &[is_inside], same)
}

/// A product whose rounding is half a unit less.
#[test]
fn another_product_is_refuted_with_a_dividend() {
    let Some(solvers) = Solver::all() else { return };
    let mut product = Product::of(1000, 7, 0).expect("a product");
    product.c -= 1 << (product.s - 1);
    let answer = ask(&solvers, &claim("fault".into(), product, 1000, 7, 0), 20);
    assert_eq!(answer.verdict, Verdict::Refuted, "{answer:?}");
    assert!(answer.numbers.contains("(a "), "{answer:?}");
}

#[test]
fn products_are_quotients_of_every_dividend() {
    let mut queries = Vec::new();
    for b in DIVISORS {
        for n in SHIFTS {
            for bits in BITS {
                let largest = (1 << bits) - 1;
                if let Some(product) = Product::of(largest, b, n) {
                    let name = format!("by_{b}/shift_{n}/bits_{bits}");
                    queries.push(claim(name, product, largest, b, n));
                }
            }
        }
    }
    assert!(queries.len() > 100, "{}", queries.len());
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("src/partial_eval/divide");
    check(&folder.join("proven.txt"), &queries);
}
