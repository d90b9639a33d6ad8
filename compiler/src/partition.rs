//! Partitioning: which core has which keys, where keys do not all cost the same.
//!
//! Each core has a run of neighbouring keys, as converter words come in their order. Where every
//! program has one instrument the cores have equal parts; a key that is over belongs to core 0, or
//! to core 1, around whose keys less is done, where only that is in time. Otherwise an image that
//! is divided so is bounded first. What it proves of a key of each zone says what every other
//! division would come to, and the one is taken with which the slowest core of the slowest program
//! is fastest; of equal ones that with the most equal parts. Its image is then bounded as it
//! stands: only the choice rests on the sums here. Members of an instrument in parts are divided in
//! the same way; then those of one core become one part, where that is faster.

use whippen_board::Board;
use whippen_budget::{Bounded, Budget, NotBounded, Program, cores};
use whippen_firmware::{
    FirmwareImage, ImageError, Instrument, ProgramCode, Setup, build_divided, build_image,
};
use whippen_keyboard::{Layout, ProgramId};

use crate::pipeline;

/// Keys of a core, at most.
const KEYS_MAX: u32 = 255;

/// Why there is no image.
#[derive(Debug, Clone, PartialEq)]
pub enum BuildError {
    /// It cannot be made.
    Image(ImageError),
    /// Its keys have no bound.
    Bound(NotBounded),
}

impl std::fmt::Display for BuildError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            BuildError::Image(error) => error.fmt(f),
            BuildError::Bound(error) => write!(f, "no bound: {error}"),
        }
    }
}

impl std::error::Error for BuildError {}

/// What the zones of a program cost.
#[derive(Debug, Clone, PartialEq, Eq)]
struct Costs {
    /// Of each zone: how many keys it has, and the cycles of a key.
    keys: Vec<(u32, u64)>,
    /// Cycles around the keys of a zone.
    zone: u64,
}

/// Builds the image of a setup with its division, and divides the keys anew where that is faster.
///
/// # Errors
/// There is no image, or no bound of its keys.
pub fn build_partitioned(
    layout: &Layout,
    instruments: &[Instrument],
    setup: &Setup,
    board: &Board,
) -> Result<FirmwareImage, BuildError> {
    let equal = build_image(layout, instruments, setup, board).map_err(BuildError::Image)?;
    if setup.keys.len() == 1 {
        return with_faster_parts(equal, layout, instruments, setup, board);
    }
    if layout.split_program().is_none() {
        return with_odd_key_in_time(equal, layout, instruments, setup, board);
    }
    let costs = bound_zones(&equal, board).map_err(BuildError::Bound)?;
    let keys = fastest_division(&costs, &setup.keys);
    if keys == setup.keys {
        return Ok(equal);
    }
    let divided = Setup {
        keys,
        ..setup.clone()
    };
    build_image(layout, instruments, &divided, board).map_err(BuildError::Image)
}

/// The image of an instrument in parts, or that in which its members are divided by the cycles that
/// the first one proves, if its frame is shorter; or where those of a core are together, likewise.
fn with_faster_parts(
    first: FirmwareImage,
    layout: &Layout,
    instruments: &[Instrument],
    setup: &Setup,
    board: &Board,
) -> Result<FirmwareImage, BuildError> {
    let in_parts = instruments.iter().find_map(|instrument| instrument.parts);
    let (Some(in_parts), Some(cut)) = (in_parts, first.cut()) else {
        return Ok(first);
    };
    // What has no bound is judged by whoever wants one.
    let Ok(bounded) = bound_frame(&first, board) else {
        return Ok(first);
    };
    let cycles = |part: usize| {
        let cut = bounded.contended.cut.as_ref();
        let own = cut.and_then(|cut| cut.parts.get(part));
        own.map_or(0, |part| part.code.tick.cycles_max(1))
    };
    let mut division = in_parts.divided(board.stacks.len(), cycles);
    let known: Vec<usize> = cut.parts.iter().map(|part| part.core).collect();
    let mut best = (bounded.contended.cycles_max, first);
    let build = |instruments: &[Instrument], division: &[usize]| {
        build_divided(layout, instruments, setup, board, division).map_err(BuildError::Image)
    };
    let is_new = known != division[..known.len()];
    if is_new && !take_shorter(&mut best, build(instruments, &division)?, board) {
        division[..known.len()].copy_from_slice(&known);
    }
    let cores = &division[1..known.len()];
    // A defect of what is only tried is told where it is what is asked for.
    if let Ok(Some(together)) = pipeline::together(in_parts, cores) {
        let instruments: Vec<Instrument> = instruments
            .iter()
            .map(|own| Instrument {
                parts: own.parts.and(Some(&together)),
                ..*own
            })
            .collect();
        let division = together.on_own_cores(board.stacks.len());
        // Where it is too large for the board it stays as it is.
        if let Ok(image) = build(&instruments, &division) {
            take_shorter(&mut best, image, board);
        }
    }
    Ok(best.1)
}

