//! Every rule with the interval that it gives, end by end: another one is refused.

use super::check_ranges;

/// What the operators of [`ROWS`] are applied to.
const GIVEN: &str = "
  in x: u16 [3..9]
  live l: i32 [-8..8] = 0
  cell a: i32 [-3..5] = 0
  cell b: i32 [2..7] = 2
  cell c: i32 [-4..9] = 0
  cell w: i64 [-100..200] = 0
  cell p: i1 [0..1] = 0
  cell q: i1 [1..1] = 1
  cell g: i32 x 3 [-6..6] = 0
  cell at: i32 [0..1] = 0
  cell n: i32 [-9..-2] = -2
  cell e: i32 [-9..2] = 0
  cell one: i32 [1..1] = 1
  cell five: i32 [5..9] = 5
  cell full: i32 [-2147483648..2147483647] = 0
  line d: 4 [-7..7]
  table t x 2 = { 1, -20, 3, 40, 5, 60 }
  event ev(2)
  probe pr: i64
  out y: i16 [-3..7]
  tick {
    v0: i32 [-3..5] = get a
    v1: i32 [2..7] = get b
    v2: i32 [-4..9] = get c
    v3: i64 [-100..200] = get w
    v4: i1 [0..1] = get p
    v5: i1 [1..1] = get q
    v6: i32 [0..1] = get at
    v7: i32 [-9..-2] = get n
    v8: i32 [-2147483648..2147483647] = get full
    v9: i32 [-9..2] = get e
    v10: i32 [1..1] = get one
    v11: i32 [5..9] = get five
";

/// An operator with its operands, and type and ends of its result.
const ROWS: &[(&str, &str, i64, i64)] = &[
    ("const -12", "i32", -12, -12),
    ("in x", "i32", 3, 9),
    ("live l", "i32", -8, 8),
    ("get_at g v6", "i32", -6, 6),
    ("delay d 4", "i32", -7, 7),
    ("delay_at d v6", "i32", -7, 7),
    ("tick 1", "i32", -2_147_483_648, 2_147_483_647),
    ("add v0 v1", "i32", -1, 12),
    ("add_wrap v0 v1", "i32", -1, 12),
    ("add_wrap v0 v8", "i32", -2_147_483_648, 2_147_483_647),
    ("add_sat v0 v1", "i32", -1, 12),
    ("add_sat v8 v1", "i32", -2_147_483_646, 2_147_483_647),
    ("sub v0 v1", "i32", -10, 3),
    ("sub_wrap v0 v1", "i32", -10, 3),
    ("sub_sat v0 v1", "i32", -10, 3),
    ("sub_sat v8 v1", "i32", -2_147_483_648, 2_147_483_645),
    ("mul v0 v1", "i32", -21, 35),
    ("mul_wide v0 v1", "i64", -21, 35),
    ("mul_wrap v0 v1", "i32", -21, 35),
    ("mac_wide v3 v0 v1", "i64", -121, 235),
    ("mul_top v8 v1", "i32", -3, 3),
    ("mac_top v0 v8 v1", "i32", -6, 8),
    ("min v0 v1", "i32", -3, 5),
    ("max v0 v1", "i32", 2, 7),
    ("shl v0 3", "i32", -24, 40),
    ("shl_wrap v0 3", "i32", -24, 40),
    ("sar v0 1", "i32", -2, 2),
    ("sar_round v0 1", "i32", -1, 3),
    ("div_round v0 v1 0", "i32", -1, 3),
    ("div_round v0 v1 2", "i32", -6, 10),
    ("div_round v1 v1 2", "i32", 1, 14),
    ("div_round v0 v7 0", "i32", -2, 2),
    ("div_round v0 v2 0", "i32", -5, 5),
    ("quot v0 v1 0", "i32", -2, 2),
    ("quot v0 v7 0", "i32", 0, 0),
    ("quot v0 v2 1", "i32", -7, 10),
    ("quot v8 v1 9", "i32", -536_870_912, 536_870_911),
    ("quot v8 v11 0", "i32", -429_509_838, 429_509_837),
    ("quot v0 v10 0", "i32", -4, 5),
    ("quot v6 v1 0", "i32", 0, 0),
    ("sqrt v3", "i32", 0, 14),
    ("widen v0", "i64", -3, 5),
    ("narrow v3", "i32", -100, 200),
    ("low v3", "i32", -100, 200),
    ("assume v0 -1 9", "i32", -1, 5),
    ("assume v0 -9 2", "i32", -3, 2),
    ("lt v0 v1", "i1", 0, 1),
    ("lt v7 v1", "i1", 1, 1),
    ("lt v1 v9", "i1", 0, 0),
    ("le v9 v1", "i1", 1, 1),
    ("le v1 v7", "i1", 0, 0),
    ("le v0 v1", "i1", 0, 1),
    ("eq v0 v1", "i1", 0, 1),
    ("eq v1 v7", "i1", 0, 0),
    ("eq v7 v1", "i1", 0, 0),
    ("eq v5 v5", "i1", 1, 1),
    ("eq v4 v4", "i1", 0, 1),
    ("eq v5 v4", "i1", 0, 1),
    ("and v4 v5", "i1", 0, 1),
    ("or v4 v5", "i1", 1, 1),
    ("not v5", "i1", 0, 0),
    ("select v4 v0 v1", "i32", -3, 7),
    ("select v5 v0 v1", "i32", -3, 5),
    ("lookup t v6 0", "i32", 1, 3),
    ("lookup t v6 1", "i32", -20, 40),
    ("lookup t v0 0", "i32", 1, 5),
];

fn text(statement: &str) -> String {
    format!("kernel k @44100 {{{GIVEN}    {statement}\n  }}\n}}\n")
}

fn is_taken(op: &str, ty: &str, low: i64, high: i64) -> bool {
    check_ranges(&text(&format!("v12: {ty} [{low}..{high}] = {op}"))).is_ok()
}

#[test]
fn every_operator_has_the_interval_of_its_operands() {
    for (op, ty, low, high) in ROWS {
        let found = check_ranges(&text(&format!("v12: {ty} [{low}..{high}] = {op}")));
        assert!(found.is_ok(), "{op}: {found:?}");
        for (low, high) in [(*low + 1, *high), (*low, *high - 1)] {
            assert!(!is_taken(op, ty, low, high), "{op} in [{low}..{high}]");
        }
    }
}

#[test]
fn what_is_stored_must_have_room() {
    let rows = [
        ("set a v0", true),
        ("set a v1", false),
        ("set_at g v6 v0", true),
        ("set_at g v6 v1", false),
        ("push d v1", true),
        ("push d v2", false),
    ];
    for (statement, has_room) in rows {
        let found = check_ranges(&text(statement));
        assert_eq!(found.is_ok(), has_room, "{statement}: {found:?}");
    }
}

#[test]
fn what_a_cell_holds_at_first_lies_in_its_range() {
    for (start, is_inside) in [(1, true), (2, true), (0, false), (3, false)] {
        let text = format!("kernel k @44100 {{\n  cell z: i32 [1..2] = {start}\n}}\n");
        assert_eq!(check_ranges(&text).is_ok(), is_inside, "{start}");
    }
}

#[test]
fn a_refusal_says_both_intervals() {
    let found = check_ranges(&text("v12: i32 [-3..4] = add v0 v1"));
    let why = found.expect_err("the sum is more").to_string();
    assert!(
        why.contains("[-3..4] is declared, [-1..12] is computed"),
        "{why}"
    );
}

/// A value lies in its type, and there is one.
#[test]
fn a_value_is_one_of_its_type() {
    for (statement, range) in [
        (
            "v12: i32 [-4294967296..4294967294] = add v8 v8",
            "[-4294967296..4294967294]",
        ),
        ("v12: i32 [9..5] = assume v0 9 20", "[9..5]"),
    ] {
        let says = format!("{range} does not lie in an i32");
        assert!(why(statement).ends_with(&says), "{}", why(statement));
    }
}

#[test]
fn promises_are_collected() {
    for statement in [
        "wave g g v1 v7 v1 v7 v1 v1",
        "v12: i32 [-1..5] = assume v0 -1 9",
    ] {
        let found = check_ranges(&text(statement)).expect("it is taken");
        assert_eq!(found[0].promises, [statement]);
        assert_eq!(found[0].kernel, "k");
    }
}

#[test]
fn a_table_has_no_more_columns_than_it_says() {
    let found = check_ranges(&text("v12: i32 [-20..60] = lookup t v6 2"));
    let why = found.expect_err("it has two").to_string();
    assert!(why.contains("reads no entry"), "{why}");
}

/// Why a statement behind the others is refused; empty where it is not.
fn why(statement: &str) -> String {
    let why = check_ranges(&text(statement)).err();
    why.map_or(String::new(), |why| why.why)
}

/// Operands, numbers and results are of the types that an operator has: nobody reads 64 bits where
/// there are 32.
#[test]
fn operators_have_types() {
    for statement in [
        "v12: i64 [-4294967296..4294967294] = add v8 v8",
        "v12: i32 [-103..205] = add v0 v3",
        "v12: i64 [-103..205] = add v0 v3",
        "v12: i1 [0..2] = add v4 v4",
        "v12: i64 [-21..35] = mul v0 v1",
        "v12: i32 [-21..35] = mul_wide v0 v1",
        "v12: i64 [-3..5] = get a",
        "v12: i32 [-3..5] = add v0",
        "v12: i32 [-3..5] = add v0 v0 v0",
        "add v0 v1",
        "v12: i32 [-1..12], v13: i32 [-1..12] = add v0 v1",
        "v12: i32 [-24..40] = shl v0",
        "v12: i32 [-24..40] = shl v0 3 3",
        "v12: i32 [3..9] = in x 1",
        "v12: u16 [3..9] = in x",
        "v12: i32 [-3..5] = select v0 v0 v0",
        "v12: i64 [-3..5] = select v5 v0 v3",
        "v12: i1 [0..1] = eq v0 v3",
        "v12: i32 [0..1] = lt v0 v1",
        "v12: i1 [0..1] = lt v4 v5",
        "set a v3",
        "set w v0",
        "set_at g v3 v0",
        "v12: i32 [3..9] = const 3",
        "emit ev v3",
        "probe pr v0",
        "out y v3",
    ] {
        let refused = why(statement);
        let types = "has operands, numbers or a result of other types";
        let other = "is declared, [3..3] is computed";
        assert!(
            refused.ends_with(types) || refused.ends_with(other),
            "{statement}: {refused}"
        );
    }
    for statement in [
        "set w v3",
        "emit ev",
        "emit ev v0 v1",
        "probe pr v3",
        "out y v0",
        "v12: i64 [7..7] = const 7",
        "v12: i1 [1..1] = const 1",
        "v12: i64 [-100..200] = select v5 v3 v3",
    ] {
        assert_eq!(why(statement), "");
    }
}

/// What an operator names is of its kind: a table of constants is no cell that changes.
#[test]
fn names_are_of_the_kind_of_their_operator() {
    for statement in [
        "v12: i32 [0..0] = lookup a v6 0",
        "v12: i32 [-3..5] = in a",
        "v12: i32 [3..9] = get x",
        "v12: i32 [3..9] = live x",
        "v12: i32 [3..9] = delay x 1",
        "set x v0",
        "push a v0",
        "out x v1",
        "wave g d v1 v7 v1 v7 v1 v1",
        "emit a v0",
        "v12: i32 [0..0] = get nothing",
    ] {
        assert!(
            why(statement).ends_with("names what is not declared"),
            "{statement}"
        );
    }
    assert!(why("v12: i32 [0..0] = nothing v0").ends_with("is no operator"));
}

#[test]
fn a_shift_beyond_its_word_is_refused() {
    for (op, width) in [
        ("v12: i32 [0..1] = div_round v0 v1", 32),
        ("v12: i32 [0..1] = quot v0 v1", 32),
        ("v12: i32 [0..1] = shl v0", 32),
        ("v12: i32 [0..1] = sar v0", 32),
        ("v12: i32 [0..1] = shl_wrap v0", 32),
        ("v12: i64 [0..1] = shl v3", 64),
        ("v12: i64 [0..1] = sar_round v3", 64),
    ] {
        let types = "has operands, numbers or a result of other types";
        for (shift, is_one) in [
            (-1, false),
            (0, true),
            (width - 1, true),
            (width, false),
            (200, false),
        ] {
            let refused = why(&format!("{op} {shift}"));
            assert_eq!(!refused.ends_with(types), is_one, "{op} {shift}: {refused}");
        }
    }
}

/// Both regions give as many values as there are results, of their types; the condition is one.
#[test]
fn an_if_gives_what_both_of_its_regions_give() {
    let chosen = |results: &str, condition: &str, then: &str, other: &str| {
        let regions = format!("{{\n {then}\n }} else {{\n {other}\n }}");
        why(&format!("{results} if {condition} {regions}"))
    };
    let one = "v12: i32 [-3..7] =";
    assert_eq!(chosen(one, "v4", "yield v0", "yield v1"), "");
    assert!(chosen("v12: i32 [-3..5] =", "v4", "yield v0", "yield v1").contains("[2..7]"));
    assert!(chosen("v12: i32 [2..7] =", "v4", "yield v0", "yield v1").contains("[-3..5]"));
    let larger = chosen("v12: i32 [-4..7] =", "v4", "yield v0", "yield v1");
    assert!(
        larger.ends_with("[-4..7] is declared, [-3..7] is computed"),
        "{larger}"
    );
    let count = "as many results as are computed are wanted";
    for (then, other) in [
        ("yield v0 v0", "yield v1"),
        ("yield v0", "yield v1 v1"),
        ("", "yield v1"),
    ] {
        assert!(
            chosen(one, "v4", then, other).ends_with(count),
            "{then} {other}"
        );
    }
    let types = chosen(one, "v4", "yield v0", "yield v3");
    assert!(
        types.ends_with("i32 is declared, i64 is computed"),
        "{types}"
    );
    assert!(chosen(one, "v0", "yield v0", "yield v1").ends_with("has no condition"));
    assert!(chosen(one, "v4 3", "yield v0", "yield v1").ends_with("has no condition"));
    assert!(chosen(one, "v4 v4", "yield v0", "yield v1").ends_with("two regions"));
    // Without the second region nothing is given; what is defined in one is known there alone.
    assert_eq!(why("if v4 {\n set a v0\n }"), "");
    assert_eq!(
        why("if v4 {\n v12: i32 [-3..5] = get a\n }\n v12: i32 [-3..5] = get a"),
        ""
    );
    let unknown = why("if v4 {\n v12: i32 [-3..5] = get a\n }\n set a v12");
    assert!(
        unknown.ends_with("v12 is not defined on the way here"),
        "{unknown}"
    );
    let twice = why("v0: i32 [-3..5] = get a");
    assert!(twice.ends_with("v0 is defined twice"), "{twice}");
    let empty = why("v12: i32 [5..4] = if v4 {\n yield v0\n } else {\n yield v1\n }");
    assert!(empty.contains("[5..4]"), "{empty}");
}

/// A loop runs once at least; what is carried has room for what it begins with and for what each
/// round gives.
#[test]
fn a_loop_has_room_for_what_each_round_gives() {
    let looped = |rounds: &str, params: &str, body: &str, result: &str| {
        why(&format!(
            "v14: i32 {result} = loop {rounds} ({params}) {{\n {body}\n }}"
        ))
    };
    let params = "v12: i32 [0..3], v13: i32 [-3..7] = v0";
    let one = |body| looped("4", params, body, "[2..7]");
    assert_eq!(one("yield v1"), "");
    assert_eq!(looped("4", params, "yield v13", "[-3..7]"), "");
    let once = "v12: i32 [0..0], v13: i32 [-3..7] = v0";
    assert_eq!(looped("1", once, "yield v1", "[2..7]"), "");
    assert!(one("yield v13").ends_with("[2..7] is declared, [-3..7] is computed"));
    assert!(one("yield v11").ends_with("[-3..7] is declared, [5..9] is computed"));
    assert!(one("yield v3").ends_with("i32 is declared, i64 is computed"));
    assert!(one("yield v1 v1").ends_with("as many results as are computed are wanted"));
    assert!(
        looped("5", params, "yield v1", "[2..7]")
            .ends_with("[0..3] is declared, [0..4] is computed")
    );
    for rounds in ["0", "-1", "-170141183460469231731687303715884105728"] {
        assert!(
            looped(rounds, params, "yield v1", "[2..7]").ends_with("has no rounds"),
            "{rounds}"
        );
    }
    assert!(looped("", params, "yield v1", "[2..7]").ends_with("has not one region"));
    assert!(looped("4 4", params, "yield v1", "[2..7]").ends_with("has not one region"));
    let small = "v12: i32 [0..3], v13: i32 [-2..7] = v0";
    assert!(
        looped("4", small, "yield v1", "[2..7]")
            .ends_with("[-2..7] is declared, [-3..5] is computed")
    );
    let wide = "v12: i64 [0..3], v13: i32 [-3..7] = v0";
    assert!(looped("4", wide, "yield v1", "[2..7]").ends_with("i64 is declared, i32 is computed"));
    // What it begins with stands in each parameter.
    let none = "v12: i32 [0..3], v13: i32 [-3..7]";
    let count = "as many results as are computed are wanted";
    assert!(looped("4", none, "yield v1", "[2..7]").ends_with(count));
    let found =
        check_ranges(&text("loop 2 (v12: i32 [0..1]) {\n set a v12\n }")).expect("it is taken");
    // Twelve that are given, and the round.
    assert_eq!((found[0].values, found[0].stores), (13, 1));
    let unknown = why("loop 2 (v12: i32 [0..1]) {\n set a v12\n }\n set a v12");
    assert!(
        unknown.ends_with("v12 is not defined on the way here"),
        "{unknown}"
    );
}

/// No more ticks ago than the line holds.
#[test]
fn a_line_is_read_as_far_as_it_goes() {
    for (back, is_there) in [(0, false), (1, true), (4, true), (5, false)] {
        let refused = why(&format!("v12: i32 [-7..7] = delay d {back}"));
        assert_eq!(refused.is_empty(), is_there, "{back}");
        assert!(is_there || refused.ends_with("the line holds 4 words"));
    }
}
