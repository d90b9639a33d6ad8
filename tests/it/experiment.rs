//! `whippen experiment`: every bundled experiment holds and each of its assertions can fail; what
//! is wrong with a file of one's own is told.

mod mutants;
mod recorded;

use std::collections::BTreeSet;
use std::path::Path;

use serde_json::Value;
use whippen_runtime::experiment::bundled::{EXPERIMENTS, PROGRAMS};

use crate::cli::{Shell, bundled};
use crate::pictures::compare_picture;
use mutants::MUTANTS;

fn stem(file: &str) -> &str {
    file.trim_end_matches(".toml")
}

/// Those that play no recording, which is not part of the repository.
fn without_recording() -> Vec<(&'static str, &'static str)> {
    let plays_one = |text: &str| text.contains("\nrecording = ");
    let all = EXPERIMENTS.iter().copied();
    all.filter(|(_, text)| !plays_one(text)).collect()
}

/// The JSON lines of experiments.
fn lines(out: &str) -> Vec<Value> {
    let line = |line: &str| serde_json::from_str(line).expect("a line of JSON");
    out.lines().map(line).collect()
}

#[test]
fn every_bundled_experiment_holds_and_looks_as_its_page_shows() {
    let shell = Shell::new();
    let (out, err) = shell.ends(0, &["experiment", "all", "--json", "--pictures", "."]);
    let left_out = ["figure-18", "figure-19", "hammer-paths"]
        .map(|name| format!("left out: {name} plays a recording (--recordings FOLDER)\n"));
    assert_eq!(err, left_out.concat());
    let (played, wanted) = (lines(&out), without_recording());
    assert_eq!(played.len(), wanted.len());
    for (line, (file, _)) in played.iter().zip(wanted) {
        assert_eq!(
            (line["name"].as_str(), &line["held"]),
            (Some(stem(file)), &Value::Bool(true)),
            "{line:#}"
        );
        assert_eq!(line["notes"], serde_json::json!([]), "{line:#}");
        let picture = format!("{}.svg", stem(file));
        let drawn = std::fs::read_to_string(shell.path(&picture)).expect("a picture");
        compare_picture(&format!("docs/pictures/{picture}"), &drawn);
    }
}

#[test]
fn every_file_of_the_folder_is_bundled() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("instruments/experiments");
    let entries = std::fs::read_dir(folder).expect("the folder");
    let names = entries.map(|e| {
        e.expect("an entry")
            .file_name()
            .into_string()
            .expect("a name")
    });
    let listed = EXPERIMENTS.iter().chain(PROGRAMS);
    let listed = listed.map(|(file, _)| file.to_string());
    assert_eq!(names.collect::<BTreeSet<_>>(), listed.collect());
}

/// The assertions of an experiment that fail with a program changed, and all of them; beside it
/// lie some files.
fn failing(
    (name, text): (&str, &str),
    (from, to): mutants::Change,
    beside: &[(&str, String)],
) -> (BTreeSet<String>, BTreeSet<String>) {
    let mut own = text.to_string();
    let mut shell = Shell::new();
    for (file, text) in beside {
        shell = shell.with(file, text);
    }
    let mut is_changed = false;
    let programs = text
        .lines()
        .filter_map(|line| line.strip_prefix("program = \""));
    for program in programs.map(|rest| rest.trim_end_matches('"')) {
        let file = format!("{program}.whip");
        let own_program = PROGRAMS.iter().find(|(name, _)| *name == file);
        let source = match own_program {
            Some((_, text)) => text.to_string(),
            None => std::fs::read_to_string(bundled(&file)).expect("a bundled program"),
        };
        is_changed |= source.contains(from);
        shell = shell.with(&file, &source.replace(from, to));
        own = own.replace(
            &format!("program = \"{program}\""),
            &format!("program = \"{file}\""),
        );
    }
    assert!(is_changed, "{name}: no program has `{from}`");
    let shell = shell.with("mutant.toml", &own);
    let (out, _) = shell.ends(1, &["experiment", "mutant.toml", "--json"]);
    let line = lines(&out).remove(0);
    let assertions = line["assertions"].as_array().expect("assertions").clone();
    let told = |wanted: &dyn Fn(&Value) -> bool| {
        let all = assertions.iter().filter(|a| wanted(a));
        let texts = all.filter_map(|a| a["assertion"].as_str().map(String::from));
        texts.filter(|text| !text.starts_with("instant ")).collect()
    };
    (told(&|a| a["held"] == false), told(&|_| true))
}

