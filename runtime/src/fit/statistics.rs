//! What data say of fitted parameters: confidence, correlation, and what they do not show.
//!
//! The covariance is that of an M-estimator with columns of unlike noise,
//!
//! ```text
//!   C = A^-1 N A^-1,   A = sum over columns of b_c G_c,   N = sum of v_c t_c G_c,   G_c = J_c' J_c
//! ```
//!
//! with the mean curvature b_c of what the residuals of a column cost, the mean square v_c of its
//! slope, and t_c = (1 + r)/(1 - r) where neighbours correlate by r: rows that repeat each other
//! count less. Of least squares it is the textbook's s^2 (J' J)^-1. It holds for small errors of a
//! model that is right; where the model itself is wrong, intervals say too much.

use std::ops::Range;

use basin::{DenseMatrix, SymmetricEigen};

/// Neighbouring residuals are taken to correlate by no more than this.
const CORRELATION_MAX: f64 = 0.99;

/// Directions whose scaled information is below this part of the greatest are not shown at all.
const FLAT: f64 = 1e-9;

/// A component of a flat direction that counts.
const IN_DIRECTION: f64 = 0.1;

/// A loss that falls away may bend the wrong way far out; a column as a whole is taken to have at
/// least this curvature.
const CURVATURE_MIN: f64 = 1e-6;

type Matrix = Vec<Vec<f64>>;

/// What data say of the parameters, in parts of the way between their bounds.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Judged {
    /// Half the width of the interval of 95 % confidence; none where nothing is shown of it alone.
    pub half_width: Vec<Option<f64>>,
    /// How the errors of two parameters go together, -1 .. 1; 0 where one of them is not shown.
    pub correlation: Vec<Vec<f64>>,
    /// Sets of parameters which could all change together without a trace in the data.
    pub flat: Vec<Vec<usize>>,
}

/// Residuals at the best point, by column of a recording.
pub struct Evidence<'a> {
    /// Slopes of the residuals, one list for each parameter.
    pub slopes: &'a [Vec<f64>],
    /// The slope of what each residual costs; in least squares the residual itself.
    pub pulls: &'a [f64],
    /// Its curvature; in least squares 1.
    pub curvatures: &'a [f64],
    /// Which of them belong to one column.
    pub columns: &'a [Range<usize>],
}

impl Evidence<'_> {
    /// Judges what is known.
    pub fn judge(&self) -> Judged {
        let all = self.slopes.len();
        let freedom = self.pulls.len().saturating_sub(all).max(1) as f64;
        let (information, noise) = self.sums(self.pulls.len() as f64 / freedom);
        let shown: Vec<usize> = (0..all)
            .filter(|p| noise[*p][*p].sqrt() < information[*p][*p])
            .collect();
        let mut out = Judged {
            half_width: vec![None; all],
            correlation: vec![vec![0.0; all]; all],
            flat: Vec::new(),
        };
        let Some((inverse, flat)) = inverse_of(&information, &shown) else {
            return out;
        };
        out.flat = flat;
        let covariance = between(&inverse, &noise, &shown);
        let quantile = student(freedom);
        let is_flat = |p: usize| out.flat.iter().any(|set| set.contains(&p));
        for (i, &p) in shown.iter().enumerate() {
            if !is_flat(p) {
                out.half_width[p] = Some(quantile * covariance[i][i].sqrt());
            }
            for (j, &q) in shown.iter().enumerate() {
                let size = (covariance[i][i] * covariance[j][j]).sqrt();
                let known = size > 0.0;
                out.correlation[p][q] = if known { covariance[i][j] / size } else { 0.0 };
            }
        }
        out
    }

    /// The sums over columns: information, and noise.
    fn sums(&self, share: f64) -> (Matrix, Matrix) {
        let zero = || vec![vec![0.0; self.slopes.len()]; self.slopes.len()];
        let (mut information, mut noise) = (zero(), zero());
        for column in self.columns.iter().filter(|column| !column.is_empty()) {
            let rows = column.len() as f64;
            let pulls = &self.pulls[column.clone()];
            let square = pulls.iter().map(|pull| pull * pull).sum::<f64>() / rows;
            let mean = self.curvatures[column.clone()].iter().sum::<f64>() / rows;
            let own = self.gram(column.clone());
            add(&mut information, mean.max(CURVATURE_MIN), &own);
            add(&mut noise, share * square * repetition(pulls), &own);
        }
        (information, noise)
    }

    /// J' J of some rows.
    fn gram(&self, rows: Range<usize>) -> Matrix {
        let entry = |a: &Vec<f64>, b: &Vec<f64>| rows.clone().map(|r| a[r] * b[r]).sum();
        let row = |a| self.slopes.iter().map(|b| entry(a, b)).collect();
        self.slopes.iter().map(row).collect()
    }
}

fn add(to: &mut Matrix, factor: f64, own: &Matrix) {
    for (row, own) in to.iter_mut().zip(own) {
        for (cell, own) in row.iter_mut().zip(own) {
            *cell += factor * own;
        }
    }
}

