//! The module for Rust.

use std::fmt::Write;

use super::{Holds, Interface, PortInterface, number, safety, unit_name};

/// A module for Rust; it wants the crate `fixed` and no standard library.
pub fn rust_module(own: &Interface) -> String {
    let Interface {
        name,
        keys,
        first_key,
        rate_hz,
        component,
        ..
    } = own;
    let state_bytes = match component {
        Some(_) => "core::mem::size_of::<State>()".to_string(),
        None => own.state_bytes.to_string(),
    };
    let (rate_constant, is_float) = rate_hz.constant();
    let rate_type = if is_float { "f64" } else { "u32" };
    let mut text = format!(
        "//! {name}: {keys} keys at {rate_hz} ticks a second. Written by Whippen.\n\
         //!\n\
         //! Put this tick's sensor words into `inputs`, call `init` once and `tick` in every tick, and take the drive words\n\
         //! out of `outputs`. Link with the object file, or the compiled C, that came with this module.\n\
         #![allow(dead_code, non_snake_case)]\n\n\
         use core::ptr::{{addr_of, addr_of_mut}};\n\n\
         /// Keys.\npub const KEYS: usize = {keys};\n\
         /// The number of the first key, from which events count.\npub const FIRST_KEY: u16 = {first_key};\n\
         /// Ticks per second.\npub const RATE_HZ: {rate_type} = {rate_constant};\n\
         /// Bytes of the state.\npub const STATE_BYTES: usize = {state_bytes};\n"
    );
    ports(&mut text, "INPUT", &own.inputs.1);
    ports(&mut text, "OUTPUT", &own.outputs.1);
    lives(&mut text, own);
    events(&mut text, own);
    state(&mut text, own);
    functions(&mut text, own);
    text
}

fn ports(text: &mut String, kind: &str, ports: &[PortInterface]) {
    for (index, port) in ports.iter().enumerate() {
        let (name, unit) = (
            port.name.to_uppercase(),
            unit_name(&port.unit).to_uppercase(),
        );
        let _ = writeln!(
            text,
            "\n/// Which word of a key is `{}`.\npub const {kind}_{name}: usize = {index};\n\
             /// Value of one unit of `{}`, in {}.\npub const {name}_LSB_{unit}: f64 = {};\n\
             /// Value of word 0 of `{}`, in {}.\npub const {name}_ZERO_{unit}: f64 = {};",
            port.name,
            port.name,
            port.unit,
            number(port.lsb),
            port.name,
            port.unit,
            number(port.zero)
        );
    }
}

/// The type of integers with so many fraction bits: of `fixed`, where it has one.
fn fixed(fraction_bits: i32) -> String {
    match fraction_bits {
        0..=32 => format!("fixed::FixedI32<fixed::types::extra::U{fraction_bits}>"),
        _ => "i32".to_string(),
    }
}

fn bits(value: i32, fraction_bits: i32) -> String {
    if (0..=32).contains(&fraction_bits) {
        format!("{}::from_bits({value})", path(fraction_bits))
    } else {
        value.to_string()
    }
}

fn path(fraction_bits: i32) -> String {
    fixed(fraction_bits).replace('<', "::<")
}

fn lives(text: &mut String, own: &Interface) {
    for live in &own.lives {
        let (name, ty, f) = (
            live.name.to_uppercase(),
            fixed(live.fraction_bits),
            live.fraction_bits,
        );
        let Some(unit) = &live.unit else {
            let _ = writeln!(
                text,
                "\n/// First value of `{}`, a switch.\npub const {name}_INIT: bool = {};",
                live.name,
                live.init != 0
            );
            continue;
        };
        for (what, which, value) in [
            ("Smallest", "MIN", live.range.0),
            ("Largest", "MAX", live.range.1),
            ("First", "INIT", live.init),
        ] {
            let _ = writeln!(
                text,
                "\n/// {what} value of `{}`, in {unit}.\npub const {name}_{which}: {ty} = {};",
                live.name,
                bits(value, f)
            );
        }
    }
}

