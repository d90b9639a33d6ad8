//! An assembler for the firmware: text in unified syntax to an [`Object`].
//!
//! ```text
//!   text --line--> statements --section--> items (instructions with holes, data, alignment, pools)
//!        --layout--> offsets, widths of branches --> bytes, fixups, symbols
//! ```
//!
//! What an instruction's text means is the table's (`isa::parse`). Everything written here
//! assembles to the same bytes with the GNU assembler (`compiler/tests/it/asm.rs`), so that who
//! knows one can read the other. Labels, also `1:` with `1b` and `1f`; constants by `.equ` or from
//! the caller; `ldr r0, =value` with pools at `.ltorg` and at the end; `.if` and `.rept` by
//! constants. A comment `@! rounds 3` says how often the loop that begins with the next instruction
//! runs at most, `@! targets a b` where the next instruction, an indirect branch, may go: what a
//! static bound must be told.
//!
//! Not here: macros, includes, floating point data, addresses.

mod directive;
mod emit;
mod expr;
mod instruction;
mod item;
mod layout;
mod line;

use std::collections::BTreeMap;
use std::fmt;

use whippen_isa::Arch;

use crate::image::Object;

/// A text to assemble.
#[derive(Debug, Clone, Copy, Hash)]
pub struct Source<'a> {
    /// Its name in messages.
    pub name: &'a str,
    /// The text.
    pub text: &'a str,
}

/// What is wrong with a text, and where.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct AsmError {
    /// Name of the text.
    pub source: String,
    /// Its line, from 1.
    pub line: usize,
    /// What is wrong and what to write.
    pub message: String,
}

impl fmt::Display for AsmError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}:{}: {}", self.source, self.line, self.message)
    }
}

impl std::error::Error for AsmError {}

/// Assembles texts as one, in this order. `constants` are known in them as if `.equ` had defined
/// them.
///
/// # Errors
/// The first line that is no assembly, with what to write instead.
pub fn assemble(
    sources: &[Source],
    constants: &BTreeMap<String, i64>,
    arch: Arch,
) -> Result<Object, AsmError> {
    let mut unit = item::AssemblyUnit::new(constants, arch);
    let lines: Vec<&str> = sources
        .iter()
        .flat_map(|source| source.text.lines())
        .collect();
    let located = |(line, message): (usize, String)| at(sources, line, message);
    take(&mut unit, &lines, 0).map_err(located)?;
    unit.close()
        .map_err(|message| located((lines.len(), message)))?;
    layout::place(&mut unit).map_err(located)?;
    emit::object(&unit).map_err(located)
}

/// Takes lines, the first of which has number `first` + 1; what stands between `.rept` and `.endr`
/// as often as it says.
fn take(
    unit: &mut item::AssemblyUnit,
    lines: &[&str],
    first: usize,
) -> Result<(), (usize, String)> {
    let mut index = 0;
    while index < lines.len() {
        let number = first + index + 1;
        unit.line = number;
        let located = |message| (number, message);
        if let Some(times) = lines[index]
            .trim()
            .strip_prefix(".rept")
            .filter(|_| unit.counts())
        {
            let length = lines[index + 1..]
                .iter()
                .position(|line| line.trim() == ".endr");
            let length = length.ok_or_else(|| located("`.endr` is missing".to_string()))?;
            let times = unit.number(times).map_err(located)?;
            if !(0..=REPEATS_MAX).contains(&times) {
                return Err(located(format!(
                    "{times} times cannot be; at most {REPEATS_MAX}"
                )));
            }
            for _ in 0..times {
                take(unit, &lines[index + 1..=index + length], number)?;
            }
            index += length + 2;
            continue;
        }
        line::statements(lines[index])
            .and_then(|all| unit.take(&all))
            .map_err(located)?;
        index += 1;
    }
    Ok(())
}

/// More than any table here.
const REPEATS_MAX: i64 = 1000;

/// The source that holds a line of all.
fn at(sources: &[Source], line: usize, message: String) -> AsmError {
    let mut line = line;
    for source in sources {
        let count = source.text.lines().count();
        if line <= count {
            return AsmError {
                source: source.name.to_string(),
                line,
                message,
            };
        }
        line -= count;
    }
    let last = sources.last().map_or("", |source| source.name);
    AsmError {
        source: last.to_string(),
        line,
        message,
    }
}
