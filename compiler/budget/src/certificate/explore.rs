//! All states at all points of a function, found by the checker's own steps.

use std::collections::{BTreeMap, BTreeSet};

use whippen_audit as audit;
use whippen_audit::{
    Around, Arrival, Certificate, Cost, Facts, Function, Kind, Last, NEVER, Node, Piece, Place,
    Refusal, Seen, State, Stepper, Tag, walk,
};
use whippen_isa::timing::{Core, Evidence, Pipe};

use super::explored::{Explored, Follows, Spot};
use super::finish::finished;
use super::potential;
use super::tighten::{join, tighten};
use crate::Flow;
use crate::graph::Graph;
use crate::memory::SOMEWHERE;

/// States at one point at most; more are joined.
const STATES_MAX: usize = 64;
/// How often stacks may turn out to be known less well.
const TRIES_MAX: usize = 64;
/// How often joined states are cut down to what arrives.
const TIGHTENED_MAX: usize = 64;

/// Where pieces begin: with which stack, and which pipeline.
type Places = BTreeMap<u32, (Place, Pipe)>;

/// What a function is explored with.
pub struct Explorer<'a> {
    pub core: &'a Core,
    pub around: &'a Around<'a>,
    pub certificate: &'a Certificate,
    pub costs: &'a [Option<Cost>],
}

impl Explorer<'_> {
    /// Explores all pieces.
    pub fn explore(
        &self,
        function: Function,
        entries: &[u32],
        flows: &[Flow],
    ) -> Result<Function, Refusal> {
        let mut function = function;
        let mut pieces: Vec<Explored> = Vec::new();
        for flow in flows {
            let contexts = contexts_of(&mut function, &flow.graph);
            self.see(&mut function, &flow.graph);
            pieces.push(Explored::new(&function, flow, &contexts));
        }
        for round in pieces.iter().flat_map(|piece| &piece.rounds) {
            let own = (round.head, round.rounds_max);
            if !function.loops.contains(&own) {
                function.loops.push(own);
            }
        }
        let first = Place::entered();
        let mut places: Places = [(entries[0], (first, Pipe::default()))].into();
        for entry in entries {
            function.pieces.push(Piece {
                entry: *entry,
                ..Piece::default()
            });
        }
        let mut seen = Seen {
            class: Evidence::Exact,
            stack: 0,
            hands_stack: false,
        };
        // With what each piece was explored to the end: again, it would be the same.
        let mut settled: Vec<Option<(Place, Pipe)>> = vec![None; entries.len()];
        for _ in 0..TRIES_MAX {
            let mut again = false;
            for (number, piece) in pieces.iter_mut().enumerate() {
                let facts = match number {
                    0 => self.entered(&function),
                    _ => Facts::default(),
                };
                let start = places.get(&entries[number]).cloned();
                if let Some(start) = start.filter(|start| settled[number].as_ref() != Some(start)) {
                    let mut run = Run {
                        own: self,
                        function: &function,
                        seen: &mut seen,
                    };
                    let unsettled = run.explore(piece, start.clone(), facts, &mut places)?;
                    settled[number] = (!unsettled).then_some(start);
                    again = true;
                }
            }
            if !again {
                function.stack = seen.stack;
                return self.finished(function, pieces, &places, &mut seen);
            }
        }
        Err(Refusal::at(entries[0], "has stacks that do not settle"))
    }

    /// With the pieces in the place of what was explored.
    fn finished(
        &self,
        function: Function,
        pieces: Vec<Explored>,
        places: &Places,
        seen: &mut Seen,
    ) -> Result<Function, Refusal> {
        let mut function = function;
        let (mut facts, kind) = (self.entered(&function), function.kind);
        let mut places = places.clone();
        for (number, mut explored) in pieces.into_iter().enumerate() {
            let entry = function.pieces[number].entry;
            let start = explored.index.get(&(0, entry)).copied();
            let start = start.ok_or_else(|| Refusal::at(entry, "is no point"))?;
            let idle = kind == Kind::Idle;
            let mut remains = potential::remains(&mut explored, (start, &facts), idle)?;
            for _ in 0..TIGHTENED_MAX {
                if idle || !tighten(&mut explored, &remains, (start, &facts)) {
                    break;
                }
                let mut run = Run {
                    own: self,
                    function: &function,
                    seen,
                };
                run.explore_open(&mut explored, &mut places)?;
                remains = potential::remains(&mut explored, (start, &facts), idle)?;
            }
            let (place, _) = places.get(&entry).cloned().unwrap_or_default();
            function.pieces[number] = finished(entry, &explored, &remains, place, kind, self.core);
            facts = Facts::default();
        }
        if let Some((at, pipe)) = &mut function.until {
            *pipe = places.get(at).map_or(0, |(_, pipe)| pipe.to_bits());
        }
        Ok(function)
    }

    fn entered(&self, function: &Function) -> Facts {
        let mut facts = Facts::default();
        for (register, words) in &function.entered {
            facts.set(*register, *words);
        }
        facts
    }

    /// What is fetched, whether addresses of the stack are handed out, and which loops have bounds.
    fn see(&self, function: &mut Function, graph: &Graph) {
        for block in &graph.blocks {
            for item in &block.items {
                function.fetched |= self.around.fetched_at(item.address);
                function.hands_stack |= item.inst.hands_stack();
            }
            let targets = block.edges.iter().filter_map(|edge| edge.taken);
            for target in targets.filter(|target| target.address != SOMEWHERE) {
                function.fetched |= self.around.fetched_at(target.address);
            }
        }
        let blocks = graph.blocks.iter().flat_map(|block| &block.edges);
        let mut targets = blocks.filter_map(|edge| edge.taken);
        if targets.any(|target| target.address == SOMEWHERE) {
            function.fetched |= self.around.fetched_at(SOMEWHERE);
        }
    }
}

