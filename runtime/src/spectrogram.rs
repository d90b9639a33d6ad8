//! What a sound is made of over time: levels in bands of a twelfth of an octave, from the
//! short-time Fourier transform (Hann window of 4096 samples).
//!
//! ```text
//!   samples   |......column......|......column......|      a column is so many ticks, a power of two
//!                 [window]               the middle of the window is in the middle of a hop
//!                         [window]       of several in a column each band keeps the loudest
//! ```
//!
//! Memory is bounded: where there are more than 1024 columns, neighbours become one.
//! A band that holds several frequencies of the transform has the level of the loudest, one that
//! holds none has that of the nearest, so a sine has its own level wherever it lies.

use microfft::real::rfft_4096;
use whippen_compiler::rate::Rate;

/// Samples of a window: 93 ms at 44.1 kHz, frequencies 10.8 Hz apart.
pub const WINDOW: usize = 4096;
/// Ticks from one window to the next.
const HOP: usize = 1024;
/// Most columns.
const COLUMNS_MAX: usize = 1024;
/// Bands of an octave.
const BANDS_PER_OCTAVE: f64 = 12.0;
/// Middle of the lowest band (Hz): the lowest A of a piano.
const LOWEST_HZ: f64 = 27.5;
/// The level of silence (dB).
const SILENCE_DB: f64 = -200.0;

/// Levels of a channel of the sound over time.
#[derive(Debug, Clone, PartialEq)]
pub struct Spectrogram {
    /// The channel's name.
    pub name: String,
    rate_hz: f64,
    /// The last samples, as a ring that begins at `at`.
    ring: Vec<f32>,
    at: usize,
    /// Samples that came.
    samples: usize,
    /// Ticks of a column.
    column_ticks: usize,
    /// Powers of the bands, column by column.
    powers: Vec<Vec<f32>>,
}

impl Spectrogram {
    /// Of a channel at a rate.
    pub fn new(name: &str, rate_hz: Rate) -> Spectrogram {
        Spectrogram {
            name: name.to_string(),
            rate_hz: f64::from(rate_hz),
            ring: vec![0.0; WINDOW],
            at: 0,
            samples: 0,
            column_ticks: HOP,
            powers: Vec::new(),
        }
    }

    /// Adds a sample (full scale is 1).
    pub fn push(&mut self, sample: f64) {
        self.ring[self.at] = sample as f32;
        self.at = (self.at + 1) % WINDOW;
        self.samples += 1;
        // The middle of the window is `WINDOW / 2` back.
        let middle = self.samples.checked_sub(WINDOW / 2);
        if let Some(middle) = middle.filter(|middle| middle % HOP == HOP / 2) {
            self.transform(middle);
        }
    }

    /// Ends the sound: its last windows reach into silence.
    pub fn finish(&mut self) {
        let samples = self.samples;
        (0..WINDOW / 2).for_each(|_| self.push(0.0));
        self.samples = samples;
    }

    /// Samples that came.
    pub fn samples(&self) -> usize {
        self.samples
    }

    /// Ticks of a column; the first column begins with the first tick.
    pub fn column_ticks(&self) -> usize {
        self.column_ticks
    }

    /// Columns.
    pub fn columns(&self) -> usize {
        self.powers.len()
    }

    /// Middles of the bands (Hz), upwards.
    pub fn bands_hz(&self) -> Vec<f64> {
        let octaves = (0.5 * self.rate_hz / LOWEST_HZ).log2();
        let last = (octaves * BANDS_PER_OCTAVE).floor().max(0.0) as i32;
        (0..=last)
            .map(|n| LOWEST_HZ * (f64::from(n) / BANDS_PER_OCTAVE).exp2())
            .collect()
    }

    /// Level of a band in a column: that of a sine, in dB of one of full scale.
    pub fn level_db(&self, column: usize, band: usize) -> f64 {
        let power = self.powers.get(column).and_then(|bands| bands.get(band));
        let level = 10.0 * f64::from(power.copied().unwrap_or(0.0)).log10();
        level.max(SILENCE_DB)
    }

    fn transform(&mut self, middle: usize) {
        let mut window = [0.0_f32; WINDOW];
        let (late, early) = self.ring.split_at(self.at);
        for (n, sample) in early.iter().chain(late).enumerate() {
            let turn = std::f64::consts::TAU * n as f64 / WINDOW as f64;
            window[n] = sample * (0.5 - 0.5 * libm::cos(turn)) as f32;
        }
        let spectrum = rfft_4096(&mut window);
        // The first holds the highest frequency in its imaginary part, which is in no band.
        spectrum[0].im = 0.0;
        // A sine of amplitude 1 has half of the window's sum in its frequency.
        let scale = (4.0 / WINDOW as f32).powi(2);
        let powers: Vec<f32> = spectrum.iter().map(|c| c.norm_sqr() * scale).collect();
        let bands = self.in_bands(&powers);
        self.add(middle / self.column_ticks, bands);
    }

