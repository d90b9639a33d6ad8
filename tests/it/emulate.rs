//! `whippen emulate` as its users meet it. Programs are compiled by arm-none-eabi-gcc; without it
//! those tests say so.

mod boards;
mod gdb;
mod gnu;
#[path = "../../emulator/tests/made/elf.rs"]
mod made;

use crate::cli::Shell;
pub use gnu::gcc;
use made::{Part, elf_of};

/// Increments R0, stores it at 0x20000000 and returns; at 0x20000100. Then a word that is
/// undefined.
fn tiny() -> Vec<u8> {
    let code: Vec<u8> = [0x3001_u16, 0x4901, 0x6008, 0x4770, 0x0000, 0x2000, 0xde00]
        .iter()
        .flat_map(|h| h.to_le_bytes())
        .collect();
    let size = code.len() as u32;
    elf_of(
        2,
        0,
        &[Part {
            run: 0x2000_0100,
            load: 0x2000_0100,
            bytes: &code,
            memory_bytes: size,
            flags: 5,
        }],
    )
}

fn shell() -> Shell {
    let shell = Shell::new();
    std::fs::write(shell.path("tiny.elf"), tiny()).expect("writable");
    shell
}

const SOURCE: &str = "
#include <stdint.h>
int16_t samples[4] = {1, -2, 3, -4};
static const int16_t taps[4] = {10, 20, 30, 40};
uint32_t calls;
int32_t fir(const int16_t *x, int n) { int32_t s = 0; calls++; for (int i = 0; i < n; i++) s += x[i] * taps[i]; return s; }
uint64_t wide(uint32_t a, uint32_t b) { return (uint64_t)a * b; }
float half(float x) { return x * 0.5f; }
int needs(int x) { extern int absent(int); return absent(x) + 1; }
int load(const int *p) { return *p; }
void forever(void) { for (;;) calls++; }
";

/// The object file of `SOURCE`, if there is a compiler.
fn with_object() -> Option<Shell> {
    let shell = shell().with("fir.c", SOURCE);
    gcc(
        &shell,
        &[
            "-O1",
            "-g",
            "-mcpu=cortex-m33",
            "-mfloat-abi=hard",
            "-c",
            "fir.c",
            "-o",
            "fir.o",
        ],
    )
    .then_some(shell)
}

#[test]
fn a_function_at_an_address_is_called() {
    let (out, err) = shell().ends(
        0,
        &[
            "emulate",
            "tiny.elf",
            "--call",
            "0x20000100,41",
            "--read",
            "0x20000000:4",
            "--json",
        ],
    );
    assert_eq!(err, "");
    // ADDS 1, LDR 1, STR 1 and 1 for the late address, BX LR 2 less 1 because it is folded.
    let expected = "{\"cycles\":5,\"instructions\":4,\"r0\":42,\"r1\":536870912,\"reads\":[\"2a000000\"],\"stop\":\"returned\",\
                    \"core\":\"cortex-m33\"}\n";
    assert_eq!(out, expected);
}

#[test]
fn a_summary_is_for_people() {
    let (out, _) = shell().ends(
        0,
        &[
            "emulate",
            "tiny.elf",
            "--call",
            "0x20000101,-2",
            "--read",
            "0x20000000:4",
        ],
    );
    let lines: Vec<&str> = out.lines().collect();
    assert_eq!(lines[0], "0x20000101 returned 0xffffffff (-1)");
    assert!(
        lines[1].contains("cycles")
            && lines[1].contains(" 5 ")
            && lines[1].ends_with("150 MHz, cortex-m33"),
        "{out}"
    );
    assert!(lines[2].contains("1.25 cycles each"), "{out}");
    assert_eq!(
        lines[5],
        "  20000000  ff ff ff ff                                      |....|"
    );
}

