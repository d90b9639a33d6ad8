//! `run --hand` and `run --force`: the key is moved by a player and by the program's force, not
//! along a recording.

use std::path::PathBuf;
use std::str::FromStr;

use clap::ValueHint;
use whippen_compiler::model::Model;
use whippen_compiler::pipeline::Compiled;
use whippen_compiler::stability::Hand;
use whippen_compiler::units::{Dim, Quantity, parse_quantity};
use whippen_runtime::closed::{self, StrokeEnergy, Strokes};
use whippen_runtime::device::Device;
use whippen_runtime::engine::EngineKind;
use whippen_runtime::motion::load_force;
use whippen_runtime::plant::Player;
use whippen_runtime::session::{Recorded, Recording, Run};

use super::motion::Positions;
use super::progress::Progress;
use super::run::stopped;
use crate::exit::Failure;

/// Who moves the key.
#[derive(Debug, clap::Args)]
#[command(next_help_heading = "The player")]
pub struct HandArgs {
    /// Close the loop: the program's force moves the key of the device, and a hand of this mass,
    /// damping and stiffness leads it along the motion, such as 0.2kg,3N*s/m,500N/m; `free` for
    /// nobody
    #[arg(long, value_name = "free|MASS,DAMPING,STIFFNESS", conflicts_with_all = ["errors", "midi"])]
    hand: Option<Grip>,
    /// A force on the free key, as recorded: a table with titles such as t_s,f_n; down is positive
    #[arg(long, value_name = "FILE", value_hint = ValueHint::FilePath, conflicts_with_all = ["errors", "midi", "motion"])]
    force: Option<PathBuf>,
}

/// What `--hand` says, with the dimensions as they were given.
#[derive(Debug, Clone, Copy)]
pub enum Grip {
    Free,
    Held([(f64, Dim); 3]),
}

impl FromStr for Grip {
    type Err = String;

    fn from_str(text: &str) -> Result<Grip, String> {
        if text == "free" {
            return Ok(Grip::Free);
        }
        let parts: Vec<&str> = text.split(',').collect();
        let [mass, damping, stiffness] = parts[..] else {
            return Err(
                "a hand is `free`, or its mass, damping and stiffness, such as 0.2kg,3N*s/m,500N/m"
                    .to_string(),
            );
        };
        let part = |text: &str| match parse_quantity(text) {
            Ok(Quantity::Real { value, dim }) if value >= 0.0 => Ok((value, dim)),
            Ok(_) => Err(format!("`{text}` is below zero or no quantity")),
            Err(error) => Err(error.to_string()),
        };
        Ok(Grip::Held([part(mass)?, part(damping)?, part(stiffness)?]))
    }
}

impl Grip {
    /// The hand, if its dimensions are those of what it moves.
    pub fn hand(self, turns: bool) -> Result<Hand, String> {
        let Grip::Held([mass, damping, stiffness]) = self else {
            return Ok(Hand::FREE);
        };
        let dims = if turns {
            [Dim::INERTIA, Dim::TORQUE.mul(Dim::TIME), Dim::TORQUE]
        } else {
            let per_length = Dim::FORCE.div(Dim::LENGTH);
            [Dim::MASS, per_length.mul(Dim::TIME), per_length]
        };
        if [mass.1, damping.1, stiffness.1] != dims {
            let units = dims.map(|dim| dim.unit()).join(", ");
            return Err(format!(
                "--hand: mass, damping and stiffness are numbers of {units}"
            ));
        }
        Ok(Hand {
            mass: mass.0,
            damping: damping.0,
            stiffness: stiffness.0,
        })
    }
}

impl HandArgs {
    /// Whether the loop is closed.
    pub fn closes(&self) -> bool {
        self.hand.is_some() || self.force.is_some()
    }

    /// The files that are read.
    pub fn files(&self) -> impl Iterator<Item = &PathBuf> {
        self.force.iter()
    }

