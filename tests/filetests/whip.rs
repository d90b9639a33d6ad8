//! Commands on the text of a program.

use std::fmt::Write;

use whippen_compiler::check::{Options, Program};
use whippen_compiler::diag::{Diagnostic, Severity, render, summary};
use whippen_compiler::front::compile_front;
use whippen_compiler::pipeline::{CompileError, Compiled, compile};
use whippen_compiler::source::SourceMap;
use whippen_compiler::{stability, syntax};
use whippen_runtime::device::Device;
use whippen_runtime::ringing;

/// What `whippen budget` says of the loop on the device of an instrument, as it is shown; something
/// must be.
pub fn budget(text: &str, words: &[&str]) -> Result<String, String> {
    let (map, mut diagnostics, program) = front(text, words)?;
    for model in program.iter().flat_map(|p| &p.instruments) {
        let device = Device::of(model);
        diagnostics.extend(ringing::warnings(model, &device));
        let rated = device.rated_force().ok_or("the device has no motor")?;
        diagnostics.extend(
            stability::static_force(model).and_then(|s| stability::too_strong(model, &s, rated)),
        );
    }
    if diagnostics.is_empty() {
        Err("nothing is said of this program".to_string())
    } else {
        Ok(rendered(&map, &diagnostics))
    }
}

/// The tree as canonical text, behind what is wrong with the text.
pub fn parse(text: &str, _: &[&str]) -> Result<String, String> {
    let (mut map, mut diagnostics) = (SourceMap::default(), Vec::new());
    let index = map.add("test.whip", text);
    let file = syntax::parse(index, text, &mut diagnostics);
    let printed = syntax::pretty::print(&file);
    let again = syntax::pretty::print(&syntax::parse(0, &printed, &mut Vec::new()));
    if printed != again {
        return Err(format!("printing twice gives\n{again}"));
    }
    Ok(rendered(&map, &diagnostics) + &printed)
}

/// What is wrong, in the order given, else the Model. `NAME=VALUE` words are settings.
pub fn check(text: &str, words: &[&str]) -> Result<String, String> {
    let (map, diagnostics, program) = front(text, words)?;
    let mut printed = rendered(&map, &diagnostics);
    for model in program.iter().flat_map(|p| &p.instruments) {
        match compile(model.clone(), Device::mikey().scales(), false) {
            Ok(compiled) => drop(write!(
                printed,
                "{}{model}",
                rendered(&map, &compiled.warnings)
            )),
            Err(CompileError::Program(diagnostics)) => printed += &rendered(&map, &diagnostics),
            Err(CompileError::Defect(message)) => return Err(message),
        }
    }
    for keyboard in program.iter().flat_map(|p| &p.keyboards) {
        let _ = writeln!(
            printed,
            "keyboard {}: {} keys at {} Hz",
            keyboard.name, keyboard.layout.keys, keyboard.rate_hz
        );
    }
    Ok(printed)
}

/// What is wrong or surely not meant, as it is shown; something must be.
pub fn mistake(text: &str, words: &[&str]) -> Result<String, String> {
    let (map, mut diagnostics, program) = front(text, words)?;
    for model in program.into_iter().flat_map(|p| p.instruments) {
        match compile(model, Device::mikey().scales(), false) {
            Ok(compiled) => diagnostics.extend(compiled.warnings),
            Err(CompileError::Program(errors)) => diagnostics.extend(errors),
            Err(CompileError::Defect(message)) => return Err(message),
        }
    }
    if diagnostics.is_empty() {
        Err("nothing is said of this mistake".to_string())
    } else {
        Ok(rendered(&map, &diagnostics))
    }
}

/// The Model after algebra.
pub fn simplify(text: &str, words: &[&str]) -> Result<String, String> {
    compiled(text, words).map(|all| all.iter().map(|c| c.step.model.to_string()).collect())
}

/// The Kernel without probes.
pub fn lower(text: &str, words: &[&str]) -> Result<String, String> {
    compiled(text, words).map(|all| all.iter().map(|c| c.lowered.kernel.to_string()).collect())
}

fn front(
    text: &str,
    words: &[&str],
) -> Result<(SourceMap, Vec<Diagnostic>, Option<Program>), String> {
    let mut map = SourceMap::default();
    map.add("test.whip", text);
    let setting = |word: &&str| {
        word.split_once('=')
            .map(|(name, value)| (name.to_string(), value.to_string()))
    };
    let sets = words
        .iter()
        .map(|w| setting(w).ok_or_else(|| format!("what is `{w}`?")))
        .collect::<Result<_, _>>()?;
    let (program, diagnostics) = compile_front(
        &mut map,
        &Options {
            sets,
            ..Options::default()
        },
    );
    Ok((map, diagnostics, program))
}

/// Every instrument; there must be no error.
fn compiled(text: &str, words: &[&str]) -> Result<Vec<Compiled>, String> {
    let (map, diagnostics, program) = front(text, words)?;
    let program = program.ok_or_else(|| rendered(&map, &diagnostics))?;
    let one = |model| {
        compile(model, Device::mikey().scales(), false).map_err(|error| format!("{error:?}"))
    };
    program.instruments.into_iter().map(one).collect()
}

/// Diagnostics without colour, then their number if there is an error.
fn rendered(map: &SourceMap, diagnostics: &[Diagnostic]) -> String {
    let mut text: String = diagnostics
        .iter()
        .map(|d| render(map, d, false) + "\n")
        .collect();
    if diagnostics.iter().any(|d| d.severity() == Severity::Error) {
        let _ = writeln!(text, "{}", summary(diagnostics));
    }
    text
}
