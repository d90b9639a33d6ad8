//! The state of the C text as types of Rust: the same fields in the same order, `repr(C)`.

use std::fmt::Write;

use super::declare::{args_max, line_type, rings};
use super::{Names, Options, c_type};
use whippen_kernel::Kernel;

/// `KernelState`, with records of the keys, and what it holds.
pub(super) fn rust_types(kernel: &Kernel, names: &Names, options: Options) -> String {
    let rust = |c: &str| match c {
        "uint16_t" => "u16",
        "int64_t" => "i64",
        _ => "i32",
    };
    let mut text = format!(
        "\n#[repr(C)]\npub struct KernelEvent {{\n    tick: u64,\n    key: u32,\n    event: u32,\n    args: [i32; {}],\n}}\n\n\
         #[repr(C)]\npub struct KernelKey {{\n",
        args_max(kernel)
    );
    if kernel.cells.is_empty() && kernel.lines.is_empty() {
        text.push_str("    nothing: u8,\n");
    }
    for (cell, field) in kernel.cells.iter().zip(&names.cells) {
        let ty = rust(c_type(cell.ty));
        let _ = match cell.len {
            0 | 1 => writeln!(text, "    {field}: {ty},"),
            len => writeln!(text, "    {field}: [{ty}; {len}],"),
        };
    }
    for (line, field) in kernel.lines.iter().zip(&names.lines) {
        let _ = writeln!(
            text,
            "    {field}: [{}; {}],",
            rust(line_type(line)),
            line.len
        );
    }
    text.push_str("}\n\n#[repr(C)]\npub struct KernelState {\n");
    for field in &names.lives {
        let _ = writeln!(text, "    {field}: i32,");
    }
    let _ = writeln!(text, "    key: [KernelKey; {}],", options.keys);
    for len in rings(kernel) {
        let _ = writeln!(text, "    ring_{len}: u32,");
    }
    let _ = writeln!(
        text,
        "    tick: u64,\n    lost: u64,\n    events: u32,\n    event: [KernelEvent; {}],\n}}",
        options.events
    );
    text
}
