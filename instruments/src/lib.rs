//! What comes with Whippen as text: library, instruments, keyboards, boards, devices, presets and
//! experiments, each listed once, here.
//!
//! A crate of its own, so that every package that needs a text finds it outside of this repository
//! too. Each list has names, as messages and command lines have them, and texts.

/// Rows of a list: what stands before and after the name of a row, the folder and the ending of its
/// file, and what names and files have in common.
macro_rules! texts {
    ($before:literal, $after:literal, $folder:literal, $ending:literal; $($name:literal)*) => {
        &[$((
            concat!($before, $name, $after),
            include_str!(concat!("../", $folder, $name, $ending)),
        )),*]
    };
}

/// A name and a text.
pub type Text = (&'static str, &'static str);

/// The standard library, always in scope: names as shown in messages, and texts.
pub const STD: &[Text] = texts! {
    "<std/", ".whip>", "std/", ".whip";
    "damper"
    "detents"
    "distortion"
    "envelope"
    "escapement"
    "felt"
    "filter"
    "friction"
    "karplus"
    "laws"
    "lfo"
    "modulation"
    "pick"
    "plectrum"
    "rubbed"
    "spring"
    "strings"
    "tangent"
    "violin"
    "wall"
};

/// The instruments: those of keys and knobs from the simplest to the grand, then those of an arm,
/// a pad or a mouse.
pub const INSTRUMENTS: &[Text] = texts! {
    "", ".whip", "", ".whip";
    "virtual-spring"
    "baker"
    "two-body"
    "snap-dome"
    "knob"
    "hammond"
    "tracker-organ"
    "harpsichord"
    "clavichord"
    "clavichord-heard"
    "celesta"
    "upright-piano"
    "grand-piano"
    "grand-action"
    "rubbed-bank"
    "rubbed-pad"
    "rubbed-mouse"
    "keytar"
    "bowed-violin"
};

/// The keyboards: one plays three of the instruments, one after the other, and one plays two of
/// them in zones.
pub const KEYBOARDS: &[Text] = texts! {
    "", ".whip", "", ".whip";
    "mikey"
    "split"
};

/// The boards.
pub const BOARDS: &[Text] = texts! {
    "", ".toml", "hardware/", ".toml";
    "rp2350"
    "rp2040"
    "pico2_knob"
    "pico2_two_knobs"
    "pico2_four_knobs"
    "pico2_strings"
    "rp2350_columns"
    "rp2350b_bench"
    "stm32f4"
};

/// The devices, in the order in which one that fits an instrument is looked for.
pub const DEVICES: &[Text] = texts! {
    "", ".toml", "hardware/", ".toml";
    "mikey"
    "chain"
    "knob"
    "gimbal"
    "touch"
    "pad"
    "mouse"
    "voice_coil"
    "column_coil"
};

/// Values for several parameters at once, by names without an ending.
pub const PRESETS: &[Text] = texts! {
    "", "", "presets/", ".toml";
    "onofrei"
    "open-g"
    "pentatonic"
};

/// The experiments, in the order of the papers.
pub const EXPERIMENTS: &[Text] = texts! {
    "", ".toml", "experiments/", ".toml";
    "figure-4"
    "figure-5"
    "figure-8"
    "figure-12"
    "signal-chain"
    "figure-16"
    "figure-17"
    "figure-18"
    "figure-19"
    "figure-20"
    "figure-21"
    "motion-force"
    "hammer-paths"
    "two-body-and-grand"
    "hammond"
    "friction-law"
    "helmholtz"
    "schelleng"
};

/// Programs that only experiments play.
pub const EXPERIMENT_PROGRAMS: &[Text] = texts! {
    "", ".whip", "experiments/", ".whip";
    "bowed-string"
    "friction-law"
};

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;
    use std::path::Path;

    use super::*;

    /// Names of files of this ending in a folder.
    fn files(folder: &str, ending: &str) -> BTreeSet<String> {
        let root = Path::new(env!("CARGO_MANIFEST_DIR")).join(folder);
        let entries = std::fs::read_dir(root).expect("the folder");
        let names = entries.map(|entry| entry.expect("an entry").file_name());
        names
            .map(|name| name.into_string().expect("a plain name"))
            .filter(|name| name.ends_with(ending) && name != "Cargo.toml")
            .collect()
    }

    /// Names of the files that lists name.
    fn listed(lists: &[&[Text]], ending: &str) -> BTreeSet<String> {
        let names = lists.concat().into_iter().map(|(name, _)| name);
        names
            .map(|name| name.trim_start_matches("<std/").trim_end_matches('>'))
            .map(|name| format!("{}{ending}", name.trim_end_matches(ending)))
            .collect()
    }

    #[test]
    fn every_file_of_the_folders_is_listed() {
        let lists: [(&str, &str, &[&[Text]]); 6] = [
            ("", ".whip", &[INSTRUMENTS, KEYBOARDS]),
            ("std", ".whip", &[STD]),
            ("hardware", ".toml", &[BOARDS, DEVICES]),
            ("presets", ".toml", &[PRESETS]),
            ("experiments", ".toml", &[EXPERIMENTS]),
            ("experiments", ".whip", &[EXPERIMENT_PROGRAMS]),
        ];
        for (folder, ending, lists) in lists {
            let listed = listed(lists, ending);
            assert_eq!(files(folder, ending), listed, "{folder}/*{ending}");
        }
    }
}
