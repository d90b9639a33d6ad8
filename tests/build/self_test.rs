//! `--self-test`: the command, and its image as others run it.

use crate::tools::{Folder, WHIPPEN, text};

const HAMMOND: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/instruments/hammond.whip");

/// Exit code and what is said.
fn run(folder: &Folder, args: &[&str]) -> (Option<i32>, String) {
    let output = folder.output(WHIPPEN, args).expect("starts");
    let said = text(&output.stdout) + &text(&output.stderr);
    (output.status.code(), said)
}

#[test]
fn an_image_that_tells_of_itself() {
    let folder = Folder::new();
    let on = ["--board", "rp2350"];
    let build = ["build", HAMMOND, "--self-test", "-o", "test.elf"];
    let (code, said) = run(&folder, &[&build[..], &on].concat());
    assert!(code == Some(0) && said.contains("115200 baud"), "{said}");
    let emulate = ["emulate", "test.elf", "--read", "self_test:4"];
    let (code, said) = run(&folder, &[&emulate[..], &on].concat());
    assert_eq!(code, Some(0), "{said}");
    for words in [
        " programs differ",
        "0 of 1024 ticks of hammond differ",
        "|WHST|",
    ] {
        assert!(said.contains(words), "{said}");
    }
    // A core whose flag-setting instructions with a shifted register take a cycle less.
    let unlike = ["--shifted-flags", "1"];
    let (code, said) = run(&folder, &[&emulate[..2], &on, &unlike].concat());
    let differs =
        "3      2 rule     a shifted register that sets the flags DIFFERS: less by      1";
    assert!(code == Some(1) && said.contains(differs), "{said}");
}

#[test]
fn what_is_no_self_test() {
    let folder = Folder::new();
    let split = concat!(env!("CARGO_MANIFEST_DIR"), "/instruments/split.whip");
    let refused = [
        (vec![HAMMOND, "-o", "test.o"], "--self-test makes an image"),
        (
            vec![HAMMOND, "-o", "test.uf2", "--board", "stm32f4"],
            "make a .elf",
        ),
        (
            vec![HAMMOND, "-o", "test.elf", "--unproven"],
            "cannot be used with",
        ),
        (vec![split, "split", "-o", "test.elf"], "of one instrument"),
    ];
    for (args, why) in refused {
        let (code, said) = run(&folder, &[&["build", "--self-test"], &args[..]].concat());
        assert!(code == Some(2) && said.contains(why), "{args:?}: {said}");
        let written = std::fs::read_dir(folder.path()).expect("a folder").count();
        assert_eq!(written, 0, "{args:?}");
    }
}
