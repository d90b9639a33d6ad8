//! The second stage of an RP2040: its checksum, and what it does when the ROM enters it.

use std::sync::{Arc, Mutex};

use whippen_compiler::firmware::{Instrument, build_image};
use whippen_compiler::image::{Image, uf2};
use whippen_compiler::keyboard::Layout;
use whippen_compiler::modes::Modes;
use whippen_emulator::{
    Access, BoardKind, Bus, BusError, ConverterSetup, Device, Register, Stop, Waits, build,
};
use whippen_runtime::board;

use crate::rig::{kernel, midi, setup};

const FLASH: u32 = 0x1000_0000;
/// Where the ROM puts it (RP2040 datasheet 2.8.1.3).
const AT: u32 = 0x2004_1f00;
const SSI: u32 = 0x1800_0000;

fn image() -> Image {
    let (kernel, board) = (
        kernel("virtual-spring.whip"),
        board::bundled("rp2040").expect("it is bundled"),
    );
    let modes = Modes::single(&kernel);
    let notes = midi(&kernel);
    let instrument = Instrument {
        modes: &modes,
        places: &[],
        midi: &notes,
        parts: None,
    };
    let layout = Layout::of_one_instrument("spring", 88, 21);
    build_image(&layout, &[instrument], &setup(), &board)
        .unwrap_or_else(|e| panic!("{e}"))
        .image
}

/// What is stored from an address on.
fn stored(image: &Image, from: u32, bytes: usize) -> Vec<u8> {
    let mut found = vec![0; bytes];
    for segment in &image.segments {
        for (at, byte) in (segment.load..).zip(&segment.bytes) {
            if let Some(place) = found.get_mut(at.wrapping_sub(from) as usize) {
                *place = *byte;
            }
        }
    }
    found
}

/// CRC-32 as the datasheet has it (2.8.1.3.1), by division of polynomials: bit by bit, first the
/// top one.
fn checksum(bytes: &[u8]) -> u32 {
    let bits = bytes
        .iter()
        .flat_map(|byte| (0..8).rev().map(move |bit| byte >> bit & 1));
    bits.fold(u32::MAX, |rest, bit| {
        let out = (rest >> 31) as u8 ^ bit;
        rest << 1 ^ if out == 1 { 0x04c1_1db7 } else { 0 }
    })
}

#[test]
fn the_rom_finds_its_checksum_and_the_bootloader_its_family() {
    let image = image();
    let block = stored(&image, FLASH, 256);
    let sum = u32::from_le_bytes(block[252..].try_into().expect("four bytes"));
    assert_eq!(sum, checksum(&block[..252]));
    let reset = image
        .symbols
        .iter()
        .find(|symbol| symbol.name == "reset")
        .expect("the start")
        .address;
    let vectors = stored(&image, FLASH + 0x100, 8);
    let word = |at: usize| u32::from_le_bytes(vectors[at..at + 4].try_into().expect("four bytes"));
    assert_eq!((word(0), word(4)), (0x2004_1000, reset | 1));
    let file = uf2(&image, 0xe48b_ff56, None);
    assert_eq!(
        (file.len() % 512, &file[28..32]),
        (0, &0xe48b_ff56_u32.to_le_bytes()[..])
    );
    assert_eq!(
        (&file[12..16], &file[32..288]),
        (&FLASH.to_le_bytes()[..], &block[..])
    );
}

/// Keeps what is written.
struct Recorder(Arc<Mutex<Vec<(u32, u32)>>>);

impl Device for Recorder {
    fn read(&mut self, _: Access, _: &mut Bus) -> Result<u32, BusError> {
        Ok(0)
    }

    fn write(&mut self, access: Access, value: u32, _: &mut Bus) -> Result<(), BusError> {
        self.0
            .lock()
            .map_err(|_| BusError)?
            .push((access.offset, value));
        Ok(())
    }
}

#[test]
fn it_sets_the_flash_up_and_starts_the_image() {
    let image = image();
    let (mut machine, _) = build(
        BoardKind::Rp2040,
        BoardKind::Rp2040.board(),
        ConverterSetup::default(),
    )
    .expect("the board can be");
    for segment in &image.segments {
        machine
            .bus
            .memory
            .write(segment.load, &segment.bytes)
            .expect("memory");
    }
    let written = Arc::new(Mutex::new(Vec::new()));
    machine.bus.attach(
        SSI,
        0x1000,
        Waits::default(),
        Box::new(Recorder(written.clone())),
    );
    machine.reset();
    machine
        .bus
        .memory
        .write(AT, &stored(&image, FLASH, 256))
        .expect("memory");
    let named = |name: &str| Register::named(name).expect("a register");
    machine.cpu_mut(0).set(named("pc"), AT);
    machine.cpu_mut(0).set(named("sp"), 0x2004_2000);
    let reset = image
        .symbols
        .iter()
        .find(|symbol| symbol.name == "reset")
        .expect("the start")
        .address;
    machine.set_breakpoint(reset & !1);
    assert!(matches!(
        machine.run(10_000),
        Stop::Breakpoint { core: 0, .. }
    ));
    assert_eq!(machine.cpu(0).get(named("sp")), 0x2004_1000);
    // Off, the clock, one word at a time of 32 bits behind command and address, the plain read, on.
    let expected = [
        (0x08, 0),
        (0x14, 4),
        (0x00, 0x001f_0300),
        (0x04, 0),
        (0xf4, 0x0300_0218),
        (0x08, 1),
    ];
    assert_eq!(*written.lock().expect("nobody failed"), expected);
}
