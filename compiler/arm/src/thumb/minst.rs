//! Machine instructions, before and after register allocation.
//!
//! ```text
//!   isa::Inst (what it is, immediates, condition)  +  Operands (who stands in d n m a t t2)  =  MInst
//! ```
//!
//! What an operand's role is, whether it is read or written, is asked of the instruction table and
//! stands nowhere else. A role that is read and written (the accumulator of SMLAL, the result of a
//! conditional MOV) has two registers: `reg` is what it becomes, `old` what it was; the allocator
//! puts both in one register. Flags never live from block to block, and no two of their lives
//! overlap in the order that selection makes.
//!
//! Not here: encodings (`emit` takes the shortest), cycles (`schedule`, `critical_path`).

use super::routine::{Convention, OF_ROUTINES, OF_STRINGS, Routine, StringRoutine};
use std::fmt::{Debug, Display};
use std::hash::Hash;
use whippen_ids::impl_id;
use whippen_isa::{Arch, Cond, Encoding, Flags, Inst, Op};

/// A virtual register.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub(super) struct VReg(pub u32);

impl_id!(VReg);

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
        self.as_virtual().map(|reg| reg.0 as usize)
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
    /// Reads and writes two cells.
    Update([u32; 2]),
}

/// Where a row of a table is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(super) struct RowPlace {
    pub table: u32,
    /// Bytes from where the table begins.
    pub offset: i32,
}

/// An address that is known when the object is linked.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(super) enum Relocation {
    /// MOVW: the low half of the address of a table's row.
    Low(RowPlace),
    /// MOVT: the high half.
    High(RowPlace),
    /// BL: a routine.
    Routine(Routine),
    /// BL: the tick of a string.
    String(StringRoutine),
}

impl Relocation {
    /// How it is called, if it is.
    pub(super) fn convention(self) -> Option<&'static Convention> {
        match self {
            Relocation::Low(_) | Relocation::High(_) => None,
            Relocation::Routine(_) => Some(&OF_ROUTINES),
            Relocation::String(_) => Some(&OF_STRINGS),
        }
    }
}

/// One instruction.
#[derive(Debug, Clone, Copy, Hash)]
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
    /// How it is called, if it calls.
    pub(super) fn convention(&self) -> Option<&'static Convention> {
        self.address?.convention()
    }

    /// Its operands, with what happens to them.
    pub(super) fn uses(&self) -> impl Iterator<Item = Use<R>> + '_ {
        let mut numbered = self.inst;
        for role in Role::ALL {
            *role.of(&mut numbered) = role as u8;
        }
        let (reads, writes) = match self.convention() {
            Some(convention) => {
                let bit = |role: &Role| 1 << *role as u16;
                let reads = convention.reads.iter().map(bit).sum();
                (reads, convention.writes.as_ref().map_or(0, bit))
            }
            None => (numbered.uses().core_bits(), numbered.defs().core_bits()),
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

    /// The registers it reads, and those that it writes or loses, as bits.
    pub(super) fn register_bits(&self) -> (u32, u32) {
        let bits = |all: u32, reg: PReg| all | 1 << reg.0;
        let lost = self.convention().map_or(&[][..], |call| call.lost);
        let lost = lost.iter().copied().map(PReg);
        (
            self.registers_read().fold(0, bits),
            self.registers_written().chain(lost).fold(0, bits),
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
