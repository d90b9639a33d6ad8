//! What a run says on the terminal: a few lines, however long it was.

use std::path::PathBuf;

use serde_json::{Map, Value, json};
use whippen_compiler::firmware::FAULTS;
use whippen_compiler::pipeline::Compiled;
use whippen_compiler::units::Dim;
use whippen_runtime::emulated::Load;
use whippen_runtime::engine::EngineKind;
use whippen_runtime::session::{self, Counts, Emitted, LISTED_MAX, Run};
use whippen_runtime::sticking::{FrictionTally, Tally};
use whippen_runtime::titles::split_title;
use whippen_runtime::trace::EventRow;

use super::{Outputs, beside};
use crate::cmd::count::count_keys;
use crate::say::say;

/// What a run took on the board, and what went wrong there.
pub fn report_load(load: &Load, is_once: bool) {
    for (number, core) in load.cores.iter().enumerate() {
        say!(
            "  core {number}: {}, longest tick {} of {} cycles, {:.1} % busy, {} missed, faults {}",
            count_keys(core.keys, is_once),
            core.frame_cycles_max,
            load.period_cycles,
            100.0 * core.utilisation(load),
            core.missed,
            core.faults
        );
        for fault in FAULTS.iter().filter(|fault| core.faults & fault.bit != 0) {
            say!("    fault {}: {}", fault.bit, fault.what);
        }
    }
}

/// What happened, in a few lines.
pub fn report_run(compiled: &Compiled, run: &Run, kind: EngineKind, notes: &[String]) {
    notes.iter().for_each(|note| say!("motion: {note}"));
    let Counts {
        ticks, engine_time, ..
    } = run.counts;
    let played_s = ticks as f64 / f64::from(compiled.model.rate_hz);
    say!(
        "{}: {played_s:.2} s on engine {kind}, {:.0}x real time",
        compiled.model.name,
        played_s / engine_time.as_secs_f64()
    );
    list(&run.happenings.emitted);
    run.frictions.iter().for_each(|friction| {
        if let Some(line) = rubbed(friction, f64::from(compiled.model.rate_hz)) {
            say!("  {line}");
        }
    });
    for (count, what) in run.counts.told(session::driven(&compiled.model)) {
        say!("  {count} of {ticks} ticks {what}");
    }
    if run.happenings.clipped_samples > 0 {
        let clipped = run.happenings.clipped_samples;
        say!("  {clipped} samples of the sound clipped at full scale");
    }
    if let Some(load) = &run.load {
        report_load(load, !compiled.model.is_of_key());
        say!(
            "  traced are the drive and what is emitted: a board keeps no values and transitions of a tick"
        );
    }
}

/// What a friction did, in a line; nothing where it never rubbed.
fn rubbed(friction: &FrictionTally, rate_hz: f64) -> Option<String> {
    let said = |tally: &Tally| {
        let share = 100.0 * tally.stick_share()?;
        let slips = match tally.slips_per_period() {
            Some(slips) => format!("{slips:.2} slips a period"),
            None => format!("{} slips", tally.slips),
        };
        Some(format!("sticks {share:.0} % of the time, {slips}"))
    };
    let whole = said(&friction.whole)?;
    let settled = said(&friction.second_half);
    let settled = settled.map_or(String::new(), |said| {
        format!("; in the second half it {said}")
    });
    let seconds = friction.whole.rubbed as f64 / rate_hz;
    Some(format!(
        "friction {}: {seconds:.2} s, {whole}{settled}",
        friction.name
    ))
}

/// A friction as an object.
fn friction_json(friction: &FrictionTally, rate_hz: f64) -> Value {
    let tally = |tally: &Tally| {
        json!({
            "rubbed_s": tally.rubbed as f64 / rate_hz,
            "stick_share": tally.stick_share(),
            "slips": tally.slips,
            "slips_per_period": tally.slips_per_period(),
        })
    };
    json!({
        "friction": friction.name,
        "whole": tally(&friction.whole),
        "second_half": tally(&friction.second_half),
    })
}

