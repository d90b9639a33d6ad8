//! The pipeline on one screen: source text to the proof on the image's bytes, and what verifies
//! each pass.
//!
//! ```text
//!   text -front-> Model -compile-> Kernel -specialize-> Modes -build-> Image -prove-> Budget
//! ```
//!
//! Command line, emulated boards and tests call these functions and nothing below them. Each tells
//! an observer every form that it makes, by its [`Pass`]: what `dump --after` shows is what the
//! next pass gets.
//!
//! Not here: files and devices (their callers), C and host code, which take a Kernel.

use std::collections::BTreeSet;
use std::fmt::Display;
use std::sync::Arc;
use whippen_rate::Rate;

use whippen_audit::Certificate;
use whippen_board::Board;
use whippen_budget::{Bounded, Budget, NotBounded, NotCertified, Program as Bytes, certificate};
use whippen_deterministic::Memo;
use whippen_firmware::{FirmwareImage, InParts, Instrument, Setup};
use whippen_kernel::{self as kernel, Kernel, without_probes};
use whippen_keyboard::Layout;
use whippen_lang::check::{Options, Program};
use whippen_lang::diag::Diagnostic;
use whippen_lang::front::compile_front_observed;
use whippen_lang::lint;
use whippen_lang::model::Model;
use whippen_lang::range::{self, Ranges};
use whippen_lang::syntax::pretty;
use whippen_lower::scales::{PortScales, Scales};
use whippen_lower::simplify::{self, Step};
use whippen_lower::{self as lower, Lowered, lost, slow_port};
use whippen_modes::{self as modes, Modes};
use whippen_parts::{Beside, Parts, split, split_sound, split_together};
use whippen_source::SourceMap;

pub use crate::partition::{BuildError, Partitioned};
use crate::partition::{KnownTime, bound_programs, build_partitioned};

/// Declares the passes in their order.
macro_rules! passes {
    ($($pass:ident $name:literal: $makes:literal, verified by $verifier:literal;)*) => {
        /// A pass of the pipeline.
        #[derive(Debug, Clone, Copy, PartialEq, Eq)]
        pub enum Pass {
            $(#[doc = $makes] $pass,)*
        }

        /// All passes in their order.
        pub const PASSES: &[Pass] = &[$(Pass::$pass,)*];

        impl Pass {
            /// The name by which `dump --after` knows it.
            pub fn name(self) -> &'static str {
                match self { $(Pass::$pass => $name,)* }
            }

            /// What it makes.
            pub fn makes(self) -> &'static str {
                match self { $(Pass::$pass => $makes,)* }
            }

            /// What verifies its result.
            pub fn verified_by(self) -> &'static str {
                match self { $(Pass::$pass => $verifier,)* }
            }
        }
    };
}

passes! {
    Parse "parse": "the tree of the text, printed as source", verified by "its diagnostics";
    Check "check": "the Model: equations over the reals, names resolved, terms inlined",
        verified by "its diagnostics, and range analysis: every value is bounded";
    Simplify "simplify": "the Model after algebra, with the proven range of every value",
        verified by "range analysis of the new Model";
    Lower "lower": "the Kernel: one tick as integers", verified by "the verifier of Kernels";
    Modes "modes": "the tick of each combination of machine states that can occur",
        verified by "the verifier of modes";
    Image "image": "the image of all keys with its firmware, as a map",
        verified by "translation validation of the code, and the linker";
    Budget "budget": "cycles at most, by program and core", verified by "nothing: it is the proof";
}

/// Gets every form that a function of the pipeline makes, as text if it asks for it.
pub type Observer<'a> = &'a mut dyn FnMut(Pass, &dyn Display);

/// The observer that looks away.
pub fn unobserved(_: Pass, _: &dyn Display) {}

/// One instrument in every form up to its Kernel.
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
    /// What the words of each of its ports mean, by sense.
    pub scales: Vec<Scales>,
    /// What is surely not meant, though it has a meaning.
    pub warnings: Vec<Diagnostic>,
}

