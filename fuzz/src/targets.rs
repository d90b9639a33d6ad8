//! The doors of Whippen, and what must hold behind each.

use std::path::PathBuf;

use whippen_compiler::check::Options;
use whippen_compiler::diag::render;
use whippen_compiler::front::compile_front;
use whippen_compiler::kernel::{self, Interp, Kernel};
use whippen_compiler::pipeline::{CompileError, compile};
use whippen_compiler::source::SourceMap;
use whippen_compiler::syntax::{self, pretty, token};
use whippen_runtime::device::Device;
use whippen_runtime::motion::{self, Layout, MotionOptions, Stops};

/// A door.
pub struct Target {
    /// Its name, and that of its folder of old findings.
    pub name: &'static str,
    /// What its files end in.
    pub ending: &'static str,
    /// Hands it an input.
    pub try_it: fn(&[u8]) -> Result<(), String>,
    /// New inputs of a run of the tests: what about six seconds suffice for.
    pub inputs: u64,
}

/// All of them.
pub const TARGETS: &[Target] = &[
    Target {
        name: "lex",
        ending: "whip",
        try_it: lex,
        inputs: 90_000,
    },
    Target {
        name: "parse",
        ending: "whip",
        try_it: parse,
        inputs: 24_000,
    },
    Target {
        name: "check",
        ending: "whip",
        try_it: check,
        inputs: 6_000,
    },
    Target {
        name: "lower",
        ending: "whip",
        try_it: lower,
        inputs: 6_000,
    },
    Target {
        name: "kernel",
        ending: "kernel",
        try_it: kernel,
        inputs: 80_000,
    },
    Target {
        name: "motion",
        ending: "csv",
        try_it: motion,
        inputs: 5_000,
    },
    Target {
        name: "device",
        ending: "toml",
        try_it: device,
        inputs: 17_000,
    },
];

/// Hands an input to the target of that name.
///
/// # Panics
/// What must hold does not, with what went wrong; or there is no such target.
pub fn must_hold(name: &str, bytes: &[u8]) {
    let target = TARGETS
        .iter()
        .find(|t| t.name == name)
        .expect("a target of the table");
    if let Err(wrong) = (target.try_it)(bytes) {
        panic!("{name}: {wrong}");
    }
}

/// Ticks that a kernel is run for.
const TICKS: usize = 3;

/// Kernels that declare more words are not run: a size is not a mistake.
const WORDS_MAX: usize = 1_000_000;

/// Tokens and comments lie in the text, in order.
fn lex(bytes: &[u8]) -> Result<(), String> {
    let text = String::from_utf8_lossy(bytes);
    let lexed = token::lex(0, &text, &mut Vec::new());
    let mut end = 0;
    for token in &lexed.tokens {
        let good = end <= token.span.start
            && token.span.start <= token.span.end
            && token.span.end as usize <= text.len();
        if !good {
            return Err(format!("{token:?} behind {end}"));
        }
        end = token.span.end;
    }
    Ok(())
}

/// What is printed reads back as the same.
fn parse(bytes: &[u8]) -> Result<(), String> {
    let text = String::from_utf8_lossy(bytes);
    let mut diagnostics = Vec::new();
    let tree = syntax::parse(0, &text, &mut diagnostics);
    let printed = pretty::print(&tree);
    let again = pretty::print(&syntax::parse(0, &printed, &mut Vec::new()));
    // Trees with holes print as something that is not the language.
    if diagnostics.is_empty() && printed != again {
        return Err(format!("printed twice:\n{printed}\n---\n{again}"));
    }
    Ok(())
}

/// Every message can be shown, and points into its file.
fn check(bytes: &[u8]) -> Result<(), String> {
    let mut map = SourceMap::default();
    map.add("fuzz.whip", String::from_utf8_lossy(bytes));
    let (_, diagnostics) = compile_front(&mut map, &Options::default());
    for diagnostic in diagnostics.iter().take(20) {
        let _ = render(&map, diagnostic, false);
    }
    for suggestion in diagnostics.iter().flat_map(|d| &d.suggestions) {
        let span = suggestion.span;
        if map
            .files()
            .get(span.file as usize)
            .is_none_or(|f| f.text.get(span.start as usize..span.end as usize).is_none())
        {
            return Err(format!("a suggestion for no place: {suggestion:?}"));
        }
    }
    Ok(())
}

