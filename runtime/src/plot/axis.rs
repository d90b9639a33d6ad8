//! Axes: from values to places, with ticks at round numbers.

use crate::record::Record;

/// A linear axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Axis {
    /// Ends in the unit shown.
    low: f64,
    high: f64,
    /// What one SI unit is in the unit shown.
    factor: f64,
    /// Place of `low` on the page.
    start: f64,
    /// Place of `high` on the page.
    end: f64,
}

impl Axis {
    /// An axis from exactly `low` to exactly `high`, between two places on the page. A range
    /// without extent is widened.
    pub fn exact(low: f64, high: f64, start: f64, end: f64) -> Axis {
        let (low, high) = if low < high {
            (low, high)
        } else {
            (low - 0.5, low + 0.5)
        };
        Axis {
            low,
            high,
            factor: 1.0,
            start,
            end,
        }
    }

    /// The same axis with labels in a unit of which `factor` make one SI unit.
    #[must_use]
    pub fn in_units(self, factor: f64) -> Axis {
        Axis {
            low: self.low * factor,
            high: self.high * factor,
            factor,
            ..self
        }
    }

    /// An axis that holds all finite values of some series (0 .. 1 if there are none), with a
    /// little room beyond them.
    pub fn around<'a>(series: impl Iterator<Item = &'a Record>, start: f64, end: f64) -> Axis {
        let widest = |a: (f64, f64), b: (f64, f64)| (a.0.min(b.0), a.1.max(b.1));
        let extent = series.filter_map(Record::extent).reduce(widest);
        let (low, high) = extent.unwrap_or((0.0, 1.0));
        let least = 1e-9 * low.abs().max(high.abs()).max(1e-3);
        let (low, high) = if high - low > least {
            (low, high)
        } else {
            (low.min(0.0), high.max(0.0))
        };
        let (low, high) = if high - low > 0.0 {
            (low, high)
        } else {
            (-1.0, 1.0)
        };
        let room = 0.05 * (high - low);
        Axis::exact(low - room, high + room, start, end)
    }

    /// The place of a value (SI).
    pub fn place(&self, value: f64) -> f64 {
        self.start
            + (value * self.factor - self.low) / (self.high - self.low) * (self.end - self.start)
    }

    /// Places of round numbers on the axis, about one every `apart` points, with their labels.
    pub fn ticks(&self, apart: f64) -> Vec<(f64, String)> {
        let wanted = ((self.end - self.start).abs() / apart).max(1.0);
        let step = round_up((self.high - self.low) / wanted);
        let decimals = (-step.log10() - 1e-9).ceil().clamp(0.0, 12.0) as usize;
        let (first, last) = (
            (self.low / step - 1e-9).ceil(),
            (self.high / step + 1e-9).floor(),
        );
        let values =
            (0..=(last - first).clamp(0.0, 1000.0) as usize).map(|i| (first + i as f64) * step);
        values
            .map(|v| (self.place(v / self.factor), label(v, decimals)))
            .collect()
    }
}

/// The next of 1, 2 and 5 times a power of ten.
fn round_up(step: f64) -> f64 {
    let power = 10.0_f64.powf(step.log10().floor());
    [1.0, 2.0, 5.0]
        .into_iter()
        .map(|m| m * power)
        .find(|round| *round >= step * (1.0 - 1e-9))
        .unwrap_or(10.0 * power)
}

/// A number with a proper minus sign; very small and very large ones with a power of ten.
fn label(value: f64, decimals: usize) -> String {
    let digits = |text: &str| text.bytes().any(|b| (b'1'..=b'9').contains(&b));
    let plain = format!("{value:.decimals$}");
    let text = match format!("{value:.2e}").split_once('e') {
        Some((mantissa, power)) if (decimals > 5 || value.abs() >= 1e6) && digits(mantissa) => {
            format!(
                "{}e{power}",
                mantissa.trim_end_matches('0').trim_end_matches('.')
            )
        }
        _ if decimals > 5 => "0".into(),
        _ if digits(&plain) => plain,
        _ => plain.trim_start_matches('-').into(),
    };
    text.replace('-', "−")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn labels(low: f64, high: f64) -> Vec<String> {
        Axis::exact(low, high, 0.0, 400.0)
            .ticks(60.0)
            .into_iter()
            .map(|t| t.1)
            .collect()
    }

    #[test]
    fn ticks_are_round_numbers() {
        assert_eq!(labels(0.0, 37.0), ["0", "10", "20", "30"]);
        assert_eq!(labels(-0.31, 0.52), ["−0.2", "0.0", "0.2", "0.4"]);
        assert_eq!(
            labels(0.0, 0.0041),
            ["0.000", "0.001", "0.002", "0.003", "0.004"]
        );
        assert_eq!(labels(9.5, 10.5), ["9.6", "9.8", "10.0", "10.2", "10.4"]);
        assert_eq!(
            labels(0.0, 3e7),
            ["0", "5e6", "1e7", "1.5e7", "2e7", "2.5e7", "3e7"]
        );
        assert_eq!(
            labels(-3e-8, 0.0),
            [
                "−3e−8",
                "−2.5e−8",
                "−2e−8",
                "−1.5e−8",
                "−1e−8",
                "−5e−9",
                "0"
            ]
        );
    }

    #[test]
    fn places_are_linear_and_flat_data_has_an_axis() {
        let axis = Axis::exact(0.0, 10.0, 100.0, 0.0);
        assert_eq!(
            (axis.place(0.0), axis.place(2.5), axis.place(10.0)),
            (100.0, 75.0, 0.0)
        );
        let millimetres = Axis::exact(0.0, 0.010, 0.0, 100.0).in_units(1e3);
        assert_eq!(millimetres.place(0.005), 50.0);
        assert_eq!(
            millimetres.ticks(50.0),
            [(0.0, "0".into()), (50.0, "5".into()), (100.0, "10".into())]
        );
        for flat in [
            &[0.0][..],
            &[5.0, 5.0],
            &[-3.0; 4],
            &[f64::NAN],
            &[],
            &[1e300],
            &[1e-300],
            &[f64::MAX, -f64::MAX],
        ] {
            let record = Record::from(flat.to_vec());
            let axis = Axis::around([&record].into_iter(), 100.0, 0.0);
            assert!(axis.ticks(40.0).len() < 50, "{flat:?}");
            for v in flat.iter().filter(|v| v.abs() < 1e200) {
                assert!((0.0..=100.0).contains(&axis.place(*v)), "{flat:?} {axis:?}");
            }
        }
    }
}
