//! `whippen measure`: definitions on programs whose numbers are known in closed form, every bundled
//! instrument, the command.

use std::fmt::Write;

use serde_json::Value;
use whippen_compiler::bundled::INSTRUMENTS;
use whippen_compiler::parallel;
use whippen_compiler::pipeline::compile;
use whippen_runtime::device::Device;
use whippen_runtime::engine::EngineKind;
use whippen_runtime::keyboard::model_of_keys;
use whippen_runtime::measure::{GRAM_FORCE_N, Measured, Protocol, measure, sweep};

use crate::cli::{Shell, bundled};
use crate::common::compiled;

/// A key whose body is this text, measured.
fn measured(body: &str) -> Measured {
    let text =
        format!("instrument known {{ sense x: length in -0.5 mm .. 10.5 mm over 0.7 ms\n{body} }}");
    let all = compiled("known.whip", &text, &[]);
    let device = Device::of(&all[0].model);
    let protocol = Protocol::of(&all[0].model, EngineKind::Jit);
    measure(&all[0], &device, &protocol).expect("it runs")
}

#[track_caller]
fn close(measured: &Measured, name: &str, known: f64, within: f64) {
    let found = measured.value(name).unwrap_or(f64::NAN);
    assert!(
        (found - known).abs() <= within,
        "{name} is {found}, not {known}"
    );
}

#[test]
fn a_spring_with_coulomb_friction_is_weighed_in_the_middle_of_its_way() {
    let found = measured(
        "let rubs = coulomb(x, level: 0.15 N, give: 0.1 mm)
         force spring = 0.2 N + 40 N/m * x
         force rubs = rubs.drag
         force oil = 2 N*s/m * x'",
    );
    // 2 N*s/m at 5 mm/s are 10 mN.
    close(&found, "down_weight", 0.2 + 0.2 + 0.15 + 0.01, 1e-3);
    close(&found, "up_weight", 0.2 + 0.2 - 0.15 - 0.01, 1e-3);
    close(&found, "balance_weight", 0.4, 1e-3);
    close(&found, "friction_weight", 0.16, 1e-3);
    close(&found, "rate_effect", 0.01, 5e-4);
    for none in ["let_off_travel", "aftertouch", "repetition_limit"] {
        assert_eq!(found.value(none), None, "{none}");
    }
    assert_eq!(found.drop, None);
}

#[test]
fn a_weight_that_gives_way_has_its_let_off_there() {
    let found = measured("force weight = if x < 7 mm then 0.5 N else 0.1 N");
    close(&found, "down_weight", 0.5, 1e-3);
    close(&found, "let_off_travel", 7e-3, 2e-5);
    close(&found, "let_off_force", 0.5, 1e-3);
    close(&found, "let_off_bump", 0.0, 1e-3);
    close(&found, "after_travel", 3e-3, 2e-5);
    close(&found, "aftertouch", 3e-3, 3e-5);
    close(&found, "key_dip", 10e-3, 0.0);
}

