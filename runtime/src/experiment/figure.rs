//! The trace of all instruments of an experiment, and its figure.

use super::bind::Bound;
use super::columns::{Found, Part};
use crate::plot::{Figure, Machine, Mark, Place, Series};
use crate::trace::{Column, EventRow, Heading, Trace};

impl Part {
    /// One trace of the instruments' traces, with the names of the experiment.
    pub fn joined(parts: &[Part], traces: Vec<Trace>) -> Trace {
        let mut joined = Trace::default();
        for (part, trace) in parts.iter().zip(traces) {
            let column = |column: Column| Column {
                heading: Heading {
                    name: part.called(&column.heading.name),
                    ..column.heading
                },
                record: column.record,
            };
            let event = |event: EventRow| EventRow {
                event: part.called(&event.event),
                ..event
            };
            (joined.rate_hz, joined.start_s) = (trace.rate_hz, trace.start_s);
            joined.columns.extend(trace.columns.into_iter().map(column));
            joined.events.extend(trace.events.into_iter().map(event));
        }
        joined.events.sort_by(|a, b| a.t_s.total_cmp(&b.t_s));
        joined
    }
}

impl Bound<'_> {
    /// What is drawn of a trace.
    pub fn figure<'t>(&self, trace: &'t Trace) -> Figure<'t> {
        let column = |found: &Found| &trace.columns[found.at];
        let series = |found: &Found| {
            let Column { heading, record } = column(found);
            Series {
                name: &heading.name,
                unit: &heading.unit,
                record,
            }
        };
        let machine = |found: &Found| {
            let Column { heading, record } = column(found);
            Machine {
                name: &heading.name,
                states: &heading.labels,
                record,
            }
        };
        let mark = |(label, t_s): (String, Option<f64>)| Some(Mark { t_s: t_s?, label });
        let place = |(label, at): &(String, f64)| Place {
            at: *at,
            label: label.clone(),
        };
        Figure {
            title: self.experiment.title.clone(),
            rate_hz: trace.rate_hz,
            start_s: trace.start_s,
            travel: self.travel.as_ref().map(series),
            forces: self.forces.iter().map(series).collect(),
            total: self.total.as_ref().map(series),
            coordinates: self.lines.iter().map(series).collect(),
            machines: self.states.iter().map(machine).collect(),
            mark_name: "instants".to_string(),
            marks: self.instants(trace).into_iter().filter_map(mark).collect(),
            places: self.places.iter().map(place).collect(),
            ..Figure::default()
        }
    }
}