#[test]
fn a_disputed_rule_is_a_switch() {
    // cmp r0, r1, lsl #8 (the S form with a shifted register); bx lr
    let code: Vec<u8> = [0xebb0_u16, 0x2f01, 0x4770, 0xbf00]
        .iter()
        .flat_map(|h| h.to_le_bytes())
        .collect();
    let part = Part {
        run: 0x2000_0100,
        load: 0x2000_0100,
        bytes: &code,
        memory_bytes: 8,
        flags: 5,
    };
    let shell = Shell::new();
    std::fs::write(shell.path("cmp.elf"), elf_of(2, 0, &[part])).expect("writable");
    let cycles = |side: &str| {
        let args = [
            "emulate",
            "cmp.elf",
            "--call",
            "0x20000100",
            "--json",
            "--shifted-flags",
            side,
        ];
        let (out, _) = shell.ends(0, &args);
        serde_json::from_str::<serde_json::Value>(&out).expect("JSON")["cycles"].as_u64()
    };
    assert_eq!(
        cycles("2").zip(cycles("1")).map(|(two, one)| two - one),
        Some(1)
    );
    shell.refuses(
        2,
        &["emulate", "cmp.elf", "--shifted-flags", "3"],
        &["--shifted-flags"],
    );
}

#[test]
fn memory_is_written_before_and_read_after() {
    let shell = shell();
    std::fs::write(shell.path("bytes.bin"), [1, 2, 3]).expect("writable");
    let args = [
        "emulate",
        "tiny.elf",
        "--call",
        "0x20000100",
        "--write",
        "0x20000010=0A0b 0c",
        "--write",
        "0x20000013=@bytes.bin",
        "--read",
        "0x20000010:6",
        "--json",
    ];
    let (out, _) = shell.ends(0, &args);
    assert!(out.contains("\"reads\":[\"0a0b0c010203\"]"), "{out}");
}

#[test]
fn what_goes_wrong_while_it_runs_ends_with_1() {
    let shell = shell();
    let (out, _) = shell.ends(
        1,
        &["emulate", "tiny.elf", "--call", "0x2000010c", "--json"],
    );
    assert!(
        out.contains("\"stop\":\"fault\"") && out.contains("undefined instruction at 0x2000010c"),
        "{out}"
    );
    let (out, _) = shell.ends(
        1,
        &[
            "emulate",
            "tiny.elf",
            "--call",
            "0x20000100",
            "--max-cycles",
            "3",
        ],
    );
    assert!(
        out.contains("the limit of 3 cycles was reached; --max-cycles sets another"),
        "{out}"
    );
}

#[test]
fn a_wrong_command_line_or_image_ends_with_2_and_says_what_to_do() {
    let shell = shell()
        .with("prose.elf", "Dear reader,\n")
        .with("empty.elf", "");
    let wrong = |args: &[&str], words: &[&str]| {
        let all: Vec<&str> = ["emulate"].iter().chain(args).copied().collect();
        shell.refuses(2, &all, words);
    };
    let mut x86 = tiny();
    x86[18] = 62;
    std::fs::write(shell.path("x86.elf"), x86).expect("writable");
    wrong(&["missing.elf"], &["missing.elf", "no such file"]);
    wrong(&["."], &["directory"]);
    wrong(&["prose.elf"], &["prose.elf", "is no ELF: this is text"]);
    wrong(&["empty.elf"], &["the file is empty"]);
    wrong(&["x86.elf"], &["is an ELF for x86-64, not for ARM"]);
    wrong(&["tiny.elf"], &["no start", "--call FUNCTION"]);
    wrong(
        &["tiny.elf", "--call", "main"],
        &["no symbols", "stripped", "`main` must be a number"],
    );
    wrong(
        &["tiny.elf", "--call", "0x10"],
        &["no code of the image at 0x00000010"],
    );
    wrong(
        &["tiny.elf", "--call", "0x20000100,1,2,3,4,5"],
        &["at most four arguments"],
    );
    wrong(
        &["tiny.elf", "--call", "0x20000100,4294967296"],
        &["does not fit into 32 bits"],
    );
    wrong(
        &["tiny.elf", "--call", "0x20000100", "--read", "0x20000000"],
        &["how many bytes", "ADDR:LEN"],
    );
    wrong(
        &["tiny.elf", "--call", "0x20000100", "--read", "0x50000000:4"],
        &["no memory at 0x50000003"],
    );
    wrong(
        &["tiny.elf", "--call", "0x20000100", "--write", "0x20000000"],
        &["ADDR=HEX or ADDR=@FILE"],
    );
    wrong(
        &[
            "tiny.elf",
            "--call",
            "0x20000100",
            "--write",
            "0x20000000=1",
        ],
        &["half a byte"],
    );
    wrong(
        &["tiny.elf", "--call", "0x20000100", "--core", "cortex-m7"],
        &["cortex-m0plus, cortex-m4, cortex-m33"],
    );
    wrong(
        &["tiny.elf", "--call", "0x20000100", "--ram", "0x20000000:1"],
        &["multiples of 4096"],
    );
    wrong(
        &["tiny.elf", "--call", "0x20000100", "--max-cycles", "soon"],
        &["`soon` is no count"],
    );
    wrong(
        &[
            "tiny.elf",
            "--call",
            "0x20000100",
            "--trace",
            "nowhere/trace.txt",
        ],
        &["no folder `nowhere`"],
    );
    wrong(
        &["tiny.elf", "--gdb", "3333", "--json"],
        &["--gdb", "--json"],
    );
}

