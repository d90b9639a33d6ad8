//! The parts of a syntax, each read from the start of what is left of a text; blanks are gone from
//! both.

use crate::cond::Cond;
use crate::imm::ShiftType;
use crate::inst::Inst;
use crate::reg::{core_name, special_name};
use crate::row::{Encoding, Row};
use crate::rules::Rule;

/// What has been read so far.
#[derive(Clone, Copy)]
pub(super) struct Reader {
    inst: Inst,
    /// The condition at the end of the mnemonic.
    pub cond: Option<Cond>,
    /// Registers by letter that have been named: the same letter again must name the same.
    named: u32,
}

/// Words that a part of a mnemonic may be, by its name in the syntax; the number is what `imm` or
/// `amount` becomes.
const WORDS: &[(&str, &[&str])] = &[
    ("s", &["", "s"]),
    ("x", &["", "x"]),
    ("r", &["", "r"]),
    ("l", &["", "l"]),
    ("e", &["", "e"]),
    ("y", &["b", "t"]),
    ("xy", &["bb", "bt", "tb", "tt"]),
    ("us", &["u", "s"]),
    ("anpm", &["a", "n", "p", "m"]),
    ("sel", &["eq", "vs", "ge", "gt"]),
    ("fixed", &["s16", "s32", "u16", "u32"]),
    ("ie", &["ie", "id"]),
    ("if", &["", "f", "i", "if"]),
    ("bits", &["", "_g", "_nzcvq", "_nzcvqg"]),
];

impl Reader {
    pub fn new(encoding: Encoding) -> Self {
        Self {
            inst: Inst::new(encoding),
            cond: None,
            named: 0,
        }
    }

    /// The instruction, with the operands that follow from others.
    pub fn inst(mut self, row: &Row) -> Inst {
        if row.rules.has(Rule::NIsD) {
            self.inst.n = self.inst.d;
        }
        if row.rules.has(Rule::MIsD) {
            self.inst.m = self.inst.d;
        }
        if row.rules.has(Rule::SpecialMask) && !row.text.contains("{bits}") {
            self.inst.amount = 2;
        }
        if row.rules.has(Rule::SetsFlagsOutsideIt) && !row.text.contains("{s}") {
            self.inst.s = self.inst.cond.is_none();
        }
        self.inst
    }

    /// Reads a whole mnemonic; its parts are words of which the first that leads to the end is
    /// right.
    pub fn mnemonic(self, syntax: &str, text: &str) -> Option<Self> {
        let Some((before, rest)) = syntax.split_once('{') else {
            return (syntax == text).then_some(self);
        };
        let text = text.strip_prefix(before)?;
        let (name, rest) = rest.split_once('}')?;
        if name == "c" {
            return conditions(text)
                .find_map(|(cond, text)| Self { cond, ..self }.mnemonic(rest, text));
        }
        let words = WORDS.iter().find(|(part, _)| *part == name)?.1;
        words.iter().enumerate().find_map(|(number, word)| {
            let mut next = self;
            next.number(name, number as u32);
            next.mnemonic(rest, text.strip_prefix(word)?)
        })
    }

    /// Reads all operands.
    pub fn operands(mut self, mut syntax: &str, mut text: &str) -> Option<Self> {
        while let Some((before, rest)) = syntax.split_once('{') {
            text = text.strip_prefix(before)?;
            let (name, rest) = rest.split_once('}')?;
            text = self.part(name, text)?;
            syntax = rest;
        }
        (syntax == text).then_some(self)
    }

    /// A word of a mnemonic.
    fn number(&mut self, name: &str, number: u32) {
        match name {
            "s" => self.inst.s = number != 0,
            "l" | "e" | "anpm" | "fixed" | "if" | "bits" => self.inst.amount = number as u8,
            _ => self.inst.imm = number,
        }
    }

