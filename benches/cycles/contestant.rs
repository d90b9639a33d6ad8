//! Programs in C, compiled for the board: `reset(in)` and `tick(in, out)` over the words at
//! `in_words`, `out_words`.

use std::fmt;
use std::path::Path;
use std::process::Command;

use super::{Failure, KEYS, Setting};

/// Who compiles.
#[derive(Clone, Copy)]
pub enum Compiler {
    Gcc,
    Clang,
}

impl Compiler {
    pub const ALL: [Compiler; 2] = [Compiler::Gcc, Compiler::Clang];

    fn command(self, cpu: &str) -> Command {
        match self {
            Compiler::Gcc => Command::new("arm-none-eabi-gcc"),
            Compiler::Clang => {
                let mut clang = Command::new("clang-19");
                clang.arg(match cpu {
                    "cortex-m33" => "--target=thumbv8m.main-none-eabi",
                    "cortex-m4" => "--target=thumbv7em-none-eabi",
                    _ => "--target=thumbv6m-none-eabi",
                });
                clang
            }
        }
    }
}

impl fmt::Display for Compiler {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str(match self {
            Compiler::Gcc => "gcc -O3",
            Compiler::Clang => "clang-19 -O3",
        })
    }
}

/// A program.
pub struct Contestant {
    /// What it is.
    pub name: &'static str,
    text: String,
}

/// Around a generated text.
const KERNEL: &str = "
static NAME_state state;
uint16_t in_words[INS];
int16_t out_words[OUTS];
void bench_reset(void) { NAME_defaults(&state); NAME_init(&state, in_words); }
void bench_tick(void) { NAME_tick(&state, in_words, out_words); state.events = 0; }
";

/// Around the text by hand.
const BY_HAND: &str = "
uint16_t in_words[KEYS];
int16_t out_words[KEYS];
static Live live;
void bench_reset(void) { live.weight = Q(-0.13, 24); reset(in_words); }
void bench_tick(void) { tick(in_words, out_words, &live); }
";

impl Contestant {
    /// A Kernel as the compiler writes it in C.
    pub fn kernel(name: &str, text: &str, setting: &Setting) -> Contestant {
        let words = setting.ports.map(|ports| setting.keys * ports.max(1));
        let around = KERNEL
            .replace("NAME", name)
            .replace("INS", &words[0].to_string())
            .replace("OUTS", &words[1].to_string());
        Contestant {
            name: "the Kernel in C",
            text: format!("{text}\n{around}"),
        }
    }

    /// The grand written by hand.
    pub fn by_hand() -> Contestant {
        let text = include_str!("../peers/piano.c");
        Contestant {
            name: "C by hand",
            text: format!("#define KEYS {KEYS}\n{text}\n{BY_HAND}"),
        }
    }

    /// The image; none where the compiler, or the linker and C library that both use, are absent.
    pub fn build(&self, compiler: Compiler, setting: &Setting) -> Result<Option<Vec<u8>>, Failure> {
        let folder = tempfile::tempdir()?;
        let (c, object, elf) = (
            folder.path().join("x.c"),
            folder.path().join("x.o"),
            folder.path().join("x.elf"),
        );
        std::fs::write(&c, &self.text)?;
        let cpu = format!("-mcpu={}", setting.cpu.replace("m0+", "m0plus"));
        let mut command = compiler.command(setting.cpu);
        command.args([
            &cpu,
            "-mthumb",
            "-mfloat-abi=soft",
            "-O3",
            "-ffreestanding",
            "-c",
        ]);
        if !run(command.arg(&c).arg("-o").arg(&object))? {
            return Ok(None);
        }
        let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("benches/peers/board.ld");
        let mut link = Command::new("arm-none-eabi-gcc");
        link.args([
            &cpu,
            "-mthumb",
            "-mfloat-abi=soft",
            "-nostartfiles",
            "-Wl,--no-warn-rwx-segments",
        ]);
        let linked = run(link
            .arg("-T")
            .arg(script)
            .arg(&object)
            .arg("-lgcc")
            .arg("-o")
            .arg(&elf))?;
        Ok(if linked {
            Some(std::fs::read(elf)?)
        } else {
            None
        })
    }
}

/// Whether the command could be run; it must succeed then.
fn run(command: &mut Command) -> Result<bool, Failure> {
    match command.output() {
        Err(e) if e.kind() == std::io::ErrorKind::NotFound => Ok(false),
        Err(e) => Err(e.into()),
        Ok(output) if output.status.success() => Ok(true),
        Ok(output) => Err(String::from_utf8_lossy(&output.stderr).into_owned().into()),
    }
}
