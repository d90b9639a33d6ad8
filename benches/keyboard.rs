//! A keyboard of grands, timed like its peers in C and in Faust (`benches/run` runs them all,
//! interleaved).
//!
//! ```text
//! cargo bench --bench keyboard -- words FILE KEYS     writes rows of sensor words: the bundled gesture, each key at another time
//! cargo bench --bench keyboard -- time FILE KEYS      plays them through `jit`
//! ```

use std::time::Instant;

use whippen_compiler::front::compile_front;
use whippen_compiler::jit::{JitCode, Options};
use whippen_compiler::kernel::Kernel;
use whippen_compiler::pipeline::compile;
use whippen_compiler::source::SourceMap;
use whippen_runtime::device::Device;
use whippen_runtime::gesture;

type Failure = Box<dyn std::error::Error>;

const RATE_HZ: u32 = 44_100;
const ROUNDS: usize = 20;

/// Ticks between two looks at the clock. Each stretch is played in every round and its fastest time
/// counts, so that what else runs on the machine disturbs little.
const STRETCH: usize = 256;

fn main() -> Result<(), Failure> {
    let args: Vec<String> = std::env::args()
        .skip(1)
        .filter(|arg| arg != "--bench")
        .collect();
    match &args[..] {
        [what, file, keys] if what == "words" => words(file, keys.parse()?),
        [what, file, keys] if what == "time" => time(file, keys.parse()?),
        // `cargo test --benches` only wants to see that it runs.
        _ => grand().map(drop),
    }
}

fn grand() -> Result<Kernel, Failure> {
    let mut map = SourceMap::default();
    map.add(
        "grand-piano.whip",
        include_str!("../instruments/grand-piano.whip"),
    );
    let (program, _) = compile_front(&mut map, &Default::default());
    let model = program
        .ok_or("the bundled grand piano is correct")?
        .instruments
        .remove(0);
    Ok(compile(model, Device::mikey().scales(), false)
        .map_err(|e| format!("{e:?}"))?
        .lowered
        .kernel)
}

fn words(file: &str, keys: usize) -> Result<(), Failure> {
    let device = Device::mikey();
    let positions = gesture::default_gesture().positions(RATE_HZ);
    let words: Vec<u16> = positions
        .iter()
        .map(|&x| device.word_of_position(x).0)
        .collect();
    let rows = 0..4 * RATE_HZ as usize;
    let word = |row: usize, key: usize| words[(row + key * 997) % words.len()];
    let bytes: Vec<u8> = rows
        .flat_map(|row| (0..keys).flat_map(move |key| word(row, key).to_le_bytes()))
        .collect();
    std::fs::write(file, bytes)?;
    Ok(())
}

fn time(file: &str, keys: usize) -> Result<(), Failure> {
    let bytes = std::fs::read(file)?;
    let words: Vec<u16> = bytes
        .chunks_exact(2)
        .map(|pair| u16::from_le_bytes([pair[0], pair[1]]))
        .collect();
    let mut code = JitCode::build(&grand()?, keys, Options { probes: false })?;
    let mut out = vec![0; keys];
    let (mut sum, mut events) = (0u64, 0);
    let stretches: Vec<&[u16]> = words.chunks(STRETCH * keys).collect();
    let mut best = vec![f64::INFINITY; stretches.len()];
    for _ in 0..ROUNDS {
        code.init(&words[..keys]);
        (sum, events) = (0, 0);
        for (stretch, best) in stretches.iter().zip(&mut best) {
            let start = Instant::now();
            for row in stretch.chunks_exact(keys) {
                code.tick(row, &mut out);
            }
            *best = best.min(start.elapsed().as_secs_f64());
            sum = out.iter().fold(sum, |sum, word| {
                sum.wrapping_mul(31).wrapping_add(i64::from(*word) as u64)
            });
            events += code.drain_events().len();
        }
    }
    let ns = 1e9 * best.iter().sum::<f64>() / words.len() as f64;
    println!("{ns:.3} ns per key tick, drive {sum:016x}, {events} events");
    Ok(())
}
