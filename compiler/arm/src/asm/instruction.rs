//! An instruction's text, with holes where expressions stand, and what it becomes once they are
//! known.

use whippen_isa::imm::thumb_shrink_imm;
use whippen_isa::{Arch, Code, Cond, Inst, NotEncoded, NotParsed};

use super::expr::{Expr, Value};
use super::item::AssemblyUnit;
use crate::features::Features;
use crate::image::FixupKind;

/// An instruction as written.
#[derive(Debug)]
pub struct Instruction {
    /// Its name, in lower case, without `.w` and `.n`.
    mnemonic: String,
    /// `.w`, `.n` or nothing.
    width: &'static str,
    pieces: Vec<Piece>,
}

/// A part of the operands.
#[derive(Debug)]
enum Piece {
    Text(String),
    /// `#number`
    Constant(Expr),
    /// Where a branch goes.
    Branch(Expr),
    /// A place near the instruction, as a distance from PC.
    Near(Expr),
    /// A literal: number of the pool, number in it.
    Literal(usize, usize),
    /// The low or high half of an address.
    Half(bool, Expr),
}

/// An address to be filled in: how, of which symbol, plus how much.
pub type Wanted = (FixupKind, String, i64);

/// An instruction with its operands, and the place in it that waits for an address.
pub struct Encoded {
    pub code: Code,
    pub inst: Inst,
    pub fixup: Option<Wanted>,
}

impl Instruction {
    /// Reads the text of an instruction.
    ///
    /// # Errors
    /// An expression is none.
    pub fn read(
        unit: &mut AssemblyUnit,
        mnemonic: &str,
        operands: &str,
    ) -> Result<Instruction, String> {
        let (mnemonic, width) = match (mnemonic.strip_suffix(".w"), mnemonic.strip_suffix(".n")) {
            (Some(stem), _) => (stem, ".w"),
            (_, Some(stem)) => (stem, ".n"),
            _ => (mnemonic, ""),
        };
        let with = |mnemonic: &str, pieces| {
            Ok(Instruction {
                mnemonic: mnemonic.to_string(),
                width,
                pieces,
            })
        };
        let (first, last) = operands
            .rsplit_once(',')
            .map_or(("", operands.trim()), |(a, b)| (a, b.trim()));
        let to_register = |after: &str| Piece::Text(format!("{}{after}", first.to_lowercase()));
        if is_branch(mnemonic) {
            let before = if first.is_empty() {
                Piece::Text(String::new())
            } else {
                to_register(", ")
            };
            return with(mnemonic, vec![before, Piece::Branch(unit.expr(last)?)]);
        }
        if let Some(value) = last.strip_prefix('=') {
            return literal(unit, mnemonic, width, first, value);
        }
        let condition = mnemonic
            .strip_prefix("adr")
            .filter(|rest| rest.is_empty() || condition(rest));
        if let Some(condition) = condition {
            let pieces = vec![to_register(", pc, "), Piece::Near(unit.expr(last)?)];
            return with(&format!("add{condition}"), pieces);
        }
        if mnemonic.starts_with("ldr") && !last.starts_with(['[', '#']) && !last.ends_with(']') {
            let pieces = vec![
                to_register(", [pc, "),
                Piece::Near(unit.expr(last)?),
                Piece::Text("]".to_string()),
            ];
            return with(mnemonic, pieces);
        }
        with(mnemonic, holes(unit, operands)?)
    }

