//! The self-test image of a board (`whippen_compiler::firmware::SelfTest`): which ticks it has, and
//! its run on the emulated board, which says what they are expected to take.
//!
//! ```text
//!   image without expected ticks --emulated board--> ticks found --> image with them
//! ```
//!
//! What programs are expected to take is not taken from a run: it is walked by the core's table.

use whippen_compiler::Rng;
use whippen_compiler::board::Board;
use whippen_compiler::firmware::{SelfTest, self_test_block, support};
use whippen_compiler::image::Image;
use whippen_emulator::{BoardKind, ConverterSetup, Machine, Stop, Uart};
use whippen_isa::Arch;
use whippen_isa::timing::Core;

use crate::image::ImageInstrument;

/// Bits per second of its serial port, which every adapter has.
const BAUD: u32 = 115_200;
/// The same while it runs to find out about ticks.
const FAST_BAUD: u32 = 3_000_000;
/// Ticks of strokes, and of any words after them.
const STROKES: u32 = 768;
const LEAPS: u32 = 256;
/// A run that takes more cycles does not end.
const CYCLES_MAX: u64 = 2_000_000_000;
/// Cycles between looks at whether it is over.
const SLICE: u64 = 100_000;

/// What a self-test has told.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SelfTestOutcome {
    /// On the serial port.
    pub text: String,
    /// How many programs and ticks differ.
    pub differ: u32,
    /// Cycles of each tick.
    pub ticks: Vec<u32>,
}

/// The table of the core of a board.
pub fn timing_of(board: &Board) -> Core {
    match board.arch {
        Arch::V6M => Core::cortex_m0plus(),
        Arch::V7EM => Core::cortex_m4(),
        Arch::V8M => Core::cortex_m33(),
    }
}

/// The emulated board with the core of a board.
fn kind_of(board: &Board) -> BoardKind {
    match board.arch {
        Arch::V6M => BoardKind::Rp2040,
        Arch::V7EM => BoardKind::Stm32f4,
        Arch::V8M => BoardKind::Rp2350,
    }
}

/// Sensor words: three strokes over the whole range, each faster than the one before, then leaps.
fn motion() -> Vec<u16> {
    let stroke = |tick: u32| {
        let period = (STROKES / 3) >> (tick * 3 / STROKES);
        let at = tick % period * 2;
        let up = at.min(2 * period - at);
        (up * 65_535 / period) as u16
    };
    let mut rng = Rng::new(1);
    let leaps = (0..LEAPS).map(|_| rng.below(65_536) as u16);
    (0..STROKES).map(stroke).chain(leaps).collect()
}

/// The self-test of a board with the key of an instrument, as the table of its core expects it.
///
/// # Errors
/// There is none, in words.
pub fn self_test_image(
    board: &Board,
    timing: &Core,
    name: &str,
    instrument: &ImageInstrument,
) -> Result<Image, String> {
    let support = support(board).map_err(|e| e.to_string())?;
    let motion = motion();
    let test = SelfTest {
        support: &support,
        timing,
        instrument: name,
        modes: &instrument.modes,
        places: &instrument.places,
        motion: &motion,
        ticks: &[],
        baud: FAST_BAUD,
    };
    let first = test.image().map_err(|e| e.to_string())?;
    let found = run_self_test(&first, kind_of(board))?;
    let test = SelfTest {
        ticks: &found.ticks,
        baud: BAUD,
        ..test
    };
    test.image().map_err(|e| e.to_string())
}

/// Runs a self-test on an emulated board to its end.
///
/// # Errors
/// It does not come to its end, in words.
pub fn run_self_test(image: &Image, kind: BoardKind) -> Result<SelfTestOutcome, String> {
    let converter = ConverterSetup::default();
    let (mut machine, ports) =
        whippen_emulator::build(kind, kind.board(), converter).map_err(|e| e.to_string())?;
    for segment in &image.segments {
        let memory = &mut machine.bus.memory;
        let written = memory.write(segment.load, &segment.bytes);
        written.map_err(|e| e.to_string())?;
    }
    machine.reset();
    let symbol = |name: &str| {
        let mut symbols = image.symbols.iter();
        let found = symbols.find(|symbol| symbol.name == name);
        let address = found.map(|symbol| symbol.address);
        address.ok_or_else(|| format!("the image has no `{name}`"))
    };
    let block = symbol("self_test")?;
    let stop = loop {
        let stop = machine.run(machine.cycle(0) + SLICE);
        let over = machine.cycle(0) > CYCLES_MAX;
        if over || !matches!(stop, Stop::Limit) {
            break stop;
        }
    };
    let mut text = Vec::new();
    for uart in ports.uarts {
        let uart = machine.bus.device::<Uart>(uart);
        text.extend(uart.iter().flat_map(|uart| &uart.output));
    }
    let text = String::from_utf8_lossy(&text).into_owned();
    let told = |machine: &Machine, at: u32| word(machine, block + at);
    let behind = text.lines().next_back().unwrap_or_default().trim();
    match told(&machine, self_test_block::STATE)? {
        1 => {}
        2 => {
            return Err(format!(
                "the self-test met a fault of the processor, behind: {behind}"
            ));
        }
        _ => {
            return Err(format!(
                "the self-test did not come to its end ({stop}), behind: {behind}"
            ));
        }
    }
    let ticks = told(&machine, self_test_block::TICKS)?;
    let first = symbol("self_test_ticks_found")?;
    let ticks = (0..ticks).map(|tick| word(&machine, first + 4 * tick));
    Ok(SelfTestOutcome {
        text,
        differ: told(&machine, self_test_block::DIFFER)?
            + told(&machine, self_test_block::TICKS_DIFFER)?,
        ticks: ticks.collect::<Result<_, _>>()?,
    })
}

fn word(machine: &Machine, address: u32) -> Result<u32, String> {
    let mut bytes = [0; 4];
    let read = machine.bus.memory.read(address, &mut bytes);
    read.map_err(|e| e.to_string())?;
    Ok(u32::from_le_bytes(bytes))
}
