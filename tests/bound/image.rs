//! An instrument's image and its bounds.

use std::collections::HashMap;

use whippen_compiler::budget::{Bounded, Program, cores};
use whippen_compiler::firmware::{self, CORES, Whole, whole};
use whippen_compiler::image::{Board, MemoryKind};
use whippen_compiler::modes::{INSTRUCTIONS, Modes, specialise};
use whippen_compiler::pipeline::{Compiled, compile};
use whippen_isa::timing::Core;
use whippen_runtime::image::{midi, setup};
use whippen_runtime::{board, device::Device};

use crate::common;

pub struct Image {
    pub compiled: Compiled,
    pub modes: Modes,
    pub whole: Whole,
    pub program: Program,
    pub cores: [Bounded; 2],
    pub keys: [u32; 2],
    /// Cycles between two ticks.
    pub period: u64,
}

/// Every bundled instrument as it is built, for its device; without those whose device has no firmware because nothing is
/// known of its motor.
pub fn instruments() -> Vec<Compiled> {
    let built = |observed: Compiled| {
        let scales = Device::of(&observed.model).scales();
        compile(observed.model, scales, false).unwrap_or_else(|e| panic!("{e:?}"))
    };
    let has_motor = |compiled: &Compiled| Device::of(&compiled.model).motor.is_some();
    let (with, without): (Vec<Compiled>, Vec<Compiled>) = common::all().into_iter().partition(has_motor);
    without.iter().for_each(|compiled| println!("{}: no motor, so no image", compiled.model.name));
    with.into_iter().map(built).collect()
}

pub fn rp2350() -> Board {
    board::bundled("rp2350").expect("it is bundled")
}

impl Image {
    pub fn new(compiled: Compiled, keys: u32) -> Image {
        let modes = specialise(&compiled.lowered.kernel, INSTRUCTIONS);
        let setup = setup(&compiled, &Device::of(&compiled.model), keys, 21).expect("a setup");
        let board = rp2350();
        let midi = midi(&compiled);
        let programs = [firmware::Program { modes: &modes, places: &[], midi: &midi }];
        let whole = whole(&programs, &setup, &board).unwrap_or_else(|e| panic!("{e}"));
        let program = Program::of(&whole.image);
        let cores = cores(&whole.image, &program, &Core::cortex_m33(), setup.keys, 0).unwrap_or_else(|e| panic!("{e}"));
        let period = u64::from(board.clock_hz / compiled.model.rate_hz);
        Image { compiled, modes, whole, program, cores, keys: setup.keys, period }
    }

    pub fn name(&self) -> &str {
        &self.compiled.model.name
    }

    pub fn symbol(&self, name: &str) -> u32 {
        *self.program.symbols.get(name).unwrap_or_else(|| panic!("{name} is there"))
    }

    /// Where a core's keys begin, by address: the number of the mode, or none behind the last key.
    pub fn places(&self, core: usize) -> HashMap<u32, Option<usize>> {
        let name = CORES[core];
        let mode = |index: usize| (self.symbol(&format!("{name}.mode.{index}")), Some(index));
        (0..self.modes.modes.len()).map(mode).chain([(self.symbol(&format!("{name}.end")), None)]).collect()
    }

    /// Sections that are read where they are stored.
    pub fn is_flash(&self, memory: &str) -> bool {
        rp2350().memory.iter().any(|own| own.name == memory && own.kind == MemoryKind::Flash)
    }
}
