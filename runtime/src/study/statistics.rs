//! Friedman's test and Wilcoxon's signed ranks, both with p by permutation, and Holm's correction.
//!
//! Ratings are ordinal, come from few people, and tie often; every person rates every condition.
//! So ranks within a person are compared: Friedman's test says whether conditions differ at all,
//! signed ranks say which pairs do. Their usual approximations (chi-square, normal) hold for many
//! people without ties; permuting holds for any number, ties included.
//!
//! | test | p |
//! | --- | --- |
//! | Friedman | each person's answers are shuffled, [`SHUFFLES`] times with a fixed seed: (1 + as large) / (1 + shuffles) |
//! | Wilcoxon, two-sided | exact: all signs of the ranks, mid-ranks for ties, zeros left out |
//! | pairs together | Holm's step-down correction |
//!
//! Not here: reading sessions, drawing (`results`).

use whippen_compiler::Rng;

/// Shuffles of a permutation test.
pub const SHUFFLES: u32 = 20_000;

/// What Friedman's test says.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Friedman {
    /// The statistic, corrected for ties.
    pub statistic: f64,
    /// How likely one as large is if conditions do not matter.
    pub p: f64,
}

/// What Wilcoxon's test says of two conditions.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SignedRanks {
    /// The smaller sum of ranks.
    pub statistic: f64,
    /// How many pairs differ.
    pub differing: usize,
    /// Two-sided.
    pub p: f64,
}

/// Ranks from 1 on, the mean of those that tie.
pub fn mid_ranks(values: &[f64]) -> Vec<f64> {
    let rank = |value: &f64| {
        let less = values.iter().filter(|other| *other < value).count();
        let same = values.iter().filter(|other| *other == value).count();
        less as f64 + 0.5 * (same as f64 + 1.0)
    };
    values.iter().map(rank).collect()
}

/// Friedman's statistic of rows of ranks: 0 where nothing differs.
fn friedman_statistic(ranks: &[Vec<f64>]) -> f64 {
    let k = ranks[0].len();
    let mean = 0.5 * (k as f64 + 1.0);
    let spread = |at: usize| {
        let sum: f64 = ranks.iter().map(|row| row[at] - mean).sum();
        sum * sum
    };
    let between: f64 = (0..k).map(spread).sum();
    let deviation = |rank: &f64| (rank - mean) * (rank - mean);
    let within: f64 = ranks.iter().flatten().map(deviation).sum();
    match within > 0.0 {
        true => (k as f64 - 1.0) * between / within,
        false => 0.0,
    }
}

/// Friedman's test of answers: a row for each person, a column for each condition.
///
/// None for fewer than two people or conditions.
pub fn friedman(rows: &[Vec<f64>], shuffles: u32) -> Option<Friedman> {
    if rows.len() < 2 || rows[0].len() < 2 {
        return None;
    }
    let mut ranks: Vec<Vec<f64>> = rows.iter().map(|row| mid_ranks(row)).collect();
    let statistic = friedman_statistic(&ranks);
    let mut random = Rng::new(0x5eed);
    let mut as_large = 0_u32;
    for _ in 0..shuffles {
        for row in &mut ranks {
            for last in (1..row.len()).rev() {
                row.swap(last, random.below(last as u64 + 1) as usize);
            }
        }
        // A part in a thousand million: sums of the same ranks in another order.
        as_large += u32::from(friedman_statistic(&ranks) >= statistic * (1.0 - 1e-9));
    }
    let p = f64::from(as_large + 1) / f64::from(shuffles + 1);
    Some(Friedman { statistic, p })
}

/// Wilcoxon's test of pairs, exact with ties. None where no pair differs.
pub fn signed_ranks(one: &[f64], other: &[f64]) -> Option<SignedRanks> {
    let pairs = one.iter().zip(other);
    let mut differences: Vec<f64> = pairs.map(|(a, b)| a - b).collect();
    differences.retain(|difference| *difference != 0.0);
    if differences.is_empty() {
        return None;
    }
    let sizes: Vec<f64> = differences.iter().map(|d| d.abs()).collect();
    // Twice the ranks are whole numbers.
    let doubled: Vec<usize> = (mid_ranks(&sizes).iter())
        .map(|rank| (2.0 * rank).round() as usize)
        .collect();
    let total: usize = doubled.iter().sum();
    let above = differences.iter().zip(&doubled);
    let above: usize = above.filter(|(d, _)| **d > 0.0).map(|(_, rank)| rank).sum();
    let least = above.min(total - above);
    // How many choices of signs give each sum, as parts of all.
    let mut chances = vec![0.0; total + 1];
    chances[0] = 1.0;
    for rank in doubled {
        for sum in (0..=total).rev() {
            let with = sum.checked_sub(rank).map_or(0.0, |before| chances[before]);
            chances[sum] = 0.5 * (chances[sum] + with);
        }
    }
    let tail: f64 = chances[..=least].iter().sum();
    Some(SignedRanks {
        statistic: 0.5 * least as f64,
        differing: differences.len(),
        p: (2.0 * tail).min(1.0),
    })
}

/// Holm's correction of several p, in their order.
pub fn holm(all: &[f64]) -> Vec<f64> {
    let mut order: Vec<usize> = (0..all.len()).collect();
    order.sort_by(|a, b| all[*a].total_cmp(&all[*b]));
    let mut corrected = vec![0.0; all.len()];
    let mut most = 0.0_f64;
    for (place, at) in order.into_iter().enumerate() {
        most = most.max((all.len() - place) as f64 * all[at]).min(1.0);
        corrected[at] = most;
    }
    corrected
}

/// Least, lower quartile, median, upper quartile, most of some values: by linear interpolation
/// between neighbours, as most tables of statistics do.
pub fn quartiles(values: &[f64]) -> [f64; 5] {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let at = |part: f64| {
        let place = part * (sorted.len() - 1) as f64;
        let (low, high) = (place.floor() as usize, place.ceil() as usize);
        sorted[low] + (sorted[high] - sorted[low]) * (place - low as f64)
    };
    [0.0, 0.25, 0.5, 0.75, 1.0].map(at)
}