    /// Runs in a closed loop, recording as `recording` says of the columns there are; gives what is
    /// to be said of the motion and who gave how much energy. Nobody lets the key go at half of the
    /// motion's way.
    pub fn play(
        &self,
        compiled: &Compiled,
        device: &Device,
        kind: EngineKind,
        positions: &Positions,
        recording: impl FnOnce(Vec<Recorded>) -> Result<Recording, Failure>,
    ) -> Result<(Run, Vec<String>), Failure> {
        let model = &compiled.model;
        if model.senses.len() > 1 {
            let why = "--hand and --force close the loop of one port; move several with --motion";
            return Err(Failure::Usage(format!(
                "{why} (`{}` senses {})",
                model.name,
                model.senses.len()
            )));
        }
        let grip = self.hand.unwrap_or(Grip::Free);
        if self.force.is_some() && !matches!(grip, Grip::Free) {
            return Err(Failure::Usage(
                "--force acts on a free key; leave --hand away".to_string(),
            ));
        }
        let hand = grip.hand(model.turns()).map_err(Failure::Usage)?;
        let (player, start_m, note, ticks) = self.player(model, hand, positions)?;
        if device.port().mechanics.is_none() {
            let why = "does not say how its key moves: add `[mechanics]` to its file";
            return Err(Failure::Usage(format!(
                "the device `{}` {why}",
                device.name
            )));
        }
        let recording = recording(closed::recorded(compiled, device, kind))?;
        let progress = Progress::new(ticks, model.rate_hz);
        let from = (player, start_m);
        let at = |ticks| progress.at(ticks);
        let closed = closed::record(compiled, device, kind, from, ticks, recording, at);
        progress.done();
        let closed = closed.map_err(|why| stopped(kind, why))?;
        let mut notes = positions.notes.clone();
        if self.force.is_some() {
            notes.clear();
        }
        notes.push(note);
        notes.extend(energies(&closed.strokes));
        Ok((closed.run, notes))
    }

    fn player(
        &self,
        model: &Model,
        hand: Hand,
        positions: &Positions,
    ) -> Result<(Player, f64, String, usize), Failure> {
        if let Some(path) = &self.force {
            let force = load_force(path, model.turns(), model.rate_hz)
                .map_err(|e| Failure::Usage(e.to_string()))?;
            let ticks = force.ticks();
            return Ok((
                Player::Force(force),
                0.0,
                format!("closed loop: {}, on a free key", path.display()),
                ticks,
            ));
        }
        let target = positions.first();
        let ticks = target.ticks();
        if hand == Hand::FREE {
            let most = target.greatest().unwrap_or(0.0).max(0.0);
            let note =
                "closed loop: nobody holds the key, let go at half of the motion's way".to_string();
            return Ok((Player::nobody(), 0.5 * most, note, ticks));
        }
        let start_m = target.at(0);
        let note = "closed loop: a hand leads the key along the motion".to_string();
        Ok((Player::Hand { hand, target }, start_m, note, ticks))
    }
}

/// So many strokes are told one by one; more are told together.
const LISTED_MAX: usize = 20;

/// What each stroke took of the player; and if so, that the key gave more than it got, from a rest
/// on.
fn energies(strokes: &Strokes) -> Vec<String> {
    let told = |stroke: &StrokeEnergy| {
        format!(
            "stroke at {:.3} s, {:.0} ms: the player put in {:.3} mJ and got back {:.3} mJ",
            stroke.start_s,
            1e3 * stroke.seconds,
            1e3 * stroke.energy.given_j,
            1e3 * stroke.energy.returned_j
        )
    };
    if strokes.count == 0 {
        return Vec::new();
    }
    let mut lines: Vec<String> = if strokes.count <= LISTED_MAX {
        strokes.first.iter().map(told).collect()
    } else {
        vec![format!(
            "{} strokes: the player put in {:.3} mJ and got back {:.3} mJ",
            strokes.count,
            1e3 * strokes.all.given_j,
            1e3 * strokes.all.returned_j
        )]
    };
    let kept_j = strokes.all.kept_j();
    let (word, size) = if kept_j < 0.0 {
        ("gave the player", -kept_j)
    } else {
        ("kept", kept_j)
    };
    lines.push(format!(
        "all strokes together: the key {word} {:.3} mJ",
        1e3 * size
    ));
    lines
}
