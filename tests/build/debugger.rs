//! gdb stops at lines of the source and steps through them.

use std::io::{BufRead, BufReader};
use std::process::{Command, Stdio};

use whippen_compiler::image::executable;
use whippen_runtime::board::bundled;

use crate::program::{TEXT, image};
use crate::tools::{Folder, WHIPPEN, text};

/// A session of gdb with the emulator; what gdb printed, or nothing where it is not installed.
pub fn session(folder: &Folder, image: &str, script: &[&str]) -> Option<String> {
    folder.output("gdb-multiarch", &["--version"])?;
    let mut emulator = Command::new(WHIPPEN)
        .args(["emulate", image, "--board", "rp2350", "--gdb", "0"])
        .current_dir(folder.path())
        .stderr(Stdio::piped())
        .stdout(Stdio::null())
        .spawn()
        .expect("starts");
    let mut told = BufReader::new(emulator.stderr.take().expect("piped"));
    let mut line = String::new();
    told.read_line(&mut line).expect("says where it listens");
    let port = line
        .trim()
        .rsplit_once(':')
        .unwrap_or_else(|| panic!("no port: {line}"))
        .1
        .to_string();
    let target = format!("target remote localhost:{port}");
    let mut args = vec![
        "--batch",
        "-nx",
        "-q",
        "-iex",
        "set auto-load off",
        "-ex",
        "set confirm off",
        "-ex",
        &target,
    ];
    script
        .iter()
        .for_each(|command| args.extend(["-ex", command]));
    args.push(image);
    let output = folder.output("gdb-multiarch", &args);
    let _ = emulator.kill();
    let _ = emulator.wait();
    let output = output?;
    Some(text(&output.stdout) + &text(&output.stderr))
}

#[test]
fn a_force_term_can_be_stopped_at_and_stepped_through() {
    let folder = Folder::new();
    folder.write(
        "out.elf",
        executable(&image(&bundled("rp2350").expect("bundled")), None),
    );
    folder.write("probe.whip", TEXT);
    let script = [
        "break probe.whip:2",
        "break probe.whip:4",
        "continue",
        "step",
        "continue",
        "backtrace",
        "info line probe_tick",
        "kill",
    ];
    let Some(told) = session(&folder, "out.elf", &script) else {
        return;
    };
    for wanted in [
        "Breakpoint 1, probe_tick () at probe.whip:2",
        "force weight = 1 N",
        "force more = 2 N",
        "Breakpoint 2, probe_scale () at probe.whip:4",
        "force scaled = 3 N",
        "in probe_tick () at probe.whip:3",
        "Line 1 of \"probe.whip\"",
    ] {
        assert!(told.contains(wanted), "{wanted}: {told}");
    }
}
