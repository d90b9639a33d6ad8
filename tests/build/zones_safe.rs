//! Safety of several zones in one file: each is guarded as in a file of its own, whatever happens
//! to the others.

use crate::one_interface::{STRICT, TARGET, ran};
use crate::tools::{Folder, WHIPPEN};

/// Two instruments whose live values move the force under a sensor that stands still.
const PROGRAM: &str = "
instrument low {
    sense x: length in -0.5 mm .. 10.5 mm over 0.7 ms
    live param k = 80 N/m in 0 N/m .. 3000 N/m
    force spring = k * x
}
instrument high {
    sense x: length in -0.5 mm .. 10.5 mm over 0.7 ms
    live param weight = 0.1 N in 0 N .. 4 N
    states key { up -> down when x > 5 mm { emit note(speed: x') } down -> up when x < 4 mm { emit release() } }
    force weight = weight
    force push = if key is down then 0.5 N else 0 N
}
keyboard stage {
    board rp2350
    device mikey
    rate 44100 Hz
    keys C4 .. G4
    programs both
    zones both = { C4 .. E4: low, F4 .. G4: high }
}
";

/// Plays both, with faults in either; without those of the lower zone where WELL is defined.
const MAIN: &str = "
#ifdef APART
#include \"low.h\"
#include \"high.h\"
#else
#include \"both.h\"
#endif
#ifdef HOSTED
#include <stdio.h>
#endif
uint32_t low_sum = 2166136261u, high_sum = 2166136261u;
uint32_t low_missed, low_faults, low_key, high_missed, high_faults, high_key;
static uint32_t mix(uint32_t sum, uint32_t word) { return (sum ^ word) * 16777619u; }
static uint16_t moving(uint32_t tick, uint32_t key) {
    const uint32_t phase = (tick * (key + 5u) * 40u) % 131072u;
    return (uint16_t)(phase < 65536u ? phase : 131071u - phase);
}
static void feed(uint32_t tick) {
    for (uint32_t key = 0; key < LOW_KEYS; key++) low_state.inputs[key][0] = moving(tick, key);
    for (uint32_t key = 0; key < HIGH_KEYS; key++) high_state.inputs[key][0] = moving(tick, key + 5u);
    if (tick >= 2000u) high_state.inputs[0][0] = 0;
#ifndef WELL
    if (tick >= 300u) low_state.inputs[3][0] = 30000u;
    if (tick >= 600u) low_state.inputs[2][0] = 65535u;
    if (tick >= 1000u) low_state.inputs[4][0] = (uint16_t)(62000u + tick % 8u);
#endif
}
static void play(void) {
    feed(0);
    low_safe_init();
    high_safe_init();
    for (uint32_t tick = 0; tick < 16000u; tick++) {
        /* One tick is missed. */
        const uint32_t number = tick + 1u + (tick >= 1500u ? 1u : 0u);
        feed(tick);
        if (tick % 97u == 0) {
            (void)low_set_k(&low_state, tick % 2u == 0 ? LOW_K_MAX : LOW_K_INIT);
            (void)high_set_weight(&high_state, tick % 2u == 0 ? HIGH_WEIGHT_MAX : HIGH_WEIGHT_INIT);
        }
        low_safe_tick(number);
        high_safe_tick(number);
        for (uint32_t key = 0; key < LOW_KEYS; key++) low_sum = mix(low_sum, (uint16_t)low_state.outputs[key][0]);
        for (uint32_t key = 0; key < HIGH_KEYS; key++) high_sum = mix(high_sum, (uint16_t)high_state.outputs[key][0]);
    }
    low_missed = low_safety.missed;
    low_faults = low_safety.faults;
    low_key = (uint32_t)low_safety.faulty_key;
    high_missed = high_safety.missed;
    high_faults = high_safety.faults;
    high_key = (uint32_t)high_safety.faulty_key;
}
#ifdef HOSTED
int main(void) {
    play();
    printf(\"%u %u %u %u %u %u %u %u\\n\", (unsigned)low_sum, (unsigned)high_sum, (unsigned)low_missed, (unsigned)low_faults,
        (unsigned)low_key, (unsigned)high_missed, (unsigned)high_faults, (unsigned)high_key);
    return 0;
}
#else
#include <stddef.h>
/* C text wants it of a library. */
void *memset(void *to, int byte, size_t count);
void *memset(void *to, int byte, size_t count) {
    for (size_t at = 0; at < count; at++) ((volatile unsigned char *)to)[at] = (unsigned char)byte;
    return to;
}
#ifndef STACK
#define STACK 0x20080000u
#endif
/* In hexadecimal, by semihosting. */
static void tell(void) {
    const uint32_t words[8] = { low_sum, high_sum, low_missed, low_faults, low_key, high_missed, high_faults, high_key };
    char text[73], *to = text;
    for (unsigned word = 0; word < 8u; word++) {
        for (unsigned digit = 8u; digit-- > 0;) *to++ = \"0123456789abcdef\"[words[word] >> 4u * digit & 15u];
        *to++ = ' ';
    }
    *to = 0;
    __asm__ volatile (\"movs r0, #4\\n mov r1, %0\\n bkpt #0xab\" :: \"r\"(text) : \"r0\", \"r1\", \"memory\");
}
void reset(void);
void reset(void) {
    play();
    tell();
    __asm__ volatile (\"movs r0, #0x18\\n ldr r1, =0x20026\\n bkpt #0xab\" ::: \"r0\", \"r1\");
    for (;;) {}
}
struct vectors { uint32_t stack; void (*reset)(void); };
extern const struct vectors vectors;
__attribute__((section(\".vectors\"), used)) const struct vectors vectors = {STACK, reset};
#endif
";

/// What is told of a run.
const TOLD: [&str; 8] = [
    "low_sum",
    "high_sum",
    "low_missed",
    "low_faults",
    "low_key",
    "high_missed",
    "high_faults",
    "high_key",
];

const MISSED: u32 = 1;
const RAIL: u32 = 2;
const FROZEN: u32 = 4;
const HOT: u32 = 8;

/// A folder with the program and the files that `build` makes of it by these arguments.
fn built(all: &[&[&str]]) -> Folder {
    let folder = Folder::new();
    folder.write("both.whip", PROGRAM);
    folder.write("main.c", MAIN);
    for more in all {
        let args = [&["build", "both.whip"], *more, &["--safety"]].concat();
        folder.run(WHIPPEN, &args).expect("is built");
    }
    folder
}

/// What a program for the board says that was linked with these files.
fn on_the_target(folder: &Folder, more: &[&str]) -> Option<Vec<u32>> {
    let rest = ["-o", "out.elf", "-lgcc"];
    let args = [STRICT, TARGET, &["main.c"], more, &rest].concat();
    folder.run("arm-none-eabi-gcc", &args)?;
    ran(folder, &TOLD)
}

/// Where QEMU's mps2-an505 has code and data.
const QEMU: &[&str] = &[
    "-mcpu=cortex-m33",
    "-O1",
    "-nostdlib",
    "-DSTACK=0x38100000u",
    "-Wl,--fatal-warnings,-e,reset",
    "-Wl,--section-start=.vectors=0x10000000",
    "-Wl,-Ttext=0x10001000",
    "-Wl,-Tdata=0x38000000",
    "-Wl,-Tbss=0x38080000",
];

/// The same in QEMU.
fn in_qemu(folder: &Folder, file: &str) -> Option<Vec<u32>> {
    let args = [STRICT, QEMU, &["main.c", file, "-o", "qemu.elf", "-lgcc"]].concat();
    folder.run("arm-none-eabi-gcc", &args)?;
    let machine = ["-M", "mps2-an505", "-nographic", "-monitor", "none"];
    let more = ["-serial", "none", "-semihosting-config"];
    let more = [
        &more[..],
        &["enable=on,target=native", "-kernel", "qemu.elf"],
    ]
    .concat();
    let told = folder.run("qemu-system-arm", &[&machine[..], &more].concat())?;
    let words = told.split_whitespace();
    let words = words.filter_map(|word| u32::from_str_radix(word, 16).ok());
    Some(words.collect())
}

#[test]
fn each_zone_of_a_file_is_guarded_as_by_itself() {
    let object = built(&[&["both", "-o", "both.o"]]);
    let Some(told) = on_the_target(&object, &["both.o"]) else {
        return;
    };
    println!("{told:?}");
    assert_eq!(told[2..4], [1, MISSED | RAIL | FROZEN | HOT]);
    assert!([2, 3].contains(&told[4]), "the key of the last fault");
    assert_eq!(told[5..], [1, MISSED | RAIL, 0]);
    if let Some(told_there) = in_qemu(&object, "both.o") {
        assert_eq!(told_there, told, "QEMU");
    }
    // The same keys in a file for each instrument.
    let low = ["low", "--keys", "5", "-o", "low.o"];
    let high = ["high", "--keys", "3", "-o", "high.o"];
    let apart = built(&[&low, &high]);
    let of_two = on_the_target(&apart, &["-DAPART", "low.o", "high.o"]);
    assert_eq!(of_two.as_ref(), Some(&told), "two files");
    // What happens in one zone is nothing to the other.
    let well = on_the_target(&object, &["-DWELL", "both.o"]).expect("as before");
    assert_eq!(well[2..5], [1, MISSED, u32::MAX]);
    assert_eq!((well[1], &well[5..]), (told[1], &told[5..]));
    assert_ne!(well[0], told[0]);
    // The C text, here and on the target.
    let in_c = built(&[&["both", "-o", "both.c"]]);
    let of_text = on_the_target(&in_c, &["both.c"]);
    assert_eq!(of_text.as_ref(), Some(&told), "C text on the target");
    for compiler in ["gcc", "clang"] {
        let flags = ["-O2", "-DHOSTED", "main.c", "both.c", "-o", "out"];
        let Some(_) = in_c.run(compiler, &[STRICT, &flags[..]].concat()) else {
            continue;
        };
        let path = in_c.path().join("out");
        let said = in_c.run(path.to_str().expect("UTF-8"), &[]).expect("runs");
        let words = said.split_whitespace().map(|word| word.parse().ok());
        assert_eq!(words.collect::<Option<Vec<u32>>>(), Some(told.clone()));
    }
}
