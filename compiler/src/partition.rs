//! Partitioning: which core has which keys, where keys do not all cost the same.
//!
//! Each core has a run of neighbouring keys, as converter words come in their order. Where every
//! program has one instrument the cores have equal parts; a key that is over belongs to core 0, or
//! to core 1, around whose keys less is done, where only that is in time. Otherwise an image that
//! is divided so is bounded first. What it proves of a key of each zone says what every other
//! division would come to, and the one is taken with which the slowest core of the slowest program
//! is fastest; of equal ones that with the most equal parts. Its image is then bounded as it
//! stands: only the choice rests on the sums here. On a board with columns of converters each core
//! has whole columns.
//!
//! Of an instrument in parts the members of one core become one part where that is faster. What is
//! proven of a division says what every other one would come to; the fastest is made and bounded,
//! until that is one that is known. So without what is early on core 1 and with it, and then with
//! what is heard there as well.

mod known_time;
mod odd_key;

use std::collections::BTreeSet;

use whippen_board::{Board, COLUMN_KEYS, Columns};
use whippen_budget::{Bounded, NotBounded, Program, TickHandlerBound, cores};
use whippen_firmware::{
    FirmwareImage, ImageError, InParts, Instrument, PartCode, ProgramCode, Role, Setup,
    build_divided, build_image,
};
use whippen_keyboard::{Layout, ProgramId};
use whippen_parts::{Beside, EARLY_CYCLES_MIN};

pub use self::known_time::{KnownTime, Partitioned};
use self::odd_key::with_odd_key_in_time;
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
) -> Result<Partitioned, BuildError> {
    let in_columns = in_whole_columns(setup, board);
    let setup = in_columns.as_ref().unwrap_or(setup);
    if let Some(in_parts) = sound_apart(instruments) {
        return with_sound_apart(in_parts, layout, instruments, setup, board).map(Into::into);
    }
    let equal = build_image(layout, instruments, setup, board).map_err(BuildError::Image)?;
    if setup.keys.len() == 1 {
        return with_faster_parts(equal, layout, instruments, setup, board).map(Into::into);
    }
    if layout.split_program().is_none() {
        return with_odd_key_in_time(equal, layout, instruments, setup, board);
    }
    let bytes = Program::of(&equal.image);
    let bounded = bound_programs(&equal, &bytes, board).map_err(BuildError::Bound)?;
    let costs = costs_of_zones(&equal, &bounded);
    let step = board.columns.as_ref().map_or(1, |_| COLUMN_KEYS);
    let keys = fastest_division(&costs, &setup.keys, step);
    if keys == setup.keys {
        return Ok(Partitioned {
            image: equal,
            known: KnownTime::Bounded(bounded),
        });
    }
    let divided = Setup {
        keys,
        ..setup.clone()
    };
    let image = build_image(layout, instruments, &divided, board).map_err(BuildError::Image)?;
    Ok(image.into())
}

/// A setup whose cores have whole columns, where the board has columns and more than one core.
fn in_whole_columns(setup: &Setup, board: &Board) -> Option<Setup> {
    let cores = setup.keys.len() as u32;
    board.columns.as_ref().filter(|_| cores > 1)?;
    Some(Setup {
        keys: Columns::divided(setup.keys.iter().sum(), cores),
        ..setup.clone()
    })
}

/// The only instrument, where it has no members and only what is heard of it is apart.
fn sound_apart<'a>(instruments: &[Instrument<'a>]) -> Option<&'a InParts> {
    let mut in_parts = instruments.iter().filter_map(|own| own.parts);
    in_parts.find(|in_parts| !in_parts.parts.has_members())
}

