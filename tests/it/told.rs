//! What the command tells its users in passing: the summary of a run, units and titles, what is
//! wanted instead of what was given.

use super::cli::{Shell, bundled};

/// A switch that says when it goes on and off, with what one over a time is.
const LAMP: &str = "\
instrument lamp {
    sense x: length in -0.5 mm .. 10.5 mm over 1 ms
    live param rate = 3 Hz in 1 Hz .. 9 Hz
    let share = x / 10 mm
    let often = rate * share
    states contact {
        open   -> closed when x > 6 mm { emit light() }
        closed -> open   when x < 4 mm { emit dark() }
    }
    force spring = 50 N/m * x * (1 + often / 100 Hz)
}
";

/// A knob whose torque no motor gives.
const STIFF: &str = "\
instrument dial {
    sense angle: angle in -90 deg .. 90 deg over 2 ms
    torque centring = 2 N*m/rad * angle
}
";

#[test]
fn a_summary_lists_all_that_was_emitted() {
    let shell = Shell::new().with("lamp.whip", LAMP);
    let (out, _) = shell.ends(0, &["run", "lamp.whip"]);
    let (light, dark) = (out.find(" light\n"), out.find(" dark\n"));
    assert!(light.is_some() && light < dark, "{out}");
    let (out, _) = shell.ends(0, &["run", "lamp.whip", "--seconds", "40"]);
    for kind in ["times light between", "times dark between"] {
        assert!(out.contains(kind), "{out}");
    }
    // A figure marks them too.
    shell.ends(0, &["run", "lamp.whip", "--plot", "lamp.svg"]);
    assert!(shell.lines("lamp.svg").concat().contains(">light<"));
}

#[test]
fn what_happens_in_the_first_tick_is_asked_about() {
    // The other way round: the key rests where the first state is left at once.
    let swapped = LAMP
        .replace("open   -> closed when x > 6 mm { emit light() }", "")
        .replace(
            "{ emit dark() }",
            "{ emit dark() } open -> closed when x > 6 mm { emit light() }",
        );
    let shell = Shell::new()
        .with("lamp.whip", LAMP)
        .with("swapped.whip", &swapped);
    let told = "dark in the very first tick: does the first state";
    let (out, _) = shell.ends(0, &["run", "swapped.whip"]);
    assert!(out.contains(told), "{out}");
    let (out, _) = shell.ends(0, &["run", "lamp.whip"]);
    assert!(!out.contains("very first tick"), "{out}");
}

#[test]
fn what_a_knob_gives_is_a_torque() {
    let shell = Shell::new().with("dial.whip", STIFF);
    let args = ["run", "dial.whip", "--report", "dial.html"];
    let (out, _) = shell.ends(0, &args);
    let told = "with more torque than the drive gives, clipped";
    assert!(out.contains(told), "{out}");
    assert!(shell.lines("dial.html").concat().contains(told));
}

#[test]
fn plain_numbers_and_frequencies_are_called_that() {
    let shell = Shell::new().with("lamp.whip", LAMP);
    let all = ["run", "lamp.whip", "--columns", "all"];
    let files = ["--plot", "lamp.svg", "--out", "lamp.csv"];
    shell.ends(0, &[&all[..], &files].concat());
    let titles = &shell.lines("lamp.csv")[0];
    assert!(titles.contains("often_per_s"), "{titles}");
    assert!(titles.split(',').any(|title| title == "share"), "{titles}");
    let figure = shell.lines("lamp.svg").concat();
    for title in [">number<", ">frequency (1/s)<"] {
        assert!(figure.contains(title), "{title}");
    }
    assert!(!figure.contains("coordinate") && !figure.contains("rad"));
    let (out, _) = shell.ends(0, &["check", "lamp.whip", "--numbers"]);
    let row = out.lines().find(|line| line.contains("often"));
    assert!(row.is_some_and(|row| row.contains(" 1/s ")), "{out}");
}

#[test]
fn options_say_what_number_is_wanted() {
    let shell = Shell::new().with("lamp.whip", LAMP);
    let budget = ["budget", "lamp.whip"];
    let emulate = ["emulate", "lamp.whip"];
    let run = ["run", "lamp.whip"];
    let cases: [(&[&str], &str, &str); 14] = [
        (&budget, "--modes", "wanted is a whole number from 0 to"),
        (
            &budget,
            "--keys",
            "wanted is a whole number from 1 to 65536",
        ),
        (
            &budget,
            "--tick-rate",
            "wanted is a rate, such as 8000 or 8kHz",
        ),
        (&run, "--every", "wanted is a whole number from 1 to"),
        (&run, "--threads", "wanted is a whole number from 1 to 256"),
        (&run, "--column", "wanted is a whole number from 1 to"),
        (&run, "--seconds", "wanted is a time, such as 10s"),
        (&run, "--lowpass", "wanted is a frequency, such as 200Hz"),
        (&run, "--keys", "wanted is a whole number from 1 to 65536"),
        (
            &emulate,
            "--keys",
            "wanted is a whole number from 1 to 65536",
        ),
        (
            &emulate,
            "--gdb",
            "wanted is a whole number from 0 to 65535",
        ),
        (
            &emulate,
            "--shifted-flags",
            "wanted is a whole number from 1 to 2",
        ),
        (&emulate, "--rate", "wanted is a rate, such as 8000 or 8kHz"),
        (
            &["dump", "lamp.whip"],
            "--mode",
            "wanted is a whole number from 0 to",
        ),
    ];
    for (command, option, says) in cases {
        for value in ["x", "-3"] {
            let value = format!("{option}={value}");
            shell.refuses(2, &[command, &[&value]].concat(), &[says]);
        }
    }
    shell.ends(0, &["run", "lamp.whip", "--tick-rate", "8kHz"]);
}

