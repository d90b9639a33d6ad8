//! Lines from devices to cores: interrupt levels, events, and starting and halting of cores.

/// How many 64-bit words hold the interrupt lines of a core.
pub(crate) const WORDS: usize = 8;

/// Where a core begins.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Start {
    /// Its vector table.
    pub vector_table: u32,
    /// Its main stack pointer.
    pub stack: u32,
    /// The address of its first instruction; bit 0 is ignored.
    pub address: u32,
}

/// What a device asks of a core's running.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Order {
    Start(Start),
    Halt,
}

/// The lines of one core.
#[derive(Clone, Default)]
pub(crate) struct CoreLines {
    /// Levels now.
    pub level: [u64; WORDS],
    /// Rising edges the core has not seen.
    pub risen: [u64; WORDS],
    pub nmi: bool,
    pub event: bool,
    pub order: Option<Order>,
}

/// All lines of all cores.
pub struct Lines {
    pub(crate) cores: Vec<CoreLines>,
    /// Whether anything changed that a core has not looked at.
    pub(crate) changed: bool,
    /// Whether a device asks for a reset of the chip, and whether of its peripherals too.
    pub(crate) reset: bool,
    pub(crate) reset_peripherals: bool,
    /// The clock that glitched.
    pub(crate) glitch: Option<&'static str>,
}

impl Lines {
    pub(crate) fn new(cores: usize) -> Self {
        Self {
            cores: vec![CoreLines::default(); cores],
            changed: false,
            reset: false,
            reset_peripherals: false,
            glitch: None,
        }
    }

    /// Sets the level of interrupt `number` of a core. A rising edge makes it pending; a level that
    /// is still high when its handler ends makes it pending again. Cores and interrupts that do not
    /// exist are ignored.
    pub fn set(&mut self, core: usize, number: usize, level: bool) {
        let (word, bit) = (number / 64, 1 << (number % 64));
        let Some(lines) = self.cores.get_mut(core).filter(|_| word < WORDS) else {
            return;
        };
        let was = lines.level[word] & bit != 0;
        lines.level[word] = lines.level[word] & !bit | if level { bit } else { 0 };
        if level && !was {
            lines.risen[word] |= bit;
        }
        self.changed |= level != was;
    }

    /// Sets the level of an interrupt of every core.
    pub fn set_all(&mut self, number: usize, level: bool) {
        (0..self.cores.len()).for_each(|core| self.set(core, number, level));
    }

    /// Makes an interrupt pending once.
    pub fn pulse(&mut self, core: usize, number: usize) {
        self.set(core, number, true);
        self.set(core, number, false);
    }

    /// Whether interrupt `number` of a core is high.
    pub fn level(&self, core: usize, number: usize) -> bool {
        self.cores
            .get(core)
            .is_some_and(|c| number / 64 < WORDS && c.level[number / 64] >> (number % 64) & 1 != 0)
    }

    /// Makes NMI pending.
    pub fn nmi(&mut self, core: usize) {
        self.with(core, |lines| lines.nmi = true);
    }

    /// Sets the event register of one core, as its peer's SEV does.
    pub fn event(&mut self, core: usize) {
        self.with(core, |lines| lines.event = true);
    }

    /// Sets the event registers of all cores but one.
    pub fn event_from(&mut self, sender: usize) {
        (0..self.cores.len())
            .filter(|core| *core != sender)
            .for_each(|core| self.event(core));
    }

    /// Asks for a reset of the chip, which ends the run.
    pub fn reset(&mut self) {
        self.reset_peripherals = true;
        self.reset_cores();
    }

    /// Asks for a reset of the cores alone, which ends the run; peripherals go on.
    pub fn reset_cores(&mut self) {
        self.reset = true;
        self.changed = true;
    }

    /// A clock had an edge that came too early, which ends the run.
    pub fn glitch(&mut self, clock: &'static str) {
        self.glitch = Some(clock);
        self.changed = true;
    }

    /// Starts a core, whatever it is doing, from reset.
    pub fn start(&mut self, core: usize, start: Start) {
        self.with(core, |lines| lines.order = Some(Order::Start(start)));
    }

    /// Halts a core until it is started.
    pub fn halt(&mut self, core: usize) {
        self.with(core, |lines| lines.order = Some(Order::Halt));
    }

    fn with(&mut self, core: usize, change: impl FnOnce(&mut CoreLines)) {
        if let Some(lines) = self.cores.get_mut(core) {
            change(lines);
            self.changed = true;
        }
    }
}
