//! Strings of every length near the width of vectors, and long ones, against the interpreter.

use crate::{JitCode, Options, string};
use whippen_kernel::random::{Draw, Rng};
use whippen_kernel::{Builder, Interp, Kernel, Op, Type};

/// A string with such coefficients and ends, and its tick.
fn string(count: u32, k: [i64; 4], ends: [i64; 2]) -> Kernel {
    let mut b = Builder::new("string", 44_100);
    let all = Type::I32.range();
    let e = b.grid("e", Type::I32, count + 1, all, 0);
    let v = b.grid("v", Type::I32, count, all, 0);
    b.begin_tick();
    let args = k.iter().chain(&ends);
    let args: Vec<_> = args
        .map(|word| b.constant(Type::I32, *word).expect("a word"))
        .collect();
    b.effect(Op::Wave(e, v), &args).expect("a string");
    b.finish()
}

fn compare(rng: &mut Rng, count: u32, keys: usize, sizes: u64) {
    let mut size = || (rng.next() >> sizes) as i64;
    let k = [size(), -size(), size(), -size()];
    compare_words(rng, (count, keys, k), |rng| {
        rng.interesting(Type::I32.range())
    });
}

/// Ticks a string of so many points and keys, with such coefficients, that begins with such words.
fn compare_words(
    rng: &mut Rng,
    (count, keys, k): (u32, usize, [i64; 4]),
    mut word: impl FnMut(&mut Rng) -> i64,
) {
    let ends = [rng.pick(&[0, 2]), rng.pick(&[0, 2])];
    let kernel = string(count, k, ends);
    let mut interp = Interp::new(&kernel, keys).expect("verifies");
    let mut code = JitCode::build(&kernel, keys, Options { probes: false }).expect("compiles");
    interp.init(&[]);
    code.init(&[]);
    for (key, cell) in (0..keys).flat_map(|key| [(key, 0), (key, 1)]) {
        let words = kernel.cells[cell].len as usize;
        for point in 0..words {
            let word = word(rng);
            interp.set_cell(key, cell, point, word).expect("a word");
            code.set_cell(key, cell, point, word).expect("a word");
        }
    }
    // What a machine without wide vectors runs.
    let words = |interp: &Interp, cell: usize| -> Vec<i32> {
        let all = 0..kernel.cells[cell].len as usize;
        all.map(|word| interp.cell(0, cell, word).expect("a word") as i32)
            .collect()
    };
    let [mut e, mut v] = [0, 1].map(|cell| words(&interp, cell));
    let mut room = vec![0; string::ROOM_WORDS];
    let by = string::Coefficients {
        k: k.map(|word| word as i32),
        ends: ends.map(|end| end as i32),
    };
    for tick in 0..20 {
        interp.tick(&[], &mut []);
        code.tick(&[], &mut []);
        let told = || format!("{count} points, {keys} keys, {k:?} {ends:?}, tick {tick}");
        assert_eq!(interp.memory(), code.memory(), "{}", told());
        string::tick(&mut e, &mut v, &mut room, &by);
        assert_eq!(
            [0, 1].map(|cell| words(&interp, cell)),
            [e.clone(), v.clone()],
            "{}",
            told()
        );
    }
}

#[test]
fn strings_of_every_length() {
    let mut rng = Rng::new(1);
    for count in (5..40).chain([1022, 1023]) {
        for keys in [1, 2, 4, 6] {
            // Coefficients of all sizes, and stable ones.
            for sizes in [33, 34, 36] {
                compare(&mut rng, count, keys, sizes);
            }
        }
    }
}

/// Words on both sides of where sums begin to leave theirs, with the largest coefficients, whose
/// signs let sums grow the most.
#[test]
fn strings_whose_sums_are_held() {
    let mut rng = Rng::new(2);
    let [low, high] = [i32::MIN, i32::MAX].map(i64::from);
    for size in [(1_i64 << 28) - 1, 1 << 29, 1 << 30, high] {
        for k in [[high, low, high, low], [high, low, 0, 0], [0, 0, high, low]] {
            for count in [5, 8, 16, 31] {
                for _ in 0..10 {
                    let signed = |rng: &mut Rng| rng.pick(&[size, -size]);
                    compare_words(&mut rng, (count, 1, k), signed);
                }
            }
        }
    }
}
