//! From placed items to an object.

use whippen_isa::{ItState, Op};

use super::expr::Value;
use super::item::{AssemblyUnit, Note, PlacedItem, What};
use crate::image::{Fixup, FixupKind, Hint, Object, Section, SectionKind, Symbol, SymbolKind};

type Located = (usize, String);

/// The object of a text whose items have their places.
///
/// # Errors
/// The line of data that does not fit, or of a name that is used and cannot be.
pub fn object(unit: &AssemblyUnit) -> Result<Object, Located> {
    let mut object = Object::default();
    for index in 0..unit.sections.len() {
        object.sections.push(section(unit, index)?);
    }
    object.symbols = symbols(unit, &object);
    Ok(object)
}

fn section(unit: &AssemblyUnit, index: usize) -> Result<Section, Located> {
    let from = &unit.sections[index];
    let mut to = Section {
        name: from.name.clone(),
        kind: from.kind,
        align: from.align,
        bytes: Vec::new(),
        size: 0,
        fixups: Vec::new(),
        lines: Vec::new(),
        hints: Vec::new(),
    };
    let mut it = ItState::OUTSIDE;
    for (number, item) in from.items.iter().enumerate() {
        put(unit, (index, number), item, &mut it, &mut to)
            .map_err(|message| (item.line, message))?;
    }
    to.size = to.bytes.len() as u32;
    if from.kind == SectionKind::Zeroed {
        if to.bytes.iter().any(|byte| *byte != 0) {
            let line = from.items.first().map_or(1, |item| item.line);
            return Err((
                line,
                format!("`{}` holds zeros alone; put values into `.data`", from.name),
            ));
        }
        to.bytes.clear();
    }
    to.hints = hints(unit, index)?;
    Ok(to)
}

fn put(
    unit: &AssemblyUnit,
    at: (usize, usize),
    item: &PlacedItem,
    it: &mut ItState,
    to: &mut Section,
) -> Result<(), String> {
    match &item.what {
        What::Instruction(instruction) => {
            let encoded = instruction.encode(unit, at, it.cond())?;
            *it = encoded.inst.it_behind(*it).unwrap_or_default();
            if let Some((kind, symbol, addend)) = encoded.fixup {
                let kind = if encoded.inst.op() == Op::BL {
                    FixupKind::ThumbCall
                } else {
                    kind
                };
                fix(to, item.offset, kind, symbol, addend)?;
            }
            let (first, second) = encoded.code.halfwords();
            to.bytes.extend(first.to_le_bytes());
            to.bytes
                .extend(second.iter().flat_map(|half| half.to_le_bytes()));
        }
        What::Words(bytes, values) => {
            for value in values {
                word(unit, at, *bytes, value, to)?;
            }
        }
        What::Bytes(bytes) => to.bytes.extend(bytes),
        What::Fill(count, value) => to
            .bytes
            .extend(std::iter::repeat_n(*value, *count as usize)),
        What::Align(_) if to.kind == SectionKind::Code => pad(item.size, to),
        What::Align(_) => to.bytes.extend(std::iter::repeat_n(0, item.size as usize)),
        What::Pool(literals) => {
            to.bytes.resize(to.bytes.len().next_multiple_of(4), 0);
            for value in literals {
                word(unit, at, 4, value, to)?;
            }
        }
    }
    Ok(())
}

/// Instructions that do nothing: a narrow one if need be, then wide ones.
fn pad(bytes: u32, to: &mut Section) {
    to.bytes
        .extend(std::iter::repeat_n(0, (bytes & 1) as usize));
    if bytes & 2 != 0 {
        to.bytes.extend([0x00, 0xbf]);
    }
    (0..bytes / 4).for_each(|_| to.bytes.extend([0xaf, 0xf3, 0x00, 0x80]));
}

