//! A piece: that the cycles claimed to remain in each state are what each of its steps demands.
//!
//! Potentials of a longest path. Each state of the certificate claims at most how many cycles
//! remain to the end of its piece. Checked, for each of them and everything that may follow it:
//! some state of the certificate covers what follows, and cycles of the step and those claimed to
//! remain there come to no more. Nothing is searched.
//!
//! In loops the claim is `a + b r`: r rounds of the loop remain, the present one included, and b
//! is the cycles claimed for a round. A loop is entered at its head alone, with all its rounds;
//! back at the head one remains less; wherever it is left, one did remain at least.

#[cfg(test)]
pub(crate) mod tests;

use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::mem;

use whippen_isa::timing::Pipe;

use crate::Refusal;
use crate::certificate::{Function, Kind, Piece, Point};
use crate::facts::Facts;
use crate::overlap::Last;
use crate::place::{Place, Tag};
use crate::step::{Node, Room, Seen, State, Stepper, To};

/// Instructions between two points at most.
const WALK_MAX: usize = 100_000;

/// Where a walk arrives.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Arrival {
    /// At a point.
    Point(Node),
    /// At the entry of another piece.
    Piece(u32),
    /// Out of the function.
    Return,
}

/// Walks from a state to wherever one of `points` or of the entries `ends` comes next; `passes` is
/// told of each instruction with its cycles.
///
/// # Errors
/// What cannot be followed.
pub fn walk(
    stepper: &Stepper,
    from: (Node, State),
    points: &dyn Fn(&Node) -> bool,
    ends: &BTreeSet<u32>,
    passes: &mut dyn FnMut(Node, u64) -> Result<(), Refusal>,
    seen: &mut Seen,
) -> Result<Vec<(Arrival, State, u64)>, Refusal> {
    let mut arrived = Vec::new();
    let Room { mut open, mut next } = stepper.room.take();
    open.push((from.0, from.1, 0_u64));
    let mut steps = 0;
    // Whoever runs until a place may come there in a call.
    let anywhere = stepper.function.kind == Kind::Until;
    while let Some((node, state, cycles)) = open.pop() {
        steps += 1;
        if steps > WALK_MAX {
            return Err(Refusal::at(
                node.at,
                "is walked through endlessly between two points",
            ));
        }
        stepper.step(node, state, seen, &mut next)?;
        for (to, mut state, more) in next.drain(..) {
            passes(node, more)?;
            if stepper.function.kind == Kind::Idle {
                (state.pipe, state.facts) = (Pipe::default(), Facts::default());
            }
            let cycles = cycles
                .checked_add(more)
                .ok_or_else(|| Refusal::at(node.at, "is endless"))?;
            match to {
                To::Node(to) if (to.context == 0 || anywhere) && ends.contains(&to.at) => {
                    arrived.push((Arrival::Piece(to.at), state, cycles));
                }
                To::Node(to) if points(&to) => arrived.push((Arrival::Point(to), state, cycles)),
                To::Node(to) => open.push((to, state, cycles)),
                To::Return => arrived.push((Arrival::Return, state, cycles)),
            }
        }
    }
    stepper.room.replace(Room { open, next });
    Ok(arrived)
}

/// What remains, about, where a way returns that was to lead elsewhere: less than on any that does.
pub const NEVER: i64 = -(1 << 40);

/// Where a piece of a function ends, by the entries of all: where another one begins.
pub fn ends(function: &Function, entries: &[u32], entry: u32) -> BTreeSet<u32> {
    match function.kind {
        Kind::Keys => entries.iter().skip(1).copied().collect(),
        Kind::Legs => {
            let own = entries.iter().position(|other| *other == entry);
            let next = own.map_or(0, |own| own + 1);
            let next = entries.get(next).or(entries.first());
            next.copied().into_iter().collect()
        }
        Kind::Until => function.until.map(|(at, _)| at).into_iter().collect(),
        Kind::Plain | Kind::Handler | Kind::Idle => BTreeSet::new(),
    }
}

/// A point's node.
pub fn node_of(point: &Point) -> Node {
    Node {
        context: point.context,
        at: point.at,
        it: point.it.bits(),
    }
}

/// What arrives at a claimed state: all of it, and the least that remains.
struct Claimed {
    /// Of each name of its facts, the words of all that arrive.
    words: Vec<Option<[i64; 2]>>,
    flags: u16,
    reached: bool,
}

