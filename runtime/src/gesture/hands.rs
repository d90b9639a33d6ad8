//! What hands do on instruments with several ports: rubs, strums, strokes of a bow.
//!
//! Who senses what a bundled instrument senses is played as that one is; anything else goes round.
//! A hand goes from place to place, all ports at once, each with minimum jerk, so that the path
//! between two places is straight.

use whippen_compiler::model::Model;

use super::Gesture;

/// Where a hand is, port by port (SI), and how long it takes to get there (s).
type Step = (f64, &'static [f64]);

/// A hand, and what it plays: names and ends (SI) of the senses.
struct Hand {
    /// In words, for whoever runs it.
    name: &'static str,
    senses: &'static [(&'static str, f64, f64)],
    steps: fn() -> Vec<(f64, Vec<f64>)>,
}

const HANDS: &[Hand] = &[
    Hand {
        name: "rubs",
        senses: &[("x", -0.08, 0.08), ("y", -0.06, 0.06), ("z", -0.04, 0.04)],
        steps: || steps(RUBS),
    },
    Hand {
        name: "rubs",
        senses: &[
            ("across", 0.0, 0.24),
            ("height", 0.0, 0.14),
            ("push", 0.0, 20.0),
        ],
        steps: || steps(RUBS_ON_PAD),
    },
    Hand {
        name: "rubs",
        senses: &[("across", 0.0, 1.0), ("height", 0.0, 1.0)],
        steps: || steps(RUBS_BY_MOUSE),
    },
    Hand {
        name: "strums",
        senses: &[("x", -0.06, 0.06), ("y", -0.04, 0.04), ("z", -0.02, 0.06)],
        steps: || steps(STRUMS),
    },
    Hand {
        name: "strokes of a bow",
        senses: &[
            ("x", -0.16, 0.16),
            ("y", -0.12, 0.12),
            ("z", -0.1, 0.1),
            ("tilt", -75.0 * DEG, 75.0 * DEG),
        ],
        steps: bows,
    },
];

/// Degrees in radians.
const DEG: f64 = std::f64::consts::PI / 180.0;

/// The hand that plays what senses like that: what it does, and the gesture of each port.
pub(super) fn of(model: &Model) -> Option<(&'static str, Vec<Gesture>)> {
    let near = |a: f64, b: f64| (a - b).abs() <= 1e-9 * b.abs();
    let fits = |hand: &&Hand| {
        let mut both = model.senses.iter().zip(hand.senses);
        model.senses.len() == hand.senses.len()
            && both.all(|(sense, (name, low, high))| {
                sense.name == *name && near(sense.range.low, *low) && near(sense.range.high, *high)
            })
    };
    let hand = HANDS.iter().find(fits)?;
    let steps = (hand.steps)();
    let port = |port: usize| {
        let go = |gesture: Gesture, (seconds, places): &(f64, Vec<f64>)| {
            gesture.to(places[port], *seconds)
        };
        steps.iter().fold(Gesture::new(), go)
    };
    Some((hand.name, (0..hand.senses.len()).map(port).collect()))
}

fn steps(rows: &[Step]) -> Vec<(f64, Vec<f64>)> {
    let row = |(seconds, places): &Step| (*seconds, places.to_vec());
    rows.iter().map(row).collect()
}

/// 7 s with an arm on the rubbed bank (x, y, z): the lowest mass, slowly and back, then harder; on
/// over all of them while it rubs; a high one, quickly; off.
const RUBS: &[Step] = &[
    (0.0, &[-0.06, 0.01, -0.035]),
    (0.1, &[-0.06, -0.0004, -0.035]),
    (1.0, &[0.06, -0.0004, -0.035]),
    (1.0, &[-0.06, -0.0004, -0.035]),
    (0.1, &[-0.06, -0.002, -0.035]),
    (0.8, &[0.06, -0.002, -0.035]),
    (0.1, &[0.06, -0.001, -0.014]),
    (0.6, &[0.0, -0.001, -0.014]),
    (0.6, &[-0.06, -0.001, 0.0]),
    (0.6, &[0.0, -0.001, 0.014]),
    (0.6, &[0.06, -0.001, 0.035]),
    (0.4, &[-0.01, -0.001, 0.035]),
    (0.1, &[-0.03, 0.01, 0.035]),
    (1.0, &[-0.03, 0.01, 0.035]),
];

/// The same on a pad (across, height, push).
const RUBS_ON_PAD: &[Step] = &[
    (0.0, &[0.06, 0.0, 0.0]),
    (0.1, &[0.06, 0.0, 0.6]),
    (1.0, &[0.18, 0.0, 0.6]),
    (1.0, &[0.06, 0.0, 0.6]),
    (0.1, &[0.06, 0.0, 4.0]),
    (0.8, &[0.18, 0.0, 4.0]),
    (0.1, &[0.18, 0.042, 2.0]),
    (0.6, &[0.12, 0.042, 2.0]),
    (0.6, &[0.06, 0.07, 2.0]),
    (0.6, &[0.12, 0.098, 2.0]),
    (0.6, &[0.18, 0.14, 2.0]),
    (0.4, &[0.11, 0.14, 2.0]),
    (0.1, &[0.1, 0.14, 0.0]),
    (1.0, &[0.1, 0.14, 0.0]),
];

/// And by mouse (across, height), which presses all the time.
const RUBS_BY_MOUSE: &[Step] = &[
    (0.0, &[0.3, 0.0]),
    (1.0, &[0.7, 0.0]),
    (1.0, &[0.3, 0.0]),
    (0.1, &[0.3, 0.3]),
    (0.8, &[0.7, 0.3]),
    (0.6, &[0.5, 0.5]),
    (0.6, &[0.3, 0.7]),
    (0.6, &[0.5, 1.0]),
    (0.4, &[0.3, 1.0]),
    (1.0, &[0.3, 1.0]),
];

