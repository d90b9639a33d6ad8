//! Random kernels and inputs, for tests of every engine and backend.
//!
//! A kernel is grown through the [`Builder`], so it is valid by construction: an operator is drawn
//! from the table, its operands from what is in sight, and what the table refuses is repaired
//! (operands are shifted down or clamped) or given up. Constants are the interesting ones: powers
//! of two and their neighbours, the ends of types and ranges. Half of all values are exposed by
//! probes and cells, so that what computes them cannot hide.
//!
//! Everything follows from the seed alone, on every platform.

mod declare;
mod draw;
mod statement;
mod string;
mod value;

pub use draw::Draw;
pub use whippen_deterministic::Rng;

use super::{Builder, Effect, Kernel, Op, OpError, Value};

/// A valid kernel that follows from the seed.
pub fn kernel(seed: u64) -> Kernel {
    let mut rng = Rng::new(seed);
    let mut b = Builder::new(&format!("random.{seed}"), 44_100);
    declare::all(&mut rng, &mut b);
    let size = 4 + rng.below(40);
    let mut generator = Generator {
        rng,
        pool: Vec::new(),
        tick: false,
        done: Vec::new(),
        depth: 0,
    };
    // A statement that fails leaves nothing behind, so neither can the whole.
    let _ = generator.init(&mut b, size / 4);
    let _ = generator.tick(&mut b, size);
    b.finish()
}

/// Words for every port of so many keys: mostly ends of ranges and their neighbours.
pub fn inputs(rng: &mut Rng, kernel: &Kernel, keys: usize) -> Vec<u16> {
    let word = |rng: &mut Rng, port: &super::Port| match rng.below(4) {
        0 => rng.pick(&[0, 1, u16::MAX, u16::MAX - 1, 1 << 15]),
        1 => rng.pick(&[port.range.low, port.range.high]) as u16,
        _ => rng.next() as u16,
    };
    let ports = std::iter::repeat_n(&kernel.inputs, keys).flatten();
    ports.map(|port| word(rng, port)).collect()
}

/// Adds up how often each row of the table occurs in a kernel.
pub fn count_operators(kernel: &Kernel, counts: &mut [usize]) {
    for inst in kernel.all_insts() {
        counts[inst.op.row().index] += 1;
    }
}

struct Generator {
    rng: Rng,
    /// Values in sight.
    pool: Vec<Value>,
    tick: bool,
    /// Outputs written and lines pushed.
    done: Vec<Op>,
    depth: u32,
}

impl Generator {
    fn init(&mut self, b: &mut Builder, size: u64) -> Result<(), OpError> {
        b.begin_init();
        (0..size).try_for_each(|_| self.statement(b))
    }

    fn tick(&mut self, b: &mut Builder, size: u64) -> Result<(), OpError> {
        b.begin_tick();
        self.pool.clear();
        self.tick = true;
        (0..size).try_for_each(|_| self.statement(b))?;
        let outputs = b.kernel().outputs.len() as u32;
        let lines = b.kernel().lines.len() as u32;
        for op in (0..outputs).map(Op::Out).chain((0..lines).map(Op::Push)) {
            let wanted = matches!(op, Op::Out(_)) || self.rng.chance(9, 10);
            if wanted && !self.done.contains(&op) {
                self.write(b, op)?;
            }
        }
        Ok(())
    }

    /// Whether such an operator may stand here.
    fn allows(&self, op: Op) -> bool {
        match op.row().effect {
            Effect::Pure | Effect::PerTick | Effect::PerKey => true,
            Effect::Reads | Effect::Writes => match op {
                Op::Delay(line, _) | Op::DelayAt(line) => !self.done.contains(&Op::Push(line)),
                _ => true,
            },
            Effect::WritesInTick => self.tick,
            Effect::WritesInInit => !self.tick,
            Effect::WritesOnce => self.tick && self.depth == 0 && !self.done.contains(&op),
            Effect::Control => false,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Interp, ROWS, parse, verify};

    #[test]
    fn kernels_verify_and_read_back() {
        for seed in 0..2000 {
            let kernel = kernel(seed);
            let text = kernel.to_string();
            if let Err(errors) = verify(&kernel) {
                panic!("seed {seed}: {errors:#?}\n{text}");
            }
            let read = parse(&text).unwrap_or_else(|error| panic!("seed {seed}: {error}\n{text}"));
            assert_eq!(read.to_string(), text, "seed {seed}");
        }
    }

    #[test]
    fn every_operator_occurs() {
        let mut counts = vec![0; ROWS.len()];
        (0..1000).for_each(|seed| count_operators(&kernel(seed), &mut counts));
        let rare: Vec<_> = ROWS
            .iter()
            .zip(counts)
            .filter(|(_, count)| *count < 100)
            .map(|(row, n)| (row.name, n))
            .collect();
        assert_eq!(rare, []);
    }

    #[test]
    fn values_stay_in_their_ranges() {
        for seed in 0..2000 {
            let kernel = kernel(seed);
            let mut rng = Rng::new(seed);
            let mut interp = Interp::checked(&kernel, 3).expect("verifies");
            let mut out = vec![0; 3 * kernel.outputs.len()];
            interp.init(&inputs(&mut rng, &kernel, 3));
            for _ in 0..8 {
                interp.tick(&inputs(&mut rng, &kernel, 3), &mut out);
            }
            assert_eq!(interp.violation(), None, "seed {seed}\n{kernel}");
        }
    }
}