/// The pipeline gives messages or a Kernel that verifies, prints, reads back and keeps its
/// promises; never a defect.
fn lower(bytes: &[u8]) -> Result<(), String> {
    let mut map = SourceMap::default();
    map.add("fuzz.whip", String::from_utf8_lossy(bytes));
    let (program, _) = compile_front(&mut map, &Options::default());
    for model in program.into_iter().flat_map(|p| p.instruments).take(3) {
        match compile(model, Device::mikey().scales(), true) {
            Ok(compiled) => {
                compiled
                    .warnings
                    .iter()
                    .take(20)
                    .for_each(|d| drop(render(&map, d, false)));
                run(&compiled.lowered.kernel)?;
            }
            Err(CompileError::Program(diagnostics)) => diagnostics
                .iter()
                .for_each(|d| drop(render(&map, d, false))),
            Err(CompileError::Defect(why)) => return Err(why),
        }
    }
    Ok(())
}

/// Reading gives a place and a reason, or a kernel that prints as itself; what verifies runs.
fn kernel(bytes: &[u8]) -> Result<(), String> {
    let Ok(kernel) = kernel::parse(&String::from_utf8_lossy(bytes)) else {
        return Ok(());
    };
    let printed = kernel.to_string();
    match kernel::parse(&printed) {
        Ok(again) if again.to_string() == printed => {}
        other => return Err(format!("printed:\n{printed}\nreads back as {other:?}")),
    }
    // A written `assume` may be wrong, and a loop may be long: such kernels are only verified.
    let runs = kernel::verify(&kernel).is_ok()
        && !printed.contains("loop ")
        && !printed.contains("assume ");
    if runs { run(&kernel) } else { Ok(()) }
}

fn run(kernel: &Kernel) -> Result<(), String> {
    let words: usize = kernel.lines.iter().map(|l| l.len as usize).sum();
    if words > WORDS_MAX {
        return Ok(());
    }
    let Ok(mut interp) = Interp::checked(kernel, 1) else {
        return Ok(());
    };
    let (inputs, mut outputs) = (
        vec![30_000; kernel.inputs.len()],
        vec![0; kernel.outputs.len()],
    );
    interp.init(&inputs);
    for tick in 0..TICKS {
        interp.tick(
            &vec![(tick * 20_000) as u16; kernel.inputs.len()],
            &mut outputs,
        );
    }
    interp
        .violation()
        .map_or(Ok(()), |violation| Err(violation.to_string()))
}

/// A file with these bytes.
fn file(bytes: &[u8], name: &str) -> Result<(tempfile::TempDir, PathBuf), String> {
    let folder = tempfile::tempdir().map_err(|e| e.to_string())?;
    let path = folder.path().join(name);
    std::fs::write(&path, bytes).map_err(|e| e.to_string())?;
    Ok((folder, path))
}

/// Recordings, titled and bare, and calibration tables.
fn motion(bytes: &[u8]) -> Result<(), String> {
    let (_folder, path) = file(bytes, "fuzz.csv")?;
    let stops = Some(Stops {
        rest_m: 0.88e-3,
        full_m: 12.7e-3,
        dip_m: 10e-3,
    });
    let raw = |calibration| Layout::Raw {
        rate_hz: 2000.0,
        column: 1,
        calibration,
    };
    for (layout, stops, lowpass_hz) in [
        (Layout::Titled, None, None),
        (raw(None), stops, Some(200.0)),
        (raw(Some(path.clone())), None, None),
    ] {
        if let Ok(motion) = motion::load(
            &path,
            &MotionOptions {
                layout,
                stops,
                lowpass_hz,
                ..MotionOptions::default()
            },
            44_100.into(),
        ) && motion.positions.to_vec().iter().any(|x| !x.is_finite())
        {
            return Err("a position is not finite".to_string());
        }
    }
    Ok(())
}

/// Device files.
fn device(bytes: &[u8]) -> Result<(), String> {
    let (_folder, path) = file(bytes, "fuzz.toml")?;
    let Ok(device) = Device::load(&path) else {
        return Ok(());
    };
    let _ = (device.word_of_position(5e-3), device.force_of_word(1000));
    let mut map = SourceMap::default();
    map.add(
        "spring.whip",
        "instrument i { sense x: length in 0 mm .. 10 mm over 1 ms force f = 75 N/m * x }",
    );
    let (program, _) = compile_front(&mut map, &Options::default());
    for model in program.into_iter().flat_map(|p| p.instruments) {
        if let Err(CompileError::Defect(why)) = compile(model, device.scales(), true) {
            return Err(why);
        }
    }
    Ok(())
}
