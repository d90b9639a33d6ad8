//! Where the motion of `run` comes from: a recording, or the bundled gesture.

use std::path::{Path, PathBuf};

use clap::ValueHint;
use whippen_compiler::model::Model;
use whippen_compiler::units::{Dim, shown};
use whippen_runtime::gesture;
use whippen_runtime::motion::{self, Layout, MotionOptions, Stops};
use whippen_runtime::trajectory::Trajectory;

use super::option;
use crate::exit::Failure;

/// How to read a recording.
#[derive(Debug, clap::Args)]
#[command(next_help_heading = "The motion")]
pub struct MotionArgs {
    /// The key moves as recorded here: a table with titles such as t_s,x_mm (t_s,angle_deg for a
    /// knob, t_s,x_mm,y_mm for the ports x and y), bare columns with --rate, or a channel of a WAV
    /// file with --full-scale; without it a bundled gesture
    #[arg(long, value_name = "FILE", value_hint = ValueHint::FilePath)]
    motion: Option<PathBuf>,
    /// How far the bundled gesture goes; 10 mm otherwise, or less where the instrument senses less,
    /// and for a knob as its range says
    #[arg(long, value_name = "LENGTH|ANGLE", conflicts_with = "motion", value_parser = travel)]
    travel: Option<Travel>,
    /// What a sample of full scale is in a WAV file, such as 10mm or 30deg
    #[arg(long, value_name = "LENGTH|ANGLE", requires = "motion", value_parser = travel)]
    full_scale: Option<Travel>,
    /// The channel of a WAV file, counted from 1
    #[arg(long, value_name = "N", requires = "full_scale", default_value_t = 1, value_parser = option::column)]
    channel: u32,
    /// Rows per second of bare columns
    #[arg(long, value_name = "HZ", requires = "motion", value_parser = option::frequency)]
    rate: Option<f64>,
    /// The bare column with the position, counted from 1
    #[arg(long, value_name = "N", requires = "rate", default_value_t = 1, value_parser = option::column)]
    column: u32,
    /// Table from position to reading, by which bare readings become positions; without it they are
    /// metres
    #[arg(long, value_name = "FILE", value_hint = ValueHint::FilePath, requires = "rate")]
    calibration: Option<PathBuf>,
    /// Position of the key at rest, becomes 0
    #[arg(long, value_name = "LENGTH", value_parser = option::length, allow_hyphen_values = true)]
    rest: Option<f64>,
    /// Position of the key when down, becomes --dip
    #[arg(long, value_name = "LENGTH", value_parser = option::length, allow_hyphen_values = true)]
    full: Option<f64>,
    /// Dip of the modelled key
    #[arg(long, value_name = "LENGTH", requires = "full", value_parser = option::length, default_value = "10mm")]
    dip: f64,
    /// How far readings must move before the key does, in their own unit, such as 0.0002: a dead
    /// band in front of the calibration, against noise that a flat sensor makes large
    #[arg(long, value_name = "READING", requires = "rate", value_parser = option::reading, default_value_t = 0.0, hide_default_value = true)]
    deadband: f64,
    /// Low-pass filter without delay, against noise of the recording
    #[arg(long, value_name = "FREQUENCY", requires = "motion", value_parser = option::frequency)]
    lowpass: Option<f64>,
}

/// Positions at the tick rate, and what is to be said about them.
pub struct Positions {
    /// What each port senses at every tick; where the key is for the only one.
    pub places: Vec<Trajectory>,
    /// When the first tick is (s): a recording keeps its own times.
    pub start_s: f64,
    pub notes: Vec<String>,
}

impl Positions {
    /// How many ticks it lasts.
    pub fn ticks(&self) -> usize {
        ticks_of(&self.places)
    }

    /// Where the key is: the first port.
    pub fn first(&self) -> Trajectory {
        let none = || Trajectory::from(Vec::new());
        self.places.first().cloned().unwrap_or_else(none)
    }

