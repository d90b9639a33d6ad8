//! Whether two functions with registers do the same: one before the passes that change such code,
//! and the one behind them.
//!
//! ```text
//!   ldr r0, a      r0 = #1 = load a of (STATE, what a holds)          Both functions are run with numbers for contents. Equal
//!   adds r1, r0    r1 = #2 = add of (#1), flags = #3 ..           instructions that find equal numbers leave equal numbers,
//!   str r1, a      a  = #4 = store of (#2, STATE, what a held)        whichever registers they use and wherever they stand.
//! ```
//!
//! Equal must be: flags where a block's end decides by them and, where the code is left, memory,
//! registers with a role, and the address of what follows. A block with several ways in begins
//! with numbers of its own; where one of these counts, all blocks before must leave equal numbers
//! there. Nothing is known of dependences, nor of free registers.

use std::collections::{BTreeMap, BTreeSet, HashMap};

use super::allocate::{Allocated, Fixed, next_key_register};
use super::emit::branch_inst;
use super::minst::{Access, AliasClass, Relocation, Role, Terminator};
use super::registers::{HISTORY, RECORD, SAMPLES, STATE};
use whippen_isa::ShiftType;
use whippen_isa::reg::SP;
use whippen_isa::{Arch, Class, Cond, Flags, Inst, Op};

/// What has a content.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
enum Location {
    Register(u8),
    /// One of [`FLAGS`].
    Flag(usize),
    /// A word of the stack.
    Slot(u32),
    Memory(AliasClass),
    /// A word, by its offset, that only other functions read: to this one it is as good as
    /// constant.
    Result(u32),
}

/// Flags that instructions read.
const FLAGS: [Flags; 5] = [Flags::N, Flags::Z, Flags::C, Flags::V, Flags::GE];

/// What a content is, but for what it was made of.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
enum ValueKey {
    /// What is there where a block begins.
    Start(usize, Location),
    /// A result: of what, and which.
    Result(Operation, ResultPart),
}

/// An instruction without its registers and its encoding; whether it sets the flags is told by
/// these.
type Operation = (
    Op,
    Option<Cond>,
    ShiftType,
    u8,
    u32,
    [bool; 3],
    Option<Relocation>,
);

/// Which result of an instruction.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
enum ResultPart {
    Role(Role),
    Flag(Location),
    Memory,
}

/// Numbers of contents, the same for the same.
#[derive(Default)]
struct ValueNumbers {
    known: HashMap<(ValueKey, Vec<u32>), u32>,
    /// The starts among them that are still to be compared: looking at one may bring up more.
    starts: Vec<(usize, Location)>,
}

/// What is where, as numbers.
#[derive(Clone)]
struct State {
    /// The block with whose start it began.
    from: usize,
    left: BTreeMap<Location, u32>,
}

/// Compares two functions.
///
/// # Errors
/// They differ, or do what the checker does not know; says where.
pub(super) fn validate(before: &Allocated, after: &Allocated, arch: Arch) -> Result<(), String> {
    let ends = |func: &Allocated| {
        func.blocks
            .iter()
            .map(|b| (b.end.clone(), b.rounds))
            .collect::<Vec<_>>()
    };
    if ends(before) != ends(after) || before.slots != after.slots {
        return Err("a pass changed how blocks end, or the stack".to_string());
    }
    let mut predecessors = vec![Vec::new(); before.blocks.len()];
    for (index, block) in before.blocks.iter().enumerate() {
        block
            .end
            .targets()
            .into_iter()
            .for_each(|to| predecessors[to].push(index));
    }
    let mut numbers = ValueNumbers::default();
    let states = [
        numbers.run(before, &predecessors)?,
        numbers.run(after, &predecessors)?,
    ];
    let written: BTreeSet<Location> = states
        .iter()
        .flatten()
        .flat_map(|state| state.left.keys().copied())
        .collect();
    let memory = written
        .into_iter()
        .filter(|at| matches!(at, Location::Memory(_) | Location::Result(_)));
    let outside: Vec<Location> = memory
        .chain([STATE, RECORD, SAMPLES, HISTORY, SP].map(Location::Register))
        .collect();
    let same = |numbers: &mut ValueNumbers, block: usize, at: Location| {
        let [one, other] = states.each_ref().map(|all| numbers.at(&all[block], at));
        (one == other)
            .then_some(())
            .ok_or_else(|| format!("a pass changed what block {block} leaves in {at:?}"))
    };
    for (index, block) in before.blocks.iter().enumerate() {
        let counts: Vec<Location> = match block.end {
            Terminator::Jump(_) => Vec::new(),
            Terminator::Branch { cond, .. } => {
                flag_places(branch_inst(Some(cond), false, 0).flags().reads).collect()
            }
            Terminator::NextKey(_) => outside
                .iter()
                .copied()
                .chain([Location::Register(next_key_register(arch))])
                .collect(),
            Terminator::FallThrough => outside.clone(),
        };
        counts
            .into_iter()
            .try_for_each(|at| same(&mut numbers, index, at))?;
    }
    while let Some((block, at)) = numbers.starts.pop() {
        predecessors[block]
            .iter()
            .try_for_each(|from| same(&mut numbers, *from, at))?;
    }
    Ok(())
}