    /// The instruction by the present layout; `.w` where it has become wide.
    ///
    /// # Errors
    /// It is no instruction of the architecture, or out of reach.
    pub fn encode(
        &self,
        unit: &AssemblyUnit,
        at: (usize, usize),
        it: Option<Cond>,
    ) -> Result<Encoded, String> {
        let (section, item) = at;
        let placed = &unit.sections[section].items[item];
        let mut text = self.mnemonic.clone();
        text += if placed.size == 4 { ".w" } else { self.width };
        text.push(' ');
        let mut fixup = None;
        for piece in &self.pieces {
            let (part, waits) = piece.render(unit, at, i64::from(placed.offset))?;
            text += &part;
            fixup = fixup.or(waits);
        }
        if fixup.is_some() && self.is_jump() {
            text = text
                .replacen(&self.mnemonic, &format!("{}.w", self.mnemonic), 1)
                .replace(".w.w", ".w");
        }
        let inst = read(&text, unit.arch, it)?;
        let code = inst
            .encode(unit.arch)
            .map_err(|_| format!("`{text}` has no bits"))?;
        Ok(Encoded { code, inst, fixup })
    }

    /// Whether it is B, whose 16-bit form cannot wait for an address.
    fn is_jump(&self) -> bool {
        self.mnemonic
            .strip_prefix('b')
            .is_some_and(|rest| rest.is_empty() || condition(rest))
    }
}

impl Piece {
    fn render(
        &self,
        unit: &AssemblyUnit,
        (section, item): (usize, usize),
        here: i64,
    ) -> Result<(String, Option<Wanted>), String> {
        let find = |name: &str| unit.find(name, section, item);
        let near = |offset: i64| format!("#{}", offset - ((here + 4) & !3));
        Ok(match self {
            Piece::Text(text) => (text.clone(), None),
            Piece::Constant(expr) => (format!("#{}", expr.value(&find)?.number()?), None),
            Piece::Branch(expr) => match expr.value(&find)? {
                Value::Place {
                    section: s,
                    offset,
                    label,
                    ..
                } if s == section && !unit.globals.contains(&label) => {
                    (format!(".{:+}", offset - here), None)
                }
                Value::Place { label, addend, .. } | Value::Outside(label, addend) => (
                    ".+4".to_string(),
                    Some((FixupKind::ThumbJump24, label, addend)),
                ),
                Value::Number(_) => return Err("a branch goes to a label".to_string()),
            },
            Piece::Near(expr) => match expr.value(&find)? {
                Value::Place {
                    section: s, offset, ..
                } if s == section => (near(offset), None),
                _ => {
                    return Err(
                        "the place must be in this section; write `ldr r0, =name` for another"
                            .to_string(),
                    );
                }
            },
            Piece::Literal(pool, number) => {
                (near(unit.literal_offset(section, *pool, *number)), None)
            }
            Piece::Half(high, expr) => match expr.value(&find)? {
                Value::Number(n) => (
                    format!("#{}", if *high { n >> 16 & 0xffff } else { n & 0xffff }),
                    None,
                ),
                Value::Place { label, addend, .. } | Value::Outside(label, addend) => {
                    let kind = if *high {
                        FixupKind::MovtAbs
                    } else {
                        FixupKind::MovwAbs
                    };
                    ("#0".to_string(), Some((kind, label, addend)))
                }
            },
        })
    }
}

/// B, BL, CBZ, CBNZ.
fn is_branch(mnemonic: &str) -> bool {
    let rest = mnemonic
        .strip_prefix("bl")
        .filter(|rest| rest.is_empty() || condition(rest));
    let rest = rest.or(mnemonic.strip_prefix('b'));
    rest.is_some_and(|rest| rest.is_empty() || condition(rest))
        || matches!(mnemonic, "cbz" | "cbnz")
}

fn condition(name: &str) -> bool {
    Cond::ALL.iter().any(|cond| cond.name() == name) || matches!(name, "hs" | "lo")
}

