//! `run --hand` and `run --force`: the key is moved by a player and by the program's force, not
//! along a recording.

use std::path::{Path, PathBuf};
use std::str::FromStr;

use clap::ValueHint;
use whippen_compiler::model::Model;
use whippen_compiler::pipeline::Compiled;
use whippen_compiler::stability::Hand;
use whippen_compiler::units::{Dim, Quantity, parse_quantity};
use whippen_runtime::closed::{self, LoopStrokes, PortMover, StrokeEnergy};
use whippen_runtime::device::Device;
use whippen_runtime::engine::EngineKind;
use whippen_runtime::motion::load_force;
use whippen_runtime::plant::Player;
use whippen_runtime::session::{Recorded, Recording, Run};
use whippen_runtime::trajectory::Trajectory;

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
    /// nobody. Where several ports are driven x=0.2kg,3N*s/m,500N/m is a hand at the port x, and
    /// the option may be repeated
    #[arg(long = "hand", value_name = "[PORT=]free|MASS,DAMPING,STIFFNESS", conflicts_with_all = ["errors", "midi"])]
    hands: Vec<AtPort<Grip>>,
    /// A force on the free key, as recorded: a table with titles such as t_s,f_n; down is positive.
    /// Where several ports are driven x=FILE is a force on the port x, and the option may be
    /// repeated
    #[arg(long = "force", value_name = "[PORT=]FILE", value_hint = ValueHint::FilePath, conflicts_with_all = ["errors", "midi"])]
    forces: Vec<AtPort<PathBuf>>,
}

/// Something at a port that may be named.
#[derive(Debug, Clone)]
struct AtPort<T> {
    port: Option<String>,
    what: T,
}

impl<T: FromStr> FromStr for AtPort<T> {
    type Err = T::Err;

    fn from_str(text: &str) -> Result<AtPort<T>, T::Err> {
        let is_name = |name: &&str| {
            let mut letters = name.chars();
            letters.next().is_some_and(char::is_alphabetic)
                && letters.all(|letter| letter.is_alphanumeric() || letter == '_')
        };
        let (port, what) = match text.split_once('=') {
            Some((name, what)) if is_name(&name) => (Some(name.to_string()), what),
            _ => (None, text),
        };
        let what = what.parse()?;
        Ok(AtPort { port, what })
    }
}

impl<T> AtPort<T> {
    /// The number of the port among the senses: the only one that is driven, if none is named.
    fn number(&self, option: &str, model: &Model) -> Result<usize, String> {
        let driven = model.drives();
        let name_of = |port: &usize| model.senses.get(*port).map_or("", |sense| &sense.name);
        let found = match &self.port {
            Some(name) => driven.iter().find(|port| name_of(port) == name),
            None if driven.len() == 1 => driven.first(),
            None => None,
        };
        if let Some(port) = found {
            return Ok(*port);
        }
        let names: Vec<&str> = driven.iter().map(name_of).collect();
        let names = names.join("`, `");
        let instrument = &model.name;
        Err(match &self.port {
            _ if driven.is_empty() => {
                format!("{option}: no force of `{instrument}` acts on anything")
            }
            Some(name) => {
                format!("{option}: no force of `{instrument}` acts on `{name}`, but on `{names}`")
            }
            None => format!(
                "{option}: forces of `{instrument}` act on `{names}`; name one, such as {option} {}=..",
                name_of(&driven[0])
            ),
        })
    }
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
    /// Whether a loop is closed.
    pub fn closes(&self) -> bool {
        !self.hands.is_empty() || !self.forces.is_empty()
    }

    /// The files that are read.
    pub fn files(&self) -> impl Iterator<Item = &PathBuf> {
        self.forces.iter().map(|force| &force.what)
    }

    /// Runs in closed loops, recording as `recording` says of the columns there are; gives what is
    /// to be said of the motion and who gave how much energy.
    pub fn play(
        &self,
        compiled: &Compiled,
        device: &Device,
        kind: EngineKind,
        positions: &Positions,
        recording: impl FnOnce(Vec<Recorded>) -> Result<Recording, Failure>,
    ) -> Result<(Run, Vec<String>), Failure> {
        let model = &compiled.model;
        let Followed { movers, notes } = self.movers(model, positions).map_err(Failure::Usage)?;
        let ports: Vec<usize> = (0..movers.len()).filter(|p| movers[*p].is_loop()).collect();
        for port in &ports {
            closed::check(model, device, *port).map_err(Failure::Usage)?;
        }
        let ticks = ticks_of(&movers, positions);
        let recording = recording(closed::recorded(compiled, device, kind, &ports))?;
        let progress = Progress::new(ticks, model.rate_hz);
        let at = |ticks| progress.at(ticks);
        let closed = closed::record(compiled, device, kind, (movers, ticks), recording, at);
        progress.done();
        let closed = closed.map_err(|why| stopped(kind, why))?;
        let energies = closed.loops.iter().flat_map(energies);
        Ok((closed.run, notes.into_iter().chain(energies).collect()))
    }

