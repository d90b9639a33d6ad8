//! From the command line's files to checked and compiled instruments.

use std::ffi::{OsStr, OsString};
use std::io::IsTerminal;
use std::path::{Path, PathBuf};
use std::sync::Once;

use serde_json::{Map, Value};
use whippen_compiler::check::{Options, Program, note_name};
use whippen_compiler::diag::{Diagnostic, Severity, render, summary};
use whippen_compiler::keyboard;
use whippen_compiler::model::Model;
use whippen_compiler::pipeline::{self, CompileError, Compiled, Observer};
use whippen_compiler::source::SourceMap;
use whippen_runtime::device::Device;
use whippen_runtime::files::{InputKind, read_text};
use whippen_runtime::keyboard::model_of_keys;

use super::json;
use crate::device::{self, NoDevice};
use crate::exit::Failure;
use crate::say::{say, tell};
use crate::table_text::BESIDE_FILES;

/// So many diagnostics are printed at the most.
const SHOWN_MAX: usize = 100;

/// Reads the files of one program.
pub fn read(paths: &[PathBuf]) -> Result<Vec<(String, String)>, Failure> {
    let one = |path: &PathBuf| {
        let text = read_text(path, InputKind::PROGRAM).map_err(|e| {
            Failure::Usage(format!(
                "cannot read `{}`: {}{}",
                path.display(),
                e.message,
                hint(path)
            ))
        })?;
        Ok((path.display().to_string(), text))
    };
    paths.iter().map(one).collect()
}

fn hint(path: &Path) -> &'static str {
    if path.extension().is_some_and(|e| e == "whip") {
        ""
    } else {
        "; a program's file ends in .whip"
    }
}

/// Splits `FILE.. [INSTRUMENT]`: what ends in `.whip` or names a file is a file.
pub fn split(words: &[OsString]) -> Result<(Vec<PathBuf>, Option<&str>), Failure> {
    let is_file = |w: &&OsString| {
        let path = Path::new(w);
        path.extension().is_some_and(|e| e == "whip") || path.exists()
    };
    let files: Vec<PathBuf> = words.iter().filter(is_file).map(PathBuf::from).collect();
    let others = words.iter().filter(|w| !is_file(w));
    let names: Vec<Option<&str>> = others.map(|w| w.to_str()).collect();
    match (files.is_empty(), names.as_slice()) {
        (false, []) => Ok((files, None)),
        (false, [Some(name)]) => Ok((files, Some(name))),
        (false, [_, _, ..]) => Err(Failure::Usage(
            "at most one instrument can be named".to_string(),
        )),
        _ => {
            let typed: Vec<String> = words.iter().map(|w| w.display().to_string()).collect();
            let meant = typed.iter().map(|word| format!("{word}.whip"));
            let near = meant.into_iter().find(|file| Path::new(file).exists());
            let near = near.map_or(String::new(), |file| format!("; did you mean `{file}`?"));
            Err(Failure::Usage(format!(
                "`{}` is neither a .whip file nor exists{near}",
                typed.join(" ")
            )))
        }
    }
}

/// `name=value` of `--set`.
pub fn sets(texts: &[String]) -> Result<Vec<(String, String)>, Failure> {
    let one = |text: &String| match text.split_once('=') {
        Some((name, value)) => Ok((name.trim().to_string(), value.trim().to_string())),
        None => Err(Failure::Usage(format!(
            "`--set {text}`: write `--set name=value`, such as `--set weight=0.4N`"
        ))),
    };
    texts.iter().map(one).collect()
}

/// Settings, and which of them are in SI.
type SettingsInSi = (Vec<(String, String)>, Vec<String>);

/// The objects of `--set-json`: settings, and the names of those that are plain numbers, in SI.
pub fn json_sets(texts: &[String]) -> Result<SettingsInSi, Failure> {
    let (mut sets, mut in_si) = (Vec::new(), Vec::new());
    for text in texts {
        let wrong = |why: String| Failure::Usage(format!("`--set-json {text}`: {why}"));
        let object: Map<String, Value> = serde_json::from_str(text).map_err(|error| {
            let wanted = "wanted is an object, such as {\"k\": 9e3, \"weight\": \"0.4N\"}";
            wrong(format!("{error}; {wanted}"))
        })?;
        for (name, value) in object {
            let value = match value {
                Value::Number(number) => {
                    in_si.push(name.clone());
                    number.as_f64().unwrap_or(f64::NAN).to_string()
                }
                Value::String(text) => text,
                Value::Bool(true) => "on".to_string(),
                Value::Bool(false) => "off".to_string(),
                _ => {
                    let wanted = "is a number in SI, a text with a unit, true or false";
                    return Err(wrong(format!("the value of `{name}` {wanted}")));
                }
            };
            sets.push((name, value));
        }
    }
    Ok((sets, in_si))
}

/// The form in which diagnostics are reported.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Form {
    /// Drawn into excerpts of the source, to stderr.
    Text,
    /// As JSON lines, to stdout.
    Json,
}

