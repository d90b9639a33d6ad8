//! The frame of a core: from the request of its tick to the return from its handler, and what it is
//! summed from.

#[cfg(test)]
mod tests;

use std::collections::BTreeMap;

use whippen_isa::timing::{Core, Evidence};

use crate::Refusal;
use crate::certificate::{CYCLES, Call, Certificate, Frame, Function, Kind};
use crate::facts::Facts;
use crate::legs::{HELPER, Meetings};
use crate::memory::Around;
use crate::piece::check;
use crate::place::Place;
use crate::step::{Cost, Seen, Stepper};

/// Words that an exception saves and restores, and bytes with what aligns them.
const SAVED_WORDS: u64 = 8;
const SAVED_BYTES: u32 = 36;

/// What is checked of a frame.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Checked {
    /// Which core.
    pub core: u32,
    /// Which program.
    pub program: u32,
    /// Cycles from the request to the return.
    pub cycles: u64,
    /// The largest cycles of a key's modes.
    pub key: u64,
    /// How many keys.
    pub keys: u32,
    /// What the cycles are summed from.
    pub parts: Vec<(&'static str, u64)>,
    /// Bytes of stack.
    pub stack: u32,
    /// As sure as the least sure number.
    pub class: Evidence,
    /// How many instructions, states and functions were checked.
    pub states: usize,
}

/// The largest of the modes of a function that ticks keys.
fn mode_cycles(function: &Function) -> u64 {
    let modes = function.pieces.len().saturating_sub(2);
    let modes = function.pieces.iter().skip(1).take(modes);
    modes.map(|piece| piece.cycles).max().unwrap_or(0)
}

/// What a call of a function costs, with so many keys.
fn cost(function: &Function, keys: u32) -> Option<Cost> {
    let [first, .., last] = &function.pieces[..] else {
        let [only] = &function.pieces[..] else {
            return None;
        };
        return (function.kind == Kind::Plain && keys == 0).then_some(Cost {
            cycles: only.cycles,
            stack: function.stack,
            returns: function.returns,
            fetched: function.fetched,
        });
    };
    let modes = mode_cycles(function).checked_mul(keys.into())?;
    let around = first.cycles.checked_add(last.cycles)?;
    (function.kind == Kind::Keys).then_some(Cost {
        cycles: around.checked_add(modes)?,
        stack: function.stack,
        returns: function.returns,
        fetched: function.fetched,
    })
}

/// What all calls cost of a core's function with that number.
///
/// # Errors
/// One that is not there, or stands behind it.
pub fn costs(
    around: &Around,
    frame: &Frame,
    number: usize,
    calls: &[Call],
) -> Result<Vec<Option<Cost>>, Refusal> {
    let functions = frame.functions_of(around.core);
    let legs = functions.iter().position(|own| own.kind == Kind::Legs);
    let of = |call: &Call| {
        let Some((function, keys)) = call.costs else {
            return Ok(None);
        };
        let callee = functions
            .get(..number)
            .and_then(|all| all.get(function as usize));
        let callee =
            callee.filter(|own| own.pieces.first().map(|own| own.entry) == Some(call.callee));
        let known = match callee.map(|own| own.kind) {
            // The first of both stands for both.
            Some(Kind::Legs) if keys == 0 && Some(function as usize) == legs => {
                Some(Meetings::of(around, frame)?.cost())
            }
            _ => callee.and_then(|callee| cost(callee, keys)),
        };
        let known = known.filter(|cost| cost.cycles <= CYCLES);
        let why = "costs what no function before it does";
        known.map(Some).ok_or_else(|| Refusal::at(call.site, why))
    };
    calls.iter().map(of).collect()
}

