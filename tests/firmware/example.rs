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

/// Compilers of this machine have nothing to say about the example either.
#[test]
fn the_c_project_is_strict_c() {
    let folder = project();
    if !whippen_need::tools(&["arm-none-eabi-gcc", "make", "gcc", "clang"]) {
        return;
    }
    make(folder.path(), "piano.o");
    let flags = [
        "-std=c99",
        "-Wall",
        "-Wextra",
        "-Wconversion",
        "-pedantic",
        "-Werror",
    ];
    for compiler in ["gcc", "clang"] {
        let path = whippen_need::tool(compiler).expect("is there");
        let mut command = Command::new(path);
        command.current_dir(folder.path()).args(flags);
        command.args(["-fsyntax-only", "main.c", "start.c"]);
        let output = command.output().expect("runs");
        let told = String::from_utf8_lossy(&output.stderr);
        assert!(
            output.status.success() && told.is_empty(),
            "{compiler}: {told}"
        );
    }
}

/// What the header says of the state, as the C compiler tells gdb, is what the object file tells
/// it.
#[test]
fn the_object_and_the_header_agree_about_the_state() {
    if !whippen_need::tools(&["arm-none-eabi-gcc", "make", "gdb-multiarch"]) {
        return;
    }
    let folder = project();
    make(folder.path(), "piano.o");
    let script = "
of = gdb.lookup_type('struct grand_piano_state')
print('size', of.sizeof)
for f in of.fields():
    if f.name != 'keys' and not f.name.startswith('private_'):
        print('field', f.name, f.bitpos // 8, f.type.sizeof)
";
    std::fs::write(folder.path().join("fields.py"), script).expect("written");
    let side = "#include \"piano.h\"\nstruct grand_piano_state side;\n";
    std::fs::write(folder.path().join("side.c"), side).expect("written");
    let run = |tool: &str, args: &[&str]| {
        let path = whippen_need::tool(tool).expect("is there");
        let mut command = Command::new(path);
        let output = command.current_dir(folder.path()).args(args).output();
        let output = output.expect("runs");
        assert!(output.status.success(), "{tool} {args:?}");
        String::from_utf8_lossy(&output.stdout).into_owned()
    };
    let compile = ["-mcpu=cortex-m33", "-g", "-c", "side.c", "-o", "side.o"];
    run("arm-none-eabi-gcc", &compile);
    let fields = |file: &str| {
        let told = run(
            "gdb-multiarch",
            &["--batch", "-nx", "-q", "-x", "fields.py", file],
        );
        let mut lines: Vec<String> = told.lines().map(str::to_string).collect();
        lines.sort();
        lines
    };
    let own = fields("piano.o");
    assert!(own.len() >= 10, "{own:?}");
    assert_eq!(own, fields("side.o"));
}

/// `examples/smartknob`: C in a loop of one's own, which a thumb turns over four detents.
#[test]
fn the_smart_knob_clicks_and_rests() {
    if !whippen_need::tools(&["gcc", "make"]) {
        return;
    }
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let folder = tempfile::tempdir().expect("a folder");
    for name in ["Makefile", "main.c"] {
        let from = root.join("examples/smartknob").join(name);
        std::fs::copy(from, folder.path().join(name)).expect("the example's files");
    }
    let program = root.join("instruments/knob.whip");
    let output = Command::new("make")
        .current_dir(folder.path())
        .arg(format!("WHIPPEN={}", env!("CARGO_BIN_EXE_whippen")))
        .arg(format!("PROGRAM={}", program.display()))
        .arg("run")
        .output()
        .expect("make runs");
    let errors = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{errors}");
    let said = String::from_utf8_lossy(&output.stdout);
    for place in 1..=4 {
        assert!(said.contains(&format!(": place {place} at")), "{said}");
    }
    assert!(!said.contains("place 5"), "{said}");
    // The fourth detent is 60 degrees away, and friction may hold it a little before.
    let rests = said.lines().find_map(|line| {
        let rest = line.strip_prefix("rests at ")?.strip_suffix(" deg")?;
        rest.parse::<f64>().ok()
    });
    assert!(
        rests.is_some_and(|deg| (59.0..61.0).contains(&deg)),
        "{said}"
    );
}
