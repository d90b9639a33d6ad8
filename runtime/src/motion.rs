//! Recorded motions: from a file to key positions at the tick rate.
//!
//! ```text
//!   t_s,x_mm table ---------> even grid --.
//!                                         +--> rest .. full      --> low-pass   --> resample --> Motion
//!   bare column --> calibration table ----'    becomes 0 .. dip      (no delay)     (no delay)
//! ```
//!
//! Positions are metres, 0 at rest and positive down. Files are read line by line; whatever is
//! held, interpolated or moved on the way is counted in the [`Motion`] or said in its notes. Only
//! portable arithmetic is used: the same file gives the same bits on every machine.
//!
//! Forces on the key are read in the same way ([`load_force`]).
//!
//! Not here: what a sensor makes of a position (`device`), synthetic motions (`gesture`).

mod calibration;
mod errors;
mod lowpass;
pub mod on_board;
mod pchip;
mod raw;
mod resample;
pub(crate) mod table;
mod titled;
pub mod tune;
mod uniform;
mod wav;

#[cfg(test)]
mod recordings;
#[cfg(test)]
mod tests;

use std::path::{Path, PathBuf};
use whippen_compiler::rate::Rate;

use crate::files::FileError;
pub use calibration::Calibration;
pub use errors::{Disturbance, Unseen};
pub use pchip::Pchip;
pub use resample::Resampled;
use resample::resampled_len;

use crate::trajectory::Trajectory;
pub use titled::{WantedPort, wanted_ports};
use uniform::Uniform;
use whippen_compiler::units::Unit;

/// The most ticks a motion may last: about seven hours at 44.1 kHz.
const TICKS_MAX: usize = 1 << 30;

/// The most rows of a recording, which are held: nine hours at 2 kHz, half an hour at 44.1 kHz.
const ROWS_MAX: usize = 1 << 26;

/// Sources are at most so many times as fast as the tick.
const OVERSAMPLING_MAX: f64 = 1000.0;

/// How the numbers stand in the file.
#[derive(Debug, Clone, PartialEq, Default)]
pub enum Layout {
    /// A table whose titles name time and position with their units, such as `t_s,x_mm`.
    #[default]
    Titled,
    /// Bare columns of numbers.
    Raw {
        /// Rows per second.
        rate_hz: f64,
        /// The column of the positions, counted from 1.
        column: usize,
        /// A table that turns readings into positions; without it they are metres.
        calibration: Option<PathBuf>,
    },
    /// A channel of a WAV file.
    Wav {
        /// Which, counted from 1.
        channel: usize,
        /// What a sample of full scale is (SI).
        full_scale: f64,
    },
}

/// What the recorded key reads at its stops, and the dip it shall have.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stops {
    /// Reading at rest (m); becomes 0.
    pub rest_m: f64,
    /// Reading at full dip (m); becomes `dip_m`.
    pub full_m: f64,
    /// The dip after mapping (m).
    pub dip_m: f64,
}

/// How to read a motion.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct MotionOptions {
    /// How the numbers stand in the file.
    pub layout: Layout,
    /// A linear map from what was recorded to the dip of the model; without it positions are taken
    /// as they are.
    pub stops: Option<Stops>,
    /// What the sensor does not show of the first way, against its flat end.
    pub unseen: Option<Unseen>,
    /// Noise and scale of a copy.
    pub disturbance: Option<Disturbance>,
    /// The positions of a table are angles (rad), for an instrument that turns, and not lengths.
    pub turns: bool,
    /// Corner of a low-pass filter without delay (Hz), below half the rate of the file.
    pub lowpass_hz: Option<f64>,
    /// How far bare readings must move before the key does, in their own unit: half the width of a
    /// dead band in front of the calibration, where noise is as large as it looks; 0 for none.
    pub dead_band: f64,
}

/// Positions of a key at the tick rate, and how they came about.
#[derive(Debug, Clone, PartialEq)]
pub struct Motion {
    /// Ticks per second.
    pub rate_hz: Rate,
    /// The position at each tick (m).
    pub positions: Trajectory,
    /// When the first was recorded (s).
    pub start_s: f64,
    /// Rows read from the file.
    pub samples_read: usize,
    /// Rows per second of the file, or of the grid its rows were interpolated onto.
    pub source_rate_hz: f64,
    /// Readings beyond the ends of the calibration table, held there.
    pub calibration_clipped: usize,
    /// What else one should know about it, in sentences.
    pub notes: Vec<String>,
}

impl Motion {
    /// How long it lasts (s).
    pub fn duration_s(&self) -> f64 {
        self.positions.ticks() as f64 / f64::from(self.rate_hz)
    }
}

