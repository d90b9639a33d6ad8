//! Where values lie, and what is said where nobody can tell.

mod problems;

use super::*;
use crate::check::Options;
use crate::diag::{Code, Severity, render};
use crate::front::compile_front;
use crate::model::dag::Real;
use crate::model::{DelayId, GridNumber, StrandId};
use whippen_rate::Rate;
use whippen_source::SourceMap;

/// The first instrument of a program at 1 kHz.
fn model_of(text: String) -> (SourceMap, Model) {
    let mut map = SourceMap::default();
    map.add("test.whip", text);
    let options = Options {
        rate_hz: Some(Rate::whole(1000)),
        ..Options::default()
    };
    let (program, found) = compile_front(&mut map, &options);
    let errors: String = found
        .iter()
        .filter(|d| d.severity() == Severity::Error)
        .map(|d| render(&map, d, false))
        .collect();
    let program = program.unwrap_or_else(|| panic!("{errors}"));
    (map, program.instruments.into_iter().next().expect("one"))
}

/// An instrument that senses `x`, 0 to 10 mm over three ticks.
fn model(body: &str) -> (SourceMap, Model) {
    let sense = "sense x: length in 0 mm .. 10 mm over 3 ms";
    model_of(format!("instrument i {{\n{sense}\n{body}\n}}\n"))
}

fn of(low: f64, high: f64) -> Interval {
    Interval { low, high }
}

/// Whether it is that interval, but for some roundings to the outside.
fn is(found: Interval, low: f64, high: f64) -> bool {
    let near = |end: f64, of: f64| (end - of).abs() <= 1e-12 * of.abs();
    found.contains(of(low, high)) && near(found.low, low) && near(found.high, high)
}

/// A string of 16 parts of 20 mm.
const STRING: &str = "string line along 0 m .. 0.32 m {
    position u in -8 mm .. 8 mm, rate in -40 m/s .. 40 m/s
    density 100 g/m load 10 N * d2(u) ends pinned points 15
    friction f(v) at 0.1 m against x' = 1 N * tanh(v / (1 mm/s)) }";

/// Declarations with a value `y`, and where that lies by hand (SI).
const VALUES: &[(&str, [f64; 2])] = &[
    ("let y = 3", [3.0, 3.0]),
    ("let y = x", [0.0, 0.01]),
    // From one end to the other within three ticks: half of it a tick, and the parabola over it.
    ("let y = x'", [-5.0, 5.0]),
    ("let y = x''", [-2e4, 2e4]),
    // Over five: weights -2 -1 0 1 2 by 10, and 2 -1 -2 -1 2 by 7.
    (
        "sense z: length in -5 mm .. 5 mm over 5 ms let y = z'",
        [-3.0, 3.0],
    ),
    (
        "sense z: length in -5 mm .. 5 mm over 5 ms let y = z''",
        [-4e4 / 7.0, 4e4 / 7.0],
    ),
    ("live param p = 1 in -2 .. 4 let y = p", [-2.0, 4.0]),
    ("live param p = on let y = p", [0.0, 1.0]),
    ("state s: number in -2 .. 4 let y = s", [-2.0, 4.0]),
    ("noise n let y = n", [-1.0, 1.0]),
    // Nothing was fed before the first tick.
    (
        "delay d: number in 2 .. 4 lasting 9 ms feed d = 3 let y = d(5 ms)",
        [0.0, 4.0],
    ),
    (
        "delay d: number in -3 .. 1 lasting 9 ms feed d = 0 let y = tuned(d, 5 ms)",
        [-10.001, 10.001],
    ),
    ("let y = x + 2 * x - 1 mm", [-0.001, 0.029]),
    ("let y = x - x", [-0.01, 0.01]),
    ("let d = x - 4 mm let y = d * d", [0.0, 3.6e-5]),
    ("let y = (x - 4 mm) * (x - 1 mm)", [-3.6e-5, 5.4e-5]),
    ("let y = x / (x + 10 mm)", [0.0, 1.0]),
    ("let y = -(x - 4 mm)", [-0.006, 0.004]),
    ("let y = min(x, 4 mm)", [0.0, 0.004]),
    ("let y = max(x, 4 mm)", [0.004, 0.01]),
    ("let y = abs(x - 4 mm)", [0.0, 0.006]),
    ("let y = (x / 1 mm)^1.5", [0.0, 31.622_776_601_683_793]),
    ("let y = sqrt(x / 1 mm + 6)", [2.449_489_742_783_178, 4.0]),
    ("let y = exp(x / 10 mm)", [1.0, std::f64::consts::E]),
    (
        "table t: force over length { 0 mm: 1 N, 5 mm: 3 N, 10 mm: 2 N } let y = t(x)",
        [1.0, 3.0],
    ),
    ("let y = x >= 0 mm", [1.0, 1.0]),
    ("let y = not (x >= 0 mm)", [0.0, 0.0]),
    ("let y = not (x > 4 mm)", [0.0, 1.0]),
    ("let y = x >= 0 mm and x > 4 mm", [0.0, 1.0]),
    ("let y = x < 0 mm and x > 4 mm", [0.0, 0.0]),
    ("let y = x >= 0 mm or x > 4 mm", [1.0, 1.0]),
    ("let y = x < 0 mm or x > 4 mm", [0.0, 1.0]),
    ("let y = if x > 4 mm then x else x + 20 mm", [0.0, 0.03]),
    ("let y = if x >= 0 mm then x else x + 20 mm", [0.0, 0.01]),
    ("let y = if x < 0 mm then x else x + 20 mm", [0.02, 0.03]),
    (
        "states m { a -> b when x > 4 mm b -> a when x < 1 mm } let y = if m is a then 1 else 2",
        [1.0, 2.0],
    ),
];