/// Why there is no Kernel, or no modes of it.
#[derive(Debug)]
pub enum CompileError {
    /// The program is wrong.
    Program(Vec<Diagnostic>),
    /// The compiler is wrong.
    Defect(String),
}

/// What is proven of an image.
#[derive(Debug, Clone)]
pub struct Proof {
    /// The bytes and names that it is proven on.
    pub bytes: Bytes,
    /// While it plays each of its programs.
    pub programs: Vec<ProgramProof>,
}

/// What is proven while one program plays.
#[derive(Debug, Clone)]
pub struct ProgramProof {
    /// Each core.
    pub cores: Vec<Bounded>,
    /// What a tick may take, what it takes at most, what is left.
    pub budget: Budget,
}

/// Text to Models: parse, check.
pub fn front(map: &mut SourceMap, options: &Options) -> (Option<Program>, Vec<Diagnostic>) {
    front_observed(map, options, &mut unobserved)
}

/// As [`front`], with an observer, which gets the tree of each file. The Model that is checked is
/// observed by [`compile_observed`], which finds out whether its values are bounded.
pub fn front_observed(
    map: &mut SourceMap,
    options: &Options,
    observer: Observer,
) -> (Option<Program>, Vec<Diagnostic>) {
    compile_front_observed(map, options, &mut |file| {
        observer(Pass::Parse, &pretty::print(file));
    })
}

/// Model to Kernel: range analysis, lint, algebra, range analysis again, lowering.
///
/// `probes` keeps what traces need: a probe per named value, an event per rule.
///
/// # Errors
/// Values that cannot be bounded, or a defect.
pub fn compile(
    model: Model,
    scales: impl Into<PortScales>,
    probes: bool,
) -> Result<Compiled, CompileError> {
    compile_observed(model, &scales.into(), probes, &mut unobserved)
}

/// As [`compile`], with an observer.
///
/// # Errors
/// Values that cannot be bounded, or a defect.
pub fn compile_observed(
    model: Model,
    scales: &PortScales,
    probes: bool,
    observer: Observer,
) -> Result<Compiled, CompileError> {
    let name = &model.name;
    let ranges = range::analyze(&model).map_err(CompileError::Program)?;
    observer(Pass::Check, &model);
    let mut warnings = lint::lint(&model, &ranges);
    let (step, ranges) = simplify::simplify(&model, ranges).map_err(CompileError::Program)?;
    observer(Pass::Simplify, &step.model);
    let lowered = lower::lower(&step, &ranges, scales, probes)
        .map_err(|error| defect(Pass::Lower, name, &[error]))?;
    kernel::verify::verify(&lowered.kernel).map_err(|all| defect(Pass::Lower, name, &all))?;
    warnings.extend(lost::warnings(&model, &step, &ranges, &lowered.updates));
    let scales = scales.of(&model);
    warnings.extend(slow_port::warnings(&model, &scales));
    warnings.sort_by_key(|d| (d.span, d.code));
    observer(Pass::Lower, &lowered.kernel);
    Ok(Compiled {
        scales,
        model,
        step,
        ranges,
        lowered,
        warnings,
    })
}

/// Kernel to Modes, with so many instructions at most; 0 for one mode that knows nothing.
///
/// # Errors
/// A defect.
pub fn specialize(
    compiled: &Compiled,
    instructions: usize,
    observer: Observer,
) -> Result<Modes, CompileError> {
    let modes = modes_of(&without_probes(&compiled.lowered.kernel), instructions)?;
    observer(Pass::Modes, &modes);
    Ok(modes)
}

/// Kernels whose modes are kept.
static MODES: Memo<Modes> = Memo::new(16);

/// The verified modes of a Kernel, of a whole one or of a part.
fn modes_of(kernel: &Kernel, instructions: usize) -> Result<Modes, CompileError> {
    let of_any_values = kernel.for_any_values();
    let origin = (&of_any_values, instructions);
    let made = MODES.get_or_make(&origin, || new_modes_of(&of_any_values, instructions))?;
    Ok(Modes {
        kernel: kernel.clone(),
        ..Arc::unwrap_or_clone(made)
    })
}

