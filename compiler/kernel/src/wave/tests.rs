//! What the operator promises: it is its formula, it never grows where its coefficients are stable,
//! and it decays as the same scheme in real numbers does.

use super::*;
use crate::random::{Draw, Rng};

/// Ticks a second.
const RATE: f64 = 44_100.0;

#[derive(Debug, Clone, PartialEq)]
struct Words {
    e: Vec<i32>,
    v: Vec<i32>,
}

impl Points for Words {
    fn slope(&self, part: usize) -> i32 {
        self.e[part]
    }

    fn rate(&self, point: usize) -> i32 {
        self.v[point]
    }

    fn set_slope(&mut self, part: usize, slope: i32) {
        self.e[part] = slope;
    }

    fn set_rate(&mut self, point: usize, rate: i32) {
        self.v[point] = rate;
    }
}

/// The formula, word by word, over the points and both ends.
fn formula(before: &Words, k: [i32; 4], ends: [i32; 2]) -> Words {
    let (e, n) = (&before.e, before.e.len());
    let v = [&[0], &before.v[..], &[0]].concat();
    let sat = |exact: i64| exact.clamp(i32::MIN.into(), i32::MAX.into()) as i32;
    let top = |at: usize, x: i32| {
        let product = i128::from(k[at]) * i128::from(x);
        ((2 * product + (1 << 32)) >> 33) as i64
    };
    let w: Vec<i32> = (0..=n)
        .map(|l| match l {
            0 => sat(i64::from(ends[0]) * i64::from(e[0])),
            l if l == n => sat(i64::from(ends[1]) * i64::from(sat(-i64::from(e[n - 1])))),
            l => sat(i64::from(e[l]) - i64::from(e[l - 1])),
        })
        .collect();
    let p: Vec<i64> = (0..=n)
        .map(|l| i64::from((top(1, w[l]) + top(2, v[l])) as i32))
        .collect();
    let mut new = v.clone();
    for l in 1..n {
        let q = (p[l - 1] + top(0, w[l]) + top(3, v[l])) as i32;
        let a = sat(i64::from(q) + p[l + 1]);
        new[l] = sat(i64::from(v[l]) + i64::from(a));
    }
    let moved = |l: usize| {
        let exact = i64::from(e[l]) + 2 * (i64::from(new[l + 1]) - i64::from(new[l]));
        exact as i32
    };
    Words {
        e: (0..n).map(moved).collect(),
        v: new[1..n].to_vec(),
    }
}

#[test]
fn the_window_is_the_formula() {
    let mut rng = Rng::new(1);
    let all = Type::I32.range();
    for _ in 0..2000 {
        let count = 5 + rng.below(12) as usize;
        let mut words = |count| (0..count).map(|_| rng.interesting(all) as i32).collect();
        let mut string = Words {
            e: words(count + 1),
            v: words(count),
        };
        let k = std::array::from_fn(|_| rng.interesting(all) as i32);
        let ends = [rng.pick(&[0, 2]), rng.pick(&[0, 2])];
        for _ in 0..4 {
            let expected = formula(&string, k, ends);
            tick(&mut string, count, k, ends);
            assert_eq!(string, expected, "{k:?} {ends:?}");
        }
    }
}

/// Coefficients for the sizes K0 to K3, rounded as stability wants: K2 down, K3 up.
fn coefficients([k0, k1, k2, k3]: [f64; 4]) -> [i32; 4] {
    let (half, whole) = (f64::from(1_u32 << 31), 2.0 * f64::from(1_u32 << 31));
    [
        (k0 * half).round() as i32,
        (-k1 * half).round() as i32,
        (k2 * whole).floor() as i32,
        (-k3 * whole).floor() as i32,
    ]
}

/// A violin's string of so many parts: frequency, stiffness (m^2/s), losses (1/s, m^2/s).
fn violin(parts: f64, frequency: f64, kappa: f64, [s0, s1]: [f64; 2]) -> [f64; 4] {
    let (k, h) = (1.0 / RATE, 0.32 / parts);
    let (lambda, mu) = (2.0 * 0.32 * frequency * k / h, kappa * k / (h * h));
    let (q, x) = (2.0 * s1 * k / (h * h), s0 * k);
    let a = 1.0 - x * (1.0 - x);
    [
        a * (lambda * lambda + 2.0 * mu * mu),
        a * mu * mu,
        a * q,
        a * (2.0 * q + 2.0 * x),
    ]
}

/// E5, A4, D4, G3: parts, frequency, stiffness.
const STRINGS: [[f64; 3]; 4] = [
    [32.0, 659.2551, 0.2979],
    [45.0, 440.0, 0.4151],
    [62.0, 293.6648, 0.2887],
    [81.0, 195.9977, 0.2097],
];

