//! `--firmware`: texts of a board of one's own, built into an image and run.

use std::collections::BTreeMap;

use crate::tools::{Folder, WHIPPEN, text};

const HAMMOND: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/instruments/hammond.whip");
const RP2350: &str = concat!(
    env!("CARGO_MANIFEST_DIR"),
    "/instruments/hardware/rp2350.toml"
);
const KEYS: usize = 4;
const TICKS: usize = 2500;

/// Exit code and what is said.
fn run(folder: &Folder, args: &[&str]) -> (Option<i32>, String) {
    let output = folder.output(WHIPPEN, args).expect("starts");
    let said = text(&output.stdout) + &text(&output.stderr);
    (output.status.code(), said)
}

/// `whippen build` of four keys of the organ.
fn build(folder: &Folder, args: &[&str]) -> (Option<i32>, String) {
    run(folder, &[&["build", HAMMOND, "--keys", "4"], args].concat())
}

/// The texts of a board in the folder `bundled`, and its image `bundled.elf`.
fn bundled(board: &str) -> Folder {
    let folder = Folder::new();
    let args = [
        "--board",
        board,
        "-o",
        "bundled.elf",
        "--firmware-texts",
        "bundled",
    ];
    let (code, said) = build(&folder, &args);
    assert_eq!(code, Some(0), "{said}");
    folder
}

fn read(folder: &Folder, name: &str) -> String {
    std::fs::read_to_string(folder.path().join(name)).expect("it is there")
}

/// A bundled text with other words in place of some, into the folder `mine`.
fn edit(folder: &Folder, name: &str, edits: &[(&str, &str)]) {
    std::fs::create_dir_all(folder.path().join("mine")).expect("a folder");
    let mut text = read(folder, &format!("bundled/{name}"));
    for (from, to) in edits {
        assert_eq!(text.matches(from).count(), 1, "{name}: {from}");
        text = text.replace(from, to);
    }
    folder.write(&format!("mine/{name}"), text);
}

#[test]
fn texts_as_they_were_written_build_the_same_image() {
    for board in ["rp2350", "rp2040", "stm32f4"] {
        let folder = bundled(board);
        let args = ["--board", board, "-o", "again.elf", "--firmware", "bundled"];
        let (code, said) = build(&folder, &args);
        assert_eq!(code, Some(0), "{said}");
        let bytes = ["bundled.elf", "again.elf"]
            .map(|name| std::fs::read(folder.path().join(name)).expect("it is there"));
        assert!(bytes[0] == bytes[1], "{board}");
        let (code, said) = build(
            &folder,
            &[&args[..4], &["--firmware-texts", "bundled"]].concat(),
        );
        assert!(
            code == Some(2) && said.contains("is there already"),
            "{said}"
        );
    }
}

/// Keys that go down, each faster than the one before.
fn words() -> Vec<u8> {
    let word = |tick: usize, key: usize| {
        (20_000 + (tick.saturating_sub(500) * 20 * (key + 1)).min(40_000)) as u16
    };
    let ticks = (0..TICKS).flat_map(|tick| (0..KEYS).map(move |key| word(tick, key)));
    ticks.flat_map(u16::to_le_bytes).collect()
}

/// How long each pin was high, pulse by pulse (ps).
fn pulses(dump: &str) -> BTreeMap<String, Vec<u64>> {
    let (mut names, mut rose) = (BTreeMap::new(), BTreeMap::new());
    let (mut all, mut now) = (BTreeMap::new(), 0);
    for line in dump.lines() {
        let words: Vec<&str> = line.split(' ').collect();
        match (&words[..], line.split_at_checked(1)) {
            (["$var", _, _, id, name, _], _) => {
                drop(names.insert(id.to_string(), name.to_string()))
            }
            (_, Some(("#", time))) => now = time.parse().expect("a time"),
            (_, Some(("1", id))) => drop(rose.insert(id.to_string(), now)),
            (_, Some(("0", id))) if names.contains_key(id) => {
                let own: &mut Vec<u64> = all.entry(names[id].clone()).or_default();
                own.extend(rose.remove(id).map(|rose| now - rose));
            }
            _ => {}
        }
    }
    all
}

