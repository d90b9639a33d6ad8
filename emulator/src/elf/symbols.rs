//! Names of an image: by name, by address, and the nearest one to a name that does not exist.

use super::{ElfError, File, corrupt};
use object::elf::{STB_LOCAL, STT_FUNC, STT_NOTYPE, STT_OBJECT};
use object::read::elf::Sym;

/// A name for an address.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Symbol {
    /// As in the symbol table.
    pub name: String,
    /// Its address, without the Thumb bit.
    pub address: u32,
    /// Its size in bytes; 0 when the file does not say.
    pub bytes: u32,
    /// Whether it is a function.
    pub function: bool,
    /// Whether other files see it.
    pub global: bool,
}

/// Why a name stands for no address.
#[derive(Clone, PartialEq, Eq, Debug)]
pub enum SymbolError {
    /// No such name; the nearest one.
    Unknown {
        /// What was asked for.
        name: String,
        /// What may have been meant.
        nearest: Option<String>,
    },
    /// Several local symbols have the name.
    Ambiguous {
        /// What was asked for.
        name: String,
        /// Their addresses.
        addresses: Vec<u32>,
    },
}

impl std::fmt::Display for SymbolError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Unknown {
                name,
                nearest: Some(nearest),
            } => {
                write!(f, "there is no symbol `{name}`; did you mean `{nearest}`?")
            }
            Self::Unknown {
                name,
                nearest: None,
            } => write!(f, "there is no symbol `{name}`"),
            Self::Ambiguous { name, addresses } => {
                let list: Vec<String> = addresses.iter().map(|a| format!("{a:#010x}")).collect();
                write!(
                    f,
                    "several files have a `{name}`: write one of {}",
                    list.join(", ")
                )
            }
        }
    }
}

impl std::error::Error for SymbolError {}

/// The names of an image, sorted by address.
#[derive(Clone, Default, Debug)]
pub struct Symbols {
    sorted: Vec<Symbol>,
}

impl Symbols {
    pub(super) fn read(file: &File<'_>) -> Result<Self, ElfError> {
        let endian = file.endian();
        let table = file.elf_symbol_table();
        let mut symbols = Vec::new();
        for symbol in table.iter().filter(|s| !s.is_undefined(endian)) {
            let name = table.symbol_name(endian, symbol).map_err(corrupt)?;
            symbols.extend(one(
                &String::from_utf8_lossy(name),
                symbol,
                symbol.st_value(endian),
                symbol.st_size(endian),
            ));
        }
        Ok(Self::new(symbols))
    }

    /// Of these symbols.
    pub fn new(mut symbols: Vec<Symbol>) -> Self {
        // Where several names share an address, the one to show comes last: functions after labels,
        // global ones after local ones.
        symbols.sort_by(|a, b| {
            (a.address, a.function, a.global, &b.name)
                .cmp(&(b.address, b.function, b.global, &a.name))
        });
        Self { sorted: symbols }
    }

    /// All of them, by address.
    pub fn iter(&self) -> impl Iterator<Item = &Symbol> {
        self.sorted.iter()
    }

    /// Whether the image has no names.
    pub fn is_empty(&self) -> bool {
        self.sorted.is_empty()
    }

    /// The symbol of that name; a global one is preferred.
    ///
    /// # Errors
    /// There is none, or several.
    pub fn named(&self, name: &str) -> Result<&Symbol, SymbolError> {
        let mut found: Vec<&Symbol> = self.sorted.iter().filter(|s| s.name == name).collect();
        if found.iter().any(|s| s.global) {
            found.retain(|s| s.global);
        }
        found.dedup_by_key(|s| s.address);
        match found.as_slice() {
            [one] => Ok(one),
            [] => Err(SymbolError::Unknown {
                name: name.into(),
                nearest: self.nearest(name),
            }),
            several => Err(SymbolError::Ambiguous {
                name: name.into(),
                addresses: several.iter().map(|s| s.address).collect(),
            }),
        }
    }

