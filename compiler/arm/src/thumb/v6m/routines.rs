//! The routines become a part of the object that calls them.

use crate::asm::{Source, assemble};
use crate::image::{Object, Section, SectionKind, Symbol};
use crate::thumb::routine::Routine;
use crate::thumb::{Options, ThumbError, names};

/// The text of the routines.
const ROUTINES: &str = include_str!("routines.s");

/// Adds the routines that the code calls, under names of its own.
pub(in crate::thumb) fn add_routines(
    object: &mut Object,
    options: &Options,
) -> Result<(), ThumbError> {
    let name = |routine: &str| names::routine(&options.name, routine);
    let all = Routine::ALL.map(|routine| name(routine.name()));
    let calls = |section: &Section| {
        section
            .fixups
            .iter()
            .any(|fixup| all.contains(&fixup.symbol))
    };
    if !object.sections.iter().any(calls) {
        return Ok(());
    }
    let source = Source {
        name: "routines.s",
        text: ROUTINES,
    };
    let routines = assemble(&[source], &Default::default(), options.arch)
        .map_err(|e| ThumbError::Bug(e.to_string()))?;
    let (code, others) = (object.sections.len(), routines.symbols);
    let own = others
        .into_iter()
        .filter(|symbol| all.contains(&name(&symbol.name)));
    object.symbols.extend(own.map(|symbol| Symbol {
        name: name(&symbol.name),
        section: Some(code),
        ..symbol
    }));
    let text = routines
        .sections
        .into_iter()
        .filter(|section| section.kind == SectionKind::Code && section.size != 0);
    object.sections.extend(text.map(|section| Section {
        name: format!(".text.{}.routines", options.name),
        ..section
    }));
    Ok(())
}
