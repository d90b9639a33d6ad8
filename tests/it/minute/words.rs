//! Words and live values at random, the same on every engine that is tried.

use whippen_compiler::kernel::Kernel;
use whippen_compiler::kernel::random::{Draw, Rng};

/// Ticks of each instrument, where nobody asks for more.
const TICKS: usize = 3000;

/// Ticks from one set of live values to the next.
const LIVE_TICKS: usize = 4000;

/// How many ticks are played: `WHIPPEN_TICKS`, where it is set.
pub fn ticks() -> usize {
    whippen_need::count("WHIPPEN_TICKS", TICKS)
}

/// What one key of a kernel is fed, tick by tick.
pub struct Words {
    random: Rng,
    tick: usize,
    words: Vec<u16>,
}

impl Words {
    pub fn new(kernel: &Kernel) -> Words {
        Words {
            random: Rng::new(29),
            tick: 0,
            words: vec![0; kernel.inputs.len()],
        }
    }

    /// The next tick: a live value that is set before it, if one is, and the words. Words are
    /// noise, jumps between the ends, and rest; live values are set one a tick, then kept.
    pub fn turn(&mut self, kernel: &Kernel) -> (Option<(usize, i32)>, &[u16]) {
        let (tick, random) = (self.tick, &mut self.random);
        self.tick += 1;
        let live = tick % LIVE_TICKS;
        let about = kernel.lives.get(live);
        let set = about.map(|about| (live, random.interesting(about.range) as i32));
        for (port, word) in self.words.iter_mut().enumerate() {
            match (tick / 300 + port) % 4 {
                0 => *word = random.next() as u16,
                1 => *word = [0, 65_535][tick % 2],
                2 if tick.is_multiple_of(300) => *word = random.next() as u16,
                _ => {}
            }
        }
        (set, &self.words)
    }
}
