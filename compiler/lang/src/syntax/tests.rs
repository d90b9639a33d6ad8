//! Tests of the way from text to tree.

mod layout;
mod manual;
mod meaning;
mod mistakes;
mod random;
mod spans;
mod spoilt;

use super::ast::*;
use super::parse;
use crate::bundled::programs;
use crate::diag::Diagnostic;

fn read(text: &str) -> (File, Vec<Diagnostic>) {
    let mut diagnostics = Vec::new();
    let file = parse(0, text, &mut diagnostics);
    (file, diagnostics)
}

/// The tree of a text without mistakes.
fn tree(text: &str) -> File {
    let (file, diagnostics) = read(text);
    assert!(diagnostics.is_empty(), "{text}\n{diagnostics:#?}");
    file
}

/// The declarations of an instrument that consists of this text.
fn decls(text: &str) -> Vec<DeclKind> {
    match tree(&format!("instrument i {{\n{text}\n}}"))
        .items
        .remove(0)
    {
        Item::Instrument(i) => i.decls.into_iter().map(|d| d.kind).collect(),
        other => panic!("{other:?}"),
    }
}

#[test]
fn bundled_programs_are_read_without_complaint() {
    for (name, text) in programs() {
        let (file, diagnostics) = read(text);
        assert!(diagnostics.is_empty(), "{name}: {diagnostics:#?}");
        assert!(!file.items.is_empty(), "{name}");
    }
}
