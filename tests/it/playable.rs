//! Pages that play: under node what they record is what `whippen run` plays, word for word; in a
//! browser, in real time, a key is struck.

use std::path::Path;
use std::process::Command;

use serde_json::Value;

use crate::cli::{Shell, bundled};

/// The folder of the scripts.
fn scripts() -> std::path::PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/it/playable")
}

/// A page of a bundled instrument.
fn page(shell: &Shell, file: &str, more: &[&str]) -> String {
    let program = bundled(file);
    let words = [&["page", &program, "-o", "page.html"], more].concat();
    let (out, _) = shell.ends(0, &words);
    assert!(out.contains("open it in a browser"), "{out}");
    std::fs::read_to_string(shell.path("page.html")).expect("a page")
}

#[test]
fn a_page_is_one_file_that_asks_for_nothing() {
    let shell = Shell::new();
    let html = page(&shell, "grand-piano.whip", &[]);
    for outside in ["http://", "https://", "src=\"", "@import", "fetch("] {
        assert!(!html.contains(outside), "{outside}");
    }
    assert!(html.len() < 2_000_000, "{} bytes", html.len());
    assert_eq!(
        html,
        page(&shell, "grand-piano.whip", &[]),
        "the same again"
    );
    let two = ["page", &bundled("split.whip"), "-o", "two.html"];
    shell.refuses(2, &two, &["grand_piano"]);
    let wrong = ["page", &bundled("mikey.whip"), "-o", "two.txt"];
    shell.refuses(2, &wrong, &["html"]);
}

#[test]
fn what_a_page_records_runs_to_the_same_words() {
    let Some(node) = whippen_need::tool("node") else {
        return;
    };
    for (file, drives) in [
        ("grand-piano.whip", &["drive_n"][..]),
        ("knob.whip", &["drive_n_m"]),
        (
            "bowed-violin.whip",
            &["drive_x_n", "drive_y_n", "drive_z_n"],
        ),
        ("keytar.whip", &["drive_x_n", "drive_y_n", "drive_z_n"]),
    ] {
        let shell = Shell::new();
        page(&shell, file, &[]);
        let ran = Command::new(&node)
            .arg(scripts().join("record.mjs"))
            .args(["page.html", "1.5"])
            .current_dir(shell.path("."))
            .output()
            .expect("node starts");
        assert!(
            ran.status.success(),
            "{}",
            String::from_utf8_lossy(&ran.stderr)
        );
        // As texts: a reader of JSON may be off by the last bit.
        let driven: Vec<Vec<String>> = serde_json::from_slice(&ran.stdout).expect("JSON");
        let number = |text: &String| text.parse::<f64>().expect("a number");
        let forces = |row: &Vec<String>| row.iter().map(number).collect();
        let driven: Vec<Vec<f64>> = driven.iter().map(forces).collect();
        let (program, columns) = (bundled(file), drives.join(","));
        let run = ["run", &program, "--motion", "recorded.csv", "--exact"];
        shell.ends(
            0,
            &[&run[..], &["--out", "trace.csv", "--columns", &columns]].concat(),
        );
        let rows = shell.lines("trace.csv");
        let values = |row: &String| -> Vec<f64> {
            let cells = row.split(',').skip(1);
            cells.map(|cell| cell.parse().expect("a number")).collect()
        };
        let traced: Vec<Vec<f64>> = rows[1..].iter().map(values).collect();
        assert_eq!(traced.len(), driven.len(), "{file}: ticks");
        let differs = (0..traced.len()).find(|tick| traced[*tick] != driven[*tick]);
        assert_eq!(differs, None, "{file}: the first tick that is another");
        let most = driven
            .iter()
            .flatten()
            .fold(0.0_f64, |most, force| most.max(force.abs()));
        assert!(most > 0.01, "{file}: {most} at most");
    }
}

/// Plays a script in `page.html` in Chromium, after texts that stand before it; none without the
/// tools.
pub fn driven(shell: &Shell, script: &Path, before: &str) -> Option<Value> {
    let [Some(node), Some(chromium)] = ["node", "chromium"].map(whippen_need::tool) else {
        return None;
    };
    let text = std::fs::read_to_string(script).expect("a script");
    std::fs::write(shell.path("script.js"), format!("{before}\n{text}")).expect("writable");
    let ran = Command::new(node)
        .arg(scripts().join("drive.mjs"))
        .arg(chromium)
        .args([shell.path("page.html"), shell.path("script.js")])
        .output()
        .expect("node starts");
    let told: Value = serde_json::from_slice(&ran.stdout)
        .unwrap_or_else(|e| panic!("{e}: {}", String::from_utf8_lossy(&ran.stderr)));
    assert_eq!(told["heard"], serde_json::json!([]), "{told}");
    assert_eq!(told["exception"], Value::Null, "{told}");
    Some(told["value"].clone())
}

