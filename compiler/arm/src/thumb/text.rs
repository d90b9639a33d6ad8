//! Machine code as text: one instruction a line, results on the left, before and after register
//! allocation.
//!
//! ```text
//! block0:
//!     v3 = ldr [STATE, #28]                      ; constant
//!     v5 = smmlar v1, v2, v3
//!     v6 = moveq v4, v5                            v4 where the condition fails
//!     v7, RECORD = ldr [RECORD, #24]!            ; mode
//!     next v7
//! ```
//!
//! Opcodes and immediates are the text of `isa`; only the registers of its operands are replaced.
//! An operand that is read and written stands on both sides, as what it was and as what it becomes.
//! Before allocation the width of an encoding is open, so `.w` is left out. Behind a load or store
//! stands the memory that it may meet.

use super::func::{Block, Func, Terminator};
use super::minst::{
    Access, AliasClass, MInst, Other, PReg, Reg, Register, Relocation, Role, RowPlace, VReg,
    template,
};
use super::registers::{HISTORY, RECORD, SAMPLES, STATE};
use std::fmt::{self, Display, Formatter};
use whippen_isa::Inst;
use whippen_isa::reg::core_name;

/// The column of comments.
const COMMENT: usize = 48;

impl<R: Register> Display for Func<R> {
    fn fmt(&self, f: &mut Formatter) -> fmt::Result {
        for (id, block) in self.blocks.enumerated() {
            write!(f, "{id}{}", Values::<R>(&block.params))?;
            head(f, block.rounds)?;
            block.fmt(f)?;
        }
        Ok(())
    }
}

impl<R: Register> Display for Block<R> {
    fn fmt(&self, f: &mut Formatter) -> fmt::Result {
        for code in &self.code {
            line(f, &code.to_string(), code.access)?;
        }
        leave::<R>(f, &self.end)
    }
}

fn head(f: &mut Formatter, rounds: Option<u32>) -> fmt::Result {
    match rounds {
        Some(rounds) => writeln!(f, ": ; at most {rounds} rounds"),
        None => writeln!(f, ":"),
    }
}

fn line(f: &mut Formatter, text: &str, access: Access) -> fmt::Result {
    match access {
        // A word of the stack is among the operands.
        Access::None | Access::Read(AliasClass::Slot(_)) | Access::Write(AliasClass::Slot(_)) => {
            writeln!(f, "    {text}")
        }
        Access::Read(place) | Access::Write(place) => {
            writeln!(f, "    {text:<width$}; {place}", width = COMMENT - 4)
        }
        Access::Update([u, v]) => {
            let [u, v] = [u, v].map(AliasClass::Cell);
            writeln!(f, "    {text:<width$}; {u}, {v}", width = COMMENT - 4)
        }
    }
}

fn leave<R: Register>(f: &mut Formatter, end: &Terminator<R::Value>) -> fmt::Result {
    match end {
        Terminator::Jump(edge) => {
            writeln!(f, "    jump {}{}", edge.block, Values::<R>(&edge.args))
        }
        Terminator::Branch {
            cond,
            yes,
            no,
            likely,
        } => {
            write!(f, "    branch {} {yes} else {no}", cond.name())?;
            match likely {
                Some(likely) => writeln!(f, " ; likely {}", if *likely { yes } else { no }),
                None => writeln!(f),
            }
        }
        Terminator::NextKey(_) if R::IS_PHYSICAL => writeln!(f, "    next"),
        Terminator::NextKey(code) => writeln!(f, "    next {}", R::of_value(*code)),
        Terminator::FallThrough => writeln!(f, "    falls through"),
    }
}

/// Values in brackets; nothing where there are none.
struct Values<'a, R: Register>(&'a [R::Value]);

impl<R: Register> Display for Values<'_, R> {
    fn fmt(&self, f: &mut Formatter) -> fmt::Result {
        let names: Vec<String> = (self.0.iter())
            .map(|value| R::of_value(*value).to_string())
            .collect();
        if names.is_empty() {
            Ok(())
        } else {
            write!(f, "({})", names.join(", "))
        }
    }
}

impl Display for AliasClass {
    fn fmt(&self, f: &mut Formatter) -> fmt::Result {
        match self {
            AliasClass::Constant => f.write_str("constant"),
            AliasClass::Cell(cell) => write!(f, "cell {cell}"),
            AliasClass::Line(line) => write!(f, "line {line}"),
            AliasClass::Other(Other::Drive) => f.write_str("drive"),
            AliasClass::Other(Other::Probes) => f.write_str("probes"),
            AliasClass::Other(Other::Events) => f.write_str("events"),
            AliasClass::Other(Other::Mode) => f.write_str("mode"),
            AliasClass::Slot(at) => write!(f, "stack {at}"),
        }
    }
}

