//! Building an image of cases, running it under QEMU and here, comparing.

use crate::cases::Case;
use std::fmt::Write as _;
use std::path::PathBuf;
use std::process::{Command, Stdio};
use whippen_emulator::{Board, CoreKind, Machine, Region, Stop};
use whippen_isa::Arch;

/// A machine of QEMU and the same board here.
pub struct Target {
    pub machine: &'static str,
    pub core: CoreKind,
    pub arch: Arch,
    pub cpu: &'static str,
    pub code: u32,
    pub code_bytes: u32,
    pub ram: u32,
    pub ram_bytes: u32,
    pub window: u32,
    pub fpu: bool,
    pub mainline: bool,
    /// Cases of one image.
    pub batch: usize,
}

pub const MPS2_AN505: Target = Target {
    machine: "mps2-an505",
    core: CoreKind::CortexM33,
    arch: Arch::V8M,
    cpu: "cortex-m33",
    code: 0x1000_0000,
    code_bytes: 0x40_0000,
    ram: 0x3800_0000,
    ram_bytes: 0x20_0000,
    window: 0x3800_8000,
    fpu: true,
    mainline: true,
    batch: 8000,
};

pub const MPS2_AN386: Target = Target {
    machine: "mps2-an386",
    core: CoreKind::CortexM4,
    arch: Arch::V7EM,
    cpu: "cortex-m4",
    code: 0,
    code_bytes: 0x40_0000,
    ram: 0x2000_0000,
    ram_bytes: 0x40_0000,
    window: 0x2000_8000,
    ..MPS2_AN505
};

pub const MICROBIT: Target = Target {
    machine: "microbit",
    core: CoreKind::CortexM0Plus,
    arch: Arch::V6M,
    cpu: "cortex-m0plus",
    code: 0,
    code_bytes: 0x4_0000,
    ram: 0x2000_0000,
    ram_bytes: 0x4000,
    window: 0x2000_1800,
    fpu: false,
    mainline: false,
    batch: 1500,
};

impl Target {
    pub fn record_bytes(&self) -> usize {
        if self.fpu { 216 } else { 80 }
    }

    pub fn case_words(&self) -> usize {
        if self.fpu { 51 } else { 18 }
    }

    /// The top of the harness's own stack.
    pub fn stack(&self) -> u32 {
        self.ram + self.ram_bytes.min(0x1_0000)
    }

    /// What QEMU writes without what it is known to get wrong: it keeps Q where ARMv6-M has none.
    fn known(&self, mut records: Vec<u8>) -> Vec<u8> {
        if !self.mainline {
            records
                .chunks_exact_mut(self.record_bytes())
                .for_each(|record| record[31] &= !8);
        }
        records
    }

    fn board(&self) -> Board {
        let code = Region::ram("code", self.code, self.code_bytes);
        let ram = Region::ram("ram", self.ram, self.ram_bytes);
        Board {
            regions: vec![code, ram],
            vector_table: self.code,
            ..Board::generic(self.core)
        }
    }
}

/// An assembled image.
pub struct Image {
    elf: PathBuf,
    text: Vec<u8>,
    data: Vec<u8>,
    folder: tempfile::TempDir,
}

/// The tools are there.
pub struct Tools;

impl Tools {
    /// None where a tool is absent, and the test counts as skipped.
    pub fn find() -> Option<Self> {
        let names = [
            "qemu-system-arm",
            "arm-none-eabi-as",
            "arm-none-eabi-ld",
            "arm-none-eabi-objcopy",
        ];
        whippen_need::tools(&names).then_some(Self)
    }

    pub fn build(&self, target: &Target, cases: &[Case]) -> Image {
        let mut text = include_str!("harness.s").to_string();
        text.push_str("\n        .text\n        .balign 4\ncases:\n");
        cases
            .iter()
            .enumerate()
            .for_each(|(i, case)| write_state(&mut text, target, i, case));
        text.push_str("        .space 8192\n");
        cases
            .iter()
            .enumerate()
            .for_each(|(i, case)| write_code(&mut text, i, case));
        text.push_str("        .space 8192\n");
        let symbols = [
            ("FPU", u32::from(target.fpu)),
            ("MAINLINE", u32::from(target.mainline)),
            ("COUNT", cases.len() as u32),
            ("CASE_BYTES", 4 * target.case_words() as u32),
            ("RECORD_BYTES", target.record_bytes() as u32),
            ("STACK_TOP", target.stack()),
            ("WINDOW", target.window),
            ("CCR_BITS", 0x10),
        ];
        self.assemble(target, &text, &symbols)
    }

