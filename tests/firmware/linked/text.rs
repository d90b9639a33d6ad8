//! The C text, compiled here.

use std::io::Write;
use std::path::Path;
use std::process::{Command, Stdio};

use whippen_compiler::bindings::{Interface, SafetyInterface, c_header, c_source};
use whippen_compiler::firmware::{Setup, safety_numbers};
use whippen_compiler::kernel::verify;
use whippen_compiler::pipeline::Compiled;

use super::{Fault, OWN, Played, Story};

/// Reads rows (what happens, a value, words), writes drive words, then what is told.
const MAIN: &str = "
#include \"k.h\"
#include <stdio.h>
int main(int count, char **given) {
    int32_t what[2];
    unsigned first = 0, number = 0;
    if (count != 2 || sscanf(given[1], \"%u\", &first) != 1) return 1;
    while (fread(what, sizeof what, 1, stdin) == 1) {
        if (fread(k_state.inputs, sizeof k_state.inputs, 1, stdin) != 1) return 2;
        number++;
        if (number == 1) k_safe_init();
        if (number < first) continue;
        if (what[0] == 1) k_safety.tick = number - 2u;
        LIVE
        k_safe_tick(number);
        if (fwrite(k_state.outputs, sizeof k_state.outputs, 1, stdout) != 1) return 3;
    }
    uint32_t told[3] = { k_safety.missed, k_safety.faults, (uint32_t)k_safety.faulty_key };
    return fwrite(told, sizeof told, 1, stdout) == 1 ? 0 : 4;
}
";

/// The C text, compiled here by a compiler that takes no warning and looks for what C leaves
/// undefined; none where there is no compiler.
pub fn of_c(compiled: &Compiled, setup: &Setup, story: &Story, first: u32) -> Option<Played> {
    let gcc = whippen_need::tool("gcc")?;
    let kernel = verify(&compiled.lowered.kernel).expect("a kernel");
    let numbers = safety_numbers(setup).unwrap_or_else(|e| panic!("{e}"));
    let own = Interface::of_c(compiled, kernel, "k", OWN as u32)
        .with_safety(Some(SafetyInterface::of_c(numbers)));
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!(
        "linked-{}-{}",
        compiled.model.name,
        story.len()
    ));
    std::fs::create_dir_all(&folder).expect("a folder");
    let source = format!("#include \"k.h\"\n\n{}", c_source(&own).expect("C text"));
    let live = match compiled.lowered.kernel.lives.is_empty() {
        true => "",
        false => "if (what[0] == 2) k_state.live_push = what[1];",
    };
    for (name, text) in [
        ("k.h", c_header(&own)),
        ("k.c", source),
        ("main.c", MAIN.replace("LIVE", live)),
    ] {
        std::fs::write(folder.join(name), text).expect("it is written");
    }
    let flags = [
        "-std=c99",
        "-O1",
        "-Wall",
        "-Wextra",
        "-Wconversion",
        "-pedantic",
        "-Werror",
        "-fsanitize=undefined",
        "-fno-sanitize-recover=all",
        "main.c",
        "k.c",
        "-o",
        "linked",
    ];
    let made = Command::new(gcc).current_dir(&folder).args(flags).output();
    let made = made.expect("it starts");
    assert!(
        made.status.success(),
        "{}",
        String::from_utf8_lossy(&made.stderr)
    );
    let mut child = Command::new(folder.join("linked"))
        .arg(first.to_string())
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .expect("it starts");
    let mut input = child.stdin.take().expect("its input");
    let bytes: Vec<u8> = story.iter().flat_map(|row| row_of_c(row)).collect();
    let written = std::thread::spawn(move || input.write_all(&bytes));
    let output = child.wait_with_output().expect("it ends");
    written.join().expect("it ends").expect("it is read");
    assert!(output.status.success(), "{output:?}");
    let (drives, told) = output.stdout.split_at(output.stdout.len() - 12);
    let word = |bytes: &[u8]| i16::from_le_bytes([bytes[0], bytes[1]]);
    let row = |bytes: &[u8]| std::array::from_fn(|key| word(&bytes[2 * key..]));
    Some(Played {
        drives: drives.chunks(2 * OWN).map(row).collect(),
        told: [0, 4, 8].map(|at| u32::from_le_bytes(told[at..at + 4].try_into().expect("4"))),
    })
}

fn row_of_c((words, fault): &([u16; OWN], Fault)) -> Vec<u8> {
    let what = match fault {
        Fault::None => [0, 0],
        Fault::Missed => [1, 0],
        Fault::Live(value) => [2, *value],
    };
    let words = words.iter().flat_map(|word| word.to_le_bytes());
    what.iter()
        .flat_map(|word| word.to_le_bytes())
        .chain(words)
        .collect()
}
