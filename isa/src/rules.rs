//! The words beside a picture: what its fields mean, when it does not apply, and what is
//! UNPREDICTABLE.
//!
//! A word of the form `dn:r` limits registers: the named ones may not be SP or PC (`r`), PC (`p`)
//! or SP (`s`). All other words are rows of the list below; an unknown word is a build error.

use crate::pattern::{Field, Pattern};
use crate::words::{index_of, skip_blanks, word_end};

macro_rules! rules {
    ($($(#[doc = $doc:literal])+ $rule:ident $word:literal,)+) => {
        /// One word of an encoding's rules.
        #[derive(Clone, Copy, PartialEq, Eq, Debug)]
        pub(crate) enum Rule { $($(#[doc = $doc])+ $rule,)+ }
        const WORDS: &[&str] = &[$($word),+];
    };
}

rules! {
    // Operands that the word does not spell out.
    /// Rn is Rd.
    NIsD "n=d",
    /// Rm is Rd.
    MIsD "m=d",
    /// Rn is SP.
    NIsSp "n=sp",
    /// Rd is SP.
    DIsSp "d=sp",
    /// Always sets the flags.
    SetsFlags "s=1",
    /// Sets the flags outside an IT block, and only there.
    SetsFlagsOutsideIt "s=it",
    /// Always writes the base back.
    WritesBack "w=1",
    /// Writes the base back unless it is in the list.
    WritesBackUnlessListed "w=list",
    /// The offset is subtracted.
    Subtracts "u=0",

    // What the immediate is.
    /// Times 2.
    Times2 "x2",
    /// Times 4.
    Times4 "x4",
    /// A modified immediate.
    ModifiedImm "const",
    /// `imm4:i:imm3:imm8`, whose picture has `i` first.
    Imm16 "imm16",
    /// A signed branch offset in halfwords.
    Relative "rel",
    /// A branch offset `S:J2:J1:imm6:imm11:0`.
    Relative20 "rel20",
    /// A branch offset `S:I1:I2:imm10:imm11:0`.
    Relative24 "rel24",
    /// Plus 1: a width or a saturation bit.
    Plus1 "plus1",
    /// The most significant bit of a field; the operand is its width.
    Msb "msb",
    /// A floating-point immediate.
    Float "float",
    /// The fraction bits of a fixed-point number, counted from its size down.
    FractionBits "fbits",

    // What the list is.
    /// Bit 8 of the list is LR.
    ListLr "lr",
    /// Bit 8 of the list is PC.
    ListPc "pc",
    /// The list is one register, by number.
    ListOne "one",

    // What the shift is; LSL where nothing else is said.
    /// Logical shift right.
    Lsr "lsr",
    /// Arithmetic shift right.
    Asr "asr",
    /// Rotate right.
    Ror "ror",
    /// Rotate right with extend.
    Rrx "rrx",
    /// The amount is a rotation in bytes.
    Bytes "bytes",

    // Words that fit the picture and are another encoding ("SEE") or UNDEFINED.
    /// Rn is PC.
    ExceptN15 "see:n15",
    /// Rm is SP.
    ExceptM13 "see:m13",
    /// Neither index nor write back.
    ExceptPw00 "see:pw00",
    /// Neither index, add nor write back.
    ExceptPuw000 "see:puw000",
    /// Condition 111x.
    ExceptCond111x "see:c111x",
    /// Coprocessor 10 or 11: the floating-point extension.
    ExceptFloat "see:cp101x",

    // IT blocks.
    /// UNPREDICTABLE in an IT block.
    NotInIt "no-it",
    /// UNPREDICTABLE in an IT block unless last.
    LastInIt "last",
    /// UNPREDICTABLE in an IT block unless last, when PC is written.
    LastInItIfPc "last-pc",
    /// Executed in an IT block whatever the condition.
    Unconditional "always",

    // UNPREDICTABLE operands.
    /// Rd equals Rn.
    DistinctDN "d!=n",
    /// Rd equals Rt.
    DistinctDT "d!=t",
    /// Rt equals Rt2.
    DistinctT "t!=t2",
    /// RdLo equals RdHi.
    DistinctDA "d!=a",
    /// Writes back to a register it loads or stores.
    NoWritebackOfT "wb!=t",
    /// Writes back.
    NoWriteback "no-wb",
    /// Writes back relative to PC.
    NoWritebackOfPc "wb!=pc",
    /// An empty list.
    List1 "list1",
    /// A list of fewer than two.
    List2 "list2",
    /// PC and LR in one list.
    ListNotPcAndLr "pc|lr",
    /// Writes back to a register of the list.
    ListWithoutN "wb!=list",
    /// Single registers d to d + imm - 1 beyond S31.
    Singles "singles",
    /// Double registers d to d + imm - 1 beyond D15, or more than 16.
    Doubles "doubles",
    /// Two single registers from S31 on.
    M31 "m!=31",
    /// Both registers below 8, for which there is a shorter form.
    NotBothLow "high",
    /// SP with SP, or PC, in a MOV.
    MovSp "mov",
    /// SP from a register shifted by other than LSL #0 to #3.
    SpLsl3 "sp:lsl3",
    /// PC loaded from an address that is no multiple of 4.
    AlignedIfPc "pc:x4",
    /// The field of BFI, SBFX leaves the register.
    FieldInside "field",
    /// A condition and mask that make no block.
    ItBlock "it",
    /// A special register that the architecture does not have.
    SpecialRegister "sysm",
    /// A mask that the special register does not have.
    SpecialMask "mask",
    /// Neither PRIMASK nor FAULTMASK, or FAULTMASK where there is none.
    CpsMasks "cps",
    /// PC plus PC.
    PcPlusPc "pc+pc",
    /// SP in the list.
    ListWithoutSp "list!=sp",
    /// PC in the list.
    ListWithoutPc "list!=pc",
}

/// Registers that a limit names: bit 0 d, 1 n, 2 m, 3 a, 4 t, 5 t2.
pub(crate) type Slots = u8;
const SLOT_LETTERS: &[u8] = b"dnmatu";

/// All words of one encoding.
#[derive(Clone, Copy, Debug)]
pub(crate) struct OperandRules {
    words: u128,
    /// The registers that may not be SP.
    pub not_sp: Slots,
    /// The registers that may not be PC.
    pub not_pc: Slots,
}

impl OperandRules {
    /// Parses the words; panics, which is a build error in a constant, at an unknown one.
    pub const fn parse(text: &str) -> Self {
        assert!(WORDS.len() <= 128);
        let text = text.as_bytes();
        let mut rules = Self {
            words: 0,
            not_sp: 0,
            not_pc: 0,
        };
        let mut from = skip_blanks(text, 0);
        while from < text.len() {
            let end = word_end(text, from);
            match index_of(WORDS, text, from, end) {
                Some(word) => rules.words |= 1 << word,
                None => rules.add_limit(text, from, end),
            }
            from = skip_blanks(text, end);
        }
        rules
    }

    const fn add_limit(&mut self, text: &[u8], from: usize, end: usize) {
        assert!(end >= from + 3 && text[end - 2] == b':', "unknown rule");
        let (mut slots, mut i) = (0, from);
        while i < end - 2 {
            slots |= 1 << slot_index(text[i]);
            i += 1;
        }
        match text[end - 1] {
            b'r' => {
                self.not_sp |= slots;
                self.not_pc |= slots;
            }
            b'p' => self.not_pc |= slots,
            b's' => self.not_sp |= slots,
            _ => panic!("a limit ends with r, p or s"),
        }
    }

    /// Whether the encoding has the rule.
    pub const fn has(&self, rule: Rule) -> bool {
        self.words >> rule as u32 & 1 != 0
    }

    /// Whether `word`, which matches `pattern`, is another encoding all the same.
    pub const fn excludes(&self, pattern: &Pattern, word: u32) -> bool {
        let mut i = 0;
        while i < EXCEPTIONS.len() {
            if self.has(EXCEPTIONS[i].0) {
                let (mask, bits) = exception(pattern, EXCEPTIONS[i]);
                if word & mask == bits {
                    return true;
                }
            }
            i += 1;
        }
        false
    }

    /// Whether every word with the fixed places `(mask, bits)` is excluded by one of the
    /// exceptions.
    pub const fn excludes_all(&self, pattern: &Pattern, mask: u32, bits: u32) -> bool {
        let mut i = 0;
        while i < EXCEPTIONS.len() {
            if self.has(EXCEPTIONS[i].0) {
                let (except_mask, except_bits) = exception(pattern, EXCEPTIONS[i]);
                if except_mask & !mask == 0 && bits & except_mask == except_bits {
                    return true;
                }
            }
            i += 1;
        }
        false
    }
}

/// An exception: the rule, the fields (as a mask over [`Field`] numbers), their value and how many
/// low bits are free.
type Exception = (Rule, &'static [Field], u32, u32);

const EXCEPTIONS: &[Exception] = &[
    (Rule::ExceptN15, &[Field::N], 15, 0),
    (Rule::ExceptM13, &[Field::M], 13, 0),
    (Rule::ExceptPw00, &[Field::P, Field::W], 0, 0),
    (Rule::ExceptPuw000, &[Field::P, Field::U, Field::W], 0, 0),
    (Rule::ExceptCond111x, &[Field::Cond], 14, 1),
    (Rule::ExceptFloat, &[Field::A], 10, 1),
];

const fn exception(pattern: &Pattern, (_, fields, value, free): Exception) -> (u32, u32) {
    let (mut mask, mut i) = (0, 0);
    while i < fields.len() {
        mask |= pattern.field(fields[i]);
        i += 1;
    }
    let bits = crate::pattern::scatter(value, mask);
    let free_places = crate::pattern::scatter((1 << free) - 1, mask);
    (mask & !free_places, bits & !free_places)
}

const fn slot_index(letter: u8) -> u32 {
    let mut i = 0;
    while i < SLOT_LETTERS.len() {
        if SLOT_LETTERS[i] == letter {
            return i as u32;
        }
        i += 1;
    }
    panic!("a limit names d, n, m, a, t or u")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_and_limits_parse() {
        let rules = OperandRules::parse("n=d  dm:r n:p x4");
        assert!(rules.has(Rule::NIsD) && rules.has(Rule::Times4) && !rules.has(Rule::Times2));
        assert_eq!((rules.not_sp, rules.not_pc), (0b101, 0b111));
    }

    #[test]
    fn an_exception_takes_words_out_of_a_picture() {
        let picture = Pattern::parse("1101cccciiiiiiii");
        let rules = OperandRules::parse("see:c111x");
        assert!(rules.excludes(&picture, 0xdf00) && rules.excludes(&picture, 0xde12));
        assert!(!rules.excludes(&picture, 0xdd00));
        assert!(
            rules.excludes_all(&picture, 0xff00, 0xde00)
                && !rules.excludes_all(&picture, 0xf000, 0xd000)
        );
    }
}