#[test]
fn a_key_that_must_wait_repeats_no_faster() {
    // A stroke less than 50 ms after the last one is lost.
    let found = measured(
        "pulse wait: force in 0 N .. 1 N lasting 50 ms
         states key {
             up -> down when x > 5 mm and wait <= 0 N { emit note(speed: x') fire wait at 1 N }
             up -> lost when x > 5 mm and wait > 0 N
             down -> up when x < 2 mm
             lost -> up when x < 2 mm
         }
         force weight = 0.5 N",
    );
    close(&found, "repetition_limit", 20.0, 0.5);
    assert!(!found.repeats_beyond);
    // Half way a move of minimum jerk has its greatest speed, here 20 mm/s to 1 m/s.
    let dynamic_range_db = 20.0 * f64::log10(1.0 / 0.02);
    close(&found, "dynamic_range", dynamic_range_db, 0.1);
    close(&found, "loudest_strike", 1.0, 0.01);
}

#[test]
fn every_bundled_instrument() {
    let shell = Shell::new();
    let mut all = String::new();
    for (file, text) in INSTRUMENTS {
        if text.contains("\nkeyboard ") || text.starts_with("keyboard ") {
            continue;
        }
        let output = shell.run(&["measure", &bundled(file)]);
        let text = [output.stdout, output.stderr].concat();
        let _ = writeln!(all, "{}", String::from_utf8_lossy(&text));
    }
    insta::assert_snapshot!(all);
}

/// A whole keyboard beside the keys of a Gaveau, which weighed without the springs of its whippens.
#[test]
fn a_register_makes_88_keys_as_heavy_as_they_were_measured() {
    let Some(folder) = whippen_need::recordings("touchweight") else {
        return;
    };
    let text = [
        include_str!("../../examples/register/grand-88.whip"),
        include_str!("../../instruments/grand-piano.whip"),
    ];
    let model = &compiled("grand-88.whip", &text.concat(), &[])[0].model;
    let device = Device::of(model);
    let protocol = Protocol::of(model, EngineKind::Jit);
    let weights = parallel::map((0..88).collect(), |key: usize| {
        let one = compile(model_of_keys(model, &[key]), device.scales(), true).expect("compiles");
        let touch = sweep(&one, &device, &protocol).expect("it runs").touch;
        [touch.down_weight(), touch.up_weight()]
    });
    let table = std::fs::read_to_string(folder.join("gaveau_m1_88keys.csv")).expect("a table");
    let rows: Vec<Vec<&str>> = table.lines().map(|row| row.split(',').collect()).collect();
    let mut judged = 0;
    for (title, side) in [("down_weight_no_spring_g", 0), ("up_weight_g", 1)] {
        let column = rows[0].iter().position(|own| *own == title).expect(title);
        for (key, (row, found)) in rows[1..].iter().zip(&weights).enumerate() {
            let wanted_g: f64 = row[column].parse().expect("a number");
            let off_g = found[side] / GRAM_FORCE_N - wanted_g;
            assert!(
                off_g.abs() < 5.0,
                "key {}: {title} off by {off_g} g",
                key + 1
            );
            judged += 1;
        }
    }
    assert_eq!(judged, 2 * 88);
}

const PLAIN: &str =
    "instrument plain { sense x: length in -0.5 mm .. 10.5 mm force spring = 50 N/m * x }";

#[test]
fn json_has_null_for_what_is_not_there() {
    let shell = Shell::new()
        .with("plain.whip", PLAIN)
        .with("keys.csv", "key,down_weight_g,leads_g\n1,20,3\n88,31,4\n");
    let args = [
        "measure",
        "plain.whip",
        "--json",
        "-",
        "--compare",
        "keys.csv",
    ];
    let (out, err) = shell.ends(0, &args);
    assert_eq!((out.lines().count(), err.as_str()), (1, ""));
    let object: Value = serde_json::from_str(&out).expect("JSON");
    let key = &object["keys"][0];
    let grams = key["down_weight_gf"].as_f64().expect("a number");
    assert!((grams - 25.5).abs() < 0.1, "{grams}");
    assert_eq!(key["let_off_travel_m"], Value::Null);
    assert_eq!(object["compared"][0]["keys"], 2);
    let (out, _) = shell.ends(0, &args[..2]);
    assert!(out.contains("let-off travel    none"), "{out}");
    let (out, _) = shell.ends(0, &["measure", "plain.whip", "--compare", "keys.csv"]);
    assert!(
        out.contains("2 keys, 25.5 gf in the mean") && out.contains("not measured: leads_g"),
        "{out}"
    );
}

#[test]
fn keys_have_their_own_weights_and_a_curve_along_them() {
    let text = format!(
        "{}\nkeyboard two {{ rate 44100 Hz keys C4 .. D4 programs plain plain.w = {{ C4: 0.1 N, D4: 0.3 N }} }}",
        PLAIN.replace(
            "force spring",
            "live param w = 0.2 N in 0 N .. 1 N force weight = w force spring"
        )
    );
    let shell = Shell::new().with("two.whip", &text);
    let files = [
        "--plot",
        "keys.svg",
        "--report",
        "keys.html",
        "--json",
        "keys.json",
    ];
    let args = [&["measure", "two.whip", "--keys"], &files[..]].concat();
    let (out, _) = shell.ends(0, &args);
    let down = |name: &str| {
        let row = out.lines().find(|line| line.trim_start().starts_with(name));
        let words: Vec<&str> = row.unwrap_or_default().split_whitespace().collect();
        words[1].parse::<f64>().expect("a number")
    };
    assert!((down("D4 ") - down("C4 ") - 20.4).abs() < 0.2, "{out}");
    assert!((down("C#4") - down("C4 ") - 10.2).abs() < 0.2, "{out}");
    assert!(
        shell
            .lines("keys.svg")
            .concat()
            .contains("weights along the keys")
    );
    assert!(shell.lines("keys.html").concat().contains("C#4"));
    let object: Value = serde_json::from_str(&shell.lines("keys.json")[0]).expect("JSON");
    assert_eq!(object["keys"].as_array().map(Vec::len), Some(3));
}

#[test]
fn what_cannot_be_measured_is_told() {
    let shell = Shell::new()
        .with("plain.whip", PLAIN)
        .with("bad.csv", "key,colour\n1,2\n");
    let refuses = |args: &[&str], words: &[&str]| {
        shell.refuses(2, &[&["measure", "plain.whip"], args].concat(), words);
    };
    refuses(&["--keys"], &["the program has none"]);
    refuses(&["--key", "C4"], &["the program has none"]);
    refuses(&["--dip", "12mm"], &["up to 10.500 mm"]);
    refuses(&["--speed", "5mm"], &["a speed, such as 5mm/s"]);
    refuses(&["--speed", "0m/s"], &["above zero"]);
    refuses(&["--engine", "emulated"], &["--engine jit"]);
    refuses(&["--compare", "bad.csv"], &["such as `down_weight_g`"]);
    refuses(&["--compare", "none.csv"], &["none.csv"]);
    refuses(&["--plot", "plot.pdf"], &["svg"]);
    refuses(&["--set", "y=1"], &["y"]);
    let knob = bundled("knob.whip");
    shell.refuses(2, &["measure", &knob], &["a key that is pressed"]);
}
