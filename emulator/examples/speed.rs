//! How fast a raw image of `benches/kernels.c` runs: `speed IMAGE`. Prints instructions, cycles, seconds.

use std::time::Instant;
use whippen_emulator::{Board, CoreKind, Machine, Observer, Region, Step};

/// Counts instructions.
struct Count(u64);

impl Observer for Count {
    fn instruction(&mut self, _: &Step<'_>) {
        self.0 += 1;
    }
}

fn machine(image: &[u8]) -> Machine {
    let ram = Region::ram("ram", 0x1000_0000, 0x4_0000);
    let board = Board { regions: vec![ram], vector_table: 0x1000_0000, ..Board::generic(CoreKind::CortexM33) };
    let mut machine = Machine::new(board).expect("a board");
    machine.bus.memory.write(0x1000_0000, image).expect("an image that fits");
    machine.semihosting.enabled = true;
    machine.reset();
    machine
}

fn main() {
    let path = std::env::args().nth(1).expect("speed IMAGE");
    let image = std::fs::read(&path).expect("readable");
    let mut best = f64::MAX;
    for _ in 0..5 {
        let mut machine = machine(&image);
        let start = Instant::now();
        let stop = machine.run(u64::MAX);
        best = best.min(start.elapsed().as_secs_f64());
        println!("{stop}: {} cycles in {best:.3} s", machine.cycle(0));
    }
    if std::env::args().nth(2).is_some() {
        let (mut watched, mut count) = (machine(&image), Count(0));
        watched.run_observed(u64::MAX, &mut count);
        println!("{} cycles, {} instructions, {:.1} M/s", watched.cycle(0), count.0, count.0 as f64 / best / 1e6);
    }
}
