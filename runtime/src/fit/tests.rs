//! The optimisers beside scipy on the same problems: `tests/problems.py` made `tests/scipy.txt`.

use std::sync::atomic::AtomicBool;

use super::solve::{End, Local, Loss, Search, solve};
use super::statistics::Evidence;

const SCIPY: &str = include_str!("tests/scipy.txt");
const ROWS: usize = 60;

/// White, -1 .. 1: the upper bits of a congruential generator.
fn noise() -> impl Iterator<Item = f64> {
    let mut word = 1u64;
    std::iter::from_fn(move || {
        word = word
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        Some((word >> 33) as f64 / f64::from(1 << 30) - 1.0)
    })
}

type Function = fn(&[f64], f64) -> f64;

fn decay(x: &[f64], t: f64) -> f64 {
    x[0] * (-x[1] * t).exp() + x[2]
}

fn sine(x: &[f64], t: f64) -> f64 {
    x[0] * (x[1] * t + x[2]).sin()
}

struct Task {
    model: Function,
    data: Vec<f64>,
    bounds: [(f64, f64); 3],
}

impl Task {
    fn named(name: &str) -> Task {
        let (model, truth, size): (Function, _, _) = match name {
            "sine" => (sine, [1.4, 12.3, 0.4], 0.2),
            _ => (decay, [2.5, 1.3, 0.5], 0.1),
        };
        let outlier = |row: usize| match name == "outliers" && row % 11 == 5 {
            true => 2.0,
            false => 0.0,
        };
        let measured = |(row, noise): (usize, f64)| {
            model(&truth, row as f64 / 12.0) + size * noise + outlier(row)
        };
        Task {
            model,
            data: noise().take(ROWS).enumerate().map(measured).collect(),
            bounds: match name {
                "sine" => [(0.1, 3.0), (1.0, 20.0), (-3.0, 3.0)],
                "bound" => [(0.0, 5.0), (0.1, 3.0), (-1.0, 0.2)],
                _ => [(0.0, 5.0), (0.1, 3.0), (-1.0, 1.0)],
            },
        }
    }

    fn residuals(&self, at: &[f64]) -> Option<Vec<f64>> {
        let values = self.bounds.iter().zip(at);
        let x: Vec<f64> = values
            .map(|((low, high), u)| low + u * (high - low))
            .collect();
        let rows = self.data.iter().enumerate();
        Some(
            rows.map(|(row, y)| (self.model)(&x, row as f64 / 12.0) - y)
                .collect(),
        )
    }
}

fn search(loss: &str) -> Search {
    Search {
        local: Local::TrustRegion,
        loss: match loss {
            "soft_l1" => Loss::SoftL1,
            "huber" => Loss::Huber,
            "cauchy" => Loss::Cauchy,
            _ => Loss::Squares,
        },
        loss_scale: 0.1,
        generations: 0,
        seed: 1,
    }
}

#[test]
fn scipy_finds_the_same() {
    finds_what_scipy_finds(Local::TrustRegion, 1e-6, 2e-5);
}

#[test]
fn scipy_finds_what_levenberg_and_marquardt_do() {
    finds_what_scipy_finds(Local::LevenbergMarquardt, 1e-6, 1e-4);
}

/// All problems of `scipy.txt`: costs within a part of them, places within a part of the way
/// between the bounds.
fn finds_what_scipy_finds(local: Local, cost_part: f64, place: f64) {
    let mut problems = 0;
    for line in SCIPY.lines().filter(|line| !line.starts_with('#')) {
        let words: Vec<&str> = line.split(' ').collect();
        let numbers: Vec<f64> = words[2..]
            .iter()
            .map(|w| w.parse().expect("a number"))
            .collect();
        let (cost, at, widths) = (numbers[0], &numbers[1..4], &numbers[4..7]);
        let task = Task::named(words[0]);
        let search = Search {
            generations: if words[0] == "sine" { 60 } else { 0 },
            local,
            ..search(words[1])
        };
        let residuals = |at: &[f64]| task.residuals(at);
        let never = AtomicBool::new(false);
        let found = solve(&[0.5; 3], &residuals, &search, &never, &|_, _| {}).expect("a start");
        // Levenberg-Marquardt comes to a bound by ever shorter steps and does not say that it is
        // there.
        let is_slow = local == Local::LevenbergMarquardt && words[0] == "bound";
        let end = if is_slow {
            End::Stalled
        } else {
            End::Converged
        };
        assert_eq!(found.end, end, "{line}");
        assert!(
            (found.cost / cost - 1.0).abs() < cost_part,
            "{line}: {}",
            found.cost
        );
        for (own, theirs) in found.at.iter().zip(at) {
            assert!((own - theirs).abs() < place, "{line}: {:?}", found.at);
        }
        let rows = 0..ROWS;
        let evidence = Evidence {
            slopes: &found.slopes,
            pulls: &found.residuals,
            curvatures: &[1.0; ROWS],
            columns: std::slice::from_ref(&rows),
        };
        for (own, theirs) in evidence.judge().half_width.iter().zip(widths) {
            let own = own.expect("shown");
            // Neighbours of this noise do not correlate.
            assert!(
                *theirs == 0.0 || (own / theirs - 1.0).abs() < 0.02,
                "{line}: {own}"
            );
        }
        problems += 1;
    }
    assert_eq!(problems, 7);
}

#[test]
fn a_search_from_afar_needs_generations() {
    let task = Task::named("sine");
    let residuals = |at: &[f64]| task.residuals(at);
    let never = AtomicBool::new(false);
    let cost = |generations| {
        let search = Search {
            generations,
            ..search("linear")
        };
        let found = solve(&[0.5; 3], &residuals, &search, &never, &|_, _| {});
        found.expect("a start").cost
    };
    assert!(cost(0) > 10.0 * cost(60));
}

#[test]
fn the_best_so_far_is_kept_when_it_is_stopped() {
    let task = Task::named("decay");
    let stopped = AtomicBool::new(false);
    let residuals = |at: &[f64]| task.residuals(at);
    let stop = |runs: usize, _: f64| {
        stopped.store(runs >= 9, std::sync::atomic::Ordering::Relaxed);
    };
    let found = solve(&[0.5; 3], &residuals, &search("linear"), &stopped, &stop).expect("a start");
    assert_eq!(found.end, End::Interrupted);
    let first: f64 = task
        .residuals(&[0.5; 3])
        .expect("numbers")
        .iter()
        .map(|r| r * r / 2.0)
        .sum();
    assert!(found.cost < first && found.evaluations < 20, "{found:?}");
}
