//! The boards, by programs: C compiled by the GNU toolchain that starts like vendors' code does and
//! uses the devices from both cores. Each prints over the serial port what it found; here is what a
//! real board would print.

#[path = "../made/seen.rs"]
mod seen;

use std::path::{Path, PathBuf};
use std::process::Command;

use whippen_emulator::elf::{Elf, vector_table};
use whippen_emulator::{
    BoardKind, Converter, ConverterSetup, Machine, Observer, Ports, Step, Stop, Uart, build,
};

/// Cycles after which a program is lost.
const CYCLES_MAX: u64 = 20_000_000;

/// RAM that both have.
const RAM_BYTES: usize = 256 << 10;

/// The boards that the programs are for.
const RASPBERRY: [BoardKind; 2] = [BoardKind::Rp2350, BoardKind::Rp2040];

fn compiler_present() -> bool {
    whippen_need::tool("arm-none-eabi-gcc").is_some()
}

fn compile(kind: BoardKind, program: &str, folder: &Path) -> PathBuf {
    let sources = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/boards/programs");
    let image = folder.join(format!("{}-{program}.elf", kind.name()));
    let (name, core, rom, stack1) = match kind {
        BoardKind::Rp2350 => ("RP2350", "cortex-m33", "0x10000000", "0x20082000"),
        _ => ("RP2040", "cortex-m0plus", "0x10000100", "0x20042000"),
    };
    let mut gcc = Command::new("arm-none-eabi-gcc");
    gcc.args([
        &format!("-mcpu={core}"),
        "-mthumb",
        "-O2",
        "-Wall",
        "-ffreestanding",
        "-nostdlib",
        &format!("-D{name}"),
    ]);
    gcc.args([
        format!("-Wl,--defsym=rom_base={rom}"),
        format!("-Wl,--defsym=stack1_top={stack1}"),
    ]);
    gcc.arg("-T")
        .arg(sources.join("link.ld"))
        .arg("-o")
        .arg(&image);
    let output = gcc
        .arg(sources.join("start.c"))
        .arg(sources.join(format!("{program}.c")))
        .arg("-lgcc")
        .output();
    let output = output.expect("gcc starts");
    assert!(
        output.status.success(),
        "{program}: {}",
        String::from_utf8_lossy(&output.stderr)
    );
    image
}

/// A machine with the program in its flash, at reset.
fn machine(kind: BoardKind, program: &str) -> (Machine, Ports) {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let bytes =
        std::fs::read(compile(kind, program, folder.path())).expect("the image was just built");
    let elf = Elf::parse(&bytes, false).expect("an ELF");
    let board = whippen_emulator::Board {
        vector_table: vector_table(&elf).expect("a vector table"),
        ..kind.board()
    };
    let (mut machine, ports) = build(kind, board, ConverterSetup::default()).expect("a board");
    elf.load(&mut machine.bus.memory, false)
        .expect("it fits the flash");
    machine.semihosting.enabled = true;
    machine.reset();
    (machine, ports)
}

fn printed(machine: &Machine, ports: &Ports) -> String {
    let uart = machine
        .bus
        .device::<Uart>(ports.uarts[0])
        .expect("a serial port");
    String::from_utf8_lossy(&uart.output).into_owned()
}

/// Runs a program on both boards; it must print exactly this and exit with 0.
fn prints(program: &str, expected: &str) {
    if !compiler_present() {
        return;
    }
    for kind in RASPBERRY {
        let (mut machine, ports) = machine(kind, program);
        let stop = machine.run(CYCLES_MAX);
        let text = printed(&machine, &ports);
        assert_eq!(
            (text.as_str(), stop),
            (expected, Stop::Exit { code: 0 }),
            "{program} on {}",
            kind.name()
        );
    }
}

#[test]
fn an_alarm_wakes_the_core_in_its_microsecond() {
    prints("alarm", "microseconds 250\narmed 0\n");
}

#[test]
fn two_cores_share_a_counter_behind_a_spinlock() {
    prints(
        "cores",
        "core 1 says 1001\nthen it says 7\nboth counted 4000\nlocks taken 0\n",
    );
}

#[test]
fn a_dma_copies_and_feeds_the_serial_port() {
    let text = "sent by a DMA while the core sleeps: longer than the port's queue";
    prints("dma", &format!("wrong words 0\n{text}\nleft 0\n"));
}

#[test]
fn state_machines_and_pwm_reach_the_pins() {
    prints("pins", "wrong bytes 0\nhigh behind a wrap 1\n");
}

