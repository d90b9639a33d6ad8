//! Peak-detect decimation: a column over time in bounded memory.
//!
//! ```text
//!   few ticks    every value
//!   many         of every stretch of 2^n ticks   first  lowest  highest  last
//!   more         neighbouring stretches become one, n grows
//! ```
//!
//! As an oscilloscope keeps the lowest and the highest sample of what one column of its screen
//! covers, so no peak is lost however long a run lasts. A state machine keeps of every stretch the
//! first visit of each state, so no state is lost either. What may grow without bound, because all
//! values are asked for afterwards, is a record of every tick ([`Record::whole`]).
//!
//! Not here: what is drawn of it (`plot::decimate`, `report::knots`).

/// A tick and its value.
pub type Kept = (usize, f64);

/// So many ticks are kept one by one: 11.9 s at 44.1 kHz, 4 MB.
pub const HEAD_MAX: usize = 1 << 19;

/// The first stretches have so many ticks.
const STRETCH_FIRST: usize = 16;

/// So many stretches are kept, in as much memory as the head.
const STRETCHES_MAX: usize = 1 << 16;

/// A column over time.
#[derive(Debug, Clone, PartialEq)]
pub struct Record {
    ticks: usize,
    /// Ticks that are kept one by one.
    head_max: usize,
    /// Whether the first ticks stay when there are more.
    keeps_head: bool,
    /// Whether values are states, of which there are few, and not numbers.
    of_states: bool,
    /// The first ticks.
    head: Vec<f64>,
    /// All ticks, where they are more than the head holds.
    thinned: Option<Thinned>,
}

/// Stretches, and what was kept of each.
#[derive(Debug, Clone, PartialEq)]
struct Thinned {
    /// Ticks of a stretch, a power of two.
    stretch: usize,
    /// What was kept of the stretches that are over.
    kept: Vec<Kept>,
    /// The values of the last stretch.
    open: Vec<Kept>,
}

impl Record {
    /// A record of every tick.
    pub fn whole() -> Record {
        Record {
            ticks: 0,
            head_max: usize::MAX,
            keeps_head: true,
            of_states: false,
            head: Vec::new(),
            thinned: None,
        }
    }

    /// A record of numbers that takes at most a few megabytes.
    pub fn bounded() -> Record {
        Record {
            head_max: HEAD_MAX,
            keeps_head: false,
            ..Record::whole()
        }
    }

    /// As [`Record::bounded`], for the states of a machine.
    pub fn bounded_states() -> Record {
        Record {
            of_states: true,
            ..Record::bounded()
        }
    }

    /// The same, which keeps its first [`HEAD_MAX`] ticks one by one besides.
    #[must_use]
    pub fn with_head(self) -> Record {
        Record {
            keeps_head: true,
            ..self
        }
    }

    /// Adds the value of the next tick.
    pub fn push(&mut self, value: f64) {
        let tick = self.ticks;
        self.ticks += 1;
        if tick < self.head_max {
            self.head.push(value);
            return;
        }
        let of_states = self.of_states;
        let thinned = self
            .thinned
            .get_or_insert_with(|| Thinned::of(&self.head, of_states));
        if tick == self.head_max && !self.keeps_head {
            self.head = Vec::new();
        }
        thinned.push((tick, value), of_states);
    }

    /// How many ticks it covers.
    pub fn ticks(&self) -> usize {
        self.ticks
    }

    /// The value of every tick, where all are kept.
    pub fn values(&self) -> Option<&[f64]> {
        self.thinned.is_none().then_some(&self.head)
    }

    /// The value of every tick of a record that keeps all of them; else those of the first ticks.
    pub fn into_values(self) -> Vec<f64> {
        self.head
    }

    /// The first ticks, one by one; none where they were not kept beyond [`HEAD_MAX`] ticks.
    pub fn head(&self) -> &[f64] {
        &self.head
    }

    /// Of so many ticks the first, lowest, highest and last value are kept; 1 where all are.
    pub fn stretch(&self) -> usize {
        self.thinned.as_ref().map_or(1, |t| t.stretch)
    }

    /// What was kept, by rising tick.
    pub fn points(&self) -> impl Iterator<Item = Kept> {
        let (head, kept, open) = match &self.thinned {
            None => (&self.head[..], &[][..], &[][..]),
            Some(thinned) => (&[][..], &thinned.kept[..], &thinned.open[..]),
        };
        let one_by_one = head.iter().copied().enumerate();
        one_by_one.chain(kept.iter().chain(open).copied())
    }

    /// The lowest and the highest finite value.
    pub fn extent(&self) -> Option<(f64, f64)> {
        let finite = self.points().map(|p| p.1).filter(|v| v.is_finite());
        finite.fold(None, |extent, value| {
            let (low, high) = extent.unwrap_or((value, value));
            Some((value.min(low), value.max(high)))
        })
    }
}

impl From<Vec<f64>> for Record {
    fn from(values: Vec<f64>) -> Record {
        Record {
            ticks: values.len(),
            head: values,
            ..Record::whole()
        }
    }
}

impl Thinned {
    fn of(values: &[f64], of_states: bool) -> Thinned {
        let mut thinned = Thinned {
            stretch: STRETCH_FIRST,
            kept: Vec::new(),
            open: Vec::new(),
        };
        for point in values.iter().copied().enumerate() {
            thinned.push(point, of_states);
        }
        thinned
    }