struct Check<'a> {
    stepper: &'a Stepper<'a>,
    piece: &'a Piece,
    points: BTreeMap<Node, usize>,
    ends: BTreeSet<u32>,
    claimed: Vec<Vec<Claimed>>,
    /// The loops that each instruction is in.
    loops: HashMap<Node, Vec<u32>>,
    /// The longest instruction.
    longest: u64,
    seen: &'a mut Seen,
}

/// Checks a piece. What is entered first is entered with `facts`.
///
/// # Errors
/// What is claimed wrongly.
pub(crate) fn check(
    stepper: &Stepper,
    piece: &Piece,
    facts: &Facts,
    seen: &mut Seen,
) -> Result<(), Refusal> {
    let mut check = Check::new(stepper, piece, seen)?;
    check.prepare()?;
    check.enter(facts)?;
    for number in 0..piece.points.len() {
        check.point(number)?;
    }
    let longest = check.longest + u64::from(stepper.core.late.cycles);
    if stepper.function.kind == Kind::Idle && longest != piece.cycles {
        return Err(check.claims_not(longest.into()));
    }
    check.is_least()
}

impl<'a> Check<'a> {
    fn new(
        stepper: &'a Stepper<'a>,
        piece: &'a Piece,
        seen: &'a mut Seen,
    ) -> Result<Self, Refusal> {
        let points: BTreeMap<Node, usize> = piece
            .points
            .iter()
            .enumerate()
            .map(|(nth, point)| (node_of(point), nth))
            .collect();
        if points.len() != piece.points.len() {
            return Err(Refusal::at(piece.entry, "has a point twice"));
        }
        let entries = stepper.function.pieces.iter().map(|piece| piece.entry);
        let entries: Vec<u32> = entries.collect();
        Ok(Self {
            stepper,
            piece,
            points,
            ends: ends(stepper.function, &entries, piece.entry),
            claimed: Vec::new(),
            loops: HashMap::new(),
            longest: 0,
            seen,
        })
    }

    /// That every entry is there that another one names, and that none is idle.
    fn prepare(&mut self) -> Result<(), Refusal> {
        let piece = self.piece;
        let at = piece.entry;
        let named = |number: u32, of: usize| match (number as usize) < of {
            true => Ok(number),
            false => Err(Refusal::at(at, "names an entry that is not there")),
        };
        let places = piece.places.iter().all(Place::is_possible);
        if !places || !piece.facts.iter().all(Facts::is_possible) {
            return Err(Refusal::at(at, "claims a stack or words that cannot be"));
        }
        let mut used: [BTreeSet<u32>; 4] = Default::default();
        used[0].insert(named(piece.place, piece.places.len())?);
        for point in &piece.points {
            used[0].insert(named(point.place, piece.places.len())?);
            for number in &point.loops {
                used[1].insert(named(*number, piece.rounds.len())?);
            }
            let mut claimed = Vec::new();
            for (pipe, facts, _) in &point.states {
                used[2].insert(named(*pipe, piece.pipes.len())?);
                used[3].insert(named(*facts, piece.facts.len())?);
                let names = piece.facts[*facts as usize].values.len();
                let words = vec![None; names];
                claimed.push(Claimed {
                    words,
                    flags: 0,
                    reached: false,
                });
            }
            self.claimed.push(claimed);
        }
        let all = [
            piece.places.len(),
            piece.rounds.len(),
            piece.pipes.len(),
            piece.facts.len(),
        ];
        let distinct = piece.places.iter().collect::<BTreeSet<_>>().len() == all[0]
            && piece.pipes.iter().collect::<BTreeSet<_>>().len() == all[2]
            && piece.facts.iter().collect::<BTreeSet<_>>().len() == all[3];
        if used.map(|numbers| numbers.len()) != all || !distinct {
            return Err(Refusal::at(at, "has an entry that nothing needs"));
        }
        Ok(())
    }

    fn place(&self, number: u32) -> Result<&Place, Refusal> {
        let place = self.piece.places.get(number as usize);
        place.ok_or_else(|| Refusal::at(self.piece.entry, "has no such place"))
    }

    fn enter(&mut self, facts: &Facts) -> Result<(), Refusal> {
        let entry = self.piece.entry;
        let state = State {
            pipe: Pipe::from_bits(self.piece.begins),
            facts: facts.clone(),
            place: self.place(self.piece.place)?.clone(),
            last: Last::default(),
        };
        let node = Node {
            context: 0,
            at: entry,
            it: 0,
        };
        if !self.points.contains_key(&node) {
            return Err(Refusal::at(entry, "is an entry, but no point"));
        }
        let remains = self.go_on(node, &[], &state)?;
        let idle = self.stepper.function.kind == Kind::Idle;
        match idle || i128::from(self.piece.cycles) == remains {
            true => Ok(()),
            false => Err(self.claims_not(remains)),
        }
    }

