//! The interpreter and the host code agree in every byte: outputs, memory, probes and events.
//!
//! ```text
//! cargo test -p whippen-compiler --test it engines                          10 000 random kernels
//! WHIPPEN_KERNELS=N cargo test --release -p whippen-compiler --test it engines    N of them
//! ```

use std::sync::atomic::{AtomicU64, Ordering};
use std::thread;

use whippen_compiler::jit::{JitCode, Options};
use whippen_compiler::kernel::random::{self, Draw, Rng};
use whippen_compiler::kernel::{EngineError, Interp, Kernel, parse, without_probes};

const TICKS: usize = 8;

/// Both engines, on the same kernel and with the same inputs.
struct Pair {
    kernel: Kernel,
    interp: Interp,
    code: JitCode,
    /// What is said when they differ.
    name: String,
}

impl Pair {
    fn new(kernel: &Kernel, keys: usize, probes: bool, name: &str) -> Pair {
        let code = JitCode::build(kernel, keys, Options { probes })
            .unwrap_or_else(|error| panic!("{name}: {error}"));
        let kernel = if probes {
            kernel.clone()
        } else {
            without_probes(kernel)
        };
        let interp = Interp::new(&kernel, keys).unwrap_or_else(|error| panic!("{name}: {error}"));
        Pair {
            kernel,
            interp,
            code,
            name: name.to_string(),
        }
    }

    fn init(&mut self, words: &[u16]) {
        self.interp.init(words);
        self.code.init(words);
        self.compare("init", &[], &[]);
    }

    fn tick(&mut self, words: &[u16]) {
        let count = self.interp.memory().keys() * self.kernel.outputs.len();
        let (mut left, mut right) = (vec![0; count], vec![0; count]);
        self.interp.tick(words, &mut left);
        self.code.tick(words, &mut right);
        self.compare("tick", &left, &right);
    }

    fn compare(&self, what: &str, left: &[i16], right: &[i16]) {
        let (name, kernel) = (&self.name, &self.kernel);
        let tick = self.interp.memory().tick();
        assert_eq!(
            left, right,
            "{name}: {what} {tick}, outputs of interp and jit\n{kernel}"
        );
        assert_eq!(
            self.interp.memory(),
            self.code.memory(),
            "{name}: {what} {tick}, memory\n{kernel}"
        );
    }

    fn drain(&mut self) -> usize {
        let (left, right) = (self.interp.drain_events(), self.code.drain_events());
        assert_eq!(left, right, "{}: events\n{}", self.name, self.kernel);
        left.len()
    }

    fn set_live(&mut self, live: usize, value: i32) {
        self.interp.set_live(live, value).expect("in range");
        self.code.set_live(live, value).expect("in range");
    }
}

fn agree(seed: u64) {
    let mut rng = Rng::new(seed);
    // Most in lanes alone; some with keys left over, or with no lanes at all.
    let keys = [4, 4, 6, 4, 3, 4, 4, 5][(seed % 8) as usize];
    let mut pair = Pair::new(
        &random::kernel(seed),
        keys,
        !seed.is_multiple_of(5),
        &format!("seed {seed}"),
    );
    pair.init(&random::inputs(&mut rng, &pair.kernel, keys));
    for tick in 0..TICKS {
        let live = tick % pair.kernel.lives.len();
        let value = rng.interesting(pair.kernel.lives[live].range);
        pair.set_live(live, value as i32);
        pair.tick(&random::inputs(&mut rng, &pair.kernel, keys));
        if tick % 3 == 2 {
            pair.drain();
        }
    }
    // And from the start again, into memory that is used.
    pair.init(&random::inputs(&mut rng, &pair.kernel, keys));
    pair.tick(&random::inputs(&mut rng, &pair.kernel, keys));
}

/// How many random kernels, where the environment does not say.
const KERNELS: u64 = 10_000;

#[test]
fn random_kernels() {
    let count = whippen_need::count("WHIPPEN_KERNELS", KERNELS);
    let next = AtomicU64::new(0);
    let work = || {
        let mut seeds = std::iter::repeat_with(|| next.fetch_add(1, Ordering::Relaxed));
        while let Some(seed) = seeds.next().filter(|seed| *seed < count) {
            agree(seed);
        }
    };
    thread::scope(|scope| {
        let workers = thread::available_parallelism().map_or(1, usize::from);
        let threads: Vec<_> = (0..workers).map(|_| scope.spawn(work)).collect();
        for thread in threads {
            thread
                .join()
                .unwrap_or_else(|panic| std::panic::resume_unwind(panic));
        }
    });
    println!("{count} kernels agree");
}

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

