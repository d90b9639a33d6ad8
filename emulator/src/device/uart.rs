//! The serial port, a PL011 with FIFOs of 32 bytes (RP2350 datasheet 12.1, RP2040 datasheet 4.2),
//! or the one of an STM32 (`usart`). A byte takes the time that its dividers say; before they are
//! set it takes none.

mod usart;

use std::collections::VecDeque;

use crate::bus::{Access, Bus, BusError, Device};
use crate::device::alias;

const FIFO: usize = 32;
/// Raw interrupts: receive level, transmit level, receive timeout, overrun.
const RX: u32 = 1 << 4;
const TX: u32 = 1 << 5;
const TIMEOUT: u32 = 1 << 6;
const OVERRUN: u32 = 1 << 10;
/// With the first byte that was received after others found no room.
const BEHIND_LOST: u16 = 1 << 11;

/// A serial port. What the program sends is in `output`; what it is to receive is put into `input`.
#[derive(Default)]
pub struct Uart {
    /// Bytes sent, in order. Take them whenever you like.
    pub output: Vec<u8>,
    /// Bytes that will arrive, one frame after the other, once the port receives.
    pub input: VecDeque<u8>,
    /// Whether it has the registers of an STM32, and then how many cycles one of its own clock
    /// takes.
    usart: Option<u32>,
    interrupt: usize,
    sending: VecDeque<u8>,
    received: VecDeque<u16>,
    /// The cycle in which the byte on the wire is over, each way.
    sent_at: u64,
    arrives_at: u64,
    divider: [u32; 2],
    line: u32,
    control: u32,
    levels: u32,
    mask: u32,
    sticky: u32,
    /// Whether a byte has found no room, and nothing was received since.
    lost: bool,
    dma: u32,
    power: u32,
}

impl Uart {
    pub(crate) fn new(interrupt: usize) -> Self {
        Self {
            interrupt,
            control: 0x300,
            levels: 0x12,
            ..Self::default()
        }
    }

    /// Has bytes arrive one frame after the other, the first of them at once where none is on its
    /// way in this cycle.
    pub fn receive(&mut self, bytes: &[u8], cycle: u64) {
        if self.input.is_empty() {
            self.arrives_at = self.arrives_at.max(cycle);
        }
        self.input.extend(bytes);
    }

    /// Whether the program may be given a byte by a DMA, or take one.
    pub(crate) fn requests(&self) -> (bool, bool) {
        let (tx, rx) = (self.sending.len() < self.depth(), !self.received.is_empty());
        (tx && self.dma & 2 != 0, rx && self.dma & 1 != 0)
    }

    fn depth(&self) -> usize {
        if self.line & 0x10 != 0 { FIFO } else { 1 }
    }

    /// Cycles of a frame: start bit, data, parity, stop bits, each 16 periods of the divided clock.
    fn frame_cycles(&self) -> u64 {
        let data = 5 + u64::from(self.line >> 5 & 3);
        let bits = 1 + data + u64::from(self.line >> 1 & 1) + 1 + u64::from(self.line >> 3 & 1);
        let sixty_fourths = u64::from(self.divider[0]) * 64 + u64::from(self.divider[1]);
        bits * 16 * sixty_fourths / 64
    }

    /// Whether it is enabled, and that direction with it.
    fn enabled(&self, direction: u32) -> bool {
        self.control & 1 != 0 && self.control & direction != 0
    }

    fn send(&mut self, byte: u8, cycle: u64) {
        if self.sending.is_empty() {
            self.sent_at = cycle + self.frame_cycles();
        }
        if self.sending.len() < self.depth().max(2) {
            self.sending.push_back(byte);
        }
        self.advance(cycle);
    }

    /// What has left and what has arrived by now.
    fn advance(&mut self, cycle: u64) {
        let frame = self.frame_cycles();
        while self.enabled(0x100) && self.sent_at <= cycle {
            let Some(byte) = self.sending.pop_front() else {
                break;
            };
            self.output.push(byte);
            self.sent_at += frame;
        }
        while self.enabled(0x200) && self.arrives_at <= cycle {
            let Some(byte) = self.input.pop_front() else {
                break;
            };
            if self.received.len() < self.depth() {
                let lost = if std::mem::take(&mut self.lost) {
                    BEHIND_LOST
                } else {
                    0
                };
                self.received.push_back(u16::from(byte) | lost)
            } else {
                self.lost = true;
                self.sticky |= OVERRUN
            }
            self.arrives_at = cycle + frame.max(1);
        }
    }

