//! A tool that is taken away: the test that asks for it counts as skipped, or fails.
//!
//! This binary runs one of its own tests again, with a search path that holds nothing, and gives
//! what comes out to `tests/summary`, which makes the last line of `tests/run`.

use std::path::Path;
use std::process::{Command, Output};

use crate::skip::is_required;
use crate::{asked, count, table, tool};

/// The test that is run again; elsewhere it finds what it asks for.
const ASKS: &str = "tests::bash_is_found";

#[test]
fn bash_is_found() {
    let Some(bash) = tool("bash") else { return };
    let said = Command::new(bash).args(["-c", "echo here"]).output();
    assert_eq!(said.expect("bash starts").stdout, b"here\n");
}

/// [`ASKS`] where no program is, with what is required; skips go to a file of the folder.
fn deprived(folder: &Path, required: &str) -> Output {
    Command::new(std::env::current_exe().expect("this binary"))
        .args(["--exact", ASKS, "--test-threads=2"])
        .env("PATH", folder)
        .env("WHIPPEN_SKIPS", folder.join("skips"))
        .env("WHIPPEN_REQUIRE", required)
        .output()
        .expect("this binary starts")
}

/// What `tests/summary` prints of a run.
fn summary(folder: &Path, log: &[u8]) -> String {
    std::fs::write(folder.join("log"), log).expect("writable");
    if !folder.join("skips").exists() {
        std::fs::write(folder.join("skips"), "").expect("writable");
    }
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("../summary");
    let output = Command::new(script)
        .arg(folder.join("log"))
        .arg(folder.join("skips"))
        .output()
        .expect("the summary starts");
    String::from_utf8(output.stdout).expect("UTF-8")
}

#[test]
fn a_test_without_its_tool_counts_as_skipped() {
    let folder = tempfile::tempdir().expect("a folder");
    let run = deprived(folder.path(), "");
    assert!(run.status.success(), "{run:?}");
    let skips = std::fs::read_to_string(folder.path().join("skips")).expect("a record");
    assert!(
        skips.ends_with("\ttests::bash_is_found\tbash\tDebian: bash\n")
            && skips.lines().count() == 1,
        "{skips}"
    );
    let summary = summary(folder.path(), &run.stdout);
    assert!(
        summary.contains("tests::bash_is_found needs bash (Debian: bash)"),
        "{summary}"
    );
    assert!(
        summary.ends_with("\n0 passed, 0 failed, 1 skipped\n"),
        "{summary}"
    );
}

#[test]
fn a_test_without_a_tool_that_is_required_fails() {
    for required in ["bash", "tools", "all", "recordings, bash"] {
        let folder = tempfile::tempdir().expect("a folder");
        let run = deprived(folder.path(), required);
        let said = String::from_utf8_lossy(&run.stdout).into_owned();
        assert!(!run.status.success(), "{required}: {said}");
        assert!(
            said.contains("bash is required and absent: install Debian: bash"),
            "{said}"
        );
        let summary = summary(folder.path(), &run.stdout);
        assert_eq!(summary, "0 passed, 1 failed, 0 skipped\n", "{required}");
    }
}

#[test]
fn what_is_not_named_is_not_required() {
    for list in ["", "recordings", "gcc", "bashful"] {
        assert!(!is_required(list, "bash", "tools"), "{list}");
    }
    assert!(is_required("tools,recordings", "bash", "tools"));
}

#[test]
fn the_summary_adds_up_all_binaries() {
    let folder = tempfile::tempdir().expect("a folder");
    // Two tests lack something, one of them twice; one that lacks something fails all the same.
    let skips = "p\ta\tone\tgcc\tDebian: gcc\np\ta\tone\tclang\tDebian: clang\n\
                 p\tb\ttwo\tgcc\tDebian: gcc\np\tb\tthree\tgcc\tDebian: gcc\n";
    std::fs::write(folder.path().join("skips"), skips).expect("writable");
    let log = "...\ntest result: ok. 5 passed; 0 failed; 2 ignored; 0 measured; 0 filtered out\n\
               ..F\nfailures:\n\n---- three stdout ----\npassed\n\nfailures:\n    three\n\n\
               test result: FAILED. 7 passed; 1 failed; 0 ignored; 0 measured; 0 filtered out\n";
    let summary = summary(folder.path(), log.as_bytes());
    let last = summary.lines().last().expect("a line");
    assert_eq!(last, "10 passed, 1 failed, 4 skipped");
}

#[test]
fn the_table_names_each_tool_once_and_what_brings_it() {
    let names: Vec<&str> = table().iter().map(|tool| tool.name()).collect();
    let distinct: std::collections::BTreeSet<&&str> = names.iter().collect();
    assert!(
        names.len() > 10 && names.len() == distinct.len(),
        "{names:?}"
    );
    for tool in table() {
        assert!(!tool.packages.is_empty(), "{}", tool.name());
    }
}

/// Cargo sets variables for tests, of which one is a number.
#[test]
fn a_count_is_asked_for_or_usual() {
    let patch: u64 = env!("CARGO_PKG_VERSION_PATCH").parse().expect("a number");
    assert_eq!(count("CARGO_PKG_VERSION_PATCH", patch + 7), patch);
    assert_eq!(count("WHIPPEN_NEVER_SET", 7), 7);
    assert_eq!(asked::<u64>("WHIPPEN_NEVER_SET"), None);
}

#[test]
#[should_panic(expected = "CARGO_PKG_NAME=whippen-need is no count")]
fn what_is_no_count_is_not_the_usual_one() {
    count("CARGO_PKG_NAME", 7_u64);
}
