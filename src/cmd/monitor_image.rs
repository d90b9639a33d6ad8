//! `--monitor` of `build` and `budget`: an image that answers `whippen monitor` at its serial port.

use whippen_compiler::board::Board;
use whippen_compiler::firmware::Monitor;
use whippen_isa::Arch;

use super::option;
use crate::exit::Failure;

#[derive(Debug, clap::Args)]
pub struct MonitorImageArgs {
    /// Answer `whippen monitor` at the serial port, in place of MIDI; for whole images
    #[arg(long)]
    monitor: bool,
    /// Bits per second of the monitor's serial port [default: 3000000; 115200 where the port holds
    /// a single byte, as on stm32f4]
    #[arg(long, value_name = "BAUD", allow_negative_numbers = true, value_parser = option::baud)]
    baud: Option<u32>,
}

/// Fast, and what usual bridges to USB have.
const BAUD: u32 = 3_000_000;
/// A port that holds a single byte, which must take longer than a tick.
const BAUD_WITHOUT_QUEUE: u32 = 115_200;

impl MonitorImageArgs {
    /// What is asked for is an image with the monitor, whatever is said.
    pub fn insist(&mut self) {
        self.monitor = true;
    }

    /// Bits per second that were asked for, or on a board of this architecture.
    pub fn baud_or_fast(&self) -> u32 {
        self.baud.unwrap_or(BAUD)
    }

    /// Bits per second on a board.
    fn baud(&self, board: &Board) -> u32 {
        let usual = match board.arch {
            Arch::V7EM => BAUD_WITHOUT_QUEUE,
            Arch::V6M | Arch::V8M => BAUD,
        };
        self.baud.unwrap_or(usual)
    }

    /// What is at the serial port of an image, if it is the monitor.
    pub fn of_image(&self, board: &Board) -> Result<Option<Monitor>, Failure> {
        if !self.monitor && self.baud.is_some() {
            let why = "--baud is for the serial port of --monitor; that of MIDI has 31250";
            return Err(Failure::Usage(why.to_string()));
        }
        let baud = self.baud(board);
        Ok(self.monitor.then_some(Monitor { baud }))
    }
}
