//! Piecewise cubic interpolation that keeps monotone data monotone (Fritsch and Carlson 1980, with
//! the three-point end slopes and weighted harmonic means of Fritsch and Butland 1984).
//!
//! It passes through every knot, has a continuous slope and never overshoots: a calibration table
//! stays invertible and a held key stays held.

use whippen_compiler::model::table::monotone_slopes;

/// Interpolates through points with increasing abscissae.
#[derive(Debug, Clone, PartialEq)]
pub struct Pchip {
    x: Vec<f64>,
    y: Vec<f64>,
    slope: Vec<f64>,
}

impl Pchip {
    /// Through the points `(x, y)`; `None` unless there are at least two, all finite, with strictly
    /// increasing `x`.
    pub fn new(x: Vec<f64>, y: Vec<f64>) -> Option<Pchip> {
        let ordered =
            x.windows(2).all(|w| w[0] < w[1]) && x.iter().chain(&y).all(|v| v.is_finite());
        if x.len() < 2 || x.len() != y.len() || !ordered {
            return None;
        }
        let width: Vec<f64> = x.windows(2).map(|w| w[1] - w[0]).collect();
        let secant: Vec<f64> = y
            .windows(2)
            .zip(&width)
            .map(|(w, h)| (w[1] - w[0]) / h)
            .collect();
        let slope = monotone_slopes(&width, &secant);
        Some(Pchip { x, y, slope })
    }

    /// The first and the last abscissa.
    pub fn domain(&self) -> (f64, f64) {
        (self.x[0], self.x[self.x.len() - 1])
    }

    /// The value at `x`; beyond the ends the value at the end.
    pub fn at(&self, x: f64) -> f64 {
        let i = self
            .x
            .partition_point(|&knot| knot <= x)
            .clamp(1, self.x.len() - 1)
            - 1;
        self.in_interval(i, x)
    }

    /// The values at increasing abscissae, in one pass over the knots.
    pub fn sweep(&self, at: impl Iterator<Item = f64>) -> impl Iterator<Item = f64> {
        let mut i = 0;
        at.map(move |x| {
            while i + 2 < self.x.len() && self.x[i + 1] <= x {
                i += 1;
            }
            self.in_interval(i, x)
        })
    }

    fn in_interval(&self, i: usize, x: f64) -> f64 {
        let width = self.x[i + 1] - self.x[i];
        let u = ((x - self.x[i]) / width).clamp(0.0, 1.0);
        let rise = self.y[i + 1] - self.y[i];
        let (left, right) = (self.slope[i] * width, self.slope[i + 1] * width);
        self.y[i]
            + u * (left + u * ((3.0 * rise - 2.0 * left - right) + u * (left + right - 2.0 * rise)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn passes_through_knots_and_keeps_monotone_data_monotone() {
        let x = vec![
            0.0, 0.0015, 0.0035, 0.0064, 0.0115, 0.0165, 0.057, 0.145, 0.57, 1.0,
        ];
        let y = vec![
            0.0, 0.794, 1.587, 2.381, 3.175, 3.969, 6.35, 7.938, 10.319, 11.906,
        ];
        let p = Pchip::new(x.clone(), y.clone()).unwrap();
        assert!(x.iter().zip(&y).all(|(&x, &y)| (p.at(x) - y).abs() < 1e-12));
        let dense: Vec<f64> = (0..=10_000)
            .map(|i| p.at(f64::from(i) / 10_000.0))
            .collect();
        assert!(dense.windows(2).all(|w| w[1] > w[0]));
        let swept: Vec<f64> = p
            .sweep((0..=10_000).map(|i| f64::from(i) / 10_000.0))
            .collect();
        assert_eq!(swept, dense);
        assert_eq!((p.at(-1.0), p.at(2.0)), (0.0, 11.906));
    }

    #[test]
    fn straight_lines_are_exact_and_smooth_curves_close() {
        let p = Pchip::new(vec![0.0, 1.0, 3.0], vec![1.0, 3.0, 7.0]).unwrap();
        assert!((p.at(0.3) - 1.6).abs() < 1e-15 && (p.at(2.9) - 6.8).abs() < 1e-14);
        let knots: Vec<f64> = (0..=50).map(|i| f64::from(i) * 0.02).collect();
        let p = Pchip::new(knots.clone(), knots.iter().map(|x| x.exp()).collect()).unwrap();
        let worst = (0..1000)
            .map(|i| f64::from(i) / 1000.0)
            .map(|x| (p.at(x) - x.exp()).abs())
            .fold(0.0, f64::max);
        assert!(worst < 1e-5, "{worst}");
    }

    #[test]
    fn agrees_with_scipy() {
        // scipy.interpolate.PchipInterpolator([0, 1, 3, 4, 9], [0, 2, 3, 7, 7.5])([0.25, 2, 3.5, 5,
        // 8])
        let p = Pchip::new(vec![0.0, 1.0, 3.0, 4.0, 9.0], vec![0.0, 2.0, 3.0, 7.0, 7.5]).unwrap();
        let expected = [0.62388393, 2.47104247, 5.09069379, 7.21035052, 7.48758763];
        for (x, y) in [0.25, 2.0, 3.5, 5.0, 8.0].into_iter().zip(expected) {
            assert!((p.at(x) - y).abs() < 1e-8, "{x}: {} for {y}", p.at(x));
        }
    }

    #[test]
    fn refuses_what_is_no_function() {
        assert_eq!(Pchip::new(vec![0.0], vec![0.0]), None);
        assert_eq!(Pchip::new(vec![0.0, 0.0], vec![0.0, 1.0]), None);
        assert_eq!(Pchip::new(vec![0.0, f64::NAN], vec![0.0, 1.0]), None);
        assert_eq!(Pchip::new(vec![0.0, 1.0], vec![0.0, f64::INFINITY]), None);
        assert_eq!(Pchip::new(vec![0.0, 1.0], vec![0.0]), None);
    }
}
