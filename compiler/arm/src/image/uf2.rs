//! UF2: blocks of 256 bytes that a bootloader takes over USB in any order (Microsoft, USB Flashing
//! Format).

use super::linked::Image;

const MAGIC: [u32; 2] = [0x0a32_4655, 0x9e5d_5157];
const MAGIC_END: u32 = 0x0ab1_6f30;
/// The field behind the counts is the family.
const FAMILY_PRESENT: u32 = 0x2000;
const PAYLOAD: u32 = 256;
/// Where the last magic number of a block is.
const END: u32 = 508;
/// Bytes between payload and end, but for a zero that ends a text there.
const TEXT_BYTES: usize = (END - PAYLOAD - 32 - 1) as usize;
/// What precedes the reason in an image that is not proven.
const UNPROVEN: &str = "Whippen: not proven to be in time: ";

/// The image as a UF2 file for a family of chips. Blocks begin at multiples of 256, as flash wants
/// to be written; what nobody fills is zero. One that is not proven to be in time says why behind
/// the payload of its first block, where no bootloader looks.
pub fn uf2(image: &Image, family: u32, unproven: Option<&str>) -> Vec<u8> {
    let mut pages = std::collections::BTreeMap::<u32, [u8; PAYLOAD as usize]>::new();
    for segment in &image.segments {
        for (at, &byte) in (segment.load..).zip(&segment.bytes) {
            pages
                .entry(at / PAYLOAD * PAYLOAD)
                .or_insert([0; PAYLOAD as usize])[(at % PAYLOAD) as usize] = byte;
        }
    }
    let count = pages.len() as u32;
    let block = |(number, (address, page)): (u32, (&u32, &[u8; PAYLOAD as usize]))| {
        let head = [
            MAGIC[0],
            MAGIC[1],
            FAMILY_PRESENT,
            *address,
            PAYLOAD,
            number,
            count,
            family,
        ];
        let mut block: Vec<u8> = head.iter().flat_map(|word| word.to_le_bytes()).collect();
        block.extend(page);
        if let Some(why) = unproven.filter(|_| number == 0) {
            block.extend(UNPROVEN.bytes().chain(why.bytes()).take(TEXT_BYTES));
        }
        block.resize(END as usize, 0);
        block.extend(MAGIC_END.to_le_bytes());
        block
    };
    (0..).zip(&pages).flat_map(block).collect()
}