/// The image of an instrument in one piece, or with what is heard of it on core 1, if that is
/// proven to be faster.
fn with_sound_apart(
    in_parts: &InParts,
    layout: &Layout,
    instruments: &[Instrument],
    setup: &Setup,
    board: &Board,
) -> Result<FirmwareImage, BuildError> {
    let pieces: Vec<Instrument> = instruments
        .iter()
        .map(|own| Instrument {
            parts: None,
            ..*own
        })
        .collect();
    let whole = build_image(layout, &pieces, setup, board).map_err(BuildError::Image)?;
    let cores = board.stacks.len();
    if cores < 2 || setup.keys != [1] {
        return Ok(whole);
    }
    let division = in_parts.on_own_cores(cores);
    let apart = build_divided(layout, instruments, setup, board, &division);
    let cycles_max = |image: &FirmwareImage| {
        let bounded = bound_frame(image, board).ok()?;
        Some(bounded.contended.cycles_max)
    };
    // What has no bound is judged by whoever wants one.
    let is_faster = |apart: &FirmwareImage| match [apart, &whole].map(cycles_max) {
        [Some(apart), Some(whole)] => apart < whole,
        [apart, _] => apart.is_some(),
    };
    Ok(apart.ok().filter(is_faster).unwrap_or(whole))
}

/// The image of an instrument in parts, or a faster one: with the members of a core together, with
/// or without what is early on core 1, and other divisions, as long as what is proven says that
/// another one should be faster.
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
    let of_members = |part: &&PartCode| matches!(part.role, Role::Member(_));
    let members = cut.parts.iter().filter(of_members);
    let division: Vec<usize> = members.map(|part| part.core).collect();
    let makes = DividedParts {
        in_parts,
        layout,
        instruments,
        setup,
        board,
    };
    // What has no bound is judged by whoever wants one.
    let Some(apart) = Divided::of(first.clone(), division, board) else {
        return Ok(first);
    };
    let mut best = makes.fastest(apart.clone(), Beside::default());
    if board.stacks.len() > 1 {
        let early = Beside {
            early_cycles_min: Some(EARLY_CYCLES_MIN),
            sound: false,
        };
        let is_early = best.take_shorter(Some(makes.fastest(apart.clone(), early)));
        let kept = if is_early { early } else { Beside::default() };
        best.take_shorter(makes.fastest_with_sound(&apart, &best, kept));
    }
    Ok(best.image)
}

/// Divisions of an instrument in parts that are made and bounded, at most.
const DIVISIONS_MAX: usize = 4;

/// What makes images of an instrument in parts. One that is only tried is none where it has a
/// defect or is too large for the board.
struct DividedParts<'a> {
    in_parts: &'a InParts,
    layout: &'a Layout,
    instruments: &'a [Instrument<'a>],
    setup: &'a Setup,
    board: &'a Board,
}

impl DividedParts<'_> {
    /// The fastest of the divisions to which what is proven leads, from one with each member apart.
    fn fastest(&self, apart: Divided, beside: Beside) -> Divided {
        let costs = apart.costs();
        let mut best = apart;
        let is_together = best.take_shorter(self.together(&best.members, beside));
        self.search(best, &costs, is_together.then_some(beside))
    }

    /// The fastest with what is heard on core 1, from the fastest without.
    fn fastest_with_sound(
        &self,
        apart: &Divided,
        without: &Divided,
        beside: Beside,
    ) -> Option<Divided> {
        let beside = Beside {
            sound: true,
            ..beside
        };
        let first = self.together(&without.members, beside)?;
        Some(self.search(first, &apart.costs(), Some(beside)))
    }

    /// The fastest of the divisions to which what is proven of one leads, with members together or
    /// each apart.
    fn search(&self, first: Divided, costs: &[u64], together: Option<Beside>) -> Divided {
        let mut best = first;
        let mut tried = BTreeSet::from([best.members.clone()]);
        while tried.len() < DIVISIONS_MAX {
            let Some(next) = best.faster(costs).filter(|next| !tried.contains(next)) else {
                break;
            };
            let image = match together {
                Some(beside) => self.together(&next, beside),
                None => self.apart(&next),
            };
            best.take_shorter(image);
            tried.insert(next);
        }
        best
    }

    /// With each member, of which the core is given, a part of its own.
    fn apart(&self, members: &[usize]) -> Option<Divided> {
        let division: Vec<usize> = [0].iter().chain(members).copied().collect();
        self.build(self.instruments, &division, members)
    }

    /// With the members of a core together, and perhaps more on core 1.
    fn together(&self, members: &[usize], beside: Beside) -> Option<Divided> {
        let cores = self.board.stacks.len();
        let together = pipeline::together(self.in_parts, members, beside).ok()??;
        let with_parts = |own: &Instrument<'_>| own.parts.is_some();
        let instruments: Vec<Instrument> = self
            .instruments
            .iter()
            .map(|own| Instrument {
                parts: with_parts(own).then_some(&together),
                ..*own
            })
            .collect();
        self.build(&instruments, &together.on_own_cores(cores), members)
    }

    fn build(
        &self,
        instruments: &[Instrument],
        division: &[usize],
        members: &[usize],
    ) -> Option<Divided> {
        let image = build_divided(self.layout, instruments, self.setup, self.board, division);
        Divided::of(image.ok()?, members.to_vec(), self.board)
    }
}

