//! `whippen emulate --board`: a firmware that serves the converter from both cores, and what users
//! get wrong about boards.

use super::gnu::gcc;
use crate::cli::Shell;

/// A program of the emulator's own tests, for RP2350. The converter's: drive = 3 * sense - key, ten
/// keys.
fn with_firmware(level: &str, program: &str) -> Option<Shell> {
    let programs = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/emulator/tests/boards/programs"
    );
    let shell = Shell::new();
    let (start, program) = (
        format!("{programs}/start.c"),
        format!("{programs}/{program}.c"),
    );
    let link = format!("-T{programs}/link.ld");
    let flags = [
        level,
        "-mcpu=cortex-m33",
        "-ffreestanding",
        "-nostdlib",
        "-DRP2350",
        "-Wl,--defsym=rom_base=0x10000000",
    ];
    let files = [
        "-Wl,--defsym=stack1_top=0x20082000",
        &link,
        &start,
        &program,
        "-o",
        "firmware.elf",
    ];
    gcc(&shell, &[&flags[..], &files[..]].concat()).then_some(shell)
}

/// The bundled knob, turned by two detents on the pins of the chip; and what users get wrong.
#[test]
fn a_knob_is_turned_on_the_pins() {
    let shell = Shell::new();
    let knob = concat!(env!("CARGO_MANIFEST_DIR"), "/instruments/knob.whip");
    let build = ["build", knob, "--board", "pico2_knob", "--device", "gimbal"];
    let rate = ["--tick-rate", "150MHz/3400", "-o", "knob.elf"];
    let (out, _) = shell.ends(0, &[&build[..], &rate].concat());
    assert!(
        out.contains("pin   12  GPIO  9  driver, enable; and 10 kOhm to ground"),
        "{out}"
    );
    let turn = "t_s,angle_deg\n0,0\n0.05,0\n0.35,30\n0.5,30\n";
    std::fs::write(shell.path("turn.csv"), turn).expect("writable");
    let emulate = ["emulate", "knob.elf", "--board", "rp2350"];
    let turned = [
        "--knob",
        "pico2_knob",
        "--motion",
        "turn.csv",
        "--out",
        "knob.csv",
    ];
    let (out, _) = shell.ends(0, &[&emulate[..], &turned].concat());
    assert!(out.contains("from its start, driven"), "{out}");
    let table = std::fs::read_to_string(shell.path("knob.csv")).expect("a table");
    let row = |line: &str| -> Vec<f64> {
        let cells = line.split(',').map(|cell| cell.parse().expect("a number"));
        cells.collect()
    };
    let rows: Vec<Vec<f64>> = table.lines().skip(1).map(row).collect();
    let from = rows
        .iter()
        .find(|row| row[2] != 0.0)
        .expect("the hand takes it")[1];
    let to = rows.last().expect("rows")[1];
    assert!((to - from - 30.0).abs() < 1.5, "{from} to {to} degrees");
    let most = rows.iter().map(|row| row[3].abs()).fold(0.0, f64::max);
    assert!((9e-3..20e-3).contains(&most), "a detent's {most} N*m");
    for (args, told) in [
        (&["--knob", "rp2350"][..], "this board has no `[knob]`"),
        (
            &["--knob", "pico2_knob", "--device", "mikey"],
            "the device `mikey` does not say",
        ),
        (
            &["--knob", "pico2_knob", "--motion", "none.csv"],
            "none.csv: there is no such file",
        ),
        (&["--motion", "turn.csv"], "--knob"),
    ] {
        let (_, err) = shell.ends(2, &[&emulate[..], args].concat());
        assert!(err.contains(told), "{err}");
    }
    let (_, err) = shell.ends(2, &["emulate", "knob.elf", "--knob", "pico2_knob"]);
    assert!(err.contains("--knob needs a board with pins"), "{err}");
}

