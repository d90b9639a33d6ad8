//! Values of options: numbers and quantities. What is wrong says what is wanted.

use std::ops::RangeInclusive;
use std::path::PathBuf;

use whippen_compiler::check::tick_rate;
use whippen_compiler::rate::Rate;
use whippen_compiler::units::{Dim, Quantity, parse_quantity};
use whippen_runtime::device::Device;

/// What `--tick-rate` is for.
pub const TICK_RATE: &str = "Ticks per second, 1 to 1000000, such as 8000, 8kHz or 150MHz/3400; the keyboard's otherwise, or 44100";

/// Most keys that are worth a try: more than any board has.
const KEYS_MAX: u32 = 65_536;

/// `--notes`: a name and a file.
pub fn named_file(text: &str) -> Result<(String, PathBuf), String> {
    match text.split_once('=') {
        Some((name, file)) if !name.is_empty() && !file.is_empty() => {
            Ok((name.to_string(), PathBuf::from(file)))
        }
        _ => Err("wanted is a live parameter and a file, such as pitch=riff.mid".to_string()),
    }
}

/// A whole number; `usual` is one that many give.
fn whole<T>(text: &str, range: RangeInclusive<T>, usual: T) -> Result<T, String>
where
    T: std::str::FromStr + PartialOrd + Copy + std::fmt::Display,
{
    let number = text.parse().ok().filter(|number| range.contains(number));
    let (least, most) = (range.start(), range.end());
    number
        .ok_or_else(|| format!("wanted is a whole number from {least} to {most}, such as {usual}"))
}

/// `--keys`: how many.
pub fn keys(text: &str) -> Result<u32, String> {
    whole(text, 1..=KEYS_MAX, 40)
}

/// `--modes`: instructions for all modes of a key.
pub fn modes(text: &str) -> Result<usize, String> {
    whole(text, 0..=100_000_000, 8000)
}

/// `--mode`: one of the modes.
pub fn mode(text: &str) -> Result<u32, String> {
    whole(text, 0..=u32::MAX, 0)
}

/// `--every`: rows.
pub fn every(text: &str) -> Result<u32, String> {
    whole(text, 1..=u32::MAX, 44)
}

/// `--threads`: how many.
pub fn threads(text: &str) -> Result<u32, String> {
    whole(text, 1..=256, 2)
}

/// `--sobol`: points.
pub fn points(text: &str) -> Result<u32, String> {
    whole(text, 2..=65_536, 64)
}

/// `--column`: a column of a table.
pub fn column(text: &str) -> Result<u32, String> {
    whole(text, 1..=u32::MAX, 2).map_err(|why| format!("{why}: columns are counted from 1"))
}

/// `--gdb`: a port of this machine.
pub fn port(text: &str) -> Result<u16, String> {
    whole(text, 0..=u16::MAX, 3333)
}

/// `--baud`: bits per second.
pub fn baud(text: &str) -> Result<u32, String> {
    whole(text, 300..=20_000_000, 3_000_000)
}

/// `--shifted-flags`: cycles.
pub fn shifted_flags(text: &str) -> Result<u8, String> {
    whole(text, 1..=2, 2)
}

/// `--tick-rate`: ticks per second.
pub fn rate(text: &str) -> Result<Rate, String> {
    let wanted = |why: String| format!("{why}; wanted is a rate, such as 8000 or 8kHz");
    let (frequency, divisor) = text.split_once('/').unwrap_or((text, "1"));
    let hertz = match frequency.trim().parse::<f64>() {
        Ok(hertz) => hertz,
        Err(_) => quantity(frequency, Dim::PER_TIME, "a rate, such as 8000 or 8kHz")?,
    };
    let divisor = divisor
        .trim()
        .parse::<u32>()
        .map_err(|_| wanted(format!("`{}` is no whole number of cycles", divisor.trim())))?;
    tick_rate(hertz / f64::from(divisor)).map_err(wanted)
}

/// `--clock`: whole cycles per second.
pub fn clock(text: &str) -> Result<u32, String> {
    let wanted = || format!("`{text}`: wanted is a clock from 1 Hz to 4 GHz, such as 170MHz");
    let hertz = match text.trim().parse::<f64>() {
        Ok(hertz) => hertz,
        Err(_) => quantity(text, Dim::PER_TIME, "a clock, such as 170MHz")?,
    };
    let is_whole = (1.0..=4e9).contains(&hertz) && hertz.fract() == 0.0;
    is_whole.then_some(hertz as u32).ok_or_else(wanted)
}

/// A length.
pub fn length(text: &str) -> Result<f64, String> {
    quantity(text, Dim::LENGTH, "a length, such as 12.7mm")
}

