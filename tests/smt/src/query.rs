//! A claim as the text of a query.

use std::collections::BTreeSet;
use std::fmt::Write as _;

use crate::term::{Head, Sort, Term};

/// Before the opposite of the claim.
const CLAIM: &str = "; the opposite of the claim\n";

/// That a claim holds wherever what is assumed does.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Query {
    /// A name without blanks, by which its answer is kept.
    pub name: String,
    /// The text in SMT-LIB 2: it is unsatisfiable where the claim holds.
    pub text: String,
}

impl Query {
    /// The claim as text.
    pub fn new(name: impl Into<String>, assumed: &[Term], claim: Term) -> Query {
        let opposite = claim.negated();
        let mut asserted = assumed.to_vec();
        asserted.push(opposite);
        let mut used = BTreeSet::new();
        let mut left = asserted.clone();
        while let Some(term) = left.pop() {
            if used.insert(term) {
                left.extend(term.node().args);
                if let Some(definition) = term.definition() {
                    asserted.push(definition);
                    left.push(definition);
                }
            }
        }
        let of_integers = used.iter().any(|term| term.sort() == Sort::Integer);
        let logic = if of_integers { "QF_NIA" } else { "QF_BV" };
        let mut text = format!("(set-logic {logic})\n");
        for term in &used {
            let node = term.node();
            match &node.head {
                Head::Number(_) => {}
                Head::Free(name) => {
                    let _ = writeln!(text, "(declare-const {name} {})", sort(node.sort));
                }
                _ => {
                    let (own, body) = (shown(&used, *term), body(&used, *term));
                    let _ = writeln!(text, "(define-fun {own} () {} {body})", sort(node.sort));
                }
            }
        }
        for term in asserted {
            let text_of = shown(&used, term);
            let _ = match term == opposite {
                true => writeln!(text, "{CLAIM}(assert {text_of})"),
                false => writeln!(text, "(assert {text_of})"),
            };
        }
        let name = name.into();
        text += "(check-sat)\n";
        Query { name, text }
    }

    /// The same query without the claim: where it is unsatisfiable nothing is said by the claim.
    pub fn premises(&self) -> Query {
        let (before, claim) = self.text.split_once(CLAIM).unwrap_or((&self.text, "\n"));
        let after = claim.split_once('\n').map_or("", |(_, after)| after);
        Query {
            name: format!("the premises of {}", self.name),
            text: format!("{before}{after}"),
        }
    }

    /// A claim that cannot be put into a query, and why.
    pub fn unasked(name: impl Into<String>, why: &str) -> Query {
        let name = name.into();
        let text = format!("; {why}\n");
        Query { name, text }
    }

    /// Why it is no query, if it is none.
    pub fn why_unasked(&self) -> Option<&str> {
        self.text.strip_prefix("; ").map(str::trim_end)
    }

    /// The names of what is free in it.
    pub fn free(&self) -> Vec<&str> {
        let declared = self.text.lines().filter_map(|line| {
            let rest = line.strip_prefix("(declare-const ")?;
            rest.split(' ').next()
        });
        declared.collect()
    }
}

fn sort(sort: Sort) -> String {
    match sort {
        Sort::Truth => "Bool".to_string(),
        Sort::Integer => "Int".to_string(),
        Sort::Word(bits) => format!("(_ BitVec {bits})"),
    }
}

/// How a term is named where another one is made of it: by its place among those that are used.
fn shown(used: &BTreeSet<Term>, term: Term) -> String {
    let node = term.node();
    match (&node.head, node.sort) {
        (Head::Free(name), _) => name.clone(),
        (Head::Number(number), Sort::Truth) => (*number == 1).to_string(),
        (Head::Number(number), Sort::Integer) if *number < 0 => {
            format!("(- {})", number.unsigned_abs())
        }
        (Head::Number(number), Sort::Integer) => number.to_string(),
        (Head::Number(number), Sort::Word(bits)) => format!("(_ bv{} {bits})", *number as u128),
        _ => format!("t{}", used.range(..term).count()),
    }
}

fn body(used: &BTreeSet<Term>, term: Term) -> String {
    let node = term.node();
    let function = match &node.head {
        Head::Apply(name) => (*name).to_string(),
        Head::Extract(high, low) => format!("(_ extract {high} {low})"),
        Head::SignExtend(by) => format!("(_ sign_extend {by})"),
        Head::ZeroExtend(by) => format!("(_ zero_extend {by})"),
        Head::Number(_) | Head::Free(_) => return shown(used, term),
    };
    let args: Vec<String> = node.args.iter().map(|arg| shown(used, *arg)).collect();
    format!("({function} {})", args.join(" "))
}