/// Keys on a bench that are heard: two of them, of which one is pressed, so that its string sounds.
#[test]
fn keys_of_a_bench_are_pressed_and_heard_on_the_pins() {
    let shell = Shell::new();
    let program = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/instruments/clavichord-heard.whip"
    );
    let on = ["--board", "rp2350b_bench", "--device", "voice_coil"];
    let build = ["build", program, "--keys", "2", "-o", "keys.elf"];
    let rate = ["--tick-rate", "150MHz/3400"];
    let (out, _) = shell.ends(0, &[&build[..], &on, &rate].concat());
    assert!(out.contains("GPIO 12  DAC, DIN"), "{out}");
    let press = "t_s,x_mm\n0,0\n0.02,0\n0.05,8\n0.1,8\n";
    std::fs::write(shell.path("press.csv"), press).expect("writable");
    let emulate = ["emulate", "keys.elf", "--board", "rp2350"];
    let pressed = ["--bench", "rp2350b_bench", "--motion", "press.csv"];
    let outputs = ["--pressed", "1", "--out", "keys.csv", "--heard", "keys.wav"];
    // As JSON, since the note that the key sends is no text.
    let json = [&emulate[..], &pressed, &outputs, &["--json"]].concat();
    shell.ends(0, &json);
    let table = std::fs::read_to_string(shell.path("keys.csv")).expect("a table");
    assert!(table.starts_with("t_s,x0_mm,current0_a,x1_mm"), "{table}");
    let last: Vec<f64> = (table.lines().last().expect("rows").split(','))
        .map(|cell| cell.parse().expect("a number"))
        .collect();
    // The strings push against the finger's spring; the other key lies where it lay.
    assert!(
        last[1].abs() < 0.1 && (6.5..8.0).contains(&last[3]),
        "{last:?}"
    );
    let sound = std::fs::read(shell.path("keys.wav")).expect("a WAV file");
    assert_eq!(
        sound[22..28],
        [2, 0, 0x56, 0xac, 0, 0],
        "two sides, 44 118 Hz"
    );
    let data = sound.windows(4).position(|four| four == b"data");
    let words = sound[data.expect("words") + 8..].chunks_exact(4);
    let words: Vec<i32> = words
        .map(|four| i32::from_le_bytes([four[0], four[1], four[2], four[3]]))
        .collect();
    // As long as the grid of the motion, but for the first ticks.
    assert!((5150..5330).contains(&(words.len() / 2)), "{}", words.len());
    let loud = |words: &[i32]| words.iter().map(|word| word.unsigned_abs()).max();
    assert!(loud(&words[..1400]) < Some(1 << 22) && loud(&words) > Some(1 << 26));
    for (args, told) in [
        (
            &["--bench", "pico2_knob"][..],
            "this board has no `[bench]`",
        ),
        (
            &["--bench", "rp2350b_bench", "--device", "gimbal"],
            "the device `gimbal` does not say",
        ),
        (
            &[&pressed[..], &["--pressed", "8"]].concat(),
            "the bench has keys 0 to 7",
        ),
        (
            &["--knob", "pico2_knob", "--heard", "x.wav"],
            "this board has no `[i2s]`",
        ),
        (
            &["--bench", "rp2350b_bench", "--knob", "pico2_knob"],
            "--knob",
        ),
        (&["--heard", "x.wav"], "--bench"),
    ] {
        let (_, err) = shell.ends(2, &[&emulate[..], args].concat());
        assert!(err.contains(told), "{told}: {err}");
    }
}

#[test]
fn sensor_words_go_in_and_drive_words_come_out() {
    let Some(shell) = with_firmware("-O2", "converter") else {
        return;
    };
    let words: Vec<u16> = (0..30_u16).map(|i| 100 * i).collect();
    let bytes: Vec<u8> = words.iter().flat_map(|w| w.to_le_bytes()).collect();
    std::fs::write(shell.path("sense.bin"), bytes).expect("writable");
    let board = [
        "emulate",
        "firmware.elf",
        "--board",
        "rp2350",
        "--keys",
        "10",
        "--sense",
        "sense.bin",
    ];
    let (out, err) = shell.ends(0, &[&board[..], &["--drive", "drive.bin"]].concat());
    assert_eq!(err, "");
    assert!(
        out.starts_with("overruns 0\nrounds missed by core 1 0\nthe program exited with 0\n"),
        "{out}"
    );
    assert!(out.contains(" of 10 keys, 0 overruns"), "{out}");
    let drive = std::fs::read(shell.path("drive.bin")).expect("written");
    let expected: Vec<i16> = (0..30)
        .map(|i| 3 * words[i] as i16 - (i % 10) as i16)
        .collect();
    let drive: Vec<i16> = drive
        .chunks_exact(2)
        .map(|pair| i16::from_le_bytes([pair[0], pair[1]]))
        .collect();
    assert_eq!(drive, expected);
    let (json, _) = shell.ends(0, &[&board[..], &["--json"]].concat());
    assert!(
        json.contains("\"stop\":\"exit\"") && json.contains("\"overruns\":0"),
        "{json}"
    );
}

