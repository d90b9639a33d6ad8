//! What happened in a run, in numbers.

use crate::trace::EventRow;

/// So many events of a kind can be listed one by one without a file.
pub const LISTED_MAX: usize = 20;

/// What happened in a run, in numbers.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Happenings {
    /// How many strikes: the marked event.
    pub strikes: usize,
    /// Everything that happened, strikes too.
    pub events: usize,
    /// Samples of the sound that were cut off at full scale; none where it was not written.
    pub clipped_samples: usize,
    /// What was emitted, by the kind of event, in the order in which they came first.
    pub emitted: Vec<Emitted>,
}

/// Events of a kind that were emitted.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Emitted {
    /// The name of the event.
    pub event: String,
    /// How many.
    pub count: usize,
    /// The first [`LISTED_MAX`] of them.
    pub first: Vec<EventRow>,
    /// When the first and the last were (s).
    pub between_s: (f64, f64),
    /// The first argument: its title, and its least, greatest and summed value (SI).
    pub argument: Option<(String, [f64; 3])>,
}

impl Happenings {
    pub(super) fn add_emission(&mut self, row: &EventRow) {
        let known = self.emitted.iter().position(|e| e.event == row.event);
        let kind = known.unwrap_or_else(|| {
            self.emitted.push(Emitted {
                event: row.event.clone(),
                ..Emitted::default()
            });
            self.emitted.len() - 1
        });
        self.emitted[kind].add(row);
    }
}

impl Emitted {
    fn add(&mut self, event: &EventRow) {
        if self.count == 0 {
            self.between_s.0 = event.t_s;
        }
        if self.first.len() < LISTED_MAX {
            self.first.push(event.clone());
        }
        self.between_s.1 = event.t_s;
        self.count += 1;
        let Some((title, value)) = event.args.first() else {
            return;
        };
        let start = (title.clone(), [f64::INFINITY, f64::NEG_INFINITY, 0.0]);
        let (_, [least, greatest, sum]) = self.argument.get_or_insert(start);
        *least = least.min(*value);
        *greatest = greatest.max(*value);
        *sum += value;
    }
}
