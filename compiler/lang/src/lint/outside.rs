//! Values that reach beyond the range of the `state` they are written to.
//!
//! Clamping is part of the language, and what depends on memory (a counter, a position) may rely on
//! it. A value that is made of measured and set values alone shows how far it reaches, and a range
//! that cuts it off is too small.

use super::in_calls;
use crate::diag::{Code, Diagnostic};
use crate::model::{Action, CellId, CellKind, Interval, Model, Node, NodeId};
use crate::range::Ranges;
use crate::units::{shown, shown_range};
use whippen_ids::{Id, IdMap};
use whippen_source::Span;

/// A range may be missed by such a part of its width: ends are rounded.
const SLACK: f64 = 1e-9;

/// Warns of `next` values and writes that are cut off.
pub(super) fn check(model: &Model, ranges: &Ranges, found: &mut Vec<Diagnostic>) {
    let nexts = model
        .nexts
        .iter()
        .map(|&(cell, value)| (cell, value, None, None));
    let actions = model
        .rules
        .iter()
        .flat_map(|r| r.actions.iter().map(|a| (a, r.call)));
    let writes = actions.filter_map(|(action, call)| match action {
        Action::Write { cell, value, span } => Some((*cell, *value, Some(*span), call)),
        _ => None,
    });
    for (cell, value, span, call) in nexts.chain(writes) {
        if model.cells[cell].kind == CellKind::State && is_free(model, value) {
            let written = span.or_else(|| computed_at(model, value));
            let diagnostic = outside(model, cell, ranges.get(value), written);
            found.extend(diagnostic.map(|d| in_calls(model, call, d)));
        }
    }
}

/// Where a value is computed, unless it is a name alone.
fn computed_at(model: &Model, value: NodeId) -> Option<Span> {
    let leaf = model.dag.get(value).operands().is_empty();
    model.spans.get(value).copied().flatten().filter(|_| !leaf)
}

/// Whether every bound of the value's interval is a value it takes: each leaf occurs once, and
/// nothing is remembered.
fn is_free(model: &Model, value: NodeId) -> bool {
    let mut uses: IdMap<NodeId, u32> = IdMap::filled(0, value.index() + 1);
    let below = model.dag.below(value);
    for id in &below {
        for operand in model.dag.get(*id).operands() {
            uses[operand] += 1;
        }
    }
    below.iter().all(|&id| match model.dag.get(id) {
        Node::Const(_) | Node::Bool(_) => true,
        Node::Cell(_) | Node::Is(..) | Node::Slope(_) | Node::Curvature(_) => false,
        Node::Select(..) | Node::SelectBool(..) => false,
        _ => uses[id] <= 1,
    })
}

fn outside(
    model: &Model,
    cell: CellId,
    value: Interval,
    written: Option<Span>,
) -> Option<Diagnostic> {
    let cell = &model.cells[cell];
    let slack = SLACK * cell.range.width();
    let (reach, end) = if value.high > cell.range.high + slack {
        (value.high, cell.range.high)
    } else if value.low < cell.range.low - slack {
        (value.low, cell.range.low)
    } else {
        return None;
    };
    let (name, dim) = (&cell.name, cell.dim);
    let message = format!("the range of `{name}` is too small for what is written to it");
    let label = format!(
        "ends at {}, and {} is written",
        shown(end, dim),
        shown(reach, dim)
    );
    let mut diagnostic = Diagnostic::new(Code::RangeTooSmall, cell.span, message, label);
    if let Some(written) = written {
        diagnostic = diagnostic.also(written, format!("reaches {}", shown_range(value, dim)));
    }
    Some(diagnostic.hint("widen the range; if cutting off is meant, say so with `clamp`"))
}
