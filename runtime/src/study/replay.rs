//! A session played again: the gestures that a page kept must give the words that it heard.
//!
//! The other side, and the form of a gesture, is `playable/log.js`.

use std::io::Read;

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use whippen_compiler::pipeline::Compiled;

use crate::device::Device;
use crate::engine::{Engine, EngineKind};

/// The most bytes of a gesture: twice what a page keeps.
const BYTES_MAX: u64 = 1 << 26;
/// FNV-1a of 32 bits.
const BASIS: u32 = 0x811c_9dc5;
const PRIME: u32 = 0x0100_0193;

/// Plays a gesture of so many ticks; a digest of each second of drive words and samples.
///
/// # Errors
/// It is no gesture of this instrument, in words.
pub fn digests(
    compiled: &Compiled,
    device: &Device,
    packed: &str,
    ticks: u64,
) -> Result<Vec<String>, String> {
    let bytes = unpacked(packed)?;
    let mut gesture = PackedGesture { bytes: &bytes };
    let kernel = &compiled.lowered.kernel;
    let (ports, lives) = (kernel.inputs.len(), kernel.lives.len());
    let mut engine = Engine::new(EngineKind::Jit, compiled, device, 1)?;
    let mut words = vec![0_u16; ports];
    for word in &mut words {
        *word = gesture.number(2)? as u16;
    }
    for live in 0..lives {
        let value = gesture.number(4)? as i32;
        set(compiled, &mut engine, live, value)?;
    }
    engine.start(&words);
    let channels = kernel.channels();
    let second = f64::from(compiled.model.rate_hz).round() as u64;
    let mut drive = vec![0_i16; kernel.outputs.len()];
    let mut next = gesture.change(ports + lives)?;
    let (mut hash, mut all, mut since) = (BASIS, Vec::new(), 0_u64);
    for tick in 0..ticks {
        while let Some((_, which)) = next.filter(|(wait, _)| *wait == since) {
            match which.checked_sub(ports) {
                None => words[which] = gesture.number(2)? as u16,
                Some(live) => set(compiled, &mut engine, live, gesture.number(4)? as i32)?,
            }
            next = gesture.change(ports + lives)?;
            since = 0;
        }
        engine.tick(&words, &mut drive);
        for word in &drive {
            mix(&mut hash, &word.to_le_bytes());
        }
        if let Engine::Jit(_, code) = &engine {
            for cell in &channels {
                let sample = code.cell(0, *cell, 0).unwrap_or_default() as i32;
                mix(&mut hash, &sample.to_le_bytes());
            }
        }
        // What happened is not asked for here.
        engine.drain();
        since += 1;
        if (tick + 1) % second == 0 || tick + 1 == ticks {
            all.push(format!("{hash:08x}"));
            hash = BASIS;
        }
    }
    Ok(all)
}

fn mix(hash: &mut u32, bytes: &[u8]) {
    for byte in bytes {
        *hash = (*hash ^ u32::from(*byte)).wrapping_mul(PRIME);
    }
}

/// Gives a live value its word.
fn set(compiled: &Compiled, engine: &mut Engine, live: usize, word: i32) -> Result<(), String> {
    let lsb = compiled.lowered.lives[live].lsb;
    engine.set_live(live, f64::from(word) * lsb)
}

fn unpacked(packed: &str) -> Result<Vec<u8>, String> {
    let packed = STANDARD
        .decode(packed)
        .map_err(|_| "it is no base64".to_string())?;
    let mut bytes = Vec::new();
    let mut reader = flate2::read::DeflateDecoder::new(&packed[..]).take(BYTES_MAX);
    reader
        .read_to_end(&mut bytes)
        .map_err(|_| "it is not deflated".to_string())?;
    Ok(bytes)
}

/// The rest of a gesture.
struct PackedGesture<'b> {
    bytes: &'b [u8],
}

impl PackedGesture<'_> {
    /// A number of so many bytes, the lowest first.
    fn number(&mut self, count: usize) -> Result<u32, String> {
        let (own, rest) = (self.bytes)
            .split_at_checked(count)
            .ok_or("the gesture ends early")?;
        self.bytes = rest;
        let number = |sum, byte: &u8| (sum << 8) | u32::from(*byte);
        Ok(own.iter().rev().fold(0, number))
    }

    /// The next change of one of so many values: after how many ticks, and which; none at the end.
    fn change(&mut self, values: usize) -> Result<Option<(u64, usize)>, String> {
        if self.bytes.is_empty() {
            return Ok(None);
        }
        let (mut number, mut shift) = (0_u64, 0);
        loop {
            let byte = self.number(1)? as u8;
            if shift > 56 {
                return Err("a number of the gesture is too long".to_string());
            }
            number |= u64::from(byte & 127) << shift;
            shift += 7;
            if byte < 128 {
                break;
            }
        }
        let values = values as u64;
        Ok(Some((number / values, (number % values) as usize)))
    }
}
