//! One program, as far as it can be understood.

use std::collections::HashMap;
use std::path::Path;

use whippen_compiler::check::Options;
use whippen_compiler::diag::{Code, Diagnostic};
use whippen_compiler::front::compile_front;
use whippen_compiler::index::{Definition, Index, NameKind, Occurrence};
use whippen_compiler::lower::{Export, ExportKind};
use whippen_compiler::pipeline::{CompileError, Compiled, compile};
use whippen_compiler::source::SourceMap;
use whippen_compiler::syntax::ast::File;
use whippen_compiler::syntax::parse;
use whippen_runtime::device::Device;
use whippen_runtime::ringing;
use whippen_runtime::session;

use super::uri;
use super::world::{is_std, std_file};
use crate::beside::Source;
use crate::device;
use crate::table_text::BESIDE_URIS;

/// What is proven about an instrument's values, by their names.
pub type Numbers = HashMap<String, HashMap<String, Number>>;

/// What is proven about a value.
#[derive(Debug, Clone)]
pub struct Number {
    pub export: Export,
    /// The unit it is shown in.
    pub unit: String,
}

/// A program with everything an editor asks about. File 0 is the document that it was made for.
#[derive(Debug, Default)]
pub struct Analysis {
    pub map: SourceMap,
    /// URIs of the files that are not of the standard library.
    pub uris: Vec<String>,
    pub index: Index,
    pub diagnostics: Vec<Diagnostic>,
    /// What rings with some hand, of the text as it was saved.
    pub rings: Vec<Diagnostic>,
    /// By instrument; of the last program that was right, where this one is not.
    pub numbers: Numbers,
}

impl Analysis {
    /// Reads, checks and lowers a program. What rings is judged if it is not known, which takes
    /// longer than all else.
    pub fn new(program: &[Source], before: Numbers, known: Option<Vec<Diagnostic>>) -> Analysis {
        let mut map = SourceMap::default();
        for source in program {
            map.add(&source.name, &source.text);
        }
        let options = Options {
            read: BESIDE_URIS,
            ..Options::default()
        };
        let (checked, mut diagnostics) = compile_front(&mut map, &options);
        let (mut numbers, unknown) = (before, known.is_none());
        let mut rings = known.unwrap_or_default();
        let keyboard = checked.as_ref().and_then(|p| p.keyboards.first());
        let folder = |uri: &str| uri::path(uri)?.parent().map(Path::to_path_buf);
        let named = keyboard.map(|keyboard| device::of_keyboard(keyboard, &map, folder));
        let named = named.unwrap_or(Ok(None)).unwrap_or_else(|wrong| {
            diagnostics.push(*wrong);
            None
        });
        for model in checked.map(|p| p.instruments).unwrap_or_default() {
            let device = Device::fitting(named.as_ref(), &model);
            if unknown {
                rings.extend(ringing::warnings(&model, &device));
            }
            match compile(model, device.scales(), true) {
                Ok(compiled) => {
                    drop(numbers.insert(compiled.model.name.clone(), proven(&compiled)))
                }
                Err(CompileError::Program(mut found)) => diagnostics.append(&mut found),
                // A defect is told by `check` and `run`; the editor goes on.
                Err(CompileError::Defect(_)) => {}
            }
        }
        if program.first().is_some_and(|source| is_std(&source.text)) {
            diagnostics.retain(|d| d.code != Code::HidesStd);
        }
        let trees = |(n, file): (usize, &whippen_compiler::source::SourceFile)| -> File {
            parse(n as u32, &file.text, &mut Vec::new())
        };
        let files: Vec<File> = map.files().iter().enumerate().map(trees).collect();
        let index = Index::new(&map, &files);
        Analysis {
            uris: program.iter().map(|s| s.name.clone()).collect(),
            map,
            index,
            diagnostics,
            rings,
            numbers,
        }
    }

    /// The text of a file.
    pub fn text(&self, file: u32) -> &str {
        self.map.files().get(file as usize).map_or("", |f| &f.text)
    }

    /// The document's name for a file; a file of the standard library is written to the disk to
    /// have one.
    pub fn uri(&self, file: u32) -> Option<String> {
        match self.uris.get(file as usize) {
            Some(uri) => Some(uri.clone()),
            None => std_file(&self.map.files().get(file as usize)?.name),
        }
    }

    /// The name at a place of the document and what it stands for.
    pub fn at(&self, byte: usize) -> Option<(Occurrence, &Definition)> {
        let occurrence = self.index.at(0, byte as u32)?;
        Some((occurrence, &self.index.definitions[occurrence.definition]))
    }

    /// What is proven about a definition's value.
    pub fn number(&self, definition: &Definition) -> Option<&Number> {
        let instrument = self
            .index
            .definitions
            .iter()
            .find(|d| d.item == definition.item)?;
        let name = match definition.kind {
            NameKind::Force => format!("force {}", definition.name),
            kind if kind.is_value() => definition.name.clone(),
            _ => return None,
        };
        self.numbers.get(&instrument.name)?.get(&name)
    }
}

fn proven(compiled: &Compiled) -> HashMap<String, Number> {
    let one = |export: &Export| {
        let name = match export.kind {
            ExportKind::Force(_) => format!("force {}", export.name),
            ExportKind::Machine(_) => return None,
            _ => export.name.clone(),
        };
        Some((
            name,
            Number {
                unit: session::unit(&compiled.model, export),
                export: export.clone(),
            },
        ))
    };
    compiled.lowered.exports.iter().filter_map(one).collect()
}