/// The clock of a serial interface has 160 edges up, 125 cycles apart within its bytes.
#[test]
fn pins_are_written_as_a_logic_analyser_sees_them() {
    let Some(shell) = with_firmware("-O2", "pins") else {
        return;
    };
    let board = ["emulate", "firmware.elf", "--board", "rp2350", "--vcd"];
    shell.ends(0, &[&board[..], &["pins.vcd"]].concat());
    let dump = std::fs::read_to_string(shell.path("pins.vcd")).expect("written");
    assert_eq!(dump.matches("$var wire 1 ").count(), 3, "{}", &dump[..400]);
    let named = |name: &str| {
        let wire = dump
            .lines()
            .find(|line| line.ends_with(&format!(" {name} $end")));
        wire.expect("a wire").split(' ').nth(3).expect("its code")
    };
    let (clock, mut ps, mut rises) = (format!("1{}", named("gpio18")), 0_u64, Vec::new());
    for line in dump.lines() {
        match line.strip_prefix('#') {
            Some(time) => ps = time.parse().expect("a time"),
            None if line == clock => rises.push(ps * 15 / 100_000),
            None => {}
        }
    }
    assert_eq!(rises.len(), 160);
    for byte in rises.chunks(8) {
        let steps = byte.windows(2).map(|pair| pair[1] - pair[0]);
        assert!(
            steps.clone().all(|cycles| (124..=126).contains(&cycles)),
            "{byte:?}"
        );
    }
    shell.ends(0, &[&board[..], &["one.vcd", "--vcd-pins", "18"]].concat());
    let one = std::fs::read_to_string(shell.path("one.vcd")).expect("written");
    assert_eq!(one.matches("$var wire 1 ").count(), 1);
    let (_, err) = shell.ends(2, &["emulate", "firmware.elf", "--vcd", "no.vcd"]);
    assert!(err.contains("--vcd needs a board"), "{err}");
    let stm32 = [
        "emulate",
        "firmware.elf",
        "--board",
        "stm32f4",
        "--vcd",
        "no.vcd",
    ];
    let (_, err) = shell.ends(2, &stm32);
    assert!(err.contains("a board with pins"), "{err}");
}

#[test]
fn a_tick_that_cannot_be_served_in_time_fails_the_run() {
    let Some(shell) = with_firmware("-O0", "converter") else {
        return;
    };
    std::fs::write(shell.path("sense.bin"), vec![0; 20 * 50]).expect("writable");
    let board = [
        "emulate",
        "firmware.elf",
        "--board",
        "rp2350",
        "--keys",
        "10",
        "--sense",
        "sense.bin",
    ];
    // 150 cycles a tick are not enough for five keys a core, without optimization.
    let (out, _) = shell.ends(1, &[&board[..], &["--rate", "1000000"]].concat());
    assert!(
        !out.contains(" 0 overruns") && out.contains(" of 10 keys, "),
        "{out}"
    );
}

#[test]
fn mistakes_about_boards_are_told() {
    let Some(shell) = with_firmware("-O2", "converter") else {
        return;
    };
    std::fs::write(shell.path("odd.bin"), [0; 7]).expect("writable");
    let wrong: [(&[&str], &str); 4] = [
        (
            &["--keys", "10"],
            "--keys needs a board with devices: --board rp2350, rp2040 or stm32f4",
        ),
        (
            &["--board", "rp2350", "--core", "cortex-m4"],
            "rp2350 has a cortex-m33; leave --core out",
        ),
        (
            &["--board", "rp2350", "--keys", "10", "--sense", "odd.bin"],
            "7 bytes are not whole ticks of 10 keys",
        ),
        (
            &["--board", "rp2350", "--rate", "0"],
            "a rate is from 1 to 1000000 Hz",
        ),
    ];
    for (options, message) in wrong {
        let (_, err) = shell.ends(2, &[&["emulate", "firmware.elf"], options].concat());
        assert!(err.contains(message), "{options:?}: {err}");
    }
}
