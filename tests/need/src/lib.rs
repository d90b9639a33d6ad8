//! What tests need from outside: programs that judge, and recordings, neither part of the
//! repository; how many random cases.
//!
//! A test asks first and returns where it gets nothing; it then counts as skipped, not as passed:
//!
//! ```no_run
//! let Some(qemu) = whippen_need::tool("qemu-system-arm") else { return };
//! ```
//!
//! ```text
//! WHIPPEN_SKIPS=FILE     each skip is a line of that file: package, binary, test, what it needs;
//!                        `tests/run` sums them up. Without it they go to standard error.
//! WHIPPEN_REQUIRE=LIST   what must be there, separated by commas: `tools`, `recordings`, `all`,
//!                        or names of tools. A test that lacks it fails and says what to install.
//! ```
//!
//! A test is known by the name of its thread, so it asks on the thread that it was started on.
//! What there is to ask for is the table `tests/need/tools.txt`, which `tests/setup` installs.

mod skip;
#[cfg(test)]
mod tests;
mod tool;

use std::path::{Path, PathBuf};
use std::process::Command;
use std::str::FromStr;

pub use tool::{Tool, table};

/// How many cases of something random are tried: `usual`, or what a variable of the environment
/// says.
///
/// # Panics
///
/// As [`asked`].
pub fn count<T: FromStr>(variable: &str, usual: T) -> T {
    asked(variable).unwrap_or(usual)
}

/// The number that a variable of the environment holds; none where it is not set.
///
/// # Panics
///
/// Where it holds no such number: whoever asked for more must not get the usual few.
pub fn asked<T: FromStr>(variable: &str) -> Option<T> {
    let text = std::env::var_os(variable)?;
    let number = text.to_str().and_then(|text| text.parse().ok());
    assert!(
        number.is_some(),
        "{variable}={} is no count",
        text.display()
    );
    number
}

/// The program of that name in the table; none, and the test counts as skipped, where it is absent.
///
/// # Panics
///
/// Where it is absent and required, or not in the table.
pub fn tool(name: &str) -> Option<PathBuf> {
    let tool = tool::named(name);
    let found = tool.find(&std::env::var_os("PATH").unwrap_or_default());
    if found.is_none() {
        skip::record(tool.name(), "tools", &tool.advice());
    }
    found
}

/// Whether all these programs are there; if not, the test counts as skipped.
///
/// # Panics
///
/// As [`tool`].
pub fn tools(names: &[&str]) -> bool {
    names.iter().all(|name| tool(name).is_some())
}

/// Whether newlib is there, the C library of `arm-none-eabi-gcc`; if not, the test counts as
/// skipped.
///
/// # Panics
///
/// As [`tool`].
pub fn newlib() -> bool {
    let Some(compiler) = tool("arm-none-eabi-gcc") else {
        return false;
    };
    // The compiler repeats the name alone of what it does not find.
    let found = Command::new(compiler)
        .arg("-print-file-name=libc_nano.a")
        .output()
        .is_ok_and(|output| output.stdout.contains(&b'/'));
    if !found {
        let tool = tool::named("newlib");
        skip::record(tool.name(), "tools", &tool.advice());
    }
    found
}

/// A Python that has a module which judges (`tests/need/judges.txt`); none, and the test counts as
/// skipped, where there is none: neither in the folder that `tests/setup` makes nor on the search
/// path.
///
/// # Panics
///
/// Where it is absent and required.
pub fn python(module: &str) -> Option<PathBuf> {
    let own = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../target/judges/bin/python");
    let imports = |python: &PathBuf| {
        let arguments = ["-c", &format!("import {module}")];
        let output = Command::new(python).args(arguments).output();
        output.is_ok_and(|output| output.status.success())
    };
    let found = [own, PathBuf::from("python3")].into_iter().find(imports);
    if found.is_none() {
        skip::record(module, "judges", "tests/setup, which takes it from PyPI");
    }
    found
}

/// The command as a WebAssembly module, which `tests/setup` makes of the sources; none, and the
/// test counts as skipped, where it is absent.
///
/// # Panics
///
/// Where it is absent and required.
pub fn module() -> Option<PathBuf> {
    let advice = "tests/setup, which builds it (Debian: rustc-web rust-web-src wasi-libc)";
    made("module/whippen.wasm", "module", advice)
}

/// A file of a package of npm that judges; none, and the test counts as skipped, where it is
/// absent.
///
/// # Panics
///
/// Where it is absent and required.
pub fn npm(file: &str) -> Option<PathBuf> {
    // A scope and a name within it, or a name alone.
    let parts = if file.starts_with('@') { 2 } else { 1 };
    let package: Vec<&str> = file.split('/').take(parts).collect();
    made(
        &format!("npm/node_modules/{file}"),
        &package.join("/"),
        FROM_NPM,
    )
}

/// The packages that the extension of VS Code is made with, a folder `node_modules`; none, and the
/// test counts as skipped, where they are absent.
///
/// # Panics
///
/// Where they are absent and required.
pub fn extension_packages() -> Option<PathBuf> {
    let name = "vscode-languageclient";
    let file = format!("vscode/node_modules/{name}/package.json");
    let found = made(&file, name, FROM_NPM)?;
    found.ancestors().nth(2).map(Path::to_path_buf)
}

/// The processor of `examples/embassy`, as Rust names it.
pub const EMBASSY_TARGET: &str = "thumbv8m.main-none-eabihf";

/// Whether `examples/embassy` can be built without a network: Rust's library for its processor and
/// the crates of its lock file are there; if not, the test counts as skipped.
///
/// # Panics
///
/// Where they are absent and required.
pub fn embassy() -> bool {
    let manifest = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/../../examples/embassy/Cargo.toml"
    );
    let library = Command::new("rustc")
        .args(["--print", "target-libdir", "--target", EMBASSY_TARGET])
        .output()
        .is_ok_and(|output| Path::new(String::from_utf8_lossy(&output.stdout).trim()).is_dir());
    let fetch = [
        "fetch",
        "--offline",
        "--locked",
        "--quiet",
        "--manifest-path",
    ];
    let crates = || {
        let mut cargo = Command::new("cargo");
        let output = cargo.args(fetch).arg(manifest).output();
        output.is_ok_and(|output| output.status.success())
    };
    let found = library && crates();
    if !found {
        let advice = "tests/setup, which takes its crates and Rust's library for its processor";
        skip::record("embassy", "judges", advice);
    }
    found
}

const FROM_NPM: &str = "tests/setup, which takes it from npm";

/// A file that `tests/setup` leaves in the folder `target`.
fn made(file: &str, name: &str, advice: &str) -> Option<PathBuf> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("../../target")
        .join(file);
    if path.is_file() {
        return Some(path);
    }
    skip::record(name, "judges", advice);
    None
}

/// A folder of the recordings that lie beside the repository (`../shared/data`); none, and the test
/// counts as skipped, where it is absent.
///
/// # Panics
///
/// Where it is absent and recordings are required.
pub fn recordings(folder: &str) -> Option<PathBuf> {
    let data = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data");
    let path = data.join(folder);
    if path.is_dir() {
        return Some(path);
    }
    let name = format!("recordings of {folder}");
    skip::record(&name, "recordings", "a folder ../shared/data");
    None
}
