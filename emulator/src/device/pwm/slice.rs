//! One slice: where its counter is, and when something happens to it next.

const ENABLE: u32 = 1;
const PHASE_CORRECT: u32 = 2;
const RETARD: u32 = 1 << 6;
const ADVANCE: u32 = 1 << 7;

/// TOP and the two compare values, as they count or as they wait for a wrap.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
struct Compare {
    top: u32,
    levels: [u32; 2],
}

/// See the module.
#[derive(Clone, Debug)]
pub(super) struct Slice {
    control: u32,
    /// Cycles a count, in sixteenths.
    divider: u64,
    now: Compare,
    next: Compare,
    /// The place in the period in cycle `since`, with the sixteenths of a count that have gone by.
    place: i64,
    part: u64,
    since: u64,
}

impl Slice {
    pub(super) fn new() -> Self {
        let now = Compare {
            top: 0xffff,
            levels: [0; 2],
        };
        Self {
            control: 0,
            divider: 16,
            now,
            next: now,
            place: 0,
            part: 0,
            since: 0,
        }
    }

    pub(super) fn is_enabled(&self) -> bool {
        self.control & ENABLE != 0
    }

    fn is_phase_correct(&self) -> bool {
        self.control & PHASE_CORRECT != 0
    }

    /// Counts from wrap to wrap.
    fn period(&self) -> i64 {
        let counts = i64::from(self.now.top) + 1;
        if self.is_phase_correct() {
            2 * counts
        } else {
            counts
        }
    }

    /// The place in the period in a cycle, which is not before `since`; and the part of a count.
    fn place(&self, cycle: u64) -> (i64, u64) {
        if !self.is_enabled() {
            return (self.place, self.part);
        }
        let sixteenths = self.part + 16 * (cycle - self.since);
        let counts = sixteenths / self.divider;
        (self.place + counts as i64, sixteenths % self.divider)
    }

    fn counter(&self, place: i64) -> u32 {
        let top = i64::from(self.now.top);
        let back = self.is_phase_correct() && place > top;
        (if back { 2 * top + 1 - place } else { place }) as u32
    }

    /// The first cycle in which the place is so far.
    fn cycle_of(&self, place: i64) -> u64 {
        let counts = (place - self.place).max(0) as u64;
        self.since
            + (counts * self.divider)
                .saturating_sub(self.part)
                .div_ceil(16)
    }

    /// Goes on to a cycle; whether there was a wrap. More than one is not passed over, as each is
    /// due.
    pub(super) fn advance(&mut self, cycle: u64) -> bool {
        if cycle < self.since {
            return false;
        }
        (self.place, self.part) = self.place(cycle);
        self.since = cycle;
        let wraps = self.place >= self.period();
        if wraps {
            self.place -= self.period();
            self.now = self.next;
            self.place %= self.period();
        } else if self.place < 0 {
            self.place += self.period();
        }
        wraps
    }

    /// Both outputs in a cycle.
    pub(super) fn outputs(&self, cycle: u64) -> [bool; 2] {
        let counter = self.counter(self.place(cycle.max(self.since)).0);
        [0, 1].map(|channel| {
            let inverted = self.control >> (2 + channel) & 1 != 0;
            (counter < self.now.levels[channel]) != inverted
        })
    }

    /// When an output changes or the counter wraps.
    pub(super) fn due(&self) -> u64 {
        if !self.is_enabled() {
            return u64::MAX;
        }
        let period = self.period();
        let levels = self.now.levels.map(i64::from);
        let back = |level: i64| {
            if self.is_phase_correct() {
                period - level
            } else {
                period
            }
        };
        let places = levels.into_iter().chain(levels.map(back)).chain([period]);
        let next = places.filter(|place| *place > self.place).min();
        self.cycle_of(next.unwrap_or(period))
    }

    pub(super) fn read(&self, at: u32, cycle: u64) -> u32 {
        match at {
            0 => self.control,
            4 => self.divider as u32 & 0xfff,
            8 => self.counter(self.place(cycle.max(self.since)).0),
            0xc => self.next.levels[1] << 16 | self.next.levels[0],
            _ => self.next.top,
        }
    }

    /// A register; the slice is up to this cycle. It counts so from the next one on.
    pub(super) fn write(&mut self, at: u32, value: u32, cycle: u64) {
        match at {
            0 => {
                self.enable(value & ENABLE != 0, cycle);
                self.control = value & 0x3f;
                self.place += i64::from(value & ADVANCE != 0) - i64::from(value & RETARD != 0);
            }
            4 => {
                // An integer part of 0 means 256.
                let whole = if value & 0xff0 == 0 { 0x1000 } else { 0 };
                self.divider = u64::from(value & 0xfff | whole);
                self.part = 0;
            }
            8 => (self.place, self.part) = (i64::from(value & 0xffff), 0),
            0xc => self.next.levels = [value & 0xffff, value >> 16],
            _ => self.next.top = value & 0xffff,
        }
        // While it stands still there is no wrap to wait for.
        if !self.is_enabled() {
            self.now = self.next;
        }
    }

    /// Starts in the next cycle, or stands still.
    pub(super) fn enable(&mut self, enable: bool, cycle: u64) {
        if enable && !self.is_enabled() {
            self.since = cycle + 1;
        }
        self.control = self.control & !ENABLE | u32::from(enable);
    }
}
