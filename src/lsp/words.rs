//! What the words of the language mean, in a line each: keywords, functions, constants.

use whippen_compiler::units::{DIMENSIONS, UNITS, parse_unit};

/// A keyword, and what it is for.
pub const KEYWORDS: &[(&str, &str)] = &[
    ("instrument", "`instrument name { .. }`: a touch profile."),
    (
        "term",
        "`term name(parameter: type, ..) -> result: type, .. { .. }`: a piece that is used again; each call has a memory of its own.",
    ),
    (
        "keyboard",
        "`keyboard name { .. }`: instruments on a device.",
    ),
    (
        "sense",
        "`sense x: length in low .. high [slew v] [over time]`: what is measured, and the range that is accepted.",
    ),
    (
        "live",
        "`live param name = value in low .. high`: a parameter that may change while playing.",
    ),
    (
        "param",
        "`param name = value [in low .. high]`: a constant; the range bounds what may be set from outside.",
    ),
    ("let", "`let name = value`: a value with a name."),
    (
        "body",
        "`body name { .. }`: something that moves: a coordinate, its inertia or mass, and what drives it.",
    ),
    (
        "states",
        "`states name { a -> b when guard { actions } .. }`: a machine, first in the state named first.",
    ),
    (
        "state",
        "`state name: type in low .. high [= first]`: a value that is kept from tick to tick.",
    ),
    (
        "next",
        "`next name = value`: what a `state` is in the next tick.",
    ),
    (
        "event",
        "`event name when guard { actions }`: happens when its guard becomes true.",
    ),
    (
        "emit",
        "`emit name(argument: value, ..)`: a message to the outside, such as `note(speed: ..)` and `release()`.",
    ),
    (
        "pulse",
        "`pulse name: type in low .. high lasting time`: a rectangle, begun by `fire`.",
    ),
    (
        "fire",
        "`fire pulse at value`: begins a pulse, from the next tick on.",
    ),
    (
        "force",
        "`force label = value`: a term of the force on the key; positive pushes the key up.",
    ),
    (
        "hold",
        "`hold body when guard`: the body stands still while the guard is true.",
    ),
    ("when", "`when guard`: under which condition."),
    ("if", "`if c then a else b`: a choice between values."),
    ("then", "`if c then a else b`: a choice between values."),
    ("else", "`if c then a else b`: a choice between values."),
    ("and", "`a and b`: both."),
    ("or", "`a or b`: one of them, or both."),
    ("not", "`not a`; `machine is not state`."),
    (
        "is",
        "`machine is state`: asks a machine for its state at the tick's start.",
    ),
    ("in", "`in low .. high`: a range."),
    ("on", "True."),
    ("off", "False."),
    (
        "every",
        "`event name every time`: an event that happens again and again.",
    ),
    (
        "over",
        "`over time`: the window of the differentiators behind `x'` and `x''`; longer is smoother and later.",
    ),
    (
        "slew",
        "`slew speed`: the fastest the sensed value may move; what is faster is held back.",
    ),
    (
        "lasting",
        "`lasting time`: how long a pulse is, or how far a delay line reaches back.",
    ),
    (
        "glide",
        "`glide time`: a live parameter moves towards what is set, at most over its whole range in this time.",
    ),
    ("at", "`fire pulse at value`: how strong."),
    (
        "angle",
        "`angle phi in low .. high [= first], rate in low .. high [= first]`: the coordinate of a body that turns.",
    ),
    (
        "position",
        "`position y in low .. high [= first], rate in low .. high [= first]`: the coordinate of a body that slides.",
    ),
    (
        "rate",
        "The range of a coordinate's rate; in a keyboard, ticks per second.",
    ),
    (
        "noise",
        "`noise name`: white noise, -1 .. 1, another number in every tick.",
    ),
    (
        "delay",
        "`delay name: type in low .. high lasting time`: a delay line; `name(t)` is what was fed `t` ago.",
    ),
    (
        "feed",
        "`feed delay = value`: what goes into a delay line in every tick.",
    ),
    (
        "sound",
        "`sound label = value`: a term of the sound, -1 .. 1; behind the label `on left` or `on right`.",
    ),
    (
        "string",
        "`string name along a .. b { .. }`: what moves all along between two ends; it has a `density`, loads and ends.",
    ),
    (
        "along",
        "`along a .. b`: where a string begins and ends, as lengths.",
    ),
    (
        "density",
        "`density value`: the mass of a string per length.",
    ),
    (
        "load",
        "`load tension * d2(u)`: a force per length all along a string, a sum of `d2(u)`, `d4(u)`, `u'` and `d2(u')` times values; loads are added.",
    ),
    (
        "ends",
        "`ends pinned`, `ends clamped`, or a word for each: how a string is held.",
    ),
    (
        "tuned",
        "`tuned tension to pitch` in a string: the tension at which it has that pitch; elsewhere `tuned(d, t)` reads a delay line.",
    ),
    ("to", "Before the pitch to which a string is tuned."),
    (
        "points",
        "`points value`: at how many points a string is computed; as many as are stable without it.",
    ),
    ("inertia", "`inertia value`: of a body that turns."),
    ("mass", "`mass value`: of a body that slides."),
    (
        "torque",
        "One of the torques that drive a body, or, with a label, that a knob feels; they are added.",
    ),
    (
        "friction",
        "`friction f(v) against w = force`, in a string with `at place` before `against`: acts against the slip `v`, the speed relative to `w` of this very tick; `f` is the force, `f.slip` the slip.",
    ),
    (
        "against",
        "`friction f(v) against w = force`: the speed that the slip is relative to.",
    ),
    (
        "board",
        "`board name`: what the keyboard's code runs on; `board name * 2` divides its keys over two.",
    ),
    (
        "device",
        "`device name`: sensor, converters, motor and key.",
    ),
    ("keys", "`keys low .. high`: the keys, by notes."),
    (
        "programs",
        "`programs a, b`: the programs of the keyboard: instruments, and zones by their names.",
    ),
    (
        "zones",
        "`zones name = { low .. high: instrument, .. }`: a program whose keys play different instruments; every key is in one zone.",
    ),
    (
        "bank",
        "`bank name over i in 0 .. n { .. }`: its declarations once for each member; outside `sum(name.x)` and `name[2].x`.",
    ),
    (
        "table",
        "`table name: type over type { place: value, .. }`, or `from \"file.csv\"`: knots with straight lines between them; `name(place)` is its value, held beyond the ends.",
    ),
    (
        "cubic",
        "`table name: type over type cubic { .. }`: smooth between its knots, without overshooting.",
    ),
    (
        "from",
        "`table name: type over type from \"file.csv\"`: knots from a file, whose titles have units (`x_mm,force_gf`).",
    ),
];

