//! From the text of an instruction to its operands, by the table's syntax column: the inverse of
//! `text`.
//!
//! ```text
//!   row's syntax   "ldr{c}.w {t}, {mem}"          a part in braces is read by `operand`, everything else must be there
//!   text            ldr    r0, [r1, #8]
//! ```
//!
//! Every row is tried, 16-bit ones first, and the first whose operands encode is the answer; `.w`
//! and `.n` ask for a width. As in any UAL assembler two operands may stand for three (`adds r0,
//! #1`), and three for two of an encoding that has one register twice. Letters are lower case. Not
//! here: symbols, labels and directives.

mod operand;

use crate::arch::Arch;
use crate::cond::Cond;
use crate::encode::NotEncoded;
use crate::inst::Inst;
use crate::pattern::Field;
use crate::row::{Encoding, Form};
use crate::rules::Rule;
use crate::table::Op;
use alloc::format;
use alloc::string::{String, ToString};
use operand::Reader;

/// Why a text is no instruction.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum NotParsed {
    /// No instruction of that name.
    Mnemonic,
    /// Other operands than the instruction takes, which are written like this.
    Operands(&'static str),
    /// The condition is not that of the IT block the instruction stands in.
    Condition,
    /// The operands have no bits.
    Encoding(NotEncoded),
}

/// Other names of instructions, as other assemblers print them.
const SYNONYMS: &[(&str, &str)] = &[("ldmia", "ldm"), ("stmia", "stm")];

/// The instruction of a text in lower case, such as `adds r0, r1, #5`, with the condition that its
/// place in an IT block gives it, or none outside.
///
/// # Errors
/// The text is no instruction of `arch`, or does not belong into that block.
pub fn parse(text: &str, arch: Arch, it: Option<Cond>) -> Result<Inst, NotParsed> {
    let (mnemonic, operands) = text
        .trim()
        .split_once([' ', '\t'])
        .unwrap_or((text.trim(), ""));
    let (mnemonic, width) = match (mnemonic.strip_suffix(".w"), mnemonic.strip_suffix(".n")) {
        (Some(stem), _) => (stem, Some(4)),
        (_, Some(stem)) => (stem, Some(2)),
        _ => (mnemonic, None),
    };
    let mnemonic = SYNONYMS
        .iter()
        .find(|s| s.0 == mnemonic)
        .map_or(mnemonic, |s| s.1);
    let text = Text {
        mnemonic,
        operands: operands.split_whitespace().collect(),
        it,
    };
    let mut refused = NotParsed::Mnemonic;
    for size in [2, 4]
        .into_iter()
        .filter(|size| width.is_none_or(|width| width == *size))
    {
        for count in [Count::AsWritten, Count::Adapted] {
            // Most names begin otherwise, which is told from one letter.
            let first = |text: &str| text.bytes().next();
            let alike = |e: &Encoding| [Some(b'{'), first(mnemonic)].contains(&first(e.row().text));
            for encoding in Encoding::all().filter(|e| e.size() == size && alike(e)) {
                match text
                    .read(encoding, count)
                    .and_then(|inst| checked(inst, arch))
                {
                    Ok(inst) => return Ok(inst),
                    Err(why) => refused = worse(refused, why),
                }
            }
        }
    }
    Err(refused)
}

fn checked(inst: Inst, arch: Arch) -> Result<Inst, NotParsed> {
    // Of two 16-bit forms for one register and a small constant, assemblers take the one for larger
    // constants.
    let small = matches!(inst.op(), Op::ADD_immediate | Op::SUB_immediate)
        && inst.encoding.form() == Form::T1;
    if small && inst.d == inst.n {
        return Err(NotParsed::Mnemonic);
    }
    inst.encode(arch).map(|_| inst).map_err(NotParsed::Encoding)
}

/// The refusal that came furthest.
fn worse(a: NotParsed, b: NotParsed) -> NotParsed {
    let rank = |refused: &NotParsed| match refused {
        NotParsed::Mnemonic => 0,
        NotParsed::Operands(_) => 1,
        NotParsed::Condition => 2,
        NotParsed::Encoding(NotEncoded::Absent) => 3,
        NotParsed::Encoding(_) => 4,
    };
    if rank(&b) >= rank(&a) { b } else { a }
}

/// Whether operands are taken as written, or one more or one fewer.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Count {
    AsWritten,
    Adapted,
}

/// A text, its blanks between operands removed.
struct Text<'a> {
    mnemonic: &'a str,
    operands: String,
    it: Option<Cond>,
}

impl Text<'_> {
    fn read(&self, encoding: Encoding, count: Count) -> Result<Inst, NotParsed> {
        let row = encoding.row();
        if row.rules.has(Rule::ItBlock) {
            return operand::it_block(self.mnemonic, &self.operands, Inst::new(encoding))
                .ok_or(NotParsed::Mnemonic);
        }
        let stem = row.text.split(['{', '.', ' ']).next().unwrap_or("");
        if !self.mnemonic.starts_with(stem) {
            return Err(NotParsed::Mnemonic);
        }
        let (mnemonic, operands) = row.text.split_once(' ').unwrap_or((row.text, ""));
        let mnemonic = mnemonic.strip_suffix(".w").unwrap_or(mnemonic);
        let named = Reader::new(encoding)
            .mnemonic(mnemonic, self.mnemonic)
            .ok_or(NotParsed::Mnemonic)?;
        let operands: String = operands.split(' ').collect();
        let given = self
            .counted(encoding, &operands, count)
            .ok_or(NotParsed::Operands(row.text))?;
        let read = named
            .operands(&operands, &given)
            .ok_or(NotParsed::Operands(row.text))?;
        let spelled = read.cond.unwrap_or(Cond::AL);
        if row.pattern.has(Field::Cond) {
            return Ok(Inst {
                cond: Some(spelled),
                ..read.inst(row)
            });
        }
        if row.text.contains("{c}") && spelled != self.it.unwrap_or(Cond::AL) {
            return Err(NotParsed::Condition);
        }
        Ok(Inst {
            cond: self.it,
            ..read.inst(row)
        })
    }

    /// The operands in the number that the syntax has, if that is what `count` makes of them.
    fn counted(&self, encoding: Encoding, syntax: &str, count: Count) -> Option<String> {
        if count == Count::AsWritten {
            return Some(self.operands.clone());
        }
        let (first, rest) = self.operands.split_once(',')?;
        let rules = &encoding.row().rules;
        let three = ["{d},{n},", "{d},{m},#", "{d},sp,"]
            .iter()
            .any(|start| syntax.starts_with(start));
        match rest.split_once(',') {
            None if three => Some(format!("{first},{first},{rest}")),
            Some((second, _))
                if second == first && (rules.has(Rule::NIsD) || rules.has(Rule::DIsSp)) =>
            {
                Some(rest.to_string())
            }
            _ => None,
        }
    }
}
