//! Images are proven before they are written; one that is not says so.

use whippen_emulator::elf::Elf;
use whippen_emulator::{Board, CoreKind, Machine, Register, Stop};

use crate::tools::{Folder, WHIPPEN, text};

/// A folder with the grand piano.
fn folder() -> Folder {
    let folder = Folder::new();
    let grand = concat!(env!("CARGO_MANIFEST_DIR"), "/instruments/grand-piano.whip");
    folder.write("grand.whip", std::fs::read(grand).expect("is there"));
    folder
}

/// Exit code and what is said.
fn run(folder: &Folder, line: &str) -> (Option<i32>, String) {
    let args: Vec<&str> = line.split(' ').collect();
    let output = folder.output(WHIPPEN, &args).expect("starts");
    let said = text(&output.stdout) + &text(&output.stderr);
    (output.status.code(), said)
}

#[test]
fn an_image_that_is_late_is_not_written() {
    let folder = folder();
    for name in ["late.elf", "late.uf2"] {
        let (code, said) = run(
            &folder,
            &format!("build grand.whip -o {name} --map late.map"),
        );
        assert_eq!(code, Some(1), "{said}");
        for words in ["[WH0701]", "keys fit as it is (--most-keys)", "--unproven"] {
            assert!(said.contains(words), "{said}");
        }
        assert!(!folder.path().join(name).exists() && !folder.path().join("late.map").exists());
    }
}

/// The bound of an object is that of any clock; of images and of C it is not asked.
#[test]
fn an_object_is_for_any_clock() {
    let folder = folder();
    for (clock, period) in [("170MHz", 3854), ("64 MHz", 1451)] {
        let args = [
            "build",
            "grand.whip",
            "--keys",
            "8",
            "-o",
            "grand.o",
            "--clock",
            clock,
        ];
        let output = folder.output(WHIPPEN, &args).expect("starts");
        let said = text(&output.stdout);
        let line = format!(
            "a tick at 44100 Hz and {} MHz has {period}.",
            &clock[..clock.len() - 3].trim()
        );
        assert!(output.status.success() && said.contains(&line), "{said}");
    }
    let (code, said) = run(
        &folder,
        "build grand.whip --keys 28 -o late.o --clock 64MHz",
    );
    assert!(code == Some(1) && said.contains("[WH0701]"), "{said}");
    for name in ["late.elf", "late.c"] {
        let (code, said) = run(
            &folder,
            &format!("build grand.whip -o {name} --clock 64MHz"),
        );
        assert!(code == Some(2) && said.contains("for a .o"), "{said}");
    }
    assert!(!folder.path().join("late.o").exists());
}

#[test]
fn an_unproven_image_says_so() {
    let folder = folder();
    let why = "`grand_piano` misses its deadline by";
    let (code, said) = run(&folder, "build grand.whip --unproven -o late.elf");
    assert!(code == Some(0) && said.contains(why), "{said}");
    let bytes = std::fs::read(folder.path().join("late.elf")).expect("is written");
    let elf = Elf::parse(&bytes, false).expect("an image");
    assert!(elf.unproven.is_some_and(|text| text.starts_with(why)));
    let (_, said) = run(&folder, "emulate late.elf --board rp2350 --max-cycles 1000");
    assert!(
        said.contains("not proven to be in time") && said.contains(why),
        "{said}"
    );
    let (code, _) = run(&folder, "build grand.whip --unproven -o late.uf2");
    assert_eq!(code, Some(0));
    let bytes = std::fs::read(folder.path().join("late.uf2")).expect("is written");
    let behind = String::from_utf8_lossy(&bytes[288..508]);
    assert!(
        behind.starts_with("Whippen: not proven") && behind.contains(why),
        "{behind}"
    );
    assert!(bytes[512 + 288..512 + 508].iter().all(|byte| *byte == 0));
}

#[test]
fn an_image_that_is_proven_has_no_mark() {
    let folder = folder();
    let mut images = Vec::new();
    for more in ["", " --unproven"] {
        let line = format!("build grand.whip --keys 4 -o grand.elf{more}");
        let (code, said) = run(&folder, &line);
        assert!(code == Some(0) && !said.contains("proven"), "{said}");
        images.push(std::fs::read(folder.path().join("grand.elf")).expect("is written"));
    }
    assert_eq!(images[0], images[1]);
    let elf = Elf::parse(&images[0], false).expect("an image");
    assert_eq!(elf.unproven, None);
}

