//! Programs with a mistake, and the codes they must give: exactly these, so that one mistake gives
//! one message.

mod keyboards;
mod slips;
mod strings;

pub use keyboards::KEYBOARDS;
pub use slips::SLIPS;
pub use strings::STRINGS;

/// A mistake: a name for the snapshot, the codes of its messages in the order of the text, the
/// program.
#[derive(Debug, Clone, Copy)]
pub struct Case {
    /// Name.
    pub name: &'static str,
    /// Codes.
    pub codes: &'static [&'static str],
    /// The program; what does not begin with a keyword of the top level stands in an instrument
    /// that senses `x`.
    pub text: &'static str,
}

const fn case(name: &'static str, codes: &'static [&'static str], text: &'static str) -> Case {
    Case { name, codes, text }
}

/// Names, terms, arguments.
pub const NAMES: &[Case] = &[
    case(
        "unknown name",
        &["WH0201"],
        "let lift = x force f = lft * 1 N/m",
    ),
    case(
        "unknown name in a term",
        &["WH0201"],
        "term t(a: length) -> b: length { b = a + offset }",
    ),
    case(
        "machine as a value",
        &["WH0201"],
        "states m { a -> b when x > 1 mm b -> a when x < 1 mm } force f = m * 1 N",
    ),
    case(
        "duplicate value",
        &["WH0202"],
        "let a = x let a = 2 * x force f = a * 1 N/m",
    ),
    case(
        "duplicate of another kind",
        &["WH0202"],
        "param k = 1 N/m state k: force in 0 N .. 1 N force f = k * x",
    ),
    case(
        "built-in name",
        &["WH0202"],
        "param gravity = 1.62 m/s^2 force f = 1 kg * gravity",
    ),
    case(
        "duplicate force",
        &["WH0202"],
        "force f = 1 N force f = 2 N",
    ),
    case(
        "duplicate event",
        &["WH0202"],
        "event e when x > 1 mm { } event e when x > 2 mm { }",
    ),
    case(
        "duplicate machine",
        &["WH0202"],
        "states m { a -> b when x > 1 mm } states m { a -> b when x > 2 mm }",
    ),
    case(
        "duplicate body",
        &["WH0202"],
        "body b { position y in 0 mm .. 1 mm, rate in -1 m/s .. 1 m/s mass 1 g }
         body b { position z in 0 mm .. 1 mm, rate in -1 m/s .. 1 m/s mass 1 g }",
    ),
    case(
        "duplicate instrument",
        &["WH0202"],
        "instrument i { force f = 1 N } instrument i { force f = 2 N }",
    ),
    case(
        "term named like a function",
        &["WH0202"],
        "term min(a: length) -> b: length { b = a }",
    ),
    case(
        "unknown term",
        &["WH0203"],
        "let jack = escapment(x, start: 1 mm) force f = jack.resistance",
    ),
    case(
        "unknown type",
        &["WH0204"],
        "state s: lenght in 0 mm .. 1 mm next s = x force f = s * 1 N/m",
    ),
    case(
        "unknown machine",
        &["WH0205"],
        "states gate { a -> b when x > 1 mm } force f = if gat is a then 1 N else 0 N",
    ),
    case(
        "value as a machine",
        &["WH0205"],
        "force f = if x is low then 1 N else 0 N",
    ),
    case(
        "unknown state",
        &["WH0206"],
        "states m { open -> shut when x > 1 mm } force f = if m is opn then 1 N else 0 N",
    ),
    case(
        "unknown body",
        &["WH0207"],
        "body hammer { angle a in 0 rad .. 1 rad, rate in -1 rad/s .. 1 rad/s inertia 1 kg*m^2 } hold hamer when x > 1 mm",
    ),
    case(
        "unknown result",
        &["WH0208"],
        "let j = escapement(x, 1 mm, 2 mm, 3 mm, 1 N) force f = j.resistence",
    ),
    case(
        "unknown argument",
        &["WH0209"],
        "force f = escapement(x, strat: 1 mm, peak: 2 mm, end: 3 mm, height: 1 N).resistance",
    ),
    case(
        "argument after a named one",
        &["WH0209"],
        "force f = escapement(x: x, 1 mm, peak: 2 mm, end: 3 mm, height: 1 N).resistance",
    ),
    case(
        "named argument of a function",
        &["WH0209"],
        "let a = min(x, b: 1 mm)",
    ),
    case(
        "unknown argument of an event",
        &["WH0209"],
        "event e when x > 1 mm { emit note(sped: x') }",
    ),
    case(
        "missing arguments",
        &["WH0210"],
        "force f = escapement(x, peak: 2 mm, height: 1 N).resistance",
    ),
    case(
        "missing argument of a function",
        &["WH0210"],
        "let a = clamp(x, 0 mm)",
    ),
    case(
        "missing argument of an event",
        &["WH0210"],
        "event e when x > 1 mm { emit note() }",
    ),
    case(
        "events of one name with different arguments",
        &["WH0209"],
        "event e when x > 1 mm { emit tap(at: x) } event f when x > 2 mm { emit tap(at: x, speed: x') }",
    ),
    case(
        "one argument too many",
        &["WH0211"],
        "term t(a: length) -> b: length { b = a } instrument i { let c = t(1 mm, 2 mm) }",
    ),
    case(
        "one argument too many of a function",
        &["WH0211"],
        "let a = abs(x, x)",
    ),
    case(
        "repeated argument",
        &["WH0212"],
        "force f = escapement(x, x: x, start: 1 mm, peak: 2 mm, end: 3 mm, height: 1 N).resistance",
    ),
    case(
        "repeated argument of an event",
        &["WH0212"],
        "event e when x > 1 mm { emit note(speed: x', speed: x') }",
    ),
    case(
        "missing result",
        &["WH0213"],
        "term t(a: length) -> b: length, c: bool { b = a }",
    ),
    case(
        "result without keyword",
        &["WH0214"],
        "lift = 2 * x force f = lift * 1 N/m",
    ),
    case(
        "result that is not declared",
        &["WH0214"],
        "term t(a: length) -> height: length { height = a heigth = a }",
    ),
    case(
        "sense in a term",
        &["WH0215"],
        "term t(a: length) -> b: length { sense y: length in 0 mm .. 1 mm b = y + a }",
    ),
    case(
        "force in a term",
        &["WH0215"],
        "term t(a: length) -> b: length { force f = 1 N b = a }",
    ),
    case(
        "recursive terms",
        &["WH0216", "WH0216"],
        "term up(a: length) -> b: length { b = down(a) } term down(a: length) -> b: length { b = up(a) }",
    ),
    case(
        "term of std hidden",
        &["WH0219"],
        "term escapement(x: length) -> y: length { y = x }",
    ),
    case(
        "function hidden",
        &["WH0219"],
        "term exp(x: length) -> y: length { y = 2 * x }
         instrument i { sense x: length in 0 mm .. 1 mm let a = exp(x) force f = 1 N/m * a }",
    ),
];

/// Types, dimensions, constants.
pub const TYPES: &[Case] = &[
    case(
        "sum of different dimensions",
        &["WH0301"],
        "param k = 8e3 N/m let a = x + k * x",
    ),
    case(
        "comparison of different dimensions",
        &["WH0301"],
        "event e when x > 1 N { }",
    ),
    case(
        "branches of different kinds",
        &["WH0301"],
        "let a = if x > 1 mm then 1 N else x",
    ),
    case(
        "min of different dimensions",
        &["WH0301"],
        "let a = min(x, 1 N)",
    ),
    case(
        "number and bool",
        &["WH0301"],
        "live param b = on let a = x + b",
    ),
    case(
        "param in another unit than its range",
        &["WH0302"],
        "param k = 80 N in 0 N/m .. 200 N/m force f = k * x",
    ),
    case(
        "param without unit, in a range with one",
        &["WH0303"],
        "param k = 80 in 0 N/m .. 200 N/m force f = k * x",
    ),
    case(
        "force of another dimension",
        &["WH0302"],
        "force f = 3 N/m + 2 N/m",
    ),
    case("bool as a force", &["WH0302"], "force f = x > 1 mm"),
    case(
        "number as a condition",
        &["WH0302"],
        "force f = if x then 1 N else 0 N",
    ),
    case(
        "and of numbers",
        &["WH0302", "WH0302"],
        "event e when x and x' { }",
    ),
    case("not of a number", &["WH0302"], "event e when not x { }"),
    case(
        "bools compared",
        &["WH0302"],
        "live param b = on live param c = on event e when b >= c { }",
    ),
    case("minus a bool", &["WH0302"], "live param b = on let a = -b"),
    case(
        "product with a bool",
        &["WH0302"],
        "live param b = on let a = 2 * b",
    ),
    case(
        "argument of another dimension",
        &["WH0302"],
        "force f = escapement(x, 1 mm, 2 mm, 3 mm, height: 5 mm).resistance",
    ),
    case(
        "result of another dimension",
        &["WH0302"],
        "term t(a: length) -> b: force { b = a }",
    ),
    case(
        "range of another dimension",
        &["WH0302"],
        "state s: force in 0 mm .. 1 N next s = 1 N",
    ),
    case(
        "written value of another dimension",
        &["WH0302"],
        "state s: force in 0 N .. 1 N event e when x > 1 mm { s := x }",
    ),
    case(
        "level of another dimension",
        &["WH0302"],
        "pulse p: force in 0 N .. 1 N lasting 1 ms event e when x > 1 mm { fire p at x }",
    ),
    case(
        "event argument of another dimension",
        &["WH0302"],
        "event e when x > 1 mm { emit note(speed: x) }",
    ),
    case(
        "bool as an event argument",
        &["WH0302"],
        "event e when x > 1 mm { emit tap(hard: on) }",
    ),
    case(
        "state of type bool",
        &["WH0302"],
        "state s: bool in 0 .. 1 next s = on",
    ),
    case(
        "range of a bool",
        &["WH0302"],
        "live param b = on in 0 .. 1",
    ),
    case("period of a force", &["WH0302"], "event e every 1 N { }"),
    case("prime of a bool", &["WH0302"], "let a = (x > 1 mm)'"),
    case("zero without unit", &["WH0303"], "event e when x > 0 { }"),
    case(
        "number without unit",
        &["WH0303"],
        "state s: length in 0 mm .. 10 next s = x",
    ),
    case(
        "call with several results as a value",
        &["WH0304"],
        "let j = escapement(x, 1 mm, 2 mm, 3 mm, 1 N) force f = j",
    ),
    case(
        "result of something that is no call",
        &["WH0305"],
        "let a = x.y",
    ),
    case("exponent", &["WH0306"], "let a = x^4"),
    case("negative exponent", &["WH0306"], "let a = x^-1"),
    case("fractional dimension", &["WH0307"], "let a = x^1.5"),
    case("root of a length", &["WH0307"], "let a = sqrt(x)"),
    case(
        "root of an area",
        &[],
        "let a = sqrt(x * x) force f = 1 N/m * a",
    ),
    case("sine of a length", &["WH0302"], "let a = sin(x)"),
    case(
        "sine of an angle",
        &[],
        "let a = sin(90 deg * x / 1 mm) force f = 1 N * a",
    ),
    case("two arguments", &["WH0211"], "let a = exp(x / 1 mm, 2)"),
    case(
        "length of a tick",
        &[],
        "let a = x' * tick force f = 1 N/m * a",
    ),
    case(
        "type as a unit",
        &[],
        "state a: kg/m in 0 kg/m .. 1 kg/m next a = 0.5 kg/m
         state b: 1/s in 0 s^-1 .. 1 s^-1 next b = clamp(x' / 1 mm, 0 s^-1, 1 s^-1)
         state c: m^2/s in 0 m^2/s .. 1 m^2/s force f = 1 N*s/m^2 * c + 1 N*m/kg * a",
    ),
    case(
        "type with a size",
        &["WH0204"],
        "state a: mm/s in 0 m/s .. 1 m/s",
    ),
    case("type of no unit", &["WH0204"], "state a: kg/lb in 0 .. 1"),
    case("own tick", &[], "let tick = x force f = 1 N/m * tick"),
    case(
        "changing range",
        &["WH0308"],
        "state s: length in 0 mm .. x next s = x",
    ),
    case(
        "live value as a constant",
        &["WH0308"],
        "live param w = 1 mm in 0 mm .. 2 mm state s: length in 0 mm .. w next s = x",
    ),
    case(
        "changing argument where a constant is needed",
        &["WH0308", "WH0308"],
        "force f = escapement(x, 1 mm, 2 mm, 3 mm, height: x * 1 N/m).resistance",
    ),
    case(
        "state of a machine as a constant",
        &["WH0308"],
        "states m { a -> b when x > 1 mm } param p = m is a",
    ),
    case(
        "infinite constant",
        &["WH0309"],
        "param k = 1 N / 0 m in 0 N/m .. 1 N/m",
    ),
];

/// Motion, time, memory.
pub const MOTION: &[Case] = &[
    case(
        "every",
        &[],
        "event e every 20 ms { emit depth(at: x) } force f = 1 N",
    ),
    case("every tick", &["WH0416"], "event e every 10 us { }"),
    case(
        "friction with a choice",
        &["WH0417"],
        "body b { position y in -1 mm .. 1 mm, rate in -1 m/s .. 1 m/s mass 1 g force -1 kN/m * y
         friction rub(v) against x' = if v > 0 m/s then 1 N else -1 N } force f = rub",
    ),
    case("too seldom", &["WH0416"], "event e every 3600 s { }"),
    case(
        "noise, a delay line, sound and a glide",
        &[],
        "noise n delay d: length in 0 mm .. 10 mm lasting 5 ms feed d = x \
         live param v = 0.5 in 0 .. 1 glide 20 ms let past = d(2 ms) let back = tuned(d, 1.5 ms) \
         sound a = v * n sound b on left = past / 1 m sound c on right = back / 1 m",
    ),
    case(
        "fed twice",
        &["WH0418"],
        "delay d: length in 0 mm .. 1 m lasting 5 ms feed d = x feed d = x",
    ),
    case(
        "never fed",
        &["WH0418"],
        "delay d: length in 0 mm .. 1 m lasting 5 ms let a = d(1 ms)",
    ),
    case(
        "feed of a state",
        &["WH0418"],
        "state s: length in 0 mm .. 1 m feed s = x",
    ),
    case(
        "feed of something else",
        &["WH0302"],
        "delay d: force in 0 N .. 1 N lasting 5 ms feed d = x",
    ),
    case(
        "a delay line as a value",
        &["WH0302"],
        "delay d: length in 0 mm .. 1 m lasting 5 ms feed d = x let a = d",
    ),
    case(
        "a delay line of two times",
        &["WH0210"],
        "delay d: length in 0 mm .. 1 m lasting 5 ms feed d = x let a = d(1 ms, 2 ms)",
    ),
    case(
        "a delay line and a length",
        &["WH0302"],
        "delay d: length in 0 mm .. 1 m lasting 5 ms feed d = x let a = d(1 mm)",
    ),
    case(
        "too long a delay line",
        &["WH0419"],
        "delay d: length in 0 mm .. 1 m lasting 60 s feed d = x",
    ),
    case("tuned of a value", &["WH0302"], "let a = tuned(x, 2 ms)"),
    case(
        "prime of what was",
        &["WH0402"],
        "delay d: length in 0 mm .. 1 m lasting 5 ms feed d = x let a = d(1 ms)'",
    ),
    case("prime of noise", &["WH0402"], "noise n let a = n'"),
    case(
        "prime of a glide",
        &["WH0402"],
        "live param v = 0.5 in 0 .. 1 glide 20 ms let a = (v * x)'",
    ),
    case(
        "a glide of a constant",
        &["WH0420"],
        "param v = 0.5 in 0 .. 1 glide 20 ms",
    ),
    case(
        "a glide of a bool",
        &["WH0420"],
        "live param v = on glide 20 ms",
    ),
    case(
        "a glide in metres",
        &["WH0302"],
        "live param v = 0.5 in 0 .. 1 glide 20 mm",
    ),
    case(
        "tables",
        &[],
        "param top = 2 N table t: force over length { 0 mm: 0 N, 4 mm: top, 10 mm: 5 N } \
         table s: N*s/m over speed cubic { -1 m/s: 1 N*s/m, 0 m/s: 2 N*s/m, 1 m/s: 4 N*s/m } \
         let slope = t(x)' force f = t(x) force g = s(clamp(x', -1 m/s, 1 m/s)) * x' \
         table constant: number over number { 0: 1, 1: 2 } \
         table other: number over number { 0: 1, constant(0.5): 2 } force h = other(0.1) * 1 N",
    ),
    case(
        "a table beyond its knots",
        &["WH0530"],
        "table t: force over length { 0 mm: 0 N, 4 mm: 2 N } force f = t(x)",
    ),
    case(
        "knots that fall",
        &["WH0531"],
        "table t: force over length { 0 mm: 0 N, 4 mm: 2 N, 3 mm: 5 N } force f = t(x)",
    ),
    case(
        "one knot",
        &["WH0531"],
        "table t: force over length { 0 mm: 0 N } force f = t(x)",
    ),
    case(
        "a knot in other units",
        &["WH0302"],
        "table t: force over length { 0 mm: 0 N, 4 mm: 2 mm } force f = t(x)",
    ),
    case(
        "a knot that moves",
        &["WH0308"],
        "table t: force over length { 0 mm: 0 N, x: 2 N } force f = t(x)",
    ),
    case(
        "a table without its file",
        &["WH0532"],
        "table t: force over length from \"none.csv\" force f = t(x)",
    ),
    case(
        "a table as a value",
        &["WH0302"],
        "table t: force over length { 0 mm: 0 N, 10 mm: 2 N } force f = t",
    ),
    case(
        "a table at two places",
        &["WH0210"],
        "table t: force over length { 0 mm: 0 N, 10 mm: 2 N } force f = t(x, x)",
    ),
    case(
        "a table at a speed",
        &["WH0302"],
        "table t: force over length { 0 mm: 0 N, 10 mm: 2 N } force f = t(x')",
    ),
    case(
        "a table of itself",
        &["WH0401"],
        "table t: number over number { 0: 0, t(1): 2 } force f = t(0.5) * 1 N",
    ),
    case(
        "the second prime of a table",
        &["WH0402"],
        "table t: force over length cubic { 0 mm: 0 N, 10 mm: 2 N } let a = t(x)''",
    ),
    case("a bank from 1", &["WH0427"], "bank b over i in 1 .. 4 { }"),
    case("a bank of 65", &["WH0427"], "bank b over i in 0 .. 64 { }"),
    case(
        "a bank of metres",
        &["WH0427"],
        "bank b over i in 0 m .. 3 m { }",
    ),
    case(
        "a bank in a bank",
        &["WH0428"],
        "bank b over i in 0 .. 3 { bank c over j in 0 .. 3 { let y = x } }",
    ),
    case(
        "force in a bank",
        &["WH0428"],
        "bank b over i in 0 .. 3 { force f = 1 N }",
    ),
    case(
        "a member writes outside",
        &["WH0428"],
        "state s: length in 0 mm .. 1 mm bank b over i in 0 .. 3 { next s = 1 mm }",
    ),
    case(
        "a member reads another",
        &["WH0429"],
        "bank b over i in 0 .. 3 { let y = x let z = y + b[0].y }",
    ),
    case(
        "a member reads all by way of a value",
        &["WH0429"],
        "bank b over i in 0 .. 3 { let y = x let z = y + all } let all = sum(b.y)",
    ),
    case("each outside", &["WH0622"], "let a = each(1, 2)"),
    case(
        "each of three for four",
        &["WH0622"],
        "bank b over i in 0 .. 3 { let a = each(1, 2, 3) }",
    ),
    case(
        "each of two types",
        &["WH0302"],
        "bank b over i in 0 .. 1 { let a = each(1 mm, 2 N) }",
    ),
    case(
        "a member outside",
        &["WH0623"],
        "bank b over i in 0 .. 3 { let y = x } let a = b[4].y",
    ),
    case(
        "a number that changes",
        &["WH0308"],
        "bank b over i in 0 .. 3 { let y = x } let a = b[x / 1 mm].y",
    ),
    case(
        "sum of what is not there",
        &["WH0623"],
        "bank b over i in 0 .. 3 { let y = x } let a = sum(b.z)",
    ),
    case("sum of no bank", &["WH0623"], "let a = sum(x)"),
    case(
        "a bank as a value",
        &["WH0623"],
        "bank b over i in 0 .. 3 { let y = x } let a = b.y",
    ),
    case("a side between", &["WH0620"], "sound a on middle = 0.5"),
    case("sound in metres", &["WH0302"], "sound a = x"),
    case(
        "two sounds of a name",
        &["WH0202"],
        "sound a = 0.5 sound a = 0.2",
    ),
    case(
        "a sound on the left and on the right",
        &[],
        "sound a on left = 0.5 sound a on right = 0.2 sound b on right = 0.1",
    ),
    case(
        "a sound on both sides, and on the left",
        &["WH0202"],
        "sound a = 0.5 sound a on left = 0.2",
    ),
    case(
        "a word that is taken, used",
        &["WH0102"],
        "let off = 3 N/m * x let a = 2 * off force f on x = off force g = max(off, a)",
    ),
    case(
        "circle",
        &["WH0401"],
        "let a = b + 1 mm let b = c / 2 let c = a",
    ),
    case(
        "circle through a term",
        &["WH0401"],
        "let j = escapement(y, 1 mm, 2 mm, 3 mm, 1 N) let y = j.resistance * 1 mm/N",
    ),
    case(
        "circle of parameters",
        &["WH0401"],
        "param a = 2 * b param b = a / 2",
    ),
    case("third prime", &["WH0402"], "let a = x'''"),
    case(
        "second prime of a coordinate",
        &["WH0402"],
        "body b { angle phi in 0 rad .. 1 rad, rate in -1 rad/s .. 1 rad/s inertia 1 kg*m^2 } let a = phi''",
    ),
    case(
        "prime of a state",
        &["WH0402"],
        "state s: length in 0 mm .. 10 mm next s = x let a = (x - s)'",
    ),
    case(
        "prime of a pulse",
        &["WH0402"],
        "pulse p: force in 0 N .. 1 N lasting 1 ms let a = p'",
    ),
    case(
        "prime of a comparing choice",
        &["WH0403"],
        "let a = if x > 3 mm then x else 2 * x let b = a'",
    ),
    case(
        "jump of a mode",
        &["WH0404"],
        "live param m = on let a = if m then x else 2 * x let b = a' let c = a'",
    ),
    case(
        "write to a let",
        &["WH0405"],
        "let a = x event e when x > 1 mm { a := 0 mm }",
    ),
    case(
        "write to a param",
        &["WH0405"],
        "param a = 1 mm event e when x > 1 mm { a := 0 mm }",
    ),
    case(
        "write to what is measured",
        &["WH0405"],
        "event e when x > 1 mm { x := 0 mm }",
    ),
    case(
        "write to a pulse",
        &["WH0405"],
        "pulse p: force in 0 N .. 1 N lasting 1 ms event e when x > 1 mm { p := 1 N }",
    ),
    case(
        "write to a parameter of the term",
        &["WH0405"],
        "term t(a: length) -> b: length { b = a event e when a > 1 mm { a := 0 mm } }",
    ),
    case(
        "rate of a state",
        &["WH0405"],
        "state s: length in 0 mm .. 1 mm event e when x > 1 mm { s' := 1 mm/s }",
    ),
    case("next of a let", &["WH0406"], "let a = x next a = 2 * x"),
    case(
        "two next values",
        &["WH0407"],
        "state s: length in 0 mm .. 10 mm next s = x next s = 2 * x",
    ),
    case(
        "fire of a state",
        &["WH0408"],
        "state s: force in 0 N .. 1 N next s = s event e when x > 1 mm { fire s at 1 N }",
    ),
    case(
        "two writers",
        &["WH0409"],
        "state s: length in 0 mm .. 10 mm
         event up when x > 1 mm { s := x }
         event down when x' < 0 mm/s { s := 0 mm }",
    ),
    case(
        "two writes of one rule",
        &["WH0409"],
        "state s: length in 0 mm .. 10 mm event e when x > 1 mm { s := x s := x / 2 }",
    ),
    case(
        "empty machine",
        &["WH0410"],
        "states m { } force f = if m is a then 1 N else 0 N",
    ),
    case(
        "unreachable state",
        &["WH0411"],
        "states m { open -> shut when x > 1 mm shutt -> open when x < 1 mm }",
    ),
    case(
        "idle step",
        &["WH0412"],
        "states m { a -> a when x > 1 mm }",
    ),
];

/// Ranges, bodies.
pub const RANGES: &[Case] = &[
    case(
        "first value outside",
        &["WH0503"],
        "state s: force in 0 N .. 1 N = 2 N next s = s",
    ),
    case(
        "zero outside",
        &["WH0503"],
        "state s: force in 1 N .. 2 N next s = s",
    ),
    case(
        "swapped range",
        &["WH0505"],
        "state s: force in 2 N .. 1 N next s = s",
    ),
    case("empty range", &["WH0505"], "param k = 1 N in 1 N .. 1 N"),
    case(
        "clamp to nothing",
        &["WH0505"],
        "let a = clamp(x, 2 mm, 1 mm)",
    ),
    case(
        "live param without range",
        &["WH0506"],
        "live param w = 1 N force f = w",
    ),
    case(
        "param outside its range",
        &["WH0507"],
        "param k = 3 N/m in 0 N/m .. 2 N/m force f = k * x",
    ),
    case(
        "pulse without zero",
        &["WH0508"],
        "pulse p: force in 1 N .. 2 N lasting 1 ms",
    ),
    case(
        "massless body",
        &["WH0509"],
        "body b { position y in 0 mm .. 1 mm, rate in -1 m/s .. 1 m/s mass 0 g }",
    ),
    case(
        "pulse of no duration",
        &["WH0509"],
        "pulse p: force in 0 N .. 2 N lasting 0 ms",
    ),
    case(
        "window of no duration",
        &["WH0509"],
        "instrument i { sense y: length in 0 mm .. 1 mm over -1 ms }",
    ),
    case(
        "window too long",
        &["WH0510"],
        "instrument i { sense y: length in 0 mm .. 1 mm over 1 s }",
    ),
    case(
        "body without coordinate",
        &["WH0601"],
        "body b { mass 1 g } hold b when x > 1 mm",
    ),
    case(
        "body without mass",
        &["WH0601"],
        "body b { position y in 0 mm .. 1 mm, rate in -1 m/s .. 1 m/s }",
    ),
    case(
        "body with two coordinates",
        &["WH0601"],
        "body b { position y in 0 mm .. 1 mm, rate in -1 m/s .. 1 m/s mass 1 g
                  position z in 0 mm .. 1 mm, rate in -1 m/s .. 1 m/s } force f = z * 1 N/m",
    ),
    case(
        "body with two masses",
        &["WH0601"],
        "body b { position y in 0 mm .. 1 mm, rate in -1 m/s .. 1 m/s mass 1 g mass 2 g }",
    ),
    case(
        "torque on a sliding body",
        &["WH0602"],
        "body b { position y in 0 mm .. 1 mm, rate in -1 m/s .. 1 m/s mass 1 g torque 1 N*m }",
    ),
    case(
        "mass of a turning body",
        &["WH0602"],
        "body b { angle phi in 0 rad .. 1 rad, rate in -1 rad/s .. 1 rad/s mass 1 g }",
    ),
    case(
        "force on a knob",
        &["WH0610"],
        "instrument dial { sense angle: angle in -90 deg .. 90 deg force pull = 1 N }",
    ),
    case("torque on a key", &["WH0610"], "torque pull = 1 N*m"),
    case(
        "force on a pressure",
        &["WH0610"],
        "instrument i { sense p: pressure in 0 Pa .. 100 kPa force f = 1 N }",
    ),
    case(
        "force on a turning port",
        &["WH0610"],
        "instrument i { sense x: length in 0 mm .. 10 mm sense tilt: angle in 0 deg .. 90 deg force f on tilt = 1 N }",
    ),
    case(
        "torque on a number",
        &["WH0610"],
        "instrument i { sense tilt: angle in 0 deg .. 90 deg sense n: number in 0 .. 1 torque f on n = 1 N*m }",
    ),
    case("force on no sense", &["WH0201"], "force f on y = 1 N"),
    case(
        "force on a misspelt sense",
        &["WH0201"],
        "instrument i { sense across: length in 0 mm .. 10 mm force f on acros = 1 N }",
    ),
    case(
        "label twice on one port",
        &["WH0202"],
        "instrument i { sense x: length in 0 mm .. 10 mm sense y: length in 0 mm .. 10 mm
                        force f on y = 1 N force f = 1 N force f on x = 1 N }",
    ),
    case(
        "torque in the wrong unit",
        &["WH0302"],
        "instrument dial { sense angle: angle in -90 deg .. 90 deg torque pull = 1 N }",
    ),
    case(
        "torque in a term",
        &["WH0215"],
        "term t(a: angle) -> b: angle { b = a torque pull = 1 N*m }",
    ),
    case(
        "force on a turning body in the wrong unit",
        &["WH0302"],
        "body b { angle phi in 0 rad .. 1 rad, rate in -1 rad/s .. 1 rad/s inertia 1 kg*m^2 torque 1 N }",
    ),
];
