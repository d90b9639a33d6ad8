//! The program that a curve becomes.

use std::fmt::Write;

use whippen_compiler::syntax::layout;

use super::curve::Curve;
use super::recording::{GRAM_N, Point, Recording};

/// The text of an instrument, in the canonical layout.
pub fn text(name: &str, source: &str, recording: &Recording, curve: &Curve) -> String {
    let [low, high] = recording.travel_m();
    let give = mm(curve.give_m);
    let mut out = String::new();
    let what = match curve.spring {
        Some(_) => "A bare spring",
        None => "A key",
    };
    let _ = write!(
        out,
        "/// {what} after a recording of its force over its travel, `{source}`: pressed and let go slowly.\n\
         ///\n\
         /// The recording tells the two curves. It does not tell what moves with the key, what depends on speed,\n\
         /// or how the force goes from one curve to the other where the key turns round half way: `give` says that.\n\
         instrument {name} {{\n\
         sense x: length in {low} .. {high} over 1 ms\n\n\
         // The force of the key going down, and coming up.\n\
         table press: force over length {{ {press} }}\n\
         table back: force over length {{ {back} }}\n\n\
         // A link with play, dragged along by the key: `give` behind it on the way down, level with it on the way\n\
         // up, and in between where the key has turned round.\n\
         param give = {give} in 0.005 mm .. 0.5 mm\n\
         state link: length in {reach} .. {high} = {low}\n\
         let dragged = clamp(link, x - give, x)\n\
         next link = dragged\n\
         let down = clamp((x - dragged) / give, 0, 1)\n\n\
         force switch = back(x) + down * (press(x) - back(x))\n",
        low = mm(low),
        high = mm(high),
        reach = mm(low - 0.5e-3),
        press = knots(&curve.press),
        back = knots(&curve.back),
    );
    if let Some(closes) = recording.closes_m {
        let opens = recording.opens_m.unwrap_or(closes).min(closes);
        let _ = write!(
            out,
            "\n// Where its contact closed and opened.\n\
             states contact {{\n\
             open -> closed when x > {} {{ emit note(speed: x') }}\n\
             closed -> open when x < {} {{ emit release() }}\n\
             }}\n",
            mm(closes),
            mm(opens)
        );
    }
    out.push_str("}\n");
    layout(0, &out).unwrap_or(out)
}

fn knots(points: &[Point]) -> String {
    let knot = |(x, force): &Point| format!("{}: {} gf", mm(*x), number(force / GRAM_N, 3));
    points.iter().map(knot).collect::<Vec<_>>().join(", ")
}

/// A length in millimetres, as a program writes it.
fn mm(metres: f64) -> String {
    format!("{} mm", number(1e3 * metres, 4))
}

/// A number with so many digits behind the point at most.
fn number(value: f64, digits: i32) -> String {
    let scale = 10_f64.powi(digits);
    let value = (value * scale).round() / scale;
    // No minus before a zero.
    format!("{}", if value == 0.0 { 0.0 } else { value })
}
