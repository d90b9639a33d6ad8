//! Observation of the back end: the code of each function after each of its passes, as text.
//!
//! The text of a pass is made by the pass: a mode goes once more through selection, promotion,
//! scheduling, allocation and reordering with the strategy that the search has chosen for it, and
//! what comes out last is compared with what was chosen. After `emit` stand the bytes of the
//! object, before addresses are filled in.

mod emitted;
mod forms;

use super::code_cache::CodeCache;
use super::{Options, Parts, ThumbError, build_object, compile_parts, critical_path, names};
use forms::{ModeForms, forms_of};
use std::fmt::Display;
use whippen_ids::IdMap;
use whippen_modes::{ModeId, Modes};

/// A pass of the back end, in the order in which they run.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Pass {
    /// Instructions over virtual registers, as the core has them.
    Select,
    /// Words that all keys read are in registers.
    Promote,
    /// Instructions in an order that hides their latency.
    Schedule,
    /// Registers and words of the stack.
    Allocate,
    /// Instructions with registers, in a better order, moved over branches.
    Reorder,
    /// Bytes, with offsets.
    Emit,
}

impl Pass {
    /// All passes: each with its name and what it makes.
    pub const ALL: [(Pass, &'static str, &'static str); 6] = [
        (
            Pass::Select,
            "select",
            "machine code of each mode over virtual registers",
        ),
        (
            Pass::Promote,
            "promote",
            "the same; words that every key reads are in registers",
        ),
        (
            Pass::Schedule,
            "schedule",
            "the same, in an order that hides latencies",
        ),
        (Pass::Allocate, "allocate", "machine code with registers"),
        (
            Pass::Reorder,
            "reorder",
            "the same in a better order, moved over branches",
        ),
        (
            Pass::Emit,
            "emit",
            "the bytes before they are linked: offset, encoding, cycles, instruction",
        ),
    ];

    /// The pass of a name.
    pub fn named(name: &str) -> Option<Pass> {
        let pass = Pass::ALL.iter().find(|(_, known, _)| *known == name)?;
        Some(pass.0)
    }
}

/// The code of one function after a pass.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Function {
    /// Its symbol.
    pub name: String,
    /// Which mode it is the code of, if it is that of a mode.
    pub mode: Option<ModeId>,
    /// Its longest path in cycles, as strategies are compared by: the bound of final bytes is
    /// `whippen-budget`'s.
    pub cycles: Option<u64>,
    /// Its instructions, one a line.
    pub text: String,
}

/// The code of every mode after a pass; after [`Pass::Emit`] that of all functions.
///
/// # Errors
/// Those of [`super::compile`].
pub fn code_after(
    pass: Pass,
    modes: &Modes,
    options: &Options,
) -> Result<Vec<Function>, ThumbError> {
    let mut parts = compile_parts(modes, options, None, CodeCache::of_process())?;
    if pass == Pass::Emit {
        return emitted(parts, options);
    }
    let modes: Vec<ModeId> = parts.made.modes.ids().collect();
    modes
        .into_iter()
        .map(|mode| {
            let forms = forms_of(&mut parts, mode)?;
            Ok(Function {
                name: names::mode(&options.name, mode),
                mode: Some(mode),
                cycles: None,
                text: text_after(pass, &forms),
            })
        })
        .collect()
}

fn text_after(pass: Pass, forms: &ModeForms) -> String {
    let form: &dyn Display = match pass {
        Pass::Select => &forms.selected,
        Pass::Promote => &forms.promoted,
        Pass::Schedule => &forms.scheduled,
        Pass::Allocate => &forms.allocated,
        Pass::Reorder | Pass::Emit => &forms.reordered,
    };
    form.to_string()
}

fn emitted(parts: Parts, options: &Options) -> Result<Vec<Function>, ThumbError> {
    let core = parts.core;
    let longest: IdMap<ModeId, u64> = parts
        .made
        .modes
        .iter()
        .map(|func| critical_path::worst_case_cycles(func, &core))
        .collect();
    let built = build_object(parts, options)?;
    let mut functions = emitted::functions(&built.object, &core);
    for (mode, cycles) in longest.enumerated() {
        let name = names::mode(&options.name, mode);
        let of_mode = functions
            .iter_mut()
            .filter(|function| function.name == name);
        of_mode.for_each(|function| {
            (function.mode, function.cycles) = (Some(mode), Some(*cycles));
        });
    }
    Ok(functions)
}