/// MIDI elsewhere, and a GPIO of each core that is high during its ticks, as a scope wants it.
fn with_scope_pins(folder: &Folder) {
    let pin = |begins: &str, register: &str| {
        format!(
            "{begins}\n        .ifdef  CORE\n        ldr     r0, ={register}\n        ldr     r1, =1 \
             << (15 + CORE)\n        str     r1, [r0]\n        .endif\n"
        )
    };
    let [set, clear] = [
        ("\nboard_begin:", "0xd0000018"),
        ("\nboard_end:", "0xd0000020"),
    ]
    .map(|(label, register)| (label, pin(label, register)));
    edit(
        folder,
        "converter.s",
        &[(set.0, &set.1), (clear.0, &clear.1)],
    );
    let scope = "str     r1, [r0, #108]
        movs    r1, #5
        str     r1, [r0, #124]          @ GPIO 15 and 16 are the program's
        adds    r0, #132
        str     r1, [r0]
        ldr     r0, =PADS_BANK
        movs    r1, #0x56
        str     r1, [r0, #64]
        str     r1, [r0, #68]
        ldr     r0, =0xd0000038         @ SIO: GPIO_OE_SET
        ldr     r1, =3 << 15
        str     r1, [r0]  ";
    edit(
        folder,
        "rp2.s",
        &[
            (
                "str     r1, [r0, #4]            @ GPIO 0 l",
                "str r1, [r0, #52] @ GPIO 12 l",
            ),
            (
                "str     r1, [r0, #8]            @ so does",
                "str r1, [r0, #56] @ so does",
            ),
            (
                "str     r1, [r0, #4]            @ GPIO 0 is",
                "str r1, [r0, #100] @ GPIO 12 is",
            ),
            ("str     r1, [r0, #12]  ", scope),
        ],
    );
}

/// The cycles of each core that are proven of an image that is built with these.
fn proven(folder: &Folder, args: &[&str]) -> Vec<u64> {
    let budget = ["budget", HAMMOND, "--keys", "4", "--json"];
    let output = folder.output(WHIPPEN, &[&budget[..], args].concat());
    let output = output.expect("it is there");
    let budget: serde_json::Value = serde_json::from_slice(&output.stdout).expect("JSON");
    let cores = budget["cores"].as_array().expect("cores");
    let cycles = cores.iter().map(|core| core["cycles_max"].as_u64());
    cycles.collect::<Option<_>>().expect("numbers")
}

#[test]
fn pins_of_ones_own_and_their_cycles_in_the_bound() {
    let folder = bundled("rp2350");
    with_scope_pins(&folder);
    folder.write("words.bin", words());
    let (code, said) = build(&folder, &["-o", "mine.elf", "--firmware", "mine"]);
    assert!(code == Some(0) && said.contains("nobody proves"), "{said}");
    let emulate = |name: &str, dump: &str| {
        let line = format!(
            "emulate {name} --board rp2350 --keys 4 --sense words.bin --drive {name}.bin --vcd {dump}"
        );
        let args: Vec<&str> = line.split(' ').collect();
        folder.run(WHIPPEN, &args).expect("it is there");
        std::fs::read(folder.path().join(format!("{name}.bin"))).expect("it is there")
    };
    let drives = ["bundled.elf", "mine.elf"].map(|name| emulate(name, "gpio.vcd"));
    assert!(drives[0] == drives[1], "keys play the same");
    assert!(drives[0].iter().any(|byte| *byte != 0), "and play");
    let pulses = pulses(&read(&folder, "gpio.vcd"));
    let bounds = proven(&folder, &["--firmware", "mine"]);
    for (core, bound) in bounds.iter().enumerate() {
        let own = &pulses[&format!("gpio{}", 15 + core)];
        assert!((TICKS..TICKS + 1000).contains(&own.len()), "{}", own.len());
        let longest = own.iter().max().expect("a pulse") * 150 / 1_000_000;
        println!("core {core}: {longest} of {bound} cycles from begin to end");
        assert!(longest > 50 && longest <= *bound, "{longest} of {bound}");
    }
    let usual = proven(&folder, &[]);
    // Two constants and a store, twice.
    let more: Vec<u64> = bounds
        .iter()
        .zip(&usual)
        .map(|(own, usual)| own - usual)
        .collect();
    assert!(
        more.iter().all(|cycles| (6..=12).contains(cycles)),
        "{more:?}"
    );
}

#[test]
fn clocks_of_ones_own() {
    let folder = bundled("rp2350");
    let board = std::fs::read_to_string(RP2350).expect("it is there");
    folder.write("slow.toml", board.replace("150 MHz", "120 MHz"));
    let args = ["-o", "slow.elf", "--board", "slow.toml"];
    let (code, said) = build(&folder, &args);
    assert!(
        code == Some(2) && said.contains("the start of its firmware sets 150 MHz"),
        "{said}"
    );
    // A text that leaves the clocks alone does not make them right.
    edit(&folder, "boot.s", &[("\nreset:", "\n        nop\nreset:")]);
    let own = [&args[..], &["--firmware", "mine"]].concat();
    assert_eq!(build(&folder, &own).0, Some(2));
    edit(&folder, "rp2350.s", &[("#125", "#100")]);
    let (code, said) = build(&folder, &own);
    assert!(
        code == Some(0) && said.contains("at 120000000 Hz"),
        "{said}"
    );
}

/// One core where the bundled texts are for two: all that is the board's comes from two texts.
#[test]
fn a_board_that_has_no_texts() {
    let folder = bundled("rp2350");
    let board = std::fs::read_to_string(RP2350).expect("it is there");
    let one = [
        ("cores = \"2\"", "cores = \"1\""),
        ("\"0x20081000 0x20082000\"", "\"0x20081000\""),
    ];
    let board = one.iter().fold(board, |text, (from, to)| {
        assert_eq!(text.matches(from).count(), 1, "{from}");
        text.replace(from, to)
    });
    folder.write("one.toml", board);
    let args = ["-o", "one.elf", "--board", "one.toml"];
    let (code, said) = build(&folder, &args);
    assert!(
        code == Some(2) && said.contains("`board.s` and `board_tick.s`"),
        "{said}"
    );
    let constants = "
        .equ    WATCHDOG_LOAD, 10000
        .equ    PSM, 0x40018000
        .equ    PSM_STAGES, 0x01fffff3
        .equ    RESETS, 0x40020000
        .equ    PADS_BANK, 0x40038000
        .equ    RESET_UART, 1 << 26
";
    let of_board = ["rp2350.s", "rp2.s", "converter_start.s"];
    let texts = of_board.map(|name| read(&folder, &format!("bundled/{name}")));
    std::fs::create_dir(folder.path().join("mine")).expect("a folder");
    folder.write("mine/board.s", constants.to_string() + &texts.concat());
    let own = [&args[..], &["--firmware", "mine"]].concat();
    assert_eq!(build(&folder, &own).0, Some(2), "not all that it needs");
    folder.write("mine/board_tick.s", read(&folder, "bundled/converter.s"));
    let (code, said) = build(&folder, &own);
    assert!(
        code == Some(0) && said.contains("4 keys of hammond on one core"),
        "{said}"
    );
    folder.write("words.bin", words());
    let drives = ["bundled", "one"].map(|name| {
        let line = format!(
            "emulate {name}.elf --board rp2350 --keys 4 --sense words.bin --drive {name}.bin"
        );
        let args: Vec<&str> = line.split(' ').collect();
        folder.run(WHIPPEN, &args).expect("it is there");
        std::fs::read(folder.path().join(format!("{name}.bin"))).expect("it is there")
    });
    // They come up after other numbers of ticks: what keys give in the end is the same.
    let last = drives.map(|all| all[all.len() - 8 * KEYS..].to_vec());
    assert!(
        last[0] == last[1] && last[0].iter().any(|byte| *byte != 0),
        "{last:?}"
    );
}

/// A bundled text, edits of it, and what is told.
type Mistake<'a> = (&'a str, &'a [(&'a str, &'a str)], &'a str);

/// What is wrong in the folder `mine`: the edits of one bundled text, and what is told.
#[test]
fn mistakes_are_told_with_their_place() {
    let core1 = ".section .text.core1.firmware.board";
    let mistakes: &[Mistake] = &[
        (
            "rp2.s",
            &[(
                "        bx      lr\n\n@ R0: the byte",
                "        bxx     lr\n\n@ R0: the byte",
            )],
            "mine/rp2.s:15: `bxx` is no instruction",
        ),
        (
            "rp2.s",
            &[("=RESET_UART", "=RESET_UARTS")],
            "`RESET_UARTS`, used in .text.start, is defined nowhere: give",
        ),
        (
            "rp2.s",
            &[
                ("\nboard_feed:", "\nboard_food:"),
                (".type   board_feed", ".type board_food"),
                (".global board_feed", ".global board_food"),
            ],
            "`board_feed`, used in .text.firmware.idle, is defined nowhere: give",
        ),
        (
            "boot.s",
            &[(
                "\nreset:",
                "\n        .global tick_core0\ntick_core0:\nreset:",
            )],
            "is defined twice: a text of --firmware",
        ),
        (
            "converter.s",
            &[(
                "\nboard_end:",
                "\nboard_end:\n1:      subs    r0, #1\n        bne     1b\n",
            )],
            "has no bound: say how often its first instruction runs at most (in `board_end`)",
        ),
        (
            "converter.s",
            &[("\nboard_end:", "\nboard_end:\n        wfi\n")],
            "how long that takes is not known (in `board_end`)",
        ),
        (
            "rp2.s",
            &[(core1, ".section .text.firmware.board")],
            "core 1 runs the code at",
        ),
        (
            "exceptions.s",
            &[("0, dead, dead\n", "0, dead, board_begin\n")],
            "may interrupt a tick, and how often is not known",
        ),
    ];
    let folder = bundled("rp2350");
    for (name, edits, told) in mistakes {
        edit(&folder, name, edits);
        let (code, said) = build(&folder, &["-o", "mine.elf", "--firmware", "mine"]);
        assert!(code == Some(2) && said.contains(told), "{told}: {said}");
        assert!(!folder.path().join("mine.elf").exists(), "{told}");
        std::fs::remove_dir_all(folder.path().join("mine")).expect("it was there");
    }
}

#[test]
fn folders_and_names_that_are_wrong() {
    let folder = bundled("rp2350");
    let own = ["-o", "mine.elf", "--firmware", "mine"];
    let refused = |args: &[&str], told: &str| {
        let (code, said) = build(&folder, args);
        assert!(code == Some(2) && said.contains(told), "{told}: {said}");
        assert!(!folder.path().join("mine.elf").exists(), "{told}");
    };
    refused(&own, "there is no such file or folder");
    std::fs::create_dir(folder.path().join("mine")).expect("a folder");
    refused(&own, "has no text of a firmware, whose names end in `.s`");
    folder.write("mine/rp235.s", "");
    refused(&own, "did you mean rp2350.s?");
    std::fs::remove_file(folder.path().join("mine/rp235.s")).expect("it was there");
    folder.write("mine/rp2040.s", "        nop\n");
    refused(
        &["-o", "mine.o", "--firmware", "mine"],
        "--firmware is for whole images",
    );
    refused(
        &["-o", "mine.o", "--firmware-texts", "new"],
        "--firmware-texts writes what is in",
    );
    refused(
        &["-o", "mine.elf", "--self-test", "--firmware", "mine"],
        "--firmware is for whole images",
    );
    let (code, said) = build(&folder, &own);
    let unused = "mine/rp2040.s is not used: no image for rp2350 has such a text";
    assert!(code == Some(0) && said.contains(unused), "{said}");
}
