//! The debugger's view, through the real socket and the real gdb.

use std::io::{BufRead, BufReader};
use std::process::{Child, Command, Stdio};

use super::gnu::gcc;
use crate::cli::Shell;

const SOURCE: &str = "
#include <stdint.h>
volatile uint32_t counter, other;
float ratio = 1.5f;
char text[8] = \"whippen\";
uint32_t add(uint32_t a, uint32_t b) {
    uint32_t sum = a + b;
    return sum;
}
uint32_t run(uint32_t n) {
    float r = ratio * 2.0f;
    for (uint32_t i = 0; i < n; i++) {
        counter = add(counter, i);
        other = counter ^ i;
    }
    return counter + (uint32_t)r;
}
";

/// The command under gdb; what gdb printed, what the command printed, and its exit code.
fn debugged(
    shell: &Shell,
    image: &str,
    options: &[&str],
    script: &[&str],
) -> (String, String, Option<i32>) {
    let mut server = Command::new(env!("CARGO_BIN_EXE_whippen"))
        .args(["emulate", image, "--gdb", "0"])
        .args(options)
        .current_dir(shell.path("."))
        .stderr(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .expect("the command starts");
    let mut errors = BufReader::new(server.stderr.take().expect("piped"));
    let mut line = String::new();
    errors.read_line(&mut line).expect("a line");
    let port = line
        .trim()
        .rsplit_once(':')
        .unwrap_or_else(|| panic!("no port: {line}"))
        .1
        .to_string();
    let mut gdb = Command::new("gdb-multiarch");
    gdb.args([
        "-batch",
        "-nx",
        "-iex",
        "set auto-load off",
        "-ex",
        "set confirm off",
        "-ex",
        "set architecture arm",
    ]);
    gdb.args([
        "-ex",
        "set remotetimeout 30",
        "-ex",
        &format!("target remote localhost:{port}"),
    ]);
    gdb.args(script.iter().flat_map(|command| ["-ex", command]));
    let output = gdb
        .arg(image)
        .current_dir(shell.path("."))
        .output()
        .expect("gdb starts");
    let told = String::from_utf8_lossy(&output.stdout).into_owned()
        + &String::from_utf8_lossy(&output.stderr);
    let code = ended(&mut server);
    let mut rest = String::new();
    std::io::Read::read_to_string(&mut errors, &mut rest).expect("text");
    (told, rest, code)
}

/// The exit code of a server that has to end by itself.
fn ended(server: &mut Child) -> Option<i32> {
    for _ in 0..400 {
        if let Some(status) = server.try_wait().expect("a child") {
            return status.code();
        }
        std::thread::sleep(std::time::Duration::from_millis(25));
    }
    let _ = server.kill();
    panic!("the server did not end");
}

/// A linked image, so that gdb knows every line.
fn image() -> Option<Shell> {
    let shell = Shell::new().with("debug.c", SOURCE);
    let flags = [
        "-Og",
        "-g",
        "-mcpu=cortex-m33",
        "-mfloat-abi=hard",
        "-nostdlib",
        "-Ttext=0x20000000",
        "-Wl,-e,run",
    ];
    let args: Vec<&str> = flags
        .into_iter()
        .chain(["debug.c", "-o", "debug.elf"])
        .collect();
    (whippen_need::tool("gdb-multiarch").is_some() && gcc(&shell, &args)).then_some(shell)
}

/// What follows each mention, line by line in order.
#[track_caller]
fn says(text: &str, parts: &[&str]) {
    let mut rest = text;
    for part in parts {
        let Some(at) = rest.find(part) else {
            panic!("`{part}` is missing, or not where it should be, in\n{text}")
        };
        rest = &rest[at + part.len()..];
    }
}

#[test]
fn breakpoints_steps_registers_and_memory() {
    let Some(shell) = image() else { return };
    let script = [
        "break add",
        "continue",
        "continue",
        "print/d $r1",
        "backtrace",
        "stepi",
        "info registers pc",
        "finish",
        "set var $s9 = 2.5",
        "print $s9 + $d4",
        "print/x $msp == $sp",
        "info threads",
        "x/8xb text",
        "set var counter = 100",
        "print text",
        "delete",
        "monitor cycles",
        "continue",
    ];
    let (told, server, code) = debugged(&shell, "debug.elf", &["--call", "run,4"], &script);
    says(
        &told,
        &[
            "Breakpoint 1, add (a=0",
            "Breakpoint 1, add (a=0",
            "$1 = 1",
            "#0  add",
            "#1",
            "in run (n=4)",
        ],
    );
    says(
        &told,
        &[
            "pc ",
            "Value returned is $2 = 1",
            "$3 = 10.5",
            "$4 = 0x1",
            "core 0, running",
            "0x77",
            "0x68",
            "0x69",
        ],
    );
    says(&told, &["\"whippen\"", "exited normally"]);
    assert!(
        told.contains("core 0: ") && told.contains(" cycles"),
        "monitor cycles:\n{told}"
    );
    // 0 + 1 came back as the sum, which is stored after 100 was: 1 + 2 + 3 and the ratio, 3.
    says(&server, &["the function returned 0x00000009 after "]);
    assert_eq!(code, Some(0));
}

#[test]
fn watchpoints_stop_at_accesses() {
    let Some(shell) = image() else { return };
    let script = [
        "watch other",
        "rwatch ratio",
        "continue",
        "continue",
        "continue",
        "info breakpoints",
        "delete",
        "detach",
    ];
    let (told, _, code) = debugged(&shell, "debug.elf", &["--call", "run,4"], &script);
    says(
        &told,
        &[
            "Hardware watchpoint 1: other",
            "Hardware read watchpoint 2: ratio",
            "Value = 1.5",
        ],
    );
    says(
        &told,
        &[
            "Hardware watchpoint 1: other",
            "Old value = 0",
            "New value = 1",
        ],
    );
    assert_eq!(code, Some(0));
}

#[test]
fn lines_are_stepped_and_faults_are_signals() {
    let Some(shell) = image() else { return };
    let script = [
        "next",
        "next",
        "next",
        "step",
        "set $pc = 0x10000000",
        "stepi",
        "kill",
    ];
    let (told, server, code) = debugged(&shell, "debug.elf", &["--call", "run,4"], &script);
    says(&told, &["run (n=4)", "add (a=", "return sum", "SIGSEGV"]);
    says(&server, &["no code at 0x10000000"]);
    assert_eq!(code, Some(0));
}

#[test]
fn a_running_program_is_interrupted() {
    let Some(shell) = image() else { return };
    // `run` with as many rounds as there are takes minutes; gdb interrupts it after a moment, in
    // `run` or what it calls.
    let script = [
        "python import gdb, threading",
        "python threading.Timer(0.5, lambda: gdb.post_event(lambda: gdb.execute('interrupt'))).start()",
    ];
    let async_script: Vec<&str> = script
        .into_iter()
        .chain(["continue", "frame function run", "print n > 1000", "kill"])
        .collect();
    let (told, _, code) = debugged(&shell, "debug.elf", &["--call", "run,-1"], &async_script);
    if told.contains("Python scripting is not supported") {
        println!("SKIPPED: gdb without Python");
        return;
    }
    says(&told, &["SIGINT", "$1 = 1"]);
    assert_eq!(code, Some(0));
}

/// Core 0 starts core 1 of an RP2350 as the boot ROM expects it, and both count.
const TWO: &str = "
#include <stdint.h>
#define REG(address) (*(volatile uint32_t *)(address))
volatile uint32_t count[2];
static uint32_t stack[64];
void other(void) { for (;;) count[1]++; }
extern uint32_t vectors[];
static void send(uint32_t word) { while (!(REG(0xd0000050) & 2)); REG(0xd0000054) = word; __asm__ volatile(\"sev\"); }
static uint32_t receive(void) { while (!(REG(0xd0000050) & 1)) __asm__ volatile(\"wfe\"); return REG(0xd0000058); }
static void start_other(void) {
    const uint32_t words[] = {0, 0, 1, (uint32_t)vectors, (uint32_t)&stack[64], (uint32_t)other};
    for (int i = 0; i < 6;) {
        if (!words[i]) while (REG(0xd0000050) & 1) (void)REG(0xd0000058);
        send(words[i]);
        i = receive() == words[i] ? i + 1 : 0;
    }
}
void reset(void) { start_other(); for (;;) count[0]++; }
__attribute__((section(\".vectors\"), used)) uint32_t vectors[] = {0x20040000, (uint32_t)reset};
";

#[test]
fn both_cores_of_a_board_are_threads() {
    let shell = Shell::new().with("two.c", TWO);
    let flags = [
        "-O1",
        "-g",
        "-mcpu=cortex-m33",
        "-mfloat-abi=soft",
        "-nostdlib",
        "-Wl,-e,reset",
        "-fno-toplevel-reorder",
    ];
    let place = [
        "-Wl,--section-start=.vectors=0x10000000",
        "-Wl,-Ttext=0x10001000",
        "-Wl,-Tdata=0x20000000",
    ];
    let place = place
        .into_iter()
        .chain(["-Wl,-Tbss=0x20000100", "two.c", "-o", "two.elf"]);
    let args: Vec<&str> = flags.into_iter().chain(place).collect();
    if whippen_need::tool("gdb-multiarch").is_none() || !gcc(&shell, &args) {
        return;
    }
    let script = [
        "info threads",
        "break other",
        "continue",
        "thread",
        "delete",
        "watch count[1] if count[1] == 7",
        "continue",
        "print count[0] > 0",
        "thread 1",
        "backtrace",
        "thread 2",
        "stepi",
        "kill",
    ];
    let (told, _, code) = debugged(&shell, "two.elf", &["--board", "rp2350"], &script);
    says(
        &told,
        &[
            "core 0, ",
            "core 1, ",
            "hit Breakpoint 1, other ()",
            "[Current thread is 2 ",
        ],
    );
    says(
        &told,
        &[
            "New value = 7",
            "$1 = 1",
            "[Switching to thread 1 ",
            "in reset ()",
            "[Switching to thread 2 ",
        ],
    );
    assert_eq!(code, Some(0));
}