    /// Who moves each port; those without a player follow the motion.
    fn movers(&self, model: &Model, positions: &Positions) -> Result<Followed, String> {
        let ports = model.senses.len().max(1);
        let mut grips: Vec<Option<Grip>> = vec![None; ports];
        let mut forces: Vec<Option<&PathBuf>> = vec![None; ports];
        for hand in &self.hands {
            let port = hand.number("--hand", model)?;
            if grips[port].replace(hand.what).is_some() {
                return Err("--hand stands twice for one port".to_string());
            }
        }
        for force in &self.forces {
            let port = force.number("--force", model)?;
            if forces[port].replace(&force.what).is_some() {
                return Err("--force stands twice for one port".to_string());
            }
        }
        let none = || Trajectory::from(Vec::new());
        let mut played = Followed {
            movers: Vec::new(),
            notes: Vec::new(),
        };
        for (port, (grip, force)) in grips.into_iter().zip(forces).enumerate() {
            let way = positions.places.get(port).cloned().unwrap_or_else(none);
            let of = match model.senses.get(port) {
                Some(sense) if ports > 1 => format!(", at `{}`", sense.name),
                _ => String::new(),
            };
            let (mover, note) = match (grip, force) {
                (None, None) => (PortMover::Motion(way), None),
                (grip, Some(path)) => forced(model, port, grip, path)?,
                (Some(grip), None) => held(model, port, grip, way)?,
            };
            played.notes.extend(note.map(|note| note + &of));
            played.movers.push(mover);
        }
        // A recording is told of where it is played.
        let is_forced = |mover: &PortMover| force_ticks(mover).is_some();
        if !played.movers.iter().all(is_forced) {
            played.notes.splice(..0, positions.notes.clone());
        }
        Ok(played)
    }
}

/// What moves the ports, and what is to be said of it.
struct Followed {
    movers: Vec<PortMover>,
    notes: Vec<String>,
}

/// A force on what is free.
fn forced(
    model: &Model,
    port: usize,
    grip: Option<Grip>,
    path: &Path,
) -> Result<(PortMover, Option<String>), String> {
    if matches!(grip, Some(Grip::Held(_))) {
        return Err("--force acts on a free key; leave --hand away".to_string());
    }
    let force =
        load_force(path, model.port_turns(port), model.rate_hz).map_err(|e| e.to_string())?;
    let note = format!("closed loop: {}, on a free key", path.display());
    let player = Player::Force(force);
    let start_m = 0.0;
    Ok((PortMover::Loop { player, start_m }, Some(note)))
}

/// A hand that leads along a way, or nobody, who lets go at half of it.
fn held(
    model: &Model,
    port: usize,
    grip: Grip,
    way: Trajectory,
) -> Result<(PortMover, Option<String>), String> {
    let hand = grip.hand(model.port_turns(port))?;
    let (player, start_m, note) = if hand == Hand::FREE {
        let most = way.greatest().unwrap_or(0.0).max(0.0);
        let note = "closed loop: nobody holds the key, let go at half of the motion's way";
        (Player::nobody(), 0.5 * most, note)
    } else {
        let start_m = way.at(0);
        let note = "closed loop: a hand leads the key along the motion";
        (Player::Hand { hand, target: way }, start_m, note)
    };
    Ok((PortMover::Loop { player, start_m }, Some(note.to_string())))
}

/// How long it lasts: as long as the motion, or as the longest force where no port follows one.
fn ticks_of(movers: &[PortMover], positions: &Positions) -> usize {
    let forces = movers.iter().map(force_ticks);
    let longest = forces.reduce(|a, b| a.zip(b).map(|(a, b)| a.max(b)));
    longest.flatten().unwrap_or(positions.ticks())
}

/// How long the force lasts that moves a port, if one does.
fn force_ticks(mover: &PortMover) -> Option<usize> {
    match mover {
        PortMover::Loop {
            player: Player::Force(force),
            ..
        } => Some(force.ticks()).filter(|ticks| *ticks > 0),
        _ => None,
    }
}

/// So many strokes are told one by one; more are told together.
const LISTED_MAX: usize = 20;

/// What each stroke took of the player; and if so, that the key gave more than it got, from a rest
/// on.
fn energies(of_loop: &LoopStrokes) -> Vec<String> {
    let LoopStrokes { port, strokes } = of_loop;
    let at = match &**port {
        "" => String::new(),
        port => format!("{port}: "),
    };
    let told = |stroke: &StrokeEnergy| {
        format!(
            "{at}stroke at {:.3} s, {:.0} ms: the player put in {:.3} mJ and got back {:.3} mJ",
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
            "{at}{} strokes: the player put in {:.3} mJ and got back {:.3} mJ",
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
        "{at}all strokes together: the key {word} {:.3} mJ",
        1e3 * size
    ));
    lines
}
