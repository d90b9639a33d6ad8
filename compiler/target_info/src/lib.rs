//! Target description: what the operators of a Kernel are to Thumb code, one row for each.
//!
//! | column | who asks |
//! | --- | --- |
//! | cycles | `whippen-modes`, to compare one way of making code with another |
//! | selected | instruction selection, which emits an operator in place, at its user or anew |
//! | at entry | the motion of tick invariants to the entry of a tick |
//!
//! It is a table of its own, and not columns of the Kernel's table of operators, because a Kernel
//! is for any machine: there stands what holds on all of them (meaning, effect, interval, and
//! whether keys share a result), here what depends on the instructions of one. It lies below
//! specialization, which asks for cycles before there is any code, and below the back end, which
//! asks for the rest. [`row`] matches every operator by name, so whoever adds one is asked by the
//! compiler for its row.
//!
//! Not here: the exact cycles of instructions (`whippen-isa`), and which instructions compute an
//! operator (`whippen-arm`).

use whippen_kernel::Op;

/// Cycles of a decision: compare, branch.
pub const BRANCH_CYCLES: u32 = 2;

/// Constants up to this are part of instructions; others are loaded.
pub const IMMEDIATE_MAX: u64 = 4095;

/// Where selection emits what computes an operator.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Selected {
    /// Where the operator stands.
    InPlace,
    /// At its only user, if possible as a part of that; in place where it has several users.
    AtOnlyUser,
    /// Wherever its outcome decides, because flags are cheaper than a 0 or 1 in a register.
    AtDecisions,
    /// At the store of a cell that may keep its old word instead; in place where there is none.
    AtStore,
    /// With its operand: it is another name for that, or for a part of it.
    WithOperand,
    /// In each block that uses it, because the word is in memory anyway.
    Reload,
}

/// Where an operator is computed whose operands are the same for all keys.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum AtEntry {
    /// Once a tick, at its entry: it costs more than to load its result.
    Hoisted,
    /// At each key: it costs no more than that load, or cannot be moved.
    Stays,
}

/// What an operator is to the target.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Row {
    /// Rough cycles on a Cortex-M33, on words and on 64 bits. What instructions do besides (a
    /// product's upper word, an accumulator) is free, and operands are assumed to be there in
    /// time.
    pub cycles: [u32; 2],
    /// Where it is emitted.
    pub selected: Selected,
    /// Where it is computed if all keys share it.
    pub at_entry: AtEntry,
}

const fn new(cycles: [u32; 2], selected: Selected, at_entry: AtEntry) -> Row {
    Row {
        cycles,
        selected,
        at_entry,
    }
}

