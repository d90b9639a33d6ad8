//! `whippen budget`: what it says, and how it ends.

use serde_json::Value;
use whippen_compiler::diag::Code;

use crate::cli::Shell;

const SPRING: &str = "/// A spring.
instrument spring {
    sense x: length in -0.5 mm .. 10.5 mm over 0.7 ms
    states half {
        up   -> down when x > 5 mm
        down -> up   when x < 4 mm
    }
    force push = if half is down then 60 N/m * x else 80 N/m * x
}
";

fn shell() -> Shell {
    Shell::new().with("spring.whip", SPRING)
}

/// What `--json` prints.
fn json(shell: &Shell, code: i32, args: &[&str]) -> Value {
    let all = [&["budget", "spring.whip", "--json"], args].concat();
    let (out, _) = shell.ends(code, &all);
    serde_json::from_str(&out).unwrap_or_else(|error| panic!("{error}: {out}"))
}

#[test]
fn a_budget_that_fits_says_what_is_left() {
    let shell = shell();
    let (out, _) = shell.ends(0, &["budget", "spring.whip", "--keys", "20"]);
    for words in [
        "20 keys at 44100 Hz, 3401 cycles a tick at 150 MHz: fits",
        "half is up",
        "half is down",
        "slack",
        "by declaration",
    ] {
        assert!(out.contains(words), "{words}: {out}");
    }
    assert!(out.contains("spring.whip:8"), "{out}");
}

#[test]
fn as_json_it_has_every_number() {
    let shell = shell();
    let found = json(&shell, 0, &["--keys", "21"]);
    assert_eq!(
        (&found["fits"], &found["period_cycles"]),
        (&Value::Bool(true), &Value::from(3401))
    );
    let key = found["key"]["cycles_max"].as_u64().expect("cycles");
    let items = found["key"]["by_item"].as_object().expect("items");
    assert_eq!(
        items.values().filter_map(Value::as_u64).sum::<u64>(),
        key,
        "the declarations share all cycles"
    );
    assert!(items.contains_key("force push"), "{items:?}");
    let lines = found["key"]["worst_path"].as_array().expect("lines");
    let of_spring = |line: &&Value| line["file"] == "spring.whip" && line["line"] == 8;
    let spring = lines.iter().find(of_spring);
    assert!(
        spring
            .is_some_and(|line| line["item"] == "force push" && line["cycles"].as_u64() > Some(0)),
        "{lines:?}"
    );
    let cores = found["cores"].as_array().expect("cores");
    assert_eq!(
        cores
            .iter()
            .map(|core| core["keys"].as_u64().expect("keys"))
            .collect::<Vec<_>>(),
        [11, 10]
    );
    for core in cores {
        let number = |name: &str| {
            core[name]
                .as_i64()
                .unwrap_or_else(|| panic!("{name}: {core}"))
        };
        assert_eq!(number("cycles_max") + number("slack_cycles"), 3401);
        let around: i64 = core["around_keys"]
            .as_object()
            .expect("parts")
            .values()
            .filter_map(Value::as_i64)
            .sum();
        assert_eq!(
            number("cycles_max"),
            around + number("keys") * key as i64 + number("contention_cycles_max"),
            "{core}"
        );
        let utilization = core["utilization"].as_f64().expect("a part");
        assert!((utilization - number("cycles_max") as f64 / 3401.0).abs() < 1e-12);
    }
    for name in ["stack_bytes_max", "flash_bytes", "ram_bytes"] {
        assert!(
            found[name].as_u64().is_some_and(|bytes| bytes > 32),
            "{name}: {found}"
        );
    }
    assert!(["rule", "estimate"].contains(&found["class"].as_str().expect("a class")));
}

#[test]
fn more_keys_cost_more_and_a_slower_rate_has_room() {
    let shell = shell();
    let cycles = |args: &[&str]| {
        json(&shell, 0, args)["cores"][0]["cycles_max"]
            .as_u64()
            .expect("cycles")
    };
    assert!(cycles(&["--keys", "30"]) > cycles(&["--keys", "28"]));
    let slow = json(&shell, 0, &["--keys", "30", "--rate", "22050"]);
    assert_eq!(slow["period_cycles"], 6802);
}