/// An image with the bound of its frame.
#[derive(Clone)]
struct Divided {
    image: FirmwareImage,
    /// The core of each member.
    members: Vec<usize>,
    bound: TickHandlerBound,
}

impl Divided {
    fn of(image: FirmwareImage, members: Vec<usize>, board: &Board) -> Option<Divided> {
        let bounded = bound_frame(&image, board).ok()?;
        Some(Divided {
            image,
            members,
            bound: bounded.contended,
        })
    }

    /// The cycles of each member, where each is a part of its own.
    fn costs(&self) -> Vec<u64> {
        let parts = self.bound.cut.iter().flat_map(|cut| &cut.parts);
        let members = parts.filter(|part| matches!(part.role, Role::Member(_)));
        members.map(|part| part.code.tick.cycles_max(1)).collect()
    }

    /// Takes another one whose frame is shorter; says whether it did.
    fn take_shorter(&mut self, other: Option<Divided>) -> bool {
        let shorter = other.filter(|other| other.bound.cycles_max < self.bound.cycles_max);
        let is_shorter = shorter.is_some();
        if let Some(shorter) = shorter {
            *self = shorter;
        }
        is_shorter
    }

    /// The division that should be fastest, by the cycles of members: what one costs moves with it
    /// from core to core.
    fn faster(&self, costs: &[u64]) -> Option<Vec<usize>> {
        let helped = self.bound.cut.as_ref()?.helped.as_ref()?;
        fastest_members(costs, &self.members, helped.members_cycles_max())
    }
}

/// Of all divisions that leave no core without a member the fastest, where this one takes so many
/// cycles on either core.
fn fastest_members(costs: &[u64], known: &[usize], cycles: [u64; 2]) -> Option<Vec<usize>> {
    let count = costs.len().min(MEMBERS_MAX);
    let on = |division: &[usize], core: usize| -> u64 {
        let own = division.iter().zip(costs).filter(|(on, _)| **on == core);
        own.map(|(_, cost)| cost).sum()
    };
    let longest = |division: &[usize]| {
        let core = |core| (cycles[core] + on(division, core)).saturating_sub(on(known, core));
        [0, 1].map(core).into_iter().max()
    };
    // Those beyond stay where they are.
    let divisions = (1..(1_usize << count).saturating_sub(1)).map(|chosen| {
        let moved = (0..count).map(|member| chosen >> member & 1);
        let stay = known.iter().copied().skip(count);
        moved.chain(stay).collect::<Vec<usize>>()
    });
    divisions.min_by_key(|division| (longest(division), division != known))
}

/// Members of which all divisions are weighed.
const MEMBERS_MAX: usize = 10;

/// The bound of the frame of core 0.
fn bound_frame(image: &FirmwareImage, board: &Board) -> Result<Bounded, NotBounded> {
    let mut all = cores(image, &Program::of(&image.image), board, ProgramId(0))?;
    Ok(all.swap_remove(0))
}

