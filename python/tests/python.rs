//! The wheel as `maturin` makes it, installed into a folder and used by Python (`check.py`).

use std::path::Path;
use std::process::Command;

/// Runs a program to its end.
fn succeeds(command: &mut Command) -> String {
    let output = command.output().expect("it starts");
    let [out, errors] =
        [output.stdout, output.stderr].map(|text| String::from_utf8_lossy(&text).into_owned());
    assert!(output.status.success(), "{command:?}: {out}\n{errors}");
    out
}

#[test]
fn the_wheel_does_what_its_page_says() {
    let (Some(_), Some(python)) = (
        whippen_need::python("maturin"),
        whippen_need::python("numpy"),
    ) else {
        return;
    };
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let folder = tempfile::tempdir().expect("a folder");
    let [wheels, package, written] =
        ["wheels", "package", "written"].map(|name| folder.path().join(name));
    std::fs::create_dir(&written).expect("it is new");
    succeeds(
        Command::new(&python)
            .args([
                "-m",
                "maturin",
                "build",
                "--locked",
                "--profile",
                "dev",
                "-m",
                "python/Cargo.toml",
                "-i",
            ])
            .arg(&python)
            .arg("--out")
            .arg(&wheels)
            .current_dir(&root),
    );
    let mut found = std::fs::read_dir(&wheels).expect("it was made");
    let wheel = found.next().expect("a wheel").expect("it is read").path();
    let name = wheel
        .file_name()
        .expect("a name")
        .to_string_lossy()
        .into_owned();
    assert!(name.contains("-cp310-abi3-"), "{name}");
    let install = [
        "-m",
        "pip",
        "install",
        "-q",
        "--no-deps",
        "--no-index",
        "--target",
    ];
    succeeds(Command::new(&python).args(install).args([&package, &wheel]));
    let out = succeeds(
        Command::new(&python)
            .arg(root.join("python/tests/check.py"))
            .arg(&written)
            .env("PYTHONPATH", &package)
            .current_dir(&root),
    );
    assert!(out.lines().count() >= 9 && out.ends_with("ok\n"), "{out}");
    let version = Command::new(package.join("bin/whippen"))
        .arg("--version")
        .env("PYTHONPATH", &package)
        .output()
        .expect("the wheel brings the command");
    assert_eq!(
        String::from_utf8_lossy(&version.stdout).trim(),
        concat!("whippen ", env!("CARGO_PKG_VERSION"))
    );
}
