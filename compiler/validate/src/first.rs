//! What memory holds before `init`, in the bytes of the image: what the Kernel says that it holds.
//!
//! Not here: numbers, gains and constants of keys, and the values that a key's code finds in live
//! ones, which are in their range.

use whippen_kernel::Type;

use crate::places::Question;
use crate::stop::{Doubt, Reason};

impl Question<'_> {
    /// The words of each cell before `init`, with where they begin in the record.
    pub(crate) fn first_cells(&self) -> Vec<(u32, Vec<i32>)> {
        let cells = self.places.cells.iter().zip(&self.modes.kernel.cells);
        let cells = cells.map(|(at, cell)| {
            let number = match cell.ty {
                Type::I64 => vec![cell.init as i32, (cell.init >> 32) as i32],
                _ => vec![cell.init as i32],
            };
            (*at, number.repeat(cell.len as usize))
        });
        cells.collect()
    }

    /// Whether the state and histories are as the Kernel says: the code of each record is that of
    /// mode 0, and behind the last one the end's; cells; rings, events and ticks at their
    /// beginning; live values within their ranges; slots that `init` does not fill.
    ///
    /// # Errors
    /// What is otherwise.
    pub(crate) fn check_first(&self) -> Result<(), Doubt> {
        let places = self.places;
        let record = |key: u32| places.records + key * places.record_bytes;
        let cells = self.first_cells();
        for key in 0..places.keys {
            let what = || format!("key {key}");
            self.holds(record(key), self.symbols.modes[0] | 1, || {
                format!("the code of {}", what())
            })?;
            for ((at, words), cell) in cells.iter().zip(&self.modes.kernel.cells) {
                for (word, offset) in words.iter().zip((0..).step_by(4)) {
                    let at = record(key) + at + offset;
                    self.holds(at, *word as u32, || {
                        format!("cell `{}` of {}", cell.name, what())
                    })?;
                }
            }
        }
        let last = record(places.keys);
        self.holds(last, self.symbols.end | 1, || "the end".to_string())?;
        self.holds(places.tick, 0, || "the number of the tick".to_string())?;
        for line in &places.lines {
            self.holds(line.ring, 0, || "the slot of a line".to_string())?;
        }
        if let Some(ring) = places.events {
            for at in [ring.head, ring.tail, ring.lost] {
                self.holds(at, 0, || "the ring of events".to_string())?;
            }
        }
        for (live, at) in self.modes.kernel.lives.iter().zip(&places.lives) {
            let found = self.first(*at)? as i32;
            if !live.range.has(found.into()) {
                return Err(otherwise(&format!("`{}` is outside its range", live.name)));
            }
        }
        self.check_slots()
    }

    fn check_slots(&self) -> Result<(), Doubt> {
        let from = match self.places.apart {
            Some(at) => self.first(at)?,
            None => self.symbols.state,
        };
        for line in self.modes.kernel.unfilled_lines() {
            let (place, line) = (&self.places.lines[line], &self.modes.kernel.lines[line]);
            let value = line.first_value() as u32;
            for row in 0..place.len {
                for key in 0..self.places.keys {
                    let at = place.at + row * place.row + key * u32::from(place.bytes());
                    let found = self.code.first_bytes(from.wrapping_add(at), place.bytes());
                    if found != Some(value) {
                        return Err(otherwise(&format!("a slot of line `{}`", line.name)));
                    }
                }
            }
        }
        Ok(())
    }

    /// What a word of the state holds.
    fn first(&self, at: u32) -> Result<u32, Doubt> {
        let found = self.code.first_word(self.symbols.state.wrapping_add(at));
        found.ok_or_else(|| {
            let why = format!("the image does not say what the state holds at {at:#x}");
            Doubt::new(Reason::Entry, why)
        })
    }

    fn holds(&self, at: u32, wanted: u32, what: impl Fn() -> String) -> Result<(), Doubt> {
        match self.first(at)? == wanted {
            true => Ok(()),
            false => Err(otherwise(&format!("{} is otherwise", what()))),
        }
    }
}

/// It is certain that memory holds something else.
fn otherwise(what: &str) -> Doubt {
    Doubt {
        is_certain: true,
        ..Doubt::new(Reason::Values, format!("before `init`: {what}"))
    }
}
