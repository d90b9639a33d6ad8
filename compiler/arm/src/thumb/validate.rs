//! Translation validation by value numbering: whether a function computes the same before and after
//! passes that move or rename instructions.
//!
//! ```text
//!   ldr r0, a      r0 = #1 = load a of (STATE, what a holds)
//!   adds r1, r0    r1 = #2 = add of (#1), flags = #3 ..
//!   str r1, a      a  = #4 = store of (#2, STATE, what a held)
//! ```
//!
//! Both functions are run with numbers for contents: instructions that find equal numbers leave
//! equal numbers, whichever registers they use and wherever they stand. It serves the scheduler,
//! with virtual registers, and the passes after allocation.
//!
//! Equal must be: flags where a block's end decides by them, what it reads (arguments, the address
//! of what follows), and, where the code is left, memory and the registers with a role. A block
//! with several predecessors begins with numbers of its own; where one of these counts, all
//! predecessors must leave equal numbers there. Nothing is known of dependences, nor of liveness.

use std::collections::{BTreeMap, BTreeSet, HashMap};

use super::emit::branch_inst;
use super::func::{BlockId, Func, Terminator};
use super::minst::{Access, AliasClass, MInst, Register, Relocation, Role};
use super::registers::{HISTORY, RECORD, SAMPLES, STATE};
use whippen_ids::IdMap;
use whippen_isa::ShiftType;
use whippen_isa::reg::SP;
use whippen_isa::{Cond, Flags, Op};

