//! What delay lines hold when a program begins: what they held at first.
//!
//! A key that begins fills the lines of its differentiators itself. All other lines of a program
//! are emptied before its first key begins, a piece of memory after the other (`emptying.s`), as
//! all of them may be more than a tick can write.

use std::fmt::Write;

use whippen_arm::thumb::LineSlots;
use whippen_kernel::Kernel;

use super::code::{CoreCode, ProgramCode, ZoneCode, begins_later};
use super::{CORES, Setup};

/// A row of words that all begin as the same one.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct EmptyPiece {
    /// Bytes from where the zone's histories begin.
    at: u32,
    /// How many.
    bytes: u32,
    /// The word.
    word: u32,
}

impl EmptyPiece {
    /// The pieces of a zone's lines that `init` does not fill.
    pub(super) fn of(kernel: &Kernel, lines: &[LineSlots]) -> Vec<EmptyPiece> {
        let mut pieces: Vec<EmptyPiece> = Vec::new();
        for line in kernel.unfilled_lines() {
            let (slots, first) = (&lines[line], kernel.lines[line].first_value());
            let word = match slots.narrow {
                true => first as u32 & 0xffff | (first as u32) << 16,
                false => first as u32,
            };
            let (at, bytes) = (slots.at, slots.row * slots.len);
            match pieces.last_mut() {
                Some(last) if last.at + last.bytes == at && last.word == word => {
                    last.bytes += bytes;
                }
                _ => pieces.push(EmptyPiece { at, bytes, word }),
            }
        }
        pieces
    }
}

/// Whether some program has lines that are emptied, where one may begin after the start.
pub(super) fn empties(programs: &[ProgramCode], setup: &Setup) -> bool {
    let mut zones = programs.iter().flat_map(ProgramCode::zones);
    begins_later(programs, setup) && zones.any(|zone| !zone.empty_pieces.is_empty())
}

/// The table of a core's pieces in a program.
pub(super) fn lines_table_name(program: usize, core: usize) -> String {
    format!("lines{program}_core{core}")
}

/// The table of a core's pieces as assembly: of each from where to where, and the word; then 0.
pub(super) fn table_as_assembly(core: &CoreCode, program: usize) -> String {
    let mut text = format!(
        "        .section .rodata.{section}.lines, \"a\"\n        .balign 4\n        .global {name}\n{name}:\n",
        section = CORES[core.core.index()],
        name = lines_table_name(program, core.core.index()),
    );
    for ZoneCode {
        name, empty_pieces, ..
    } in &core.zones
    {
        for EmptyPiece { at, bytes, word } in empty_pieces {
            let from = format!("{name}_histories + {at}");
            let _ = writeln!(text, "        .word   {from}, {from} + {bytes}, {word}");
        }
    }
    text.push_str("        .word   0\n");
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use whippen_arm::thumb::{Options, TickAbi, compile_for_frame};
    use whippen_isa::Arch;
    use whippen_kernel::parse;
    use whippen_modes::Modes;

    /// What a key fills is left out; what begins alike and follows is one piece.
    const TEXT: &str = "kernel lines @44100 {
  in x: u16 [0..65535]
  out f: i16 [-32768..32767]
  line filled: 4 [0..65535]
  line a: 3 [-9..9]
  line b: 2 [-5..100000]
  line high: 2 [70000..80000]
  line narrow: 3 [3..9]
  init {
    v0: i32 [0..65535] = in x
    fill filled v0
  }
  tick {
    v0: i32 [0..65535] = in x
    v1: i32 [0..9] = const 5
    v2: i32 [70000..70000] = const 70000
    v3: i32 [0..0] = const 0
    push filled v0
    push a v1
    push b v1
    push high v2
    push narrow v1
    out f v3
  }
}
";

    #[test]
    fn pieces_are_the_lines_that_no_key_fills() {
        let kernel = parse(TEXT).unwrap_or_else(|error| panic!("{error:?}"));
        let options = Options {
            name: "k".to_string(),
            keys: 5,
            gain: true,
            probes: false,
            arch: Arch::V8M,
        };
        let abi = TickAbi {
            drive_offset: 28,
            record_bytes_min: 40,
            shares: true,
        };
        let built = compile_for_frame(&Modes::single(&kernel), &options, &abi)
            .unwrap_or_else(|error| panic!("{error}"));
        let lines = built.layout.lines();
        let piece = |at, bytes, word| EmptyPiece { at, bytes, word };
        let (wide, narrow) = (4 * 5, 12);
        assert_eq!(
            EmptyPiece::of(&kernel, &lines),
            [
                piece(lines[1].at, 5 * wide, 0),
                piece(lines[3].at, 2 * wide, 70_000),
                piece(lines[4].at, 3 * narrow, 0x0003_0003),
            ]
        );
    }
}
