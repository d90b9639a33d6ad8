//! The command as its users meet it: what it prints, what it writes, how it ends.

use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

use tempfile::TempDir;
use whippen_compiler::bundled::INSTRUMENTS;

/// A bundled file.
pub fn bundled(name: &str) -> String {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("instruments")
        .join(name)
        .display()
        .to_string()
}

/// A folder to work in, with the command.
pub struct Shell {
    folder: TempDir,
}

impl Shell {
    pub fn new() -> Shell {
        Shell {
            folder: tempfile::tempdir().expect("a temporary folder"),
        }
    }

    pub fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    pub fn with(self, name: &str, text: &str) -> Shell {
        std::fs::write(self.path(name), text).expect("writable");
        self
    }

    pub fn run(&self, args: &[&str]) -> Output {
        let mut command = Command::new(env!("CARGO_BIN_EXE_whippen"));
        command
            .args(args)
            .current_dir(self.folder.path())
            .output()
            .expect("the command starts")
    }

    /// Runs, expects this exit code and gives stdout and stderr.
    #[track_caller]
    pub fn ends(&self, code: i32, args: &[&str]) -> (String, String) {
        let output = self.run(args);
        let text = |bytes: &[u8]| String::from_utf8(bytes.to_vec()).expect("UTF-8");
        let (out, err) = (text(&output.stdout), text(&output.stderr));
        assert_eq!(
            output.status.code(),
            Some(code),
            "whippen {args:?}\n{out}\n{err}"
        );
        (out, err)
    }

    /// Runs, expects this exit code, nothing written, and these words on stderr.
    #[track_caller]
    pub fn refuses(&self, code: i32, args: &[&str], words: &[&str]) {
        let before = self.files();
        let (out, err) = self.ends(code, args);
        for word in words {
            assert!(
                err.contains(word),
                "whippen {args:?} does not say `{word}`:\n{err}"
            );
        }
        assert_eq!(out, "", "whippen {args:?}");
        assert!(
            !err.contains("panicked") && !err.contains("defect"),
            "{err}"
        );
        assert_eq!(self.files(), before, "whippen {args:?} wrote something");
    }

    fn files(&self) -> Vec<String> {
        let list = std::fs::read_dir(self.folder.path()).expect("readable");
        let mut names: Vec<String> = list
            .map(|e| e.expect("an entry").file_name().display().to_string())
            .collect();
        names.sort();
        names
    }

    pub fn lines(&self, name: &str) -> Vec<String> {
        let text =
            std::fs::read_to_string(self.path(name)).unwrap_or_else(|e| panic!("{name}: {e}"));
        text.lines().map(str::to_string).collect()
    }
}

