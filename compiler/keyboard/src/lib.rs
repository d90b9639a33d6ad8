//! The layout of a keyboard: which keys play which instrument in which program, and on which core.
//!
//! ```text
//!   Layout --< Program --< Zone { keys, instrument }     the checked program, or one instrument
//!                 `-- on_cores(division) --> CoreKeys --< CoreZone { core, zone, keys }
//! ```
//!
//! Keys are counted from 0 at the lowest key of the keyboard. These types are the only ones for
//! this idea; checker, image, bound, emulated board and reports borrow them.
//!
//! Not here: what an instrument is (whoever numbers them), which division is cheapest (the builder
//! of images).

mod ids;
mod range;
mod zone;

pub use ids::{CoreId, InstrumentId, ProgramId, ZoneId};
pub use range::KeyRange;
use whippen_ids::IdMap;
pub use zone::{CoreKeys, CoreZone, Program, Zone};

/// Chips that one keyboard can be divided over, at most.
pub const CHIPS_MAX: u32 = 16;

/// The keys of a keyboard and its programs, one of which plays at a time.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct Layout {
    /// MIDI number of the lowest key.
    pub first_note: u8,
    /// How many keys there are.
    pub keys: u32,
    /// At least one once it is checked; each has every key.
    pub programs: IdMap<ProgramId, Program>,
}

/// A program of several zones has other keys than were wanted.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct FixedKeys {
    /// The program's name.
    pub program: String,
    /// How many keys its zones have.
    pub keys: u32,
    /// How many were wanted.
    pub wanted: u32,
}

impl std::fmt::Display for FixedKeys {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(
            f,
            "`{}` are zones for the {} keys of their keyboard, not for {}",
            self.program, self.keys, self.wanted
        )
    }
}

impl std::error::Error for FixedKeys {}

impl Layout {
    /// One program in which instrument 0 has all keys.
    pub fn of_one_instrument(name: &str, keys: u32, first_note: u8) -> Layout {
        Layout {
            first_note,
            keys,
            programs: vec![Program::of_zones(name, [(keys, InstrumentId(0))])].into(),
        }
    }

    /// Programs with their numbers.
    pub fn numbered_programs(&self) -> impl Iterator<Item = (ProgramId, &Program)> {
        self.programs.enumerated()
    }

    /// The program of that number.
    pub fn program(&self, id: ProgramId) -> &Program {
        &self.programs[id]
    }

    /// The program of that name.
    pub fn program_named(&self, name: &str) -> Option<&Program> {
        self.programs.iter().find(|program| program.name == name)
    }

    /// The first program with several zones, if there is one.
    pub fn split_program(&self) -> Option<&Program> {
        self.programs.iter().find(|program| program.is_split())
    }

    /// MIDI number of the highest key.
    pub fn last_note(&self) -> u8 {
        self.note_of(self.keys.saturating_sub(1))
    }

    /// MIDI number of a key; 255 stands for all that have none.
    pub fn note_of(&self, key: u32) -> u8 {
        u8::try_from(u32::from(self.first_note).saturating_add(key)).unwrap_or(u8::MAX)
    }

    /// The key with a MIDI number, if there is one.
    pub fn key_of_note(&self, note: u8) -> Option<u32> {
        let key = u32::from(note.checked_sub(self.first_note)?);
        (key < self.keys).then_some(key)
    }

    /// All instruments that any program plays, each once, in the order of the programs.
    pub fn instruments(&self) -> Vec<InstrumentId> {
        each_once(self.programs.iter().flat_map(Program::all_instruments))
    }

    /// The same programs on another number of keys.
    ///
    /// # Errors
    /// A program of several zones is for other keys.
    pub fn with_keys(&self, keys: u32) -> Result<Layout, FixedKeys> {
        let programs = self
            .programs
            .iter()
            .map(|program| program.with_keys(keys))
            .collect::<Result<_, _>>()?;
        Ok(Layout {
            keys,
            programs,
            ..*self
        })
    }

    /// These keys alone, of which the lowest is key 0 then. A zone without any of them is none.
    pub fn part(&self, keys: KeyRange) -> Layout {
        let first_note = self.note_of(keys.first);
        let programs = self.programs.iter().map(|program| program.part(keys));
        Layout {
            first_note,
            keys: keys.count(),
            programs: programs.collect(),
        }
    }

