//! How many times faster than real time each engine plays the grand piano, with 1 key and with 88
//! keys.
//!
//! `cargo run --release --example real_time_factor [positions.csv]`, the file with titles
//! `t_s,x_mm`; otherwise the bundled gesture. Keys hear the motion at different times, as fingers
//! would play it. Nothing is traced: this is what a keyboard runs.

use std::path::Path;
use std::time::Instant;

use whippen_compiler::check::Options;
use whippen_compiler::front::compile_front;
use whippen_compiler::pipeline::compile;
use whippen_compiler::source::SourceMap;
use whippen_runtime::device::Device;
use whippen_runtime::engine::{ENGINES, Engine, EngineKind};
use whippen_runtime::{gesture, motion};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut map = SourceMap::default();
    map.add(
        "grand-piano.whip",
        include_str!("../instruments/grand-piano.whip"),
    );
    let (program, _) = compile_front(&mut map, &Options::default());
    let model = program
        .ok_or("the bundled grand piano is correct")?
        .instruments
        .remove(0);
    let (device, rate_hz) = (Device::mikey(), model.rate_hz);
    let compiled = compile(model, device.scales(), false).map_err(|e| format!("{e:?}"))?;
    let positions = match std::env::args().nth(1) {
        Some(path) => motion::load(Path::new(&path), &motion::MotionOptions::default(), rate_hz)?
            .positions
            .to_vec(),
        None => gesture::default_gesture().positions(rate_hz),
    };
    let words: Vec<u16> = positions
        .iter()
        .map(|&x| device.word_of_position(x).0)
        .collect();
    for &(name, kind) in ENGINES {
        for keys in [1, 88] {
            // The slow engines need not play everything.
            let ticks = if kind == EngineKind::Jit {
                words.len()
            } else {
                words.len() / keys
            };
            let rows: Vec<u16> = (0..ticks * keys)
                .map(|i| words[(i / keys + i % keys * 997) % words.len()])
                .collect();
            let mut engine = Engine::new(kind, &compiled, &device, keys)?;
            let mut drive = vec![0; keys];
            engine.start(&rows[..keys]);
            let start = Instant::now();
            rows.chunks_exact(keys)
                .for_each(|inputs| engine.tick(inputs, &mut drive));
            let factor = ticks as f64 / f64::from(rate_hz) / start.elapsed().as_secs_f64();
            // A board that stopped has played nothing.
            match engine.board().and_then(|board| board.trouble()) {
                Some(why) => println!("{name:>8} {keys:>3} keys: {why}"),
                None => println!("{name:>8} {keys:>3} keys: {factor:8.1} x real time"),
            }
        }
    }
    Ok(())
}
