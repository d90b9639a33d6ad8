//! `--calibration` on the command line.

use crate::cli::Shell;

/// An image reads its sensors through a table, with what a board found built in.
#[test]
fn a_calibration_is_built_in() {
    let table = "key_mm,adc\n0,0\n2,0.1\n5,0.5\n10,0.9\n10.5,1\n";
    let tuned = "offset,gain\n4096,8192\n-1000000,9000\n";
    let shell = Shell::new()
        .with("table.csv", table)
        .with("tuned.csv", tuned)
        .with("half.csv", "offset,gain\n4096,0.5\n")
        .with("wild.csv", "offset,gain\n0,24577\n0,1\n")
        .with("other.csv", "gain,offset\n0,1\n");
    let hammond = crate::cli::bundled("hammond.whip");
    let with = |extra: &[&str]| -> Vec<String> {
        let build = [
            "build",
            &hammond,
            "--keys",
            "2",
            "--calibration",
            "table.csv",
        ];
        [&build[..], extra]
            .concat()
            .iter()
            .map(ToString::to_string)
            .collect()
    };
    let ends = |extra: &[&str], words: &[&str]| {
        let args = with(extra);
        let args: Vec<&str> = args.iter().map(String::as_str).collect();
        shell.refuses(2, &args, words);
    };
    let args = with(&["--full", "10mm", "--tuned", "tuned.csv", "-o", "a.elf"]);
    let args: Vec<&str> = args.iter().map(String::as_str).collect();
    let (_, err) = shell.ends(0, &args);
    assert!(
        err.contains("pieces of the calibration are at most"),
        "{err}"
    );
    ends(&["-o", "b.o"], &["--calibration is for whole images"]);
    ends(
        &["--full", "20mm", "-o", "b.elf"],
        &["20 mm is beyond the table"],
    );
    ends(
        &["--full", "0.5mm", "-o", "b.elf"],
        &["at least 1/16 is needed"],
    );
    let tuned = |file| ["--tuned", file, "-o", "b.elf"];
    ends(&tuned("half.csv"), &["0.5 is no whole number of 32 bits"]);
    ends(
        &tuned("wild.csv"),
        &["offset and gain of sensor 0 are out of range"],
    );
    ends(&tuned("other.csv"), &["`offset,gain`"]);
    ends(
        &["--tuned", "tuned.csv", "--keys", "3", "-o", "b.elf"],
        &["--keys"],
    );
}
