//! How often something happens per second, exact.
//!
//! ```text
//!   44100        44100 Hz
//!   750000/17    44117.647.. Hz: a chip of 150 MHz that counts 3400 cycles
//! ```
//!
//! A chip's tick is a whole number of cycles, which is seldom a whole number of hertz, and a rate
//! that is off by half a hertz is a second off after a day. So a rate is a fraction.
//! Not here: units of time, clocks.

use std::fmt;
use std::str::FromStr;

/// Most ticks per second (Hz): more is no keyboard, whose converters take longer.
pub const HZ_MAX: u32 = 1_000_000;

/// A rate that was read from a number of hertz has no larger denominator.
pub const DENOMINATOR_MAX: u32 = 100_000;

/// Ticks per second: a fraction in lowest terms, at least one tick in 2^32 seconds.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Rate {
    ticks: u32,
    seconds: u32,
}

impl Rate {
    /// So many ticks in so many seconds; `None` where one of them is 0.
    pub const fn new(ticks: u32, seconds: u32) -> Option<Rate> {
        if ticks == 0 || seconds == 0 {
            return None;
        }
        let (mut a, mut b) = (ticks, seconds);
        while b != 0 {
            (a, b) = (b, a % b);
        }
        Some(Rate {
            ticks: ticks / a,
            seconds: seconds / a,
        })
    }

    /// A whole number of ticks a second, 1 at least.
    pub const fn whole(hz: u32) -> Rate {
        Rate {
            ticks: if hz == 0 { 1 } else { hz },
            seconds: 1,
        }
    }

    /// The fraction with the smallest denominator that is this number of hertz as an `f64`; `None`
    /// where it would be larger than 100000, or the number is not in 0 .. [`HZ_MAX`].
    pub fn of_hz(hz: f64) -> Option<Rate> {
        if !(hz > 0.0 && hz <= f64::from(HZ_MAX)) {
            return None;
        }
        // Convergents of the continued fraction; the first that rounds to the number is it.
        let ([mut before, mut last], mut rest) = ([[0.0, 1.0], [1.0, 0.0]], hz);
        loop {
            let whole = rest.floor();
            let next = [whole * last[0] + before[0], whole * last[1] + before[1]];
            let [ticks, seconds] = next;
            if !(ticks <= f64::from(u32::MAX) && seconds <= f64::from(DENOMINATOR_MAX)) {
                return None;
            }
            // The last bit may be lost where a quotient was computed, as in 44.1 kHz.
            if (ticks / seconds - hz).abs() <= hz * f64::EPSILON {
                return Rate::new(ticks as u32, seconds as u32);
            }
            (before, last) = (last, next);
            rest = 1.0 / (rest - whole);
        }
    }

    /// As a constant expression of C and of Rust, and whether that is a float: `44100`, or
    /// `750000.0 / 17.0`, since 750000 / 17 is a whole number there.
    pub fn constant(self) -> (String, bool) {
        match self.fraction() {
            [whole, 1] => (whole.to_string(), false),
            [ticks, seconds] => (format!("{ticks}.0 / {seconds}.0"), true),
        }
    }

    /// In Hz, rounded.
    pub fn hz(self) -> f64 {
        f64::from(self.ticks) / f64::from(self.seconds)
    }

    /// Ticks, and the seconds in which there are so many.
    pub const fn fraction(self) -> [u32; 2] {
        [self.ticks, self.seconds]
    }

    /// The nearest whole number of hertz, 1 at least.
    pub fn rounded_hz(self) -> u32 {
        (self.hz().round() as u32).max(1)
    }

    /// Whole cycles that every tick has: where ticks are not a whole number of cycles, some have
    /// one more.
    pub fn cycles_min(self, clock_hz: u32) -> u64 {
        u64::from(clock_hz) * u64::from(self.seconds) / u64::from(self.ticks)
    }

    /// The slowest clock (Hz) with so many cycles in every tick.
    pub fn clock_hz_min(self, cycles: u64) -> u64 {
        let cycles = u128::from(cycles) * u128::from(self.ticks);
        u64::try_from(cycles.div_ceil(u128::from(self.seconds))).unwrap_or(u64::MAX)
    }

