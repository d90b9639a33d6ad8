//! Control flow of code as bytes, linked or not: what instructions there are and where they lead.
//!
//! Not here: what follows from it (`unwind`, `live`).

use std::cell::RefCell;
use std::collections::{BTreeSet, HashMap};

use rustc_hash::FxHashMap;

use super::linked::Image;
use super::object::{FixupKind, Hint, Object, SectionKind, SymbolKind};
use crate::control::{Control, falls_through};
use whippen_isa::{Arch, Inst, ItState, decode};

/// Some code and what its bytes do not say.
#[derive(Debug)]
pub(super) struct Flow<'a> {
    /// Of the cores.
    pub arch: Arch,
    /// Address and bytes of each section.
    pub sections: Vec<(u32, &'a [u8])>,
    /// Addresses of functions.
    pub functions: BTreeSet<u32>,
    /// Where indirect branches may lead.
    pub targets: FxHashMap<u32, Vec<u32>>,
    /// Where branches lead that are not linked yet; none: out of this code.
    pub unlinked: FxHashMap<u32, Option<u32>>,
    /// What was decoded, by address and state of IT.
    pub decoded: RefCell<FxHashMap<(u32, ItState), Option<Inst>>>,
}

/// Where an instruction leads.
pub(super) struct Leads {
    pub to: Vec<u32>,
    /// What is called before it goes on.
    pub calls: Vec<Option<u32>>,
    pub returns: bool,
    /// Whether nobody says what is called.
    pub calls_anybody: bool,
}

impl Flow<'_> {
    /// How many instructions there may be, about.
    pub(super) fn instructions(&self) -> usize {
        let bytes: usize = self.sections.iter().map(|(_, bytes)| bytes.len()).sum();
        bytes / 3
    }

    /// The instruction at an address, by its place in an IT block.
    pub(super) fn inst(&self, at: u32, it: ItState) -> Option<Inst> {
        let mut decoded = self.decoded.borrow_mut();
        *decoded
            .entry((at, it))
            .or_insert_with(|| self.decode(at, it))
    }

    fn decode(&self, at: u32, it: ItState) -> Option<Inst> {
        let inside = |(base, bytes): &&(u32, &[u8])| at.wrapping_sub(*base) < bytes.len() as u32;
        let (base, bytes) = self.sections.iter().find(inside)?;
        let half = |at: u32| {
            let at = (at - base) as usize;
            let pair = bytes.get(at..at + 2)?;
            Some(u16::from_le_bytes([pair[0], pair[1]]))
        };
        decode(half(at)?, half(at + 2).unwrap_or(0), self.arch, it).ok()
    }

    /// Where an instruction leads that stands there.
    pub(super) fn leads(&self, inst: &Inst, at: u32) -> Leads {
        let behind = at + inst.size();
        let targets = self.targets.get(&at);
        let known = targets.map_or(&[][..], Vec::as_slice);
        let unlinked = self.unlinked.get(&at);
        let mut leads = Leads {
            to: Vec::new(),
            calls: Vec::new(),
            returns: false,
            calls_anybody: false,
        };
        match Control::of(inst, at) {
            Control::Next | Control::Waits => leads.to.push(behind),
            Control::Jump(to) => match unlinked.copied().unwrap_or(Some(to)) {
                Some(to) => leads.to.push(to),
                None => leads.returns = true,
            },
            Control::Call(to) => {
                leads.calls.push(unlinked.copied().unwrap_or(Some(to)));
                leads.to.push(behind);
            }
            Control::CallIndirect => {
                leads.calls.extend(known.iter().map(|to| Some(*to)));
                leads.calls_anybody = targets.is_none();
                leads.to.push(behind);
            }
            Control::Return if targets.is_none() => leads.returns = true,
            Control::Return | Control::Indirect | Control::Table => leads.to.extend(known),
        }
        let conditional = falls_through(inst) && leads.to.last() != Some(&behind);
        leads.to.extend(conditional.then_some(behind));
        leads
    }
}

/// Of an image.
pub(super) fn of_image(image: &Image) -> Flow<'_> {
    let code = |kind: SectionKind| kind == SectionKind::Code;
    let sections = image.sections.iter().filter(|section| code(section.kind));
    let functions = image
        .symbols
        .iter()
        .filter(|symbol| symbol.kind == SymbolKind::Function);
    Flow {
        arch: image.arch,
        sections: sections.map(|s| (s.run, &s.bytes[..])).collect(),
        functions: functions.map(|symbol| symbol.address).collect(),
        targets: image.targets.iter().cloned().collect(),
        unlinked: FxHashMap::default(),
        decoded: RefCell::default(),
    }
}

/// Where a section of an object lies for this purpose: all far from each other.
pub(super) fn base(section: usize) -> u32 {
    (section as u32 + 1) << 24
}

/// Of an object.
pub(super) fn of_object(object: &Object, arch: Arch) -> Flow<'_> {
    let placed = object.symbols.iter().filter_map(|symbol| {
        let place = base(symbol.section?) + symbol.offset;
        Some((symbol.name.as_str(), place))
    });
    let places: HashMap<&str, u32> = placed.collect();
    let place = |name: &String| places.get(name.as_str()).copied();
    let mut flow = Flow {
        arch,
        sections: Vec::new(),
        functions: BTreeSet::new(),
        targets: FxHashMap::default(),
        unlinked: FxHashMap::default(),
        decoded: RefCell::default(),
    };
    for symbol in &object.symbols {
        if let (SymbolKind::Function, Some(section)) = (symbol.kind, symbol.section) {
            flow.functions.insert(base(section) + symbol.offset);
        }
    }
    let code = |kind: SectionKind| kind == SectionKind::Code;
    let sections = object.sections.iter().enumerate();
    for (index, section) in sections.filter(|(_, section)| code(section.kind)) {
        flow.sections.push((base(index), &section.bytes));
        for fixup in &section.fixups {
            if matches!(fixup.kind, FixupKind::ThumbCall | FixupKind::ThumbJump24) {
                let to = place(&fixup.symbol);
                flow.unlinked.insert(base(index) + fixup.at, to);
            }
        }
        for hint in &section.hints {
            if let Hint::Targets { at, symbols } = hint {
                let to = symbols.iter().filter_map(place).collect();
                flow.targets.insert(base(index) + at, to);
            }
        }
    }
    flow
}

/// The place in an IT block of an instruction to which another one leads.
pub(super) fn state_at(to: u32, from: u32, inst: &Inst, it: ItState) -> ItState {
    match to == from + inst.size() {
        true => inst.it_behind(it).unwrap_or_default(),
        false => ItState::OUTSIDE,
    }
}
