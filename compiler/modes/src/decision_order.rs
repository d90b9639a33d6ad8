//! Optimal decision order: dynamic programming over intervals, as for optimal binary search trees.
//!
//! ```text
//!        a         b         c              the constants, in order
//!   ---- 0 ------- 1 ------- 2 ------- 3 ---     spans between them, each with its cost if the value lies there
//! ```
//!
//! Every order of comparisons of one value with constants is a tree over the spans, and a span pays
//! for as many decisions as it is deep. Minimized is the worst-case cost, so that an expensive span
//! is reached after few decisions.

use whippen_target_info::BRANCH_CYCLES;

/// Bits of a weight: a span this many cycles cheaper than the worst case does not count.
const BITS: u32 = 64;

/// `costs[i][n]`: what is left to do in span `i` and the `n` behind it while nothing between them
/// is decided.
pub type Costs = Vec<Vec<u32>>;

/// The comparison that is best decided first, given which of them must be decided, the costs, and
/// how many cycles a decision must save where none must be made; none if no decision pays.
pub fn best_first(required: &[bool], costs: &Costs, threshold: u32) -> Option<usize> {
    let worst_case = costs.iter().map(|from| from[0]).max()?;
    let spans = costs.len();
    // By the first of some spans and how many follow it: the least weight, and the decision that
    // leads to it.
    let mut best: Vec<Vec<(u128, Option<usize>)>> = vec![Vec::new(); spans];
    for high in 0..spans {
        for low in (0..=high).rev() {
            let undecided_weight = |off: u32| match required[low..high].contains(&true) {
                true => u128::MAX,
                false => weight(costs[low][high - low].saturating_sub(off), worst_case),
            };
            let split = |at: usize| {
                let sides = best[low][at - low]
                    .0
                    .saturating_add(best[at + 1][high - at - 1].0);
                (sides.saturating_mul(1 << BRANCH_CYCLES), Some(at))
            };
            let least = (low..high).map(split).min_by_key(|(weight, _)| *weight);
            let least = least.filter(|(weight, _)| *weight <= undecided_weight(threshold));
            best[low].push(least.unwrap_or((undecided_weight(0), None)));
        }
    }
    best[0][spans - 1].1
}

/// `2^cycles`, so that sums are little more than the largest: of two orders with the same worst
/// case, the one with fewer paths as long is better, because all of this is estimated.
fn weight(cycles: u32, worst_case: u32) -> u128 {
    (1_u128 << BITS)
        .checked_shr(worst_case.saturating_sub(cycles))
        .unwrap_or(0)
        << cycles.saturating_sub(worst_case).min(BITS / 2)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Costs of spans between comparisons of which all must be decided.
    fn first_of_required(spans: &[u32]) -> Option<usize> {
        let costs: Costs = (0..spans.len())
            .map(|low| vec![spans[low]; spans.len() - low])
            .collect();
        best_first(&vec![true; spans.len() - 1], &costs, 2)
    }

    #[test]
    fn the_most_expensive_span_is_reached_first() {
        assert_eq!(first_of_required(&[50, 50, 50, 50]), Some(1));
        assert_eq!(first_of_required(&[60, 50, 50, 50]), Some(0));
        assert_eq!(first_of_required(&[50, 50, 50, 60]), Some(2));
        assert_eq!(first_of_required(&[7]), None);
    }

    #[test]
    fn an_optional_decision_is_made_where_it_pays() {
        let costs = |undecided| vec![vec![40, undecided], vec![40]];
        assert_eq!(best_first(&[false], &costs(43), 2), None);
        assert_eq!(best_first(&[false], &costs(46), 2), Some(0));
        assert_eq!(best_first(&[true], &costs(40), 2), Some(0));
    }
}