/// A string that is plucked at a fifth of its length.
fn plucked(count: usize, u_max: f64) -> Words {
    let top = count as f64 / 5.0;
    let at = |point: usize| {
        let place = point as f64 + 1.0;
        let rest = (count as f64 + 1.0 - place) / (count as f64 + 1.0 - top);
        (u_max * (place / top).min(rest)) as i32
    };
    let u: Vec<i32> = (0..count).map(at).collect();
    let ends = [&[0], &u[..], &[0]].concat();
    Words {
        e: ends.windows(2).map(|u| u[1] - u[0]).collect(),
        v: vec![0; count],
    }
}

/// The largest of some words.
fn largest(words: &[i32]) -> u32 {
    words
        .iter()
        .map(|word| word.unsigned_abs())
        .max()
        .unwrap_or(0)
}

#[test]
fn stable_coefficients_never_grow() {
    let mut rng = Rng::new(2);
    let mut unit = || rng.below(1 << 20) as f64 / f64::from(1 << 20);
    for case in 0..120 {
        // On the border, but for the margin that is kept where a string's points are counted.
        let k1 = 0.25 * unit() * unit();
        let k2 = 0.2 * unit() * unit();
        let k3 = 2.0 * k2 + 0.05 * unit() * unit();
        let k0 = 1.0 - 2.0 * k1 - k3 / 2.0 - k2 - 1.0 / 65_536.0;
        if k0 < 2.0 * k1 {
            continue;
        }
        let k = coefficients([k0, k1, k2, k3]);
        let count = 5 + case % 40;
        let ends = [[0, 0], [2, 0], [2, 2]][case % 3];
        let mut string = plucked(count, 2e7);
        let mut rate_max = [0, 0];
        for at in 0..20_000 {
            tick(&mut string, count, k, ends);
            let half = at / 10_000;
            rate_max[half] = rate_max[half].max(largest(&string.v));
        }
        let [first, second] = rate_max.map(f64::from);
        assert!(
            second <= 1.2 * first,
            "{k:?} {count} {ends:?}: {first} {second}"
        );
        assert!(first < 2e9, "{k:?} {count} {ends:?}: {first}");
    }
}

/// The same scheme in real numbers, in units of the rate.
fn real_tick(u: &mut [f64], v: &mut [f64], k: [i32; 4]) {
    let two_32 = 2.0 * f64::from(1_u32 << 31);
    let [k0, k1, k2, k3] = k.map(|k| f64::from(k) / two_32);
    let n = u.len();
    let at = |words: &[f64], l: isize| {
        usize::try_from(l)
            .ok()
            .and_then(|l| words.get(l))
            .copied()
            .unwrap_or(0.0)
    };
    let bend = |l: isize| at(u, l + 1) - 2.0 * at(u, l) + at(u, l - 1);
    let bends: Vec<f64> = (0..n as isize).map(bend).collect();
    let rates: Vec<f64> = (0..n as isize)
        .map(|l| {
            let bends = k0 * at(&bends, l) + k1 * (at(&bends, l - 1) + at(&bends, l + 1));
            at(v, l) + bends + k2 * (at(v, l - 1) + at(v, l + 1)) + k3 * at(v, l)
        })
        .collect();
    v.copy_from_slice(&rates);
    u.iter_mut().zip(v).for_each(|(u, v)| *u += 2.0 * *v);
}

/// What the slopes add up to, point by point.
fn displacements(string: &Words) -> Vec<f64> {
    let sums = string.e.iter().scan(0_i64, |sum, e| {
        *sum += i64::from(*e);
        Some(*sum as f64)
    });
    sums.take(string.v.len()).collect()
}

/// How far the words are from real numbers in a second after a pluck of 0.1 mm, in dB below the
/// level of the pluck, where rates are up to 40 m/s.
fn noise_db([parts, frequency, kappa]: [f64; 3], losses: [f64; 2]) -> f64 {
    let unit_m = 40.0 / RATE / f64::from(1_u32 << 31);
    let k = coefficients(violin(parts, frequency, kappa, losses));
    let count = parts as usize - 1;
    let mut string = plucked(count, 1e-4 * 2.0 / unit_m);
    let mut u = displacements(&string);
    let mut v = vec![0.0; count];
    let square = |words: &[f64]| words.iter().map(|word| word * word).sum::<f64>();
    let (level, mut noise) = (square(&u), 0.0);
    for _ in 0..RATE as usize {
        tick(&mut string, count, k, [0, 0]);
        real_tick(&mut u, &mut v, k);
        let held = displacements(&string);
        let error = held.iter().zip(&u).map(|(word, real)| word - real);
        noise += square(&error.collect::<Vec<_>>()) / RATE;
    }
    10.0 * (level / noise).log10()
}

#[test]
fn a_plucked_string_decays_as_in_real_numbers() {
    for string in STRINGS {
        for losses in [[0.1, 1e-4], [1.0, 0.005], [10.0, 0.015]] {
            let noise = noise_db(string, losses);
            println!("{string:?} {losses:?}: {noise:.1} dB");
            assert!(noise >= 95.0, "{string:?} {losses:?}: {noise:.1} dB");
        }
    }
}
