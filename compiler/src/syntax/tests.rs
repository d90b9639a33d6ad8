//! Tests of the way from text to tree.

mod manual;
mod meaning;
mod mistakes;
mod random;
mod spans;

use super::ast::*;
use super::parse;
use crate::diag::Diagnostic;

/// The bundled programs: file name and text.
pub(crate) const PROGRAMS: &[(&str, &str)] = &[
    ("grand-piano.whip", include_str!("../../../instruments/grand-piano.whip")),
    ("harpsichord.whip", include_str!("../../../instruments/harpsichord.whip")),
    ("hammond.whip", include_str!("../../../instruments/hammond.whip")),
    ("mikey.whip", include_str!("../../../instruments/mikey.whip")),
    ("std/escapement.whip", include_str!("../../../instruments/std/escapement.whip")),
    ("std/plectrum.whip", include_str!("../../../instruments/std/plectrum.whip")),
];

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
    match tree(&format!("instrument i {{\n{text}\n}}")).items.remove(0) {
        Item::Instrument(i) => i.decls.into_iter().map(|d| d.kind).collect(),
        other => panic!("{other:?}"),
    }
}

#[test]
fn bundled_programs_are_read_without_complaint() {
    for (name, text) in PROGRAMS {
        let (file, diagnostics) = read(text);
        assert!(diagnostics.is_empty(), "{name}: {diagnostics:#?}");
        assert_eq!(file.items.len(), 1, "{name}");
    }
}
