//! Machine instructions in basic blocks, before and after register allocation.
//!
//! ```text
//!   isa::Inst (what it is, immediates, condition)  +  Operands (who stands in d n m a t t2)  =  MInst
//!
//!   Func<Reg>   virtual registers, in SSA form   --allocate-->   Func<PReg>   registers of the core
//! ```
//!
//! What an operand's role is, whether it is read or written, is asked of the instruction table and
//! stands nowhere else. A role that is read and written (the accumulator of SMLAL, the result of a
//! conditional MOV) has two registers: `reg` is what it becomes, `old` what it was; the allocator
//! puts both in one register. Flags never live from block to block, and no two of their lives
//! overlap in the order that selection makes.
//!
//! Not here: encodings (`emit` takes the shortest), cycles (`schedule`, `critical_path`).

use super::registers::ALL_FREE;
use super::v6m::Routine;
use std::fmt::{Debug, Display};
use std::hash::Hash;
use std::sync::OnceLock;
use whippen_isa::{Arch, Cond, Encoding, Flags, Inst, Op};

/// A virtual register.
pub(super) type VReg = u32;

/// What stands in the roles of instructions: [`Reg`] before allocation, [`PReg`] after.
pub(super) trait Register: Copy + Ord + Hash + Debug + Display {
    /// A register that holds a value, of those that the allocator deals with.
    type Value: Copy + Ord + Hash + Debug;

    /// Whether it is a register of the core.
    const IS_PHYSICAL: bool;

    /// The register that holds a value.
    fn of_value(value: Self::Value) -> Self;

    /// A register with a role of its own.
    fn fixed(reg: u8) -> Self;

    /// Its place among those that liveness follows, if it is one.
    fn index(self) -> Option<usize>;

    /// Its number in encodings; none before it has one.
    fn number(self) -> Option<u8>;
}

/// Who stands in a role before allocation.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub(super) enum Reg {
    /// A virtual register.
    Virtual(VReg),
    /// A register with a role of its own: those of `registers`.
    Fixed(u8),
}

/// A register of the core.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub(super) struct PReg(pub u8);

impl Register for Reg {
    type Value = VReg;
    const IS_PHYSICAL: bool = false;

    fn of_value(value: VReg) -> Reg {
        Reg::Virtual(value)
    }

    fn fixed(reg: u8) -> Reg {
        Reg::Fixed(reg)
    }

    fn index(self) -> Option<usize> {
        self.as_virtual().map(|reg| reg as usize)
    }

    fn number(self) -> Option<u8> {
        None
    }
}

impl Register for PReg {
    type Value = PReg;
    const IS_PHYSICAL: bool = true;

    fn of_value(value: PReg) -> PReg {
        value
    }

    fn fixed(reg: u8) -> PReg {
        PReg(reg)
    }

    fn index(self) -> Option<usize> {
        Some(self.0.into())
    }

    fn number(self) -> Option<u8> {
        Some(self.0)
    }
}

/// The places of operands in an instruction, as `Inst` names them.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(super) enum Role {
    D,
    N,
    M,
    A,
    T,
    T2,
}

impl Role {
    pub(super) const ALL: [Role; 6] = [Role::D, Role::N, Role::M, Role::A, Role::T, Role::T2];

    /// The field of the instruction.
    pub(super) fn of(self, inst: &mut Inst) -> &mut u8 {
        match self {
            Role::D => &mut inst.d,
            Role::N => &mut inst.n,
            Role::M => &mut inst.m,
            Role::A => &mut inst.a,
            Role::T => &mut inst.t,
            Role::T2 => &mut inst.t2,
        }
    }
}

/// What stands in a role.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(super) struct Operand<R: Register = Reg> {
    /// What is read or, if the role is written, written.
    pub reg: R,
    /// What is read, where the role is read and written.
    pub old: Option<R::Value>,
}

/// Memory that accesses may meet in.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub(super) enum AliasClass {
    /// What no tick writes.
    Constant,
    /// A cell of the key.
    Cell(u32),
    /// A delay line.
    Line(u32),
    /// Everything else.
    Other(Other),
    /// A word of the stack, by its offset.
    Slot(u32),
}

/// Memory that is neither constant nor a cell nor a line.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub(super) enum Other {
    /// Drive words.
    Drive,
    /// Probes.
    Probes,
    /// The ring of events.
    Events,
    /// The mode: the address of its code.
    Mode,
}

