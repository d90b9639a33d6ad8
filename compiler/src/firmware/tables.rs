//! What the firmware looks up: live parameters with their ranges, velocities by speed.

use std::fmt::Write;

use super::Setup;
use crate::kernel::Kernel;
use crate::thumb::Layout;

/// The tables as assembly: `lives` is how many, then offset in the state, lowest and highest value of each; `velocities` 128
/// bytes.
pub(super) fn text(kernel: &Kernel, setup: &Setup, layout: &Layout) -> String {
    let mut text =
        String::from("        .section .rodata.tables, \"a\"\n        .balign 4\n        .global lives, velocities\n");
    let _ = writeln!(text, "lives:  .word   {}", kernel.lives.len());
    for (index, live) in kernel.lives.iter().enumerate() {
        let at = layout.live(index).unwrap_or(0);
        let _ = writeln!(text, "        .word   {at}, {}, {}         @ {}", live.range.low, live.range.high, live.name);
    }
    // Looked up by core 1 alone.
    text += "        .section .rodata.core1.tables, \"a\"\nvelocities:\n";
    for row in setup.midi.velocities.chunks(16) {
        let bytes: Vec<String> = row.iter().map(u8::to_string).collect();
        let _ = writeln!(text, "        .byte   {}", bytes.join(", "));
    }
    text
}
