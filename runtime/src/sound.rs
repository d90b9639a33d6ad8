//! What a program lets hear, as a WAV file: a sample a tick, 24 bits, a channel per side.

use std::cell::RefCell;
use std::io::{self, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::rc::Rc;

use whippen_compiler::kernel;
use whippen_compiler::lower::ExportKind;
use whippen_compiler::pipeline::Compiled;
use whippen_compiler::rate::Rate;

use crate::engine::Engine;
use crate::files::{FileError, OutputFile};

/// Samples of the longest file: its bytes are counted in 32 bits, 3 a sample.
const SAMPLES_MAX: u32 = 1_431_655_000;
/// Full scale of a sample.
const FULL_SCALE: f64 = 8_388_607.0;

/// A WAV file that is being written while a program plays.
pub struct SoundFile {
    path: PathBuf,
    file: Shared,
    writer: hound::WavWriter<Shared>,
    /// How many channels there are.
    sides: usize,
    /// The exports that are channels, of engines that observe them.
    channels: Vec<usize>,
    /// Samples that were cut off at full scale.
    clipped: usize,
}

/// The file, for the writer of WAV files, which does not give back what it was given.
#[derive(Clone)]
struct Shared(Rc<RefCell<OutputFile>>);

impl Write for Shared {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.0.borrow_mut().write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.0.borrow_mut().flush()
    }
}

impl Seek for Shared {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        self.0.borrow_mut().seek(to)
    }
}

impl SoundFile {
    /// Begins a file of this name.
    ///
    /// # Errors
    /// The program has no `sound`; the file cannot be written.
    pub fn create(path: &Path, compiled: &Compiled) -> Result<SoundFile, FileError> {
        let exports = compiled.lowered.exports.iter().enumerate();
        let channels: Vec<usize> = exports
            .filter(|(_, export)| matches!(export.kind, ExportKind::Channel(_)))
            .map(|(index, _)| index)
            .collect();
        let sides = compiled.model.channels.len();
        if sides == 0 {
            let message = format!(
                "`{}` has no sound to write to it; add a line such as `sound out = ..`",
                compiled.model.name
            );
            return Err(FileError::not_written(path, &io::Error::other(message)));
        }
        let file = Shared(Rc::new(RefCell::new(OutputFile::create(path)?)));
        let spec = hound::WavSpec {
            channels: sides as u16,
            // A file of sound has whole rates only: at 44117.647 Hz it is 8 ppm off.
            sample_rate: compiled.model.rate_hz.rounded_hz(),
            bits_per_sample: 24,
            sample_format: hound::SampleFormat::Int,
        };
        let writer = hound::WavWriter::new(file.clone(), spec);
        Ok(SoundFile {
            path: path.to_path_buf(),
            file,
            writer: writer.map_err(|error| not_written(path, error))?,
            sides,
            channels,
            clipped: 0,
        })
    }

    /// What is heard in a tick. What a board lets hear comes when it leaves, a tick later.
    ///
    /// # Errors
    /// The disk is full; the file would be longer than a WAV file may be (4 GiB).
    pub fn tick(&mut self, compiled: &Compiled, engine: &mut Engine) -> Result<(), FileError> {
        if let Engine::Emulated(_, board) = engine {
            let samples = board.take_samples();
            return self.put_samples(samples);
        }
        for at in 0..self.channels.len() {
            let channel = self.channels[at];
            self.put(engine.value(0, channel, &compiled.lowered.exports[channel]))?;
        }
        Ok(())
    }

    /// What is heard when the last tick is over.
    ///
    /// # Errors
    /// As of [`SoundFile::tick`].
    pub fn end(&mut self, engine: &mut Engine) -> Result<(), FileError> {
        match engine {
            Engine::Emulated(_, board) => {
                let samples = board.take_last_sample();
                self.put_samples(samples)
            }
            _ => Ok(()),
        }
    }

    /// The words of a board.
    fn put_samples(&mut self, samples: Result<Vec<[i32; 2]>, String>) -> Result<(), FileError> {
        let samples =
            samples.map_err(|why| FileError::not_written(&self.path, &io::Error::other(why)))?;
        for both in samples {
            for sample in &both[..self.sides] {
                self.put(f64::from(*sample) / kernel::FULL_SCALE as f64)?;
            }
        }
        Ok(())
    }

    fn put(&mut self, value: f64) -> Result<(), FileError> {
        if self.writer.len() >= SAMPLES_MAX {
            let message = "a WAV file has at most 4 GiB; play less, with `--seconds`";
            return Err(FileError::not_written(
                &self.path,
                &io::Error::other(message),
            ));
        }
        let sample = (value * FULL_SCALE).round();
        self.clipped += usize::from(sample.abs() >= FULL_SCALE);
        let written = self.writer.write_sample(sample as i32);
        written.map_err(|error| not_written(&self.path, error))
    }

    /// Ends the file, which then has its name; how many samples were cut off at full scale.
    ///
    /// # Errors
    /// The disk is full.
    pub fn finish(self) -> Result<usize, FileError> {
        let SoundFile { path, file, .. } = self;
        let ended = self.writer.finalize();
        ended.map_err(|error| not_written(&path, error))?;
        // The writer has gone, so nobody else has the file.
        if let Ok(file) = Rc::try_unwrap(file.0) {
            file.into_inner().finish()?;
        }
        Ok(self.clipped)
    }
}

/// Writes words of both sides, such as a DAC is given, as they are.
///
/// # Errors
/// The disk is full; the file would be longer than a WAV file may be (4 GiB).
pub fn write_words(
    path: &Path,
    rate: Rate,
    frames: impl IntoIterator<Item = [i32; 2]>,
) -> Result<(), FileError> {
    let file = Shared(Rc::new(RefCell::new(OutputFile::create(path)?)));
    let spec = hound::WavSpec {
        channels: 2,
        sample_rate: rate.rounded_hz(),
        bits_per_sample: 32,
        sample_format: hound::SampleFormat::Int,
    };
    let failed = |error| not_written(path, error);
    let mut writer = hound::WavWriter::new(file.clone(), spec).map_err(failed)?;
    for word in frames.into_iter().flatten() {
        writer.write_sample(word).map_err(failed)?;
    }
    writer.finalize().map_err(failed)?;
    match Rc::try_unwrap(file.0) {
        Ok(file) => file.into_inner().finish(),
        Err(_) => Ok(()),
    }
}

fn not_written(path: &Path, error: hound::Error) -> FileError {
    let error = match error {
        hound::Error::IoError(error) => error,
        other => io::Error::other(other.to_string()),
    };
    FileError::not_written(path, &error)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_not_finished_leaves_nothing() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("a.wav");
        let file = OutputFile::create(&path).expect("is created");
        let shared = Shared(Rc::new(RefCell::new(file)));
        drop(shared);
        assert_eq!(
            std::fs::read_dir(folder.path()).expect("is there").count(),
            0
        );
    }
}
