//! C compilers, and where what they make runs: here, or on a Cortex-M33 in QEMU.

use std::path::{Path, PathBuf};
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
    compiler: PathBuf,
    flags: Vec<String>,
    place: Place,
}

impl std::fmt::Display for Toolchain {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let name = self.compiler.file_name().unwrap_or_default();
        write!(f, "{} {}", name.display(), self.flags.join(" "))
    }
}

/// A toolchain with flags; none where it is absent, and the test counts as skipped.
pub type Find = fn(&[&str]) -> Option<Toolchain>;

/// GCC for this computer.
pub fn gcc(flags: &[&str]) -> Option<Toolchain> {
    find("gcc", flags, Place::Host)
}

/// Clang for this computer.
pub fn clang(flags: &[&str]) -> Option<Toolchain> {
    find("clang", flags, Place::Host)
}

/// GCC for the Cortex-M33, with newlib, and QEMU to run what it makes.
pub fn cortex_m33(flags: &[&str]) -> Option<Toolchain> {
    let runs = whippen_need::newlib() && whippen_need::tool("qemu-system-arm").is_some();
    runs.then(|| find("arm-none-eabi-gcc", flags, Place::CortexM33))?
}

fn find(name: &str, flags: &[&str], place: Place) -> Option<Toolchain> {
    Some(Toolchain {
        compiler: whippen_need::tool(name)?,
        flags: flags.iter().map(ToString::to_string).collect(),
        place,
    })
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
        let mut compile = Command::new(&self.compiler);
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