/// Reads a motion from a file and brings it to the tick rate.
///
/// # Errors
/// The file cannot be read or does not hold what the options say (with line and column), or an
/// option makes no sense for it.
pub fn load(path: &Path, options: &MotionOptions, tick_rate_hz: Rate) -> Result<Motion, FileError> {
    let mut source = read(path, options)?;
    let error = |message: String| FileError::new(path, message);
    if let Some(stops) = options.stops {
        map_stops(&mut source.positions_m, stops).map_err(error)?;
    }
    if let Some(unseen) = options.unseen {
        let dip_m = options.stops.map_or(10e-3, |stops| stops.dip_m);
        unseen.restore(&mut source.positions_m, dip_m);
    }
    if let Some(disturbance) = options.disturbance {
        disturbance.disturb(&mut source.positions_m);
    }
    if let Some(corner_hz) = options.lowpass_hz {
        let smooth = smoothed(&source.positions_m, source.rate_hz, corner_hz);
        source.positions_m = smooth.map_err(error)?;
    }
    check_rates(source.positions_m.len(), source.rate_hz, tick_rate_hz).map_err(error)?;
    if !source.positions_m.iter().all(|x| x.abs() <= FARTHEST_M) {
        return Err(error(format!(
            "positions of more than {FARTHEST_M} m are no key's; check the column and its unit"
        )));
    }
    Ok(Motion {
        rate_hz: tick_rate_hz,
        positions: Resampled::new(source.positions_m, source.rate_hz, f64::from(tick_rate_hz))
            .into(),
        start_s: source.start_s,
        samples_read: source.samples_read,
        source_rate_hz: source.rate_hz,
        calibration_clipped: source.calibration_clipped,
        notes: source.notes,
    })
}

/// What each of several ports senses at the tick rate, and how it came about.
#[derive(Debug, Clone, PartialEq)]
pub struct PortMotion {
    /// By port, all of the same length.
    pub places: Vec<Trajectory>,
    /// When the first was recorded (s).
    pub start_s: f64,
    /// Rows read from the file.
    pub samples_read: usize,
    /// Rows per second of the file, or of the grid its rows were interpolated onto.
    pub source_rate_hz: f64,
    /// What else one should know about it, in sentences.
    pub notes: Vec<String>,
}

/// Reads the motion of several ports from a table such as `t_s,x_mm,y_mm` and brings it to the tick
/// rate.
///
/// # Errors
/// As [`load`]; ports without a column are named.
pub fn load_ports(
    path: &Path,
    ports: &[WantedPort],
    lowpass_hz: Option<f64>,
    tick_rate_hz: Rate,
) -> Result<PortMotion, FileError> {
    let table = titled::read_ports(path, ports, ROWS_MAX)?;
    let error = |message: String| FileError::new(path, message);
    let (mut places, mut notes) = (Vec::new(), Vec::new());
    let mut source_rate_hz = 0.0;
    for Uniform {
        rate_hz,
        samples,
        note,
    } in table.grids
    {
        check_rates(samples.len(), rate_hz, tick_rate_hz).map_err(error)?;
        let samples = match lowpass_hz {
            Some(corner_hz) => smoothed(&samples, rate_hz, corner_hz).map_err(error)?,
            None => samples,
        };
        places.push(Resampled::new(samples, rate_hz, f64::from(tick_rate_hz)).into());
        source_rate_hz = rate_hz;
        // The times are the same for all columns, and so is what is to be said of them.
        notes = note.into_iter().collect();
    }
    Ok(PortMotion {
        places,
        start_s: table.start_s,
        samples_read: table.rows,
        source_rate_hz,
        notes,
    })
}

/// Samples without what is above a frequency.
fn smoothed(samples: &[f64], rate_hz: f64, corner_hz: f64) -> Result<Vec<f64>, String> {
    lowpass::lowpass(samples, rate_hz, corner_hz).ok_or_else(|| {
        let limit_hz = rate_hz / 2.0;
        format!(
            "at {rate_hz} rows a second a low-pass must lie below {limit_hz} Hz, \
             and {corner_hz} Hz does not"
        )
    })
}

/// Columns of a table on an even grid.
pub(crate) struct TableColumns {
    /// Rows a second of the grid.
    pub rate_hz: f64,
    /// The values of each column (SI).
    pub values: Vec<Vec<f64>>,
}

