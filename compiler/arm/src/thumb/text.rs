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

use super::allocate::{Allocated, Fixed, Placed};
use super::minst::{
    Access, AliasClass, Block, Func, MInst, Other, Reg, Relocation, Role, Terminator, VReg,
    template,
};
use super::registers::{HISTORY, RECORD, SAMPLES, STATE};
use std::fmt::{self, Display, Formatter};
use whippen_isa::Inst;
use whippen_isa::reg::core_name;

/// The column of comments.
const COMMENT: usize = 48;

impl Display for Func {
    fn fmt(&self, f: &mut Formatter) -> fmt::Result {
        for (index, block) in self.blocks.iter().enumerate() {
            write!(f, "block{index}{}", Registers(&block.params))?;
            head(f, block.rounds)?;
            block.fmt(f)?;
        }
        Ok(())
    }
}

impl Display for Block {
    fn fmt(&self, f: &mut Formatter) -> fmt::Result {
        for code in &self.code {
            line(f, &code.to_string(), code.access)?;
        }
        match &self.end {
            Terminator::Jump(edge) => {
                writeln!(f, "    jump block{}{}", edge.block, Registers(&edge.args))
            }
            Terminator::NextKey(code) => writeln!(f, "    next v{code}"),
            end => leave(f, end),
        }
    }
}

impl Display for Allocated {
    fn fmt(&self, f: &mut Formatter) -> fmt::Result {
        for (index, block) in self.blocks.iter().enumerate() {
            write!(f, "block{index}")?;
            head(f, block.rounds)?;
            block.fmt(f)?;
        }
        Ok(())
    }
}

impl Display for Placed {
    fn fmt(&self, f: &mut Formatter) -> fmt::Result {
        for fixed in &self.code {
            let access = fixed.code.map_or(Access::None, |code| code.access);
            line(f, &fixed.to_string(), access)?;
        }
        leave(f, &self.end)
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
        Access::None => writeln!(f, "    {text}"),
        Access::Read(place) | Access::Write(place) => {
            writeln!(f, "    {text:<width$}; {place}", width = COMMENT - 4)
        }
    }
}

/// An end without its values, which are in their registers.
fn leave(f: &mut Formatter, end: &Terminator) -> fmt::Result {
    match end {
        Terminator::Jump(edge) => writeln!(f, "    jump block{}", edge.block),
        Terminator::Branch {
            cond,
            yes,
            no,
            likely,
        } => {
            write!(f, "    branch {} block{yes} else block{no}", cond.name())?;
            match likely {
                Some(likely) => writeln!(f, " ; likely block{}", if *likely { yes } else { no }),
                None => writeln!(f),
            }
        }
        Terminator::NextKey(_) => writeln!(f, "    next"),
        Terminator::FallThrough => writeln!(f, "    falls through"),
    }
}

/// Virtual registers in brackets; nothing where there are none.
struct Registers<'a>(&'a [VReg]);

impl Display for Registers<'_> {
    fn fmt(&self, f: &mut Formatter) -> fmt::Result {
        let names: Vec<String> = self.0.iter().map(|reg| format!("v{reg}")).collect();
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
        }
    }
}

