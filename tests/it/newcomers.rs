//! What people meet who begin: devices and rates on the command line, programs of several files,
//! copies of bundled programs, states that are on and off.

use serde_json::{Value, json};
use whippen_compiler::bundled::{INSTRUMENTS, KEYBOARDS};

use super::cli::{Shell, bundled};
use super::common;
use super::lsp::editor::Editor;

const DIAL: &str = "\
instrument dial {
    sense angle: angle in -90 deg .. 90 deg over 2 ms
    torque centring = 20 mN*m/rad * angle
}
";

const KEY: &str = "\
instrument key {
    sense x: length in 0 mm .. 10 mm over 1 ms
    force spring = soft(x)
}
";

const SOFT: &str = "\
term soft(x: length) -> push: force {
    push = 60 N/m * x
}
";

const BOARD: &str = "\
keyboard board {
    device   \"devices/own.toml\"
    rate     8000 Hz
    keys     C4 .. F4
    programs key
}
";

/// A device file: MIKEY's under another name.
fn own_device() -> String {
    let path = bundled("hardware/mikey.toml");
    let text = std::fs::read_to_string(path).expect("is there");
    text.replace("name = \"mikey\"", "name = \"own\"")
}

/// A folder `program` with a keyboard, its device, its instrument and a term that this needs.
fn several_files() -> Shell {
    let shell = Shell::new();
    std::fs::create_dir_all(shell.path("program/devices")).expect("writable");
    shell
        .with("program/board.whip", BOARD)
        .with("program/devices/own.toml", &own_device())
        .with("program/key.whip", KEY)
        .with("program/soft.whip", SOFT)
        .with("program/broken.whip", "term {{{")
}

/// Commands that take a device.
const WITH_DEVICE: [&[&str]; 4] = [
    &["run"],
    &["check"],
    &["budget", "--keys", "2"],
    &["build", "-o", "x.o"],
];

