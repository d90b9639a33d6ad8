//! The experiments that come with Whippen: names of files in `instruments/experiments/`, and
//! texts.

/// All of them, in the order of the paper.
pub const EXPERIMENTS: &[(&str, &str)] = &[
    (
        "figure-16.toml",
        include_str!("../../../instruments/experiments/figure-16.toml"),
    ),
    (
        "figure-21.toml",
        include_str!("../../../instruments/experiments/figure-21.toml"),
    ),
];
