//! How fast compiled code runs: `kernels.c`, compiled by GCC with -O2 for the Cortex-M33, on one
//! core and on two, in blocks and observed. Counted is the time on a processor, where the host
//! tells it, so that other work does not matter much; of several runs the fastest.
//!
//! `cargo bench -p whippen-emulator`. QEMU on the same program: `docs/bars.md`.

use std::path::Path;
use std::process::Command;
use std::sync::LazyLock;
use std::time::Instant;
use whippen_emulator::{Board, CoreKind, Machine, Observer, Region, Start, Step, Stop};

const RAM: u32 = 0x1000_0000;

/// Looks at every instruction.
struct Watcher;

impl Observer for Watcher {
    fn instruction(&mut self, step: &Step<'_>) {
        std::hint::black_box(step);
    }
}

/// The image, or why there is none.
fn build(folder: &Path) -> Result<Vec<u8>, String> {
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
        "-DROUNDS=100",
        "-nostdlib",
        "-fno-builtin",
        "-T",
    ]);
    run(gcc
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

fn machine(image: &[u8], cores: usize) -> Machine {
    let regions = vec![Region::ram("ram", RAM, 0x4_0000)];
    let board = Board {
        cores,
        regions,
        vector_table: RAM,
        ..Board::generic(CoreKind::CortexM33)
    };
    let mut machine = Machine::new(board).expect("a board");
    machine
        .bus
        .memory
        .write(RAM, image)
        .expect("an image that fits");
    machine.semihosting.enabled = true;
    machine.reset();
    let word =
        |at: usize| u32::from_le_bytes([image[at], image[at + 1], image[at + 2], image[at + 3]]);
    // All cores run the same program on the same data, each on a stack of its own.
    (1..cores).for_each(|core| {
        machine.start(
            core,
            Start {
                vector_table: RAM,
                stack: word(0) - 0x1000 * core as u32,
                address: word(4),
            },
        );
    });
    machine
}

/// Seconds on a processor so far (Linux), else of the clock.
fn now() -> f64 {
    let stat = std::fs::read_to_string("/proc/self/schedstat").unwrap_or_default();
    let busy_ns = stat.split(' ').next().and_then(|ns| ns.parse::<f64>().ok());
    busy_ns.map_or_else(|| START.elapsed().as_secs_f64(), |ns| ns / 1e9)
}

static START: LazyLock<Instant> = LazyLock::new(Instant::now);

/// Instructions per second of the fastest run.
fn fastest(image: &[u8], cores: usize, runs: usize, run: impl Fn(&mut Machine) -> Stop) -> f64 {
    let once = || {
        let mut machine = machine(image, cores);
        let start = now();
        assert_eq!(run(&mut machine), Stop::Exit { code: 0 });
        machine.instructions() as f64 / (now() - start)
    };
    (0..runs).map(|_| once()).fold(0.0, f64::max)
}

fn main() {
    let folder = tempfile::tempdir().expect("a folder");
    let image = match build(folder.path()) {
        Ok(image) => image,
        Err(why) => return println!("skipped: no image: {why}"),
    };
    for cores in [1, 2] {
        let blocks = fastest(&image, cores, 3, |m| m.run(u64::MAX));
        let observed = fastest(&image, cores, 1, |m| m.run_observed(u64::MAX, &mut Watcher));
        println!(
            "{cores} running: {:.1} M instructions/s, observed {:.1} M",
            blocks / 1e6,
            observed / 1e6
        );
    }
}
