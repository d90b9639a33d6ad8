//! Our own code for the same Kernel, on the same words, compared with the interpreter in every
//! drive word.

use whippen_compiler::kernel::{Interp, Kernel};
use whippen_compiler::modes::Modes;
use whippen_emulator::CoreKind;

use super::play::Cycles;
use super::target::Target;
use super::{Failure, KEYS};

/// Cycles of its frames.
pub fn play(kernel: &Kernel, modes: &Modes, words: &[u16]) -> Result<Cycles, Failure> {
    let mut interp = Interp::new(kernel, 1).map_err(|e| format!("{e:?}"))?;
    let mut target = Target::new(modes, KEYS as u32, CoreKind::CortexM33);
    let first = words.first().copied().unwrap_or_default();
    interp.init(&[first]);
    target.init(&[first; KEYS]);
    let mut drive = [0];
    let (mut worst, mut sum) = (0, 0);
    for (tick, &word) in words.iter().enumerate() {
        interp.tick(&[word], &mut drive);
        let found = target.tick(&[word; KEYS]);
        target.drain_events();
        if found.iter().any(|&found| found != drive[0]) {
            return Err(format!("tick {tick}: {found:?} instead of {drive:?}").into());
        }
        worst = worst.max(target.cycles);
        sum += target.cycles;
    }
    Ok(Cycles {
        worst: worst as f64,
        mean: sum as f64 / words.len() as f64,
    })
}
