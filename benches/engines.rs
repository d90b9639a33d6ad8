//! What each stage costs: check, lowering, machine code, C, modes, image, bound and stability, and
//! a tick of each engine with 1 key and with 88; of the emulated board with as many as it can take.
//!
//! ```text
//! cargo bench --bench engines                     everything, with criterion's statistics
//! cargo bench --bench engines -- "tick jit"       what the name contains
//! ```

use std::hint::black_box;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use whippen_compiler::c99::{self, Layout};
use whippen_compiler::check::Program;
use whippen_compiler::front::compile_front;
use whippen_compiler::jit::{JitCode, Options};
use whippen_compiler::kernel::{Kernel, verify};
use whippen_compiler::keyboard;
use whippen_compiler::modes::{INSTRUCTIONS, specialize};
use whippen_compiler::pipeline::{self, Compiled, compile, unobserved};
use whippen_compiler::source::SourceMap;
use whippen_compiler::stability::analyze;
use whippen_runtime::device::Device;
use whippen_runtime::engine::{ENGINES, Engine};
use whippen_runtime::image::ImageInstrument;
use whippen_runtime::{board, gesture, image};

const GRAND: &str = include_str!("../instruments/grand-piano.whip");

fn checked() -> Program {
    let mut map = SourceMap::default();
    map.add("grand-piano.whip", GRAND);
    compile_front(&mut map, &Default::default())
        .0
        .unwrap_or_else(|| panic!("the bundled grand piano is correct"))
}

fn lowered() -> Compiled {
    let model = checked().instruments.remove(0);
    compile(model, Device::mikey().scales(), false).unwrap_or_else(|e| panic!("{e:?}"))
}

fn stages(criterion: &mut Criterion) {
    let model = checked().instruments.remove(0);
    let kernel: Kernel = lowered().lowered.kernel;
    criterion.bench_function("check", |b| b.iter(checked));
    criterion.bench_function("lower", |b| {
        b.iter(|| compile(black_box(model.clone()), Device::mikey().scales(), false));
    });
    for keys in [1, 88] {
        criterion.bench_function(&format!("machine code {keys}"), |b| {
            b.iter(|| JitCode::build(&kernel, keys, Options { probes: false }));
        });
    }
    let options = c99::Options {
        keys: 88,
        layout: Layout::Records,
        events: 64,
    };
    criterion.bench_function("C 88", |b| {
        b.iter(|| verify(&kernel).map(|verified| c99::source(verified, options)))
    });
}

/// What `build` and `budget` of 88 keys on the RP2350 consist of.
fn images(criterion: &mut Criterion) {
    let (compiled, device) = (lowered(), Device::mikey());
    let kernel = &compiled.lowered.kernel;
    let board = board::bundled("rp2350").unwrap_or_else(|| panic!("it is bundled"));
    let setup =
        image::setup(&compiled, &device, 88, board.cores, 21).unwrap_or_else(|e| panic!("{e}"));
    let instrument = ImageInstrument::new(&compiled, INSTRUCTIONS, None, &mut unobserved)
        .unwrap_or_else(|e| panic!("{e:?}"));
    let instruments = ImageInstrument::borrow_all(std::slice::from_ref(&instrument));
    let layout = keyboard::Layout::of_one_instrument(&compiled.model.name, 88, 21);
    let image = || {
        pipeline::build(&layout, &instruments, &setup, &board, &mut unobserved)
            .unwrap_or_else(|e| panic!("{e}"))
    };
    let built = image();
    let bound = || pipeline::prove(&built, &board, setup.rate_hz, &mut unobserved);
    criterion.bench_function("modes", |b| {
        b.iter(|| specialize(black_box(kernel), INSTRUCTIONS))
    });
    criterion.bench_function("image 88", |b| b.iter(image));
    criterion.bench_function("bound 88", |b| b.iter(bound));
    let key = device
        .port()
        .key(compiled.model.rate_hz)
        .unwrap_or_else(|| panic!("the file says how its key moves"));
    criterion.bench_function("stability", |b| {
        b.iter(|| analyze(black_box(&compiled.model), &key))
    });
}

fn ticks(criterion: &mut Criterion) {
    let (compiled, device) = (lowered(), Device::mikey());
    let positions = gesture::default_gesture().positions(compiled.model.rate_hz);
    let words: Vec<u16> = positions
        .iter()
        .map(|&x| device.word_of_position(x).0)
        .collect();
    for &(name, kind) in ENGINES {
        // Two cores of the board miss ticks with more.
        let most = if name == "emulated" { 52 } else { 88 };
        for keys in [1, most] {
            let Ok(mut engine) = Engine::new(kind, &compiled, &device, keys) else {
                continue;
            };
            let (mut drive, mut inputs, mut tick) = (vec![0; keys], vec![words[0]; keys], 0);
            engine.start(&inputs);
            let mut group = criterion.benchmark_group("tick");
            group.throughput(Throughput::Elements(keys as u64));
            group.bench_function(format!("{name} {keys}"), |b| {
                b.iter(|| {
                    for (key, word) in inputs.iter_mut().enumerate() {
                        *word = words[(tick + key * 997) % words.len()];
                    }
                    tick += 1;
                    engine.tick(&inputs, &mut drive);
                    engine.drain()
                });
            });
        }
    }
}

criterion_group!(benches, stages, images, ticks);
criterion_main!(benches);
