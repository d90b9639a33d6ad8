//! `jit` and `interp` agree bit for bit on everything they export; the interpreter never leaves a
//! proven range.

use whippen_compiler::jit::{JitCode, Options};
use whippen_compiler::kernel::Interp;
use whippen_compiler::kernel::random::Rng;
use whippen_compiler::pipeline::{Compiled, compile};
use whippen_runtime::device::Device;

use crate::common;

/// Runs both engines on the same words and compares drive words, probes, events in every tick and
/// all memory at the end. Every key hears the motion from another place on, so many ticks after the
/// key before it; there are so many words.
fn compare(compiled: &Compiled, words: &[u16], keys: usize, apart: usize, count: usize) {
    let (kernel, name) = (&compiled.lowered.kernel, &compiled.model.name);
    let mut interp = Interp::checked(kernel, keys).unwrap_or_else(|e| panic!("{name}: {e}"));
    let mut jit = JitCode::build(kernel, keys, Options { probes: true })
        .unwrap_or_else(|e| panic!("{name}: {e}"));
    let (ins, outs) = (kernel.inputs.len(), kernel.outputs.len());
    let (mut a, mut b) = (vec![0i16; keys * outs], vec![0i16; keys * outs]);
    for tick in 0..count / ins {
        let inputs: Vec<u16> = (0..keys)
            .flat_map(|key| (0..ins).map(move |port| (tick + key * apart) * ins + port))
            .map(|place| words[place % words.len()])
            .collect();
        if tick == 0 {
            interp.init(&inputs);
            jit.init(&inputs);
        }
        interp.tick(&inputs, &mut a);
        jit.tick(&inputs, &mut b);
        for (index, (x, y)) in interp.probes().iter().zip(jit.probes()).enumerate() {
            let probe = &kernel.probes[index % kernel.probes.len()].name;
            assert_eq!(x, y, "{name}: tick {tick}, `{probe}`");
        }
        assert_eq!(a, b, "{name}: drive words of tick {tick}");
        assert_eq!(
            interp.drain_events(),
            jit.drain_events(),
            "{name}: events of tick {tick}"
        );
    }
    assert_eq!(interp.violation(), None, "{name}");
    assert_eq!(interp.memory(), jit.memory(), "{name}: memory");
}

#[test]
fn on_the_bundled_gesture() {
    for compiled in common::all_and_programs() {
        let words = common::gesture_words(&compiled);
        // One group in lanes and two keys by themselves; what is played once, alone and for 2 s.
        let rows = words.len() / compiled.model.senses.len();
        let (keys, count) = if compiled.model.is_of_key() {
            (6, words.len() / 2)
        } else {
            (1, words.len() / rows * rows.min(90_000))
        };
        compare(&compiled, &words, keys, 997, count);
    }
}

#[test]
fn on_the_recording() {
    if let Some(positions) = common::recording() {
        let words = common::words(&positions);
        let quarter = words.len() / 4;
        let compiled = common::of_keys();
        compiled
            .iter()
            .filter(|c| !c.model.turns())
            .for_each(|c| compare(c, &words, 4, quarter, quarter));
    }
}

#[test]
fn on_noise() {
    // Any sequence of words: no motion of a key, every clamp and every corner.
    let mut random = Rng::new(1);
    let noise: Vec<u16> = (0..30_000)
        .map(|tick| {
            let hold = tick / 40 % 3 == 0;
            if hold {
                [0, 65_535][tick / 120 % 2]
            } else {
                random.next() as u16
            }
        })
        .collect();
    common::all_and_programs()
        .iter()
        .for_each(|compiled| compare(compiled, &noise, 5, 997, noise.len() / 2));
}

/// One key is observed: what it exports, what all drive and what all tell is as if every key were.
#[test]
fn one_key_observed() {
    let words = common::words(&common::gesture());
    for compiled in common::of_keys() {
        let (kernel, keys) = (&compiled.lowered.kernel, 10);
        for observed in [0, 5, 7, 8, 9] {
            let mut all = JitCode::build(kernel, keys, Options { probes: true }).expect("a kernel");
            let mut one = JitCode::build_observing(kernel, keys, observed).expect("a kernel");
            let (mut a, mut b) = (vec![0i16; keys], vec![0i16; keys]);
            for tick in (0..words.len() / 2).step_by(3) {
                let inputs: Vec<u16> = (0..keys)
                    .map(|key| words[(tick + key * 997) % words.len()])
                    .collect();
                if tick == 0 {
                    all.init(&inputs);
                    one.init(&inputs);
                }
                all.tick(&inputs, &mut a);
                one.tick(&inputs, &mut b);
                let own = |probes: &[i64]| {
                    probes
                        .chunks(kernel.probes.len())
                        .nth(observed)
                        .map(<[i64]>::to_vec)
                };
                assert_eq!(
                    own(all.probes()),
                    own(one.probes()),
                    "key {observed}, tick {tick}"
                );
                assert_eq!(a, b, "key {observed}, tick {tick}");
                assert_eq!(
                    all.drain_events(),
                    one.drain_events(),
                    "key {observed}, tick {tick}"
                );
            }
        }
        assert!(JitCode::build_observing(kernel, keys, keys).is_err());
    }
}

/// Engines go to other threads.
#[test]
fn machine_code_can_be_sent() {
    fn sent<T: Send>(value: T) -> T {
        value
    }
    let compiled = common::instruments("grand-piano.whip", &[]).remove(0);
    let mut code = sent(
        JitCode::build(&compiled.lowered.kernel, 4, Options { probes: false }).expect("a kernel"),
    );
    let run = std::thread::spawn(move || {
        let mut drive = [0i16; 4];
        code.init(&[2979; 4]);
        code.tick(&[2979; 4], &mut drive);
        drive
    });
    let drive = run.join().expect("runs");
    assert!(
        drive.iter().all(|word| *word == drive[0] && *word != 0),
        "{drive:?}"
    );
}

/// Without observation a Kernel drives and tells what it does with it, word for word.
#[test]
fn observed_or_not() {
    for observed in common::all() {
        let words = common::gesture_words(&observed);
        let scales = Device::of(&observed.model).scales();
        let name = &observed.model.name;
        let bare =
            compile(observed.model.clone(), scales, false).unwrap_or_else(|e| panic!("{e:?}"));
        let engine = |c: &Compiled| {
            JitCode::build(&c.lowered.kernel, 1, Options { probes: true }).expect("a kernel")
        };
        let (mut with, mut without) = (engine(&observed), engine(&bare));
        let told = observed.model.emissions.len() as u32;
        let outputs = observed.lowered.kernel.outputs.len();
        let (mut a, mut b, mut events) = (vec![0i16; outputs], vec![0i16; outputs], 0);
        for (tick, row) in words.chunks(observed.model.senses.len()).enumerate() {
            if tick == 0 {
                with.init(row);
                without.init(row);
            }
            with.tick(row, &mut a);
            without.tick(row, &mut b);
            assert_eq!(a, b, "{name}: drive word of tick {tick}");
            let emitted: Vec<_> = with
                .drain_events()
                .into_iter()
                .filter(|e| e.event < told)
                .collect();
            assert_eq!(
                emitted,
                without.drain_events(),
                "{name}: events of tick {tick}"
            );
            events += emitted.len();
        }
        assert!(events > 5 || told == 0, "{name}: {events} events");
    }
}
