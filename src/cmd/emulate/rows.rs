//! Rows of a table of what is on an emulated chip's pins, one every ten periods, and the hand or
//! finger that goes on with each, once the image has ticks.

use std::path::Path;

use whippen_compiler::firmware::core_block;
use whippen_compiler::rate::Rate;
use whippen_emulator::Machine;
use whippen_emulator::elf::Elf;
use whippen_runtime::motion::{self, MotionOptions};
use whippen_runtime::trajectory::Trajectory;

use crate::exit::Failure;

/// Periods of the carrier between two rows.
const PERIODS: u64 = 10;

/// See the module.
pub struct Rows {
    clock_hz: u32,
    /// Cycles from row to row.
    cycles: u64,
    done: u64,
    /// Where the image counts its ticks, if it does: while there are none its start moves things.
    ticks: Option<u32>,
    /// The row in which the hand came.
    began: Option<u64>,
    /// Where the hand is at each row (SI), if there is one.
    places: Option<Trajectory>,
}

impl Rows {
    /// Of an image on a board with so many cycles a period; a hand moves as a file says, in angles
    /// or in lengths.
    ///
    /// # Errors
    /// The file cannot be read or says no motion.
    pub fn new(
        machine: &Machine,
        elf: &Elf,
        period_cycles: u32,
        motion: Option<(&Path, bool)>,
    ) -> Result<Rows, Failure> {
        let clock_hz = machine.board().clock_hz;
        let cycles = PERIODS * u64::from(period_cycles);
        let places = motion.map(|(path, turns)| places(path, turns, clock_hz, cycles));
        let core = elf.symbols.named("core0").ok();
        Ok(Rows {
            clock_hz,
            cycles,
            done: 0,
            ticks: core.map(|core| core.address + core_block::TICK),
            began: None,
            places: places.transpose()?,
        })
    }

    /// Cycles of the chip a second.
    pub fn clock_hz(&self) -> f64 {
        self.clock_hz.into()
    }

    /// The cycle up to which the hand holds still.
    pub fn next(&self) -> u64 {
        (self.done + 1) * self.cycles
    }

    /// When the row that is due is (s).
    pub fn time_s(&self) -> f64 {
        self.next() as f64 / self.clock_hz()
    }

    /// Whether the hand has done all that it does.
    pub fn is_over(&self) -> bool {
        let (Some(places), Some(row)) = (&self.places, self.began) else {
            return false;
        };
        self.done - row >= places.ticks() as u64
    }

    /// Where the hand goes with the row that is due, if it moves; whether it has just come.
    pub fn hand(&mut self, machine: &Machine) -> Option<(f64, bool)> {
        let places = self.places.as_ref()?;
        let comes = self.began.is_none();
        if comes && !has_ticks(machine, self.ticks) {
            return None;
        }
        let began = *self.began.get_or_insert(self.done);
        let place = places.get((self.done - began) as usize)?;
        Some((place, comes))
    }

    /// The row is done.
    pub fn pass(&mut self) {
        self.done += 1;
    }
}

fn has_ticks(machine: &Machine, at: Option<u32>) -> bool {
    let Some(at) = at else {
        return true;
    };
    let mut bytes = [0; 4];
    let read = machine.bus.memory.read(at, &mut bytes);
    read.is_ok() && bytes != [0; 4]
}

/// Where the hand is at each row (SI).
fn places(path: &Path, turns: bool, clock_hz: u32, cycles: u64) -> Result<Trajectory, Failure> {
    let options = MotionOptions {
        turns,
        ..MotionOptions::default()
    };
    // Periods have 17 bits at most.
    let rate = Rate::new(clock_hz, cycles as u32)
        .ok_or_else(|| Failure::Defect("parts without a rate".into()))?;
    let motion = motion::load(path, &options, rate).map_err(|e| Failure::Usage(e.to_string()))?;
    Ok(motion.positions)
}
