//! Variables and their types: the state as a global, what a key has as locals of its modes.
//!
//! ```text
//!   Variables -> types, NAME_state         -> structures over memory, fixed point
//!             -> locals of NAME.mode.N,     -> memory, what the mode knows, or nothing:
//!                by what `held` proves         <optimized out>
//! ```
//!
//! An integer that counts from elsewhere than 0, or in units that are no power of two, has no type
//! in DWARF; a local's location computes its value instead, as a `double`. In a structure it stays
//! an integer, whose type's name says what it means.

use std::collections::BTreeMap;

use gimli::Register;
use gimli::constants::{
    DW_AT_binary_scale, DW_AT_byte_size, DW_AT_const_value, DW_AT_count,
    DW_AT_data_member_location, DW_AT_encoding, DW_AT_external, DW_AT_location, DW_AT_name,
    DW_AT_type, DW_ATE_boolean, DW_ATE_float, DW_ATE_signed, DW_ATE_signed_fixed, DW_ATE_unsigned,
    DW_OP_mul, DW_OP_plus, DW_OP_stack_value, DW_TAG_array_type, DW_TAG_base_type,
    DW_TAG_enumeration_type, DW_TAG_enumerator, DW_TAG_member, DW_TAG_pointer_type,
    DW_TAG_structure_type, DW_TAG_subrange_type, DW_TAG_variable, DwAte, DwTag,
};
use gimli::write::{
    Address, AttributeValue, Expression, Location, LocationList, Unit, UnitEntryId,
};

use super::super::held::{Held, held};
use super::super::variables::{Known, Meaning, Scale, Variable, Variables};
use super::{Code, Described, name};
use crate::thumb::POINTS;

/// The member of a record for what its mode may know, so that memory need not hold it.
const UNLESS_KNOWN: &str = "unless_mode_knows";

/// The types of a unit, by their names.
#[derive(Debug, Default)]
pub(super) struct Types(BTreeMap<String, UnitEntryId>);

/// From where a local's offset counts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum From {
    State,
    Record,
    Words,
}

impl From {
    fn register(self) -> u8 {
        match self {
            From::State => POINTS.state[0],
            From::Record => POINTS.state[1],
            From::Words => POINTS.words,
        }
    }
}

fn text(text: &str) -> AttributeValue {
    AttributeValue::String(name(text))
}

fn number(number: u32) -> AttributeValue {
    AttributeValue::Udata(number.into())
}

/// Whether values of this kind are computed from their integers.
fn is_computed(meaning: &Meaning) -> bool {
    matches!(
        meaning,
        Meaning::Real {
            scale: Scale::Linear { .. },
            ..
        }
    )
}

impl Types {
    fn add(
        &mut self,
        unit: &mut Unit,
        tag: DwTag,
        key: String,
        attributes: &[(gimli::DwAt, AttributeValue)],
    ) -> UnitEntryId {
        if let Some(id) = self.0.get(&key) {
            return *id;
        }
        let id = unit.add(unit.root(), tag);
        for (attribute, value) in attributes {
            unit.get_mut(id).set(*attribute, value.clone());
        }
        self.0.insert(key, id);
        id
    }

    fn base(&mut self, unit: &mut Unit, called: &str, bytes: u8, ate: DwAte) -> UnitEntryId {
        let attributes = [
            (DW_AT_name, text(called)),
            (DW_AT_byte_size, AttributeValue::Data1(bytes)),
            (DW_AT_encoding, AttributeValue::Encoding(ate)),
        ];
        self.add(
            unit,
            DW_TAG_base_type,
            format!("{called} {bytes}"),
            &attributes,
        )
    }

    fn integer(&mut self, unit: &mut Unit, bytes: i8) -> UnitEntryId {
        match bytes {
            2 => self.base(unit, "uint16_t", 2, DW_ATE_unsigned),
            -2 => self.base(unit, "int16_t", 2, DW_ATE_signed),
            _ => self.base(unit, "int32_t", 4, DW_ATE_signed),
        }
    }

    /// The type of a value in memory.
    fn stored(&mut self, unit: &mut Unit, meaning: &Meaning) -> UnitEntryId {
        match meaning {
            Meaning::Unsigned => self.base(unit, "uint32_t", 4, DW_ATE_unsigned),
            Meaning::Bool => self.base(unit, "bool", 4, DW_ATE_boolean),
            Meaning::Code => {
                let size = [(DW_AT_byte_size, AttributeValue::Data1(4))];
                self.add(unit, DW_TAG_pointer_type, "code".to_string(), &size)
            }
            Meaning::States { machine, states } => self.states(unit, machine, states),
            Meaning::Real {
                bytes,
                scale,
                unit: own,
            } => match scale {
                Scale::PowerOfTwo(scale) => {
                    let called = format!("{own} (2^{scale})");
                    let attributes = [
                        (DW_AT_name, text(&called)),
                        (DW_AT_byte_size, AttributeValue::Data1(bytes.unsigned_abs())),
                        (
                            DW_AT_encoding,
                            AttributeValue::Encoding(DW_ATE_signed_fixed),
                        ),
                        (DW_AT_binary_scale, AttributeValue::Sdata(i64::from(*scale))),
                    ];
                    let key = format!("{called} {bytes}");
                    self.add(unit, DW_TAG_base_type, key, &attributes)
                }
                Scale::Linear { called, .. } => {
                    let signed = if *bytes == 2 {
                        DW_ATE_unsigned
                    } else {
                        DW_ATE_signed
                    };
                    self.base(unit, called, bytes.unsigned_abs(), signed)
                }
            },
        }
    }