fn events(text: &mut String, own: &Interface) {
    let args = own.args_max();
    if own.ring.is_none() {
        return;
    }
    let mut readers = String::new();
    for (number, event) in own.events.iter().enumerate() {
        let name = event.name.to_uppercase();
        let _ = writeln!(
            text,
            "\n/// Event `{}`.\npub const EVENT_{name}: u16 = {number};",
            event.name
        );
        for (index, arg) in event.args.iter().enumerate() {
            let (arg_name, ty) = (arg.name.to_uppercase(), fixed(arg.fraction_bits));
            let read = if ty == "i32" {
                format!("self.args[{index}]")
            } else {
                format!("{}::from_bits(self.args[{index}])", path(arg.fraction_bits))
            };
            let _ = writeln!(
                readers,
                "    /// `{}` of an event `{}`, in {}: argument {index}.\n\
                 \x20   pub fn {}_{}(&self) -> {ty} {{\n        {read}\n    }}",
                arg.name,
                event.name,
                arg.unit,
                event.name,
                arg_name.to_lowercase()
            );
        }
    }
    let _ = writeln!(
        text,
        "\n/// What happened to a key in a tick.\n#[derive(Debug, Clone, Copy, PartialEq, Eq)]\npub struct Event {{\n\
         \x20   /// The tick, counted from 0.\n    pub tick: u32,\n    /// The key.\n    pub key: u16,\n\
         \x20   /// What: `EVENT_..`.\n    pub event: u16,\n    /// Its arguments.\n    pub args: [i32; {args}],\n}}"
    );
    if !readers.is_empty() {
        let _ = writeln!(text, "\nimpl Event {{\n{readers}}}");
    }
}

fn state(text: &mut String, own: &Interface) {
    if let Some(component) = &own.component {
        text.push_str(&component.rust_types);
    }
    let _ = writeln!(
        text,
        "\n/// Memory of all keys. What is private belongs to the code.\n#[repr(C)]\npub struct State {{"
    );
    let row = own.row_words;
    let fields = own.fields();
    for field in &fields {
        let name = &field.name;
        let declared = match field.holds {
            Holds::Counter => format!("{name}: u32"),
            Holds::Live => format!("{name}: i32"),
            Holds::Ring(words) => format!("{name}: [i32; {words}]"),
            Holds::Inputs => {
                format!("/// Sensor words of this tick.\n    pub {name}: [[u16; {row}]; KEYS]")
            }
            Holds::Outputs => {
                format!("/// Drive words of this tick.\n    pub {name}: [[i16; {row}]; KEYS]")
            }
            Holds::Kernel => format!("{name}: KernelState"),
            Holds::Private(bytes) if bytes % 4 == 0 => format!("{name}: [u32; {}]", bytes / 4),
            Holds::Private(bytes) => format!("{name}: [u8; {bytes}]"),
        };
        let _ = writeln!(text, "    {declared},");
    }
    let _ = writeln!(
        text,
        "}}\n\nconst _: () = assert!(core::mem::size_of::<State>() == STATE_BYTES);"
    );
    for field in own.public_fields() {
        let _ = writeln!(
            text,
            "const _: () = assert!(core::mem::offset_of!(State, {}) == {});",
            field.name, field.at
        );
    }
}

