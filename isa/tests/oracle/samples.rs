//! Words to ask the oracles about: fixed seeds, so that every run asks the same.

use whippen_isa::{Arch, Cond, Encoding, Inst, ItRule, ItState, NotDecoded, Why, decode};

/// SplitMix64.
pub struct Random(u64);

impl Random {
    pub fn new(seed: u64) -> Self {
        Self(seed)
    }

    pub fn next(&mut self) -> u32 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ self.0 >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ z >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ z >> 31) >> 32) as u32
    }

    /// Random bits, often with runs of zeros and ones, so that short lists and equal registers come
    /// up.
    fn skewed(&mut self) -> u32 {
        match self.next() & 3 {
            0 => self.next() & self.next(),
            1 => self.next() | self.next(),
            _ => self.next(),
        }
    }
}

/// The two halfwords of a word; of a 16-bit one the second is 0.
pub fn halves(word: u32, size: u32) -> (u16, u16) {
    if size == 4 {
        ((word >> 16) as u16, word as u16)
    } else {
        (word as u16, 0)
    }
}

/// The bytes in memory.
pub fn bytes(word: u32, size: u32) -> Vec<u8> {
    let (hw1, hw2) = halves(word, size);
    let both = [hw1.to_le_bytes(), hw2.to_le_bytes()].concat();
    both[..size as usize].to_vec()
}

/// The halfword of an IT instruction for a block of one, and the state after it.
pub fn it_block(cond: Cond) -> (u16, ItState) {
    let hw = 0xbf08 | u16::from(cond.bits()) << 4;
    (
        hw,
        ItState::after_it(cond.bits(), 8).expect("a block of one is always possible"),
    )
}

/// Valid instructions of one encoding, with the words they were read from: `count` tries of random
/// fields.
pub fn of_encoding(encoding: Encoding, count: u32, seed: u64) -> Vec<(u32, Inst)> {
    let (mask, bits) = encoding.fixed_bits();
    let mut random = Random::new(seed);
    let in_block = encoding.it_rule() != ItRule::Never;
    let mut samples = Vec::new();
    for i in 0..count {
        let word = bits
            | random.skewed()
                & !mask
                & if encoding.size() == 4 {
                    u32::MAX
                } else {
                    0xffff
                };
        let cond = Cond::ALL[(random.next() % 15) as usize];
        let it = if in_block && i % 4 == 0 {
            it_block(cond).1
        } else {
            ItState::OUTSIDE
        };
        let (hw1, hw2) = halves(word, encoding.size());
        match decode(hw1, hw2, Arch::V8M, it) {
            Ok(inst) if inst.encoding == encoding => samples.push((word, inst)),
            _ => {}
        }
    }
    samples
}

/// A random 32-bit instruction word: its first halfword is one of those that start one.
pub fn wide(random: &mut Random) -> u32 {
    const FIRST: [u32; 3] = [0b11101, 0b11110, 0b11111];
    FIRST[(random.next() % 3) as usize] << 27 | random.next() & 0x07ff_ffff
}

/// Words of one encoding that are UNPREDICTABLE for another reason than a should-be bit, outside an
/// IT block.
pub fn unpredictable(encoding: Encoding, count: u32, seed: u64) -> Vec<(u32, Inst, Why)> {
    let (mask, bits) = encoding.fixed_bits();
    let mut random = Random::new(seed);
    let mut samples = Vec::new();
    for _ in 0..count {
        let word = bits
            | random.skewed()
                & !mask
                & if encoding.size() == 4 {
                    u32::MAX
                } else {
                    0xffff
                };
        let (hw1, hw2) = halves(word, encoding.size());
        if let Err(NotDecoded::Unpredictable { reading, why }) =
            decode(hw1, hw2, Arch::V8M, ItState::OUTSIDE)
            && reading.encoding == encoding
            && why != Why::ShouldBe
        {
            samples.push((word, reading, why));
        }
    }
    samples
}
