//! What a page shows of strings in slow motion, as JSON with packed numbers.
//!
//! ```text
//!   { "rate_hz", "start", "strings": [ { name, along, places, every, friction, most, windows: [ { first, u, s, p } ] } ] }
//! ```
//!
//! `u` are displacements, 16 bits each, 32 767 for `most` (m), shape after shape; `s` says of each
//! shape what rubs the string there (0 free, 1 sticks, 2 slips, 3 nothing), `p` where, in 255ths of
//! the string; all in base64. The other side is `report/strings.js`.

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use serde_json::{Value, json};

use crate::rate;
use crate::trace::Trace;
use crate::vibration::{Shapes, Vibration};

/// So many strings are shown, those that move most.
const STRINGS_MAX: usize = 16;
/// What stands for a shape that nothing rubs.
const NOTHING: u8 = 3;

/// The JSON of a trace's strings; none where none moves.
pub fn strings(trace: &Trace) -> Option<Value> {
    let most = |string: &Vibration| string.loudest().map_or(0.0, Shapes::greatest);
    let mut moving: Vec<&Vibration> = trace.vibrations.iter().collect();
    moving.retain(|string| most(string) > 0.0);
    moving.sort_by(|a, b| most(b).total_cmp(&most(a)));
    moving.truncate(STRINGS_MAX);
    // In the order of the program.
    let all = trace.vibrations.iter();
    let shown = all.filter(|string| moving.iter().any(|other| std::ptr::eq(*string, *other)));
    let shown: Vec<Value> = shown.map(|string| packed(string, most(string))).collect();
    (!shown.is_empty())
        .then(|| json!({ "rate_hz": rate::number(trace.rate_hz), "start": trace.start_s, "strings": shown }))
}

fn packed(string: &Vibration, most: f32) -> Value {
    let window = |window: &Shapes| {
        let word = |u: &f32| ((u / most * 32_767.0).round() as i16).to_le_bytes();
        let displacements: Vec<u8> = window.shapes.iter().flatten().flat_map(word).collect();
        let states = window
            .rubbed
            .iter()
            .map(|r| r.map_or(NOTHING, |(state, _)| state as u8));
        let place = |part: f32| (255.0 * part).round().clamp(0.0, 255.0) as u8;
        let places = window
            .rubbed
            .iter()
            .map(|r| r.map_or(0, |(_, part)| place(part)));
        json!({
            "first": window.first,
            "u": STANDARD.encode(displacements),
            "s": STANDARD.encode(states.collect::<Vec<u8>>()),
            "p": STANDARD.encode(places.collect::<Vec<u8>>()),
        })
    };
    json!({
        "name": string.name, "along": string.along_m, "places": string.places, "every": string.every,
        "friction": string.friction, "most": most,
        "windows": string.windows.iter().map(window).collect::<Vec<_>>(),
    })
}
