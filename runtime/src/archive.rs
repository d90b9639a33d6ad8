//! ZIP archives without compression, the same bytes for the same files.
//!
//! Not here: archives that are longer than 4 GB.

/// An entry of an archive.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Entry {
    /// Its name, with folders.
    pub name: String,
    /// Checksum of its bytes.
    pub crc: u32,
    /// How many there are.
    pub bytes: u32,
    /// Where its head begins.
    pub at: u32,
}

impl Entry {
    /// Bytes of a head before the name.
    pub const HEAD: u64 = 30;

    /// What both heads of an entry have in common.
    fn common(&self) -> Vec<u8> {
        let mut bytes = Vec::new();
        // Version 2.0, no flags, stored, midnight of the first day of 1980.
        for word in [20_u16, 0, 0, 0, 0x21] {
            bytes.extend(word.to_le_bytes());
        }
        for word in [self.crc, self.bytes, self.bytes] {
            bytes.extend(word.to_le_bytes());
        }
        bytes.extend((self.name.len() as u16).to_le_bytes());
        bytes.extend(0_u16.to_le_bytes());
        bytes
    }

    /// What stands before its bytes.
    pub fn head(&self) -> Vec<u8> {
        [b"PK\x03\x04", &self.common()[..], self.name.as_bytes()].concat()
    }

    /// What stands in the directory.
    fn listed(&self) -> Vec<u8> {
        let version = 20_u16.to_le_bytes();
        let mut bytes = [b"PK\x01\x02", &version[..], &self.common()].concat();
        // No comment, disk 0, no attributes.
        bytes.extend([0; 10]);
        bytes.extend(self.at.to_le_bytes());
        bytes.extend(self.name.as_bytes());
        bytes
    }
}

/// The directory of entries, which begins at a place of the file: its end.
pub fn directory(entries: &[Entry], at: u32) -> Vec<u8> {
    let mut bytes: Vec<u8> = entries.iter().flat_map(Entry::listed).collect();
    let length = bytes.len() as u32;
    let count = (entries.len() as u16).to_le_bytes();
    bytes.extend(b"PK\x05\x06\0\0\0\0");
    bytes.extend([count, count].concat());
    bytes.extend([length, at].map(u32::to_le_bytes).concat());
    bytes.extend([0; 2]);
    bytes
}

/// An archive of files.
pub fn archive(files: &[(String, Vec<u8>)]) -> Vec<u8> {
    let (mut archive, mut entries) = (Vec::new(), Vec::new());
    for (name, bytes) in files {
        let entry = Entry {
            name: name.clone(),
            crc: crc32fast::hash(bytes),
            bytes: bytes.len() as u32,
            at: archive.len() as u32,
        };
        archive.extend(entry.head());
        archive.extend(bytes);
        entries.push(entry);
    }
    let at = archive.len() as u32;
    archive.extend(directory(&entries, at));
    archive
}