impl Display for RowPlace {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        match self.offset {
            0 => write!(f, "table {}", self.table),
            offset => write!(f, "table {} + {offset}", self.table),
        }
    }
}

impl Display for Reg {
    fn fmt(&self, f: &mut Formatter) -> fmt::Result {
        match self {
            Reg::Virtual(VReg(reg)) => write!(f, "v{reg}"),
            Reg::Fixed(reg) => f.write_str(register_name(*reg)),
        }
    }
}

/// A register by its role in the code of keys, if it has one.
pub(super) fn register_name(reg: u8) -> &'static str {
    match reg {
        STATE => "STATE",
        RECORD => "RECORD",
        SAMPLES => "SAMPLES",
        HISTORY => "HISTORY",
        other => core_name(other),
    }
}

impl Display for PReg {
    fn fmt(&self, f: &mut Formatter) -> fmt::Result {
        f.write_str(register_name(self.0))
    }
}

impl<R: Register> Display for MInst<R> {
    fn fmt(&self, f: &mut Formatter) -> fmt::Result {
        let mut names = Names(
            [Name {
                read: None,
                written: None,
            }; Role::ALL.len()],
        );
        for u in self.uses() {
            let reg = u.operand.reg;
            let old = u.operand.old.map(R::of_value);
            names.0[u.role as usize] = match u.writes {
                true => Name {
                    read: old.or(u.reads.then_some(reg)),
                    written: Some(reg),
                },
                false => Name {
                    read: Some(reg),
                    written: None,
                },
            };
        }
        if let Some(role) = self.tied {
            names.0[role as usize].read = names.0[Role::D as usize].read.take();
        }
        let opcode = opcode(&self.inst);
        let opcode = match R::IS_PHYSICAL {
            true => opcode.as_str(),
            false => opcode.trim_end_matches(".w"),
        };
        f.write_str(&names.text(&self.inst, self.address, opcode))
    }
}

/// What an operand is called where it is read, and where it is written.
#[derive(Debug, Clone, Copy)]
struct Name<R> {
    read: Option<R>,
    written: Option<R>,
}

/// The names of all operands, by role.
#[derive(Debug)]
struct Names<R>([Name<R>; Role::ALL.len()]);

impl<R: Register> Names<R> {
    /// `results = opcode operands`
    fn text(&self, inst: &Inst, address: Option<Relocation>, opcode: &str) -> String {
        let text = numbered(inst).to_string();
        let (_, operands) = text.split_once(' ').unwrap_or((&text, ""));
        let (mut results, mut rest) = (Vec::new(), Vec::new());
        for operand in operands.split(", ") {
            let role = role_of(operand).map(|(role, name)| (self.0[role as usize], name));
            let Some((name, number)) = role else {
                rest.push(operand.to_string());
                continue;
            };
            results.extend(name.written.map(|reg| reg.to_string()));
            rest.extend(
                name.read
                    .map(|reg| operand.replacen(number, &reg.to_string(), 1)),
            );
        }
        match address {
            Some(Relocation::Low(row)) => replace_last(&mut rest, format!("#low({row})")),
            Some(Relocation::High(row)) => replace_last(&mut rest, format!("#high({row})")),
            Some(Relocation::Routine(routine)) => return self.call(routine.name()),
            Some(Relocation::String(_)) => return self.call_string(),
            None => {}
        }
        let equals = if results.is_empty() { "" } else { " = " };
        let text = format!("{}{equals}{opcode} {}", results.join(", "), rest.join(", "));
        text.trim_end().to_string()
    }

    fn call(&self, routine: &str) -> String {
        let name = |reg: Option<R>| reg.map_or_else(String::new, |reg| reg.to_string());
        let [d, n, m] = [Role::D, Role::N, Role::M].map(|role| self.0[role as usize]);
        let (d, n, m) = (name(d.written), name(n.read), name(m.read));
        format!("{d} = bl {routine}({n}, {m})")
    }

    fn call_string(&self) -> String {
        let k = [Role::N, Role::M, Role::A, Role::T].map(|role| {
            let read = self.0[role as usize].read;
            read.map_or_else(String::new, |reg| reg.to_string())
        });
        format!("bl wave({})", k.join(", "))
    }
}