/// A function or a constant: name, how it is written, what it is.
pub const BUILT_IN: &[(&str, &str, &str)] = &[
    ("min", "min(a, b)", "The smaller of two values."),
    ("max", "max(a, b)", "The larger of two values."),
    (
        "clamp",
        "clamp(value, low, high)",
        "The value, not below `low` and not above `high`.",
    ),
    ("abs", "abs(value)", "The value without its sign."),
    ("gravity", "gravity", "9.80665 m/s^2, standard gravity."),
    ("pi", "pi", "3.14159.., the circle's number."),
    (
        "each",
        "each(a, b, ..)",
        "In a bank: the value of the member, one for each.",
    ),
    (
        "sum",
        "sum(bank.value)",
        "A value of all members of a bank, added in their order.",
    ),
];

/// What a word of the language means.
pub fn meaning(word: &str) -> Option<String> {
    let keyword = KEYWORDS
        .iter()
        .find(|(name, _)| *name == word)
        .map(|(_, what)| (*what).to_string());
    let built_in = BUILT_IN.iter().find(|(name, ..)| *name == word);
    keyword
        .or_else(|| built_in.map(|(_, shape, what)| format!("`{shape}`: {what}")))
        .or_else(|| dimension(word))
}

/// What a type means.
fn dimension(word: &str) -> Option<String> {
    let named = DIMENSIONS.iter().find(|d| d.name == word)?;
    Some(if named.unit.is_empty() {
        format!("`{word}`: no unit")
    } else {
        format!("`{word}`, in {}", named.unit)
    })
}

/// What a unit means.
pub fn unit(text: &str) -> Option<String> {
    let unit = parse_unit(text)?;
    let title = UNITS
        .iter()
        .find(|u| u.name == text)
        .map_or(String::new(), |u| format!(" ({})", u.title));
    let of = unit
        .dim
        .name()
        .map_or(String::new(), |name| format!(": a unit of {name}"));
    let si = unit.dim.unit();
    let worth = if text == si || unit.dim.is_number() {
        String::new()
    } else {
        format!("; 1 {text} = {} {si}", unit.factor())
    };
    Some(format!("`{text}`{title}{of}{worth}"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use whippen_compiler::syntax::token::{HARD_KEYWORDS, SOFT_KEYWORDS};

    #[test]
    fn every_keyword_is_explained() {
        let explained: Vec<&str> = KEYWORDS.iter().map(|(name, _)| *name).collect();
        assert_eq!(explained, [HARD_KEYWORDS, SOFT_KEYWORDS].concat());
        assert_eq!(
            unit("mN").as_deref(),
            Some("`mN` (millinewton): a unit of force; 1 mN = 0.001 N")
        );
        assert_eq!(unit("N*s/m").as_deref(), Some("`N*s/m`: a unit of damping"));
        assert_eq!(unit("apples"), None);
    }
}
