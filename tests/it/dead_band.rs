//! Dead bands and errors over time: what is told of an update is seen when the integers run beside
//! the equations.

use whippen_compiler::ideal::Ideal;
use whippen_compiler::kernel::Interp;
use whippen_compiler::lower::lost::{DeadBand, dead_bands};
use whippen_compiler::lower::{Export, ExportKind, OverTime};
use whippen_compiler::model::CellId;
use whippen_compiler::pipeline::Compiled;
use whippen_runtime::device::Device;

use crate::common;

/// The only cell of these programs.
const KEPT: CellId = CellId(0);

fn program(range: &str, next: &str) -> Compiled {
    let text = format!(
        "instrument slow {{
            sense x: length in 0 mm .. 10 mm over 1 ms
            state y: length in {range}
            next y = {next}
            force memory = 1 mN/m * y
        }}"
    );
    common::compiled("slow", &text, &[]).remove(0)
}

fn lag(range: &str, part: f64) -> Compiled {
    program(range, &format!("y + (x - y) * {part}"))
}

fn band(compiled: &Compiled) -> DeadBand {
    let updates = &compiled.lowered.updates;
    let bands = dead_bands(&compiled.step, &compiled.ranges, updates);
    bands.first().expect("it rounds").1
}

fn warns(compiled: &Compiled) -> bool {
    compiled
        .warnings
        .iter()
        .any(|w| w.code.number() == "WH0512")
}

/// The kept value after each tick, of the integers and of the equations.
fn run(compiled: &Compiled, positions_m: &[f64]) -> Vec<[f64; 2]> {
    let (model, kernel) = (&compiled.model, &compiled.lowered.kernel);
    let is_kept = |e: &&Export| e.kind == ExportKind::Cell(KEPT);
    let export = compiled.lowered.exports.iter().find(is_kept);
    let export = export.expect("every cell is exported");
    let cell = kernel.cells.iter().position(|c| c.name == "y");
    let cell = cell.expect("every cell is in the kernel");
    let mut interp = Interp::new(kernel, 1).unwrap_or_else(|e| panic!("{e}"));
    let mut ideal = Ideal::new(model, &Device::of(model).scales(), 1);
    let words = common::words(positions_m);
    interp.init(&words[..1]);
    let tick = |word: &u16| {
        interp.tick(&[*word], &mut [0]);
        ideal.tick(&[*word]);
        let integer = interp.cell(0, cell, 0).expect("one key");
        [export.value(integer), ideal.state(0).cells[KEPT]]
    };
    words.iter().map(tick).collect()
}

#[test]
fn a_lag_comes_to_rest_within_the_band_that_is_told_and_almost_as_far_away() {
    for (range, part) in [
        ("-100 m .. 100 m", 1e-3),
        ("-100 m .. 100 m", 3.7e-4),
        ("0 m .. 30 m", 2e-3),
        ("-3000 m .. 1 m", 0.02),
    ] {
        let compiled = lag(range, part);
        assert!(warns(&compiled), "{range} {part}");
        let told = band(&compiled).width;
        let ticks = (20.0 / part) as usize;
        let mut farthest = 0.0_f64;
        // From below and from above.
        for first_m in [0.0, 9e-3] {
            let mut positions_m = vec![first_m; ticks];
            positions_m.extend(vec![5e-3; ticks]);
            let all = run(&compiled, &positions_m);
            let [integer, real] = all[all.len() - 1];
            assert_eq!(integer, all[all.len() - 100][0], "it rests");
            farthest = farthest.max((integer - real).abs());
        }
        println!("{range}, {part}: told {told:.2e} m, seen {farthest:.2e} m");
        assert!((told / 3.0..=told).contains(&farthest), "{range} {part}");
    }
}

#[test]
fn a_sum_misses_what_is_less_than_its_band_and_takes_what_is_more() {
    let compiled = program("-100 m .. 100 m", "y + (x - 5 mm) * 2e-4");
    assert!(warns(&compiled));
    let band = band(&compiled);
    assert_eq!(band.part, None);
    // As a difference of the key's travel.
    let width_m = band.width / 2e-4;
    for (share, moves) in [(0.9, false), (-0.9, false), (1.1, true), (-1.1, true)] {
        let all = run(&compiled, &vec![5e-3 + share * width_m; 20_000]);
        let [integer, real] = all[all.len() - 1];
        assert_eq!(integer != all[0][0], moves, "{share}");
        assert!(real.abs() > 1e-4, "the equations move: {real}");
    }
}

