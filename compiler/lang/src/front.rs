//! The front of the compiler: a program's text to Models.

use std::collections::HashSet;

use crate::bundled::STD;
use crate::check::{Options, Program, check, table_file};
use crate::diag::{Code, Diagnostic, Severity};
use crate::syntax::ast::File;
use crate::syntax::parse;
use whippen_source::SourceMap;

/// What may merely follow from a declaration that could not be read. It is not told beside errors
/// of the text.
const CONSEQUENCES: &[Code] = &[
    Code::UnknownName,
    Code::UnknownTerm,
    Code::UnknownMachine,
    Code::UnknownState,
    Code::UnknownBody,
    Code::UnknownResult,
    Code::UnknownArgument,
    Code::MissingArgument,
    Code::ExtraArgument,
    Code::MissingResult,
    Code::NotAResult,
    Code::UnknownInstrument,
    Code::UnknownParam,
    Code::SeveralResults,
    Code::EmptyMachine,
    Code::UnreachableState,
    Code::BodyPart,
    Code::MissingSetting,
    Code::SenseMismatch,
];

/// Reads and checks the files in `map`, which become one program; the Program only if there is no
/// error.
///
/// The standard library and the settings of `options` are added to `map` behind the files, because
/// messages may point at them: call this once per map.
pub fn compile_front(map: &mut SourceMap, options: &Options) -> (Option<Program>, Vec<Diagnostic>) {
    compile_front_observed(map, options, &mut |_| {})
}

/// As [`compile_front`]; `parsed` gets the tree of each of the files before it is checked.
pub fn compile_front_observed(
    map: &mut SourceMap,
    options: &Options,
    parsed: &mut dyn FnMut(&File),
) -> (Option<Program>, Vec<Diagnostic>) {
    let mut found = Vec::new();
    let files = parse_from(map, 0, &mut found);
    files.iter().for_each(parsed);
    let first_std = map.files().len();
    for (name, text) in STD {
        map.add(*name, *text);
    }
    let std = parse_from(map, first_std, &mut found);
    for (name, value) in &options.sets {
        map.add("<set>", format!("{name}={value}"));
    }
    let unreadable = found.iter().any(|d| d.severity() == Severity::Error);
    let name = |file: u32| map.files().get(file as usize).map_or("", |file| &file.name);
    let table_files = table_file::read(&files, &options.read, name);
    let (program, mut checked) = check(&files, &std, table_files, options);
    if unreadable {
        let lines: HashSet<(u32, usize)> = found
            .iter()
            .map(|d| (d.span.file, map.line(d.span)))
            .collect();
        // Beside what could not be read on a line, little on it is to be believed.
        let believed = |d: &Diagnostic| !lines.contains(&(d.span.file, map.line(d.span)));
        checked.retain(|d| !CONSEQUENCES.contains(&d.code) && believed(d));
    }
    found.append(&mut checked);
    found.sort_by_key(|d| (d.span, d.code));
    (program.filter(|_| !unreadable), found)
}

fn parse_from(map: &SourceMap, first: usize, found: &mut Vec<Diagnostic>) -> Vec<File> {
    map.files()
        .iter()
        .enumerate()
        .skip(first)
        .map(|(index, file)| parse(index as u32, &file.text, found))
        .collect()
}
