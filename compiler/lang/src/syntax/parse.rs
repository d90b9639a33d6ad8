//! The parser: tokens to tree. Never fails; what is wrong becomes diagnostics, what could not be
//! read is left out or stands in the tree as [`super::ast::ExprKind::Error`].

use std::collections::HashSet;

use lalrpop_util::lalrpop_mod;

use super::ast::{File, Item, Spanned};
use super::build::Build;
use super::expected;
use super::repair::repair;
use super::token::lex;
use crate::diag::{Code, Diagnostic};

lalrpop_mod!(
    #[allow(clippy::all, clippy::pedantic, missing_docs, unused)]
    grammar,
    "/syntax/grammar.rs"
);

/// Reads one file. Diagnostics are added in the order of the text.
pub fn parse(file: u32, text: &str, diagnostics: &mut Vec<Diagnostic>) -> File {
    let mut found = Vec::new();
    let lexed = lex(file, text, &mut found);
    let tokens = repair(text, lexed.tokens, &mut found);
    let mut build = Build {
        file,
        errors: Vec::new(),
        diagnostics: Vec::new(),
    };
    let triples = tokens
        .iter()
        .map(|t| Ok((t.span.start, t.node, t.span.end)));
    let tree = grammar::FileParser::new().parse(&mut build, triples);
    let mut tree = tree.unwrap_or_else(|error| {
        build.failed(lalrpop_util::ErrorRecovery {
            error,
            dropped_tokens: Vec::new(),
        });
        File::default()
    });
    let mut described = expected::describe(file, text, &tokens, build.errors);
    let places: HashSet<u32> = found.iter().map(|d| d.span.start).collect();
    described.retain(|d| !places.contains(&d.span.start) && !follows_stray(text, &found, d));
    found.append(&mut build.diagnostics);
    found.append(&mut described);
    found.sort_by_key(|d| (d.span.start, d.span.end));
    diagnostics.append(&mut found);
    document(&mut tree, &lexed.comments, &tokens);
    tree
}

/// Whether what is wrong comes of a sign earlier in its line that is not of the language.
fn follows_stray(text: &str, found: &[Diagnostic], wrong: &Diagnostic) -> bool {
    found.iter().any(|stray| {
        let between = text.get(stray.span.end as usize..wrong.span.start as usize);
        stray.code == Code::UnexpectedCharacter
            && between.is_some_and(|between| !between.contains('\n'))
    })
}

/// Gives every item the `///` lines between what stands before it and itself.
fn document(tree: &mut File, comments: &[Spanned<&str>], tokens: &[Spanned<super::token::Token>]) {
    for item in &mut tree.items {
        let (doc, span) = match item {
            Item::Instrument(i) => (&mut i.doc, i.span),
            Item::Term(t) => (&mut t.doc, t.span),
            Item::Keyboard(k) => (&mut k.doc, k.span),
        };
        let before = tokens[..tokens.partition_point(|t| t.span.start < span.start)].last();
        let from = before.map_or(0, |t| t.span.end);
        let first = comments.partition_point(|c| c.span.start < from);
        let lines = comments[first..]
            .iter()
            .take_while(|c| c.span.start < span.start);
        let lines = lines.filter_map(|c| c.node.strip_prefix("///"));
        *doc = lines
            .map(|line| line.strip_prefix(' ').unwrap_or(line))
            .collect::<Vec<_>>()
            .join("\n");
    }
}
