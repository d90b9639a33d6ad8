//! Boards that play an instrument in parts: every drive word and event is the interpreter's, and no
//! frame is longer than its bound.

use std::process::Command;

use whippen_compiler::firmware::Role;
use whippen_compiler::kernel::random::Rng;
use whippen_compiler::pipeline::Compiled;
use whippen_emulator::BoardKind;
use whippen_runtime::device::Device;
use whippen_runtime::engine::{Engine, EngineKind};

use crate::rig::{Image, words_of};
use crate::{
    KEYTAR, SLOW_HZ, SOUND_HZ, STRINGS, VIOLIN, WEIGHTS, bent_violin, compiled, compiled_bare,
};

fn is_member(role: Role) -> bool {
    matches!(role, Role::Member(_))
}

/// Ticks of each, where the environment does not say (`WHIPPEN_TICKS=N`).
const TICKS: usize = 200;

fn ticks() -> usize {
    whippen_need::count("WHIPPEN_TICKS", TICKS)
}

/// Plays the reference and the board; gives the longest frame and its bound.
fn compare(compiled: &Compiled, board: BoardKind) -> [u64; 2] {
    let device = Device::of(&compiled.model);
    let name = format!("{} on {}", compiled.model.name, board.name());
    let mut engines = [EngineKind::Interp, EngineKind::Emulated(board.into())].map(|kind| {
        Engine::new(kind, compiled, &device, 1).unwrap_or_else(|error| panic!("{name}: {error}"))
    });
    let [ins, outs] = words_of(compiled);
    let mut rng = Rng::new(7);
    let mut row = vec![30_000_u16; ins];
    let (mut says, mut happened) = (0, 0);
    for tick in 0..ticks() {
        // A hand that goes to and fro, and jumps at times.
        for (port, word) in row.iter_mut().enumerate() {
            let turn = tick as f64 / (90.0 + 40.0 * port as f64) - 1.2 * port as f64;
            let to = 32_000.0 + 20_000.0 * turn.sin();
            *word = if rng.chance(1, 400) {
                rng.next() as u16
            } else {
                to as u16
            };
        }
        let [reference, played] = engines.each_mut().map(|engine| {
            let mut drive = vec![0_i16; outs];
            if tick == 0 {
                engine.start(&row);
            }
            engine.tick(&row, &mut drive);
            (drive, engine.drain())
        });
        let trouble = engines[1].board().and_then(|board| board.trouble());
        assert_eq!(trouble, None, "{name}: tick {tick}");
        assert_eq!(played, reference, "{name}: tick {tick}");
        says += reference.0.iter().filter(|word| **word != 0).count();
        happened += reference.1.len();
    }
    assert!(says > ticks() / 4, "{name}: {says} words say something");
    let emits = !compiled.lowered.kernel.events.is_empty();
    assert!(happened > 0 || !emits, "{name}: {happened} events");
    let load = engines[1].board().expect("a board").load();
    let image = Image::of(compiled, board);
    let bound = image.bounded();
    let [found, most] = [load.cores[0].frame_cycles_max, bound.contended.cycles_max];
    assert!(found <= most, "{name}: {found}, bound {most}");
    [found, most]
}

#[test]
fn strings_in_parts_play_what_the_whole_plays() {
    let compiled = compiled(STRINGS, SLOW_HZ);
    for board in [BoardKind::Rp2350, BoardKind::Stm32f4] {
        let image = Image::of(&compiled, board);
        let cut = image.built.cut().expect("four members");
        // Those of a core are together.
        let members = cut.parts.iter().filter(|part| is_member(part.role));
        assert_eq!(members.count(), image.board.stacks.len());
        assert_eq!(cut.has_helper(), board != BoardKind::Stm32f4);
        println!("{} {:?}", board.name(), compare(&compiled, board));
    }
}

/// The bow of the bundled violin moves along its strings.
#[test]
fn a_violin_whose_bow_moves_along_plays_what_the_whole_plays() {
    println!(
        "{:?}",
        compare(&compiled(VIOLIN, SLOW_HZ), BoardKind::Rp2350)
    );
}

/// The goal: the bundled violin in a tick of 44.1 kHz. The emulator's frame of core 0 is within the
/// bound at that rate as well, and every word the interpreter's.
#[test]
fn a_violin_is_in_time_at_the_rate_of_sound() {
    let compiled = compiled(VIOLIN, SOUND_HZ);
    let image = Image::of(&compiled, BoardKind::Rp2350);
    let cut = image.built.cut().expect("four members");
    assert!(cut.has_early() && cut.has_sound());
    let [found, most] = compare(&compiled, BoardKind::Rp2350);
    println!("{found}, at most {most}");
    assert!(most <= u64::from(150_000_000 / SOUND_HZ), "{most}");
}

/// The goal: the bundled keytar as well. It has no members: what is heard is core 1's.
#[test]
fn a_keytar_is_in_time_at_the_rate_of_sound() {
    let image = Image::of(&compiled_bare(KEYTAR, SOUND_HZ), BoardKind::Rp2350);
    let cut = image.built.cut().expect("parts");
    assert!(!cut.parts.iter().any(|part| is_member(part.role)));
    assert!(cut.has_early() && cut.has_sound());
    let most = image.bounded().contended.cycles_max;
    let traced = compare(&compiled(KEYTAR, SOUND_HZ), BoardKind::Rp2350);
    println!("at most {most}; with transitions traced {traced:?}");
    assert!(most <= u64::from(150_000_000 / SOUND_HZ), "{most}");
}

