//! `examples/firmware`: the C project is built, and prints the same on the emulator and in QEMU.

use std::io::Write;
use std::path::Path;
use std::process::Command;

fn is_installed(tool: &str, package: &str) -> bool {
    let found = Command::new(tool)
        .arg("--version")
        .output()
        .is_ok_and(|output| output.status.success());
    if !found {
        let note = format!("SKIPPED: {tool} is not installed (Debian: {package})\n");
        std::io::stderr()
            .write_all(note.as_bytes())
            .expect("standard error takes a line");
    }
    found
}

/// What `make` prints for a target, line by line.
fn make(folder: &Path, target: &str) -> Vec<String> {
    let program = Path::new(env!("CARGO_MANIFEST_DIR")).join("instruments/grand-piano.whip");
    let mut command = Command::new("make");
    command
        .current_dir(folder)
        .arg(format!("WHIPPEN={}", env!("CARGO_BIN_EXE_whippen")));
    let output = command
        .arg(format!("PROGRAM={}", program.display()))
        .arg(target)
        .output()
        .expect("make runs");
    assert!(
        output.status.success(),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
    // QEMU prints what the program says to its standard error.
    let all = [output.stdout, output.stderr].concat();
    String::from_utf8_lossy(&all)
        .lines()
        .map(str::to_string)
        .collect()
}

#[test]
fn the_c_project_runs_on_the_emulator_and_in_qemu() {
    let tools = [("arm-none-eabi-gcc", "gcc-arm-none-eabi"), ("make", "make")];
    if !tools
        .iter()
        .all(|(tool, package)| is_installed(tool, package))
    {
        return;
    }
    let folder = tempfile::tempdir().expect("a folder");
    let from = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/firmware");
    for name in ["Makefile", "firmware.ld", "main.c", "start.c"] {
        std::fs::copy(from.join(name), folder.path().join(name)).expect("the example's files");
    }
    let said = |lines: Vec<String>| -> Vec<String> {
        lines
            .into_iter()
            .filter(|line| line.starts_with("tick ") || line.starts_with("sum "))
            .collect()
    };
    let emulated = said(make(folder.path(), "run"));
    let of = |what: &str| emulated.iter().filter(|line| line.ends_with(what)).count();
    assert_eq!(
        (of(" note"), of(" release"), emulated.len()),
        (4, 4, 9),
        "{emulated:?}"
    );
    if is_installed("qemu-system-arm", "qemu-system-arm") {
        assert_eq!(said(make(folder.path(), "qemu")), emulated);
    }
}
