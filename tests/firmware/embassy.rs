//! `examples/embassy`: the Rust project is built, and plays on the emulated chip as `interp` does.

use std::path::{Path, PathBuf};
use std::process::Command;

use whippen_compiler::kernel::Interp;

use crate::rig::kernel;

const ROOT: &str = env!("CARGO_MANIFEST_DIR");
const KEYS: usize = 4;
/// Ticks that the program keeps (`KEPT` in its main.rs).
const KEPT: usize = 1024;
const CYCLES_A_TICK: u64 = 150_000_000 / 44_100;

/// What a command says, which must succeed.
fn said(command: &mut Command) -> String {
    let output = command.output().expect("it starts");
    let told = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{command:?}: {told}");
    String::from_utf8_lossy(&output.stdout).into_owned()
}

/// The project as its README has it built, in a folder that keeps the crates for the next time.
fn built() -> PathBuf {
    let target = Path::new(ROOT).join("target/embassy");
    let project = target.join("project");
    for folder in ["src", ".cargo", "target"] {
        std::fs::create_dir_all(project.join(folder)).expect("a folder");
    }
    let files = [
        ".cargo/config.toml",
        "Cargo.lock",
        "Cargo.toml",
        "build.rs",
        "memory.x",
        "src/main.rs",
    ];
    for file in files {
        let from = Path::new(ROOT).join("examples/embassy").join(file);
        std::fs::copy(from, project.join(file)).expect("the example's files");
    }
    let program = Path::new(ROOT).join("instruments/grand-piano.whip");
    said(
        Command::new(env!("CARGO_BIN_EXE_whippen"))
            .current_dir(&project)
            .arg("build")
            .arg(program)
            .args(["grand_piano", "--keys", "4", "-o", "target/piano.o"]),
    );
    // Crates need not be fast here; what ticks is in `keys`. But where LLVM does not optimise,
    // it compares and swaps with an encoding of CMP that the architecture leaves UNPREDICTABLE.
    let plain = "profile.release.package.'*'.opt-level=0";
    let swaps = "profile.release.package.embassy-executor.opt-level=1";
    said(
        Command::new("cargo")
            .current_dir(&project)
            .args(["--config", plain, "--config", swaps])
            .args(["build", "--release", "--offline", "--locked", "--quiet"])
            .env("CARGO_TARGET_DIR", &target)
            .env_remove("RUSTFLAGS"),
    );
    target
        .join(whippen_need::EMBASSY_TARGET)
        .join("release/keys")
}

/// What stands in memory at the names after so many cycles.
fn read<const N: usize>(image: &Path, cycles: u64, names: [&str; N]) -> [Vec<u8>; N] {
    let mut command = Command::new(env!("CARGO_BIN_EXE_whippen"));
    command.arg("emulate").arg(image);
    command.args(["--board", "rp2350", "--json", "--max-cycles"]);
    command.arg(cycles.to_string());
    for name in names {
        command.args(["--read", name]);
    }
    // The limit of cycles is no good end.
    let output = command.output().expect("it starts");
    let text = String::from_utf8_lossy(&output.stdout);
    let told: serde_json::Value = text
        .lines()
        .find_map(|line| serde_json::from_str(line).ok())
        .unwrap_or_else(|| panic!("{text}"));
    assert_eq!(told["stop"], "limit", "{text}");
    std::array::from_fn(|at| {
        let digits = told["reads"][at].as_str().expect("hexadecimal");
        let byte = |at| u8::from_str_radix(&digits[at..at + 2], 16).expect("a byte");
        (0..digits.len()).step_by(2).map(byte).collect()
    })
}

fn words(bytes: &[u8]) -> Vec<u16> {
    let pairs = bytes.chunks_exact(2);
    pairs.map(|p| u16::from_le_bytes([p[0], p[1]])).collect()
}

fn ticks(bytes: &[u8]) -> usize {
    u32::from_le_bytes(bytes.try_into().expect("a word")) as usize
}

/// Its drive words are those of the reference on the words it read, no wrap of its slice is
/// missed, and keys and their state lie in SRAM.
#[test]
fn the_embassy_project_plays_on_the_emulator() {
    if !whippen_need::embassy() {
        return;
    }
    let Some(nm) = whippen_need::tool("arm-none-eabi-nm") else {
        return;
    };
    let image = built();
    let [count, sensed, driven] = read(&image, 3_300_000, ["TICKS", "SENSED", "DRIVEN"]);
    let (count, sensed, driven) = (ticks(&count), words(&sensed), words(&driven));
    assert!((600..KEPT).contains(&count), "{count} ticks");

    let kernel = kernel("grand-piano.whip");
    let mut interp = Interp::new(&kernel, KEYS).expect("it verifies");
    interp.init(&sensed[..KEYS]);
    let mut drive = vec![0; KEYS];
    for (tick, (read, wrote)) in sensed.chunks(KEYS).zip(driven.chunks(KEYS)).enumerate() {
        if tick == count {
            break;
        }
        interp.tick(read, &mut drive);
        let wrote: Vec<i16> = wrote.iter().map(|&word| word as i16).collect();
        assert_eq!(wrote, drive, "tick {tick}");
    }
    let different = |words: &[u16]| {
        words
            .iter()
            .collect::<std::collections::BTreeSet<_>>()
            .len()
    };
    assert!(different(&sensed) > 100 && different(&driven) > 100);

    // 3000 periods later it has ticked 3000 times more.
    let later = 3_300_000 + 3000 * CYCLES_A_TICK;
    let [after] = read(&image, later, ["TICKS"]);
    assert!(
        ticks(&after).abs_diff(count + 3000) <= 1,
        "{count}, {after:?}"
    );

    let symbols = said(Command::new(nm).arg(&image));
    // The handler calls nothing in flash.
    let leaves = |line: &&str| line.starts_with("20") && line.contains("Thunk");
    assert_eq!(symbols.lines().find(leaves), None);
    for name in ["grand_piano_tick", "grand_piano_state", "PWM_IRQ_WRAP_0"] {
        let line = symbols
            .lines()
            .find(|line| line.ends_with(&format!(" {name}")));
        assert!(
            line.is_some_and(|line| line.starts_with("20")),
            "{name}: {line:?}"
        );
    }
}
