//! Motions as WAV files: one channel of 16, 24 or 32 bits, or of floats, at the file's rate.
//!
//! A sample of full scale is as far as the caller says; the file itself knows no unit.

use std::io::BufReader;
use std::path::Path;

use super::ROWS_MAX;
use super::titled::too_many_rows;
use crate::files::{FileError, InputKind, open};

/// What was read.
#[derive(Debug, Clone, PartialEq)]
pub struct WavMotion {
    /// Samples a second.
    pub rate_hz: f64,
    /// Where the key was (SI).
    pub positions: Vec<f64>,
}

/// Reads a channel (counted from 1), whose full scale is so far (SI).
///
/// # Errors
/// It is no WAV file, or not of these kinds; it has no such channel, no samples, or ends early; a
/// sample is not finite; there are more than [`ROWS_MAX`].
pub fn read(path: &Path, channel: usize, full_scale: f64) -> Result<WavMotion, FileError> {
    let error = |message: String| FileError::new(path, message);
    let wrong = |e: hound::Error| error(format!("cannot be read as a WAV file: {e}"));
    let file = BufReader::with_capacity(1 << 16, open(path, InputKind::RECORDING)?);
    let mut reader = hound::WavReader::new(file).map_err(wrong)?;
    let spec = reader.spec();
    let (channels, bits) = (usize::from(spec.channels), spec.bits_per_sample);
    if channel == 0 || channel > channels {
        let what = format!("has {channels} channels, and there is no channel {channel}");
        return Err(error(what));
    }
    if reader.duration() as usize > ROWS_MAX {
        return Err(too_many_rows(path, ROWS_MAX));
    }
    let own = |at: usize| at % channels == channel - 1;
    let positions: Result<Vec<f64>, hound::Error> = match (spec.sample_format, bits) {
        (hound::SampleFormat::Float, 32) => {
            let samples = reader.samples::<f32>().enumerate();
            let samples = samples.filter(|(at, _)| own(*at));
            samples
                .map(|(_, sample)| Ok(f64::from(sample?) * full_scale))
                .collect()
        }
        (hound::SampleFormat::Int, 16 | 24 | 32) => {
            let unit = full_scale / f64::from(1_u32 << (bits - 1));
            let samples = reader.samples::<i32>().enumerate();
            let samples = samples.filter(|(at, _)| own(*at));
            samples
                .map(|(_, sample)| Ok(f64::from(sample?) * unit))
                .collect()
        }
        _ => {
            let what = format!(
                "has samples of {bits} bits; 16, 24 and 32 bits are read, and floats of 32"
            );
            return Err(error(what));
        }
    };
    let positions = positions.map_err(wrong)?;
    match positions.iter().position(|x| !x.is_finite()) {
        _ if positions.is_empty() => Err(error("has no samples".to_string())),
        Some(at) => Err(error(format!("sample {at} is not finite"))),
        None => Ok(WavMotion {
            rate_hz: f64::from(spec.sample_rate),
            positions,
        }),
    }
}

#[cfg(test)]
mod tests {
    use super::read;

    #[test]
    fn every_kind_of_sample_is_read_and_others_are_refused() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("a.wav");
        let half = [(16, 1 << 14), (24, 1 << 22), (32, 1 << 30), (8, 1 << 6)];
        for (bits, sample) in half {
            let spec = hound::WavSpec {
                channels: 2,
                sample_rate: 8000,
                bits_per_sample: bits,
                sample_format: hound::SampleFormat::Int,
            };
            let mut writer = hound::WavWriter::create(&path, spec).expect("is created");
            for one in [0, sample, 0, -sample] {
                writer.write_sample(one).expect("is written");
            }
            writer.finalize().expect("ends");
            let found = read(&path, 2, 0.02);
            match bits {
                8 => assert!(found.expect_err("8 bits").to_string().contains("8 bits")),
                _ => assert_eq!(found.expect("is read").positions, [0.01, -0.01]),
            }
        }
        assert!(read(&path, 3, 0.02).is_err(), "no third channel");
        let spec = hound::WavSpec {
            channels: 1,
            sample_rate: 48000,
            bits_per_sample: 32,
            sample_format: hound::SampleFormat::Float,
        };
        let mut writer = hound::WavWriter::create(&path, spec).expect("is created");
        writer.write_sample(0.25_f32).expect("is written");
        writer.finalize().expect("ends");
        let found = read(&path, 1, 0.02).expect("is read");
        assert_eq!(
            (found.rate_hz, &found.positions[..]),
            (48000.0, &[0.005][..])
        );
        std::fs::write(&path, "RIFFnonsense").expect("is written");
        assert!(read(&path, 1, 0.02).is_err());
    }
}
