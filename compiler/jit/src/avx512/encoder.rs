//! Bytes of the few instructions that a tick in vectors of 512 bits is made of.
//!
//! ```text
//!   vectors        EVEX   62 | R X B R' map | W vvvv 1 pp | z 512 b V' aaa | opcode | ModRM .. | imm
//!   masks          VEX    C5 | R vvvv L pp                                 | opcode | ModRM .. | imm
//!   addresses      REX    4x                                               | opcode | ModRM .. | imm
//! ```
//!
//! Source: Intel 64 and IA-32 Architectures Software Developer's Manual, volume 2, chapters 2.3
//! (VEX) and 2.7 (EVEX), and the pages of the instructions.

/// A register of 512 bits, 0 to 31.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Zmm(pub u8);

/// A register of masks, 0 to 7; as a condition, 0 stands for all lanes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Mask(pub u8);

/// All lanes.
pub(super) const ALL: Mask = Mask(0);

/// A register of 64 bits.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Gpr {
    Rax = 0,
    Rcx = 1,
    Rdx = 2,
    Rbx = 3,
    Rbp = 5,
    Rsi = 6,
    Rdi = 7,
    R8 = 8,
    R9 = 9,
    R10 = 10,
    R11 = 11,
}

/// What stands behind the base of an address.
#[derive(Debug, Clone, Copy)]
enum Index {
    None,
    /// A register times 2 to a power.
    Gpr(Gpr, u8),
    /// Four times each lane of a vector.
    Lanes(Zmm),
}

/// A place in memory.
#[derive(Debug, Clone, Copy)]
pub(super) struct Address {
    base: Gpr,
    index: Index,
    offset: i32,
}

impl Address {
    /// Bytes behind a base.
    pub fn new(base: Gpr, offset: i32) -> Address {
        Address {
            base,
            index: Index::None,
            offset,
        }
    }

    /// The same and `index * 2^shift` bytes.
    pub fn indexed(self, index: Gpr, shift: u8) -> Address {
        Address {
            index: Index::Gpr(index, shift),
            ..self
        }
    }

    /// The same and four bytes times each lane.
    pub fn lanes(self, index: Zmm) -> Address {
        Address {
            index: Index::Lanes(index),
            ..self
        }
    }
}

/// The last operand of an instruction.
#[derive(Debug, Clone, Copy)]
pub(super) enum Operand {
    Zmm(Zmm),
    Gpr(Gpr),
    Mask(Mask),
    /// As many words as there are lanes.
    Memory(Address),
    /// One word for all lanes.
    Broadcast(Address),
}

/// An instruction on vectors.
#[derive(Debug, Clone, Copy)]
pub(super) struct Form {
    prefix: u8,
    map: u8,
    is_wide: bool,
    opcode: u8,
    /// How many bytes short offsets count.
    unit: i32,
}

const fn form(prefix: u8, map: u8, opcode: u8) -> Form {
    Form {
        prefix,
        map,
        is_wide: false,
        opcode,
        unit: 64,
    }
}

const fn wide(form: Form) -> Form {
    Form {
        is_wide: true,
        ..form
    }
}

const fn of_unit(unit: i32, form: Form) -> Form {
    Form { unit, ..form }
}

/// Prefixes 66 and F3, and the maps of opcodes 0F, 0F38 and 0F3A, as EVEX has them.
const P66: u8 = 1;
const F3: u8 = 2;
const MAP_0F: u8 = 1;
const MAP_0F38: u8 = 2;
const MAP_0F3A: u8 = 3;

/// The instructions, by their names in the manual without the `v`.
pub(super) mod forms {
    use super::{F3, Form, MAP_0F, MAP_0F3A, MAP_0F38, P66, form, of_unit, wide};