/// The first word of an instruction's text.
fn opcode(inst: &Inst) -> String {
    let text = inst.to_string();
    text.split(' ').next().unwrap_or_default().to_string()
}

fn replace_last(operands: &mut [String], with: String) {
    if let Some(last) = operands.last_mut() {
        *last = with;
    }
}

/// The instruction in the encoding that writes down every operand, with the number of its role in
/// the place of each register.
fn numbered(inst: &Inst) -> Inst {
    let mut numbered = Inst {
        encoding: template(inst.op()).encoding,
        ..*inst
    };
    for role in Role::ALL {
        *role.of(&mut numbered) = role as u8;
    }
    numbered
}

/// The role that a piece of an instruction's text stands for, and how it is written there.
fn role_of(operand: &str) -> Option<(Role, &str)> {
    let register = operand.trim_matches(['[', ']', '!']);
    let role = Role::ALL
        .into_iter()
        .find(|role| core_name(*role as u8) == register)?;
    Some((role, register))
}

#[cfg(test)]
mod tests {
    use super::*;
    use whippen_isa::{Cond, Encoding, Form, Op, ShiftType};

    fn fixed(inst: Inst) -> String {
        let inst = inst
            .shortest(whippen_isa::Arch::V8M)
            .expect("has an encoding");
        MInst::inserted(inst, Access::None).to_string()
    }

    #[test]
    fn results_are_on_the_left_and_what_they_were_among_the_operands() {
        let sum = MInst::new(Op::SMLAL)
            .reg(Role::N, VReg(1))
            .reg(Role::M, VReg(2));
        let sum = sum
            .both(Role::D, VReg(5), VReg(3))
            .both(Role::A, VReg(6), VReg(4));
        assert_eq!(sum.to_string(), "v5, v6 = smlal v3, v4, v1, v2");
        let only = MInst::new(Op::MOV_immediate)
            .imm(7)
            .both(Role::D, VReg(2), VReg(1))
            .only(Cond::EQ);
        assert_eq!(only.to_string(), "v2 = moveq v1, #7");
        let compared = MInst::new(Op::CMP_register)
            .reg(Role::N, VReg(1))
            .with(Role::M, Reg::Fixed(STATE));
        assert_eq!(compared.to_string(), "cmp v1, STATE");
    }

    #[test]
    fn bases_that_go_on_are_written() {
        let mut next = MInst::new(Op::LDR_immediate)
            .reg(Role::T, VReg(9))
            .with(Role::N, Reg::Fixed(RECORD));
        (next.inst.wback, next.inst.imm) = (true, 24);
        assert_eq!(next.to_string(), "v9, RECORD = ldr [RECORD, #24]!");
        next.inst.index = false;
        assert_eq!(next.to_string(), "v9, RECORD = ldr [RECORD], #24");
    }

    #[test]
    fn encodings_of_two_operands_say_all_three() {
        let multiply = Inst {
            d: 1,
            n: 2,
            m: 1,
            s: true,
            ..template(Op::MUL)
        };
        let short = Encoding::new(Op::MUL, Form::T1).expect("has one");
        let short = Inst {
            encoding: short,
            ..multiply
        };
        let short = MInst::inserted(short, Access::None);
        assert_eq!(short.to_string(), "r1 = muls r2, r1");
        let add = Inst {
            d: 3,
            n: 3,
            m: 12,
            ..template(Op::ADD_register)
        };
        assert_eq!(fixed(add), "r3 = add r3, r12");
        let far = Inst {
            m: 1,
            amount: 4,
            shift: ShiftType::ASR,
            ..add
        };
        assert_eq!(fixed(far), "r3 = add.w r3, r1, asr #4");
    }

    #[test]
    fn tied_roles_and_addresses_have_names() {
        let mut and = MInst::new(Op::AND_register)
            .both(Role::D, VReg(3), VReg(1))
            .reg(Role::M, VReg(2));
        and.tied = Some(Role::N);
        assert_eq!(and.to_string(), "v3 = and v1, v2");
        let table = MInst {
            address: Some(Relocation::High(RowPlace {
                table: 2,
                offset: 64,
            })),
            ..MInst::new(Op::MOVT)
        };
        assert_eq!(
            table.both(Role::D, VReg(4), VReg(3)).to_string(),
            "v4 = movt v3, #high(table 2 + 64)"
        );
    }
}
