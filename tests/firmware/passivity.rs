//! A key that may give no more energy than its device says: actively unstable programs stay
//! bounded, others play as ever.

use whippen_compiler::budget::{Program, cores};
use whippen_compiler::firmware::{Instrument, Passivity, Setup, build_image};
use whippen_compiler::front::compile_front;
use whippen_compiler::keyboard::{Layout, ProgramId};
use whippen_compiler::modes::Modes;
use whippen_compiler::pipeline::{Compiled, compile};
use whippen_compiler::source::SourceMap;
use whippen_emulator::BoardKind;
use whippen_runtime::closed;
use whippen_runtime::device::Device;
use whippen_runtime::engine::EngineKind;
use whippen_runtime::gesture::Gesture;
use whippen_runtime::plant::Player;
use whippen_runtime::{board, session};

use crate::rig::{kernel, midi, setup};

const RATE_HZ: f64 = 44_100.0;

/// The fault: a damper of the wrong sign. It pulls where it should brake, far more than the key's
/// own friction takes.
const UNSTABLE: &str = "instrument wrong {
    sense x: length in -0.5 mm .. 10.5 mm over 1 ms
    force centre = 200 N/m * (x - 5 mm)
    force wrong  = -5 N*s/m * x'
}";

fn compiled(text: &str) -> Compiled {
    let mut map = SourceMap::default();
    map.add("passivity.whip", text);
    let (program, diagnostics) = compile_front(&mut map, &Default::default());
    let model = program
        .unwrap_or_else(|| panic!("{diagnostics:?}"))
        .instruments
        .remove(0);
    compile(model, Device::mikey().scales(), false).unwrap_or_else(|e| panic!("{e:?}"))
}

fn device(passivity_j: Option<f64>) -> Device {
    Device {
        passivity_j,
        ..Device::mikey()
    }
}

/// The largest speed (m/s) of a key that is let go half a millimetre from its rest, in the second
/// half of `seconds`; and in all.
fn speeds(device: &Device, seconds: f64) -> (f64, f64) {
    let (ticks, player) = ((seconds * RATE_HZ) as usize, Player::nobody());
    let run = closed::run(
        &compiled(UNSTABLE),
        device,
        EngineKind::Emulated(BoardKind::Rp2350.into()),
        (player, 5.5e-3),
        ticks,
        |_| (),
    );
    let run = run.unwrap_or_else(|e| panic!("{e}"));
    let positions = run.positions();
    let speeds: Vec<f64> = positions
        .windows(2)
        .map(|pair| (pair[1] - pair[0]).abs() * RATE_HZ)
        .collect();
    let largest = |part: &[f64]| part.iter().copied().fold(0.0, f64::max);
    (largest(&speeds[ticks / 2..]), largest(&speeds))
}

#[test]
fn an_unstable_program_stays_bounded() {
    const CREDIT_J: f64 = 2e-3;
    let mass = Device::mikey()
        .port()
        .mechanics
        .expect("mikey says how its key moves")
        .mass;
    // What the key may have: the credit, and what the spring held.
    let bound = (2.0 * (CREDIT_J + 0.5 * 200.0 * 0.5e-3_f64.powi(2)) / mass).sqrt();
    let (late, ever) = speeds(&device(Some(CREDIT_J)), 0.5);
    let (wild, _) = speeds(&device(None), 0.5);
    println!("with 2 mJ: {ever:.3} m/s of {bound:.3}, then {late:.4}; without: {wild:.3} m/s");
    assert!(
        ever > 0.3 * bound,
        "it was let swing: {ever} of {bound} m/s"
    );
    assert!(ever <= 1.05 * bound, "{ever} m/s, bound {bound}");
    assert!(
        wild > 2.0 * bound && wild > 3.0 * late,
        "{wild} m/s without, {late} with"
    );
}

#[test]
fn what_gives_no_energy_plays_as_ever() {
    let text = |name: &str| {
        whippen_compiler::bundled::INSTRUMENTS
            .iter()
            .find(|(file, _)| *file == name)
            .map(|i| i.1)
    };
    let grand = compiled(text("grand-piano.whip").expect("it is bundled"));
    let positions = Gesture::new()
        .stroke(0.02, 0.04, 0.1, 0.06, 9.5e-3)
        .hold(0.05)
        .positions(RATE_HZ as u32);
    let play = |device: &Device| {
        let run = session::run(
            &grand,
            device,
            EngineKind::Emulated(BoardKind::Rp2350.into()),
            &positions,
            |_| (),
        );
        run.unwrap_or_else(|e| panic!("{e}")).trace
    };
    let (with, without) = (play(&device(Some(50e-3))), play(&device(None)));
    let forces = |trace: &whippen_runtime::trace::Trace| -> Vec<Vec<f64>> {
        trace
            .columns
            .iter()
            .map(|column| column.values().to_vec())
            .collect()
    };
    assert!(
        forces(&without).iter().flatten().any(|force| *force > 5.0),
        "it is struck"
    );
    assert!(forces(&with) == forces(&without) && with.events == without.events);
}

/// The budget has its cycles.
#[test]
fn it_is_charged() {
    let kernel = kernel("virtual-spring.whip");
    let (modes, midi, board) = (
        Modes::single(&kernel),
        midi(&kernel),
        board::bundled("rp2350").expect("it is bundled"),
    );
    let frames = |passivity: Option<Passivity>| {
        let setup = Setup {
            passivity,
            ..setup()
        };
        let instrument = Instrument {
            modes: &modes,
            places: &[],
            midi: &midi,
            parts: None,
        };
        let layout = Layout::of_one_instrument("spring", 88, 21);
        let whole =
            build_image(&layout, &[instrument], &setup, &board).unwrap_or_else(|e| panic!("{e}"));
        let program = Program::of(&whole.image);
        let bounds = cores(&whole, &program, &board, ProgramId(0));
        let bounds = bounds.unwrap_or_else(|e| panic!("{e}"));
        [0, 1].map(|core: usize| bounds[core].alone.handler.cycles_max)
    };
    let (with, without) = (
        frames(Some(Passivity {
            credit: 1 << 24,
            past: 5,
            damping: 300,
        })),
        frames(None),
    );
    let each =
        [0, 1].map(|core| (with[core] - without[core]) as f64 / f64::from(setup().keys[core]));
    println!("{each:?} cycles a key, {with:?} and {without:?} in all");
    assert!(
        each.iter().all(|cycles| (20.0..40.0).contains(cycles)),
        "{each:?}"
    );
}
