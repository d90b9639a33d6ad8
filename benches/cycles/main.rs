//! Cycles per key on a Cortex-M: what compilers make of a Kernel in C, and of the grand written by
//! hand.
//!
//! ```text
//! cargo bench --bench cycles [-- INSTRUMENT|FILE.whip] [cortex-m33|cortex-m4|cortex-m0+]
//! ```
//!
//! All keys play the same words at the same moment, so a frame is so many times what one key costs
//! there (and the frame's own cycles once); its worst-case frame is what a keyboard must reckon
//! with. What has ports is played once, in one piece on one core. The words are the bundled
//! gesture, then every word at random. Wants arm-none-eabi-gcc, uses clang-19 where it is; who is
//! absent is said and left out. Counts come from the emulator and are the same everywhere.

mod contestant;
mod ours;
mod play;
#[path = "../../tests/thumb/target.rs"]
#[expect(dead_code, reason = "tests look at more than cycles")]
mod target;

use whippen_compiler::c99::{Layout, Options, source};
use whippen_compiler::front::compile_front;
use whippen_compiler::kernel::verify;
use whippen_compiler::modes::{self, Modes};
use whippen_compiler::pipeline::{Compiled, compile};
use whippen_compiler::source::SourceMap;
use whippen_emulator::CoreKind;
use whippen_runtime::device::Device;

use contestant::{Compiler, Contestant};

type Failure = Box<dyn std::error::Error>;

/// Keys of an instrument that has them.
const KEYS: usize = 8;
const RATE_HZ: u32 = 44_100;

/// Cores, and how a compiler is told of them.
const CORES: [(&str, CoreKind); 3] = [
    ("cortex-m33", CoreKind::CortexM33),
    ("cortex-m4", CoreKind::CortexM4),
    ("cortex-m0+", CoreKind::CortexM0Plus),
];

/// What is played on what.
pub struct Setting {
    /// The core's name for compilers.
    cpu: &'static str,
    core: CoreKind,
    keys: usize,
    /// Words of a key, in and out.
    ports: [usize; 2],
    /// For each tick the words of one key.
    rows: Vec<Vec<u16>>,
}

fn main() -> Result<(), Failure> {
    let args: Vec<String> = std::env::args()
        .skip(1)
        .filter(|arg| arg != "--bench")
        .collect();
    // `cargo test --benches` only wants to see that it is built.
    if args.iter().any(|arg| arg == "--test") {
        return Ok(());
    }
    let core_of = |arg: &String| CORES.into_iter().find(|(name, _)| name == arg);
    let core = args.iter().find_map(core_of).unwrap_or(CORES[0]);
    let wanted = args.iter().find(|arg| core_of(arg).is_none());
    if args.len() > 2 || (args.len() == 2 && args.iter().all(|arg| core_of(arg).is_none())) {
        return Err("at most an instrument or a file, and a core".into());
    }
    println!(
        "| instrument on {} | code | compiler | cycles per key, worst-case frame | mean |",
        core.0
    );
    println!("| --- | --- | --- | --- | --- |");
    if let Some(file) = wanted.filter(|file| file.ends_with(".whip")) {
        return instrument(file, file, &std::fs::read_to_string(file)?, core);
    }
    let mut is_known = false;
    for (file, text) in whippen_compiler::bundled::INSTRUMENTS {
        let name = file.trim_end_matches(".whip");
        if wanted.is_none_or(|wanted| wanted == name) {
            is_known = true;
            instrument(name, file, text, core)?;
        }
    }
    match wanted {
        Some(wanted) if !is_known => {
            let cores = CORES.map(|(name, _)| name).join(", ");
            Err(format!("`{wanted}` is neither a core ({cores}), an instrument nor a file").into())
        }
        _ => Ok(()),
    }
}

fn instrument(
    name: &str,
    file: &str,
    text: &str,
    (cpu, core): (&'static str, CoreKind),
) -> Result<(), Failure> {
    let compiled = compiled(file, text)?;
    let kernel = compiled.lowered.kernel;
    let setting = Setting {
        cpu,
        core,
        keys: if compiled.model.is_of_key() { KEYS } else { 1 },
        ports: [kernel.inputs.len(), kernel.outputs.len()],
        rows: play::rows(&compiled.model),
    };
    let verified = verify(&kernel).map_err(|e| format!("{e:?}"))?;
    let text = source(
        verified,
        Options {
            keys: setting.keys,
            layout: Layout::Records,
            events: 64,
        },
    );
    let mut contestants = vec![Contestant::kernel(
        &kernel.name,
        &format!("{}\n{}", text.header, text.body),
        &setting,
    )];
    if name == "grand-piano" && core == CoreKind::CortexM33 {
        contestants.push(Contestant::by_hand());
    }
    for (code, modes) in [
        ("one mode", Modes::single(&kernel)),
        ("modes", modes::specialize(&kernel, modes::INSTRUCTIONS)),
    ] {
        let cycles = ours::play(&kernel, &modes, &setting)?;
        let [worst, mean] = cycles.of_key(&setting);
        println!("| {name} | {code} | whippen | {worst:.1} | {mean:.1} |");
    }
    for contestant in &contestants {
        for compiler in Compiler::ALL {
            match contestant.build(compiler, &setting)? {
                Some(elf) => {
                    let [worst, mean] = play::play(&elf, &setting)?.of_key(&setting);
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

/// The last instrument of a file, for its device.
fn compiled(file: &str, text: &str) -> Result<Compiled, Failure> {
    let mut map = SourceMap::default();
    map.add(file, text);
    let (program, _) = compile_front(&mut map, &Default::default());
    let last = program.and_then(|mut program| program.instruments.pop());
    let model = last.ok_or_else(|| format!("`{file}` has no instrument that can be played"))?;
    let device = Device::of(&model);
    Ok(compile(model, device.scales(), false).map_err(|e| format!("{e:?}"))?)
}
