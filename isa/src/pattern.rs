//! Bit pictures: the manual's encoding diagrams as strings, parsed while the crate is compiled.
//!
//! ```text
//!   "11110(0)110110nnnn 0kkkddddkk(0)wwwww"     blanks are ignored; 16 or 32 places, most significant first
//!    ||||| |       |       |
//!    |||||_|       |       a letter: a bit of a field; a field's bits are gathered in reading order
//!    |     should-be-zero: anything else is UNPREDICTABLE
//!    fixed
//! ```
//!
//! | letter | field |
//! | --- | --- |
//! | `d n m a t u` | register Rd (RdLo, CRd), Rn, Rm, Ra (RdHi, coprocessor), Rt, Rt2 |
//! | `D N M` | single-precision register Sd, Sn, Sm; of Sd and Sm the first bit read is the *least* significant |
//! | `q` | Rm once more; must repeat it |
//! | `i` | immediate |
//! | `k` | shift amount, rotation, lsb, second opcode |
//! | `y` | shift type |
//! | `r` | register list, kept at its place in the word |
//! | `c` | condition |
//! | `S P U W` | sets flags, index, add, write back |
//!
//! A malformed picture is a build error. Not here: what an immediate means (`imm`), when a picture
//! does not apply (`rules`).

/// The letters of a picture, in the order of [`Field`].
const LETTERS: &[u8; 19] = b"dnmatuDNMqikyrcSPUW";

/// A field of an encoding; see the module's table of letters.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Field {
    D,
    N,
    M,
    A,
    T,
    T2,
    SingleD,
    SingleN,
    SingleM,
    RepeatM,
    Imm,
    Amount,
    ShiftType,
    List,
    Cond,
    S,
    P,
    U,
    W,
}

/// A parsed picture. A 16-bit instruction is a word below 0x10000, a 32-bit one has its first
/// halfword on top.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Pattern {
    /// True for a 32-bit encoding.
    pub wide: bool,
    /// The fixed places.
    pub mask: u32,
    /// Their values.
    pub bits: u32,
    /// The should-be places, `(0)` and `(1)`.
    pub should_mask: u32,
    /// Their values.
    pub should_bits: u32,
    fields: [u32; LETTERS.len()],
}

impl Pattern {
    /// Parses a picture; panics, which is a build error in a constant, unless it is 16 or 32 known
    /// places.
    pub const fn parse(picture: &str) -> Self {
        let text = picture.as_bytes();
        let mut p = Self {
            wide: false,
            mask: 0,
            bits: 0,
            should_mask: 0,
            should_bits: 0,
            fields: [0; LETTERS.len()],
        };
        let places = count_places(text);
        assert!(
            places == 16 || places == 32,
            "a picture has 16 or 32 places"
        );
        p.wide = places == 32;
        let (mut i, mut place) = (0, places);
        while i < text.len() {
            if text[i] == b' ' {
                i += 1;
                continue;
            }
            place -= 1;
            let one = 1 << place;
            match text[i] {
                b'0' => p.mask |= one,
                b'1' => {
                    p.mask |= one;
                    p.bits |= one;
                }
                b'(' => {
                    assert!(
                        text[i + 2] == b')' && (text[i + 1] == b'0' || text[i + 1] == b'1'),
                        "(0) or (1)"
                    );
                    p.should_mask |= one;
                    p.should_bits |= if text[i + 1] == b'1' { one } else { 0 };
                    i += 2;
                }
                letter => p.fields[letter_index(letter)] |= one,
            }
            i += 1;
        }
        p
    }

    /// The places of a field, as a mask; 0 when the encoding has none.
    pub const fn field(&self, field: Field) -> u32 {
        self.fields[field as usize]
    }

    /// Whether the encoding has the field.
    pub const fn has(&self, field: Field) -> bool {
        self.field(field) != 0
    }

    /// The field's bits in `word`, gathered.
    pub fn extract(&self, word: u32, field: Field) -> u32 {
        gather(word, self.field(field))
    }

    /// How many places are fixed: of the patterns that match a word, the one that fixes most
    /// decodes it.
    pub const fn fixed(&self) -> u32 {
        self.mask.count_ones()
    }
}

const fn count_places(text: &[u8]) -> u32 {
    let (mut i, mut places) = (0, 0);
    while i < text.len() {
        match text[i] {
            b' ' => {}
            b'(' => {
                places += 1;
                i += 2;
            }
            _ => places += 1,
        }
        i += 1;
    }
    places
}

const fn letter_index(letter: u8) -> usize {
    let mut i = 0;
    while i < LETTERS.len() {
        if LETTERS[i] == letter {
            return i;
        }
        i += 1;
    }
    panic!("not a letter of a picture")
}

/// Packs the bits of `word` under `mask` to the right, keeping their order.
pub(crate) const fn gather(word: u32, mut mask: u32) -> u32 {
    let (mut value, mut to) = (0, 0);
    while mask != 0 {
        let (place, count, ones) = first_run(mask);
        value |= (word >> place & ones) << to;
        to += count;
        mask &= !(ones << place);
    }
    value
}

/// Spreads the low bits of `value` over the places of `mask`: the inverse of [`gather`]. Bits that
/// find no place are lost.
pub(crate) const fn scatter(value: u32, mut mask: u32) -> u32 {
    let (mut word, mut from) = (0, 0);
    while mask != 0 {
        let (place, count, ones) = first_run(mask);
        word |= (value >> from & ones) << place;
        from += count;
        mask &= !(ones << place);
    }
    word
}

/// The lowest run of ones of a mask that has one: its place, how many they are, and as many ones
/// from bit 0 on.
const fn first_run(mask: u32) -> (u32, u32, u32) {
    let place = mask.trailing_zeros();
    let count = (mask >> place).trailing_ones();
    (place, count, u32::MAX >> (32 - count))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_picture_reads_like_the_manual() {
        let p = Pattern::parse("11110(0)110110nnnn 0kkkddddkk(1)iiiii");
        assert!(p.wide);
        assert_eq!(
            (p.bits, p.mask),
            (0b1111_0011_0110 << 20, 0b1111_1011_1111 << 20 | 1 << 15)
        );
        assert_eq!((p.should_mask, p.should_bits), (1 << 26 | 1 << 5, 1 << 5));
        assert_eq!(p.extract(0xabcd_5abf, Field::N), 0xd);
        assert_eq!(p.extract(0xffff_0abf & !(1 << 6), Field::Amount), 0b00010);
        assert!(!p.has(Field::T));
    }

    #[test]
    fn scatter_inverts_gather() {
        for mask in [0, 1, 0x8000_0001, 0x0f0f_f0f0, u32::MAX] {
            assert_eq!(scatter(gather(0x1234_5678, mask), mask), 0x1234_5678 & mask);
        }
    }
}