    /// The symbol that covers an address, and how far into it the address is. One without a size
    /// reaches to the next.
    pub fn covering(&self, address: u32) -> Option<(&Symbol, u32)> {
        let behind = self.sorted.partition_point(|s| s.address <= address);
        let nearest = self.sorted[..behind].last()?.address;
        let first = self.sorted.partition_point(|s| s.address < nearest);
        let here = &self.sorted[first..behind];
        let covers = |s: &&Symbol| s.bytes == 0 || address - s.address < s.bytes;
        here.iter()
            .rev()
            .find(covers)
            .map(|s| (s, address - s.address))
    }

    fn nearest(&self, name: &str) -> Option<String> {
        let distance =
            |a: &str, b: &str| strsim::osa_distance(&a.to_lowercase(), &b.to_lowercase());
        let allowed = name.len() / 3 + 1;
        let near = |s: &&Symbol| s.name.len().abs_diff(name.len()) <= allowed;
        let measured = self
            .sorted
            .iter()
            .filter(near)
            .map(|s| (distance(name, &s.name), &s.name));
        measured
            .filter(|(d, _)| *d <= allowed)
            .min()
            .map(|(_, nearest)| nearest.clone())
    }
}

/// The symbol of a table's entry, unless it only marks something for tools.
pub(super) fn one<S: Sym>(name: &str, symbol: &S, value: u32, bytes: u32) -> Option<Symbol> {
    let kind = symbol.st_type();
    let tool = name.is_empty() || name.starts_with('$');
    let wanted = !tool && (kind == STT_FUNC || kind == STT_OBJECT || kind == STT_NOTYPE);
    let function = kind == STT_FUNC;
    let address = if function { value & !1 } else { value };
    let global = symbol.st_bind() != STB_LOCAL;
    wanted.then(|| Symbol {
        name: name.into(),
        address,
        bytes,
        function,
        global,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn symbol(name: &str, address: u32, bytes: u32, global: bool) -> Symbol {
        Symbol {
            name: name.into(),
            address,
            bytes,
            function: true,
            global,
        }
    }

    fn symbols() -> Symbols {
        Symbols::new(vec![
            symbol("fir_q15", 0x100, 16, true),
            symbol("helper", 0x120, 0, false),
            symbol("helper", 0x140, 8, false),
            symbol("main", 0x150, 4, true),
            symbol("main", 0x160, 4, false),
        ])
    }

    #[test]
    fn by_name_a_global_symbol_is_preferred_and_locals_may_be_ambiguous() {
        let symbols = symbols();
        assert_eq!(symbols.named("main").map(|s| s.address), Ok(0x150));
        let error = symbols.named("helper").unwrap_err();
        assert_eq!(
            error.to_string(),
            "several files have a `helper`: write one of 0x00000120, 0x00000140"
        );
    }

    #[test]
    fn the_nearest_name_is_suggested() {
        let suggestion = |name: &str| symbols().named(name).unwrap_err().to_string();
        assert_eq!(
            suggestion("fir_q31"),
            "there is no symbol `fir_q31`; did you mean `fir_q15`?"
        );
        assert_eq!(
            suggestion("Main2"),
            "there is no symbol `Main2`; did you mean `main`?"
        );
        assert_eq!(
            suggestion("quite_something_else"),
            "there is no symbol `quite_something_else`"
        );
    }

    #[test]
    fn an_address_belongs_to_the_symbol_before_it_if_that_reaches_so_far() {
        let symbols = symbols();
        let at = |address| {
            symbols
                .covering(address)
                .map(|(s, offset)| (s.address, offset))
        };
        assert_eq!(at(0x100), Some((0x100, 0)));
        assert_eq!(at(0x10e), Some((0x100, 14)));
        assert_eq!(at(0x110), None);
        assert_eq!(
            at(0x13e),
            Some((0x120, 0x1e)),
            "no size: to the next symbol"
        );
        assert_eq!(at(0xff), None);
    }
}