    fn states(&mut self, unit: &mut Unit, machine: &str, states: &[String]) -> UnitEntryId {
        let key = format!("enum {machine} {}", states.join(" "));
        if let Some(id) = self.0.get(&key) {
            return *id;
        }
        let attributes = [
            (DW_AT_name, text(machine)),
            (DW_AT_byte_size, AttributeValue::Data1(4)),
        ];
        let id = self.add(unit, DW_TAG_enumeration_type, key, &attributes);
        for (value, state) in (0..).zip(states) {
            let entry = unit.add(id, DW_TAG_enumerator);
            unit.get_mut(entry).set(DW_AT_name, text(state));
            unit.get_mut(entry)
                .set(DW_AT_const_value, AttributeValue::Sdata(value));
        }
        id
    }

    /// The type of a value as a local has it.
    fn shown(&mut self, unit: &mut Unit, meaning: &Meaning) -> UnitEntryId {
        match meaning {
            Meaning::Real { unit: own, .. } if is_computed(meaning) => {
                self.base(unit, own, 8, DW_ATE_float)
            }
            _ => self.stored(unit, meaning),
        }
    }

    fn array(&mut self, unit: &mut Unit, of: UnitEntryId, lengths: &[u32]) -> UnitEntryId {
        let id = unit.add(unit.root(), DW_TAG_array_type);
        unit.get_mut(id)
            .set(DW_AT_type, AttributeValue::UnitRef(of));
        for length in lengths {
            let range = unit.add(id, DW_TAG_subrange_type);
            unit.get_mut(range).set(DW_AT_count, number(*length));
        }
        id
    }

    fn structure<'v>(
        &mut self,
        unit: &mut Unit,
        called: &str,
        bytes: u32,
        members: impl Iterator<Item = &'v Variable>,
    ) -> UnitEntryId {
        let typed: Vec<(&Variable, UnitEntryId)> = members
            .map(|member| (member, self.member_type(unit, member)))
            .collect();
        let id = unit.add(unit.root(), DW_TAG_structure_type);
        unit.get_mut(id).set(DW_AT_name, text(called));
        unit.get_mut(id).set(DW_AT_byte_size, number(bytes));
        for (member, of) in typed {
            add_member(unit, id, &member.name, member.at, of);
        }
        id
    }

    fn member_type(&mut self, unit: &mut Unit, member: &Variable) -> UnitEntryId {
        let of = self.stored(unit, &member.meaning);
        if member.array.is_empty() {
            of
        } else {
            self.array(unit, of, &member.array)
        }
    }
}

fn add_member(unit: &mut Unit, of: UnitEntryId, called: &str, at: u32, ty: UnitEntryId) {
    let entry = unit.add(of, DW_TAG_member);
    let entry = unit.get_mut(entry);
    entry.set(DW_AT_name, text(called));
    entry.set(DW_AT_type, AttributeValue::UnitRef(ty));
    entry.set(DW_AT_data_member_location, number(at));
}

/// Adds all types, and the state as a global variable, which lies in a section at an offset.
pub(super) fn add_state(
    unit: &mut Unit,
    types: &mut Types,
    own: &Variables,
    (section, at): (usize, u32),
) {
    // Types that locations name stand before whatever has locations.
    types.integer(unit, 4);
    for variable in own.shared.iter().chain(&own.key).chain(&own.words) {
        types.shown(unit, &variable.meaning);
        if let Meaning::Real { bytes, .. } = &variable.meaning {
            types.integer(unit, *bytes);
        }
    }
    for (_, own) in &own.nowhere {
        types.base(unit, own, 8, DW_ATE_float);
    }
    let (keys, records, record_bytes) = own.records;
    let held = |always: bool| {
        let all = own.key.iter().enumerate();
        let some = all.filter(move |(nth, _)| own.is_always_held(*nth) == always);
        some.map(|(_, own)| own)
    };
    let called = format!("{}_key", own.name);
    let perhaps = format!("{}_known", own.name);
    let perhaps = types.structure(unit, &perhaps, record_bytes, held(false));
    let key = types.structure(unit, &called, record_bytes, held(true));
    if held(false).next().is_some() {
        add_member(unit, key, UNLESS_KNOWN, 0, perhaps);
    }
    let called = format!("{}_state", own.name);
    let state = types.structure(unit, &called, own.state_bytes, own.shared.iter());
    let all = types.array(unit, key, &[keys]);
    add_member(unit, state, "keys", records, all);
    let entry = unit.add(unit.root(), DW_TAG_variable);
    let entry = unit.get_mut(entry);
    let mut location = Expression::new();
    location.op_addr(Address::Symbol {
        symbol: section,
        addend: at.into(),
    });
    entry.set(DW_AT_name, text(&called));
    entry.set(DW_AT_type, AttributeValue::UnitRef(state));
    entry.set(DW_AT_external, AttributeValue::Flag(true));
    entry.set(DW_AT_location, AttributeValue::Exprloc(location));
}