    pub const PADDD: Form = form(P66, MAP_0F, 0xFE);
    pub const PSUBD: Form = form(P66, MAP_0F, 0xFA);
    pub const PMULLD: Form = form(P66, MAP_0F38, 0x40);
    pub const PMINSD: Form = form(P66, MAP_0F38, 0x39);
    pub const PMAXSD: Form = form(P66, MAP_0F38, 0x3D);
    pub const PANDD: Form = form(P66, MAP_0F, 0xDB);
    pub const PXORD: Form = form(P66, MAP_0F, 0xEF);
    pub const PADDQ: Form = wide(form(P66, MAP_0F, 0xD4));
    pub const PMULDQ: Form = wide(form(P66, MAP_0F38, 0x28));
    /// Shifts by a number: to the left, arithmetically to the right.
    pub const SHIFT: Form = form(P66, MAP_0F, 0x72);
    pub const MOVSHDUP: Form = form(F3, MAP_0F, 0x16);
    pub const MOVDQU32: Form = form(F3, MAP_0F, 0x6F);
    pub const MOVDQU32_STORE: Form = form(F3, MAP_0F, 0x7F);
    pub const MOVDQA32: Form = form(P66, MAP_0F, 0x6F);
    pub const PBROADCASTD: Form = of_unit(4, form(P66, MAP_0F38, 0x58));
    pub const PBROADCASTD_GPR: Form = form(P66, MAP_0F38, 0x7C);
    pub const PBLENDMD: Form = form(P66, MAP_0F38, 0x64);
    pub const PCMPD: Form = form(P66, MAP_0F3A, 0x1F);
    pub const PMOVZXWD: Form = of_unit(32, form(P66, MAP_0F38, 0x33));
    pub const PMOVDW_STORE: Form = of_unit(32, form(F3, MAP_0F38, 0x33));
    pub const PGATHERDD: Form = of_unit(4, form(P66, MAP_0F38, 0x90));
}

/// Which shift [`forms::SHIFT`] is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Shift {
    Right = 4,
    Left = 6,
}

/// Opcodes of masks.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum MaskOp {
    And = 0x41,
    /// The second where the first is not.
    AndNot = 0x42,
    Not = 0x44,
    Or = 0x45,
    Equal = 0x46,
    Differ = 0x47,
    Move = 0x90,
    Store = 0x91,
    FromGpr = 0x92,
    ToGpr = 0x93,
    /// The flag of zero: neither has a lane.
    Test = 0x98,
}

/// Opcodes of addresses and flags.
pub(super) mod opcodes {
    pub const LOAD: &[u8] = &[0x8B];
    pub const STORE: &[u8] = &[0x89];
    pub const LEA: &[u8] = &[0x8D];
    pub const ADD: &[u8] = &[0x03];
    pub const CMP: &[u8] = &[0x3B];
    pub const TEST: &[u8] = &[0x85];
    /// With a number; the register is 0 to add it.
    pub const ADD_NUMBER: &[u8] = &[0x81];
    pub const IMUL_NUMBER: &[u8] = &[0x69];
    /// To a register or to memory.
    pub const MOVE_NUMBER: &[u8] = &[0xC7];
    pub const CMOVS: &[u8] = &[0x0F, 0x48];
    pub const BSF: &[u8] = &[0x0F, 0xBC];
    /// The bit that the register says becomes 0.
    pub const BTR: &[u8] = &[0x0F, 0xB3];
    pub const JZ: &[u8] = &[0x0F, 0x84];
    pub const JNZ: &[u8] = &[0x0F, 0x85];
    pub const JL: &[u8] = &[0x0F, 0x8C];
}

/// What is written, byte by byte.
#[derive(Default)]
pub(super) struct Encoder {
    pub bytes: Vec<u8>,
}

impl Encoder {
    /// An instruction on vectors: destination, second and last operand, lanes that are written.
    /// `keep` says whether the other lanes keep what they have, or become 0.
    pub fn masked(
        &mut self,
        form: Form,
        to: u8,
        second: u8,
        last: Operand,
        (lanes, keep): (Mask, bool),
    ) {
        let (x, b, v4) = match last {
            Operand::Zmm(Zmm(n)) => (n >> 4, n >> 3, second >> 4),
            Operand::Gpr(gpr) => (0, gpr as u8 >> 3, second >> 4),
            Operand::Mask(Mask(n)) => (0, n >> 3, second >> 4),
            Operand::Memory(at) | Operand::Broadcast(at) => match at.index {
                Index::None => (0, at.base as u8 >> 3, second >> 4),
                Index::Gpr(index, _) => (index as u8 >> 3, at.base as u8 >> 3, second >> 4),
                Index::Lanes(Zmm(n)) => (n >> 3, at.base as u8 >> 3, n >> 4),
            },
        };
        let off = |bit: u8| !bit & 1;
        let is_broadcast = matches!(last, Operand::Broadcast(_));
        self.bytes.extend([
            0x62,
            off(to >> 3) << 7 | off(x) << 6 | off(b) << 5 | off(to >> 4) << 4 | form.map,
            u8::from(form.is_wide) << 7 | (!second & 15) << 3 | 1 << 2 | form.prefix,
            u8::from(!keep) << 7 | 2 << 5 | u8::from(is_broadcast) << 4 | off(v4) << 3 | lanes.0,
            form.opcode,
        ]);
        let unit = match (is_broadcast, form.is_wide) {
            (true, true) => 8,
            (true, false) => 4,
            (false, _) => form.unit,
        };
        self.operand(to, last, unit);
    }

