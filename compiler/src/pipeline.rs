//! The pipeline on one screen: source text to Kernel, with a check between passes.
//!
//! ```text
//!   parse -> check => Model -> range (must be bounded) -> simplify -> range => Ranges -> lower => Kernel -> verify
//! ```

use crate::check::{self, Options, Program};
use crate::diag::{Diagnostic, Severity};
use crate::fix::{self, Lowered};
use crate::kernel;
use crate::model::Model;
use crate::range::{self, Ranges};
use crate::scales::Scales;
use crate::simplify::{self, Step};
use crate::source::SourceMap;
use crate::standard;
use crate::syntax::{self, ast};

/// The passes, by the names `dump --after` knows them by.
pub const PASSES: &[(&str, &str)] = &[
    ("parse", "the tree of the text, printed as source"),
    ("check", "the Model: equations over the reals, names resolved, terms inlined"),
    ("simplify", "the Model after algebra, with the proven range of every value"),
    ("lower", "the Kernel: one tick as integers"),
];

/// What reading and checking found.
#[derive(Debug)]
pub struct Front {
    /// All sources: the given files, then the standard library, then the texts of `--set`.
    pub map: SourceMap,
    /// The trees of the given files.
    pub files: Vec<ast::File>,
    /// The program, unless there is an error.
    pub program: Option<Program>,
    /// Everything there is to say, in the order of the text.
    pub diagnostics: Vec<Diagnostic>,
}

impl Front {
    /// Whether any diagnostic is an error.
    pub fn has_errors(&self) -> bool {
        self.diagnostics.iter().any(|d| d.severity() == Severity::Error)
    }
}

/// Reads and checks one program: all `files` (name and text) together, with the standard library in scope.
pub fn front(files: &[(String, String)], options: &Options) -> Front {
    let mut map = SourceMap::default();
    let mut diagnostics = Vec::new();
    let mut parse = |map: &mut SourceMap, name: &str, text: &str| {
        let index = map.add(name, text);
        syntax::parse(index, text, &mut diagnostics)
    };
    let trees: Vec<ast::File> = files.iter().map(|(name, text)| parse(&mut map, name, text)).collect();
    let std: Vec<ast::File> = standard::FILES.iter().map(|(name, text)| parse(&mut map, name, text)).collect();
    for (name, value) in &options.sets {
        map.add("--set", format!("{name}={value}"));
    }
    let (program, found) = check::check(&trees, &std, options);
    diagnostics.extend(found);
    let failed = diagnostics.iter().any(|d| d.severity() == Severity::Error);
    Front { map, files: trees, program: if failed { None } else { program }, diagnostics }
}

/// One instrument in every form.
#[derive(Debug)]
pub struct Compiled {
    /// As checked.
    pub model: Model,
    /// After algebra.
    pub step: Step,
    /// Proven ranges of the simplified values.
    pub ranges: Ranges,
    /// In integers.
    pub lowered: Lowered,
}

/// Why there is no Kernel.
#[derive(Debug)]
pub enum CompileError {
    /// The program is wrong.
    Program(Vec<Diagnostic>),
    /// The compiler is wrong.
    Defect(String),
}

/// Compiles one instrument. `observe` keeps what traces need: a probe per named value, an event per rule.
///
/// # Errors
/// Values that cannot be bounded, or a defect.
pub fn compile(model: Model, scales: Scales, observe: bool) -> Result<Compiled, CompileError> {
    let step = simplify::simplify(&model).map_err(CompileError::Program)?;
    let ranges = range::analyze(&step.model).map_err(CompileError::Program)?;
    let defect = |what: &str, why: String| CompileError::Defect(format!("{what} of `{}`: {why}", model.name));
    let lowered = fix::lower(&step, &ranges, scales, observe).map_err(|e| defect("lowering", e.to_string()))?;
    kernel::verify::verify(&lowered.kernel).map_err(|errors| {
        let all: Vec<String> = errors.iter().map(ToString::to_string).collect();
        defect("the kernel", all.join("; "))
    })?;
    Ok(Compiled { model, step, ranges, lowered })
}

#[cfg(test)]
mod tests {
    use super::*;

    const MIKEY: Scales = Scales { sensor_zero: -0.5e-3, sensor_lsb: 11e-3 / 65535.0, drive_lsb_n: 20.0 / 32768.0 };

    fn program(text: &str) -> Program {
        let front = front(&[("test.whip".to_string(), text.to_string())], &Options::default());
        assert!(!front.has_errors(), "{:#?}", front.diagnostics);
        front.program.expect("no errors")
    }

    #[test]
    fn every_bundled_instrument_becomes_a_kernel() {
        let texts = [
            include_str!("../../instruments/grand-piano.whip"),
            include_str!("../../instruments/harpsichord.whip"),
            include_str!("../../instruments/hammond.whip"),
        ];
        for text in texts {
            for model in program(text).instruments {
                for observe in [true, false] {
                    let compiled = compile(model.clone(), MIKEY, observe).unwrap_or_else(|e| panic!("{e:?}"));
                    println!("{}", compiled.lowered.kernel);
                    assert_eq!(compiled.lowered.exports.is_empty(), !observe);
                }
            }
        }
    }
}