/// The bounds of the cores of an image, whose bytes are given, while each of its programs plays.
pub fn bound_programs(
    image: &FirmwareImage,
    bytes: &Program,
    board: &Board,
) -> Result<Vec<Vec<Bounded>>, NotBounded> {
    let programs = (0..image.programs.len() as u32).map(ProgramId);
    programs
        .map(|program| cores(image, bytes, board, program))
        .collect()
}

/// What the zones of each program cost, as the bounds of an image prove it.
fn costs_of_zones(image: &FirmwareImage, bounded: &[Vec<Bounded>]) -> Vec<Costs> {
    let of_program = |(code, cores): (&ProgramCode, &Vec<Bounded>)| {
        let keys = code.zones.iter().map(|zone| (zone.keys.count(), 0));
        let mut costs = Costs {
            keys: keys.collect(),
            zone: 0,
        };
        for zone in cores.iter().flat_map(|core| &core.contended.zones) {
            let cycles = &mut costs.keys[zone.of.zone.index()].1;
            *cycles = zone.tick.key_cycles_max().max(*cycles);
            costs.zone = zone.tick.frame_cycles_max().max(costs.zone);
        }
        costs
    };
    image.programs.iter().zip(bounded).map(of_program).collect()
}

/// The fastest division between two cores, by what programs cost, at a multiple of so many keys.
fn fastest_division(programs: &[Costs], equal: &[u32], step: u32) -> Vec<u32> {
    let all: u32 = equal.iter().sum();
    let slowest = |first: u32| {
        let slower_core = |costs: &Costs| costs.of(0, first).max(costs.of(first, all));
        programs.iter().map(slower_core).max().unwrap_or(0)
    };
    let possible = (step..all).step_by(step as usize);
    let possible = possible.filter(|first| *first <= KEYS_MAX && all - first <= KEYS_MAX);
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
        assert_eq!(fastest_division(&[costs(&[(9, 50)])], &[5, 4], 1), [5, 4]);
        // 30 keys of 50 and 20 of 100: 3500 in all.
        let split = costs(&[(30, 50), (20, 100)]);
        let one = fastest_division(std::slice::from_ref(&split), &[25, 25], 1);
        assert_eq!(one, [32, 18]);
        let in_columns = fastest_division(&[costs(&[(20, 50), (20, 100)])], &[16, 24], 8);
        assert_eq!(in_columns, [24, 16]);
        // The other program is slower with more keys on core 0.
        let with = |other| fastest_division(&[split.clone(), costs(&[(50, other)])], &[25, 25], 1);
        assert_eq!(with(80), [27, 23]);
        assert_eq!(with(62), [31, 19]);
    }

    #[test]
    fn members_move_to_the_core_that_has_time() {
        let costs = [400, 300, 200, 100];
        // Besides members 100 cycles on core 0, and 200 on core 1.
        let best = fastest_members(&costs, &[0, 0, 0, 1], [1000, 300]);
        assert_eq!(best, Some(vec![1, 0, 0, 0]));
        let stays = fastest_members(&costs, &[1, 0, 0, 1], [600, 700]);
        assert_eq!(stays, Some(vec![1, 0, 0, 1]));
        // Core 1 begins late.
        let late = fastest_members(&costs, &[1, 0, 0, 1], [600, 1100]);
        assert_eq!(late, Some(vec![0, 1, 0, 0]));
        assert_eq!(fastest_members(&[900], &[0], [900, 0]), None);
    }

    #[test]
    fn no_core_has_none_or_more_than_the_firmware_takes() {
        let few = fastest_division(&[costs(&[(1, 900), (3, 1)])], &[2, 2], 1);
        assert_eq!(few, [1, 3]);
        let many = fastest_division(&[costs(&[(290, 1), (10, 1000)])], &[150, 150], 1);
        assert_eq!(many, [255, 45]);
    }
}
