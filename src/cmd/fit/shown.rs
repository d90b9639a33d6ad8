//! A fit as text, as JSON, as a picture.

use std::path::Path;

use serde_json::{Map as Object, Value, json};
use whippen_compiler::units::{Dim, shown};
use whippen_runtime::files::FileError;
use whippen_runtime::fit::residuals;
use whippen_runtime::fit::solve::End;
use whippen_runtime::fit::strokes::StrokePair;
use whippen_runtime::plot::{Curve, Map};

use super::Fit;
use super::outcome::{Fitted, Left};

/// Errors of two parameters that go together so much are told.
const CORRELATED: f64 = 0.9;

/// So many points of a column are drawn.
const DRAWN_MAX: usize = 4000;

/// The values that were found, as `--set` takes them, in six digits.
pub fn rounded(fit: &Fit, fitted: &Fitted) -> Vec<(String, String)> {
    let pairs = fit.free.iter().zip(&fitted.at);
    let text = |value: f64, dim: Dim| format!("{}{}", digits(value), dim.unit());
    pairs
        .map(|(free, part)| {
            // Rounding must not leave the range.
            let (low, high) = free.bounds;
            let value = digits(free.at(*part)).parse().unwrap_or(free.value);
            (
                free.name.clone(),
                text(f64::clamp(value, low, high), free.dim),
            )
        })
        .collect()
}

/// Six digits that count.
fn digits(value: f64) -> String {
    let text = format!("{value:.5e}");
    let value: f64 = text.parse().unwrap_or(value);
    format!("{value}")
}

/// The report for people.
pub fn text(fit: &Fit, fitted: &Fitted) -> String {
    let mut out = head(fit, fitted);
    for (number, free) in fit.free.iter().enumerate() {
        out += &parameter(fitted, number, free);
    }
    out += &doubts(fit, fitted);
    out += &left("what is left", &fitted.left);
    if !fitted.held_out.is_empty() {
        out += &left("held out", &fitted.held_out);
    }
    out += &strokes(fitted);
    out
}

/// Strokes like for like.
fn strokes(fitted: &Fitted) -> String {
    let all = || fitted.strokes.iter().flatten();
    let Some(width) = all().map(|(name, _)| name.len()).max() else {
        return String::new();
    };
    let mut out = "  strokes, like for like, in fixed point:\n".to_string();
    for (kind, strokes) in ["", ", held out"].iter().zip(&fitted.strokes) {
        for (name, compared) in strokes {
            out += &format!("    {name:<width$}  {}{kind}\n", stroke(compared));
        }
    }
    if let Some(verdict) = fitted.verdict() {
        out += &format!(
            "  speeds are {:.3} times the measured ones; without that scale the median error of strokes \
             that were not fitted is {:.1} %\n  (of the key's greatest speed times {:.2}: {:.1} %)\n",
            verdict.scale,
            100.0 * verdict.error,
            verdict.key_factor,
            100.0 * verdict.key_error
        );
    }
    out
}

fn stroke(compared: &StrokePair) -> String {
    let (often, copies) = (compared.as_often(), compared.copies.len());
    let measured = &compared.measured;
    if !compared.is_struck() {
        return format!("does not strike, and so do {often} of {copies} copies");
    }
    let late = match compared.late_s() {
        Some(late_s) => format!("{:+.1} ms", 1e3 * late_s),
        None => "never".to_string(),
    };
    let mut ratios: Vec<f64> = compared.ratios().flatten().collect();
    ratios.sort_by(f64::total_cmp);
    let copy = |ratio: Option<&f64>| ratio.map_or(0.0, |ratio| ratio * measured.speed);
    format!(
        "measured {:.3}, computed {:.3}, in copies {:.3} .. {:.3}; strikes as often in {often} of {copies}, {late}, path {:.2e}",
        measured.speed,
        compared.computed.speed,
        copy(ratios.first()),
        copy(ratios.last()),
        compared.path
    )
}

