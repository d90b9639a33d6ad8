//! The command: what it writes links with C and plays bit for bit what the reference plays; gdb
//! stops at a force term.

use std::path::Path;

use whippen_compiler::check::Options;
use whippen_compiler::front::compile_front;
use whippen_compiler::kernel::{Interp, Kernel};
use whippen_compiler::pipeline;
use whippen_compiler::source::SourceMap;
use whippen_runtime::device::Device;

use crate::debugger::session;
use crate::tools::{Folder, WHIPPEN, text};

const KEYS: usize = 3;
const TICKS: u32 = 3000;

/// Keys that go down and up at different times; the sum of all drive words and events, so that each
/// bit counts.
const MAIN: &str = "
#include \"piano.h\"
uint32_t sum = 2166136261u;
static void mix(uint32_t word) { sum = (sum ^ word) * 16777619u; }
static uint16_t word(uint32_t tick, uint32_t key) {
    const uint32_t phase = (tick * (key + 5u) * 12u) % 131072u;
    return (uint16_t)(phase < 65536u ? phase : 131071u - phase);
}
/* A second instance: a copy from before the first `init`. */
static struct grand_piano_state other;
static void feed(uint32_t tick) {
    for (uint32_t key = 0; key < GRAND_PIANO_KEYS; key++) {
        grand_piano_state.inputs[key][GRAND_PIANO_INPUT_X] = word(tick, key);
        other.inputs[key][GRAND_PIANO_INPUT_X] = word(tick, GRAND_PIANO_KEYS - 1u - key);
    }
}
void reset(void) {
    for (uint32_t at = 0; at < sizeof other; at += 4u) {
        *(volatile uint32_t *)((char *)&other + at) = *(const uint32_t *)((const char *)&grand_piano_state + at);
    }
    feed(0);
    grand_piano_init(&grand_piano_state);
    grand_piano_init(&other);
    for (uint32_t tick = 0; tick < 3000u; tick++) {
        feed(tick);
        if (tick == 1000u && !grand_piano_set_weight(&grand_piano_state, GRAND_PIANO_WEIGHT_MAX)) mix(1);
        grand_piano_tick(&grand_piano_state);
        grand_piano_tick(&other);
        for (uint32_t key = 0; key < GRAND_PIANO_KEYS; key++) {
            const int16_t mirrored = other.outputs[GRAND_PIANO_KEYS - 1u - key][GRAND_PIANO_OUTPUT_DRIVE];
            /* Live values are each instance's own. */
            if (tick < 1000u && mirrored != grand_piano_state.outputs[key][GRAND_PIANO_OUTPUT_DRIVE]) mix(2);
        }
        for (uint32_t key = 0; key < GRAND_PIANO_KEYS; key++) mix((uint16_t)grand_piano_state.outputs[key][GRAND_PIANO_OUTPUT_DRIVE]);
        struct grand_piano_event event;
        while (grand_piano_read_event(&grand_piano_state, &event)) {
            mix(event.tick); mix(event.key); mix(event.event);
            if (event.event == GRAND_PIANO_EVENT_NOTE) mix((uint32_t)event.args[GRAND_PIANO_NOTE_SPEED]);
        }
    }
    __asm__ volatile (\"movs r0, #0x18\\n ldr r1, =0x20026\\n bkpt #0xab\" ::: \"r0\", \"r1\");
    for (;;) {}
}
__attribute__((section(\".vectors\"), used)) void *vectors[] = {(void *)0x20080000, (void *)reset};
";

fn grand() -> &'static Path {
    Path::new(concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/instruments/grand-piano.whip"
    ))
}

/// `whippen build` in a folder that holds the grand piano.
fn built(extra: &[&str]) -> Folder {
    let folder = Folder::new();
    folder.write(
        "grand-piano.whip",
        std::fs::read(grand()).expect("is there"),
    );
    let mut args = vec![
        "build",
        "grand-piano.whip",
        "--board",
        "rp2350",
        "--keys",
        "3",
        "--modes",
        "0",
        "-o",
        "piano.o",
    ];
    args.extend(extra);
    folder.run(WHIPPEN, &args).expect("is built");
    folder
}

/// Links the object with [`MAIN`]; false where there is no compiler.
fn linked(folder: &Folder) -> bool {
    folder.write("main.c", MAIN);
    let flags = [
        "-mcpu=cortex-m33",
        "-mfloat-abi=hard",
        "-O1",
        "-g",
        "-Wall",
        "-Wextra",
        "-Werror",
        "-nostdlib",
    ];
    let place = [
        "-Wl,--fatal-warnings,-e,reset",
        "-Wl,--section-start=.vectors=0x10000000",
        "-Wl,-Ttext=0x20000000",
    ];
    let rest = [
        "-Wl,-Tdata=0x20040000",
        "-Wl,-Tbss=0x20060000",
        "main.c",
        "piano.o",
        "-o",
        "out.elf",
    ];
    let args: Vec<&str> = flags.into_iter().chain(place).chain(rest).collect();
    folder.run("arm-none-eabi-gcc", &args).is_some()
}

fn kernel() -> Kernel {
    let mut map = SourceMap::default();
    map.add(
        "grand-piano.whip",
        std::fs::read_to_string(grand()).expect("is there"),
    );
    let model = compile_front(&mut map, &Options::default())
        .0
        .expect("is right")
        .instruments
        .remove(0);
    let scales = Device::of(&model).scales();
    pipeline::compile(model, scales, false)
        .expect("compiles")
        .lowered
        .kernel
}

/// What [`MAIN`] sums up, by the reference.
fn reference() -> u32 {
    let kernel = kernel();
    let mut interp = Interp::new(&kernel, KEYS).expect("verifies");
    let mut sum = 2_166_136_261u32;
    let mut mix = |word: u32| sum = (sum ^ word).wrapping_mul(16_777_619);
    let word = |tick: u32, key: u32| {
        let phase = tick * (key + 5) * 12 % 131_072;
        (if phase < 65_536 {
            phase
        } else {
            131_071 - phase
        }) as u16
    };
    let words = |tick: u32| {
        (0..KEYS as u32)
            .map(|key| word(tick, key))
            .collect::<Vec<u16>>()
    };
    let mut out = vec![0i16; KEYS];
    interp.init(&words(0));
    let weight = kernel
        .lives
        .iter()
        .position(|live| live.name == "weight")
        .expect("is live");
    let mut events = 0;
    for tick in 0..TICKS {
        if tick == 1000 {
            interp
                .set_live(weight, kernel.lives[weight].range.high as i32)
                .expect("in range");
        }
        interp.tick(&words(tick), &mut out);
        out.iter().for_each(|word| mix(u32::from(*word as u16)));
        for happened in interp.drain_events() {
            events += 1;
            [happened.tick as u32, happened.key, happened.event]
                .into_iter()
                .for_each(&mut mix);
            happened.args.iter().for_each(|arg| mix(*arg as u32));
        }
    }
    assert!(events > 5, "{events}");
    sum
}

#[test]
fn an_object_file_plays_in_c_what_the_reference_plays() {
    let folder = built(&["--map", "piano.map", "--listing", "piano.lst"]);
    let listing = std::fs::read_to_string(folder.path().join("piano.lst")).expect("written");
    for wanted in [
        "force friction",
        "let push",
        "event string",
        "grand_piano_tick:",
        "late r",
    ] {
        assert!(listing.contains(wanted), "{wanted}");
    }
    let map = std::fs::read_to_string(folder.path().join("piano.map")).expect("written");
    assert!(
        map.contains("sram0") && map.contains("grand_piano_state"),
        "{map}"
    );
    if !linked(&folder) {
        return;
    }
    let nm = folder.run("arm-none-eabi-nm", &["out.elf"]).expect("there");
    let at = nm
        .lines()
        .find(|line| line.ends_with(" sum"))
        .expect("is there");
    let read = format!("0x{}:4", &at[..8]);
    let args = [
        "emulate",
        "out.elf",
        "--board",
        "rp2350",
        "--max-cycles",
        "20000000",
        "--read",
        &read,
        "--json",
    ];
    let told = folder.run(WHIPPEN, &args).expect("is built");
    let bytes: String = reference()
        .to_le_bytes()
        .iter()
        .map(|byte| format!("{byte:02x}"))
        .collect();
    assert!(told.contains(&bytes), "{bytes}: {told}");
}

#[test]
fn gdb_stops_at_a_force_term_and_steps_on() {
    let folder = built(&[]);
    if !linked(&folder) {
        return;
    }
    let source = std::fs::read_to_string(grand()).expect("is there");
    let line = 1 + source
        .lines()
        .position(|line| line.trim().starts_with("force friction"))
        .expect("has friction");
    let stop = format!("break grand-piano.whip:{line}");
    let script = [
        stop.as_str(),
        "continue",
        "step",
        "backtrace",
        "info line",
        "kill",
    ];
    let Some(told) = session(&folder, "out.elf", &script) else {
        return;
    };
    assert!(told.contains(&format!("grand-piano.whip:{line}")), "{told}");
    assert!(told.contains("force friction"), "{told}");
    // A step leads to another line of the instrument.
    let other = told.contains("Line ") && !told.contains(&format!("Line {line} of"));
    assert!(other && told.contains("grand_piano.mode."), "{told}");
    // The frame of the keys leads to the C program that called them.
    let caller = told.lines().find(|line| line.starts_with("#1 "));
    assert!(
        caller.is_some_and(|line| line.contains(" in reset () at main.c:")),
        "{told}"
    );
}

#[test]
fn the_same_program_gives_the_same_bytes_in_every_folder() {
    let (a, b) = (built(&[]), built(&[]));
    for file in ["piano.o", "piano.h", "piano.rs"] {
        let [a, b] =
            [&a, &b].map(|folder| std::fs::read(folder.path().join(file)).expect("written"));
        assert_eq!(a, b, "{file}");
    }
}

/// The image serves every tick of its keys on the emulated board; the bootloader's file holds the
/// same.
#[test]
fn an_image_starts_and_plays() {
    let folder = Folder::new();
    let program = grand().with_file_name("virtual-spring.whip");
    let program = program.to_str().expect("text");
    for file in ["spring.elf", "spring.uf2"] {
        folder
            .run(
                WHIPPEN,
                &[
                    "build",
                    program,
                    "--keys",
                    "5",
                    "-o",
                    file,
                    "--map",
                    "spring.map",
                ],
            )
            .expect("is built");
    }
    let map = std::fs::read_to_string(folder.path().join("spring.map")).expect("written");
    assert!(
        map.contains("core0_state") && map.contains("core1_state"),
        "{map}"
    );
    let blocks = std::fs::read(folder.path().join("spring.uf2")).expect("written");
    assert!(blocks.len().is_multiple_of(512) && blocks.starts_with(b"UF2\n"));
    let words: Vec<u8> = (0..3000u16)
        .flat_map(|tick| [40_000 + tick % 5; 5])
        .flat_map(u16::to_le_bytes)
        .collect();
    folder.write("words.bin", words);
    let on = [
        "emulate",
        "spring.elf",
        "--board",
        "rp2350",
        "--keys",
        "5",
        "--sense",
        "words.bin",
        "--drive",
        "drive.bin",
    ];
    folder.run(WHIPPEN, &on).expect("plays without overruns");
    let drive = std::fs::read(folder.path().join("drive.bin")).expect("written");
    let last: Vec<i16> = drive[drive.len() - 10..]
        .chunks(2)
        .map(|b| i16::from_le_bytes([b[0], b[1]]))
        .collect();
    assert!(
        last.iter().all(|&word| word != 0 && word == last[0]),
        "{last:?}"
    );
}

/// An image of a keyboard has all its programs; one that is named is alone in it.
#[test]
fn an_image_has_the_programs_of_its_keyboard() {
    let folder = Folder::new();
    let file = |name: &str| grand().with_file_name(name).to_string_lossy().into_owned();
    let board = "keyboard two {\n    rate     11025 Hz\n    keys     A0 .. C8\n    programs virtual_spring, hammond\n}\n";
    folder.write("two.whip", board);
    let files = [
        "two.whip",
        &file("virtual-spring.whip"),
        &file("hammond.whip"),
    ];
    fn build<'a>(files: &[&'a str], more: &[&'a str]) -> Vec<&'a str> {
        [&["build"], files, more].concat()
    }
    let both = folder
        .run(
            WHIPPEN,
            &build(
                &files,
                &["--modes", "0", "-o", "two.elf", "--map", "two.map"],
            ),
        )
        .expect("is built");
    assert!(
        both.contains("44 and 44 keys of virtual_spring, hammond on two cores"),
        "{both}"
    );
    assert!(both.contains("it begins with virtual_spring"), "{both}");
    let map = std::fs::read_to_string(folder.path().join("two.map")).expect("written");
    assert!(
        [
            "core0_tick",
            "core0_1_tick",
            "core1_1_state",
            "whippen_play"
        ]
        .iter()
        .all(|name| map.contains(name)),
        "{map}"
    );
    let one = folder
        .run(
            WHIPPEN,
            &build(&files, &["hammond", "--modes", "0", "-o", "one.elf"]),
        )
        .expect("is built");
    assert!(
        one.contains("44 and 44 keys of hammond on two cores") && !one.contains("it begins"),
        "{one}"
    );
    let refused = folder
        .output(WHIPPEN, &build(&files, &["-o", "two.o"]))
        .expect("runs");
    assert_eq!(
        refused.status.code(),
        Some(2),
        "an object has one program: {}",
        text(&refused.stderr)
    );
}

#[test]
fn c_is_written_with_its_header() {
    let folder = Folder::new();
    let program = grand().to_str().expect("text");
    folder
        .run(WHIPPEN, &["build", program, "--keys", "2", "-o", "piano.c"])
        .expect("is built");
    let flags = [
        "-std=c99",
        "-Wall",
        "-Wextra",
        "-Wpedantic",
        "-Werror",
        "-O1",
        "-c",
        "piano.c",
        "-o",
        "piano.o",
    ];
    folder.run("gcc", &flags);
    folder.run(
        "arm-none-eabi-gcc",
        &[&["-mcpu=cortex-m0plus"][..], &flags[..]].concat(),
    );
}

#[test]
fn what_is_asked_wrongly_is_told_and_nothing_is_written() {
    let folder = Folder::new();
    folder.write("own.toml", "name = \"own\"\ncolour = \"red\"\n");
    folder.write("wrong.whip", "instrument wrong {\n    force f = 1 m\n}\n");
    let program = grand().to_str().expect("text");
    let rp2350 =
        std::fs::read_to_string(grand().with_file_name("hardware/rp2350.toml")).expect("the board");
    folder.write(
        "single.toml",
        rp2350
            .replace("\"rp2350\"", "\"single\"")
            .replace("cores = \"2\"", "cores = \"1\""),
    );
    folder.write(
        "fast.toml",
        rp2350
            .replace("\"rp2350\"", "\"fast\"")
            .replace("150 MHz", "300 MHz"),
    );
    let knob = grand().with_file_name("knob.whip");
    let knob = knob.to_str().expect("text");
    let cases: [(&[&str], i32); 13] = [
        (
            &[
                "build",
                program,
                "-o",
                "piano.elf",
                "--board",
                "single.toml",
                "--modes",
                "0",
            ],
            2,
        ),
        (
            &[
                "build",
                program,
                "-o",
                "piano.elf",
                "--board",
                "fast.toml",
                "--modes",
                "0",
            ],
            2,
        ),
        (
            &[
                "build",
                program,
                "-o",
                "piano.uf2",
                "--board",
                "stm32f4",
                "--modes",
                "0",
            ],
            2,
        ),
        (
            &[
                "build",
                program,
                "-o",
                "piano.elf",
                "--keys",
                "1",
                "--modes",
                "0",
            ],
            2,
        ),
        (&["build", knob, "-o", "knob.elf", "--modes", "0"], 2),
        (&["build", program], 2),
        (&["build", program, "-o", "piano.exe"], 2),
        (&["build", program, "-o", "piano.o", "--board", "rp2530"], 2),
        (
            &["build", program, "-o", "piano.o", "--board", "own.toml"],
            2,
        ),
        (&["build", program, "-o", "piano.o", "--keys", "0"], 2),
        (
            &["build", program, "-o", "piano.c", "--map", "piano.map"],
            2,
        ),
        (&["build", "wrong.whip", "-o", "piano.o"], 1),
        (
            &[
                "build",
                program,
                "-o",
                "piano.o",
                "--keys",
                "20000",
                "--modes",
                "0",
                "--map",
                "piano.map",
            ],
            1,
        ),
    ];
    let mut told = Vec::new();
    for (args, code) in cases {
        let output = folder.output(WHIPPEN, args).expect("is built");
        assert_eq!(
            output.status.code(),
            Some(code),
            "{args:?}: {}",
            text(&output.stderr)
        );
        let first = text(&output.stderr)
            .lines()
            .next()
            .unwrap_or_default()
            .to_string();
        told.push(first.replace(program, "PROGRAM"));
    }
    let mut files: Vec<String> = std::fs::read_dir(folder.path())
        .expect("there")
        .map(|entry| {
            entry
                .expect("readable")
                .file_name()
                .to_string_lossy()
                .into_owned()
        })
        .collect();
    files.sort();
    assert_eq!(
        files,
        ["fast.toml", "own.toml", "single.toml", "wrong.whip"]
    );
    insta::assert_snapshot!("mistakes", told.join("\n"));
}
