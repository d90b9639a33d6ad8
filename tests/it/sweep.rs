//! `whippen sweep`, and what serves other schedulers: `run --set-json .. --json`.

use serde_json::Value;

use crate::cli::{Shell, bundled};

const SPRING: &str = "\
instrument spring {
    sense x: length in -0.5 mm .. 10.5 mm
    param k = 80 N/m in 50 N/m .. 150 N/m
    param preload = 0.4 N in 0 N .. 1 N
    param loud = on
    event bottom when x > 8 mm and loud { emit note(speed: x') }
    force spring = k * x + preload
}
";

fn shell() -> Shell {
    Shell::new().with("spring.whip", SPRING)
}

fn numbers(line: &str) -> Vec<f64> {
    let cells = line.split(',');
    cells.map(|cell| cell.parse().unwrap_or(f64::NAN)).collect()
}

#[test]
fn a_grid_measures_what_is_known_in_closed_form() {
    let shell = shell();
    let args = [
        "sweep",
        "spring.whip",
        "--over",
        "k=60N/m..120N/m:3",
        "--over",
        "preload=0N..1N:2",
        "--measure",
        "down_weight,let_off_travel,strikes",
        "--out",
        "table.csv",
        "--plot",
        "heat.svg",
    ];
    let (out, err) = shell.ends(0, &args);
    assert_eq!(err, "");
    let lines = shell.lines("table.csv");
    assert_eq!(
        lines[0],
        "k_n_per_m,preload_n,down_weight_n,let_off_travel_m,strikes"
    );
    let rows: Vec<Vec<f64>> = lines[1..].iter().map(|line| numbers(line)).collect();
    let places: Vec<(f64, f64)> = rows.iter().map(|row| (row[0], row[1])).collect();
    let known = [60.0, 90.0, 120.0].map(|k| [(k, 0.0), (k, 1.0)]);
    assert_eq!(places, known.concat());
    for row in &rows {
        // In the middle of the way: 5 mm.
        assert!((row[2] - (row[0] * 5e-3 + row[1])).abs() < 1e-3, "{row:?}");
        assert!(row[3].is_nan() && row[4] > 3.0, "{row:?}");
    }
    assert!(out.contains("none") && out.contains("table: table.csv"));
    assert!(
        shell
            .lines("heat.svg")
            .concat()
            .contains("down_weight_n over k and preload")
    );
    // Whatever the threads, the bytes are the same.
    let first = shell.lines("table.csv");
    shell.ends(0, &args);
    assert_eq!(shell.lines("table.csv"), first);
}

#[test]
fn sobol_points_are_those_of_their_seed() {
    let shell = shell();
    let table = |seed: &str| {
        let args = [
            "sweep",
            "spring.whip",
            "--over",
            "k=60N/m..120N/m",
            "--sobol",
            "8",
        ];
        let rest = [
            "--measure",
            "strikes",
            "--out",
            "t.csv",
            "--plot",
            "p.png",
            "--seed",
            seed,
        ];
        shell.ends(0, &[&args[..], &rest[..]].concat());
        shell.lines("t.csv")
    };
    let first = table("3");
    assert_eq!(first.len(), 9);
    let inside = |line: &String| (60.0..120.0).contains(&numbers(line)[0]);
    assert!(first[1..].iter().all(inside));
    assert_eq!(table("3"), first);
    assert_ne!(table("4"), first);
}

#[test]
fn what_cannot_be_swept_is_told() {
    let shell = shell();
    let refuses = |args: &[&str], words: &[&str]| {
        shell.refuses(2, &[&["sweep", "spring.whip"], args].concat(), words);
    };
    refuses(&[], &["--over"]);
    refuses(&["--over", "k=60N/m..120N/m:1"], &["one point is no sweep"]);
    refuses(
        &["--over", "K=60N/m..120N/m:2"],
        &["WH0221", "no parameter `K`"],
    );
    refuses(
        &["--over", "k=60N/m..200N/m:2"],
        &["WH0507", "outside its range"],
    );
    refuses(&["--over", "k=60N..80N:2"], &["WH0302", "N/m"]);
    refuses(&["--over", "k=60..80:2"], &["WH0303"]);
    refuses(&["--over", "k=60N/m..120N/m"], &["--sobol"]);
    refuses(
        &["--over", "k=60N/m..120N/m:2", "--sobol", "8"],
        &["leave the count away"],
    );
    refuses(
        &["--over", "k=60N/m..120N/m:2", "--set", "k=80N/m"],
        &["is swept and set"],
    );
    refuses(
        &["--over", "k=60N/m..120N/m:2", "--measure", "weight"],
        &["measured are down_weight"],
    );
    let knob = bundled("knob.whip");
    let over = ["--over", "height=1mN*m..2mN*m:2"];
    let args = [&["sweep", knob.as_str()], &over[..]].concat();
    shell.refuses(2, &args, &["turns", "down_weight"]);
    let args = [&args[..], &["--measure", "events"]].concat();
    assert!(shell.ends(0, &args).0.contains("events"));
}

#[test]
fn a_run_gives_one_line_for_other_schedulers() {
    let shell = shell();
    let set = r#"{"k": 9e1, "preload": "300mN", "loud": false}"#;
    let args = [
        "run",
        "spring.whip",
        "--set-json",
        set,
        "--json",
        "--out",
        "t.csv",
    ];
    let (out, err) = shell.ends(0, &args);
    // An event that never happens any more is warned of, on stderr.
    assert!(out.lines().count() == 1 && err.contains("WH0413"), "{err}");
    let object: Value = serde_json::from_str(&out).expect("JSON");
    assert_eq!(object["strikes"], 0);
    assert_eq!(object["set"]["preload"], "300mN");
    assert_eq!(object["files"]["out"][0], "t.csv");
    let greatest = shell.lines("t.csv")[1..]
        .iter()
        .map(|line| numbers(line)[1])
        .fold(0.0, f64::max);
    // 90 N/m over 10 mm, and 0.3 N.
    assert!((greatest - 1.2).abs() < 2e-3, "{greatest}");
    let (out, _) = shell.ends(0, &["run", "spring.whip", "--json"]);
    let object: Value = serde_json::from_str(&out).expect("JSON");
    assert_eq!(object["emitted"][0]["event"], "note");
    assert_eq!(object["emitted"][0]["count"], object["strikes"]);
}

#[test]
fn what_is_wrong_in_an_object_is_told() {
    let shell = shell();
    let refuses = |set: &str, words: &[&str]| {
        shell.refuses(
            2,
            &["run", "spring.whip", "--json", "--set-json", set],
            words,
        );
    };
    refuses("k=3", &["wanted is an object"]);
    refuses("[1]", &["wanted is an object"]);
    refuses(r#"{"k": null}"#, &["the value of `k`"]);
    refuses(r#"{"K": 80}"#, &["WH0221"]);
    refuses(r#"{"k": 8000}"#, &["WH0507"]);
    refuses(r#"{"k": "80"}"#, &["WH0303"]);
    refuses(r#"{"k": "80N"}"#, &["WH0302"]);
    refuses(r#"{"loud": 1}"#, &["loud"]);
}

/// What a sweep over a bow's place and press tells: the place, the press, slips a period and the
/// share of sticking.
fn bowed(shell: &Shell, over: [&str; 2], more: &[&str]) -> Vec<Vec<f64>> {
    let root = std::path::Path::new(env!("CARGO_MANIFEST_DIR"));
    let program = root.join("examples/schelleng/schelleng.whip");
    let program = program.to_str().expect("UTF-8");
    let mut args = vec!["sweep", program, "--over", over[0], "--over", over[1]];
    args.extend([
        "--measure",
        "slips_per_period,stick_share",
        "--out",
        "map.csv",
    ]);
    args.extend(more);
    shell.ends(0, &args);
    let table = std::fs::read_to_string(shell.path("map.csv")).expect("is written");
    assert!(
        table.starts_with("beta,press_n,slips_per_period,stick_share\n"),
        "{table}"
    );
    table.lines().skip(1).map(numbers).collect()
}

#[test]
fn a_bow_makes_helmholtz_s_motion_within_schelleng_s_limits() {
    let shell = Shell::new();
    let lines = ["--plot", "map.svg", "--line", "hardest,softest"];
    let over = ["beta=0.08..0.12:2", "press=0.3N..1.5N:2"];
    let map = bowed(&shell, over, &lines);
    for row in &map {
        let [beta, press, slips, stuck] = row[..] else {
            panic!("four columns")
        };
        let hardest = 2.0 * (2.0 * 0.32 * 293.6648 * 1.61e-3) * 0.1 / beta;
        if press < hardest {
            assert!((slips - 1.0).abs() < 0.02, "{row:?}");
            assert!((stuck - (1.0 - beta)).abs() < 0.05, "{row:?}");
        } else {
            assert!((slips - 1.0).abs() > 0.1, "{row:?}");
        }
    }
    assert!(map.iter().any(|row| row[1] < 0.5) && map.iter().any(|row| row[1] > 1.0));
    let picture = std::fs::read_to_string(shell.path("map.svg")).expect("is drawn");
    assert!(picture.contains("hardest") && picture.contains("softest"));
}

#[test]
fn a_line_over_a_map_is_a_value_of_the_program() {
    let root = std::path::Path::new(env!("CARGO_MANIFEST_DIR"));
    let program = root.join("examples/schelleng/schelleng.whip");
    let program = program.to_str().expect("UTF-8");
    for (line, told) in [
        ("hardes", "has no value `hardes`; did you mean `hardest`?"),
        ("sigma", "`sigma` is not of the kind of `press`"),
    ] {
        let args = [
            "sweep",
            program,
            "--over",
            "beta=0.1..0.2:2",
            "--over",
            "press=0.1N..1N:2",
            "--line",
            line,
            "--measure",
            "stick_share",
        ];
        Shell::new().refuses(2, &args, &["--line: ", told]);
    }
    let one = [
        "sweep",
        program,
        "--over",
        "beta=0.1..0.2:2",
        "--line",
        "hardest",
    ];
    Shell::new().refuses(2, &one, &["a line is drawn over a heat map"]);
}
