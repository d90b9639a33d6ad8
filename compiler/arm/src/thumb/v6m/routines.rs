//! The routines become a part of the object that calls them.

use crate::image::{Object, Section};
use crate::thumb::object::append_code;
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
    let section = format!(".text.{}.routines", options.name);
    append_code(object, section, options.arch, ROUTINES, |label| {
        Some(name(label)).filter(|name| all.contains(name))
    })
}
