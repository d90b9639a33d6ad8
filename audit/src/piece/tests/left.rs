//! Loops that are left for a point which is no head.

use whippen_isa::ItState;

use super::{COUNTS, NESTED, cycles, looping};
use crate::certificate::Point;
use crate::made::{HANDLER, Image};

/// Of each loop that is left, one round did remain.
#[test]
fn a_point_behind_loops_is_no_further() {
    let with_point = |mut image: Image, at: u32, loops: &[u32]| {
        image.function(0).pieces[0].points.push(Point {
            context: 0,
            at: HANDLER + at,
            it: ItState::OUTSIDE,
            place: 0,
            loops: loops.to_vec(),
            states: Vec::new(),
        });
        cycles(image)
    };
    let mut counts = COUNTS.to_vec();
    counts.insert(3, "movs r1, #1");
    let counts = || looping(&counts, &[(2, 9, 3)]);
    assert_eq!(cycles(counts()), Ok(1 + 9 * 3 - 2 + 1 + 1));
    assert_eq!(with_point(counts(), 6, &[]), cycles(counts()));
    let round = 1 + (9 * 3 - 2) + 3;
    let nested = || looping(&NESTED, &[(2, 9, round), (4, 9, 3)]);
    for (at, loops) in [(12, &[][..]), (8, &[0]), (10, &[0]), (6, &[0, 1])] {
        let found = with_point(nested(), at, loops);
        assert_eq!(found, Ok(1 + 9 * round - 2 + 1), "{at}");
    }
}
