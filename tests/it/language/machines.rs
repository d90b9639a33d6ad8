//! Rules 2 and 3: machines and events.

use super::{both, close, instrument};

#[test]
fn a_machine_takes_one_step_a_tick() {
    let three = instrument(
        "states m {
             a -> b when x > 1 mm
             b -> c when x > 1 mm
             c -> a when x > 1 mm
         }
         let in_b = m is b",
    );
    both(&three, |p| {
        p.tick(0.0);
        for expected in ["a", "b", "c", "a", "b"] {
            p.tick(2e-3);
            assert_eq!(p.state("m"), expected);
            assert_eq!(
                p.value("in_b") == 1.0,
                expected == "b",
                "`is` asks for the state of the tick's start"
            );
        }
    });
}

#[test]
fn the_first_transition_that_may_go_goes() {
    let fork = instrument(
        "state which: number in 0 .. 10
         states m {
             a -> b when x > 6 mm { which := 1 }
             a -> c when x > 3 mm { which := 2 }
             a -> d when x > 1 mm { which := 3 }
             b -> a when x < 1 mm
             c -> a when x < 1 mm
             d -> a when x < 1 mm
         }",
    );
    both(&fork, |p| {
        for (x_m, state, which) in [(7e-3, "b", 1.0), (4e-3, "c", 2.0), (2e-3, "d", 3.0)] {
            p.tick(0.0);
            p.tick(0.0);
            assert_eq!(p.state("m"), "a");
            p.events();
            p.tick(x_m);
            assert_eq!(p.events(), [(format!("m: a -> {state}"), vec![])]);
            p.tick(x_m);
            assert_eq!(p.state("m"), state);
            close(p.value("which"), which, 1e-8);
            p.tick(0.0);
        }
    });
}

#[test]
fn machines_do_not_see_each_other_s_step() {
    let pair = instrument(
        "states m { a -> b when x > 1 mm }
         states n { a -> b when m is b }",
    );
    both(&pair, |p| {
        let seen: Vec<_> = (0..4)
            .map(|_| {
                p.tick(2e-3);
                (p.state("m"), p.state("n"))
            })
            .collect();
        assert_eq!(seen, [("a", "a"), ("b", "a"), ("b", "b"), ("b", "b")]);
    });
}

#[test]
fn an_event_is_an_edge_and_the_first_tick_is_none() {
    let tap = instrument("event tap when x > 5 mm { emit tapped(at: x) }");
    both(&tap, |p| {
        let mut at = |x_m: f64| {
            p.tick(x_m);
            p.count("tapped")
        };
        assert_eq!(
            [6e-3, 6e-3, 0.0, 6e-3, 7e-3, 4e-3, 5.1e-3].map(&mut at),
            [0, 0, 0, 1, 0, 0, 1]
        );
    });
    both(&tap, |p| {
        let mut at = |x_m: f64| {
            p.tick(x_m);
            p.count("tapped")
        };
        assert_eq!(
            [0.0, 6e-3, 6e-3].map(&mut at),
            [0, 1, 0],
            "true in the second tick is an edge"
        );
    });
}

#[test]
fn an_event_tells_the_values_of_its_tick() {
    let tap = instrument("event tap when x > 5 mm { emit tapped(at: x, twice: 2 * x) }");
    both(&tap, |p| {
        p.tick(0.0);
        p.tick(6.5e-3);
        let (_, args) = p
            .events()
            .into_iter()
            .find(|(name, _)| name == "tapped")
            .expect("an event");
        close(args[0], 6.5e-3, 1e-6);
        close(args[1], 13e-3, 2e-6);
    });
}
