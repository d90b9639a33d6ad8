//! What a fit found, judged: confidence, what is left, what recordings say that were not fitted.

use whippen_compiler::pipeline::Compiled;
use whippen_runtime::engine::EngineKind;
use whippen_runtime::fit::data::FitData;
use whippen_runtime::fit::residuals::{self, ResidualPart};
use whippen_runtime::fit::solve::{End, Solution};
use whippen_runtime::fit::statistics::{Evidence, Judged};
use whippen_runtime::fit::strokes::{StrokePair, StrokeVerdict};

use super::Fit;

/// A parameter is at its bound when it is so near, as a part of the way between them.
const AT_BOUND: f64 = 1e-4;

/// Solution values and what is to be said of them.
pub struct Fitted {
    /// Parts of the way between the bounds, before and after.
    pub start: Vec<f64>,
    pub at: Vec<f64>,
    pub judged: Judged,
    /// What is left of each part, in units of its spread: before, after, and in fixed point.
    pub left: Vec<Left>,
    /// The same of what was held out.
    pub held_out: Vec<Left>,
    /// Strokes like for like, in fixed point: fitted, and held out.
    pub strokes: [Vec<(String, StrokePair)>; 2],
    /// How often the instrument was played.
    pub runs: usize,
    pub end: End,
}

/// Roots of the mean squares of a part's residuals, without weights.
#[derive(Debug, Clone, PartialEq)]
pub struct Left {
    /// The recording's name.
    pub recording: String,
    pub title: String,
    /// What 1 is (SI); none for events.
    pub unit: Option<f64>,
    pub before: Option<f64>,
    pub after: Option<f64>,
    /// With the arithmetic of the chip.
    pub fixed_point: Option<f64>,
}

impl Fitted {
    pub fn new(fit: &Fit, start: &[f64], found: Solution) -> Fitted {
        let (loss, scale) = fit.args.loss;
        let cost = found.residuals.iter().map(|r| loss.derivatives(*r, scale));
        let (pulls, curvatures): (Vec<f64>, Vec<f64>) = cost.unzip();
        let columns: Vec<_> = fit.parts.iter().map(|part| part.rows.clone()).collect();
        let evidence = Evidence {
            slopes: &found.slopes,
            pulls: &pulls,
            curvatures: &curvatures,
            columns: &columns,
        };
        let judged = match found.slopes.is_empty() {
            true => Judged::default(),
            false => evidence.judge(),
        };
        let [before, after] = [start, &found.at].map(|point| fit.compiled(point).ok());
        let left = |data: &[FitData], parts: &[ResidualPart]| {
            let of = |compiled: &Option<Compiled>, engine| {
                fit.of(compiled.as_ref()?, engine, data, parts)
            };
            let all = [
                of(&before, fit.args.engine),
                of(&after, fit.args.engine),
                of(&after, EngineKind::Jit),
            ];
            let all = all.map(|all| all.map(|all| all.concat()));
            let one = |part: &ResidualPart| Left {
                recording: data[part.recording].name.clone(),
                title: part.title.clone(),
                unit: part.unit,
                before: rms(all[0].as_deref(), part),
                after: rms(all[1].as_deref(), part),
                fixed_point: rms(all[2].as_deref(), part),
            };
            parts.iter().map(one).collect::<Vec<Left>>()
        };
        let strokes = [&fit.data, &fit.held_out].map(|data| {
            after
                .as_ref()
                .map_or_else(Vec::new, |c| fit.strokes(c, data))
        });
        Fitted {
            strokes,
            left: left(&fit.data, &fit.parts),
            held_out: left(&fit.held_out, &residuals::parts(&fit.held_out)),
            start: start.to_vec(),
            at: found.at,
            judged,
            runs: found.evaluations,
            end: found.end,
        }
    }

    /// What holds of all strokes.
    pub fn verdict(&self) -> Option<StrokeVerdict> {
        let [fitted, others] = self
            .strokes
            .each_ref()
            .map(|all| all.iter().map(|(_, compared)| compared).collect::<Vec<_>>());
        StrokeVerdict::of(&fitted, &others)
    }

    /// Whether a parameter is at one of its bounds.
    pub fn is_at_bound(&self, parameter: usize) -> bool {
        let at = self.at[parameter];
        !(AT_BOUND..=1.0 - AT_BOUND).contains(&at)
    }

    /// Whether the data say anything of a parameter: less than its whole range.
    pub fn is_shown(&self, parameter: usize) -> bool {
        let width = self.judged.half_width.get(parameter);
        width.is_some_and(|width| width.is_some_and(|width| width < 1.0))
    }
}

/// Root of the mean square of a part without its weight.
fn rms(all: Option<&[f64]>, part: &ResidualPart) -> Option<f64> {
    let own = all?.get(part.rows.clone())?;
    let square: f64 = own.iter().map(|r| r * r).sum();
    Some((square / own.len().max(1) as f64).sqrt() / part.weight)
}