/// What has a content.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
enum Location<R> {
    Register(R),
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
enum ValueKey<R> {
    /// What is there where a block begins.
    Start(BlockId, Location<R>),
    /// A result: of what, and which.
    Result(Operation, ResultPart<R>),
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
enum ResultPart<R> {
    Role(Role),
    Flag(Location<R>),
    Memory,
    /// What a call leaves in a register that it does not keep.
    Lost(Location<R>),
}

/// Numbers of contents, the same for the same.
struct ValueNumbers<R> {
    known: HashMap<(ValueKey<R>, Vec<u32>), u32>,
    /// The starts among them that are still to be compared: looking at one may bring up more.
    starts: Vec<(BlockId, Location<R>)>,
}

/// What is where, as numbers.
#[derive(Clone)]
struct BlockState<R> {
    /// The block with whose start it began.
    from: BlockId,
    left: BTreeMap<Location<R>, u32>,
}

/// Compares two functions.
///
/// # Errors
/// They differ, or do what the validator does not know; says where.
pub(super) fn validate<R: Register>(before: &Func<R>, after: &Func<R>) -> Result<(), String> {
    let ends = |func: &Func<R>| -> Vec<_> {
        func.blocks
            .iter()
            .map(|b| (b.end.clone(), b.rounds, b.params.clone()))
            .collect()
    };
    if ends(before) != ends(after) || before.slots != after.slots {
        return Err("a pass changed how blocks begin or end, or the stack".to_string());
    }
    let predecessors = list_predecessors(before);
    let mut numbers = ValueNumbers {
        known: HashMap::new(),
        starts: Vec::new(),
    };
    let states = [
        numbers.run(before, &predecessors)?,
        numbers.run(after, &predecessors)?,
    ];
    let outside = list_outside(&states);
    let same = |numbers: &mut ValueNumbers<R>, block: BlockId, at: Location<R>| {
        let [one, other] = states.each_ref().map(|all| numbers.at(&all[block], at));
        (one == other)
            .then_some(())
            .ok_or_else(|| format!("a pass changed what {block} leaves in {at:?}"))
    };
    for (index, block) in before.blocks.enumerated() {
        let mut counts: Vec<Location<R>> = match block.end {
            Terminator::Jump(_) => Vec::new(),
            Terminator::Branch { cond, .. } => {
                flag_places(branch_inst(Some(cond), false, 0).flags().reads).collect()
            }
            Terminator::NextKey(_) | Terminator::FallThrough => outside.clone(),
        };
        let read = block.end.values_read().iter();
        counts.extend(read.map(|value| Location::Register(R::of_value(*value))));
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

fn list_predecessors<R: Register>(func: &Func<R>) -> IdMap<BlockId, Vec<BlockId>> {
    let mut predecessors = IdMap::filled(Vec::new(), func.blocks.len());
    for (index, block) in func.blocks.enumerated() {
        for target in block.end.targets() {
            predecessors[target].push(index);
        }
    }
    predecessors
}

/// What others find where the code is left.
fn list_outside<R: Register>(states: &[IdMap<BlockId, BlockState<R>>; 2]) -> Vec<Location<R>> {
    let written: BTreeSet<Location<R>> = states
        .iter()
        .flatten()
        .flat_map(|state| state.left.keys().copied())
        .collect();
    let memory = written
        .into_iter()
        .filter(|at| matches!(at, Location::Memory(_) | Location::Result(_)));
    let roles = [STATE, RECORD, SAMPLES, HISTORY, SP].map(|reg| Location::Register(R::fixed(reg)));
    memory.chain(roles).collect()
}

fn flag_places<R>(of: Flags) -> impl Iterator<Item = Location<R>> {
    (0..FLAGS.len())
        .filter(move |flag| of.intersects(FLAGS[*flag]))
        .map(Location::Flag)
}

impl<R: Register> ValueNumbers<R> {
    fn of(&mut self, name: ValueKey<R>, made_of: Vec<u32>) -> u32 {
        let next = self.known.len() as u32;
        *self.known.entry((name, made_of)).or_insert_with(|| {
            if let ValueKey::Start(block, at) = name {
                self.starts.push((block, at));
            }
            next
        })
    }

    fn at(&mut self, state: &BlockState<R>, at: Location<R>) -> u32 {
        state
            .left
            .get(&at)
            .copied()
            .unwrap_or_else(|| self.of(ValueKey::Start(state.from, at), Vec::new()))
    }

    /// What each block leaves.
    fn run(
        &mut self,
        func: &Func<R>,
        predecessors: &IdMap<BlockId, Vec<BlockId>>,
    ) -> Result<IdMap<BlockId, BlockState<R>>, String> {
        let mut states: IdMap<BlockId, BlockState<R>> = IdMap::new();
        for (index, block) in func.blocks.enumerated() {
            let mut state = match predecessors[index][..] {
                [from] if from < index => states[from].clone(),
                _ => BlockState {
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

    fn step(&mut self, state: &mut BlockState<R>, code: &MInst<R>) -> Result<(), String> {
        check_encoding(code)?;
        let inst = &code.inst;
        let [from, to] = memory_touched(code);
        let found = code
            .registers_read()
            .map(Location::Register)
            .chain(flag_places(inst.flags().reads))
            .chain(from);
        let found: Vec<u32> = found.map(|at| self.at(state, at)).collect();
        let parts = code
            .uses()
            .filter(|u| u.writes)
            .map(|u| (ResultPart::Role(u.role), Location::Register(u.operand.reg)));
        let parts =
            parts.chain(flag_places(inst.flags().writes).map(|at| (ResultPart::Flag(at), at)));
        let parts: Vec<(ResultPart<R>, Location<R>)> = parts
            .chain(to.into_iter().map(|at| (ResultPart::Memory, at)))
            .collect();
        let what = (
            inst.op(),
            inst.cond,
            inst.shift,
            inst.amount,
            inst.imm,
            [inst.index, inst.add, inst.wback],
            code.address,
        );
        for (part, at) in parts
            .into_iter()
            .chain(lost(code).map(|at| (ResultPart::Lost(at), at)))
        {
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

/// Whether registers of the core stand in the encoding as among the operands, all of them.
fn check_encoding<R: Register>(code: &MInst<R>) -> Result<(), String> {
    if let Some(convention) = code.convention() {
        // A call has its registers by convention, and names none.
        let read = code.uses().filter(|u| u.reads).map(|u| u.operand.reg);
        let mut numbers = read.map(Register::number).zip(0..);
        let is_so = numbers.all(|(number, at)| number.is_none_or(|number| number == at));
        let count = code.uses().filter(|u| u.reads).count();
        return match is_so && count == convention.reads.len() {
            true => Ok(()),
            false => Err("a call has other operands than those of its convention".to_string()),
        };
    }
    let mut inst = code.inst;
    let mut reads = 0;
    let mut writes = 0;
    for u in code.uses() {
        let Some(number) = u.operand.reg.number() else {
            return Ok(());
        };
        if *u.role.of(&mut inst) != number {
            return Err(format!("{:?} has other registers than its operands", inst));
        }
        reads |= u16::from(u.reads) << number;
        writes |= u16::from(u.writes) << number;
    }
    if (reads, writes) != (inst.uses().core_bits(), inst.defs().core_bits()) {
        let op = inst.op();
        return Err(format!("{op:?} names registers otherwise than by roles"));
    }
    Ok(())
}

/// The memory that an instruction reads, and that it writes.
fn memory_touched<R: Register>(code: &MInst<R>) -> [Vec<Location<R>>; 2] {
    match code.access {
        Access::None | Access::Read(AliasClass::Constant) => [Vec::new(), Vec::new()],
        Access::Write(AliasClass::Constant) => [Vec::new(), vec![Location::Result(code.inst.imm)]],
        Access::Read(class) => [vec![locate(class)], Vec::new()],
        Access::Write(class) => [Vec::new(), vec![locate(class)]],
        Access::Update(cells) => {
            let both = cells.map(|cell| locate(AliasClass::Cell(cell)));
            [both.to_vec(), both.to_vec()]
        }
    }
}

/// The registers that a call does not keep.
fn lost<R: Register>(code: &MInst<R>) -> impl Iterator<Item = Location<R>> {
    let lost = code.convention().map_or(&[][..], |call| call.lost);
    lost.iter().map(|reg| Location::Register(R::fixed(*reg)))
}

fn locate<R>(class: AliasClass) -> Location<R> {
    match class {
        AliasClass::Slot(at) => Location::Slot(at),
        other => Location::Memory(other),
    }
}

#[cfg(test)]
mod tests;
