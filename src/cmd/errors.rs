//! `run --errors`: the engine beside `ideal` on the same motion, value by value.

use std::fmt::Write;

use whippen_compiler::lower::{Export, ExportKind};
use whippen_compiler::pipeline::Compiled;
use whippen_runtime::compare::{Comparison, Deviation};
use whippen_runtime::session;

/// A declared range so many times wider than what was seen is worth a word.
const WIDE: f64 = 8.0;

/// The report of one run.
pub fn report(compiled: &Compiled, comparison: &Comparison) -> String {
    let mut out = String::from("against `ideal`, both running free:\n");
    let _ = writeln!(
        out,
        "  {:<24} {:<11} {:<9} {:>10} {:>10} {:>9}",
        "value", "unit", "format", "max", "rms", "SNR"
    );
    for deviation in &comparison.deviations {
        row(&mut out, compiled, deviation);
    }
    events(&mut out, compiled, comparison);
    for deviation in &comparison.deviations {
        wide(
            &mut out,
            &compiled.lowered.exports[deviation.export],
            deviation,
        );
    }
    out
}

fn row(out: &mut String, compiled: &Compiled, d: &Deviation) {
    let export = &compiled.lowered.exports[d.export];
    let unit = session::unit(&compiled.model, export);
    let snr = if d.rms == 0.0 {
        "exact".to_string()
    } else {
        format!("{:.0} dB", d.snr_db())
    };
    let (name, format) = (&export.name, export.format());
    let _ = writeln!(
        out,
        "  {name:<24} {unit:<11} {format:<9} {:>10.1e} {:>10.1e} {snr:>9}",
        d.max, d.rms
    );
}

fn events(out: &mut String, compiled: &Compiled, comparison: &Comparison) {
    let rate_hz = f64::from(compiled.model.rate_hz);
    let (together, apart) = (comparison.events_together, comparison.events_apart);
    let args = comparison.args_relative_max;
    let _ = writeln!(
        out,
        "  {together} events in the same ticks, arguments within {:.1e} %",
        args * 100.0
    );
    let _ = writeln!(
        out,
        "  {apart} events in one engine only, or in another tick",
    );
    for (tick, name) in &comparison.first_apart {
        let _ = writeln!(out, "    {:>10.5} s  {name}", *tick as f64 / rate_hz);
    }
}

/// Says where a declared range is much wider than needed: every halving gives its value a bit.
fn wide(out: &mut String, export: &Export, d: &Deviation) {
    let declared = matches!(export.kind, ExportKind::Cell(_));
    let seen = d.seen.0.abs().max(d.seen.1.abs());
    if declared && seen > 0.0 && export.range.magnitude() > WIDE * seen {
        let times = export.range.magnitude() / seen;
        let _ = writeln!(
            out,
            "  `{}` stays {times:.0} times below the range declared for it",
            export.name
        );
    }
}
