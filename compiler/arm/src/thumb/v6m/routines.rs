//! The routines become a part of the object that calls them.

use crate::image::{Object, Section};
use crate::thumb::object::append_code;
use crate::thumb::routine::Routine;
use crate::thumb::{Options, ThumbError, names};

/// Texts with the routines that are in each: all of a text comes along where one is called.
const TEXTS: [(&str, &str, &[Routine]); 2] = [
    (
        "routines",
        include_str!("routines.s"),
        &[
            Routine::MulTop,
            Routine::MulHigh,
            Routine::UmulHigh,
            Routine::Divide,
            Routine::LeadingZeros,
        ],
    ),
    (
        "saturate",
        include_str!("saturate.s"),
        &[Routine::AddSat, Routine::SubSat],
    ),
];

/// Adds the routines that the code calls, under names of its own.
pub(in crate::thumb) fn add_routines(
    object: &mut Object,
    options: &Options,
) -> Result<(), ThumbError> {
    let name = |routine: &str| names::routine(&options.name, routine);
    for (title, text, routines) in TEXTS {
        let own: Vec<String> = routines.iter().map(|one| name(one.name())).collect();
        let calls = |section: &Section| {
            let mut fixups = section.fixups.iter();
            fixups.any(|fixup| own.contains(&fixup.symbol))
        };
        if object.sections.iter().any(calls) {
            let section = format!(".text.{}.{title}", options.name);
            append_code(object, section, options.arch, text, |label| {
                Some(name(label)).filter(|name| own.contains(name))
            })?;
        }
    }
    Ok(())
}
