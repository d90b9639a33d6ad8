//! Agreement of the programs of a keyboard in what they sense.

use super::diags::Diags;
use super::keyboard::Board;
use crate::diag::{Code, Diagnostic};
use crate::model::{Model, Sense};

/// Programs that share a keyboard read the same sensors, so they must agree in what they sense.
pub fn compare_senses(boards: &[Board], models: &[Option<Model>], diags: &mut Diags) {
    for board in boards {
        let programs: Vec<&Model> = board
            .keyboard
            .layout
            .instruments()
            .into_iter()
            .filter_map(|id| models[id.index()].as_ref())
            .collect();
        let Some((first, rest)) = programs.split_first() else {
            continue;
        };
        for other in rest {
            compare(board, first, other, diags);
        }
    }
}

fn compare(board: &Board, first: &Model, other: &Model, diags: &mut Diags) {
    let differs = |(a, b): &(&Sense, &Sense)| a.dim != b.dim || a.range != b.range;
    let (spans, what) = match first.senses.iter().zip(&other.senses).find(differs) {
        Some((a, b)) => (Some((a.span, b.span)), "differ in dimension or range"),
        None if first.senses.len() == other.senses.len() => return,
        None => (None, "differ in number"),
    };
    let keyboard = &board.ast.name;
    let message = format!(
        "`{}` and `{}` share the keyboard `{}` and sense differently",
        first.name, other.name, keyboard.node
    );
    let (place, label) = spans.map_or(
        (keyboard.span, format!("the sensed values {what}")),
        |(_, b)| (b, format!("sensed by `{}`", other.name)),
    );
    let mut diagnostic = Diagnostic::new(Code::SenseMismatch, place, message, label);
    if let Some((a, _)) = spans {
        diagnostic = diagnostic.also(a, format!("sensed by `{}`", first.name));
    }
    diags.push(
        diagnostic.hint("give their `sense` lines the same type and range, in the same order"),
    );
}
