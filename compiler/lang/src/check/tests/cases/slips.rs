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
        &["WH0211"],
        "let c = clamp(x, 0,5 mm, 1 mm) force f = 0 N",
    ),
    case(
        "decimal comma in a call of a term",
        &["WH0303", "WH0302", "WH0211"],
        "force f = spring(x, 0,5 N, 1 N/m)",
    ),
];
