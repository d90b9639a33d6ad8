//! The experiments that come with Whippen: names of files in `instruments/experiments/`, and
//! texts.

/// Programs that only they play.
pub const PROGRAMS: &[(&str, &str)] = &[
    (
        "bowed-string.whip",
        include_str!("../../../instruments/experiments/bowed-string.whip"),
    ),
    (
        "friction-law.whip",
        include_str!("../../../instruments/experiments/friction-law.whip"),
    ),
];

/// All of them, in the order of the papers.
pub const EXPERIMENTS: &[(&str, &str)] = &[
    (
        "figure-4.toml",
        include_str!("../../../instruments/experiments/figure-4.toml"),
    ),
    (
        "figure-5.toml",
        include_str!("../../../instruments/experiments/figure-5.toml"),
    ),
    (
        "figure-8.toml",
        include_str!("../../../instruments/experiments/figure-8.toml"),
    ),
    (
        "figure-12.toml",
        include_str!("../../../instruments/experiments/figure-12.toml"),
    ),
    (
        "figure-16.toml",
        include_str!("../../../instruments/experiments/figure-16.toml"),
    ),
    (
        "figure-17.toml",
        include_str!("../../../instruments/experiments/figure-17.toml"),
    ),
    (
        "figure-18.toml",
        include_str!("../../../instruments/experiments/figure-18.toml"),
    ),
    (
        "figure-19.toml",
        include_str!("../../../instruments/experiments/figure-19.toml"),
    ),
    (
        "figure-20.toml",
        include_str!("../../../instruments/experiments/figure-20.toml"),
    ),
    (
        "figure-21.toml",
        include_str!("../../../instruments/experiments/figure-21.toml"),
    ),
    (
        "motion-force.toml",
        include_str!("../../../instruments/experiments/motion-force.toml"),
    ),
    (
        "two-body-and-grand.toml",
        include_str!("../../../instruments/experiments/two-body-and-grand.toml"),
    ),
    (
        "hammond.toml",
        include_str!("../../../instruments/experiments/hammond.toml"),
    ),
    (
        "friction-law.toml",
        include_str!("../../../instruments/experiments/friction-law.toml"),
    ),
    (
        "helmholtz.toml",
        include_str!("../../../instruments/experiments/helmholtz.toml"),
    ),
    (
        "schelleng.toml",
        include_str!("../../../instruments/experiments/schelleng.toml"),
    ),
];
