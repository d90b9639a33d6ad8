//! Every instrument as a WebAssembly module does under node what it does in the interpreter, and
//! its text tells what the words mean.

use std::process::Command;

use serde_json::Value;
use whippen_runtime::device::Device;

use crate::cases::Cases;
use crate::cli::{Shell, bundled};
use crate::common;

/// Ticks of each instrument.
const TICKS: usize = 4000;

#[test]
fn every_instrument_has_the_memory_of_the_interpreter() {
    let mut cases = Cases::default();
    for compiled in common::all_and_programs() {
        let kernel = &compiled.lowered.kernel;
        let device = Device::of(&compiled.model);
        let ports = device.ports_of(&compiled.model);
        let gestures = common::gestures_of(&compiled);
        let row = |tick: usize| -> Vec<u16> {
            let words = gestures.iter().zip(&ports);
            // Faster than it is told, so that all of it is played.
            words
                .map(|(places, port)| port.word(places[7 * tick % places.len()]).0)
                .collect()
        };
        cases.add(compiled.model.name.clone(), kernel, 1, |case| {
            case.run(false, &row(0));
            for tick in 0..TICKS {
                case.run(true, &row(tick));
                case.drain();
            }
        });
        // Few at a time: what is expected is kept until node has judged.
        cases.judge();
        cases = Cases::default();
    }
}

/// Strikes a key of a module from its text alone, as a page would.
const STRIKE: &str = r#"
import { readFileSync } from "node:fs";
const module = new WebAssembly.Module(readFileSync(process.argv[2]));
const map = JSON.parse(new TextDecoder().decode(WebAssembly.Module.customSections(module, "whippen")[0]));
const { memory, init, tick } = new WebAssembly.Instance(module).exports;
const view = new DataView(memory.buffer);
const { senses: [sense], drives: [drive], events } = map.meaning;
const word = (value) => Math.round(((value - sense.low) / (sense.high - sense.low)) * 65535);
const put = (x) => view.setUint16(map.inputs + 2 * 40, word(x), true);
for (let key = 0; key < map.keys; key++) view.setUint16(map.inputs + 2 * key, word(0), true);
init();
let most = 0;
for (let n = 0; n < 2000; n++) {
  put(Math.min(0.01, (n / 1000) * 0.01));
  tick();
  most = Math.max(most, (view.getInt16(map.outputs + 2 * 40, true) / 32768) * drive.full_scale);
}
const strikes = [];
for (let n = 0; n < view.getUint32(map.clock + 8, true); n++) {
  const at = map.events + 4 * map.event_words * n;
  const event = events[view.getUint32(at + 12, true)];
  const arg = view.getInt32(at + 4 * map.event_head, true) * event.lsbs[0];
  strikes.push([view.getUint32(at, true), view.getUint32(at + 8, true), event.name, event.args[0], arg]);
}
console.log(JSON.stringify({ keys: map.keys, most, strikes: strikes.filter(([, , name]) => name === "note") }));
"#;

#[test]
fn a_page_can_strike_a_key_from_what_a_module_tells() {
    let Some(node) = whippen_need::tool("node") else {
        return;
    };
    let shell = Shell::new().with("strike.mjs", STRIKE);
    let grand = bundled("grand-piano.whip");
    let (out, _) = shell.ends(0, &["build", &grand, "--keys", "88", "-o", "grand.wasm"]);
    assert!(out.contains("grand.wasm: grand_piano on 88 keys"), "{out}");
    let ran = Command::new(node)
        .args([shell.path("strike.mjs"), shell.path("grand.wasm")])
        .output()
        .expect("node starts");
    assert!(
        ran.status.success(),
        "{}",
        String::from_utf8_lossy(&ran.stderr)
    );
    let told: Value = serde_json::from_slice(&ran.stdout).expect("JSON");
    assert_eq!(told["keys"], 88);
    let most = told["most"].as_f64().expect("a force");
    assert!((1.0..20.0).contains(&most), "{most} N at most");
    let strikes = told["strikes"].as_array().expect("strikes");
    assert_eq!(strikes.len(), 1, "{strikes:?}");
    let of_strike = |at: usize| strikes[0][at].as_f64().expect("a number");
    assert_eq!(
        (of_strike(1), &strikes[0][3]),
        (40.0, &"speed_m_per_s".into())
    );
    assert!((0.5..5.0).contains(&of_strike(4)), "{} m/s", of_strike(4));
}

#[test]
fn what_cannot_be_a_module_is_refused() {
    let shell = Shell::new();
    let (grand, split) = (bundled("grand-piano.whip"), bundled("split.whip"));
    let two = ["build", &split, "split", "-o", "x.wasm"];
    shell.refuses(2, &two, &["a .wasm has one instrument"]);
    let map = ["build", &grand, "-o", "x.wasm", "--map", "x.map"];
    shell.refuses(2, &map, &["C, WebAssembly and FMUs have none"]);
}