/// Checks the frame of a core.
///
/// # Errors
/// What is claimed wrongly.
pub(crate) fn check_frame(
    certificate: &Certificate,
    around: &Around,
    core: &Core,
    frame: &Frame,
) -> Result<Checked, Refusal> {
    let (mut class, mut states) = check_functions(certificate, around, core, frame)?;
    class = class
        .max(core.exceptions.entry.evidence)
        .max(core.exceptions.exit.evidence);
    if let Some(helper) = &frame.helper {
        let around = Around::new(certificate, around.elf, HELPER)?;
        let (other, more) = check_functions(certificate, &around, core, frame)?;
        (class, states) = (class.max(other), states + more);
        no_other(&around, certificate, helper.vectors, None)?;
        let stack = helper.functions.iter().map(|own| own.stack).max();
        around.has_stack_room(HELPER, stack.unwrap_or(0))?;
    }
    let (parts, stack) = sums(around, core, frame)?;
    let cycles: u64 = parts.iter().map(|(_, cycles)| cycles).sum();
    around.has_stack_room(frame.core, stack)?;
    if (frame.cycles, frame.stack) != (cycles, stack) {
        let why = format!(
            "core {} claims {} cycles and {} bytes of stack, not {cycles} and {stack}",
            frame.core, frame.cycles, frame.stack
        );
        return Err(Refusal::new(why));
    }
    if cycles > certificate.deadline {
        let why = format!(
            "core {}: {cycles} cycles of {}",
            frame.core, certificate.deadline
        );
        return Err(Refusal::new(why));
    }
    let [_, handler] = last_two(frame)?;
    let handler = handler.pieces[0].entry;
    no_other(around, certificate, frame.vectors, Some(handler))?;
    let (key, keys) = keys_of(frame);
    Ok(Checked {
        core: frame.core,
        program: frame.program,
        cycles,
        key,
        keys,
        parts,
        stack,
        class,
        states,
    })
}

/// Checks what a core runs in a frame: as sure as the least sure number, and how many states.
fn check_functions(
    certificate: &Certificate,
    around: &Around,
    core: &Core,
    frame: &Frame,
) -> Result<(Evidence, usize), Refusal> {
    let (mut class, mut states) = (Evidence::Exact, 0);
    for (number, function) in frame.functions_of(around.core).iter().enumerate() {
        let costs = costs(around, frame, number, &function.calls)?;
        let stepper = Stepper {
            core,
            around,
            certificate,
            function,
            costs: &costs,
            room: Default::default(),
        };
        class = class.max(check_function(&stepper)?);
        let points = function.pieces.iter().flat_map(|piece| &piece.points);
        states += points.map(|point| point.states.len()).sum::<usize>();
    }
    Ok((class, states))
}

/// What runs between ticks, and the handler: each in one piece.
fn last_two(frame: &Frame) -> Result<[&Function; 2], Refusal> {
    let one = |own: &Function, kind| own.kind == kind && own.pieces.len() == 1;
    match &frame.functions[..] {
        [.., idle, last] if one(idle, Kind::Idle) && one(last, Kind::Handler) => Ok([idle, last]),
        _ => {
            let why = "a frame ends with what runs between ticks and its handler";
            Err(Refusal::new(why.into()))
        }
    }
}

