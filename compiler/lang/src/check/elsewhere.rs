//! What other languages have and this one has not: functions and names, and what to write instead.

use crate::diag::Advice;

/// Functions: names, and what is written instead.
const FUNCTIONS: &[(&[&str], &str)] = &[
    (
        &["sine", "cosine"],
        "they are written `sin(angle)` and `cos(angle)`",
    ),
    (
        &["tan", "tangent"],
        "write `sin(a) / cos(a)`, where the cosine cannot be zero",
    ),
    (
        &["asin", "acos", "atan", "atan2"],
        "there are `sin` and `cos` and not their inverses: a small sine is its own angle",
    ),
    (
        &["sign", "sgn", "signum"],
        "write `if v > 0 m/s then 1 else -1`; a friction that turns with the speed is \
         `coulomb(x, level: .., give: ..).drag`",
    ),
    (
        &["pow", "power", "square", "sqr"],
        "a power is written `a^n`, with n = 1, 1.5, 2, 2.5 or 3; others of what is above zero are `exp(n * log(a))`",
    ),
    (
        &["cbrt", "root"],
        "the square root is `sqrt(a)`, others of what is above zero are `exp(log(a) / n)`",
    ),
    (
        &["ln", "log10", "log2"],
        "the natural logarithm is `log(a)`; to base 10 it is `log(a) / log(10)`",
    ),
    (
        &["sinh", "cosh", "sigmoid", "logistic"],
        "write it with `exp` or `tanh`",
    ),
    (
        &["sat", "saturate", "limit", "constrain", "clip"],
        "write `clamp(value, low, high)`",
    ),
    (&["fabs", "mag", "magnitude"], "write `abs(value)`"),
    (
        &["round", "floor", "ceil", "mod", "fmod", "rem", "int"],
        "nothing is rounded to whole numbers: steps along the way are `detents`, or `states`",
    ),
    (
        &["random", "rand", "noise"],
        "nothing is random: the same motion gives the same force",
    ),
    (
        &[
            "d",
            "der",
            "diff",
            "deriv",
            "derivative",
            "ddt",
            "dot",
            "vel",
            "velocity",
            "speed",
        ],
        "the rate of `x` is written `x'`, the rate of that `x''`",
    ),
    (
        &["integrate", "integral", "sum"],
        "what is added up over time is a `state` with its `next`, or the coordinate of a `body`",
    ),
    (
        &["delay", "wait", "sleep", "timer", "millis"],
        "nothing waits: a `pulse` lasts for a time, a `state` remembers, and `event name every t` happens again and again",
    ),
    (
        &["lerp", "map", "interp", "lookup", "table"],
        "a straight line is written out, `a + (b - a) * t`; a curve of several is `min` and `max` of them",
    ),
    (
        &["print", "printf", "note", "release"],
        "something is told by `emit note(speed: ..)` in the braces of an `event` or a transition",
    ),
];

/// Names of values, and what is written instead.
const VALUES: &[(&[&str], &str)] = &[
    (
        &["t", "time", "now"],
        "no value tells the time: a `pulse` lasts for a while, a `state` is carried from tick to tick",
    ),
    (
        &["dt", "delta", "timestep"],
        "the length of a tick is called `tick`; the rate of `x` is written `x'`",
    ),
    (
        &["g"],
        "standard gravity is called `gravity`; after a number and a space, `g` is the gram",
    ),
];

/// What to write instead of a call of this function.
pub fn function(name: &str) -> Option<Advice> {
    find(FUNCTIONS, name)
}

/// What to write instead of this name.
pub fn value(name: &str) -> Option<Advice> {
    match name {
        "true" | "True" | "TRUE" | "yes" => Some(Advice::instead(
            "bools are `on` and `off`: write `on`",
            "on",
        )),
        "false" | "False" | "FALSE" | "no" => Some(Advice::instead(
            "bools are `on` and `off`: write `off`",
            "off",
        )),
        _ => find(VALUES, name),
    }
}

fn find(table: &[(&[&str], &str)], name: &str) -> Option<Advice> {
    let row = table.iter().find(|(names, _)| names.contains(&name));
    row.map(|(_, instead)| (*instead).into())
}
