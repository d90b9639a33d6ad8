//! The optimisers of the crate `basin` behind one function: a global start and a local finish.
//!
//! Parameters are parts of the way between their bounds, 0 .. 1, so that all of them have one
//! scale. Slopes are central differences, a probe on each thread.

use std::fmt;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};

use basin::{
    BoundedCmaEs, BoundedLevenbergMarquardt, BoxBounds, CauchyLoss, ConstraintDescription,
    ConstraintSet, ConstraintSolveError, Constraints, CostFunction, DenseMatrix, Executor,
    HuberLoss, Jacobian, LossFunction, PopulationProgress, Residual, RobustLeastSquares,
    SoftL1Loss, SquaredLoss, Termination, TrustRegionReflective,
};
use whippen_compiler::parallel;

/// How far a probe of a slope is from its point, as a part of the way between the bounds.
///
/// Events move by whole ticks, so a much shorter step would see their jumps alone.
const PROBE: f64 = 1e-4;

/// A local search takes so many steps at the most.
const STEPS_MAX: u64 = 200;

/// What is left of the cost from step to step when a search is over.
const COST_CHANGE: f64 = 1e-9;

/// How far a step still goes when a search is over, relative to where it is.
const STEP_CHANGE: f64 = 1e-7;

/// The width of the first generation, as a part of the way between the bounds.
const FIRST_WIDTH: f64 = 0.3;

/// What a residual costs, in units of the loss's scale.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Loss {
    /// Its square.
    #[default]
    Squares,
    /// Its square near 0, its size further out, smoothly.
    SoftL1,
    /// Its square up to the scale, its size beyond.
    Huber,
    /// Its logarithm: what lies far out hardly counts.
    Cauchy,
}

impl Loss {
    /// By name.
    pub const ALL: [(&'static str, Loss); 4] = [
        ("squares", Loss::Squares),
        ("soft-l1", Loss::SoftL1),
        ("huber", Loss::Huber),
        ("cauchy", Loss::Cauchy),
    ];

    fn function(self) -> &'static (dyn LossFunction + Sync) {
        match self {
            Loss::Squares => &SquaredLoss,
            Loss::SoftL1 => &SoftL1Loss,
            Loss::Huber => &HuberLoss,
            Loss::Cauchy => &CauchyLoss,
        }
    }

    /// The first and second derivative of what a residual costs: how it pulls, and how firmly.
    pub fn derivatives(self, residual: f64, scale: f64) -> (f64, f64) {
        let at = self.function().evaluate_scaled(residual, scale);
        (at.first_derivative, at.second_derivative)
    }
}

/// How a search goes downhill; both keep within the bounds.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Local {
    /// The trust-region reflective method (Branch, Coleman and Li 1999).
    #[default]
    TrustRegion,
    /// Levenberg-Marquardt with the same scaling by the distance to the bounds.
    LevenbergMarquardt,
}

impl Local {
    /// By name.
    pub const ALL: [(&'static str, Local); 2] = [
        ("trust-region", Local::TrustRegion),
        ("levenberg-marquardt", Local::LevenbergMarquardt),
    ];
}

/// How to search.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Search {
    /// How it goes downhill in the end.
    pub local: Local,
    /// What residuals cost.
    pub loss: Loss,
    /// Where a robust loss begins to be one, in units of the residuals.
    pub loss_scale: f64,
    /// So many generations of CMA-ES before the local search; 0 for none.
    pub generations: u64,
    /// Which random numbers they use.
    pub seed: u64,
}

/// How a search ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum End {
    /// The next step would change nothing that counts.
    Converged,
    /// The steps were used up, or no step was better: jumps, or noise of numbers.
    Stalled,
    /// Somebody stopped it.
    Interrupted,
}

/// What was found.
#[derive(Debug, Clone)]
pub struct Solution {
    /// Parts of the way between the bounds.
    pub at: Vec<f64>,
    /// Half the sum of what residuals cost.
    pub cost: f64,
    /// The residuals there.
    pub residuals: Vec<f64>,
    /// Their slopes there, one list for each parameter; empty after an interruption.
    pub slopes: Vec<Vec<f64>>,
    /// How often residuals were computed.
    pub evaluations: usize,
    /// How it ended.
    pub end: End,
}

