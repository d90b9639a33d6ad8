//! How fast compiled code runs: `kernels.c`, compiled by GCC with -O2 for the Cortex-M33, on one
//! core and on two, in blocks and observed. Two cores run it on the same data, or each on its own
//! data in banks of its own, as on RP2350. Counted is the time on a processor, where the host tells
//! it, so that other work does not matter much; of several runs the fastest. QEMU, where it is
//! there, runs the same program on one core in between.
//!
//! `cargo bench -p whippen-emulator`; with `-- one` or another part of a row's name those rows.

use std::path::Path;
use std::process::Command;
use std::sync::LazyLock;
use std::time::Instant;
use whippen_emulator::{Board, BoardKind, CoreKind, Machine, Observer, Region, Start, Step, Stop};

const RAM: u32 = 0x1000_0000;
const RAM_BYTES: u32 = 0x4_0000;
/// Two groups of banks of RP2350.
const GROUPS: [u32; 2] = [0x2000_0000, 0x2004_0000];

/// Looks at every instruction.
struct Watcher;

impl Observer for Watcher {
    fn instruction(&mut self, step: &Step<'_>) {
        std::hint::black_box(step);
    }
}

/// Rounds of the kernels, and how many times as many QEMU gets, whose time is told in hundredths.
const ROUNDS: u32 = 100;
const QEMU_TIMES: u32 = 20;

/// The image for an address, or why there is none; its ELF is `kernels.elf` in the folder.
fn build(folder: &Path, origin: u32, rounds: u32) -> Result<Vec<u8>, String> {
    let benches = Path::new(env!("CARGO_MANIFEST_DIR")).join("benches");
    let run = |command: &mut Command| {
        let output = command
            .output()
            .map_err(|e| format!("{:?}: {e}", command.get_program()))?;
        if output.status.success() {
            Ok(())
        } else {
            Err(String::from_utf8_lossy(&output.stderr).into_owned())
        }
    };
    let (elf, image) = (folder.join("kernels.elf"), folder.join("kernels.bin"));
    let mut gcc = Command::new("arm-none-eabi-gcc");
    gcc.args([
        "-mcpu=cortex-m33",
        "-mthumb",
        "-O2",
        "-nostdlib",
        "-fno-builtin",
    ]);
    run(gcc
        .arg(format!("-DROUNDS={rounds}"))
        .arg(format!("-Wl,--defsym=origin={origin:#x}"))
        .arg("-T")
        .arg(benches.join("kernels.ld"))
        .arg(benches.join("kernels.c"))
        .arg("-o")
        .arg(&elf))?;
    run(Command::new("arm-none-eabi-objcopy")
        .args(["-O", "binary"])
        .arg(&elf)
        .arg(&image))?;
    std::fs::read(&image).map_err(|e| e.to_string())
}

/// A board whose cores run images that lie in its memory.
fn machine(board: Board, images: &[(u32, &[u8])]) -> Machine {
    let mut machine = Machine::new(board).expect("a board");
    for (origin, image) in images {
        let memory = &mut machine.bus.memory;
        memory.write(*origin, image).expect("an image that fits");
    }
    machine.semihosting.enabled = true;
    let word = |image: &[u8], at: usize| {
        u32::from_le_bytes([image[at], image[at + 1], image[at + 2], image[at + 3]])
    };
    // Cores with the same image work on the same data, each on a stack of its own.
    for core in 0..machine.cores() {
        let (origin, image) = images[core % images.len()];
        let shared = (core / images.len()) as u32;
        let start = Start {
            vector_table: origin,
            stack: word(image, 0) - 0x1000 * shared,
            address: word(image, 4),
        };
        machine.start(core, start);
    }
    machine
}

/// Cores without banks, on one memory.
fn plain(cores: usize) -> Board {
    Board {
        cores,
        regions: vec![Region::ram("ram", RAM, RAM_BYTES)],
        vector_table: RAM,
        ..Board::generic(CoreKind::CortexM33)
    }
}

