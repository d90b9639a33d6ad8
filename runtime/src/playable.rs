//! A page that plays: an instrument as WebAssembly, a hand that closes the loop, and what one sees
//! and hears of it, in one file that needs no network.
//!
//! ```text
//!   Compiled --web::module--> module --base64--> page.html: module, player (audio thread), page (pointer, MIDI, knobs, pictures)
//! ```
//!
//! One tick is one sample of the audio thread. A hand of mass, damping and stiffness leads a key to
//! where the pointer is, and the program's force acts against it, as in `whippen run --hand` but
//! for converters, coil and heat, which the page leaves out. What nothing drives follows the
//! pointer.
//!
//! Not here: pages that report a run (`report`).

use std::fmt::Write;
use std::path::Path;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use serde_json::{Value, json};
use whippen_compiler::model::{Moves, Sense};
use whippen_compiler::pipeline::Compiled;
use whippen_compiler::units::unit_suffix;
use whippen_compiler::wasm::WasmError;

use crate::device::{Device, Mechanics, Port};
use crate::files::{FileError, write_whole};
use crate::gesture::DIP_M;
use crate::report::{escape, script_json};
use crate::session::marked;
use crate::titles::join_title;
use crate::web;

mod window;

const STYLE: &str = include_str!("playable/page.css");
const PLAYER: &str = concat!(
    include_str!("playable/moving.js"),
    include_str!("playable/log.js"),
    include_str!("playable/player.js")
);
const WORKLET: &str = include_str!("playable/worklet.js");
/// What the page's script uses; the studio's too.
const ELEMENTS: &str = include_str!("web_elements.js");
const SCRIPT: &str = include_str!("playable/page.js");
const WINDOW: &str = include_str!("playable/window.js");

/// Nothing is loaded from anywhere; the audio thread's script is a part of the page, and what it
/// saves is its own.
const POLICY: &str = "default-src 'none'; script-src 'unsafe-inline' 'wasm-unsafe-eval' data:; style-src 'unsafe-inline'; img-src data:";

/// A page that plays.
#[derive(Debug, Clone, PartialEq)]
pub struct PlayablePage {
    /// The page.
    pub html: String,
    /// Bytes of its module.
    pub module_bytes: usize,
}

/// Makes the page of so many keys, the lowest of which has this MIDI number; `command` made it.
///
/// # Errors
/// There is no module of so many keys.
pub fn page(
    compiled: &Compiled,
    device: &Device,
    (keys, first_note): (usize, u8),
    command: &str,
) -> Result<PlayablePage, WasmError> {
    let module = web::module(compiled, device, keys)?;
    let title = compiled.model.name.replace('_', " ");
    let mut html = String::with_capacity(2 * module.bytes.len());
    let _ = write!(
        html,
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
         <meta http-equiv=\"Content-Security-Policy\" content=\"{POLICY}\">\n\
         <title>{0}</title>\n<style>\n{STYLE}</style>\n</head>\n<body>\n<main>\n<h1>{0}</h1>\n{1}",
        escape(&title),
        body(compiled, keys)
    );
    let _ = write!(
        html,
        "</main>\n<footer>Made by whippen {} with <code>{}</code></footer>\n",
        env!("CARGO_PKG_VERSION"),
        escape(command)
    );
    let data = script_json(&data(compiled, device, first_note));
    let module_text = STANDARD.encode(&module.bytes);
    let _ = write!(
        html,
        "<script type=\"application/json\" id=\"data\">{data}</script>\n\
         <script type=\"application/wasm\" id=\"module\">{module_text}</script>\n\
         <script type=\"text/plain\" id=\"player\">{PLAYER}</script>\n\
         <script type=\"text/plain\" id=\"worklet\">{WORKLET}</script>\n\
         <script>\n\"use strict\";\n(() => {{\n{PLAYER}{ELEMENTS}{WINDOW}{SCRIPT}}})();\n</script>\n</body>\n</html>\n"
    );
    Ok(PlayablePage {
        html,
        module_bytes: module.bytes.len(),
    })
}

impl PlayablePage {
    /// Writes it to a file.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn save(&self, path: &Path) -> Result<(), FileError> {
        write_whole(path, |w| w.write_all(self.html.as_bytes()))
    }
}

/// The view from the front.
const FRONT: &str = "<h2>From the front</h2><canvas id=\"front\" role=\"img\" aria-label=\"Strings and bow from the front: the pointer moves the bow across and up\"></canvas>\n";

