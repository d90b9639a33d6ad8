//! Tables that are read beyond their knots, where they are held.

use crate::diag::{Code, Diagnostic};
use crate::model::table::Table;
use crate::model::{Interval, Model, Node};
use crate::range::Ranges;
use crate::units::shown_range;
use whippen_source::Span;

/// Beyond the knots by no more than this part of what they span is rounding.
const ROUNDING: f64 = 1e-9;

/// Warns about every place at which a table is read that may lie beyond its knots.
pub fn check(model: &Model, ranges: &Ranges, found: &mut Vec<Diagnostic>) {
    for (id, node) in model.dag.nodes() {
        let Node::Curve(curve, x) = node else {
            continue;
        };
        let span = model.spans.get(id).copied().flatten().unwrap_or_default();
        let warning = curve
            .table()
            .and_then(|table| beyond(table, ranges.get(*x), span));
        found.extend(warning.map(|warning| {
            let calls = model.calls_around(id);
            calls.fold(warning, |warning, call| warning.also(call, "in this call"))
        }));
    }
}

fn beyond(table: &Table, x: Interval, span: Span) -> Option<Diagnostic> {
    let knots = table.span_of_knots();
    let slack = ROUNDING * knots.width();
    let is_beyond = x.low < knots.low - slack || x.high > knots.high + slack;
    is_beyond.then(|| {
        let message = format!(
            "the table `{}` has knots in {}, and it is read in {}",
            table.name,
            shown_range(knots, table.over),
            shown_range(x, table.over)
        );
        let label = "held at the outermost knot";
        Diagnostic::new(Code::BeyondKnots, span, message, label)
            .also(table.span, "declared here")
            .hint("add knots out there, or put a `clamp` around the place where holding is meant")
    })
}