    /// One operand; what is left of the text after it.
    fn part<'t>(&mut self, name: &str, text: &'t str) -> Option<&'t str> {
        match name {
            "d" | "n" | "m" | "a" | "t" | "t2" => self.core(name, text),
            "i" => self.store(unsigned(text)?),
            "k" => {
                let (value, rest) = unsigned(text)?;
                self.inst.amount = u8::try_from(value).ok()?;
                Some(rest)
            }
            "w" => {
                self.inst.wback = text.starts_with('!');
                Some(text.strip_prefix('!').unwrap_or(text))
            }
            "const" => self.store(signed(text.strip_prefix('#')?)?),
            "shift" => self.shift(text),
            "mem" => self.memory(text),
            "lit" => self.literal(text.strip_prefix("[pc")?),
            "to" => {
                let (value, rest) = signed(text.strip_prefix('.')?)?;
                self.store((value.wrapping_sub(4), rest))
            }
            "list" => self.store(core_list(text)?),
            "special" => self.special(text),
            "barrier" => self.barrier(text),
            "hint" | "option" => {
                let (value, rest) = unsigned(text.strip_prefix('{')?)?;
                self.store((value, rest.strip_prefix('}')?))
            }
            "if" | "bits" => self.word(name, text),
            "float" => self.float(text.strip_prefix('#')?),
            _ => self.extension(name, text),
        }
    }

    fn store<'t>(&mut self, (value, rest): (u32, &'t str)) -> Option<&'t str> {
        self.inst.imm = value;
        Some(rest)
    }

    /// A core register into the slot of that letter.
    fn core<'t>(&mut self, name: &str, text: &'t str) -> Option<&'t str> {
        let (number, rest) = register(text)?;
        self.slot(name, number)?;
        Some(rest)
    }

    /// Nothing when the slot has been given another register before.
    fn slot(&mut self, name: &str, number: u8) -> Option<()> {
        let (slot, bit) = match name {
            "d" => (&mut self.inst.d, 1),
            "n" => (&mut self.inst.n, 2),
            "m" => (&mut self.inst.m, 4),
            "a" => (&mut self.inst.a, 8),
            "t" => (&mut self.inst.t, 16),
            _ => (&mut self.inst.t2, 32),
        };
        let again = self.named & bit != 0;
        self.named |= bit;
        (!again || *slot == number).then(|| *slot = number)
    }

    fn shift<'t>(&mut self, text: &'t str) -> Option<&'t str> {
        if let Some(rest) = text.strip_prefix(",rrx") {
            (self.inst.shift, self.inst.amount) = (ShiftType::RRX, 1);
            return Some(rest);
        }
        let kinds = [
            ShiftType::LSL,
            ShiftType::LSR,
            ShiftType::ASR,
            ShiftType::ROR,
        ];
        let spelled = |kind: &ShiftType| {
            Some((
                *kind,
                text.strip_prefix(',')?
                    .strip_prefix(kind.name())?
                    .strip_prefix('#')?,
            ))
        };
        let Some((kind, amount)) = kinds.iter().find_map(spelled) else {
            return Some(text);
        };
        let (amount, rest) = unsigned(amount)?;
        (self.inst.shift, self.inst.amount) = (kind, u8::try_from(amount).ok()?);
        Some(rest)
    }

    /// `[n]`, `[n, #i]`, `[n, #i]!` and `[n], #i`.
    fn memory<'t>(&mut self, text: &'t str) -> Option<&'t str> {
        let rest = self.core("n", text.strip_prefix('[')?)?;
        if let Some(rest) = rest.strip_prefix("],#") {
            (self.inst.index, self.inst.wback) = (false, true);
            return self.offset(rest);
        }
        if let Some(rest) = rest.strip_prefix(']') {
            self.inst.add = true;
            return Some(rest);
        }
        let rest = self.offset(rest.strip_prefix(",#")?)?.strip_prefix(']')?;
        self.inst.wback = rest.starts_with('!');
        Some(rest.strip_prefix('!').unwrap_or(rest))
    }

    fn literal<'t>(&mut self, text: &'t str) -> Option<&'t str> {
        self.offset(text.strip_prefix(",#")?)?.strip_prefix(']')
    }

    fn offset<'t>(&mut self, text: &'t str) -> Option<&'t str> {
        self.inst.add = !text.starts_with('-');
        self.store(unsigned(text.strip_prefix('-').unwrap_or(text))?)
    }

    /// The longest name that fits.
    fn special<'t>(&mut self, text: &'t str) -> Option<&'t str> {
        let names = (0..=u8::MAX).filter_map(|number| Some((number, special_name(number)?)));
        let (number, name) = names
            .filter(|(_, name)| text.starts_with(name))
            .max_by_key(|(_, name)| name.len())?;
        self.store((u32::from(number), &text[name.len()..]))
    }

    fn barrier<'t>(&mut self, text: &'t str) -> Option<&'t str> {
        match text.strip_prefix("sy") {
            Some(rest) => self.store((15, rest)),
            None => self.store(unsigned(text.strip_prefix('#')?)?),
        }
    }

    /// The longest word that fits.
    fn word<'t>(&mut self, name: &str, text: &'t str) -> Option<&'t str> {
        let words = WORDS
            .iter()
            .find(|(part, _)| *part == name)?
            .1
            .iter()
            .enumerate();
        let (number, word) = words
            .filter(|(_, word)| text.starts_with(**word))
            .max_by_key(|(_, word)| word.len())?;
        self.number(name, number as u32);
        Some(&text[word.len()..])
    }

    fn float<'t>(&mut self, text: &'t str) -> Option<&'t str> {
        let value: f32 = text.parse().ok()?;
        self.store((value.to_bits(), ""))
    }

    /// Registers of the floating-point unit and of coprocessors.
    fn extension<'t>(&mut self, name: &str, text: &'t str) -> Option<&'t str> {
        let (bank, slot) = match name {
            "Sd" => ('s', "d"),
            "Sn" => ('s', "n"),
            "Sm" => ('s', "m"),
            "Dd" => ('d', "d"),
            "Dm" => ('d', "m"),
            "cp" => ('p', "a"),
            "Cd" => ('c', "d"),
            "Cn" => ('c', "n"),
            "Cm" => ('c', "m"),
            "Sm2" => {
                let (second, rest) = unsigned(text.strip_prefix('s')?)?;
                return (second == u32::from(self.inst.m) + 1).then_some(rest);
            }
            "halfd" | "halfm" => return self.half(&name[4..], text),
            "Slist" => return self.float_list('s', text),
            "Dlist" => return self.float_list('d', text),
            _ => return None,
        };
        let (number, rest) = unsigned(text.strip_prefix(bank)?)?;
        self.slot(slot, u8::try_from(number).ok()?)?;
        Some(rest)
    }

    /// `d3[1]`: the single register in that half.
    fn half<'t>(&mut self, slot: &str, text: &'t str) -> Option<&'t str> {
        let (double, rest) = unsigned(text.strip_prefix('d')?)?;
        let (half, rest) = unsigned(rest.strip_prefix('[')?)?;
        self.slot(
            slot,
            u8::try_from(double.checked_mul(2)?.checked_add(half.min(2))?)
                .ok()
                .filter(|_| half < 2)?,
        )?;
        rest.strip_prefix(']')
    }

    /// `{s3}` or `{s3-s5}`.
    fn float_list<'t>(&mut self, bank: char, text: &'t str) -> Option<&'t str> {
        let (first, rest) = unsigned(text.strip_prefix('{')?.strip_prefix(bank)?)?;
        let (last, rest) = match rest.strip_prefix('-') {
            Some(rest) => unsigned(rest.strip_prefix(bank)?)?,
            None => (first, rest),
        };
        self.inst.d = u8::try_from(first).ok()?;
        self.inst.imm = last.checked_sub(first)?.checked_add(1)?;
        rest.strip_prefix('}')
    }
}

