//! A bundled instrument as C, for a keyboard that runs without traces: the peer of the benchmarks
//! is made of it.
//!
//! `cargo run --release --example kernel_in_c grand-piano.whip 88 columns`: file, keys, and how
//! their memory lies (`records` or `columns`).

use std::path::Path;

use whippen_compiler::c99::{Layout, Options, source};
use whippen_compiler::front::compile_front;
use whippen_compiler::kernel::verify;
use whippen_compiler::pipeline::compile;
use whippen_compiler::source::SourceMap;
use whippen_runtime::device::Device;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let [file, keys, layout] = &args[..] else {
        return Err("wanted: FILE KEYS records|columns".into());
    };
    let path = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("instruments")
        .join(file);
    let mut map = SourceMap::default();
    map.add(file, &std::fs::read_to_string(path)?);
    let (program, _) = compile_front(&mut map, &Default::default());
    let model = program
        .ok_or("the bundled instruments are correct")?
        .instruments
        .remove(0);
    let compiled = compile(model, Device::mikey().scales(), false).map_err(|e| format!("{e:?}"))?;
    let verified = verify(&compiled.lowered.kernel).map_err(|e| format!("{e:?}"))?;
    let layout = if layout == "records" {
        Layout::Records
    } else {
        Layout::Columns
    };
    let text = source(
        verified,
        Options {
            keys: keys.parse()?,
            layout,
            events: 4096,
        },
    );
    print!("{}\n{}", text.header, text.body);
    Ok(())
}