/// The row of an operator.
pub const fn row(op: Op) -> Row {
    use AtEntry::{Hoisted, Stays};
    use Selected::{AtDecisions, AtOnlyUser, AtStore, InPlace, Reload, WithOperand};
    match op {
        Op::Const(_) => new([0, 0], InPlace, Stays),
        Op::Add | Op::Sub => new([1, 2], InPlace, Hoisted),
        Op::Mul => new([1, 3], AtOnlyUser, Hoisted),
        Op::MulWide => new([1, 1], AtOnlyUser, Hoisted),
        Op::MacWide => new([1, 1], InPlace, Hoisted),
        Op::MulTop => new([1, 1], AtOnlyUser, Hoisted),
        Op::MacTop => new([1, 1], InPlace, Hoisted),
        Op::Min | Op::Max => new([2, 4], AtOnlyUser, Hoisted),
        Op::Shl(0) => new([0, 0], AtOnlyUser, Stays),
        Op::Shl(_) => new([1, 2], AtOnlyUser, Stays),
        // The upper word of an accumulator is a register.
        Op::Sar(32) => new([1, 1], AtOnlyUser, Stays),
        Op::Sar(_) => new([1, 2], AtOnlyUser, Stays),
        Op::SarRound(32) => new([2, 1], AtOnlyUser, Stays),
        Op::SarRound(_) => new([2, 2], AtOnlyUser, Stays),
        Op::DivRound(_) => new([40, 40], InPlace, Hoisted),
        Op::Quot(_) => new([16, 16], InPlace, Hoisted),
        Op::Sqrt => new([100, 100], InPlace, Hoisted),
        Op::Widen => new([1, 1], InPlace, Stays),
        Op::Assume(..) => new([0, 0], WithOperand, Stays),
        Op::Narrow | Op::Low => new([0, 0], WithOperand, Stays),
        Op::AddWrap | Op::SubWrap => new([1, 2], InPlace, Hoisted),
        Op::MulWrap => new([1, 3], InPlace, Hoisted),
        Op::AddSat => new([1, 1], InPlace, Hoisted),
        Op::SubSat => new([1, 1], InPlace, Hoisted),
        Op::ShlWrap(_) => new([1, 2], AtOnlyUser, Stays),
        Op::Eq | Op::Lt | Op::Le => new([1, 1], AtDecisions, Stays),
        Op::And | Op::Or => new([1, 1], InPlace, Stays),
        Op::Not => new([1, 1], AtOnlyUser, Stays),
        Op::Select => new([2, 3], AtStore, Hoisted),
        Op::In(_) => new([1, 2], InPlace, Stays),
        Op::Out(_) => new([1, 1], InPlace, Stays),
        Op::Live(_) => new([1, 2], Reload, Stays),
        Op::Tick(0) => new([1, 2], Reload, Stays),
        // A load and a sum.
        Op::Tick(_) => new([1, 2], InPlace, Hoisted),
        Op::Keyed(_) => new([1, 2], Reload, Stays),
        Op::Get(_) => new([1, 2], Reload, Stays),
        Op::Set(_) => new([1, 2], InPlace, Stays),
        Op::GetAt(_) => new([2, 3], InPlace, Stays),
        Op::SetAt(_) => new([2, 3], InPlace, Stays),
        // A call; how many points a string has is not known here.
        Op::Wave(..) => new([500, 500], InPlace, Stays),
        Op::Delay(..) => new([1, 2], InPlace, Stays),
        Op::DelayAt(_) => new([8, 12], InPlace, Stays),
        Op::Push(_) => new([1, 1], InPlace, Stays),
        Op::Fill(_) => new([1, 1], InPlace, Stays),
        Op::Lookup(..) => new([2, 3], InPlace, Hoisted),
        Op::Emit(_) => new([6, 6], InPlace, Stays),
        Op::Probe(_) => new([4, 4], InPlace, Stays),
        Op::If => new([4, 4], InPlace, Stays),
        Op::Loop(_) => new([4, 4], InPlace, Stays),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use whippen_kernel::{Effect, ROWS};

    /// Every operator with small immediates, beside its row of the Kernel's table.
    fn operators() -> Vec<(&'static whippen_kernel::op::Row, Op)> {
        let with = |row: &'static whippen_kernel::op::Row, k: i64| {
            Some((row, (row.make)(&vec![k; row.immediates.len()])?))
        };
        ROWS.iter()
            .flat_map(|row| [0, 1, 32].map(|k| with(row, k)))
            .flatten()
            .collect()
    }

    #[test]
    fn only_what_has_no_effect_is_emitted_elsewhere() {
        for (kernel, op) in operators() {
            let is_read = kernel.effect.is_pure() || kernel.effect == Effect::Reads;
            let in_place = row(op).selected == Selected::InPlace;
            assert!(is_read || in_place, "{}", kernel.name);
        }
    }

    #[test]
    fn what_is_emitted_elsewhere_has_the_operands_that_selection_keeps() {
        for (kernel, op) in operators() {
            let kept = match row(op).selected {
                Selected::InPlace => continue,
                Selected::AtOnlyUser => 1..=2,
                Selected::AtDecisions => 2..=2,
                Selected::AtStore => 3..=3,
                Selected::WithOperand => 1..=1,
                Selected::Reload => 0..=0,
            };
            assert!(kept.contains(&kernel.args.len()), "{}", kernel.name);
        }
    }

    #[test]
    fn what_moves_to_the_entry_is_pure_and_costs_cycles() {
        for (kernel, op) in operators() {
            let Row {
                cycles, at_entry, ..
            } = row(op);
            let may_move = kernel.effect.is_pure() && cycles[0] > 0;
            assert!(may_move || at_entry == AtEntry::Stays, "{}", kernel.name);
        }
    }
}