    fn claims_not(&self, cycles: i128) -> Refusal {
        let why = format!("claims {} cycles, not {cycles}", self.piece.cycles);
        Refusal::at(self.piece.entry, why)
    }

    /// What remains where a state comes to a point: by a claimed state that covers it.
    fn arrive(&mut self, number: usize, state: &State) -> Result<i64, Refusal> {
        let point = &self.piece.points[number];
        let derived = |register: u8| self.stepper.derived(&state.facts, register);
        if !self.place(point.place)?.covers(&state.place, derived) {
            return Err(Refusal::at(
                point.at,
                "is met with another stack than is claimed",
            ));
        }
        let mut best: Option<(i64, usize)> = None;
        for (nth, (pipe, facts, remains)) in point.states.iter().enumerate() {
            let facts = &self.piece.facts[*facts as usize];
            let covers = self.piece.pipe(*pipe) == Some(state.pipe) && facts.covers(&state.facts);
            if covers && best.is_none_or(|(least, _)| *remains < least) {
                best = Some((*remains, nth));
            }
        }
        let (remains, nth) =
            best.ok_or_else(|| Refusal::at(point.at, "is met in a state that is not claimed"))?;
        self.claimed[number][nth].hull(
            &self.piece.facts[point.states[nth].1 as usize],
            &state.facts,
        );
        Ok(remains)
    }

    fn point(&mut self, number: usize) -> Result<(), Refusal> {
        let point = &self.piece.points[number];
        let place = self.place(point.place)?.clone();
        let node = node_of(point);
        self.is_in(node, &point.loops)?;
        for (pipe, facts, remains) in &point.states {
            let state = State {
                pipe: self.piece.pipe(*pipe).unwrap_or_default(),
                facts: self.piece.facts[*facts as usize].clone(),
                place: place.clone(),
                last: Last::default(),
            };
            let needed = self.follow(node, state, &point.loops)?;
            if i128::from(*remains) != needed {
                let why = format!("claims that {remains} cycles remain, not {needed}");
                return Err(Refusal::at(point.at, why));
            }
        }
        Ok(())
    }

    /// An instruction belongs to the same loops whichever way it is met.
    fn is_in(&mut self, node: Node, loops: &[u32]) -> Result<(), Refusal> {
        let known = self.loops.entry(node).or_insert_with(|| loops.to_vec());
        match known == loops {
            true => Ok(()),
            false => Err(Refusal::at(node.at, "is both in a loop and outside of it")),
        }
    }

    /// The least that must be claimed of a state for all that follows it.
    fn follow(&mut self, node: Node, state: State, loops: &[u32]) -> Result<i128, Refusal> {
        let stepper = self.stepper;
        let (points, ends) = (mem::take(&mut self.points), mem::take(&mut self.ends));
        let mut seen = *self.seen;
        let mut passes = |node: Node, cycles: u64| {
            self.longest = self.longest.max(cycles);
            self.is_in(node, loops)
        };
        let is_point = |node: &Node| points.contains_key(node);
        let arrived = walk(
            stepper,
            (node, state),
            &is_point,
            &ends,
            &mut passes,
            &mut seen,
        )?;
        (self.points, self.ends) = (points, ends);
        *self.seen = seen;
        let mut needed = i128::MIN;
        for (arrival, state, cycles) in arrived {
            let remains = match arrival {
                Arrival::Return if stepper.function.kind == Kind::Until => {
                    self.left(loops, 0)? + i128::from(NEVER)
                }
                Arrival::Return => self.leave(loops, 0, &state)?,
                Arrival::Piece(at) => self.hand_over(at, loops, &state)?,
                Arrival::Point(node) => self.go_on(node, loops, &state)?,
            };
            needed = needed.max(i128::from(cycles) + remains);
        }
        // Between ticks nothing is summed; where nothing follows, nothing remains.
        let none = needed == i128::MIN || stepper.function.kind == Kind::Idle;
        Ok(if none { 0 } else { needed })
    }

    /// Cycles of a round of a loop.
    fn round(&self, number: u32) -> Result<(u32, u32, i128), Refusal> {
        let round = self.piece.rounds.get(number as usize);
        let (context, head, cycles) =
            round.ok_or_else(|| Refusal::at(self.piece.entry, "has no such loop"))?;
        Ok((*context, *head, (*cycles).into()))
    }

