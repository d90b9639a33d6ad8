//! An instrument's image and its bounds.

use std::collections::HashMap;
use std::sync::Arc;

use whippen_compiler::budget::{Bounded, Program};
use whippen_compiler::firmware::{CORES, FirmwareImage, Monitor, OwnText, OwnTexts, Setup};
use whippen_compiler::image::{Board, MemoryKind};
use whippen_compiler::keyboard::{CoreId, Layout};
use whippen_compiler::modes::{INSTRUCTIONS, Modes};
use whippen_compiler::pipeline::{self, Compiled, compile, unobserved};
use whippen_emulator::{Board as EmulatedBoard, BoardKind};
use whippen_runtime::image::{ImageInstrument, setup_to_bound};
use whippen_runtime::{board, device::Device};

use crate::common;

pub struct Image {
    pub kind: BoardKind,
    pub board: Board,
    /// What the emulator has in the place of the board.
    pub emulated: EmulatedBoard,
    pub compiled: Arc<Compiled>,
    pub modes: Modes,
    pub whole: FirmwareImage,
    pub program: Program,
    pub cores: Vec<Bounded>,
    pub keys: Vec<u32>,
    /// Cycles between two ticks.
    pub period: u64,
}

/// Every bundled instrument of a key as it is built, for its device.
pub fn instruments() -> Vec<Compiled> {
    let built = |observed: Compiled| {
        let scales = Device::of(&observed.model).scales();
        compile(observed.model, scales, false).unwrap_or_else(|e| panic!("{e:?}"))
    };
    common::of_keys().into_iter().map(built).collect()
}

impl Image {
    /// On an rp2350.
    pub fn new(compiled: Compiled, keys: u32) -> Image {
        Image::on(BoardKind::Rp2350, compiled, keys)
    }

    pub fn on(kind: BoardKind, compiled: Compiled, keys: u32) -> Image {
        let board = board::bundled(kind.name()).expect("it is bundled");
        Image::for_board(kind, (board, kind.board()), Arc::new(compiled), keys)
            .unwrap_or_else(|e| panic!("{e}"))
    }

    /// With another text in place of a bundled one.
    pub fn with_text(kind: BoardKind, compiled: Compiled, keys: u32, own: [&str; 2]) -> Image {
        let board = board::bundled(kind.name()).expect("it is bundled");
        let [name, text] = own.map(str::to_string);
        let path = name.clone();
        let own = OwnTexts::new([(name, OwnText { path, text })]).expect("its name is known");
        let compiled = Arc::new(compiled);
        let with_text = |setup: &mut Setup| setup.own_texts = own;
        Image::built((kind, board, kind.board()), compiled, keys, with_text)
            .unwrap_or_else(|e| panic!("{e}"))
    }

    /// With the monitor, at a rate that its port has.
    pub fn monitored(kind: BoardKind, compiled: Compiled, keys: u32) -> Image {
        let board = board::bundled(kind.name()).expect("it is bundled");
        let compiled = Arc::new(compiled);
        let monitor = Some(Monitor { baud: 3_000_000 });
        let monitored = |setup: &mut Setup| setup.monitor = monitor;
        Image::built((kind, board, kind.board()), compiled, keys, monitored)
            .unwrap_or_else(|e| panic!("{e}"))
    }

    /// One of several chips, which sends MIDI on.
    pub fn passing(kind: BoardKind, compiled: Compiled, keys: u32) -> Image {
        let board = board::bundled(kind.name()).expect("it is bundled");
        let passing = |setup: &mut Setup| setup.passes_midi = true;
        Image::built(
            (kind, board, kind.board()),
            Arc::new(compiled),
            keys,
            passing,
        )
        .unwrap_or_else(|e| panic!("{e}"))
    }

    /// Words that the other core looks up in a core's memory between two ticks.
    pub fn visits(&self, core: usize) -> u64 {
        match self.cores.len() {
            1 => 0,
            _ => self.whole.visits(CoreId(core as u32)).into(),
        }
    }

    /// On a board of one's own and what the emulator has in its place; or why it is refused.
    pub fn for_board(
        kind: BoardKind,
        (board, emulated): (Board, EmulatedBoard),
        compiled: Arc<Compiled>,
        keys: u32,
    ) -> Result<Image, String> {
        Image::built((kind, board, emulated), compiled, keys, |_| {})
    }

    fn built(
        (kind, board, emulated): (BoardKind, Board, EmulatedBoard),
        compiled: Arc<Compiled>,
        keys: u32,
        change: impl FnOnce(&mut Setup),
    ) -> Result<Image, String> {
        let device = Device::of(&compiled.model);
        let mut setup = setup_to_bound(&compiled, &device, keys, board.cores, 21).expect("a setup");
        change(&mut setup);
        let layout = Layout::of_one_instrument(&compiled.model.name, keys, 21);
        let instrument = ImageInstrument::new(&compiled, INSTRUCTIONS, None, &mut unobserved)
            .unwrap_or_else(|e| panic!("{e:?}"));
        let instruments = ImageInstrument::borrow_all(std::slice::from_ref(&instrument));
        let whole = pipeline::build(&layout, &instruments, &setup, &board, &mut unobserved)
            .map_err(|e| e.to_string())?;
        let rate_hz = compiled.model.rate_hz;
        let mut proof =
            pipeline::prove(&whole, &board, rate_hz, &mut unobserved).map_err(|e| e.to_string())?;
        let (program, cores) = (proof.bytes, proof.programs.remove(0).cores);
        let modes = instrument.modes;
        let period = compiled.model.rate_hz.cycles_min(board.clock_hz);
        Ok(Image {
            kind,
            board,
            emulated,
            compiled,
            modes,
            whole,
            program,
            cores,
            keys: setup.keys,
            period,
        })
    }

    /// Words each way in a tick.
    pub fn words_each_way(&self) -> usize {
        let kernel = &self.modes.kernel;
        let of_key = kernel.inputs.len().max(kernel.outputs.len());
        of_key * self.keys.iter().sum::<u32>() as usize
    }

    pub fn name(&self) -> &str {
        &self.compiled.model.name
    }

    pub fn symbol(&self, name: &str) -> u32 {
        *self
            .program
            .symbols
            .get(name)
            .unwrap_or_else(|| panic!("{name} is there"))
    }

    /// Where a core's keys begin, by address: the number of the mode, or none behind the last key.
    pub fn places(&self, core: usize) -> HashMap<u32, Option<usize>> {
        let name = CORES[core];
        let mode = |index: usize| (self.symbol(&format!("{name}.mode.{index}")), Some(index));
        (0..self.modes.modes.len())
            .map(mode)
            .chain([(self.symbol(&format!("{name}.end")), None)])
            .collect()
    }

    /// Sections that are read where they are stored.
    pub fn is_flash(&self, memory: &str) -> bool {
        self.board
            .memory
            .iter()
            .any(|own| own.name == memory && own.kind == MemoryKind::Flash)
    }
}
