//! `build` and `budget` for a bench of keys: the wiring that is told, and what is refused.

use crate::cli::Shell;

const SPRING: &str = concat!(
    env!("CARGO_MANIFEST_DIR"),
    "/instruments/virtual-spring.whip"
);
const RATE: [&str; 2] = ["--tick-rate", "150MHz/3400"];

#[test]
fn a_bench_s_wiring_and_its_latency_are_told() {
    let shell = Shell::new();
    let on = ["--board", "rp2350b_bench", "--device", "voice_coil"];
    let build = [
        &["build", SPRING, "-o", "bench.elf", "--keys", "2"][..],
        &on,
        &RATE,
    ]
    .concat();
    let (out, err) = shell.ends(0, &build);
    for line in [
        "GPIO  8  all bridges, nSLEEP; and 10 kOhm to ground",
        "GPIO 19  bridge of key 1, IN2",
        "GPIO 41  sensor of key 1; and 10 nF to ground",
        "2665 cycles of key 0 (0.78 ticks), 2240 of the last key (0.66)",
    ] {
        assert!(out.contains(line), "{line}: {out}");
    }
    assert!(
        !out.contains("GPIO 20") && !out.contains("counts"),
        "{out}{err}"
    );
    // A device that is said to be quicker than the board.
    let device = include_str!("../../instruments/hardware/voice_coil.toml");
    let quick = device.replace("\"1.2 sample\"", "\"0.1 sample\"");
    assert_ne!(device, quick);
    std::fs::write(shell.path("quick.toml"), quick).expect("writable");
    let on = ["--board", "rp2350b_bench", "--device", "quick.toml"];
    let build = [&["build", SPRING, "-o", "bench.elf"][..], &on, &RATE].concat();
    let (out, _) = shell.ends(0, &build);
    assert!(
        out.contains("counts 1.10 ticks from sensor to force, and these are 2.03"),
        "{out}"
    );
}

/// What is wrong with a copy of the bundled board, and where.
#[test]
fn what_cannot_be_wired_is_refused_with_its_line() {
    let shell = Shell::new();
    let board = include_str!("../../instruments/hardware/rp2350b_bench.toml");
    let line = |key: &str| {
        1 + board
            .lines()
            .position(|line| line.starts_with(key))
            .expect(key)
    };
    let mistakes = [
        (
            "\"40 41 42",
            "\"40 40 42",
            "sensors",
            "has pin 40, which `bench.sensors` has too",
        ),
        (
            "\"40 41 42",
            "\"26 41 42",
            "sensors",
            "is no input of the ADC",
        ),
        ("45 46 47\"", "45 46 47 48\"", "sensors", "names 9 pins"),
        (
            "\"16 18 20",
            "\"16 18 32",
            "bridges",
            "has pin 32, of slice 8 of PWM",
        ),
        ("\"16 18 20", "\"0 18 20", "bridges", "has pin 0"),
        (
            "\"16 18 20",
            "\"4 18 20",
            "bridges",
            "has pin 20, of slice 2 of PWM, which another",
        ),
        (
            "fault   = \"9\"",
            "fault   = \"17\"",
            "fault",
            "has pin 17, which `bench.bridges`",
        ),
        (
            "fault   = \"9\"",
            "fault   = \"nine\"",
            "fault",
            "but must be a whole number",
        ),
        (
            "\"3400 cycles\"",
            "\"2000 cycles\"",
            "period",
            "must be a multiple of 8",
        ),
        (
            "\"1900 cycles\"",
            "\"3399 cycles\"",
            "ahead",
            "with room for a conversion",
        ),
    ];
    for (from, to, key, told) in mistakes {
        assert!(board.contains(from), "{from}");
        std::fs::write(shell.path("own.toml"), board.replacen(from, to, 1)).expect("writable");
        let build = ["build", SPRING, "-o", "no.elf", "--board", "own.toml"];
        let build = [&build[..], &["--device", "voice_coil"], &RATE].concat();
        let (_, err) = shell.ends(2, &build);
        assert!(err.contains(told), "{told}: {err}");
        assert!(
            err.contains(&format!("own.toml, line {}:", line(key))),
            "{key}: {err}"
        );
    }
    let selects = board.replacen("fault   =", "psram   = \"47\"\nfault   =", 1);
    std::fs::write(shell.path("own.toml"), selects).expect("writable");
    let budget = [
        "budget",
        SPRING,
        "--board",
        "own.toml",
        "--device",
        "voice_coil",
    ];
    shell.refuses(
        2,
        &[&budget[..], &RATE].concat(),
        &["the select of the board's PSRAM"],
    );
    let bundled = [
        "budget",
        SPRING,
        "--board",
        "rp2350b_bench",
        "--device",
        "voice_coil",
    ];
    for (more, told) in [
        (
            &["--keys", "9", RATE[0], RATE[1]][..],
            "9 keys on a board whose [bench] has pins for 8",
        ),
        (&["--keys", "2"], "samples every 3400 cycles"),
    ] {
        shell.refuses(2, &[&bundled[..], more].concat(), &[told]);
    }
    let build = ["build", SPRING, "-o", "no.elf", "--board", "rp2350b_bench"];
    shell.refuses(2, &[&build[..], &RATE].concat(), &["--device voice_coil"]);
    assert!(!shell.path("no.elf").exists());
}