    /// Leaving all loops but so many: of each one round did remain.
    fn left(&self, loops: &[u32], keeps: usize) -> Result<i128, Refusal> {
        let mut sum = 0;
        for number in &loops[keeps..] {
            sum -= self.round(*number)?.2;
        }
        Ok(sum)
    }

    fn leave(&self, loops: &[u32], keeps: usize, state: &State) -> Result<i128, Refusal> {
        self.leave_with(Pipe::default(), loops, keeps, state)
    }

    /// The end, for what goes on with that pipeline.
    fn leave_with(
        &self,
        pipe: Pipe,
        loops: &[u32],
        keeps: usize,
        state: &State,
    ) -> Result<i128, Refusal> {
        match state.pipe == pipe || self.stepper.function.kind == Kind::Handler {
            true => self.left(loops, keeps),
            false => Err(Refusal::at(
                self.piece.entry,
                "ends with another pipeline than is claimed",
            )),
        }
    }

    /// The next piece begins: with the stack that it claims, and with registers that are assumed
    /// to point somewhere.
    fn hand_over(&self, at: u32, loops: &[u32], state: &State) -> Result<i128, Refusal> {
        let function = self.stepper.function;
        if let Some((_, bits)) = function.until {
            return self.leave_with(Pipe::from_bits(bits), loops, 0, state);
        }
        let last = function.pieces.last().map(|piece| piece.entry);
        if last == Some(self.piece.entry) && function.kind == Kind::Keys {
            return Err(Refusal::at(
                at,
                "is led to by the last piece, which runs once",
            ));
        }
        let next = function.pieces.iter().find(|piece| piece.entry == at);
        let place = next.and_then(|next| next.places.get(next.place as usize));
        let derived = |register: u8| {
            let found = self.stepper.derived(&state.facts, register);
            let assumed = function.bases.iter().find(|(own, _)| *own == register);
            found.or(assumed.map(|(_, section)| Tag::Section(*section)))
        };
        let begins = next.map_or(0, |next| next.begins);
        match place.is_some_and(|place| place.covers(&state.place, derived)) {
            true => self.leave_with(Pipe::from_bits(begins), loops, 0, state),
            false => Err(Refusal::at(at, "begins with another stack than is claimed")),
        }
    }

    fn go_on(&mut self, node: Node, loops: &[u32], state: &State) -> Result<i128, Refusal> {
        let number = self.points.get(&node).copied().unwrap_or(0);
        let remains: i128 = self.arrive(number, state)?.into();
        let into = &self.piece.points[number].loops;
        let same = loops.iter().zip(into).take_while(|(a, b)| a == b).count();
        let head = match into.last() {
            Some(last) => {
                Some(self.round(*last)?).filter(|own| (own.0, own.1) == (node.context, node.at))
            }
            None => None,
        };
        let left = self.left(loops, same)?;
        match head {
            Some((_, _, cycles)) if same == into.len() => Ok(remains - cycles + left),
            Some((_, at, cycles)) if same + 1 == into.len() => {
                let known = self
                    .stepper
                    .function
                    .loops
                    .iter()
                    .find(|(own, _)| *own == at);
                let (_, rounds) =
                    known.ok_or_else(|| Refusal::at(at, "heads a loop without a bound"))?;
                Ok(remains + cycles * i128::from(*rounds) + left)
            }
            _ if same == into.len() => Ok(remains + left),
            _ => Err(Refusal::at(
                node.at,
                "is in a loop that is not entered at its head",
            )),
        }
    }

    /// That nothing more is claimed than what arrives.
    fn is_least(&self) -> Result<(), Refusal> {
        for (point, claimed) in self.piece.points.iter().zip(&self.claimed) {
            for ((_, facts, _), claimed) in point.states.iter().zip(claimed) {
                let facts = &self.piece.facts[*facts as usize];
                let values = facts.values.iter().map(|value| Some(*value));
                let flags = facts.flags == !0 || facts.flags == claimed.flags;
                if !claimed.reached || !flags || !values.eq(claimed.words.iter().copied()) {
                    return Err(Refusal::at(point.at, "has a state that nothing needs"));
                }
            }
        }
        Ok(())
    }
}

impl Claimed {
    fn hull(&mut self, claim: &Facts, state: &Facts) {
        self.reached = true;
        self.flags |= state.flags;
        for (name, other) in claim.names.iter().zip(&state.names) {
            let Some(words) = self.words.get_mut(usize::from(*name)) else {
                continue;
            };
            let [low, high] = state
                .values
                .get(usize::from(*other))
                .copied()
                .unwrap_or([0, 0]);
            let [l, h] = words.unwrap_or([low, high]);
            *words = Some([l.min(low), h.max(high)]);
        }
    }
}
