//! `whippen import`: a recording becomes an instrument that gives the recording back.

mod keyswitches;

use std::fmt::Write;

use serde_json::Value;
use whippen_runtime::engine::EngineKind;

use crate::cli::Shell;
use crate::common;

/// The weight of a gram (N).
const GRAM_N: f64 = 9.80665e-3;

/// A switch of 4 mm that snaps at 2 mm, with 6 gf of hysteresis: force (gf) at a place (mm).
fn snap(x: f64, pressed: bool) -> f64 {
    let bump = (-((x - 1.6) / 0.3).powi(2)).exp();
    let rise = 40.0 * (x / 0.2).min(1.0) + 6.0 * x;
    rise + 25.0 * bump + if pressed { 3.0 } else { -3.0 } * (x / 0.2).min(1.0)
}

/// Down and up in steps of 5 um; `glitch` is a line that reads 300 gf.
pub fn recorded(glitch: Option<usize>) -> String {
    let mut text = "x_um,force_gf,actuated\n".to_string();
    let down = (0..=800).map(|n| (n, true));
    for (row, (n, pressed)) in down.chain((0..=800).rev().map(|n| (n, false))).enumerate() {
        let x = f64::from(n) * 5e-3;
        let force = match Some(row) == glitch {
            true => 300.0,
            false => snap(x, pressed),
        };
        let _ = writeln!(text, "{},{force:.2},{}", n * 5, u8::from(x > 2.1));
    }
    text
}

/// The force (gf) of a program in every row of a slow motion (mm).
fn swept(name: &str, text: &str, rows_mm: &[f64]) -> Vec<f64> {
    const TICKS: usize = 4;
    let compiled = common::compiled(name, text, &[]).remove(0);
    let motion = |tick: usize, at: &mut [f64]| at[0] = 1e-3 * rows_mm[tick / TICKS];
    let motion = (TICKS * rows_mm.len(), motion);
    let run = common::recorded(&compiled, EngineKind::Jit, motion);
    let column = run.trace.column("force_n").expect("a force");
    let last = column.values().iter().skip(TICKS - 1).step_by(TICKS);
    last.map(|newtons| newtons / GRAM_N).collect()
}

/// What the command tells of a curve, how far its loop comes back, and the program.
struct Told {
    json: Value,
    rms_gf: f64,
    program: String,
}

/// Imports a recording and plays it back.
fn there_and_back(recording: &str) -> Told {
    let shell = Shell::new().with("curve.csv", recording);
    let args = ["import", "curve.csv", "-o", "switch.whip", "--json"];
    let (out, _) = shell.ends(0, &args);
    let json: Value = serde_json::from_str(&out).expect("JSON");
    let program = std::fs::read_to_string(shell.path("switch.whip")).expect("written");
    let rows = rows(recording);
    let [low, high] = [0, 1].map(|end| json["travel_mm"][end].as_f64().expect("a number"));
    let glitches = json["glitches"].as_array().expect("a list");
    let places: Vec<f64> = rows.iter().map(|row| row.0).collect();
    let forces = swept("switch.whip", &program, &places);
    let deepest = places
        .iter()
        .position(|x| *x == high)
        .expect("the deepest place");
    let is_glitch = |row: usize| {
        let at = |glitch: &Value| {
            let pressed = glitch["pressed"] == Value::Bool(row <= deepest);
            pressed && (glitch["x_mm"].as_f64().expect("a place") - places[row]).abs() < 1e-6
        };
        glitches.iter().any(at)
    };
    let compared = (0..rows.len()).filter(|row| (low..=high).contains(&places[*row]));
    let off: Vec<f64> = compared
        .filter(|row| !is_glitch(*row))
        .map(|row| (forces[row] - rows[row].1).powi(2))
        .collect();
    Told {
        json,
        rms_gf: (off.iter().sum::<f64>() / off.len() as f64).sqrt(),
        program,
    }
}

/// Places (mm) and forces (gf) of a recording in um and gf.
fn rows(recording: &str) -> Vec<(f64, f64)> {
    let row = |line: &str| {
        let mut cells = line
            .split(',')
            .map(|cell| cell.parse::<f64>().unwrap_or(0.0));
        let mut next = || cells.next().expect("a cell");
        (1e-3 * next(), next())
    };
    recording.lines().skip(1).map(row).collect()
}