/// What stands in the page before a script runs.
fn body(compiled: &Compiled, keys: usize) -> String {
    let (how, label) = match (compiled.model.is_of_key(), keys) {
        (true, 1) => (
            "Press the key with mouse, pen or finger: the lower you hold it, the deeper it goes.",
            "The key: arrow down presses it, arrow up lets it rise",
        ),
        (true, _) => (
            "Press keys with mouse, pen or finger, the lower the deeper; strike them with the letters A to P (harder with shift) or by MIDI.",
            "Keys: arrows left and right choose one, down presses it, up lets it rise",
        ),
        _ if window::touch(compiled) => (
            "Hold the pointer down to touch and move it to play; the wheel presses harder or lighter, the sliders move what is left.",
            "The instrument: arrows move the tool, space puts it down or lifts it, page down presses harder, page up lighter",
        ),
        _ => (
            "Move the pointer over the field; the wheel and the sliders move what it does not.",
            "The field: arrows move the first two ports",
        ),
    };
    let (window, front) = match window::has(compiled) {
        [true, has_front] => (" class=\"window\"", if has_front { FRONT } else { "" }),
        _ => ("", ""),
    };
    format!(
        "<p>{how}</p>\n\
         <div class=\"bar\"><button type=\"button\" id=\"begin\">Begin</button>\
         <button type=\"button\" id=\"midi\">MIDI</button>\
         <button type=\"button\" id=\"record\" aria-pressed=\"false\">Record</button>\
         <output id=\"status\" role=\"status\">Not playing yet</output></div>\n\
         <canvas id=\"pad\"{window} tabindex=\"0\" role=\"application\" aria-label=\"{label}\"></canvas>\n\
         <div class=\"bar\"><output id=\"key\"></output><output id=\"tool\"></output><output id=\"force\"></output>\
         <output id=\"strikes\"></output><output id=\"ticks\"></output></div>\n\
         {front}<div id=\"ports\"></div>\n<div id=\"lives\"></div>\n\
         <details><summary>The hand</summary><div id=\"hand\"></div></details>\n\
         <div class=\"pair\"><section><h2>Force over position</h2>\
         <canvas id=\"loop\" role=\"img\" aria-label=\"Force over position, the last second and a half\"></canvas></section>\n\
         <section><h2>Events</h2><ol id=\"events\" aria-live=\"off\"></ol></section></div>\n\
         <details id=\"sound\" open><summary>Spectrum of what is heard</summary>\
         <canvas id=\"spectrum\" role=\"img\" aria-label=\"Level in dB over frequency\"></canvas>\
         <output id=\"loudest\"></output></details>\n\
         <noscript><p>Playing needs JavaScript and WebAssembly.</p></noscript>\n"
    )
}

/// What the scripts must know beside the module's own text.
fn data(compiled: &Compiled, device: &Device, first_note: u8) -> Value {
    let model = &compiled.model;
    let drives = model.drives();
    let ports = device.ports_of(model);
    let of_port = |(at, port): (usize, &&Port)| {
        let drive = drives.iter().position(|driven| *driven == at);
        let mechanics = drive.and(port.mechanics.as_ref()).map(mechanics);
        let per_tick = port
            .sensor
            .update_hz
            .map(|hz| hz / f64::from(model.rate_hz));
        json!({
            "low": port.sensor.low, "high": port.sensor.high, "bits": port.sensor.bits, "drive": drive,
            "step": port.sensor.step, "updates": per_tick.filter(|updates| *updates < 1.0).unwrap_or(1.0),
            "fullScale": port.drive().full_scale, "mechanics": mechanics, "start": start(model.is_of_key(), port),
        })
    };
    // What is played once is led as far as the instrument senses, maybe less than its device.
    let reach = |(sense, port): (&Sense, &&Port)| {
        let [low, high] = reach(model.is_of_key(), port);
        let inside = match model.is_of_key() {
            true => [low, high],
            false => [low.max(sense.range.low), high.min(sense.range.high)],
        };
        json!({ "low": inside[0], "high": inside[1] })
    };
    let titles = model.senses.iter().map(|sense| match sense.moves {
        Moves::Turns => join_title(&sense.name, "rad"),
        _ => join_title(&sense.name, &unit_suffix(&sense.dim.unit_without_angle())),
    });
    json!({
        "ofKey": model.is_of_key(),
        "window": window::window(compiled),
        "firstNote": first_note,
        "mark": marked(model),
        "hand": hand(model.turns()),
        "ports": ports.iter().enumerate().map(of_port).collect::<Vec<_>>(),
        "reach": model.senses.iter().zip(&ports).map(reach).collect::<Vec<_>>(),
        "titles": titles.collect::<Vec<_>>(),
    })
}

/// How a port moves by itself, as the player has it.
fn mechanics(of: &Mechanics) -> Value {
    let stops = of.stops.map(|stops| {
        json!({
            "low": stops.low, "high": stops.high,
            "stiffness": stops.stiffness, "damping": stops.damping,
        })
    });
    json!({ "mass": of.mass, "damping": of.damping, "friction": of.friction, "stops": stops })
}

/// The hand that one begins with: values, the greatest that sliders have, units.
fn hand(turns: bool) -> Value {
    match turns {
        // Two fingers on a knob.
        true => json!([
            ["mass", 2e-5, 2e-4, "kg*m^2"],
            ["damping", 1e-3, 0.02, "N*m*s/rad"],
            ["stiffness", 0.3, 3.0, "N*m/rad"],
        ]),
        false => json!([
            ["mass", 0.2, 1.0, "kg"],
            ["damping", 3.0, 20.0, "N*s/m"],
            ["stiffness", 500.0, 3000.0, "N/m"],
        ]),
    }
}

/// From where to where a hand leads a port: a key from rest to its dip, others as far as is sensed.
fn reach(is_of_key: bool, port: &Port) -> [f64; 2] {
    let [low, high] = [port.sensor.low, port.sensor.high];
    if is_of_key && !port.turns() {
        [0.0, DIP_M.min(high)]
    } else {
        [low, high]
    }
}

/// Where a port begins.
fn start(is_of_key: bool, port: &Port) -> f64 {
    let [low, high] = reach(is_of_key, port);
    if is_of_key {
        0.0_f64.clamp(low, high)
    } else {
        0.5 * (low + high)
    }
}