#[test]
fn an_object_file_is_called_without_a_linker() {
    let Some(shell) = with_object() else { return };
    let json = |args: &[&str]| {
        let all: Vec<&str> = ["emulate", "fir.o", "--json"]
            .iter()
            .chain(args)
            .copied()
            .collect();
        shell.run(&all)
    };
    let text = |output: &std::process::Output| String::from_utf8_lossy(&output.stdout).into_owned();
    let output = json(&[
        "--call",
        "fir,samples,4",
        "--read",
        "calls",
        "--read",
        "samples+2:2",
    ]);
    assert!(
        text(&output).contains("\"r0\":4294967196,"),
        "10 - 40 + 90 - 160 is -100: {}",
        text(&output)
    );
    assert!(
        text(&output).contains("\"reads\":[\"01000000\",\"feff\"]"),
        "{}",
        text(&output)
    );
    let note = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(
        note,
        "note: the object file is not linked; it faults if it comes to `absent`\n"
    );
    // Written samples, other arguments, a 64-bit result.
    let output = json(&["--call", "fir,samples+2,1", "--write", "samples+2=0700"]);
    assert!(text(&output).contains("\"r0\":70,"), "{}", text(&output));
    let output = json(&["--call", "wide,-1,0x10"]);
    assert!(
        text(&output).contains("\"r0\":4294967280,\"r1\":15,"),
        "{}",
        text(&output)
    );
    // The FPU is on.
    assert_eq!(json(&["--call", "half"]).status.code(), Some(0));
    let output = json(&["--call", "needs,1"]);
    assert_eq!(output.status.code(), Some(1));
    assert!(
        text(&output).contains("\"where\":\"absent (not linked)\""),
        "{}",
        text(&output)
    );
    let (out, _) = shell.ends(1, &["emulate", "fir.o", "--call", "load,0x40000000"]);
    assert!(
        out.starts_with("stopped in load: BusFault: nothing answers a load at 0x40000000"),
        "{out}"
    );
    shell.refuses(
        2,
        &["emulate", "fir.o", "--call", "fri,1"],
        &["no symbol `fri`; did you mean `fir`?"],
    );
    shell.refuses(2, &["emulate", "fir.o"], &["no start", "fir", "wide"]);
}

