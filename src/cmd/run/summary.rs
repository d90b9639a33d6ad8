//! What a run says on the terminal: a few lines, however long it was.

use whippen_compiler::firmware::FAULTS;
use whippen_compiler::pipeline::Compiled;
use whippen_compiler::units::Dim;
use whippen_runtime::emulated::Load;
use whippen_runtime::engine::EngineKind;
use whippen_runtime::session::{self, Counts, LISTED_MAX, Run, Strikes};
use whippen_runtime::titles::split_title;

use crate::say::say;

/// What a run took on the board, and what went wrong there.
pub fn report_load(load: &Load) {
    for (number, core) in load.cores.iter().enumerate() {
        say!(
            "  core {number}: {} keys, longest tick {} of {} cycles, {:.1} % busy, {} missed, faults {}",
            core.keys,
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
    let marked = session::marked(&compiled.model);
    if run.happenings.strikes.count > LISTED_MAX {
        say!("  {}", counted(marked, &run.happenings.strikes));
    } else {
        list(marked, run);
    }
    for (count, what) in run.counts.told() {
        say!("  {count} of {ticks} ticks {what}");
    }
    if let Some(load) = &run.load {
        report_load(load);
        say!(
            "  traced are the drive and what is emitted: a board keeps no values and transitions of a tick"
        );
    }
}

/// Strikes one by one.
fn list(marked: &str, run: &Run) {
    for event in run.trace.events.iter().filter(|e| e.event == marked) {
        let args: Vec<String> = event
            .args
            .iter()
            .map(|(title, value)| format!("{title} {value:.3}"))
            .collect();
        say!("  {:>9.4} s  {marked}  {}", event.t_s, args.join("  "));
    }
}

/// Many strikes in a line.
fn counted(marked: &str, strikes: &Strikes) -> String {
    let (first_s, last_s) = strikes.between_s;
    let count = strikes.count;
    let argument = strikes
        .argument
        .as_ref()
        .map(|(title, [least, greatest, sum])| {
            let (name, unit) = split_title(title);
            let unit = unit.map_or(Dim::NUMBER, |unit| unit.dim).unit();
            let mean = sum / count as f64;
            let unit = if unit.is_empty() {
                unit
            } else {
                format!(" {unit}")
            };
            format!(", {name} {least:.3} .. {greatest:.3}{unit}, {mean:.3} in the mean")
        });
    format!(
        "{count} times {marked} between {first_s:.4} and {last_s:.4} s{}; --events FILE.csv lists them",
        argument.unwrap_or_default()
    )
}
