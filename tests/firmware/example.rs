//! `examples/firmware`: the C project is built, and prints the same on the emulator and in QEMU.

use std::path::Path;
use std::process::Command;

use tempfile::TempDir;

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

/// What the program says where `make` runs it, in order.
fn said(folder: &Path, target: &str) -> Vec<String> {
    let mut lines = make(folder, target);
    lines.retain(|line| line.starts_with("tick ") || line.starts_with("sum "));
    lines
}

/// A folder with the project's files.
fn project() -> TempDir {
    let folder = tempfile::tempdir().expect("a folder");
    let from = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/firmware");
    for name in ["Makefile", "firmware.ld", "main.c", "start.c"] {
        std::fs::copy(from.join(name), folder.path().join(name)).expect("the example's files");
    }
    folder
}

#[test]
fn the_c_project_runs_on_the_emulator() {
    if !whippen_need::tools(&["arm-none-eabi-gcc", "make"]) {
        return;
    }
    let emulated = said(project().path(), "run");
    let of = |what: &str| emulated.iter().filter(|line| line.ends_with(what)).count();
    assert_eq!(
        (of(" note"), of(" release"), emulated.len()),
        (4, 4, 9),
        "{emulated:?}"
    );
}

#[test]
fn the_c_project_prints_the_same_in_qemu() {
    if !whippen_need::tools(&["arm-none-eabi-gcc", "make", "qemu-system-arm"]) {
        return;
    }
    let folder = project();
    let emulated = said(folder.path(), "run");
    assert!(!emulated.is_empty());
    assert_eq!(said(folder.path(), "qemu"), emulated);
}
