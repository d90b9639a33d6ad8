//! `whippen audit`: the proof of an image, checked again from its file alone.

use std::path::PathBuf;

use clap::ValueHint;
use serde_json::{Value, json};
use whippen_compiler::audit::{
    Certificate, Checked, Elf, Ranges, assumptions, audit, check_ranges, explain,
};

use crate::exit::{Failure, Outcome};
use crate::say::{say, tell};

#[derive(Debug, clap::Args)]
#[command(
    after_help = "Example: whippen audit piano.elf\nExample: whippen audit piano.elf --explain"
)]
pub struct Args {
    /// The image, as `whippen build -o FILE.elf` writes it
    #[arg(value_name = "IMAGE.elf", value_hint = ValueHint::FilePath)]
    image: PathBuf,
    /// Say what is proven, from which numbers, and everything that it rests on
    #[arg(long)]
    explain: bool,
    /// Print one JSON object instead
    #[arg(long)]
    json: bool,
}

pub fn run(args: &Args) -> Outcome {
    let path = args.image.display();
    let usage = |why: &dyn std::fmt::Display| Failure::Usage(format!("`{path}` {why}"));
    let file =
        std::fs::read(&args.image).map_err(|error| usage(&format!("cannot be read: {error}")))?;
    let elf = Elf::read(&file).map_err(|why| usage(&why))?;
    let Some(text) = &elf.certificate else {
        return Err(usage(
            &"has no certificate: `whippen build -o IMAGE.elf` writes one",
        ));
    };
    let refused = |why: &dyn std::fmt::Display| {
        match args.json {
            true => say!(
                "{}",
                json!({ "file": path.to_string(), "refused": why.to_string() })
            ),
            false => tell!("refused: {why}"),
        }
        Failure::Program
    };
    let certificate =
        Certificate::read(text).map_err(|why| refused(&format!("the certificate: {why}")))?;
    let checked = audit(&elf, &certificate).map_err(|why| refused(&why))?;
    let kernels = elf.kernels.as_deref().unwrap_or_default();
    let ranges = check_ranges(kernels).map_err(|why| refused(&why))?;
    if args.json {
        let frames: Vec<Value> = checked.iter().map(frame_json).collect();
        let told = json!({
            "file": path.to_string(),
            "deadline_cycles": certificate.deadline,
            "frames": frames,
            "kernels": ranges.iter().map(ranges_json).collect::<Vec<_>>(),
            "assumptions": assumptions(&certificate, &ranges),
        });
        say!("{told}");
        return Ok(());
    }
    tell_all(&certificate, &checked, &ranges);
    match args.explain {
        true => say!("{}", explain(&certificate, &checked, &ranges)),
        false => say!("checked; --explain says under which assumptions"),
    }
    Ok(())
}

fn tell_all(certificate: &Certificate, checked: &[Checked], ranges: &[Ranges]) {
    for frame in checked {
        say!(
            "core {} while program {} plays: {} cycles of {} at most, {} a key; {} bytes of stack",
            frame.core,
            frame.program,
            frame.cycles,
            certificate.deadline,
            frame.key,
            frame.stack
        );
    }
    for own in ranges {
        say!(
            "Kernel `{}`: {} values in their intervals, {} stores with room, {} promises beyond \
             intervals",
            own.kernel,
            own.values,
            own.stores,
            own.promises.len()
        );
    }
}

fn ranges_json(own: &Ranges) -> Value {
    json!({
        "kernel": own.kernel,
        "values": own.values,
        "stores": own.stores,
        "promises": own.promises,
    })
}

fn frame_json(frame: &Checked) -> Value {
    json!({
        "core": frame.core,
        "program": frame.program,
        "keys": frame.keys,
        "cycles_max": frame.cycles,
        "key_cycles_max": frame.key,
        "stack_bytes_max": frame.stack,
        "evidence": format!("{:?}", frame.class).to_lowercase(),
        "states": frame.states,
        "parts": frame.parts.iter().map(|(what, cycles)| json!([what, cycles])).collect::<Vec<_>>(),
    })
}
