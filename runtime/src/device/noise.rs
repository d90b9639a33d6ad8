//! Counter-based normal noise: what a sensor adds to a reading, or a copy of a recording to a row,
//! is a function of a name and a number alone, so that a run is the same bits every time and in any
//! order.
//!
//! SplitMix64's finalizer (Steele, Lea and Flood 2014) mixes the counter, Box and Muller's
//! transform makes two of its words one normal number. The noise is white: it knows nothing of
//! mains hum and of slow drift.

use std::f64::consts::TAU;

/// A number with a mean of 0 and a variance of 1, the same whenever it is asked for.
pub fn normal(stream: u64, tick: u64) -> f64 {
    let counter = (mixed(stream) ^ tick) << 1;
    // Above zero and at most one, so that the logarithm is finite.
    let first = ((mixed(counter) >> 11) + 1) as f64 / (1u64 << 53) as f64;
    let second = (mixed(counter | 1) >> 11) as f64 / (1u64 << 53) as f64;
    libm::sqrt(-2.0 * libm::log(first)) * libm::cos(TAU * second)
}

/// The stream of a port of a key.
pub fn stream(name: &str, key: u64) -> u64 {
    let add = |sum: u64, byte: u8| mixed(sum ^ u64::from(byte));
    name.bytes().fold(mixed(key), add)
}

fn mixed(word: u64) -> u64 {
    let word = word.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let word = (word ^ (word >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let word = (word ^ (word >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    word ^ (word >> 31)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_is_normal_and_white() {
        for (name, key) in [("", 0), ("", 1), ("x", 0), ("x", 1)] {
            judge(stream(name, key));
        }
        let streams = [stream("x", 0), stream("y", 0), stream("x", 1)];
        let [x, y, other] = streams.map(|stream| normal(stream, 5));
        assert!(x == normal(streams[0], 5) && x != y && x != other);
    }

    fn judge(stream: u64) {
        let values: Vec<f64> = (0..200_000).map(|tick| normal(stream, tick)).collect();
        let mean_of = |power: i32, shift: usize| {
            let pairs = values.iter().zip(&values[shift..]);
            let sum: f64 = pairs.map(|(a, b)| a.powi(power - 1) * b).sum();
            sum / (values.len() - shift) as f64
        };
        let mean: f64 = values.iter().sum::<f64>() / values.len() as f64;
        assert!(mean.abs() < 0.01, "{mean}");
        assert!((mean_of(2, 0) - 1.0).abs() < 0.02);
        assert!((mean_of(4, 0) - 3.0).abs() < 0.1);
        for shift in [1, 2, 3, 31] {
            assert!(mean_of(2, shift).abs() < 0.01, "{shift}");
        }
    }
}
