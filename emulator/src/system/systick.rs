//! SysTick: a 24-bit counter that counts down with the core's clock.
//!
//! It is not stepped. While enabled, its value follows from the cycle in which it last wrapped to
//! its reload value.

/// The timer.
#[derive(Clone, PartialEq, Debug, Default)]
pub(crate) struct SysTick {
    /// CSR bits 0 to 2.
    control: u32,
    count_flag: bool,
    reload: u32,
    /// The value while stopped; while enabled, that of cycle `since`.
    value: u32,
    since: u64,
}

const ENABLE: u32 = 1;
const TICKINT: u32 = 2;

impl SysTick {
    /// The cycle in which it next reaches zero.
    pub fn due(&self) -> u64 {
        if self.control & ENABLE == 0 || (self.value == 0 && self.reload == 0) {
            return u64::MAX;
        }
        // From 0 the first cycle reloads.
        let first = if self.value == 0 {
            u64::from(self.reload) + 1
        } else {
            u64::from(self.value)
        };
        self.since + first
    }

    /// Moves on to a cycle; true when it reached zero and asks for its exception.
    pub fn advance(&mut self, now: u64) -> bool {
        let due = self.due();
        if due > now {
            return false;
        }
        self.value = 0;
        self.since = due;
        self.count_flag = true;
        if self.reload != 0 {
            // Whole periods that passed unseen.
            let period = u64::from(self.reload) + 1;
            self.since = now - (now - due) % period;
        }
        self.control & TICKINT != 0
    }

    fn value_at(&self, now: u64) -> u32 {
        let passed = now.saturating_sub(self.since);
        match (self.control & ENABLE, self.value) {
            (0, value) => value,
            (_, 0) if passed == 0 || self.reload == 0 => 0,
            (_, 0) => (u64::from(self.reload) + 1).saturating_sub(passed) as u32,
            (_, value) => u64::from(value).saturating_sub(passed) as u32,
        }
    }

    /// CSR, RVR, CVR, CALIB by offset from 0xE000E010. Reading CSR clears COUNTFLAG.
    pub fn read(&mut self, offset: u32, now: u64) -> u32 {
        match offset {
            0 => {
                let flag = std::mem::take(&mut self.count_flag);
                self.control | u32::from(flag) << 16
            }
            4 => self.reload,
            8 => self.value_at(now),
            _ => 1 << 31,
        }
    }

    /// A write at an offset from 0xE000E010. Any write to CVR clears it.
    pub fn write(&mut self, offset: u32, value: u32, now: u64) {
        let current = self.value_at(now);
        match offset {
            0 => {
                // CLKSOURCE: there is only the core's clock.
                self.control = value & 3 | 4;
                self.value = current;
                self.since = now;
            }
            4 => self.reload = value & 0x00ff_ffff,
            8 => {
                self.value = 0;
                self.since = now;
                self.count_flag = false;
            }
            _ => {}
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn started(reload: u32) -> SysTick {
        let mut timer = SysTick::default();
        timer.write(4, reload, 0);
        timer.write(8, 1, 0);
        timer.write(0, ENABLE | TICKINT, 100);
        timer
    }

    #[test]
    fn it_reaches_zero_every_reload_plus_one_cycles() {
        let mut timer = started(9);
        assert_eq!(timer.due(), 110);
        assert!(!timer.advance(109));
        assert_eq!((timer.read(8, 101), timer.read(8, 109)), (9, 1));
        assert!(timer.advance(110));
        assert_eq!(
            (timer.due(), timer.read(8, 110), timer.read(8, 111)),
            (120, 0, 9)
        );
        assert_eq!(timer.read(0, 111) >> 16, 1);
        assert_eq!(timer.read(0, 111) >> 16, 0);
        assert!(timer.advance(145));
        assert_eq!(timer.due(), 150);
    }

    #[test]
    fn stopped_it_keeps_its_value() {
        let mut timer = started(9);
        timer.write(0, 0, 104);
        assert_eq!((timer.read(8, 500), timer.due()), (6, u64::MAX));
    }

    #[test]
    fn without_a_reload_it_never_ends() {
        assert_eq!(started(0).due(), u64::MAX);
    }
}
