//! A status in words and as JSON.

use std::fmt::Write;

use serde_json::{Value, json};
use whippen_runtime::monitor::{CoreStatus, Status};

use super::Lives;
use super::board::KnownBoard;
use crate::say::say;

/// Keys that are listed one by one.
const LISTED: usize = 8;
/// A gain of 1.
const WHOLE: f64 = 65_536.0;

/// What is told at once.
pub struct Look {
    /// What the board says.
    pub status: Status,
    /// Answers that the line lost until then; none where nothing is asked twice.
    pub lost_answers: Option<u32>,
}

/// A few lines.
pub fn text(look: &Look, known: Option<&(&KnownBoard, Lives)>) -> String {
    let status = &look.status;
    let mut text = String::new();
    if let Some((known, _)) = known {
        let _ = writeln!(text, "{}", known.told());
    }
    for (number, core) in status.cores.iter().enumerate() {
        let program = known.and_then(|(known, _)| known.program_name(core.program?));
        let plays = program.map_or(String::new(), |name| format!(", plays {name}"));
        let _ = writeln!(
            text,
            "core {number}: keys {} to {}{plays}; {} ticks, {} missed",
            core.first_key,
            core.first_key + core.keys - 1,
            core.ticks,
            core.missed
        );
    }
    let _ = writeln!(text, "{}", told_gains(status));
    for fault in status.told_faults() {
        let _ = writeln!(text, "fault: {fault}");
    }
    for core in status.cores.iter().filter_map(|core| core.faulty_key) {
        let _ = writeln!(text, "the key of a fault: {core}");
    }
    for (name, value) in known.map_or(&[][..], |(_, lives)| lives) {
        let _ = writeln!(text, "{name} = {value}");
    }
    if let Some(lost) = look.lost_answers.and_then(told_lost) {
        let _ = writeln!(text, "{lost}");
    }
    text
}

/// One line.
pub fn line(look: &Look) -> String {
    let status = &look.status;
    let ticks = status.cores.iter().map(|core| core.ticks.to_string());
    let faults = match status.told_faults().len() {
        0 => "no faults".to_string(),
        count => format!("{count} kinds of faults"),
    };
    let ticks: Vec<String> = ticks.collect();
    let ticks = ticks.join(" and ");
    let lost = look.lost_answers.and_then(told_lost);
    format!(
        "{ticks} ticks, {} missed, {faults}; {}{}",
        status.missed(),
        told_gains(status),
        lost.map_or(String::new(), |lost| format!("; {lost}"))
    )
}

/// That the line loses answers, where it does.
fn told_lost(answers: u32) -> Option<String> {
    match answers {
        0 => None,
        1 => Some("the line lost 1 answer, which was asked for again".to_string()),
        more => Some(format!(
            "the line lost {more} answers, which were asked for again"
        )),
    }
}

fn told_gains(status: &Status) -> String {
    if status.cores.iter().any(|core| core.ramp_ticks > 0) {
        return "force comes up".to_string();
    }
    let held = status.held_back();
    if held.is_empty() {
        return "all gains are 1".to_string();
    }
    let one = |(key, gain): &(u32, u32)| format!("key {key}: {:.3}", f64::from(*gain) / WHOLE);
    let shown: Vec<String> = held.iter().take(LISTED).map(one).collect();
    let more = match held.len().saturating_sub(LISTED) {
        0 => String::new(),
        more => format!(" and {more} more"),
    };
    format!("gains below 1: {}{more}", shown.join(", "))
}

/// One object.
pub fn json(look: &Look, known: Option<&(&KnownBoard, Lives)>) -> Value {
    let status = &look.status;
    let core = |core: &CoreStatus| {
        json!({
            "ticks": core.ticks,
            "missed": core.missed,
            "faults": core.faults,
            "faulty_key": core.faulty_key,
            "first_key": core.first_key,
            "keys": core.keys,
            "program": known.and_then(|(known, _)| known.program_name(core.program?)),
            "ramp_ticks": core.ramp_ticks,
            "gains": core.gains.iter().map(|gain| f64::from(*gain) / WHOLE).collect::<Vec<_>>(),
        })
    };
    let lives = known.map_or(&[][..], |(_, lives)| lives);
    let lives = lives
        .iter()
        .map(|(name, value)| (name.clone(), json!(value)));
    json!({
        "kind": "status",
        "missed": status.missed(),
        "lost_answers": look.lost_answers,
        "faults": status.told_faults(),
        "cores": status.cores.iter().map(core).collect::<Vec<_>>(),
        "live": lives.collect::<serde_json::Map<_, _>>(),
    })
}

/// That a knob has found its motor anew.
pub fn aligned(as_json: bool) {
    match as_json {
        true => say!("{}", json!({"kind": "aligned"})),
        false => say!("the motor was found anew, and the board plays"),
    }
}

/// What the line lost while something else than a status was asked for.
pub fn lost(answers: u32, as_json: bool) {
    match told_lost(answers) {
        _ if as_json => say!("{}", json!({"kind": "line", "lost_answers": answers})),
        Some(lost) => say!("{lost}"),
        None => {}
    }
}

/// What a key remembers.
pub fn cell(name: &str, (value, unit): &(f64, String), as_json: bool) {
    match as_json {
        true => say!(
            "{}",
            json!({"kind": "cell", "name": name, "value": value, "unit": unit})
        ),
        false => say!("{name} = {value} {unit}"),
    }
}