#[test]
fn values_lie_where_they_lie_by_hand() {
    for (body, [low, high]) in VALUES {
        let (_, model) = model(body);
        let found = analyze(&model).expect("bounded");
        let y = model.named.iter().find(|n| n.name == "y").expect("a value");
        let found = found.get(y.value);
        assert!(is(found, *low, *high), "{body}: {found:?}");
    }
}

/// What no program says, but a pass may make, in a graph that has grown since it was analyzed.
#[test]
fn nodes_that_passes_make() {
    let (_, mut model) = model(STRING);
    let known = analyze(&model).expect("bounded");
    let old = known.all().len();
    let s = StrandId(0);
    let dag = &mut model.dag;
    let (x, y) = (dag.add(Node::Sense(0)), dag.constant(2.0));
    let point = dag.constant(0.1);
    let between = dag.constant(0.11);
    let moving = dag.add(Node::Add(x, point));
    let terms = vec![(Real(-3.0), x), (Real(2.0), y)];
    let cases = [
        (Node::Linear(Real(1.0), terms), [4.97, 5.0]),
        (Node::Ratio(x, y, Real(4.0)), [0.0, 0.005]),
        (Node::Ratio(x, y, Real(0.001)), [0.0, 0.001]),
        (Node::Read(s, Reading::Displacement, point), [-0.008, 0.008]),
        (Node::Read(s, Reading::Rate, point), [-50.0, 50.0]),
        // 20 mm either way between neighbours, over 20 mm.
        (Node::Read(s, Reading::Slope, point), [-1.51, 1.51]),
        (Node::Mean(s, vec![point]), [-50.0, 50.0]),
        (Node::Spread(s, point), [1.0, 1.0]),
        (Node::Spread(s, between), [0.640625, 0.640625]),
        (Node::Spread(s, moving), [0.640625, 1.0]),
        (Node::Grid(s, GridNumber::PerMetre), [50.0, 50.0]),
        (Node::Bool(true), [1.0, 1.0]),
        (Node::SelectBool(y, x, y), [0.0, 2.0]),
    ];
    let cases = cases.map(|(node, ends)| (model.dag.add(node), ends));
    let found = known.extended_to(&model).expect("bounded");
    assert!(old < found.all().len() && found.all().len() == model.dag.len());
    for (id, [low, high]) in cases {
        let interval = found.get(id);
        let node = model.dag.get(id);
        assert!(is(interval, low, high), "{node:?}: {interval:?}");
    }
}