    pub fn assemble(&self, target: &Target, text: &str, symbols: &[(&str, u32)]) -> Image {
        let folder = tempfile::tempdir().expect("a folder");
        let path = |name: &str| folder.path().join(name);
        std::fs::write(path("image.s"), text).expect("written");
        let mut assembler = Command::new("arm-none-eabi-as");
        assembler
            .arg(format!("-mcpu={}", target.cpu))
            .args(["-o", "image.o", "image.s"])
            .current_dir(&folder);
        if target.fpu {
            assembler.arg(if target.arch == Arch::V8M {
                "-mfpu=fpv5-sp-d16"
            } else {
                "-mfpu=fpv4-sp-d16"
            });
        }
        symbols.iter().for_each(|(name, value)| {
            assembler.args(["--defsym", &format!("{name}={value}")]);
        });
        run(&mut assembler);
        let mut linker = Command::new("arm-none-eabi-ld");
        linker
            .args(["-o", "image.elf", "image.o", "-e", "reset"])
            .current_dir(&folder);
        linker.arg(format!("-Ttext={:#x}", target.code));
        linker.arg(format!("--section-start=.ramdata={:#x}", target.ram));
        linker.arg(format!("--section-start=.ram={:#x}", target.ram + 0x100));
        run(&mut linker);
        let section = |name: &str, file: &str| {
            run(Command::new("arm-none-eabi-objcopy")
                .args(["-O", "binary", "-j", name, "image.elf", file])
                .current_dir(&folder));
            std::fs::read(path(file)).expect("a section")
        };
        let (text, data) = (
            section(".text", "text.bin"),
            section(".ramdata", "data.bin"),
        );
        Image {
            elf: path("image.elf"),
            text,
            data,
            folder,
        }
    }

    /// What the image writes under QEMU.
    pub fn qemu(&self, target: &Target, image: &Image) -> Vec<u8> {
        let mut qemu = Command::new("timeout");
        qemu.args([
            "60",
            "qemu-system-arm",
            "-M",
            target.machine,
            "-nographic",
            "-monitor",
            "none",
            "-serial",
            "none",
        ]);
        qemu.args(["-semihosting-config", "enable=on,target=native", "-kernel"])
            .arg(&image.elf);
        let output = qemu
            .current_dir(&image.folder)
            .stdin(Stdio::null())
            .output()
            .expect("QEMU runs");
        assert!(
            output.stderr.is_empty(),
            "{}",
            String::from_utf8_lossy(&output.stderr[..output.stderr.len().min(2000)])
        );
        target.known(output.stdout)
    }
}

impl Image {
    /// What the image writes here.
    pub fn emulate(&self, target: &Target) -> Vec<u8> {
        let mut machine = Machine::new(target.board()).expect("a board");
        machine
            .bus
            .memory
            .write(target.code, &self.text)
            .expect("code fits");
        machine
            .bus
            .memory
            .write(target.ram, &self.data)
            .expect("data fits");
        machine.semihosting.enabled = true;
        machine.reset();
        let stop = machine.run(2_000_000_000);
        if stop != (Stop::Exit { code: 0 }) {
            println!("{}: {stop}", target.machine);
        }
        machine.semihosting.output
    }
}

fn run(command: &mut Command) {
    let output = command.output().expect("runs");
    let shown = String::from_utf8_lossy(&output.stderr);
    assert!(
        output.status.success(),
        "{command:?}: {}",
        shown.lines().take(20).collect::<Vec<_>>().join("\n")
    );
}

fn write_state(text: &mut String, target: &Target, index: usize, case: &Case) {
    let words: Vec<String> = case.core.iter().map(|w| format!("{w:#x}")).collect();
    let _ = writeln!(
        text,
        "        .word {}, {:#x}, {:#x}, code{index} + 1",
        words.join(", "),
        case.apsr,
        case.seed
    );
    if target.fpu {
        let words: Vec<String> = case.singles.iter().map(|w| format!("{w:#x}")).collect();
        let _ = writeln!(
            text,
            "        .word {:#x}, {}",
            case.fpscr,
            words.join(", ")
        );
    }
}

fn write_code(text: &mut String, index: usize, case: &Case) {
    let halfwords: Vec<String> = case.code.iter().map(|h| format!("{h:#x}")).collect();
    let _ = writeln!(
        text,
        "        .balign 4\ncode{index}: .short {}, 0xdf00, 0xdf00",
        halfwords.join(", ")
    );
}

const NAMES: [&str; 20] = [
    "r0",
    "r1",
    "r2",
    "r3",
    "r12",
    "lr",
    "pc",
    "xpsr",
    "r4",
    "r5",
    "r6",
    "r7",
    "r8",
    "r9",
    "r10",
    "r11",
    "sp",
    "exception",
    "cfsr",
    "memory",
];

/// The words that differ, by name.
pub fn differences(theirs: &[u8], ours: &[u8]) -> String {
    let mut text = String::new();
    for (i, (a, b)) in theirs
        .chunks(4)
        .zip(ours.chunks(4).chain(std::iter::repeat(&[][..])))
        .enumerate()
    {
        if a != b {
            let name = match i {
                0..20 => NAMES[i].to_string(),
                20 => "exc_return".to_string(),
                21 => "fpscr".to_string(),
                _ => format!("s{}", i - 22),
            };
            let word = |bytes: &[u8]| {
                bytes.try_into().map_or("-".to_string(), |b| {
                    format!("{:08x}", u32::from_le_bytes(b))
                })
            };
            let _ = write!(text, " {name} {} here {}", word(a), word(b));
        }
    }
    text
}
