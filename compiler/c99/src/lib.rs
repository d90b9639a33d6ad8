//! C99 back end: a Kernel as source text for any microcontroller or computer that has a C compiler.
//!
//! ```text
//!   Kernel -> Source { header: types and three functions, body: the code }
//!
//!   defaults(state)         live values as declared
//!   init(state, in)         memory as before the first tick
//!   tick(state, in, out)    one tick of all keys; events collect in the state until the caller sets `events` to 0
//! ```
//!
//! The text is integers alone and agrees with the interpreter bit for bit. It rests on what
//! `verify` proved: no sum or product overflows its type, so none is written with unsigned detours,
//! and the same text is readable. Nothing that C leaves undefined is left over: negative values are
//! shifted left by way of unsigned ones, and a division sees no zero. Where a kernel `assume`s,
//! indices are held inside as in every engine. Shifting a negative value to the right is the only
//! thing that C leaves to the compiler; the text checks that it is the arithmetic shift, as
//! everywhere.
//!
//! | part | what it settles |
//! | --- | --- |
//! | `names` | identifiers: unique, and as near to the program's names as C lets them be |
//! | `declare` | the state, the header |
//! | `body` | regions, the loop over the keys, events |
//! | `operator` | operators as expressions and statements |
//! | `rust_types` | the state as types of Rust |
//! | `helpers` | functions that a text brings along where it needs them |
//!
//! Not here: compiling it, writing files.

mod body;
mod declare;
mod helpers;
mod names;
mod operator;
mod rust_types;

pub use declare::rate_constant;
pub use names::{Names, spelled};

use std::fmt::Write;
use whippen_ids::IdMap;
use whippen_kernel::{Inst, Kernel, Op, Region, Type, Value, Verified};

/// How the memory of the keys lies.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Layout {
    /// A record for each key: what a microcontroller loads with one base register.
    Records,
    /// A column for each word, keys side by side: what a compiler can run in lanes. Events are set
    /// aside and collected after the loop over the keys, so that the loop calls nothing.
    Columns,
}

/// How to write it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Options {
    /// How many keys, at least one.
    pub keys: usize,
    /// How their memory lies.
    pub layout: Layout,
    /// How many events are kept until the caller takes them; more are counted as lost.
    pub events: usize,
}

/// A Kernel in C.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Source {
    /// Types, sizes and functions, between include guards.
    pub header: String,
    /// The functions; to be compiled after the header.
    pub body: String,
}

/// Writes a kernel in C.
pub fn source(kernel: Verified, options: Options) -> Source {
    let kernel = kernel.kernel();
    let names = Names::new(kernel);
    let header = declare::header(kernel, &names, options);
    let body = Writer::new(kernel, &names, options).whole();
    Source { header, body }
}

/// A Kernel in C as a part of a larger text: what another one declares around it is its own.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Component {
    /// Types, to be declared before anything that holds a `PREFIX_state`.
    pub types: String,
    /// The same types in Rust: `KernelState` and what it holds.
    pub rust_types: String,
    /// The functions, all static: `PREFIX_defaults`, `PREFIX_init`, `PREFIX_tick`.
    pub body: String,
    /// The fields of live values.
    pub lives: Vec<String>,
}

/// Writes a kernel as a part of a larger text, records of keys, with a prefix for its names and
/// this many words of a key from one to the next. The text keeps as many events as a tick can have.
pub fn component(kernel: Verified, prefix: &str, keys: usize, row_words: usize) -> Component {
    let kernel = kernel.kernel();
    let events = keys * kernel.tick.events_max() as usize;
    let options = Options {
        keys,
        layout: Layout::Records,
        events: events.max(1),
    };
    let mut names = Names::new(kernel);
    names.kernel = prefix.to_string();
    names.capitals = prefix.to_uppercase();
    names.events = (0..kernel.events.len()).map(|n| n.to_string()).collect();
    let mut writer = Writer::new(kernel, &names, options);
    writer.linkage = "static ";
    writer.row_words = [row_words; 2];
    Component {
        types: declare::component_types(kernel, &names, options),
        rust_types: rust_types::rust_types(kernel, &names, options),
        body: writer.whole(),
        lives: names.lives.clone(),
    }
}

/// Writes the functions.
struct Writer<'a> {
    kernel: &'a Kernel,
    names: &'a Names,
    options: Options,
    text: String,
    depth: usize,
    /// How each value is written where it is used: its name, or a constant.
    values: IdMap<Value, String>,
    /// Whether anything is `assume`d, so that indices must be held inside.
    assumes: bool,
    /// Whether events are set aside until all keys are done.
    set_aside: bool,
    /// Events met so far.
    emits: usize,
    /// What stands before each function.
    linkage: &'static str,
    /// Words in and words out from one key to the next.
    row_words: [usize; 2],
}

impl<'a> Writer<'a> {
    fn new(kernel: &'a Kernel, names: &'a Names, options: Options) -> Writer<'a> {
        Writer {
            kernel,
            names,
            options,
            text: String::new(),
            depth: 0,
            values: IdMap::filled(String::new(), kernel.values.len()),
            assumes: kernel.assumes(),
            set_aside: options.layout == Layout::Columns && !emits_in_loop(&kernel.tick),
            emits: 0,
            linkage: "",
            row_words: [kernel.inputs.len(), kernel.outputs.len()],
        }
    }

    fn line(&mut self, text: impl AsRef<str>) {
        let _ = writeln!(self.text, "{:1$}{2}", "", 4 * self.depth, text.as_ref());
    }

    fn open(&mut self, text: impl AsRef<str>) {
        self.line(text);
        self.depth += 1;
    }

    fn close(&mut self) {
        self.depth -= 1;
        self.line("}");
    }

    fn value(&self, value: Value) -> &str {
        &self.values[value]
    }

    fn ty(&self, value: Value) -> Type {
        self.kernel.values[value].ty
    }
}

/// The C type that holds a value of this type. A bool takes a word, as wide as what it chooses
/// between.
fn c_type(ty: Type) -> &'static str {
    match ty {
        Type::I1 | Type::I32 => "int32_t",
        Type::I64 => "int64_t",
    }
}

/// A constant of this type. C has no negative literals, and the smallest number is no negated one.
fn literal(ty: Type, value: i64) -> String {
    match ty {
        Type::I1 | Type::I32 if value == i64::from(i32::MIN) => "INT32_MIN".to_string(),
        Type::I1 | Type::I32 => value.to_string(),
        Type::I64 if value == i64::MIN => "INT64_MIN".to_string(),
        Type::I64 => format!("INT64_C({value})"),
    }
}

fn emits_in_loop(region: &Region) -> bool {
    let is_loop = |inst: &&Inst| matches!(inst.op, Op::Loop(_));
    let loops = region.all_insts().filter(is_loop);
    loops
        .flat_map(Inst::all_insts)
        .any(|inst| matches!(inst.op, Op::Emit(_)))
}
