//! What the checker makes of small programs.

use super::super::Options;
use super::check_text;
use crate::model::{Action, CellId, Model, Node, PulseId, RuleKind};
use whippen_keyboard::{InstrumentId, KeyRange, Zone};

const SENSE: &str = "sense x: length in 0 mm .. 10 mm\n";

/// The Models of a program without errors.
fn models(text: &str, options: &Options) -> Vec<Model> {
    let (_, program, diagnostics) = check_text(text, options);
    program
        .unwrap_or_else(|| panic!("{diagnostics:?}"))
        .instruments
}

/// The Model of an instrument that senses `x` and holds `body`.
fn model(body: &str) -> Model {
    models(
        &format!("instrument i {{ {SENSE} {body} }}"),
        &Options::default(),
    )
    .remove(0)
}

fn set(name: &str, value: &str) -> Options {
    Options {
        sets: vec![(name.into(), value.into())],
        ..Options::default()
    }
}

/// The line of the text form that begins with `start`.
fn line(model: &Model, start: &str) -> String {
    let text = model.to_string();
    text.lines()
        .find(|l| l.starts_with(start))
        .unwrap_or_else(|| panic!("no `{start}` in\n{text}"))
        .to_string()
}

#[test]
fn declarations_may_stand_in_any_order() {
    let model =
        model("force f = b let b = a * k let a = x param k = 2 * half param half = 100 N/m");
    assert_eq!(line(&model, "b ="), "b = x * 200");
    assert_eq!(line(&model, "force f"), "force f = b");
    let names: Vec<&str> = model.named.iter().map(|n| n.name.as_str()).collect();
    assert_eq!(names, ["b", "a"]);
}

#[test]
fn numbers_are_si() {
    let model = model(
        "param m = 11.74 g param a = 90 deg let w = m * gravity let t = a * 2 / pi force f = w * t",
    );
    assert_eq!(
        line(&model, "w ="),
        format!("w = {}", 11.74 / 1000.0 * 9.80665)
    );
    assert_eq!(line(&model, "t ="), "t = 1");
}

#[test]
fn prime_of_a_product() {
    let model = model("let a = (x + 1 mm) * x let b = a' force f = b * 1 kg/m/s");
    assert_eq!(line(&model, "%1 ="), "%1 = x + 0.001");
    assert_eq!(line(&model, "b ="), "b = x' * x + %1 * x'");
}

/// The names of the forces of an instrument that holds a text, and its driven ports.
fn driven(body: &str) -> (Vec<String>, Vec<usize>) {
    let text = format!("instrument i {{ {body} }}");
    let model = models(&text, &Options::default()).remove(0);
    let names = model.forces.iter().map(|force| force.name.clone());
    (names.collect(), model.drives())
}

#[test]
fn forces_act_on_their_ports() {
    let senses = "sense x: length in 0 mm .. 10 mm sense tilt: angle in 0 deg .. 90 deg \
                  sense p: pressure in 0 Pa .. 1 kPa";
    let all = "torque t on tilt = 1 N*m force f = 1 N force g on x = 2 N";
    assert_eq!(
        driven(&format!("{senses} {all}")),
        (
            vec!["t.tilt".into(), "f.x".into(), "g.x".into()],
            vec![0, 1]
        )
    );
    let one = format!("{senses} torque t on tilt = 1 N*m");
    assert_eq!(driven(&one), (vec!["t".into()], vec![1]), "no other port");
    assert_eq!(driven(senses), (vec![], vec![]));
    let key = "sense x: length in 0 mm .. 10 mm";
    assert_eq!(driven(key), (vec![], vec![0]), "a key has a drive");
    let none = "sense p: pressure in 0 Pa .. 1 kPa";
    assert_eq!(driven(none), (vec![], vec![]));
    let below = "force f on y = 1 N sense x: length in 0 m .. 1 m sense y: length in 0 m .. 1 m";
    assert_eq!(driven(below), (vec!["f".into()], vec![1]));
}