    /// The same for so many ticks, if it is long enough: a gesture is repeated.
    pub fn lasting(self, ticks: usize) -> Positions {
        let (before, rest) = (self.ticks(), self.notes);
        let longer = |place: Trajectory| place.lasting(ticks);
        let places: Vec<Trajectory> = self.places.into_iter().map(longer).collect();
        let now = ticks_of(&places);
        let note = if now > before {
            Some("repeated to the end")
        } else if now < ticks {
            Some("it ends before --seconds")
        } else {
            None
        };
        Positions {
            places,
            notes: rest.into_iter().chain(note.map(String::from)).collect(),
            ..self
        }
    }
}

fn ticks_of(places: &[Trajectory]) -> usize {
    places.iter().map(Trajectory::ticks).max().unwrap_or(0)
}

impl MotionArgs {
    /// Whether a recording is played.
    pub fn is_recorded(&self) -> bool {
        self.motion.is_some()
    }

    /// Reads the recording, or makes the bundled gesture.
    pub fn load(&self, model: &Model) -> Result<Positions, Failure> {
        if self.rest.is_some() != self.full.is_some() {
            let message = "`--rest` and `--full` belong together: the positions of the key at rest and when down, \
                           such as `--rest 0.88mm --full 12.7mm`";
            return Err(Failure::Usage(message.to_string()));
        }
        if !model.is_of_key() {
            return self.load_ports(model);
        }
        let (tick_rate_hz, turns) = (model.rate_hz, model.turns());
        let Some(path) = &self.motion else {
            let travel = self.travel.map(|travel| travel.of(model)).transpose()?;
            return Ok(MotionArgs::bundled(model, travel));
        };
        if turns && self.rest.is_some() {
            let message = "`--rest`, `--full` and `--dip` are lengths, and this instrument turns: record its angle";
            return Err(Failure::Usage(message.to_string()));
        }
        let layout = self.layout(path, model)?;
        let stops = self.rest.zip(self.full).map(|(rest_m, full_m)| Stops {
            rest_m,
            full_m,
            dip_m: self.dip,
        });
        let options = MotionOptions {
            layout,
            stops,
            turns,
            lowpass_hz: self.lowpass,
            dead_band: self.deadband,
            ..MotionOptions::default()
        };
        let motion = motion::load(path, &options, tick_rate_hz)
            .map_err(|e| Failure::Usage(e.to_string()))?;
        let mut notes = vec![format!(
            "{}: {} rows at {} Hz, {:.2} s",
            path.display(),
            motion.samples_read,
            motion.source_rate_hz,
            motion.duration_s()
        )];
        notes.extend(motion.notes);
        if motion.calibration_clipped > 0 {
            notes.push(format!(
                "{} readings beyond the calibration table, held at its ends",
                motion.calibration_clipped
            ));
        }
        Ok(Positions {
            places: vec![motion.positions],
            start_s: motion.start_s,
            notes,
        })
    }

    /// The same for an instrument whose ports are found by their names.
    fn load_ports(&self, model: &Model) -> Result<Positions, Failure> {
        let names = model.senses.iter().map(|sense| sense.name.as_str());
        let names: Vec<&str> = names.collect();
        let of_key = [
            ("--rate", self.rate.is_some()),
            ("--rest", self.rest.is_some()),
            ("--full", self.full.is_some()),
            ("--travel", self.travel.is_some()),
            ("--full-scale", self.full_scale.is_some()),
        ];
        if let Some((option, _)) = of_key.iter().find(|(_, is_given)| *is_given) {
            return Err(Failure::Usage(format!(
                "{option} is for a key; `{}` has the ports `{}`, whose motion is a table with a titled column for each",
                model.name,
                names.join("`, `")
            )));
        }
        let Some(path) = &self.motion else {
            return Ok(MotionArgs::bundled(model, None));
        };
        let ports = motion::wanted_ports(model);
        let motion = motion::load_ports(path, &ports, self.lowpass, model.rate_hz)
            .map_err(|e| Failure::Usage(e.to_string()))?;
        let seconds = ticks_of(&motion.places) as f64 / f64::from(model.rate_hz);
        let note = format!(
            "{}: {} rows at {} Hz, {seconds:.2} s",
            path.display(),
            motion.samples_read,
            motion.source_rate_hz
        );
        Ok(Positions {
            places: motion.places,
            start_s: motion.start_s,
            notes: std::iter::once(note).chain(motion.notes).collect(),
        })
    }