#[test]
fn the_warning_begins_where_a_65536th_part_may_be_lost() {
    for range in ["0 mm .. 10 mm", "-2 m .. 2 m"] {
        // The excess falls as the part rises; units change by up to two with it.
        let cure = 1e-6 * band(&lag(range, 1e-6)).excess;
        assert!(warns(&lag(range, 0.45 * cure)), "{range}");
        assert!(!warns(&lag(range, 2.1 * cure)), "{range}");
    }
    let slow = |range: &str| program(range, "y + x * 2e-6");
    assert!(warns(&slow("0 mm .. 10 mm")));
    let needed = 0.01 / band(&slow("0 mm .. 10 mm")).excess;
    assert!(!warns(&slow(&format!("0 m .. {} m", 0.5 * needed))));
    assert!(warns(&slow(&format!("0 m .. {} m", 2.1 * needed))));
}

#[test]
fn what_does_not_round_is_told_as_exact_and_never_warned_of() {
    for (range, next) in [
        ("-100 m .. 100 m", "max(x, y)"),
        ("-100 m .. 100 m", "if x > 5 mm then y + 1 m else y"),
        ("-0.2 m .. 0.2 m", "x - clamp(x - y, -1 mm, 1 mm)"),
    ] {
        let compiled = program(range, next);
        assert!(!warns(&compiled), "{next}");
        let update = &compiled.lowered.updates[0];
        let settled = matches!(update.over_time, OverTime::Exact | OverTime::Bounded(_));
        assert!(settled, "{next}: {update:?}");
    }
}

/// A chorus is read between ticks, and told to be off by a ten-thousandth; a lag goes there.
#[test]
fn a_lag_gets_to_what_may_be_wrong_itself() {
    let text = "instrument slow {
        sense x: length in 0 mm .. 10 mm over 1 ms
        let voice = chorus(x / 10 mm, pace: 1 Hz, late: 15 ms, depth: 5 ms, mix: 0.5)
        state y: number in -1 .. 1
        next y = y + (voice.left - y) * 0.001
        sound out = y
    }";
    let compiled = common::compiled("slow", text, &[]).remove(0);
    let updates = &compiled.lowered.updates;
    let slow = compiled
        .model
        .cells
        .enumerated()
        .find(|(_, c)| c.name == "y");
    let (slow, _) = slow.expect("is kept");
    let bands = dead_bands(&compiled.step, &compiled.ranges, updates);
    let found = bands.iter().find(|(update, _)| update.cell == slow);
    let (update, band) = found.expect("it rounds");
    assert!(update.error > 5e-8, "{update:?}");
    assert!(band.width < 1e-5 && !warns(&compiled), "{band:?}");
}

#[test]
fn the_error_of_a_lag_stays_within_its_bound_however_long_it_runs() {
    let positions_m = &common::gesture()[80_000..180_000];
    for (range, part) in [
        ("0 mm .. 10 mm", 2e-6),
        ("0 mm .. 10 mm", 1e-3),
        ("-100 m .. 100 m", 0.01),
        ("-100 m .. 100 m", 0.37),
    ] {
        let compiled = lag(range, part);
        let OverTime::Bounded(told) = compiled.lowered.updates[0].over_time else {
            panic!("{range} {part}: {:?}", compiled.lowered.updates[0]);
        };
        let all = run(&compiled, positions_m);
        let seen = all.iter().map(|[a, b]| (a - b).abs()).fold(0.0, f64::max);
        println!("{range}, {part}: told {told:.2e} m, seen {seen:.2e} m");
        assert!(seen <= told && seen > 0.0, "{range} {part}");
    }
}

/// The equations leave 0.5 mm to where the sensor counts from; over many ticks that is not nothing.
#[test]
fn a_slow_lag_does_not_forget_where_the_sensor_counts_from() {
    let compiled = lag("0 mm .. 10 mm", 2e-6);
    let all = run(&compiled, &vec![5e-3; 400_000]);
    let [integer, real] = all[all.len() - 1];
    assert!((integer - real).abs() < 1.4e-6, "{integer} {real}");
}