fn flag_places(of: Flags) -> impl Iterator<Item = Location> {
    (0..FLAGS.len())
        .filter(move |flag| of.intersects(FLAGS[*flag]))
        .map(Location::Flag)
}

impl ValueNumbers {
    fn of(&mut self, name: ValueKey, made_of: Vec<u32>) -> u32 {
        let next = self.known.len() as u32;
        *self.known.entry((name, made_of)).or_insert_with(|| {
            if let ValueKey::Start(block, at) = name {
                self.starts.push((block, at));
            }
            next
        })
    }

    fn at(&mut self, state: &State, at: Location) -> u32 {
        state
            .left
            .get(&at)
            .copied()
            .unwrap_or_else(|| self.of(ValueKey::Start(state.from, at), Vec::new()))
    }

    /// What each block leaves.
    fn run(&mut self, func: &Allocated, predecessors: &[Vec<usize>]) -> Result<Vec<State>, String> {
        let mut states: Vec<State> = Vec::new();
        for (index, block) in func.blocks.iter().enumerate() {
            let mut state = match predecessors[index][..] {
                [from] if from < index => states[from].clone(),
                _ => State {
                    from: index,
                    left: BTreeMap::new(),
                },
            };
            block
                .code
                .iter()
                .try_for_each(|fixed| self.step(&mut state, fixed))?;
            states.push(state);
        }
        Ok(states)
    }

    fn step(&mut self, state: &mut State, fixed: &Fixed) -> Result<(), String> {
        let inst = &fixed.inst;
        let (from, to) = memory_touched(fixed);
        let [reads, writes] = roles_touched(inst)?;
        let found = reads
            .into_iter()
            .map(|(_, at)| at)
            .chain(flag_places(inst.flags().reads))
            .chain(from);
        let found: Vec<u32> = found.map(|at| self.at(state, at)).collect();
        let parts = writes
            .into_iter()
            .map(|(role, at)| (ResultPart::Role(role), at));
        let parts =
            parts.chain(flag_places(inst.flags().writes).map(|at| (ResultPart::Flag(at), at)));
        let parts: Vec<(ResultPart, Location)> =
            parts.chain(to.map(|at| (ResultPart::Memory, at))).collect();
        let address = fixed.code.and_then(|code| code.address);
        let what = (
            inst.op(),
            inst.cond,
            inst.shift,
            inst.amount,
            inst.imm,
            [inst.index, inst.add, inst.wback],
            address,
        );
        for (part, at) in parts {
            let mut made_of = found.clone();
            if part == ResultPart::Memory || inst.is_conditional() {
                // Other words of that memory, and what is skipped, stay.
                made_of.push(self.at(state, at));
            }
            state
                .left
                .insert(at, self.of(ValueKey::Result(what, part), made_of));
        }
        Ok(())
    }
}

/// The roles that an instruction reads, and those that it writes, with their registers.
fn roles_touched(inst: &Inst) -> Result<[Vec<(Role, Location)>; 2], String> {
    let (mut own, mut numbered) = (*inst, *inst);
    Role::ALL
        .into_iter()
        .for_each(|role| *role.of(&mut numbered) = role as u8);
    let mut of = |by_role: u16, all: u16| {
        let roles = Role::ALL
            .into_iter()
            .filter(|role| by_role >> *role as u8 & 1 == 1);
        let roles: Vec<(Role, u8)> = roles.map(|role| (role, *role.of(&mut own))).collect();
        if roles.iter().fold(0, |bits, (_, reg)| bits | 1 << reg) != all {
            return Err(format!(
                "{:?} names registers otherwise than by roles",
                inst.op()
            ));
        }
        Ok(roles
            .into_iter()
            .map(|(role, reg)| (role, Location::Register(reg)))
            .collect())
    };
    let reads = of(numbered.uses().core_bits(), inst.uses().core_bits())?;
    Ok([
        reads,
        of(numbered.defs().core_bits(), inst.defs().core_bits())?,
    ])
}

/// The memory that an instruction reads, and that it writes.
fn memory_touched(fixed: &Fixed) -> (Option<Location>, Option<Location>) {
    let Fixed { inst, code } = fixed;
    match code.map(|code| code.access) {
        Some(Access::None | Access::Read(AliasClass::Constant)) => (None, None),
        Some(Access::Read(place)) => (Some(Location::Memory(place)), None),
        Some(Access::Write(AliasClass::Constant)) => (None, Some(Location::Result(inst.imm))),
        Some(Access::Write(place)) => (None, Some(Location::Memory(place))),
        None if inst.class() == Class::Load => (Some(Location::Slot(inst.imm)), None),
        None if inst.class() == Class::Store => (None, Some(Location::Slot(inst.imm))),
        None => (None, None),
    }
}

#[cfg(test)]
mod tests;
