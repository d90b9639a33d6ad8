//! What the files of a program declare: instruments, terms, keyboards.

use std::collections::BTreeMap;

use super::builtin::{self, Signature};
use super::diags::Diags;
use super::table_file::TableFiles;
use crate::diag::{Code, Diagnostic, nearest};
use crate::syntax::ast::{File, Instrument, Item, Keyboard, Name, Term};
use whippen_source::Span;

/// A term and where it comes from.
#[derive(Debug, Clone, Copy)]
pub struct TermItem<'a> {
    /// The term.
    pub ast: &'a Term,
    /// Whether it belongs to the standard library.
    pub std: bool,
}

/// Everything at the top level.
#[derive(Default)]
pub struct Items<'a> {
    /// Instruments in the order of the text.
    pub instruments: Vec<&'a Instrument>,
    /// Keyboards in the order of the text.
    pub keyboards: Vec<&'a Keyboard>,
    /// Terms, the user's first.
    pub terms: Vec<TermItem<'a>>,
    /// The files of tables.
    pub table_files: TableFiles,
    user_terms: BTreeMap<&'a str, TermItem<'a>>,
    std_terms: BTreeMap<&'a str, TermItem<'a>>,
}

impl<'a> Items<'a> {
    /// The term of that name. The standard library sees only itself, so hiding one of its terms
    /// changes no other.
    pub fn term(&self, name: &str, from_std: bool) -> Option<TermItem<'a>> {
        let user = if from_std {
            None
        } else {
            self.user_terms.get(name)
        };
        user.or_else(|| self.std_terms.get(name)).copied()
    }

    /// The function of that name, unless a term of the program has it.
    pub fn function(&self, name: &str, from_std: bool) -> Option<&'static Signature> {
        let hidden = !from_std && self.user_terms.contains_key(name);
        builtin::function(name).filter(|_| !hidden)
    }

    /// The index of the instrument of that name.
    pub fn instrument(&self, name: &str) -> Option<usize> {
        self.instruments.iter().position(|i| i.name.node == name)
    }

    /// A function or term that looks like the name.
    pub fn nearest_function(&self, name: &str) -> Option<&str> {
        let terms = self.user_terms.keys().chain(self.std_terms.keys()).copied();
        nearest(name, builtin::FUNCTIONS.iter().map(|f| f.name).chain(terms))
    }

    /// An instrument that looks like the name.
    pub fn nearest_instrument(&self, name: &str) -> Option<&str> {
        nearest(name, self.instruments.iter().map(|i| i.name.node.as_str()))
    }
}

/// Collects the items of all files; of two with one name the first is kept.
pub fn collect<'a>(files: &'a [File], std: &'a [File], diags: &mut Diags) -> Items<'a> {
    let mut items = Items::default();
    for item in std.iter().flat_map(|f| &f.items) {
        if let Item::Term(ast) = item {
            items
                .std_terms
                .insert(&ast.name.node, TermItem { ast, std: true });
        }
    }
    let mut taken = BTreeMap::new();
    for item in files.iter().flat_map(|f| &f.items) {
        let (kind, name) = match item {
            Item::Instrument(i) => ("instrument", &i.name),
            Item::Term(t) => ("term", &t.name),
            Item::Keyboard(k) => ("keyboard", &k.name),
        };
        if is_new(&mut taken, kind, name, diags) {
            items.add(item, diags);
        }
    }
    items.terms = items
        .user_terms
        .values()
        .chain(items.std_terms.values())
        .copied()
        .collect();
    items
}

impl<'a> Items<'a> {
    fn add(&mut self, item: &'a Item, diags: &mut Diags) {
        match item {
            Item::Instrument(instrument) => self.instruments.push(instrument),
            Item::Keyboard(keyboard) => self.keyboards.push(keyboard),
            Item::Term(ast) => {
                if builtin::function(&ast.name.node).is_some() {
                    diags.push(hides_function(&ast.name));
                }
                if let Some(hidden) = self.std_terms.get(ast.name.node.as_str()) {
                    diags.push(hides_std(&ast.name, hidden.ast.name.span));
                }
                self.user_terms
                    .insert(&ast.name.node, TermItem { ast, std: false });
            }
        }
    }
}

fn is_new<'a>(
    taken: &mut BTreeMap<(&'static str, &'a str), Span>,
    kind: &'static str,
    name: &'a Name,
    diags: &mut Diags,
) -> bool {
    let function = builtin::function(&name.node);
    if kind == "term" && function.is_some_and(|function| !function.can_be_hidden()) {
        let message = format!("`{}` is built in", name.node);
        diags.push(
            Diagnostic::new(
                Code::DuplicateName,
                name.span,
                message,
                "a term of this name could never be called",
            )
            .hint("choose another name for the term"),
        );
        return false;
    }
    match taken.get(&(kind, name.node.as_str())) {
        None => taken.insert((kind, &name.node), name.span).is_none(),
        Some(&first) => {
            let message = format!("there are two {kind}s `{}`", name.node);
            let diagnostic =
                Diagnostic::new(Code::DuplicateName, name.span, message, "the second one");
            diags.push(
                diagnostic
                    .also(first, "the first one")
                    .hint(format!("rename one {kind}")),
            );
            false
        }
    }
}

fn hides_std(name: &Name, hidden: Span) -> Diagnostic {
    let message = format!(
        "the term `{}` hides the one of the standard library",
        name.node
    );
    Diagnostic::new(Code::HidesStd, name.span, message, "this one is used")
        .also(hidden, "this one is hidden")
        .hint("rename it, unless it is meant to replace the library's term")
}

fn hides_function(name: &Name) -> Diagnostic {
    let message = format!("the term `{}` hides a function that is built in", name.node);
    Diagnostic::new(Code::HidesStd, name.span, message, "this one is used")
        .hint("rename it, unless it is meant to replace the function")
}
