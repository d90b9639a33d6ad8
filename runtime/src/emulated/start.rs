//! The start of a board: its cores begin, force comes up, and the keys go back to their beginning.

use whippen_compiler::firmware::{CORES, ZoneCode};

use super::{Emulated, Frames};

/// Ticks after which a board that does not play will not.
const START_TICKS: u32 = 44_100;

/// The gain of a key with all its force.
const GAIN_ONE: u32 = 1 << 16;

/// What the keys of a zone remember.
#[derive(Debug, Clone)]
struct ZoneMemory {
    state: Vec<u8>,
    histories: Vec<u8>,
}

impl Emulated {
    /// Starts the board, lets force come up, puts the keys back to their beginning.
    pub(super) fn begin(&mut self, words: &[u16]) -> Result<(), String> {
        self.give(words)?;
        let entry = |core: usize| self.symbol(&format!("{}_tick", CORES[core]));
        let entries: Vec<u32> = self.cores().map(entry).collect::<Result<_, _>>()?;
        entries
            .iter()
            .for_each(|&entry| self.machine.set_breakpoint(entry));
        let mut fresh: Vec<Option<Vec<ZoneMemory>>> = vec![None; entries.len()];
        while fresh.iter().any(Option::is_none) {
            if let Some(core) = self.slice(10_000)? {
                self.machine.clear_breakpoint(entries[core]);
                fresh[core] = Some(self.states(core)?);
            }
            self.begins()?;
        }
        while !self.all(|core| self.is_up(core))? {
            let next = self.ticks()? + 1;
            self.until_served(next)?;
            self.begins()?;
        }
        for (core, states) in fresh.into_iter().flatten().enumerate() {
            for (at, state) in states.into_iter().enumerate() {
                self.put_back(&self.zones(core)[at].clone(), state)?;
            }
        }
        self.frames = Frames::default();
        self.begin_sound()
    }

    fn begins(&mut self) -> Result<(), String> {
        if self.ticks()? < START_TICKS {
            Ok(())
        } else {
            Err("the board does not begin to play: its ticks may be too long (`whippen budget` says how many keys fit)"
                .to_string())
        }
    }

    /// What a zone's keys remember, with all gains at 1.
    fn put_back(&mut self, zone: &ZoneCode, mut memory: ZoneMemory) -> Result<(), String> {
        for key in 0..zone.keys() {
            if let Some(gain) = zone.layout().gain(key) {
                memory.state[gain as usize..][..4].copy_from_slice(&GAIN_ONE.to_le_bytes());
            }
        }
        let to = self.state_of(zone)?;
        self.write(to, &memory.state)?;
        match self.histories_of(zone)? {
            Some((to, _)) => self.write(to, &memory.histories),
            None => Ok(()),
        }
    }

    /// Where the histories and delay lines of a zone's keys are, and how many bytes they have.
    fn histories_of(&self, zone: &ZoneCode) -> Result<Option<(u32, u32)>, String> {
        let name = format!("{}_histories", zone.name);
        let mut symbols = zone.built.object.symbols.iter();
        let found = symbols.find(|symbol| symbol.name == name);
        found
            .map(|symbol| Ok((self.symbol(&name)?, symbol.size)))
            .transpose()
    }

    /// Whether all keys of a core have all their force.
    fn is_up(&self, core: usize) -> Result<bool, String> {
        for zone in self.zones(core) {
            let state = self.state_of(zone)?;
            for gain in (0..zone.keys()).filter_map(|key| zone.layout().gain(key)) {
                if self.word(state + gain)? != GAIN_ONE {
                    return Ok(false);
                }
            }
        }
        Ok(true)
    }

    /// What the zones of a core remember.
    fn states(&self, core: usize) -> Result<Vec<ZoneMemory>, String> {
        let memory = |zone: &ZoneCode| {
            let mut state = vec![0; zone.layout().size() as usize];
            self.read(self.state_of(zone)?, &mut state)?;
            let mut histories = Vec::new();
            if let Some((at, bytes)) = self.histories_of(zone)? {
                histories.resize(bytes as usize, 0);
                self.read(at, &mut histories)?;
            }
            Ok(ZoneMemory { state, histories })
        };
        self.zones(core).iter().map(memory).collect()
    }
}
