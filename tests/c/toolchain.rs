//! The C compilers that are installed, and where what they make runs: here, or on a Cortex-M33 in
//! QEMU.

use std::path::Path;
use std::process::{Command, Output, Stdio};

/// Where a program runs.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Place {
    Host,
    /// QEMU's mps2-an505, with files through semihosting.
    CortexM33,
}

/// A C compiler with its flags.
pub struct Toolchain {
    compiler: &'static str,
    flags: Vec<String>,
    place: Place,
}

impl std::fmt::Display for Toolchain {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{} {}", self.compiler, self.flags.join(" "))
    }
}

/// The compilers of this computer; which are not there is said.
pub fn host(flags: &[&str]) -> Vec<Toolchain> {
    let found = [&["gcc"][..], &["clang", "clang-19"]]
        .into_iter()
        .filter_map(|names| installed(names));
    found
        .map(|compiler| Toolchain {
            compiler,
            flags: owned(flags),
            place: Place::Host,
        })
        .collect()
}

/// GCC for the Cortex-M33 and QEMU to run it, if both are there; what is not is said.
pub fn cortex_m33(flags: &[&str]) -> Option<Toolchain> {
    let compiler = installed(&["arm-none-eabi-gcc"])?;
    installed(&["qemu-system-arm"])?;
    Some(Toolchain {
        compiler,
        flags: owned(flags),
        place: Place::CortexM33,
    })
}

fn owned(flags: &[&str]) -> Vec<String> {
    flags.iter().map(ToString::to_string).collect()
}

/// The first of these that is there.
fn installed(names: &[&'static str]) -> Option<&'static str> {
    let answers = |name: &&&str| {
        let answer = Command::new(name)
            .arg("--version")
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .status();
        answer.is_ok_and(|status| status.success())
    };
    let found = names.iter().find(answers).copied();
    if found.is_none() {
        println!("skipped: {} is absent", names[0]);
    }
    found
}

impl Toolchain {
    /// The text around kernels: `get` and `put`, and what calls `play`.
    pub fn frame(&self) -> &'static str {
        match self.place {
            Place::Host => include_str!("host.c"),
            Place::CortexM33 => include_str!("bare.c"),
        }
    }

    /// Compiles and runs a text in a folder; what it makes of the file `input` is in the file
    /// `output`.
    pub fn run(&self, folder: &Path, text: &str) {
        std::fs::write(folder.join("kernels.c"), text).expect("writable");
        let mut compile = Command::new(self.compiler);
        compile
            .args(&self.flags)
            .args(["kernels.c", "-o", "kernels"])
            .current_dir(folder);
        if self.place == Place::CortexM33 {
            std::fs::write(folder.join("bare.ld"), include_str!("bare.ld")).expect("writable");
            compile.args([
                "-mcpu=cortex-m33",
                "-mthumb",
                "--specs=nano.specs",
                "-nostartfiles",
                "-T",
                "bare.ld",
            ]);
        }
        self.ended(&compile.output().unwrap_or_else(|e| panic!("{self}: {e}")));
        let mut run = match self.place {
            Place::Host => Command::new(folder.join("kernels")),
            Place::CortexM33 => {
                let mut qemu = Command::new("qemu-system-arm");
                qemu.args([
                    "-M",
                    "mps2-an505",
                    "-nographic",
                    "-monitor",
                    "none",
                    "-serial",
                    "none",
                ]);
                qemu.args([
                    "-semihosting-config",
                    "enable=on,target=native",
                    "-kernel",
                    "kernels",
                ]);
                qemu
            }
        };
        let output = run.current_dir(folder).stdin(Stdio::null()).output();
        self.ended(&output.unwrap_or_else(|e| panic!("{self}: {e}")));
    }

    fn ended(&self, output: &Output) {
        let said = String::from_utf8_lossy(&output.stderr);
        let said = said.lines().take(40).collect::<Vec<_>>().join("\n");
        assert!(output.status.success(), "{self}: {}\n{said}", output.status);
    }
}
