//! What the parser makes of each construct.

use super::*;

/// An expression in brackets: every operator shows what it holds.
fn show(expr: &Expr) -> String {
    match &expr.kind {
        ExprKind::Number(n) => match &n.unit {
            Some(unit) => format!("{} {unit}", n.text),
            None => n.text.clone(),
        },
        ExprKind::Bool(b) => if *b { "on" } else { "off" }.to_string(),
        ExprKind::Name(name) => name.clone(),
        ExprKind::Field(base, name) => format!("{}.{}", show(base), name.node),
        ExprKind::Call(name, args) => {
            let arg = |a: &Arg| {
                a.name
                    .as_ref()
                    .map_or(String::new(), |n| format!("{}: ", n.node))
                    + &show(&a.value)
            };
            format!(
                "{}({})",
                name.node,
                args.iter().map(arg).collect::<Vec<_>>().join(", ")
            )
        }
        ExprKind::Prime(x) => format!("{}'", show(x)),
        ExprKind::Neg(x) => format!("(-{})", show(x)),
        ExprKind::Not(x) => format!("(not {})", show(x)),
        ExprKind::Binary(op, a, b) => format!("({} {op:?} {})", show(a), show(b)),
        ExprKind::Is {
            machine,
            state,
            negated,
        } => {
            format!(
                "({} is{} {})",
                machine.node,
                if *negated { " not" } else { "" },
                state.node
            )
        }
        ExprKind::If(c, a, b) => format!("(if {} then {} else {})", show(c), show(a), show(b)),
        ExprKind::Member(bank, index) => format!("{}[{}]", show(bank), show(index)),
        ExprKind::Error => "?".to_string(),
    }
}

fn expr(text: &str) -> String {
    match decls(&format!("let v = {text}")).remove(0) {
        DeclKind::Let { value, .. } => show(&value),
        other => panic!("{other:?}"),
    }
}

#[test]
fn operators_bind_as_the_manual_says() {
    assert_eq!(
        expr("a or b and not c < d"),
        "(a Or (b And (not (c Lt d))))"
    );
    assert_eq!(
        expr("a + b * c - d / e"),
        "((a Add (b Mul c)) Sub (d Div e))"
    );
    assert_eq!(expr("-a ^ 2 * b"), "((-(a Pow 2)) Mul b)");
    assert_eq!(expr("a ^ -1"), "(a Pow (-1))");
    assert_eq!(expr("a' ^ 2"), "(a' Pow 2)");
    assert_eq!(expr("a''"), "a''");
    assert_eq!(expr("(a + b)'"), "(a Add b)'");
    assert_eq!(expr("f(a, k: b + 1).out'"), "f(a, k: (b Add 1)).out'");
    assert_eq!(expr("-a + -b"), "((-a) Add (-b))");
    assert_eq!(
        expr("if a is b then c else d + e"),
        "(if (a is b) then c else (d Add e))"
    );
    assert_eq!(
        expr("if p then 1 else if q then 2 else 3"),
        "(if p then 1 else (if q then 2 else 3))"
    );
    assert_eq!(expr("m is not s and n is t"), "((m is not s) And (n is t))");
    assert_eq!(expr("a <= b or on"), "((a Le b) Or on)");
    assert_eq!(expr("f(a, b,)"), "f(a, b)");
    assert_eq!(expr("f()"), "f()");
}

#[test]
fn a_unit_follows_after_one_space() {
    assert_eq!(expr("20 N*s/m * squeeze"), "(20 N*s/m Mul squeeze)");
    assert_eq!(expr("1.54e-4 kg*m^2"), "1.54e-4 kg*m^2");
    assert_eq!(expr("3 N*k"), "(3 N Mul k)");
    assert_eq!(expr("2 m ^ 2"), "(2 m Pow 2)");
    assert_eq!(expr("1 - 2 m"), "(1 Sub 2 m)");
    assert_eq!(expr("0.5/m"), "(0.5 Div m)");
}

#[test]
fn ranges_and_points_are_told_apart() {
    for text in [
        "param p = 1 in 1..2",
        "param p = 1 in 1 .. 2",
        "param p = 1 in 1.5..2.5",
        "param p = 1 in a..b",
    ] {
        assert!(
            matches!(&decls(text)[0], DeclKind::Param { range: Some(_), .. }),
            "{text}"
        );
    }
    let DeclKind::Param {
        range: Some(range), ..
    } = decls("param p = 1 in 0.5 mm .. 3").remove(0)
    else {
        panic!()
    };
    assert_eq!(
        (show(&range.low), show(&range.high)),
        ("0.5 mm".to_string(), "3".to_string())
    );
}

#[test]
fn soft_keywords_are_names_elsewhere() {
    for word in super::super::token::SOFT_KEYWORDS {
        assert_eq!(
            expr(&format!("{word} + f({word}: {word}').{word}")),
            format!("({word} Add f({word}: {word}').{word})")
        );
        let text = format!(
            "param {word} = 1 in 0 .. {word}\nlet a = {word}\n{word} = {word}\nstates {word} {{ {word} -> {word} when {word} \
             {{ {word} := {word} {word}' := 1 fire {word} at {word} emit {word}({word}: {word}) }} }}\n\
             pulse {word}: {word} in {word} .. {word} lasting {word}\nforce {word} = {word}\nhold {word} when {word}\n\
             body {word} {{ angle {word} in {word} .. {word}, rate in {word} .. {word} = {word} torque {word} inertia {word} }}\n\
             sense {word}: {word} in {word} .. {word} slew {word} over {word}"
        );
        assert_eq!(decls(&text).len(), 9, "{word}");
        tree(&format!(
            "keyboard {word} {{ board {word} rate 1 keys {word} .. C#8 programs {word}, {word} zones {word} = {{ {word} .. C#8: {word} }} {word}.{word} = {{ {word}: 1 }} }}"
        ));
    }
}

