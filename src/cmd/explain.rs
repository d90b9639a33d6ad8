//! `whippen explain`

use whippen_compiler::bundled::STD;
use whippen_compiler::diag::Code;
use whippen_compiler::diag::explain::GROUPS;
use whippen_compiler::syntax::ast::{Item, Term, TypedName};
use whippen_compiler::syntax::parse;

use crate::exit::{Failure, Outcome};
use crate::say::{self, say};

#[derive(Debug, clap::Args)]
#[command(after_help = "Example: whippen explain WH0203")]
pub struct Args {
    /// The code, such as WH0203, 203 or unknown-term, or a term of the library, such as detents;
    /// without it all are listed
    #[arg(value_name = "CODE|TERM")]
    code: Option<String>,
}

pub fn run(args: &Args) -> Outcome {
    let Some(text) = &args.code else {
        list();
        return Ok(());
    };
    if let Some(term) = term(text) {
        say::whole(&term);
        return Ok(());
    }
    match Code::find(text) {
        Ok(code) => {
            say::whole(&code.plain_page(say::columns()));
            Ok(())
        }
        Err(Some(near)) => Err(Failure::Usage(format!(
            "there is no diagnostic `{text}`; did you mean {} ({})?",
            near.number(),
            near.name()
        ))),
        Err(None) => Err(Failure::Usage(format!(
            "there is no diagnostic and no term of the library `{text}`; `whippen explain` lists all"
        ))),
    }
}

/// All terms of the library.
fn terms() -> impl Iterator<Item = Term> {
    let items = STD
        .iter()
        .flat_map(|(_, text)| parse(0, text, &mut Vec::new()).items);
    items.filter_map(|item| match item {
        Item::Term(term) => Some(term),
        Item::Instrument(_) | Item::Keyboard(_) => None,
    })
}

/// What a term of the library takes and gives, and what it is.
fn term(name: &str) -> Option<String> {
    let term = terms().find(|term| term.name.node == name)?;
    let typed = |all: &[TypedName]| {
        let one = |one: &TypedName| format!("{}: {}", one.name.node, one.ty.node);
        all.iter().map(one).collect::<Vec<_>>().join(", ")
    };
    let (params, results) = (typed(&term.params), typed(&term.results));
    Some(format!(
        "{name}({params}) -> {results}\n\n{}\n\ndocs/std.md has an example and its picture.\n",
        term.doc
    ))
}

fn list() {
    for (group, name) in GROUPS {
        say!("{name}");
        for code in Code::ALL
            .iter()
            .filter(|c| c.number()[2..].starts_with(group))
        {
            say!("  {}  {:<22} {}", code.number(), code.name(), code.title());
        }
        say!("");
    }
    say!("terms of the library");
    for term in terms() {
        say!("  {}", term.name.node);
    }
    say!("");
    say!("whippen explain CODE shows the page of one of them, whippen explain TERM what a term is");
}