/// The ways to read a condition at the start of a text, none included.
fn conditions(text: &str) -> impl Iterator<Item = (Option<Cond>, &str)> {
    let second = [("hs", Cond::CS), ("lo", Cond::CC)];
    let names = Cond::ALL
        .into_iter()
        .map(|cond| (cond.name(), cond))
        .chain(second);
    let spelled =
        names.filter_map(move |(name, cond)| Some((Some(cond), text.strip_prefix(name)?)));
    spelled.chain([(None, text)])
}

/// The condition of that name.
fn condition(name: &str) -> Option<Cond> {
    conditions(name).find(|(_, rest)| rest.is_empty())?.0
}

/// IT with the letters of its block.
pub(super) fn it_block(mnemonic: &str, first: &str, inst: Inst) -> Option<Inst> {
    let letters = mnemonic
        .strip_prefix("it")
        .filter(|letters| letters.len() <= 3)?;
    let cond = u32::from(condition(first)?.bits());
    let mut mask = 0;
    for letter in letters.bytes() {
        let then = match letter {
            b't' => true,
            b'e' => false,
            _ => return None,
        };
        mask = mask << 1 | if then { cond & 1 } else { cond & 1 ^ 1 };
    }
    let mask = (mask << 1 | 1) << (3 - letters.len());
    Some(Inst {
        imm: cond << 4 | mask,
        ..inst
    })
}

/// A core register and what follows it.
fn register(text: &str) -> Option<(u8, &str)> {
    let end = text
        .find(|c: char| !c.is_ascii_alphanumeric())
        .unwrap_or(text.len());
    let (name, rest) = text.split_at(end);
    let number = (0..16).find(|number| core_name(*number) == name)?;
    Some((number, rest))
}

/// `{r0,r4-r7,lr}` as bits.
fn core_list(text: &str) -> Option<(u32, &str)> {
    let (list, rest) = text.strip_prefix('{')?.split_once('}')?;
    let mut bits = 0;
    for part in list.split(',') {
        let (first, more) = register(part)?;
        let (last, end) = match more.strip_prefix('-') {
            Some(more) => register(more)?,
            None => (first, more),
        };
        if last < first || !end.is_empty() {
            return None;
        }
        bits |= (first..=last).fold(0, |bits, number| bits | 1 << number);
    }
    Some((bits, rest))
}

/// A number, decimal or hexadecimal, and what follows it; a `#` before it is skipped.
fn unsigned(text: &str) -> Option<(u32, &str)> {
    let text = text.strip_prefix('#').unwrap_or(text);
    let (digits, radix) = text.strip_prefix("0x").map_or((text, 10), |hex| (hex, 16));
    let end = digits
        .find(|c: char| !c.is_digit(radix))
        .unwrap_or(digits.len());
    Some((
        u32::from_str_radix(&digits[..end], radix).ok()?,
        &digits[end..],
    ))
}

/// A number with or without a sign, as its 32 bits.
fn signed(text: &str) -> Option<(u32, &str)> {
    match text.strip_prefix('-') {
        Some(text) => unsigned(text).map(|(value, rest)| (value.wrapping_neg(), rest)),
        None => unsigned(text.strip_prefix('+').unwrap_or(text)),
    }
}
