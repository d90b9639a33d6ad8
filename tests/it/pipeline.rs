//! The table of passes is what a run does: from a text to the proof, every pass reports its form
//! once, in the order of the table.

use std::fmt::Display;

use whippen_compiler::bundled::INSTRUMENTS;
use whippen_compiler::check::Options;
use whippen_compiler::keyboard::Layout;
use whippen_compiler::modes::INSTRUCTIONS;
use whippen_compiler::pipeline::{self, PASSES, Pass};
use whippen_compiler::source::SourceMap;
use whippen_runtime::board;
use whippen_runtime::device::Device;
use whippen_runtime::image::{ImageInstrument, setup_to_bound};

const KEYS: u32 = 4;
const FIRST_NOTE: u8 = 21;

/// All passes over the first instrument of a text, as they report themselves.
fn run_all_passes(name: &str, text: &str) -> Vec<(Pass, String)> {
    let mut reported = Vec::new();
    let mut observer = |pass: Pass, form: &dyn Display| reported.push((pass, form.to_string()));
    let mut map = SourceMap::default();
    map.add(name, text);
    let (program, diagnostics) =
        pipeline::front_observed(&mut map, &Options::default(), &mut observer);
    let program = program.unwrap_or_else(|| panic!("{name}: {diagnostics:#?}"));
    let model = program.instruments[0].clone();
    let (device, rate_hz) = (Device::of(&model), model.rate_hz);
    let board = board::bundled("rp2350").expect("it is bundled");
    let layout = Layout::of_one_instrument(&model.name, KEYS, FIRST_NOTE);
    let compiled = pipeline::compile_observed(model, &device.scales(), false, &mut observer)
        .unwrap_or_else(|e| panic!("{name}: {e:?}"));
    let instrument = ImageInstrument::new(&compiled, INSTRUCTIONS, None, &mut observer)
        .unwrap_or_else(|e| panic!("{name}: {e:?}"));
    let setup = setup_to_bound(&compiled, &device, KEYS, board.cores, FIRST_NOTE)
        .unwrap_or_else(|e| panic!("{name}: {e}"));
    let instruments = ImageInstrument::borrow_all(std::slice::from_ref(&instrument));
    let image = pipeline::build(&layout, &instruments, &setup, &board, &mut observer)
        .unwrap_or_else(|e| panic!("{name}: {e}"));
    pipeline::prove(&image, &board, rate_hz, &mut observer)
        .unwrap_or_else(|e| panic!("{name}: {e}"));
    reported
}

#[test]
fn a_whole_run_reports_the_passes_of_the_table() {
    let (name, text) = INSTRUMENTS
        .iter()
        .find(|(name, _)| *name == "hammond.whip")
        .expect("it is bundled");
    let reported = run_all_passes(name, text);
    let passes: Vec<Pass> = reported.iter().map(|(pass, _)| *pass).collect();
    assert_eq!(passes, PASSES);
    for (pass, form) in &reported {
        assert!(form.lines().count() > 1, "{}: {form:?}", pass.name());
    }
    let forms = |pair: &[(Pass, String)]| pair[0].1 != pair[1].1;
    assert!(
        reported.windows(2).all(forms),
        "each pass makes its own form"
    );
}
