//! The text of an instruction in UAL, from the table's syntax column.
//!
//! `{...}` stands for an operand or a part of the mnemonic; the rest is itself. Text assembles to
//! the same bits with any UAL assembler where the syntax can name the encoding (`.W` does, for
//! 32-bit ones that have a 16-bit form). A branch target is an offset from the instruction itself,
//! `.+8`; a literal is `[pc, #8]`. Encodings without syntax print as `.inst`.

use crate::encode::pack;
use crate::imm::ShiftType;
use crate::inst::Inst;
use crate::reg::{core_name, special_name};
use core::fmt::{self, Display, Formatter, Write};

impl Display for Inst {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        let mut rest = self.encoding.row().text;
        while let Some((before, after)) = rest.split_once('{') {
            f.write_str(before)?;
            let (name, after) = after.split_once('}').unwrap_or((after, ""));
            self.part(f, name)?;
            rest = after;
        }
        f.write_str(rest)
    }
}

impl Inst {
    fn part(&self, f: &mut Formatter<'_>, name: &str) -> fmt::Result {
        match name {
            "s" => suffix(f, self.s, "s"),
            "c" => self.cond.map_or(Ok(()), |c| c.fmt(f)),
            "d" => f.write_str(core_name(self.d)),
            "n" => f.write_str(core_name(self.n)),
            "m" => f.write_str(core_name(self.m)),
            "a" => f.write_str(core_name(self.a)),
            "t" => f.write_str(core_name(self.t)),
            "t2" => f.write_str(core_name(self.t2)),
            "i" => self.imm.fmt(f),
            "k" => self.amount.fmt(f),
            "w" => suffix(f, self.wback, "!"),
            "l" => suffix(f, self.amount != 0, "l"),
            "const" => constant(f, self.imm),
            "shift" => self.shift_part(f),
            "mem" => self.memory(f),
            "lit" => write!(f, "[pc, #{}{}]", if self.add { "" } else { "-" }, self.imm),
            "to" => write!(f, ".{:+}", i64::from(self.offset()) + 4),
            "list" => self.core_list(f),
            "inst" => write!(f, ".inst.w {:#010x}", pack(self, self.encoding.row())),
            _ => self.opcode_part(f, name),
        }
    }

    /// Parts of a mnemonic, and operands that are neither core registers nor plain numbers.
    fn opcode_part(&self, f: &mut Formatter<'_>, name: &str) -> fmt::Result {
        let (imm, amount) = (self.imm as usize, self.amount as usize);
        match name {
            "x" => suffix(f, imm != 0, "x"),
            "r" => suffix(f, imm != 0, "r"),
            "y" => f.write_str(["b", "t"][imm & 1]),
            "xy" => f.write_str(["bb", "bt", "tb", "tt"][imm & 3]),
            "us" => f.write_str(["u", "s"][imm & 1]),
            "e" => suffix(f, amount != 0, "e"),
            "anpm" => f.write_str(["a", "n", "p", "m"][amount & 3]),
            "sel" => f.write_str(["eq", "vs", "ge", "gt"][imm & 3]),
            "fixed" => f.write_str(["s16", "s32", "u16", "u32"][amount & 3]),
            "ie" => f.write_str(["ie", "id"][imm & 1]),
            "if" => f.write_str(["none", "f", "i", "if"][amount & 3]),
            "bits" => f.write_str(["", "_g", "_nzcvq", "_nzcvqg"][amount & 3]),
            "barrier" => self.barrier(f),
            "special" => self.special(f),
            "hint" => write!(f, "{{{imm}}}"),
            "option" => write!(f, "{{{imm}}}"),
            "it" => self.it_block(f),
            "cp" => write!(f, "p{}", self.a),
            "Cd" => write!(f, "c{}", self.d),
            "Cn" => write!(f, "c{}", self.n),
            "Cm" => write!(f, "c{}", self.m),
            _ => self.float_part(f, name),
        }
    }

