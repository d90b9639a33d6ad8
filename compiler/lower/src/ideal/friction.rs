//! Frictions in f64: the balance to the last bit, from the slip of the tick before.
//!
//! Rule 21 with as many steps as it takes. Where they do not end, because the force jumps between
//! two slips, the interval that holds a balance is halved until nothing is left of it.

/// Newton's steps; what takes more goes round in a circle.
const STEPS: usize = 100;
/// Steps of this part of what the slip may be are rounding.
const CLOSE: f64 = 1e-14;
/// Halvings, which leave no two numbers between the ends.
const HALVINGS: usize = 2000;
/// Least slope that a step is made by.
const LEAST_SLOPE: f64 = 1.0 / 16.0;

/// The slip `v` with `v + gain * law(v) = free`, nearest to `last` as far as steps lead there; of
/// a slip `law` gives the force and its slope.
pub(super) fn balanced(
    free: f64,
    gain: f64,
    last: f64,
    mut law: impl FnMut(f64) -> (f64, f64),
) -> f64 {
    let (low, high) = (free.min(0.0), free.max(0.0));
    let mut rest = |slip: f64| {
        let (force, slope) = law(slip);
        (slip + gain * force - free, 1.0 + gain * slope)
    };
    let mut slip = last.clamp(low, high);
    for _ in 0..STEPS {
        let (left, slope) = rest(slip);
        let next = (slip - left / slope.max(LEAST_SLOPE)).clamp(low, high);
        let step = (next - slip).abs();
        slip = next;
        if step <= CLOSE * (high - low) {
            return slip;
        }
    }
    // The rest is below zero at the low end, or zero, and above at the high end.
    let (mut below, mut above) = (low, high);
    for _ in 0..HALVINGS {
        let left = rest(slip).0;
        if left > 0.0 {
            above = slip;
        } else {
            below = slip;
        }
        let middle = below + 0.5 * (above - below);
        if left == 0.0 || middle <= below || middle >= above {
            break;
        }
        slip = middle;
    }
    slip
}

#[cfg(test)]
mod tests {
    use super::*;

    /// `n tanh(v / 1 mm/s)` and its slope.
    fn dry(n: f64) -> impl FnMut(f64) -> (f64, f64) {
        move |v| {
            let t = libm::tanh(v / 1e-3);
            (n * t, n * (1.0 - t * t) / 1e-3)
        }
    }

    #[test]
    fn what_is_found_is_in_balance() {
        for free in [-3.0, -0.2, -1e-6, 0.0, 1e-9, 0.01, 0.7] {
            for last in [-1.0, 0.0, 1e-4, 2.0] {
                for gain in [1e-5, 0.01, 3.0] {
                    let slip = balanced(free, gain, last, dry(10.0));
                    let force = dry(10.0)(slip).0;
                    let left = slip + gain * force - free;
                    assert!(
                        left.abs() <= 1e-12 * (1.0 + gain * 1e4),
                        "{free} {gain} {left}"
                    );
                    assert!(force * slip >= 0.0 && (free - slip) * slip >= 0.0);
                }
            }
        }
    }
}