fn functions(text: &mut String, own: &Interface) {
    let name = &own.name;
    let _ = writeln!(
        text,
        "\nunsafe extern \"C\" {{\n    /// All memory of the keys, with its values at the start.\n    #[link_name = \"{name}_state\"]\n    pub static mut STATE: State;\n\
         \x20   /// Prepares all keys for the first tick, whose words are in `inputs`.\n    #[link_name = \"{name}_init\"]\n    pub fn init(state: *mut State);\n\
         \x20   /// One tick of all keys: reads `inputs`, writes `outputs`.\n    #[link_name = \"{name}_tick\"]\n    pub fn tick(state: *mut State);\n}}\n\n\
         /// A live value that was not set: it is out of its range.\n#[derive(Debug, Clone, Copy, PartialEq, Eq)]\npub struct OutOfRange;\n"
    );
    for live in &own.lives {
        if live.unit.is_none() {
            let _ = writeln!(
                text,
                "/// Sets `{field}` from the next tick on.\n///\n/// # Safety\n/// `state` points to the state.\n\
                 pub unsafe fn set_{field}(state: *mut State, value: bool) {{\n\
                 \x20   unsafe {{ addr_of_mut!((*state).live_{field}).write_volatile(i32::from(value)) }};\n}}\n",
                field = live.name
            );
            continue;
        }
        let (ty, upper, field) = (
            fixed(live.fraction_bits),
            live.name.to_uppercase(),
            &live.name,
        );
        let value = if ty == "i32" {
            "value".to_string()
        } else {
            "value.to_bits()".to_string()
        };
        let _ = writeln!(
            text,
            "/// Sets `{field}` from the next tick on.\n///\n/// # Errors\n/// It is out of range; nothing is changed.\n///\n\
             /// # Safety\n/// `state` points to the state.\n\
             pub unsafe fn set_{field}(state: *mut State, value: {ty}) -> Result<(), OutOfRange> {{\n\
             \x20   if !({upper}_MIN..={upper}_MAX).contains(&value) {{\n        return Err(OutOfRange);\n    }}\n\
             \x20   unsafe {{ addr_of_mut!((*state).live_{field}).write_volatile({value}) }};\n    Ok(())\n}}\n"
        );
    }
    safety::rust(text, own);
    reader(text, own);
}

fn reader(text: &mut String, own: &Interface) {
    let Some(ring) = own.ring else { return };
    let args: Vec<String> = (0..own.args_max())
        .map(|index| format!("word({})", index + 2))
        .collect();
    let _ = writeln!(
        text,
        "/// Takes the oldest event. What found the ring full is counted, and lost.\n///\n\
         /// # Safety\n/// `state` points to the state, and nobody else takes events.\n\
         pub unsafe fn read_event(state: *mut State) -> Option<Event> {{\n\
         \x20   let mut tail = unsafe {{ addr_of!((*state).event_tail).read_volatile() }};\n\
         \x20   let head = unsafe {{ addr_of!((*state).event_head).read_volatile() }};\n\
         \x20   let at = |tail: u32| (tail % {bytes} / 4) as usize;\n\
         \x20   if head != tail && unsafe {{ addr_of!((*state).events[at(tail) + 1]).read_volatile() }} == -1 {{\n\
         \x20       // A mark, no event: the ring goes on at its beginning.\n\
         \x20       tail = (tail | {mask}).wrapping_add(1);\n\
         \x20       unsafe {{ addr_of_mut!((*state).event_tail).write_volatile(tail) }};\n    }}\n\
         \x20   if head == tail {{\n        return None;\n    }}\n\
         \x20   let word = |offset: usize| unsafe {{ addr_of!((*state).events[at(tail) + offset]).read_volatile() }};\n\
         \x20   let what = word(1) as u32;\n\
         \x20   let event = Event {{ tick: word(0) as u32, key: what as u16, event: (what >> 16) as u16, args: [{args}] }};\n\
         \x20   unsafe {{ addr_of_mut!((*state).event_tail).write_volatile(tail.wrapping_add({record})) }};\n    Some(event)\n}}\n\n\
         /// How many events found the ring full.\n///\n/// # Safety\n/// `state` points to the state.\n\
         pub unsafe fn events_lost(state: *const State) -> u32 {{\n    unsafe {{ addr_of!((*state).events_lost).read_volatile() }}\n}}",
        bytes = ring.bytes,
        mask = ring.bytes - 1,
        args = args.join(", "),
        record = ring.record_bytes,
    );
}
