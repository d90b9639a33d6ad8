//! What people who know other languages write, and what a hint makes of it.

use super::{Case, case};

/// Slips of other languages and of pens.
pub const SLIPS: &[Case] = &[
    case("gram as a force", &["WH0302"], "force f = 400 g"),
    case(
        "gram as a range of a force",
        &["WH0302"],
        "live param w = 50 g in 0 gf .. 100 gf force f = 0 N",
    ),
    case(
        "number beside a position",
        &["WH0303", "WH0303"],
        "event low when x < 4 { } let way = max(x - 2 mm, 0.5) force f = 0 N",
    ),
    case(
        "number beside a small force",
        &["WH0303"],
        "live param w = 0.1 N in 0 N .. 0.5 N force f = w + 200",
    ),
    case(
        "three factors of a unit without signs",
        &["WH0103"],
        "force f = 0.1 mN s m",
    ),
    case(
        "a term of keys for a knob",
        &["WH0302"],
        "instrument dial { sense a: angle in -1 rad .. 1 rad torque t = 1 N*m * rotary_bristle(a, give: 1 deg) * bristle(a, give: 1 mm) }",
    ),
    case(
        "a parameter that is called otherwise",
        &["WH0209"],
        "let jack = plectrum(x, row: on, touch: 1 mm, release: 3 mm, height: 1 N) force f = 0 N",
    ),
    case("tangent", &["WH0203"], "force f = 1 N * tan(x / 1 mm)"),
    case("sign", &["WH0203"], "force f = 1 N * sign(x')"),
    case("root", &["WH0203"], "force f = 1 N * cbrt(x / 1 mm)"),
    case("power", &["WH0203"], "force f = 1 N * pow(x / 1 mm, 2)"),
    case("derivative", &["WH0203"], "force f = 1 N*s/m * der(x)"),
    case("unknown function", &["WH0203"], "force f = 1 N * wobble(x)"),
    case(
        "true",
        &["WH0201"],
        "live param p = true force f = if p then 1 N else 0 N",
    ),
    case(
        "derivative as a quotient",
        &["WH0201", "WH0201"],
        "force f = 1 N*s/m * dx/dt",
    ),
    case("time", &["WH0201"], "force f = 1 N/s * t"),
    case(
        "states in a row",
        &["WH0201"],
        "states m { up -> down when x > 2 mm down -> up when x < 1 mm } force f = if m is up or down then 1 N else 0 N",
    ),
    case(
        "exponent without its sign",
        &["WH0301"],
        "let v = 1 ms-1 force f = 0 N",
    ),
    case(
        "decimal comma in a call",
        &["WH0105"],
        "let c = clamp(x, 0,5 mm, 1 mm) force f = 0 N",
    ),
    case(
        "decimal comma in a call of a term",
        &["WH0105"],
        "force f = spring(x, 0,5 N, 1 N/m)",
    ),
    case(
        "decimal comma in a call, as many arguments as parameters",
        &["WH0105"],
        "force f = spring(x, 0,5 N/m)",
    ),
    case(
        "decimal comma behind a name",
        &["WH0105"],
        "force f = spring(x, stiffness: 20 N/m, rest: 1,5 mm)",
    ),
    case(
        "decimal comma where the unit is alone",
        &["WH0105"],
        "force f = min(0,5 N)",
    ),
    case(
        "commas without spaces",
        &[],
        "term t(a: number, b: length) -> y: force { y = a * b * 1 N/m } instrument i { sense x: length in 0 mm .. 10 mm let c = clamp(x / 1 mm,0,5) force f = t(3,5 mm) * max(3,4) * c }",
    ),
];
