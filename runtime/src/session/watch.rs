//! From places to words, and what is cut off on the way.

use whippen_compiler::model::Sense;
use whippen_compiler::rate::Rate;

use crate::device::Port;

/// What was cut off in a tick, of any port.
#[derive(Debug, Clone, Copy, Default)]
pub struct Cut {
    /// It was beyond what the sensor reads.
    pub at_sensor: bool,
    /// It was beyond the range the instrument senses.
    pub at_range: bool,
    /// The slew limit held it back.
    pub held: bool,
}

/// A port of a run.
pub struct WatchedPort<'a> {
    sense: &'a Sense,
    port: &'a Port,
    /// Words the sense accepts, and how far it lets them move in a tick.
    accepted: (i64, i64),
    step: Option<i64>,
    last: Option<i64>,
    /// How often a tick the sensor is read, if not in each.
    updates_per_tick: Option<f64>,
    /// The number of the last update, and what it read.
    read: Option<(u64, f64)>,
}

impl<'a> WatchedPort<'a> {
    pub fn new(sense: &'a Sense, port: &'a Port, rate_hz: Rate) -> WatchedPort<'a> {
        let scales = port.scales();
        let update_hz = port.sensor.update_hz;
        let per_tick = update_hz.map(|hz| hz / f64::from(rate_hz));
        WatchedPort {
            sense,
            port,
            accepted: scales.words_in(sense.range),
            step: sense
                .slew_per_s
                .map(|speed| scales.words_per_tick(speed, rate_hz)),
            last: None,
            updates_per_tick: per_tick.filter(|updates| *updates < 1.0),
            read: None,
        }
    }

    /// The word of a tick. A sensor that is read less often than there are ticks holds what it has
    /// read.
    pub fn word(&mut self, tick: usize, place: f64, cut: &mut Cut) -> u16 {
        let place = self.held(tick, place);
        let (word, clipped) = self.port.word(place);
        let (low, high) = self.accepted;
        let wide = i64::from(word).clamp(low, high);
        let range = self.sense.range;
        let held = match (self.last, self.step) {
            (Some(last), Some(step)) => wide.clamp(last - step, last + step),
            _ => wide,
        };
        cut.at_sensor |= clipped;
        cut.at_range |= place < range.low || place > range.high;
        cut.held |= held != wide;
        self.last = Some(held);
        word
    }

    /// What the sensor has read, with its noise.
    fn held(&mut self, tick: usize, place: f64) -> f64 {
        let Some(updates) = self.updates_per_tick else {
            return self.port.read(0, tick, place);
        };
        let update = (tick as f64 * updates) as u64;
        match self.read {
            Some((last, read)) if last == update => read,
            _ => {
                let place = self.port.read(0, tick, place);
                self.read = Some((update, place));
                place
            }
        }
    }
}