/// Checks a program of one keyboard at most, prints what there is to say to stderr (from `least`
/// upwards), and gives it unless there is an error.
pub fn checked(
    files: &[(String, String)],
    options: &Options,
    least: Severity,
) -> Result<(SourceMap, Program), Failure> {
    let (map, program) = checked_as(Form::Text, files, options, least)?;
    if let [first, second, ..] = &program.keyboards[..] {
        return Err(Failure::Usage(format!(
            "the files have several keyboards, `{}` and `{}`: give the files of one",
            first.name, second.name
        )));
    }
    Ok((map, program))
}

/// As [`checked`], in a form.
pub fn checked_as(
    form: Form,
    files: &[(String, String)],
    options: &Options,
    least: Severity,
) -> Result<(SourceMap, Program), Failure> {
    let mut map = SourceMap::default();
    for (name, text) in files {
        map.add(name, text);
    }
    let options = Options {
        read: BESIDE_FILES,
        ..options.clone()
    };
    let (program, diagnostics) = pipeline::front(&mut map, &options);
    report(form, &map, &diagnostics, least);
    let Some(program) = program else {
        // A program that is right without its settings is not to blame.
        let first_set = map.files().len() - options.sets.len();
        let set_wrong = errors(&diagnostics).all(|d| d.span.file as usize >= first_set);
        return Err(if set_wrong {
            Failure::Usage("`--set` or `--preset` cannot be used as given".into())
        } else {
            Failure::Program
        });
    };
    Ok((map, program))
}

fn errors(diagnostics: &[Diagnostic]) -> impl Iterator<Item = &Diagnostic> {
    diagnostics
        .iter()
        .filter(|d| d.severity() == Severity::Error)
}

/// Compiles one instrument; what is wrong with it is printed. `observe` keeps what traces need.
pub fn compiled(
    map: &SourceMap,
    model: Model,
    device: &Device,
    observe: bool,
) -> Result<Compiled, Failure> {
    report_diagnostics(
        Form::Text,
        map,
        pipeline::compile(model, device.scales(), observe),
    )
}

/// As [`compiled`], with an observer of the passes.
pub fn compiled_observed(
    map: &SourceMap,
    model: Model,
    device: &Device,
    probes: bool,
    observer: Observer,
) -> Result<Compiled, Failure> {
    let compiled = pipeline::compile_observed(model, &device.scales(), probes, observer);
    report_diagnostics(Form::Text, map, compiled)
}

/// As [`compiled`] for traces, in a form.
pub fn compiled_as(
    form: Form,
    map: &SourceMap,
    model: Model,
    device: &Device,
) -> Result<Compiled, Failure> {
    report_diagnostics(form, map, pipeline::compile(model, device.scales(), true))
}

/// Compiles for traces an instrument whose warnings have been reported.
pub fn compiled_silently(
    map: &SourceMap,
    model: Model,
    device: &Device,
) -> Result<Compiled, Failure> {
    let compiled = pipeline::compile(model, device.scales(), true);
    report_diagnostics(
        Form::Text,
        map,
        compiled.map(|c| Compiled {
            warnings: Vec::new(),
            ..c
        }),
    )
}

/// Reports what is wrong with an instrument or surely not meant.
fn report_diagnostics(
    form: Form,
    map: &SourceMap,
    compiled: Result<Compiled, CompileError>,
) -> Result<Compiled, Failure> {
    let compiled = compiled.map_err(|error| report_error(form, map, error))?;
    report(form, map, &compiled.warnings, Severity::Warning);
    Ok(compiled)
}

fn report_error(form: Form, map: &SourceMap, error: CompileError) -> Failure {
    match error {
        CompileError::Program(diagnostics) => {
            report(form, map, &diagnostics, Severity::Warning);
            Failure::Program
        }
        CompileError::Defect(message) => Failure::Defect(message),
    }
}

/// Reports why there is no code as text.
pub fn report_compile_error(map: &SourceMap, error: CompileError) -> Failure {
    report_error(Form::Text, map, error)
}

/// Reports diagnostics from `least` upwards in a form.
pub fn report(form: Form, map: &SourceMap, diagnostics: &[Diagnostic], least: Severity) {
    match form {
        Form::Text => print(map, diagnostics, least),
        Form::Json => diagnostics
            .iter()
            .for_each(|d| say!("{}", json::diagnostic(map, d))),
    }
}

/// Prints diagnostics from `least` upwards and a summary to stderr; the worst come last, next to
/// the summary.
pub fn print(map: &SourceMap, diagnostics: &[Diagnostic], least: Severity) {
    let colour = std::io::stderr().is_terminal();
    let mut shown: Vec<&Diagnostic> = diagnostics
        .iter()
        .filter(|d| d.severity() >= least)
        .collect();
    shown.sort_by_key(|d| d.severity());
    for diagnostic in shown.iter().take(SHOWN_MAX) {
        tell!("{}", render(map, diagnostic, colour));
    }
    if shown.len() > SHOWN_MAX {
        tell!("{} more are not shown", shown.len() - SHOWN_MAX);
    }
    if let Some(worst) = shown.last() {
        if worst.severity() > Severity::Note {
            tell!("{}", summary(diagnostics));
        }
        EXPLAINED.call_once(|| tell!("help: whippen explain {}", worst.code.number()));
    }
}

