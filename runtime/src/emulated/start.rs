//! The start of a board: its cores begin, force comes up, and the keys go back to their beginning.

use whippen_compiler::firmware::CORES;
use whippen_compiler::thumb::Built;

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
                let piece = self.pieces(core).swap_remove(at);
                self.put_back(&piece, state)?;
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

    /// What has a memory: the zones of a core, and the parts of an instrument with core 0's.
    fn pieces(&self, core: usize) -> Vec<(String, Built)> {
        let zones = self.zones(core).iter();
        let zones = zones.map(|zone| (zone.name.clone(), zone.built.clone()));
        let parts = self.program().parts().filter(|_| core == 0);
        let parts = parts.map(|part| (part.name.clone(), part.built.clone()));
        zones.chain(parts).collect()
    }

    /// What a piece remembers, with all gains at 1.
    fn put_back(
        &mut self,
        (name, built): &(String, Built),
        mut memory: ZoneMemory,
    ) -> Result<(), String> {
        for key in 0..built.keys() {
            if let Some(gain) = built.layout.gain(key) {
                memory.state[gain as usize..][..4].copy_from_slice(&GAIN_ONE.to_le_bytes());
            }
        }
        let to = self.symbol(&format!("{name}_state"))?;
        self.write(to, &memory.state)?;
        match self.histories_of(name, built)? {
            Some((to, _)) => self.write(to, &memory.histories),
            None => Ok(()),
        }
    }

    /// Where the histories and delay lines of a piece are, and how many bytes they have.
    fn histories_of(&self, name: &str, built: &Built) -> Result<Option<(u32, u32)>, String> {
        let name = format!("{name}_histories");
        let mut symbols = built.object.symbols.iter();
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

    /// What the pieces of a core remember.
    fn states(&self, core: usize) -> Result<Vec<ZoneMemory>, String> {
        let memory = |(name, built): &(String, Built)| {
            let mut state = vec![0; built.layout.size() as usize];
            self.read(self.symbol(&format!("{name}_state"))?, &mut state)?;
            let mut histories = Vec::new();
            if let Some((at, bytes)) = self.histories_of(name, built)? {
                histories.resize(bytes as usize, 0);
                self.read(at, &mut histories)?;
            }
            Ok(ZoneMemory { state, histories })
        };
        self.pieces(core).iter().map(memory).collect()
    }
}