    fn flags(&self) -> u32 {
        let (tx, rx) = (self.sending.len(), self.received.len());
        let bits = [
            (3, tx > 0),
            (4, rx == 0),
            (5, tx >= self.depth()),
            (6, rx >= self.depth()),
            (7, tx == 0),
        ];
        bits.iter().map(|(bit, set)| u32::from(*set) << bit).sum()
    }

    fn raw(&self) -> u32 {
        let level = |code: u32, of_32: [usize; 5]| {
            if self.depth() == 1 {
                1
            } else {
                of_32[code.min(4) as usize]
            }
        };
        let tx = self.sending.len() <= level(self.levels & 7, [4, 8, 16, 24, 28]);
        let rx = self.received.len() >= level(self.levels >> 3 & 7, [4, 8, 16, 24, 28]);
        let waiting = !rx && !self.received.is_empty() && self.input.is_empty();
        let bits = [(TX, tx), (RX, rx), (TIMEOUT, waiting)];
        bits.iter()
            .map(|(bit, set)| if *set { *bit } else { 0 })
            .sum::<u32>()
            | self.sticky
    }

    fn interrupts(&self, bus: &mut Bus) {
        bus.lines
            .set_all(self.interrupt, self.raw() & self.mask != 0);
    }

    fn word(&mut self, at: u32) -> Option<u32> {
        Some(match at {
            0x00 => u32::from(self.received.pop_front().unwrap_or(0)),
            0x04 => self.sticky >> 7 & 8,
            0x18 => self.flags(),
            0x20 => self.power,
            0x24 => self.divider[0],
            0x28 => self.divider[1],
            0x2c => self.line,
            0x30 => self.control,
            0x34 => self.levels,
            0x38 => self.mask,
            0x3c => self.raw(),
            0x40 => self.raw() & self.mask,
            0x48 => self.dma,
            0xfe0..=0xfff => {
                [0x11, 0x10, 0x34, 0x00, 0x0d, 0xf0, 0x05, 0xb1][(at as usize - 0xfe0) / 4]
            }
            _ => return None,
        })
    }

    fn held(&mut self, at: u32) -> Option<&mut u32> {
        Some(match at {
            0x20 => &mut self.power,
            0x24 => &mut self.divider[0],
            0x28 => &mut self.divider[1],
            0x2c => &mut self.line,
            0x30 => &mut self.control,
            0x34 => &mut self.levels,
            0x38 => &mut self.mask,
            0x48 => &mut self.dma,
            _ => return None,
        })
    }
}

impl Device for Uart {
    fn read(&mut self, access: Access, bus: &mut Bus) -> Result<u32, BusError> {
        self.advance(access.cycle);
        if self.usart.is_some() {
            return self.usart_word(access.offset & !3).ok_or(BusError);
        }
        let word = self
            .word(alias::plain(access.offset) & !3)
            .ok_or(BusError)?;
        self.interrupts(bus);
        Ok(alias::part(access.offset, word))
    }

    fn write(&mut self, access: Access, value: u32, bus: &mut Bus) -> Result<(), BusError> {
        self.advance(access.cycle);
        if let Some(cycles) = self.usart {
            return self.usart_write(cycles, access, value).ok_or(BusError);
        }
        match alias::plain(access.offset) & !3 {
            0x00 => self.send(value as u8, access.cycle),
            0x04 => self.sticky = 0,
            0x44 => self.sticky &= !value,
            at => {
                let held = self.held(at).ok_or(BusError)?;
                *held = alias::written(access, value, *held) & 0xffff;
                self.advance(access.cycle);
            }
        }
        self.interrupts(bus);
        Ok(())
    }

    fn keeps_to_itself(&self, offset: u32, write: bool) -> bool {
        let at = alias::plain(offset) & !3;
        self.usart.is_none() && (at == 0 || at == 0x18 && !write)
    }

    fn due(&self) -> u64 {
        let sent = if self.sending.is_empty() || !self.enabled(0x100) {
            u64::MAX
        } else {
            self.sent_at
        };
        let arrives = if self.input.is_empty() || !self.enabled(0x200) {
            u64::MAX
        } else {
            self.arrives_at
        };
        sent.min(arrives)
    }