    /// An instruction on all lanes of vectors.
    pub fn vector(&mut self, form: Form, to: Zmm, second: Zmm, last: Operand) {
        self.masked(form, to.0, second.0, last, (ALL, true));
    }

    /// An instruction on all lanes of vectors that has no second operand.
    pub fn vector_of(&mut self, form: Form, to: Zmm, last: Operand) {
        self.masked(form, to.0, 0, last, (ALL, true));
    }

    /// Shifts words by a number.
    pub fn shift(&mut self, shift: Shift, to: Zmm, last: Operand, n: u8) {
        self.masked(forms::SHIFT, shift as u8, to.0, last, (ALL, true));
        self.bytes.push(n);
    }

    /// An instruction on masks: register of the first field, second operand, last operand.
    pub fn mask(&mut self, op: MaskOp, to: u8, second: Mask, last: Operand) {
        let two_operands = matches!(
            op,
            MaskOp::And | MaskOp::AndNot | MaskOp::Or | MaskOp::Equal | MaskOp::Differ
        );
        let second = if two_operands { second.0 } else { 0 };
        let length = u8::from(two_operands) << 2;
        self.bytes
            .extend([0xC5, 0x80 | (!second & 15) << 3 | length, op as u8]);
        self.operand(to, last, 1);
    }

    /// An instruction on registers of 64 bits.
    pub fn wide(&mut self, opcode: &[u8], reg: u8, last: Operand) {
        self.legacy(8, opcode, reg, last);
    }

    /// An instruction on registers of 32 bits.
    pub fn narrow(&mut self, opcode: &[u8], reg: u8, last: Operand) {
        self.legacy(0, opcode, reg, last);
    }

    fn legacy(&mut self, width: u8, opcode: &[u8], reg: u8, last: Operand) {
        let (x, b) = match last {
            Operand::Gpr(gpr) => (0, gpr as u8 >> 3),
            Operand::Memory(at) => match at.index {
                Index::Gpr(index, _) => (index as u8 >> 3, at.base as u8 >> 3),
                _ => (0, at.base as u8 >> 3),
            },
            _ => (0, 0),
        };
        self.bytes.push(0x40 | width | (reg >> 3) << 2 | x << 1 | b);
        self.bytes.extend(opcode);
        self.operand(reg, last, 1);
    }

    /// Four bytes behind an instruction.
    pub fn number(&mut self, number: i32) {
        self.bytes.extend(number.to_le_bytes());
    }

    /// A jump to be completed by [`Encoder::land`]; gives where.
    pub fn jump(&mut self, opcode: &[u8]) -> usize {
        self.bytes.extend(opcode);
        self.number(0);
        self.bytes.len()
    }

    /// Lets a jump go to a place.
    pub fn land(&mut self, jump: usize, place: usize) {
        let way = place as i32 - jump as i32;
        self.put(jump - 4, way);
    }

    /// Writes a number over what stands at a place.
    pub fn put(&mut self, at: usize, number: i32) {
        self.bytes[at..at + 4].copy_from_slice(&number.to_le_bytes());
    }

    /// ModRM, SIB and offset.
    fn operand(&mut self, reg: u8, last: Operand, unit: i32) {
        let reg = (reg & 7) << 3;
        let at = match last {
            Operand::Zmm(Zmm(n)) | Operand::Mask(Mask(n)) => {
                return self.bytes.push(0xC0 | reg | n & 7);
            }
            Operand::Gpr(gpr) => return self.bytes.push(0xC0 | reg | gpr as u8 & 7),
            Operand::Memory(at) | Operand::Broadcast(at) => at,
        };
        let short = (at.offset % unit == 0)
            .then_some(at.offset / unit)
            .and_then(|units| i8::try_from(units).ok());
        let mode = if short.is_some() { 0x40 } else { 0x80 };
        let base = at.base as u8 & 7;
        match at.index {
            Index::None => self.bytes.push(mode | reg | base),
            Index::Gpr(index, shift) => {
                let sib = shift << 6 | (index as u8 & 7) << 3 | base;
                self.bytes.extend([mode | reg | 4, sib]);
            }
            Index::Lanes(Zmm(n)) => {
                self.bytes
                    .extend([mode | reg | 4, 2 << 6 | (n & 7) << 3 | base]);
            }
        }
        match short {
            Some(units) => self.bytes.push(units as u8),
            None => self.number(at.offset),
        }
    }
}
