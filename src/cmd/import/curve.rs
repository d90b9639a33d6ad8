//! What becomes of a recording: its glitches out, as few knots as a tolerance allows, and between
//! the branches a transition as long as the recording allows.

use super::recording::{GRAM_N, Point, Recording, at};

/// Knots may leave out what changes the branch by no more (N).
const TOLERANCE_N: f64 = 0.25 * GRAM_N;
/// A glitch is off by more (N) than its neighbours, of which so many on either side are asked.
const GLITCH_N: f64 = 6.0 * GRAM_N;
const NEIGHBOURS: usize = 4;
/// So many neighbouring points are one glitch at most.
const GLITCH_POINTS: usize = 3;
/// Lengths of the transition (m), the longest first.
const TRANSITIONS_M: &[f64] = &[0.2e-3, 0.1e-3, 0.05e-3, 0.02e-3, 0.01e-3, 0.005e-3];
/// How far (N) a loop may be from the recording for the sake of a longer transition.
const LOOP_N: f64 = 0.6 * GRAM_N;

/// A reading that is no part of the curve, and what its neighbours say.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Glitch {
    pub pressed: bool,
    pub x_m: f64,
    pub force_n: f64,
    pub instead_n: f64,
}

/// A recording as a program tells it.
#[derive(Debug, Clone, PartialEq)]
pub struct Curve {
    /// Knots of both branches.
    pub press: Vec<Point>,
    pub back: Vec<Point>,
    /// How far a key turns back before it is on the other branch (m).
    pub give_m: f64,
    /// How far the loop is from the recording, glitches aside (N rms).
    pub rms_n: f64,
    pub glitches: Vec<Glitch>,
    /// Stiffness (N/m) and force at the beginning (N), if it is a bare spring.
    pub spring: Option<[f64; 2]>,
}

/// Makes a curve of a recording.
pub fn of(recording: &Recording) -> Curve {
    let (cleaned, glitches) = cleaned(recording);
    let [low, high] = cleaned.travel_m();
    let cut = |branch: &[Point]| {
        let mut kept: Vec<Point> = branch.to_vec();
        kept.retain(|point| (low..=high).contains(&point.0));
        knots(&kept)
    };
    let (press, back) = (cut(&cleaned.press), cut(&cleaned.back));
    let rms = |give_m: &f64| (*give_m, loop_rms(&cleaned, &press, &back, *give_m));
    let all: Vec<(f64, f64)> = TRANSITIONS_M.iter().map(rms).collect();
    let near = all.iter().find(|(_, rms)| *rms <= LOOP_N);
    let nearest = all.iter().reduce(|a, b| if b.1 < a.1 { b } else { a });
    let (give_m, rms_n) = near.or(nearest).copied().unwrap_or((1e-5, 0.0));
    Curve {
        spring: bare_spring(&cleaned),
        press,
        back,
        give_m,
        rms_n,
        glitches,
    }
}

/// A recording with its glitches replaced, and what they were.
pub fn cleaned(recording: &Recording) -> (Recording, Vec<Glitch>) {
    let mut cleaned = recording.clone();
    let mut glitches = Vec::new();
    for (branch, pressed) in [(&mut cleaned.press, true), (&mut cleaned.back, false)] {
        glitches.extend(without_glitches(branch, pressed));
    }
    (cleaned, glitches)
}

/// Replaces glitches by what lies between their neighbours: a few points that stand off, where both
/// sides agree.
fn without_glitches(branch: &mut [Point], pressed: bool) -> Vec<Glitch> {
    let mut found = Vec::new();
    let mut from = NEIGHBOURS;
    while from + NEIGHBOURS < branch.len() {
        let glitch = (1..=GLITCH_POINTS)
            .filter(|count| from + count + NEIGHBOURS <= branch.len())
            .find(|count| stands_off(branch, from, *count));
        let Some(count) = glitch else {
            from += 1;
            continue;
        };
        let (before, behind) = (branch[from - 1], branch[from + count]);
        for point in &mut branch[from..from + count] {
            let part = (point.0 - before.0) / (behind.0 - before.0);
            let instead_n = before.1 + part * (behind.1 - before.1);
            found.push(Glitch {
                pressed,
                x_m: point.0,
                force_n: point.1,
                instead_n,
            });
            point.1 = instead_n;
        }
        from += count;
    }
    found
}

