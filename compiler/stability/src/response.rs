//! Frequency responses in z: differentiators as they are computed, linear systems, the key between
//! two samples.

use num_complex::Complex64;

use super::linear::System;

/// Weights of a differentiator over its window, the newest sample first (per tick, per tick
/// squared).
#[derive(Debug, Clone)]
pub struct Differentiator {
    slope: Vec<f64>,
    curvature: Vec<f64>,
}

impl Differentiator {
    /// Slope of the least-squares line and second derivative of the least-squares parabola over
    /// `window` ticks.
    pub fn new(window: u32, rate_hz: f64) -> Differentiator {
        let m = f64::from(window / 2);
        let places: Vec<f64> = (0..window).map(|i| m - f64::from(i)).collect();
        let squares: f64 = places.iter().map(|j| j * j).sum();
        let bowl = |j: f64| j * j - m * (m + 1.0) / 3.0;
        let bowls: f64 = places.iter().map(|j| bowl(*j).powi(2)).sum();
        Differentiator {
            slope: places.iter().map(|j| j / squares * rate_hz).collect(),
            curvature: places
                .iter()
                .map(|j| 2.0 * bowl(*j) / bowls * rate_hz * rate_hz)
                .collect(),
        }
    }

    /// Over so many ticks.
    pub fn window(&self) -> u32 {
        self.slope.len() as u32
    }

    /// `x`, `x'` and `x''` for each unit of `x`, at `z`.
    pub fn at(&self, z: Complex64) -> [Complex64; 3] {
        let back = z.inv();
        let sum = |weights: &[f64]| {
            weights
                .iter()
                .rev()
                .fold(Complex64::ZERO, |sum, weight| sum * back + weight)
        };
        [Complex64::ONE, sum(&self.slope), sum(&self.curvature)]
    }

    /// The most that `x'` (s/m times m/s: 1) and `x''` (1/s) can be for a speed that is never above
    /// 1 (m/s), whatever the motion.
    pub fn gains(&self, rate_hz: f64) -> [f64; 2] {
        let gain = |weights: &[f64]| {
            let partial = weights.iter().scan(0.0, |sum, weight| {
                *sum += weight;
                Some(*sum)
            });
            partial.map(f64::abs).sum::<f64>() / rate_hz
        };
        [gain(&self.slope), gain(&self.curvature)]
    }

    /// The most that one step of `x` by 1 changes `x'` (1/s) and `x''` (1/s^2).
    pub fn steps(&self) -> [f64; 2] {
        let step = |weights: &[f64]| {
            let partial = weights.iter().scan(0.0, |sum: &mut f64, weight| {
                *sum += weight;
                Some(*sum)
            });
            partial.map(f64::abs).fold(0.0, f64::max)
        };
        [step(&self.slope), step(&self.curvature)]
    }
}

/// Force of each term for each unit of `x`, at `z`; `inputs` are the senses' values for it.
pub fn forces(system: &System, z: Complex64, inputs: &[Complex64]) -> Vec<Complex64> {
    let n = system.a.len();
    let driven = |row: &[f64]| {
        row.iter()
            .zip(inputs)
            .map(|(gain, y)| y * gain)
            .sum::<Complex64>()
    };
    // Most modes have nothing that moves along.
    if n == 0 {
        return system.outputs.iter().map(|o| driven(&o.direct)).collect();
    }
    let mut matrix: Vec<Vec<Complex64>> = (0..n)
        .map(|to| {
            (0..n)
                .map(|from| if to == from { z } else { Complex64::ZERO } - system.a[to][from])
                .collect()
        })
        .collect();
    let mut cells: Vec<Complex64> = system.b.iter().map(|row| driven(row)).collect();
    solve(&mut matrix, &mut cells);
    let output = |o: &super::linear::Output<f64>| {
        driven(&o.direct)
            + o.cells
                .iter()
                .zip(&cells)
                .map(|(gain, s)| s * gain)
                .sum::<Complex64>()
    };
    system.outputs.iter().map(output).collect()
}

