//! What a term of numbers is, and what is simpler whatever the numbers are.

use crate::term::{Head, Node, Sort, Term, masked, signed};

/// The simpler term, if there is one.
pub(crate) fn folded(node: &Node) -> Option<Term> {
    by_shape(node).or_else(|| by_numbers(node))
}

/// What holds for all numbers.
fn by_shape(node: &Node) -> Option<Term> {
    let Head::Apply(name) = node.head else {
        return None;
    };
    let known = |at: usize| node.args.get(at).and_then(|arg| arg.number());
    match (name, &node.args[..]) {
        ("=", [a, b]) if a == b => Some(Term::truth(true)),
        ("ite", [_, yes, no]) if yes == no => Some(*yes),
        ("ite", [_, yes, no]) => known(0).map(|holds| if holds == 1 { *yes } else { *no }),
        ("and" | "or", [a, b]) => {
            let neutral = i128::from(name == "and");
            match (known(0), known(1)) {
                _ if a == b => Some(*a),
                (Some(own), _) => Some(if own == neutral { *b } else { *a }),
                (_, Some(own)) => Some(if own == neutral { *a } else { *b }),
                _ => None,
            }
        }
        ("not", [a]) => match (a.node().head, a.node().args.first()) {
            (Head::Apply("not"), Some(inner)) => Some(*inner),
            _ => None,
        },
        ("bvadd" | "bvor" | "bvxor", [a, b]) => match (known(0), known(1)) {
            (Some(0), _) => Some(*b),
            (_, Some(0)) => Some(*a),
            _ => None,
        },
        ("bvsub" | "bvshl" | "bvlshr" | "bvashr", [a, _]) if known(1) == Some(0) => Some(*a),
        _ => None,
    }
}

/// What is made of numbers alone.
fn by_numbers(node: &Node) -> Option<Term> {
    let numbers: Option<Vec<i128>> = node.args.iter().map(|arg| arg.number()).collect();
    let numbers = numbers?;
    let first = node.args.first()?.sort();
    let number = match (&node.head, first) {
        (Head::Apply("concat"), _) => {
            let below = node.args[1].bits();
            (numbers[0] << below) | numbers[1]
        }
        (Head::Extract(_, low), _) => numbers[0] >> low,
        (Head::SignExtend(_), Sort::Word(bits)) => signed(numbers[0], bits),
        (Head::ZeroExtend(_), _) => numbers[0],
        (Head::Apply(name), Sort::Word(bits)) if bits < 128 => of_words(name, bits, &numbers)?,
        (Head::Apply(name), Sort::Integer) => of_integers(name, &numbers)?,
        (Head::Apply("not"), Sort::Truth) => 1 - numbers[0],
        (Head::Apply("="), Sort::Truth) => (numbers[0] == numbers[1]).into(),
        _ => return None,
    };
    Some(match node.sort {
        Sort::Truth => Term::truth(number == 1),
        Sort::Integer => Term::integer(number),
        Sort::Word(bits) if bits < 128 => Term::word(number, bits),
        Sort::Word(_) => return None,
    })
}

fn of_words(name: &str, bits: u32, numbers: &[i128]) -> Option<i128> {
    let a = numbers[0];
    let b = *numbers.last()?;
    let (x, y) = (signed(a, bits), signed(b, bits));
    let by = u32::try_from(b).ok().filter(|by| *by < bits);
    Some(match name {
        "bvadd" => a + b,
        "bvsub" => a - b,
        "bvmul" if bits <= 64 => masked(x.wrapping_mul(y), bits),
        "bvand" => a & b,
        "bvor" => a | b,
        "bvxor" => a ^ b,
        "bvnot" => !a,
        "bvneg" => -a,
        "bvshl" => by.map_or(0, |by| a << by),
        "bvlshr" => by.map_or(0, |by| a >> by),
        "bvashr" => x >> by.unwrap_or(bits - 1),
        "bvudiv" if b != 0 => a / b,
        "bvurem" if b != 0 => a % b,
        "bvsdiv" if b != 0 => x / y,
        "bvsrem" if b != 0 => x % y,
        "=" => (a == b).into(),
        "bvult" => (a < b).into(),
        "bvule" => (a <= b).into(),
        "bvslt" => (x < y).into(),
        "bvsle" => (x <= y).into(),
        _ => return None,
    })
}

fn of_integers(name: &str, numbers: &[i128]) -> Option<i128> {
    let (a, b) = (numbers[0], *numbers.last()?);
    match name {
        "+" => a.checked_add(b),
        "-" => a.checked_sub(b),
        "*" => a.checked_mul(b),
        "div" if b > 0 => Some(a.div_euclid(b)),
        "=" => Some((a == b).into()),
        "<" => Some((a < b).into()),
        "<=" => Some((a <= b).into()),
        _ => None,
    }
}
