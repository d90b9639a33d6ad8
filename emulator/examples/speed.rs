//! How fast a raw image of `benches/kernels.c` runs: `speed IMAGE [CORES]`. With more
//! cores all run the same program on the same data.

use std::time::Instant;
use whippen_emulator::{Board, CoreKind, Machine, Observer, Region, Start, Step};

/// Counts instructions.
struct Count(u64);

impl Observer for Count {
    fn instruction(&mut self, _: &Step<'_>) {
        self.0 += 1;
    }
}

fn machine(image: &[u8], cores: usize) -> Machine {
    let ram = Region::ram("ram", 0x1000_0000, 0x4_0000);
    let board = Board { cores, regions: vec![ram], vector_table: 0x1000_0000, ..Board::generic(CoreKind::CortexM33) };
    let mut machine = Machine::new(board).expect("a board");
    machine.bus.memory.write(0x1000_0000, image).expect("an image that fits");
    machine.semihosting.enabled = true;
    machine.reset();
    let word = |at: usize| u32::from_le_bytes([image[at], image[at + 1], image[at + 2], image[at + 3]]);
    (1..cores).for_each(|core| {
        machine.start(core, Start { vector_table: 0x1000_0000, stack: word(0) - 0x1000, address: word(4) });
    });
    machine
}

fn main() {
    let path = std::env::args().nth(1).expect("speed IMAGE [CORES]");
    let image = std::fs::read(&path).expect("readable");
    let cores = std::env::args().nth(2).and_then(|n| n.parse().ok()).unwrap_or(1);
    let mut best = f64::MAX;
    for _ in 0..20 {
        let mut machine = machine(&image, cores);
        let start = Instant::now();
        machine.run(u64::MAX);
        best = best.min(start.elapsed().as_secs_f64());
    }
    let (mut watched, mut count) = (machine(&image, cores), Count(0));
    let start = Instant::now();
    let stop = watched.run_observed(u64::MAX, &mut count);
    let observed = start.elapsed().as_secs_f64();
    println!("{stop}: {} cycles, {} instructions", watched.cycle(0), count.0);
    println!("{:.1} M/s, observed {:.1} M/s", count.0 as f64 / best / 1e6, count.0 as f64 / observed / 1e6);
}
