//! Resolution: fixups and hints of sections, by the addresses of the names in them. A name is the
//! input's own, if it has one of that name, and otherwise a global one.

use super::super::fixup::apply;
use super::super::object::{Fixup, Hint, Section, SymbolKind};
use super::symbols::Addresses;
use super::{LinkError, Linker};

/// What the objects say of control flow, by address.
#[derive(Default)]
pub(super) struct Hints {
    /// Loops, and how many rounds they make at most.
    pub loops: Vec<(u32, u32)>,
    /// Indirect branches, and where they may lead.
    pub targets: Vec<(u32, Vec<u32>)>,
}

impl Linker<'_> {
    /// Fills in every address that sections ask for.
    pub(super) fn resolve_fixups(&mut self, globals: &Addresses<String>) -> Result<(), LinkError> {
        for (number, input) in self.inputs.iter().enumerate() {
            let own = self.own_symbols(number);
            for (index, section) in input.object.sections.iter().enumerate() {
                let place = self.places[&(number, index)];
                for fixup in &section.fixups {
                    self.fix(place, section, fixup, &own, globals)?;
                }
            }
        }
        Ok(())
    }

    fn fix(
        &mut self,
        place: usize,
        section: &Section,
        fixup: &Fixup,
        own: &Addresses<&str>,
        globals: &Addresses<String>,
    ) -> Result<(), LinkError> {
        let (symbol, name) = (fixup.symbol.clone(), section.name.clone());
        let found = own.get(symbol.as_str()).or_else(|| globals.get(&symbol));
        let Some(&(address, kind)) = found else {
            return Err(LinkError::Undefined {
                symbol,
                section: name,
            });
        };
        let linked = &mut self.sections[place];
        let thumb = u32::from(kind == SymbolKind::Function);
        let value = address.wrapping_add_signed(fixup.addend) | thumb;
        apply(
            &mut linked.bytes,
            fixup.at,
            fixup.kind,
            value,
            linked.run.wrapping_add(fixup.at),
        )
        .map_err(|error| LinkError::Fixup {
            symbol,
            section: name,
            error,
        })
    }

    /// What the hints of all sections say, by address.
    pub(super) fn resolve_hints(&self, globals: &Addresses<String>) -> Result<Hints, LinkError> {
        let mut hints = Hints::default();
        let mut last: Option<(&Vec<String>, Vec<u32>)> = None;
        for (number, input) in self.inputs.iter().enumerate() {
            let own = self.own_symbols(number);
            for (index, section) in input.object.sections.iter().enumerate() {
                let run = self.sections[self.places[&(number, index)]].run;
                for hint in &section.hints {
                    match hint {
                        Hint::Loop { at, rounds_max } => hints.loops.push((run + at, *rounds_max)),
                        Hint::Targets { at, symbols } => {
                            // Whoever goes to the next key goes where the one before does.
                            let to = match last {
                                Some((same, to)) if same == symbols => to,
                                _ => addresses_of(symbols, section, &own, globals)?,
                            };
                            hints.targets.push((run + at, to.clone()));
                            last = Some((symbols, to));
                        }
                    }
                }
            }
        }
        hints.loops.sort_unstable();
        hints.targets.sort_unstable();
        Ok(hints)
    }
}

/// The addresses of names that a section branches to.
fn addresses_of(
    symbols: &[String],
    section: &Section,
    own: &Addresses<&str>,
    globals: &Addresses<String>,
) -> Result<Vec<u32>, LinkError> {
    let address = |symbol: &String| {
        let found = own.get(symbol.as_str()).or_else(|| globals.get(symbol));
        let undefined = || LinkError::Undefined {
            symbol: symbol.clone(),
            section: section.name.clone(),
        };
        found.map(|(address, _)| *address).ok_or_else(undefined)
    };
    symbols.iter().map(address).collect()
}