#[test]
fn the_core_is_the_one_it_was_compiled_for() {
    for (cpu, core) in [
        ("cortex-m0", "cortex-m0plus"),
        ("cortex-m3", "cortex-m4"),
        ("cortex-m4", "cortex-m4"),
        ("cortex-m33", "cortex-m33"),
    ] {
        let shell = Shell::new().with("one.c", "int one(void) { return 1; }");
        if !gcc(
            &shell,
            &[&format!("-mcpu={cpu}"), "-c", "one.c", "-o", "one.o"],
        ) {
            return;
        }
        let (out, err) = shell.ends(0, &["emulate", "one.o", "--call", "one", "--json"]);
        assert!(
            out.contains(&format!("\"core\":\"{core}\"")) && err.is_empty(),
            "{cpu}: {out}{err}"
        );
    }
    let shell = Shell::new().with("one.c", "int one(void) { return 1; }");
    gcc(
        &shell,
        &["-mcpu=cortex-a9", "-mthumb", "-c", "one.c", "-o", "a9.o"],
    );
    shell.refuses(
        2,
        &["emulate", "a9.o", "--call", "one"],
        &["compiled for ARMv7-A or -R", "--core"],
    );
    shell.ends(
        0,
        &["emulate", "a9.o", "--call", "one", "--core", "cortex-m4"],
    );
    gcc(&shell, &["-mcpu=cortex-m33", "-c", "one.c", "-o", "m33.o"]);
    let (_, err) = shell.ends(
        0,
        &[
            "emulate",
            "m33.o",
            "--call",
            "one",
            "--core",
            "cortex-m0plus",
        ],
    );
    assert!(
        err.contains("compiled for a cortex-m33; a cortex-m0plus lacks some of its instructions"),
        "{err}"
    );
}

#[test]
fn a_linked_image_runs_from_reset_prints_and_is_profiled_and_traced() {
    let shell = Shell::new();
    let Some(()) = gnu::link(&shell, "mixed", &["-O2"]) else {
        return;
    };
    let (out, err) = shell.ends(0, &["emulate", "mixed.elf"]);
    assert!(
        out.starts_with("list by key ")
            && out.contains("\nthe program exited with 0\n")
            && err.is_empty(),
        "{out}{err}"
    );
    let cycles = |out: &str| {
        let line = out
            .lines()
            .find(|l| l.trim_start().starts_with("cycles "))
            .expect("a line with cycles")
            .to_string();
        line.split_whitespace()
            .nth(1)
            .expect("a number")
            .parse::<u64>()
            .expect("a number")
    };
    let (profiled, _) = shell.ends(
        0,
        &[
            "emulate",
            "mixed.elf",
            "--profile",
            "profile.json",
            "--trace",
            "trace.txt",
        ],
    );
    assert_eq!(cycles(&profiled), cycles(&out), "watching changes nothing");
    assert!(
        profiled.contains("share  instructions  function"),
        "{profiled}"
    );
    let profile = std::fs::read_to_string(shell.path("profile.json")).expect("written");
    let profile: serde_json::Value = serde_json::from_str(&profile).expect("JSON");
    // The BKPT that ends the program is counted by neither.
    assert_eq!(profile["cycles"].as_u64(), Some(cycles(&out)));
    let sum = |rows: &serde_json::Value| {
        rows.as_array()
            .expect("rows")
            .iter()
            .filter_map(|r| r["cycles"].as_u64())
            .sum::<u64>()
    };
    assert_eq!(sum(&profile["functions"]), cycles(&out));
    let lines = profile["lines"].as_array().expect("rows");
    assert!(
        lines
            .iter()
            .any(|l| l["file"].as_str().is_some_and(|f| f.ends_with("mixed.c"))),
        "lines of the source"
    );
    let trace = shell.lines("trace.txt");
    assert!(
        trace[0].starts_with("# core     cycle  address   instruction"),
        "{}",
        trace[0]
    );
    assert!(
        trace
            .iter()
            .any(|l| l.starts_with("# crc32  ") && l.contains("start.c:")),
        "names functions and lines"
    );
    let rows = trace.iter().filter(|l| !l.starts_with('#')).count() as u64;
    assert_eq!(Some(rows), profile["instructions"].as_u64());
}
