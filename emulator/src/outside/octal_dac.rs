//! A DAC of eight channels, as the DAC8568: select, clock, data.
//!
//! ```text
//!   select   ~~\____________________________________________/~~
//!   clock    ____/~\_/~\_/~\_ .. 32 times                 ____
//!   data     0, 3 bits | control 3 .. 0 | channel 3 .. 0 | code 15 .. 0 | 4 bits
//! ```
//!
//! A bit is read where the clock falls; the 32nd acts, and what follows is ignored. A select that
//! rises before cancels the word. So says the part's document. Not checked against it: what a load
//! pin that is held low does with a word for an input register (`loads_at_once`), so an idle word
//! should be harmless either way. Not here: the load and clear pins, channels without power, the
//! masks of the load pin, voltages and how they settle.

/// Bits of a word.
const BITS: u32 = 32;
/// The address of all channels.
const ALL: usize = 15;

/// See the module.
#[derive(Clone, Debug)]
pub(super) struct OctalDac {
    /// The code of each channel at a reset.
    resets_to: u16,
    loads_at_once: bool,
    inputs: [u16; 8],
    outputs: [u16; 8],
    has_reference: bool,
    refused: u32,
    short: u32,
    word: u32,
    bits: u32,
    selected: bool,
    clock: bool,
}

impl OctalDac {
    pub fn new(resets_to: u16, loads_at_once: bool) -> Self {
        Self {
            resets_to,
            loads_at_once,
            inputs: [resets_to; 8],
            outputs: [resets_to; 8],
            has_reference: false,
            refused: 0,
            short: 0,
            word: 0,
            bits: 0,
            selected: false,
            clock: false,
        }
    }

    /// What its channels put out.
    pub fn outputs(&self) -> [u16; 8] {
        self.outputs
    }

    /// Whether its own reference is on.
    pub fn has_reference(&self) -> bool {
        self.has_reference
    }

    /// Words that it does not know, or that name no channel.
    pub fn refused(&self) -> u32 {
        self.refused
    }

    /// Words that were cancelled behind their first bit.
    pub fn short(&self) -> u32 {
        self.short
    }

    /// Its three inputs. Whether a word has acted.
    pub fn inputs(&mut self, select: bool, clock: bool, data: bool) -> bool {
        let selected = !select;
        let falls = self.clock && !clock;
        let was_selected = std::mem::replace(&mut self.selected, selected);
        self.clock = clock;
        if selected && !was_selected {
            self.bits = 0;
        }
        if !selected {
            self.short += u32::from(was_selected && (1..BITS).contains(&self.bits));
            return false;
        }
        if !was_selected || !falls || self.bits == BITS {
            return false;
        }
        self.word = self.word << 1 | u32::from(data);
        self.bits += 1;
        if self.bits == BITS {
            self.act(self.word);
        }
        self.bits == BITS
    }

    fn act(&mut self, word: u32) {
        let (address, code) = ((word >> 20 & 15) as usize, (word >> 4) as u16);
        let channels = match address {
            0..8 => address..address + 1,
            ALL => 0..8,
            _ => 0..0,
        };
        let control = word >> 24 & 15;
        if word >> 31 != 0 || control <= 3 && channels.is_empty() {
            self.refused += 1;
            return;
        }
        if matches!(control, 0 | 2 | 3) {
            self.inputs[channels.clone()].fill(code);
        }
        match control {
            0 if !self.loads_at_once => {}
            0 | 1 | 3 => self.outputs[channels.clone()].copy_from_slice(&self.inputs[channels]),
            2 => self.outputs = self.inputs,
            7 => {
                let (refused, short) = (self.refused, self.short);
                let reset = Self::new(self.resets_to, self.loads_at_once);
                let (selected, bits) = (self.selected, self.bits);
                *self = Self {
                    refused,
                    short,
                    selected,
                    bits,
                    ..reset
                };
            }
            8 => self.has_reference = word & 1 != 0,
            _ => self.refused += 1,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn send(dac: &mut OctalDac, word: u32, clocks: u32) -> u32 {
        dac.inputs(true, false, false);
        dac.inputs(false, false, false);
        let mut acted = 0;
        for bit in 0..clocks {
            let data = bit < 32 && word >> (31 - bit) & 1 != 0;
            dac.inputs(false, true, data);
            acted += u32::from(dac.inputs(false, false, data));
        }
        dac.inputs(true, false, false);
        acted
    }

    fn mid() -> OctalDac {
        OctalDac::new(0x8000, false)
    }

    #[test]
    fn words_write_and_update_what_they_say() {
        let mut dac = mid();
        assert_eq!(dac.outputs(), [0x8000; 8]);
        assert_eq!(send(&mut dac, 0x0351_2340, 32), 1);
        assert_eq!(dac.outputs()[4..], [0x8000, 0x1234, 0x8000, 0x8000]);
        // Channels 0 and 7 are written, 7 alone updated, then all with channel 1.
        send(&mut dac, 0x000a_aaa0, 32);
        send(&mut dac, 0x007b_bbb0, 32);
        assert_eq!(dac.outputs()[0], 0x8000);
        send(&mut dac, 0x0170_0000, 32);
        assert_eq!([0, 7].map(|at| dac.outputs()[at]), [0x8000, 0xbbbb]);
        send(&mut dac, 0x021c_ccc0, 32);
        assert_eq!(dac.outputs()[..2], [0xaaaa, 0xcccc]);
        send(&mut dac, 0x03f0_0010, 32);
        assert_eq!(dac.outputs(), [1; 8]);
        assert!(!dac.has_reference());
        send(&mut dac, 0x0800_0001, 32);
        assert!(dac.has_reference());
        send(&mut dac, 0x0700_0000, 32);
        assert_eq!((dac.outputs(), dac.has_reference()), ([0x8000; 8], false));
        // The next word is read as any.
        send(&mut dac, 0x0327_7770, 32);
        assert_eq!(dac.outputs()[2], 0x7777);
        assert_eq!((dac.refused(), dac.short()), (0, 0));
    }

    #[test]
    fn a_word_acts_at_its_32nd_clock_or_not_at_all() {
        let mut dac = mid();
        assert_eq!(send(&mut dac, 0x0301_1110, 31), 0);
        assert_eq!((dac.outputs(), dac.short()), ([0x8000; 8], 1));
        assert_eq!(send(&mut dac, 0x0301_1110, 40), 1);
        assert_eq!(dac.outputs()[0], 0x1111);
        for unknown in [0x8301_2340, 0x0381_2340, 0x0f00_0000, 0x0400_0000] {
            send(&mut dac, unknown, 32);
        }
        assert_eq!((dac.outputs()[0], dac.refused()), (0x1111, 4));
    }

    #[test]
    fn an_update_is_harmless_whatever_the_load_pin_does_and_zero_is_not() {
        for loads_at_once in [false, true] {
            let mut dac = OctalDac::new(0x8000, loads_at_once);
            send(&mut dac, 0x0309_9990, 32);
            send(&mut dac, 0x0100_0000, 32);
            assert_eq!(dac.outputs()[0], 0x9999);
            send(&mut dac, 0, 32);
            let wanted = if loads_at_once { 0 } else { 0x9999 };
            assert_eq!(dac.outputs()[0], wanted);
        }
    }
}
