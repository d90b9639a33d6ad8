//! Programs and their zones, and the part of each core.

use whippen_ids::IdMap;

use crate::{CoreId, FixedKeys, InstrumentId, KeyRange, ZoneId, each_once};

/// A program: what each key plays.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct Program {
    /// Its name: that of the instrument that all keys play, or of its zones.
    pub name: String,
    /// By rising key; together all keys of the keyboard, each once.
    pub zones: IdMap<ZoneId, Zone>,
}

/// Neighbouring keys that play one instrument.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Zone {
    /// Which keys.
    pub keys: KeyRange,
    /// What they play.
    pub instrument: InstrumentId,
}

/// The keys of a core in a program.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct CoreKeys {
    /// The core.
    pub core: CoreId,
    /// All its keys.
    pub keys: KeyRange,
    /// By rising key: its part of each zone that reaches into them.
    pub zones: Vec<CoreZone>,
}

/// The part of a zone that a core has.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct CoreZone {
    /// The core.
    pub core: CoreId,
    /// Which zone of the program; the rest of it may be on another core.
    pub zone: ZoneId,
    /// Which keys.
    pub keys: KeyRange,
}

impl Program {
    /// Zones of so many keys each, from the lowest key up, and what they play.
    pub fn of_zones(name: &str, given: impl IntoIterator<Item = (u32, InstrumentId)>) -> Program {
        let mut zones: IdMap<ZoneId, Zone> = IdMap::new();
        for (count, instrument) in given {
            let first = zones.last().map_or(0, |zone| zone.keys.end);
            let keys = KeyRange::new(first, first + count);
            zones.push(Zone { keys, instrument });
        }
        Program {
            name: name.to_string(),
            zones,
        }
    }

    /// How many keys its zones have.
    pub fn keys(&self) -> u32 {
        self.zones.iter().map(|zone| zone.keys.count()).sum()
    }

    /// Whether not all its keys are in one zone.
    pub fn is_split(&self) -> bool {
        self.zones.len() > 1
    }

    /// The zone of that number.
    pub fn zone(&self, id: ZoneId) -> &Zone {
        &self.zones[id]
    }

    /// The zone of a key.
    pub fn zone_of_key(&self, key: u32) -> Option<&Zone> {
        self.zones.iter().find(|zone| zone.keys.contains(key))
    }

    /// Its instruments, each once.
    pub fn instruments(&self) -> Vec<InstrumentId> {
        each_once(self.all_instruments())
    }

    /// The instruments of its zones.
    pub(crate) fn all_instruments(&self) -> impl Iterator<Item = InstrumentId> {
        self.zones.iter().map(|zone| zone.instrument)
    }

    /// The same program on another number of keys.
    ///
    /// # Errors
    /// It has several zones, which are for other keys.
    pub fn with_keys(&self, keys: u32) -> Result<Program, FixedKeys> {
        let mut program = self.clone();
        match &mut *program.zones {
            [only] => only.keys = KeyRange::new(0, keys),
            _ if self.keys() == keys => {}
            _ => {
                return Err(FixedKeys {
                    program: self.name.clone(),
                    keys: self.keys(),
                    wanted: keys,
                });
            }
        }
        Ok(program)
    }

    /// These keys alone, of which the lowest is key 0 then. A zone without any of them is none.
    pub(crate) fn part(&self, keys: KeyRange) -> Program {
        let zones = self.zones.iter().filter_map(|zone| {
            let own = zone.keys.intersection(keys)?;
            Some((own.count(), zone.instrument))
        });
        Program::of_zones(&self.name, zones)
    }

    /// How cores have its keys: each core a run of neighbouring keys, so many of them.
    pub fn on_cores(&self, keys_of_cores: &[u32]) -> Vec<CoreKeys> {
        let mut first = 0;
        let part_of_core = |(core, &count): (u32, &u32)| {
            let keys = KeyRange::new(first, first + count);
            first = keys.end;
            self.on_core(CoreId(core), keys)
        };
        (0..).zip(keys_of_cores).map(part_of_core).collect()
    }

    fn on_core(&self, core: CoreId, keys: KeyRange) -> CoreKeys {
        let zones = self.zones.enumerated().filter_map(|(zone, of)| {
            let keys = of.keys.intersection(keys)?;
            Some(CoreZone { core, zone, keys })
        });
        CoreKeys {
            core,
            keys,
            zones: zones.collect(),
        }
    }
}

impl CoreKeys {
    /// The first key of one of its zones, counted from the core's first key.
    pub fn offset_of(&self, zone: &CoreZone) -> u32 {
        zone.keys.first - self.keys.first
    }
}
