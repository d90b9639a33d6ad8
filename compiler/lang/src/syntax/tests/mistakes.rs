//! What is said about mistakes: each case is a text; the messages are kept as snapshots.

use super::*;
use crate::diag::{render, summary};
use whippen_source::SourceMap;

/// The text and everything that is said about it.
fn said(text: &str) -> String {
    let mut map = SourceMap::default();
    let file = map.add("test.whip", text);
    let mut diagnostics = Vec::new();
    parse(file, text, &mut diagnostics);
    let messages: String = diagnostics.iter().map(|d| render(&map, d, false)).collect();
    format!("{messages}{}\n", summary(&diagnostics))
}

macro_rules! mistakes {
    ($($name:ident $text:expr;)*) => { $(
        #[test]
        fn $name() {
            insta::with_settings!({ description => $text, omit_expression => true, prepend_module_to_snapshot => false }, {
                insta::assert_snapshot!(said($text));
            });
        }
    )* };
}

mistakes! {
    // Units and numbers
    unknown_unit "instrument i {\n    param k = 2 newtons\n    param l = 3 furlong/s\n    param m = 4 Nm\n}\n";
    unit_in_the_wrong_distance "instrument i {\n    param a = 2mm\n    param b = 2  mm\n    param c = 2 N m\n}\n";
    missing_times "instrument i {\n    param k = 2 N/m\n    sense x: length in 0 mm .. 10 mm over 1 ms\n    force a = 2 k\n    force b = 2 (x + x)\n    force c = 0.5 min(x, x)\n    force d = 2 N/m x\n}\n";
    bad_numbers "instrument i {\n    param a = 1.2.3\n    param b = .5 N\n    param c = 1. N\n    param d = 1e999 N\n    param e = 0x10\n    param f = 2k\n}\n";
    digits_apart "instrument i {\n    force a = 1 000 N\n    force b = 1_000 N\n    force c = 1.000,5 N\n}\n";
    // Characters
    stray_characters "instrument i {\n    param a = 2 $$ N\n    let b = a == 2; \n    let c = a && b || !b\n    let größe = 2 · a²\n}\n";
    block_comment "/* A comment\n   of two lines */\ninstrument i {}\n";
    no_text "äöü";
    // Brackets
    missing_brace_at_the_end "instrument i {\n    let a = b\n    event e when a { emit note(speed: a) }\n";
    missing_brace_of_a_machine "instrument i {\n    states s {\n        a -> b when c {\n            x := 1\n    let d = e\n}\n\ninstrument j {\n    let f = + 2\n}\n";
    missing_brace_before_the_next_block "instrument i {\n    let a = b\n\nterm t() -> r: bool {\n    r = on\n}\n";
    missing_parenthesis "instrument i {\n    let a = min(b, c\n    let d = (e\n    event f when (g { x := 1 }\n}\n";
    surplus_brackets "instrument i {\n    let a = b)\n    }\n    let c = d\n}\n}\n";
    too_deep_brackets { const DEEP: &str = concat!("instrument i { let a = ", "((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((b))))))))))))))))))))))))))))))))))))))))))))))))))))))))))))))))))", " }"); DEEP };
    missing_parenthesis_before_a_force_on_a_sense "instrument i {\n    event e when (a { x := 1\n    force f on z = b\n    torque g on w = c\n}\n";
    // Declarations
    two_mistakes_in_one_file "instrument i {\n    let a = 2 +\n    let b = a\n    event e a > 2 { emit note() }\n    force f = b\n}\n";
    left_out "instrument i {\n    force: a = 3 N\n    when x > 3 mm { emit release() }\n    states s { a -> b when c, b -> a when d }\n    event e when c { emit note(x') }\n    force f = 2 N * abs x\n}\n";
    missing_when "instrument i {\n    states s {\n        a -> b x > 2 mm\n        b -> a when x < 1 mm\n    }\n    event e { emit release() }\n    hold b\n}\n";
    missing_in "instrument i {\n    sense x: length\n    state y: force = 2 N\n    let z = x\n}\n";
    missing_equals "instrument i {\n    let a b\n    param c 2 N\n    force d: 3 N\n}\n";
    keyword_as_a_name "instrument in {\n    param let = 2\n    let state = 3\n    let on = 4\n    force when = 3 N\n    event hold when a > b {}\n}\n";
    declaration_outside "param k = 2\n\ninstrument i {\n    let a = k\n}\n\nlet b = 3\n";
    unknown_declaration "instrument i {\n    var a = 2\n    let b = 3\n    switch c { }\n    force d = b\n}\n";
    term_without_results "term t(x: length) {\n    r = x\n}\n\nterm u(x) -> r: length {\n    r = x\n}\n";
    unnamed_block "instrument {\n    let a = + b\n}\n";
    // Expressions
    chained_comparison "instrument i {\n    let a = 0 < b < 2\n    let c = d = e\n}\n";
    missing_else "instrument i {\n    let a = if b then c\n    let d = if e c else f\n}\n";
    empty_expression "instrument i {\n    let a =\n    let b = ()\n    let c = f(, 2)\n    let d = 2 * * 3\n}\n";
    too_deep_expression { const DEEP: &str = concat!("instrument i { let a = ", "--------------------------------------------------------------------------------------------------------------------------------------------------------------------------------------------------------------------------------------------------------------------------------b }"); DEEP };
    // Blocks
    wrong_transition "instrument i {\n    states s {\n        a => b when c\n        b when d\n        emit note()\n        b -> a when e\n    }\n}\n";
    wrong_action "instrument i {\n    event e when a {\n        x = 2\n        emit note\n        fire p 3 N\n        y := 2\n    }\n}\n";
    wrong_body "instrument i {\n    body b {\n        angle a in 0 rad .. 1 rad\n        mas 2 g\n        inertia 2 kg*m^2\n    }\n    let c = d\n}\n";
    wrong_keyboard "keyboard k {\n    bord rp2350\n    rate 44100 Hz\n    keys A0 to C8\n    programs a b\n    volume 3\n    a.weight = 2 N\n}\n";
    // Slips of other languages
    braces_of_a_choice "instrument i {\n    force a = if x > 1 mm { 1 N } else { 0 N }\n}\n";
    if_around_a_declaration "instrument i {\n    if x > 1 mm then force a = 1 N\n}\n";
    force_without_a_label "instrument i {\n    force = 1 N\n}\n";
    type_of_a_param "instrument i {\n    param k: stiffness = 1 N/m\n    live l = 2 N in 0 N .. 3 N\n}\n";
    state_for_states "instrument i {\n    state s {\n        a -> b when x > 1 mm\n    }\n}\n";
    keyword_as_an_event "instrument i {\n    event e when x > 1 mm { emit on() }\n}\n";
    action_without_braces "instrument i {\n    event e when x > 1 mm emit note(speed: v)\n    event g when x > 1 mm { note(speed: v) }\n}\n";
    device_in_quotes "keyboard k {\n    device \"my keys/own.toml\"\n    device \"not closed\n    board \"own\"\n}\n";
    // Whole files
    empty_file "";
    not_a_program "the quick brown fox\njumps over { the lazy } dog\n";
    windows_and_wide_characters "// Größe 漢字\r\ninstrument i {\r\n    param a = 2 N // µ\r\n    /* 漢字 */ param b = 漢 2\r\n}";
}
