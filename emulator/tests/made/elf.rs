//! ELFs made by hand: as little of the format as a program needs to be loaded.

/// A segment.
pub struct Part<'a> {
    pub run: u32,
    pub load: u32,
    pub bytes: &'a [u8],
    pub memory_bytes: u32,
    pub flags: u32,
}

/// An ELF for ARM of that type (2 is an executable) with these segments and without sections.
pub fn elf_of(kind: u16, entry: u32, parts: &[Part<'_>]) -> Vec<u8> {
    const HEADER: u32 = 52;
    let mut elf = b"\x7fELF\x01\x01\x01\0\0\0\0\0\0\0\0\0".to_vec();
    let half =
        |elf: &mut Vec<u8>, values: &[u16]| values.iter().for_each(|v| elf.extend(v.to_le_bytes()));
    let word =
        |elf: &mut Vec<u8>, values: &[u32]| values.iter().for_each(|v| elf.extend(v.to_le_bytes()));
    half(&mut elf, &[kind, 40]);
    word(&mut elf, &[1, entry, HEADER, 0, 0x0500_0000]);
    half(&mut elf, &[HEADER as u16, 32, parts.len() as u16, 40, 0, 0]);
    let mut offset = HEADER + 32 * parts.len() as u32;
    for part in parts {
        let length = part.bytes.len() as u32;
        word(
            &mut elf,
            &[
                1,
                offset,
                part.run,
                part.load,
                length,
                part.memory_bytes,
                part.flags,
                4,
            ],
        );
        offset += length;
    }
    parts.iter().for_each(|part| elf.extend(part.bytes));
    elf
}
