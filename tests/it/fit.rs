//! `whippen fit`: known truth is found again, and what data do not show is said.

use serde_json::Value;

use crate::cli::{Shell, bundled};

const SPRING: &str = "\
instrument spring {
    sense x: length in -0.5 mm .. 10.5 mm over 1.5 ms
    param k = 80 N/m in 50 N/m .. 150 N/m       // stays as it is
    param preload = 0.3 N in 0 N .. 1 N
    param B = 1 N*s/m in 0.1 N*s/m .. 4 N*s/m
    param depth = 7 mm in 2 mm .. 9 mm
    param more = 0 N in 0 N .. 1 N
    event bottom when x > depth { emit note(speed: x') }
    force spring = k * x + preload + more
    force damper = B * x'
}
";

const TRUTH: [(&str, f64, &str); 3] = [
    ("k", 97.0, "N/m"),
    ("preload", 0.42, "N"),
    ("B", 2.2, "N*s/m"),
];

/// A folder with the program and a recording of it with other values, and tables of its events.
fn shell() -> Shell {
    let shell = Shell::new().with("spring.whip", SPRING);
    let set = |(name, value, unit): &(&str, f64, &str)| format!("{name}={value}{unit}");
    let sets: Vec<String> = TRUTH.iter().map(set).collect();
    let mut args = vec![
        "run",
        "spring.whip",
        "--out",
        "true.csv",
        "--every",
        "22",
        "--seconds",
        "2.4",
    ];
    args.extend(["--columns", "x,force", "--events", "events.csv"]);
    args.extend(["--set", "depth=5.5mm"]);
    sets.iter().for_each(|set| args.extend(["--set", set]));
    shell.ends(0, &args);
    shell
}

/// The recording with noise of 0.05 N on the force.
fn noisy(shell: &Shell, seed: u64) -> String {
    let lines = shell.lines("true.csv");
    // SplitMix64.
    let mut state = seed << 32;
    let mut uniform = || {
        state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mixed = (state ^ (state >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((mixed ^ (mixed >> 31)) >> 11) as f64 / (1u64 << 53) as f64
    };
    let mut text = "t_s,x_mm,force_mn,note\n".to_string();
    for line in &lines[1..] {
        let cells: Vec<f64> = line
            .split(',')
            .map(|c| c.parse().expect("a number"))
            .collect();
        // Nearly a normal distribution, of a spread of 1.
        let noise = (0..12).map(|_| uniform()).sum::<f64>() - 6.0;
        let [t_s, x_m, force_n] = cells[..] else {
            panic!("{line}")
        };
        text += &format!("{t_s},{},{},1\n", 1e3 * x_m, 1e3 * (force_n + 0.05 * noise));
    }
    text
}

fn fitted(shell: &Shell, args: &[&str]) -> Value {
    let (out, _) = shell.ends(0, &[&["fit", "spring.whip", "--json"], args].concat());
    serde_json::from_str(&out).expect("JSON")
}

fn value(found: &Value, name: &str, what: &str) -> f64 {
    let value = &found["values"][name][what];
    value
        .as_f64()
        .unwrap_or_else(|| panic!("{name} {what}: {value}"))
}

/// `WHIPPEN_SEEDS=100 cargo test --test it truth_is_within` looks longer.
#[test]
fn truth_is_within_the_stated_confidence() {
    let seeds = whippen_need::count("WHIPPEN_SEEDS", 5_u64);
    let mut shell = shell();
    let mut inside = [0; TRUTH.len()];
    for seed in 0..seeds {
        let text = noisy(&shell, seed);
        shell = shell.with("noisy.csv", &text);
        let found = fitted(&shell, &["--free", "k,preload,B", "--data", "noisy.csv"]);
        assert_eq!(found["end"], "converged");
        for (inside, (name, truth, _)) in inside.iter_mut().zip(TRUTH) {
            let error = (value(&found, name, "value") - truth).abs();
            *inside += u64::from(error <= value(&found, name, "half_width"));
            assert!(error < 4.0 * value(&found, name, "half_width"), "{found}");
        }
    }
    println!("of {seeds} seeds within 95 %: {inside:?} of {TRUTH:?}");
    // Few seeds say little of one parameter.
    let all: u64 = inside.iter().sum();
    assert!(5 * all >= 4 * 3 * seeds, "{inside:?} of {seeds}");
    let enough = |inside: &u64| seeds < 50 || 10 * inside >= 9 * seeds;
    assert!(inside.iter().all(enough), "{inside:?} of {seeds}");
}

#[test]
fn values_are_written_into_the_program_and_used() {
    let mut shell = shell();
    let text = noisy(&shell, 3);
    shell = shell.with("noisy.csv", &text);
    let args = [
        "fit",
        "spring.whip",
        "--free",
        "k,B",
        "--set",
        "preload=0.42N",
        "--data",
        "noisy.csv",
        "--held-out",
        "true.csv",
        "--out",
        "fitted.whip",
        "--plot",
        "fit.svg",
    ];
    let (first, err) = shell.ends(0, &args);
    assert!(err.contains("`note` are no columns of a run"), "{err}");
    assert!(
        first.contains("k            9") && first.contains("(was 80 N/m)"),
        "{first}"
    );
    assert!(
        first.contains("held out") && first.contains("in fixed point"),
        "{first}"
    );
    let fitted = shell.lines("fitted.whip").join("\n");
    assert!(
        fitted.contains("in 50 N/m .. 150 N/m       // stays as it is"),
        "{fitted}"
    );
    assert!(
        fitted.contains("preload = 0.42 N in") && !fitted.contains("k = 80"),
        "{fitted}"
    );
    shell.ends(0, &["check", "fitted.whip"]);
    // The same command gives the same bytes.
    let drawn = shell.lines("fit.svg");
    let (again, _) = shell.ends(0, &args);
    assert_eq!(again, first);
    assert_eq!(shell.lines("fit.svg"), drawn);
    assert_eq!(shell.lines("fitted.whip").join("\n"), fitted);
}

/// One processor or all, with generations and several recordings.
#[test]
fn a_fit_is_the_same_on_any_number_of_processors() {
    let Some(taskset) = whippen_need::tool("taskset") else {
        return;
    };
    let shell = shell();
    let text = [1, 2].map(|seed| noisy(&shell, seed));
    let shell = shell.with("a.csv", &text[0]).with("b.csv", &text[1]);
    let args =
        "fit spring.whip --free k,B --data a.csv --data b.csv --global 2 --engine jit --json";
    let args: Vec<&str> = args.split(' ').collect();
    let (all, _) = shell.ends(0, &args);
    let alone = std::process::Command::new(taskset)
        .args(["-c", "0", env!("CARGO_BIN_EXE_whippen")])
        .args(&args)
        .current_dir(shell.path(""))
        .output()
        .expect("it starts");
    assert_eq!(String::from_utf8_lossy(&alone.stdout), all);
}

#[test]
fn what_the_data_do_not_show_is_said() {
    let mut shell = shell();
    let text = noisy(&shell, 5);
    shell = shell.with("noisy.csv", &text);
    let run = |free: &str| {
        let args = ["fit", "spring.whip", "--free", free, "--data", "noisy.csv"];
        shell.ends(0, &args).0
    };
    // A force that is always added is a preload by another name.
    let both = run("preload,more");
    assert!(
        both.contains("preload, more can all change together"),
        "{both}"
    );
    assert_eq!(both.matches("not shown by the data").count(), 2, "{both}");
    // No column hears of strikes.
    let deep = run("k,depth");
    assert_eq!(deep.matches("not shown by the data").count(), 1, "{deep}");
    let bound = run("k=50N/m..70N/m");
    assert!(
        bound.contains("70 ± ") && bound.contains("at its bound"),
        "{bound}"
    );
}

#[test]
fn strikes_show_where_they_are() {
    let shell = shell();
    let free = [
        "--free",
        "depth",
        "--data",
        "true.csv",
        "--events",
        "events.csv",
    ];
    let found = fitted(&shell, &[&free[..], &["--global", "8"]].concat());
    let depth_m = value(&found, "depth", "value");
    assert!((depth_m - 5.5e-3).abs() < 0.02e-3, "{found}");
    let left = found["left"].as_array().expect("parts");
    let events = left
        .iter()
        .find(|part| part["column"] == "events")
        .expect("events");
    let [before, after] = ["before", "after"].map(|when| events[when].as_f64().expect("a number"));
    assert!(after < 0.1 * before, "{events}");
}

#[test]
fn recordings_have_weights_and_losses_forgive() {
    let mut shell = shell();
    // One recording is of a spring that is softer by 20 N/m.
    let soft: String = (noisy(&shell, 1).lines().enumerate())
        .map(
            |(row, line)| match (row, &line.split(',').collect::<Vec<_>>()[..]) {
                (0, _) => format!("{line}\n"),
                (_, [t, x, f, n]) => {
                    let [x_mm, f_mn] = [x, f].map(|text| text.parse::<f64>().expect("a number"));
                    format!("{t},{x},{},{n}\n", f_mn - 20.0 * x_mm)
                }
                _ => panic!("{line}"),
            },
        )
        .collect();
    let hard = noisy(&shell, 2);
    // And one has spikes.
    let spiked: String = (hard.lines().enumerate())
        .map(|(row, line)| match row % 10 {
            // A deep spike while the key is down.
            5 if line.contains(",9.") || line.contains(",10") => {
                let cells: Vec<&str> = line.split(',').collect();
                format!("{},{},-3000,1\n", cells[0], cells[1])
            }
            _ => format!("{line}\n"),
        })
        .collect();
    shell = shell
        .with("soft.csv", &soft)
        .with("hard.csv", &hard)
        .with("spiked.csv", &spiked);
    let k = |args: &[&str]| {
        value(
            &fitted(&shell, &[&["--free", "k,preload,B"], args].concat()),
            "k",
            "value",
        )
    };
    let both = ["--data", "hard.csv", "--data", "soft.csv"];
    let even = k(&both);
    assert!((86.0..88.0).contains(&even), "{even}");
    let uneven = k(&[&both[..], &["--weights", "9,1"]].concat());
    assert!((94.0..96.0).contains(&uneven), "{uneven}");
    let squares = k(&["--data", "spiked.csv"]);
    let cauchy = k(&["--data", "spiked.csv", "--loss", "cauchy:0.1"]);
    assert!(
        (cauchy - 97.0).abs() < 2.0 && (squares - 97.0).abs() > 10.0,
        "{squares} {cauchy}"
    );
}

#[test]
fn bare_columns_are_described() {
    let mut shell = shell();
    // Two columns of readings: half the force, of which 1.2 N can be read, and a hundred counts a
    // millimetre from 7.
    let lines = shell.lines("true.csv");
    let rows: Vec<Vec<f64>> = (lines[1..].iter())
        .map(|line| {
            line.split(',')
                .map(|c| c.parse().expect("a number"))
                .collect()
        })
        .collect();
    let rate_hz = (1.0 / (rows[1][0] - rows[0][0])).round();
    let bare: String = (rows.iter())
        .map(|row| format!("{} {}\n", row[2].min(1.2) / 2.0, 7.0 + 1e5 * row[1]))
        .collect();
    let description = format!(
        "file = \"bare.txt\"\nrate = \"{rate_hz} Hz\"\n\
         [motion]\ncolumn = 2\ncalibration = \"key.csv\"\n\
         [measured.force_n]\ncolumn = 1\ntimes = \"2\"\nmost = \"1.2 N\"\n\
         [[stretch]]\nfrom = \"0 s\"\nto = \"1.9 s\"\n\
         [[stretch]]\nfrom = \"1.9 s\"\nto = \"2.3 s\"\nheld_out = \"yes\"\n"
    );
    shell = shell
        .with("bare.txt", &bare)
        .with("key.csv", "x_mm,reading\n-1,-93\n5,507\n11,1107\n")
        .with("bare.toml", &description);
    let found = fitted(&shell, &["--free", "k,preload,B", "--data", "bare.toml"]);
    for (name, truth, _) in TRUTH {
        // The rate is a whole number of hertz, and the truth's is not.
        assert!(
            (value(&found, name, "value") / truth - 1.0).abs() < 0.03,
            "{found}"
        );
    }
    assert!(
        found["held_out"][0]["after"].as_f64().expect("a number") < 0.05,
        "{found}"
    );
    let wrong = [
        (
            "column = 2",
            "column = 0",
            "`column` is a whole number, 1 or more",
        ),
        ("column = 2", "colum = 2", "did you mean `column`?"),
        (
            "[measured.force_n]",
            "[measured.x_m]",
            "`x_m` is no column that can be fitted to",
        ),
        ("\"2\"", "\"2 mm\"", "of another kind"),
        (
            "to = \"2.3 s\"",
            "to = \"9 s\"",
            "a stretch is within 0 s .. ",
        ),
        ("bare.txt", "none.txt", "none.txt"),
        ("= \"yes\"", "= \"maybe\"", "is \"yes\" or \"no\""),
        ("file = ", "file ", "line 1"),
    ];
    for (from, to, words) in wrong {
        assert!(description.contains(from), "{from}");
        shell = shell.with("bare.toml", &description.replace(from, to));
        let args = ["fit", "spring.whip", "--free", "k", "--data", "bare.toml"];
        shell.refuses(2, &args, &[words]);
    }
}

/// The strokes that are fitted and those that are judged are in `examples/fit/kawai.toml`.
#[test]
fn a_recording_of_a_grand_is_fitted() {
    let Some(folder) = whippen_need::recordings("kawai-grand") else {
        return;
    };
    let description = include_str!("../../examples/fit/kawai.toml");
    let file = |name: &str| std::fs::read_to_string(folder.join(name)).expect("readable");
    let mut shell = Shell::new().with("kawai.toml", description);
    for name in [
        "key_and_hammer_2kHz.txt",
        "calibration_key.csv",
        "calibration_hammer.csv",
    ] {
        shell = shell.with(name, &file(name));
    }
    let grand = bundled("grand-piano.whip");
    let free = "k=2kN/m..40kN/m,B_k";
    let (out, _) = shell.ends(0, &["fit", &grand, "--free", free, "--data", "kawai.toml"]);
    println!("{out}");
    // Each stretch has a row of what is left, and one of its stroke.
    assert_eq!(out.matches("kawai.toml ").count(), 12, "{out}");
    assert_eq!(out.matches("strikes as often in 20 of 20").count(), 5);
    assert!(out.contains("strokes that were not fitted"), "{out}");
    // The full action as it is bundled: within the goal, and better than the key's speed alone.
    let action = bundled("grand-action.whip");
    let free = "capstan=0.5499..0.5501";
    let args = ["fit", &action, "--free", free, "--data", "kawai.toml"];
    let (out, _) = shell.ends(0, &[&args[..], &["--json"]].concat());
    let found: Value = serde_json::from_str(&out).expect("JSON");
    let strokes = &found["strokes"];
    let [error, of_key] = ["error", "key_error"].map(|name| strokes[name].as_f64().expect("it"));
    assert!(error < 0.05 && error < of_key, "{strokes}");
    for stroke in strokes["all"].as_array().expect("strokes") {
        let late_s = stroke["late_s"].as_f64().unwrap_or(0.0);
        assert!(stroke["as_often"] == 20 && late_s.abs() <= 5e-3, "{stroke}");
        // A slow press, which does not strike, has no path on its way.
        if stroke["held_out"] == true && stroke["late_s"].is_number() {
            let path_m = stroke["path"].as_f64().expect("a path");
            assert!(path_m <= 3e-3, "{stroke}");
        }
    }
}

#[test]
fn mistakes_are_told() {
    let shell = shell()
        .with("motion.csv", "t_s,x_mm\n0,0\n0.1,1\n0.2,2\n")
        .with("other.csv", "t_s,x_mm,f_n\n0,0,1\n0.1,1,2\n0.2,2,3\n");
    let refuses = |args: &[&str], words: &[&str]| {
        shell.refuses(2, &[&["fit", "spring.whip"], args].concat(), words);
    };
    let data = ["--data", "true.csv"];
    let with = |more: &[&'static str]| [more, &data].concat();
    refuses(
        &with(&["--free", "q"]),
        &["no parameter `q`; it has k, preload"],
    );
    refuses(&with(&["--free", "k,k"]), &["named twice"]);
    refuses(
        &with(&["--free", "k=1N/m..60N/m"]),
        &["its range in the program is 50 N/m"],
    );
    refuses(&with(&["--free", "k=60N..70N"]), &["not in N/m"]);
    refuses(
        &with(&["--free", "k=60N/m..70N/m:3"]),
        &["leave the count away"],
    );
    refuses(
        &with(&["--free", "k", "--set", "k=70N/m"]),
        &["free and set"],
    );
    refuses(
        &with(&["--free", "k", "--columns", "x_m"]),
        &["`x_m` is no column that can be fitted"],
    );
    refuses(
        &with(&["--free", "k", "--weights", "1,2"]),
        &["--weights: there are 1 recordings"],
    );
    refuses(&with(&["--free", "k", "--weights", "0"]), &["above 0"]);
    refuses(
        &with(&["--free", "k", "--loss", "hub"]),
        &["squares, soft-l1, huber, cauchy"],
    );
    refuses(
        &with(&["--free", "k", "--out", "spring.whip"]),
        &["spring.whip"],
    );
    refuses(
        &with(&["--free", "k", "--events", "other.csv"]),
        &["`t_s` and `event`"],
    );
    refuses(
        &["--free", "k", "--data", "motion.csv"],
        &["there is only a motion"],
    );
    refuses(
        &["--free", "k", "--data", "other.csv"],
        &["`f_n` are no columns", "--as f_n="],
    );
    refuses(&["--free", "k", "--data", "none.csv"], &["none.csv"]);
    refuses(
        &with(&["--free", "k", "--engine", "emulated"]),
        &["--engine jit"],
    );
    let named = ["--free", "k", "--data", "other.csv", "--as", "f_n=force_n"];
    let (_, err) = shell.ends(0, &[&["fit", "spring.whip"], &named[..]].concat());
    assert_eq!(err, "");
}
