//! Knots, slopes and intervals of tables.

use super::{Head, Table};
use crate::model::Interval;
use crate::units::Dim;
use whippen_source::Span;

const KNOTS: &[(f64, f64)] = &[
    (0.0, 0.0),
    (1.0, 0.5),
    (1.5, 3.0),
    (2.0, 3.0),
    (4.0, 1.0),
    (4.1, 7.0),
];

fn table(knots: &[(f64, f64)], is_cubic: bool) -> Option<Table> {
    let head = Head {
        name: "t".to_string(),
        over: Dim::LENGTH,
        dim: Dim::FORCE,
        span: Span::default(),
    };
    Table::new(head, knots, is_cubic)
}

#[test]
fn knots_are_met_and_held_beyond() {
    for is_cubic in [false, true] {
        let table = table(KNOTS, is_cubic).expect("it rises");
        for (x, y) in KNOTS {
            assert!((table.value(*x) - y).abs() < 1e-12, "{x} {is_cubic}");
        }
        assert_eq!([table.value(-3.0), table.value(9.0)], [0.0, 7.0]);
        assert_eq!([table.slope(-3.0), table.slope(9.0)], [0.0, 0.0]);
    }
    let line = table(KNOTS, false).expect("it rises");
    assert_eq!(line.value(1.25), 1.75);
    assert_eq!(line.slope(1.25), 5.0);
}

#[test]
fn what_does_not_rise_is_no_table() {
    assert!(table(&[(0.0, 1.0)], false).is_none());
    assert!(table(&[(0.0, 1.0), (0.0, 2.0)], false).is_none());
    assert!(table(&[(1.0, 1.0), (0.0, 2.0)], true).is_none());
}

#[test]
fn a_cubic_neither_overshoots_nor_turns_between_knots() {
    let table = table(KNOTS, true).expect("it rises");
    for two in KNOTS.windows(2) {
        let ((from, low), (to, high)) = (two[0], two[1]);
        let mut last = low;
        for n in 1..=1000 {
            let x = from + (to - from) * f64::from(n) / 1000.0;
            let y = table.value(x);
            assert!((y - last) * (high - low) >= -1e-12, "{x}");
            assert!(y >= low.min(high) - 1e-12 && y <= low.max(high) + 1e-12);
            last = y;
        }
    }
    // The slope of the left side is that of the right.
    for (x, _) in &KNOTS[1..KNOTS.len() - 1] {
        let slope = |at: f64| table.slope(at);
        assert!((slope(x - 1e-9) - slope(x + 1e-9)).abs() < 1e-5, "{x}");
    }
}

#[test]
fn intervals_hold_what_is_sampled_and_no_more_than_they_must() {
    for is_cubic in [false, true] {
        let table = table(KNOTS, is_cubic).expect("it rises");
        for (low, high) in [(-1.0, 5.0), (0.2, 0.3), (1.2, 2.5), (3.9, 4.05), (4.2, 8.0)] {
            let x = Interval { low, high };
            let (values, slopes) = (table.values_over(x), table.slopes_over(x));
            let mut found = [[f64::INFINITY, f64::NEG_INFINITY]; 2];
            for n in 0..=20_000 {
                let at = low + (high - low) * f64::from(n) / 20_000.0;
                for (seen, now) in found.iter_mut().zip([table.value(at), table.slope(at)]) {
                    *seen = [seen[0].min(now), seen[1].max(now)];
                }
            }
            for (bound, [least, most]) in [(values, found[0]), (slopes, found[1])] {
                assert!(bound.low <= least && most <= bound.high, "{x:?} {bound:?}");
            }
            let slack = 1e-9 + 2e-3 * values.width();
            assert!(found[0][0] - values.low <= slack && values.high - found[0][1] <= slack);
        }
    }
}
