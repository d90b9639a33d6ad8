//! Frictions: a rubbed mass against what is known of it, and against `ideal` by its regimes; under
//! words at random it never pushes.

use whippen_compiler::ideal::Ideal;
use whippen_compiler::kernel::Interp;
use whippen_compiler::kernel::random::{Draw, Rng};
use whippen_compiler::pipeline::Compiled;
use whippen_runtime::device::Device;

use crate::common;

const RATE_HZ: usize = 44_100;

fn rubbed_mass() -> Compiled {
    let text = include_str!("../programs/rubbed_mass.whip");
    common::compiled("rubbed_mass.whip", text, &[]).remove(0)
}

/// What a run settles to.
#[derive(Debug)]
struct Regime {
    /// Largest less smallest speed of the mass (m/s).
    peak_to_peak: f64,
    /// Share of ticks in which the slip is less than a tenth of what is rubbed with.
    stuck: f64,
    /// How often a second the mass turns round upwards, by at least a tenth of that.
    hz: f64,
}

fn regime(speeds: &[f64], slips: &[f64]) -> Regime {
    let most = speeds.iter().copied().fold(f64::MIN, f64::max);
    let least = speeds.iter().copied().fold(f64::MAX, f64::min);
    let (low, high) = (least + 0.3 * (most - least), most - 0.3 * (most - least));
    let (mut is_high, mut rises) = (false, 0);
    for speed in speeds {
        rises += usize::from(!is_high && *speed > high);
        is_high = *speed > high || is_high && *speed > low;
    }
    let stuck = slips.iter().filter(|slip| slip.abs() < 0.02).count();
    Regime {
        peak_to_peak: most - least,
        stuck: stuck as f64 / slips.len() as f64,
        hz: rises as f64 * RATE_HZ as f64 / speeds.len() as f64,
    }
}

/// The second half of so many seconds with these live values, in integers and in f64.
fn regimes(lives: [f64; 4], seconds: usize) -> [Regime; 2] {
    let compiled = rubbed_mass();
    let (kernel, exports) = (&compiled.lowered.kernel, &compiled.lowered.exports);
    let mut interp = Interp::new(kernel, 1).unwrap();
    let mut ideal = Ideal::new(&compiled.model, &Device::of(&compiled.model).scales(), 1);
    for (live, value) in lives.into_iter().enumerate() {
        interp
            .set_live(live, compiled.lowered.lives[live].quantize(value))
            .unwrap();
        ideal.set_live(live, value);
    }
    let at = |name: &str| exports.iter().position(|e| e.name == name).unwrap();
    let (speed, slip) = (at("speed"), at("slip"));
    let named = |name: &str| {
        compiled
            .model
            .named
            .iter()
            .find(|n| n.name == name)
            .unwrap()
            .value
    };
    let mut drive = [0_i16];
    interp.init(&[0]);
    let mut kept = [(); 4].map(|()| Vec::new());
    for tick in 0..seconds * RATE_HZ {
        // What rubs takes a tenth of a second to come to its speed.
        let part = (tick as f64 / (0.1 * RATE_HZ as f64)).min(1.0);
        interp
            .set_live(3, compiled.lowered.lives[3].quantize(part * lives[3]))
            .unwrap();
        ideal.set_live(3, part * lives[3]);
        interp.tick(&[20_000], &mut drive);
        ideal.tick(&[20_000]);
        if tick >= seconds * RATE_HZ / 2 {
            kept[0].push(exports[speed].value(interp.probes()[speed]));
            kept[1].push(exports[slip].value(interp.probes()[slip]));
            kept[2].push(ideal.value(0, named("speed")));
            kept[3].push(ideal.value(0, named("slip")));
        }
    }
    [regime(&kept[0], &kept[1]), regime(&kept[2], &kept[3])]
}

#[test]
fn a_light_touch_is_silent_and_a_firm_one_makes_it_stick_and_slip() {
    for found in regimes([0.2, 70.71e-3, 1.0, 0.2], 4) {
        assert!(found.peak_to_peak < 1e-3, "{found:?}");
    }
    let [integers, ideal] = regimes([3.0, 70.71e-3, 1.0, 0.2], 4);
    println!("3 N: {integers:?} {ideal:?}");
    alike(&integers, &ideal);
    // It goes with what rubs it, and swings back at its own pitch.
    assert!((0.40..0.50).contains(&integers.peak_to_peak));
    assert!(integers.hz == 55.0 && integers.stuck > 0.1);
}

#[test]
fn a_hard_touch_captures_the_mass() {
    let [integers, ideal] = regimes([1000.0, 5.7735e-3, 1.0, 0.2], 4);
    println!("1000 N: {integers:?} {ideal:?}");
    alike(&integers, &ideal);
    assert!((integers.peak_to_peak - 3.11).abs() < 0.02);
    assert!((integers.hz - 10.7).abs() <= 0.5 && (integers.stuck - 0.91).abs() < 0.02);
}

/// The same regime: not the same ticks, because where a body lets go the least change decides.
fn alike(integers: &Regime, ideal: &Regime) {
    let near = |a: f64, b: f64| (a - b).abs() <= 0.01 * a.abs().max(b.abs());
    assert!(
        near(integers.peak_to_peak, ideal.peak_to_peak)
            && near(integers.hz, ideal.hz)
            && near(integers.stuck, ideal.stuck),
        "{integers:?} {ideal:?}"
    );
}

/// A minute, and longer: `WHIPPEN_TICKS=100000000 cargo test --test it never_pushes`.
#[test]
fn a_friction_never_pushes_whatever_comes() {
    let compiled = rubbed_mass();
    let (kernel, exports) = (&compiled.lowered.kernel, &compiled.lowered.exports);
    let mut interp = Interp::new(kernel, 1).unwrap();
    let at = |name: &str| exports.iter().position(|e| e.name == name).unwrap();
    let (force, slip) = (at("stick"), at("slip"));
    let ticks = whippen_need::count("WHIPPEN_TICKS", 60 * RATE_HZ);
    let mut random = Rng::new(19);
    let (mut drive, mut rubbed) = ([0_i16], 0);
    interp.init(&[0]);
    for tick in 0..ticks {
        if tick % 4000 == 0 {
            for (live, meaning) in compiled.lowered.lives.iter().enumerate() {
                let value = random.interesting(meaning.range);
                interp.set_live(live, value as i32).unwrap();
            }
        }
        // Jumps, noise, and the key at rest.
        let word = match tick / 300 % 3 {
            0 => random.next() as u16,
            1 => [0, 65_535][tick % 2],
            _ => 20_000,
        };
        interp.tick(&[word], &mut drive);
        let [force, slip] = [force, slip].map(|at| interp.probes()[at]);
        assert!(
            force.signum() * slip.signum() >= 0,
            "tick {tick}: {force} {slip}"
        );
        rubbed += usize::from(force != 0 && slip != 0);
    }
    assert!(rubbed > RATE_HZ, "only {rubbed} ticks rubbed");
}
