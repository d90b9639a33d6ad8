//! Frames of the stack: as many words as code reaches, and a message beyond.

use crate::random::compare;
use crate::target::CORES;
use whippen_compiler::kernel::{Kernel, parse};
use whippen_compiler::modes::Modes;
use whippen_compiler::thumb::{Options, ThumbError, compile};
use whippen_emulator::CoreKind;

/// A tick in which so many products are alive at once: each is read before and behind a value that
/// depends on all of them.
fn wide(products: i64) -> Kernel {
    let mut lines = vec!["v0: i32 [0..65535] = in x".to_string()];
    let mut value = |range: String, what: String| {
        let name = format!("v{}", lines.len());
        lines.push(format!("{name}: i32 [{range}] = {what}"));
        name
    };
    let mut all = Vec::new();
    for factor in 1..=products {
        let by = value(format!("{factor}..{factor}"), format!("const {factor}"));
        let product = value(format!("0..{}", 65535 * factor), format!("mul v0 {by}"));
        all.push((factor, product));
    }
    let mut most = all[0].1.clone();
    for (factor, product) in &all[1..] {
        most = value(
            format!("0..{}", 65535 * factor),
            format!("max {most} {product}"),
        );
    }
    let mut last = String::new();
    for (factor, product) in all.iter().rev() {
        let range = format!("{}..{}", -65535 * products, 65535 * factor);
        let less = value(range.clone(), format!("sub {product} {most}"));
        let before = Some(&last).filter(|last| !last.is_empty());
        let range = format!("{}..{}", -65535 * products, 65535 * products);
        last = before.map_or(less.clone(), |last| {
            value(range, format!("max {last} {less}"))
        });
    }
    let low = value("-32768..-32768".into(), "const -32768".into());
    let range = format!("-32768..{}", 65535 * products);
    let held = value(range, format!("max {last} {low}"));
    let high = value("32767..32767".into(), "const 32767".into());
    let drive = value("-32768..32767".into(), format!("min {held} {high}"));
    let tick = lines.join("\n    ");
    let text = format!(
        "kernel k @44100 {{
  in x: u16 [0..65535]
  out drive: i16 [-32768..32767]
  tick {{
    {tick}
    out drive {drive}
  }}
}}
"
    );
    parse(&text).unwrap_or_else(|error| panic!("{error}"))
}

#[test]
fn a_frame_of_many_words_is_compiled() {
    for core in CORES {
        compare(1, &wide(60), core);
    }
}

/// Each maximum is a branch on a Cortex-M0+, whose other side would lie kilobytes away.
#[test]
fn many_decisions_one_after_the_other_are_within_reach() {
    for core in CORES {
        compare(1, &wide(110), core);
    }
}

#[test]
fn a_frame_beyond_what_loads_reach_is_refused() {
    let options = Options {
        name: "k".into(),
        keys: 1,
        gain: true,
        probes: false,
        arch: CoreKind::CortexM0Plus.arch(),
    };
    let error = compile(&Modes::single(&wide(300)), &options).expect_err("a frame too large");
    assert!(
        matches!(
            error,
            ThumbError::Stack {
                slots: 257..,
                max: 256
            }
        ),
        "{error}"
    );
    let told = error.to_string();
    assert!(
        told.contains("words on the stack, and code of this core reaches 256"),
        "{told}"
    );
}
