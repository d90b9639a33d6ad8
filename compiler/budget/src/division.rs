//! How keys are divided between the cores where they do not all cost the same.
//!
//! Each core has a run of neighbouring keys, as converter words come in their order. Where every
//! program has one instrument the cores have equal parts. Otherwise an image that is divided so is
//! bounded first. What it proves of a key of each zone says what every other division would come
//! to, and the one is taken with which the dearest core of the dearest program is cheapest; of
//! equal ones that with the most equal parts. Its image is then bounded as it stands: only the
//! choice rests on the sums here.

use super::{NotBounded, Program, cores};
use whippen_arm::image::Board;
use whippen_firmware::{self as firmware, Setup, Whole, WholeError, whole};

/// Keys of a core, at most.
const KEYS_MAX: u32 = 255;

/// Why there is no image.
#[derive(Debug, Clone, PartialEq)]
pub enum NotDivided {
    /// It cannot be made.
    Whole(WholeError),
    /// Its keys have no bound.
    Bound(NotBounded),
}

impl std::fmt::Display for NotDivided {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            NotDivided::Whole(error) => error.fmt(f),
            NotDivided::Bound(error) => write!(f, "no bound: {error}"),
        }
    }
}

impl std::error::Error for NotDivided {}

/// What the zones of a program cost.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Costs {
    /// Of each part: how many keys it has, and the cycles of a key.
    pub keys: Vec<(u32, u64)>,
    /// Cycles around the keys of a zone.
    pub zone: u64,
}

/// Builds the image of a setup whose keys are divided equally, and divides them anew in it where
/// that is cheaper.
///
/// # Errors
/// There is no image, or no bound of its keys.
pub fn whole_divided(
    programs: &[firmware::Program],
    setup: &mut Setup,
    board: &Board,
) -> Result<Whole, NotDivided> {
    let equal = whole(programs, setup, board).map_err(NotDivided::Whole)?;
    if setup.keys.len() == 1 || programs.iter().all(|program| program.parts.len() == 1) {
        return Ok(equal);
    }
    let program = Program::of(&equal.image);
    let costs = programs.iter().enumerate().map(|(number, of)| {
        let bounded = cores(&equal.image, &program, board, &equal.keys(number), number)?;
        let mut costs = Costs {
            keys: of.parts.iter().map(|part| (part.keys, 0)).collect(),
            zone: 0,
        };
        for (core, segments) in bounded.iter().zip(&equal.programs[number]) {
            for (zone, segment) in core.contended.zones.iter().zip(segments) {
                let cycles = &mut costs.keys[segment.part].1;
                *cycles = zone.tick.key_cycles_max().max(*cycles);
                costs.zone = zone.tick.frame_cycles_max().max(costs.zone);
            }
        }
        Ok(costs)
    });
    let costs: Vec<Costs> = costs.collect::<Result<_, _>>().map_err(NotDivided::Bound)?;
    let keys = cheapest(&costs, &setup.keys);
    if keys == setup.keys {
        return Ok(equal);
    }
    setup.keys = keys;
    whole(programs, setup, board).map_err(NotDivided::Whole)
}

/// The cheapest division between two cores, by what programs cost.
pub fn cheapest(programs: &[Costs], equal: &[u32]) -> Vec<u32> {
    let all: u32 = equal.iter().sum();
    let dearest = |first: u32| {
        let of = |costs: &Costs| costs.of(0, first).max(costs.of(first, all));
        programs.iter().map(of).max().unwrap_or(0)
    };
    let possible = (1..all).filter(|first| *first <= KEYS_MAX && all - first <= KEYS_MAX);
    let best = possible.min_by_key(|&first| (dearest(first), first.abs_diff(equal[0])));
    best.map_or(equal.to_vec(), |first| vec![first, all - first])
}

impl Costs {
    /// Cycles of the keys from one up to another.
    fn of(&self, from: u32, to: u32) -> u64 {
        let mut first = 0;
        let zones = self.keys.iter().map(|&(keys, cycles)| {
            let own = (first + keys).min(to).saturating_sub(first.max(from));
            first += keys;
            if own == 0 {
                0
            } else {
                self.zone + u64::from(own) * cycles
            }
        });
        zones.sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_dearest_core_of_the_dearest_program_is_as_cheap_as_can_be() {
        let costs = |keys: &[(u32, u64)]| Costs {
            keys: keys.to_vec(),
            zone: 10,
        };
        assert_eq!(cheapest(&[costs(&[(9, 50)])], &[5, 4]), [5, 4]);
        // 30 keys of 50 and 20 of 100: 3500 in all.
        assert_eq!(
            cheapest(&[costs(&[(30, 50), (20, 100)])], &[25, 25]),
            [32, 18]
        );
        // The other program is dearer with more keys on core 0.
        assert_eq!(
            cheapest(
                &[costs(&[(30, 50), (20, 100)]), costs(&[(50, 80)])],
                &[25, 25]
            ),
            [27, 23]
        );
        assert_eq!(
            cheapest(
                &[costs(&[(30, 50), (20, 100)]), costs(&[(50, 62)])],
                &[25, 25]
            ),
            [31, 19]
        );
        // No core has none, or more than the firmware takes.
        assert_eq!(cheapest(&[costs(&[(1, 900), (3, 1)])], &[2, 2]), [1, 3]);
        assert_eq!(
            cheapest(&[costs(&[(290, 1), (10, 1000)])], &[150, 150]),
            [255, 45]
        );
    }
}
