//! Random instructions with random outcomes: nothing panics, and no instruction takes less than no
//! time.

use whippen_isa::timing::{Core, Outcome, Pipe, Target};
use whippen_isa::{Inst, ItState, decode};

struct Random(u64);

impl Random {
    fn next(&mut self) -> u32 {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 32) as u32
    }

    fn inst(&mut self, core: &Core) -> Inst {
        let blocks = [
            ItState::OUTSIDE,
            ItState::after_it(0, 8).expect("a block"),
            ItState::OUTSIDE,
        ];
        loop {
            let (word, it) = (self.next(), blocks[self.next() as usize % blocks.len()]);
            let wide = if self.next() & 1 == 0 { 0xe000 } else { 0 };
            if let Ok(inst) = decode((word >> 16) as u16 | wide, word as u16, core.arch, it) {
                return inst;
            }
        }
    }

    fn outcome(&mut self, inst: &Inst) -> Outcome {
        let bits = self.next();
        let branches = inst.defs().contains(whippen_isa::RegSet::core(15));
        let target = Target {
            address: self.next() & !1,
            wide: bits & 1 != 0,
        };
        let skipped = inst.is_conditional() && bits & 2 != 0;
        Outcome {
            skipped,
            target: (branches && !skipped && bits & 4 != 0).then_some(target),
            quotient_bits: (bits >> 8) as i8 % 32,
            waits: if bits & 0x70 == 0 {
                (bits >> 16) as u16
            } else {
                0
            },
            near: bits & 8 != 0,
            apart: bits & 0x80 != 0,
        }
    }
}

/// Runs `count` random instructions in a row.
pub fn run(core: &Core, count: usize) {
    let (mut random, mut pipe) = (Random(7), Pipe::default());
    for _ in 0..count {
        let inst = random.inst(core);
        let (outcome, address) = (random.outcome(&inst), random.next() & !1);
        let (next, cost) = core.issue(pipe, &core.prepare(&inst), address, &outcome);
        let sum: i32 = cost.parts().map(|(_, cycles)| cycles).sum();
        assert!(sum >= 0, "{}: {inst}: {cost}", core.name);
        assert!(
            cost.cycles() <= 64 + u32::from(outcome.waits),
            "{}: {inst}: {cost}",
            core.name
        );
        pipe = next;
    }
}