/// Takes an image whose frame is shorter; says whether it did.
fn take_shorter(
    (cycles, best): &mut (u64, FirmwareImage),
    other: FirmwareImage,
    board: &Board,
) -> bool {
    let found = bound_frame(&other, board).map(|bounded| bounded.contended.cycles_max);
    let Some(found) = found.ok().filter(|found| *found < *cycles) else {
        return false;
    };
    (*cycles, *best) = (found, other);
    true
}

/// The bound of the frame of core 0.
fn bound_frame(image: &FirmwareImage, board: &Board) -> Result<Bounded, NotBounded> {
    let mut all = cores(image, &Program::of(&image.image), board, ProgramId(0))?;
    Ok(all.swap_remove(0))
}

/// The image of equal parts, or where it is late that in which core 1 has the key that is over, if
/// that one is in time.
fn with_odd_key_in_time(
    equal: FirmwareImage,
    layout: &Layout,
    instruments: &[Instrument],
    setup: &Setup,
    board: &Board,
) -> Result<FirmwareImage, BuildError> {
    let [first, second] = setup.keys[..] else {
        return Ok(equal);
    };
    // What has no bound is judged by whoever wants one.
    let in_time = |image: &FirmwareImage| fits(image, setup, board).unwrap_or(true);
    if first == second || in_time(&equal) {
        return Ok(equal);
    }
    let swapped = Setup {
        keys: vec![second, first],
        ..setup.clone()
    };
    let other = build_image(layout, instruments, &swapped, board).map_err(BuildError::Image)?;
    Ok(if in_time(&other) { other } else { equal })
}

/// Whether every program of an image is in time.
fn fits(image: &FirmwareImage, setup: &Setup, board: &Board) -> Result<bool, NotBounded> {
    let bytes = Program::of(&image.image);
    for number in 0..image.programs.len() as u32 {
        let bounded = cores(image, &bytes, board, ProgramId(number))?;
        if !Budget::of(&bounded, board.clock_hz, setup.rate_hz).fits() {
            return Ok(false);
        }
    }
    Ok(true)
}

/// What the zones of each program cost, as an image proves it.
fn bound_zones(image: &FirmwareImage, board: &Board) -> Result<Vec<Costs>, NotBounded> {
    let bytes = Program::of(&image.image);
    let of_program = |(id, code): (ProgramId, &ProgramCode)| {
        let bounded = cores(image, &bytes, board, id)?;
        let keys = code.zones.iter().map(|zone| (zone.keys.count(), 0));
        let mut costs = Costs {
            keys: keys.collect(),
            zone: 0,
        };
        for zone in bounded.iter().flat_map(|core| &core.contended.zones) {
            let cycles = &mut costs.keys[zone.of.zone.index()].1;
            *cycles = zone.tick.key_cycles_max().max(*cycles);
            costs.zone = zone.tick.frame_cycles_max().max(costs.zone);
        }
        Ok(costs)
    };
    (0..)
        .map(ProgramId)
        .zip(&image.programs)
        .map(of_program)
        .collect()
}

/// The fastest division between two cores, by what programs cost.
fn fastest_division(programs: &[Costs], equal: &[u32]) -> Vec<u32> {
    let all: u32 = equal.iter().sum();
    let slowest = |first: u32| {
        let slower_core = |costs: &Costs| costs.of(0, first).max(costs.of(first, all));
        programs.iter().map(slower_core).max().unwrap_or(0)
    };
    let possible = (1..all).filter(|first| *first <= KEYS_MAX && all - first <= KEYS_MAX);
    let best = possible.min_by_key(|&first| (slowest(first), first.abs_diff(equal[0])));
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

    fn costs(keys: &[(u32, u64)]) -> Costs {
        Costs {
            keys: keys.to_vec(),
            zone: 10,
        }
    }

    #[test]
    fn the_slowest_core_of_the_slowest_program_is_as_fast_as_can_be() {
        assert_eq!(fastest_division(&[costs(&[(9, 50)])], &[5, 4]), [5, 4]);
        // 30 keys of 50 and 20 of 100: 3500 in all.
        let split = costs(&[(30, 50), (20, 100)]);
        let one = fastest_division(std::slice::from_ref(&split), &[25, 25]);
        assert_eq!(one, [32, 18]);
        // The other program is slower with more keys on core 0.
        let with = |other| fastest_division(&[split.clone(), costs(&[(50, other)])], &[25, 25]);
        assert_eq!(with(80), [27, 23]);
        assert_eq!(with(62), [31, 19]);
    }

    #[test]
    fn no_core_has_none_or_more_than_the_firmware_takes() {
        let few = fastest_division(&[costs(&[(1, 900), (3, 1)])], &[2, 2]);
        assert_eq!(few, [1, 3]);
        let many = fastest_division(&[costs(&[(290, 1), (10, 1000)])], &[150, 150]);
        assert_eq!(many, [255, 45]);
    }
}