    fn push(&mut self, point: Kept, of_states: bool) {
        if point.0.is_multiple_of(self.stretch) && !self.open.is_empty() {
            thin(&self.open, of_states, &mut self.kept);
            self.open.clear();
            if point.0 / self.stretch == STRETCHES_MAX {
                self.double(of_states);
            }
        }
        self.open.push(point);
    }

    /// Two stretches become one: the extremes of both are among those of each.
    fn double(&mut self, of_states: bool) {
        self.stretch *= 2;
        let mut kept = Vec::with_capacity(self.kept.len() / 2);
        let of = |point: &Kept| point.0 / self.stretch;
        for stretch in self.kept.chunk_by(|a, b| of(a) == of(b)) {
            thin(stretch, of_states, &mut kept);
        }
        self.kept = kept;
    }
}

/// Adds what is kept of a stretch.
fn thin(stretch: &[Kept], of_states: bool, to: &mut Vec<Kept>) {
    let mut kept: Vec<Kept> = stretch
        .first()
        .into_iter()
        .chain(stretch.last())
        .copied()
        .collect();
    if of_states {
        let mut seen: Vec<f64> = Vec::new();
        for &(tick, value) in stretch {
            if !seen.contains(&value) {
                seen.push(value);
                kept.push((tick, value));
            }
        }
    } else {
        let finite = || stretch.iter().copied().filter(|p| p.1.is_finite());
        // The first of equal ones.
        kept.extend(finite().reduce(|low, p| if p.1 < low.1 { p } else { low }));
        kept.extend(finite().reduce(|high, p| if p.1 > high.1 { p } else { high }));
        kept.extend(stretch.iter().find(|p| !p.1.is_finite()));
    }
    kept.sort_by_key(|p| p.0);
    kept.dedup_by_key(|p| p.0);
    to.extend(kept);
}

#[cfg(test)]
mod tests {
    use super::*;

    fn filled(mut record: Record, ticks: usize, value: impl Fn(usize) -> f64) -> Record {
        (0..ticks).for_each(|tick| record.push(value(tick)));
        record
    }

    #[test]
    fn a_short_record_has_every_tick() {
        let record = filled(Record::bounded(), HEAD_MAX, |tick| tick as f64);
        assert_eq!(record.values().map(<[f64]>::len), Some(HEAD_MAX));
        assert_eq!((record.stretch(), record.points().count()), (1, HEAD_MAX));
        let whole = filled(Record::whole(), HEAD_MAX + 1, |tick| tick as f64);
        assert_eq!(whole.values().map(<[f64]>::len), Some(HEAD_MAX + 1));
    }

    #[test]
    fn a_long_record_keeps_every_peak_in_bounded_memory() {
        // Five minutes, with a peak of one tick in every tenth of a second.
        let (ticks, apart) = (300 * 44_100, 4410);
        let value = |tick: usize| match tick % apart {
            1234 => 1.0 + tick as f64,
            2345 => -1.0 - tick as f64,
            _ => 0.0,
        };
        let record = filled(Record::bounded().with_head(), ticks, value);
        assert_eq!((record.ticks(), record.values()), (ticks, None));
        assert_eq!(record.head().len(), HEAD_MAX);
        assert!(record.points().count() <= 4 * STRETCHES_MAX + record.stretch());
        let mut kept = record.points();
        for tick in (0..ticks).filter(|tick| value(*tick) != 0.0) {
            assert!(kept.any(|point| point == (tick, value(tick))), "{tick}");
        }
        let points: Vec<Kept> = record.points().collect();
        assert!(points.windows(2).all(|w| w[0].0 < w[1].0));
        assert!(points.iter().all(|p| p.1 == value(p.0)));
        assert_eq!((points[0].0, points[points.len() - 1].0), (0, ticks - 1));
        let last = ticks - apart;
        let extent = (value(last + 2345), value(last + 1234));
        assert_eq!(record.extent(), Some(extent));
    }

    #[test]
    fn a_long_record_of_states_keeps_every_visit() {
        let ticks = 3 * HEAD_MAX;
        let value = |tick: usize| match tick {
            700_000 => 2.0,
            700_001 => 3.0,
            _ if (tick / 100_000).is_multiple_of(2) => 0.0,
            _ => 1.0,
        };
        let record = filled(Record::bounded_states(), ticks, value);
        assert!(record.values().is_none() && record.head().is_empty());
        let points: Vec<Kept> = record.points().collect();
        assert!(points.contains(&(700_000, 2.0)) && points.contains(&(700_001, 3.0)));
        assert!(points.len() < 2 * ticks / STRETCH_FIRST + 16);
    }

    #[test]
    fn what_is_not_finite_stays_a_gap() {
        let value = |tick: usize| if tick == 600_003 { f64::NAN } else { 1.0 };
        let record = filled(Record::bounded(), 2 * HEAD_MAX, value);
        let gaps: Vec<usize> = record
            .points()
            .filter(|p| p.1.is_nan())
            .map(|p| p.0)
            .collect();
        assert_eq!((gaps, record.extent()), (vec![600_003], Some((1.0, 1.0))));
        assert_eq!(Record::from(vec![f64::NAN]).extent(), None);
    }
}
