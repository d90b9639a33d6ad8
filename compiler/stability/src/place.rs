//! Where a mode occurs, for who wants to run the program there.

use super::gradient::decided;
use super::pieces::Piece;
use whippen_lang::model::{Interval, Model, Node};

/// So many places of a mode are kept.
pub(super) const PLACES_MAX: usize = 4;

/// Positions, speeds and parameters that belong to a mode.
#[derive(Debug, Clone, PartialEq)]
pub struct Place {
    /// Where the first sense is (SI).
    pub x: Interval,
    /// Its speed (SI).
    pub speed: Interval,
    /// Values of the live parameters, by their numbers (SI; a bool is 0 or 1).
    pub lives: Vec<f64>,
    /// Values of the parameters that differ from key to key, by their numbers (SI).
    pub keyed: Vec<f64>,
}

impl Place {
    /// Of a piece; a parameter that it leaves open keeps its value, or goes to the nearest end.
    pub(super) fn of(model: &Model, piece: &Piece) -> Place {
        let everything = Interval {
            low: f64::NEG_INFINITY,
            high: f64::INFINITY,
        };
        let mut place = Place {
            x: model.senses.first().map_or(everything, |s| s.range),
            speed: everything,
            lives: model.lives.iter().map(|l| l.value).collect(),
            keyed: (model.keyed.iter())
                .map(|k| k.values.first().copied().unwrap_or(0.0))
                .collect(),
        };
        let within = |own: &mut f64, at: Interval| *own = own.clamp(at.low, at.high);
        for (id, node) in model.dag.nodes() {
            match node {
                Node::Sense(0) => place.x = piece.at[id],
                Node::Slope(0) => place.speed = piece.at[id],
                Node::Live(live) => within(&mut place.lives[*live as usize], piece.at[id]),
                Node::LiveBool(live) => {
                    if let Some(on) = decided(&piece.at, id) {
                        place.lives[*live as usize] = f64::from(u8::from(on));
                    }
                }
                Node::Keyed(keyed) => within(&mut place.keyed[*keyed as usize], piece.at[id]),
                _ => {}
            }
        }
        place
    }
}
