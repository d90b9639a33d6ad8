//! A state machine: its registers, its queues, and when it runs.
//!
//! ```text
//!   a tick: delay left? --yes--> one less
//!             | no
//!           instruction from the host, else from EXEC, else from memory at PC
//!             | side-set, the first time it is tried
//!           execute --stalls--> again at the next tick
//!             | done
//!           PC moves on, delay begins
//!   every tick that is no OUT: an empty OSR is filled, with autopull
//! ```

use super::divider::MachineClock;
use super::execute::Outcome;
use super::fifo::Fifo;

/// EXECCTRL, SHIFTCTRL and PINCTRL after reset.
const EXECCTRL: u32 = 0x1f << 12;
const SHIFTCTRL: u32 = 3 << 18;
const PINCTRL: u32 = 5 << 26;

/// Stalled instructions of the host are told here.
const EXEC_STALLED: u32 = 1 << 31;

/// A write to the levels or the directions of pins: which, and to what.
#[derive(Clone, Copy, Default, PartialEq, Eq, Debug)]
pub(super) struct PinWrite {
    pub mask: u32,
    pub bits: u32,
}

impl PinWrite {
    /// `count` bits from pin `base` on, beyond 31 from 0 on.
    pub(super) fn new(base: u32, count: u32, value: u32) -> Self {
        let mask = ones(count);
        Self {
            mask: mask.rotate_left(base),
            bits: (value & mask).rotate_left(base),
        }
    }

    /// Another write wins where both write.
    pub(super) fn then(self, other: Self) -> Self {
        Self {
            mask: self.mask | other.mask,
            bits: self.bits & !other.mask | other.bits,
        }
    }

    pub(super) fn of(self, register: u32) -> u32 {
        register & !self.mask | self.bits
    }
}

/// So many ones from bit 0 on.
pub(super) fn ones(count: u32) -> u32 {
    if count >= 32 {
        u32::MAX
    } else {
        (1 << count) - 1
    }
}

/// What a machine finds in a cycle.
#[derive(Clone, Copy)]
pub(super) struct Seen<'a> {
    pub memory: &'a [u16; 32],
    /// Inputs behind their synchronizers.
    pub inputs: u32,
    /// Flags as the cycle began, of this block, the one before and the one after.
    pub flags: [u8; 3],
    /// The version of the block: 0 RP2040's, 1 RP2350's.
    pub version: u32,
}

/// What a machine does in a cycle to what it shares.
#[derive(Clone, Copy, Default, Debug)]
pub(super) struct Does {
    pub levels: PinWrite,
    pub directions: PinWrite,
    /// Flags raised and lowered, in the order of [`Seen::flags`].
    pub raised: [u8; 3],
    pub lowered: [u8; 3],
    /// Bits of FDEBUG, as for machine 0.
    pub debug: u32,
    /// A queue has changed.
    pub queued: bool,
}

/// See the module.
#[derive(Clone, Debug)]
pub(super) struct StateMachine {
    pub index: u32,
    pub enabled: bool,
    pub x: u32,
    pub y: u32,
    pub isr: u32,
    pub osr: u32,
    pub isr_count: u32,
    pub osr_count: u32,
    pub pc: u32,
    /// An instruction that EXEC, or a stalled one of the host, has put before those of memory.
    pub latched: Option<u16>,
    /// Whether the latched one is the host's, so that it has no delay.
    latched_of_host: bool,
    /// An instruction that the host wants run in the next cycle.
    forced: Option<u16>,
    /// What it tries has stalled before.
    stalled: bool,
    /// An IRQ that waits has raised its flag.
    pub irq_raised: bool,
    pub execctrl: u32,
    pub shiftctrl: u32,
    pub pinctrl: u32,
    pub clkdiv: u32,
    pub divider: MachineClock,
    pub tx: Fifo,
    pub rx: Fifo,
    /// What OUT or SET wrote last, with OUT_STICKY: levels and directions.
    pub sticky: [PinWrite; 2],
    /// The cycle of its next tick that may do something; none while it stalls.
    pub wake: u64,
}