/// Cycles by part, and bytes of stack.
pub type Sums = (Vec<(&'static str, u64)>, u32);

/// What a frame is summed from.
///
/// # Errors
/// What is not there, or lies where no time is known.
pub fn sums(around: &Around, core: &Core, frame: &Frame) -> Result<Sums, Refusal> {
    let [idle, handler] = last_two(frame)?;
    let saved = SAVED_WORDS * around.exception_word(around.stack_banks(frame.core)?);
    let vector = around.exception_word(around.section_banks(frame.vectors)?);
    let entry = u64::from(core.exceptions.entry.cycles);
    let mut parts = vec![
        ("the instruction in progress", idle.pieces[0].cycles),
        ("entry of the interrupt", entry + saved + vector),
        ("the handler with all keys", handler.pieces[0].cycles),
        (
            "return from the interrupt",
            u64::from(core.exceptions.exit.cycles) + saved,
        ),
        (
            "visits of the other core",
            u64::from(frame.visits) * around.visit(),
        ),
        ("the DMA at memory", around.dma_cycles()),
    ];
    if frame.helper.is_some() {
        let around_handler = [0, 1, 4, 5].map(|nth: usize| parts[nth].1).iter().sum();
        let entry = handler.pieces[0].entry;
        let longer = Meetings::of(around, frame)?.outlasts(entry, around_handler)?;
        let all: u64 = parts.iter().map(|(_, cycles)| cycles).sum();
        let longer = longer.map_or(0, |cycles| cycles.saturating_sub(all));
        parts.push(("core 1, with what is heard", longer));
    }
    let stack = idle
        .stack
        .saturating_add(SAVED_BYTES)
        .saturating_add(handler.stack);
    Ok((parts, stack))
}

/// Cycles of the most expensive mode of a key, and how many keys: the handler ticks them, or what
/// it calls, zone by zone.
fn keys_of(frame: &Frame) -> (u64, u32) {
    let ticks = |number: &u32| {
        let function = frame.functions.get(*number as usize);
        function.filter(|own| own.kind == Kind::Keys)
    };
    let ticked = |function: &Function| {
        let mut by_callee = BTreeMap::new();
        for (number, keys) in function.calls.iter().filter_map(|call| call.costs) {
            if ticks(&number).is_some() {
                let most = by_callee.entry(number).or_insert(0);
                *most = keys.max(*most);
            }
        }
        by_callee
    };
    let all = frame.functions.iter().map(ticked);
    let most = all.max_by_key(|by_callee| by_callee.values().sum::<u32>());
    let most = most.unwrap_or_default();
    let cycles = most.keys().filter_map(ticks).map(mode_cycles);
    (cycles.max().unwrap_or(0), most.values().sum())
}

/// Whatever a table of vectors holds leads to the end, but for one that leads to the handler, if
/// there is one.
fn no_other(
    around: &Around,
    certificate: &Certificate,
    vectors: u32,
    handler: Option<u32>,
) -> Result<(), Refusal> {
    let section = around.elf.section_at(vectors);
    let section = section.filter(|own| own.base == vectors);
    let section = section.ok_or_else(|| Refusal::at(vectors, "is no table of vectors"))?;
    let end = section.base + section.size;
    // The first two words are not used after the start.
    let mut found = handler.is_none();
    for at in (vectors..end).step_by(4).skip(2) {
        let vector = around.elf.word(at);
        let vector = vector.ok_or_else(|| Refusal::at(at, "is a part of a vector"))? & !1;
        // One interrupt asks for a tick.
        let handles = Some(vector) == handler && !found;
        found |= handles;
        if vector != 0 && !handles && vector != certificate.dead {
            return Err(Refusal::at(
                at,
                "is the vector of an interrupt that nobody bounds",
            ));
        }
    }
    match found {
        true => Ok(()),
        false => Err(Refusal::at(vectors, "has no vector of the handler")),
    }
}

/// Checks a function; as sure as its least sure number.
pub(crate) fn check_function(stepper: &Stepper) -> Result<Evidence, Refusal> {
    let function = stepper.function;
    let Some(first) = function.pieces.first() else {
        return Err(Refusal::new(format!("`{}` has no pieces", function.name)));
    };
    if function.contexts.first() != Some(&[0, 0, first.entry]) {
        return Err(Refusal::at(first.entry, "is not the first context's"));
    }
    let has_right_number = match (function.kind, function.pieces.len()) {
        (Kind::Keys, pieces) => pieces > 2,
        (Kind::Legs, pieces) => pieces > 1,
        (_, pieces) => pieces == 1,
    };
    if !has_right_number {
        return Err(Refusal::at(
            first.entry,
            "has another number of pieces than its kind",
        ));
    }
    let mut facts = Facts::default();
    let entered = Place::entered();
    if matches!(function.kind, Kind::Plain | Kind::Keys) {
        for (register, words) in &function.entered {
            facts.set(*register, *words);
        }
    }
    let derived = |register: u8| stepper.derived(&facts, register);
    let place = first.places.get(first.place as usize);
    if !place.is_some_and(|place| place.covers(&entered, derived)) {
        return Err(Refusal::at(
            first.entry,
            "is entered with another stack than is claimed",
        ));
    }
    let mut seen = Seen {
        class: Evidence::Exact,
        stack: 0,
        hands_stack: false,
    };
    for piece in &function.pieces {
        check(stepper, piece, &facts, &mut seen).map_err(|why| why.in_function(&function.name))?;
        facts = Facts::default();
    }
    if first.begins != 0 {
        return Err(Refusal::at(
            first.entry,
            "is called with a pipeline at work",
        ));
    }
    if seen.hands_stack != function.hands_stack {
        let why = "does not hand out addresses of its stack as is claimed";
        return Err(Refusal::at(first.entry, why));
    }
    if seen.stack != function.stack {
        let why = format!("uses {} bytes of stack, not {}", seen.stack, function.stack);
        return Err(Refusal::at(first.entry, why));
    }
    Ok(seen.class)
}
