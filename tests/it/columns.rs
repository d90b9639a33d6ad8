//! `build`, `budget` and `emulate` for columns of converters: the wiring that is told, what is
//! refused, and keys that are pressed on the pins.

use crate::cli::Shell;

const SPRING: &str = concat!(
    env!("CARGO_MANIFEST_DIR"),
    "/instruments/virtual-spring.whip"
);
const RATE: [&str; 2] = ["--tick-rate", "150MHz/3400"];
const ON: [&str; 4] = ["--board", "rp2350_columns", "--device", "column_coil"];

#[test]
fn wiring_of_columns_and_latency_are_told_and_keys_are_pressed() {
    let shell = Shell::new();
    let build = [
        &["build", SPRING, "-o", "keys.elf", "--keys", "9"][..],
        &ON,
        &RATE,
    ]
    .concat();
    let (out, _) = shell.ends(0, &build);
    for line in [
        "pin    7  GPIO  5  all amplifiers, enable; and 10 kOhm to ground",
        "pin    9  GPIO  6  DAC of column 0, DIN: keys 0 to 7",
        "pin   12  GPIO  9  ADC of column 1, SDO: key 8",
        "pin   15  GPIO 11  ADC of column 2, SDO: no keys",
        "7089 cycles of every key (2.08 ticks); low-pass and settling of the parts add 0.88 ticks",
    ] {
        assert!(out.contains(line), "{line}: {out}");
    }
    // A device that was made for another board has less delay than this one.
    let late = "counts 2.20 ticks from sensor to force, and these are 2.97";
    assert!(!out.contains("ticks from sensor to force"), "{out}");
    let other = build.iter().map(|word| match *word {
        "column_coil" => "voice_coil",
        "keys.elf" => "other.elf",
        word => word,
    });
    let (out, _) = shell.ends(0, &other.collect::<Vec<&str>>());
    assert!(out.contains(late), "{out}");
    let (checked, _) = shell.ends(0, &["audit", "keys.elf"]);
    assert!(checked.contains("cycles of 3400 at most"), "{checked}");
    let press = "t_s,x_mm\n0,0\n0.02,4\n0.03,4\n";
    std::fs::write(shell.path("press.csv"), press).expect("writable");
    let emulate = ["emulate", "keys.elf", "--board", "rp2350"];
    let pressed = ["--columns", "rp2350_columns", "--motion", "press.csv"];
    let outputs = ["--pressed", "8", "--out", "keys.csv"];
    let (out, _) = shell.ends(0, &[&emulate[..], &pressed, &outputs].concat());
    assert!(
        out.contains("amplifiers enabled") && !out.contains("documents"),
        "{out}"
    );
    let table = std::fs::read_to_string(shell.path("keys.csv")).expect("a table");
    let last: Vec<f64> = (table.lines().last().expect("rows").split(','))
        .map(|cell| cell.parse().expect("a number"))
        .collect();
    // Time, two cells of each of 24 keys, whether amplifiers are enabled.
    assert_eq!(last.len(), 1 + 2 * 24 + 1);
    let (place, current) = (last[1 + 2 * 8], last[2 + 2 * 8]);
    assert!((2.0..4.0).contains(&place) && current > 0.5, "{last:?}");
    assert_eq!((last[1], last[49]), (0.0, 1.0));
    for (args, told) in [
        (
            &["--columns", "rp2350b_bench"][..],
            "this board has no `[columns]`",
        ),
        (
            &["--columns", "rp2350_columns", "--device", "gimbal"],
            "the device `gimbal` does not say",
        ),
        (
            &[&pressed[..], &["--pressed", "24"]].concat(),
            "the columns have keys 0 to 23",
        ),
        (
            &["--columns", "rp2350_columns", "--bench", "rp2350b_bench"],
            "--columns",
        ),
    ] {
        let (_, err) = shell.ends(2, &[&emulate[..], args].concat());
        assert!(err.contains(told), "{told}: {err}");
    }
}

/// What is wrong with a copy of the bundled board, and where.
#[test]
fn columns_that_cannot_be_are_refused_with_their_line() {
    let shell = Shell::new();
    let board = include_str!("../../instruments/hardware/rp2350_columns.toml");
    let line = |key: &str| {
        let mut lines = board.lines();
        1 + lines.position(|line| line.starts_with(key)).expect(key)
    };
    let eight = |first: u32| {
        let pins = (0..8).map(|column| (first + 2 * column).to_string());
        pins.collect::<Vec<_>>().join(" ")
    };
    // Eight columns have no pins for sound, and no channels.
    let many = board
        .replacen("\"6 8 10\"", &format!("\"{}\"", eight(6)), 1)
        .replacen("\"7 9 11\"", &format!("\"{}\"", eight(7)), 1);
    let changed = |from: &str, to: &str| {
        assert!(board.contains(from), "{from}");
        board.replacen(from, to, 1)
    };
    let mistakes = [
        (many, "to_dac", "names 8 columns, but a chip has 1 to 7"),
        (
            changed("\"6 8 10\"", "\"6 8\""),
            "from_adc",
            "names 3 pins, but must be one for each of the 2",
        ),
        (
            changed("\"6 8 10\"", "\"6 8 9\""),
            "from_adc",
            "has pin 9, which `columns.to_dac` has too",
        ),
        (
            changed("\"7 9 11\"", "\"7 9 31\""),
            "from_adc",
            "has pin 31, but must be of 2 to 29",
        ),
        (
            changed("\"6 8 10\"", "\"6 8 18\""),
            "clock = \"18\"",
            "has pin 18, which `columns.to_dac` has too",
        ),
        (
            changed("select   = \"3\"", "select   = \"12\""),
            "select",
            "must be pin 3, the one behind",
        ),
        (
            changed("\"ADS8688\"", "\"MCP3208\""),
            "adc",
            "must be one of `ADS8688`",
        ),
        (
            changed("\"0 to 10.24 V\"", "\"5 V\""),
            "range",
            "must be one of `+-10.24 V`",
        ),
        (
            changed("\"3400 cycles\"", "\"3300 cycles\""),
            "period",
            "must be a multiple of 8 of 3400",
        ),
    ];
    for (text, key, told) in mistakes {
        std::fs::write(shell.path("own.toml"), text).expect("writable");
        let build = ["build", SPRING, "-o", "no.elf", "--board", "own.toml"];
        let build = [&build[..], &["--device", "voice_coil"], &RATE].concat();
        let (_, err) = shell.ends(2, &build);
        assert!(err.contains(told), "{told}: {err}");
        let at = format!("own.toml, line {}:", line(key));
        assert!(err.contains(&at), "{key}: {err}");
    }
    for (more, told) in [
        (
            &["--keys", "25", RATE[0], RATE[1]][..],
            "25 keys on a board whose [columns] have pins for 24",
        ),
        (&["--keys", "2"], "samples every 3400 cycles"),
    ] {
        shell.refuses(2, &[&["budget", SPRING][..], &ON, more].concat(), &[told]);
    }
    assert!(!shell.path("no.elf").exists());
}