/// The residuals at a point; none where they cannot be computed.
pub type Residuals<'a> = dyn Fn(&[f64]) -> Option<Vec<f64>> + Sync + 'a;

/// Looks for the point at which residuals cost least, from a start. `stopped` ends it; the best so
/// far is then the answer. `progress` is told how often residuals were computed, and the least
/// cost.
///
/// # Errors
/// Residuals cannot be computed at the start.
pub fn solve(
    start: &[f64],
    residuals: &Residuals,
    search: &Search,
    stopped: &AtomicBool,
    progress: &(dyn Fn(usize, f64) + Sync),
) -> Result<Solution, NoStart> {
    let first = residuals(start).ok_or(NoStart)?;
    let rows = first.len();
    let problem = Problem {
        residuals,
        rows,
        search,
        stopped,
        progress,
        evaluations: AtomicUsize::new(0),
        best: Mutex::new(None),
        low: vec![0.0; start.len()],
        high: vec![1.0; start.len()],
    };
    problem.keep(start, &first);
    let end = problem.search_from(start);
    let slopes = match end {
        End::Interrupted => Vec::new(),
        _ => problem.slopes(&problem.best().at).unwrap_or_default(),
    };
    let evaluations = problem.evaluations.load(Ordering::Relaxed);
    let best = problem.best();
    Ok(Solution {
        at: best.at,
        cost: best.cost,
        residuals: best.residuals,
        slopes,
        evaluations,
        end,
    })
}

/// Residuals cannot be computed where a search begins.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct NoStart;

/// Somebody stopped the search.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Stopped;

impl fmt::Display for Stopped {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("stopped")
    }
}

impl std::error::Error for Stopped {}

#[derive(Clone)]
struct Best {
    at: Vec<f64>,
    cost: f64,
    residuals: Vec<f64>,
}

struct Problem<'a> {
    residuals: &'a Residuals<'a>,
    rows: usize,
    search: &'a Search,
    stopped: &'a AtomicBool,
    progress: &'a (dyn Fn(usize, f64) + Sync),
    evaluations: AtomicUsize,
    best: Mutex<Option<Best>>,
    low: Vec<f64>,
    high: Vec<f64>,
}

