//! Cycles per key on the Cortex-M33 of RP2350: what compilers make of a Kernel in C, and of the
//! grand written by hand.
//!
//! ```text
//! cargo bench --bench cycles [-- INSTRUMENT|FILE.whip]
//! ```
//!
//! All keys play the same words at the same moment, so a frame is so many times what one key costs
//! there (and the frame's own cycles once); its worst-case frame is what a keyboard must reckon
//! with. The words are the bundled gesture, then every word at random. Wants arm-none-eabi-gcc,
//! uses clang-19 where it is; who is absent is said and left out. Counts come from the emulator and
//! are the same everywhere.

mod contestant;
mod ours;
mod play;
#[path = "../../tests/thumb/target.rs"]
#[expect(dead_code, reason = "tests look at more than cycles")]
mod target;

use whippen_compiler::c99::{Layout, Options, source};
use whippen_compiler::front::compile_front;
use whippen_compiler::kernel::{Kernel, verify};
use whippen_compiler::modes::{self, Modes};
use whippen_compiler::pipeline::compile;
use whippen_compiler::source::SourceMap;
use whippen_runtime::device::Device;

use contestant::{Compiler, Contestant};

type Failure = Box<dyn std::error::Error>;

const KEYS: usize = 8;
const RATE_HZ: u32 = 44_100;

fn main() -> Result<(), Failure> {
    let args: Vec<String> = std::env::args()
        .skip(1)
        .filter(|arg| arg != "--bench")
        .collect();
    // `cargo test --benches` only wants to see that it is built.
    if args.iter().any(|arg| arg == "--test") {
        return Ok(());
    }
    let words = play::words(&Device::mikey());
    println!("| instrument | code | compiler | cycles per key, worst-case frame | mean |");
    println!("| --- | --- | --- | --- | --- |");
    if let Some(file) = args.first().filter(|file| file.ends_with(".whip")) {
        return instrument(file, file, &std::fs::read_to_string(file)?, &words);
    }
    for (file, text) in whippen_compiler::bundled::INSTRUMENTS {
        let name = file.trim_end_matches(".whip");
        if args.first().is_none_or(|wanted| wanted == name) {
            instrument(name, file, text, &words)?;
        }
    }
    Ok(())
}

fn instrument(name: &str, file: &str, text: &str, words: &[u16]) -> Result<(), Failure> {
    let Some(kernel) = kernel(file, text)? else {
        return Ok(());
    };
    let verified = verify(&kernel).map_err(|e| format!("{e:?}"))?;
    let text = source(
        verified,
        Options {
            keys: KEYS,
            layout: Layout::Records,
            events: 64,
        },
    );
    let mut contestants = vec![Contestant::kernel(
        &kernel.name,
        &format!("{}\n{}", text.header, text.body),
    )];
    if name == "grand-piano" {
        contestants.push(Contestant::by_hand());
    }
    for (code, modes) in [
        ("one mode", Modes::single(&kernel)),
        ("modes", modes::specialize(&kernel, modes::INSTRUCTIONS)),
    ] {
        let cycles = ours::play(&kernel, &modes, words)?;
        let [worst, mean] = [cycles.worst, cycles.mean].map(|cycles| cycles / KEYS as f64);
        println!("| {name} | {code} | whippen | {worst:.1} | {mean:.1} |");
    }
    for contestant in &contestants {
        for compiler in Compiler::ALL {
            match contestant.build(compiler)? {
                Some(elf) => {
                    let cycles = play::play(&elf, words)?;
                    let [worst, mean] =
                        [cycles.worst, cycles.mean].map(|cycles| cycles / KEYS as f64);
                    println!(
                        "| {name} | {} | {compiler} | {worst:.1} | {mean:.1} |",
                        contestant.name
                    );
                }
                None => println!("| {name} | {} | {compiler} | absent | |", contestant.name),
            }
        }
    }
    Ok(())
}

/// The kernel of an instrument for the bundled key; none if its device is another.
fn kernel(file: &str, text: &str) -> Result<Option<Kernel>, Failure> {
    let mut map = SourceMap::default();
    map.add(file, text);
    let (program, _) = compile_front(&mut map, &Default::default());
    let Some(model) = program.and_then(|mut program| program.instruments.pop()) else {
        return Ok(None);
    };
    let device = Device::of(&model);
    let compiled = compile(model, device.scales(), false).map_err(|e| format!("{e:?}"))?;
    Ok(Some(compiled.lowered.kernel))
}
