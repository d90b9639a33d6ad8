//! One program in C, compiled and linked unchanged with a relocatable file and with C text: the
//! same words and events; and the same binding in Rust.

use crate::tools::{Folder, WHIPPEN};

/// What the program of the grand piano sums up, without an operating system or with one.
const MAIN: &str = "
#include \"piano.h\"
#ifdef HOSTED
#include <stdio.h>
#endif
uint32_t sum = 2166136261u, events = 0, lost = 0;
static void mix(uint32_t word) { sum = (sum ^ word) * 16777619u; }
static uint16_t word(uint32_t tick, uint32_t key) {
    const uint32_t phase = (tick * (key + 5u) * 12u) % 131072u;
    return (uint16_t)(phase < 65536u ? phase : 131071u - phase);
}
static void feed(uint32_t tick) {
    for (uint32_t key = 0; key < GRAND_PIANO_KEYS; key++) {
        grand_piano_state.inputs[key][GRAND_PIANO_INPUT_X] = word(tick, key);
    }
}
static void play(uint32_t ticks) {
    struct grand_piano_event event;
    feed(0);
    grand_piano_init(&grand_piano_state);
    for (uint32_t tick = 0; tick < ticks; tick++) {
        feed(tick);
        if (tick == 1000u && !grand_piano_set_weight(&grand_piano_state, GRAND_PIANO_WEIGHT_MAX)) mix(1);
        grand_piano_tick(&grand_piano_state);
        for (uint32_t key = 0; key < GRAND_PIANO_KEYS; key++) {
            mix((uint16_t)grand_piano_state.outputs[key][GRAND_PIANO_OUTPUT_DRIVE]);
        }
        /* Events wait until the ring is full, and some are lost. */
        if (tick < 2000u && tick % 64u != 0u) continue;
        if (tick >= 2000u && tick + 1u != ticks) continue;
        while (grand_piano_read_event(&grand_piano_state, &event)) {
            events++;
            mix(event.tick); mix(event.key); mix(event.event);
            if (event.event == GRAND_PIANO_EVENT_NOTE) mix((uint32_t)event.args[GRAND_PIANO_NOTE_SPEED]);
        }
        mix(grand_piano_state.events_lost);
        mix(grand_piano_state.tick);
    }
    lost = grand_piano_state.events_lost;
}
#ifdef HOSTED
int main(void) {
    play(TICKS);
    printf(\"%08x %u %u\\n\", (unsigned)sum, (unsigned)events, (unsigned)lost);
    return 0;
}
#else
void reset(void);
void reset(void) {
    play(TICKS);
    __asm__ volatile (\"movs r0, #0x18\\n ldr r1, =0x20026\\n bkpt #0xab\" ::: \"r0\", \"r1\");
    for (;;) {}
}
struct vectors { uint32_t stack; void (*reset)(void); };
extern const struct vectors vectors;
__attribute__((section(\".vectors\"), used)) const struct vectors vectors = {0x20080000u, reset};
#endif
";

/// Ticks that are played: the ring is full before they are over.
const TICKS: &str = "-DTICKS=60000u";
/// Where the emulated board has code and data, for a program without a library.
pub const TARGET: &[&str] = &[
    "-mcpu=cortex-m33",
    "-O1",
    "-nostdlib",
    "-Wl,--fatal-warnings,-e,reset",
    "-Wl,--section-start=.vectors=0x10000000",
    "-Wl,-Ttext=0x20000000",
    "-Wl,-Tdata=0x20040000",
    "-Wl,-Tbss=0x20060000",
];
/// A compiler that lets nothing pass.
pub const STRICT: &[&str] = &[
    "-std=c99",
    "-Wall",
    "-Wextra",
    "-Wconversion",
    "-pedantic",
    "-Werror",
];

/// A folder with `main.c`, and what `build` writes for an ending.
fn built(ending: &str) -> Folder {
    built_with(ending, &[])
}

/// The same with more on the command line.
fn built_with(ending: &str, more: &[&str]) -> Folder {
    let folder = Folder::new();
    let program = concat!(env!("CARGO_MANIFEST_DIR"), "/instruments/grand-piano.whip");
    let output = format!("piano.{ending}");
    let args = [
        "build",
        program,
        "grand_piano",
        "--keys",
        "3",
        "--modes",
        "0",
        "-o",
        &output,
    ];
    folder
        .run(WHIPPEN, &[&args[..], more].concat())
        .expect("is built");
    folder.write("main.c", MAIN);
    folder
}

/// The words at a symbol of an image that ran to its end.
pub fn ran(folder: &Folder, symbols: &[&str]) -> Option<Vec<u32>> {
    let nm = folder.run("arm-none-eabi-nm", &["out.elf"])?;
    let at = |symbol: &&str| {
        let end = format!(" {symbol}");
        let line = nm.lines().find(|line| line.ends_with(&end));
        format!("0x{}:4", &line.expect("is there")[..8])
    };
    let words = symbols.iter().map(|symbol| {
        let read = at(symbol);
        let args = [
            "emulate",
            "out.elf",
            "--board",
            "rp2350",
            "--max-cycles",
            "900000000",
            "--read",
            &read,
            "--json",
        ];
        let told = folder.run(WHIPPEN, &args).expect("runs");
        let value: serde_json::Value =
            serde_json::from_str(told.lines().next_back().unwrap_or_default())
                .unwrap_or_else(|_| serde_json::from_str(&told).expect("JSON"));
        let text = value.to_string();
        let hex = text
            .split('"')
            .find(|word| word.len() == 8 && word.bytes().all(|b| b.is_ascii_hexdigit()));
        u32::from_str_radix(hex.unwrap_or_else(|| panic!("{told}")), 16)
            .expect("hexadecimal")
            .swap_bytes()
    });
    Some(words.collect())
}

/// Links the program for the emulator; what it summed up.
fn on_the_target(ending: &str) -> Option<Vec<u32>> {
    let folder = built(ending);
    let rest = [&format!("piano.{ending}"), "-o", "out.elf", "-lgcc"].map(str::to_string);
    let rest: Vec<&str> = rest.iter().map(String::as_str).collect();
    folder.run(
        "arm-none-eabi-gcc",
        &[STRICT, TARGET, &[TICKS, "main.c"], &rest[..]].concat(),
    )?;
    ran(&folder, &["sum", "events", "lost"])
}

#[test]
fn one_program_in_c_takes_either_file() {
    let Some(object) = on_the_target("o") else {
        return;
    };
    assert_eq!(on_the_target("c"), Some(object.clone()));
    assert!(object[1] > 50 && object[2] > 0, "{object:?}");
    let hosted = built("c");
    for compiler in ["gcc", "clang"] {
        let flags = ["-O2", "-DHOSTED", TICKS, "main.c", "piano.c", "-o", "out"];
        let Some(_) = hosted.run(compiler, &[STRICT, &flags[..]].concat()) else {
            continue;
        };
        let path = hosted.path().join("out");
        let told = hosted
            .run(path.to_str().expect("UTF-8"), &[])
            .expect("runs");
        let wanted = format!("{:08x} {} {}", object[0], object[1], object[2]);
        assert_eq!(told.trim(), wanted, "{compiler}");
    }
}

/// Everything public of a header: its lines but those of private memory and of offsets, behind what
/// is said of time.
fn public(text: &str) -> Vec<String> {
    let private = [
        "private_",
        "kernel",
        "_check_",
        "STATE_BYTES",
        "KERNEL",
        "offset_of",
        "size_of",
        // Machine code asks for its core.
        "__arm__",
        "#error",
    ];
    let own = text
        .lines()
        .skip_while(|line| !line.contains("Written by Whippen"));
    let public = own.filter(|line| private.iter().all(|word| !line.contains(word)));
    let begin = |line: &String| !line.contains("What the code keeps");
    public.map(str::to_string).filter(begin).collect()
}

#[test]
fn both_files_have_one_interface() {
    let (object, text) = (built("o"), built("c"));
    for file in ["piano.h", "piano.rs"] {
        let read =
            |folder: &Folder| std::fs::read_to_string(folder.path().join(file)).expect("written");
        let [object, text] = [public(&read(&object)), public(&read(&text))];
        let lacks: Vec<&String> = object.iter().filter(|line| !text.contains(line)).collect();
        assert_eq!(lacks, Vec::<&String>::new(), "{file}");
    }
}

#[test]
fn safety_has_one_interface() {
    let (object, text) = (
        built_with("o", &["--safety"]),
        built_with("c", &["--safety"]),
    );
    for (file, name) in [
        ("piano.h", "void grand_piano_safe_tick(uint32_t number);"),
        ("piano.rs", "pub fn safe_tick(number: u32);"),
    ] {
        let read =
            |folder: &Folder| std::fs::read_to_string(folder.path().join(file)).expect("written");
        let [object, text] = [read(&object), read(&text)];
        assert!(object.contains(name) && text.contains(name), "{file}");
        if file == "piano.h" {
            let bound = "grand_piano_safe_tick takes at most";
            assert!(object.contains(bound) && !text.contains(bound), "{object}");
        }
        let [object, text] = [public(&object), public(&text)];
        let lacks: Vec<&String> = object.iter().filter(|line| !text.contains(line)).collect();
        assert_eq!(lacks, Vec::<&String>::new(), "{file}");
    }
    // The C text is strict, and links with a program that calls it.
    let flags = ["-O2", "-DHOSTED", TICKS, "main.c", "piano.c", "-o", "out"];
    let _ = text.run("gcc", &[STRICT, &flags[..]].concat());
    let rest = ["piano.o", "-o", "out.elf", "-lgcc"];
    let linked = [STRICT, TARGET, &[TICKS, "main.c"], &rest[..]].concat();
    let _ = object.run("arm-none-eabi-gcc", &linked);
}

#[test]
fn safety_is_refused_where_it_is_none() {
    let folder = Folder::new();
    let program = |name: &str| format!("{}/instruments/{name}", env!("CARGO_MANIFEST_DIR"));
    let [grand, violin] = ["grand-piano.whip", "bowed-violin.whip"].map(program);
    for (file, output, why) in [
        (
            &grand,
            "piano.elf",
            "a whole image guards its keys in any case",
        ),
        (&grand, "piano.wasm", "drives no motor"),
        (&violin, "violin.c", "only an image guards those"),
    ] {
        let args = ["build", file, "--safety", "-o", output];
        let said = folder.output(WHIPPEN, &args).expect("starts");
        let told = crate::tools::text(&said.stderr);
        assert_eq!(said.status.code(), Some(2), "{told}");
        assert!(
            told.contains(why) && !folder.path().join(output).exists(),
            "{told}"
        );
    }
}

/// Names that differ in case only, that begin as others end, and that mean two things.
const ALIKE: &str = "instrument alike {
    sense x: length in 0 mm .. 10 mm over 1 ms
    live param k = 80 N/m in 0 N/m .. 200 N/m
    live param K = 8 N/m in 0 N/m .. 20 N/m
    live param k_1 = 0.5 in 0 .. 1
    live param Loud = on
    event events when x > 5 mm { emit events(lost: x') }
    event set when x > 6 mm { emit k(min: x', Min: x, a_b: x) emit k_a(b: x) }
    event c when x > 7 mm { emit c(fraction_bits: x') }
    force spring = if Loud then k * x + K * x * k_1 else 0 N
}
";

#[test]
fn no_two_things_have_one_name() {
    let folder = Folder::new();
    folder.write("alike.whip", ALIKE);
    let output = ["build", "alike.whip", "--keys", "2", "-o", "alike.c"];
    folder.run(WHIPPEN, &output).expect("is built");
    let read = |file: &str| std::fs::read_to_string(folder.path().join(file)).expect("written");
    let once = |file: &str, begin: &str| {
        let text = read(file);
        let lines = text
            .lines()
            .filter_map(|line| line.trim().strip_prefix(begin));
        let name = |line: &str| line.split([' ', ':', '(']).next().unwrap_or("").to_string();
        let mut all: Vec<String> = lines.map(name).collect();
        let many = all.len();
        all.sort();
        all.dedup();
        assert_eq!(all.len(), many, "{file}: {all:?}");
        all
    };
    let header = once("alike.h", "#define ");
    assert!(header.contains(&"ALIKE_K_A_B".to_string()), "{header:?}");
    once("alike.rs", "pub const ");
    assert!(once("alike.rs", "pub fn ").contains(&"events_lost".to_string()));
    once("alike.rs", "pub unsafe fn ");
    // A switch takes a bool, a number none.
    let module = read("alike.rs");
    assert!(
        module.contains("set_Loud(state: *mut State, value: bool)"),
        "{module}"
    );
    assert!(
        module.contains("/// Largest value of `k_1`, in 1."),
        "{module}"
    );
    let Some(()) = folder
        .run("gcc", &[STRICT, &["-c", "alike.c"]].concat())
        .map(drop)
    else {
        return;
    };
}