impl Display for Reg {
    fn fmt(&self, f: &mut Formatter) -> fmt::Result {
        match self {
            Reg::Virtual(reg) => write!(f, "v{reg}"),
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

impl Display for MInst {
    fn fmt(&self, f: &mut Formatter) -> fmt::Result {
        let mut names = Names::default();
        for u in self.uses() {
            let (reg, old) = (u.operand.reg, u.operand.old.map(Reg::Virtual));
            let fixed = (u.reads && matches!(reg, Reg::Fixed(_))).then_some(reg);
            names.0[u.role as usize] = match u.writes {
                true => Name {
                    read: old.or(fixed),
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
        f.write_str(&names.text(&self.inst, self.address, opcode.trim_end_matches(".w")))
    }
}

impl Display for Fixed {
    fn fmt(&self, f: &mut Formatter) -> fmt::Result {
        let address = self.code.and_then(|code| code.address);
        let names = match address {
            Some(Relocation::Routine(_)) => Names::of_call(),
            _ => Names::of_registers(self.inst),
        };
        f.write_str(&names.text(&self.inst, address, &opcode(&self.inst)))
    }
}

/// What an operand is called where it is read, and where it is written.
#[derive(Debug, Clone, Copy, Default)]
struct Name {
    read: Option<Reg>,
    written: Option<Reg>,
}

/// The names of all operands, by role.
#[derive(Debug, Default)]
struct Names([Name; Role::ALL.len()]);

impl Names {
    /// Operands in R0 and R1, the result in R0.
    fn of_call() -> Names {
        let mut names = Names::default();
        names.0[Role::N as usize].read = Some(Reg::Fixed(0));
        names.0[Role::M as usize].read = Some(Reg::Fixed(1));
        names.0[Role::D as usize].written = Some(Reg::Fixed(0));
        names
    }

    /// Those of an instruction with registers.
    fn of_registers(mut inst: Inst) -> Names {
        let numbered = numbered(&inst);
        let (reads, writes) = (numbered.uses().core_bits(), numbered.defs().core_bits());
        let mut names = Names::default();
        for role in Role::ALL {
            let reg = Some(Reg::Fixed(*role.of(&mut inst)));
            let writes = writes >> role as u16 & 1 != 0;
            let reads = reads >> role as u16 & 1 != 0 || writes && inst.is_conditional();
            names.0[role as usize] = Name {
                read: reg.filter(|_| reads),
                written: reg.filter(|_| writes),
            };
        }
        names
    }

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
            Some(Relocation::Low(table)) => replace_last(&mut rest, format!("#low(table {table})")),
            Some(Relocation::High(table)) => {
                replace_last(&mut rest, format!("#high(table {table})"))
            }
            Some(Relocation::Routine(routine)) => return self.call(routine.name()),
            None => {}
        }
        let equals = if results.is_empty() { "" } else { " = " };
        let text = format!("{}{equals}{opcode} {}", results.join(", "), rest.join(", "));
        text.trim_end().to_string()
    }

    fn call(&self, routine: &str) -> String {
        let name = |reg: Option<Reg>| reg.map_or_else(String::new, |reg| reg.to_string());
        let [d, n, m] = [Role::D, Role::N, Role::M].map(|role| self.0[role as usize]);
        let (d, n, m) = (name(d.written), name(n.read), name(m.read));
        format!("{d} = bl {routine}({n}, {m})")
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
        Fixed { inst, code: None }.to_string()
    }

    #[test]
    fn results_are_on_the_left_and_what_they_were_among_the_operands() {
        let sum = MInst::new(Op::SMLAL).reg(Role::N, 1).reg(Role::M, 2);
        let sum = sum.both(Role::D, 5, 3).both(Role::A, 6, 4);
        assert_eq!(sum.to_string(), "v5, v6 = smlal v3, v4, v1, v2");
        let only = MInst::new(Op::MOV_immediate)
            .imm(7)
            .both(Role::D, 2, 1)
            .only(Cond::EQ);
        assert_eq!(only.to_string(), "v2 = moveq v1, #7");
        let compared = MInst::new(Op::CMP_register)
            .reg(Role::N, 1)
            .with(Role::M, Reg::Fixed(STATE));
        assert_eq!(compared.to_string(), "cmp v1, STATE");
    }

    #[test]
    fn bases_that_go_on_are_written() {
        let mut next = MInst::new(Op::LDR_immediate)
            .reg(Role::T, 9)
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
        let short = Fixed {
            inst: Inst {
                encoding: short,
                ..multiply
            },
            code: None,
        };
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
            .both(Role::D, 3, 1)
            .reg(Role::M, 2);
        and.tied = Some(Role::N);
        assert_eq!(and.to_string(), "v3 = and v1, v2");
        let table = MInst {
            address: Some(Relocation::High(2)),
            ..MInst::new(Op::MOVT)
        };
        assert_eq!(
            table.both(Role::D, 4, 3).to_string(),
            "v4 = movt v3, #high(table 2)"
        );
    }
}