    fn in_bands(&self, powers: &[f32]) -> Vec<f32> {
        let apart_hz = self.rate_hz / WINDOW as f64;
        let half = (0.5 / BANDS_PER_OCTAVE).exp2();
        let last = powers.len() - 1;
        let of = |middle_hz: f64| {
            let first = (middle_hz / half / apart_hz).ceil() as usize;
            let end = (middle_hz * half / apart_hz).ceil() as usize;
            let nearest = (middle_hz / apart_hz).round() as usize;
            let inside = if first < end {
                first..end
            } else {
                nearest..nearest + 1
            };
            let inside = inside.start.min(last)..inside.end.min(last + 1);
            powers[inside].iter().fold(0.0, |most, p| p.max(most))
        };
        self.bands_hz().into_iter().map(of).collect()
    }

    fn add(&mut self, column: usize, bands: Vec<f32>) {
        match self.powers.get_mut(column) {
            Some(known) => louder(known, &bands),
            None => self.powers.push(bands),
        }
        if self.powers.len() > COLUMNS_MAX {
            self.column_ticks *= 2;
            let pairs = self.powers.chunks(2).map(|pair| {
                let mut one = pair[0].clone();
                pair[1..].iter().for_each(|next| louder(&mut one, next));
                one
            });
            self.powers = pairs.collect();
        }
    }
}

/// Keeps the louder of each band.
fn louder(known: &mut [f32], other: &[f32]) {
    for (known, other) in known.iter_mut().zip(other) {
        *known = known.max(*other);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A sine of that many seconds.
    fn sine(frequency_hz: f64, amplitude: f64, seconds: f64) -> Spectrogram {
        let mut spectrogram = Spectrogram::new("sound", 44_100.into());
        let ticks = (seconds * 44_100.0) as usize;
        for tick in 0..ticks {
            let turns = frequency_hz * tick as f64 / 44_100.0;
            spectrogram.push(amplitude * libm::sin(std::f64::consts::TAU * turns));
        }
        spectrogram.finish();
        spectrogram
    }

    /// The loudest band of a column: its middle (Hz) and level (dB).
    fn loudest(of: &Spectrogram, column: usize) -> (f64, f64) {
        let bands = of.bands_hz();
        let levels = (0..bands.len()).map(|band| (bands[band], of.level_db(column, band)));
        levels.fold((0.0, f64::NEG_INFINITY), |most, next| {
            if next.1 > most.1 { next } else { most }
        })
    }

    #[test]
    fn a_sine_has_its_own_level_in_its_own_band() {
        for (frequency_hz, amplitude, level_db) in [
            (110.0, 1.0, 0.0),
            (440.0, 0.1, -20.0),
            (3520.0, 0.01, -40.0),
            (7902.13, 1.0, 0.0),
        ] {
            let spectrogram = sine(frequency_hz, amplitude, 1.0);
            let (band_hz, level) = loudest(&spectrogram, spectrogram.columns() / 2);
            let semitones = 12.0 * (band_hz / frequency_hz).log2();
            // Below 180 Hz neighbouring bands share a frequency of the transform.
            let most = if frequency_hz < 180.0 { 1.1 } else { 0.6 };
            assert!(semitones.abs() <= most, "{frequency_hz} Hz in {band_hz} Hz");
            // A Hann window loses at most 1.42 dB between two frequencies.
            assert!((-1.5..=0.05).contains(&(level - level_db)), "{level} dB");
        }
    }

    #[test]
    fn columns_are_bounded_and_keep_what_was_loud_for_a_moment() {
        let mut spectrogram = Spectrogram::new("sound", 44_100.into());
        let ticks = 60 * 44_100;
        for tick in 0..ticks {
            let loud = (441_000..445_000).contains(&tick);
            let turns = 1000.0 * tick as f64 / 44_100.0;
            let amplitude = if loud { 0.5 } else { 0.0 };
            spectrogram.push(amplitude * libm::sin(std::f64::consts::TAU * turns));
        }
        spectrogram.finish();
        let columns = spectrogram.columns();
        assert!((513..=1024).contains(&columns), "{columns}");
        let covered = columns * spectrogram.column_ticks();
        assert!(
            (ticks..ticks + spectrogram.column_ticks()).contains(&covered),
            "{covered}"
        );
        let at = 443_000 / spectrogram.column_ticks();
        let (band_hz, level_db) = loudest(&spectrogram, at);
        assert!(
            (950.0..1060.0).contains(&band_hz) && level_db > -9.0,
            "{band_hz} {level_db}"
        );
        assert!(loudest(&spectrogram, at / 2).1 <= SILENCE_DB);
    }

    #[test]
    fn no_rate_is_too_low() {
        for rate_hz in [1, 40, 56, 1000] {
            let mut spectrogram = Spectrogram::new("sound", rate_hz.into());
            (0..5000).for_each(|_| spectrogram.push(1.0));
            spectrogram.finish();
            assert!(spectrogram.bands_hz().len() <= 110);
            assert!(spectrogram.level_db(0, 0) <= 6.1);
        }
    }
}
