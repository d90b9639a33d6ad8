//! A magnetic angle sensor on three wires, as the MT6701 is read: select, clock, data.
//!
//! ```text
//!   select  ~~\___________________________________________/~~
//!   clock   ______/~\_/~\_/~\_ .. 24 times              ____
//!   data          angle 13 .. 0, track lost, pushed, field 1, 0, CRC 5 .. 0
//! ```
//!
//! A bit is put out at the rising edge of the clock, and read at the falling one. The CRC is that
//! of the 18 bits before it, X^6 + X + 1 from 0 on. Frame and CRC are what drivers for the part
//! agree on; its timing is not checked against its datasheet. Not here: I2C, its other outputs,
//! the hysteresis of its angle, which it remembers.

/// What is wrong with a sensor.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub enum SensorFault {
    /// Nothing.
    #[default]
    None,
    /// Its data line lies at ground.
    ShortToGround,
    /// Its data line is broken: what is at the other end decides.
    Broken,
    /// A bit of its CRC is wrong.
    WrongCrc,
    /// Its magnet is gone, or too near: the field's two bits.
    Field(u8),
    /// It has lost track of the angle.
    LostTrack,
    /// It says another angle than there is: so many steps of 16384 a turn further.
    Jumped(u16),
}

/// Bits of a frame.
const BITS: u32 = 24;

/// See the module.
#[derive(Clone, Debug, Default)]
pub(super) struct AngleSensor {
    pub fault: SensorFault,
    frame: u32,
    sent: u32,
    selected: bool,
    clock: bool,
    /// What is on its data pin: `None` is nothing.
    put: Option<bool>,
}

impl AngleSensor {
    /// Its two inputs, at an angle of so many steps. What it puts on its data pin from now on, if
    /// that changes: `None` inside is nothing.
    pub fn inputs(&mut self, select: bool, clock: bool, angle: u16) -> Option<Option<bool>> {
        let (was_high, was_selected) = (self.clock, self.selected);
        let selected = !select;
        (self.clock, self.selected) = (clock, selected);
        let rises = clock && !was_high;
        if selected && !was_selected {
            (self.frame, self.sent) = (self.framed(angle), 0);
        }
        let put = match () {
            () if self.fault == SensorFault::ShortToGround => Some(false),
            () if !selected || self.fault == SensorFault::Broken => None,
            () if rises && self.sent < BITS => {
                self.sent += 1;
                Some(self.frame >> (BITS - self.sent) & 1 != 0)
            }
            () => self.put,
        };
        let old = std::mem::replace(&mut self.put, put);
        (old != put).then_some(put)
    }

    fn framed(&self, angle: u16) -> u32 {
        let (angle, status, wrong) = match self.fault {
            SensorFault::Field(field) => (angle, u32::from(field & 3), 0),
            SensorFault::LostTrack => (angle, 8, 0),
            SensorFault::WrongCrc => (angle, 0, 1),
            SensorFault::Jumped(steps) => (angle.wrapping_add(steps), 0, 0),
            _ => (angle, 0, 0),
        };
        let data = u32::from(angle & 0x3fff) << 4 | status;
        data << 6 | crc(data) ^ wrong
    }
}

/// The remainder of 18 bits, the highest first.
fn crc(data: u32) -> u32 {
    (0..18).rev().fold(0, |crc, bit| {
        let out = crc >> 5 & 1 ^ data >> bit & 1;
        (crc << 1 & 0x3f) ^ (0b11 * out)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A frame as whoever clocks it reads it.
    fn read(sensor: &mut AngleSensor, angle: u16) -> u32 {
        let mut level = true;
        let mut put = |select, clock| {
            if let Some(put) = sensor.inputs(select, clock, angle) {
                level = put.unwrap_or(true);
            }
            level
        };
        put(true, false);
        put(false, false);
        let mut word = 0;
        for _ in 0..BITS {
            put(false, true);
            word = word << 1 | u32::from(put(false, false));
        }
        word
    }

    /// A polynomial's multiples have no remainder: dividing data and CRC together leaves nothing.
    fn remainder(word: u32) -> u32 {
        (6..BITS)
            .rev()
            .fold(word, |left, bit| match left >> bit & 1 {
                1 => left ^ 0b100_0011 << (bit - 6),
                _ => left,
            })
    }

    #[test]
    fn a_frame_is_the_angle_its_status_and_a_crc_that_divides() {
        let mut sensor = AngleSensor::default();
        for angle in [0, 1, 0x1555, 0x2aaa, 0x3fff, 12_345] {
            let word = read(&mut sensor, angle);
            assert_eq!((word >> 10, word >> 6 & 15), (u32::from(angle), 0));
            assert_eq!(remainder(word), 0, "{word:#x}");
        }
    }

    #[test]
    fn every_fault_shows_as_it_would() {
        let seen = |fault| {
            let mut sensor = AngleSensor {
                fault,
                ..AngleSensor::default()
            };
            read(&mut sensor, 0x1234)
        };
        // All zeros are a frame that is right by its CRC, all ones are not.
        assert_eq!(seen(SensorFault::ShortToGround), 0);
        assert_eq!(seen(SensorFault::Broken), 0xff_ffff);
        assert_ne!(remainder(0xff_ffff), 0);
        assert_ne!(remainder(seen(SensorFault::WrongCrc)), 0);
        assert_eq!(seen(SensorFault::Field(2)) >> 6 & 15, 2);
        assert_eq!(seen(SensorFault::LostTrack) >> 6 & 15, 8);
        assert_eq!(seen(SensorFault::Jumped(0x10)) >> 10, 0x1244);
    }
}