fn new_modes_of(kernel: &Kernel, instructions: usize) -> Result<Modes, CompileError> {
    let mut modes = modes::specialize(kernel, instructions);
    if modes::verify::verify(&modes).is_err() {
        modes::verify::widen(&mut modes);
        modes::verify::verify(&modes).map_err(|all| defect(Pass::Modes, &kernel.name, &all))?;
    }
    Ok(modes)
}

/// Kernel to Parts with Modes of their own, with so many instructions at most for each; none where
/// it has neither two members that are worth it nor a sound that is worth being apart.
///
/// # Errors
/// A defect.
pub fn cut(compiled: &Compiled, instructions: usize) -> Result<Option<InParts>, CompileError> {
    let whole = without_probes(&compiled.lowered.kernel);
    let parts = split(&whole).or_else(|| split_sound(&whole));
    let Some(parts) = parts.filter(|parts| is_heard(&whole, parts)) else {
        return Ok(None);
    };
    with_modes(whole, parts, instructions).map(Some)
}

/// Whether all that is heard of a whole is in the part where it is looked for.
fn is_heard(whole: &Kernel, parts: &Parts) -> bool {
    let heard = parts.heard().and_then(|part| parts.parts.get(part));
    heard.is_some_and(|part| part.kernel.channels().len() == whole.channels().len())
}

fn with_modes(whole: Kernel, parts: Parts, instructions: usize) -> Result<InParts, CompileError> {
    let of_part = |part: &whippen_parts::Part| {
        let kernel = &part.kernel;
        kernel::verify::verify(kernel).map_err(|all| defect(Pass::Modes, &kernel.name, &all))?;
        modes_of(kernel, instructions)
    };
    let modes = parts.parts.iter().map(of_part).collect::<Result<_, _>>()?;
    Ok(InParts {
        whole,
        instructions,
        parts,
        modes,
    })
}

/// An instrument in parts whose members are together where they have one core: that of each is
/// given. None where nothing would be other, or where a member has several modes, which those of
/// others would multiply; or where there is no sound to be done beside the tail.
///
/// # Errors
/// A defect.
pub(crate) fn together(
    in_parts: &InParts,
    cores: &[usize],
    beside: Beside,
) -> Result<Option<InParts>, CompileError> {
    let mut members = in_parts.modes.iter().skip(1).take(cores.len());
    let numbers: BTreeSet<usize> = cores.iter().copied().collect();
    if (numbers.len() == cores.len() && beside == Beside::default())
        || members.any(|modes| modes.modes.len() > 1)
    {
        return Ok(None);
    }
    let cores: Vec<u32> = cores.iter().map(|core| *core as u32).collect();
    let parts = split_together(&in_parts.whole, &cores, beside);
    let parts = parts.filter(|parts| is_heard(&in_parts.whole, parts));
    let with_modes = |parts| with_modes(in_parts.whole.clone(), parts, in_parts.instructions);
    parts.map(with_modes).transpose()
}

/// Modes to Image: code of the keys, partition, firmware, linking.
///
/// # Errors
/// Board or keys have no firmware, memory is full, the partition has no bound; or a defect.
pub fn build(
    layout: &Layout,
    instruments: &[Instrument],
    setup: &Setup,
    board: &Board,
    observer: Observer,
) -> Result<FirmwareImage, BuildError> {
    let made = build_bounded(layout, instruments, setup, board, observer)?;
    Ok(made.image)
}

/// As [`build`], with what the partition has bounded of the image.
///
/// # Errors
/// As [`build`].
pub fn build_bounded(
    layout: &Layout,
    instruments: &[Instrument],
    setup: &Setup,
    board: &Board,
    observer: Observer,
) -> Result<Partitioned, BuildError> {
    let made = build_partitioned(layout, instruments, setup, board)?;
    observer(Pass::Image, &Map(&made.image, board));
    Ok(made)
}