/// The same as one object, with what was set and where the files are.
pub fn json(
    compiled: &Compiled,
    run: &Run,
    kind: EngineKind,
    settings: &[(String, String)],
    outputs: &Outputs,
) -> Value {
    let (model, counts) = (&compiled.model, run.counts);
    let emitted = run.happenings.emitted.iter().map(|kind| {
        let (first_s, last_s) = kind.between_s;
        let mut object = json!({
            "event": kind.event, "count": kind.count, "first_s": first_s, "last_s": last_s,
        });
        if let Some((title, [least, greatest, sum])) = &kind.argument {
            object[format!("{title}_least")] = json!(least);
            object[format!("{title}_greatest")] = json!(greatest);
            object[format!("{title}_mean")] = json!(sum / kind.count as f64);
        }
        object
    });
    let rate_hz = f64::from(model.rate_hz);
    let frictions = run.frictions.iter();
    let frictions = frictions.map(|friction| friction_json(friction, rate_hz));
    let set: Map<String, Value> = (settings.iter())
        .map(|(name, value)| (name.clone(), json!(value)))
        .collect();
    let mut object = json!({
        "kind": "run",
        "instrument": model.name,
        "engine": kind.to_string(),
        "seconds": counts.ticks as f64 / f64::from(model.rate_hz),
        "set": set,
        "strikes": run.happenings.strikes,
        "events": run.happenings.events,
        "counts": {
            "ticks": counts.ticks,
            "sensor_clipped": counts.sensor_clipped,
            "sense_clamped": counts.sense_clamped,
            "slew_held": counts.slew_held,
            "drive_clipped": counts.drive_clipped,
            "samples_clipped": run.happenings.clipped_samples,
        },
        "emitted": emitted.collect::<Vec<_>>(),
        "frictions": frictions.collect::<Vec<_>>(),
        "files": {
            "out": paths(&outputs.out),
            "events": paths(outputs.events.as_slice()),
            "plot": paths(&outputs.plot),
            "report": paths(outputs.report.as_slice()),
        },
    });
    if let Some(beside) = &run.beside {
        object["compared"] = beside::json(beside);
    }
    object
}

fn paths(paths: &[PathBuf]) -> Vec<String> {
    paths
        .iter()
        .map(|path| path.display().to_string())
        .collect()
}

/// What was emitted: one by one, as long as its kind is not too many.
fn list(emitted: &[Emitted]) {
    let (few, many): (Vec<&Emitted>, Vec<&Emitted>) =
        emitted.iter().partition(|kind| kind.count <= LISTED_MAX);
    let mut listed: Vec<&EventRow> = few.iter().flat_map(|kind| &kind.first).collect();
    listed.sort_by(|a, b| a.t_s.total_cmp(&b.t_s));
    for event in listed {
        let args = event.args.iter();
        let args: String = args.map(|(title, v)| format!("  {title} {v:.3}")).collect();
        say!("  {:>9.4} s  {}{args}", event.t_s, event.event);
    }
    many.iter().for_each(|kind| say!("  {}", counted(kind)));
    let begun = emitted
        .iter()
        .find(|kind| kind.first.iter().any(|event| event.t_s == 0.0));
    if let Some(kind) = begun {
        say!(
            "  {} in the very first tick: does the first state of a machine fit where the motion begins?",
            kind.event
        );
    }
}

/// Many events of a kind in a line.
fn counted(kind: &Emitted) -> String {
    let (first_s, last_s) = kind.between_s;
    let count = kind.count;
    let argument = kind
        .argument
        .as_ref()
        .map(|(title, [least, greatest, sum])| {
            let (name, unit) = split_title(title);
            let unit = unit.map_or(Dim::NUMBER, |unit| unit.dim);
            let unit = unit.unit_without_angle();
            let mean = sum / count as f64;
            let unit = if unit.is_empty() {
                unit
            } else {
                format!(" {unit}")
            };
            format!(", {name} {least:.3} .. {greatest:.3}{unit}, {mean:.3} in the mean")
        });
    format!(
        "{count} times {} between {first_s:.4} and {last_s:.4} s{}; --events FILE.csv lists them",
        kind.event,
        argument.unwrap_or_default()
    )
}
