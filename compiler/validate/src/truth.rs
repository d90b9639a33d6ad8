//! Truth of comparisons: reduced ordered binary decision diagrams, whose variables are `term >= k`.

use rustc_hash::FxHashMap;

use crate::term::Term;

/// A diagram, kept once.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub(crate) struct Truth(u32);

impl Truth {
    pub const NO: Truth = Truth(0);
    pub const YES: Truth = Truth(1);

    pub fn of(holds: bool) -> Truth {
        if holds { Truth::YES } else { Truth::NO }
    }

    /// Whether it holds, if that is settled.
    pub fn settled(self) -> Option<bool> {
        (self.0 < 2).then_some(self == Truth::YES)
    }
}

/// `primitive >= least`
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(crate) struct Variable {
    pub primitive: Term,
    pub least: i128,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
struct Node {
    variable: u32,
    yes: Truth,
    no: Truth,
}

/// All diagrams.
#[derive(Clone, Default)]
pub(crate) struct Truths {
    variables: Vec<Variable>,
    numbers: FxHashMap<Variable, u32>,
    nodes: Vec<Node>,
    known: FxHashMap<Node, Truth>,
    chosen: FxHashMap<[Truth; 3], Truth>,
}

impl Truths {
    pub fn variable(&mut self, variable: Variable) -> Truth {
        let next = self.variables.len() as u32;
        let number = *self.numbers.entry(variable).or_insert(next);
        if number == next {
            self.variables.push(variable);
        }
        self.node(Node {
            variable: number,
            yes: Truth::YES,
            no: Truth::NO,
        })
    }

    fn node(&mut self, node: Node) -> Truth {
        if node.yes == node.no {
            return node.yes;
        }
        let next = Truth(self.nodes.len() as u32 + 2);
        let truth = *self.known.entry(node).or_insert(next);
        if truth == next {
            self.nodes.push(node);
        }
        truth
    }

    fn get(&self, truth: Truth) -> Option<Node> {
        self.nodes.get((truth.0 as usize).checked_sub(2)?).copied()
    }

    /// What it asks first, with what it is in either case; none where it is settled.
    pub fn split(&self, truth: Truth) -> Option<(Variable, Truth, Truth)> {
        let node = self.get(truth)?;
        Some((self.variables[node.variable as usize], node.yes, node.no))
    }

    /// `c ? a : b`
    pub fn choose(&mut self, c: Truth, a: Truth, b: Truth) -> Truth {
        match c.settled() {
            Some(true) => return a,
            Some(false) => return b,
            None if a == b => return a,
            None if (a, b) == (Truth::YES, Truth::NO) => return c,
            None => {}
        }
        if let Some(known) = self.chosen.get(&[c, a, b]) {
            return *known;
        }
        let all = [c, a, b];
        let tops = all.iter().filter_map(|truth| self.get(*truth));
        let variable = tops.map(|node| node.variable).min().unwrap_or_default();
        let side = |truths: &Truths, yes: bool| {
            all.map(|truth| match truths.get(truth) {
                Some(node) if node.variable == variable => {
                    if yes {
                        node.yes
                    } else {
                        node.no
                    }
                }
                _ => truth,
            })
        };
        let ([c1, a1, b1], [c0, a0, b0]) = (side(self, true), side(self, false));
        let yes = self.choose(c1, a1, b1);
        let no = self.choose(c0, a0, b0);
        let result = self.node(Node { variable, yes, no });
        self.chosen.insert(all, result);
        result
    }

    pub fn not(&mut self, a: Truth) -> Truth {
        self.choose(a, Truth::NO, Truth::YES)
    }

    pub fn and(&mut self, a: Truth, b: Truth) -> Truth {
        self.choose(a, b, Truth::NO)
    }

    pub fn or(&mut self, a: Truth, b: Truth) -> Truth {
        self.choose(a, Truth::YES, b)
    }
}