impl Problem<'_> {
    fn search_from(&self, start: &[f64]) -> End {
        if self.search.generations > 0 && self.generations(start).is_err() {
            return End::Interrupted;
        }
        self.local()
    }

    /// Generations around the start, all members on all threads.
    fn generations(&self, start: &[f64]) -> Result<(), ConstraintSolveError<Stopped>> {
        let solver = BoundedCmaEs::<Vec<f64>, DenseMatrix>::new(self.search.seed, FIRST_WIDTH);
        let progress = PopulationProgress::<Vec<f64>>::from_point(start.to_vec());
        let executor = Executor::new(self, solver, progress);
        executor.max_iter(self.search.generations).run().map(|_| ())
    }

    /// From the best point downhill.
    fn local(&self) -> End {
        let robust = RobustLeastSquares::new(self, self.search.loss.function())
            .with_scale(self.search.loss_scale);
        let start = self.best().at;
        let termination = match self.search.local {
            Local::TrustRegion => {
                let solver = TrustRegionReflective::new()
                    .with_relative_cost_change_tolerance(COST_CHANGE)
                    .with_relative_step_tolerance(STEP_CHANGE);
                let executor = Executor::from_start(robust, solver, start);
                let ended = executor.max_iter(STEPS_MAX).run();
                ended.map(|result| result.report.termination).ok()
            }
            Local::LevenbergMarquardt => {
                let solver = BoundedLevenbergMarquardt::new()
                    .with_relative_cost_change_tolerance(COST_CHANGE)
                    .with_relative_step_tolerance(STEP_CHANGE);
                let executor = Executor::from_start(robust, solver, start);
                let ended = executor.max_iter(STEPS_MAX).run();
                ended.map(|result| result.report.termination).ok()
            }
        };
        match termination {
            None => End::Interrupted,
            Some(Termination::Converged(_)) => End::Converged,
            Some(_) => End::Stalled,
        }
    }

    fn best(&self) -> Best {
        let best = self.best.lock().unwrap_or_else(PoisonError::into_inner);
        best.clone().unwrap_or(Best {
            at: Vec::new(),
            cost: f64::INFINITY,
            residuals: Vec::new(),
        })
    }

    /// Residuals at a point, counted; NaN where they cannot be computed.
    fn at(&self, point: &[f64]) -> Result<Vec<f64>, Stopped> {
        if self.stopped.load(Ordering::Relaxed) {
            return Err(Stopped);
        }
        let found = (self.residuals)(point).filter(|found| found.len() == self.rows);
        if let Some(found) = &found {
            self.keep(point, found);
        }
        let done = 1 + self.evaluations.fetch_add(1, Ordering::Relaxed);
        (self.progress)(done, self.best().cost);
        Ok(found.unwrap_or_else(|| vec![f64::NAN; self.rows]))
    }

    /// Of equally good points the one that comes first in order of values is kept, whichever
    /// thread found it first.
    fn keep(&self, point: &[f64], residuals: &[f64]) {
        let cost = self.total(residuals);
        let mut best = self.best.lock().unwrap_or_else(PoisonError::into_inner);
        let is_better = match &*best {
            None => true,
            Some(best) => cost < best.cost || (cost == best.cost && point < &best.at[..]),
        };
        if is_better {
            *best = Some(Best {
                at: point.to_vec(),
                cost,
                residuals: residuals.to_vec(),
            });
        }
    }

    fn total(&self, residuals: &[f64]) -> f64 {
        let loss = self.search.loss.function();
        let one = |r: &f64| loss.evaluate_scaled(*r, self.search.loss_scale).value;
        residuals.iter().map(one).sum()
    }

    /// The slopes of all residuals, one list for each parameter.
    fn slopes(&self, point: &[f64]) -> Result<Vec<Vec<f64>>, Stopped> {
        let probe = |parameter: usize, way: f64| {
            let mut probe = point.to_vec();
            probe[parameter] = (probe[parameter] + way).clamp(0.0, 1.0);
            probe
        };
        let parameters = 0..point.len();
        let both = |p: usize| [probe(p, -PROBE), probe(p, PROBE)];
        let probes: Vec<Vec<f64>> = parameters.clone().flat_map(both).collect();
        let found = parallel::map(probes.clone(), |probe| self.at(&probe));
        let found = found.into_iter().collect::<Result<Vec<_>, _>>()?;
        let slope = |p: usize| {
            let width = probes[2 * p + 1][p] - probes[2 * p][p];
            let pairs = found[2 * p].iter().zip(&found[2 * p + 1]);
            pairs
                .map(|(below, above)| (above - below) / width)
                .collect()
        };
        Ok(parameters.map(slope).collect())
    }
}

impl Constraints for &Problem<'_> {
    type Set = ConstraintSet<BoxBounds<Vec<f64>>>;

    fn constraints(&self) -> <Self::Set as ConstraintDescription>::Borrowed<'_> {
        let bounds = BoxBounds::new(Some(&self.low), Some(&self.high));
        ConstraintSet::new().with_bounds(bounds)
    }
}

impl CostFunction for &Problem<'_> {
    type Param = Vec<f64>;
    type Output = f64;
    type Error = Stopped;

    fn cost(&self, point: &Vec<f64>) -> Result<f64, Stopped> {
        let total = self.total(&self.at(point)?);
        Ok(if total.is_nan() { f64::INFINITY } else { total })
    }
}

impl Residual for &Problem<'_> {
    type Param = Vec<f64>;
    type Output = Vec<f64>;
    type Error = Stopped;

    fn residual(&self, point: &Vec<f64>) -> Result<Vec<f64>, Stopped> {
        self.at(point)
    }
}

impl Jacobian for &Problem<'_> {
    type Jacobian = DenseMatrix;

    fn jacobian(&self, point: &Vec<f64>) -> Result<DenseMatrix, Stopped> {
        let slopes = self.slopes(point)?;
        let rows = (0..self.rows).flat_map(|row| slopes.iter().map(move |slope| slope[row]));
        let rows: Vec<f64> = rows.collect();
        Ok(DenseMatrix::from_row_slice(self.rows, point.len(), &rows))
    }
}