    /// The cycle in which a tick begins, counted from the one in which tick 0 does.
    pub fn cycle(self, tick: u64, clock_hz: u32) -> u64 {
        let cycles = u128::from(tick) * u128::from(clock_hz) * u128::from(self.seconds);
        (cycles / u128::from(self.ticks)) as u64
    }

    /// Whole ticks in a number of milliseconds.
    pub fn ticks_in(self, ms: u64) -> u64 {
        (u128::from(ms) * u128::from(self.ticks) / (1000 * u128::from(self.seconds))) as u64
    }
}

/// 44100 Hz.
impl Default for Rate {
    fn default() -> Rate {
        Rate::whole(44_100)
    }
}

/// A whole number of hertz, as [`Rate::whole`] takes it.
impl From<u32> for Rate {
    fn from(hz: u32) -> Rate {
        Rate::whole(hz)
    }
}

impl From<Rate> for f64 {
    fn from(rate: Rate) -> f64 {
        rate.hz()
    }
}

/// `750000/17`; with `{:#}` it is `44117.647 (750000/17)`.
impl fmt::Display for Rate {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.fraction() {
            [whole, 1] => write!(f, "{whole}"),
            [ticks, seconds] if f.alternate() => {
                write!(f, "{:.3} ({ticks}/{seconds})", self.hz())
            }
            [ticks, seconds] => write!(f, "{ticks}/{seconds}"),
        }
    }
}

impl FromStr for Rate {
    type Err = ();

    /// What `Display` writes, in any terms.
    fn from_str(text: &str) -> Result<Rate, ()> {
        let (ticks, seconds) = text.split_once('/').unwrap_or((text, "1"));
        let number = |text: &str| text.parse().map_err(drop);
        Rate::new(number(ticks)?, number(seconds)?).ok_or(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_rate_is_exact_from_hertz_and_back() {
        let knob = Rate::new(150_000_000, 3400).expect("a rate");
        assert_eq!(knob.to_string(), "750000/17");
        assert_eq!(knob.constant(), ("750000.0 / 17.0".to_string(), true));
        assert_eq!(format!("{knob:#}"), "44117.647 (750000/17)");
        assert_eq!(Rate::of_hz(150e6 / 3400.0), Some(knob));
        assert_eq!("150000000/3400".parse(), Ok(knob));
        for hz in [1, 50, 8000, 44_100, 48_000, HZ_MAX] {
            assert_eq!(Rate::of_hz(f64::from(hz)), Some(Rate::whole(hz)));
        }
        for cycles in 151..=65_536 {
            let rate = Rate::new(150_000_000, cycles);
            assert_eq!(Rate::of_hz(150e6 / f64::from(cycles)), rate, "{cycles}");
        }
        assert_eq!(Rate::of_hz(44.1 * 1e3), Some(Rate::whole(44_100)));
    }

    #[test]
    fn what_is_no_rate_is_refused() {
        for hz in [0.0, -1.0, f64::NAN, f64::INFINITY, 1e6 + 1.0, 1e-9] {
            assert_eq!(Rate::of_hz(hz), None, "{hz}");
        }
        assert_eq!(Rate::of_hz(std::f64::consts::PI * 1e3), None);
        for text in ["", "0", "1/0", "-1", "1/2/3", "44.1"] {
            assert_eq!(text.parse::<Rate>(), Err(()), "{text}");
        }
    }

    #[test]
    fn ticks_of_a_divided_clock_have_the_same_cycles() {
        let knob = Rate::new(150_000_000, 3400).expect("a rate");
        assert_eq!(knob.cycles_min(150_000_000), 3400);
        assert_eq!(Rate::whole(44_100).cycles_min(150_000_000), 3401);
        let day = 86_400 * 44_117;
        assert_eq!(knob.cycle(day, 150_000_000), 3400 * day);
        assert_eq!(Rate::whole(44_100).cycle(44_100, 150_000_000), 150_000_000);
        assert_eq!(knob.clock_hz_min(3400), 150_000_000);
        assert_eq!(knob.clock_hz_min(3401), 150_044_118);
        assert_eq!([knob.ticks_in(10), knob.ticks_in(1000)], [441, 44_117]);
    }
}