fn head(fit: &Fit, fitted: &Fitted) -> String {
    let rows: usize = fit.parts.iter().map(|part| part.rows.len()).sum();
    let end = match fitted.end {
        End::Converged => "",
        End::Stalled => "; no step was better, which jumps in what is computed may cause",
        End::Interrupted => "; interrupted",
    };
    let plural = |count: usize| if count == 1 { "" } else { "s" };
    let (data, runs) = (fit.data.len(), fitted.runs);
    format!(
        "fitted to {rows} values of {data} recording{}, in {runs} runs{end}\n",
        plural(data)
    )
}

fn parameter(fitted: &Fitted, number: usize, free: &super::Free) -> String {
    let (value, unit) = (free.at(fitted.at[number]), free.dim.unit());
    let width = fitted.judged.half_width.get(number).copied().flatten();
    let known = match width.filter(|part| *part < 1.0) {
        Some(part) => {
            let width = part * free.width();
            // Two digits of the width count, and as many of the value.
            let decimals = (1.0 - width.log10().floor()).clamp(0.0, 12.0) as usize;
            format!("{value:.decimals$} ± {width:.decimals$} {unit}")
        }
        None if fitted.judged.half_width.is_empty() => format!("{} {unit}", digits(value)),
        None => format!("{} {unit}, not shown by the data", digits(value)),
    };
    let bound = match fitted.is_at_bound(number) {
        true => ", at its bound",
        false => "",
    };
    let was = shown(free.value, free.dim);
    format!("  {:<12} {known}{bound} (was {was})\n", free.name)
}

/// What the data do not tell apart, in words.
fn doubts(fit: &Fit, fitted: &Fitted) -> String {
    let name = |p: usize| fit.free[p].name.as_str();
    let mut out = String::new();
    for set in &fitted.judged.flat {
        let names: Vec<&str> = set.iter().map(|p| name(*p)).collect();
        out += &format!(
            "  {} can all change together without a trace\n",
            names.join(", ")
        );
    }
    let rows = fitted.judged.correlation.iter().enumerate();
    let pairs = rows.flat_map(|(p, row)| row.iter().enumerate().map(move |(q, r)| (p, q, *r)));
    for (p, q, r) in pairs.filter(|(p, q, r)| p < q && r.abs() > CORRELATED) {
        let is_flat = |set: &Vec<usize>| set.contains(&p) && set.contains(&q);
        if !fitted.judged.flat.iter().any(is_flat) {
            let (p, q) = (name(p), name(q));
            out += &format!("  {p} and {q} are hard to tell apart: correlation {r:.3}\n");
        }
    }
    out
}

fn left(heading: &str, all: &[Left]) -> String {
    let width = all.iter().map(|left| left.recording.len()).max();
    let mut out = format!("  {heading} (rms):\n");
    for one in all {
        let cell = |value: Option<f64>| match (value, one.unit) {
            (None, _) => "none".to_string(),
            (Some(value), Some(unit)) => format!("{:.4}", value * unit),
            (Some(value), None) => format!("{value:.3}"),
        };
        let part = match (one.unit, one.after) {
            (Some(_), Some(after)) => format!(", {:.2} % of its spread", 100.0 * after),
            _ => ", where 1 is a millisecond or 5 %".to_string(),
        };
        let (before, after) = (cell(one.before), cell(one.after));
        out += &format!(
            "    {:<width$}  {}: {before} -> {after}{part}; in fixed point {}\n",
            one.recording,
            one.title,
            cell(one.fixed_point),
            width = width.unwrap_or(0)
        );
    }
    out
}

/// The same for programs.
pub fn json(fit: &Fit, fitted: &Fitted) -> Value {
    let mut values = Object::new();
    for (number, free) in fit.free.iter().enumerate() {
        let width = fitted.judged.half_width.get(number).copied().flatten();
        values.insert(
            free.name.clone(),
            json!({
                "value": free.at(fitted.at[number]),
                "unit": free.dim.unit(),
                "half_width": width.map(|part| part * free.width()),
                "shown": fitted.is_shown(number),
                "at_bound": fitted.is_at_bound(number),
                "before": free.value,
                "bounds": [free.bounds.0, free.bounds.1],
            }),
        );
    }
    let names = |set: &Vec<usize>| set.iter().map(|p| &fit.free[*p].name).collect::<Vec<_>>();
    let left = |all: &[Left]| all.iter().map(one_left).collect::<Vec<Value>>();
    json!({
        "end": match fitted.end {
            End::Converged => "converged",
            End::Stalled => "stalled",
            End::Interrupted => "interrupted",
        },
        "runs": fitted.runs,
        "values": values,
        "correlation": fitted.judged.correlation,
        "flat": fitted.judged.flat.iter().map(names).collect::<Vec<_>>(),
        "left": left(&fitted.left),
        "held_out": left(&fitted.held_out),
        "strokes": strokes_json(fitted),
    })
}