#[test]
fn a_recording_comes_back_and_its_glitch_is_told() {
    let told = there_and_back(&recorded(Some(300)));
    assert!(told.rms_gf < 0.7, "{}", told.rms_gf);
    let glitch = &told.json["glitches"];
    assert_eq!(glitch.as_array().map(Vec::len), Some(1), "{glitch}");
    assert_eq!(glitch[0]["x_mm"], 1.5);
    assert_eq!(glitch[0]["force_gf"], 300.0);
    assert!(told.json["spring_n_per_m"].is_null());
    assert!(
        told.program.contains("emit note(speed: x')"),
        "{}",
        told.program
    );
}

/// Half a stroke, a turn, another turn: the force goes from curve to curve, never beyond them, and
/// no step of it is larger than the gap over `give`.
#[test]
fn a_partial_stroke_does_not_jump() {
    let told = there_and_back(&recorded(None));
    let give_mm = told.json["give_mm"].as_f64().expect("a number");
    let step_mm = 1e-3;
    let legs = [
        (0.0, 2.6),
        (2.6, 2.55),
        (2.55, 3.0),
        (3.0, 1.0),
        (1.0, 1.02),
        (1.02, 0.5),
    ];
    let mut places = Vec::new();
    for (from, to) in legs {
        let steps = (f64::abs(to - from) / step_mm) as i32;
        places.extend((0..steps).map(|n| from + (to - from) * f64::from(n) / f64::from(steps)));
    }
    let forces = swept("switch.whip", &told.program, &places);
    for (row, two) in forces.windows(2).enumerate() {
        let gap = snap(places[row], true) - snap(places[row], false);
        let most = gap * step_mm / give_mm + 0.3 + 250.0 * step_mm;
        assert!(
            (two[1] - two[0]).abs() < most,
            "{} mm: {two:?}",
            places[row]
        );
    }
    for (x, force) in places.iter().zip(&forces) {
        let (low, high) = (snap(*x, false) - 0.5, snap(*x, true) + 0.5);
        assert!((low..=high).contains(force), "{x} mm: {force}");
    }
    // On the way up, turned round for a fiftieth of a millimetre, it is between the curves.
    let give = told.json["give_mm"].as_f64().expect("a number");
    assert!((0.005..=0.2).contains(&give));
}

#[test]
fn other_layouts_and_units_are_the_same_curve() {
    let one = there_and_back(&recorded(None)).program;
    let rows = rows(&recorded(None));
    let (down, up) = rows.split_at(801);
    let mut columns = "x_mm;press_mN;return_mN\n".to_string();
    let mut branches = "branch,force_N,x_mm\n".to_string();
    for ((x, press), (_, back)) in down.iter().zip(up.iter().rev()) {
        let (press, back) = (press * GRAM_N, back * GRAM_N);
        let _ = writeln!(columns, "{x};{};{}", 1e3 * press, 1e3 * back);
        let _ = writeln!(branches, "press,{press},{x}\nreturn,{back},{x}");
    }
    let knots = |program: &str| {
        let tables = program.split("table press").nth(1).expect("a table");
        tables.split("// A link").next().map(str::to_string)
    };
    for text in [columns, branches] {
        let shell = Shell::new().with("curve.csv", &text);
        shell.ends(0, &["import", "curve.csv", "-o", "switch.whip"]);
        let other = std::fs::read_to_string(shell.path("switch.whip")).expect("written");
        assert_eq!(knots(&other), knots(&one));
    }
}

#[test]
fn a_bare_spring_is_recognised() {
    let mut text = "x_mm,force_gf\n".to_string();
    for n in (0..=400).chain((0..=400).rev()) {
        let x = f64::from(n) * 0.01;
        let _ = writeln!(
            text,
            "{x},{}",
            if x < 0.3 { 0.0 } else { 30.0 + 7.0 * (x - 0.3) }
        );
    }
    let shell = Shell::new().with("curve.csv", &text);
    let (out, _) = shell.ends(0, &["import", "curve.csv", "-o", "spring.whip"]);
    assert!(out.contains("a bare spring: 68.6"), "{out}");
}

