//! Boards, devices and presets on the command line: bundled ones by name, others by their file.

use std::ffi::OsStr;
use std::path::{Path, PathBuf};

use whippen_compiler::bundled::{boards, devices, presets};
use whippen_compiler::diag::nearest;

/// A kind of file that comes with Whippen.
#[derive(Debug, Clone, Copy)]
pub struct Hardware {
    /// What it is called, one and several of it.
    name: &'static str,
    names: &'static str,
    /// The bundled ones.
    bundled: fn() -> Vec<&'static str>,
    /// Where a file of one's own is described.
    page: &'static str,
}

/// What a key or a knob measures and drives.
pub const DEVICE: Hardware = Hardware {
    name: "device",
    names: "devices",
    bundled: devices,
    page: "docs/how-to/device.md",
};

/// What a program runs on.
pub const BOARD: Hardware = Hardware {
    name: "board",
    names: "boards",
    bundled: boards,
    page: "docs/build.md, under Boards,",
};

/// What several parameters are.
pub const PRESET: Hardware = Hardware {
    name: "preset",
    names: "presets",
    bundled: presets,
    page: "docs/tools.md, under Presets,",
};

impl Hardware {
    /// The file that is meant, unless it is the name of a bundled one.
    pub fn file(&self, named: &OsStr) -> Option<PathBuf> {
        let path = Path::new(named);
        let is_file = path.extension().is_some() || path.components().count() > 1 || path.is_file();
        (is_file && (self.bundled)().iter().all(|name| named != *name)).then(|| path.to_path_buf())
    }

    /// What to write instead of what is not there.
    pub fn absent(&self, named: &OsStr) -> String {
        let stem = Path::new(named).file_stem().and_then(|stem| stem.to_str());
        let near = nearest(stem.unwrap_or_default(), (self.bundled)());
        let near = near.map_or(String::new(), |near| format!("; did you mean `{near}`?"));
        let there = if self.file(named).is_some() {
            "file"
        } else {
            self.name
        };
        format!(
            "there is no {there} `{}`{near}\n{} are {}; {} says how to write a file of your own",
            named.display(),
            self.names,
            (self.bundled)().join(", "),
            self.page
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_absent_says_what_there_is() {
        assert_eq!(
            DEVICE.absent("miky".as_ref()),
            "there is no device `miky`; did you mean `mikey`?\n\
             devices are chain, column_coil, gimbal, knob, mikey, mouse, pad, touch, voice_coil; docs/how-to/device.md says how to write a file of your own"
        );
        assert_eq!(
            BOARD.absent("boards/rp235.toml".as_ref()),
            "there is no file `boards/rp235.toml`; did you mean `rp2350`?\n\
             boards are pico2_four_knobs, pico2_knob, pico2_strings, pico2_two_knobs, rp2040, rp2350, rp2350_columns, rp2350_seven_columns, rp2350b_bench, stm32f4; docs/build.md, under Boards, says how to write a file of your own"
        );
    }

    #[test]
    fn what_is_bundled_is_no_file() {
        let file = |named: &str| BOARD.file(named.as_ref());
        assert_eq!(DEVICE.file("mikey".as_ref()), None);
        assert_eq!(file("mine"), None);
        assert_eq!(file("mine.toml"), Some(PathBuf::from("mine.toml")));
        assert_eq!(file("./mine"), Some(PathBuf::from("./mine")));
    }

    #[test]
    fn the_pages_that_are_named_are_there() {
        let root = Path::new(env!("CARGO_MANIFEST_DIR"));
        for page in [DEVICE.page, BOARD.page, PRESET.page] {
            let file = page.split(',').next().unwrap_or_default();
            assert!(root.join(file).is_file(), "{page}");
        }
    }
}
