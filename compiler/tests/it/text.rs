//! Spoiled texts of kernels: whatever they say, nobody panics, and what still verifies still runs
//! alike.

use whippen_compiler::jit::{JitCode, Options};
use whippen_compiler::kernel::random::{self, Rng};
use whippen_compiler::kernel::{Interp, Kernel, parse, verify};

/// Bits of text that mean something somewhere.
const PIECES: [&str; 20] = [
    "",
    " ",
    "\n",
    "{",
    "}",
    "v1",
    "v9999999",
    "0",
    "-1",
    "..",
    "i1",
    "i64",
    "= const 7",
    "yield",
    "else",
    "loop 3 (",
    "\"",
    "\u{e4}",
    "-9223372036854775808",
    "2147483648",
];

/// Replaces, removes or doubles a few stretches of the text.
fn spoil(rng: &mut Rng, text: &str) -> String {
    let mut words: Vec<String> = text
        .split_inclusive([' ', '\n'])
        .map(str::to_string)
        .collect();
    for _ in 0..1 + rng.below(3) {
        let at = rng.below(words.len() as u64) as usize;
        match rng.below(6) {
            0 => drop(words.remove(at)),
            1 => words.insert(at, rng.pick(&PIECES).to_string()),
            2 => words[at] = format!("{} ", rng.pick(&PIECES)),
            3 => words.insert(at, words[rng.below(words.len() as u64) as usize].clone()),
            4 => words.truncate(at + 1),
            _ => words[at] = words[at].chars().rev().collect(),
        }
        words.push(String::new());
    }
    words.concat()
}

/// Runs a kernel on both engines, the interpreter checking ranges.
fn run(kernel: &Kernel) {
    let mut rng = Rng::new(3);
    let mut interp = Interp::checked(kernel, 2).expect("verifies");
    let mut code = JitCode::build(kernel, 2, Options { probes: true }).expect("compiles");
    let words = random::inputs(&mut rng, kernel, 2);
    let mut out = [
        vec![0; 2 * kernel.outputs.len()],
        vec![0; 2 * kernel.outputs.len()],
    ];
    interp.init(&words);
    code.init(&words);
    for _ in 0..2 {
        interp.tick(&words, &mut out[0]);
        code.tick(&words, &mut out[1]);
    }
    assert_eq!(out[0], out[1], "{kernel}");
    assert_eq!(interp.memory(), code.memory(), "{kernel}");
    assert_eq!(interp.violation(), None, "{kernel}");
}

#[test]
fn spoiled_texts_do_no_harm() {
    let [mut read, mut verified] = [0; 2];
    for seed in 0..9000 {
        let mut rng = Rng::new(seed);
        let text = spoil(&mut rng, &random::kernel(seed % 100).to_string());
        let Ok(kernel) = parse(&text) else { continue };
        read += 1;
        let printed = kernel.to_string();
        assert_eq!(
            parse(&printed).expect("prints what it reads").to_string(),
            printed
        );
        if verify(&kernel).is_ok() {
            verified += 1;
            run(&kernel);
        }
    }
    assert!(
        read > 1000 && verified > 100,
        "{read} were read, {verified} verified"
    );
}
