//! The page of a study, in one file that needs no network.

use std::fmt::Write as _;
use std::io::Write as _;

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use flate2::{Compression, GzBuilder};
use serde_json::{Value, json};

use super::order;
use super::plan::Plan;
use crate::report::{escape, script_json};

const STYLE: &str = include_str!("study.css");
const SCRIPT: &str = include_str!("study.js");
const ELEMENTS: &str = include_str!("../web_elements.js");
/// What the forms are made with, in this order.
const VENDOR: [&str; 5] = [
    include_str!("vendor/jspsych.min.js"),
    include_str!("vendor/plugin-html-button-response.min.js"),
    include_str!("vendor/plugin-survey-likert.min.js"),
    include_str!("vendor/plugin-survey-multi-choice.min.js"),
    include_str!("vendor/plugin-survey-text.min.js"),
];

/// Nothing is loaded from anywhere, and nothing is sent: the instruments stand in frames of the
/// page, under the same policy.
const POLICY: &str = "default-src 'none'; script-src 'unsafe-inline' 'wasm-unsafe-eval' data:; style-src 'unsafe-inline'; \
     img-src data:; connect-src 'none'; form-action 'none'";

/// What plays in a condition.
#[derive(Debug, Clone)]
pub struct ConditionPage {
    /// The page that plays it ([`crate::playable`]).
    pub html: String,
    /// Ticks a second.
    pub rate_hz: f64,
}

/// The page of a plan; for each condition what plays it.
///
/// # Errors
/// The system cannot compress, in words.
pub fn page(plan: &Plan, playing: &[ConditionPage], command: &str) -> Result<String, String> {
    let mut html = String::new();
    let title = escape(&plan.title);
    let doc = plan.doc.split("\n\n").map(escape);
    let doc: String = doc.map(|text| format!("<p>{text}</p>\n")).collect();
    let _ = write!(
        html,
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
         <meta http-equiv=\"Content-Security-Policy\" content=\"{POLICY}\">\n\
         <title>{title}</title>\n<style>\n{STYLE}</style>\n</head>\n<body>\n<main id=\"study\">\n<h1>{title}</h1>\n{doc}\
         <div class=\"bar\"><label for=\"participant\">Participant number</label>\
         <input id=\"participant\" type=\"number\" min=\"1\" max=\"9999\" value=\"1\">\
         <button type=\"button\" id=\"start\">Start</button><output id=\"wrong\" role=\"alert\"></output></div>\n\
         <noscript><p>A study needs JavaScript and WebAssembly.</p></noscript>\n</main>\n\
         <footer>Made by whippen {} with <code>{}</code></footer>\n",
        env!("CARGO_PKG_VERSION"),
        escape(command)
    );
    let data = script_json(&data(plan, playing));
    let _ = writeln!(
        html,
        "<script type=\"application/json\" id=\"data\">{data}</script>"
    );
    for (number, own) in playing.iter().enumerate() {
        let packed = compressed(own.html.as_bytes()).map_err(|error| error.to_string())?;
        let _ = writeln!(
            html,
            "<script type=\"application/gzip\" id=\"condition{number}\">{}</script>",
            STANDARD.encode(packed)
        );
    }
    for library in VENDOR {
        let _ = writeln!(html, "<script>{library}</script>");
    }
    let _ = write!(
        html,
        "<script>\n\"use strict\";\n(() => {{\n{ELEMENTS}{SCRIPT}}})();\n</script>\n</body>\n</html>\n"
    );
    Ok(html)
}

fn data(plan: &Plan, playing: &[ConditionPage]) -> Value {
    let conditions = plan.conditions.iter().zip(playing).map(|(one, playing)| {
        json!({ "name": one.name, "title": one.title, "knobs": one.knobs, "rate": playing.rate_hz })
    });
    let tasks = plan.tasks.iter().map(|task| {
        let target = task.target.as_ref().map(|target| {
            json!({
                "event": target.event, "argument": target.argument,
                "of": target.of, "repeats": target.repeats,
            })
        });
        json!({ "name": task.name, "text": task.text, "lasts": task.lasts_s, "target": target })
    });
    let items = plan.items.iter();
    let items = items.map(|item| json!({ "name": item.name, "text": item.text }));
    let count = plan.conditions.len();
    let orders = (1..=order::rows(count)).map(|participant| order::order(count, participant));
    json!({
        "plan": {
            "conditions": conditions.collect::<Vec<_>>(),
            "tasks": tasks.collect::<Vec<_>>(),
            "items": items.collect::<Vec<_>>(),
            "points": plan.points, "ends": plan.ends,
            "preferred": plan.preferred, "comment": plan.comment,
        },
        "orders": orders.collect::<Vec<_>>(),
    })
}

/// The same bytes for the same bytes: no name and no time.
fn compressed(bytes: &[u8]) -> std::io::Result<Vec<u8>> {
    let mut packer = GzBuilder::new().write(Vec::new(), Compression::best());
    packer.write_all(bytes)?;
    packer.finish()
}