#[test]
fn a_full_buffer_counts_what_it_loses() {
    let mut pair = Pair::new(&parse(CHATTERBOX).expect("parses"), 2, true, "chatterbox");
    pair.init(&[]);
    (0..4).for_each(|_| pair.tick(&[]));
    assert_eq!(pair.interp.memory().lost_events(), 4 * 2 * 700 - 4096);
    assert_eq!(pair.drain(), 4096);
    pair.tick(&[]);
    assert_eq!(pair.drain(), 1400);
}

#[test]
fn nothing_gets_in_that_is_out_of_range() {
    let kernel = parse("kernel k @1 { live a: i32 [0..9] = 1 cell c: i64 x 2 [-5..5] = 0 }")
        .expect("parses");
    let mut code = JitCode::build(&kernel, 2, Options { probes: true }).expect("compiles");
    let outside = |value| {
        Err(EngineError::Outside {
            value,
            range: kernel.cells[0].range,
        })
    };
    assert_eq!(code.set_live(0, 9), Ok(()));
    assert!(matches!(
        code.set_live(0, 10),
        Err(EngineError::Outside { value: 10, .. })
    ));
    assert_eq!(code.set_live(1, 0), Err(EngineError::Unknown));
    assert_eq!(code.set_cell(1, 0, 1, -5), Ok(()));
    assert_eq!(code.set_cell(1, 0, 1, -6), outside(-6));
    assert_eq!(code.set_cell(2, 0, 0, 0), Err(EngineError::Unknown));
    assert_eq!(code.set_cell(0, 0, 2, 0), Err(EngineError::Unknown));
    assert_eq!(
        [code.cell(0, 0, 1), code.cell(1, 0, 1), code.cell(1, 1, 0)],
        [Some(0), Some(-5), None]
    );
    assert!(matches!(
        JitCode::build(&kernel, 0, Options { probes: true }),
        Err(EngineError::Layout(_))
    ));
}

const BROKEN_PROMISE: &str = "\
kernel broken_promise @44100 {
  cell any: i32 [-2147483648..2147483647] = 0
  cell u: i32 x 3 [0..100] = 0
  cell w: i64 x 2 [0..100] = 0
  table t = { 1, 2, 3 }
  probe read: i32
  probe found: i32
  probe quotient: i32
  tick {
    v0: i32 [-2147483648..2147483647] = get any
    v1: i32 [0..2] = assume v0 0 2
    v2: i32 [50..50] = const 50
    set_at u v1 v2
    v3: i32 [0..1] = assume v0 0 1
    v4: i64 [50..50] = const 50
    set_at w v3 v4
    v5: i32 [0..100] = get_at u v1
    v6: i32 [1..3] = lookup t v1 0
    v7: i32 [1..1] = assume v0 1 1
    v8: i32 [-1..0] = assume v0 -1 0
    v9: i32 [-2147483648..0] = div_round v8 v7 31
    probe read v5
    probe found v6
    probe quotient v9
  }
}
";

#[test]
fn a_broken_promise_does_no_harm() {
    let kernel = parse(BROKEN_PROMISE).expect("parses");
    let mut pair = Pair::new(&kernel, 3, true, "broken promise");
    pair.init(&[]);
    for value in [0, 1, -1, 2, 3, i32::MIN, i32::MAX] {
        pair.interp
            .set_cell(1, 0, 0, value.into())
            .expect("in range");
        pair.code.set_cell(1, 0, 0, value.into()).expect("in range");
        pair.interp.tick(&[], &mut []);
        pair.code.tick(&[], &mut []);
        let index = value.clamp(0, 2) as usize;
        for engine in [pair.interp.probes(), pair.code.probes()] {
            assert_eq!(engine[3..5], [50, index as i64 + 1], "{value}");
        }
        for word in 0..3 {
            assert_eq!(
                pair.interp.cell(1, 1, word),
                pair.code.cell(1, 1, word),
                "{value}"
            );
        }
    }
    let mut checked = Interp::checked(&kernel, 1).expect("verifies");
    checked.init(&[]);
    checked.set_cell(0, 0, 0, 3).expect("in range");
    checked.tick(&[], &mut []);
    let violation = checked
        .violation()
        .expect("a promise is broken")
        .to_string();
    assert_eq!(
        violation,
        "key 0: v1 is 3, not in [0..2]: v1: i32 [0..2] = assume v0 0 2"
    );
}