/// A mean of what lies beside its string is told as a place of a program is.
#[test]
fn a_mean_beside_its_string() {
    let (_, mut model) = model(STRING);
    let far = model.dag.constant(0.4);
    model.dag.add(Node::Mean(StrandId(0), vec![far]));
    let found = analyze(&model).expect_err("outside");
    assert_eq!(
        found.iter().map(|d| d.code).collect::<Vec<_>>(),
        [Code::OutsideString]
    );
}

/// A machine of one state is in it.
#[test]
fn a_machine_that_never_moves() {
    let (_, mut model) = model("states m { a -> b when x > 4 mm b -> a when x < 1 mm }");
    let machine = model.machines.ids().next().expect("one");
    let both = model.dag.add(Node::Is(machine, 0));
    assert_eq!(analyze(&model).expect("bounded").get(both), of(0.0, 1.0));
    model.machines[machine].states.truncate(1);
    assert_eq!(analyze(&model).expect("bounded").get(both), of(1.0, 1.0));
}

/// Of all intervals between whole numbers: what holds of all pairs is so, of none is not.
#[test]
fn comparisons_are_decided_only_where_all_pairs_agree() {
    type Holds = fn(&i32, &i32) -> bool;
    let comparisons: [(Cmp, Holds); 4] = [
        (Cmp::Lt, i32::lt),
        (Cmp::Le, i32::le),
        (Cmp::Gt, i32::gt),
        (Cmp::Ge, i32::ge),
    ];
    let intervals = || (0..4).flat_map(|low| (low..4).map(move |high| (low, high)));
    for ((a, b), (c, d)) in intervals().flat_map(|one| intervals().map(move |other| (one, other))) {
        for (cmp, holds) in comparisons {
            let mut pairs = (a..=b).flat_map(|x| (c..=d).map(move |y| holds(&x, &y)));
            let always = pairs.clone().all(|holds| holds);
            let expected = of(f64::from(always), f64::from(pairs.any(|holds| holds)));
            let [one, other] = [(a, b), (c, d)].map(|(low, high)| of(low.into(), high.into()));
            assert_eq!(
                compare(cmp, one, other),
                expected,
                "{one:?} {cmp:?} {other:?}"
            );
        }
    }
}

/// The largest that counts as bounded, and what is beyond.
#[test]
fn what_is_too_large_is_not_bounded() {
    let (_, mut model) = model("");
    let [most, beyond, negative] = [1e15, 1.001e15, -1.001e15].map(|c| model.dag.constant(c));
    let of_node = |id| transfer(&model, model.dag.get(id), |_| of(0.0, 0.0));
    assert_eq!(of_node(most), Ok(of(1e15, 1e15)));
    assert_eq!(of_node(beyond), Err(Problem::Unbounded));
    assert_eq!(of_node(negative), Err(Problem::Unbounded));
}

/// Times and places are rounded on their way, by less than a part in 10^9 of a tick or a string.
#[test]
fn ends_of_lines_and_strings_are_held_but_for_roundings() {
    let delayed = "delay d: number in -1 .. 1 lasting 9 ms feed d = 0";
    let (_, model) = model(&format!("{STRING} {delayed}"));
    let (line, strand) = (&model.delays[DelayId(0)], &model.strands[StrandId(0)]);
    let held = |low: f64, high: f64, least: f64| within_line(line, of(low, high), least).is_ok();
    assert!(held(1.0, 9.0, 1.0) && held(1.0 - 5e-10, 9.0 + 5e-10, 1.0));
    assert!(!held(1.0 - 1e-6, 9.0, 1.0) && !held(1.0, 9.0 + 1e-6, 1.0));
    assert!(held(1.3, 9.0, 1.3) && !held(1.2, 9.0, 1.3));
    let on = |low: f64, high: f64| along_string(strand, of(low, high)).is_ok();
    assert!(on(0.0, 0.32) && on(-1e-10, 0.32 + 1e-10));
    assert!(!on(-2e-9, 0.32) && !on(0.0, 0.32 + 2e-9));
}