/// Whatever `build` prints of a relocatable file stands in its page.
#[test]
fn the_page_on_build_shows_what_it_prints() {
    let shell = Shell::new();
    let grand = bundled("grand-piano.whip");
    let (out, _) = shell.ends(0, &["build", &grand, "--keys", "28", "-o", "piano.o"]);
    let (_, bound) = out.split_once('\n').expect("several lines");
    let page = include_str!("../../docs/build.md");
    assert!(
        bound.contains("cycles") && page.contains(bound.trim()),
        "{out}"
    );
}

#[test]
fn hardware_that_is_not_there_says_what_is() {
    let shell = Shell::new().with("lamp.whip", LAMP);
    let boards = [
        "boards are pico2_four_knobs, pico2_knob, pico2_strings, pico2_two_knobs, rp2040, rp2350, rp2350_columns, rp2350b_bench, stm32f4",
        "docs/build.md",
    ];
    let near = "did you mean `rp2350`?";
    for board in ["rp235", "rp235.toml", "boards/rp235.toml"] {
        let says = [&boards[..], &[near]].concat();
        shell.refuses(2, &["budget", "lamp.whip", "--board", board], &says);
    }
    let devices = [
        "devices are chain, column_coil, gimbal, knob, mikey",
        "docs/how-to/device.md",
    ];
    shell.refuses(
        2,
        &["run", "lamp.whip", "--device", "absent.toml"],
        &devices,
    );
}

#[cfg(unix)]
#[test]
fn names_of_files_are_any_bytes() {
    use std::ffi::OsStr;
    use std::os::unix::ffi::OsStrExt;
    use std::process::Command;

    let shell = Shell::new();
    let name = |ending: &str| [b"l\xe9mp.", ending.as_bytes()].concat();
    let path = |bytes: &[u8]| shell.path("").join(OsStr::from_bytes(bytes));
    std::fs::write(path(&name("whip")), LAMP).expect("writable");
    let device = include_str!("../../instruments/hardware/mikey.toml");
    std::fs::write(path(&name("toml")), device).expect("writable");
    let commands: [&[&str]; 5] = [
        &["check"],
        &["run"],
        &["dump"],
        &["budget", "--keys", "2"],
        &["build", "--keys", "2", "-o"],
    ];
    for words in commands {
        let mut command = Command::new(env!("CARGO_BIN_EXE_whippen"));
        command.args(words).current_dir(shell.path(""));
        if words[0] == "build" {
            command.arg(OsStr::from_bytes(&name("o")));
        }
        command.arg(OsStr::from_bytes(&name("whip")));
        if words[0] != "dump" {
            command
                .arg("--device")
                .arg(OsStr::from_bytes(&name("toml")));
        }
        let output = command.output().expect("the command starts");
        let told = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(0), "{words:?}: {told}");
    }
    assert!(path(&name("o")).is_file());
}

#[test]
fn what_rings_is_told_by_check_and_explained() {
    let wall = "instrument wall {
        sense x: length in -0.5 mm .. 10.5 mm over 1 ms
        force wall = if x > 5 mm then 20 kN/m * (x - 5 mm) else 0 N
    }";
    let shell = Shell::new().with("wall.whip", wall);
    let (_, err) = shell.ends(0, &["check", "wall.whip"]);
    for word in [
        "[WH0702]",
        "to ring is to swing",
        "docs/stability.md",
        "whippen explain WH0702",
    ] {
        assert!(err.contains(word), "{word}: {err}");
    }
}

#[test]
fn long_lines_are_cut_around_the_place() {
    let (blank, long) = (" ".repeat(100_000), "a".repeat(100_000));
    let text = format!(
        "instrument i {{ sense x: length in 0 mm .. 10 mm force f = 1 N {blank} + wrong {blank} }}"
    );
    let shell = Shell::new().with("long.whip", &text);
    let (_, err) = shell.ends(1, &["check", "long.whip"]);
    assert!(err.len() < 2000, "{} bytes", err.len());
    let column = text.find("wrong").expect("it is there") + 1;
    let place = format!("long.whip:1:{column} ");
    assert!(err.contains(&place) && err.contains("+ wrong"), "{err}");
    let name = shell.with("name.whip", &text.replace("wrong", &long));
    let (_, err) = name.ends(1, &["check", "name.whip"]);
    assert!(err.len() < 2000, "{} bytes", err.len());
}

