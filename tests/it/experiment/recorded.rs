//! Experiments that play a recording, where it is.

use serde_json::Value;
use whippen_runtime::experiment::bundled::EXPERIMENTS;

use super::{each_fails, lines, stem};
use crate::cli::Shell;
use crate::pictures::compare_picture;

/// The recording with its description, as they lie beside each other.
fn recording() -> Option<Vec<(&'static str, String)>> {
    let folder = whippen_need::recordings("kawai-grand")?;
    let files = [
        "key_and_hammer_2kHz.txt",
        "calibration_key.csv",
        "calibration_hammer.csv",
    ];
    let text = |file| std::fs::read_to_string(folder.join(file)).expect("readable");
    let description = include_str!("../../../examples/fit/kawai.toml").to_string();
    let mut all = vec![("kawai.toml", description)];
    all.extend(files.map(|file| (file, text(file))));
    Some(all)
}

fn experiments() -> impl Iterator<Item = (&'static str, &'static str)> {
    let names = ["figure-18.toml", "figure-19.toml", "hammer-paths.toml"];
    let all = EXPERIMENTS.iter().copied();
    all.filter(move |(file, _)| names.contains(file))
}

fn beside(files: &[(&'static str, String)]) -> Shell {
    let one = |shell: Shell, (file, text): &(&str, String)| shell.with(file, text);
    files.iter().fold(Shell::new(), one)
}

#[test]
fn experiments_with_a_recording_hold_and_look_as_their_page_shows() {
    let Some(files) = recording() else { return };
    let shell = beside(&files);
    let names: Vec<&str> = experiments().map(|(file, _)| stem(file)).collect();
    let options = ["--recordings", ".", "--json", "--pictures", "."];
    let (out, err) = shell.ends(0, &[&["experiment"], &names[..], &options].concat());
    assert_eq!(err, "");
    let played = lines(&out);
    assert_eq!(played.len(), names.len());
    for (line, name) in played.iter().zip(names) {
        let told = (line["name"].as_str(), &line["held"]);
        assert_eq!(told, (Some(name), &Value::Bool(true)), "{line:#}");
        let picture = format!("{name}.svg");
        let drawn = std::fs::read_to_string(shell.path(&picture)).expect("a picture");
        compare_picture(&format!("docs/pictures/{picture}"), &drawn);
    }
}

#[test]
fn each_assertion_about_a_recording_fails_of_a_broken_instrument() {
    let Some(files) = recording() else { return };
    for one in experiments() {
        each_fails(one, &files);
    }
}

const SMALL: &str = r#"title = "A key"

[[run]]
name = "key"
program = "hammond"

[[run]]
name = "pushed"
program = "virtual-spring"
pushed_by = "key"

[player]
recording = "small.toml"
from = "0.1 s"
to = "0.4 s"
hand = "0.1 kg, 3 N*s/m, 500 N/m"

[plot]
travel = "key.x"
lines = ["measured.spring"]

[[assert]]
greatest = "measured.spring"
is = "0.4 N"
within = "1 mN"

[[assert]]
greatest = "pushed.key_position"
at_least = "1 mm"
"#;

const DESCRIPTION: &str = r#"file = "small.txt"
rate = "1 kHz"

[motion]
column = 1

[measured.spring_n]
column = 2
"#;

/// Half a second of a key that goes down by 4 mm, and a force of 0.1 N a mm beside it.
fn small() -> Shell {
    let place_m = |row: i32| 4e-3 * f64::from((row - 200).clamp(0, 100)) / 100.0;
    let row = |row: i32| format!("{} {}\n", place_m(row), 100.0 * place_m(row));
    let rows: String = (0..500).map(row).collect();
    let shell = Shell::new().with("small.txt", &rows);
    shell
        .with("mine.toml", SMALL)
        .with("small.toml", DESCRIPTION)
}

#[test]
fn a_recording_of_ones_own_is_played_and_a_hands_force_pushes_another_key() {
    let (out, _) = small().ends(0, &["experiment", "mine.toml"]);
    assert!(out.contains("2 of 2 held"), "{out}");
    // A hand that pulls a key up pushes no other.
    let up = SMALL.replace("to = \"0.4 s\"", "to = \"0.15 s\"");
    let shell = small().with("mine.toml", &up);
    let (out, _) = shell.ends(1, &["experiment", "mine.toml"]);
    assert!(out.contains("0 of 2 held"), "{out}");
}

#[test]
fn what_is_wrong_with_a_recorded_player_is_told() {
    let cases: &[(&str, &str, &[&str])] = &[
        (
            "hand = ",
            "motion = [\"wait 1 s\"]\nhand = ",
            &["contradict"],
        ),
        ("to = \"0.4 s\"", "to = \"0.9 s\"", &["within 0 s .. 0.5"]),
        (
            "to = \"0.4 s\"",
            "to = \"0.4 N\"",
            &["line 15", "another kind"],
        ),
        ("to = \"0.4 s\"", "", &["is a time"]),
        ("to = \"0.4 s\"", "to = \"99 s\"", &["more than 60 s"]),
        ("small.toml", "none.toml", &["none.toml", "no such file"]),
        ("small.toml", "small.txt", &["describes a recording"]),
        ("name = \"key\"", "name = \"measured\"", &["the recording"]),
        ("pushed_by = \"key\"", "pushed_by = \"kex\"", &["earlier"]),
        (
            "pushed_by = \"key\"",
            "pushed_by = \"pushed\"",
            &["earlier"],
        ),
        (
            "hand = \"0.1 kg, 3 N*s/m, 500 N/m\"",
            "",
            &["give the [player] a `hand`"],
        ),
        (
            "recording = \"small.toml\"",
            "motion = [\"wait 1 s\"]",
            &["is of a `recording`"],
        ),
    ];
    for (from, to, words) in cases {
        assert!(SMALL.contains(from), "{from}");
        println!("{to}");
        let text = SMALL.replacen(from, to, 1);
        let shell = small().with("mine.toml", &text);
        shell.refuses(2, &["experiment", "mine.toml", "--plot", "p.svg"], words);
    }
    // One program without a name.
    let (head, rest) = SMALL.split_once("[[run]]").expect("runs");
    let (_, rest) = rest.split_once("pushed_by = \"key\"").expect("a run");
    let text = format!("{head}program = \"hammond\"{rest}");
    let shell = small().with("mine.toml", &text);
    shell.refuses(2, &["experiment", "mine.toml"], &["line 6", "in a [[run]]"]);
    let words = ["plays a recording", "kawai.toml", "--recordings FOLDER"];
    Shell::new().refuses(2, &["experiment", "figure-18"], &words);
    let far = ["experiment", "figure-18", "--recordings", "none"];
    Shell::new().refuses(2, &far, &["no such file"]);
}