#[test]
fn what_is_no_recording_is_refused_and_nothing_is_written() {
    let good = recorded(None);
    let lines: Vec<&str> = good.lines().collect();
    let (head, rest) = (lines[0], &lines[1..]);
    let reversed: Vec<&str> = rest[801..].iter().chain(&rest[..801]).copied().collect();
    let gap: Vec<&str> = rest[..300].iter().chain(&rest[400..]).copied().collect();
    let swapped: String = rest
        .iter()
        .map(|line| line.replacen(',', ",press,", 1))
        .enumerate()
        .map(|(n, line)| {
            if n > 800 {
                line
            } else {
                line.replace("press", "return")
            }
        })
        .map(|line| line + "\n")
        .collect();
    let of = |lines: &[&str]| format!("{head}\n{}\n", lines.join("\n"));
    let cases = [
        (of(&reversed), "begins where the key is down"),
        (of(&gap), "its press has a gap from 1.495 mm to 2 mm"),
        (
            format!("x_um,branch,force_gf,a\n{swapped}"),
            "the branches are swapped",
        ),
        (of(&rest[..801]), "its return has 0 points"),
        (
            good.replace("x_um", "x_m"),
            "a travel of 4000000 mm is no key's",
        ),
        (
            good.replace("force_gf", "force"),
            "one column of force with its unit",
        ),
        (good.replacen(",43.", ",43x.", 1), "is no number"),
        ("\u{0}\u{1}photo".to_string(), "it is no text"),
        (String::new(), "it is empty"),
    ];
    for (text, words) in cases {
        let shell = Shell::new().with("curve.csv", &text);
        shell.refuses(2, &["import", "curve.csv", "-o", "switch.whip"], &[words]);
        assert!(!shell.path("switch.whip").exists(), "{words}");
    }
    let shell = Shell::new().with("curve.csv", &good);
    shell.refuses(
        2,
        &["import", "none.csv", "-o", "a.whip"],
        &["there is no such file"],
    );
    shell.refuses(
        2,
        &["import", "curve.csv", "-o", "a.txt"],
        &["NAME.whip is wanted"],
    );
    shell.ends(0, &["import", "curve.csv", "-o", "a.whip"]);
    shell.refuses(
        2,
        &["import", "curve.csv", "-o", "a.whip"],
        &["exists already"],
    );
}

/// How far `run --compare` finds the program of a recording from it (gf rms).
fn compared(shell: &Shell) -> Value {
    let args = ["run", "switch.whip", "--compare", "curve.csv", "--json"];
    let (out, _) = shell.ends(0, &args);
    let object: Value = serde_json::from_str(&out).expect("JSON");
    object["compared"].clone()
}

#[test]
fn a_run_is_compared_with_what_was_measured() {
    for glitch in [None, Some(300)] {
        let text = recorded(glitch);
        let told = there_and_back(&text);
        let shell = Shell::new()
            .with("curve.csv", &text)
            .with("switch.whip", &told.program);
        let compared = compared(&shell);
        let rms_gf = compared["rms_gf"].as_f64().expect("a number");
        assert!(
            (rms_gf - told.rms_gf).abs() < 0.02,
            "{compared} {}",
            told.rms_gf
        );
        assert_eq!(compared["missed"], 0);
        assert_eq!(compared["points"], 1602 - i32::from(glitch.is_some()));
    }
    // A program that gives a hundredth of a newton more is that far from it.
    let text = recorded(None);
    let program = there_and_back(&text).program;
    let more = program.replace("force switch =", "force more = 0.1 N\n    force switch =");
    let shell = Shell::new()
        .with("curve.csv", &text)
        .with("switch.whip", &more);
    let rms_n = compared(&shell)["rms_n"].as_f64().expect("a number");
    assert!((rms_n - 0.1).abs() < 0.002, "{rms_n}");
    let drawn = ["--plot", "a.svg", "--report", "a.html"];
    let args = ["run", "switch.whip", "--compare", "curve.csv"];
    let (out, _) = shell.ends(0, &[&args[..], &drawn].concat());
    assert!(out.contains("measured: curve.csv: 0.1"), "{out}");
    let svg = shell.lines("a.svg").join("\n");
    assert!(svg.contains("measured press") && svg.contains("measured return"));
    let page = shell.lines("a.html").join("\n");
    assert!(page.contains("<dt>measured</dt>") && page.contains("\"measured\":{"));
}

