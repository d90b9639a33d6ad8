//! The worst-case path of each mode, searched for: cells, live values and words within their
//! ranges, mutated where they come far.
//!
//! Cells are set to whatever their ranges allow, which a key may never reach by playing. So the
//! largest that is found may be more than playing gives, never more than the bound; and what is
//! found shows how much of the bound is real.

use whippen_compiler::budget::{Query, bound};
use whippen_compiler::kernel::Range;
use whippen_compiler::kernel::random::{Draw, Rng};
use whippen_isa::timing::Core;

use crate::image::{Image, instruments};
use crate::states::{Case, Keys};

/// Ticks of all keys for each instrument, where the environment does not say.
const ROUNDS: u64 = 500;
/// Keys that are tried at once.
const KEYS: u32 = 48;

fn rounds() -> u64 {
    whippen_need::count("WHIPPEN_ROUNDS", ROUNDS)
}

/// The best case of a mode so far.
#[derive(Clone)]
struct Best {
    case: Case,
    lives: Vec<i64>,
    cycles: u64,
}

/// The largest cycles of each mode that were found.
fn search(keys: &mut Keys, seed: u64) -> Vec<u64> {
    let mut rng = Rng::new(seed);
    let modes = keys.image.modes.modes.len();
    let mut best: Vec<Option<Best>> = vec![None; modes];
    for round in 0..rounds() {
        let base = &best[rng.below(modes as u64) as usize];
        let lives: Vec<i64> = keys
            .image
            .modes
            .kernel
            .lives
            .iter()
            .enumerate()
            .map(|(at, live)| match &base {
                Some(base) if rng.chance(9, 10) => base.lives[at],
                _ => rng.interesting(live.range),
            })
            .collect();
        let cases: Vec<Case> = (0..keys.count())
            .map(|key| {
                let mode = (round as usize * keys.count() + key) % modes;
                let case = match &best[mode] {
                    Some(best) if rng.chance(7, 8) => best.case.clone(),
                    _ => Case {
                        mode,
                        cells: cells(keys, mode, &mut rng),
                        word: rng.next() as u16,
                    },
                };
                mutated(keys, case, &mut rng)
            })
            .collect();
        let full = rng.chance(1, 8);
        for (case, cycles) in cases.iter().zip(keys.tick(&cases, &lives, full)) {
            let known = &mut best[case.mode];
            if known.as_ref().is_none_or(|best| best.cycles <= cycles) {
                *known = Some(Best {
                    case: case.clone(),
                    lives: lives.clone(),
                    cycles,
                });
            }
        }
    }
    best.into_iter()
        .map(|best| best.map_or(0, |best| best.cycles))
        .collect()
}

fn cells(keys: &Keys, mode: usize, rng: &mut Rng) -> Vec<i64> {
    keys.ranges(mode)
        .iter()
        .map(|range| within(*range, rng))
        .collect()
}

/// A value of a range: an end, anything, or something small.
fn within(range: Range, rng: &mut Rng) -> i64 {
    let span = (range.high - range.low) as u64;
    match rng.below(4) {
        0 => rng.interesting(range),
        1 => (1_i64 << rng.below(31))
            .wrapping_mul(if rng.chance(1, 2) { 1 } else { -1 })
            .clamp(range.low, range.high),
        _ => range.low.wrapping_add(if span == u64::MAX {
            rng.next()
        } else {
            rng.below(span + 1)
        } as i64),
    }
}

/// A few values are others.
fn mutated(keys: &Keys, mut case: Case, rng: &mut Rng) -> Case {
    let ranges = keys.ranges(case.mode);
    for _ in 0..rng.below(4) {
        let at = rng.below(ranges.len() as u64 + 1) as usize;
        match ranges.get(at) {
            None if rng.chance(1, 2) => case.word = rng.next() as u16,
            None => {
                case.word = case
                    .word
                    .wrapping_add(rng.below(64) as u16)
                    .wrapping_sub(32)
            }
            Some(range) if rng.chance(1, 2) => case.cells[at] = within(*range, rng),
            Some(range) => {
                let by = 1_i64 << rng.below(28);
                let by = if rng.chance(1, 2) { by } else { -by };
                case.cells[at] = case.cells[at]
                    .saturating_add(by)
                    .clamp(range.low, range.high);
            }
        }
    }
    case
}

