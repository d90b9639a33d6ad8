//! From the tree to the Model: names, dimensions, constants, terms, machines, keyboards.
//!
//! ```text
//!   files + std ─ items ──┬─ sets, keyboards (numbers only) ─┐
//!                         │                                  v
//!                         └─ per instrument:  instantiate -> elaborate -> finish ──> Model
//! ```
//!
//! * `items` finds what the files declare; a user's term hides a term of `std`.
//! * `instantiate` makes the tree of scopes: the instrument, and below it one scope per call of a
//!   term, each with memory of its own. No expression is looked at yet, so cells and machines are
//!   numbered in the order of the text.
//! * `elaborate` gives every expression a type and a node. Values are evaluated when first asked
//!   for, so the order of declarations does not matter and a circle shows itself.
//! * `finish` looks at the whole: states that no transition names.
//!
//! Every term is first checked by itself, with parameters of which only the type is known, then
//! wherever it is called; a message that says the same about the same place is given once. What is
//! in error already is `None` and silent, so that one mistake gives one message.
//!
//! Not here: whether values are bounded and divisors differ from zero (the range analysis), algebra
//! (the simplifier).

mod action;
mod bank;
mod body;
mod builtin;
mod call;
mod cell;
mod children;
mod constant;
mod decimal_comma;
mod delay;
mod diags;
mod drive;
mod dubious;
mod elaborate;
mod elsewhere;
mod expect;
mod expr;
mod friction;
mod hardware;
mod instantiate;
mod items;
mod keyboard;
mod noise;
mod notes;
mod operator;
mod param;
mod per_key;
mod ports;
mod prime;
mod results;
mod rule;
mod scope;
mod sense;
mod sets;
mod settings;
mod shared_senses;
mod slot;
mod sound;
mod states;
pub mod strand;
mod table;
pub(crate) mod table_file;
mod titled_text;
mod types;
mod walk;
mod written_unit;
mod zones;

#[cfg(test)]
mod tests;

pub use builtin::function_names;
pub use notes::{midi_number, note_name};
pub use table_file::FileReader;
pub use titled_text::{TitledText, short};

use crate::diag::Diagnostic;
use crate::model::Model;
use crate::syntax::ast::File;
use table_file::TableFiles;
use whippen_keyboard::Layout;
use whippen_rate::{DENOMINATOR_MAX, HZ_MAX, Rate};
use whippen_source::Span;

/// A rate of ticks, if it is one: from 1 to [`HZ_MAX`] Hz, whole or a fraction.
///
/// # Errors
/// What a rate is, in words.
pub fn tick_rate(hertz: f64) -> Result<Rate, String> {
    let rate = Rate::of_hz(hertz).filter(|rate| rate.hz() >= 1.0);
    rate.ok_or_else(|| {
        format!(
            "a rate is from 1 to {HZ_MAX} Hz, or a fraction such as 150 MHz / 3400, \
             with a denominator of at most {DENOMINATOR_MAX}"
        )
    })
}

/// What the caller decides.
#[derive(Debug, Clone, Default)]
pub struct Options {
    /// Ticks per second, a [`tick_rate`]; where it is not decided, the keyboard's, or
    /// 44100 Hz.
    pub rate_hz: Option<Rate>,
    /// Parameters set from outside: `name` or `instrument.name`, and the value as text (`0.4N`,
    /// `off`).
    pub sets: Vec<(String, String)>,
    /// Those of them, by the name that they set, whose plain numbers are in SI.
    pub in_si: Vec<String>,
    /// Reads the files of tables.
    pub read: FileReader,
}

/// A checked program.
#[derive(Debug, Clone)]
pub struct Program {
    /// Its instruments, in the order of the text.
    pub instruments: Vec<Model>,
    /// Its keyboards, in the order of the text.
    pub keyboards: Vec<Keyboard>,
}

/// `keyboard`: instruments on a device.
#[derive(Debug, Clone, PartialEq)]
pub struct Keyboard {
    /// Its name.
    pub name: String,
    /// Where its name stands.
    pub span: Span,
    /// The board its code runs on, if it says so.
    pub board: Option<String>,
    /// How many chips of that board have its keys, each a run of neighbours.
    pub chips: u32,
    /// Sensors, converters, motor and key; of keys `mikey` unless it says otherwise.
    pub device: DeviceName,
    /// Ticks per second.
    pub rate_hz: Rate,
    /// Its keys, and its programs: instruments by their place in [`Program::instruments`].
    pub layout: Layout,
}

/// The device that a keyboard names.
#[derive(Debug, Clone, PartialEq)]
pub enum DeviceName {
    /// It names none, and has ports of its instrument: the bundled one that has them.
    Usual,
    /// A bundled one.
    Bundled(String),
    /// A file, relative to the program's, and where it is named.
    File(String, Span),
}

impl Options {
    /// Ticks per second where no keyboard says otherwise.
    fn usual_rate_hz(&self) -> Rate {
        self.rate_hz.unwrap_or_default()
    }
}

/// Checks a program and gives its Models, unless there is an error.
///
/// The spans in `files` and `std` name their files in this order, all of `files` before all of
/// `std`; spans in messages about the k-th of `options.sets` name file `files.len() + std.len() +
/// k`, whose text is `name=value`.
pub fn check(
    files: &[File],
    std: &[File],
    table_files: TableFiles,
    options: &Options,
) -> (Option<Program>, Vec<Diagnostic>) {
    let mut diags = diags::Diags::default();
    let mut items = items::collect(files, std, &mut diags);
    items.table_files = table_files;
    let mut sets = sets::read(options, files.len() + std.len(), &mut diags);
    let boards = keyboard::read(&items, options, &mut diags);
    for term in &items.terms {
        elaborate::term_alone(&items, term, options, &mut diags);
    }
    let models: Vec<Option<Model>> = (0..items.instruments.len())
        .map(|index| {
            let settings = settings::of(index, &items, &boards, &mut sets, options, &mut diags);
            elaborate::instrument(&items, index, settings, &mut diags)
        })
        .collect();
    ports::of_keys(&boards, &models, &mut diags);
    shared_senses::compare_senses(&boards, &models, &mut diags);
    sets::report_unused(&sets, &items, &mut diags);
    let program = (!diags.any_error()).then(|| Program {
        instruments: models.into_iter().flatten().collect(),
        keyboards: boards.into_iter().map(|board| board.keyboard).collect(),
    });
    (program, diags.sorted())
}
