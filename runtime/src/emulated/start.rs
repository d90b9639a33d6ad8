//! The start of a board: its cores begin, force comes up, and the keys go back to their beginning.

use whippen_compiler::firmware::CORES;
use whippen_compiler::thumb::StateLayout;

use super::{Emulated, Frames};

/// Ticks after which a board that does not play will not.
const START_TICKS: u32 = 44_100;

/// The gain of a key with all its force.
const GAIN_ONE: u32 = 1 << 16;

impl Emulated {
    /// Starts the board, lets force come up, puts the keys back to their beginning.
    pub(super) fn begin(&mut self, words: &[u16]) -> Result<(), String> {
        self.give(words)?;
        let entry = |core: usize| self.symbol(&format!("{}_tick", CORES[core]));
        let entries: Vec<u32> = self.cores().map(entry).collect::<Result<_, _>>()?;
        entries
            .iter()
            .for_each(|&entry| self.machine.set_breakpoint(entry));
        let mut fresh: Vec<Option<Vec<Vec<u8>>>> = vec![None; entries.len()];
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
                let (name, layout) = self.pieces(core)[at].clone();
                self.put_back(&name, &layout, state)?;
            }
        }
        self.frames = Frames::default();
        Ok(())
    }

    fn begins(&mut self) -> Result<(), String> {
        if self.ticks()? < START_TICKS {
            Ok(())
        } else {
            Err("the board does not begin to play: its ticks may be too long (`whippen budget` says how many keys fit)"
                .to_string())
        }
    }

    /// What has a state: the zones of a core, and the parts of an instrument with core 0's.
    fn pieces(&self, core: usize) -> Vec<(String, StateLayout)> {
        let zones = self.zones(core).iter();
        let zones = zones.map(|zone| (zone.name.clone(), zone.layout().clone()));
        let parts = self.program().parts().filter(|_| core == 0);
        let parts = parts.map(|part| (part.name.clone(), part.built.layout.clone()));
        zones.chain(parts).collect()
    }

    /// A state, with all gains at 1.
    fn put_back(
        &mut self,
        name: &str,
        layout: &StateLayout,
        mut state: Vec<u8>,
    ) -> Result<(), String> {
        for key in 0..layout.keys() {
            if let Some(gain) = layout.gain(key) {
                state[gain as usize..][..4].copy_from_slice(&GAIN_ONE.to_le_bytes());
            }
        }
        let to = self.symbol(&format!("{name}_state"))?;
        self.write(to, &state)
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

    /// The states of a core's pieces.
    fn states(&self, core: usize) -> Result<Vec<Vec<u8>>, String> {
        let state = |(name, layout): &(String, StateLayout)| {
            let mut state = vec![0; layout.size() as usize];
            self.read(self.symbol(&format!("{name}_state"))?, &mut state)?;
            Ok(state)
        };
        self.pieces(core).iter().map(state).collect()
    }
}
