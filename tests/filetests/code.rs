//! Commands on the machine code of a Kernel: after each pass, as bytes, and its bound.
//!
//! `select`, `promote`, `schedule`, `allocate`, `reorder` and `code` (the bytes) print one mode.
//! Words: `core=cortex-m0plus` (cortex-m33 otherwise); `modes` for the modes of the kernel, not one
//! that knows nothing; `mode=N` for another than the first; of `code`, `function=init` or the like,
//! or `routine=mul_top` for what is called.

use std::fmt::Write;
use whippen_compiler::board::timing;
use whippen_compiler::budget::{Annotations, Bound, Code, Query, bound};
use whippen_compiler::image::{Hint, Object};
use whippen_compiler::kernel::without_probes;
use whippen_compiler::modes::{Modes, specialize, specialize_fully};
use whippen_compiler::thumb::{Function, Options, Pass, code_after, compile};
use whippen_isa::{Arch, ItState};

use super::kernel::verified;

/// Where the bound takes the code to be.
const CODE: u32 = 0x2000_0000;

/// What is asked for, by a command's words.
struct Asked {
    modes: Modes,
    options: Options,
    mode: usize,
    function: Option<String>,
}

impl Asked {
    fn read(text: &str, words: &[&str]) -> Result<Asked, String> {
        let mut kernel = verified(text)?;
        kernel = without_probes(&kernel);
        let (mut arch, mut mode, mut function, mut split) = (Arch::V8M, 0, None, false);
        for word in words {
            match word.split_once('=').unwrap_or((word, "")) {
                ("core", "cortex-m33") => arch = Arch::V8M,
                ("core", "cortex-m4") => arch = Arch::V7EM,
                ("core", "cortex-m0plus") => arch = Arch::V6M,
                ("mode", number) => mode = number.parse().map_err(|_| format!("`{word}`"))?,
                ("function", name) => function = Some(format!("k_{name}")),
                ("routine", name) => function = Some(format!("k.{name}")),
                ("modes", "") => split = true,
                _ => return Err(format!("what is `{word}`?")),
            }
        }
        let modes = match split {
            true => specialize_fully(&kernel, 1000).ok_or("more than 1000 instructions")?,
            false => specialize(&kernel, 0),
        };
        let options = Options {
            name: "k".to_string(),
            keys: 4,
            gain: false,
            probes: false,
            arch,
        };
        Ok(Asked {
            modes,
            options,
            mode,
            function,
        })
    }
}

/// The code of a mode after a pass.
fn after(pass: Pass, text: &str, words: &[&str]) -> Result<Function, String> {
    let asked = Asked::read(text, words)?;
    let name = match &asked.function {
        Some(function) => function.clone(),
        None => format!("k.mode.{}", asked.mode),
    };
    let functions =
        code_after(pass, &asked.modes, &asked.options).map_err(|error| error.to_string())?;
    let found = functions.into_iter().find(|function| function.name == name);
    found.ok_or_else(|| format!("there is no function `{name}`"))
}

/// Instructions over virtual registers.
pub fn select(text: &str, words: &[&str]) -> Result<String, String> {
    after(Pass::Select, text, words).map(|function| function.text)
}

/// With words that every key reads in registers.
pub fn promote(text: &str, words: &[&str]) -> Result<String, String> {
    after(Pass::Promote, text, words).map(|function| function.text)
}

/// In an order that hides latencies.
pub fn schedule(text: &str, words: &[&str]) -> Result<String, String> {
    after(Pass::Schedule, text, words).map(|function| function.text)
}

/// With registers.
pub fn allocate(text: &str, words: &[&str]) -> Result<String, String> {
    after(Pass::Allocate, text, words).map(|function| function.text)
}

/// In a better order.
pub fn reorder(text: &str, words: &[&str]) -> Result<String, String> {
    after(Pass::Reorder, text, words).map(|function| function.text)
}

/// Bytes: offset, encoding, cycles of going straight on, instruction.
pub fn code(text: &str, words: &[&str]) -> Result<String, String> {
    let function = after(Pass::Emit, text, words)?;
    let cycles = function
        .cycles
        .map(|cycles| format!("longest path {cycles} cycles\n"));
    Ok(cycles.unwrap_or_default() + &function.text)
}

/// The bound of a mode, and the path that takes so long.
pub fn budget(text: &str, words: &[&str]) -> Result<String, String> {
    let asked = Asked::read(text, words)?;
    let built = compile(&asked.modes, &asked.options).map_err(|error| error.to_string())?;
    let section = &built.object.sections[0];
    let code = Code::new(CODE, section.bytes.clone());
    let entry = offset(&built.object, &format!("k.mode.{}", asked.mode))?;
    let annotations = annotations(&built.object)?;
    let core = timing(asked.options.arch).at_worst();
    let query = Query {
        core: &core,
        code: &code,
        entry,
        annotations: &annotations,
        interference: None,
    };
    let bound = bound(&query).map_err(|error| error.to_string())?;
    printed(&bound, &code, asked.options.arch)
}

/// The address of a symbol of the code.
fn offset(object: &Object, name: &str) -> Result<u32, String> {
    let symbol = object.symbols.iter().find(|symbol| symbol.name == name);
    let symbol = symbol.ok_or_else(|| format!("there is no symbol `{name}`"))?;
    Ok(CODE + symbol.offset)
}

/// Loops and targets of the code; a path ends where the next key's code begins.
fn annotations(object: &Object) -> Result<Annotations, String> {
    let mut annotations = Annotations::default();
    for hint in &object.sections[0].hints {
        match hint {
            Hint::Loop { at, rounds_max } => {
                annotations.loops.insert(CODE + at, *rounds_max);
            }
            Hint::Targets { at, symbols } => {
                let targets: Result<Vec<u32>, String> =
                    symbols.iter().map(|name| offset(object, name)).collect();
                let targets = targets?;
                annotations.stops.extend(&targets);
                annotations.targets.insert(CODE + at, targets);
            }
        }
    }
    Ok(annotations)
}

fn printed(bound: &Bound, code: &Code, arch: Arch) -> Result<String, String> {
    let mut text = format!("at most {} cycles, {}", bound.cycles_max, bound.class);
    if bound.infeasible > 0 {
        let _ = write!(text, "; {} branches that no input takes", bound.infeasible);
    }
    if bound.merged {
        text += "; states were joined";
    }
    let mut it = ItState::OUTSIDE;
    for step in &bound.path {
        let inst = code
            .decode(step.address, arch, it)
            .ok_or("a path outside of the code")?;
        let inst = inst.map_err(|error| format!("{:08x}: {error:?}", step.address))?;
        it = inst.it_behind(it).unwrap_or_default();
        let at = step.address - CODE;
        let _ = write!(text, "\n{at:04x}  {:3}  {inst}", step.cycles);
        if step.times > 1 {
            let _ = write!(text, " ; {} times", step.times);
        }
    }
    Ok(text)
}
