//! Events of a board: what the keys' code puts into their rings, taken out after each tick.

use whippen_compiler::kernel::Happened;
use whippen_compiler::thumb::EVENT_MARK;

use super::Emulated;

impl Emulated {
    /// Events since the last call.
    pub fn drain(&mut self) -> Vec<Happened> {
        let of_cores: Result<Vec<Vec<Happened>>, String> =
            self.cores().map(|core| self.events(core)).collect();
        match of_cores {
            Ok(all) => all.concat(),
            Err(why) => {
                self.trouble.get_or_insert(why);
                Vec::new()
            }
        }
    }

    /// What a core's keys emitted since the last call.
    fn events(&mut self, core: usize) -> Result<Vec<Happened>, String> {
        let mut all = Vec::new();
        for at in 0..self.zones(core).len() {
            let (happened, taken) = self.events_of(core, at)?;
            self.taken[core][at] = taken;
            all.extend(happened);
        }
        // One zone after the other has told its ticks.
        if self.zones(core).len() > 1 {
            all.sort_by_key(|happened| happened.tick);
        }
        Ok(all)
    }

    /// What a zone's keys emitted, and how many bytes of it are taken then.
    fn events_of(&self, core: usize, at: usize) -> Result<(Vec<Happened>, u32), String> {
        let (zone, mut taken) = (&self.zones(core)[at], self.taken[core][at]);
        let Some(ring) = zone.layout().events() else {
            return Ok((Vec::new(), taken));
        };
        let kernel = &self.kernels[self.program().instrument_of(zone).index()];
        let state = self.state_of(zone)?;
        let start = self.symbol(&format!("{}_events", zone.name))? + ring.start;
        if self.word(state + ring.lost)? > 0 {
            return Err("more events in a tick than the ring holds".to_string());
        }
        let head = self.word(state + ring.head)?;
        let first = if core == 0 {
            0
        } else {
            self.image.keys_of_cores[0]
        };
        let mut all = Vec::new();
        while taken != head {
            let record = |at: u32| self.word(start + (taken.wrapping_add(at) & (ring.bytes - 1)));
            let (tick, what) = (record(0)?, record(4)?);
            if what == EVENT_MARK {
                taken = ring.behind_mark(taken);
                continue;
            }
            let event = what >> 16;
            let args = kernel
                .events
                .get(event as usize)
                .map_or(0, |event| event.args);
            let args: Result<Vec<i32>, String> = (0..args)
                .map(|arg| Ok(record(8 + 4 * arg)? as i32))
                .collect();
            let key = (what & 0xffff) + first;
            let happened = Happened {
                tick: tick.into(),
                key,
                event,
                args: args?,
            };
            // The key that only the board has is nobody's.
            if (key as usize) < self.keys {
                all.push(happened);
            }
            taken = taken.wrapping_add(ring.event);
        }
        Ok((all, taken))
    }
}