#[test]
fn declarations_need_no_separators() {
    let kinds = decls(
        "let a = b c = d next e = f state g: force in 0 N .. h = h force i = jj kk = 2 ll = 3 zz = 4 N nn = 5",
    );
    assert_eq!(kinds.len(), 9);
    let DeclKind::State {
        init: Some(init), ..
    } = &kinds[3]
    else {
        panic!("{kinds:?}")
    };
    assert_eq!(show(init), "h");
}

#[test]
fn transitions_and_actions_need_no_separators() {
    let text = "states s { a -> b when c d -> e when f > 2 gg -> h when i { x := 1 y' := 2 z := w fire p at 3 q := 4 } }";
    let DeclKind::States { transitions, .. } = decls(text).remove(0) else {
        panic!()
    };
    assert_eq!(transitions.len(), 3);
    let actions = &transitions[2].actions;
    assert_eq!(actions.len(), 5);
    assert!(matches!(
        &actions[1].kind,
        ActionKind::Write { rate: true, .. }
    ));
}

#[test]
fn bodies_turn_or_slide() {
    let text = "body b { position y in -1 m .. 1 m = 0.5 m, rate in -2 m/s .. 2 m/s = 1 m/s mass 3 g force f force g }";
    let DeclKind::Body { parts, .. } = decls(text).remove(0) else {
        panic!()
    };
    assert!(matches!(
        &parts[0],
        BodyPart::Coordinate {
            angle: false,
            init: Some(_),
            rate_init: Some(_),
            ..
        }
    ));
    assert!(matches!(&parts[1], BodyPart::Inertia { angle: false, .. }));
    assert!(
        parts[2..]
            .iter()
            .all(|p| matches!(p, BodyPart::Torque { angle: false, .. }))
            && parts.len() == 4
    );
}

#[test]
fn keyboards_are_read() {
    let text = "keyboard k { board b device d rate 44.1 kHz keys F#1 .. C8 programs p, q p.w = { A0: 1 N, C#8: -2 N } \
         zones q = { F#1 .. B3: p, C4 .. C8: r, } }";
    let Item::Keyboard(keyboard) = tree(text).items.remove(0) else {
        panic!()
    };
    assert_eq!(keyboard.settings.len(), 7);
    let Setting::Keys(low, high) = &keyboard.settings[3] else {
        panic!()
    };
    assert_eq!((low.node.as_str(), high.node.as_str()), ("F#1", "C8"));
    let Setting::PerKey { points, .. } = &keyboard.settings[5] else {
        panic!()
    };
    assert_eq!(points[1].0.node, "C#8");
    let Setting::Zones { name, zones, span } = &keyboard.settings[6] else {
        panic!()
    };
    assert_eq!((name.node.as_str(), zones.len()), ("q", 2));
    let [low, high, instrument] =
        [&zones[0].low, &zones[0].high, &zones[0].instrument].map(|n| n.node.as_str());
    assert_eq!((low, high, instrument), ("F#1", "B3", "p"));
    assert_eq!(
        &text[span.start as usize..span.end as usize],
        "zones q = { F#1 .. B3: p, C4 .. C8: r, }"
    );
}

#[test]
fn what_a_force_acts_on_is_no_definition() {
    let file = tree(
        "instrument i { let a = on force f on z = 1 N torque torque on torque = 2 N*m z = 3 \
         let b = on c = 4 force g = if on then 1 N else 2 N }",
    );
    let Item::Instrument(i) = &file.items[0] else {
        panic!()
    };
    let shown = |decl: &Decl| {
        let (kind, name) = decl.kind.label();
        let on = match &decl.kind {
            DeclKind::Force { on: Some(on), .. } => format!(" on {}", on.node),
            _ => String::new(),
        };
        format!("{kind} {}{on}", name.node)
    };
    let all: Vec<String> = i.decls.iter().map(shown).collect();
    assert_eq!(
        all,
        [
            "let a",
            "force f on z",
            "torque torque on torque",
            "result z",
            "let b",
            "result c",
            "force g"
        ]
    );
}

#[test]
fn documentation_belongs_to_the_item_after_it() {
    let file = tree(
        "/// First line.\n//\n/// Second line.\n// no\ninstrument a { /// nothing\n }\n/// B\nterm b() -> r: bool {}",
    );
    let docs: Vec<&str> = file
        .items
        .iter()
        .map(|item| match item {
            Item::Instrument(i) => i.doc.as_str(),
            Item::Term(t) => t.doc.as_str(),
            Item::Keyboard(k) => k.doc.as_str(),
        })
        .collect();
    assert_eq!(docs, ["First line.\nSecond line.", "B"]);
}

#[test]
fn places_cover_what_was_written() {
    let text = "instrument i { let v = 2 * (a + b)' }";
    let file = tree(text);
    let Item::Instrument(i) = &file.items[0] else {
        panic!()
    };
    let source = |s: whippen_source::Span| &text[s.start as usize..s.end as usize];
    assert_eq!(source(i.span), text);
    assert_eq!(source(i.decls[0].span), "let v = 2 * (a + b)'");
    let DeclKind::Let { value, .. } = &i.decls[0].kind else {
        panic!()
    };
    assert_eq!(source(value.span), "2 * (a + b)'");
    let ExprKind::Binary(_, _, prime) = &value.kind else {
        panic!()
    };
    let ExprKind::Prime(inner) = &prime.kind else {
        panic!()
    };
    assert_eq!(
        (source(prime.span), source(inner.span)),
        ("(a + b)'", "(a + b)")
    );
}
