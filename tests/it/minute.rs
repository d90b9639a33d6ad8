//! The instruments with strings under words and live values at random: engines are equal bit for
//! bit, the interpreter never leaves a proven range, and real numbers stay numbers.
//!
//! A moment belongs to the tests; a full minute is
//! `WHIPPEN_TICKS=2646000 cargo test --test it minute::`, and with `--test c minute` or
//! `--test thumb minute` that of the C text or of the machine code.

mod words;

use whippen_compiler::ideal::Ideal;
use whippen_compiler::jit::{JitCode, Options};
use whippen_compiler::kernel::Interp;
use whippen_compiler::pipeline::Compiled;
use whippen_runtime::device::Device;

use crate::common;
use words::{Words, ticks};

/// Plays it on the engines of this machine.
fn play(file: &str) {
    let compiled: Compiled = common::instruments(file, &[]).remove(0);
    let (kernel, lives) = (&compiled.lowered.kernel, &compiled.lowered.lives);
    let scales = Device::of(&compiled.model).scales();
    let mut ideal = Ideal::new(&compiled.model, &scales, 1);
    let mut interp = Interp::checked(kernel, 1).expect("verifies");
    let mut jit = JitCode::build(kernel, 1, Options { probes: true }).expect("compiles");
    let mut random = Words::new(kernel);
    let [mut own, mut others] = [(); 2].map(|()| vec![0_i16; kernel.outputs.len()]);
    let ports = compiled.model.drives();
    for tick in 0..ticks() {
        let (set, words) = random.turn(kernel);
        if let Some((live, word)) = set {
            interp.set_live(live, word).expect("is live");
            jit.set_live(live, word).expect("is live");
            ideal.set_live(live, f64::from(word) * lives[live].lsb);
        }
        if tick == 0 {
            interp.init(words);
            jit.init(words);
        }
        interp.tick(words, &mut own);
        jit.tick(words, &mut others);
        ideal.tick(words);
        assert_eq!(own, others, "{file}: drive words of tick {tick}");
        assert_eq!(interp.probes(), jit.probes(), "{file}: tick {tick}");
        assert_eq!(
            interp.drain_events(),
            jit.drain_events(),
            "{file}: tick {tick}"
        );
        let forces = ports.iter().map(|port| ideal.force_on(0, *port));
        let heard = compiled
            .model
            .channels
            .iter()
            .map(|node| ideal.value(0, *node));
        for value in forces.chain(heard) {
            assert!(value.is_finite(), "{file}: {value} in tick {tick}");
            assert!(!value.is_subnormal(), "{file}: {value:e} in tick {tick}");
        }
    }
    assert_eq!(interp.violation(), None, "{file}");
    assert_eq!(interp.memory(), jit.memory(), "{file}");
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