#[test]
fn each_assertion_fails_of_a_broken_instrument() {
    assert_eq!(MUTANTS.len(), EXPERIMENTS.len());
    for one in without_recording() {
        each_fails(one, &[]);
    }
}

/// Under one of its changes each assertion of an experiment fails.
fn each_fails((file, text): (&str, &str), beside: &[(&str, String)]) {
    let name = stem(file);
    let listed = MUTANTS.iter().find(|(mutated, _)| *mutated == name);
    let (_, changes) = listed.expect("its changes");
    let (mut failed, mut all) = (BTreeSet::new(), BTreeSet::new());
    for change in *changes {
        let (of_change, known) = failing((name, text), *change, beside);
        assert!(
            !of_change.is_empty(),
            "{name}: nothing fails with {change:?}"
        );
        failed.extend(of_change);
        all = known;
    }
    let never: Vec<_> = all.difference(&failed).collect();
    assert!(
        never.is_empty(),
        "{name}: nothing makes these fail: {never:#?}"
    );
}

#[test]
fn all_engines_agree() {
    let shell = Shell::new();
    let (jit, _) = shell.ends(0, &["experiment", "figure-16", "figure-21"]);
    let (interp, _) = shell.ends(
        0,
        &["experiment", "figure-16", "figure-21", "--engine", "interp"],
    );
    assert_eq!(jit, interp);
    shell.ends(0, &["experiment", "all", "--engine", "ideal"]);
    shell.refuses(
        2,
        &["experiment", "all", "--engine", "emulated"],
        &["emulated", "use jit"],
    );
}

#[test]
fn the_gallery_has_all_figures_and_the_example_holds() {
    let shell = Shell::new();
    let (out, _) = shell.ends(0, &["experiment", "all", "--report", "gallery.html"]);
    assert!(
        out.contains(
            "held    peaks force over 0.4 N under 0.2 N is 2: 2 (two spikes for two plectra)"
        ),
        "{out}"
    );
    let page = std::fs::read_to_string(shell.path("gallery.html")).expect("a page");
    for (file, _) in without_recording() {
        let id = format!("<section id=\"{}\">", stem(file));
        assert!(
            page.contains(&id) && page.contains(&format!("chart-{}", stem(file))),
            "{file}"
        );
    }
    let example = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/experiment/stiff-key.toml");
    let (out, _) = shell.ends(
        0,
        &[
            "experiment",
            &example.display().to_string(),
            "--plot",
            "key.png",
        ],
    );
    assert!(out.contains("2 of 2 held"), "{out}");
    let (out, _) = shell.ends(0, &["experiment"]);
    assert_eq!(out.lines().count(), EXPERIMENTS.len(), "{out}");
}

/// A small experiment that holds.
const SMALL: &str = r#"title = "A key"
program = "hammond"

[player]
motion = ["wait 20 ms", "to 10 mm in 50 ms", "wait 20 ms"]

[[when]]
name = "t1"
is = "x above 2 mm"

[[when]]
name = "t2"
is = "note"

[plot]
travel = "x"
total = "force"
states = ["contacts"]

[[assert]]
greatest = "spring"
is = "1.15 N"
within = "5 mN"
from = "t1"
until = "t2 + 80 ms"
"#;