/// The numbers of a graph's contexts in a function's.
fn contexts_of(function: &mut Function, graph: &Graph) -> Vec<u32> {
    let mut numbers = vec![0_u32];
    for context in graph.contexts.iter().skip(1) {
        let caller = numbers[context.caller.unwrap_or(0)];
        let wanted = [caller, context.return_address, context.callee & !1];
        let known = function
            .contexts
            .iter()
            .skip(1)
            .position(|own| *own == wanted);
        let number = known.map_or(function.contexts.len(), |at| at + 1);
        if known.is_none() {
            function.contexts.push(wanted);
        }
        numbers.push(number as u32);
    }
    numbers
}

/// One try.
struct Run<'a, 's> {
    own: &'a Explorer<'a>,
    function: &'a Function,
    seen: &'s mut Seen,
}

impl Run<'_, '_> {
    /// Explores a piece from its entry; whether its own stacks turned out otherwise. What others
    /// begin with is in `places`.
    fn explore(
        &mut self,
        piece: &mut Explored,
        (place, pipe): (Place, Pipe),
        facts: Facts,
        places: &mut Places,
    ) -> Result<bool, Refusal> {
        for spot in &mut piece.spots {
            (spot.states, spot.follows) = (Vec::new(), Vec::new());
        }
        piece.begins = pipe;
        let start = State {
            pipe,
            facts,
            place,
            last: Last::default(),
        };
        let (context, at, it) = (0, piece.entry, 0);
        let mut again = false;
        self.arrive(piece, Node { context, at, it }, &start, &mut again)?;
        Ok(again | self.explore_open(piece, places)?)
    }

    /// Finds what follows all open states; whether stacks of the piece turned out otherwise.
    fn explore_open(&mut self, piece: &mut Explored, places: &mut Places) -> Result<bool, Refusal> {
        let stepper = Stepper {
            core: self.own.core,
            around: self.own.around,
            certificate: self.own.certificate,
            function: self.function,
            costs: self.own.costs,
            room: Default::default(),
        };
        let ends = audit::ends(self.function, &self.entries(), piece.entry);
        let mut again = false;
        let index: BTreeSet<(u32, u32)> = piece.index.keys().copied().collect();
        while let Some((number, nth)) = piece.open.pop_first() {
            let from = start_of(&piece.spots[number], nth);
            let is_point = |node: &Node| index.contains(&(node.context, node.at));
            let mut longest = piece.longest;
            let mut passes = |_, cycles| {
                longest = longest.max(cycles);
                Ok(())
            };
            let arrived = walk(&stepper, from, &is_point, &ends, &mut passes, self.seen)?;
            piece.longest = longest;
            let mut follows = Vec::new();
            for (arrival, state, cycles) in arrived {
                let to = match arrival.clone() {
                    Arrival::Point(node) => Some(self.arrive(piece, node, &state, &mut again)?),
                    Arrival::Piece(at) => {
                        self.hand_over(at, &state, places);
                        None
                    }
                    Arrival::Return => None,
                };
                let never = arrival == Arrival::Return && self.function.kind == Kind::Until;
                let state = (state.pipe, state.facts);
                let cycles = cycles as i64 + if never { NEVER } else { 0 };
                follows.push(Follows { cycles, to, state });
            }
            piece.spots[number].set_follows(nth, follows);
        }
        Ok(again)
    }

