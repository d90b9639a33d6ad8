//! What was explored as a piece of a certificate: only what is reached, each entry once.

use std::collections::BTreeSet;

use whippen_audit::{Kind, Piece, Place, Point};
use whippen_isa::ItState;
use whippen_isa::timing::Core;

use super::explored::Explored;
use super::potential::Remains;

/// As a piece of a certificate, with the cycles that remain.
pub fn finished(
    entry: u32,
    explored: &Explored,
    remains: &Remains,
    own: Place,
    kind: Kind,
    core: &Core,
) -> Piece {
    let idle = kind == Kind::Idle;
    let mut piece = Piece {
        entry,
        begins: explored.begins.to_bits(),
        ..Piece::default()
    };
    piece.place = number(&mut piece.places, own);
    let numbers = loops(explored, remains, &mut piece);
    for (spot, kept) in explored.spots.iter().zip(&remains.kept) {
        let (Some(place), false) = (&spot.place, kept.is_empty()) else {
            continue;
        };
        let mut states = Vec::new();
        for (nth, remains) in kept {
            let (pipe, facts) = &spot.states[*nth];
            let pipe = number(&mut piece.pipes, pipe.to_bits());
            let facts = number(&mut piece.facts, facts.clone());
            states.push((pipe, facts, *remains));
        }
        piece.points.push(Point {
            context: spot.node.context,
            at: spot.node.at,
            it: ItState::from_bits(spot.node.it).unwrap_or_default(),
            place: number(&mut piece.places, place.clone()),
            loops: spot
                .loops
                .iter()
                .map(|own| numbers[*own as usize])
                .collect(),
            states,
        });
    }
    piece.cycles = match idle {
        true => remains.longest + u64::from(core.late.cycles),
        false => remains.entry as u64,
    };
    piece
}

/// Puts the loops into a piece that something is in: the numbers of all there.
fn loops(explored: &Explored, remains: &Remains, piece: &mut Piece) -> Vec<u32> {
    let spots = explored.spots.iter().zip(&remains.kept);
    let kept = spots.filter(|(_, kept)| !kept.is_empty());
    let used: BTreeSet<u32> = kept
        .flat_map(|(spot, _)| spot.loops.iter().copied())
        .collect();
    let mut numbers = Vec::new();
    for (number, (own, cycles)) in (0..).zip(explored.rounds.iter().zip(&remains.rounds)) {
        numbers.push(piece.rounds.len() as u32);
        if used.contains(&number) {
            let round = (own.context, own.head, *cycles as u64);
            piece.rounds.push(round);
        }
    }
    numbers
}

/// The number of something in a list, where it is put.
fn number<T: PartialEq>(all: &mut Vec<T>, one: T) -> u32 {
    let known = all.iter().position(|own| *own == one);
    let at = known.unwrap_or(all.len());
    if known.is_none() {
        all.push(one);
    }
    at as u32
}
