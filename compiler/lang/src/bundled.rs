//! Programs that come with Whippen: the standard library and the instruments, as text.
//!
//! The one list of them: what goes into `instruments/` goes in here, and every test that means "all
//! of them" reads it.

/// The boards that a keyboard may name: the files in `instruments/hardware/`.
pub const BOARDS: &[&str] = &[
    "pico2_knob",
    "pico2_strings",
    "rp2040",
    "rp2350",
    "rp2350b_bench",
    "stm32f4",
];

/// The devices that a keyboard may name, likewise.
pub const DEVICES: &[&str] = &[
    "chain",
    "gimbal",
    "knob",
    "mikey",
    "mouse",
    "pad",
    "touch",
    "voice_coil",
];

/// The presets that a command may name: the files in `instruments/presets/`.
pub const PRESETS: &[&str] = &["onofrei", "open-g", "pentatonic"];

/// The standard library, always in scope: names as shown in messages, and texts.
pub const STD: &[(&str, &str)] = &[
    (
        "<std/damper.whip>",
        include_str!("../../../instruments/std/damper.whip"),
    ),
    (
        "<std/detents.whip>",
        include_str!("../../../instruments/std/detents.whip"),
    ),
    (
        "<std/distortion.whip>",
        include_str!("../../../instruments/std/distortion.whip"),
    ),
    (
        "<std/envelope.whip>",
        include_str!("../../../instruments/std/envelope.whip"),
    ),
    (
        "<std/escapement.whip>",
        include_str!("../../../instruments/std/escapement.whip"),
    ),
    (
        "<std/felt.whip>",
        include_str!("../../../instruments/std/felt.whip"),
    ),
    (
        "<std/filter.whip>",
        include_str!("../../../instruments/std/filter.whip"),
    ),
    (
        "<std/friction.whip>",
        include_str!("../../../instruments/std/friction.whip"),
    ),
    (
        "<std/karplus.whip>",
        include_str!("../../../instruments/std/karplus.whip"),
    ),
    (
        "<std/laws.whip>",
        include_str!("../../../instruments/std/laws.whip"),
    ),
    (
        "<std/lfo.whip>",
        include_str!("../../../instruments/std/lfo.whip"),
    ),
    (
        "<std/modulation.whip>",
        include_str!("../../../instruments/std/modulation.whip"),
    ),
    (
        "<std/pick.whip>",
        include_str!("../../../instruments/std/pick.whip"),
    ),
    (
        "<std/plectrum.whip>",
        include_str!("../../../instruments/std/plectrum.whip"),
    ),
    (
        "<std/rubbed.whip>",
        include_str!("../../../instruments/std/rubbed.whip"),
    ),
    (
        "<std/spring.whip>",
        include_str!("../../../instruments/std/spring.whip"),
    ),
    (
        "<std/strings.whip>",
        include_str!("../../../instruments/std/strings.whip"),
    ),
    (
        "<std/tangent.whip>",
        include_str!("../../../instruments/std/tangent.whip"),
    ),
    (
        "<std/violin.whip>",
        include_str!("../../../instruments/std/violin.whip"),
    ),
    (
        "<std/wall.whip>",
        include_str!("../../../instruments/std/wall.whip"),
    ),
];

/// The bundled instruments, names of files in `instruments/` and texts: those of keys and knobs
/// from the simplest to the grand, then those of an arm, a pad or a mouse.
pub const INSTRUMENTS: &[(&str, &str)] = &[
    (
        "virtual-spring.whip",
        include_str!("../../../instruments/virtual-spring.whip"),
    ),
    (
        "baker.whip",
        include_str!("../../../instruments/baker.whip"),
    ),
    (
        "two-body.whip",
        include_str!("../../../instruments/two-body.whip"),
    ),
    (
        "snap-dome.whip",
        include_str!("../../../instruments/snap-dome.whip"),
    ),
    ("knob.whip", include_str!("../../../instruments/knob.whip")),
    (
        "hammond.whip",
        include_str!("../../../instruments/hammond.whip"),
    ),
    (
        "tracker-organ.whip",
        include_str!("../../../instruments/tracker-organ.whip"),
    ),
    (
        "harpsichord.whip",
        include_str!("../../../instruments/harpsichord.whip"),
    ),
    (
        "clavichord.whip",
        include_str!("../../../instruments/clavichord.whip"),
    ),
    (
        "clavichord-heard.whip",
        include_str!("../../../instruments/clavichord-heard.whip"),
    ),
    (
        "celesta.whip",
        include_str!("../../../instruments/celesta.whip"),
    ),
    (
        "upright-piano.whip",
        include_str!("../../../instruments/upright-piano.whip"),
    ),
    (
        "grand-piano.whip",
        include_str!("../../../instruments/grand-piano.whip"),
    ),
    (
        "grand-action.whip",
        include_str!("../../../instruments/grand-action.whip"),
    ),
    (
        "rubbed-bank.whip",
        include_str!("../../../instruments/rubbed-bank.whip"),
    ),
    (
        "rubbed-pad.whip",
        include_str!("../../../instruments/rubbed-pad.whip"),
    ),
    (
        "rubbed-mouse.whip",
        include_str!("../../../instruments/rubbed-mouse.whip"),
    ),
    (
        "keytar.whip",
        include_str!("../../../instruments/keytar.whip"),
    ),
    (
        "bowed-violin.whip",
        include_str!("../../../instruments/bowed-violin.whip"),
    ),
];

/// The bundled keyboards: one plays three of the instruments, one after the other, and one plays
/// two of them in zones.
pub const KEYBOARDS: &[(&str, &str)] = &[
    (
        "mikey.whip",
        include_str!("../../../instruments/mikey.whip"),
    ),
    (
        "split.whip",
        include_str!("../../../instruments/split.whip"),
    ),
];

/// All of them: instruments, keyboards, library.
pub fn programs() -> impl Iterator<Item = &'static (&'static str, &'static str)> {
    INSTRUMENTS.iter().chain(KEYBOARDS).chain(STD)
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;
    use std::path::Path;

    use super::*;

    #[test]
    fn every_file_of_the_folders_is_listed() {
        let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../instruments");
        for (folder, listed) in [
            (
                "",
                INSTRUMENTS
                    .iter()
                    .chain(KEYBOARDS)
                    .map(|(name, _)| name.to_string())
                    .collect::<BTreeSet<_>>(),
            ),
            (
                "std",
                STD.iter()
                    .map(|(name, _)| name["<std/".len()..name.len() - 1].to_string())
                    .collect(),
            ),
        ] {
            let entries = std::fs::read_dir(root.join(folder)).expect("the folder");
            let names = entries.map(|e| {
                e.expect("an entry")
                    .file_name()
                    .into_string()
                    .expect("a plain name")
            });
            assert_eq!(
                names
                    .filter(|n| n.ends_with(".whip"))
                    .collect::<BTreeSet<_>>(),
                listed,
                "instruments/{folder}"
            );
        }
    }
}