/// Whether some points are all off to one side of the line between their neighbours, by much more
/// than the neighbours are apart.
fn stands_off(branch: &[Point], from: usize, count: usize) -> bool {
    let sides = [
        &branch[from - NEIGHBOURS..from],
        &branch[from + count..][..NEIGHBOURS],
    ];
    let neighbours = || {
        sides
            .iter()
            .flat_map(|side| side.iter().map(|point| point.1))
    };
    let low = neighbours().fold(f64::INFINITY, f64::min);
    let high = neighbours().fold(f64::NEG_INFINITY, f64::max);
    let least = GLITCH_N.max(high - low);
    let points = &branch[from..from + count];
    points.iter().all(|point| point.1 > high + least)
        || points.iter().all(|point| point.1 < low - least)
}

/// Douglas and Peucker's choice: the fewest points that its halving finds such that lines between
/// them pass all others within the tolerance.
fn knots(branch: &[Point]) -> Vec<Point> {
    let mut keep = vec![false; branch.len()];
    let last = branch.len() - 1;
    (keep[0], keep[last]) = (true, true);
    let mut open = vec![(0, last)];
    while let Some((from, to)) = open.pop() {
        let ends = [branch[from], branch[to]];
        let off = |n: &usize| (at(&ends, branch[*n].0) - branch[*n].1).abs();
        let worst = (from + 1..to).max_by(|a, b| off(a).total_cmp(&off(b)));
        if let Some(worst) = worst.filter(|worst| off(worst) > TOLERANCE_N) {
            keep[worst] = true;
            open.extend([(from, worst), (worst, to)]);
        }
    }
    let kept = branch.iter().zip(keep).filter(|(_, keep)| *keep);
    kept.map(|(point, _)| *point).collect()
}

/// How far a loop all the way down and up is from a recording (N rms), computed as the program
/// does.
fn loop_rms(recording: &Recording, press: &[Point], back: &[Point], give_m: f64) -> f64 {
    let [low, high] = recording.travel_m();
    let mut link = low;
    let mut squares = 0.0;
    let down = recording.press.iter();
    let points: Vec<Point> = down.chain(recording.back.iter().rev()).copied().collect();
    let points = points
        .iter()
        .filter(|point| (low..=high).contains(&point.0));
    let mut count = 0.0;
    for (x, force) in points {
        link = link.clamp(x - give_m, *x);
        let share = (x - link) / give_m;
        let computed = at(back, *x) + share * (at(press, *x) - at(back, *x));
        squares += (computed - force).powi(2);
        count += 1.0;
    }
    (squares / f64::max(count, 1.0)).sqrt()
}

/// Stiffness and first force of a recording that is a straight line without hysteresis, from where
/// it is touched to where its coils meet.
fn bare_spring(recording: &Recording) -> Option<[f64; 2]> {
    /// A recording with more hysteresis, or further from a line (N), is no bare spring.
    const STRAIGHT_N: f64 = 0.8 * GRAM_N;
    let touched = recording
        .press
        .windows(3)
        .find(|w| w.iter().all(|p| p.1 > 3.0 * GRAM_N))?[0]
        .0;
    let [_, high] = recording.travel_m();
    let (from, to) = (touched + 0.3e-3, high - 0.3e-3);
    let inside: Vec<Point> = recording
        .press
        .iter()
        .filter(|point| (from..=to).contains(&point.0))
        .copied()
        .collect();
    if inside.len() < 3 || recording.mean_gap_n().abs() > STRAIGHT_N {
        return None;
    }
    let count = inside.len() as f64;
    let mean = |of: &dyn Fn(&Point) -> f64| inside.iter().map(of).sum::<f64>() / count;
    let (x, f) = (mean(&|p| p.0), mean(&|p| p.1));
    let k = mean(&|p| (p.0 - x) * (p.1 - f)) / mean(&|p| (p.0 - x).powi(2));
    let off = mean(&|p| (p.1 - f - k * (p.0 - x)).powi(2)).sqrt();
    (off <= STRAIGHT_N && k > 0.0).then_some([k, f + k * (touched - x)])
}
