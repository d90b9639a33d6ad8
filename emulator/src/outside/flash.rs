//! A serial flash chip (as a W25Q): commands of single bytes over one line each way, by which its
//! sectors are erased and its pages written. What it holds lies in plain memory, where the chip
//! shows it.
//!
//! The boot leaves it in a mode in which a command is taken for an address; ones alone end that.
//! Not here: the ways to read that memory itself stands for, protection, and what a sector holds
//! while it is being erased.

use crate::memory::Memory;

/// Bytes of a page, and how long it takes to write one (us).
const PAGE: u32 = 256;
const PAGE_US: u64 = 400;
/// Command, bytes and time (us) of what erases.
const ERASERS: [(u8, u32, u64); 2] = [(0x20, 4096, 45_000), (0xd8, 65_536, 150_000)];
/// Maker, kind and size.
const IDENTITY: [u8; 3] = [0xef, 0x40, 0x16];
const WRITE: u8 = 0x02;
const READ: u8 = 0x03;
const DISABLE: u8 = 0x04;
const STATUS: u8 = 0x05;
const ENABLE: u8 = 0x06;
const IDENTIFY: u8 = 0x9f;

/// See the module.
pub(crate) struct FlashChip {
    /// Where memory shows it.
    base: u32,
    bytes: u32,
    cycles_per_us: u64,
    /// Takes no commands.
    reads_ahead: bool,
    /// May be written once.
    enabled: bool,
    busy_until: u64,
    /// What came since it was selected.
    frame: Vec<u8>,
}

impl FlashChip {
    pub(crate) fn new(base: u32, bytes: u32, clock_hz: u32) -> Self {
        Self {
            base,
            bytes,
            cycles_per_us: u64::from(clock_hz / 1_000_000),
            reads_ahead: true,
            enabled: false,
            busy_until: 0,
            frame: Vec::new(),
        }
    }

    fn is_busy(&self, cycle: u64) -> bool {
        cycle < self.busy_until
    }

    /// A byte goes in, another one comes out.
    pub(crate) fn exchange(&mut self, byte: u8, cycle: u64, memory: &Memory) -> u8 {
        let count = self.frame.len() as u32;
        let answer = match self.frame.first() {
            _ if self.reads_ahead => None,
            Some(&STATUS) => {
                let [busy, enabled] = [self.is_busy(cycle), self.enabled].map(u8::from);
                Some(busy | enabled << 1)
            }
            _ if self.is_busy(cycle) => None,
            Some(&IDENTIFY) => IDENTITY.get(count as usize - 1).copied(),
            Some(&READ) if count >= 4 => {
                let mut read = [0xff];
                let _ = memory.read(self.place(&self.frame, count - 4), &mut read);
                Some(read[0])
            }
            _ => None,
        };
        self.frame.push(byte);
        answer.unwrap_or(0xff)
    }

    /// Where memory shows the byte so far from the address of a frame.
    fn place(&self, frame: &[u8], further: u32) -> u32 {
        let address = frame[1..4].iter();
        let address = address.fold(0, |all, byte| all << 8 | u32::from(*byte));
        self.base + (address + further) % self.bytes
    }

    /// The end of a frame, with which it takes effect.
    pub(crate) fn deselect(&mut self, cycle: u64, memory: &mut Memory) {
        let frame = std::mem::take(&mut self.frame);
        if self.reads_ahead {
            self.reads_ahead = frame.is_empty() || frame.iter().any(|byte| *byte != 0xff);
            return;
        }
        if self.is_busy(cycle) {
            return;
        }
        let takes = match frame[..] {
            [ENABLE] => {
                self.enabled = true;
                return;
            }
            [DISABLE] => 0,
            [command, _, _, _] if self.enabled => self.erase(command, &frame, memory),
            [WRITE, _, _, _, ..] if self.enabled => self.write(&frame, memory),
            _ => return,
        };
        self.enabled = false;
        self.busy_until = cycle + takes * self.cycles_per_us;
    }

    fn erase(&self, command: u8, frame: &[u8], memory: &mut Memory) -> u64 {
        let Some((_, bytes, takes)) = ERASERS.iter().find(|(own, ..)| *own == command) else {
            return 0;
        };
        let at = self.place(frame, 0) & !(bytes - 1);
        let _ = memory.write(at, &vec![0xff; *bytes as usize]);
        *takes
    }

    /// Bits go from one to zero; behind the end of a page it goes on at its beginning.
    fn write(&self, frame: &[u8], memory: &mut Memory) -> u64 {
        let at = self.place(frame, 0);
        for (n, byte) in (0..).zip(&frame[4..]) {
            let at = at & !(PAGE - 1) | (at + n) & (PAGE - 1);
            let mut own = [0];
            let _ = memory.read(at, &mut own);
            let _ = memory.write(at, &[own[0] & byte]);
        }
        PAGE_US
    }
}
