//! Terms of SMT-LIB: truths, integers and words of so many bits, each kept once.
//!
//! What is made of numbers alone is a number. All terms of a thread lie in one place, so a term is
//! small and can be copied; a term is made of terms with smaller numbers.

use std::cell::RefCell;
use std::collections::HashMap;

use crate::fold::folded;

/// A term, by its number.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Term(u32);

/// What a term is about.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Sort {
    /// True or false.
    Truth,
    /// An integer without bounds.
    Integer,
    /// A word of so many bits, at most 128 where it is a number.
    Word(u32),
}

/// What a term is.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub enum Head {
    /// Anything of its sort, by a name.
    Free(String),
    /// A number: of a word its bits, of a truth 0 or 1.
    Number(i128),
    /// A function of SMT-LIB.
    Apply(&'static str),
    /// Bits of a word, both ends counted.
    Extract(u32, u32),
    /// So many copies of the sign before it.
    SignExtend(u32),
    /// So many zeros before it.
    ZeroExtend(u32),
}

/// A term and what it is made of.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct Node {
    /// What it is about.
    pub sort: Sort,
    /// What it is.
    pub head: Head,
    /// What it is made of.
    pub args: Vec<Term>,
}

#[derive(Default)]
struct Terms {
    nodes: Vec<Node>,
    known: HashMap<Node, Term>,
    /// By a free term: what is asked of it wherever it stands.
    defined: HashMap<Term, Term>,
    fresh: u32,
}

thread_local! {
    static TERMS: RefCell<Terms> = RefCell::default();
}

/// The number without the bits beyond a word's.
pub(crate) fn masked(number: i128, bits: u32) -> i128 {
    if bits >= 128 {
        number
    } else {
        number & ((1 << bits) - 1)
    }
}

/// The signed number of a word's bits.
pub(crate) fn signed(number: i128, bits: u32) -> i128 {
    let up = 128 - bits.min(128);
    number << up >> up
}

impl Term {
    fn of(sort: Sort, head: Head, args: Vec<Term>) -> Term {
        let node = Node { sort, head, args };
        TERMS.with_borrow_mut(|terms| {
            if let Some(term) = terms.known.get(&node) {
                return *term;
            }
            let term = Term(terms.nodes.len() as u32);
            terms.nodes.push(node.clone());
            terms.known.insert(node, term);
            term
        })
    }

    /// What it is made of.
    pub fn node(self) -> Node {
        TERMS.with_borrow(|terms| terms.nodes[self.0 as usize].clone())
    }

    /// What it is about.
    pub fn sort(self) -> Sort {
        TERMS.with_borrow(|terms| terms.nodes[self.0 as usize].sort)
    }

    /// The number, if it is one.
    pub fn number(self) -> Option<i128> {
        TERMS.with_borrow(|terms| match terms.nodes[self.0 as usize].head {
            Head::Number(number) => Some(number),
            _ => None,
        })
    }

    /// The width of a word.
    ///
    /// # Panics
    ///
    /// It is none.
    pub fn bits(self) -> u32 {
        match self.sort() {
            Sort::Word(bits) => bits,
            sort => panic!("{sort:?} is no word"),
        }
    }

    /// A truth that is known.
    pub fn truth(holds: bool) -> Term {
        Term::of(Sort::Truth, Head::Number(holds.into()), Vec::new())
    }

    /// An integer that is known.
    pub fn integer(number: i128) -> Term {
        Term::of(Sort::Integer, Head::Number(number), Vec::new())
    }

    /// A word that is known, from the low bits of a number.
    pub fn word(number: i128, bits: u32) -> Term {
        assert!((1..=128).contains(&bits), "{bits} bits");
        let number = masked(number, bits);
        Term::of(Sort::Word(bits), Head::Number(number), Vec::new())
    }

    /// Anything of a sort, by a name.
    pub fn free(name: &str, sort: Sort) -> Term {
        Term::of(sort, Head::Free(name.to_string()), Vec::new())
    }

    /// Anything of a sort of which something holds, with a name of its own.
    pub fn such_that(what: &str, sort: Sort, holds: impl FnOnce(Term) -> Term) -> Term {
        let number = TERMS.with_borrow_mut(|terms| {
            terms.fresh += 1;
            terms.fresh
        });
        let own = Term::free(&format!("{what}.{number}"), sort);
        let holds = holds(own);
        TERMS.with_borrow_mut(|terms| terms.defined.insert(own, holds));
        own
    }

    /// What holds of a term wherever it stands.
    pub fn definition(self) -> Option<Term> {
        TERMS.with_borrow(|terms| terms.defined.get(&self).copied())
    }