/// A number of the unit in which a recording has its readings, not below zero.
pub fn reading(text: &str) -> Result<f64, String> {
    let number = text.parse().ok();
    let possible = number.filter(|number: &f64| *number >= 0.0 && number.is_finite());
    possible.ok_or_else(|| "wanted is a number of readings, such as 0.0002".to_string())
}

/// A speed above zero; a plain number is in m/s.
pub fn speed(text: &str) -> Result<f64, String> {
    positive(text, Dim::SPEED, "a speed, such as 5mm/s")
}

/// A frequency; a plain number is in Hz.
pub fn frequency(text: &str) -> Result<f64, String> {
    positive(text, Dim::PER_TIME, "a frequency, such as 200Hz")
}

/// A time; a plain number is in seconds.
pub fn seconds(text: &str) -> Result<f64, String> {
    positive(text, Dim::TIME, "a time, such as 10s")
}

/// `--noise`: of a sensor, a length or an angle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Noise {
    rms: f64,
    dim: Dim,
}

/// A length or an angle, not below zero.
pub fn noise(text: &str) -> Result<Noise, String> {
    let noise = [Dim::LENGTH, Dim::NUMBER].into_iter().find_map(|dim| {
        let rms = quantity(text, dim, "").ok()?;
        Some(Noise { rms, dim })
    });
    let possible = noise.filter(|noise| noise.rms >= 0.0 && noise.rms.is_finite());
    possible.ok_or_else(|| "not a length or an angle, such as 1um or 0.005deg".to_string())
}

impl Noise {
    /// A device whose sensor has this noise.
    pub fn of(self, device: &Device) -> Result<Device, String> {
        if device.ports.len() > 1 {
            let why = "--noise is of a key's one sensor; of several, each states its own";
            return Err(format!(
                "{why} in the device's file, `noise` of its `sensor`"
            ));
        }
        let (wanted, measures) = match device.turns() {
            true => (Dim::NUMBER, "an angle, such as 0.005deg"),
            false => (Dim::LENGTH, "a length, such as 1um"),
        };
        match self.dim == wanted {
            true => Ok(device.with_noise(self.rms)),
            false => Err(format!(
                "--noise: the sensor of `{}` measures {measures}",
                device.name
            )),
        }
    }
}

/// A quantity above zero; a plain number is in SI.
fn positive(text: &str, dim: Dim, wanted: &str) -> Result<f64, String> {
    let value = text
        .parse::<f64>()
        .map_or_else(|_| quantity(text, dim, wanted), Ok)?;
    if value.is_finite() && value > 0.0 {
        Ok(value)
    } else {
        Err(format!("wanted is {wanted}, above zero"))
    }
}

/// A quantity of a dimension, in SI.
pub fn quantity(text: &str, dim: Dim, wanted: &str) -> Result<f64, String> {
    match parse_quantity(text) {
        Ok(Quantity::Real { value, dim: found }) if found == dim => Ok(value),
        Ok(_) => Err(format!("not {wanted}")),
        Err(error) => Err(format!("{error}; wanted is {wanted}")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_no_number_says_what_is_wanted() {
        let wanted = "wanted is a whole number from 1 to 65536, such as 40";
        for text in ["x", "0", "-1", "1.5", "1,5", "99999999999999999999", ""] {
            assert_eq!(keys(text).unwrap_err(), wanted, "{text}");
        }
        assert_eq!(keys("65536"), Ok(65_536));
        assert!(modes("x").unwrap_err().contains("such as 8000"));
    }

    #[test]
    fn a_clock_is_whole_hertz() {
        for (text, hertz) in [
            ("170MHz", 170_000_000),
            ("64 MHz", 64_000_000),
            ("1e6", 1_000_000),
        ] {
            assert_eq!(clock(text), Ok(hertz), "{text}");
        }
        for text in ["0", "-1", "5GHz", "1.5", "fast", "3mm"] {
            assert!(clock(text).is_err(), "{text}");
        }
    }

    #[test]
    fn a_rate_may_have_a_unit() {
        for (text, hertz) in [("44100", 44_100), ("44.1kHz", 44_100), ("8 kHz", 8000)] {
            assert_eq!(rate(text), Ok(Rate::whole(hertz)), "{text}");
        }
        for text in ["150MHz/3400", "150 MHz / 3400", "750000/17"] {
            assert_eq!(rate(text).ok(), Rate::new(750_000, 17), "{text}");
        }
        for text in [
            "x", "0", "-1", "44.1k", "1MHzz", "0.5", "2 s", "nan", "1e99",
        ] {
            assert!(rate(text).unwrap_err().contains("such as 8000"), "{text}");
        }
    }

    #[test]
    fn times_are_above_zero() {
        assert_eq!((seconds("10"), seconds("10ms")), (Ok(10.0), Ok(0.01)));
        for text in ["0", "-1", "inf", "nan", "x", "4mm"] {
            assert!(seconds(text).unwrap_err().contains("such as 10s"), "{text}");
        }
    }
}
