//! Branches around what a factor of 0 makes nearly constant: a bow that does not press, a contact
//! that is open.
//!
//! ```text
//!   w = min c press          brif w == 0, zero, other
//!   f = mul_top w ..         zero:  the same instructions with a constant 0 in place of w, which
//!   d = add (max 0 f ..) 1          Cranelift folds:  f = 0, d = 1, no division by d
//!   q = quot .. d            other: the instructions as they are
//!   out q                    after: what later instructions read is a parameter of this block
//! ```
//!
//! Both blocks are translations of the same instructions, so there is nothing that could differ:
//! where `w` is 0, a constant 0 is what it is. What only the second needs Cranelift computes there,
//! though it stands before the branch.
//!
//! Not here: keys in lanes, of which some would have to wait for others.

use std::collections::BTreeSet;
use whippen_ids::IdMap;
use whippen_kernel::{Inst, Kernel, Op, Region, Type, Value};

/// How many other instructions a factor has to make 0, so that a branch is worth while.
const ZEROS_MIN: usize = 4;

/// Instructions that are translated twice: for a factor that is 0, and as they are.
#[derive(Debug, PartialEq, Eq)]
pub(super) struct Branch {
    /// The factor.
    pub factor: Value,
    /// Where the instructions stand in their region.
    pub members: Vec<usize>,
    /// The place that they are translated before: of the first other instruction that reads one.
    pub before: usize,
    /// What other instructions read of them.
    pub results: Vec<Value>,
    /// What the results need where the factor is 0, in order.
    pub where_zero: Vec<WhereZero>,
}

/// What becomes of an instruction where the factor is 0.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum WhereZero {
    /// The instruction at a place, as it is.
    Same(usize),
    /// A value is 0.
    Zero(Value),
    /// A value is another.
    Copy(Value, Value),
}

/// The branches of a region: around pure instructions that read one factor and that no other
/// factor has a part in, a division among them.
pub(super) fn branches(kernel: &Kernel, region: &Region) -> Vec<Branch> {
    let divides = |inst: &Inst| matches!(inst.op, Op::Quot(_) | Op::DivRound(_));
    if !region.insts.iter().any(divides) {
        return Vec::new();
    }
    let mut parts = Parts {
        of: IdMap::filled(Part::None, kernel.values.len()),
        end: region.insts.len(),
        open: Vec::new(),
        closed: Vec::new(),
    };
    let factors = factors(kernel, region);
    for (place, inst) in region.insts.iter().enumerate() {
        parts.take(place, inst, &factors);
    }
    let mut branches = parts.closed;
    branches.extend(parts.open.into_iter().flatten());
    branches.retain(|branch| {
        let mut members = branch.members.iter();
        members.any(|place| divides(&region.insts[*place]))
    });
    for branch in &mut branches {
        branch.results = results(region, &branch.members);
        branch.where_zero = where_zero(kernel, region, branch);
    }
    branches
}

/// Values of a region that make many others 0 where they are 0, and that are never less; of those
/// that make each other 0 the one that makes the most.
fn factors(kernel: &Kernel, region: &Region) -> Vec<Value> {
    let mut read = IdMap::filled(0, kernel.values.len());
    for value in region.insts.iter().flat_map(|inst| &inst.args) {
        read[value] += 1;
    }
    let mut found: Vec<(usize, Value, IdMap<Value, bool>)> = Vec::new();
    for (place, inst) in region.insts.iter().enumerate() {
        let [value] = inst.results[..] else { continue };
        let known = &kernel.values[value];
        if known.ty == Type::I32 && known.range.low == 0 && known.range.high > 0 && read[value] > 1
        {
            let (count, zeros) = zeros(kernel, value, &region.insts[place + 1..]);
            if count >= ZEROS_MIN {
                found.push((count, value, zeros));
            }
        }
    }
    found.sort_by_key(|(count, ..)| std::cmp::Reverse(*count));
    let mut chosen: Vec<(Value, IdMap<Value, bool>)> = Vec::new();
    for (_, value, zeros) in found {
        if chosen
            .iter()
            .all(|(other, theirs)| !theirs[value] && !zeros[*other])
        {
            chosen.push((value, zeros));
        }
    }
    chosen.into_iter().map(|(value, _)| value).collect()
}

/// How many results of instructions are 0 where a value is, and which.
fn zeros(kernel: &Kernel, value: Value, insts: &[Inst]) -> (usize, IdMap<Value, bool>) {
    let mut zeros = IdMap::filled(false, kernel.values.len());
    zeros[value] = true;
    let mut count = 0;
    for inst in insts {
        let args: Vec<bool> = inst.args.iter().map(|arg| zeros[*arg]).collect();
        let is_zero = match (inst.op, &args[..]) {
            (Op::Mul | Op::MulWide | Op::MulTop | Op::MulWrap, [a, b]) => *a || *b,
            (Op::MacTop | Op::MacWide, [a, b, c]) => *a && (*b || *c),
            (Op::Add | Op::Sub, [a, b]) => *a && *b,
            (Op::Shl(_) | Op::ShlWrap(_) | Op::Sar(_) | Op::SarRound(_), [a]) => *a,
            (Op::Widen | Op::Narrow | Op::Low | Op::Assume(..), [a]) => *a,
            _ => false,
        };
        if is_zero {
            zeros[inst.results[0]] = true;
            count += 1;
        }
    }
    (count, zeros)
}