const CLICK: &str = "\
instrument click {
    sense x: length in -0.5 mm .. 10.5 mm over 0.7 ms
    param k = 300 N/m in 100 N/m .. 1 kN/m
    event bottom when x > 8 mm { emit note(speed: x') }
    force spring = k * x
}
";

// How it ends

#[test]
fn a_good_program_ends_with_0() {
    let shell = Shell::new().with("click.whip", CLICK);
    let (out, err) = shell.ends(0, &["check", "click.whip"]);
    assert_eq!((out.as_str(), err.as_str()), ("click: ok\n", ""));
    let names = [
        "grand-piano.whip",
        "harpsichord.whip",
        "hammond.whip",
        "mikey.whip",
    ]
    .map(bundled);
    let [grand, harpsichord, hammond, mikey] = names.each_ref().map(String::as_str);
    let (out, _) = shell.ends(0, &["check", grand, harpsichord, hammond, mikey]);
    assert_eq!(
        out,
        "grand_piano: ok\nharpsichord: ok\nhammond: ok\nmikey: ok (49 keys at 44100 Hz)\n"
    );
}

#[test]
fn a_wrong_program_ends_with_1_and_says_where() {
    let text = "instrument i { sense x: length in 0 mm .. 10 mm force f = 3 N/mm * y force g = x }";
    let shell = Shell::new().with("wrong.whip", text);
    let says = ["[WH0201]", "wrong.whip:1:68", "[WH0302]", "2 errors"];
    for command in [
        &["check", "wrong.whip"][..],
        &["run", "wrong.whip", "--out", "t.csv"],
        &["dump", "wrong.whip"],
    ] {
        shell.refuses(1, command, &says);
    }
}

#[test]
fn what_only_ranges_show_ends_with_1_too() {
    let text = "instrument i { sense x: length in 0 mm .. 10 mm force f = 1 N * (1 mm / x) }";
    let shell = Shell::new().with("wrong.whip", text);
    shell.refuses(
        1,
        &["check", "wrong.whip"],
        &["[WH0502]", "wrong.whip:1:", "1 error"],
    );
    // And hides nothing of the next instrument.
    let again = text.replace("instrument i", "instrument j");
    let shell = shell.with("click.whip", CLICK).with("again.whip", &again);
    let (out, err) = shell.ends(1, &["check", "wrong.whip", "click.whip", "again.whip"]);
    assert_eq!(out, "click: ok\n");
    assert!(
        err.contains("wrong.whip:1:") && err.contains("again.whip:1:"),
        "{err}"
    );
}

#[test]
fn a_text_that_cannot_be_read_ends_with_1() {
    let shell = Shell::new()
        .with("noise.whip", "instrument } 5 §§ {{{")
        .with("prose.whip", "Dear reader,\n");
    shell.refuses(1, &["check", "noise.whip"], &["noise.whip:1:", "[WH01"]);
    shell.refuses(1, &["check", "prose.whip"], &["prose.whip:1:1", "[WH0102]"]);
}

#[test]
fn a_wrong_command_line_ends_with_2_and_says_what_to_do() {
    let shell = Shell::new()
        .with("click.whip", CLICK)
        .with("two.whip", "instrument a { } instrument b { }");
    std::fs::create_dir(shell.path("folder")).expect("writable");
    std::fs::create_dir(shell.path("folder.whip")).expect("writable");
    std::fs::write(shell.path("latin1.whip"), b"// caf\xe9\n").expect("writable");
    let cases: &[(&[&str], &[&str])] = &[
        (
            &["chekc", "click.whip"],
            &["unrecognized subcommand 'chekc'", "check"],
        ),
        (&["check"], &["<FILE>", "Usage: whippen check"]),
        (
            &["check", "click.whip", "--fast"],
            &["unexpected argument '--fast'", "Usage"],
        ),
        (
            &["check", "absent.whip"],
            &["cannot read `absent.whip`: there is no such file"],
        ),
        (
            &["check", "absent"],
            &["cannot read `absent`", "a program's file ends in .whip"],
        ),
        (&["check", "folder.whip"], &["cannot read `folder.whip`"]),
        (
            &["check", "folder"],
            &["cannot read `folder`", "ends in .whip"],
        ),
        (
            &["check", "latin1.whip"],
            &["cannot read `latin1.whip`", "UTF-8"],
        ),
        (
            &["run", "absent"],
            &["`absent` is neither a .whip file nor exists"],
        ),
        (&["run", "absent.whip"], &["cannot read `absent.whip`"]),
        (
            &["run", "click.whip", "clack"],
            &["there is no instrument `clack`; there are: click"],
        ),
        (
            &["run", "click.whip", "click", "clack"],
            &["at most one instrument"],
        ),
        (
            &["run", "two.whip"],
            &["several instruments, name one of them after the files: a, b"],
        ),
        (
            &["run", "click.whip", "--engine", "warp"],
            &["'warp'", "engines are jit, interp, ideal"],
        ),
        (
            &["run", "click.whip", "--set", "k"],
            &["`--set name=value`, such as"],
        ),
        (
            &["run", "click.whip", "--set", "q=1N"],
            &["WH0221", "`q`", "its parameters are k", "--set"],
        ),
        (
            &["run", "click.whip", "--set", "k=300"],
            &["WH0303", "such as `k=1N/m`"],
        ),
        (
            &["run", "click.whip", "--set", "k=300mm"],
            &["WH0302", "`k`"],
        ),
        (
            &["run", "click.whip", "--set", "k=9kN/m"],
            &["WH0507", "1 kN/m"],
        ),
        (
            &["check", "click.whip", "--set", "k=3 furlong"],
            &["WH0609", "furlong"],
        ),
        (
            &["run", "click.whip", "--plot", "touch.jpg"],
            &["touch.jpg", "`.svg` or `.png`"],
        ),
        (
            &["run", "click.whip", "--plot", "touch"],
            &["`.svg` or `.png`"],
        ),
        (
            &["run", "click.whip", "--every", "0", "--out", "t.csv"],
            &["'0'", "--every"],
        ),
        (
            &["run", "click.whip", "--seconds", "fast"],
            &["'fast'", "a time, such as 10s"],
        ),
        (&["run", "click.whip", "--seconds", "0"], &["above zero"]),
        (&["run", "click.whip", "--rate", "2000"], &["--motion"]),
        (
            &[
                "run",
                "click.whip",
                "--motion",
                "m.csv",
                "--rate",
                "9",
                "--column",
                "x",
            ],
            &["columns are counted from 1"],
        ),
        (
            &["run", "click.whip", "--motion", "click.whip", "--rate", "9"],
            &["a table with titles needs no rate"],
        ),
        (
            &["run", "click.whip", "--motion", "absent.csv"],
            &["absent.csv", "no such file"],
        ),
        (
            &["run", "click.whip", "--motion", "click.whip"],
            &["click.whip", "time with its unit, such as `t_s`"],
        ),
        (
            &["run", "click.whip", "--device", "absent.toml"],
            &["absent.toml", "there is no file"],
        ),
        (
            &["run", "click.whip", "--device", "click.whip"],
            &["click.whip"],
        ),
        (
            &["dump", "click.whip", "--after", "magic"],
            &["`magic` is no pass", "simplify", "lower", "emit"],
        ),
        (
            &["dump", "click.whip", "--mode", "0"],
            &["--mode and --board are for machine code", "`lower`"],
        ),
        (
            &["dump", "click.whip", "--after", "emit", "--mode", "99"],
            &["there is no mode 99", "`click` has"],
        ),
        (
            &["dump", "click.whip", "--after", "emit", "--board", "rp2O40"],
            &["there is no board `rp2O40`; did you mean `rp2040`?"],
        ),
        (
            &["dump", "two.whip", "c", "--after", "check"],
            &["no instrument `c`; there are: a, b"],
        ),
    ];
    for (args, words) in cases {
        shell.refuses(2, args, words);
    }
}

#[test]
fn an_empty_file_is_a_program_without_instruments() {
    let shell = Shell::new()
        .with("empty.whip", "")
        .with("note.whip", "// nothing yet\n");
    for file in ["empty.whip", "note.whip"] {
        let (out, err) = shell.ends(0, &["check", file]);
        assert_eq!(
            (out.as_str(), err.as_str()),
            ("no instrument, but nothing wrong either\n", "")
        );
        shell.refuses(2, &["run", file], &["the program has no instrument"]);
        shell.refuses(2, &["dump", file], &["the program has no instrument"]);
    }
}

#[test]
fn where_the_folder_is_missing_nothing_is_written() {
    let shell = Shell::new().with("click.whip", CLICK).with("file", "");
    for missing in [
        ["--out", "no/t.csv"],
        ["--events", "no/e.csv"],
        ["--plot", "no/p.svg"],
        ["--plot", "no/p.png"],
    ] {
        let args = [
            &["run", "click.whip", "--out", "good.csv", "--seconds", "0.1"][..],
            &missing,
        ]
        .concat();
        let args = if missing[0] == "--out" {
            [&["run", "click.whip"][..], &missing].concat()
        } else {
            args
        };
        shell.refuses(2, &args, &["there is no folder `no`", "make it first"]);
    }
    shell.refuses(
        2,
        &["run", "click.whip", "--out", "file/t.csv"],
        &["there is no folder `file`"],
    );
    std::fs::create_dir(shell.path("t.csv")).expect("writable");
    let (_, err) = shell.ends(
        2,
        &["run", "click.whip", "--seconds", "0.01", "--out", "t.csv"],
    );
    assert!(
        err.contains("t.csv: cannot be written: it is a directory"),
        "{err}"
    );
    assert_eq!(
        shell.files(),
        ["click.whip", "file", "t.csv"],
        "no temporary file stays behind"
    );
}

#[test]
fn nobody_reading_on_is_no_defect() {
    let shell = Shell::new();
    let mut command = Command::new(env!("CARGO_BIN_EXE_whippen"));
    command
        .args(["dump", &bundled("grand-piano.whip")])
        .current_dir(shell.folder.path());
    let mut child = command
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("the command starts");
    drop(child.stdout.take());
    let output = child.wait_with_output().expect("it ends");
    assert_eq!(
        (output.status.code(), output.stderr.as_slice()),
        (Some(0), &b""[..])
    );
}

// What it prints

#[test]
fn notes_are_for_check_alone() {
    let text = "instrument n { sense x: length in 0 mm .. 10 mm live param far = off
        let a = if far then 2 * x else x  force f = 1 N*s/m * a' }";
    let shell = Shell::new().with("note.whip", text);
    assert!(
        shell
            .ends(0, &["check", "note.whip"])
            .1
            .contains("[WH0404] Note")
    );
    assert_eq!(
        shell.ends(0, &["run", "note.whip", "--seconds", "0.01"]).1,
        ""
    );
    assert_eq!(shell.ends(0, &["dump", "note.whip"]).1, "");
}

#[test]
fn help_has_an_example_for_every_command() {
    let shell = Shell::new();
    let (out, _) = shell.ends(0, &["--help"]);
    assert!(
        ["check", "run", "dump"].iter().all(|c| out.contains(c)),
        "{out}"
    );
    for command in ["check", "run", "measure", "sweep", "dump"] {
        let (out, err) = shell.ends(0, &[command, "--help"]);
        assert!(
            out.contains(&format!("Example: whippen {command} instruments/")),
            "{out}"
        );
        assert_eq!(err, "");
    }
    let (out, _) = shell.ends(0, &["--version"]);
    assert_eq!(out, format!("whippen {}\n", env!("CARGO_PKG_VERSION")));
}

#[test]
fn numbers_are_ranges_formats_and_errors() {
    let shell = Shell::new().with("click.whip", CLICK);
    let (out, _) = shell.ends(0, &["check", "click.whip", "--numbers"]);
    let rows: Vec<Vec<&str>> = out
        .lines()
        .map(|line| line.split_whitespace().collect())
        .collect();
    let row = |name: &str| {
        rows.iter()
            .find(|r| r.first() == Some(&name))
            .unwrap_or_else(|| panic!("{name}: {out}"))
    };
    assert_eq!(
        row("x")[..6],
        ["x", "-0.000500", "..", "0.010500", "m", "word"]
    );
    assert_eq!(
        row("spring")[..6],
        ["spring", "-0.150000", "..", "3.150000", "N", "~I4F28"]
    );
    assert!(
        row("spring")[6]
            .parse::<f64>()
            .is_ok_and(|error| (0.0..1e-6).contains(&error))
    );
    assert!(
        out.contains("x: window 31 ticks (0.703 ms); x' and x'' lag 15 ticks (0.340 ms)"),
        "{out}"
    );
    // A setting from outside is seen.
    let (out, _) = shell.ends(0, &["check", "click.whip", "--numbers", "--set", "k=1kN/m"]);
    assert!(out.contains("10.500000"), "{out}");
}

#[test]
fn every_pass_can_be_dumped() {
    let shell = Shell::new().with("click.whip", CLICK);
    for (pass, begins, holds) in [
        ("parse", "instrument click {", "    force spring = k * x\n"),
        ("check", "model click at 44100 Hz\n", "force spring"),
        ("simplify", "model click at 44100 Hz\n", "force spring"),
        ("lower", "kernel click @44100 {\n", "probe \"force spring\""),
    ] {
        let (out, err) = shell.ends(0, &["dump", "click.whip", "--after", pass]);
        assert!(
            out.starts_with(begins) && out.contains(holds),
            "{pass}:\n{out}"
        );
        assert_eq!(err, "");
    }
    assert_eq!(
        shell.ends(0, &["dump", "click.whip"]),
        shell.ends(0, &["dump", "click.whip", "--after", "lower"])
    );
    let (bare, _) = shell.ends(0, &["dump", "click.whip", "--bare"]);
    assert!(
        bare.contains("emit note") && !bare.contains("probe"),
        "{bare}"
    );
    // What `dump --after parse` prints is the program again, in canonical layout.
    let (printed, _) = shell.ends(0, &["dump", "click.whip", "--after", "parse"]);
    std::fs::write(shell.path("again.whip"), &printed).expect("writable");
    assert_eq!(
        shell.ends(0, &["dump", "again.whip", "--after", "parse"]).0,
        printed
    );
    for board in ["rp2350", "rp2040"] {
        for (pass, holds) in [
            ("select", " = ldrh ["),
            ("promote", "    next v"),
            ("schedule", "    next v"),
            ("allocate", "\n    next\n"),
            ("reorder", "\n    next\n"),
            ("emit", "click_tick:\n"),
        ] {
            let args = ["dump", "click.whip", "--after", pass, "--board", board];
            let (out, err) = shell.ends(0, &args);
            assert!(
                out.contains("click.mode.0:") && out.contains(holds),
                "{pass}:\n{out}"
            );
            assert_eq!(err, "");
            assert_eq!(shell.ends(0, &args).0, out);
            let (one, _) = shell.ends(0, &[&args[..], &["--mode", "0"]].concat());
            assert!(
                out.contains(&one) && one.starts_with("click.mode.0:"),
                "{one}"
            );
        }
    }
    let (named, _) = shell.ends(
        0,
        &[
            "dump",
            &bundled("harpsichord.whip"),
            &bundled("hammond.whip"),
            "hammond",
        ],
    );
    assert!(named.starts_with("kernel hammond @44100"));
}

// What it writes

#[test]
fn a_run_writes_what_it_is_asked_for() {
    let shell = Shell::new().with("click.whip", CLICK);
    let outputs = [
        "--out", "t.csv", "--every", "100", "--events", "e.csv", "--plot", "p.svg", "--plot",
        "p.png",
    ];
    let (out, err) = shell.ends(
        0,
        &[&["run", "click.whip", "--seconds", "2"][..], &outputs].concat(),
    );
    assert_eq!(err, "");
    assert!(
        out.contains("click: 2.00 s on engine jit") && out.contains("trace: t.csv"),
        "{out}"
    );
    assert_eq!(
        shell.files(),
        ["click.whip", "e.csv", "p.png", "p.svg", "t.csv"]
    );

    let trace = shell.lines("t.csv");
    assert_eq!(trace[0], "t_s,drive_n,x_m,x_dot_m_per_s,force_n,spring_n");
    assert_eq!(
        trace.len(),
        1 + 88_200 / 100,
        "2 s at 44100 ticks a second, every 100th"
    );
    assert!(
        trace[1].starts_with("0,") && trace[2].starts_with("0.002267574,"),
        "{}",
        trace[2]
    );
    assert!(trace.iter().all(|row| row.split(',').count() == 6));

    let events = shell.lines("e.csv");
    assert_eq!(events[0], "t_s,key,event,speed_m_per_s");
    let notes = events.iter().filter(|row| row.contains(",note,")).count();
    assert!(
        notes > 0 && out.matches("note  speed_m_per_s").count() == notes,
        "{out}\n{events:?}"
    );
    assert_eq!(
        events.iter().filter(|row| row.contains(",bottom,")).count(),
        notes
    );

    assert!(
        shell.lines("p.svg")[0].starts_with("<svg") || shell.lines("p.svg")[0].starts_with("<?xml")
    );
    assert!(
        std::fs::read(shell.path("p.png"))
            .expect("readable")
            .starts_with(b"\x89PNG\r\n\x1a\n")
    );
}

#[test]
fn a_recorded_motion_moves_the_key() {
    // A ramp of 1 mm in 10 ms and a rest, in milliseconds and millimetres.
    let table: String = (0..=40)
        .map(|i| format!("{i},{}\n", f64::from(i.min(10)) * 0.1))
        .collect();
    let shell = Shell::new()
        .with("click.whip", CLICK)
        .with("key.csv", &format!("t_ms,x_mm\n{table}"));
    let args = [
        "run",
        "click.whip",
        "--motion",
        "key.csv",
        "--out",
        "t.csv",
        "--set",
        "k=1kN/m",
    ];
    for engine in ["jit", "interp", "ideal"] {
        let (out, _) = shell.ends(0, &[&args[..], &["--engine", engine]].concat());
        assert!(
            out.contains("key.csv: 41 rows at 1000 Hz")
                && out.contains(&format!("engine {engine}")),
            "{out}"
        );
        let trace = shell.lines("t.csv");
        assert_eq!(trace.len() - 1, 1808, "41 ms");
        let last: Vec<f64> = trace[trace.len() - 1]
            .split(',')
            .map(|v| v.parse().expect("a number"))
            .collect();
        assert!(
            (last[2] - 1e-3).abs() < 2e-7 && (last[4] - 1.0).abs() < 1e-3,
            "{last:?}"
        );
    }
}

#[test]
fn the_same_run_writes_the_same_bytes() {
    let shell = Shell::new();
    let grand = bundled("grand-piano.whip");
    let run = |out: &str, events: &str, engine: &str| {
        shell.ends(
            0,
            &[
                "run",
                &grand,
                "--seconds",
                "1",
                "--out",
                out,
                "--events",
                events,
                "--engine",
                engine,
            ],
        );
    };
    run("a.csv", "ae.csv", "jit");
    run("b.csv", "be.csv", "jit");
    run("c.csv", "ce.csv", "interp");
    let bytes = |name: &str| std::fs::read(shell.path(name)).expect("readable");
    assert!(bytes("a.csv") == bytes("b.csv") && bytes("ae.csv") == bytes("be.csv"));
    assert!(
        bytes("a.csv") == bytes("c.csv") && bytes("ae.csv") == bytes("ce.csv"),
        "jit and interp"
    );
}

#[test]
fn the_program_in_the_readme_clicks_as_printed() {
    let readme = include_str!("../../README.md");
    let program = readme
        .split("```whip\n")
        .nth(1)
        .and_then(|rest| rest.split("```").next())
        .expect("a program");
    let shell = Shell::new().with("click.whip", program);
    let (out, err) = shell.ends(0, &["run", "click.whip", "--plot", "click.png"]);
    assert_eq!(err, "");
    // One click for each of the eight strokes of the bundled gesture that pass 5.5 mm.
    assert_eq!(out.matches("  note  ").count(), 8, "{out}");
    assert!(shell.files().contains(&"click.png".to_string()));
}

#[test]
fn without_a_command_it_tours_every_bundled_instrument() {
    let shell = Shell::new();
    let (out, err) = shell.ends(0, &[]);
    assert_eq!(err, "");
    assert_eq!(shell.files(), ["whippen-tour"]);
    let text = |name: &str| {
        let path = shell.path("whippen-tour").join(name);
        std::fs::read_to_string(&path).unwrap_or_else(|e| panic!("{name}: {e}"))
    };
    let page = text("report.html");
    for (file, program) in INSTRUMENTS {
        let name = file.trim_end_matches(".whip");
        assert_eq!(text(file), *program);
        for part in [".csv", "-events.csv", ".svg"] {
            assert!(text(&format!("{name}{part}")).len() > 10, "{name}{part}");
        }
        assert!(
            page.contains(&format!("<section id=\"{name}\">"))
                && out.contains(&name.replace('-', " ")),
            "{name}"
        );
    }
    let row = |name: &str| {
        out.lines()
            .find(|line| line.starts_with(name))
            .unwrap_or_else(|| panic!("{name}: {out}"))
    };
    let words: Vec<&str> = row("grand piano").split_whitespace().collect();
    assert_eq!(
        words[2..4],
        ["ok", "7"],
        "checked, and the gesture strikes seven times"
    );
    assert!(
        out.contains("next:") && out.matches("\n  whippen ").count() == 2,
        "{out}"
    );
    // What was changed to play with stays, and so does what is not ours; the rest has the same
    // bytes.
    std::fs::write(shell.path("whippen-tour/grand-piano.whip"), "mine").expect("writable");
    std::fs::write(shell.path("whippen-tour/notes.txt"), "mine").expect("writable");
    shell.ends(0, &[]);
    assert_eq!(
        (text("grand-piano.whip"), text("notes.txt")),
        ("mine".to_string(), "mine".to_string())
    );
    assert!(text("report.html") == page, "the same page again");
    // A file in the way is said, not overwritten.
    let shell = Shell::new().with("whippen-tour", "mine");
    let (_, err) = shell.ends(2, &[]);
    assert!(
        err.contains("cannot make the folder `whippen-tour`"),
        "{err}"
    );
    assert_eq!(shell.lines("whippen-tour"), ["mine"]);
}

#[test]
fn a_report_is_one_page_and_says_how_it_was_made() {
    let shell = Shell::new().with("click.whip", CLICK);
    let args = [
        "run",
        "click.whip",
        "--seconds",
        "2",
        "--set",
        "k=200 N/m",
        "--report",
        "r.html",
    ];
    let (out, _) = shell.ends(0, &args);
    assert!(out.contains("report: r.html"), "{out}");
    assert_eq!(shell.files(), ["click.whip", "r.html"]);
    let page = shell.lines("r.html").join("\n");
    assert!(
        page.contains(
            "whippen run click.whip --seconds 2 --set &#39;k=200 N/m&#39; --report r.html"
        )
    );
    assert!(page.contains("force spring = k * x") && page.contains("<dd>k = 200 N/m</dd>"));
    shell.ends(0, &args);
    assert_eq!(shell.lines("r.html").join("\n"), page, "the same bytes");
    shell.refuses(
        2,
        &["run", "click.whip", "--report", "no/r.html"],
        &["there is no folder `no`"],
    );
}
