//! What is proven while one program plays, by zones and modes.

use whippen_compiler::budget::{Bound, Bounded, Budget, ZoneBound};
use whippen_compiler::check::note_name;
use whippen_compiler::deadline_diagnostic::WorstMode;
use whippen_compiler::keyboard::{self, ProgramId, ZoneId};
use whippen_compiler::mode_names::mode_names;
use whippen_compiler::pipeline::{Compiled, ProgramProof};
use whippen_runtime::image::ImageInstrument;

use crate::cmd::setup::ImageSetup;

/// What is proven while one program plays.
pub struct ProgramReport<'a> {
    /// Its number in the image.
    pub id: ProgramId,
    pub program: &'a keyboard::Program,
    /// From the lowest keys up.
    pub zones: Vec<ZoneReport<'a>>,
    pub cores: Vec<Bounded>,
    pub budget: Budget,
}

/// What is shown of a zone besides its bounds.
pub struct ZoneReport<'a> {
    pub compiled: &'a Compiled,
    pub of: &'a keyboard::Zone,
    /// Its keys by their notes, where not all keys play it.
    pub notes: Option<String>,
    /// The modes of a key, in words.
    pub modes: Vec<String>,
}

impl<'a> ProgramReport<'a> {
    pub fn new(
        setup: &'a ImageSetup,
        instruments: &[ImageInstrument],
        (id, program): (ProgramId, &'a keyboard::Program),
        proof: ProgramProof,
    ) -> Self {
        let zone = |of: &'a keyboard::Zone| {
            let compiled = &setup.instruments[of.instrument.index()];
            let note = |key: u32| note_name(setup.layout.note_of(key));
            let notes = || format!("{} .. {}", note(of.keys.first), note(of.keys.end - 1));
            let modes = instruments[of.instrument.index()].modes_of_zone();
            ZoneReport {
                compiled,
                of,
                notes: program.is_split().then(notes),
                modes: mode_names(&compiled.model, modes),
            }
        };
        ProgramReport {
            id,
            program,
            zones: program.zones.iter().map(zone).collect(),
            cores: proof.cores,
            budget: proof.budget,
        }
    }

    /// The mode that costs most, and its bound with nobody else at the bus.
    pub fn worst_case(&self) -> WorstMode<'_> {
        let id = self.slowest_zone();
        let modes = &self.zone(id).modes;
        let bounds = self
            .bounds(id)
            .flat_map(|(alone, _)| modes.iter().zip(&alone.tick.modes));
        let slowest = bounds.max_by_key(|(_, (_, bound))| bound.cycles_max);
        let (mode, bound) = slowest.map_or(
            ("any state", &self.cores[0].alone.handler),
            |(name, (_, bound))| (name.as_str(), bound),
        );
        WorstMode { mode, bound }
    }

    /// Whether it is no program of keys.
    pub fn is_once(&self) -> bool {
        !self.zones[0].compiled.model.is_of_key()
    }

    /// What its bounds are of.
    pub fn one(&self) -> &'static str {
        if self.is_once() {
            "the instrument"
        } else {
            "a key"
        }
    }

    /// What is played.
    pub fn all(&self) -> &'static str {
        if self.is_once() {
            "the instrument"
        } else {
            "the keys"
        }
    }

    /// The zone of that number.
    pub fn zone(&self, id: ZoneId) -> &ZoneReport<'a> {
        &self.zones[id.index()]
    }

    /// All zones with their numbers.
    pub fn numbered_zones(&self) -> impl DoubleEndedIterator<Item = (ZoneId, &ZoneReport<'a>)> {
        let numbered = self.zones.iter().enumerate();
        numbered.map(|(number, zone)| (ZoneId(number as u32), zone))
    }

    /// The zone whose keys take the most cycles; of equal ones the first.
    pub fn slowest_zone(&self) -> ZoneId {
        let cycles = |id: ZoneId| {
            let bounds = self.bounds(id);
            bounds.map(|(alone, _)| alone.tick.key_cycles_max()).max()
        };
        let zones = self.numbered_zones().rev().map(|(id, _)| id);
        zones.max_by_key(|id| cycles(*id)).unwrap_or(ZoneId(0))
    }

    /// The bounds of a zone's keys on each core, alone and contended.
    pub fn bounds(&self, zone: ZoneId) -> impl Iterator<Item = (&ZoneBound, &ZoneBound)> {
        let all = self
            .cores
            .iter()
            .flat_map(|core| core.alone.zones.iter().zip(&core.contended.zones));
        all.filter(move |(alone, _)| alone.of.zone == zone)
    }

    /// The bounds of one mode of a zone on each core, alone and contended.
    pub fn mode(&self, zone: ZoneId, index: usize) -> impl Iterator<Item = (&Bound, &Bound)> {
        self.bounds(zone).filter_map(move |(alone, contended)| {
            Some((
                &alone.tick.modes.get(index)?.1,
                &contended.tick.modes.get(index)?.1,
            ))
        })
    }
}
