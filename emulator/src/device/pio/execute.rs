//! What the nine instructions do (RP2350 datasheet 11.4, RP2040 datasheet 3.4).

use super::machine::{Does, PinWrite, Seen, StateMachine, ones};

/// How an instruction ends.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Outcome {
    /// PC moves on.
    Next,
    /// PC has been set.
    Jumped,
    /// It is to be tried again.
    Stalls,
    /// It has put an instruction before those of memory, and its own delay does not count.
    Latched,
}

use Outcome::{Jumped, Latched, Next, Stalls};

/// Bits of FDEBUG of machine 0.
const RXSTALL: u32 = 1;
const TXSTALL: u32 = 1 << 24;

fn wait_for(condition: bool) -> Outcome {
    if condition { Next } else { Stalls }
}

impl StateMachine {
    /// One instruction.
    pub(super) fn execute(
        &mut self,
        instruction: u16,
        seen: &Seen<'_>,
        does: &mut Does,
    ) -> Outcome {
        let word = u32::from(instruction);
        // The three fields that most have.
        let (upper, lower) = (word >> 5 & 7, word & 0x1f);
        match word >> 13 {
            0 => self.jump(upper, lower, seen),
            1 => self.wait(word >> 7 & 1 != 0, upper & 3, lower, seen, does),
            2 => self.shift_in(upper, bits(lower), seen, does),
            3 => self.shift_out(upper, bits(lower), does),
            4 if lower & 0x10 != 0 && seen.version > 0 => self.move_register(word),
            4 if word >> 7 & 1 == 0 => self.push(word, does),
            4 => self.pull(word, does),
            5 => self.copy(upper, word >> 3 & 3, word & 7, seen, does),
            6 => self.flag(word, seen, does),
            _ => self.set(upper, lower, does),
        }
    }

    fn jump(&mut self, condition: u32, target: u32, seen: &Seen<'_>) -> Outcome {
        let taken = match condition {
            0 => true,
            1 => self.x == 0,
            2 => {
                self.x = self.x.wrapping_sub(1);
                self.x != u32::MAX
            }
            3 => self.y == 0,
            4 => {
                self.y = self.y.wrapping_sub(1);
                self.y != u32::MAX
            }
            5 => self.x != self.y,
            6 => seen.inputs >> self.jump_pin() & 1 != 0,
            _ => self.osr_count < self.threshold(25),
        };
        if taken {
            self.pc = target;
            return Jumped;
        }
        Next
    }

    fn jump_pin(&self) -> u32 {
        self.execctrl >> 24 & 0x1f
    }

    /// The inputs from IN_BASE on; of version 1 as many as IN_COUNT says.
    fn in_pins(&self, seen: &Seen<'_>) -> u32 {
        let all = seen.inputs.rotate_right(self.pinctrl >> 15 & 0x1f);
        match self.shiftctrl & 0x1f {
            0 => all,
            count => all & ones(count),
        }
    }

    fn wait(
        &mut self,
        polarity: bool,
        source: u32,
        index: u32,
        seen: &Seen<'_>,
        does: &mut Does,
    ) -> Outcome {
        let is_high = match source {
            0 => seen.inputs >> index & 1 != 0,
            1 => self.in_pins(seen) >> index & 1 != 0,
            2 => {
                let (block, bit) = self.flag_of(index, seen.version);
                let high = seen.flags[block] & bit != 0;
                if high && polarity {
                    does.lowered[block] |= bit;
                }
                high
            }
            _ if seen.version > 0 => seen.inputs >> ((self.jump_pin() + (index & 3)) % 32) & 1 != 0,
            _ => polarity,
        };
        wait_for(is_high == polarity)
    }

    /// The flag that an index means: whose block (this, the one before, the one after), and its
    /// bit.
    fn flag_of(&self, index: u32, version: u32) -> (usize, u8) {
        let relative = index & 4 | (index + self.index) & 3;
        match (index >> 3 & 3, version) {
            (2, 1..) | (2 | 3, 0) => (0, 1 << relative),
            (1, 1..) => (1, 1 << (index & 7)),
            (3, _) => (2, 1 << (index & 7)),
            _ => (0, 1 << (index & 7)),
        }
    }

    fn source(&self, source: u32, seen: &Seen<'_>) -> u32 {
        match source {
            0 => self.in_pins(seen),
            1 => self.x,
            2 => self.y,
            6 => self.isr,
            7 => self.osr,
            _ => 0,
        }
    }

    fn shift_in(&mut self, source: u32, count: u32, seen: &Seen<'_>, does: &mut Does) -> Outcome {
        let value = u64::from(self.source(source, seen) & ones(count));
        let isr = match self.shiftctrl >> 18 & 1 != 0 {
            true => (u64::from(self.isr) >> count) as u32 | (value << (32 - count)) as u32,
            false => (u64::from(self.isr) << count) as u32 | value as u32,
        };
        let shifted = (self.isr_count + count).min(32);
        let pushes = self.shiftctrl >> 16 & 1 != 0 && shifted >= self.threshold(20);
        if !pushes {
            (self.isr, self.isr_count) = (isr, shifted);
            return Next;
        }
        if !self.rx.push(isr) {
            does.debug |= RXSTALL;
            return Stalls;
        }
        does.queued = true;
        (self.isr, self.isr_count) = (0, 0);
        Next
    }

