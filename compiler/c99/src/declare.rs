//! Declarations of the C text: sizes, the state, prototypes.

use super::{Layout, Names, Options, c_type};
use std::fmt::Write;
use whippen_kernel::{Kernel, Line, Range};
use whippen_rate::Rate;

/// A rate as the value of a macro.
pub fn rate_constant(rate: Rate) -> String {
    match rate.constant() {
        (whole, false) => whole,
        (quotient, true) => format!("({quotient})"),
    }
}

/// Types, sizes and functions.
pub(super) fn header(kernel: &Kernel, names: &Names, options: Options) -> String {
    let (name, capitals) = (&names.kernel, &names.capitals);
    let Options { keys, events, .. } = options;
    let probes = kernel.probes.len();
    let mut text = String::new();
    let _ = writeln!(
        text,
        "/* One tick of {keys} keys of `{name}` at {rate} Hz, in integers. Written by Whippen. */\n\
         #ifndef {capitals}_H\n#define {capitals}_H\n\n#include <stdint.h>\n\n\
         #define {capitals}_RATE_HZ {rate_constant}\n#define {capitals}_KEYS {keys}\n#define {capitals}_EVENTS {events}",
        rate = kernel.rate_hz,
        rate_constant = rate_constant(kernel.rate_hz)
    );
    for (at, macro_name) in names.events.iter().chain(&names.probes).enumerate() {
        let at = if at < names.events.len() {
            at
        } else {
            at - names.events.len()
        };
        let _ = writeln!(text, "#define {macro_name} {at}");
    }
    event(&mut text, kernel, names);
    state(&mut text, kernel, names, options);
    let _ = writeln!(
        text,
        "/* Live values as declared, no events; once, before anything else. */\n\
         void {name}_defaults({name}_state *state);\n\
         /* Memory as before the first tick; `in` holds {inputs} word(s) a key, those of the first tick. */\n\
         void {name}_init({name}_state *state, const uint16_t *in);\n\
         /* One tick of all keys; `out` gets {outputs} word(s) a key{and_probes}. */\n\
         void {name}_tick({name}_state *state, const uint16_t *in, int16_t *out);\n\n\
         #endif",
        inputs = kernel.inputs.len(),
        outputs = kernel.outputs.len(),
        and_probes = if probes > 0 {
            ", `probes` of the state all that is exported"
        } else {
            ""
        },
    );
    text
}

/// Sizes and types alone.
pub(super) fn component_types(kernel: &Kernel, names: &Names, options: Options) -> String {
    let (capitals, Options { keys, events, .. }) = (&names.capitals, options);
    let mut text = format!("#define {capitals}_KEYS {keys}\n#define {capitals}_EVENTS {events}\n");
    event(&mut text, kernel, names);
    state(&mut text, kernel, names, options);
    text
}

/// Words of the arguments of the event that has most, at least one.
pub(super) fn args_max(kernel: &Kernel) -> u32 {
    let args = kernel.events.iter().map(|event| event.args).max();
    args.unwrap_or(0).max(1)
}

fn event(text: &mut String, kernel: &Kernel, names: &Names) {
    let _ = writeln!(
        text,
        "\n/* What happened to a key in a tick. */\n\
         typedef struct {{ uint64_t tick; uint32_t key; uint32_t event; int32_t args[{}]; }} {}_event;\n",
        args_max(kernel),
        names.kernel
    );
}

fn state(text: &mut String, kernel: &Kernel, names: &Names, options: Options) {
    let (name, capitals) = (&names.kernel, &names.capitals);
    let records = options.layout == Layout::Records;
    let columns = if records {
        String::new()
    } else {
        format!("[{capitals}_KEYS]")
    };
    let mut fields = String::new();
    for (cell, field) in kernel.cells.iter().zip(&names.cells) {
        let words = if cell.len > 1 {
            format!("[{}]", cell.len)
        } else {
            String::new()
        };
        let _ = writeln!(
            fields,
            "    {} {field}{words}{columns}; /* {} */",
            c_type(cell.ty),
            cell.range
        );
    }
    for (line, field) in kernel.lines.iter().zip(&names.lines) {
        let _ = writeln!(
            fields,
            "    {} {field}[{}]{columns}; /* {} */",
            line_type(line),
            line.len,
            line.range
        );
    }
    if records {
        let fields = if fields.is_empty() {
            "    char nothing;\n"
        } else {
            &fields
        };
        let _ = writeln!(
            text,
            "/* Memory of a key. */\ntypedef struct {{\n{fields}}} {name}_key;\n"
        );
    }
    let _ = writeln!(text, "/* Memory of all keys. */\ntypedef struct {{");
    for (live, field) in kernel.lives.iter().zip(&names.lives) {
        let _ = writeln!(
            text,
            "    int32_t {field}; /* {}; may be changed between ticks, within its range */",
            live.range
        );
    }
    let memory = if records {
        format!("    {name}_key key[{capitals}_KEYS];\n")
    } else {
        fields
    };
    text.push_str(&memory);
    for len in rings(kernel) {
        let _ = writeln!(text, "    uint32_t ring_{len};");
    }
    if !kernel.probes.is_empty() {
        let _ = writeln!(
            text,
            "    int64_t probes[{capitals}_KEYS][{}];",
            kernel.probes.len()
        );
    }
    let _ = writeln!(
        text,
        "    uint64_t tick;\n    uint64_t lost;   /* events that found the buffer full */\n\
         \x20   uint32_t events; /* in the buffer; set to 0 when they are read */\n\
         \x20   {name}_event event[{capitals}_EVENTS];\n}} {name}_state;\n"
    );
}

/// The C type of an element of a line.
pub(super) fn line_type(line: &Line) -> &'static str {
    if Range::new(0, u16::MAX.into()).contains(line.range) {
        "uint16_t"
    } else {
        "int32_t"
    }
}

/// The distinct lengths of lines: each has a ring index.
pub(super) fn rings(kernel: &Kernel) -> Vec<u32> {
    let mut lens: Vec<u32> = kernel.lines.iter().map(|line| line.len).collect();
    lens.sort_unstable();
    lens.dedup();
    lens
}
