//! Bytes with addresses.

use whippen_isa::{Arch, Inst, ItState, NotDecoded, decode, is_wide};

/// Bytes that a program executes and reads as constants: nobody writes them while it runs.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Code {
    /// Address and bytes, by address.
    segments: Vec<(u32, Vec<u8>)>,
}

impl Code {
    /// One run of bytes.
    pub fn new(address: u32, bytes: Vec<u8>) -> Self {
        Self {
            segments: vec![(address, bytes)],
        }
    }

    /// Adds a run of bytes that overlaps no other.
    pub fn add(&mut self, address: u32, bytes: Vec<u8>) {
        if bytes.is_empty() {
            return;
        }
        self.segments.push((address, bytes));
        self.segments.sort_by_key(|(address, _)| *address);
    }

    /// The bytes from an address on, as far as they are here.
    fn from(&self, address: u32) -> Option<&[u8]> {
        let at = self
            .segments
            .partition_point(|(start, _)| *start <= address)
            .checked_sub(1)?;
        let (start, bytes) = &self.segments[at];
        bytes.get((address - start) as usize..)
    }

    /// The byte at an address.
    pub fn byte(&self, address: u32) -> Option<u8> {
        self.from(address)?.first().copied()
    }

    /// The halfword at an address.
    pub fn halfword(&self, address: u32) -> Option<u16> {
        self.from(address)?
            .first_chunk()
            .copied()
            .map(u16::from_le_bytes)
    }

    /// The word at an address.
    pub fn word(&self, address: u32) -> Option<u32> {
        self.from(address)?
            .first_chunk()
            .copied()
            .map(u32::from_le_bytes)
    }

    /// Whether a 32-bit instruction starts at an address.
    pub fn is_wide_at(&self, address: u32) -> bool {
        self.halfword(address).is_some_and(is_wide)
    }

    /// The instruction at an address; none where there are no bytes.
    pub fn decode(
        &self,
        address: u32,
        arch: Arch,
        it: ItState,
    ) -> Option<Result<Inst, NotDecoded>> {
        let first = self.halfword(address)?;
        let second = if is_wide(first) {
            self.halfword(address.wrapping_add(2))?
        } else {
            0
        };
        Some(decode(first, second, arch, it))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bytes_are_found_in_the_segment_that_holds_them() {
        let mut code = Code::new(0x100, vec![1, 2, 3, 4, 5]);
        code.add(0x10, vec![9, 8]);
        code.add(0x100, Vec::new());
        assert_eq!(
            (code.byte(0x11), code.halfword(0x11), code.halfword(0x10)),
            (Some(8), None, Some(0x0809))
        );
        assert_eq!(
            (
                code.word(0x101),
                code.word(0x102),
                code.byte(0x105),
                code.byte(0)
            ),
            (Some(0x0504_0302), None, None, None)
        );
    }

    /// A 32-bit instruction across two segments, one whose end is not there, and what is none.
    #[test]
    fn instructions_are_read_from_their_halfwords() {
        // adds r0, #1; smull r0, r1, r2, r3 in two parts.
        let mut code = Code::new(0x100, vec![0x01, 0x30, 0x82, 0xfb]);
        code.add(0x104, vec![0x03, 0x01]);
        code.add(0x200, vec![0x82, 0xfb]);
        assert_eq!(
            [0x100, 0x102, 0x104, 0x106].map(|at| code.is_wide_at(at)),
            [false, true, false, false]
        );
        let text = |at| {
            let inst = code.decode(at, Arch::V8M, ItState::OUTSIDE)?;
            Some(inst.map(|inst| inst.to_string()).ok())
        };
        assert_eq!(text(0x100), Some(Some("adds r0, #1".into())));
        assert_eq!(text(0x102), Some(Some("smull r0, r1, r2, r3".into())));
        assert_eq!([text(0x200), text(0x106)], [None, None]);
        assert_eq!(
            code.decode(0x102, Arch::V6M, ItState::OUTSIDE)
                .map(|inst| inst.is_ok()),
            Some(false)
        );
    }
}