    fn entries(&self) -> Vec<u32> {
        let pieces = self.function.pieces.iter();
        pieces.map(|piece| piece.entry).collect()
    }

    /// Another piece begins: with what registers are assumed to point to there.
    fn hand_over(&self, at: u32, state: &State, places: &mut Places) {
        let mut state = state.clone();
        for (register, section) in &self.function.bases {
            let tag = &mut state.place.registers[usize::from(*register & 15)];
            tag.get_or_insert(Tag::Section(*section));
        }
        let first = || (nowhere(), state.pipe);
        // The checker refuses a second pipeline.
        self.meet_place(&mut places.entry(at).or_insert_with(first).0, &state);
    }

    /// A state comes to a spot: its number there.
    fn arrive(
        &mut self,
        piece: &mut Explored,
        node: Node,
        state: &State,
        again: &mut bool,
    ) -> Result<(usize, usize), Refusal> {
        let number = piece.index.get(&(node.context, node.at)).copied();
        let number = number.ok_or_else(|| Refusal::at(node.at, "is no point"))?;
        let mut facts = state.facts.clone();
        facts.trim(piece.spots[number].relevant);
        let spot = &mut piece.spots[number];
        if !spot.states.is_empty() && spot.node != node {
            return Err(Refusal::at(node.at, "is met in and outside of an IT block"));
        }
        spot.node = node;
        let mut place = spot.place.take().unwrap_or_else(nowhere);
        *again |= self.meet_place(&mut place, state) && !spot.states.is_empty();
        spot.place = Some(place);
        let known = spot
            .states
            .iter()
            .position(|(pipe, known)| *pipe == state.pipe && *known == facts);
        if let Some(nth) = known {
            return Ok((number, nth));
        }
        let full = spot.states.len() >= STATES_MAX;
        let like = spot
            .states
            .iter()
            .rposition(|(pipe, _)| full && *pipe == state.pipe);
        if let Some(nth) = like {
            let old = &spot.states[nth].1;
            if !old.covers(&facts) {
                // One state in the place of two: what led to the old one leads to both.
                let joined = (state.pipe, join(old, &facts));
                spot.states[nth] = joined;
                piece.open.insert((number, nth));
            }
            return Ok((number, nth));
        }
        let nth = spot.states.len();
        spot.states.push((state.pipe, facts));
        piece.open.insert((number, nth));
        Ok((number, nth))
    }

    /// What is known of a stack on all ways; whether that is less than before.
    fn meet_place(&self, known: &mut Place, state: &State) -> bool {
        let keys = self.function.kind == Kind::Keys;
        let derived = |register: u8| {
            let section = self.own.around.section_of(state.facts.of(register));
            section.filter(|_| keys).map(Tag::Section)
        };
        let mut new = state.place.clone();
        for register in 0..15_u8 {
            let tag = state.place.tag(register).or_else(|| derived(register));
            new.registers[usize::from(register)] = tag;
        }
        if known.sp == i32::MAX {
            *known = new;
            return true;
        }
        let before = known.clone();
        for (tag, new) in known.registers.iter_mut().zip(&new.registers) {
            *tag = tag.filter(|tag| Some(*tag) == *new);
        }
        known.slots.retain(|slot| new.slots.contains(slot));
        *known != before
    }
}

/// Where a walk from a state begins.
fn start_of(spot: &Spot, nth: usize) -> (Node, State) {
    let (pipe, facts) = spot.states[nth].clone();
    let place = spot.place.clone().unwrap_or_default();
    let last = Last::default();
    let state = State {
        pipe,
        facts,
        place,
        last,
    };
    (spot.node, state)
}

/// No stack yet.
fn nowhere() -> Place {
    Place {
        sp: i32::MAX,
        ..Place::default()
    }
}