#[test]
fn what_cannot_be_compared_is_refused_and_nothing_is_written() {
    let good = recorded(None);
    let program = there_and_back(&good).program;
    let cases = [
        ("\u{0}\u{1}photo".to_string(), "it is no text"),
        (good.replace("force_gf", "force"), "one column of force"),
        (good.replace("force_gf", "m_kg"), "one column of force"),
        (good.replace("x_um", "t_s"), "one column of travel"),
        (good.replacen(",43.", ",43x.", 1), "is no number"),
    ];
    let args = ["run", "switch.whip", "--compare", "curve.csv"];
    let written = ["--out", "a.csv", "--plot", "a.svg"];
    let refused = |text: &str, more: &[&str], words: &str| {
        let shell = Shell::new()
            .with("curve.csv", text)
            .with("switch.whip", &program);
        shell.refuses(2, &[&args[..], more].concat(), &[words]);
    };
    for (text, words) in cases {
        refused(&text, &written, words);
    }
    refused(
        &good,
        &["--out", "a.csv", "--columns", "switch"],
        "add `x_m` to --columns",
    );
    refused(&good, &["--plot", "curve.csv"], "curve.csv");
    let shell = Shell::new().with("curve.csv", &good);
    let knob = crate::cli::bundled("knob.whip");
    let args = ["run", knob.as_str(), "--compare", "curve.csv"];
    shell.refuses(2, &args, &["is for what senses a travel"]);
}

/// Readings of a key that went to both ends tune a table, with which `run` finds the places again.
#[test]
fn a_table_is_tuned_and_a_run_reads_with_it() {
    let table = "key_mm,adc_after_offset_9_gain_9\n0,0\n2,0.1\n5,0.5\n10,1\n";
    // Rest, and presses at corners of the table, where its readings are known.
    let corners = [(0.0, 0.0), (2.0, 0.1), (5.0, 0.5), (10.0, 1.0)];
    let down = corners.iter().chain(corners.iter().rev());
    let rows = corners[..1].iter().chain(down);
    let raw: String = rows
        .flat_map(|(_, reading)| std::iter::repeat_n(format!("{}\n", 200.0 + 3000.0 * reading), 60))
        .collect();
    let shell = Shell::new().with("raw.txt", &raw).with("table.csv", table);
    let args = ["tune", "raw.txt", "--table", "table.csv", "-o", "tuned.csv"];
    let (out, _) = shell.ends(0, &args);
    assert!(
        out.contains("540 readings from 200 to 3200, which rise"),
        "{out}"
    );
    assert_eq!(
        shell.lines("tuned.csv")[0],
        "key_mm,reading_after_offset_200_gain_3000"
    );
    let hammond = crate::cli::bundled("hammond.whip");
    let run = [
        "run",
        &hammond,
        "--motion",
        "raw.txt",
        "--rate",
        "1kHz",
        "--calibration",
    ];
    let run = [&run[..], &["tuned.csv", "--out", "a.csv", "--columns", "x"]].concat();
    shell.ends(0, &run);
    let place = |row: usize| {
        let lines = shell.lines("a.csv");
        let cell = lines[row].split(',').nth(1).map(str::parse::<f64>);
        cell.expect("a cell").expect("a number")
    };
    for (n, (x_mm, _)) in corners.iter().enumerate() {
        let row = 1 + 441 * (6 * n + 9);
        assert!(
            (1e3 * place(row) - x_mm).abs() < 0.05,
            "{x_mm} {}",
            place(row)
        );
    }
    let refused = |raw: &str, words: &str| {
        let shell = Shell::new().with("raw.txt", raw).with("table.csv", table);
        shell.refuses(2, &args, &[words]);
    };
    refused(&"1\n".repeat(500), "shows no key that moves");
    refused("1\n2\n", "has 2 readings");
    refused("x\n", "raw.txt");
}
