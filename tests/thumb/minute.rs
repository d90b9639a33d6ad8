//! The instruments with strings, each as one piece of code on one emulated Cortex-M33, under words
//! and live values at random.
//!
//! A moment belongs to the tests; a full minute is
//! `WHIPPEN_TICKS=2646000 cargo test --test thumb minute`.

use crate::common;
use crate::target::Target;
use crate::words::{Words, ticks};
use whippen_compiler::kernel::{Interp, without_probes};
use whippen_compiler::modes::Modes;
use whippen_emulator::CoreKind;

/// Compares drive words and events of every tick, and what is left in memory.
fn play(file: &str) {
    let compiled = common::instruments(file, &[]).remove(0);
    let kernel = without_probes(&compiled.lowered.kernel);
    let mut interp = Interp::new(&kernel, 1).expect("verifies");
    let mut target = Target::new(&Modes::single(&kernel), 1, CoreKind::CortexM33);
    let mut random = Words::new(&kernel);
    let mut drive = vec![0; kernel.outputs.len()];
    let mut cycles = 0;
    for tick in 0..ticks() {
        let (set, words) = random.turn(&kernel);
        if let Some((live, word)) = set {
            interp.set_live(live, word).expect("is live");
            target.set_live(live, word);
        }
        if tick == 0 {
            interp.init(words);
            target.init(words);
        }
        interp.tick(words, &mut drive);
        assert_eq!(target.tick(words), drive, "{file}: tick {tick}");
        cycles = cycles.max(target.cycles);
        let found = target.drain_events();
        assert_eq!(found, (interp.drain_events(), 0), "{file}: tick {tick}");
    }
    for (cell, about) in kernel.cells.iter().enumerate() {
        for word in 0..about.len {
            let want = interp.cell(0, cell, word as usize).expect("a word");
            assert_eq!(target.cell(0, cell, word), want, "{file}: `{}`", about.name);
        }
    }
    let bound = target.cycles_max();
    println!("{file}: {} ticks, {cycles} cycles, bound {bound}", ticks());
    assert!(cycles <= bound, "{file}: {cycles} cycles, bound {bound}");
}

#[test]
fn of_a_bowed_violin() {
    play("bowed-violin.whip");
}

#[test]
fn of_a_rubbed_bank() {
    play("rubbed-bank.whip");
}

#[test]
fn of_a_keytar() {
    play("keytar.whip");
}
