//! The functions of a frame that a certificate speaks of, in the order in which it does: who calls
//! stands behind what it calls.

use std::collections::BTreeMap;

use whippen_audit as audit;
use whippen_audit::Kind;
use whippen_firmware::ZoneCode;
use whippen_isa::timing::Target;

use super::super::calls::Calls;
use super::super::graph::{Block, Edge, Graph, Tables};
use super::super::tick::Places;
use super::super::tick_handler::{OnCore, find};
use super::super::{Annotations, Known, Query};
use super::{Framed, NotCertified};

/// A function that is looked for.
pub(super) struct Wanted<'a> {
    pub name: &'a str,
    pub kind: Kind,
    /// Where it ends, if that is a place in it.
    pub until: Option<u32>,
    /// Entries of its pieces.
    pub entries: Vec<u32>,
    pub annotations: Annotations,
    pub calls: Vec<audit::Call>,
}

impl Framed<'_> {
    /// What ticks keys and what begins one, zone by zone, what calls the zones, what runs between
    /// ticks, the handler.
    pub(super) fn wanted<'a>(
        &'a self,
        of: &OnCore<'a>,
        calls: &Calls,
    ) -> Result<Vec<Wanted<'a>>, NotCertified> {
        if let Some(cut) = &of.playing.cut {
            return self.cut(of, calls, cut);
        }
        let playing = of.playing;
        let zones = &playing.zones;
        let is_split = playing.is_split();
        // Zones come back to different places: to the most expensive.
        let return_to = calls.return_to.filter(|_| !is_split);
        let mut all = Vec::new();
        for zone in zones {
            all.push(self.ticked(of, &zone.name, return_to)?);
        }
        for zone in zones {
            all.push(self.begun(of, &zone.name, zone.keys(), Vec::new())?);
        }
        let keys = playing.keys.count();
        let mut called = [(0, keys), (0, keys.saturating_sub(1)), (1, 0)];
        if is_split {
            let row = all.len() as u32;
            called = [(row, 0), (row, 0), (row + 1, 0)];
            all.push(self.row(of, calls)?);
            let begins = zones.iter().enumerate();
            let begins = begins.map(|(at, zone)| (zone, "begin", (zones.len() + at) as u32, 0));
            let begins = self.calls_of_zones(calls.begin, begins)?;
            all.push(self.begun(of, &playing.name, keys, begins)?);
        }
        self.around_keys(of, &mut all, calls, called)?;
        Ok(all)
    }

    /// What runs between ticks, and the handler with its calls of keys.
    pub(super) fn around_keys<'a>(
        &'a self,
        of: &OnCore<'a>,
        all: &mut Vec<Wanted<'a>>,
        calls: &Calls,
        called: [(u32, u32); 3],
    ) -> Result<(), NotCertified> {
        let (program, running) = (self.program, of.running);
        let own = || program.annotations.clone();
        let sleeping = Annotations {
            sleeps: true,
            ..own()
        };
        let handled = Annotations {
            handler: true,
            ..own()
        };
        all.push(Wanted {
            name: running.idle,
            kind: Kind::Idle,
            until: None,
            entries: vec![find(program, running.idle)?],
            annotations: sleeping,
            calls: Vec::new(),
        });
        all.push(Wanted {
            name: running.handler,
            kind: Kind::Handler,
            until: None,
            entries: vec![find(program, running.handler)?],
            annotations: handled,
            calls: calls.certified(called),
        });
        Ok(())
    }

    /// The tick of the keys of that name.
    pub(super) fn ticked<'a>(
        &'a self,
        of: &OnCore<'a>,
        name: &'a str,
        return_to: Option<Target>,
    ) -> Result<Wanted<'a>, NotCertified> {
        let Places { tick, modes, end } = Places::find(self.program, name)?;
        let modes = modes.iter().map(|(_, at)| *at);
        Ok(Wanted {
            name,
            kind: Kind::Keys,
            until: None,
            entries: [tick].into_iter().chain(modes).chain([end]).collect(),
            annotations: Annotations {
                return_to,
                entered: of.entered(name, None),
                ..self.program.annotations.clone()
            },
            calls: Vec::new(),
        })
    }

    /// What begins one of so many keys of that name.
    pub(super) fn begun<'a>(
        &'a self,
        of: &OnCore<'a>,
        name: &'a str,
        keys: u32,
        calls: Vec<audit::Call>,
    ) -> Result<Wanted<'a>, NotCertified> {
        Ok(Wanted {
            name: "begin",
            kind: Kind::Plain,
            until: None,
            entries: vec![find(self.program, &format!("{name}_begin"))?],
            annotations: Annotations {
                entered: of.entered(name, Some(keys)),
                ..self.program.annotations.clone()
            },
            calls,
        })
    }

    /// The row of calls that ticks one zone after the other.
    fn row<'a>(&'a self, of: &OnCore<'a>, calls: &Calls) -> Result<Wanted<'a>, NotCertified> {
        let zones = of.playing.zones.iter().enumerate();
        let ticks = zones.map(|(at, zone)| (zone, "tick", at as u32, zone.keys()));
        let ticks = self.calls_of_zones(calls.tick, ticks)?;
        self.row_of(of, calls, "zones", ticks)
    }

    /// What calls the keys' code of a core piece by piece.
    pub(super) fn row_of<'a>(
        &'a self,
        of: &OnCore<'a>,
        calls: &Calls,
        name: &'a str,
        called: Vec<audit::Call>,
    ) -> Result<Wanted<'a>, NotCertified> {
        Ok(Wanted {
            name,
            kind: Kind::Plain,
            until: None,
            entries: vec![calls.tick],
            annotations: Annotations {
                return_to: calls.return_to,
                entered: of.entered(&of.playing.name, None),
                ..self.program.annotations.clone()
            },
            calls: called,
        })
    }

    /// The calls of functions of zones from the function at an address: each by the zone, what is
    /// called, its number in the frame and how many keys it ticks.
    fn calls_of_zones<'z>(
        &self,
        entry: u32,
        zones: impl Iterator<Item = (&'z ZoneCode, &'static str, u32, u32)>,
    ) -> Result<Vec<audit::Call>, NotCertified> {
        let mut costs = BTreeMap::new();
        for (zone, what, number, keys) in zones {
            let callee = find(self.program, &format!("{}_{what}", zone.name))?;
            costs.insert(callee, (number, keys));
        }
        self.calls_from(entry, &costs)
    }

    /// The calls of functions in what an entry leads to: each function with its number in the frame
    /// and how many keys it ticks.
    pub(super) fn calls_from(
        &self,
        entry: u32,
        costs: &BTreeMap<u32, (u32, u32)>,
    ) -> Result<Vec<audit::Call>, NotCertified> {
        let known = costs.keys().map(|callee| (None, *callee));
        let annotations = Annotations {
            known: known.map(|call| (call, Known::default())).collect(),
            ..self.program.annotations.clone()
        };
        let timing = self.board.timing();
        let graph = Graph::build(
            &Query {
                core: &timing,
                code: &self.program.code,
                entry,
                annotations: &annotations,
                interference: None,
            },
            &Tables::default(),
        )?;
        let call = |block: &Block, edge: &Edge| {
            let (site, callee) = (block.last()?.address, edge.taken?.address);
            Some(audit::Call {
                site,
                callee,
                costs: Some(*costs.get(&callee)?),
            })
        };
        let blocks = graph.blocks.iter();
        let calls = blocks.flat_map(|block| block.edges.iter().filter_map(|e| call(block, e)));
        Ok(calls.collect())
    }
}
