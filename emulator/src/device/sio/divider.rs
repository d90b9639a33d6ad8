//! The divider of RP2040's SIO: a quotient and remainder eight cycles after either operand is
//! written (datasheet 2.3.1.5).

/// One core's divider.
#[derive(Clone, Copy, Default)]
pub(super) struct Divider {
    dividend: u32,
    divisor: u32,
    quotient: u32,
    remainder: u32,
    ready: u64,
    dirty: bool,
}

/// Cycles from the write of an operand to the result.
const CYCLES: u64 = 8;

impl Divider {
    pub(super) fn read(&mut self, at: u32, cycle: u64) -> Option<u32> {
        Some(match at {
            0x60 | 0x68 => self.dividend,
            0x64 | 0x6c => self.divisor,
            0x70 => {
                self.dirty = false;
                self.quotient
            }
            0x74 => self.remainder,
            0x78 => u32::from(cycle >= self.ready) | u32::from(self.dirty) << 1,
            _ => return None,
        })
    }

    pub(super) fn write(&mut self, at: u32, value: u32, cycle: u64) -> Option<()> {
        match at {
            0x60 | 0x68 => self.dividend = value,
            0x64 | 0x6c => self.divisor = value,
            0x70 => self.quotient = value,
            0x74 => self.remainder = value,
            _ => return None,
        }
        self.dirty = true;
        if at < 0x70 {
            (self.quotient, self.remainder) = divide(self.dividend, self.divisor, at >= 0x68);
            self.ready = cycle + CYCLES;
        } else {
            self.ready = cycle;
        }
        Some(())
    }
}

/// Quotient and remainder. Division by zero gives the largest quotient of the dividend's sign, and
/// the dividend.
fn divide(dividend: u32, divisor: u32, signed: bool) -> (u32, u32) {
    let (a, b) = (dividend as i32, divisor as i32);
    match (signed, divisor) {
        (false, 0) => (u32::MAX, dividend),
        (false, _) => (dividend / divisor, dividend % divisor),
        (true, 0) => (if a < 0 { 1 } else { u32::MAX }, dividend),
        (true, _) => (a.wrapping_div(b) as u32, a.wrapping_rem(b) as u32),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn divides_after_eight_cycles() {
        let mut d = Divider::default();
        d.write(0x68, -7i32 as u32, 100).unwrap();
        d.write(0x6c, 2, 101).unwrap();
        assert_eq!(d.read(0x78, 108), Some(0b10), "not ready, not read");
        assert_eq!(d.read(0x78, 109), Some(0b11));
        assert_eq!(
            (d.read(0x74, 109), d.read(0x70, 109)),
            (Some(-1i32 as u32), Some(-3i32 as u32))
        );
        assert_eq!(d.read(0x78, 110), Some(0b01));
        assert_eq!(divide(1 << 31, u32::MAX, true), (1 << 31, 0));
        assert_eq!(divide(5, 0, true), (u32::MAX, 5));
    }
}
