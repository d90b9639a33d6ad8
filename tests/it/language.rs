//! The rules of `docs/language.md`, one by one, on small instruments, through `interp` and `ideal`.

mod machines;
mod motion;
mod outputs;
mod primes;
mod tick;

use whippen_compiler::pipeline::Compiled;
use whippen_runtime::engine::EngineKind;

use crate::common::{self, RATE_HZ};
use crate::player::Player;

/// Tick length (s).
const T_S: f64 = 1.0 / RATE_HZ as f64;

/// An instrument that senses `x` and holds these declarations.
fn instrument(declarations: &str) -> Compiled {
    let sense = "sense x: length in -0.5 mm .. 10.5 mm over 0.7 ms";
    common::compiled(
        "rule.whip",
        &format!("instrument rule {{ {sense}\n{declarations} }}"),
        &[],
    )
    .remove(0)
}

/// Tells the same story to both engines.
fn both(compiled: &Compiled, story: impl Fn(&mut Player)) {
    for kind in [EngineKind::Interp, EngineKind::Ideal] {
        println!("engine {kind}");
        story(&mut Player::new(compiled, kind));
    }
}

#[track_caller]
fn close(found: f64, expected: f64, tolerance: f64) {
    assert!(
        (found - expected).abs() <= tolerance,
        "{found} instead of {expected}"
    );
}

/// Positions that fall on words of the sensor, so that a slope has no quantization in it (m).
fn on_a_word(words: u32) -> f64 {
    -0.5e-3 + 11e-3 / 65_535.0 * f64::from(words)
}
