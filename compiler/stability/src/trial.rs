//! What a simulation is asked about a mode that is not proven stable, and what it answers.

use super::key::Hand;
use super::loops::PerHand;
use super::place::Place;

/// A mode to be tried out.
#[derive(Debug, Clone)]
pub struct Trial<'a> {
    /// Where it occurs.
    pub places: &'a [Place],
    /// The hands to try, each with what the linear loop does in it.
    pub hands: Vec<PerHand>,
    /// Its force falls with speed, so that it shows on a key that is drawn along.
    pub falls_with_speed: bool,
}

/// What was seen.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Seen {
    /// The key swings, and goes on.
    Rings(Oscillation),
    /// It comes to rest from every push.
    Quiet,
    /// Nobody looked, or it would have taken too long.
    NotTried,
}

/// A swing that lasts.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Oscillation {
    /// The place of the trial, by its number.
    pub place: usize,
    /// How often (Hz).
    pub hz: f64,
    /// Half of the way from one end to the other (SI).
    pub amplitude: f64,
    /// It still grew when the run ended.
    pub grows: bool,
    /// Where the key was when it was pushed (SI).
    pub x: f64,
    /// The speed that the push gave it (SI); 0 where it was led.
    pub push: f64,
    /// How fast the hand led it (SI); 0 where it stood.
    pub speed: f64,
    /// The steady force that held it there, besides a hand's spring (N or N*m, down).
    pub force: f64,
    /// Who held it.
    pub hand: Hand,
}
