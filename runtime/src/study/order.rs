//! The order of conditions: Williams's Latin squares, balanced for what comes directly before.
//!
//! For an even number of conditions one square of as many rows; for an odd one the square and its
//! mirror. Within all rows each condition stands equally often at each place and equally often
//! directly after each other one. A participant takes the row of their number, in turn.

/// The order of so many conditions for a participant, who are counted from 1.
pub fn order(conditions: usize, participant: usize) -> Vec<usize> {
    let rows = rows(conditions);
    let row = (participant.max(1) - 1) % rows.max(1);
    // 0, 1, n-1, 2, n-2, ..
    let first = (0..conditions).map(|place| match place % 2 {
        1 => place.div_ceil(2),
        _ => (conditions - place / 2) % conditions,
    });
    let shifted = first.map(|own| (own + row) % conditions);
    let mut shifted: Vec<usize> = shifted.collect();
    if row >= conditions {
        shifted.reverse();
    }
    shifted
}

/// How many rows there are: participants are balanced when their number is a multiple of it.
pub fn rows(conditions: usize) -> usize {
    if conditions.is_multiple_of(2) || conditions < 2 {
        conditions
    } else {
        2 * conditions
    }
}

/// What the squares are called.
pub fn kind(conditions: usize) -> &'static str {
    match conditions.is_multiple_of(2) {
        true => "Williams's Latin square",
        false => "Williams's two Latin squares, the second the mirror of the first",
    }
}

#[cfg(test)]
mod tests {
    use super::{order, rows};
    use std::collections::BTreeMap;

    #[test]
    fn every_place_and_every_neighbour_is_as_frequent_as_the_others() {
        for conditions in 2..=9 {
            let [mut places, mut after] = [(); 2].map(|()| BTreeMap::<_, usize>::new());
            for participant in 1..=rows(conditions) {
                let order = order(conditions, participant);
                for (place, own) in order.iter().enumerate() {
                    *places.entry((place, *own)).or_default() += 1;
                }
                for pair in order.windows(2) {
                    *after.entry((pair[0], pair[1])).or_default() += 1;
                }
            }
            let turns = rows(conditions) / conditions;
            assert_eq!(places.len(), conditions * conditions);
            assert!(places.values().all(|count| *count == turns), "{conditions}");
            assert_eq!(after.len(), conditions * (conditions - 1));
            assert!(after.values().all(|count| *count == turns), "{conditions}");
        }
        assert_eq!(order(4, 5), order(4, 1), "the rows come again");
    }
}
