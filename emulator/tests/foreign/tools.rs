//! The GNU toolchain and QEMU, from outside.

use std::fmt;
use std::path::{Path, PathBuf};
use std::process::Command;

use whippen_emulator::CoreKind;

/// A core as gcc and QEMU know it.
pub struct Target {
    pub core: CoreKind,
    name: &'static str,
    flags: &'static [&'static str],
    machine: &'static str,
    rom: &'static str,
    ram: &'static str,
    dsp: bool,
}

/// The cores, each with and without its FPU.
pub const TARGETS: [Target; 5] = [
    // The first core of this board has neither DSP extension nor FPU.
    Target {
        core: CoreKind::CortexM33,
        name: "cortex-m33 without DSP",
        flags: &["-mcpu=cortex-m33+nodsp", "-mfloat-abi=soft"],
        machine: "mps2-an521",
        rom: "0x10000000",
        ram: "0x38000000",
        dsp: false,
    },
    Target {
        core: CoreKind::CortexM4,
        name: "cortex-m4",
        flags: &["-mcpu=cortex-m4", "-mfloat-abi=soft"],
        machine: "mps2-an386",
        rom: "0",
        ram: "0x20000000",
        dsp: true,
    },
    // QEMU's only ARMv6-M is the Cortex-M0 of the micro:bit, whose instructions are those of the
    // M0+.
    Target {
        core: CoreKind::CortexM0Plus,
        name: "cortex-m0plus",
        flags: &["-mcpu=cortex-m0plus"],
        machine: "microbit",
        rom: "0",
        ram: "0x20000000",
        dsp: false,
    },
    Target {
        core: CoreKind::CortexM33,
        name: "cortex-m33, hard float",
        flags: &["-mcpu=cortex-m33", "-mfloat-abi=hard", "-mfpu=fpv5-sp-d16"],
        machine: "mps2-an505",
        rom: "0x10000000",
        ram: "0x38000000",
        dsp: true,
    },
    Target {
        core: CoreKind::CortexM4,
        name: "cortex-m4, hard float",
        flags: &["-mcpu=cortex-m4", "-mfloat-abi=hard", "-mfpu=fpv4-sp-d16"],
        machine: "mps2-an386",
        rom: "0",
        ram: "0x20000000",
        dsp: true,
    },
];

const LEVELS: [&str; 4] = ["-O0", "-O2", "-O3", "-Os"];

/// Whether everything is installed; if not, the test counts as skipped.
pub fn have_all() -> bool {
    let names = ["arm-none-eabi-gcc", "arm-none-eabi-g++", "qemu-system-arm"];
    whippen_need::tools(&names) && whippen_need::newlib()
}

/// One program for one core at one level of optimization.
pub struct Build<'t> {
    program: &'t str,
    pub target: &'t Target,
    level: &'static str,
}

impl fmt::Display for Build<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "{} for {} at {}",
            self.program, self.target.name, self.level
        )
    }
}

impl<'t> Build<'t> {
    /// All levels, if the core can run the program.
    pub fn all(program: &'t str, target: &'t Target) -> impl Iterator<Item = Self> {
        let wanted = program != "simd" || target.dsp;
        LEVELS
            .into_iter()
            .filter(move |_| wanted)
            .map(move |level| Self {
                program,
                target,
                level,
            })
    }

    /// Compiles and links the program.
    pub fn compile(&self, folder: &Path) -> PathBuf {
        let sources = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/foreign/programs");
        let image = folder.join("image.elf");
        let define = |name: &str, value: &str| format!("-Wl,--defsym={name}={value}");
        let mut gcc = Command::new("arm-none-eabi-gcc");
        gcc.args(self.target.flags).args([
            "-mthumb",
            "-masm-syntax-unified",
            self.level,
            "-g",
            "-Wall",
            "-ffunction-sections",
        ]);
        gcc.args(["--specs=nano.specs", "-nostartfiles", "-Wl,--gc-sections"]);
        gcc.args([
            define("rom_base", self.target.rom),
            define("ram_base", self.target.ram),
        ]);
        gcc.arg("-T")
            .arg(sources.join("link.ld"))
            .arg("-o")
            .arg(&image);
        let cpp = sources.join(format!("{}.cpp", self.program));
        if cpp.exists() {
            gcc.args(["-fno-exceptions", "-fno-rtti", "-x", "c++"])
                .arg(cpp)
                .args(["-x", "c"]);
        } else {
            gcc.arg(sources.join(format!("{}.c", self.program)));
        }
        let output = gcc
            .arg(sources.join("start.c"))
            .output()
            .expect("gcc starts");
        assert!(
            output.status.success(),
            "{self} does not compile:\n{}",
            String::from_utf8_lossy(&output.stderr)
        );
        image
    }

    /// Output and exit code of the image in QEMU.
    pub fn qemu(&self, image: &Path) -> (String, u32) {
        // Half a minute is a hundred times what any of them takes.
        let mut qemu = Command::new("timeout");
        qemu.args([
            "30",
            "qemu-system-arm",
            "-M",
            self.target.machine,
            "-nographic",
            "-monitor",
            "none",
            "-serial",
            "none",
        ]);
        qemu.args(["-semihosting-config", "enable=on,target=native", "-kernel"])
            .arg(image);
        let output = qemu.output().expect("QEMU starts");
        let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
        let code = output.status.code().unwrap_or(-1) as u32;
        // With -nographic, semihosting's console is stderr or stdout depending on QEMU's version.
        (text(&output.stdout) + &text(&output.stderr), code)
    }
}
