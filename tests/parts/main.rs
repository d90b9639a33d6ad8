//! Instruments in parts: images whose members run one after the other, or on two cores, against the
//! interpreter and against their bound.

mod certified;
#[path = "../../audit/tests/made/changed.rs"]
mod changed;
mod divided;
mod played;
mod rig;
mod set;
mod sound;

use whippen_compiler::check::Options;
use whippen_compiler::front::compile_front;
use whippen_compiler::pipeline::{Compiled, compile};
use whippen_compiler::source::SourceMap;
use whippen_runtime::device::Device;

/// Ticks per second at which every board has time for the strings.
const SLOW_HZ: u32 = 11_025;

/// Ticks per second of sound.
const SOUND_HZ: u32 = 44_100;

/// Four bowed strings.
const STRINGS: &str = include_str!("../programs/bowed_strings.whip");

/// Four strings under a bow that moves along them.
const VIOLIN: &str = include_str!("../../instruments/bowed-violin.whip");

/// Six strings under a plectrum, and pedals: nothing that is worth being a member.
const KEYTAR: &str = include_str!("../../instruments/keytar.whip");

/// Weights that are rubbed; each tells when it is touched, and the tail tells of all of them.
const WEIGHTS: &str = "
instrument weights {
    sense x: length in -40 mm .. 40 mm over 4 ms
    sense y: length in 0 mm .. 20 mm over 4 ms
    live param press = 2 N in 0 N .. 10 N glide 20 ms
    let v_rub = clamp(x', -0.4 m/s, 0.4 m/s)
    bank weights over i in 0 .. 2 {
        let own = if y > i * 5 mm then press else 0 N
        body weight {
            position u in -60 mm .. 60 mm, rate in -10 m/s .. 10 m/s
            mass     20 g
            force    -(300 N/m + 200 N/m * i) * u - 0.2 N*s/m * u'
            friction rubs(v) against v_rub = own * (tanh(v * 20 s/m) + 0.2 * tanh(v * 5 s/m))
        }
        event touched when y > i * 5 mm { emit touched(speed: x') }
        let moves = u
    }
    let far = sum(weights.moves) > 2 mm
    event far when far { emit note(speed: x') }
    force drag on x = -sum(weights.rubs)
    force lift on y = 0.1 N + 20 N/m * sum(weights.moves)
}
";

/// The violin, with something of it replaced by a number from 0 to 1 that takes long to compute of
/// something else, and moves with every bit of that.
fn bent_violin(what: &str, of: &str, with: &str) -> String {
    assert!(VIOLIN.contains(what));
    let bends = (1..=60).map(|bend| {
        let before = match bend {
            1 => of.to_string(),
            _ => format!("bent{}", bend - 1),
        };
        format!("    let bent{bend} = 0.5 + 0.4 * sin(5 * ({before}))\n")
    });
    let (head, rest) = VIOLIN.split_once("    let sigma0").expect("losses");
    let bends: String = bends.collect();
    format!("{head}{bends}    let sigma0{rest}").replace(what, with)
}

/// Words of a bow that goes to and fro on all strings of a violin.
fn bow(tick: usize) -> Vec<u16> {
    let x = 32_000.0 + 25_000.0 * (tick as f64 / 60.0).sin();
    vec![x as u16, 25_000, 32_768, 32_768]
}

/// The only instrument of a text, at so many ticks a second, with its transitions traced.
fn compiled(text: &str, rate_hz: u32) -> Compiled {
    compiled_with(text, rate_hz, true)
}

/// The same as it is built.
fn compiled_bare(text: &str, rate_hz: u32) -> Compiled {
    compiled_with(text, rate_hz, false)
}

fn compiled_with(text: &str, rate_hz: u32, probes: bool) -> Compiled {
    let mut map = SourceMap::default();
    map.add("parts.whip", text);
    let options = Options {
        rate_hz: Some(rate_hz.into()),
        ..Options::default()
    };
    let (program, diagnostics) = compile_front(&mut map, &options);
    let program = program.unwrap_or_else(|| panic!("{diagnostics:#?}"));
    let model = program
        .instruments
        .into_iter()
        .next()
        .expect("an instrument");
    let scales = Device::of(&model).scales();
    compile(model, scales, probes).unwrap_or_else(|error| panic!("{error:?}"))
}
