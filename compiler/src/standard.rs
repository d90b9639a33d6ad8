//! The standard library: terms written in the language itself, always in scope.

/// Its files: name for messages and text.
pub const FILES: &[(&str, &str)] = &[
    ("<std/escapement.whip>", include_str!("../../instruments/std/escapement.whip")),
    ("<std/plectrum.whip>", include_str!("../../instruments/std/plectrum.whip")),
];
