//! Who else is at banks and bridges, of sections laid out by hand.

use super::*;
use crate::chip::{board, columns};
use whippen_board::Bench;
use whippen_isa::Arch;

/// A section of so many bytes, code where its name says so.
pub(crate) fn section(name: &str, run: u32, size: u32) -> LinkedSection {
    LinkedSection {
        name: name.into(),
        kind: match name.starts_with(".text") {
            true => SectionKind::Code,
            false => SectionKind::Data,
        },
        memory: String::new(),
        load: run,
        run,
        bytes: Vec::new(),
        size,
        lines: Vec::new(),
    }
}

/// An image for so many cores.
pub(crate) fn whole(cores: usize, sections: Vec<LinkedSection>) -> FirmwareImage {
    FirmwareImage {
        image: Image {
            arch: Arch::V8M,
            entry: 0,
            sections,
            segments: Vec::new(),
            symbols: Vec::new(),
            loops: Vec::new(),
            targets: Vec::new(),
        },
        keys_of_cores: vec![1; cores],
        programs: Default::default(),
        monitored: false,
        passes_midi: false,
        yields_dma: false,
        has_columns: false,
    }
}

/// Two sections of each kind in banks 0 to 3 and 4 to 7, a word each or two, partly in the same.
fn laid_out() -> Vec<LinkedSection> {
    [
        (".text.core0", 0x2000_0000, 8),
        (".text.core0.frame", 0x2000_0010, 4),
        (".text.core1", 0x2004_0000, 4),
        (".text.core1.frame", 0x2004_0010, 8),
        (".text.start", 0x2000_0018, 8),
        (".bss.state", 0x2000_0108, 4),
        (".rodata.tables", 0x2000_0208, 8),
        (".data.core1.state", 0x2004_0108, 8),
        (".bss.core1.more", 0x2004_0208, 4),
        (".data.vectors", 0x2000_0304, 4),
    ]
    .map(|(name, run, size)| section(name, run, size))
    .to_vec()
}

#[test]
fn cores_meet_in_the_banks_of_their_sections() {
    let (both, board) = (whole(2, laid_out()), board());
    let program = Program::of(&both.image);
    let of = |core| around(&both, &program, &board, core);
    let (code0, code1) = (0b0011, 0b0011_0000);
    let (data0, data1) = (0b1100, 0b1100_0000);
    let lies = [0, 1].map(|core| of(core).lies());
    assert_eq!(lies.each_ref().map(|own| own.code), [code0, code1]);
    assert_eq!(lies.map(|own| own.data.banks), [data0, data1]);
    assert_eq!(of(0).others.contenders, [code1, data1]);
    assert_eq!(of(1).others.contenders, [code0, data0]);
    // Alone it has what is named after either.
    let one = whole(1, laid_out());
    let alone = around(&one, &program, &board, 0);
    assert_eq!(alone.lies().code, code0 | code1);
    assert_eq!(alone.lies().data.banks, data0 | data1);
    assert!(alone.others.contenders.is_empty());
    let mut same = laid_out();
    same[2].run = 0x2000_0000;
    let same = whole(1, same);
    assert_eq!(around(&same, &program, &board, 0).lies().code, 0b0011_0011);
}

/// A write to the APB takes four cycles, a read three.
#[test]
fn the_other_core_is_waited_for_at_the_bridge() {
    let mut board = board();
    let waits = |cores, has_columns, board: &Board| {
        let image = FirmwareImage {
            has_columns,
            ..whole(cores, Vec::new())
        };
        [0, 1].map(|core| neighbour(&image, board, core).map(|own| own.wait_cycles))
    };
    assert_eq!(waits(2, false, &board), [None; 2], "no converter");
    board.devices = vec![
        ("converter".into(), 0x4017_0000),
        ("pwm".into(), 0x400a_8000),
    ];
    assert_eq!(waits(2, false, &board), [Some(4); 2]);
    // Core 0 goes first, with up to two more.
    assert_eq!(waits(2, true, &board), [Some(4), Some(3 * 4)]);
    assert_eq!(waits(1, false, &board), [None; 2]);
    board.buses[0].read_cycles = 6;
    assert_eq!(waits(2, false, &board), [Some(6); 2]);
}

/// One of its reads and one of its writes at the bridge; at memory all, where it may go first.
#[test]
fn a_dma_is_waited_for_at_its_bridge_and_at_memory() {
    let mut board = board();
    board.devices = vec![("adc".into(), 0x400a_0000), ("pio0".into(), 0x5020_0000)];
    let waits = |yields_dma, board: &Board| {
        let image = FirmwareImage {
            yields_dma,
            ..whole(1, Vec::new())
        };
        dma(&image, board).map(|own| (own.device, own.wait_cycles, own.in_memory))
    };
    assert_eq!(waits(false, &board), None);
    board.bench = Some(Bench {
        sensors: vec![40],
        bridges: vec![0],
        sleep: 2,
        fault: 3,
        psram: None,
        period_cycles: 3400,
        ahead_cycles: 0,
        supply_mv: 12_000,
    });
    assert_eq!(waits(false, &board), Some((0x400a_0000, 2 * 16, 16)));
    assert_eq!(waits(true, &board), Some((0x400a_0000, 2 * 16, 0)));
    board.columns = Some(columns(1));
    // A word of each of eight keys either way, and eight commands.
    assert_eq!(waits(false, &board), Some((0x5020_0000, 2 * 2, 24)));
}
