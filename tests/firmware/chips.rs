//! Several chips that have one keyboard: what arrives at the first one is done by all and comes out
//! of the last one, among the notes of all. A parser of others (`midly`) says what bytes mean.

use midly::MidiMessage;
use midly::live::LiveEvent;
use midly::stream::MidiStream;
use whippen_compiler::Rng;
use whippen_compiler::firmware::{Setup, passed};
use whippen_emulator::{BoardKind, Uart};

use crate::midi::{Told, garbage, kernel_of, listening_with, messages, receive, state};
use crate::rig::{KEYS, RATE_HZ, Rig, setup};

/// Ticks for which chips run in turn: about as long as a byte takes.
const TURN: usize = 4;

/// Each chip runs for so many ticks with the same words on all keys, and what it sends arrives at
/// the next one; what the last one has sent.
fn play(chips: &mut [Rig], words: &[u16], ticks: usize) -> Vec<u8> {
    let mut out = Vec::new();
    for _ in 0..ticks.div_ceil(TURN) {
        let mut sent = Vec::new();
        for (chip, word) in chips.iter_mut().zip(words) {
            receive(chip, &std::mem::take(&mut sent), 0);
            chip.play(vec![*word; TURN * KEYS]);
            sent = chip.sent();
        }
        out.extend(sent);
    }
    out
}

fn passing() -> Setup {
    Setup {
        passes_midi: true,
        ..setup()
    }
}

/// Programs and live values of three chips are those that the parser of others finds in what
/// arrives at the first one, and the last one sends its messages.
#[test]
fn what_arrives_at_the_first_chip_arrives_at_all() {
    for (kind, cores) in [
        (BoardKind::Rp2350, 2),
        (BoardKind::Rp2040, 2),
        (BoardKind::Stm32f4, 1),
    ] {
        let mut chips: Vec<Rig> = (0..3)
            .map(|_| listening_with(kind, RATE_HZ, &passing()))
            .collect();
        let (mut rng, mut stream, mut told) = (Rng::new(9), MidiStream::new(), Told::default());
        let (mut arrived, mut left) = (Vec::new(), Vec::new());
        for round in 0..20 {
            let bytes = garbage(&mut rng);
            stream.feed(&bytes, |event| {
                told.hear(event);
                if let LiveEvent::Midi { channel, message } = event {
                    arrived.push((channel, message));
                }
            });
            receive(&mut chips[0], &bytes, 0);
            let ticks = 4 * bytes.len() + 150;
            left.extend(play(&mut chips, &[20_000; 3], ticks));
            for (number, chip) in chips.iter().enumerate() {
                let wanted = (told.program, told.lives.repeat(cores));
                assert_eq!(state(chip, cores), wanted, "{kind:?}, {round}, {number}");
            }
        }
        let mut passed = Vec::new();
        MidiStream::new().feed(&left, |event| match event {
            LiveEvent::Midi { channel, message } => passed.push((channel, message)),
            other => panic!("{other:?}"),
        });
        assert_eq!(passed, arrived, "{kind:?}");
        println!("{kind:?}: {} messages through three chips", passed.len());
        assert!(passed.len() > 80);
    }
}