fn word(
    unit: &AssemblyUnit,
    (section, item): (usize, usize),
    bytes: u32,
    value: &super::expr::Expr,
    to: &mut Section,
) -> Result<(), String> {
    let at = to.bytes.len() as u32;
    let number = match value.value(&|name| unit.find(name, section, item))? {
        Value::Number(n) => n,
        Value::Place { label, addend, .. } | Value::Outside(label, addend) if bytes == 4 => {
            fix(to, at, FixupKind::Abs32, label, addend)?;
            0
        }
        Value::Place { label, .. } | Value::Outside(label, _) => {
            return Err(format!("the address of `{label}` needs a `.word`"));
        }
    };
    let bits = 8 * bytes;
    if bits < 64 && !(-(1_i64 << (bits - 1))..1 << bits).contains(&number) {
        return Err(format!("{number} does not fit {bits} bits"));
    }
    to.bytes.extend(&number.to_le_bytes()[..bytes as usize]);
    Ok(())
}

fn fix(
    to: &mut Section,
    at: u32,
    kind: FixupKind,
    symbol: String,
    addend: i64,
) -> Result<(), String> {
    if symbol.contains(' ') || symbol == "." {
        return Err(
            "give the place a name: an address of a local label cannot be used here".to_string(),
        );
    }
    let addend =
        i32::try_from(addend).map_err(|_| format!("{addend} is too far from `{symbol}`"))?;
    to.fixups.push(Fixup {
        at,
        kind,
        symbol,
        addend,
    });
    Ok(())
}

fn hints(unit: &AssemblyUnit, index: usize) -> Result<Vec<Hint>, Located> {
    let section = &unit.sections[index];
    let each = section.notes.iter().map(|(item, note)| {
        let at = unit.offset(index, *item);
        let line = section.items.get(*item).map_or(1, |item| item.line);
        match note {
            Note::Rounds(rounds) => {
                let rounds = rounds
                    .value(&|name| unit.find(name, index, *item))
                    .and_then(|value| value.number());
                let rounds_max = rounds.map_err(|message| (line, message))?;
                Ok(Hint::Loop {
                    at,
                    rounds_max: u32::try_from(rounds_max).unwrap_or(0),
                })
            }
            Note::Targets(symbols) => Ok(Hint::Targets {
                at,
                symbols: symbols.clone(),
            }),
        }
    });
    each.collect()
}

/// Labels, and names that are used and not defined.
fn symbols(unit: &AssemblyUnit, object: &Object) -> Vec<Symbol> {
    let mut all: Vec<_> = unit
        .labels
        .iter()
        .filter(|(name, _)| !name.contains(' '))
        .collect();
    all.sort_by_key(|(name, place)| (**place, name.as_str()));
    let mut symbols: Vec<_> = all
        .iter()
        .map(|(name, place)| symbol(unit, name, **place))
        .collect();
    let used = object
        .sections
        .iter()
        .flat_map(|section| &section.fixups)
        .map(|fixup| &fixup.symbol);
    let mut outside: Vec<_> = used
        .filter(|name| !unit.labels.contains_key(*name))
        .collect();
    outside.sort();
    outside.dedup();
    symbols.extend(outside.into_iter().map(|name| Symbol {
        name: name.clone(),
        section: None,
        offset: 0,
        size: 0,
        kind: SymbolKind::Label,
        global: true,
    }));
    symbols
}

fn symbol(unit: &AssemblyUnit, name: &str, (section, item): (usize, usize)) -> Symbol {
    let size = unit
        .sizes
        .get(name)
        .and_then(|size| size.value(&|name| unit.find(name, section, item)).ok());
    Symbol {
        name: name.to_string(),
        section: Some(section),
        offset: unit.offset(section, item),
        size: size
            .and_then(|size| size.number().ok())
            .and_then(|size| u32::try_from(size).ok())
            .unwrap_or(0),
        kind: unit.kinds.get(name).copied().unwrap_or(SymbolKind::Label),
        global: unit.globals.contains(name),
    }
}