#[test]
fn c_says_that_nothing_is_proven() {
    let folder = folder();
    let (code, said) = run(&folder, "build grand.whip --keys 2 -o piano.c");
    assert_eq!(code, Some(0), "{said}");
    let text = std::fs::read_to_string(folder.path().join("piano.h")).expect("is written");
    assert!(text.contains("Nothing is proven of its time"), "{text}");
}

/// What a text says behind some words, as a number.
fn number_behind(text: &str, words: &str) -> u64 {
    let (_, behind) = text.split_once(words).unwrap_or_else(|| panic!("{text}"));
    let digits: String = behind.chars().take_while(char::is_ascii_digit).collect();
    digits.parse().unwrap_or_else(|_| panic!("{text}"))
}

/// The longest of some ticks of the keys at rest, from the call to the return, without waiting.
fn longest_tick(object: &[u8]) -> u64 {
    let elf = Elf::parse(object, false).expect("an object");
    let mut machine = Machine::new(Board::generic(CoreKind::CortexM33)).expect("a board");
    elf.load(&mut machine.bus.memory, false).expect("memory");
    let stack = Register::named("sp").expect("a register");
    machine.cpu_mut(0).set(stack, 0x2006_0000);
    let at = |name: &str| elf.symbols.named(name).expect("it is there").address;
    let state = at("grand_piano_state");
    let mut call = |name: &str| {
        let called = machine.call(at(name) | 1, [state, 0, 0, 0], 1_000_000);
        let Stop::Returned { cycles, .. } = called else {
            panic!("{name}: {called}")
        };
        cycles
    };
    call("grand_piano_init");
    (0..60).map(|_| call("grand_piano_tick")).max().unwrap_or(0)
}

#[test]
fn a_relocatable_file_says_what_its_tick_takes() {
    let folder = folder();
    let mut bounds = Vec::new();
    for keys in [2, 12] {
        let (code, said) = run(
            &folder,
            &format!("build grand.whip --keys {keys} -o piano.o"),
        );
        assert_eq!(code, Some(0), "{said}");
        let most = number_behind(&said, "grand_piano_tick takes at most ");
        let frame = number_behind(&said, " for each key and ");
        let key = number_behind(&said.replace('\n', " "), "of a cortex-m33, ");
        assert_eq!(most, keys * key + frame, "{said}");
        for header in ["piano.h", "piano.rs"] {
            let text = std::fs::read_to_string(folder.path().join(header)).expect("is written");
            assert!(text.contains(&format!("at most {most} cycles")), "{text}");
            assert!(text.contains("all data lie in one memory"), "{text}");
        }
        let measured = longest_tick(&std::fs::read(folder.path().join("piano.o")).expect("it"));
        assert!(
            measured <= most && 2 * measured > most,
            "{measured} of {most}"
        );
        bounds.push(most);
    }
    assert!(bounds[0] < bounds[1]);
}

#[test]
fn a_relocatable_file_that_is_late_is_not_written() {
    let folder = folder();
    let (code, said) = run(&folder, "build grand.whip -o late.o --map late.map");
    assert_eq!(code, Some(1), "{said}");
    for words in ["[WH0701]", "--unproven"] {
        assert!(said.contains(words), "{said}");
    }
    for name in ["late.o", "late.h", "late.rs", "late.map"] {
        assert!(!folder.path().join(name).exists(), "{name}");
    }
    let (code, said) = run(&folder, "build grand.whip -o late.o --unproven");
    let why = "Not proven to be in time: `grand_piano` misses its deadline by";
    assert!(code == Some(0) && said.contains(why), "{said}");
    let header = std::fs::read_to_string(folder.path().join("late.h")).expect("is written");
    assert!(header.contains(why), "{header}");
}

#[test]
fn a_board_runs_what_is_proven() {
    let folder = folder();
    let run_with = |more: &str| {
        run(
            &folder,
            &format!("run grand.whip --engine emulated --seconds 0.01{more}"),
        )
    };
    let (code, said) = run_with(" --keys 88");
    assert!(code == Some(1) && said.contains("[WH0701]"), "{said}");
    let (code, said) = run_with(" --keys 8");
    assert!(code == Some(0) && said.contains("core 1: 4 keys"), "{said}");
    let (code, said) = run_with(" --keys 60 --unproven");
    assert!(
        code == Some(0) && said.contains("core 1: 30 keys"),
        "{said}"
    );
    let (code, said) = run(&folder, "run grand.whip --seconds 0.01 --keys 8");
    assert!(
        code == Some(2) && said.contains("--keys is for --engine emulated"),
        "{said}"
    );
}