    fn float_part(&self, f: &mut Formatter<'_>, name: &str) -> fmt::Result {
        match name {
            "Sd" => write!(f, "s{}", self.d),
            "Sn" => write!(f, "s{}", self.n),
            "Sm" => write!(f, "s{}", self.m),
            "Sm2" => write!(f, "s{}", u32::from(self.m) + 1),
            "Dd" => write!(f, "d{}", self.d),
            "Dm" => write!(f, "d{}", self.m),
            "halfd" => write!(f, "d{}[{}]", self.d / 2, self.d % 2),
            "halfm" => write!(f, "d{}[{}]", self.m / 2, self.m % 2),
            "Slist" => self.float_list(f, 's'),
            "Dlist" => self.float_list(f, 'd'),
            "float" => write!(f, "#{:?}", f32::from_bits(self.imm)),
            _ => Err(fmt::Error),
        }
    }

    fn shift_part(&self, f: &mut Formatter<'_>) -> fmt::Result {
        match self.shift {
            ShiftType::LSL if self.amount == 0 => Ok(()),
            ShiftType::RRX => f.write_str(", rrx"),
            shift => write!(f, ", {} #{}", shift.name(), self.amount),
        }
    }

    fn memory(&self, f: &mut Formatter<'_>) -> fmt::Result {
        let (base, sign) = (core_name(self.n), if self.add { "" } else { "-" });
        match (self.index, self.wback) {
            (true, false) if self.imm == 0 && self.add => write!(f, "[{base}]"),
            (true, write_back) => {
                write!(f, "[{base}, #{sign}{}]", self.imm)?;
                suffix(f, write_back, "!")
            }
            (false, _) => write!(f, "[{base}], #{sign}{}", self.imm),
        }
    }

    fn core_list(&self, f: &mut Formatter<'_>) -> fmt::Result {
        f.write_char('{')?;
        let listed = (0..16).filter(|n| self.imm >> n & 1 != 0);
        for (i, number) in listed.enumerate() {
            write!(f, "{}{}", if i == 0 { "" } else { ", " }, core_name(number))?;
        }
        f.write_char('}')
    }

    fn float_list(&self, f: &mut Formatter<'_>, bank: char) -> fmt::Result {
        match (u32::from(self.d), self.imm) {
            (first, 1) => write!(f, "{{{bank}{first}}}"),
            (first, count) => write!(
                f,
                "{{{bank}{first}-{bank}{}}}",
                first.wrapping_add(count).wrapping_sub(1)
            ),
        }
    }

    fn barrier(&self, f: &mut Formatter<'_>) -> fmt::Result {
        if self.imm == 15 {
            f.write_str("sy")
        } else {
            write!(f, "#{}", self.imm)
        }
    }

    fn special(&self, f: &mut Formatter<'_>) -> fmt::Result {
        match special_name(self.imm as u8) {
            Some(name) => f.write_str(name),
            None => write!(f, "#{}", self.imm),
        }
    }

    /// The then-or-else letters and the first condition.
    fn it_block(&self, f: &mut Formatter<'_>) -> fmt::Result {
        let (firstcond, mask) = (self.imm >> 4, self.imm & 15);
        let more = 3_u32.saturating_sub(mask.trailing_zeros());
        for i in 0..more {
            let then = mask >> (3 - i) & 1 == firstcond & 1;
            f.write_char(if then { 't' } else { 'e' })?;
        }
        match crate::cond::Cond::from_bits(firstcond as u8) {
            Some(cond) => write!(f, " {}", cond.name()),
            None => f.write_str(" nv"),
        }
    }
}

fn suffix(f: &mut Formatter<'_>, wanted: bool, text: &str) -> fmt::Result {
    f.write_str(if wanted { text } else { "" })
}

/// A constant: bit patterns beyond a byte read better in hexadecimal.
fn constant(f: &mut Formatter<'_>, value: u32) -> fmt::Result {
    if value > 0xfff {
        write!(f, "#{value:#x}")
    } else {
        write!(f, "#{value}")
    }
}
