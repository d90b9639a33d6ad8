//! Both engines agree in every byte on random kernels and inputs.

use whippen_compiler::host::{HostCode, Options};
use whippen_compiler::kernel::Interp;
use whippen_compiler::kernel::random::{self, Rng};

const KEYS: usize = 3;
const TICKS: usize = 8;

fn compare(seed: u64) {
    let kernel = random::kernel(seed);
    let mut rng = Rng::new(seed);
    let mut interp = Interp::new(&kernel, KEYS).expect("verifies");
    let mut code = HostCode::build(&kernel, KEYS, Options { probes: true }).expect("compiles");
    let mut out = [vec![0; KEYS * kernel.outputs.len()], vec![0; KEYS * kernel.outputs.len()]];
    let words = random::inputs(&mut rng, &kernel, KEYS);
    interp.init(&words);
    code.init(&words);
    assert_eq!(interp.memory(), code.memory(), "seed {seed}, init\n{kernel}");
    for tick in 0..TICKS {
        let words = random::inputs(&mut rng, &kernel, KEYS);
        interp.tick(&words, &mut out[0]);
        code.tick(&words, &mut out[1]);
        assert_eq!(out[0], out[1], "seed {seed}, tick {tick}: outputs\n{kernel}");
        assert_eq!(interp.memory(), code.memory(), "seed {seed}, tick {tick}: memory\n{kernel}");
        if tick % 3 == 1 {
            assert_eq!(interp.drain_events(), code.drain_events(), "seed {seed}, tick {tick}: events\n{kernel}");
        }
    }
}

#[test]
fn interp_and_jit_agree_on_random_kernels() {
    let start = std::time::Instant::now();
    (0..1000).for_each(compare);
    eprintln!("{:?}", start.elapsed());
}
