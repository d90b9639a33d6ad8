//! Our own code for the same Kernel, on the same words, compared with the interpreter in every
//! drive word.

use whippen_compiler::kernel::{Interp, Kernel};
use whippen_compiler::modes::Modes;

use super::play::Cycles;
use super::target::Target;
use super::{Failure, Setting};

/// Cycles of its frames.
pub fn play(kernel: &Kernel, modes: &Modes, setting: &Setting) -> Result<Cycles, Failure> {
    let mut interp = Interp::new(kernel, 1).map_err(|e| format!("{e:?}"))?;
    let Setting { rows, keys, .. } = setting;
    let mut target = Target::new(modes, *keys as u32, setting.core);
    interp.init(&rows[0]);
    target.init(&rows[0].repeat(*keys));
    let mut drive = vec![0; setting.ports[1].max(1)];
    let (mut worst, mut sum) = (0, 0);
    for (tick, row) in rows.iter().enumerate() {
        interp.tick(row, &mut drive);
        let found = target.tick(&row.repeat(*keys));
        target.drain_events();
        if found.chunks(drive.len()).any(|found| found != drive) {
            return Err(format!("tick {tick}: {found:?} instead of {drive:?}").into());
        }
        worst = worst.max(target.cycles);
        sum += target.cycles;
    }
    Ok(Cycles {
        worst: worst as f64,
        mean: sum as f64 / rows.len() as f64,
    })
}