/// 7 s with a plectrum (x, y, z): slowly over all six strings, along a wound one while it is drawn,
/// lifted back; three fast strokes, down, up and down; a string alone that rings.
const STRUMS: &[Step] = &[
    (0.0, &[0.0, -0.04, 0.01]),
    (0.1, &[0.0, -0.04, -0.003]),
    (2.0, &[0.0, 0.035, -0.003]),
    (0.2, &[0.0, 0.035, 0.01]),
    (0.3, &[0.02, -0.03, 0.01]),
    (0.1, &[0.02, -0.03, -0.003]),
    (0.2, &[0.02, -0.024, -0.003]),
    (0.6, &[-0.04, -0.024, -0.003]),
    (0.1, &[-0.04, -0.02, -0.003]),
    (0.2, &[-0.01, -0.035, 0.01]),
    (0.1, &[-0.01, -0.035, -0.003]),
    (0.12, &[-0.01, 0.035, -0.003]),
    (0.5, &[-0.01, 0.035, -0.003]),
    (0.12, &[-0.01, -0.035, -0.003]),
    (0.5, &[-0.01, -0.035, -0.003]),
    (0.06, &[-0.01, 0.035, -0.003]),
    (0.5, &[-0.01, 0.035, -0.003]),
    (0.2, &[0.0, 0.03, 0.01]),
    (0.1, &[0.0, 0.03, -0.003]),
    (0.1, &[0.0, 0.02, -0.003]),
    (1.2, &[0.0, 0.02, 0.01]),
];

/// A string of the violin: where it is (m), and how the bow leans that plays it alone: degrees,
/// their cosine and sine.
struct BowedString {
    at: (f64, f64),
    tilt: f64,
    lean: (f64, f64),
}

const G: BowedString = BowedString {
    at: (-0.075, -0.01),
    tilt: 53.13 * DEG,
    lean: (0.6, 0.8),
};
const D: BowedString = BowedString {
    at: (-0.025, 0.025),
    tilt: 16.26 * DEG,
    lean: (0.96, 0.28),
};
const D_AND_A: BowedString = BowedString {
    at: (0.0, 0.025),
    tilt: 0.0,
    lean: (1.0, 0.0),
};
const A: BowedString = BowedString {
    at: (0.025, 0.025),
    tilt: -16.26 * DEG,
    lean: (0.96, -0.28),
};
const E: BowedString = BowedString {
    at: (0.075, -0.01),
    tilt: -53.13 * DEG,
    lean: (0.6, -0.8),
};

/// 7 s with a bow (x, y, z, tilt): D, down and up; A and E, faster; short strokes on E; D and A
/// together; the lowest, long, and lifted while it sounds.
fn bows() -> Vec<(f64, Vec<f64>)> {
    // Seconds, string, how far it is drawn from its middle (mm), how deep it lies (mm).
    let rows: &[(f64, &BowedString, f64, f64)] = &[
        (0.0, &D, -45.0, -5.0),
        (0.1, &D, -45.0, 8.0),
        (0.9, &D, 45.0, 10.0),
        (0.9, &D, -45.0, 8.0),
        (0.1, &D, -50.0, -5.0),
        (0.1, &A, -45.0, -5.0),
        (0.1, &A, -40.0, 8.0),
        (0.5, &A, 10.0, 8.0),
        (0.05, &A, 12.0, -5.0),
        (0.1, &E, 10.0, -5.0),
        (0.1, &E, 10.0, 6.0),
        (0.4, &E, -30.0, 6.0),
        (0.15, &E, -15.0, 6.0),
        (0.15, &E, -30.0, 6.0),
        (0.15, &E, -15.0, 6.0),
        (0.15, &E, -30.0, 6.0),
        (0.1, &E, -30.0, -20.0),
        (0.15, &D_AND_A, -30.0, -5.0),
        (0.1, &D_AND_A, -30.0, 6.0),
        (0.7, &D_AND_A, 40.0, 6.0),
        (0.1, &D_AND_A, 45.0, -15.0),
        (0.15, &G, 40.0, -5.0),
        (0.1, &G, 40.0, 11.0),
        (1.0, &G, -50.0, 11.0),
        (0.1, &G, -55.0, -5.0),
        (0.8, &G, -55.0, -5.0),
    ];
    // Near the end of the strings that the bridge is at.
    let along = -0.064;
    let row = |(seconds, string, drawn, deep): &(f64, &BowedString, f64, f64)| {
        let ((x, y), (cos, sin)) = (string.at, string.lean);
        let (drawn, deep) = (1e-3 * drawn, 1e-3 * deep);
        let x = x + drawn * cos + deep * sin;
        let y = y + drawn * sin - deep * cos;
        (*seconds, vec![x, y, along, string.tilt])
    };
    rows.iter().map(row).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hands_stay_within_what_is_sensed() {
        for hand in HANDS {
            let steps = (hand.steps)();
            let seconds: f64 = steps.iter().map(|(seconds, _)| seconds).sum();
            assert!((5.0..8.0).contains(&seconds), "{}: {seconds} s", hand.name);
            for (_, places) in &steps {
                assert_eq!(places.len(), hand.senses.len());
                for (place, (name, low, high)) in places.iter().zip(hand.senses) {
                    assert!(
                        (*low..=*high).contains(place),
                        "{}: {name} {place}",
                        hand.name
                    );
                }
            }
        }
    }
}