/// Solves `matrix x = right` in place, by elimination with pivots. A singular matrix gives numbers
/// without end.
pub fn solve<R: AsRef<[Complex64]> + AsMut<[Complex64]>>(
    matrix: &mut [R],
    right: &mut [Complex64],
) {
    let n = right.len();
    for column in 0..n {
        let size = |row: usize| matrix[row].as_ref()[column].norm_sqr();
        let pivot = (column..n)
            .max_by(|a, b| size(*a).total_cmp(&size(*b)))
            .unwrap_or(column);
        matrix.swap(column, pivot);
        right.swap(column, pivot);
        let (above, below) = matrix.split_at_mut(column + 1);
        let top = above[column].as_ref();
        let (first, rest) = right.split_at_mut(column + 1);
        for (row, value) in below.iter_mut().zip(rest) {
            let row = row.as_mut();
            let factor = row[column] / top[column];
            row.iter_mut()
                .zip(top)
                .skip(column)
                .for_each(|(v, t)| *v -= factor * t);
            *value -= factor * first[column];
        }
    }
    for row in (0..n).rev() {
        let own = matrix[row].as_ref();
        let known: Complex64 = (row + 1..n).map(|k| own[k] * right[k]).sum();
        right[row] = (right[row] - known) / own[row];
    }
}

/// Whether all poles of a matrix lie within a circle: its powers, squared again and again, vanish.
pub fn settles(matrix: &[Vec<f64>], circle: f64) -> bool {
    let n = matrix.len();
    let mut power: Vec<Vec<f64>> = matrix
        .iter()
        .map(|row| row.iter().map(|v| v / circle).collect())
        .collect();
    for _ in 0..40 {
        let square = |i: usize, j: usize| (0..n).map(|k| power[i][k] * power[k][j]).sum::<f64>();
        power = (0..n)
            .map(|i| (0..n).map(|j| square(i, j)).collect())
            .collect();
        let size = power
            .iter()
            .flatten()
            .fold(0.0_f64, |most, v| most.max(v.abs()));
        if !size.is_finite() || size > 1e60 {
            return false;
        }
        if size < 1e-6 {
            return true;
        }
    }
    n == 0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn differentiators_lag_half_their_window_and_know_lines_and_parabolas() {
        let rate_hz = 44_100.0;
        let d = Differentiator::new(31, rate_hz);
        let line: f64 = d
            .slope
            .iter()
            .enumerate()
            .map(|(i, w)| w * -(i as f64) / rate_hz)
            .sum();
        let parabola: f64 = d
            .curvature
            .iter()
            .enumerate()
            .map(|(i, w)| w * (i as f64 / rate_hz).powi(2))
            .sum();
        assert!(
            (line - 1.0).abs() < 1e-9 && (parabola - 2.0).abs() < 1e-9,
            "{line} {parabola}"
        );
        let w = 20.0;
        let [_, slope, curvature] = d.at(Complex64::from_polar(1.0, w / rate_hz));
        let lag = Complex64::from_polar(1.0, -15.0 * w / rate_hz);
        assert!((slope / (Complex64::I * w * lag) - 1.0).norm() < 1e-4);
        assert!((curvature / (-w * w * lag) - 1.0).norm() < 1e-4);
        assert!((d.gains(rate_hz)[0] - 1.0).abs() < 1e-9);
    }

    #[test]
    fn a_matrix_settles_within_its_poles() {
        let turn = |size: f64| vec![vec![size * 0.6, size * 0.8], vec![size * -0.8, size * 0.6]];
        assert!(
            settles(&turn(0.999), 1.0)
                && !settles(&turn(1.001), 1.0)
                && settles(&turn(1.001), 1.002)
        );
        assert!(settles(&[], 1.0));
    }
}