impl StateMachine {
    pub(super) fn new(index: u32) -> Self {
        Self {
            index,
            enabled: false,
            x: 0,
            y: 0,
            isr: 0,
            osr: 0,
            isr_count: 0,
            osr_count: 32,
            pc: 0,
            latched: None,
            latched_of_host: false,
            forced: None,
            stalled: false,
            irq_raised: false,
            execctrl: EXECCTRL,
            shiftctrl: SHIFTCTRL,
            pinctrl: PINCTRL,
            clkdiv: 1 << 16,
            divider: MachineClock::new(),
            tx: Fifo::new(4),
            rx: Fifo::new(4),
            sticky: [PinWrite::default(); 2],
            wake: u64::MAX,
        }
    }

    /// A field of a register.
    pub(super) fn threshold(&self, shift: u32) -> u32 {
        match self.shiftctrl >> shift & 0x1f {
            0 => 32,
            bits => bits,
        }
    }

    pub(super) fn autopull(&self) -> bool {
        self.shiftctrl >> 17 & 1 != 0
    }

    /// SM_RESTART.
    pub(super) fn restart(&mut self) {
        self.isr = 0;
        self.isr_count = 0;
        self.osr_count = 32;
        self.latched = None;
        self.forced = None;
        self.stalled = false;
        self.irq_raised = false;
        self.sticky = [PinWrite::default(); 2];
        // The delay is over as well.
        self.wake = u64::MAX;
    }

    /// Looks again at what it waited for, from a cycle on. A delay goes on.
    pub(super) fn stir(&mut self, cycle: u64) {
        if self.wake == u64::MAX && self.enabled {
            self.wake = self.divider.at_or_after(cycle);
        }
    }

    /// When something happens in it next.
    pub(super) fn due(&self, next: u64) -> u64 {
        let latched = self.latched.is_some() && self.latched_of_host && !self.enabled;
        match self.forced.is_some() || latched {
            true => next,
            false if self.is_thirsty() => self.wake.min(self.divider.at_or_after(next)),
            false if self.enabled => self.wake,
            false => u64::MAX,
        }
    }

    /// EXECCTRL as it is read.
    pub(super) fn execctrl(&self) -> u32 {
        let stalled = self.forced.is_some() || self.latched.is_some() && self.latched_of_host;
        self.execctrl | if stalled { EXEC_STALLED } else { 0 }
    }

    pub(super) fn set_execctrl(&mut self, value: u32) {
        self.execctrl = value & !EXEC_STALLED;
    }

    /// SHIFTCTRL. Changing how the queues are joined empties them.
    pub(super) fn set_shiftctrl(&mut self, value: u32, version: u32) {
        const JOINS: u32 = 3 << 30 | 3 << 14;
        let writable = if version == 0 {
            0xffff_0000
        } else {
            0xffff_c01f
        };
        let changed = (self.shiftctrl ^ value) & writable & JOINS != 0;
        self.shiftctrl = value & writable;
        if changed {
            let [rx, tx] = [31, 30].map(|bit| value >> bit & 1 != 0);
            let registers = self.shiftctrl >> 14 & 3 != 0;
            self.tx = Fifo::new(if rx {
                0
            } else if tx {
                8
            } else {
                4
            });
            self.rx = Fifo::new(match () {
                () if tx || registers => 0,
                () if rx => 8,
                () => 4,
            });
            if rx && tx {
                (self.tx, self.rx) = (Fifo::new(0), Fifo::new(0));
            }
        }
    }

    /// INSTR: runs in the next cycle, whatever the divider says.
    pub(super) fn force(&mut self, instruction: u16) {
        self.forced = Some(instruction);
    }

    /// Runs what it has to in a cycle; between ticks that do anything its OSR may be filled.
    pub(super) fn run(&mut self, cycle: u64, seen: &Seen<'_>, does: &mut Does) {
        let waits = !self.enabled && self.latched.is_some() && self.latched_of_host;
        let ticks = self.enabled && self.wake <= cycle;
        if let Some(instruction) = self.forced.take() {
            self.run_forced(instruction, cycle, seen, does);
        } else if ticks || waits {
            self.run_tick(cycle, seen, does);
        } else {
            self.sip(cycle, does);
        }
        self.stick(does);
    }

    fn run_forced(&mut self, instruction: u16, cycle: u64, seen: &Seen<'_>, does: &mut Does) {
        // It takes the place of what the program would do in this cycle.
        if self.enabled && self.wake <= cycle {
            self.wake = self.divider.at_or_after(cycle + 1);
        }
        self.side_set(instruction, does);
        let outcome = self.execute(instruction, seen, does);
        match outcome {
            Outcome::Stalls => {
                self.latched = Some(instruction);
                self.latched_of_host = true;
                self.stalled = true;
            }
            Outcome::Next | Outcome::Jumped => {
                if self.latched_of_host {
                    self.latched = None;
                }
                self.latched_of_host = false;
                // Behind a jump something else is tried.
                self.stalled &= outcome == Outcome::Next;
                self.irq_raised &= outcome == Outcome::Next;
            }
            Outcome::Latched => self.latched_of_host = false,
        }
        self.stir(cycle + 1);
    }