    /// Only these programs, with their instruments numbered anew; and the old numbers, by the new
    /// ones.
    pub fn only(&self, wanted: impl Fn(&Program) -> bool) -> (Layout, Vec<InstrumentId>) {
        let programs = self.programs.iter().filter(|program| wanted(program));
        let mut layout = Layout {
            programs: programs.cloned().collect(),
            ..*self
        };
        let old = layout.instruments();
        let zones = layout.programs.iter_mut().flat_map(|p| &mut p.zones);
        for zone in zones {
            let new = (0..).zip(&old).find(|(_, old)| **old == zone.instrument);
            zone.instrument = InstrumentId(new.map_or(0, |(new, _)| new));
        }
        (layout, old)
    }
}

/// Ids in the order in which they first appear.
fn each_once(ids: impl Iterator<Item = InstrumentId>) -> Vec<InstrumentId> {
    let mut all: Vec<InstrumentId> = Vec::new();
    for id in ids {
        if !all.contains(&id) {
            all.push(id);
        }
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    fn split() -> Layout {
        let program = |name, zones: &[(u32, u32)]| {
            let zones = zones.iter().map(|&(keys, id)| (keys, InstrumentId(id)));
            Program::of_zones(name, zones)
        };
        Layout {
            first_note: 21,
            keys: 9,
            programs: vec![
                program("plain", &[(9, 4)]),
                program("split", &[(2, 7), (5, 4), (2, 7)]),
            ]
            .into(),
        }
    }

    #[test]
    fn cores_have_runs_of_neighbouring_keys() {
        let cores = split().program(ProgramId(1)).on_cores(&[6, 3]);
        let zones = |core: &CoreKeys| -> Vec<(u32, u32, u32)> {
            let zone = |z: &CoreZone| (z.zone.0, z.keys.first, z.keys.end);
            core.zones.iter().map(zone).collect()
        };
        assert_eq!(zones(&cores[0]), [(0, 0, 2), (1, 2, 6)]);
        assert_eq!(zones(&cores[1]), [(1, 6, 7), (2, 7, 9)]);
        assert_eq!(cores[1].keys, KeyRange::new(6, 9));
        assert_eq!(cores[1].zones[0].core, CoreId(1));
    }

    #[test]
    fn a_part_has_its_own_keys_from_zero_on() {
        let part = split().part(KeyRange::new(4, 9));
        assert_eq!((part.first_note, part.keys), (25, 5));
        let zones = |number| {
            let zones = part.program(ProgramId(number)).zones.iter();
            let zone = |z: &Zone| (z.keys.first, z.keys.end, z.instrument.0);
            zones.map(zone).collect::<Vec<_>>()
        };
        assert_eq!(zones(0), [(0, 5, 4)]);
        assert_eq!(zones(1), [(0, 3, 4), (3, 5, 7)]);
        assert_eq!(split().part(KeyRange::new(0, 9)), split());
    }

    #[test]
    fn instruments_are_numbered_anew() {
        let (layout, old) = split().only(|program| program.name == "split");
        assert_eq!(old, [InstrumentId(7), InstrumentId(4)]);
        assert_eq!(layout.programs.len(), 1);
        assert_eq!(layout.instruments(), [InstrumentId(0), InstrumentId(1)]);
    }

    #[test]
    fn zones_keep_their_keys() {
        let wanted = FixedKeys {
            program: "split".to_string(),
            keys: 9,
            wanted: 8,
        };
        assert_eq!(split().with_keys(8), Err(wanted));
        assert_eq!(split().with_keys(9), Ok(split()));
        let (plain, _) = split().only(|program| !program.is_split());
        let more = plain
            .with_keys(300)
            .map(|layout| layout.program(ProgramId(0)).keys());
        assert_eq!(more, Ok(300));
    }

    #[test]
    fn notes_and_keys_agree() {
        let layout = split();
        assert_eq!((layout.note_of(8), layout.last_note()), (29, 29));
        let keys = [20, 21, 29, 30].map(|note| layout.key_of_note(note));
        assert_eq!(keys, [None, Some(0), Some(8), None]);
    }
}