#[test]
fn terms_of_the_library_are_explained() {
    let shell = Shell::new();
    let (out, _) = shell.ends(0, &["explain", "rotary_detents"]);
    assert!(out.starts_with("rotary_detents(angle: angle, pitch: angle, height: torque) ->"));
    assert!(
        out.contains("for a knob") && out.contains("docs/std.md"),
        "{out}"
    );
    let (out, _) = shell.ends(0, &["explain"]);
    assert!(
        out.contains("  plectrum\n") && out.contains("WH0203"),
        "{out}"
    );
    shell.refuses(
        2,
        &["explain", "plectrums"],
        &["no term of the library `plectrums`"],
    );
}

#[test]
fn very_long_names_are_laid_out() {
    let name = "a".repeat(70_000);
    let text = format!(
        "instrument i {{\n    sense x: length in 0 mm .. 1 mm\n    let {name} = x\n    let b = x\n    force f = 1 N\n}}\n"
    );
    let shell = Shell::new().with("long.whip", &text);
    shell.ends(0, &["fmt", "long.whip"]);
    shell.ends(0, &["fmt", "--check", "long.whip"]);
}

#[test]
fn any_tick_rate_is_judged() {
    let shell = Shell::new();
    for rate in ["1", "2", "3", "7", "20"] {
        for (name, _) in whippen_compiler::bundled::INSTRUMENTS {
            let file = super::cli::bundled(name);
            let output = shell.run(&["check", &file, "--tick-rate", rate]);
            let told = String::from_utf8_lossy(&output.stderr);
            let code = output.status.code();
            assert!(matches!(code, Some(0 | 1)), "{name} at {rate} Hz: {told}");
        }
    }
}

#[test]
fn a_switch_emits_on_and_off() {
    let switch = "instrument switch {
        sense x: length in -0.5 mm .. 10.5 mm
        states lamp {
            off -> on  when x > 6 mm { emit on() }
            on  -> off when x < 4 mm { emit off() }
        }
        force spring = 50 N/m * x
    }";
    let shell = Shell::new().with("switch.whip", switch);
    let (out, _) = shell.ends(0, &["run", "switch.whip"]);
    assert!(out.contains("  on\n") && out.contains("  off\n"), "{out}");
    for file in ["s.o", "s.c"] {
        shell.ends(0, &["build", "switch.whip", "--keys", "2", "-o", file]);
    }
    assert!(shell.lines("s.h").concat().contains("SWITCH_EVENT_ON"));
}

#[test]
fn rows_that_are_always_on_are_no_mistake() {
    let plucks = "instrument cembalo {
        sense x: length in 0 mm .. 8 mm over 1 ms
        let front = plectrum(x, row: on, touch: 2.5 mm, peak: 3.6 mm, pluck: 4 mm, height: 0.4 N)
        force pull = front.pull
    }";
    let shell = Shell::new().with("cembalo.whip", plucks);
    let (_, err) = shell.ends(0, &["check", "cembalo.whip"]);
    assert!(!err.contains("WH0411"), "{err}");
    // What is meant by a name without its ending.
    let near = "did you mean `cembalo.whip`?";
    shell.refuses(2, &["run", "cembalo"], &[near]);
    let comma = ["run", "cembalo.whip", "--seconds", "0,5s"];
    shell.refuses(2, &comma, &["the decimal point is `.`"]);
}

#[test]
fn a_program_here_finds_what_lies_beside_it() {
    let keyboard = "keyboard k { rate 8000 Hz keys C4 .. E4 programs lamp }";
    let shell = Shell::new()
        .with("lamp.whip", LAMP)
        .with("k.whip", keyboard);
    let (_, err) = shell.ends(0, &["check", "k.whip"]);
    assert!(err.contains("note: with lamp.whip"), "{err}");
}

#[test]
fn one_header_for_two_files_is_told() {
    let shell = Shell::new().with("lamp.whip", LAMP);
    let build = |file: &str| {
        let args = ["build", "lamp.whip", "--keys", "2", "-o", file];
        shell.ends(0, &args).1
    };
    let told = "lamp.h and lamp.rs are for lamp.c now, and do not fit lamp.o";
    assert!(!build("lamp.o").contains("do not fit"));
    assert!(build("lamp.c").contains(told));
    assert!(build("lamp.o").contains("do not fit lamp.c"));
    assert!(!build("other.o").contains("do not fit"));
}

#[cfg(unix)]
#[test]
fn what_is_no_file_is_told_without_numbers_of_errors() {
    let shell = Shell::new();
    let socket = std::os::unix::net::UnixListener::bind(shell.path("socket.whip"));
    std::os::unix::fs::symlink("loop.whip", shell.path("loop.whip")).expect("a link");
    for (file, says) in [
        ("socket.whip", "no such device or address"),
        ("loop.whip", "too many levels of symbolic links"),
    ] {
        let (_, err) = shell.ends(2, &["check", file]);
        assert!(err.contains(says) && !err.contains("os error"), "{err}");
    }
    drop(socket);
}
