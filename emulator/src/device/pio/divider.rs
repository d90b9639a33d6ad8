//! The clock of a state machine: one cycle of many, with a fraction (RP2350 datasheet 11.5.5).
//!
//! It counts down from the integer part and ticks when it reaches 1; the fractions of the periods
//! add up, and whenever the sum passes 1 the period after is a cycle longer. So with a divider of
//! n + f / 256 and a start before cycle c, tick k (from 0) is in cycle
//! c + (k + 1) n - 1 + k f / 256, rounded down. No source says more of the phase.

/// See the module.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) struct MachineClock {
    /// The cycle of the first tick.
    origin: u64,
    whole: u64,
    fraction: u64,
}

impl MachineClock {
    /// As after a reset: each cycle.
    pub(super) fn new() -> Self {
        Self {
            origin: 0,
            whole: 1,
            fraction: 0,
        }
    }

    /// CLKDIV: the integer in the upper half, of which 0 means 65536 and no fraction.
    pub(super) fn set(&mut self, register: u32, cycle: u64) {
        // The period that runs ends as it began.
        let next = self.at_or_after(cycle);
        let whole = u64::from(register >> 16);
        let fraction = u64::from(register >> 8 & 0xff);
        *self = match whole {
            0 => Self {
                origin: next,
                whole: 1 << 16,
                fraction: 0,
            },
            _ => Self {
                origin: next,
                whole,
                fraction,
            },
        };
    }

    /// Counts from the start, the first time in a cycle.
    pub(super) fn restart(&mut self, cycle: u64) {
        self.origin = cycle + self.whole - 1;
    }

    fn tick(&self, number: u64) -> u64 {
        self.origin + number * self.whole + ((number * self.fraction) >> 8)
    }

    /// The first tick in a cycle or after it.
    pub(super) fn at_or_after(&self, cycle: u64) -> u64 {
        let Some(since) = cycle.checked_sub(self.origin) else {
            return self.origin;
        };
        let mut number = (since << 8) / (self.whole << 8 | self.fraction);
        while self.tick(number) < cycle {
            number += 1;
        }
        self.tick(number)
    }

    /// So many ticks after the one in a cycle.
    pub(super) fn after(&self, cycle: u64, ticks: u64) -> u64 {
        if self.whole == 1 && self.fraction == 0 {
            return cycle + ticks;
        }
        (0..ticks).fold(cycle, |cycle, _| self.at_or_after(cycle + 1))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ticks(divider: &MachineClock, count: usize) -> Vec<u64> {
        let next = |cycle: &u64| Some(divider.at_or_after(*cycle + 1));
        std::iter::successors(Some(divider.at_or_after(0)), next)
            .take(count)
            .collect()
    }

    #[test]
    fn periods_are_as_the_datasheet_says() {
        let mut divider = MachineClock::new();
        assert_eq!(ticks(&divider, 4), [0, 1, 2, 3]);
        divider.set(2 << 16 | 0x80 << 8, 0);
        divider.restart(10);
        assert_eq!(ticks(&divider, 6), [11, 13, 16, 18, 21, 23]);
        divider.set(0, 30);
        divider.restart(100);
        assert_eq!(ticks(&divider, 2), [65_635, 131_171]);
    }

    #[test]
    fn a_fraction_is_exact_over_its_denominator() {
        let mut divider = MachineClock::new();
        divider.set(26 << 16 | 144 << 8, 0);
        divider.restart(0);
        let ticks = ticks(&divider, 1281);
        assert_eq!(ticks[1280] - ticks[0], 34_000);
        let frames: Vec<u64> = ticks.chunks(128).map(|frame| frame[0]).collect();
        assert!(frames.windows(2).all(|pair| pair[1] - pair[0] == 3400));
        let edges = ticks.windows(2).map(|pair| pair[1] - pair[0]);
        assert!(edges.clone().all(|cycles| cycles == 26 || cycles == 27));
        assert_eq!(divider.after(ticks[3], 5), ticks[8]);
    }

    #[test]
    fn a_change_waits_for_the_end_of_the_period() {
        let mut divider = MachineClock::new();
        divider.set(10 << 16, 0);
        divider.restart(0);
        divider.set(3 << 16, 12);
        assert_eq!(ticks(&divider, 3), [19, 22, 25]);
    }
}
