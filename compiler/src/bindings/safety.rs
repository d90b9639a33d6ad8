//! The safety of the keys in header, module and C text: what is told of it, and its functions.
//!
//! ```text
//!   safety.c  + numbers (`firmware::safety_numbers`)  -->  C text; machine code brings its own (`firmware::safety_object`)
//! ```

use std::collections::BTreeMap;
use std::fmt::Write;

use whippen_firmware::{SAFETY_BYTES, SAFETY_WORDS, safety_faults};

use super::Interface;

/// In C: `$name_` and `$NAME_` stand for the keys' prefix, `$X` for a number, lines from `@PAST` to `@END`
/// are for keys whose energy is limited.
const TEXT: &str = include_str!("safety.c");

/// What is told, with its type in C and in Rust.
const FIELDS: [(&str, &str, &str, &str); 4] = [
    ("tick", "uint32_t", "u32", "the number of the last tick"),
    ("missed", "uint32_t", "u32", "ticks that were missed"),
    ("faults", "uint32_t", "u32", "faults so far, a bit each"),
    (
        "faulty_key",
        "int32_t",
        "i32",
        "the key that went free last, counted from 0; -1 for none",
    ),
];

/// The safety of keys, as who calls it must know it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SafetyInterface {
    /// Offsets of what is told, in its block, and the size of that (bytes).
    words: [u32; 4],
    bytes: u32,
    /// Its numbers, where it is C text.
    numbers: Option<BTreeMap<String, i64>>,
}

impl SafetyInterface {
    /// Of machine code.
    pub fn of_object() -> SafetyInterface {
        SafetyInterface {
            words: SAFETY_WORDS,
            bytes: SAFETY_BYTES,
            numbers: None,
        }
    }

    /// Of C text, with these numbers.
    pub fn of_c(numbers: BTreeMap<String, i64>) -> SafetyInterface {
        SafetyInterface {
            words: [0, 4, 8, 12],
            bytes: 16,
            numbers: Some(numbers),
        }
    }

    /// Fields and what is between them: an offset, the bytes in front of it, a field or the end.
    fn fields(&self) -> impl Iterator<Item = (u32, u32, Option<usize>)> {
        let places = self.words.into_iter().zip((0..).map(Some));
        let places = places.chain([(self.bytes, None)]);
        let before = [0].into_iter().chain(self.words.map(|at| at + 4));
        places
            .zip(before)
            .map(|((at, field), before)| (before, at - before, field))
    }
}

/// What the header says of it.
pub(super) fn c_header(text: &mut String, big: &str, own: &Interface) {
    let Some(safety) = &own.safety else { return };
    let name = &own.name;
    let _ = writeln!(
        text,
        "/* Safety, as in a whole image: gains that come up over 20 ms, what a motor stands, sensors that stay where they are,\n\
         \x20* energy where the device limits it. Call {name}_safe_init in place of {name}_init and {name}_safe_tick in place of\n\
         \x20* {name}_tick, and drive nothing but the words in `outputs` behind it. It is of {name}_state alone. */"
    );
    for fault in safety_faults() {
        let _ = writeln!(
            text,
            "#define {big}_{} {}u /* {} */",
            fault.name(),
            fault.bit,
            fault.what
        );
    }
    let _ = writeln!(text, "struct {name}_safety {{");
    for (at, gap, field) in safety.fields() {
        if gap > 0 {
            let _ = writeln!(text, "    uint32_t private_{at}[{}];", gap / 4);
        }
        if let Some((field, c, _, what)) = field.map(|field| FIELDS[field]) {
            let _ = writeln!(text, "    volatile {c} {field}; /* {what} */");
        }
    }
    let _ = writeln!(
        text,
        "}};\ntypedef char {name}_check_safety[sizeof(struct {name}_safety) == {bytes} ? 1 : -1];\n\n/* What it tells; nobody else writes there. */\nextern struct {name}_safety {name}_safety;\n\n\
         /* Prepares all keys, whose first words are in `inputs`; forgets faults, and takes all force away. */\n\
         void {name}_safe_init(void);\n\n\
         /* One tick of all keys. `number` counts ticks by a clock of yours, not by calls: where it is not the one before and 1, a tick\n\
         \x20* was missed, no key is ticked, and forces go to zero and come back. */\n\
         void {name}_safe_tick(uint32_t number);\n",
        bytes = safety.bytes
    );
}

/// What the module says of it.
pub(super) fn rust(text: &mut String, own: &Interface) {
    let Some(safety) = &own.safety else { return };
    let name = &own.name;
    for fault in safety_faults() {
        let _ = writeln!(
            text,
            "/// In `faults`: {}.\npub const {}: u32 = {};\n",
            fault.what,
            fault.name(),
            fault.bit
        );
    }
    let _ = writeln!(
        text,
        "/// What the safety of the keys tells.\n#[repr(C)]\npub struct Safety {{"
    );
    for (at, gap, field) in safety.fields() {
        if gap > 0 {
            let _ = writeln!(text, "    private_{at}: [u32; {}],", gap / 4);
        }
        if let Some((field, _, rust, what)) = field.map(|field| FIELDS[field]) {
            let _ = writeln!(text, "    /// It is {what}.\n    pub {field}: {rust},");
        }
    }
    let _ = writeln!(
        text,
        "}}\n\nunsafe extern \"C\" {{\n    /// What the safety tells; read it volatile, write nothing.\n    #[link_name = \"{name}_safety\"]\n    pub static mut SAFETY: Safety;\n\
         \x20   /// Prepares all keys, whose first words are in `inputs`; forgets faults, and takes all force away.\n    #[link_name = \"{name}_safe_init\"]\n    pub fn safe_init();\n\
         \x20   /// One tick of all keys, in place of `tick`. `number` counts ticks by a clock of yours, not by calls: where it is not the\n    /// one before and 1, a tick was missed, no key is ticked, and forces go to zero and come back.\n    #[link_name = \"{name}_safe_tick\"]\n    pub fn safe_tick(number: u32);\n}}\n"
    );
}

/// The C text of it.
pub(super) fn c_source(own: &Interface) -> Option<String> {
    let numbers = own.safety.as_ref()?.numbers.as_ref()?;
    let has_past = numbers.get("PAST").is_some_and(|past| *past > 0);
    let mut is_in = true;
    let kept = TEXT.lines().filter(|line| {
        match *line {
            "@PAST" => is_in = has_past,
            "@END" => is_in = true,
            _ => return is_in,
        }
        false
    });
    let mut text: String = kept.map(|line| format!("{line}\n")).collect();
    // The longest first: one name begins as another does.
    for (number, value) in numbers.iter().rev() {
        text = text.replace(&format!("${number}"), &value.to_string());
    }
    text = text.replace("$name_", &format!("{}_", own.name));
    text = text.replace("$NAME_", &format!("{}_", own.name.to_uppercase()));
    Some(format!("#include <string.h>\n\n{text}"))
}