/// What an instruction does to memory.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(super) enum Access {
    None,
    Read(AliasClass),
    Write(AliasClass),
}

/// An address that is known when the object is linked.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(super) enum Relocation {
    /// MOVW: the low half of a table's address.
    Low(u32),
    /// MOVT: the high half.
    High(u32),
    /// BL: a routine.
    Routine(Routine),
}

/// One instruction.
#[derive(Debug, Clone, Copy)]
pub(super) struct MInst<R: Register = Reg> {
    /// What it is. Its register fields mean nothing before allocation; after, they are those of the
    /// operands, and its encoding is the shortest.
    pub inst: Inst,
    pub operands: [Option<Operand<R>>; 6],
    pub access: Access,
    /// An immediate that is an address.
    pub address: Option<Relocation>,
    /// The role, without an operand of its own, whose register is that of D.
    pub tied: Option<Role>,
    pub origin: Option<u32>,
    /// Whether the allocator put it in: a move, or an access to the stack.
    pub inserted: bool,
}

/// Whether the roles of an instruction are read, written.
#[derive(Debug, Clone, Copy)]
pub(super) struct Use<R: Register = Reg> {
    pub role: Role,
    pub operand: Operand<R>,
    pub reads: bool,
    pub writes: bool,
}

impl MInst {
    pub(super) fn new(op: Op) -> MInst {
        MInst {
            inst: template(op),
            operands: [None; 6],
            access: Access::None,
            address: None,
            tied: None,
            origin: None,
            inserted: false,
        }
    }

    pub(super) fn with(mut self, role: Role, reg: Reg) -> MInst {
        self.operands[role as usize] = Some(Operand { reg, old: None });
        self
    }

    pub(super) fn reg(self, role: Role, reg: VReg) -> MInst {
        self.with(role, Reg::Virtual(reg))
    }

    /// A role that becomes `new` and was `old`.
    pub(super) fn both(mut self, role: Role, new: VReg, old: VReg) -> MInst {
        self.operands[role as usize] = Some(Operand {
            reg: Reg::Virtual(new),
            old: Some(old),
        });
        self
    }

    pub(super) fn imm(mut self, imm: u32) -> MInst {
        self.inst.imm = imm;
        self
    }

    pub(super) fn access(mut self, access: Access) -> MInst {
        self.access = access;
        self
    }

    /// Sets the flags.
    pub(super) fn flags(mut self) -> MInst {
        self.inst.s = true;
        self
    }

    /// Only where the condition holds.
    pub(super) fn only(mut self, cond: Cond) -> MInst {
        self.inst.cond = Some(cond);
        self
    }

    /// Writes another register instead.
    pub(super) fn rename(&mut self, from: VReg, to: VReg) {
        let writes: Vec<Role> = self.uses().filter(|u| u.writes).map(|u| u.role).collect();
        for role in writes {
            let operand = self.operands[role as usize]
                .as_mut()
                .filter(|operand| operand.reg == Reg::Virtual(from));
            operand
                .into_iter()
                .for_each(|operand| operand.reg = Reg::Virtual(to));
        }
    }
}

impl<R: Register> MInst<R> {
    /// Its operands, with what happens to them.
    pub(super) fn uses(&self) -> impl Iterator<Item = Use<R>> + '_ {
        let mut numbered = self.inst;
        for role in Role::ALL {
            *role.of(&mut numbered) = role as u8;
        }
        let (reads, writes) = match self.address {
            Some(Relocation::Routine(_)) => (
                1 << Role::N as u16 | 1 << Role::M as u16,
                1 << Role::D as u16,
            ),
            _ => (numbered.uses().core_bits(), numbered.defs().core_bits()),
        };
        Role::ALL.into_iter().filter_map(move |role| {
            let operand = self.operands[role as usize]?;
            let bit = |set: u16| set >> role as u8 & 1 != 0;
            Some(Use {
                role,
                operand,
                reads: bit(reads),
                writes: bit(writes),
            })
        })
    }

    /// The registers it reads, those with a role of their own among them.
    pub(super) fn registers_read(&self) -> impl Iterator<Item = R> + '_ {
        self.uses().filter_map(|u| match u.operand.old {
            Some(old) if u.writes => Some(R::of_value(old)),
            _ => (u.reads || !u.writes).then_some(u.operand.reg),
        })
    }

    /// The registers it writes, those with a role of their own among them.
    pub(super) fn registers_written(&self) -> impl Iterator<Item = R> + '_ {
        self.uses()
            .filter_map(|u| u.writes.then_some(u.operand.reg))
    }

    /// The registers that become something else in place.
    pub(super) fn registers_replaced(&self) -> impl Iterator<Item = R> + '_ {
        self.operands
            .iter()
            .flatten()
            .filter_map(|operand| operand.old.map(R::of_value))
    }

    /// Whether it reads, and writes, the flags of conditions.
    pub(super) fn touches_flags(&self) -> (bool, bool) {
        let flags = self.inst.flags();
        (
            flags.reads.intersects(Flags::NZCV),
            flags.writes.intersects(Flags::NZCV),
        )
    }
}

