//! The GNU toolchain, if it is there.

use std::path::Path;
use std::process::{Command, Output};

use crate::cli::Shell;

/// Compiles in the shell's folder; false where there is no compiler, and the test counts as
/// skipped.
pub fn gcc(shell: &Shell, args: &[&str]) -> bool {
    if whippen_need::tool("arm-none-eabi-gcc").is_none() {
        return false;
    }
    done(
        Command::new("arm-none-eabi-gcc")
            .args(args)
            .arg("-mthumb")
            .current_dir(shell.path(".")),
    );
    true
}

/// Compiles and links one of the emulator's foreign programs to `NAME.elf`, for a Cortex-M33
/// without FPU.
pub fn link(shell: &Shell, name: &str, options: &[&str]) -> Option<()> {
    let programs = Path::new(env!("CARGO_MANIFEST_DIR")).join("emulator/tests/foreign/programs");
    let path = |file: &str| programs.join(file).display().to_string();
    let (elf, source, start, script) = (
        format!("{name}.elf"),
        path(&format!("{name}.c")),
        path("start.c"),
        path("link.ld"),
    );
    let mut args = vec![
        "-mcpu=cortex-m33",
        "-mfloat-abi=soft",
        "-masm-syntax-unified",
        "-g",
        "-nostartfiles",
        "-T",
        &script,
    ];
    args.extend([
        "-Wl,--defsym=rom_base=0x10000000",
        "-Wl,--defsym=ram_base=0x20000000",
        "-o",
        &elf,
        &source,
        &start,
    ]);
    args.extend(options);
    gcc(shell, &args).then_some(())
}

fn done(command: &mut Command) -> Output {
    let output = command.output().expect("the tool starts");
    assert!(
        output.status.success(),
        "{command:?}\n{}",
        String::from_utf8_lossy(&output.stderr)
    );
    output
}
