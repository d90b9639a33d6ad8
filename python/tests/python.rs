//! The wheel as `maturin` makes it, installed into a folder and used by Python (`check.py`).

use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::OnceLock;

/// Runs a program to its end.
fn succeeds(command: &mut Command) -> String {
    let output = command.output().expect("it starts");
    let [out, errors] =
        [output.stdout, output.stderr].map(|text| String::from_utf8_lossy(&text).into_owned());
    assert!(output.status.success(), "{command:?}: {out}\n{errors}");
    out
}

/// The wheel, built and installed into a folder that lives as long as this process: the Python that
/// takes it, the folder; none where a judge is absent.
fn installed() -> Option<&'static (PathBuf, PathBuf)> {
    static INSTALLED: OnceLock<Option<(PathBuf, PathBuf)>> = OnceLock::new();
    let made = || {
        let (_, python) = (
            whippen_need::python("maturin")?,
            whippen_need::python("numpy")?,
        );
        let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("wheel");
        let _ = std::fs::remove_dir_all(&folder);
        let package = install(&python, &folder);
        Some((python, package))
    };
    INSTALLED.get_or_init(made).as_ref()
}

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

/// Builds the wheel for a Python and unpacks it. Gives the folder of its modules.
fn install(python: &Path, folder: &Path) -> PathBuf {
    let [wheels, package] = ["wheels", "package"].map(|name| folder.join(name));
    let build = "-m maturin build --locked --profile dev -m python/Cargo.toml -i";
    succeeds(
        Command::new(python)
            .args(build.split(' '))
            .arg(python)
            .arg("--out")
            .arg(&wheels)
            .current_dir(root()),
    );
    let mut found = std::fs::read_dir(&wheels).expect("it was made");
    let wheel = found.next().expect("a wheel").expect("it is read").path();
    let name = wheel.file_name().expect("a name").to_string_lossy();
    assert!(name.contains("-cp310-abi3-"), "{name}");
    let install = "-m pip install -q --no-deps --no-index --target";
    let install = install.split(' ');
    succeeds(Command::new(python).args(install).args([&package, &wheel]));
    package
}

#[test]
fn the_wheel_does_what_its_page_says() {
    let Some((python, package)) = installed() else {
        return;
    };
    let written = tempfile::tempdir().expect("a folder");
    let out = succeeds(
        Command::new(python)
            .arg(root().join("python/tests/check.py"))
            .arg(written.path())
            .env("PYTHONPATH", package)
            .current_dir(root()),
    );
    assert!(out.lines().count() >= 9 && out.ends_with("ok\n"), "{out}");
    let version = Command::new(package.join("bin/whippen"))
        .arg("--version")
        .env("PYTHONPATH", package)
        .output()
        .expect("the wheel brings the command");
    assert_eq!(
        String::from_utf8_lossy(&version.stdout).trim(),
        concat!("whippen ", env!("CARGO_PKG_VERSION"))
    );
}

/// One of `examples/python`, with the package that it is for.
fn example(judge: &str) {
    let (Some((python, package)), Some(_)) = (installed(), whippen_need::python(judge)) else {
        return;
    };
    let out = succeeds(
        Command::new(python)
            .args(["python/tests/examples.py", judge])
            .env("PYTHONPATH", package)
            .current_dir(root()),
    );
    assert!(out.ends_with("ok\n"), "{out}");
}

#[test]
fn scipy_fits_a_key() {
    example("scipy");
}

#[test]
fn optuna_finds_a_weight() {
    example("optuna");
}

#[test]
fn dask_plays_many_weights() {
    example("dask");
}

#[test]
fn ray_plays_many_weights() {
    example("ray");
}
