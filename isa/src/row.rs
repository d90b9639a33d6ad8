//! One row of the table, parsed, and the checks over all rows that run while the crate is compiled.

use crate::arch::Arch;
use crate::class::Class;
use crate::effects::Effects;
use crate::pattern::Pattern;
use crate::rules::OperandRules;
use crate::table::{Op, ROWS};
use core::fmt;

/// The manual's number of an encoding within its instruction.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug, PartialOrd, Ord)]
#[repr(u8)]
#[expect(missing_docs, reason = "numbers")]
pub enum Form {
    T1,
    T2,
    T3,
    T4,
}

/// A row: everything the table says about one encoding.
#[derive(Debug)]
pub(crate) struct Row {
    pub op: Op,
    pub form: Form,
    pub since: Arch,
    pub class: Class,
    pub effects: Effects,
    pub pattern: Pattern,
    pub text: &'static str,
    pub rules: OperandRules,
}

impl Row {
    /// Parses the columns of a line; panics, which is a build error in a constant, at a malformed
    /// one.
    #[expect(clippy::too_many_arguments, reason = "the columns of the table")]
    pub const fn new(
        op: Op,
        form: Form,
        since: Arch,
        class: Class,
        effects: &str,
        picture: &str,
        text: &'static str,
        rules: &str,
    ) -> Self {
        let (pattern, rules) = (Pattern::parse(picture), OperandRules::parse(rules));
        Self {
            op,
            form,
            since,
            class,
            effects: Effects::parse(effects),
            pattern,
            text,
            rules,
        }
    }

    const fn overlaps(&self, other: &Self) -> bool {
        let (a, b) = (&self.pattern, &other.pattern);
        let (mask, bits) = (a.mask | b.mask, a.bits | b.bits);
        a.wide == b.wide
            && (a.bits ^ b.bits) & a.mask & b.mask == 0
            && !self.rules.excludes_all(a, mask, bits)
            && !other.rules.excludes_all(b, mask, bits)
    }
}

/// One encoding of one instruction: a row of the table.
#[derive(Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Encoding(u16);

impl Encoding {
    /// How many encodings there are.
    pub const COUNT: usize = ROWS.len();

    /// The encoding of `op` with this number, or nothing when the manual has none.
    pub const fn new(op: Op, form: Form) -> Option<Self> {
        let mut i = FIRST[op as usize];
        while (i as usize) < ROWS.len() && ROWS[i as usize].op as u16 == op as u16 {
            if ROWS[i as usize].form as u8 == form as u8 {
                return Some(Self(i));
            }
            i += 1;
        }
        None
    }

    /// All encodings, in the order of the table.
    pub fn all() -> impl Iterator<Item = Self> {
        (0..ROWS.len() as u16).map(Self)
    }

    /// The encodings of an instruction: 16-bit ones first.
    pub fn of(op: Op) -> impl Iterator<Item = Self> {
        (FIRST[op as usize]..ROWS.len() as u16)
            .map(Self)
            .take_while(move |e| e.op() == op)
    }

    /// The instruction.
    pub fn op(self) -> Op {
        self.row().op
    }

    /// The manual's number.
    pub fn form(self) -> Form {
        self.row().form
    }

    /// The class.
    pub fn class(self) -> Class {
        self.row().class
    }

    /// 2 or 4 bytes.
    pub fn size(self) -> u32 {
        if self.row().pattern.wide { 4 } else { 2 }
    }

    /// The places of its words that do not vary, and their values; 16 bits wide or, the first
    /// halfword on top, 32.
    pub fn fixed_bits(self) -> (u32, u32) {
        let p = &self.row().pattern;
        (p.mask | p.should_mask, p.bits | p.should_bits)
    }

    /// Whether `arch` has the encoding.
    pub fn exists_in(self, arch: Arch) -> bool {
        self.row().since <= arch
    }

    /// Whether the instruction may stand in an IT block.
    pub fn it_rule(self) -> ItRule {
        use crate::rules::Rule;
        let rules = &self.row().rules;
        if rules.has(Rule::NotInIt) {
            ItRule::Never
        } else if rules.has(Rule::LastInIt) {
            ItRule::Last
        } else if rules.has(Rule::LastInItIfPc) {
            ItRule::LastIfPc
        } else {
            ItRule::Anywhere
        }
    }

    pub(crate) fn row(self) -> &'static Row {
        &ROWS[self.0 as usize]
    }

    /// The encoding that reads `word`, or nothing when it is UNDEFINED.
    pub(crate) fn find(word: u32, wide: bool, arch: Arch) -> Option<Self> {
        let group = group(word, wide);
        let candidates = &CANDIDATES[STARTS[group] as usize..STARTS[group + 1] as usize];
        let matching = candidates.iter().filter(|c| word & c.mask == c.bits);
        matching.map(|c| Self(c.row)).find(|e| {
            let row = e.row();
            row.since <= arch && !row.rules.excludes(&row.pattern, word)
        })
    }
}

