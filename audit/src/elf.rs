//! Reading an ELF file: sections that are loaded, their bytes, certificate and Kernels.

#[cfg(test)]
mod tests;

/// The section that holds the certificate.
pub const CERTIFICATE: &str = ".whippen.certificate";

/// The section that holds the text of the Kernels.
pub const KERNELS: &str = ".whippen.kernels";

/// A section that is loaded.
#[derive(Debug, Clone)]
pub struct Section {
    /// Its name.
    pub name: String,
    /// First address.
    pub base: u32,
    /// Bytes.
    pub size: u32,
    /// Whether it holds instructions.
    pub code: bool,
    /// Whether the program stores there.
    pub writable: bool,
    bytes: Vec<u8>,
}

/// An image.
#[derive(Debug, Clone, Default)]
pub struct Elf {
    /// What is loaded, by address.
    pub sections: Vec<Section>,
    /// The certificate's text.
    pub certificate: Option<String>,
    /// The text of its Kernels.
    pub kernels: Option<String>,
}

impl Section {
    /// A number that stands for its bytes (FNV-1a): against mix-ups, not against malice.
    pub fn hash(&self) -> u64 {
        crate::hash(&self.bytes)
    }
}

fn number<const N: usize>(bytes: &[u8], at: usize) -> Option<[u8; N]> {
    bytes.get(at..)?.first_chunk().copied()
}

fn word_at(bytes: &[u8], at: usize) -> Option<u32> {
    number(bytes, at).map(u32::from_le_bytes)
}

fn half_at(bytes: &[u8], at: usize) -> Option<usize> {
    number(bytes, at).map(|half| usize::from(u16::from_le_bytes(half)))
}

impl Elf {
    /// Reads an executable for Arm, little endian, of 32 bits.
    ///
    /// # Errors
    /// It is none.
    pub fn read(file: &[u8]) -> Result<Self, String> {
        let is_arm = file.starts_with(b"\x7fELF\x01\x01") && half_at(file, 18) == Some(40);
        if !is_arm || half_at(file, 16) != Some(2) {
            return Err("is no executable ELF file for Arm".into());
        }
        Self::parse(file).ok_or_else(|| "is an ELF file that ends too early".to_string())?
    }

    fn parse(file: &[u8]) -> Option<Result<Self, String>> {
        let (table, size) = (word_at(file, 32)? as usize, half_at(file, 46)?);
        let (count, names) = (half_at(file, 48)?, half_at(file, 50)?);
        let header = |nth: usize| table.checked_add(nth.checked_mul(size)?);
        let field = |nth: usize, word: usize| word_at(file, header(nth)?.checked_add(4 * word)?);
        let names = field(names, 4)? as usize;
        let mut elf = Self::default();
        for nth in 1..count {
            let name = file.get(names.checked_add(field(nth, 0)? as usize)?..)?;
            let name = name.split(|byte| *byte == 0).next()?;
            let name = String::from_utf8_lossy(name).into_owned();
            let (kind, flags) = (field(nth, 1)?, field(nth, 2)?);
            let (base, from, size) = (field(nth, 3)?, field(nth, 4)? as usize, field(nth, 5)?);
            let bytes = match kind {
                8 => Vec::new(),
                _ => file.get(from..from.checked_add(size as usize)?)?.to_vec(),
            };
            if [CERTIFICATE, KERNELS].contains(&name.as_str()) {
                let Ok(text) = String::from_utf8(bytes) else {
                    return Some(Err(format!("has a section `{name}` that is no text")));
                };
                let kept = match name == CERTIFICATE {
                    true => &mut elf.certificate,
                    false => &mut elf.kernels,
                };
                if kept.replace(text).is_some() {
                    return Some(Err(format!("has two sections `{name}`")));
                }
            } else if flags & 2 != 0 {
                let (code, writable) = (flags & 4 != 0, flags & 1 != 0);
                elf.sections.push(Section {
                    name,
                    base,
                    size,
                    code,
                    writable,
                    bytes,
                });
            }
        }
        elf.sections.sort_by_key(|section| section.base);
        let overlap = elf.sections.windows(2).find(|pair| {
            pair[1].base < pair[0].base.saturating_add(pair[0].size) && pair[1].size > 0
        });
        Some(match overlap {
            Some(pair) => Err(format!("has sections that overlap: `{}`", pair[1].name)),
            None => Ok(elf),
        })
    }

    /// Sections of those names, addresses and bytes: `.text` is code, `.data` is written.
    #[cfg(test)]
    pub(crate) fn of(sections: &[(&str, u32, &[u8])]) -> Self {
        let section = |(name, base, bytes): &(&str, u32, &[u8])| Section {
            name: name.to_string(),
            base: *base,
            size: bytes.len() as u32,
            code: name.starts_with(".text"),
            writable: name.starts_with(".data"),
            bytes: bytes.to_vec(),
        };
        Self {
            sections: sections.iter().map(section).collect(),
            ..Self::default()
        }
    }

    /// The section that an address is in.
    pub fn section_at(&self, address: u32) -> Option<&Section> {
        // They are in the order of their addresses.
        let below = self.sections.partition_point(|own| own.base <= address);
        let mut nearest = self.sections[..below].iter().rev();
        let nearest = nearest.find(|own| own.size > 0);
        nearest.filter(|own| address - own.base < own.size)
    }

    /// What nobody writes: code and constants, by first address, with what stands for the bytes.
    pub fn constants(&self) -> Vec<(u32, u64)> {
        let all = self
            .sections
            .iter()
            .filter(|own| !own.writable && own.size > 0);
        all.map(|own| (own.base, own.hash())).collect()
    }

    /// Bytes of code or constants from an address on.
    fn constant<const N: usize>(&self, address: u32) -> Option<[u8; N]> {
        let section = self.section_at(address).filter(|own| !own.writable)?;
        number(&section.bytes, (address - section.base) as usize)
    }

    /// A constant byte.
    pub fn byte(&self, address: u32) -> Option<u8> {
        self.constant(address).map(|[byte]| byte)
    }

    /// A constant halfword.
    pub fn half(&self, address: u32) -> Option<u16> {
        self.constant(address).map(u16::from_le_bytes)
    }

    /// A constant word.
    pub fn word(&self, address: u32) -> Option<u32> {
        self.constant(address).map(u32::from_le_bytes)
    }

    /// Whether a 32-bit instruction is at an address.
    pub fn is_wide(&self, address: u32) -> bool {
        self.half(address).is_some_and(whippen_isa::is_wide)
    }
}
