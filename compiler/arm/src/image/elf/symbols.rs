//! The symbol table: sections, then local names, then global ones.

use std::collections::HashMap;

use super::file::Part;
use crate::image::object::SymbolKind;

/// Names nothing here.
pub(super) const UNDEFINED: u16 = 0;
/// Names an address that is in no section.
pub(super) const ABSOLUTE: u16 = 0xfff1;

/// A name.
#[derive(Debug, Clone)]
pub(super) struct Entry {
    pub name: String,
    pub value: u32,
    pub size: u32,
    pub kind: SymbolKind,
    pub global: bool,
    /// The section's number, [`UNDEFINED`] or [`ABSOLUTE`].
    pub place: u16,
}

impl Entry {
    pub fn undefined(name: &str) -> Entry {
        let name = name.to_string();
        Entry {
            name,
            value: 0,
            size: 0,
            kind: SymbolKind::Label,
            global: true,
            place: UNDEFINED,
        }
    }
}

/// The table under construction.
#[derive(Debug)]
pub(super) struct Symbols {
    /// `.symtab`
    pub table: Vec<u8>,
    /// `.strtab`
    pub strings: Vec<u8>,
    /// Number of the first global symbol.
    pub first_global: u32,
    numbers: HashMap<String, u32>,
    /// Code and data sections, and whether they are code.
    starts: Vec<(u16, u32, bool)>,
}

impl Symbols {
    /// A symbol for each section, of the section's number.
    pub fn new(parts: &[Part]) -> Symbols {
        let mut symbols = Symbols {
            table: vec![0; 16],
            strings: vec![0],
            first_global: 1,
            numbers: HashMap::new(),
            starts: Vec::new(),
        };
        for (index, part) in parts.iter().enumerate() {
            let number = super::file::number(index);
            symbols.push(0, part.address, 0, 3, number);
            if let Some(code) = part.holds_code() {
                symbols.starts.push((number, part.address, code));
            }
        }
        symbols
    }

    /// Adds names, and before them what the sections hold from their beginning on: `$t` Thumb code,
    /// `$d` data.
    pub fn add(&mut self, mut entries: Vec<Entry>) {
        let maps = |place: u16| {
            entries
                .iter()
                .any(|e| e.place == place && is_mapping(&e.name))
        };
        let starts: Vec<(u16, u32, bool)> = self
            .starts
            .iter()
            .copied()
            .filter(|start| !maps(start.0))
            .collect();
        for (place, value, code) in starts {
            let name = self.string(if code { "$t" } else { "$d" });
            self.push(name, value, 0, 0, place);
        }
        entries.sort_by_key(|entry| entry.global);
        for entry in entries {
            let (kind, thumb) = match entry.kind {
                SymbolKind::Function => (2, 1),
                SymbolKind::Data => (1, 0),
                SymbolKind::Label => (0, 0),
            };
            let name = self.string(if is_mapping(&entry.name) {
                &entry.name[..2]
            } else {
                &entry.name
            });
            if !entry.global {
                self.first_global = self.count() + 1;
            }
            self.numbers.insert(entry.name, self.count());
            let thumb = if entry.place == UNDEFINED { 0 } else { thumb };
            self.push(
                name,
                entry.value | thumb,
                entry.size,
                u8::from(entry.global) << 4 | kind,
                entry.place,
            );
        }
    }

    /// The number of a name.
    pub fn number(&self, name: &str) -> u32 {
        self.numbers.get(name).copied().unwrap_or(0)
    }

    fn count(&self) -> u32 {
        self.table.len() as u32 / 16
    }

    fn string(&mut self, text: &str) -> u32 {
        let at = self.strings.len() as u32;
        self.strings.extend(text.as_bytes());
        self.strings.push(0);
        at
    }

    fn push(&mut self, name: u32, value: u32, size: u32, info: u8, place: u16) {
        for word in [name, value, size] {
            self.table.extend(word.to_le_bytes());
        }
        self.table.extend([info, 0]);
        self.table.extend(place.to_le_bytes());
        if info >> 4 == 0 {
            self.first_global = self.count();
        }
    }
}

/// Whether a name only says what follows: `$t` and `$d`, alone or with a suffix.
fn is_mapping(name: &str) -> bool {
    matches!(
        name.as_bytes(),
        [b'$', b't' | b'd'] | [b'$', b't' | b'd', b'.', ..]
    )
}
