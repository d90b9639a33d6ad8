//! Reading an ELF file: sections that are loaded, their bytes, certificate and Kernels.

#[cfg(test)]
pub(crate) mod tests;

/// The section that holds the certificate.
pub const CERTIFICATE: &str = ".whippen.certificate";

/// The section that holds the text of the Kernels.
pub const KERNELS: &str = ".whippen.kernels";

/// Of a segment: its bytes are loaded.
const LOADED: u32 = 1;

/// Of a section: it takes no bytes of the file.
const WITHOUT_BYTES: usize = 8;

/// Flags of a section: it is written, loaded, code.
const WRITTEN: u32 = 1;
const ALLOCATED: u32 = 2;
const CODE: u32 = 4;

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

const EARLY: &str = "is an ELF file that ends too early";

/// The entries of a table, in words: the header says where it begins, and from `sizes` on how large
/// an entry is and how many there are.
fn entries<const N: usize>(
    file: &[u8],
    begins: usize,
    sizes: usize,
) -> Result<Vec<[u32; N]>, String> {
    let [size, count] = [sizes, sizes + 2].map(|at| half_at(file, at));
    let (table, count) = word_at(file, begins).zip(count).ok_or(EARLY)?;
    if count > 0 && size != Some(4 * N) {
        return Err("has headers of another size than that of an ELF file".into());
    }
    let table = file.get(table as usize..).ok_or(EARLY)?;
    let own = table.get(..4 * N * count).ok_or(EARLY)?;
    let entry = |entry: &[u8]| std::array::from_fn(|nth| word_at(entry, 4 * nth).unwrap_or(0));
    Ok(own.chunks_exact(4 * N).map(entry).collect())
}

/// The number of the first range of addresses that goes beyond the address space, or into the one
/// behind it; empty ones lie anywhere.
pub(crate) fn not_apart(ranges: impl Iterator<Item = (u32, u32)>) -> Option<usize> {
    let mut all: Vec<_> = ranges.enumerate().filter(|(_, own)| own.1 > 0).collect();
    all.sort_by_key(|(_, (base, _))| *base);
    let next = all.iter().skip(1).map(|(_, (base, _))| *base);
    let mut ends = all.iter().zip(next.map(Some).chain([None]));
    let found = ends.find(|((_, (base, size)), next)| {
        let end = base.checked_add(*size);
        end.is_none_or(|end| next.is_some_and(|next| next < end))
    });
    found.map(|((number, _), _)| *number)
}

/// Name and bytes of a section.
fn contents<'a>(
    file: &'a [u8],
    names: &'a [u8],
    header: &[u32; 10],
) -> Option<(&'a [u8], &'a [u8])> {
    let [name, kind, _, _, from, size, ..] = header.map(|word| word as usize);
    let name = names.get(name..)?.split(|byte| *byte == 0).next()?;
    let bytes = match kind == WITHOUT_BYTES {
        true => &[],
        false => file.get(from..)?.get(..size)?,
    };
    Some((name, bytes))
}

/// Whether a segment loads those bytes of the file to where their section lies.
fn is_loaded(segments: &[[u32; 8]], base: u32, from: u32, size: u32) -> bool {
    segments.iter().any(|[_, begins, run, _, bytes, ..]| {
        let within = base.checked_sub(*run).filter(|within| within <= bytes);
        within.is_some_and(|within| {
            begins.checked_add(within) == Some(from) && size <= bytes - within
        })
    })
}

impl Elf {
    /// Reads an executable for Arm, little endian, of 32 bits.
    ///
    /// # Errors
    /// It is none, or what it loads is not what its sections hold.
    pub fn read(file: &[u8]) -> Result<Self, String> {
        let is_arm = file.starts_with(b"\x7fELF\x01\x01") && half_at(file, 18) == Some(40);
        if !is_arm || half_at(file, 16) != Some(2) {
            return Err("is no executable ELF file for Arm".into());
        }
        let headers: Vec<[u32; 10]> = entries(file, 32, 46)?;
        let mut segments: Vec<[u32; 8]> = entries(file, 28, 42)?;
        segments.retain(|[kind, ..]| *kind == LOADED);
        // Where they are loaded to, and where they lie while the program runs.
        let loads = segments.iter().map(|own| (own[3], own[4]));
        let runs = segments.iter().map(|own| (own[2], own[4].max(own[5])));
        if not_apart(loads).is_some() || not_apart(runs).is_some() {
            return Err("has segments that overlap".into());
        }
        let names = half_at(file, 50).and_then(|nth| headers.get(nth));
        let names = names.and_then(|[_, _, _, _, from, ..]| file.get(*from as usize..));
        let names = names.ok_or(EARLY)?;
        // Nothing stands in a file more than once.
        let (mut elf, mut left) = (Self::default(), file.len());
        for header in headers.iter().skip(1) {
            let (name, bytes) = contents(file, names, header).ok_or(EARLY)?;
            let taken = left.checked_sub(name.len() + bytes.len());
            left = taken.ok_or("has sections of the same bytes")?;
            elf.add(header, &String::from_utf8_lossy(name), bytes, &segments)?;
        }
        elf.sections.sort_by_key(|section| section.base);
        let ranges = elf.sections.iter().map(|own| (own.base, own.size));
        match not_apart(ranges) {
            Some(nth) => Err(format!(
                "has a section `{}` that goes into another one, or beyond all addresses",
                elf.sections[nth].name
            )),
            None => Ok(elf),
        }
    }

    fn add(
        &mut self,
        header: &[u32; 10],
        name: &str,
        bytes: &[u8],
        segments: &[[u32; 8]],
    ) -> Result<(), String> {
        let [_, _, flags, base, from, size, ..] = *header;
        if flags & ALLOCATED == 0 {
            return self.keep_text(name, bytes);
        }
        if !bytes.is_empty() && !is_loaded(segments, base, from, size) {
            return Err(format!("has a section `{name}` that no segment loads"));
        }
        self.sections.push(Section {
            name: name.to_string(),
            base,
            size,
            code: flags & CODE != 0,
            writable: flags & WRITTEN != 0,
            bytes: bytes.to_vec(),
        });
        Ok(())
    }

    /// Keeps what a section holds that is not loaded, if it is the certificate or its Kernels.
    fn keep_text(&mut self, name: &str, bytes: &[u8]) -> Result<(), String> {
        let kept = match name {
            CERTIFICATE => &mut self.certificate,
            KERNELS => &mut self.kernels,
            _ => return Ok(()),
        };
        let text = String::from_utf8(bytes.to_vec());
        let text = text.map_err(|_| format!("has a section `{name}` that is no text"))?;
        match kept.replace(text) {
            Some(_) => Err(format!("has two sections `{name}`")),
            None => Ok(()),
        }
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