fn words<'w>(command: &[&'w str], more: &[&'w str]) -> Vec<&'w str> {
    [command, more].concat()
}

// Devices

#[test]
fn a_device_is_named_or_given_as_a_file_in_every_command() {
    let knob = bundled("hardware/knob.toml");
    for command in WITH_DEVICE {
        let shell = Shell::new().with("dial.whip", DIAL).with("soft.whip", SOFT);
        for device in ["knob", knob.as_str()] {
            shell.ends(0, &words(command, &["dial.whip", "--device", device]));
        }
        let shell = Shell::new().with("dial.whip", DIAL);
        let refuses = |device: &str, says: &[&str]| {
            shell.refuses(2, &words(command, &["dial.whip", "--device", device]), says);
        };
        let known = "devices are chain, column_coil, gimbal, knob, mikey, mouse, pad, touch, voice_coil; docs/how-to/device.md says how";
        refuses(
            "knobb",
            &["there is no device `knobb`; did you mean `knob`?", known],
        );
        refuses("absent.toml", &["there is no file `absent.toml`", known]);
        refuses(
            "mikey",
            &[
                "measures lengths, but `dial` senses an angle",
                "--device knob",
            ],
        );
    }
}

#[test]
fn a_keyboard_names_a_device_file_beside_it() {
    let shell = several_files();
    let (out, _) = shell.ends(0, &["check", "program/board.whip"]);
    assert_eq!(out, "key: ok\nboard: ok (6 keys at 8000 Hz)\n");
    let report = ["run", "program/board.whip", "--report", "page.html"];
    shell.ends(0, &report);
    assert!(shell.lines("page.html").concat().contains("own"));
    // What a command reads is not written over, whoever names it.
    std::fs::remove_file(shell.path("page.html")).expect("is there");
    let link = shell.path("t.csv");
    std::fs::hard_link(shell.path("program/devices/own.toml"), &link).expect("a link");
    let over = ["run", "program/board.whip", "--out", "t.csv"];
    shell.refuses(2, &over, &["--out would overwrite", "own.toml"]);
    // Wrong files are named, where the program names them.
    std::fs::write(shell.path("program/devices/own.toml"), "name = 3").expect("writable");
    for command in WITH_DEVICE {
        let command = words(command, &["program/board.whip"]);
        shell.refuses(1, &command, &["[WH0618]", "board.whip:2:14", "own.toml"]);
    }
    std::fs::remove_file(shell.path("program/devices/own.toml")).expect("is there");
    shell.refuses(
        1,
        &["check", "program/board.whip"],
        &["no such file or folder", "own.toml"],
    );
}

// Several files

#[test]
fn what_a_program_uses_is_found_beside_it() {
    let shell = several_files();
    let note = "note: with program/soft.whip, which declare what is used";
    let (out, err) = shell.ends(0, &["check", "program/key.whip"]);
    assert_eq!(
        (out.as_str(), err.contains(note)),
        ("key: ok\n", true),
        "{err}"
    );
    // Given files are read as they are, and nothing else.
    let (_, err) = shell.ends(0, &["check", "program/key.whip", "program/soft.whip"]);
    assert_eq!(err, "");
    shell.refuses(
        2,
        &["check", "program/key.whip", "program/../program/key.whip"],
        &["is given twice (as `program/key.whip`)"],
    );
    let again = shell.with("program/soft-2.whip", SOFT);
    again.refuses(
        1,
        &["check", "program/key.whip"],
        &[
            "there are two terms `soft`",
            "soft.whip:1:6",
            "soft-2.whip:1:6",
        ],
    );
    std::fs::remove_file(again.path("program/soft.whip")).expect("is there");
    std::fs::remove_file(again.path("program/soft-2.whip")).expect("is there");
    again.refuses(
        1,
        &["check", "program/key.whip"],
        &["there is no term `soft`", "in a file of this folder"],
    );
}

#[test]
fn an_editor_finds_the_same_files_as_the_command_line() {
    let mut editor = Editor::new();
    let folder = editor.folder.path().to_path_buf();
    std::fs::create_dir_all(folder.join("devices")).expect("writable");
    std::fs::write(folder.join("key.whip"), KEY).expect("writable");
    std::fs::write(folder.join("soft.whip"), SOFT).expect("writable");
    let messages = |found: &[Value]| -> Vec<String> {
        let message = |d: &Value| d["message"].as_str().unwrap_or_default().to_string();
        found.iter().map(message).collect()
    };
    let missing = messages(&editor.open("board.whip", BOARD));
    assert!(
        matches!(&missing[..], [one] if one.contains("own.toml")),
        "{missing:?}"
    );
    std::fs::write(folder.join("devices/own.toml"), own_device()).expect("writable");
    std::fs::write(folder.join("soft-2.whip"), SOFT).expect("writable");
    let mut again = || {
        editor.tell("workspace/didChangeWatchedFiles", json!({ "changes": [] }));
        editor.diagnostics("board.whip", 1)
    };
    let twice = messages(&again());
    assert!(
        matches!(&twice[..], [one] if one.contains("there are two terms `soft`")),
        "{twice:?}"
    );
    std::fs::remove_file(folder.join("soft-2.whip")).expect("is there");
    assert_eq!(again(), Vec::<Value>::new());
    editor.end();
}

// Rates

#[test]
fn the_tick_rate_of_the_command_line_wins() {
    let shell = several_files();
    let (out, _) = shell.ends(0, &["check", "program/board.whip", "--tick-rate", "16000"]);
    assert!(out.contains("(6 keys at 16000 Hz)"), "{out}");
    shell.ends(
        0,
        &[
            "run",
            "program/key.whip",
            "--tick-rate",
            "1000",
            "--out",
            "t.csv",
        ],
    );
    let rows = shell.lines("t.csv").len();
    assert!((4200..4210).contains(&rows), "4.2 s of ticks: {rows}");
    let shell = Shell::new().with("dial.whip", DIAL);
    for command in WITH_DEVICE {
        for wrong in ["0", "1000001", "0.5", "150MHz/x", "fast"] {
            let command = words(command, &["dial.whip", "--tick-rate", wrong]);
            let says: &[&str] = match wrong {
                "fast" => &["`fast` is not a number", "wanted is a rate"],
                "150MHz/x" => &["`x` is no whole number of cycles", "wanted is a rate"],
                _ => &["from 1 to 1000000 Hz"],
            };
            shell.refuses(2, &command, says);
        }
    }
}

// Beginnings

#[test]
fn every_bundled_program_is_one_to_begin_with() {
    let played_once = common::played_once();
    for (file, _) in INSTRUMENTS.iter().chain(KEYBOARDS) {
        let like = file.trim_end_matches(".whip");
        let shell = Shell::new();
        let (out, _) = shell.ends(0, &["new", "mine", "--like", like]);
        let (checked, err) = shell.ends(0, &["check", "mine.whip"]);
        assert!(checked.contains("mine: ok"), "{like}: {checked}");
        assert!(!err.contains("note: with"), "{like} is one file: {err}");
        shell.ends(0, &["fmt", "--check", "mine.whip"]);
        // What is said to come next works, but for waiting.
        let next = out.lines().last().expect("a line").trim();
        let next: Vec<&str> = next
            .split(' ')
            .skip(1)
            .filter(|w| *w != "--watch")
            .collect();
        shell.ends(0, &words(&next, &["--seconds", "0.1"]));
        let plays = next.iter().skip(2).take_while(|w| !w.starts_with('-'));
        let named: Vec<&str> = plays.copied().collect();
        // What has no keys does not fit on a core either.
        let build = if played_once.contains(&like.replace('-', "_")) {
            ["build", "mine.whip", "--unproven", "-o", "mine.o"]
        } else {
            ["build", "mine.whip", "--keys=2", "-o", "mine.o"]
        };
        shell.ends(0, &words(&build, &named));
    }
    let shell = Shell::new();
    let (help, _) = shell.ends(0, &["new", "--help"]);
    assert!(
        help.contains("grand-piano") && help.contains("split"),
        "{help}"
    );
    shell.refuses(
        2,
        &["new", "mine", "--like", "grandpiano"],
        &["grand-piano"],
    );
}

#[test]
fn states_may_be_called_on_and_off() {
    let light = "\
instrument light {
    sense x: length in 0 mm .. 10 mm over 1 ms

    states lamp {
        off -> on  when x > 8 mm { emit note(speed: x') }
        on  -> off when x < 2 mm and x' < 0 m/s
    }

    force spring = 50 N/m * x
    force held   = if lamp is on then 0.1 N else 0 N
    force free   = if lamp is not on then 0.1 N else 0 N
    force other  = if lamp is off then 0 N else 0.1 N
}
";
    let shell = Shell::new().with("light.whip", light);
    shell.ends(0, &["fmt", "--check", "light.whip"]);
    shell.ends(
        0,
        &["run", "light.whip", "--out", "t.csv", "--columns", "lamp"],
    );
    let states = shell.lines("t.csv");
    assert!(
        states.iter().any(|row| row.ends_with(",on"))
            && states.iter().any(|row| row.ends_with(",off"))
    );
    shell.ends(0, &["build", "light.whip", "--keys", "2", "-o", "light.c"]);
    shell.ends(0, &["build", "light.whip", "--keys", "2", "-o", "light.o"]);
}

#[test]
fn a_page_says_how_to_ask_for_what_it_does_not_draw() {
    let shell = Shell::new();
    let grand = bundled("grand-piano.whip");
    let page = ["run", &grand, "--seconds", "0.1", "--report", "page.html"];
    let says = |shell: &Shell| {
        let page = shell.lines("page.html").join("\n");
        page.contains("not drawn") && page.contains("--columns all")
    };
    shell.ends(0, &page);
    assert!(says(&shell));
    shell.ends(0, &words(&page, &["--columns", "all"]));
    assert!(!says(&shell));
}

#[test]
fn the_gesture_goes_as_far_as_is_wanted_and_as_the_device_measures() {
    let slider = "\
instrument slider {
    sense x: length in 0 mm .. 40 mm over 1 ms
    force spring = 20 N/m * x
}
";
    let long = own_device().replace("\"10.5 mm\"", "\"40.5 mm\"");
    let shell = Shell::new()
        .with("slider.whip", slider)
        .with("long.toml", &long)
        .with("dial.whip", DIAL);
    let note = "`slider` senses 0 m .. 40 mm, and the device `mikey` measures -0.5 mm .. 10.5 mm";
    let (_, err) = shell.ends(0, &["check", "slider.whip"]);
    assert!(err.contains(note), "{err}");
    let run = [
        "run",
        "slider.whip",
        "--device",
        "long.toml",
        "--out",
        "t.csv",
    ];
    let (out, err) = shell.ends(0, &words(&run, &["--travel", "40mm", "--columns", "x"]));
    assert!(out.contains("(synthetic), to 40 mm"), "{out}");
    assert_eq!(err, "");
    let furthest = shell.lines("t.csv").into_iter().skip(1).map(|row| {
        let x = row.split(',').nth(1).expect("x_m");
        x.parse::<f64>().expect("a number")
    });
    let furthest = furthest.fold(0.0, f64::max);
    assert!((furthest - 0.04).abs() < 1e-5, "{furthest}");
    shell.ends(0, &["run", "dial.whip", "--travel", "10deg"]);
    let turned = ["run", "dial.whip", "--travel", "10mm"];
    shell.refuses(2, &turned, &["`dial` turns: an angle"]);
    let still = ["run", "slider.whip", "--travel", "0mm"];
    shell.refuses(2, &still, &["above zero, such as 4mm or 30deg"]);
}

#[cfg(target_os = "linux")]
#[test]
fn a_full_disk_is_told_and_nothing_else_ends_the_command() {
    let shell = Shell::new().with("dial.whip", DIAL);
    let whippen = |line: &str| {
        let command = format!("\"$WHIPPEN\" {line}");
        let run = std::process::Command::new("sh")
            .args(["-c", &command])
            .env("WHIPPEN", env!("CARGO_BIN_EXE_whippen"))
            .current_dir(shell.path("."))
            .output()
            .expect("a shell");
        (
            run.status.code(),
            String::from_utf8_lossy(&run.stderr).into_owned(),
        )
    };
    let (code, err) = whippen("check dial.whip --numbers > /dev/full");
    assert_eq!(code, Some(2), "{err}");
    assert!(
        err.contains("cannot write to stdout: no space left"),
        "{err}"
    );
    assert_eq!(whippen("check absent.whip 2> /dev/full").0, Some(2));
    assert_eq!(whippen("dump dial.whip | head -1").0, Some(0));
}