#[test]
fn both_cores_serve_the_converter() {
    const KEYS: u16 = 10;
    const TICKS: u16 = 200;
    if !compiler_present() {
        return;
    }
    for kind in RASPBERRY {
        let (mut machine, ports) = machine(kind, "converter");
        let word = |tick: u16, key: u16| tick.wrapping_mul(977).wrapping_add(key * 131) % 9000;
        let samples = (0..TICKS).flat_map(|tick| (0..KEYS).map(move |key| word(tick, key)));
        let converter = machine
            .bus
            .device_mut::<Converter>(ports.converter)
            .expect("a converter");
        converter.recording = true;
        converter.samples.extend(samples);
        let stop = machine.run(CYCLES_MAX);
        let text = printed(&machine, &ports);
        let expected = (
            "overruns 0\nrounds missed by core 1 0\n",
            Stop::Exit { code: 0 },
        );
        assert_eq!((text.as_str(), stop), expected, "on {}", kind.name());
        let converter = machine
            .bus
            .device::<Converter>(ports.converter)
            .expect("a converter");
        let drives = (0..TICKS).flat_map(|tick| {
            (0..KEYS).map(move |key| (3 * word(tick, key)).wrapping_sub(key) as i16)
        });
        assert!(
            converter.drives.iter().copied().take(2000).eq(drives),
            "on {}",
            kind.name()
        );
    }
}

/// It prints, is fed for 240 us, and bites 100 us after the last time.
#[test]
fn the_watchdog_bites_on_time() {
    if !compiler_present() {
        return;
    }
    for kind in RASPBERRY {
        let (mut machine, ports) = machine(kind, "dog");
        let stop = machine.run(CYCLES_MAX);
        assert_eq!(
            (printed(&machine, &ports).as_str(), stop),
            ("guarded\n", Stop::Reset),
            "on {}",
            kind.name()
        );
        // Eight bytes of 10 bits at about a megabaud, before that some microseconds of start-up.
        let us = machine.cycle(0) * 1_000_000 / u64::from(kind.board().clock_hz);
        assert!(
            (340 + 80..340 + 80 + 60).contains(&us),
            "on {}: {us} us",
            kind.name()
        );
    }
}

/// Nothing runs apart or by blocks while it looks.
struct Watcher;

impl Observer for Watcher {
    fn instruction(&mut self, _: &Step<'_>) {}
}

/// Each program, stopped every now and then, is where it is when its cores take turns.
#[test]
fn programs_are_where_they_are_by_turns() {
    if !compiler_present() {
        return;
    }
    for program in ["alarm", "cores", "dma", "pins", "converter", "dog"] {
        for kind in RASPBERRY {
            let (mut fast, ports) = machine(kind, program);
            let (mut judge, _) = machine(kind, program);
            for machine in [&mut fast, &mut judge] {
                let converter: Option<&mut Converter> = machine.bus.device_mut(ports.converter);
                let samples = &mut converter.expect("a converter").samples;
                samples.extend((0..400).map(|word| word * 131));
            }
            let (mut noise, mut until) = (9_u64, 0);
            loop {
                noise = noise
                    .wrapping_mul(6_364_136_223_846_793_005)
                    .wrapping_add(1);
                until += 1 + (noise >> 33) % [60, 900, 12_000][(noise >> 31) as usize % 3];
                let stops = (fast.run(until), judge.run_observed(until, &mut Watcher));
                let what = format!("{program} on {}, up to {until}", kind.name());
                assert_eq!(stops.0, stops.1, "{what}");
                let state = |machine| (seen::cores(machine), printed(machine, &ports));
                assert_eq!(state(&fast), state(&judge), "{what}");
                if stops.0 != Stop::Limit || until > CYCLES_MAX {
                    assert!(until < CYCLES_MAX, "{what}");
                    break;
                }
            }
            assert!(
                seen::ram(&fast, RAM_BYTES) == seen::ram(&judge, RAM_BYTES),
                "{program} on {}: RAM",
                kind.name()
            );
        }
    }
}

/// The committed ROM is what the assembler makes of its source.
#[test]
fn roms_are_their_sources() {
    let roms = Path::new(env!("CARGO_MANIFEST_DIR")).join("src/rom");
    if !whippen_need::tools(&[
        "arm-none-eabi-as",
        "arm-none-eabi-ld",
        "arm-none-eabi-objcopy",
    ]) {
        return;
    }
    let folder = tempfile::tempdir().expect("a temporary folder");
    let run = |tool: &str, arguments: &[&str]| {
        let output = Command::new(tool)
            .args(arguments)
            .current_dir(folder.path())
            .output()
            .expect("the tool starts");
        assert!(
            output.status.success(),
            "{tool}: {}",
            String::from_utf8_lossy(&output.stderr)
        );
    };
    for (name, core) in [("rp2350", "cortex-m33"), ("rp2040", "cortex-m0plus")] {
        let source = roms.join(format!("{name}.s"));
        run(
            "arm-none-eabi-as",
            &[
                &format!("-mcpu={core}"),
                "-I",
                &roms.to_string_lossy(),
                &source.to_string_lossy(),
                "-o",
                "rom.o",
            ],
        );
        run("arm-none-eabi-ld", &["-Ttext=0", "rom.o", "-o", "rom.elf"]);
        run(
            "arm-none-eabi-objcopy",
            &["-O", "binary", "rom.elf", "rom.bin"],
        );
        let assembled = std::fs::read(folder.path().join("rom.bin")).expect("just made");
        let committed = std::fs::read(roms.join(format!("{name}.bin"))).expect("committed");
        assert!(
            assembled == committed,
            "{name}.bin is not what {name}.s says"
        );
    }
}