/// Strokes like for like; null where there are none.
fn strokes_json(fitted: &Fitted) -> Value {
    let one = |(name, c): &(String, StrokePair), is_held_out: bool| {
        json!({
            "recording": name,
            "held_out": is_held_out,
            "measured": c.measured.speed,
            "computed": c.computed.speed,
            "copies": c.copies.iter().map(|copy| copy.speed).collect::<Vec<_>>(),
            "as_often": c.as_often(),
            "late_s": c.late_s(),
            "path": c.path,
            "key_speed": c.key_speed,
        })
    };
    let [own, others] = &fitted.strokes;
    let all = own.iter().map(|c| one(c, false));
    let all: Vec<Value> = all.chain(others.iter().map(|c| one(c, true))).collect();
    if all.is_empty() {
        return Value::Null;
    }
    let verdict = fitted.verdict();
    json!({
        "all": all,
        "scale": verdict.map(|v| v.scale),
        "error": verdict.map(|v| v.error),
        "key_factor": verdict.map(|v| v.key_factor),
        "key_error": verdict.map(|v| v.key_error),
    })
}

fn one_left(left: &Left) -> Value {
    let unit = left.unit.unwrap_or(1.0);
    let si = |value: Option<f64>| value.map(|value| value * unit);
    json!({
        "recording": left.recording,
        "column": left.title,
        "spread": left.unit,
        "before": si(left.before),
        "after": si(left.after),
        "fixed_point": si(left.fixed_point),
    })
}

/// Measured, before and after, of the first column.
pub fn save_picture(fit: &Fit, fitted: &Fitted, path: &Path) -> Result<(), FileError> {
    let none = || FileError::new(path, "there is no column to be drawn");
    let data = &fit.data[0];
    let column = data.columns.first().ok_or_else(none)?;
    let every = column.values.len().div_ceil(DRAWN_MAX).max(1);
    let time = |row: usize| data.start_s + row as f64 / column.rate_hz;
    let curve = |name: &str, values: &[f64]| Curve {
        name: name.to_string(),
        points: (0..values.len())
            .step_by(every)
            .map(|row| (time(row), values[row]))
            .collect(),
        dots: false,
    };
    let computed = |point: &[f64]| {
        let compiled = fit.compiled(point).ok()?;
        let trace = residuals::play(&compiled, &fit.device, fit.args.engine, data).ok()?;
        residuals::at_rows(&trace, column)
    };
    let before = computed(&fitted.start).ok_or_else(none)?;
    let after = computed(&fitted.at).ok_or_else(none)?;
    let all = || column.values.iter().chain(&before).chain(&after).copied();
    let (low, high) = (
        all().fold(f64::INFINITY, f64::min),
        all().fold(f64::NEG_INFINITY, f64::max),
    );
    let margin = 0.05 * (high - low);
    let names: Vec<&str> = fit.free.iter().map(|free| free.name.as_str()).collect();
    let map = Map {
        title: format!("{} fitted to {}", names.join(", "), file_name(&data.name)),
        abscissa: "time (s)".to_string(),
        ordinate: column.title.clone(),
        starts: (time(0), low - margin),
        ends: (time(column.values.len().saturating_sub(1)), high + margin),
        curves: vec![
            curve("before", &before),
            curve("measured", &column.values),
            curve("fitted", &after),
        ],
    };
    map.save(path)
}

/// The last part of a path.
fn file_name(path: &str) -> String {
    let name = Path::new(path).file_name();
    name.map_or(path.to_string(), |name| name.display().to_string())
}
