//! Sound of a board: what its converter is given, a sample a tick.

use whippen_compiler::firmware::{mute_name, sound_table_name};

use super::Emulated;

impl Emulated {
    /// From now on samples are kept.
    ///
    /// # Errors
    /// The board has no converter.
    pub fn listen(&mut self) -> Result<(), String> {
        self.converter()?.listening = true;
        Ok(())
    }

    /// The samples, left and right, that have left since the last call: 2^30 is full scale. That of
    /// a tick leaves at the beginning of the next one.
    ///
    /// # Errors
    /// The board has no converter.
    pub fn take_samples(&mut self) -> Result<Vec<[i32; 2]>, String> {
        let mut samples = std::mem::take(&mut self.converter()?.heard);
        let before = self.samples_before.min(samples.len());
        self.samples_before -= before;
        Ok(samples.split_off(before))
    }

    /// The sample of the last tick: the board plays on for one more, which nobody counts.
    ///
    /// # Errors
    /// The board does not play on.
    pub fn take_last_sample(&mut self) -> Result<Vec<[i32; 2]>, String> {
        if self.load.ticks == 0 {
            return Ok(Vec::new());
        }
        let (words, frames) = (self.last_words.clone(), self.frames.clone());
        self.serve(&words)?;
        self.frames = frames;
        self.take_samples()
    }

    /// The first sample that leaves from now on is of the tick before. Keys that only the board
    /// has are not heard.
    pub(super) fn begin_sound(&mut self) -> Result<(), String> {
        self.converter()?.heard.clear();
        self.samples_before = 1;
        let zones = self.cores().flat_map(|core| self.zones(core).to_vec());
        let zones: Vec<_> = zones.collect();
        let channels = zones.iter().map(|zone| zone.channels.len());
        let row_bytes = 4 * channels.max().unwrap_or(0) as u32;
        if row_bytes == 0 {
            return Ok(());
        }
        let mut first = 0;
        for core in self.cores() {
            let table = self.symbol(&sound_table_name(0, core))?;
            let mute = self.symbol(&mute_name(core))?.to_le_bytes();
            let keys = self.image.keys_of_cores[core];
            for key in 0..keys {
                if (first + key) as usize >= self.keys {
                    for at in (0..row_bytes).step_by(4) {
                        self.write(table + row_bytes * key + at, &mute)?;
                    }
                }
            }
            first += keys;
        }
        Ok(())
    }
}
