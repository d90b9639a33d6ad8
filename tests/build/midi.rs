//! `--fine-velocity`: the command, and what its image sends.

use crate::tools::{Folder, WHIPPEN, text};

const HAMMOND: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/instruments/hammond.whip");
const PIANO: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/instruments/grand-piano.whip");

/// Two keys that go down once, the second one twice as fast, and up again: words of each tick.
fn strokes() -> Vec<u8> {
    let key = |tick: i32, ticks: i32| {
        let at = (tick - 1500).clamp(0, ticks) - (tick - 8000).clamp(0, ticks);
        (20_000 + 40_000 * at / ticks) as u16
    };
    let ticks = (0..12_000).flat_map(|tick| [key(tick, 3000), key(tick, 1500)]);
    ticks.flat_map(u16::to_le_bytes).collect()
}

/// What a board sends over MIDI whose image was built so.
fn sent(extra: &[&str]) -> Vec<u8> {
    let folder = Folder::new();
    folder.write("words.bin", strokes());
    let build = ["build", PIANO, "-o", "piano.elf", "--keys", "2"];
    let build = [&build[..], extra].concat();
    folder.run(WHIPPEN, &build).expect("it is there");
    let emulate = "emulate piano.elf --board rp2350 --keys 2 --sense words.bin";
    let args: Vec<&str> = emulate.split(' ').collect();
    let output = folder.output(WHIPPEN, &args).expect("it is there");
    let said = text(&output.stderr);
    assert!(output.status.success(), "{said}");
    output.stdout
}

/// Where in the bytes these follow each other.
fn places(bytes: &[u8], wanted: &[u8]) -> usize {
    let windows = bytes.windows(wanted.len());
    windows.filter(|window| *window == wanted).count()
}

#[test]
fn velocities_have_low_bits_where_they_are_wanted() {
    let (usual, fine) = (sent(&[]), sent(&["--fine-velocity"]));
    for note in [21, 22] {
        assert_eq!(places(&usual, &[0x90, note]), 1, "{usual:02x?}");
        assert_eq!(places(&fine, &[0x90, note]), 1, "{fine:02x?}");
    }
    assert_eq!(places(&usual, &[0xb0, 88]), 0, "{usual:02x?}");
    assert!(places(&fine, &[0xb0, 88]) > 0, "{fine:02x?}");
}

#[test]
fn it_is_for_images_that_play() {
    let folder = Folder::new();
    for args in [
        vec!["-o", "organ.o"],
        vec!["-o", "organ.c"],
        vec!["-o", "organ.elf", "--self-test"],
    ] {
        let args = [&["build", HAMMOND, "--fine-velocity"], &args[..]].concat();
        let output = folder.output(WHIPPEN, &args).expect("it is there");
        let said = text(&output.stderr);
        let told = said.contains("--fine-velocity is for whole images");
        assert!(output.status.code() == Some(2) && told, "{args:?}: {said}");
        let written = std::fs::read_dir(folder.path()).expect("a folder").count();
        assert_eq!(written, 0, "{args:?}");
    }
}
