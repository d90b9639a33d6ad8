//! `--calibration` of `build` and `budget`: the table through which an image reads its sensors.

use std::path::PathBuf;

use clap::ValueHint;
use whippen_compiler::firmware::SensorTuning;
use whippen_runtime::device::Device;
use whippen_runtime::motion::Calibration;
use whippen_runtime::motion::on_board::{OnBoard, tuned_sensors};

use super::option;
use crate::exit::Failure;
use crate::say::tell;

#[derive(Debug, clap::Args)]
pub struct CalibrationArgs {
    /// Read sensors through this table from position to reading, and have them tuned on the board;
    /// for whole images
    #[arg(long, value_name = "FILE", value_hint = ValueHint::FilePath)]
    calibration: Option<PathBuf>,
    /// Where keys rest, in the calibration; its first position otherwise
    #[arg(long, value_name = "LENGTH", requires = "calibration", value_parser = option::length, allow_hyphen_values = true)]
    rest: Option<f64>,
    /// Where keys are when down, in the calibration; its last position otherwise
    #[arg(long, value_name = "LENGTH", requires = "calibration", value_parser = option::length, allow_hyphen_values = true)]
    full: Option<f64>,
    /// What the board found for each key when it was tuned: a table with offset and gain
    #[arg(long, value_name = "FILE.csv", requires = "calibration", value_hint = ValueHint::FilePath)]
    tuned: Option<PathBuf>,
}

impl CalibrationArgs {
    /// The files that are read.
    pub fn files(&self) -> impl Iterator<Item = &PathBuf> {
        self.calibration.iter().chain(&self.tuned)
    }

    /// What the firmware must know, if there is a table; how far it is from the table is told.
    pub fn tuning(&self, device: &Device) -> Result<Option<SensorTuning>, Failure> {
        let Some(path) = &self.calibration else {
            return Ok(None);
        };
        let usage = |e: whippen_runtime::files::FileError| Failure::Usage(e.to_string());
        if device.turns() {
            let why = "positions of a calibration are lengths, and this sensor measures angles";
            return Err(Failure::Usage(why.to_string()));
        }
        let table = Calibration::load(path).map_err(usage)?;
        let [first_m, last_m] = table.ends_m();
        let stops_m = [self.rest.unwrap_or(first_m), self.full.unwrap_or(last_m)];
        let on_board = OnBoard::new(&table, stops_m, device.port())
            .map_err(|why| Failure::Usage(format!("`{}`: {why}", path.display())))?;
        let mut tuning = on_board.tuning;
        if let Some(tuned) = &self.tuned {
            tuning.tuned = tuned_sensors(tuned).map_err(usage)?;
        }
        tell!(
            "the image's pieces of the calibration are at most {:.2} um off",
            1e6 * on_board.error_m
        );
        Ok(Some(tuning))
    }
}