/// Image to Budget, while each of its programs plays with so many ticks per second.
///
/// # Errors
/// What cannot be bounded.
pub fn prove(
    image: &FirmwareImage,
    board: &Board,
    rate_hz: Rate,
    observer: Observer,
) -> Result<Proof, NotBounded> {
    let bytes = Bytes::of(&image.image);
    let bounded = bound_programs(image, &bytes, board)?;
    Ok(proof_of(bytes, bounded, board, rate_hz, observer))
}

/// The proof of an image whose programs are bounded.
fn proof_of(
    bytes: Bytes,
    bounded: Vec<Vec<Bounded>>,
    board: &Board,
    rate_hz: Rate,
    observer: Observer,
) -> Proof {
    let programs = bounded.into_iter().map(|cores| {
        let budget = Budget::of(&cores, board, rate_hz);
        observer(Pass::Budget, &budget);
        ProgramProof { cores, budget }
    });
    Proof {
        programs: programs.collect(),
        bytes,
    }
}

/// As [`prove`], of what is bounded already, as far as it is.
///
/// # Errors
/// As [`prove`].
pub fn prove_bounded(
    made: &mut Partitioned,
    board: &Board,
    rate_hz: Rate,
) -> Result<Proof, NotBounded> {
    let bytes = Bytes::of(&made.image.image);
    let known = std::mem::replace(&mut made.known, KnownTime::Nothing);
    let bounded = match known {
        KnownTime::Bounded(bounded) => bounded,
        KnownTime::Nothing | KnownTime::Late => bound_programs(&made.image, &bytes, board)?,
    };
    Ok(proof_of(bytes, bounded, board, rate_hz, &mut unobserved))
}

/// The certificate of an image that is proven, whose ELF file is given, with the text of its
/// Kernels.
///
/// # Errors
/// It has none.
pub fn certify(
    image: &FirmwareImage,
    board: &Board,
    rate_hz: Rate,
    kernels: &str,
    file: &[u8],
) -> Result<Certificate, NotCertified> {
    let deadline = board.deadline_cycles(rate_hz.cycles_min(board.clock_hz));
    let program = Bytes::of(&image.image);
    certificate(image, &program, board, deadline, kernels, file)
}

/// The map of an image on its board.
struct Map<'a>(&'a FirmwareImage, &'a Board);

impl Display for Map<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&whippen_arm::image::map(&self.0.image, self.1))
    }
}

/// The compiler's own mistake, in words.
fn defect(pass: Pass, name: &str, errors: &[impl Display]) -> CompileError {
    let all: Vec<String> = errors.iter().map(ToString::to_string).collect();
    let pass = pass.name();
    CompileError::Defect(format!("`{pass}` of `{name}`: {}", all.join("; ")))
}

#[cfg(test)]
mod tests {
    use super::*;
    use whippen_lang::bundled::INSTRUMENTS;

    const MIKEY: Scales = Scales {
        sensor_zero: -0.5e-3,
        sensor_lsb: 11e-3 / 65535.0,
        drive_lsb: 20.0 / 32768.0,
        update_hz: None,
    };

    fn program(text: &str) -> Program {
        let mut map = SourceMap::default();
        map.add("test.whip", text);
        let (program, diagnostics) = front(&mut map, &Options::default());
        program.unwrap_or_else(|| panic!("{diagnostics:#?}"))
    }

    /// Whatever its live values and its constants per key are at first, and whatever was asked
    /// before.
    #[test]
    fn modes_that_are_kept_are_those_that_would_be_made() {
        for (name, text) in INSTRUMENTS {
            for model in program(text).instruments {
                let compiled = compile(model, MIKEY, false).unwrap_or_else(|e| panic!("{e:?}"));
                let mut kernel = without_probes(&compiled.lowered.kernel);
                let anew = |kernel: &Kernel| new_modes_of(kernel, 600).expect("no defect");
                let of_this = anew(&kernel);
                let found = modes_of(&kernel, 600).expect("no defect");
                assert_eq!(found, of_this, "{name}");
                for live in &mut kernel.lives {
                    live.init = live.range.high as i32;
                }
                let found = modes_of(&kernel, 600).expect("no defect");
                assert_eq!(found.modes, of_this.modes, "{name}");
                assert_eq!(found, anew(&kernel), "{name}");
            }
        }
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