#[test]
fn primes_go_through_terms_and_choices() {
    let text = "term lever(x: length, on_it: bool) -> y: length { y = if on_it then 2 * x else x }
        instrument i { sense x: length in 0 mm .. 10 mm live param both = on
            let y = lever(x, on_it: both) force f = y' * 1 N*s/m }";
    let (_, program, diagnostics) = check_text(text, &Options::default());
    let model = program.unwrap().instruments.remove(0);
    assert_eq!(
        line(&model, "force f"),
        "force f = (if both then 2 * x' else x') * 1"
    );
    assert_eq!(
        diagnostics
            .iter()
            .map(|d| d.code.number())
            .collect::<Vec<_>>(),
        ["WH0404"]
    );
}

#[test]
fn a_term_called_twice_has_two_memories() {
    let model = model(
        "let one = escapement(x, start: 1 mm, peak: 2 mm, end: 3 mm, height: 1 N)
         let two = escapement(x, start: 4 mm, peak: 5 mm, end: 6 mm, height: 2 N)
         force f = one.resistance + two.resistance
         force g = if escapement(x, 1 mm, 2 mm, 3 mm, 1 N).out then 1 N else 0 N",
    );
    let cells: Vec<&str> = model.cells.iter().map(|c| c.name.as_str()).collect();
    assert_eq!(cells, ["one.held", "two.held", "escapement_1.held"]);
    let machines: Vec<&str> = model.machines.iter().map(|m| m.name.as_str()).collect();
    assert_eq!(machines, ["one.jack", "two.jack", "escapement_1.jack"]);
    let inits: Vec<f64> = model.cells.iter().map(|c| c.init).collect();
    assert_eq!(inits, [1.0, 2.0, 1.0]);
    let named: Vec<&str> = model.named.iter().map(|n| n.name.as_str()).collect();
    let results = ["one.resistance", "one.out", "two.resistance", "two.out"];
    assert_eq!(
        named,
        [
            &results[..],
            &["escapement_1.resistance", "escapement_1.out"]
        ]
        .concat()
    );
}

#[test]
fn rules_of_a_call_stand_where_it_is_called() {
    let model = model(
        "event first when x > 1 mm { emit release() }
         force f = if t.out then 1 N else 0 N
         event second when t.out { emit release() }
         states m { a -> b when x > 2 mm  b -> a when x < 1 mm }
         let t = escapement(x, start: 1 mm, peak: 2 mm, end: 3 mm, height: 1 N)
         event third when x > 3 mm { emit release() }",
    );
    let names: Vec<String> = model.rules.iter().map(|r| model.rule_name(r)).collect();
    let steps = [
        "m: a -> b",
        "m: b -> a",
        "t.jack: under -> away",
        "t.jack: away -> under",
    ];
    assert_eq!(
        names,
        [&["first", "second"], &steps[..], &["third"]].concat()
    );
}

#[test]
fn a_result_that_does_not_depend_on_an_argument_breaks_the_circle() {
    let text = "term delay(v: length) -> y: length { state held: length in 0 mm .. 10 mm next held = v y = held }
        instrument i { sense x: length in 0 mm .. 10 mm let y = delay(v: z) let z = min(x, y) force f = z * 1 N/m }";
    let model = models(text, &Options::default()).remove(0);
    assert_eq!(line(&model, "next y.held"), "next y.held = z");
    assert_eq!(line(&model, "z ="), "z = min(x, y.held)");
}

#[test]
fn a_keyboard_may_be_on_several_chips() {
    let chips = |board: &str| {
        let instrument = "instrument i { sense x: length in 0 mm .. 10 mm force f = 0 N }";
        let text =
            format!("keyboard k {{ {board} rate 1 kHz keys C4 .. E4 programs i }} {instrument}");
        let (_, program, _) = check_text(&text, &Options::default());
        program.expect("it is right").keyboards[0].chips
    };
    assert_eq!(
        ["", "board rp2350", "board rp2350 * 16", "board rp2350*2"].map(chips),
        [1, 1, 16, 2]
    );
}

#[test]
fn per_key_values_are_linear_between_the_notes() {
    let text = "keyboard b { rate 1000 Hz keys C4 .. E4 programs i i.w = { C#4: 1 N, Eb4: 3 N } }
        instrument i { sense x: length in 0 mm .. 10 mm live param w = 0 N in 0 N .. 5 N force f = w }";
    let (_, program, _) = check_text(text, &Options::default());
    let program = program.unwrap();
    let model = &program.instruments[0];
    assert_eq!(model.keyed[0].values, [1.0, 1.0, 2.0, 3.0, 3.0]);
    assert_eq!(
        (model.keyed[0].range.low, model.keyed[0].range.high),
        (0.0, 5.0)
    );
    assert!(model.lives.is_empty());
    assert_eq!(
        (model.rate_hz, program.keyboards[0].layout.keys),
        (1000.into(), 5)
    );
    let set = models(text, &set("i.w", "2N")).remove(0);
    assert_eq!((set.keyed.len(), set.lives[0].value), (0, 2.0));
}

#[test]
fn a_program_has_zones() {
    let text = "keyboard b { rate 1000 Hz keys C4 .. E4 programs j, split, i i.w = { C4: 1 N, E4: 5 N }
            zones split = { D4 .. E4: i, C4 .. C4: j, Db4 .. C#4: i } }
        instrument i { sense x: length in 0 mm .. 10 mm live param w = 0 N in 0 N .. 5 N force f = w }
        instrument j { sense x: length in 0 mm .. 10 mm force f = 1 N }";
    let (_, program, diagnostics) = check_text(text, &Options::default());
    assert_eq!(diagnostics.len(), 0, "{diagnostics:?}");
    let program = program.unwrap();
    let layout = &program.keyboards[0].layout;
    let zones = |name: &str| layout.program_named(name).unwrap().zones.to_vec();
    let zone = |first, end, instrument| Zone {
        keys: KeyRange::new(first, end),
        instrument: InstrumentId(instrument),
    };
    assert_eq!(
        zones("split"),
        [zone(0, 1, 1), zone(1, 2, 0), zone(2, 5, 0)]
    );
    assert_eq!(zones("i"), [zone(0, 5, 0)]);
    assert_eq!(
        (layout.instruments(), layout.first_note, layout.keys),
        (vec![InstrumentId(1), InstrumentId(0)], 60, 5)
    );
    // Values by note, whatever zone a key is in.
    assert_eq!(
        program.instruments[0].keyed[0].values,
        [1.0, 2.0, 3.0, 4.0, 5.0]
    );
}

#[test]
fn the_caller_sets_parameters() {
    let text =
        "instrument i { sense x: length in 0 mm .. 10 mm param k = 100 N/m in 50 N/m .. 200 N/m
        live param heavy = off force f = if heavy then k * x else 0 N }";
    let one = models(text, &set("k", "0.15 N/mm")).remove(0);
    assert_eq!(
        line(&one, "force f"),
        "force f = if heavy then 150 * x else 0"
    );
    let two = models(text, &set("heavy", "on")).remove(0);
    assert_eq!(two.lives[0].value, 1.0);
}

#[test]
fn holds_are_joined_and_torques_added() {
    let model = model(
        "body weight { position y in 0 mm .. 50 mm = 5 mm, rate in -1 m/s .. 1 m/s mass 10 g
             force 1 N force -0.1 N*s/m * y' }
         hold weight when x > 5 mm
         hold weight when x < 1 mm
         force f = y * 1 N/m",
    );
    let expected =
        "body weight: y' += dt * ((1 + -0.1 * y') / 0.01), held while x > 0.005 or x < 0.001";
    assert_eq!(line(&model, "body"), expected);
    assert_eq!(
        (
            model.cells[CellId(0)].init,
            model.cells[CellId(1)].name.as_str()
        ),
        (0.005, "y'")
    );
}

#[test]
fn emissions_of_one_name_share_one_kind() {
    let model = model(
        "event a when x > 1 mm { emit pedal(depth: x, speed: x') emit note(speed: x') }
         event b when x > 2 mm { emit pedal(speed: 2 * x', depth: 1 mm) }
         force f = 0 N",
    );
    let kinds: Vec<&str> = model.emissions.iter().map(|e| e.name.as_str()).collect();
    assert_eq!(kinds, ["pedal", "note"]);
    let Action::Emit { args, .. } = &model.rules[1].actions[0] else {
        panic!("{:?}", model.rules[1])
    };
    assert_eq!(model.dag.real(args[0]), Some(0.001));
    assert!(matches!(model.dag.get(args[1]), Node::Mul(..)));
}

#[test]
fn machines_pulses_and_windows_count_in_states_and_ticks() {
    let model = model(
        "states m { up -> down when x > 1 mm  down -> up when m is not down  }
         pulse p: force in 0 N .. 1 N lasting 8 ms
         event e when m is up { fire p at 0.5 N }
         force f = p",
    );
    let RuleKind::Transition { from, to, .. } = model.rules[1].kind else {
        panic!("{:?}", model.rules[1])
    };
    assert_eq!((from, to), (1, 0));
    assert_eq!(
        (model.pulses[PulseId(0)].ticks, model.senses[0].window),
        (353, 31)
    );
}

#[test]
fn sweeping_keeps_what_is_used_and_its_places() {
    let model = model("param k = 3 N/m let unused = 2 * x force f = k * x");
    let used: Vec<String> = model.dag.nodes().map(|(_, n)| format!("{n:?}")).collect();
    assert_eq!(used.len(), 5, "{used:?}");
    assert_eq!(model.spans.len(), model.dag.len());
    assert!(model.spans.iter().all(Option::is_some));
}