/// On one core it stays in one piece.
#[test]
fn a_keytar_on_one_core_is_not_cut() {
    let compiled = compiled(KEYTAR, SLOW_HZ);
    let image = Image::of(&compiled, BoardKind::Stm32f4);
    assert!(image.built.cut().is_none());
    println!("{:?}", compare(&compiled, BoardKind::Stm32f4));
}

/// Core 0 waits before its members where what is early takes longer than the head.
#[test]
fn a_core_that_waits_for_what_is_early_plays_what_the_whole_plays() {
    let text = bent_violin("-7.1104 * grip", "grip", "-7.1104 * bent60");
    let compiled = compiled(&text, SLOW_HZ);
    let cut = Image::of(&compiled, BoardKind::Rp2350)
        .bounded()
        .contended
        .cut;
    let helped = cut.expect("parts").helped.expect("core 1");
    let [led, early] = helped.early_cycles_max().expect("core 1 begins early");
    assert!(early > led);
    println!("{:?}", compare(&compiled, BoardKind::Rp2350));
}

/// Members of one core are one part where that makes the frame shorter.
#[test]
fn members_of_a_core_are_together_where_that_is_faster() {
    let compiled = compiled(STRINGS, SOUND_HZ);
    let [together, apart] = [
        Image::of(&compiled, BoardKind::Rp2350),
        Image::divided(&compiled, BoardKind::Rp2350, &[0, 0, 1, 1, 0, 0]),
    ]
    .map(|image| {
        let parts = &image.built.cut().expect("four members").parts;
        let members = parts.iter().filter(|part| is_member(part.role));
        (members.count(), image.bounded().contended.cycles_max)
    });
    assert_eq!([together.0, apart.0], [2, 4]);
    assert!(together.1 + 50 < apart.1, "{together:?} {apart:?}");
}

/// The goal: four bowed strings in a tick of 44.1 kHz.
#[test]
fn four_strings_are_in_time_at_the_rate_of_sound() {
    let [found, most] = compare(&compiled(STRINGS, SOUND_HZ), BoardKind::Rp2350);
    println!("{found}, at most {most}");
    assert!(most <= u64::from(150_000_000 / SOUND_HZ), "{most}");
}

#[test]
fn weights_in_parts_play_what_the_whole_plays() {
    let compiled = compiled(WEIGHTS, SLOW_HZ);
    for board in [BoardKind::Rp2350, BoardKind::Rp2040, BoardKind::Stm32f4] {
        let image = Image::of(&compiled, board);
        assert_eq!(image.built.cut().expect("three members").parts.len(), 4);
        println!("{} {:?}", board.name(), compare(&compiled, board));
    }
}

/// What is heard is core 1's or the tail's, and the file is the interpreter's.
#[test]
fn strings_in_parts_are_heard_as_the_whole_is() {
    let boards = ["rp2350", "stm32f4"];
    heard_as_the_whole("tests/programs/bowed_strings.whip", SLOW_HZ, &boards);
}

/// As above, with a filter behind the strings and a volume that glides.
#[test]
fn a_violin_in_parts_is_heard_as_the_whole_is() {
    let violin = "instruments/bowed-violin.whip";
    heard_as_the_whole(violin, SOUND_HZ, &["rp2350"]);
    heard_as_the_whole(violin, 8200, &["rp2040"]);
}

/// Where nothing is a member: the strings are plucked by the head, and sound on core 1.
#[test]
fn a_keytar_in_parts_is_heard_as_the_whole_is() {
    let folder = tempfile::tempdir().expect("a folder");
    let strum = folder.path().join("strum.csv");
    let rows = "t_s,x_mm,y_mm,z_mm\n0,0,-30,-8\n0.02,5,-30,-8\n0.12,5,30,-8\n0.15,5,30,-8\n";
    std::fs::write(&strum, rows).expect("a file");
    let motion = ["--motion", strum.to_str().expect("a name")];
    heard_as_the_whole_with(&motion, "instruments/keytar.whip", SOUND_HZ, &["rp2350"]);
}

fn heard_as_the_whole(program: &str, rate_hz: u32, boards: &[&str]) {
    heard_as_the_whole_with(&["--seconds", "150ms"], program, rate_hz, boards);
}

fn heard_as_the_whole_with(args: &[&str], program: &str, rate_hz: u32, boards: &[&str]) {
    let folder = tempfile::tempdir().expect("a folder");
    let program = format!("{}/{program}", env!("CARGO_MANIFEST_DIR"));
    let rate = rate_hz.to_string();
    let heard = |name: &str, engine: &[&str]| {
        let file = folder.path().join(name);
        let output = Command::new(env!("CARGO_BIN_EXE_whippen"))
            .args(["run", &program, "--tick-rate", &rate])
            .args(args)
            .args(engine)
            .arg("--out")
            .arg(&file)
            .output();
        let output = output.expect("runs");
        assert!(output.status.success(), "{output:?}");
        std::fs::read(&file).expect("a file")
    };
    let whole = heard("whole.wav", &["--engine", "interp"]);
    assert!(whole.iter().filter(|byte| **byte != 0).count() > 1000);
    for board in boards {
        let engine = ["--engine", "emulated", "--board", board];
        assert!(whole == heard("parts.wav", &engine), "{board}");
    }
}
