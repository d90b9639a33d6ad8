//! Diagnostics and reports as JSON lines: one object per line, each with a `kind`.

use serde_json::{Value, json};
use whippen_compiler::diag::{Diagnostic, Severity};
use whippen_compiler::lower::OverTime;
use whippen_compiler::model::Sense;
use whippen_compiler::pipeline::Compiled;
use whippen_compiler::source::{SourceMap, Span};
use whippen_runtime::device::Device;
use whippen_runtime::rate;
use whippen_runtime::{resting, session};

use super::numbers;

/// A diagnostic: code, severity, texts, places, and changes of the text that editors can apply.
pub fn diagnostic(map: &SourceMap, d: &Diagnostic) -> Value {
    let severity = match d.severity() {
        Severity::Error => "error",
        Severity::Warning => "warning",
        Severity::Note => "note",
    };
    let with = |span: Span, key: &str, text: &str| {
        let mut object = place(map, span);
        object[key] = json!(text);
        object
    };
    json!({
        "kind": "diagnostic",
        "code": d.code.number(),
        "name": d.code.name(),
        "severity": severity,
        "title": d.code.title(),
        "message": d.message,
        "place": with(d.span, "text", &d.label),
        "labels": d.others.iter().map(|l| with(l.span, "text", &l.text)).collect::<Vec<_>>(),
        "notes": d.hints,
        "suggestions": d.suggestions.iter().map(|s| with(s.span, "replacement", &s.replacement)).collect::<Vec<_>>(),
    })
}

/// File, bytes from 0 (the end is one past the last), lines and columns from 1 (columns in
/// characters).
fn place(map: &SourceMap, span: Span) -> Value {
    let file = map
        .files()
        .get(span.file as usize)
        .map_or("", |f| f.name.as_str());
    let end = Span {
        start: span.end,
        ..span
    };
    let at = |span: Span| {
        let (line, column) = map.line_column(span);
        json!({ "byte": span.start, "line": line, "column": column })
    };
    json!({ "file": file, "start": at(span), "end": at(end) })
}

/// What an update rounds at a time; and what that comes to: a bound for ever, or what is added in a
/// second, where there is none.
fn kept(row: &numbers::Kept) -> Value {
    let (over_time, bound, per_second) = match row.over_time {
        OverTime::Exact => ("exact", Some(0.0), None),
        OverTime::Bounded(most) => ("bounded", Some(most), None),
        OverTime::Grows(per_second) => ("grows", None, Some(per_second)),
        OverTime::BehindFriction => ("behind a friction", None, None),
        OverTime::FedBack(per_second) => ("fed back", None, Some(per_second)),
    };
    json!({
        "name": row.name, "unit": row.unit, "rounding": row.error,
        "over_time": over_time, "bound": bound, "per_second": per_second,
    })
}

/// What `check --numbers` prints as a table.
pub fn numbers(compiled: &Compiled, device: &Device) -> Value {
    let values = compiled.lowered.exports.iter().filter(|e| e.dim.is_some()).map(|e| {
        json!({
            "name": e.name, "unit": session::unit(&compiled.model, e), "low": e.range.low, "high": e.range.high,
            "format": e.format(), "lsb": e.lsb, "error_of_one_tick": e.error,
        })
    });
    let sense = |s: &Sense| json!({ "name": s.name, "window_ticks": s.window, "lag_ticks": (s.window - 1) / 2 });
    let noise = resting::noise(compiled, device).ok().flatten().map(|noise| {
        json!({
            "sensor_rms": noise.sensor_rms, "stated": noise.is_stated, "force_rms": noise.force_rms,
            "terms": noise.terms.iter().map(|(name, rms)| json!({ "name": name, "rms": rms })).collect::<Vec<_>>(),
        })
    });
    json!({
        "kind": "numbers",
        "instrument": compiled.model.name,
        "rate_hz": rate::number(compiled.model.rate_hz),
        "values": values.collect::<Vec<_>>(),
        "kept": numbers::kept(compiled).iter().map(kept).collect::<Vec<_>>(),
        "clamps": compiled.lowered.clamps,
        "noise_at_rest": noise,
        "senses": compiled.model.senses.iter().map(sense).collect::<Vec<_>>(),
    })
}
