//! The canonical layout of a program: what `whippen fmt` writes.
//!
//! ```text
//!   text -> pieces (tokens with their comments) -> rows (the tree's blocks and lines) -> cells -> lines -> text
//! ```
//!
//! * The tokens stay as they are, except a comma before a closing bracket: nothing that was written
//!   is lost, redundant round brackets included.
//! * A row is a declaration, a transition, an action or a setting. Neighbours of one kind form a
//!   run, and what they have in common stands in columns: `=`, `in`, `->`, `when`, `{`, the
//!   arguments of one term.
//! * A block with one action stays on its line if there is room; every other block has a line per
//!   row.
//! * What is wider than [`WIDTH`] is broken where it holds together most loosely.
//! * Comments at the end of a line begin in column [`COMMENT`], or two spaces behind what is
//!   longer.
//! * One blank line is kept where there were any; one stands between items.
//!
//! The result depends on tokens, comments and blank lines alone, so laying out twice changes
//! nothing.
//!
//! Not here: spelling a tree that has no text (`pretty`).

mod breaks;
mod cells;
mod lines;
mod pieces;
mod rows;
mod space;
mod write;

use super::parse;
use crate::diag::Diagnostic;

/// Lines are broken that would be wider, comments aside.
pub const WIDTH: usize = 120;
/// Columns per level of indentation.
const INDENT: usize = 4;
/// The column, counted from 0, in which comments at the end of a line begin.
const COMMENT: usize = 58;

/// The canonical layout of a text. Line ends stay what the first of them is; a byte-order mark is
/// dropped.
///
/// # Errors
/// The mistakes of a text that cannot be read; their spans name `file`.
pub fn layout(file: u32, text: &str) -> Result<String, Vec<Diagnostic>> {
    let mut diagnostics = Vec::new();
    let tree = parse(file, text, &mut diagnostics);
    if !diagnostics.is_empty() {
        return Err(diagnostics);
    }
    let (pieces, tail) = pieces::pieces(text);
    let rows = rows::items(&pieces, &tree.items);
    let lines = write::file(&pieces, &rows, &tail);
    let laid = lines::text(&lines);
    let windows = text.find('\n').is_some_and(|at| text[..at].ends_with('\r'));
    Ok(if windows {
        laid.replace('\n', "\r\n")
    } else {
        laid
    })
}
