//! How fast compiled code runs: `kernels.c`, compiled by GCC with -O2 for the Cortex-M33. Elements are emulated instructions.
//!
//! `cargo bench -p whippen-emulator`. QEMU on the same image: the command in `docs/bars.md`.

use criterion::{Criterion, Throughput};
use std::path::Path;
use std::process::Command;
use whippen_emulator::{Board, CoreKind, Machine, Observer, Region, Start, Step};

const RAM: u32 = 0x1000_0000;

/// Counts instructions.
#[derive(Default)]
struct Count(u64);

impl Observer for Count {
    fn instruction(&mut self, _: &Step<'_>) {
        self.0 += 1;
    }
}

/// The image, or why there is none.
fn build(folder: &Path) -> Result<Vec<u8>, String> {
    let benches = Path::new(env!("CARGO_MANIFEST_DIR")).join("benches");
    let run = |command: &mut Command| {
        let output = command.output().map_err(|e| format!("{:?}: {e}", command.get_program()))?;
        if output.status.success() { Ok(()) } else { Err(String::from_utf8_lossy(&output.stderr).into_owned()) }
    };
    let (elf, image) = (folder.join("kernels.elf"), folder.join("kernels.bin"));
    let mut gcc = Command::new("arm-none-eabi-gcc");
    gcc.args(["-mcpu=cortex-m33", "-mthumb", "-O2", "-DROUNDS=2", "-nostdlib", "-fno-builtin", "-T"]);
    run(gcc.arg(benches.join("kernels.ld")).arg(benches.join("kernels.c")).arg("-o").arg(&elf))?;
    run(Command::new("arm-none-eabi-objcopy").args(["-O", "binary"]).arg(&elf).arg(&image))?;
    std::fs::read(&image).map_err(|e| e.to_string())
}

fn machine(image: &[u8], cores: usize) -> Machine {
    let regions = vec![Region::ram("ram", RAM, 0x4_0000)];
    let board = Board { cores, regions, vector_table: RAM, ..Board::generic(CoreKind::CortexM33) };
    let mut machine = Machine::new(board).expect("a board");
    machine.bus.memory.write(RAM, image).expect("an image that fits");
    machine.semihosting.enabled = true;
    machine.reset();
    let word = |at: usize| u32::from_le_bytes([image[at], image[at + 1], image[at + 2], image[at + 3]]);
    // All cores run the same program on the same data, each on a stack of its own.
    (1..cores).for_each(|core| {
        machine.start(core, Start { vector_table: RAM, stack: word(0) - 0x1000 * core as u32, address: word(4) });
    });
    machine
}

fn instructions(image: &[u8], cores: usize) -> u64 {
    let mut count = Count::default();
    machine(image, cores).run_observed(u64::MAX, &mut count);
    count.0
}

fn main() {
    let folder = tempfile::tempdir().expect("a folder");
    let image = match build(folder.path()) {
        Ok(image) => image,
        Err(why) => return println!("skipped: no image: {why}"),
    };
    let mut criterion = Criterion::default().configure_from_args();
    for cores in [1, 2] {
        let mut group = criterion.benchmark_group(format!("{cores} running"));
        group.throughput(Throughput::Elements(instructions(&image, cores)));
        group.bench_function("blocks", |b| {
            b.iter_batched_ref(|| machine(&image, cores), |m| m.run(u64::MAX), criterion::BatchSize::PerIteration);
        });
        group.bench_function("observed", |b| {
            let run = |m: &mut Machine| m.run_observed(u64::MAX, &mut Count::default());
            b.iter_batched_ref(|| machine(&image, cores), run, criterion::BatchSize::PerIteration);
        });
    }
    criterion.final_summary();
}