/// Seconds on a processor so far (Linux), else of the clock.
fn now() -> f64 {
    let stat = std::fs::read_to_string("/proc/self/schedstat").unwrap_or_default();
    let busy_ns = stat.split(' ').next().and_then(|ns| ns.parse::<f64>().ok());
    busy_ns.map_or_else(|| START.elapsed().as_secs_f64(), |ns| ns / 1e9)
}

static START: LazyLock<Instant> = LazyLock::new(Instant::now);

/// Instructions per second of the fastest run, in M.
fn fastest(ready: impl Fn() -> Machine, runs: usize, run: impl Fn(&mut Machine) -> Stop) -> f64 {
    let once = || {
        let mut machine = ready();
        let start = now();
        assert_eq!(run(&mut machine), Stop::Exit { code: 0 });
        machine.instructions() as f64 / (now() - start) / 1e6
    };
    (0..runs).map(|_| once()).fold(0.0, f64::max)
}

/// Seconds on a processor of all children so far (Linux), else of the clock.
fn now_of_children() -> f64 {
    let stat = std::fs::read_to_string("/proc/self/stat").unwrap_or_default();
    let behind_name = stat.rsplit(')').next().unwrap_or_default();
    // User time and system time of children are the fields 16 and 17; the name is the second.
    let fields = behind_name.split_whitespace().skip(13).take(2);
    let ticks: Vec<f64> = fields.filter_map(|field| field.parse().ok()).collect();
    match ticks[..] {
        [user, system] => (user + system) / 100.0,
        _ => START.elapsed().as_secs_f64(),
    }
}

/// M instructions per second of QEMU on the program, its start included; nothing without QEMU.
fn qemu(folder: &Path, instructions: u64) -> Option<f64> {
    let board = ["-M", "mps2-an505", "-icount", "shift=0", "-nographic"];
    let start = now_of_children();
    let status = Command::new("qemu-system-arm")
        .args(board)
        .args(["-semihosting", "-kernel"])
        .arg(folder.join("kernels.elf"))
        .stdin(std::process::Stdio::null())
        .status();
    let seconds = now_of_children() - start;
    status.is_ok_and(|status| status.success()).then(|| {
        let all = instructions * u64::from(QEMU_TIMES);
        all as f64 / seconds / 1e6
    })
}

fn main() {
    let folder = tempfile::tempdir().expect("a folder");
    let built = |origin| build(folder.path(), origin, ROUNDS);
    let (image, first, second) = match (built(RAM), built(GROUPS[0]), built(GROUPS[1])) {
        (Ok(image), Ok(first), Ok(second)) => (image, first, second),
        (Err(why), ..) | (_, Err(why), _) | (.., Err(why)) => {
            return println!("skipped: no image: {why}");
        }
    };
    let one = || machine(plain(1), &[(RAM, &image)]);
    let two = || machine(plain(2), &[(RAM, &image)]);
    let apart = [(GROUPS[0], &first[..]), (GROUPS[1], &second[..])];
    let banks = || machine(BoardKind::Rp2350.board(), &apart);
    // Built last: its ELF is what QEMU runs.
    build(folder.path(), RAM, ROUNDS * QEMU_TIMES).expect("the same for QEMU");
    let mut count = one();
    count.run(u64::MAX);
    let part = std::env::args().nth(1).filter(|part| part != "--bench");
    let show = |name: &str, ready: &dyn Fn() -> Machine| {
        if part.as_ref().is_some_and(|part| !name.contains(part)) {
            return;
        }
        let blocks = fastest(ready, 3, |m| m.run(u64::MAX));
        let observed = fastest(ready, 1, |m| m.run_observed(u64::MAX, &mut Watcher));
        println!("{name}: {blocks:.1} M instructions/s, observed {observed:.1} M");
    };
    for (name, ready) in [
        ("one core", &one as &dyn Fn() -> Machine),
        ("two cores, the same data", &two),
        ("two cores, banks of their own", &banks),
    ] {
        show(name, ready);
        if let Some(speed) = qemu(folder.path(), count.instructions()) {
            println!("  QEMU, one core: {speed:.0} M instructions/s");
        }
    }
}
