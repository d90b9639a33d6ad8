//! Random kernels. `WHIPPEN_KERNELS=N cargo test --test thumb random` tries N of them.

use std::sync::atomic::{AtomicU64, Ordering};
use std::thread;

use crate::target::{CORES, Target};
use whippen_compiler::kernel::random::{Rng, inputs, kernel};
use whippen_compiler::kernel::{Interp, Kernel};
use whippen_compiler::modes::Modes;
use whippen_emulator::CoreKind;

/// How many kernels, where the environment does not say.
const KERNELS: u64 = 3_000;
/// Every so many of them on all cores, the others on the first.
const ON_ALL: u64 = 10;
/// From this one on.
const FIRST: u64 = 0;

fn count() -> u64 {
    whippen_need::count("WHIPPEN_KERNELS", KERNELS)
}

/// Compares everything that a kernel does in some ticks.
pub fn compare(seed: u64, kernel: &Kernel, core: CoreKind) {
    let keys = 1 + seed as u32 % 4;
    let mut rng = Rng::new(seed);
    let mut interp = Interp::new(kernel, keys as usize).expect("verifies");
    let mut target = Target::new(&Modes::single(kernel), keys, core);
    let first = inputs(&mut rng, kernel, keys as usize);
    interp.init(&first);
    target.init(&first);
    let mut drive = vec![0; keys as usize * kernel.outputs.len()];
    for tick in 0..12 {
        let words = inputs(&mut rng, kernel, keys as usize);
        interp.tick(&words, &mut drive);
        let told = || format!("{}, seed {seed}, tick {tick}\n{kernel}", core.name());
        let found = target.tick(&words);
        let events = interp.drain_events();
        let (raised, lost) = target.drain_events();
        assert!(
            lost > 0 || raised == events,
            "events {raised:?} {events:?} {}",
            told()
        );
        assert_eq!(target.probes(), interp.probes(), "probes, {}", told());
        assert_eq!(found, drive, "drive, {}", told());
        for key in 0..keys {
            for (cell, about) in kernel.cells.iter().enumerate() {
                for word in 0..about.len {
                    let want = interp
                        .cell(key as usize, cell, word as usize)
                        .expect("a cell");
                    assert_eq!(
                        target.cell(key, cell, word),
                        want,
                        "`{}`[{word}] of key {key}, {}",
                        about.name,
                        told()
                    );
                }
            }
        }
    }
}

#[test]
fn kernels() {
    let (next, end) = (AtomicU64::new(FIRST), FIRST + count());
    let work = || {
        while let Some(seed) = Some(next.fetch_add(1, Ordering::Relaxed)).filter(|seed| *seed < end)
        {
            let on = if seed % ON_ALL == 0 {
                &CORES[..]
            } else {
                &CORES[..1]
            };
            on.iter()
                .for_each(|core| compare(seed, &kernel(seed), *core));
        }
    };
    let threads = thread::available_parallelism().map_or(1, usize::from);
    thread::scope(|scope| (0..threads).for_each(|_| drop(scope.spawn(work))));
}