impl MInst {
    /// The virtual registers it reads.
    pub(super) fn reads(&self) -> impl Iterator<Item = VReg> + '_ {
        self.registers_read().filter_map(Reg::as_virtual)
    }

    /// The virtual registers it defines.
    pub(super) fn writes(&self) -> impl Iterator<Item = VReg> + '_ {
        self.registers_written().filter_map(Reg::as_virtual)
    }
}

impl Reg {
    fn as_virtual(self) -> Option<VReg> {
        match self {
            Reg::Virtual(reg) => Some(reg),
            Reg::Fixed(_) => None,
        }
    }
}

impl MInst<PReg> {
    /// An instruction that the allocator puts in, with its registers.
    pub(super) fn inserted(inst: Inst, access: Access) -> MInst<PReg> {
        let mut own = inst;
        let mut numbered = inst;
        for role in Role::ALL {
            *role.of(&mut numbered) = role as u8;
        }
        let named = numbered.uses().core_bits() | numbered.defs().core_bits();
        let operands = Role::ALL.map(|role| {
            let reg = PReg(*role.of(&mut own));
            (named >> role as u8 & 1 != 0).then_some(Operand { reg, old: None })
        });
        MInst {
            inst,
            operands,
            access,
            address: None,
            tied: None,
            origin: None,
            inserted: true,
        }
    }

    /// Another register in a role.
    pub(super) fn set_register(&mut self, role: Role, reg: PReg) {
        if let Some(operand) = &mut self.operands[role as usize] {
            operand.reg = reg;
            operand.old = operand.old.map(|_| reg);
        }
        *role.of(&mut self.inst) = reg.0;
    }

    /// In its shortest encoding.
    pub(super) fn shortened(mut self, arch: Arch) -> MInst<PReg> {
        self.inst = self.inst.shortest(arch).unwrap_or(self.inst);
        self
    }

    /// The registers it reads and writes, as bits.
    pub(super) fn register_bits(&self) -> (u32, u32) {
        let bits = |all: u32, reg: PReg| all | 1 << reg.0;
        (
            self.registers_read().fold(0, bits),
            self.registers_written().fold(0, bits),
        )
    }
}

/// The instruction in its first 32-bit encoding, or its only one.
pub(super) fn template(op: Op) -> Inst {
    let wide = Encoding::of(op).find(|encoding| encoding.size() == 4);
    let any = || Encoding::of(op).next();
    // Every instruction has an encoding; the first of all is only there to need no panic.
    let first = wide.or_else(any).or_else(|| Encoding::all().next());
    first.map_or_else(|| unreachable!("the table is not empty"), Inst::new)
}

/// A block and the values of its parameters.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Edge<V = VReg> {
    pub block: usize,
    /// None after allocation, where the values are in their registers.
    pub args: Vec<V>,
}

/// How a block ends.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Terminator<V = VReg> {
    Jump(Edge<V>),
    /// By the flags. Both blocks have no other way in.
    Branch {
        cond: Cond,
        yes: usize,
        no: usize,
        likely: Option<bool>,
    },
    /// To the address in this register, the code of the next key.
    NextKey(V),
    /// To the code after `init` of one key.
    FallThrough,
}

/// Cycles of a block, about.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Cycles {
    /// With its end, which is a branch that is not taken if it is a decision.
    pub on: u64,
    /// What the branch costs more where it is taken.
    pub taken: u64,
}

/// A basic block.
#[derive(Debug, Clone)]
pub(super) struct Block<R: Register = Reg> {
    /// None after allocation.
    pub params: Vec<R::Value>,
    pub code: Vec<MInst<R>>,
    pub end: Terminator<R::Value>,
    /// It runs at most so often each time it is entered from outside its loop.
    pub rounds: Option<u32>,
    /// Its cycles, once somebody has asked `critical_path` for them.
    pub cycles: OnceLock<Cycles>,
}

