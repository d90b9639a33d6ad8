//! Frames: COBS (Cheshire and Baker 1999) of what is said and its CRC, and a zero behind it.

use crc::{CRC_16_XMODEM, Crc};

/// Polynomial 0x1021, from 0: with the CRC behind what it is of, nothing remains.
const CRC: Crc<u16> = Crc::<u16>::new(&CRC_16_XMODEM);

/// The bytes of a frame: zeros around what is between, the first of which ends what is left of
/// another one.
pub fn encode(said: &[u8]) -> Vec<u8> {
    let mut whole = said.to_vec();
    whole.extend(CRC.checksum(said).to_be_bytes());
    let mut bytes = vec![0];
    bytes.extend(cobs::encode_vec(&whole));
    bytes.push(0);
    bytes
}

/// What a frame says, without the zero behind it; none where it is wrong.
pub fn decode(frame: &[u8]) -> Option<Vec<u8>> {
    let mut whole = cobs::decode_vec(frame).ok()?;
    let said = whole.len().checked_sub(2)?;
    let is_right = CRC.checksum(&whole) == 0;
    whole.truncate(said);
    is_right.then_some(whole)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_said_comes_back() {
        for said in [&b""[..], b"\0", b"ab\0\0c", &[0xff; 300]] {
            let bytes = encode(said);
            assert!(bytes[1..bytes.len() - 1].iter().all(|byte| *byte != 0));
            assert_eq!(decode(&bytes[1..bytes.len() - 1]).as_deref(), Some(said));
        }
    }

    /// The value that the catalogue of CRCs gives for the digits 1 to 9.
    #[test]
    fn the_crc_is_that_of_the_catalogue() {
        let bytes = encode(b"123456789");
        assert_eq!(&bytes[11..13], &0x31c3_u16.to_be_bytes());
    }

    #[test]
    fn a_bit_that_differs_is_found() {
        let bytes = encode(b"status");
        let inner = &bytes[1..bytes.len() - 1];
        for bit in 0..8 * inner.len() {
            let mut other = inner.to_vec();
            other[bit / 8] ^= 1 << (bit % 8);
            assert_eq!(decode(&other), None, "bit {bit}");
        }
    }
}
