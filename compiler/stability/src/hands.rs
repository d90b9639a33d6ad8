//! The hands that a loop must bear.

use super::key::Hand;

/// Masses (kg), dampings (N*s/m) and stiffnesses (N/m): every combination is a hand, from a finger
/// that rests on the key to a stiff wrist. A stated set, our choice: hands differ by more than any
/// measurement of one of them says, so the ends are wide. Lighter than the lightest is nobody, who
/// is tried too.
pub const HANDS: ([f64; 4], [f64; 3], [f64; 4]) = (
    [0.05, 0.1, 0.2, 0.5],
    [1.0, 3.0, 10.0],
    [0.0, 200.0, 700.0, 2000.0],
);

/// A hand on a knob acts at this radius (m): half of the 40 mm that thumb and finger hold.
const KNOB_RADIUS_M: f64 = 0.02;

/// Nobody, then every hand of the table; on what turns, at the rim of a knob.
pub fn hands(turns: bool) -> Vec<Hand> {
    let arm = if turns {
        KNOB_RADIUS_M * KNOB_RADIUS_M
    } else {
        1.0
    };
    let (masses, dampings, stiffnesses) = HANDS;
    let mut hands = vec![Hand::FREE];
    for mass in masses {
        for damping in dampings {
            let with = |stiffness| Hand {
                mass: mass * arm,
                damping: damping * arm,
                stiffness: stiffness * arm,
            };
            hands.extend(stiffnesses.map(with));
        }
    }
    hands
}