    /// Whether a motion is asked for: a recording, or how far the bundled gesture goes.
    pub fn is_given(&self) -> bool {
        self.motion.is_some() || self.travel.is_some()
    }

    /// The files that are read.
    pub fn files(&self) -> impl Iterator<Item = &PathBuf> {
        self.motion.iter().chain(&self.calibration)
    }

    /// The bundled gesture, as far (m or rad) as is wanted.
    pub fn bundled(model: &Model, travel: Option<f64>) -> Positions {
        let of = if model.turns() {
            Dim::NUMBER
        } else {
            Dim::LENGTH
        };
        let far = travel.map_or(String::new(), |travel| {
            format!(", to {}", shown(travel, of))
        });
        let gestures = match travel {
            Some(travel) => vec![gesture::bundled_to(model, travel)],
            None => gesture::bundled_ports(model),
        };
        let name = gesture::bundled_name(model);
        let place = |gesture| Trajectory::of_gesture(gesture, model.rate_hz);
        Positions {
            places: gestures.into_iter().map(place).collect(),
            start_s: 0.0,
            notes: vec![format!("the bundled {name} (synthetic){far}")],
        }
    }

    fn layout(&self, path: &Path, model: &Model) -> Result<Layout, Failure> {
        let usage = |what: &str| Err(Failure::Usage(format!("{}: {what}", path.display())));
        match (is_wav(path), self.full_scale, self.rate) {
            (true, _, Some(_)) => usage("a WAV file tells its rate itself, without --rate"),
            (true, None, _) => usage("say what a sample of full scale is: --full-scale 10mm"),
            (true, Some(full_scale), _) => Ok(Layout::Wav {
                channel: self.channel as usize,
                full_scale: full_scale.of(model).map_err(|_| {
                    let wanted = if model.turns() {
                        "an angle"
                    } else {
                        "a length"
                    };
                    Failure::Usage(format!("--full-scale: `{}` wants {wanted}", model.name))
                })?,
            }),
            (false, Some(_), _) => usage("--full-scale is for WAV files"),
            (false, None, None) => Ok(Layout::Titled),
            (false, None, Some(rate_hz)) => Ok(Layout::Raw {
                rate_hz,
                column: self.column as usize,
                calibration: self.calibration.clone(),
            }),
        }
    }
}

fn is_wav(path: &Path) -> bool {
    path.extension()
        .is_some_and(|ending| ending.eq_ignore_ascii_case("wav"))
}

/// How far a gesture goes: a length (m) or an angle (rad), above zero.
#[derive(Debug, Clone, Copy)]
struct Travel {
    end: f64,
    dim: Dim,
}

impl Travel {
    /// As far as an instrument moves, if it moves like that.
    fn of(self, model: &Model) -> Result<f64, Failure> {
        let (dim, wanted) = if model.turns() {
            (Dim::NUMBER, "turns: an angle, such as 30deg")
        } else {
            (Dim::LENGTH, "slides: a length, such as 4mm")
        };
        if self.dim == dim {
            Ok(self.end)
        } else {
            let why = format!("--travel: `{}` {wanted}, is wanted", model.name);
            Err(Failure::Usage(why))
        }
    }
}

fn travel(text: &str) -> Result<Travel, String> {
    let travel = [Dim::LENGTH, Dim::NUMBER].into_iter().find_map(|dim| {
        let end = option::quantity(text, dim, "").ok()?;
        Some(Travel { end, dim })
    });
    let possible = travel.filter(|travel| travel.end > 0.0 && travel.end.is_finite());
    possible.ok_or_else(|| "not a length or an angle above zero, such as 4mm or 30deg".to_string())
}