/// The page of a diagnostic is pointed at once in a run.
static EXPLAINED: Once = Once::new();

/// The device of an instrument, as [`device::find`] says.
pub fn device(
    wanted: Option<&OsStr>,
    map: &SourceMap,
    program: &Program,
    model: &Model,
) -> Result<Device, Failure> {
    device::find(wanted, map, program, model).map_err(|why| no_device(Form::Text, map, why))
}

/// Reports why there is no device.
pub fn no_device(form: Form, map: &SourceMap, why: NoDevice) -> Failure {
    match why {
        NoDevice::Usage(message) => Failure::Usage(message),
        NoDevice::Program(diagnostic) => {
            report(form, map, &[*diagnostic], Severity::Error);
            Failure::Program
        }
    }
}

/// The instrument that was named, or the only one.
pub fn instrument<'p>(program: &'p Program, name: Option<&str>) -> Result<&'p Model, Failure> {
    let names = || {
        program
            .instruments
            .iter()
            .map(|m| m.name.as_str())
            .collect::<Vec<_>>()
            .join(", ")
    };
    match (name, program.instruments.as_slice()) {
        (Some(name), all) => {
            all.iter()
                .find(|m| m.name == name)
                .ok_or_else(|| match zones(program, Some(name)) {
                    Some(zones) => {
                        let own = instruments_of(program, zones);
                        Failure::Usage(format!(
                            "`{name}` are zones with several instruments; name one of them: {own}"
                        ))
                    }
                    None => Failure::Usage(format!(
                        "there is no instrument `{name}`; there are: {}",
                        names()
                    )),
                })
        }
        (None, [only]) => Ok(only),
        (None, []) => Err(Failure::Usage("the program has no instrument".to_string())),
        (None, _) => Err(Failure::Usage(format!(
            "the program has several instruments, name one of them after the files: {}",
            names()
        ))),
    }
}

/// The program of zones that has this name.
fn zones<'p>(program: &'p Program, name: Option<&str>) -> Option<&'p keyboard::Program> {
    let found = program.keyboards.first()?.layout.program_named(name?)?;
    program
        .instruments
        .iter()
        .all(|model| model.name != found.name)
        .then_some(found)
}

/// The names of what a program's keys play.
pub fn instruments_of(program: &Program, of: &keyboard::Program) -> String {
    let name = |id: keyboard::InstrumentId| program.instruments[id.index()].name.as_str();
    let names: Vec<&str> = of.instruments().into_iter().map(name).collect();
    names.join(", ")
}

/// What one key plays: the instrument as [`instrument`] finds it, or the one of that key of the
/// zones that were named; with a key, as that key has it.
pub fn one_key(program: &Program, name: Option<&str>, key: Option<u8>) -> Result<Model, Failure> {
    let zones = zones(program, name);
    let layout = program.keyboards.first().map(|keyboard| &keyboard.layout);
    let (Some(key), Some(layout)) = (key, layout) else {
        return match (key, zones) {
            (Some(_), _) => Err(Failure::Usage(
                "--key names a key of a keyboard, and the program has none".to_string(),
            )),
            (None, Some(zones)) => Err(Failure::Usage(format!(
                "`{}` are zones: name a key, such as --key {}, or one of the instruments: {}",
                zones.name,
                note_name(layout.map_or(0, |layout| layout.first_note)),
                instruments_of(program, zones)
            ))),
            (None, None) => instrument(program, name).cloned(),
        };
    };
    let Some(index) = layout.key_of_note(key) else {
        return Err(Failure::Usage(format!(
            "the keyboard has the keys {} .. {}, and not {}",
            note_name(layout.first_note),
            note_name(layout.last_note()),
            note_name(key)
        )));
    };
    let model = match zones.and_then(|zones| zones.zone_of_key(index)) {
        Some(zone) => &program.instruments[zone.instrument.index()],
        None => instrument(program, name)?,
    };
    Ok(model_of_keys(model, &[index as usize]))
}

#[cfg(test)]
mod tests {
    use super::json_sets;

    #[test]
    fn a_number_of_json_is_the_nearest() {
        // Neighbours of a tenth, as exactly as a sweep or a fit prints them.
        for above in 0..1000 {
            let value = f64::from_bits(0.1_f64.to_bits() + above);
            let text = format!("{{\"k\": {value}}}");
            let (sets, in_si) = json_sets(&[text]).unwrap_or_else(|_| panic!("{value} is read"));
            assert_eq!(sets, [("k".to_string(), value.to_string())]);
            assert_eq!(in_si, ["k"]);
        }
    }
}
