//! Changes of programs under which what the bundled experiments assert is wrong.

/// A text of a program, and what stands there instead.
pub type Change = (&'static str, &'static str);

/// Under one of its changes each assertion of an experiment fails.
pub const MUTANTS: &[(&str, &[Change])] = &[
    (
        "figure-4",
        &[
            ("let_off     = 6.0 mm", "let_off     = 5.0 mm"),
            ("peak: 7.6 mm", "peak: 7.0 mm"),
            ("peak: 7.6 mm", "peak: 8.0 mm"),
            ("height: 0.20 N", "height: 0.30 N"),
            ("end: 8.4 mm", "end: 9 mm"),
            ("end: 8.4 mm", "end: 10.4 mm"),
        ],
    ),
    (
        "figure-5",
        &[
            (
                "force escapement = jack.resistance",
                "force escapement = -jack.resistance",
            ),
            ("end: 8.4 mm", "end: 9 mm"),
            ("peak: 7.6 mm", "peak: 7.0 mm"),
        ],
    ),
    (
        "figure-8",
        &[
            (
                "force front    = front_row.pull",
                "force front    = -front_row.pull",
            ),
            (
                "force back     = back_row.pull",
                "force back     = -back_row.pull",
            ),
            (
                "force four     = four_row.pull",
                "force four     = -four_row.pull",
            ),
            ("when front_row.plucked", "when four_row.plucked"),
            ("force friction = B * x'", "force friction = 0.1 N"),
        ],
    ),
    (
        "figure-12",
        &[
            ("phi_string  = 0.365 rad", "phi_string  = 0.3 rad"),
            ("restitution = 0.1", "restitution = 0.95"),
            ("phi_string  = 0.365 rad", "phi_string  = 0.41 rad"),
            ("fire thump at 20 N*s/m * squeeze'", "fire thump at 0 N"),
            ("restitution = 0.1", "restitution = 0"),
        ],
    ),
    (
        "signal-chain",
        &[
            (
                "phi' > 0 rad/s {\n        emit note",
                "phi' > 75 rad/s {\n        emit note",
            ),
            (
                "force contact    = push * reach",
                "force contact    = 10 * push * reach",
            ),
            (
                "force inertia    = added_mass * x''",
                "force inertia    = 0.1 kg * x''",
            ),
        ],
    ),
    (
        "figure-16",
        &[
            (
                "phi' > 0 rad/s {\n        emit note",
                "phi' > 75 rad/s {\n        emit note",
            ),
            ("height: 0.20 N", "height: 0.30 N"),
            (
                "force escapement = jack.resistance",
                "force escapement = -jack.resistance",
            ),
            (
                "force escapement = jack.resistance",
                "force escapement = 0.2 N - jack.resistance",
            ),
            (
                "force contact    = push * reach",
                "force contact    = push * reach + 0.1 N",
            ),
            ("weight     = -0.13 N in", "weight     = 0.9 N in"),
            ("force nudge      = -nudge", "force nudge      = nudge"),
            (
                "force nudge      = -nudge",
                "force nudge      = 0 N * nudge / 1 N",
            ),
        ],
    ),
    (
        "figure-17",
        &[
            ("let_off     = 6.0 mm", "let_off     = 5.0 mm"),
            (
                "phi' > 0 rad/s {\n        emit note",
                "phi' > 75 rad/s {\n        emit note",
            ),
            ("force thump      = thump", "force thump      = -thump"),
            (
                "force thump      = thump",
                "force thump      = thump + 0.01 N",
            ),
            ("fire thump at 20 N*s/m * squeeze'", "fire thump at 0 N"),
        ],
    ),
    (
        "figure-18",
        &[
            ("phi_string  = 0.365 rad", "phi_string  = 0.3 rad"),
            ("phi_string = 0.365 rad", "phi_string = 0.3 rad"),
            ("l3_long     = 17.8 mm", "l3_long     = 12 mm"),
            ("capstan   = 0.55", "capstan   = 0.35"),
            (
                "phi' > 0 rad/s {\n        emit note",
                "phi' > 75 rad/s {\n        emit note",
            ),
        ],
    ),
    (
        "figure-19",
        &[
            ("phi_string  = 0.365 rad", "phi_string  = 0.3 rad"),
            ("l3_long     = 17.8 mm", "l3_long     = 10 mm"),
            (
                "phi' > 0 rad/s {\n        emit note",
                "phi' > 75 rad/s {\n        emit note",
            ),
        ],
    ),
    (
        "hammer-paths",
        &[
            ("l3_long     = 17.8 mm", "l3_long     = 12 mm"),
            ("capstan   = 0.55", "capstan   = 0.35"),
            ("l3         = 17.8 mm", "l3         = 12 mm"),
            ("key_length = 218 mm", "key_length = 318 mm"),
            ("phi_string  = 0.365 rad", "phi_string  = 0.41 rad"),
            ("phi_string = 0.365 rad", "phi_string = 0.41 rad"),
        ],
    ),
    (
        "figure-20",
        &[
            ("height: 0.9 N", "height: 0.35 N"),
            ("force friction = B * x'", "force friction = -B * x'"),
            ("force friction = B * x'", "force friction = 0.1 N"),
            (
                "force front    = front_row.pull",
                "force front    = front_row.pull + 0.02 N",
            ),
            ("when back_row.plucked ", "when front_row.plucked "),
        ],
    ),
    (
        "figure-21",
        &[
            ("height: 0.9 N", "height: 0.35 N"),
            ("force friction = B * x'", "force friction = -B * x'"),
            ("force friction = B * x'", "force friction = 0.1 N"),
            (
                "force front    = front_row.pull",
                "force front    = front_row.pull + 0.02 N",
            ),
            ("when front_row.plucked", "when four_row.plucked"),
        ],
    ),
    (
        "motion-force",
        &[
            ("weight     = -0.13 N in", "weight     = 0.1 N in"),
            ("height: 0.20 N", "height: 0.40 N"),
            ("phi_string  = 0.365 rad", "phi_string  = 0.2 rad"),
            ("I_h         = 1.54e-4", "I_h         = 0.2e-4"),
            ("end: 8.4 mm", "end: 9 mm"),
        ],
    ),
    (
        "two-body-and-grand",
        &[
            ("l3_long     = 17.8 mm", "l3_long     = 12 mm"),
            ("phi_string  = 0.365 rad", "phi_string  = 0.41 rad"),
            (
                "force contact    = push * reach",
                "force contact    = push * reach + 0.1 N",
            ),
            ("max(k * squeeze, 0 N)", "min(max(k * squeeze, 0 N), 1 N)"),
            (
                "torque  l3 * push                                 // eq. 3",
                "torque  l3 * push  torque -1e-2 N*m*s/rad * phi'",
            ),
            ("when squeeze < 0 mm", "when squeeze < -90 mm"),
        ],
    ),
    (
        "hammond",
        &[
            (
                "force spring   = k * x + preload",
                "force spring   = -k * x + preload",
            ),
            ("k       = 75 N/m", "k       = 90 N/m"),
            ("preload = 0.4 N ", "preload = 0.5 N "),
            ("force friction = B * x'", "force friction = -B * x'"),
            ("when x < 2.5 mm", "when x > 8 mm"),
            ("0.4 N*s/m", "0.6 N*s/m"),
        ],
    ),
    (
        "friction-law",
        &[
            ("sticky_law(v, top)", "sticky_law(v, 0.2 * top)"),
            ("sticky_law(v, top)", "sticky_law(v, 5 * top)"),
            ("1 N * sticky_law", "2 N * sticky_law"),
        ],
    ),
    (
        "helmholtz",
        &[
            ("70.7 mm/s", "7 m/s"),
            ("rho    = 1.61 g/m", "rho    = 6 g/m"),
        ],
    ),
    ("schelleng", &[("(2 * Z * speed)", "(Z * speed)")]),
];
