//! A pole of the loop as it is, followed from the border that it left the circle at.
//!
//! Continuation: `1 + g L(z) = 0` is solved by Newton's method while `g` goes in small steps from
//! the border's factor to 1, each time from the pole before.

use num_complex::Complex64;

/// Steps of the factor, even in proportion.
const STEPS: i32 = 60;

/// Newton steps for each.
const ROUNDS: usize = 12;

/// Near enough, in the plane of z.
const CLOSE: f64 = 1e-12;

/// Where the pole is at a factor of 1 that is at `from` at a factor below; none where it is lost.
pub fn followed(
    gain: &impl Fn(Complex64) -> Complex64,
    factor: f64,
    from: Complex64,
) -> Option<Complex64> {
    let mut z = from;
    for step in 0..=STEPS {
        let left = 1.0 - f64::from(step) / f64::from(STEPS);
        let g = libm::exp(left * libm::log(factor));
        z = solved(gain, g, z)?;
    }
    Some(z)
}

fn solved(gain: &impl Fn(Complex64) -> Complex64, g: f64, from: Complex64) -> Option<Complex64> {
    let mut z = from;
    for _ in 0..ROUNDS {
        let h = 1e-6;
        let slope = (gain(z + h) - gain(z - h)) / (2.0 * h);
        let step = (gain(z) + 1.0 / g) / slope;
        z -= step;
        if !z.is_finite() {
            return None;
        }
        if step.norm() < CLOSE {
            return Some(z);
        }
    }
    // What still moves by less than what is told of it is found.
    let rest = (1.0 + g * gain(z)).norm();
    (rest < 1e-6).then_some(z)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// `g / (z^2 - 1.8 z + 0.9)`: its poles are those of `z^2 - 1.8 z + 0.9 + g`.
    #[test]
    fn a_pole_is_where_its_polynomial_has_it() {
        let gain = |z: Complex64| 0.4 / (z * z - 1.8 * z + 0.9);
        let border = Complex64::new(0.9, libm::sqrt(1.0 - 0.81));
        let found = followed(&gain, 0.25, border).expect("followed");
        let exact = Complex64::new(0.9, libm::sqrt(1.3 - 0.81));
        assert!((found - exact).norm() < 1e-9, "{found} {exact}");
    }
}