/// All code of a mode, or of `init`. The first block is the entry.
#[derive(Debug, Clone)]
pub(super) struct Func<R: Register = Reg> {
    pub blocks: Vec<Block<R>>,
    /// How many virtual registers it has.
    pub vregs: u32,
    /// The registers that it may use, as bits.
    pub free: u32,
    /// How many words of the stack it uses, which only the allocator knows.
    pub slots: usize,
}

/// A function with registers of the core.
pub(super) type Allocated = Func<PReg>;

impl Func {
    pub(super) fn new() -> Func {
        Func {
            blocks: Vec::new(),
            vregs: 0,
            free: ALL_FREE,
            slots: 0,
        }
    }

    pub(super) fn fresh(&mut self) -> VReg {
        self.vregs += 1;
        self.vregs - 1
    }

    pub(super) fn block(&mut self) -> usize {
        let end = Terminator::FallThrough;
        self.blocks.push(Block {
            params: Vec::new(),
            code: Vec::new(),
            end,
            rounds: None,
            cycles: OnceLock::new(),
        });
        self.blocks.len() - 1
    }
}

impl<V: Copy> Terminator<V> {
    /// The values that it reads: arguments, or the address of the next key's code.
    pub(super) fn values_read(&self) -> &[V] {
        match self {
            Terminator::Jump(edge) => &edge.args,
            Terminator::NextKey(code) => std::slice::from_ref(code),
            Terminator::Branch { .. } | Terminator::FallThrough => &[],
        }
    }

    /// Where it goes.
    pub(super) fn targets(&self) -> Vec<usize> {
        match self {
            Terminator::Jump(edge) => vec![edge.block],
            Terminator::Branch { yes, no, .. } => vec![*yes, *no],
            Terminator::NextKey(_) | Terminator::FallThrough => Vec::new(),
        }
    }
}

impl<R: Register> Block<R> {
    /// The same block with other code.
    pub(super) fn with_code(&self, code: Vec<MInst<R>>) -> Block<R> {
        Block {
            params: self.params.clone(),
            code,
            end: self.end.clone(),
            rounds: self.rounds,
            cycles: OnceLock::new(),
        }
    }
}

impl Func {
    /// The same without blocks that nobody comes to, in an order in which each but the first
    /// follows one that leads to it: `regalloc2`'s checker takes what comes from a later block for
    /// unknown if that has no way in yet.
    pub(super) fn into_reverse_postorder(mut self) -> Func {
        let order = self.reverse_postorder();
        let mut places = vec![0; self.blocks.len()];
        order
            .iter()
            .enumerate()
            .for_each(|(place, block)| places[*block] = place);
        let mut blocks: Vec<Option<Block>> = std::mem::take(&mut self.blocks)
            .into_iter()
            .map(Some)
            .collect();
        let mut blocks: Vec<Block> = order
            .iter()
            .filter_map(|block| blocks[*block].take())
            .collect();
        for block in &mut blocks {
            match &mut block.end {
                Terminator::Jump(edge) => edge.block = places[edge.block],
                Terminator::Branch { yes, no, .. } => (*yes, *no) = (places[*yes], places[*no]),
                Terminator::NextKey(_) | Terminator::FallThrough => {}
            }
        }
        Func { blocks, ..self }
    }

    /// Instructions on the longest way, loops counted once.
    pub(super) fn longest_path_len(&self) -> usize {
        let mut below = vec![0; self.blocks.len()];
        for at in self.reverse_postorder().into_iter().rev() {
            let block = &self.blocks[at];
            let next = block.end.targets().into_iter().map(|to| below[to]).max();
            below[at] = block.code.len() + next.unwrap_or(0);
        }
        below.first().copied().unwrap_or(0)
    }

    fn reverse_postorder(&self) -> Vec<usize> {
        let mut seen = vec![false; self.blocks.len()];
        let (mut order, mut waiting) = (Vec::new(), vec![(0, false)]);
        while let Some((block, done)) = waiting.pop() {
            if done {
                order.push(block);
            } else if !std::mem::replace(&mut seen[block], true) {
                waiting.push((block, true));
                waiting.extend(
                    self.blocks[block]
                        .end
                        .targets()
                        .into_iter()
                        .map(|to| (to, false)),
                );
            }
        }
        order.reverse();
        order
    }
}
