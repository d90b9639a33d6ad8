//! From instructions with registers to bytes: encodings, IT blocks, branches, addresses to be
//! filled in.
//!
//! ```text
//!   items: instruction | label | branch to a label     ->  sizes until nothing grows  ->  bytes, fixups, rows of origins
//! ```
//!
//! Every instruction takes its shortest encoding, but for those that grow so that others are
//! aligned ([`align`]). Where the flags are not needed, that may be one that sets them: 16-bit
//! instructions let a branch or IT behind them cost less.

mod align;
mod islands;

use super::minst::{Relocation, RowPlace, template};
use super::{ThumbError, names};
use crate::features::Features;
use crate::image::{Fixup, FixupKind, Hint, LineRow, Symbol, SymbolKind};
use whippen_isa::{Arch, Cond, Encoding, Flags, Form, Inst, Op};

/// An instruction, where it is from, and which address its immediate is.
pub(super) type Line = (Inst, Option<u32>, Option<Relocation>);

/// A place in the code, by number.
pub(super) type Label = usize;

/// What code is made of.
#[derive(Debug, Clone)]
pub(super) enum Item {
    Inst {
        inst: Inst,
        origin: Option<u32>,
        address: Option<Relocation>,
    },
    Label(Label),
    /// A function begins, at a word.
    Function {
        name: String,
        global: bool,
    },
    Branch {
        cond: Option<Cond>,
        to: Label,
    },
    /// A branch to an address in a register, which is that of one of these functions.
    Indirect {
        inst: Inst,
        to: Vec<String>,
    },
    /// The next instruction is the head of a loop.
    Loop {
        rounds: u32,
    },
}

/// Finished code.
#[derive(Debug, Default)]
pub(super) struct Bytes {
    pub bytes: Vec<u8>,
    pub fixups: Vec<Fixup>,
    pub lines: Vec<LineRow>,
    pub hints: Vec<Hint>,
    pub symbols: Vec<Symbol>,
}

/// An instruction that has no encoding, which is a bug.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct NoEncoding(String);

/// Turns narrow what may be, and puts conditional instructions into IT blocks. `flags` says whether
/// the end needs them.
pub(super) fn select_encodings(code: &mut Vec<Line>, arch: Arch, flags: bool) {
    let mut live = if flags { Flags::NZCV } else { Flags::NONE };
    for (inst, ..) in code.iter_mut().rev() {
        if live.is_empty() {
            *inst = flag_setting_form(inst, arch).unwrap_or(*inst);
        }
        let use_ = inst.flags();
        live = live.without(use_.writes) | use_.reads;
        if inst.is_conditional() {
            live |= use_.writes;
        }
    }
    let mut done: Vec<Line> = Vec::with_capacity(code.len());
    let mut rest = code.as_slice();
    while let Some((first, _)) = rest.split_first() {
        let count = it_block_len(rest.iter().map(|(inst, ..)| inst.cond));
        if let (Some(cond), 1..) = (first.0.cond, count) {
            done.push((it_inst(cond, &rest[..count]), first.1, None));
        }
        done.extend_from_slice(&rest[..count.max(1)]);
        rest = &rest[count.max(1)..];
    }
    *code = done;
}

/// The 16-bit form that sets the flags, if there is one that is worth it.
pub(super) fn flag_setting_form(inst: &Inst, arch: Arch) -> Option<Inst> {
    let with = Inst { s: true, ..*inst };
    let may =
        inst.cond.is_none() && inst.op() != Op::MUL && !inst.s && !with.flags().writes.is_empty();
    let short = may.then(|| with.shortest(arch)).flatten();
    short.filter(|short| short.size() == 2 && short.s)
}

/// How many instructions from the first on one IT block can hold, by their conditions; none if the
/// first has no condition.
pub(super) fn it_block_len(mut conditions: impl Iterator<Item = Option<Cond>>) -> usize {
    let Some(first) = conditions.next().flatten() else {
        return 0;
    };
    1 + conditions
        .take(3)
        .take_while(|cond| *cond == Some(first) || *cond == first.invert())
        .count()
}

/// The IT instruction in front of these.
pub(super) fn it_inst(cond: Cond, block: &[Line]) -> Inst {
    let bits = block[1..]
        .iter()
        .map(|(inst, ..)| inst.cond.map_or(0, |c| c.bits() & 1));
    let mask = bits.fold(1, |mask, bit| mask << 1 | u32::from(bit)) << 1 | 1;
    let mask = (mask << (4 - block.len())) & 15;
    let encoding = Encoding::of(Op::IT).next();
    let it = encoding.map_or_else(|| template(Op::IT), Inst::new);
    Inst {
        imm: u32::from(cond.bits()) << 4 | mask,
        ..it
    }
}

