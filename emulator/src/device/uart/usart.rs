//! The registers of an STM32F4's serial port (RM0090, 30.6): SR, DR, BRR, CR1; no FIFO, no
//! interrupts.

use super::Uart;
use crate::bus::Access;

/// 8 data bits and one stop bit, as PL011 has it in its line control.
const LINE: u32 = 0x60;
/// Bytes that it holds: the one on the wire and the next.
const HELD: usize = 2;

impl Uart {
    /// A port whose own clock takes so many cycles of the core's.
    pub(crate) fn stm32(interrupt: usize, cycles: u32) -> Self {
        Self {
            usart: Some(cycles),
            line: LINE,
            control: 0,
            ..Self::new(interrupt)
        }
    }

    pub(super) fn usart_word(&mut self, at: u32) -> Option<u32> {
        Some(match at {
            // ORE, RXNE, TC, TXE.
            0x00 => {
                let bits = [
                    (3, self.lost),
                    (5, !self.received.is_empty()),
                    (6, self.sending.is_empty()),
                    (7, self.sending.len() < HELD),
                ];
                bits.iter().map(|(bit, set)| u32::from(*set) << bit).sum()
            }
            // It ends ORE, which is seen in SR before: what is held came before the lost byte.
            0x04 => {
                self.lost = false;
                u32::from(self.received.pop_front().unwrap_or(0) & 0xff)
            }
            0x08 => self.power,
            0x0c => self.levels,
            0x10..=0x18 => 0,
            _ => return None,
        })
    }

    pub(super) fn usart_write(&mut self, cycles: u32, access: Access, value: u32) -> Option<()> {
        match access.offset & !3 {
            0x00 => {}
            0x04 => self.send(value as u8, access.cycle),
            0x08 => {
                // A bit takes BRR periods of the port's clock; dividers are sixteenths of it, and
                // sixty-fourths of those.
                self.power = value & 0xffff;
                let sixty_fourths = self.power * cycles * 4;
                self.divider = [sixty_fourths / 64, sixty_fourths % 64];
            }
            0x0c => {
                // UE, TE and RE as the bits that PL011 has for them.
                self.levels = value & 0xffff;
                let bit = |from: u32, to: u32| (value >> from & 1) << to;
                self.control = bit(13, 0) | bit(3, 8) | bit(2, 9);
                self.advance(access.cycle);
            }
            0x10..=0x18 => {}
            _ => return None,
        }
        Some(())
    }
}

#[cfg(test)]
mod tests {
    use super::super::*;
    use crate::board::{Board, CoreKind};

    /// The second byte finds the first one still there.
    #[test]
    fn a_lost_byte_is_told() {
        let (mut port, mut bus) = (
            Uart::stm32(37, 2),
            Bus::new(&Board::generic(CoreKind::CortexM4)).unwrap(),
        );
        let access = |offset, cycle| Access {
            offset,
            size: 4,
            core: 0,
            cycle,
        };
        for (at, value) in [(0x08, 2688), (0x0c, 1 << 13 | 1 << 2)] {
            port.write(access(at, 0), value, &mut bus).unwrap();
        }
        port.receive(&[1, 2, 3], 1000);
        let told = [(0, 1000, 0x20), (0, 54_759, 0x20), (0, 54_760, 0x28)];
        let told = told.iter().chain(&[(4, 54_760, 1), (0, 54_760, 0)]);
        for (offset, cycle, word) in told.chain(&[(0, 108_520, 0x20), (4, 108_520, 3)]) {
            let found = port.read(access(*offset, *cycle), &mut bus).unwrap();
            assert_eq!(found & 0x2f, *word, "{offset} at {cycle}");
        }
    }

    /// 31250 baud from 84 MHz in a core of 168 MHz: ten bits of 5376 cycles.
    #[test]
    fn bytes_take_their_time() {
        let (mut port, mut bus) = (
            Uart::stm32(37, 2),
            Bus::new(&Board::generic(CoreKind::CortexM4)).unwrap(),
        );
        let access = |offset, cycle| Access {
            offset,
            size: 4,
            core: 0,
            cycle,
        };
        for (at, value) in [
            (0x08, 2688),
            (0x0c, 1 << 13 | 1 << 3),
            (0x04, 0x90),
            (0x04, 60),
        ] {
            port.write(access(at, 0), value, &mut bus).unwrap();
        }
        assert_eq!(port.due(), 53_760);
        assert_eq!(
            port.read(access(0, 1), &mut bus).unwrap() & 0xc0,
            0,
            "both places are taken"
        );
        assert_eq!(port.read(access(0, 53_760), &mut bus).unwrap() & 0xc0, 0x80);
        assert_eq!(
            port.read(access(0, 107_520), &mut bus).unwrap() & 0xc0,
            0xc0
        );
        assert_eq!(port.output, [0x90, 60]);
    }
}
