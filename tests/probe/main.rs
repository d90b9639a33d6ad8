//! `whippen monitor --probe`: the whole command with the crate `probe-rs` in it, against emulated
//! chips at the level of SWD transfers. No probe was at hand, so what USB drivers do is not tested.

mod chip;
mod glasgow;

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use probe_rs::CoreType;
use probe_rs::architecture::arm::sequences::DefaultArmSequence;
use probe_rs::architecture::arm::{ApV2Address, FullyQualifiedApAddress};
use probe_rs::probe::DebugProbeSelector;
use probe_rs::probe::list::Lister;
use whippen_emulator::BoardKind;
use whippen_emulator::elf::Elf;

use crate::chip::{Chip, KEYS};
use crate::glasgow::Glasgow;

const PROGRAM: &str = "instruments/virtual-spring.whip";
/// Some hundred ticks.
const BEFORE: u64 = 10_000_000;

fn ran(arguments: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_whippen"));
    command
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .args(arguments);
    command.output().expect("it runs")
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

/// An image for a board, of this name lest tests write one file.
fn image(kind: BoardKind, name: &str) -> PathBuf {
    let file = format!("probed-{name}-{}.elf", kind.name());
    let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join(file);
    let out = path.display().to_string();
    let keys = KEYS.to_string();
    let built = ran(&[
        "build",
        PROGRAM,
        "--board",
        kind.name(),
        "--keys",
        &keys,
        "--rate",
        "11025",
        "-o",
        &out,
    ]);
    assert!(built.status.success(), "{}", text(&built.stderr));
    path
}

/// What the command says while a probe is at a chip.
fn monitored(image: &Path, chip: &mut Chip, more: &[&str]) -> Output {
    let glasgow = Glasgow::new();
    let probe = format!("--probe={}", glasgow.name());
    let image = image.display().to_string();
    std::thread::scope(|scope| {
        let arguments = [&["monitor", &image, &probe], more].concat();
        let said = scope.spawn(move || ran(&arguments));
        glasgow.serve(chip);
        said.join().expect("it runs")
    })
}

fn status(said: &Output) -> serde_json::Value {
    assert!(said.status.success(), "{}", text(&said.stderr));
    serde_json::from_slice(&said.stdout).expect("an object")
}

fn address(image: &Path, symbol: &str) -> u32 {
    let elf = Elf::parse(&std::fs::read(image).expect("an image"), false).expect("an image");
    elf.symbols.named(symbol).expect("a symbol").address
}

/// On each chip the status is there, the cores go on, nothing is written, and nothing but memory is
/// read; the debug port is left without power, as it was.
#[test]
fn the_status_is_read_and_nothing_is_halted() {
    for kind in BoardKind::ALL {
        let image = image(kind, "status");
        let mut chip = Chip::started(kind, &image, BEFORE);
        let look = |chip: &mut Chip| status(&monitored(&image, chip, &["--json"]));
        let [first, second] = [look(&mut chip), look(&mut chip)];
        assert_eq!(chip.misdeeds, [""; 0], "{kind:?}");
        assert!(chip.reads > 100 && chip.writes.is_empty(), "{kind:?}");
        assert!(!chip.is_powered(), "{kind:?}");
        let cores = first["cores"].as_array().expect("cores");
        let keys: u64 = cores.iter().filter_map(|core| core["keys"].as_u64()).sum();
        assert_eq!(keys, u64::from(KEYS), "{kind:?}");
        for (number, core) in cores.iter().enumerate() {
            let ticks = |core: &serde_json::Value| core["ticks"].as_u64().expect("ticks");
            let [before, after] = [ticks(core), ticks(&second["cores"][number])];
            assert!(after > before && before > 50, "{kind:?}: {before}, {after}");
        }
        assert_eq!(second["missed"], 0, "{kind:?}");
        let faults = second["faults"].as_array().expect("faults");
        assert!(faults.is_empty(), "{kind:?}: {faults:?}");
    }
}

/// The model of the chip notices what a session of `probe-rs` begins with.
#[test]
fn what_a_session_does_to_a_core_would_be_noticed() {
    let image = image(BoardKind::Rp2350, "session");
    let mut chip = Chip::started(BoardKind::Rp2350, &image, BEFORE);
    let glasgow = Glasgow::new();
    let selector: DebugProbeSelector = glasgow.name().parse().expect("a name");
    std::thread::scope(|scope| {
        scope.spawn(move || {
            let mut probe = Lister::new().open(selector).expect("it opens");
            probe.attach_to_unspecified().expect("it is there");
            let sequence = DefaultArmSequence::create();
            let interface = probe.try_into_arm_debug_interface(sequence.clone());
            let mut interface = interface.map_err(|(_, why)| why).expect("it is of Arm");
            let port = FullyQualifiedApAddress::v2_with_default_dp(ApV2Address::new(0x2000));
            let started =
                sequence.debug_core_start(&mut *interface, &port, CoreType::Armv8m, None, None);
            started.expect("the core is started");
        });
        glasgow.serve(&mut chip);
    });
    let told = chip.misdeeds.join(", ");
    // DHCSR is read, then written with its key and C_DEBUGEN.
    assert_eq!(told, "0xe000edf0: None, 0xe000edf0: Some(a05f0001)");
}

/// A table on the board that leads to a core's debug registers is not followed.
#[test]
fn no_register_of_a_core_is_read_whatever_the_board_says() {
    let kind = BoardKind::Rp2350;
    let image = image(kind, "registers");
    let mut chip = Chip::started(kind, &image, BEFORE);
    let block = address(&image, "status") + 12;
    for (wrong, told) in [
        (0xe000_edf0, "0xe000edf0 is no memory"),
        (0x3fff_fff0, "0x3ffffff0 is no memory"),
        (
            0x2fff_0000,
            "the line is gone: Target device responded with a FAULT",
        ),
    ] {
        let right = chip.word(block);
        chip.set(block, wrong);
        let said = monitored(&image, &mut chip, &[]);
        chip.set(block, right);
        assert!(text(&said.stderr).contains(told), "{}", text(&said.stderr));
        assert!(!said.status.success());
    }
    assert_eq!(chip.misdeeds, [""; 0]);
    // A line that had an error is well again for the next one.
    status(&monitored(&image, &mut chip, &["--json"]));
}

/// What is written is in the board's memory: a keyboard whose file says that it is a knob is asked
/// to find its motor, and its firmware refuses.
#[test]
fn a_request_is_written_and_answered() {
    let kind = BoardKind::Rp2350;
    let image = image(kind, "asked");
    let mut chip = Chip::started(kind, &image, BEFORE);
    let file = image.display().to_string();
    let said = ran(&["monitor", &file, "--probe=ffff:ffff", "--align"]);
    assert_eq!(said.status.code(), Some(2), "{}", text(&said.stderr));
    assert!(text(&said.stderr).contains("it is for no knob"));
    let mut bytes = std::fs::read(&image).expect("an image");
    let name = b"\0core1_start\0";
    let at = bytes.windows(name.len()).position(|own| own == name);
    let at = at.expect("a symbol with a name as long");
    bytes[at..at + name.len()].copy_from_slice(b"\0board_align\0");
    std::fs::write(&image, bytes).expect("it is written");
    let said = monitored(&image, &mut chip, &["--align"]);
    assert_eq!(said.status.code(), Some(1), "{}", text(&said.stderr));
    let told = text(&said.stderr);
    assert!(told.contains("keeps no alignment of a motor"), "{told}");
    let mailbox = address(&image, "mailbox");
    let wanted = [(4, 0xffff_fffd), (8, 1), (0, 1)];
    assert_eq!(chip.writes, wanted.map(|(at, word)| (mailbox + at, word)));
    assert_eq!(chip.misdeeds, [""; 0]);
}

#[test]
fn another_chip_than_the_images_is_told() {
    let images = [BoardKind::Rp2350, BoardKind::Rp2040].map(|kind| (kind, image(kind, "other")));
    let mut chip = Chip::started(
        BoardKind::Stm32f4,
        &image(BoardKind::Stm32f4, "other"),
        BEFORE,
    );
    for (kind, image) in images {
        let said = monitored(&image, &mut chip, &[]);
        let told = text(&said.stderr);
        let why = match kind {
            BoardKind::Rp2350 => {
                "is no RP2350, for which the image is: its debug port is of version 1"
            }
            _ => "no RP2040 answers at the probe",
        };
        assert!(told.contains(why), "{told}");
        assert_eq!(said.status.code(), Some(2));
    }
    assert_eq!(chip.misdeeds, [""; 0]);
}

#[test]
fn a_probe_that_is_not_there_is_told() {
    let image = image(BoardKind::Rp2350, "nowhere").display().to_string();
    let nowhere = "20b7:9db1:tcp:127.0.0.1:1";
    for (name, why) in [
        ("ffff:ffff", "there is no debug probe ffff:ffff"),
        ("piano", "--probe=piano: is no VID:PID[:SERIAL]"),
        (nowhere, "Could not connect to remote host"),
    ] {
        let said = ran(&["monitor", &image, &format!("--probe={name}")]);
        let told = text(&said.stderr);
        assert!(told.contains(why), "{told}");
        assert_eq!(said.status.code(), Some(2));
    }
}