#[test]
fn what_is_wrong_with_a_file_is_told_with_its_line() {
    let bounds = "is = \"1.15 N\"\nwithin = \"5 mN\"";
    let cases: &[(&str, &str, &[&str])] = &[
        (
            "greatest = \"spring\"",
            "greatest = \"sprung\"",
            &["line 21", "no column `sprung`", "spring"],
        ),
        (
            "is = \"note\"",
            "is = \"nota\"",
            &["no event `nota`", "did you mean `note`"],
        ),
        (
            "\"1.15 N\"",
            "\"1.15 mm\"",
            &["line 22", "`1.15 mm` is in m", "in N"],
        ),
        ("\"x above 2 mm\"", "\"x above 2 N\"", &["line 9", "`2 N`"]),
        ("to 10 mm in", "to 10 N in", &["steps are in m"]),
        (
            "\"wait 20 ms\", \"to",
            "\"rest 20 ms\", \"to",
            &["line 5", "is no step", "wait 100 ms"],
        ),
        (
            "within = \"5 mN\"",
            "at_most = \"2 N\"",
            &["contradict each other"],
        ),
        (
            bounds,
            "at_least = \"2 N\"\nat_most = \"1 N\"",
            &["nothing can be both"],
        ),
        (bounds, "is = \"1.15 N\"", &["`is` needs `within`"]),
        (bounds, "", &["needs a bound"]),
        ("from = \"t1\"", "from = \"t9\"", &["no instant `t9`"]),
        (
            "until = \"t2 + 80 ms\"",
            "until = \"t1\"",
            &["`t1`, which is not after `t1`"],
        ),
        (
            "greatest = \"spring\"",
            "count = \"note\"\nevery = \"x\"",
            &["two assertions"],
        ),
        ("greatest =", "biggest =", &["[[assert]] has no `biggest`"]),
        (
            "greatest = \"spring\"",
            "greatest = \"contacts\"",
            &["is a machine"],
        ),
        (
            "greatest = \"spring\"",
            "peaks = \"spring\"",
            &["needs `over`"],
        ),
        (
            "states = [",
            "lines = [",
            &["is a machine: list it in `states`"],
        ),
        (
            "motion = ",
            "force = [\"to 1 N in 1 s\"]\nmotion = ",
            &["contradict each other"],
        ),
        (
            "motion = ",
            "hand = \"soft\"\nmotion = ",
            &["a hand is `free`"],
        ),
        (
            "program = \"hammond\"",
            "program = \"hamond\"",
            &["did you mean `hammond`"],
        ),
        (
            "program = \"hammond\"",
            "program = \"gone.whip\"",
            &["gone.whip", "no such file"],
        ),
        (
            "title = \"A key\"",
            "title = 7",
            &["line 1", "made of strings"],
        ),
        ("[plot]", "[plot", &["line 15"]),
        ("[[assert]]", "[assert]", &["a list of tables"]),
    ];
    let shell = Shell::new().with("small.toml", SMALL);
    shell.ends(0, &["experiment", "small.toml"]);
    for (from, to, words) in cases {
        assert!(SMALL.contains(from), "{from}");
        let shell = Shell::new().with("wrong.toml", &SMALL.replacen(from, to, 1));
        println!("{to}");
        shell.refuses(2, &["experiment", "wrong.toml", "--plot", "p.svg"], words);
    }
    shell.refuses(
        2,
        &["experiment", "figure-99"],
        &["no experiment `figure-99`", "figure-16"],
    );
    shell.refuses(
        2,
        &["experiment", "all", "--plot", "p.svg"],
        &["--pictures"],
    );
    shell.refuses(2, &["experiment", "--json"], &["name an experiment"]);
}

#[test]
fn nothing_that_is_read_is_overwritten_and_what_fails_is_drawn() {
    let shell = Shell::new().with("small.toml", SMALL);
    shell.refuses(
        2,
        &["experiment", "small.toml", "--report", "small.toml"],
        &["--report", ".html"],
    );
    shell.refuses(
        2,
        &["experiment", "small.toml", "small.toml", "--pictures", "."],
        &["--pictures", "small.svg"],
    );
    shell.refuses(
        2,
        &["experiment", "small.toml", "--pictures", "none"],
        &["no folder"],
    );
    let wrong = SMALL.replace("1.15 N", "1.25 N");
    let shell = shell.with("small.toml", &wrong);
    let (out, _) = shell.ends(1, &["experiment", "small.toml", "--plot", "p.svg"]);
    assert!(
        out.contains(
            "FAILED  greatest spring is 1.25 N within 5 mN from t1 until t2 + 80 ms: 1.15"
        ),
        "{out}"
    );
    assert!(shell.path("p.svg").exists());
}

#[test]
fn an_instant_that_never_comes_fails() {
    let never = SMALL.replace("x above 2 mm", "x above 10.2 mm");
    let shell = Shell::new().with("never.toml", &never);
    let (out, _) = shell.ends(1, &["experiment", "never.toml"]);
    assert!(
        out.contains("FAILED  instant t1: x above 10.2 mm: it never comes"),
        "{out}"
    );
    assert!(out.contains("t1 never comes"), "{out}");
}
