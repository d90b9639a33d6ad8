//! From samples at given times to samples at one rate.
//!
//! Times that stay within one hundredth of a step of an even grid are that grid. Others are
//! interpolated (smoothly and without overshoot) onto an even grid, and a note says so. Its step is
//! the median, as clocks of recordings jitter; where steps are very different, as in a table of a
//! few corners written by hand, it is the shortest, so that no corner is lost.

use super::pchip::Pchip;

/// Largest distance of a time from its place on an even grid, in steps.
const TOLERANCE: f64 = 0.01;
/// Steps are very different where the longest is more than so many of the shortest.
const JITTER: f64 = 2.5;
/// Samples that corners may take, in rows and besides.
const CORNERS: [f64; 2] = [8.0, 10_000.0];

/// Samples at one rate.
#[derive(Debug, Clone, PartialEq)]
pub struct Uniform {
    /// Samples per second.
    pub rate_hz: f64,
    /// The samples; the first is at the first time.
    pub samples: Vec<f64>,
    /// What had to be done to get them.
    pub note: Option<String>,
}

/// Puts samples onto an even grid. The times (s) increase strictly; `limit` is the largest number
/// of samples wanted.
///
/// # Errors
/// There are fewer than two samples, or the gaps are so long that more than `limit` samples would
/// fill them.
pub fn uniform(times_s: &[f64], samples: Vec<f64>, limit: usize) -> Result<Uniform, String> {
    let (Some(first), Some(last)) = (
        times_s.first(),
        times_s.last().filter(|_| times_s.len() > 1),
    ) else {
        return Err("at least two rows are needed to know the rate".into());
    };
    let step = (last - first) / (times_s.len() - 1) as f64;
    let from_grid = |step: f64| {
        let place = |i: usize| (times_s[i] - first) / step - i as f64;
        (0..times_s.len())
            .map(|i| place(i).abs())
            .fold(0.0, f64::max)
    };
    if from_grid(step) <= TOLERANCE {
        let round_hz = (1.0 / step).round();
        let rate_hz = if round_hz > 0.0 && from_grid(1.0 / round_hz) <= TOLERANCE {
            round_hz
        } else {
            1.0 / step
        };
        return Ok(Uniform {
            rate_hz,
            samples,
            note: None,
        });
    }
    interpolated(times_s, samples, limit)
}

fn interpolated(times_s: &[f64], samples: Vec<f64>, limit: usize) -> Result<Uniform, String> {
    let (first, last) = (times_s[0], times_s[times_s.len() - 1]);
    let mut steps: Vec<f64> = times_s.windows(2).map(|w| w[1] - w[0]).collect();
    let longest = steps.iter().copied().fold(0.0, f64::max);
    let shortest = steps.iter().copied().fold(f64::INFINITY, f64::min);
    let middle = steps.len() / 2;
    let median = *steps.select_nth_unstable_by(middle, f64::total_cmp).1;
    let corners = CORNERS[0] * times_s.len() as f64 + CORNERS[1];
    let step = match longest > JITTER * shortest && (last - first) / shortest <= corners {
        true => shortest,
        false => median,
    };
    let count = ((last - first) / step + 1e-6).floor() + 1.0;
    if count > limit as f64 {
        return Err(format!(
            "the times are too uneven: most steps are {step:e} s, but the file spans {:e} s",
            last - first
        ));
    }
    let curve = Pchip::new(times_s.to_vec(), samples).ok_or("the times do not increase")?;
    let samples = curve
        .sweep((0..count as usize).map(|i| first + i as f64 * step))
        .collect();
    let note = format!(
        "the times are uneven (the longest step is {:.3} ms, most are {:.3} ms): interpolated at {:.3} Hz",
        longest * 1e3,
        median * 1e3,
        1.0 / step
    );
    Ok(Uniform {
        rate_hz: 1.0 / step,
        samples,
        note: Some(note),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn times(rate_hz: f64, count: usize) -> Vec<f64> {
        (0..count).map(|i| 3.0 + i as f64 / rate_hz).collect()
    }

    #[test]
    fn no_corner_of_a_table_by_hand_is_lost() {
        let corners = [0.0, 0.1, 1.1, 1.3, 2.0];
        let places = vec![0.0, 0.0, 60.0, 60.0, 0.0];
        let grid = uniform(&corners, places.clone(), 1000).unwrap();
        assert!((grid.rate_hz - 10.0).abs() < 1e-9 && grid.note.is_some());
        for (time, place) in corners.iter().zip(&places) {
            let at = grid.samples[(time * 10.0).round() as usize];
            assert!((at - place).abs() < 1e-9, "{time}: {at}");
        }
        // Far more samples than rows: one step too short does not make them.
        let mut jitter = times(1000.0, 1000);
        jitter[500] = jitter[499] + 1e-9;
        let grid = uniform(&jitter, jitter.clone(), 1 << 20).unwrap();
        assert!((grid.rate_hz - 1000.0).abs() < 1e-3, "{}", grid.rate_hz);
    }

    #[test]
    fn even_times_keep_the_samples_and_find_the_rate() {
        for rate_hz in [2000.0, 44_100.0, 1234.5, 0.25] {
            let t = times(rate_hz, 1000);
            let u = uniform(&t, t.clone(), 1 << 20).unwrap();
            assert_eq!((&u.samples, &u.note), (&t, &None));
            assert!((u.rate_hz / rate_hz - 1.0).abs() < 1e-9, "{}", u.rate_hz);
            assert!(
                rate_hz.fract() != 0.0 || u.rate_hz == rate_hz,
                "whole rates are found exactly"
            );
        }
        let rounded: Vec<f64> = times(2000.0, 1000)
            .iter()
            .map(|t| (t * 1e6).round() / 1e6)
            .collect();
        assert_eq!(
            uniform(&rounded, rounded.clone(), 1 << 20).unwrap().rate_hz,
            2000.0
        );
    }

    #[test]
    fn uneven_times_are_interpolated_with_a_note() {
        let t: Vec<f64> = (0..2000)
            .map(|i| f64::from(i) * 1e-3 + 2e-4 * f64::from(i % 3))
            .collect();
        let x = t.iter().map(|t| (20.0 * t).sin()).collect();
        let u = uniform(&t, x, 1 << 20).unwrap();
        assert!(
            u.note.as_deref().is_some_and(|n| n.contains("uneven")),
            "{:?}",
            u.note
        );
        let worst = u
            .samples
            .iter()
            .enumerate()
            .map(|(i, x)| (x - (20.0 * i as f64 / u.rate_hz).sin()).abs());
        assert!(worst.fold(0.0, f64::max) < 1e-4);
        assert!((u.samples.len() as f64 / u.rate_hz - 2.0).abs() < 0.01);
    }

    #[test]
    fn a_gap_is_bridged_but_not_without_end() {
        let u = uniform(
            &[0.0, 0.1, 0.2, 0.6, 0.7],
            vec![0.0, 1.0, 2.0, 2.0, 3.0],
            100,
        )
        .unwrap();
        assert_eq!(u.samples.len(), 8);
        assert!(
            u.samples[3..6].iter().all(|&x| (x - 2.0).abs() < 0.2),
            "{:?}",
            u.samples
        );
        assert!(
            uniform(&[0.0, 1e-9, 2e-9, 1e9], vec![0.0; 4], 1 << 30)
                .unwrap_err()
                .contains("too uneven")
        );
        assert!(
            uniform(&[1.0], vec![0.0], 100)
                .unwrap_err()
                .contains("two rows")
        );
        assert!(uniform(&[], vec![], 100).unwrap_err().contains("two rows"));
    }
}
