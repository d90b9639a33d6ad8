//! The pipeline on one screen: source text to Kernel, with a check between passes.
//!
//! ```text
//!   front: parse -> check => Model; compile: range (must be bounded) -> lint => warnings; simplify -> range => Ranges -> lower => Kernel -> verify
//! ```

use whippen_kernel as kernel;
use whippen_lang::diag::Diagnostic;
use whippen_lang::lint;
use whippen_lang::model::Model;
use whippen_lang::range::{self, Ranges};
use whippen_lower::scales::Scales;
use whippen_lower::simplify::{self, Step};
use whippen_lower::{self as fix, Lowered};

/// The passes, by the names `dump --after` knows them by.
pub const PASSES: &[(&str, &str)] = &[
    ("parse", "the tree of the text, printed as source"),
    (
        "check",
        "the Model: equations over the reals, names resolved, terms inlined",
    ),
    (
        "simplify",
        "the Model after algebra, with the proven range of every value",
    ),
    ("lower", "the Kernel: one tick as integers"),
    (
        "modes",
        "the tick of each mode: one piece of code for every combination of machine states that can occur",
    ),
    ("select", "machine code of each mode over virtual registers"),
    (
        "promote",
        "the same; words that every key reads are in registers",
    ),
    ("schedule", "the same, in an order that hides latencies"),
    ("allocate", "machine code with registers"),
    ("reorder", "the same in a better order, moved over branches"),
    (
        "emit",
        "the bytes before they are linked: offset, encoding, cycles, instruction",
    ),
];

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
    /// What is surely not meant, though it has a meaning.
    pub warnings: Vec<Diagnostic>,
}

/// Why there is no Kernel.
#[derive(Debug)]
pub enum CompileError {
    /// The program is wrong.
    Program(Vec<Diagnostic>),
    /// The compiler is wrong.
    Defect(String),
}

/// Compiles one instrument. `observe` keeps what traces need: a probe per named value, an event per
/// rule.
///
/// # Errors
/// Values that cannot be bounded, or a defect.
pub fn compile(model: Model, scales: Scales, observe: bool) -> Result<Compiled, CompileError> {
    let warnings = lint::lint(
        &model,
        &range::analyze(&model).map_err(CompileError::Program)?,
    );
    let step = simplify::simplify(&model).map_err(CompileError::Program)?;
    let ranges = range::analyze(&step.model).map_err(CompileError::Program)?;
    let defect = |what: &str, why: String| {
        CompileError::Defect(format!("{what} of `{}`: {why}", model.name))
    };
    let lowered = fix::lower(&step, &ranges, scales, observe)
        .map_err(|e| defect("lowering", e.to_string()))?;
    kernel::verify::verify(&lowered.kernel).map_err(|errors| {
        let all: Vec<String> = errors.iter().map(ToString::to_string).collect();
        defect("the kernel", all.join("; "))
    })?;
    Ok(Compiled {
        model,
        step,
        ranges,
        lowered,
        warnings,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use whippen_lang::bundled::INSTRUMENTS;
    use whippen_lang::check::{Options, Program};
    use whippen_lang::front::compile_front;
    use whippen_source::SourceMap;

    const MIKEY: Scales = Scales {
        sensor_zero: -0.5e-3,
        sensor_lsb: 11e-3 / 65535.0,
        drive_lsb: 20.0 / 32768.0,
    };

    fn program(text: &str) -> Program {
        let mut map = SourceMap::default();
        map.add("test.whip", text);
        let (program, diagnostics) = compile_front(&mut map, &Options::default());
        program.unwrap_or_else(|| panic!("{diagnostics:#?}"))
    }

    #[test]
    fn every_bundled_instrument_becomes_a_kernel() {
        for (_, text) in INSTRUMENTS {
            for model in program(text).instruments {
                for observe in [true, false] {
                    let compiled =
                        compile(model.clone(), MIKEY, observe).unwrap_or_else(|e| panic!("{e:?}"));
                    println!("{}", compiled.lowered.kernel);
                    assert_eq!(compiled.lowered.exports.is_empty(), !observe);
                }
            }
        }
    }
}
