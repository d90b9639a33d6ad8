//! The functions of an instrument in parts: its parts, what calls them, and on two cores the legs
//! between the places where these meet.

use std::collections::BTreeMap;

use whippen_audit as audit;
use whippen_audit::Kind;
use whippen_firmware::{Cut, MEMBERS, WENT};

use super::super::calls::Calls;
use super::super::parts::{ROUNDS, crossing, meeting_places, waits};
use super::super::tick_handler::{OnCore, find};
use super::super::{Annotations, NotBounded};
use super::wanted::Wanted;
use super::{Framed, NotCertified};

/// The name of the legs of each core.
const LEGS: [&str; 2] = [MEMBERS, "core1_parts"];

/// Functions by entry: the number of each, and how many keys it ticks.
type Costs = BTreeMap<u32, (u32, u32)>;

/// Words that core 0 writes to the memory of core 1 in each of that one's legs.
pub(super) fn visits_of_legs(cut: &Cut) -> Vec<u32> {
    let legs = meeting_places(cut)[1].len().saturating_sub(1);
    let visits = crossing(cut).chain(std::iter::repeat(0));
    visits.take(legs).collect()
}

impl Framed<'_> {
    /// What core 0 runs of an instrument in parts.
    pub(super) fn cut<'a>(
        &'a self,
        of: &OnCore<'a>,
        calls: &Calls,
        cut: &'a Cut,
    ) -> Result<Vec<Wanted<'a>>, NotCertified> {
        let playing = of.playing;
        let (mut all, mut costs) = self.parts(of, cut)?;
        for tail in &playing.zones {
            costs.insert(self.tick(&tail.name)?, (all.len() as u32, 1));
            all.push(self.ticked(of, &tail.name, None)?);
        }
        let members = cut.has_helper().then(|| find(self.program, MEMBERS));
        let members = members.transpose()?;
        if let Some(members) = members {
            let legs = all.len() as u32;
            all.extend(self.legs(of, cut, &costs)?);
            costs.insert(members, (legs, 0));
            all.push(self.until(of, "go", members, WENT, Vec::new())?);
        }
        let row = all.len() as u32;
        let called = self.calls_from(calls.tick, &costs)?;
        all.push(self.row_of(of, calls, "parts", called.clone())?);
        all.push(self.begun(of, &playing.name, playing.keys.count(), Vec::new())?);
        let ways = [(row, 0), (row, 0), (row + 1, 0)];
        if let Some(members) = members.filter(|_| cut.has_sound()) {
            let handled = calls.certified(ways);
            let handled = handled.into_iter().filter(|call| call.callee != calls.tick);
            let called = called.into_iter().filter(|call| call.callee != members);
            let (name, handler) = ("before", find(self.program, of.running.handler)?);
            let known = handled.chain(called).collect();
            all.push(self.until(of, name, handler, MEMBERS, known)?);
        }
        self.around_keys(of, &mut all, calls, ways)?;
        Ok(all)
    }

    /// What core 1 runs for it.
    pub(super) fn helping<'a>(
        &'a self,
        of: &OnCore<'a>,
        cut: &'a Cut,
    ) -> Result<Vec<Wanted<'a>>, NotCertified> {
        let (mut all, costs) = self.parts(of, cut)?;
        all.extend(self.legs(of, cut, &costs)?);
        Ok(all)
    }

    /// The parts of a core, and what calls of them cost: each is ticked once.
    fn parts<'a>(
        &'a self,
        of: &OnCore<'a>,
        cut: &'a Cut,
    ) -> Result<(Vec<Wanted<'a>>, Costs), NotCertified> {
        let (mut all, mut costs) = (Vec::new(), BTreeMap::new());
        for part in cut.parts.iter().filter(|part| part.core == of.number) {
            costs.insert(self.tick(&part.name)?, (all.len() as u32, 1));
            all.push(self.ticked(of, &part.name, None)?);
        }
        Ok((all, costs))
    }

    fn tick(&self, name: &str) -> Result<u32, NotBounded> {
        find(self.program, &format!("{name}_tick"))
    }

    /// The legs of a core: with the other's number there, and waiting for it.
    fn legs<'a>(
        &'a self,
        of: &OnCore<'a>,
        cut: &Cut,
        costs: &Costs,
    ) -> Result<[Wanted<'a>; 2], NotCertified> {
        let places = &meeting_places(cut)[of.number];
        let entries = places.iter().flatten().map(|name| find(self.program, name));
        let entries = entries.collect::<Result<Vec<u32>, _>>()?;
        let calls = self.calls_from(entries[0], costs)?;
        let with_rounds = |rounds| {
            let mut annotations = self.program.annotations.clone();
            for head in waits(cut) {
                annotations.loops.insert(find(self.program, head)?, rounds);
            }
            Ok::<_, NotBounded>(Wanted {
                name: LEGS[of.number],
                kind: Kind::Legs,
                until: None,
                entries: entries.clone(),
                annotations,
                calls: calls.clone(),
            })
        };
        Ok([with_rounds(1)?, with_rounds(ROUNDS)?])
    }

    /// A function of core 0 until it comes to a place.
    fn until<'a>(
        &'a self,
        of: &OnCore<'a>,
        name: &'a str,
        entry: u32,
        place: &str,
        calls: Vec<audit::Call>,
    ) -> Result<Wanted<'a>, NotCertified> {
        let handler = find(self.program, of.running.handler)?;
        Ok(Wanted {
            name,
            kind: Kind::Until,
            until: Some(find(self.program, place)?),
            entries: vec![entry],
            annotations: Annotations {
                handler: entry == handler,
                ..self.program.annotations.clone()
            },
            calls,
        })
    }
}