#[test]
fn no_state_of_a_key_takes_longer_than_its_mode_s_bound() {
    let mut exact = 0;
    for (seed, compiled) in (100..).zip(instruments()) {
        let image = Image::new(compiled, KEYS);
        let mut keys = Keys::new(&image);
        let found = search(&mut keys, seed);
        let bounds = &image.cores[0].alone.zones[0].tick.modes;
        let mut reached = 0;
        for ((mode, bound), &found) in bounds.iter().zip(&found) {
            assert!(
                found <= bound.cycles_max,
                "{}: {mode}: {found} > {}",
                image.name(),
                bound.cycles_max
            );
            reached += usize::from(found == bound.cycles_max);
        }
        let (bound, found) = (
            image.cores[0].alone.key_cycles_max(),
            found.iter().max().copied().unwrap_or(0),
        );
        exact += usize::from(bound == found);
        let tightness = bound as f64 / found as f64;
        println!(
            "{}: key {found} of {bound}, {tightness:.3}; {reached} of {} modes exactly",
            image.name(),
            bounds.len()
        );
    }
    assert!(
        exact > 0,
        "no bound is reached, so one that is too low would not be noticed"
    );
}

/// Keys whose code and some data are in one group of banks, where data wait for fetches wherever
/// they may: the bound with waiting holds and is met, the one without is exceeded.
#[test]
fn waiting_for_own_fetches_is_suffered_and_bounded() {
    let found_of = |name: &str| {
        let compiled = instruments()
            .into_iter()
            .find(|own| own.model.name == name)
            .expect("it is bundled");
        let image = Image::new(compiled, KEYS);
        let found = search(&mut Keys::meeting_fetches(&image), 1);
        let core = &image.cores[0];
        let modes = &core.contended.zones[0].tick.modes;
        for ((mode, bound), &found) in modes.iter().zip(&found) {
            assert!(found <= bound.cycles_max, "{name}: {mode}: {found}");
        }
        let found = found.iter().max().copied().unwrap_or(0);
        let bounds = [&core.alone, &core.contended].map(|frame| frame.key_cycles_max());
        println!("{name}: key {found}, bounds {bounds:?}");
        (found, bounds)
    };
    let (found, [alone, contended]) = found_of("two_body");
    assert!(alone < found, "its events wait: {found} > {alone}");
    assert_eq!(found, contended, "a cycle less would be exceeded");
    let (found, [alone, _]) = found_of("harpsichord");
    assert!(alone < found, "its histories wait: {found} > {alone}");
}

/// Numbers of the core that the worst-case paths of instruments meet, each a cycle too small, one
/// at a time; all others are the random programs'.
fn weakened() -> Vec<(&'static str, Core)> {
    let mut cores = Vec::new();
    let mut with = |name, change: fn(&mut Core)| {
        let mut core = Core::cortex_m33();
        change(&mut core);
        cores.push((name, core));
    };
    with("a taken branch", |core| core.branches.taken.cycles -= 1);
    with("a late result", |core| core.late.cycles -= 1);
    cores
}

/// Of instruments whose worst-case mode is bounded exactly: the same bound less a cycle is
/// exceeded, and each rule that is broken is noticed on one of them.
#[test]
fn a_bound_that_is_too_low_is_noticed() {
    let mut unnoticed = weakened();
    for name in ["two_body", "harpsichord", "knob", "hammond", "baker"] {
        let Some(compiled) = instruments()
            .into_iter()
            .find(|compiled| compiled.model.name == name)
        else {
            continue;
        };
        let image = Image::new(compiled, KEYS);
        let found = search(&mut Keys::new(&image), 1);
        let key = image.cores[0].alone.key_cycles_max();
        let exceeded = |cycles_max: u64| found.iter().any(|&found| found > cycles_max);
        assert!(!exceeded(key), "{name}: {found:?} of {key}");
        if name == "two_body" {
            assert!(exceeded(key - 1), "{found:?} of {key}");
        }
        unnoticed.retain(|(_, core)| {
            let mut annotations = image.program.annotations.clone();
            annotations.stops = image.places(0).into_keys().collect();
            let broken = |entry: u32| {
                let (code, annotations) = (&image.program.code, &annotations);
                let query = Query {
                    core,
                    code,
                    entry,
                    annotations,
                    interference: None,
                };
                bound(&query).expect("a bound").cycles_max
            };
            let modes =
                (0..found.len()).map(|mode| broken(image.symbol(&format!("core0.mode.{mode}"))));
            !modes.zip(&found).any(|(bound, found)| *found > bound)
        });
    }
    let names: Vec<&str> = unnoticed.iter().map(|(rule, _)| *rule).collect();
    assert!(
        names.is_empty(),
        "nothing exceeds the bound where this is a cycle too cheap: {names:?}"
    );
}
