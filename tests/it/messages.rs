//! Messages at the command line: pages, JSON, files that are no programs.

use std::path::Path;
use std::process::Command;

use tempfile::TempDir;

/// Runs in a folder with these files; exit code, stdout, stderr.
fn whippen(files: &[(&str, &[u8])], args: &[&str]) -> (Option<i32>, String, String) {
    let folder = TempDir::new().expect("a temporary folder");
    for (name, bytes) in files {
        std::fs::write(folder.path().join(name), bytes).expect("writable");
    }
    run_in(folder.path(), args)
}

fn run_in(folder: &Path, args: &[&str]) -> (Option<i32>, String, String) {
    let mut command = Command::new(env!("CARGO_BIN_EXE_whippen"));
    let output = command
        .args(args)
        .current_dir(folder)
        .output()
        .expect("the command starts");
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    (
        output.status.code(),
        text(&output.stdout),
        text(&output.stderr),
    )
}

const SPRING: &str = "instrument spring {\n    sense x: length in 0 mm .. 10 mm over 1 ms\n    force f = 75 N/m * x\n}\n";

#[test]
fn pages_are_found_and_listed() {
    for name in ["WH0203", "wh0203", "203", "unknown-term"] {
        let (code, out, _) = whippen(&[], &["explain", name]);
        assert_eq!(code, Some(0));
        assert!(
            out.starts_with("WH0203: ") && out.contains("    let jack = escapement(x"),
            "{out}"
        );
        assert!(!out.contains("```"), "{out}");
    }
    // Without a terminal pages have 80 columns; programs keep their lines.
    let (_, out, _) = whippen(&[], &["explain", "WH0203"]);
    let prose = out.lines().filter(|line| !line.starts_with("    "));
    assert!(
        prose.clone().all(|line| line.chars().count() <= 80),
        "{out}"
    );
    assert!(prose.clone().any(|line| line.chars().count() > 60), "{out}");
    let (code, out, _) = whippen(&[], &["explain"]);
    assert!(
        code == Some(0) && out.contains("WH0611  no-force") && out.contains("Ranges and numbers\n"),
        "{out}"
    );
    let (code, _, err) = whippen(&[], &["explain", "unkown-term"]);
    assert!(
        code == Some(2) && err.contains("did you mean WH0203 (unknown-term)?"),
        "{err}"
    );
}

#[test]
fn the_page_is_pointed_at_once() {
    let text = SPRING.replace("75 N/m * x", "y + z");
    let (code, _, err) = whippen(&[("a.whip", text.as_bytes())], &["check", "a.whip"]);
    assert_eq!(
        (code, err.matches("help: whippen explain WH0201").count()),
        (Some(1), 1),
        "{err}"
    );
}

#[test]
fn diagnostics_are_json_lines() {
    let text = SPRING.replace(
        "force f = 75 N/m * x",
        "force f = 75 N/m * spede\n    let speed = x",
    );
    let (code, out, err) = whippen(
        &[("a.whip", text.as_bytes())],
        &["check", "a.whip", "--json"],
    );
    assert_eq!((code, err.as_str()), (Some(1), ""), "{out}");
    let values: Vec<serde_json::Value> = out
        .lines()
        .map(|l| serde_json::from_str(l).expect("JSON"))
        .collect();
    let [d] = &values[..] else { panic!("{out}") };
    assert_eq!(d["code"], "WH0201");
    assert_eq!(d["severity"], "error");
    assert_eq!(
        (
            &d["place"]["file"],
            &d["place"]["start"]["line"],
            &d["place"]["start"]["column"]
        ),
        (&"a.whip".into(), &3.into(), &24.into())
    );
    let suggestion = &d["suggestions"][0];
    let byte = |end: &str| suggestion[end]["byte"].as_u64().expect("a number") as usize;
    let mended = format!(
        "{}{}{}",
        &text[..byte("start")],
        suggestion["replacement"].as_str().expect("text"),
        &text[byte("end")..]
    );
    assert!(mended.contains("75 N/m * speed\n"), "{mended}");
}

#[test]
fn numbers_are_json_too() {
    let (code, out, _) = whippen(
        &[("a.whip", SPRING.as_bytes())],
        &["check", "a.whip", "--numbers", "--json"],
    );
    let value: serde_json::Value = serde_json::from_str(out.trim()).expect("one line of JSON");
    assert_eq!(
        (code, &value["kind"], &value["instrument"]),
        (Some(0), &"numbers".into(), &"spring".into())
    );
    let force = value["values"]
        .as_array()
        .expect("a list")
        .iter()
        .find(|v| v["name"] == "f")
        .expect("the force");
    assert!(
        force["high"]
            .as_f64()
            .is_some_and(|high| (high - 0.75).abs() < 1e-3)
            && force["unit"] == "N",
        "{force}"
    );
}

#[test]
fn marks_of_editors_do_no_harm() {
    let windows = SPRING.replace('\n', "\r\n");
    for text in [
        format!("\u{feff}{SPRING}"),
        windows,
        SPRING.replace("    ", "\t"),
    ] {
        let (code, out, err) = whippen(&[("a.whip", text.as_bytes())], &["check", "a.whip"]);
        assert_eq!(
            (code, out.as_str(), err.as_str()),
            (Some(0), "spring: ok\n", "")
        );
    }
    let wrong = SPRING
        .replace("75 N/m * x", "75 N/m * y")
        .replace('\n', "\r\n");
    let (code, _, err) = whippen(&[("a.whip", wrong.as_bytes())], &["check", "a.whip"]);
    assert!(
        code == Some(1) && err.contains("a.whip:3:24") && !err.contains('\r'),
        "{err}"
    );
}

#[test]
fn what_is_no_program_is_told() {
    let binary: Vec<u8> = (0..=255).collect();
    let (code, _, err) = whippen(&[("a.whip", &binary)], &["check", "a.whip"]);
    assert!(code == Some(2) && err.contains("is not text"), "{err}");
    let (code, _, err) = whippen(&[], &["check", "."]);
    assert!(code == Some(2) && err.contains("is a directory"), "{err}");
    let (code, out, _) = whippen(&[("a.whip", b"")], &["check", "a.whip"]);
    assert!(code == Some(0) && out.contains("no instrument"), "{out}");
}

#[test]
fn half_of_a_pair_and_wrong_endings_are_told() {
    let files: &[(&str, &[u8])] = &[("a.whip", SPRING.as_bytes()), ("k.csv", b"t_s;x_mm\n0;1\n")];
    let (code, _, err) = whippen(files, &["run", "a.whip", "--rest", "1mm"]);
    assert!(
        code == Some(2) && err.contains("`--rest` and `--full` belong together"),
        "{err}"
    );
    let (code, _, err) = whippen(files, &["run", "a.whip", "--out", "trace.png"]);
    assert!(code == Some(2) && err.contains("ends in `.csv`"), "{err}");
    let (code, _, err) = whippen(files, &["run", "a.whip", "--motion", "k.csv"]);
    assert!(
        code == Some(2) && err.contains("cells are separated by commas"),
        "{err}"
    );
}