/// A mode's code.
pub(super) struct ModeCode<'a> {
    pub own: &'a Variables,
    pub mode: usize,
    pub code: &'a Code,
    /// Offset in the section, bytes.
    pub range: (u32, u32),
}

/// Adds the locals of a mode's code to its function.
pub(super) fn add_locals(
    unit: &mut Unit,
    types: &mut Types,
    program: &Described,
    of: &ModeCode,
    function: UnitEntryId,
) {
    let (own, base) = (of.own, of.code.base);
    let (from, to) = (base + of.range.0, base + of.range.0 + of.range.1);
    let held = held(program.flow, from, to, From::Record.register());
    let live = |own: &&Variable| own.name.starts_with("live_") && own.array.is_empty();
    let all = own
        .shared
        .iter()
        .filter(live)
        .map(|own| (own, From::State, None));
    let known = own.known[of.mode].iter();
    let all = all.chain(
        own.key
            .iter()
            .zip(known)
            .map(|(own, known)| (own, From::Record, *known)),
    );
    let all = all.chain(own.words.iter().map(|own| (own, From::Words, None)));
    for (variable, base, known) in all {
        let ty = types.shown(unit, &variable.meaning);
        let places = places(unit, types, of, &held, (variable, base, known));
        let places = (!places.0.is_empty()).then(|| unit.locations.add(places));
        let called = variable
            .name
            .strip_prefix("live_")
            .unwrap_or(&variable.name);
        let entry = unit.add(function, DW_TAG_variable);
        let entry = unit.get_mut(entry);
        entry.set(DW_AT_name, text(called));
        entry.set(DW_AT_type, AttributeValue::UnitRef(ty));
        if let Some(places) = places {
            entry.set(DW_AT_location, AttributeValue::LocationListRef(places));
        }
    }
    for (called, own) in &own.nowhere {
        let entry = unit.add(function, DW_TAG_variable);
        let ty = types.base(unit, own, 8, DW_ATE_float);
        unit.get_mut(entry).set(DW_AT_name, text(called));
        unit.get_mut(entry)
            .set(DW_AT_type, AttributeValue::UnitRef(ty));
    }
}

/// The addresses at which a local has its value, and how it is had there.
fn places(
    unit: &mut Unit,
    types: &mut Types,
    of: &ModeCode,
    held: &[(u32, Held)],
    (variable, base, known): (&Variable, From, Option<Known>),
) -> LocationList {
    // By how much the register has moved; what is known needs none.
    let is_there = |held: &Held| match known {
        Some(_) => held.unchanged.then_some(0),
        None => held.moved(base.register()),
    };
    let end = of.code.base + of.range.0 + of.range.1;
    let nexts = held.iter().skip(1).map(|(at, _)| *at).chain([end]);
    let mut ranges: Vec<(u32, u32, i32)> = Vec::new();
    for ((at, held), next) in held.iter().zip(nexts) {
        match (ranges.last_mut(), is_there(held)) {
            (_, None) => {}
            (Some(last), Some(moved)) if (last.1, last.2) == (*at, moved) => last.1 = next,
            (_, Some(moved)) => ranges.push((*at, next, moved)),
        }
    }
    let place = |(from, to, moved): (u32, u32, i32)| Location::StartLength {
        begin: Address::Symbol {
            symbol: of.code.section,
            addend: i64::from(from - of.code.base),
        },
        length: (to - from).into(),
        data: location(unit, types, variable, (base, moved), known),
    };
    LocationList(ranges.into_iter().map(place).collect())
}

/// How a value is had: in memory, computed from memory, or known.
fn location(
    unit: &mut Unit,
    types: &mut Types,
    variable: &Variable,
    (base, moved): (From, i32),
    known: Option<Known>,
) -> Expression {
    let mut location = Expression::new();
    let place = i64::from(variable.at) - i64::from(moved);
    let linear = match &variable.meaning {
        Meaning::Real {
            bytes,
            scale: Scale::Linear { lsb, zero, .. },
            ..
        } => Some((*bytes, Box::new(*lsb), Box::new(*zero))),
        _ => None,
    };
    let shown = types.shown(unit, &variable.meaning);
    match (known, linear) {
        (Some(known), Some(_)) => location.op_const_type(shown, Box::new(known.real)),
        (Some(known), None) => location.op_consts(known.integer),
        (None, linear) => {
            location.op_breg(Register(base.register().into()), place);
            let Some((bytes, lsb, zero)) = linear else {
                return location;
            };
            let integer = types.integer(unit, bytes);
            location.op_deref_type(bytes.unsigned_abs(), integer);
            location.op_convert(Some(shown));
            location.op_const_type(shown, lsb);
            location.op(DW_OP_mul);
            location.op_const_type(shown, zero);
            location.op(DW_OP_plus);
        }
    }
    location.op(DW_OP_stack_value);
    location
}