/// Lays out items.
///
/// # Errors
/// Branches that go too far for the core; an instruction without encoding, a bug.
pub(super) fn assemble(
    mut items: Vec<Item>,
    mut labels: usize,
    arch: Arch,
    name: &str,
) -> Result<Bytes, ThumbError> {
    let bug = |NoEncoding(what)| ThumbError::Bug(what);
    for item in &mut items {
        if let Item::Inst { inst, .. } | Item::Indirect { inst, .. } = item {
            *inst = shortest_encoding(inst, arch).map_err(bug)?;
        }
    }
    if !Features::of(arch).wide_branches {
        let bytes = initial_sizes(&items).iter().sum();
        let all = islands::insert_islands(items, labels, arch);
        items = all.map_err(|islands::TooFar| ThumbError::Branches { bytes })?;
        labels += items.len();
    }
    let (sizes, places) = relax_branches(&items, labels, arch);
    write_bytes(&items, &sizes, &places, arch, name).map_err(bug)
}

/// Sizes of which none need grow, and where everything then is.
fn relax_branches(items: &[Item], labels: usize, arch: Arch) -> (Vec<u32>, Places) {
    let mut sizes = initial_sizes(items);
    loop {
        let places = assign_offsets(items, &mut sizes, labels, arch);
        if !widen_branches(items, &mut sizes, &places) {
            return (sizes, places);
        }
    }
}

fn initial_sizes(items: &[Item]) -> Vec<u32> {
    let size = |item: &Item| match item {
        Item::Inst { inst, .. } | Item::Indirect { inst, .. } => inst.size(),
        Item::Branch { .. } => 2,
        Item::Label(_) | Item::Function { .. } | Item::Loop { .. } => 0,
    };
    items.iter().map(size).collect()
}

fn shortest_encoding(inst: &Inst, arch: Arch) -> Result<Inst, NoEncoding> {
    let as_is = || inst.encode(arch).is_ok().then_some(*inst);
    inst.shortest(arch)
        .or_else(as_is)
        .ok_or_else(|| NoEncoding(format!("{inst:?}")))
}

/// Where each label is, and at which offset each item begins.
struct Places {
    labels: Vec<u32>,
    items: Vec<u32>,
}

fn assign_offsets(items: &[Item], sizes: &mut [u32], labels: usize, arch: Arch) -> Places {
    let mut places = Places {
        labels: vec![0; labels],
        items: Vec::with_capacity(items.len()),
    };
    let features = Features::of(arch);
    let (mut at, mut leads_on) = (0_u32, true);
    for (index, item) in items.iter().enumerate() {
        // Where only branches lead, a long instruction that does not begin at a word would cost
        // them a cycle.
        let is_target = !leads_on && matches!(item, Item::Label(_) | Item::Loop { .. });
        if matches!(item, Item::Function { .. })
            || is_target && is_followed_by_long(&items[index..], &sizes[index..])
        {
            at = at.next_multiple_of(4);
        }
        if features.aligns_wide_instructions
            && sizes[index] == 4
            && at & 2 != 0
            && align::align_item(items, sizes, &mut places, index, arch)
        {
            at += 2;
        }
        let size = sizes[index];
        if size > 0 {
            leads_on = !matches!(
                item,
                Item::Branch { cond: None, .. } | Item::Indirect { .. }
            );
        }
        if let Item::Label(label) = item {
            places.labels[*label] = at;
        }
        places.items.push(at);
        at += size;
    }
    places
}

/// Whether the next instruction takes two halfwords.
fn is_followed_by_long(items: &[Item], sizes: &[u32]) -> bool {
    let between = |item: &&Item| matches!(item, Item::Label(_) | Item::Loop { .. });
    sizes.get(items.iter().take_while(between).count()) == Some(&4)
}

/// Widens the branches that do not reach; whether there were any.
fn widen_branches(items: &[Item], sizes: &mut [u32], places: &Places) -> bool {
    let mut grown = false;
    for (index, item) in items.iter().enumerate() {
        let Item::Branch { cond, to } = item else {
            continue;
        };
        let reach = if cond.is_some() {
            -256..256
        } else {
            -2048..2048
        };
        let offset = branch_offset(places, index, *to);
        if sizes[index] == 2 && !reach.contains(&offset) {
            sizes[index] = 4;
            grown = true;
        }
    }
    grown
}