/// Both chips play at once, with velocities of 14 bits, while notes arrive: every low part is right
/// ahead of its note, and every note of everybody comes out of the last chip.
#[test]
fn low_bits_stay_with_their_notes() {
    let kernel = kernel_of(crate::midi::SPEEDS);
    let chip = |first_note| {
        let setup = Setup {
            fine_velocity: true,
            first_note,
            ..passing()
        };
        Rig::with(&[&kernel], 0, &setup)
    };
    // Keys of the second one are notes from 64 on.
    let mut chips = [chip(20), chip(64)];
    play(&mut chips, &[0, 0], 20);
    let mut bytes = Vec::new();
    let mut host = Vec::new();
    let mut rng = Rng::new(14);
    for number in 0..30_u16 {
        // Some keys of each go down or up.
        for (at, chip) in chips.iter_mut().enumerate() {
            let word = 300 * (1 + number) + 77 * at as u16;
            chip.play((0..KEYS).map(|key| if key == 3 + at { word } else { 0 }));
        }
        let (low, velocity) = (1 + rng.below(127) as u8, 1 + rng.below(127) as u8);
        let message = [0xb7, 88, low, 0x97, 10 + (number % 8) as u8, velocity];
        host.push((message[4], u16::from(velocity) << 7 | u16::from(low)));
        receive(&mut chips[0], &message, 0);
        bytes.extend(play(&mut chips, &[0, 0], 60));
    }
    bytes.extend(play(&mut chips, &[0, 0], 1200));
    let (mut low, mut notes, mut ends) = (None, Vec::new(), 0);
    MidiStream::new().feed(&bytes, |event| {
        let LiveEvent::Midi { channel, message } = event else {
            panic!("{event:?}");
        };
        let is_host = |key: u8| key < 20;
        match message {
            MidiMessage::Controller { controller, value } => {
                assert_eq!((controller.as_int(), low), (88, None));
                low = Some((channel, u16::from(value.as_int())));
            }
            MidiMessage::NoteOn { key, vel } | MidiMessage::NoteOff { key, vel } => {
                let own = low.take();
                assert!(own.is_none_or(|(of, _)| of == channel), "{own:?} {channel}");
                assert_eq!(channel == 7, is_host(key.as_int()));
                let fine = u16::from(vel.as_int()) << 7 | own.map_or(0, |(_, low)| low);
                match message {
                    MidiMessage::NoteOn { .. } => notes.push((key.as_int(), fine)),
                    _ => ends += 1,
                }
            }
            other => panic!("{other:?}"),
        }
    });
    let of = |wanted: &dyn Fn(u8) -> bool| -> Vec<(u8, u16)> {
        let own = notes.iter().copied();
        own.filter(|(key, _)| wanted(*key)).collect()
    };
    assert_eq!(of(&|key| key < 20), host);
    for at in 0..2_u16 {
        let key = [23, 68][usize::from(at)];
        let speeds = (0..30_u16).map(|number| 300 * (1 + number) + 77 * at);
        // By the tables of the rig: half of the speed, within the table's rounding.
        let wanted: Vec<u16> = speeds.map(|speed| (speed / 2).clamp(128, 16_383)).collect();
        let found = of(&|own| own == key);
        assert_eq!(found.len(), wanted.len(), "{found:?}");
        for ((_, found), wanted) in found.iter().zip(wanted) {
            assert!(found.abs_diff(wanted) <= 1, "{found} {wanted}");
        }
    }
    assert_eq!((notes.len(), ends, low), (90, 60, None));
}

/// A host whose running status is denser than what is sent on: what finds no room is counted, and
/// what goes on is whole and in order.
#[test]
fn what_finds_no_room_is_counted() {
    let mut chips = [listening_with(BoardKind::Rp2350, RATE_HZ, &passing())];
    let mut bytes = vec![0x95];
    (0..900_u32).for_each(|number| bytes.extend([(number / 100) as u8, (number % 100) as u8 + 1]));
    receive(&mut chips[0], &bytes, 0);
    let out = play(&mut chips, &[20_000], 4 * bytes.len() + 1200);
    let numbers: Vec<u32> = messages(&out)
        .into_iter()
        .map(|message| match message {
            MidiMessage::NoteOn { key, vel } => {
                100 * u32::from(key.as_int()) + u32::from(vel.as_int()) - 1
            }
            other => panic!("{other:?}"),
        })
        .collect();
    assert!(numbers.is_sorted_by(|one, next| one < next));
    let lost = chips[0].word(chips[0].symbol("passed") + passed::LOST);
    println!("{} of 900 sent, {lost} lost", numbers.len());
    assert_eq!(numbers.len() as u32 + lost, 900);
    assert!(lost > 100);
    let port = chips[0].ports.uarts[0];
    let uart: &Uart = chips[0].machine.bus.device(port).expect("the port");
    assert!(uart.input.is_empty());
}