/// Where an instruction may stand in an IT block.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
pub enum ItRule {
    /// Anywhere.
    Anywhere,
    /// Only as the last one.
    Last,
    /// Only as the last one when it writes PC.
    LastIfPc,
    /// Not at all.
    Never,
}

/// As in `ADD (register) T3`.
impl fmt::Display for Encoding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} {:?}", self.op(), self.form())
    }
}

impl fmt::Debug for Encoding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Display::fmt(self, f)
    }
}

/// As in `ADD (register)`.
impl fmt::Display for Op {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Some((name, rest)) = self.identifier().split_once('_') else {
            return f.write_str(self.identifier());
        };
        write!(f, "{name} (")?;
        for (i, word) in rest.split('_').enumerate() {
            write!(f, "{}{word}", if i == 0 { "" } else { " " })?;
        }
        f.write_str(")")
    }
}

/// The first row of each instruction.
const FIRST: [u16; Op::ALL.len()] = {
    let mut first = [0; Op::ALL.len()];
    let mut i = ROWS.len();
    while i > 0 {
        i -= 1;
        first[ROWS[i].op as usize] = i as u16;
    }
    first
};

/// What a word is compared with: the fixed places of a row.
#[derive(Clone, Copy)]
struct Candidate {
    mask: u32,
    bits: u32,
    row: u16,
}

/// All rows: the 16-bit ones, then the 32-bit ones, each by falling number of fixed places.
const BY_PRECISION: [Candidate; ROWS.len()] = {
    let mut order = [Candidate {
        mask: 0,
        bits: 0,
        row: 0,
    }; ROWS.len()];
    let (mut filled, mut rank) = (0, 64);
    while rank > 0 {
        rank -= 1;
        let mut i = 0;
        while i < ROWS.len() {
            let p = &ROWS[i].pattern;
            if p.fixed() + (!p.wide as u32) * 32 == rank + 1 {
                order[filled] = Candidate {
                    mask: p.mask,
                    bits: p.bits,
                    row: i as u16,
                };
                filled += 1;
            }
            i += 1;
        }
    }
    assert!(filled == ROWS.len());
    order
};

/// Words are told apart by their width and six leading bits: one of so many groups.
const GROUPS: usize = 128;

/// The group of a word. Behind the three bits that say that a word is wide, the six are those of
/// the first halfword.
const fn group(word: u32, wide: bool) -> usize {
    (if wide {
        64 + (word >> 23 & 63)
    } else {
        word >> 10 & 63
    }) as usize
}

/// Whether a word of the group may be read by a row.
const fn may_read(row: &Row, group: usize) -> bool {
    let leading = group as u32 % 64;
    let (mask, bits) = if group < 64 {
        (63 << 10, leading << 10)
    } else {
        (63 << 23, leading << 23)
    };
    let p = &row.pattern;
    p.wide == (group >= 64) && (p.bits ^ bits) & p.mask & mask == 0
}

/// Where each group begins in [`CANDIDATES`], and where the last one ends.
static STARTS: [u16; GROUPS + 1] = {
    let (mut starts, mut group) = ([0; GROUPS + 1], 0);
    while group < GROUPS {
        let (mut count, mut i) = (0, 0);
        while i < ROWS.len() {
            count += may_read(&ROWS[i], group) as u16;
            i += 1;
        }
        starts[group + 1] = starts[group] + count;
        group += 1;
    }
    starts
};

/// For each group the rows that may read its words, by falling number of fixed places.
static CANDIDATES: [Candidate; STARTS[GROUPS] as usize] = {
    let mut all = [BY_PRECISION[0]; STARTS[GROUPS] as usize];
    let (mut filled, mut group) = (0, 0);
    while group < GROUPS {
        let mut i = 0;
        while i < ROWS.len() {
            if may_read(&ROWS[BY_PRECISION[i].row as usize], group) {
                all[filled] = BY_PRECISION[i];
                filled += 1;
            }
            i += 1;
        }
        group += 1;
    }
    all
};

/// No two rows that read the same word fix equally many places, and every place of a picture is
/// fixed or read.
const _: () = {
    let mut i = 0;
    while i < ROWS.len() {
        let mut j = i + 1;
        while j < ROWS.len() {
            let (a, b) = (&ROWS[i], &ROWS[j]);
            assert!(
                !(a.overlaps(b) && a.pattern.fixed() == b.pattern.fixed()),
                "two rows read the same words"
            );
            assert!(
                !(a.op as u16 == b.op as u16 && a.form as u8 == b.form as u8),
                "an encoding is listed twice"
            );
            j += 1;
        }
        i += 1;
    }
};