/// Reads the columns of a table that are found by their titles: number and unit of each.
///
/// # Errors
/// As [`load`]; what `find` says.
pub(crate) fn load_columns(
    path: &Path,
    find: impl FnOnce(&[String]) -> Result<Vec<(usize, Unit)>, String>,
) -> Result<TableColumns, FileError> {
    let table = titled::read_columns(path, find, ROWS_MAX)?;
    Ok(TableColumns {
        rate_hz: table.grids.first().map_or(0.0, |grid| grid.rate_hz),
        values: table.grids.into_iter().map(|grid| grid.samples).collect(),
    })
}

/// Reads a force on the key from a table such as `t_s,f_n` (or `t_s,torque_n_m` where it `turns`)
/// and brings it to the tick rate (N or N*m).
///
/// # Errors
/// As [`load`].
pub fn load_force(path: &Path, turns: bool, tick_rate_hz: Rate) -> Result<Trajectory, FileError> {
    let grid = titled::read(path, titled::FORCE[usize::from(turns)], ROWS_MAX)?.grid;
    check_rates(grid.samples.len(), grid.rate_hz, tick_rate_hz)
        .map_err(|message| FileError::new(path, message))?;
    Ok(Resampled::new(grid.samples, grid.rate_hz, f64::from(tick_rate_hz)).into())
}

/// Readings beyond this are mistakes (m or rad), and would overflow what computes with them.
const FARTHEST_M: f64 = 1e6;

/// A file at its own rate.
struct Source {
    rate_hz: f64,
    start_s: f64,
    positions_m: Vec<f64>,
    samples_read: usize,
    calibration_clipped: usize,
    notes: Vec<String>,
}

fn read(path: &Path, options: &MotionOptions) -> Result<Source, FileError> {
    match &options.layout {
        Layout::Titled => {
            let wanted = titled::POSITION[usize::from(options.turns)];
            let titled::Titled {
                rows,
                start_s,
                grid,
            } = titled::read(path, wanted, ROWS_MAX)?;
            let notes = grid.note.into_iter().collect();
            Ok(Source {
                rate_hz: grid.rate_hz,
                positions_m: grid.samples,
                start_s,
                samples_read: rows,
                calibration_clipped: 0,
                notes,
            })
        }
        Layout::Wav {
            channel,
            full_scale,
        } => read_wav(path, *channel, *full_scale),
        Layout::Raw {
            rate_hz,
            column,
            calibration,
        } => {
            if !(rate_hz.is_finite() && *rate_hz > 0.0) {
                return Err(FileError::new(
                    path,
                    format!("a rate of {rate_hz} Hz makes no sense"),
                ));
            }
            let calibration = calibration.as_deref().map(Calibration::load).transpose()?;
            let raw = raw::read(path, *column, calibration.as_ref(), options.dead_band)?;
            let unit = if options.turns { "radians" } else { "metres" };
            let taken = calibration
                .is_none()
                .then(|| format!("bare numbers are taken as {unit}, as there is no calibration"));
            Ok(Source {
                rate_hz: *rate_hz,
                start_s: 0.0,
                samples_read: raw.positions_m.len(),
                positions_m: raw.positions_m,
                calibration_clipped: raw.clipped,
                notes: taken.into_iter().collect(),
            })
        }
    }
}

fn read_wav(path: &Path, channel: usize, full_scale: f64) -> Result<Source, FileError> {
    let wav = wav::read(path, channel, full_scale)?;
    Ok(Source {
        rate_hz: wav.rate_hz,
        start_s: 0.0,
        samples_read: wav.positions.len(),
        positions_m: wav.positions,
        calibration_clipped: 0,
        notes: Vec::new(),
    })
}

fn map_stops(positions_m: &mut [f64], stops: Stops) -> Result<(), String> {
    let slope = stops.dip_m / (stops.full_m - stops.rest_m);
    if !(slope.is_finite() && stops.rest_m.is_finite()) || slope == 0.0 {
        return Err(
            "the readings at rest and at full dip must differ, and the dip must not be zero".into(),
        );
    }
    for x in positions_m {
        *x = (*x - stops.rest_m) * slope;
    }
    Ok(())
}

fn check_rates(len: usize, rate_hz: f64, tick_rate_hz: Rate) -> Result<(), String> {
    let tick_hz = f64::from(tick_rate_hz);
    if rate_hz > tick_hz * OVERSAMPLING_MAX {
        return Err(format!(
            "a rate of {rate_hz} Hz is too fast for ticks at {tick_rate_hz} Hz"
        ));
    }
    let ticks = resampled_len(len, rate_hz, tick_hz);
    if ticks > TICKS_MAX as f64 {
        return Err(format!(
            "it lasts {:e} s, which is more than {TICKS_MAX} ticks at {tick_rate_hz} Hz",
            ticks / tick_hz
        ));
    }
    Ok(())
}
