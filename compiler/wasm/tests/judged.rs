//! Modules under node have the interpreter's memory, byte for byte, after every tick.
//!
//! ```text
//! cargo test -p whippen-wasm                          400 random kernels
//! WHIPPEN_KERNELS=N cargo test -p whippen-wasm        N of them
//! ```

mod cases;

use cases::Cases;
use whippen_kernel::parse;
use whippen_kernel::random::{self, Draw, Rng};

/// How many random kernels, where the environment does not say.
const KERNELS: u64 = 400;

#[test]
fn random_kernels_have_the_memory_of_the_interpreter() {
    let count = whippen_need::count("WHIPPEN_KERNELS", KERNELS);
    for first in (0..count).step_by(KERNELS as usize) {
        let mut cases = Cases::default();
        for seed in first..count.min(first + KERNELS) {
            let (kernel, mut rng) = (random::kernel(seed), Rng::new(seed));
            let keys = [1, 2, 4, 5][(seed % 4) as usize];
            cases.add(format!("seed {seed}"), &kernel, keys, |case| {
                case.run(false, &random::inputs(&mut rng, &kernel, keys));
                for tick in 0..8 {
                    let live = tick % kernel.lives.len();
                    let value = rng.interesting(kernel.lives[live].range);
                    case.set_live(live, value as i32);
                    case.run(true, &random::inputs(&mut rng, &kernel, keys));
                    if tick % 3 == 2 {
                        case.drain();
                    }
                }
                // And from the start again, into memory that is used.
                case.run(false, &random::inputs(&mut rng, &kernel, keys));
                case.run(true, &random::inputs(&mut rng, &kernel, keys));
            });
        }
        cases.judge();
    }
}

/// More events than are kept.
const CHATTERBOX: &str = "\
kernel chatterbox @44100 {
  event said(2)
  tick {
    loop 700 (v0: i32 [0..699]) {
      v1: i32 [0..699000] = shl v0 2
      emit said v0 v1
    }
  }
}
";

/// Indices that are not what is promised.
const BROKEN_PROMISE: &str = "\
kernel broken_promise @44100 {
  live any: i32 [-2147483648..2147483647] = 0
  cell u: i32 x 3 [0..100] = 7
  cell w: i64 x 2 [0..100] = 0
  table t = { 1, 2, 3 }
  probe read: i32
  probe found: i32
  tick {
    v0: i32 [-2147483648..2147483647] = live any
    v1: i32 [0..2] = assume v0 0 2
    v2: i32 [50..50] = const 50
    set_at u v1 v2
    v3: i32 [0..1] = assume v0 0 1
    v4: i64 [50..50] = const 50
    set_at w v3 v4
    v5: i32 [0..100] = get_at u v1
    v6: i32 [1..3] = lookup t v1 0
    probe read v5
    probe found v6
  }
}
";

#[test]
fn what_is_too_much_or_wrong_does_no_harm() {
    let mut cases = Cases::default();
    let chatterbox = parse(CHATTERBOX).expect("parses");
    cases.add("chatterbox".to_string(), &chatterbox, 2, |case| {
        case.run(false, &[]);
        (0..4).for_each(|_| case.run(true, &[]));
        case.drain();
        case.run(true, &[]);
    });
    let promise = parse(BROKEN_PROMISE).expect("parses");
    cases.add("promise".to_string(), &promise, 3, |case| {
        case.run(false, &[]);
        for value in [0, 1, -1, 2, 3, i32::MIN, i32::MAX] {
            case.set_live(0, value);
            case.run(true, &[]);
        }
    });
    cases.judge();
}