/// What the results of a branch need where its factor is 0.
fn where_zero(kernel: &Kernel, region: &Region, branch: &Branch) -> Vec<WhereZero> {
    let members: Vec<Inst> = branch
        .members
        .iter()
        .map(|place| region.insts[*place].clone())
        .collect();
    let (_, zeros) = zeros(kernel, branch.factor, &members);
    let mut needed = IdMap::filled(false, kernel.values.len());
    for result in &branch.results {
        needed[result] = true;
    }
    let mut found = Vec::new();
    for (place, inst) in branch.members.iter().zip(&members).rev() {
        let result = inst.results[0];
        if !needed[result] {
            continue;
        }
        let args: Vec<(bool, Value)> = inst.args.iter().map(|arg| (zeros[*arg], *arg)).collect();
        let same = match (inst.op, &args[..]) {
            (Op::MacTop | Op::MacWide, [(_, a), (b, _), (c, _)]) if *b || *c => Some(*a),
            (Op::Add | Op::Sub, [(_, a), (true, _)]) | (Op::Add, [(true, _), (_, a)]) => Some(*a),
            _ => None,
        };
        let (one, reads) = match same {
            _ if zeros[result] => (WhereZero::Zero(result), Vec::new()),
            Some(same) => (WhereZero::Copy(result, same), vec![same]),
            None => (WhereZero::Same(*place), inst.args.clone()),
        };
        for value in reads {
            needed[value] = true;
        }
        found.push(one);
    }
    found.reverse();
    found
}

/// Which factors have a part in a value.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Part {
    None,
    One(usize),
    Several,
}

impl Part {
    fn and(self, other: Part) -> Part {
        match (self, other) {
            (Part::None, part) | (part, Part::None) => part,
            (Part::One(a), Part::One(b)) if a == b => self,
            _ => Part::Several,
        }
    }
}

/// Branches on the way through a region.
struct Parts {
    of: IdMap<Value, Part>,
    /// The end of the region, before which a branch stands that no other instruction reads.
    end: usize,
    /// By number; none: another instruction reads a result, so nothing is added.
    open: Vec<Option<Branch>>,
    closed: Vec<Branch>,
}

impl Parts {
    fn take(&mut self, place: usize, inst: &Inst, factors: &[Value]) {
        let reads: Vec<Value> = reads(inst).collect();
        let mut part = reads
            .iter()
            .fold(Part::None, |part, value| part.and(self.of[value]));
        let open = match part {
            Part::One(number) if inst.op.row().effect.is_pure() => self.open[number].as_mut(),
            _ => None,
        };
        match open {
            Some(branch) => branch.members.push(place),
            None => self.close(place, &reads),
        }
        if part == Part::None && inst.results.iter().any(|value| factors.contains(value)) {
            part = Part::One(self.open.len());
            self.open.push(Some(Branch {
                factor: inst.results[0],
                members: Vec::new(),
                before: self.end,
                results: Vec::new(),
                where_zero: Vec::new(),
            }));
        }
        for result in &inst.results {
            self.of[result] = part;
        }
    }

    /// Ends the branches of which an instruction that is in none reads a result.
    fn close(&mut self, place: usize, reads: &[Value]) {
        for value in reads {
            let Part::One(number) = self.of[value] else {
                continue;
            };
            let is_factor = |branch: &Branch| branch.factor == *value;
            if self.open[number]
                .as_ref()
                .is_some_and(|branch| !is_factor(branch))
            {
                let branch = self.open[number].take();
                self.closed.extend(branch.map(|branch| Branch {
                    before: place,
                    ..branch
                }));
            }
        }
    }
}

/// What an instruction reads, and what those inside it do.
pub(super) fn reads(inst: &Inst) -> impl Iterator<Item = Value> + '_ {
    inst.all_insts().flat_map(|inst| {
        let yields = inst.regions.iter().flat_map(|region| &region.yields);
        inst.args.iter().chain(yields).copied()
    })
}

/// What others read of the instructions at some places of a region, in their order.
pub(super) fn results(region: &Region, members: &[usize]) -> Vec<Value> {
    let others = region.insts.iter().enumerate();
    let others = others.filter(|(place, _)| members.binary_search(place).is_err());
    let read: BTreeSet<Value> = others
        .flat_map(|(_, inst)| reads(inst))
        .chain(region.yields.iter().copied())
        .collect();
    let all = members
        .iter()
        .flat_map(|place| &region.insts[*place].results);
    all.copied().filter(|value| read.contains(value)).collect()
}

#[cfg(test)]
mod tests;
