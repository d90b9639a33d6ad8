//! Reading ELFs: good ones, and everything that is not one.

#[path = "made/elf.rs"]
mod made;

use made::{Part, elf_of};
use whippen_emulator::elf::{Elf, ElfError, regions_for, vector_table};
use whippen_emulator::{Board, CoreKind, Machine, Region};

const CODE: u32 = 1;
const DATA: u32 = 2;

/// A vector table, two instructions, and data that is loaded behind them and runs in RAM.
fn image() -> Vec<u8> {
    let text = [0x2000_4000_u32, 0x0800_0009, 0x4770_2001]
        .map(u32::to_le_bytes)
        .concat();
    let parts = [
        Part {
            run: 0x0800_0000,
            load: 0x0800_0000,
            bytes: &text,
            memory_bytes: 12,
            flags: 4 | CODE,
        },
        Part {
            run: 0x2000_0000,
            load: 0x0800_000c,
            bytes: &[1, 2, 3, 4],
            memory_bytes: 64,
            flags: 4 | DATA,
        },
    ];
    elf_of(2, 0x0800_0009, &parts)
}

fn error(bytes: &[u8]) -> String {
    Elf::parse(bytes, false).expect_err("refused").to_string()
}

#[test]
fn segments_have_two_addresses() {
    let elf = Elf::parse(&image(), false).expect("good");
    assert_eq!(elf.entry, 0x0800_0009);
    assert_eq!(elf.segments.len(), 2);
    let data = &elf.segments[1];
    assert_eq!(
        (data.load, data.run, data.memory_bytes),
        (0x0800_000c, 0x2000_0000, 64)
    );
    assert!(
        data.writable
            && !data.executable
            && !elf.segments[0].writable
            && elf.segments[0].executable
    );
    assert_eq!(vector_table(&elf), Some(0x0800_0000));
}

#[test]
fn memory_is_made_for_what_the_image_wants() {
    let elf = Elf::parse(&image(), false).expect("good");
    let runs = regions_for(&elf, &[]).expect("little");
    assert_eq!(
        runs,
        [(0x0800_0000, 4096, false), (0x2000_0000, 512 << 10, true)]
    );
    let given = [(0x2000_0000, 0x4000, true)];
    let runs = regions_for(&elf, &given).expect("little");
    assert_eq!(
        runs,
        [
            (0x0800_0000, 4096, false),
            (0x2000_4000, (512 << 10) - 0x4000, true)
        ]
    );
}

#[test]
fn a_call_without_start_up_code_finds_its_data() {
    let elf = Elf::parse(&image(), false).expect("good");
    let regions = vec![
        Region::rom("flash", 0x0800_0000, 4096),
        Region::ram("ram", 0x2000_0000, 4096),
    ];
    let board = Board {
        regions,
        ..Board::generic(CoreKind::CortexM33)
    };
    for (started, expected) in [(false, [0; 4]), (true, [1, 2, 3, 4])] {
        let mut machine = Machine::new(board.clone()).expect("a board");
        elf.load(&mut machine.bus.memory, started)
            .expect("memory is there");
        let mut bytes = [9; 4];
        machine
            .bus
            .memory
            .read(0x2000_0000, &mut bytes)
            .expect("memory is there");
        assert_eq!(bytes, expected);
        machine
            .bus
            .memory
            .read(0x0800_000c, &mut bytes)
            .expect("memory is there");
        assert_eq!(bytes, [1, 2, 3, 4]);
    }
    let mut machine = Machine::new(Board {
        regions: board.regions[..1].to_vec(),
        ..board
    })
    .expect("a board");
    let error = elf
        .load(&mut machine.bus.memory, true)
        .expect_err("no RAM")
        .to_string();
    assert_eq!(error, "no memory at 0x20000000");
}

#[test]
fn what_is_no_image_for_a_cortex_m_is_named() {
    let patched = |at: usize, byte: u8| {
        let mut bytes = image();
        bytes[at] = byte;
        error(&bytes)
    };
    assert_eq!(error(b""), "is no ELF: the file is empty");
    assert_eq!(error(b"int main(void);\n"), "is no ELF: this is text");
    assert_eq!(
        error(&[0, 1, 2, 3]),
        "is no ELF: it does not begin with 0x7f ELF"
    );
    assert!(error(b"UF2\n\x57\x51\x5d\x9e").contains("UF2"));
    assert!(error(b":10000000").contains("Intel HEX"));
    assert!(error(b"!<arch>\n").contains("library"));
    assert_eq!(
        patched(4, 2),
        "is a 64-bit ELF; a Cortex-M runs 32-bit ones"
    );
    assert_eq!(
        patched(5, 2),
        "is a big-endian ELF; only little-endian ones are run"
    );
    assert_eq!(patched(18, 243), "is an ELF for RISC-V, not for ARM");
    assert_eq!(patched(18, 77), "is an ELF for machine 77, not for ARM");
    assert_eq!(
        patched(16, 4),
        "is an ELF of type 4, neither an executable nor an object file"
    );
    assert!(
        patched(0x34, 3).contains("for an operating system"),
        "PT_INTERP"
    );
    assert_eq!(error(&elf_of(2, 0, &[])), "has nothing to load");
    let cut = image();
    assert!(matches!(
        Elf::parse(&cut[..40], false),
        Err(ElfError::Corrupt(_))
    ));
    assert!(error(&cut[..0x78]).contains("beyond the end"));
}

#[test]
fn a_segment_of_the_whole_address_space_is_refused_before_it_is_made() {
    let part = Part {
        run: 0,
        load: 0,
        bytes: &[],
        memory_bytes: u32::MAX,
        flags: 7,
    };
    let elf = Elf::parse(&elf_of(2, 0, &[part]), false).expect("a strange image");
    let error = regions_for(&elf, &[]).expect_err("too much").to_string();
    assert!(error.contains("at most 256 MiB"), "{error}");
}
