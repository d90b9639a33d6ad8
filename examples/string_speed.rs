//! How fast `jit` ticks a violin's four strings (`benches/strings.kernel`), and the bundled violin
//! with its bows, which are moved at random, as often as its arm tells where it is and at every
//! tick: the fastest of 40 rounds of 10 000 ticks.
//!
//! ```text
//! cargo run --release --example string_speed
//! ```

use std::time::Instant;
use whippen_compiler::check::Options as CheckOptions;
use whippen_compiler::front::compile_front;
use whippen_compiler::jit::{JitCode, Options};
use whippen_compiler::kernel::random::Rng;
use whippen_compiler::kernel::{Kernel, parse, without_probes};
use whippen_compiler::pipeline::compile;
use whippen_compiler::source::SourceMap;
use whippen_runtime::device::Device;

const STRINGS: &str = include_str!("../benches/strings.kernel");
const ROUNDS: usize = 40;
const TICKS: u32 = 10_000;

/// Ticks from one place of the arm to the next: its sensors are read at 1 kHz.
const ARM_TICKS: u32 = 44;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let kernel = parse(STRINGS)?;
    let mut code = JitCode::build(&kernel, 1, Options { probes: false })?;
    code.init(&[]);
    for (cell, grid) in kernel.cells.iter().enumerate().step_by(2) {
        for point in 0..grid.len as usize {
            let from_end = (point + 1).min(grid.len as usize - point) as i64;
            let height = 100_000_000 * from_end / i64::from(grid.len);
            code.set_cell(0, cell, point, height)?;
        }
    }
    tell("strings", &kernel, || {
        (0..TICKS).for_each(|_| code.tick(&[], &mut []))
    });
    let kernel = violin()?;
    let mut code = JitCode::build(&kernel, 1, Options { probes: false })?;
    let (mut random, mut drive) = (Rng::new(3), vec![0; kernel.outputs.len()]);
    let mut words = vec![1 << 15; kernel.inputs.len()];
    code.init(&words);
    for (name, ticks) in [("violin", ARM_TICKS), ("violin, moved at every tick", 1)] {
        tell(name, &kernel, || {
            for tick in 0..TICKS {
                if tick % ticks == 0 {
                    words.fill_with(|| random.below(1 << 16) as u16);
                }
                code.tick(&words, &mut drive);
            }
        });
    }
    Ok(())
}

/// The bundled violin, as a board ticks it: nothing is observed.
fn violin() -> Result<Kernel, Box<dyn std::error::Error>> {
    let mut map = SourceMap::default();
    let text = include_str!("../instruments/bowed-violin.whip");
    map.add("bowed-violin.whip", text);
    let (program, _) = compile_front(&mut map, &CheckOptions::default());
    let mut instruments = program.ok_or("the bundled violin is correct")?.instruments;
    let model = instruments.remove(0);
    let scales = Device::of(&model).scales();
    let compiled = compile(model, scales, false).map_err(|e| format!("{e:?}"))?;
    Ok(without_probes(&compiled.lowered.kernel))
}

/// Plays the rounds and tells the fastest.
fn tell(name: &str, kernel: &Kernel, mut round: impl FnMut()) {
    let mut tick_ns = f64::INFINITY;
    for _ in 0..ROUNDS {
        let start = Instant::now();
        round();
        tick_ns = tick_ns.min(start.elapsed().as_secs_f64() * 1e9 / f64::from(TICKS));
    }
    let real_time = 1e9 / f64::from(kernel.rate_hz) / tick_ns;
    println!("jit, {name}: {tick_ns:.1} ns, {real_time:.0} times real time");
}
