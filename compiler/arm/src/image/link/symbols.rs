//! Names and their addresses: those of the inputs, and the bounds of every memory.

use super::super::linked::Named;
use super::super::object::{Symbol, SymbolKind};
use super::{LinkError, Linker};
use std::collections::HashMap;

/// Address and kind of each name.
pub(super) type Addresses<N> = HashMap<N, (u32, SymbolKind)>;

impl<'a> Linker<'a> {
    /// Address and kind of each global name.
    pub(super) fn globals(&self) -> Result<Addresses<String>, LinkError> {
        let mut globals = HashMap::new();
        for symbol in self.symbols().into_iter().filter(|symbol| symbol.global) {
            if globals
                .insert(symbol.name.clone(), (symbol.address, symbol.kind))
                .is_some()
            {
                return Err(LinkError::Twice {
                    symbol: symbol.name,
                });
            }
        }
        Ok(globals)
    }

    /// Address and kind of each name that an input defines.
    pub(super) fn own_symbols(&self, input: usize) -> Addresses<&'a str> {
        let object = self.inputs[input].object;
        let place = |symbol: &'a Symbol| {
            let section = &self.sections[self.places[&(input, symbol.section?)]];
            Some((
                symbol.name.as_str(),
                (section.run + symbol.offset, symbol.kind),
            ))
        };
        object.symbols.iter().filter_map(place).collect()
    }

    /// All names by address: those of the inputs, and the bounds of memory.
    pub(super) fn symbols(&self) -> Vec<Named> {
        let mut all = Vec::new();
        for (number, input) in self.inputs.iter().enumerate() {
            for symbol in &input.object.symbols {
                let Some(section) = symbol
                    .section
                    .map(|section| self.places[&(number, section)])
                else {
                    continue;
                };
                let address = self.sections[section].run + symbol.offset;
                let Symbol {
                    name,
                    size,
                    kind,
                    global,
                    ..
                } = symbol.clone();
                all.push(Named {
                    name,
                    address,
                    size,
                    kind,
                    global,
                    section: Some(section),
                });
            }
        }
        for bound in &self.bounds {
            let end = bound.memory.base.wrapping_add(bound.memory.size);
            for (what, address) in [
                ("start", bound.memory.base),
                ("end", end),
                ("free", bound.free),
            ] {
                let name = format!("__{}_{what}", bound.memory.name);
                all.push(Named {
                    name,
                    address,
                    size: 0,
                    kind: SymbolKind::Label,
                    global: true,
                    section: None,
                });
            }
        }
        all.sort_by(|a, b| (a.address, &a.name).cmp(&(b.address, &b.name)));
        all
    }
}
