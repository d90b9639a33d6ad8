//! What makes a frame's bound impossible is told.

use whippen_compiler::budget::{NotBounded, Program, cores};
use whippen_compiler::keyboard::ProgramId;

use crate::image::{Image, instruments};

fn spring() -> Image {
    let compiled = instruments()
        .into_iter()
        .find(|compiled| compiled.model.name == "virtual_spring");
    Image::new(compiled.expect("it is bundled"), 4)
}

/// The timer's vector leads to code that nobody bounds, or to the handler, as the tick's does.
#[test]
fn another_interrupt_has_no_bound() {
    for other in ["midi_step", "tick_core1"] {
        refuses_interrupt(other);
    }
}

fn refuses_interrupt(other: &str) {
    let mut image = spring();
    let (table, other) = (image.symbol("vectors1"), image.symbol(other));
    let section = image
        .whole
        .image
        .sections
        .iter_mut()
        .find(|section| section.run == table)
        .expect("the table");
    let timer = 4 * (16 + 3);
    section.bytes[timer..timer + 4].copy_from_slice(&(other | 1).to_le_bytes());
    let program = Program::of(&image.whole.image);
    let refused = cores(&image.whole, &program, &image.board, ProgramId(0)).expect_err("no bound");
    assert_eq!(refused, NotBounded::Interrupts { address: other });
    assert_eq!(
        refused.to_string(),
        format!("the handler at {other:#010x} may interrupt a tick, and how often is not known")
    );
}

#[test]
fn an_image_without_a_firmware_has_no_bound() {
    let mut image = spring();
    image
        .whole
        .image
        .symbols
        .retain(|symbol| symbol.name != "idle0");
    let program = Program::of(&image.whole.image);
    let refused = cores(&image.whole, &program, &image.board, ProgramId(0)).expect_err("no bound");
    assert_eq!(refused.to_string(), "there is no `idle0` in the code");
}
