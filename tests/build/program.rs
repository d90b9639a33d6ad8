//! A small program in assembly that stands for compiled code: one function whose instructions
//! belong to lines of a source.

use std::collections::BTreeMap;

use whippen_compiler::asm::{Source, assemble};
use whippen_compiler::image::{Board, Image, Input, LineRow, Object, Place, link};
use whippen_isa::Arch;

/// Sums what others put there, and answers with a constant from flash's copy.
pub const PROBE: &str = "
    .section .text.probe, \"ax\"
    .global probe_tick
    .thumb_func
probe_tick:
    push {r4, lr}
    ldr r4, =probe_state
    ldr r0, [r4]
    adds r0, r0, #3
    str r0, [r4]
    bl probe_scale
    str r0, [r4, #4]
    pop {r4, pc}
    .ltorg
    .section .text.probe2, \"ax\"
    .thumb_func
probe_scale:
    ldr r1, =probe_factor
    ldr r1, [r1]
    muls r0, r1, r0
    bx lr
    .section .rodata.probe, \"a\"
    .balign 4
probe_factor:
    .word 5
    .section .data.probe, \"aw\"
    .balign 4
    .global probe_state
    .type probe_state, %object
probe_state:
    .word 4, 0
    .size probe_state, 8
";

/// Copies, clears, calls, and ends by semihosting.
pub const START: &str = "
    .section .vectors, \"a\"
    .word __stack_top
    .word reset
    .section .text.start, \"ax\"
    .global reset
    .thumb_func
reset:
    ldr r0, =__copy_table_start
    ldr r1, =__copy_table_end
1:  cmp r0, r1
    bhs 4f
    ldm r0!, {r2, r3, r4}
2:  cmp r4, #0
    beq 1b
    ldr r5, [r2]
    str r5, [r3]
    adds r2, r2, #4
    adds r3, r3, #4
    subs r4, r4, #4
    b 2b
4:  ldr r0, =probe_tick
    blx r0
    movs r0, #0x18
    ldr r1, =0x20026
    bkpt #0xab
5:  b 5b
";

/// The source that the probe's lines are said to come from.
pub const TEXT: &str = "instrument probe {
    force weight = 1 N
    force more = 2 N
    force scaled = 3 N
}
";

/// What origins 0 to 3 mean.
pub fn places() -> Vec<Place> {
    let items = [
        "instrument probe",
        "force weight",
        "force more",
        "force scaled",
    ];
    let place = |(item, line): (&str, u32)| Place {
        file: "probe.whip".to_string(),
        line,
        item: item.to_string(),
    };
    items.into_iter().zip(1..).map(place).collect()
}

/// The assembled text.
pub fn object(text: &str, arch: Arch) -> Object {
    assemble(
        &[Source {
            name: "test.s",
            text,
        }],
        &BTreeMap::new(),
        arch,
    )
    .unwrap_or_else(|error| panic!("{error}"))
}

/// The probe with its lines.
pub fn probe(arch: Arch) -> Object {
    let mut object = object(PROBE, arch);
    for (section, rows) in [
        (".text.probe", &[(0, 0), (4, 1), (8, 2), (14, 0)][..]),
        (".text.probe2", &[(0, 0), (2, 3)]),
    ] {
        let section = object
            .sections
            .iter_mut()
            .find(|s| s.name == section)
            .expect("is there");
        section.lines = rows
            .iter()
            .map(|&(at, origin)| LineRow {
                at,
                origin: Some(origin),
            })
            .collect();
    }
    object
}

/// The image of both for a board.
pub fn image(board: &Board) -> Image {
    let last = board.memory.last().expect("has memory");
    let start = START.replace("__stack_top", &format!("__{}_end", last.name));
    let start = object(&start, board.arch);
    let (probe, places) = (probe(board.arch), places());
    let inputs = [
        Input {
            object: &start,
            places: &[],
        },
        Input {
            object: &probe,
            places: &places,
        },
    ];
    link(board, &inputs, "reset").unwrap_or_else(|error| panic!("{error}"))
}