    fn attend(&mut self, cycle: u64, bus: &mut Bus) {
        self.advance(cycle);
        self.interrupts(bus);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::board::{Board, CoreKind};

    fn port() -> (Uart, Bus) {
        (
            Uart::new(33),
            Bus::new(&Board::generic(CoreKind::CortexM33)).unwrap(),
        )
    }

    fn write(port: &mut (Uart, Bus), offset: u32, cycle: u64, value: u32) {
        port.0
            .write(
                Access {
                    offset,
                    size: 4,
                    core: 0,
                    cycle,
                },
                value,
                &mut port.1,
            )
            .unwrap();
    }

    fn read(port: &mut (Uart, Bus), offset: u32, cycle: u64) -> u32 {
        port.0
            .read(
                Access {
                    offset,
                    size: 4,
                    core: 0,
                    cycle,
                },
                &mut port.1,
            )
            .unwrap()
    }

    /// 115200 baud from 150 MHz: 81 + 24/64, 8 data bits, one stop bit: 10 bits of 1302 cycles.
    fn at_115200(port: &mut (Uart, Bus)) {
        [(0x24, 81), (0x28, 24), (0x2c, 0x70), (0x30, 0x301)]
            .iter()
            .for_each(|(at, value)| write(port, *at, 0, *value));
    }

    #[test]
    fn bytes_take_their_time() {
        let mut port = port();
        at_115200(&mut port);
        b"ab"
            .iter()
            .for_each(|byte| write(&mut port, 0, 100, u32::from(*byte)));
        assert_eq!(port.0.due(), 100 + 13_020);
        assert_eq!(
            read(&mut port, 0x18, 13_119) & 0xb8,
            0x18,
            "busy, nothing received"
        );
        assert_eq!(port.0.output, b"");
        assert_eq!(read(&mut port, 0x18, 13_120) & 0x88, 0x08);
        assert_eq!(read(&mut port, 0x18, 100 + 2 * 13_020) & 0x88, 0x80);
        assert_eq!(port.0.output, b"ab");
    }

    #[test]
    fn received_bytes_interrupt() {
        let mut port = port();
        at_115200(&mut port);
        write(&mut port, 0x38, 0, TIMEOUT | RX);
        port.0.input.extend(*b"x");
        let (uart, bus) = (&mut port.0, &mut port.1);
        uart.attend(uart.due(), bus);
        assert!(bus.lines.level(0, 33));
        assert_eq!(read(&mut port, 0, 20_000), u32::from(b'x'));
        assert!(!port.1.lines.level(0, 33));
    }

    /// 33 bytes arrive and nobody takes one; then there is room for two more.
    #[test]
    fn what_follows_a_lost_byte_says_so() {
        let mut port = port();
        at_115200(&mut port);
        let frame = 13_020;
        port.0.receive(&(0..35).collect::<Vec<u8>>(), 7);
        let at = 7 + 32 * frame;
        let pass = |port: &mut (Uart, Bus), until: u64| {
            while port.0.due() <= until {
                port.0.attend(port.0.due(), &mut port.1);
            }
        };
        pass(&mut port, at - 1);
        assert_eq!(read(&mut port, 0x18, at - 1) & 0x40, 0x40, "full");
        assert_eq!(read(&mut port, 0x3c, at) & OVERRUN, OVERRUN);
        let mut bytes: Vec<u32> = (0..2).map(|_| read(&mut port, 0, at)).collect();
        pass(&mut port, at + 2 * frame);
        bytes.extend((0..32).map(|_| read(&mut port, 0, at + 2 * frame)));
        let told: Vec<u32> = (0..32).chain([33 | 1 << 11, 34]).collect();
        assert_eq!(bytes, told);
    }

    #[test]
    fn a_full_queue_is_told() {
        let mut port = port();
        at_115200(&mut port);
        (0..32).for_each(|byte| write(&mut port, 0, 0, byte));
        assert_eq!(read(&mut port, 0x18, 1) & 0x20, 0x20);
        write(&mut port, 0, 2, 99);
        port.0.attend(u64::MAX / 2, &mut port.1);
        assert_eq!(
            port.0.output,
            (0..32).collect::<Vec<u8>>(),
            "what does not fit is lost"
        );
    }
}