#[test]
fn the_most_keys_fit_and_one_more_does_not() {
    let shell = shell();
    let most = json(&shell, 0, &["--most-keys"])["keys"]
        .as_u64()
        .expect("keys");
    assert!(most > 40, "{most}");
    json(&shell, 0, &["--keys", &most.to_string()]);
    json(&shell, 1, &["--keys", &(most + 1).to_string()]);
}

#[test]
fn a_missed_deadline_points_at_lines_and_says_what_would_fit() {
    let shell = shell();
    let (out, err) = shell.ends(1, &["budget", "spring.whip", "--keys", "480"]);
    assert!(out.contains("does not fit"), "{out}");
    let most = json(&shell, 0, &["--most-keys"])["keys"]
        .as_u64()
        .expect("keys");
    assert!(
        err.contains(&format!("{most} keys fit as it is")),
        "what --most-keys finds: {most}, {err}"
    );
    for words in [
        "WH0701",
        "`spring` misses its deadline by",
        "keys fit as it is",
        "Hz",
        "MHz",
        "spring.whip:",
        "`force push`",
    ] {
        assert!(err.contains(words), "{words}: {err}");
    }
}

/// The page's program misses its deadline, and the other one does not.
#[test]
fn the_page_shows_its_mistake() {
    for (wrong, text) in Code::DeadlineMissed.examples() {
        let shell = Shell::new().with("page.whip", text);
        let (_, err) = shell.ends(i32::from(wrong), &["budget", "page.whip"]);
        assert_eq!(err.contains("WH0701"), wrong, "{err}");
    }
}

#[test]
fn every_program_of_a_keyboard_must_fit() {
    let two = "keyboard k {\n    rate 44100 Hz\n    keys A0 .. A1\n    programs spring, other\n}\n";
    let text = format!(
        "{SPRING}{}{two}",
        SPRING.replace("instrument spring", "instrument other")
    );
    let shell = Shell::new().with("both.whip", &text);
    let (out, _) = shell.ends(0, &["budget", "both.whip"]);
    assert!(
        out.contains("spring on rp2350: 13 keys") && out.contains("other on rp2350: 13 keys"),
        "{out}"
    );
    let (out, _) = shell.ends(0, &["budget", "both.whip", "other"]);
    assert!(
        !out.contains("spring on rp2350") && out.contains("other on rp2350"),
        "{out}"
    );
}

#[test]
fn what_cannot_be_proven_is_said() {
    let shell = shell();
    let budget = |args: &[&'static str]| [&["budget", "spring.whip"], args].concat();
    shell.refuses(
        2,
        &budget(&["--board", "stm32f4", "--keys", "300"]),
        &["300 keys on a core", "1 to 255"],
    );
    shell.refuses(
        2,
        &budget(&["--board", "rp2530"]),
        &["did you mean `rp2350`?"],
    );
    shell.refuses(
        2,
        &budget(&["--keys", "1"]),
        &["0 keys on a core", "2 to 510"],
    );
    shell.refuses(
        2,
        &budget(&["--keys", "600"]),
        &["300 keys on a core", "2 to 510"],
    );
    shell.refuses(
        2,
        &budget(&["--keys", "4", "--most-keys"]),
        &["cannot be used with"],
    );
}

/// The worst-case path as assembly: all its instructions, their cycles beside them.
#[test]
fn the_worst_case_path_can_be_written_out() {
    let shell = shell();
    let args = ["--keys", "20", "--path", "path.s"];
    let key = json(&shell, 0, &args)["key"]["cycles_max"]
        .as_u64()
        .expect("cycles");
    let lines = shell.lines("path.s");
    let cycles: u64 = lines
        .iter()
        .filter(|line| line.starts_with("        "))
        .filter_map(|line| line.rsplit(' ').next()?.parse::<u64>().ok())
        .sum();
    assert_eq!(cycles, key, "{lines:?}");
}
