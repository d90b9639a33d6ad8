//! Strings.

use super::{Case, case};

/// A string with these lines besides its displacement.
macro_rules! string {
    ($lines:literal) => {
        string!($lines, "0 m .. 0.32 m", "")
    };
    ($lines:literal, $along:literal, $rest:literal) => {
        concat!(
            "force f = 80 N/m * x string line along ",
            $along,
            " { position u in -8 mm .. 8 mm, rate in -40 m/s .. 40 m/s ",
            $lines,
            " } ",
            $rest
        )
    };
}

/// Strings.
pub const STRINGS: &[Case] = &[
    case(
        "string without density",
        &["WH0421"],
        string!("load 57 N * d2(u) ends pinned"),
    ),
    case(
        "string without loads",
        &["WH0421"],
        string!("density 1.6 g/m ends pinned"),
    ),
    case(
        "string with two lines of ends",
        &["WH0421"],
        string!("density 1.6 g/m load 57 N * d2(u) ends pinned ends clamped"),
    ),
    case(
        "load by the displacement itself",
        &["WH0422"],
        string!("density 1.6 g/m load 57 N * d2(u) - 1 N/m^2 * u ends pinned"),
    ),
    case(
        "load by a slope all along",
        &["WH0422"],
        string!("density 1.6 g/m load 57 N * d2(u) + 1 N/m * d1(u) ends pinned"),
    ),
    case(
        "load by a product",
        &["WH0422"],
        string!("density 1.6 g/m load 57 N * d2(u) load 1 kg * d2(u) * u' ends pinned"),
    ),
    case(
        "load without the string",
        &["WH0422"],
        string!("density 1.6 g/m load 57 N * d2(u) load 1 N/m ends pinned"),
    ),
    case(
        "load of a wrong dimension",
        &["WH0302"],
        string!("density 1.6 g/m load 57 N/m * d2(u) ends pinned"),
    ),
    case(
        "ten thousand points",
        &["WH0423"],
        string!("density 1.6 g/m load 57 N * d2(u) ends pinned points 10000"),
    ),
    case(
        "ends that are free",
        &["WH0424"],
        string!("density 1.6 g/m load 57 N * d2(u) ends free"),
    ),
    case(
        "tuned between clamped ends",
        &["WH0425"],
        string!("density 1.6 g/m load t * d2(u) ends clamped tuned t to 294 Hz"),
    ),
    case(
        "a tension that nobody finds",
        &["WH0201"],
        string!("density 1.6 g/m load tension * d2(u) ends pinned"),
    ),
    case(
        "tuned without a unit",
        &["WH0303"],
        string!("density 1.6 g/m load t * d2(u) ends pinned tuned t to 294"),
    ),
    case(
        "tuned by a tension elsewhere",
        &["WH0425"],
        string!("density 1.6 g/m load 57 N * d2(u) ends pinned tuned t to 294 Hz"),
    ),
    case(
        "tuned too low for its stiffness",
        &["WH0425"],
        string!("density 1.6 g/m load t * d2(u) - 0.2 N*m^2 * d4(u) ends pinned tuned t to 100 Hz"),
    ),
    case(
        "displacement without a place",
        &["WH0426"],
        string!(
            "density 1.6 g/m load 57 N * d2(u) ends pinned",
            "0 m .. 0.32 m",
            "sound s = 100 s/m * u'"
        ),
    ),
    case(
        "bend outside of a load",
        &["WH0426"],
        string!(
            "density 1.6 g/m load 57 N * d2(u) ends pinned",
            "0 m .. 0.32 m",
            "sound s = 1 m * d2(u)"
        ),
    ),
    case(
        "rate of a string's rate",
        &["WH0402"],
        string!(
            "density 1.6 g/m load 57 N * d2(u) ends pinned",
            "0 m .. 0.32 m",
            "sound s = 1 s^2/m * u(0.1 m)''"
        ),
    ),
    case(
        "force outside of the string",
        &["WH0516"],
        string!("density 1.6 g/m load 57 N * d2(u) ends pinned force 1 N at 40 * x"),
    ),
    case(
        "negative density",
        &["WH0517"],
        string!("density -1.6 g/m load 57 N * d2(u) ends pinned"),
    ),
    case(
        "losses that drive",
        &["WH0517"],
        string!("density 1.6 g/m load 57 N * d2(u) + 0.01 N*s/m^2 * u' ends pinned"),
    ),
    case(
        "more points than are stable",
        &["WH0518"],
        string!("density 1.6 g/m load 57 N * d2(u) ends pinned points 200"),
    ),
    case(
        "never stable",
        &["WH0518"],
        string!("density 1.6 g/m load 1000 kN * d2(u) ends pinned"),
    ),
    case(
        "a length that changes while playing",
        &["WH0308"],
        string!(
            "density 1.6 g/m load 57 N * d2(u) ends pinned",
            "0 m .. l",
            "live param l = 0.3 m in 0.2 m .. 0.4 m"
        ),
    ),
    case(
        "two frictions of a string",
        &["WH0421"],
        string!(
            "density 1.6 g/m load 57 N * d2(u) ends pinned
             friction f(v) at 40 mm against x' = 1 N * tanh(v / (1 mm/s))
             friction g(v) at 80 mm against x' = 1 N * tanh(v / (1 mm/s))"
        ),
    ),
    case(
        "a string pulled by its own friction",
        &["WH0401"],
        string!(
            "density 1.6 g/m load (57 N + f) * d2(u) ends pinned
             friction f(v) at 40 mm against x' = 1 N * tanh(v / (1 mm/s))"
        ),
    ),
    case(
        "a string read where its own friction says",
        &["WH0401"],
        string!(
            "density 1.6 g/m load 57 N * d2(u) ends pinned
             friction f(v) at 40 mm against x' = 1 N * tanh(v / (1 mm/s))",
            "0 m .. 0.32 m",
            "sound s = 100 m^-1 * u(40 mm + 1 mm/N * clamp(f, -1 N, 1 N))"
        ),
    ),
    case(
        "a string named like a body",
        &["WH0202"],
        string!(
            "density 1.6 g/m load 57 N * d2(u) ends pinned",
            "0 m .. 0.32 m",
            "body line { position y in -1 mm .. 1 mm, rate in -1 m/s .. 1 m/s mass 1 g }"
        ),
    ),
];
