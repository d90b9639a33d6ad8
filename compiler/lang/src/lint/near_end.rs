//! Places on strings that are nearer to an end than their points tell.

use crate::diag::{Code, Diagnostic};
use crate::model::{Model, Node, NodeId, Reading, Strand};
use crate::range::Ranges;
use crate::units::{Dim, shown};
use whippen_source::Span;

/// Warns about what is read and pushed too near to an end.
pub fn check(model: &Model, ranges: &Ranges, found: &mut Vec<Diagnostic>) {
    for strand in &model.strands {
        let rub = strand.friction.as_ref().map(|rub| &rub.push);
        for push in strand.pushes.iter().chain(rub) {
            found.extend(near(strand, ranges, push.place, push.span));
        }
    }
    for (id, node) in model.dag.nodes() {
        let Node::Read(strand, reading, place) = *node else {
            continue;
        };
        let strand = &model.strands[strand];
        let is_at_end = model
            .dag
            .real(place)
            .is_some_and(|p| strand.is_end(p).is_some());
        if is_at_end && reading == Reading::Slope {
            continue;
        }
        let span = model.spans.get(id).copied().flatten().unwrap_or_default();
        found.extend(near(strand, ranges, place, span).map(|warning| {
            let calls = model.calls_around(id);
            calls.fold(warning, |warning, call| warning.also(call, "in this call"))
        }));
    }
}

fn near(strand: &Strand, ranges: &Ranges, place: NodeId, span: Span) -> Option<Diagnostic> {
    let margin = f64::from(Strand::NEAREST) * strand.part();
    let (low, high) = (margin, strand.length() - margin);
    let (places, slack) = (ranges.get(place), 1e-9 * strand.length());
    let is_near = places.low < low - slack || places.high > high + slack;
    is_near.then(|| {
        let [low, high] =
            [low, high].map(|place| shown(place + strand.along.low, Dim::LENGTH));
        let message = format!(
            "the string `{}` is read and pushed from {low} to {high}, and this place may be nearer to an end",
            strand.name
        );
        let label = "held to two parts from the end";
        Diagnostic::new(Code::NearEnd, span, message, label)
            .also(strand.span, format!("{} points", strand.parts.saturating_sub(1)))
            .hint("keep away from the ends, or put a `clamp` around the place")
    })
}
