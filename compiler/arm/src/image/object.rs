//! Code and data without addresses: sections, symbols, places to be filled in.

use std::collections::BTreeSet;

use super::lines::Place;
use super::link::Input;

/// What a section holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum SectionKind {
    /// Instructions.
    Code,
    /// Constants.
    Constant,
    /// Variables with a start value.
    Data,
    /// Variables that start as zero: `bytes` is empty, `size` counts.
    Zeroed,
}

/// A piece that stays together.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Section {
    /// As in `.text.grand_piano.tick`; a linker places sections by name.
    pub name: String,
    /// What it holds.
    pub kind: SectionKind,
    /// A power of two.
    pub align: u32,
    /// What it holds, without fixups applied.
    pub bytes: Vec<u8>,
    /// Its size in bytes.
    pub size: u32,
    /// Where addresses are to be filled in.
    pub fixups: Vec<Fixup>,
    /// Which source the instructions from an offset on belong to, by offset.
    pub lines: Vec<LineRow>,
    /// What a static bound may not guess.
    pub hints: Vec<Hint>,
}

/// From this offset on (to the next row), instructions belong to this source.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct LineRow {
    /// Offset in the section.
    pub at: u32,
    /// Index into the origins of the program; none: nobody's.
    pub origin: Option<u32>,
}

/// What only the compiler knows of the control flow.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Hint {
    /// The instruction at this offset is the head of a loop and runs at most so often each time the
    /// loop is entered.
    Loop {
        /// Offset of the loop's first instruction.
        at: u32,
        /// How often it runs.
        rounds_max: u32,
    },
    /// The indirect branch at this offset goes to one of these symbols.
    Targets {
        /// Offset of the branch.
        at: u32,
        /// Names of symbols.
        symbols: Vec<String>,
    },
}

/// A place where an address is to be filled in.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Fixup {
    /// Offset in the section.
    pub at: u32,
    /// How.
    pub kind: FixupKind,
    /// Name of the symbol.
    pub symbol: String,
    /// Added to its address.
    pub addend: i32,
}

/// How an address is filled in; the names are those of the ABI for the Arm architecture.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum FixupKind {
    /// R_ARM_ABS32: a word; bit 0 is set for a function.
    Abs32,
    /// R_ARM_REL32: a word, relative to itself.
    Rel32,
    /// R_ARM_THM_CALL: BL.
    ThumbCall,
    /// R_ARM_THM_JUMP24: B.W.
    ThumbJump24,
    /// R_ARM_THM_MOVW_ABS_NC: the low half.
    MovwAbs,
    /// R_ARM_THM_MOVT_ABS: the high half.
    MovtAbs,
}

/// What a symbol names.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum SymbolKind {
    /// A function (Thumb).
    Function,
    /// Data.
    Data,
    /// Nothing but a place.
    Label,
}

/// A name for a place.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Symbol {
    /// Its name.
    pub name: String,
    /// Index of its section; none where it is defined elsewhere.
    pub section: Option<usize>,
    /// Offset in the section.
    pub offset: u32,
    /// Bytes it names.
    pub size: u32,
    /// What it names.
    pub kind: SymbolKind,
    /// Whether other objects see it.
    pub global: bool,
}

/// Sections and symbols.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Object {
    /// Sections.
    pub sections: Vec<Section>,
    /// Symbols; names are unique.
    pub symbols: Vec<Symbol>,
}

impl Object {
    /// Several objects as one, whose names are different, and the places of all their origins.
    pub fn joined(inputs: &[Input]) -> (Object, Vec<Place>) {
        let (mut all, mut places) = (Object::default(), Vec::new());
        for input in inputs {
            let (sections, origins) = (all.sections.len(), places.len() as u32);
            all.sections.extend(input.object.sections.iter().cloned());
            for row in all.sections[sections..]
                .iter_mut()
                .flat_map(|own| &mut own.lines)
            {
                row.origin = row.origin.map(|origin| origin + origins);
            }
            all.symbols
                .extend(input.object.symbols.iter().map(|symbol| Symbol {
                    section: symbol.section.map(|section| section + sections),
                    ..symbol.clone()
                }));
            places.extend_from_slice(input.places);
        }
        all.forget_what_is_defined();
        (all, places)
    }

    /// What one of several objects wants of another is a name of their own.
    fn forget_what_is_defined(&mut self) {
        let defined = self
            .symbols
            .iter()
            .filter(|symbol| symbol.section.is_some());
        let defined: BTreeSet<String> = defined.map(|symbol| symbol.name.clone()).collect();
        self.symbols
            .retain(|symbol| symbol.section.is_some() || !defined.contains(&symbol.name));
    }
}