    fn shift_out(&mut self, target: u32, count: u32, does: &mut Does) -> Outcome {
        let empty = self.osr_count >= self.threshold(25);
        if self.autopull() && empty {
            // It is filled in this cycle, and used in the next.
            if !self.pull_if_any(does) {
                does.debug |= TXSTALL;
            }
            return Stalls;
        }
        let osr = u64::from(self.osr);
        let value = match self.shiftctrl >> 19 & 1 != 0 {
            true => {
                self.osr = (osr >> count) as u32;
                osr as u32 & ones(count)
            }
            false => {
                self.osr = (osr << count) as u32;
                (osr >> (32 - count)) as u32
            }
        };
        self.osr_count = (self.osr_count + count).min(32);
        if self.autopull() && self.osr_count >= self.threshold(25) {
            self.pull_if_any(does);
        }
        self.out(target, value, count, does)
    }

    fn out(&mut self, target: u32, value: u32, count: u32, does: &mut Does) -> Outcome {
        match target {
            0 | 4 => self.out_pins(target == 4, value, does),
            1 => self.x = value,
            2 => self.y = value,
            5 => {
                self.pc = value & 0x1f;
                return Jumped;
            }
            6 => (self.isr, self.isr_count) = (value, count),
            7 => {
                self.latched = Some(value as u16);
                return Latched;
            }
            _ => {}
        }
        Next
    }

    /// OUT and MOV to pins: not at all while the bit that enables them is low.
    fn out_pins(&mut self, directions: bool, value: u32, does: &mut Does) {
        let inline = self.execctrl >> 18 & 1 != 0;
        if inline && value >> (self.execctrl >> 19 & 0x1f) & 1 == 0 {
            self.sticky = [PinWrite::default(); 2];
            return;
        }
        let (base, count) = (self.pinctrl & 0x1f, self.pinctrl >> 20 & 0x3f);
        self.write_pins(directions, PinWrite::new(base, count, value), does);
    }

    fn push(&mut self, word: u32, does: &mut Does) -> Outcome {
        let [if_full, block] = [6, 5].map(|bit| word >> bit & 1 != 0);
        if if_full && self.isr_count < self.threshold(20) {
            return Next;
        }
        if self.rx.push(self.isr) {
            does.queued = true;
        } else {
            does.debug |= RXSTALL;
            if block {
                return Stalls;
            }
        }
        (self.isr, self.isr_count) = (0, 0);
        Next
    }

    fn pull(&mut self, word: u32, does: &mut Does) -> Outcome {
        let [if_empty, block] = [6, 5].map(|bit| word >> bit & 1 != 0);
        let full = self.autopull() && self.osr_count == 0;
        if full || if_empty && self.osr_count < self.threshold(25) {
            return Next;
        }
        if self.pull_if_any(does) {
            return Next;
        }
        if block {
            does.debug |= TXSTALL;
            return Stalls;
        }
        (self.osr, self.osr_count) = (self.x, 0);
        Next
    }

    /// MOV between ISR or OSR and the storage of the receiving queue, of version 1.
    fn move_register(&mut self, word: u32) -> Outcome {
        let index = if word >> 3 & 1 != 0 {
            word & 3
        } else {
            self.y & 3
        };
        let [puts, gets] = [15, 14].map(|bit| self.shiftctrl >> bit & 1 != 0);
        if word >> 7 & 1 == 0 {
            if puts {
                *self.rx.register(index) = self.isr;
            }
        } else if gets {
            (self.osr, self.osr_count) = (*self.rx.register(index), 0);
        }
        Next
    }

    fn copy(
        &mut self,
        target: u32,
        operation: u32,
        source: u32,
        seen: &Seen<'_>,
        does: &mut Does,
    ) -> Outcome {
        let value = match source {
            5 => self.status(seen),
            _ => self.source(source, seen),
        };
        let value = match operation {
            1 => !value,
            2 => value.reverse_bits(),
            _ => value,
        };
        match target {
            0 => self.out_pins(false, value, does),
            3 if seen.version > 0 => self.out_pins(true, value, does),
            4 => return self.out(7, value, 32, does),
            6 => (self.isr, self.isr_count) = (value, 0),
            7 => (self.osr, self.osr_count) = (value, 0),
            3 => {}
            _ => return self.out(target, value, 32, does),
        }
        Next
    }

    /// STATUS of MOV: all ones or zero.
    fn status(&self, seen: &Seen<'_>) -> u32 {
        let (kind, level) = match seen.version {
            0 => (self.execctrl >> 4 & 1, self.execctrl & 0xf),
            _ => (self.execctrl >> 5 & 3, self.execctrl & 0x1f),
        };
        let holds = match kind {
            0 => (self.tx.len() as u32) < level,
            1 => (self.rx.len() as u32) < level,
            _ => {
                let block = (level >> 3 & 3) as usize;
                seen.flags
                    .get(block)
                    .is_some_and(|flags| flags >> (level & 7) & 1 != 0)
            }
        };
        if holds { u32::MAX } else { 0 }
    }

    fn flag(&mut self, word: u32, seen: &Seen<'_>, does: &mut Does) -> Outcome {
        let [clear, wait] = [6, 5].map(|bit| word >> bit & 1 != 0);
        let (block, bit) = self.flag_of(word & 0x1f, seen.version);
        if clear {
            does.lowered[block] |= bit;
            return Next;
        }
        if self.irq_raised {
            self.irq_raised = seen.flags[block] & bit != 0;
            return wait_for(!self.irq_raised);
        }
        does.raised[block] |= bit;
        self.irq_raised = wait;
        wait_for(!wait)
    }

    fn set(&mut self, target: u32, value: u32, does: &mut Does) -> Outcome {
        let write = || PinWrite::new(self.pinctrl >> 5 & 0x1f, self.pinctrl >> 26 & 7, value);
        match target {
            0 | 4 => self.write_pins(target == 4, write(), does),
            1 => self.x = value,
            2 => self.y = value,
            _ => {}
        }
        Next
    }
}

/// A count of bits, of which 0 means all.
fn bits(field: u32) -> u32 {
    if field == 0 { 32 } else { field }
}
