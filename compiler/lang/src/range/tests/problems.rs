//! Every message about a value that cannot be bounded, as it is shown.

use super::{STRING, analyze, model, model_of, render};

/// A string that begins at 0.1 m.
const FURTHER: &str = "string line along 0.1 m .. 0.42 m {
    position u in -8 mm .. 8 mm, rate in -40 m/s .. 40 m/s
    density 100 g/m load 10 N * d2(u) ends pinned points 15 }";

/// Two bodies, of which the second is rubbed by this law.
macro_rules! rubbed {
    ($law:literal) => {
        concat!(
            "live param press = 0 N in -1 N .. 1 N
body first { position a in -1 mm .. 1 mm, rate in -1 m/s .. 1 m/s mass 10 g
    friction right(v) against x' = 1 N * tanh(v / (1 mm/s)) }
body second { position b in -1 mm .. 1 mm, rate in -2 m/s .. 2 m/s mass 10 g
    friction wrong(v) against x' = ",
            $law,
            " }"
        )
    };
}

/// What is wrong, and the program.
const WRONG: &[(&str, &str)] = &[
    ("a sense as a divisor", "let a = 1 mm / x"),
    (
        "a live parameter as a divisor",
        "live param p = 1 in -1 .. 1 let a = 1 / p",
    ),
    (
        "a state as a divisor",
        "state s: time in -2 s .. 1 s let a = 1 s / s",
    ),
    (
        "a named value as a divisor",
        "let other = x let b = x - 5 mm let a = 1 mm / b",
    ),
    ("another divisor", "let a = 1 mm / (x - 5 mm)"),
    (
        "users of what has no value",
        "let a = 1 mm / x let b = 2 * a let c = b / x",
    ),
    ("a root", "let a = sqrt(x / 1 mm - 1)"),
    ("a power", "let a = (x / 1 mm - 1)^1.5"),
    ("a logarithm", "let a = log(x / 1 mm)"),
    (
        "a time beyond a line",
        "live param back = 5 ms in 1 ms .. 20 ms
delay past: length in 0 mm .. 10 mm lasting 10 ms feed past = x
let a = past(back)",
    ),
    (
        "a time before the last tick",
        "live param back = 5 ms in 0 ms .. 10 ms
delay past: length in 0 mm .. 10 mm lasting 10 ms feed past = x
let a = past(back)",
    ),
    (
        "a time too near for an allpass",
        "live param back = 5 ms in 1 ms .. 10 ms
delay past: length in 0 mm .. 10 mm lasting 10 ms feed past = x
let a = tuned(past, back)",
    ),
    ("a law that pushes", rubbed!("-1 N * tanh(v / (1 mm/s))")),
    (
        "a law that pushes backward",
        rubbed!("0.1 N * (v / (1 m/s))^2"),
    ),
    (
        "a law that pushes forward",
        rubbed!("-0.1 N * (v / (1 m/s))^2"),
    ),
    (
        "a law that may turn round",
        rubbed!("press * tanh(v / (1 mm/s))"),
    ),
    (
        "a value of a parameter",
        "live param a = 1 in 0 .. 1e6 live param b = 1 in 0 .. 1e10
let z = x let y = a * b",
    ),
    (
        "a value of a state",
        "live param a = 1 in 0 .. 1e6 state b: number in 0 .. 1e10 let y = a * b",
    ),
    (
        "a value of what is sensed",
        "sense z: length in 0 m .. 1e10 m over 3 ms
live param a = 1 in 0 .. 1e6 force f on x = z * a * 1 N/m",
    ),
    ("a value of nothing declared", "noise n let y = (1e9 * n)^2"),
];

fn messages(name: &str, text: String) -> String {
    let (map, model) = model_of(text);
    let found = analyze(&model).expect_err(name);
    let messages = found.iter().map(|d| render(&map, d, false));
    format!("# {name}\n\n{}\n", messages.collect::<String>())
}

#[test]
fn values_that_cannot_be_bounded() {
    let own = |body: &str| {
        format!("instrument i {{\nsense x: length in 0 mm .. 10 mm over 3 ms\n{body}\n}}\n")
    };
    let mut all: Vec<String> = WRONG
        .iter()
        .map(|(name, body)| messages(name, own(body)))
        .collect();
    let places = [
        ("a place that moves off its string", STRING, "0.315 m + x"),
        ("a place off its string", STRING, "0.4 m"),
        ("a place before its string", FURTHER, "0.05 m"),
        ("a place that moves beyond", FURTHER, "0.415 m + x"),
    ];
    for (name, string, place) in places {
        let body = format!("{string}\nsound s = 0.01 s/m * u({place})'");
        all.push(messages(name, own(&body)));
    }
    let string = STRING.replace("1 N * tanh", "-1 N * tanh");
    all.push(messages("a law of a string that pushes", own(&string)));
    let keyboard = "keyboard b { rate 1 kHz keys C4 .. E4 programs i i.w = { C4: 1, E4: 3 } }";
    let per_key = [
        (
            "a parameter per key as a divisor",
            "live param w = 1 in -5 .. 5 let a = 1 / w",
        ),
        (
            "a value of a parameter per key",
            "live param v = 1 in 0 .. 1e6 live param w = 1 in 0 .. 1e10\nlet y = v * w",
        ),
    ];
    for (name, body) in per_key {
        all.push(messages(name, format!("{keyboard}\n{}", own(body))));
    }
    let term =
        "term t(a: number) -> b: number { b = 1 / a }\nterm s(a: number) -> b: number { b = t(a) }";
    let text = format!("{term}\n{}", own("let a = s(x / 1 mm)"));
    all.push(messages("a division in a term", text));
    insta::assert_snapshot!(all.concat());
}

/// Laws of frictions that never push.
#[test]
fn laws_that_only_brake() {
    let braking = [
        rubbed!("0.5 N * tanh(v / (1 mm/s))"),
        rubbed!("0.1 N * (v / (1 m/s))^3"),
        rubbed!("1 N*s/m * v"),
        rubbed!("0 N"),
    ];
    for body in braking {
        let (_, model) = model(body);
        assert!(analyze(&model).is_ok(), "{body}");
    }
}