#[test]
fn windows_are_drawn_while_they_are_played() {
    let Some(axe) = whippen_need::npm("axe-core/axe.min.js") else {
        return;
    };
    let axe = std::fs::read_to_string(axe).expect("a script");
    for (file, tool) in [
        ("bowed-violin.whip", "bow"),
        ("rubbed-bank.whip", "stick"),
        ("keytar.whip", "plectrum"),
    ] {
        let shell = Shell::new();
        page(&shell, file, &[]);
        let Some(value) = driven(&shell, &scripts().join("window.js"), &axe) else {
            return;
        };
        let text = |name: &str| value[name].as_str().unwrap_or_default().to_string();
        assert_eq!(text("hovering"), format!("{tool} hovers"), "{value}");
        assert!(
            text("touching").starts_with(&format!("{tool} touches")),
            "{value}"
        );
        assert_eq!(text("lifted"), format!("{tool} hovers"), "{value}");
        assert!(text("tool").contains("touches"), "{value}");
        assert!(text("loudest").starts_with("strongest at"), "{value}");
        assert_eq!(value["found"], serde_json::json!([]), "{file}");
        assert_eq!(value["wide"], true, "{value}");
        // How often is measured on a quiet machine (docs/bars.md), not here.
        println!("{file}: {}", text("ticks"));
        assert!(text("ticks").contains("pictures a second"), "{value}");
    }
}

#[test]
fn a_page_under_stress_says_what_is_the_matter() {
    let shell = Shell::new();
    page(&shell, "grand-piano.whip", &[]);
    let stress = scripts().join("stress.js");
    let Some(value) = driven(&shell, &stress, "const mode = 'flood';") else {
        return;
    };
    let text = |name: &str| value[name].as_str().unwrap_or_default().to_string();
    assert!(text("flood").starts_with("Too much MIDI"), "{value}");
    assert_eq!(
        value["later"], value["still"],
        "all keys have come up: {value}"
    );
    assert!(
        value["meanwhile"].as_u64().is_some_and(|n| n <= 4),
        "{value}"
    );
    assert!(
        text("hidden").starts_with("The page was hidden for 3 s"),
        "{value}"
    );
    let [before, after] = ["played", "after"].map(|name| value[name].as_f64().unwrap_or(0.0));
    assert!(after > before + 2.0, "the sound went on: {value}");
    let silent = driven(&shell, &stress, "const mode = 'silent';").expect("as before");
    let said = silent["status"].as_str().unwrap_or_default();
    assert!(said.contains("no audio device answers"), "{silent}");
    assert_eq!(silent["again"], true, "{silent}");
}

#[test]
fn a_browser_plays_a_key_in_real_time() {
    let shell = Shell::new();
    page(&shell, "grand-piano.whip", &[]);
    let Some(told) = driven(&shell, &scripts().join("strike.js"), "") else {
        return;
    };
    let value = |name: &str| told[name].as_str().unwrap_or_default().to_string();
    assert!(value("status").starts_with("running, 44100 Hz"), "{told}");
    assert!(value("ticks").contains("s played"), "{told}");
    assert!(value("events").contains("note"), "{told}");
    assert_eq!(told["wide"], true, "{told}");
}

/// Values whose dimension has several units, or none.
const UNITS: &str = "\
instrument units {
    sense x: length in 0 mm .. 10 mm
    live param pitch = 1 kHz in 20 Hz .. 2 kHz
    live param spin = 90 deg/s in 0 deg/s .. 360 deg/s
    live param share = 0.5 in 0 .. 1
    live param lean = 90 deg in 0 deg .. 180 deg
    force spring = 5 N/m * x * share * lean * (pitch / 1 kHz) * (spin / 1 rad/s)
}
";

#[test]
fn values_are_told_in_the_unit_of_the_text() {
    let shell = Shell::new().with("units.whip", UNITS);
    shell.ends(0, &["build", "units.whip", "-o", "units.wasm"]);
    let violin = bundled("bowed-violin.whip");
    shell.ends(0, &["build", &violin, "-o", "violin.wasm"]);
    let tells = |file: &str, what: &str| {
        let bytes = std::fs::read(shell.path(file)).expect("a module");
        bytes
            .windows(what.len())
            .any(|part| part == what.as_bytes())
    };
    assert!(tells("violin.wasm", r#""name":"tilt","unit":"rad""#));
    assert!(tells("units.wasm", r#""name":"spin","unit":"rad/s""#));
    shell.ends(0, &["page", "units.whip", "-o", "page.html"]);
    let script = "return [...document.querySelectorAll('#lives output')].map((one) => one.textContent.trim());";
    let shell = shell.with("outputs.js", script);
    let Some(value) = driven(&shell, &shell.path("outputs.js"), "") else {
        return;
    };
    let wanted = serde_json::json!(["1000 Hz", "1.571 rad/s", "0.5", "1.571 rad"]);
    assert_eq!(value, wanted);
}
