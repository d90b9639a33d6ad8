//! `exp`, `log`, `sin`, `cos`, `tanh` and `sqrt` over every word of the sensor: the proven error is
//! kept, and is not much larger than what is seen.

use std::collections::BTreeSet;

use crate::common;
use whippen_compiler::kernel::{Immediate, Interp};

/// An expression of the program, the same in f64 of the position in millimetres, and how much of
/// its bound is seen at least.
type Case = (&'static str, fn(f64) -> f64, f64);

const CASES: &[Case] = &[
    ("exp(x / 1 mm)", |x| x.exp(), 0.8),
    ("exp(-x / 5 mm)", |x| (-x / 5.0).exp(), 0.7),
    // Far below the largest value it is as good as zero.
    ("exp(4 * x / 1 mm - 40)", |x| (4.0 * x - 40.0).exp(), 0.3),
    ("log(2 + x / 10 mm)", |x| (2.0 + x / 10.0).ln(), 0.7),
    // Many octaves.
    ("log(max(x / 1 mm, 0.01))", |x| x.max(0.01).ln(), 0.2),
    ("sin(x / 1 mm)", f64::sin, 0.8),
    // A small part of a turn, in fine units.
    ("sin(x / 3000 mm)", |x| (x / 3000.0).sin(), 0.03),
    // A thousand turns.
    ("sin(600 * x / 1 mm)", |x| (600.0 * x).sin(), 0.9),
    ("cos(x / 1 mm)", f64::cos, 0.8),
    ("cos(x / 20 mm)", |x| (x / 20.0).cos(), 0.8),
    ("tanh(x / 4 mm - 1)", |x| (x / 4.0 - 1.0).tanh(), 0.9),
    // Saturated at both ends.
    (
        "tanh(30 * x / 1 mm - 150)",
        |x| (30.0 * x - 150.0).tanh(),
        0.2,
    ),
    ("sqrt(2 + x / 1 mm)", |x| (2.0 + x).sqrt(), 0.9),
    ("sqrt(max(x / 1 mm, 0))", |x| x.max(0.0).sqrt(), 0.001),
];

#[test]
fn every_word_is_within_the_proven_error_and_that_is_no_guess() {
    let words: Vec<u16> = (0..=u16::MAX).collect();
    let mut missed = Vec::new();
    for (expression, exact, seen) in CASES {
        let text = format!(
            "instrument f {{
                sense x: length in -0.5 mm .. 10.5 mm over 0.7 ms
                let y = {expression}
                force f = y * 1e-30 N
            }}"
        );
        let compiled = common::compiled(expression, &text, &[]).remove(0);
        let exports = &compiled.lowered.exports;
        let at = exports.iter().position(|e| e.name == "y").unwrap();
        let sensed = exports.iter().position(|e| e.name == "x").unwrap();
        let mut interp = Interp::new(&compiled.lowered.kernel, 1).unwrap();
        let (mut drive, mut worst) = ([0_i16], 0.0_f64);
        interp.init(&[0]);
        for word in &words {
            interp.tick(&[*word], &mut drive);
            let probes = interp.probes();
            let x_mm = 1e3 * exports[sensed].value(probes[sensed]);
            let error = (exports[at].value(probes[at]) - exact(x_mm)).abs();
            worst = worst.max(error);
        }
        let bound = exports[at].error;
        println!("{expression}: {worst:.1e} of {bound:.1e}");
        assert!(
            worst <= bound * (1.0 + 1e-6),
            "{expression}: {worst:e} > {bound:e}"
        );
        missed.extend(
            (worst < seen * bound).then(|| format!("{expression}: {worst:e} of {bound:e}")),
        );
    }
    assert!(missed.is_empty(), "{missed:#?}");
}

/// A unit that is tried again finer makes its table again.
#[test]
fn every_table_of_a_kernel_is_looked_up() {
    let mut tables = 0;
    for compiled in common::all_and_programs() {
        let kernel = &compiled.lowered.kernel;
        let named: BTreeSet<i64> = kernel
            .all_insts()
            .flat_map(|inst| inst.op.row().immediates.iter().zip(inst.op.immediates()))
            .filter(|(kind, _)| **kind == Immediate::Table)
            .map(|(_, number)| number)
            .collect();
        assert_eq!(named.len(), kernel.tables.len(), "{}", kernel.name);
        tables += named.len();
        if kernel.name == "tables" {
            assert_eq!(named.len(), 4, "one for each table of the program");
        }
    }
    assert!(tables > 20, "{tables}");
}