/// (1 + r)/(1 - r), r being the correlation of neighbours.
fn repetition(pulls: &[f64]) -> f64 {
    let power: f64 = pulls.iter().map(|r| r * r).sum();
    let neighbours: f64 = pulls.windows(2).map(|pair| pair[0] * pair[1]).sum();
    let r = if power > 0.0 { neighbours / power } else { 0.0 };
    let r = r.clamp(0.0, CORRELATION_MAX);
    (1.0 + r) / (1.0 - r)
}

type Inverse = (Matrix, Vec<Vec<usize>>);

/// The inverse of the information on what is shown, without its flat directions, and these.
fn inverse_of(information: &[Vec<f64>], shown: &[usize]) -> Option<Inverse> {
    let n = shown.len();
    if n == 0 {
        return None;
    }
    let size = |i: usize| information[shown[i]][shown[i]].sqrt();
    let scaled = |i: usize, j: usize| information[shown[i]][shown[j]] / (size(i) * size(j));
    let (vectors, values) = DenseMatrix::from_fn(n, n, scaled).try_eigh().ok()?;
    let greatest = values.iter().copied().fold(0.0, f64::max);
    let is_flat = |k: &usize| values[*k] <= FLAT * greatest;
    let members = |k: usize| {
        let counts = (0..n).filter(|i| vectors.get(*i, k).abs() > IN_DIRECTION);
        counts.map(|i| shown[i]).collect()
    };
    let flat = (0..n).filter(is_flat).map(members).collect();
    let kept: Vec<usize> = (0..n).filter(|k| !is_flat(k)).collect();
    let entry = |i: usize, j: usize| {
        let part = |k: &usize| vectors.get(i, *k) * vectors.get(j, *k) / values[*k];
        kept.iter().map(part).sum::<f64>() / (size(i) * size(j))
    };
    let row = |i| (0..n).map(|j| entry(i, j)).collect();
    Some(((0..n).map(row).collect(), flat))
}

/// inverse * noise * inverse, on what is shown.
fn between(inverse: &[Vec<f64>], noise: &[Vec<f64>], shown: &[usize]) -> Vec<Vec<f64>> {
    let n = shown.len();
    let product = |left: &dyn Fn(usize, usize) -> f64, right: &dyn Fn(usize, usize) -> f64| {
        let entry = |i, j| (0..n).map(|k| left(i, k) * right(k, j)).sum();
        let row = |i| (0..n).map(|j| entry(i, j)).collect();
        (0..n).map(row).collect::<Vec<Vec<f64>>>()
    };
    let half = product(&|i, k| inverse[i][k], &|k, j| noise[shown[k]][shown[j]]);
    product(&|i, k| half[i][k], &|k, j| inverse[k][j])
}

/// The 97.5 % quantile of Student's distribution, by the first term of Cornish and Fisher's
/// expansion.
fn student(freedom: f64) -> f64 {
    const NORMAL: f64 = 1.959_964;
    NORMAL + (NORMAL.powi(3) + NORMAL) / (4.0 * freedom)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn judged(slopes: &[Vec<f64>], residuals: &[f64]) -> Judged {
        let rows = 0..residuals.len();
        let evidence = Evidence {
            slopes,
            pulls: residuals,
            curvatures: &vec![1.0; residuals.len()],
            columns: std::slice::from_ref(&rows),
        };
        evidence.judge()
    }

    /// Residuals of size 1 that do not repeat each other.
    fn noise(rows: usize) -> Vec<f64> {
        let word = |row: usize| (row as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 63;
        (0..rows)
            .map(|row| if word(row) == 0 { 1.0 } else { -1.0 })
            .collect()
    }

    #[test]
    fn a_mean_is_known_by_the_root_of_the_count() {
        let rows = 400;
        let found = judged(&[vec![-10.0; rows]], &noise(rows));
        let width = found.half_width[0].expect("shown");
        let wanted = 1.96 / (10.0 * (rows as f64).sqrt());
        assert!((width / wanted - 1.0).abs() < 0.1, "{width} {wanted}");
    }

    #[test]
    fn what_changes_nothing_is_not_shown() {
        let rows = 100;
        let found = judged(&[vec![50.0; rows], vec![0.0; rows]], &noise(rows));
        assert!(found.half_width[0].is_some() && found.half_width[1].is_none());
        assert!(found.flat.is_empty());
    }

    #[test]
    fn two_that_do_the_same_are_flat_and_two_that_nearly_do_correlate() {
        let rows = 100;
        let one = vec![50.0; rows];
        let found = judged(&[one.clone(), one.clone()], &noise(rows));
        assert_eq!(found.flat, [vec![0, 1]]);
        assert_eq!(found.half_width, [None, None]);
        let near: Vec<f64> = (0..rows).map(|row| 50.0 + (row % 2) as f64).collect();
        let found = judged(&[one, near], &noise(rows));
        assert!(found.flat.is_empty());
        assert!(found.correlation[0][1] < -0.99, "{:?}", found.correlation);
    }

    #[test]
    fn rows_that_repeat_each_other_count_less() {
        let rows = 400;
        let slow: Vec<f64> = (0..rows)
            .map(|row| if row / 40 % 2 == 0 { 1.0 } else { -1.0 })
            .collect();
        let slopes = [vec![-10.0; rows]];
        let [fast, slow] = [&noise(rows), &slow].map(|r| judged(&slopes, r).half_width[0]);
        assert!(slow.expect("shown") > 4.0 * fast.expect("shown"));
    }
}
