//! Of several comparisons of one value with constants, the one to decide first.
//!
//! ```text
//!        a         b         c              the constants, in order
//!   ---- 0 ------- 1 ------- 2 ------- 3 ---     the spans between them: what is left to do if the value lies there
//! ```
//!
//! Every order of decisions is a tree over the spans, and a span pays for as many decisions as it
//! is deep. Wanted is the tree whose dearest way is cheapest, so a dear span is to be reached
//! early.

use super::cost;

/// Comparisons that are weighed against each other; of more, the middle one comes first.
pub const AT_ONCE: usize = 8;

/// What is so many cycles cheaper than the dearest span does not count.
const BITS: u32 = 64;

/// `costs[i][n]`: what is left to do in span `i` and the `n` behind it while nothing between them
/// is decided.
pub type Costs = Vec<Vec<u32>>;

/// The comparison that is best decided first, given which of them must be decided, the costs, and
/// how many cycles a decision must save where none must be made; none if no decision pays.
pub fn first(musts: &[bool], costs: &Costs, worth: u32) -> Option<usize> {
    let dearest = costs.iter().map(|from| from[0]).max()?;
    let spans = costs.len();
    // By the first of some spans and how many follow it: the least weight, and the decision that
    // leads to it.
    let mut best: Vec<Vec<(u128, Option<usize>)>> = vec![Vec::new(); spans];
    for high in 0..spans {
        for low in (0..=high).rev() {
            let whole = |off: u32| match musts[low..high].contains(&true) {
                true => u128::MAX,
                false => weight(costs[low][high - low].saturating_sub(off), dearest),
            };
            let split = |at: usize| {
                let sides = best[low][at - low]
                    .0
                    .saturating_add(best[at + 1][high - at - 1].0);
                (sides.saturating_mul(1 << cost::BRANCH), Some(at))
            };
            let least = (low..high).map(split).min_by_key(|(weight, _)| *weight);
            let least = least.filter(|(weight, _)| *weight <= whole(worth));
            best[low].push(least.unwrap_or((whole(0), None)));
        }
    }
    best[0][spans - 1].1
}

/// `2^cycles`, so that sums are little more than the largest: of two orders whose dearest ways cost
/// the same, the one with fewer such ways is better, because all of this is estimated.
fn weight(cycles: u32, dearest: u32) -> u128 {
    (1_u128 << BITS)
        .checked_shr(dearest.saturating_sub(cycles))
        .unwrap_or(0)
        << cycles.saturating_sub(dearest).min(BITS / 2)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Costs of spans between comparisons of which all must be decided.
    fn musts(spans: &[u32]) -> Option<usize> {
        let costs: Costs = (0..spans.len())
            .map(|low| vec![spans[low]; spans.len() - low])
            .collect();
        first(&vec![true; spans.len() - 1], &costs, 2)
    }

    #[test]
    fn the_dear_span_is_reached_first() {
        assert_eq!(musts(&[50, 50, 50, 50]), Some(1));
        assert_eq!(musts(&[60, 50, 50, 50]), Some(0));
        assert_eq!(musts(&[50, 50, 50, 60]), Some(2));
        assert_eq!(musts(&[7]), None);
    }

    #[test]
    fn what_need_not_be_decided_is_where_it_pays() {
        let costs = |whole| vec![vec![40, whole], vec![40]];
        assert_eq!(first(&[false], &costs(43), 2), None);
        assert_eq!(first(&[false], &costs(46), 2), Some(0));
        assert_eq!(first(&[true], &costs(40), 2), Some(0));
    }
}
