//! How fast `jit` ticks a violin's four strings (`benches/strings.kernel`): the fastest of 40
//! rounds of 10 000 ticks.
//!
//! ```text
//! cargo run --release --example string_speed
//! ```

use std::time::Instant;
use whippen_compiler::jit::{JitCode, Options};
use whippen_compiler::kernel::parse;

const STRINGS: &str = include_str!("../benches/strings.kernel");
const ROUNDS: usize = 40;
const TICKS: u32 = 10_000;

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
    let mut tick_ns = f64::INFINITY;
    for _ in 0..ROUNDS {
        let start = Instant::now();
        (0..TICKS).for_each(|_| code.tick(&[], &mut []));
        tick_ns = tick_ns.min(start.elapsed().as_secs_f64() * 1e9 / f64::from(TICKS));
    }
    let real_time = 1e9 / f64::from(kernel.rate_hz) / tick_ns;
    println!("jit {tick_ns:.1} ns, {real_time:.0} times real time");
    Ok(())
}