fn branch_offset(places: &Places, index: usize, to: Label) -> i64 {
    i64::from(places.labels[to]) - i64::from(places.items[index]) - 4
}

fn write_bytes(
    items: &[Item],
    sizes: &[u32],
    places: &Places,
    arch: Arch,
    name: &str,
) -> Result<Bytes, NoEncoding> {
    let mut out = Bytes::default();
    for (index, item) in items.iter().enumerate() {
        while out.bytes.len() < places.items[index] as usize {
            out.bytes.extend([0x00, 0xbf]);
        }
        let at = places.items[index];
        match item {
            Item::Label(_) => {}
            Item::Function { name, global } => out.symbols.push(function_symbol(name, at, *global)),
            Item::Loop { rounds } => out.hints.push(Hint::Loop {
                at,
                rounds_max: *rounds,
            }),
            Item::Inst {
                inst,
                origin,
                address,
            } => {
                out.add_line(at, *origin);
                out.add_fixup(at, *address, name);
                out.push_inst(&in_size(inst, sizes[index], arch), arch)?;
            }
            Item::Indirect { inst, to } => {
                out.hints.push(Hint::Targets {
                    at,
                    symbols: to.clone(),
                });
                out.push_inst(inst, arch)?;
            }
            Item::Branch {
                cond: Some(cond),
                to,
            } if sizes[index] == 4 && !Features::of(arch).wide_branches => {
                // Around a branch that reaches further.
                out.push_inst(&branch_inst(cond.invert(), false, 0), arch)?;
                out.push_inst(
                    &branch_inst(None, false, branch_offset(places, index, *to) - 2),
                    arch,
                )?;
            }
            Item::Branch { cond, to } => {
                out.push_inst(
                    &branch_inst(*cond, sizes[index] == 4, branch_offset(places, index, *to)),
                    arch,
                )?;
            }
        }
    }
    out.close_symbols();
    Ok(out)
}

/// An instruction in the encoding that takes so many bytes.
fn in_size(inst: &Inst, size: u32, arch: Arch) -> Inst {
    let grown = (inst.size() < size).then(|| inst.wide(arch)).flatten();
    grown.unwrap_or(*inst)
}

fn function_symbol(name: &str, at: u32, global: bool) -> Symbol {
    Symbol {
        name: name.to_string(),
        section: Some(0),
        offset: at,
        size: 0,
        kind: SymbolKind::Function,
        global,
    }
}

pub(super) fn branch_inst(cond: Option<Cond>, wide: bool, offset: i64) -> Inst {
    let form = match (cond.is_some(), wide) {
        (true, false) => Form::T1,
        (false, false) => Form::T2,
        (true, true) => Form::T3,
        (false, true) => Form::T4,
    };
    let inst = Encoding::new(Op::B, form).map_or_else(|| template(Op::B), Inst::new);
    Inst {
        cond,
        imm: offset as i32 as u32,
        ..inst
    }
}

impl Bytes {
    fn push_inst(&mut self, inst: &Inst, arch: Arch) -> Result<(), NoEncoding> {
        let code = inst
            .encode(arch)
            .map_err(|why| NoEncoding(format!("{inst:?}: {why:?}")))?;
        let (first, second) = code.halfwords();
        self.bytes.extend(first.to_le_bytes());
        second
            .into_iter()
            .for_each(|second| self.bytes.extend(second.to_le_bytes()));
        Ok(())
    }

    fn add_line(&mut self, at: u32, origin: Option<u32>) {
        if self.lines.last().map(|row| row.origin) != Some(origin) {
            self.lines.push(LineRow { at, origin });
        }
    }

    fn add_fixup(&mut self, at: u32, address: Option<Relocation>, name: &str) {
        let Some(half) = address else { return };
        let of = |row: RowPlace| (names::table(name, row.table), row.offset);
        let (kind, (symbol, addend)) = match half {
            Relocation::Low(row) => (FixupKind::MovwAbs, of(row)),
            Relocation::High(row) => (FixupKind::MovtAbs, of(row)),
            Relocation::Routine(routine) => (
                FixupKind::ThumbCall,
                (names::routine(name, routine.name()), 0),
            ),
            Relocation::String(string) => (FixupKind::ThumbCall, (names::string(name, string), 0)),
        };
        self.fixups.push(Fixup {
            at,
            kind,
            symbol,
            addend,
        });
    }

    /// Every function ends where the next begins.
    fn close_symbols(&mut self) {
        let mut end = self.bytes.len() as u32;
        for symbol in self.symbols.iter_mut().rev() {
            symbol.size = end - symbol.offset;
            end = symbol.offset;
        }
    }
}