    fn run_tick(&mut self, cycle: u64, seen: &Seen<'_>, does: &mut Does) {
        let latched = self.latched.take();
        let of_host = std::mem::take(&mut self.latched_of_host) && latched.is_some();
        let instruction = latched.unwrap_or(seen.memory[self.pc as usize]);
        let again = std::mem::take(&mut self.stalled);
        let delay = self.delay(instruction);
        if !again {
            self.side_set(instruction, does);
        }
        let outcome = self.execute(instruction, seen, does);
        self.stalled = outcome == Outcome::Stalls;
        if latched.is_none() && matches!(outcome, Outcome::Next | Outcome::Latched) {
            self.pc = match self.execctrl >> 12 & 0x1f {
                top if top == self.pc => self.execctrl >> 7 & 0x1f,
                _ => (self.pc + 1) % 32,
            };
        }
        self.wake = match outcome {
            Outcome::Stalls => {
                (self.latched, self.latched_of_host) = (latched, of_host);
                u64::MAX
            }
            Outcome::Latched => self.divider.after(cycle, 1),
            _ if of_host => self.divider.after(cycle, 1),
            _ => self.divider.after(cycle, 1 + u64::from(delay)),
        };
        if instruction >> 13 != 3 {
            self.refill(does);
        }
    }

    /// Autopull beside other instructions than OUT.
    fn refill(&mut self, does: &mut Does) {
        if self.autopull() && self.osr_count >= self.threshold(25) {
            self.pull_if_any(does);
        }
    }

    /// Fills the OSR, if there is a word.
    pub(super) fn pull_if_any(&mut self, does: &mut Does) -> bool {
        let word = self.tx.pop();
        if let Some(word) = word {
            self.osr = word;
            self.osr_count = 0;
            does.queued = true;
        }
        word.is_some()
    }

    /// Whether a word that comes now would be taken by autopull in a tick that a delay passes over.
    fn is_thirsty(&self) -> bool {
        self.enabled
            && self.autopull()
            && self.osr_count >= self.threshold(25)
            && !self.tx.is_empty()
    }

    /// A tick of a delay, or of a stall: only the OSR is filled.
    fn sip(&mut self, cycle: u64, does: &mut Does) {
        if self.is_thirsty() && self.divider.at_or_after(cycle) == cycle {
            self.refill(does);
        }
    }

    /// How many bits side-set takes of the field that it shares with the delay.
    fn side_bits(&self) -> u32 {
        (self.pinctrl >> 29).min(5)
    }

    fn delay(&self, instruction: u16) -> u32 {
        u32::from(instruction) >> 8 & ones(5 - self.side_bits())
    }

    fn side_set(&self, instruction: u16, does: &mut Does) {
        let (field, bits) = (u32::from(instruction) >> 8 & 0x1f, self.side_bits());
        let optional = self.execctrl >> 30 & 1 != 0;
        if bits == 0 || optional && field >> 4 == 0 {
            return;
        }
        let (value, count) = (field >> (5 - bits), bits - u32::from(optional));
        let write = PinWrite::new(self.pinctrl >> 10 & 0x1f, count, value);
        match self.execctrl >> 29 & 1 != 0 {
            true => does.directions = write,
            false => does.levels = write,
        }
    }

    /// What OUT and SET write goes under what side-set has written, and is kept where it sticks.
    pub(super) fn write_pins(&mut self, directions: bool, write: PinWrite, does: &mut Does) {
        let target = match directions {
            true => &mut does.directions,
            false => &mut does.levels,
        };
        *target = write.then(*target);
        if self.execctrl >> 17 & 1 != 0 {
            self.sticky = [PinWrite::default(); 2];
            self.sticky[usize::from(directions)] = write;
        }
    }

    fn stick(&self, does: &mut Does) {
        if self.execctrl >> 17 & 1 != 0 {
            does.levels = self.sticky[0].then(does.levels);
            does.directions = self.sticky[1].then(does.directions);
        }
    }
}
