//! What stands at the start of a stored image.
//!
//! ```text
//!   RP2350   vectors | image definition block (20 bytes) | ..          RP2040   boot2 (252 bytes, CRC) | vectors | ..
//! ```

/// An image definition: executable, Secure, for the Arm cores of RP2350; the only block of its loop
/// (RP2350 datasheet 5.9.5.1).
pub(super) const IMAGE_DEF: [u32; 5] = [0xffff_ded3, 0x1021_0142, 0x0000_01ff, 0, 0xab12_3579];

/// Bytes of a second stage without its checksum.
const BOOT2_BYTES: usize = 252;

/// A second stage with its checksum, if it is not too long (RP2040 datasheet 2.8.1.3.1).
pub(super) fn checked_boot2(code: &[u8]) -> Option<Vec<u8>> {
    let mut block = code.to_vec();
    if block.len() > BOOT2_BYTES {
        return None;
    }
    block.resize(BOOT2_BYTES, 0);
    let sum = crc32(&block);
    block.extend(sum.to_le_bytes());
    Some(block)
}

/// CRC-32 with polynomial 0x04c11db7 from 0xffffffff, not reflected, not inverted.
fn crc32(bytes: &[u8]) -> u32 {
    let step = |crc: u32| {
        if crc >> 31 == 1 {
            crc << 1 ^ 0x04c1_1db7
        } else {
            crc << 1
        }
    };
    let byte = |crc: u32, byte: &u8| (0..8).fold(crc ^ u32::from(*byte) << 24, |crc, _| step(crc));
    bytes.iter().fold(u32::MAX, byte)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_checksum_is_the_published_one() {
        // The check value of CRC-32/MPEG-2 in the catalogue of parametrised CRC algorithms.
        assert_eq!(crc32(b"123456789"), 0x0376_e6e7);
        let block = checked_boot2(&[0xb5, 0]).expect("fits");
        assert_eq!(block.len(), 256);
        // What follows its own checksum leaves nothing.
        let mut whole = block[..252].to_vec();
        whole.extend(crc32(&block[..252]).to_be_bytes());
        assert_eq!(crc32(&whole), 0);
        assert_eq!(checked_boot2(&[0; 253]), None);
    }
}
