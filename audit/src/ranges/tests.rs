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

#[test]
fn a_value_is_of_a_type_of_values() {
    let found = check_ranges(&text("v12: u16 [3..9] = in x"));
    let why = found
        .expect_err("a port has that type, a value has none")
        .to_string();
    assert!(why.contains("`u16` is no type"), "{why}");
}

#[test]
fn promises_are_collected() {
    for statement in [
        "wave g g v1 v7 v1 v7 v1 v1",
        "v12: i32 [-1..5] = assume v0 -1 9",
    ] {
        let found = check_ranges(&text(statement)).expect("it is taken");
        assert_eq!(found[0].promises, [statement]);
    }
}

#[test]
fn a_table_has_no_more_columns_than_it_says() {
    let found = check_ranges(&text("v12: i32 [-20..60] = lookup t v6 2"));
    let why = found.expect_err("it has two").to_string();
    assert!(why.contains("reads no entry"), "{why}");
}

#[test]
fn a_shift_beyond_its_word_is_refused() {
    for op in [
        "div_round v3 v1 32",
        "div_round v3 v1 200",
        "div_round v3 v1 -1",
        "quot v3 v1 32",
        "shl v3 64",
        "sar v3 64",
        "sar_round v3 64",
    ] {
        let found = check_ranges(&text(&format!("v12: i64 [0..1] = {op}")));
        let why = found.expect_err(op).to_string();
        let says = ["has no shift of a word", "is no operator of these operands"];
        assert!(says.iter().any(|says| why.contains(says)), "{op}: {why}");
    }
}