/// `ldr r0, =value`: a move where one can do it, else a literal.
fn literal(
    unit: &mut AssemblyUnit,
    mnemonic: &str,
    width: &'static str,
    register: &str,
    value: &str,
) -> Result<Instruction, String> {
    let suffix = mnemonic
        .strip_prefix("ldr")
        .filter(|rest| rest.is_empty() || condition(rest));
    let suffix = suffix.ok_or("only `ldr` loads a value")?;
    let value = unit.expr(value)?;
    let register = register.trim().to_lowercase();
    // Where a move of a constant changes the flags, it is loaded.
    if let Expr::Number(n) = value
        && Features::of(unit.arch).keeps_flags
    {
        let bits = n as u32;
        let moves = [("mov", ".w", bits), ("mvn", "", !bits)];
        let by = moves
            .into_iter()
            .find(|(_, _, bits)| thumb_shrink_imm(*bits).is_some());
        let by = by.or((bits <= 0xffff).then_some(("movw", "", bits)));
        if let Some((name, width, bits)) = by {
            let pieces = vec![Piece::Text(format!("{register}, #{bits}"))];
            return Ok(Instruction {
                mnemonic: format!("{name}{suffix}"),
                width,
                pieces,
            });
        }
    }
    let value = if let Expr::Number(n) = value {
        Expr::Number(i64::from(n as u32))
    } else {
        value
    };
    let (pool, number) = unit.literal(value);
    let text = Piece::Text(format!("{register}, [pc, "));
    let pieces = vec![
        text,
        Piece::Literal(pool, number),
        Piece::Text("]".to_string()),
    ];
    Ok(Instruction {
        mnemonic: mnemonic.to_string(),
        width,
        pieces,
    })
}

/// Splits operands at `#`, behind which an expression stands as far as the operand goes.
fn holes(unit: &AssemblyUnit, operands: &str) -> Result<Vec<Piece>, String> {
    let mut pieces = Vec::new();
    let mut rest = operands;
    while let Some((before, after)) = rest.split_once('#') {
        pieces.push(Piece::Text(before.to_lowercase()));
        let after = after.trim_start();
        let half = [(":lower16:", false), (":upper16:", true)];
        if let Some((name, high)) = half
            .iter()
            .find_map(|(mark, high)| Some((after.strip_prefix(mark)?, *high)))
        {
            pieces.push(Piece::Half(high, unit.expr(name)?));
            return Ok(pieces);
        }
        let end = end_of(after);
        let (expr, then) = after.split_at(end);
        if expr.trim() == "-0" || expr.contains('.') && expr.trim().parse::<f32>().is_ok() {
            pieces.push(Piece::Text(format!("#{}", expr.trim())));
        } else {
            pieces.push(Piece::Constant(unit.expr(expr)?));
        }
        rest = then;
    }
    pieces.push(Piece::Text(rest.to_lowercase()));
    Ok(pieces)
}

/// Where an operand ends: at a comma or a bracket that it did not open.
fn end_of(text: &str) -> usize {
    let mut depth = 0;
    for (at, c) in text.char_indices() {
        match c {
            '(' => depth += 1,
            ')' => depth -= 1,
            ',' | ']' | '}' if depth == 0 => return at,
            _ => {}
        }
    }
    text.len()
}

fn read(text: &str, arch: Arch, it: Option<Cond>) -> Result<Inst, String> {
    whippen_isa::parse(text, arch, it).map_err(|why| match why {
        NotParsed::Mnemonic => format!("`{}` is no instruction", text.split(' ').next().unwrap_or(text)),
        NotParsed::Operands(syntax) => format!("`{text}` has other operands than `{syntax}`"),
        NotParsed::Condition => match it {
            Some(cond) => format!("in this place of the IT block the condition is `{}`", cond.name()),
            None => format!("`{text}` is conditional, and no `it` stands before it"),
        },
        NotParsed::Encoding(NotEncoded::DoesNotFit { nearest }) => {
            format!("`{text}` has no bits: an operand does not fit; the nearest that does is `{nearest}`")
        }
        NotParsed::Encoding(NotEncoded::Unpredictable(why)) => format!("`{text}` is unpredictable: {why:?}"),
        NotParsed::Encoding(NotEncoded::Absent) => format!("`{text}` is no instruction of this core"),
        NotParsed::Encoding(NotEncoded::Shadowed { .. }) => format!("`{text}` has no bits of its own"),
    })
}