    /// Forgets every term of this thread, so that the next ones are numbered from the beginning.
    pub fn forget_all() {
        TERMS.with_borrow_mut(|terms| *terms = Terms::default());
    }

    /// A function of SMT-LIB.
    pub fn apply(name: &'static str, args: &[Term]) -> Term {
        let first = args[0].sort();
        let sort = match name {
            "=" | "<" | "<=" | "bvult" | "bvule" | "bvslt" | "bvsle" | "and" | "or" | "not" => {
                Sort::Truth
            }
            "ite" => args[1].sort(),
            "concat" => Sort::Word(args.iter().map(|arg| arg.bits()).sum()),
            _ => first,
        };
        let alike = match name {
            "concat" => &[],
            "ite" => &args[1..],
            _ => args,
        };
        for arg in alike {
            assert_eq!(arg.sort(), alike[0].sort(), "operands of `{name}`");
        }
        Term::folded(sort, Head::Apply(name), args.to_vec())
    }

    fn folded(sort: Sort, head: Head, args: Vec<Term>) -> Term {
        let node = Node { sort, head, args };
        match folded(&node) {
            Some(term) => term,
            None => Term::of(node.sort, node.head, node.args),
        }
    }

    /// The bits `low ..= high` of a word.
    pub fn extract(self, high: u32, low: u32) -> Term {
        let bits = self.bits();
        assert!(low <= high && high < bits, "bits {high}:{low} of {bits}");
        if (high, low) == (bits - 1, 0) {
            return self;
        }
        let node = self.node();
        match (&node.head, &node.args[..]) {
            (Head::Apply("concat"), [upper, lower]) => {
                let below = lower.bits();
                if high < below {
                    return lower.extract(high, low);
                }
                if low >= below {
                    return upper.extract(high - below, low - below);
                }
            }
            (Head::Extract(_, from), [inner]) => return inner.extract(high + from, low + from),
            (Head::SignExtend(_) | Head::ZeroExtend(_), [inner]) if high < inner.bits() => {
                return inner.extract(high, low);
            }
            _ => {}
        }
        let head = Head::Extract(high, low);
        Term::folded(Sort::Word(high - low + 1), head, vec![self])
    }

    /// The word with the low bits of this one, or with more, of which the sign fills the upper
    /// ones.
    pub fn resized(self, bits: u32) -> Term {
        let own = self.bits();
        match bits.checked_sub(own) {
            None => self.extract(bits - 1, 0),
            Some(0) => self,
            Some(more) => Term::folded(Sort::Word(bits), Head::SignExtend(more), vec![self]),
        }
    }

    /// The word with zeros before it, of so many bits.
    pub fn widened(self, bits: u32) -> Term {
        match bits - self.bits() {
            0 => self,
            more => Term::folded(Sort::Word(bits), Head::ZeroExtend(more), vec![self]),
        }
    }

    /// This word before the lower bits of another one.
    pub fn concat(self, lower: Term) -> Term {
        let (upper, below) = (self.node(), lower.node());
        if let (Head::Extract(high, middle), Head::Extract(end, low)) = (&upper.head, &below.head)
            && upper.args == below.args
            && *middle == end + 1
        {
            return upper.args[0].extract(*high, *low);
        }
        Term::apply("concat", &[self, lower])
    }

    /// Whether both are equal.
    pub fn equals(self, other: Term) -> Term {
        Term::apply("=", &[self, other])
    }

    /// The first where it holds, else the second.
    pub fn choose(self, yes: Term, no: Term) -> Term {
        Term::apply("ite", &[self, yes, no])
    }

    /// The other truth.
    pub fn negated(self) -> Term {
        Term::apply("not", &[self])
    }

    /// Whether both hold.
    pub fn and(self, other: Term) -> Term {
        Term::apply("and", &[self, other])
    }

    /// Whether one of both holds.
    pub fn or(self, other: Term) -> Term {
        Term::apply("or", &[self, other])
    }

    /// Whether all hold.
    pub fn all(terms: impl IntoIterator<Item = Term>) -> Term {
        terms.into_iter().fold(Term::truth(true), Term::and)
    }

    /// A truth as a word of one bit.
    pub fn as_bit(self) -> Term {
        self.choose(Term::word(1, 1), Term::word(0, 1))
    }

    /// How many zeros a word begins with, as a word of the same width.
    pub fn leading_zeros(self) -> Term {
        let bits = self.bits();
        let at = |bit: u32| self.extract(bit, bit).equals(Term::word(1, 1));
        (0..bits).fold(Term::word(bits.into(), bits), |below, bit| {
            at(bit).choose(Term::word((bits - 1 - bit).into(), bits), below)
        })
    }
}
