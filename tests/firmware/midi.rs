//! MIDI both ways. A parser of others (`midly`) says what bytes mean.

use midly::live::LiveEvent;
use midly::stream::MidiStream;
use midly::{MidiMessage, num::u7};
use whippen_compiler::Rng;
use whippen_compiler::firmware::{Instrument, Setup, core_block};
use whippen_compiler::kernel::{Kernel, parse};
use whippen_compiler::keyboard::{InstrumentId, Program};
use whippen_compiler::modes::Modes;
use whippen_emulator::{BoardKind, Uart};

use crate::rig::{KEYS, RATE_HZ, Rig, midi, setup};

/// Notes and their ends as fast as the sensor word is large: a note above the middle.
pub const SPEEDS: &str = "kernel speeds @44100 {
  in x: u16 [0..65535]
  out f: i16 [-32768..32767]
  event note(1)
  event release(1)
  cell was: i32 [0..65535] = 0
  tick {
    v0: i32 [0..65535] = in x
    v1: i32 [0..65535] = get was
    v2: i1 [0..1] = lt v1 v0
    v3: i1 [0..1] = lt v0 v1
    if v2 {
      emit note v0
    } else {
    }
    if v3 {
      emit release v0
    } else {
    }
    set was v0
    v4: i32 [0..0] = const 0
    out f v4
  }
}
";

/// Live values of several ranges.
const LIVES: &str = "kernel lives @44100 {
  in x: u16 [0..65535]
  out f: i16 [-32768..32767]
  live small: i32 [0..1] = 0
  live signed: i32 [-700..900] = 3
  live whole: i32 [-2147483648..2147483647] = 0
  tick {
    v0: i32 [0..65535] = in x
    v1: i32 [0..1] = live small
    out f v1
  }
}
";

/// Lowest and highest values of these.
const RANGES: [[i64; 2]; 3] = [[0, 1], [-700, 900], [i32::MIN as i64, i32::MAX as i64]];

pub fn kernel_of(text: &str) -> Kernel {
    parse(text).unwrap_or_else(|error| panic!("{error:?}"))
}

/// What is played of each message, in order.
pub fn messages(bytes: &[u8]) -> Vec<MidiMessage> {
    let (mut stream, mut all) = (MidiStream::new(), Vec::new());
    stream.feed(bytes, |event| {
        if let LiveEvent::Midi { message, .. } = event {
            all.push(message);
        }
    });
    all
}

/// Velocities of 14 bits, with whether they are of a note's beginning: the low bits come ahead, and
/// hold for one note.
fn velocities(bytes: &[u8]) -> Vec<(bool, u16)> {
    let (mut low, mut all) = (0, Vec::new());
    for message in messages(bytes) {
        let mut whole = |vel: u7| u16::from(vel.as_int()) << 7 | std::mem::take(&mut low);
        match message {
            MidiMessage::Controller { controller, value } if controller == 88 => {
                low = u16::from(value.as_int());
            }
            MidiMessage::NoteOn { vel, .. } => all.push((true, whole(vel))),
            MidiMessage::NoteOff { vel, .. } => all.push((false, whole(vel))),
            other => panic!("{other:?}"),
        }
    }
    all
}

/// What a key sends that is at these words one after the other.
fn sent_of(words: &[u16], fine_velocity: bool) -> Vec<u8> {
    let setup = Setup {
        fine_velocity,
        ..setup()
    };
    let mut rig = Rig::with(&[&kernel_of(SPEEDS)], 0, &setup);
    let row = |word: u16| (0..KEYS).map(move |key| if key == 60 { word } else { 0 });
    rig.play((0..10).flat_map(|_| row(0)));
    for &word in words {
        // As long as six bytes take.
        rig.play((0..24).flat_map(|_| row(word)));
    }
    rig.sent()
}

/// Speeds of notes and of their ends, in turn.
fn speeds() -> Vec<u16> {
    let mut rng = Rng::new(88);
    let mut words = vec![
        1, 0, 65_535, 255, 256, 254, 32_767, 300, 32_768, 200, 32_400,
    ];
    for _ in 0..40 {
        words.push(rng.below(16_000) as u16);
        words.push(16_384 + rng.below(49_152) as u16);
    }
    words
}

/// The velocity of 14 bits of a speed: half of it, by the tables of the rig.
fn expected(speed: u16) -> u16 {
    (speed / 2).clamp(128, 16_383)
}

#[test]
fn velocities_have_14_bits() {
    let words = speeds();
    let mut was = 0;
    let told: Vec<(bool, u16)> = (words.iter())
        .map(|&word| (word > std::mem::replace(&mut was, word), word))
        .map(|(rises, word)| (rises, expected(word)))
        .collect();
    let near = |found: &[(bool, u16)]| {
        assert_eq!(found.len(), told.len());
        for (one, other) in found.iter().zip(&told) {
            // The last piece of the table ends at 16383, not at 16384.
            let differs = one.1.abs_diff(other.1);
            assert!(one.0 == other.0 && differs <= 1, "{one:?} {other:?}");
        }
    };
    let sent = sent_of(&words, true);
    near(&velocities(&sent));
    assert!(sent.contains(&88), "some velocities have low bits");
    let coarse = sent_of(&words, false);
    let messages = messages(&coarse);
    assert_eq!((coarse.len(), messages.len()), (3 * told.len(), told.len()));
    for (message, (rises, fine)) in messages.into_iter().zip(&told) {
        let (is_on, vel) = match message {
            MidiMessage::NoteOn { vel, .. } => (true, vel),
            MidiMessage::NoteOff { vel, .. } => (false, vel),
            other => panic!("{other:?}"),
        };
        let nearest = ((fine + 64) >> 7).min(127);
        let vel = u16::from(vel.as_int());
        assert!(
            is_on == *rises && vel.abs_diff(nearest) <= 1,
            "{vel} {fine}"
        );
        assert!((1..=127).contains(&vel));
    }
}

/// A board with two programs of live values.
fn listening(kind: BoardKind, rate_hz: u32) -> Rig {
    listening_with(kind, rate_hz, &setup())
}

/// The same, built otherwise.
pub fn listening_with(kind: BoardKind, rate_hz: u32, setup: &Setup) -> Rig {
    let kernel = kernel_of(LIVES);
    let (modes, midi) = (Modes::single(&kernel), midi(&kernel));
    let instruments = [Instrument {
        modes: &modes,
        places: &[],
        midi: &midi,
        parts: None,
    }; 2];
    let programs = [0, 1].map(|number| Program::of_zones("all", [(88, InstrumentId(number))]));
    let setup = Setup {
        keys: match kind {
            BoardKind::Stm32f4 => vec![88],
            _ => setup.keys.clone(),
        },
        rate_hz: rate_hz.into(),
        ..setup.clone()
    };
    let mut rig = Rig::on(kind, programs.to_vec(), &instruments, &setup);
    rig.play(vec![20_000; 100 * KEYS]);
    rig
}

/// Bytes arrive, and everything is done that they ask for.
pub fn receive(rig: &mut Rig, bytes: &[u8], ticks: usize) {
    let (port, cycle) = (rig.ports.uarts[0], rig.machine.cycle(0));
    let uart: &mut Uart = rig.machine.bus.device_mut(port).expect("the port");
    uart.receive(bytes, cycle);
    rig.machine.bus.reschedule(port);
    rig.play(vec![20_000; ticks * KEYS]);
}

/// The number of the program that is wanted on core 0, and all live values there and on core 1.
pub fn state(rig: &Rig, cores: usize) -> (usize, Vec<i32>) {
    let wanted = rig.block(0, core_block::WANTED);
    let programs = rig.symbol("programs") + 4;
    let is_wanted = |&at: &usize| rig.word(programs + 4 * (at * cores) as u32) == wanted;
    let number = (0..2).find(is_wanted).expect("a program");
    let mut values = Vec::new();
    for core in 0..cores {
        for program in 0..2 {
            let name = &rig.code(program, core).name;
            let state = rig.symbol(&format!("{name}_state"));
            let at = |live| rig.layout(program, core).live_param(live).expect("a place");
            values.extend((0..RANGES.len()).map(|live| rig.word(state + at(live)) as i32));
        }
    }
    (number, values)
}

/// The value of a parameter that a controller sets to this: the nearest on a line from the lowest
/// to the highest.
fn value(live: usize, control: u8) -> i32 {
    let [low, high] = RANGES[live];
    let part = i64::from(control) * 129 + i64::from(control >= 64);
    let scaled = (high - low) * part + (1 << 13);
    (low + (scaled >> 14)) as i32
}

/// Bytes as they may come: messages whole and broken off, running status, other messages, real time
/// anywhere, data that belongs to nothing.
pub fn garbage(rng: &mut Rng) -> Vec<u8> {
    let mut bytes = Vec::new();
    let data = |rng: &mut Rng| rng.below(128) as u8;
    for _ in 0..8 {
        let channel = rng.below(16) as u8;
        let control = 100 + rng.below(10) as u8;
        let message = match rng.below(12) {
            0..4 => vec![0xb0 | channel, control, data(rng)],
            4..6 => vec![control, data(rng)],
            6 => vec![0xc0 | channel, rng.below(3) as u8],
            7 => vec![
                0x80 | channel | (rng.below(7) as u8) << 4,
                data(rng),
                data(rng),
            ],
            8 => vec![0xf0, control, data(rng), control, 0xf7],
            9 => vec![0xf1 + rng.below(6) as u8, control, data(rng)],
            10 => vec![0xb0 | channel, control],
            _ => vec![data(rng)],
        };
        for byte in message {
            if rng.chance(1, 8) {
                bytes.push(0xf8 | rng.below(8) as u8);
            }
            bytes.push(byte);
        }
    }
    bytes
}

/// What the parser of others was told of two programs with live values, from their start on.
pub struct Told {
    pub program: usize,
    pub lives: Vec<i32>,
    /// Programs that were called, live values that were set.
    changes: [usize; 2],
}

impl Default for Told {
    fn default() -> Told {
        Told {
            program: 0,
            lives: vec![0, 3, 0, 0, 3, 0],
            changes: [0; 2],
        }
    }
}

impl Told {
    pub fn hear(&mut self, event: LiveEvent) {
        let LiveEvent::Midi { message, .. } = event else {
            return;
        };
        match message {
            MidiMessage::ProgramChange { program } if program < 2 => {
                self.program = usize::from(program.as_int());
                self.changes[0] += 1;
            }
            MidiMessage::Controller {
                controller,
                value: to,
            } => {
                let live = usize::from(controller.as_int()).checked_sub(102);
                if let Some(live) = live.filter(|live| *live < 2 * RANGES.len()) {
                    self.lives[live] = value(live % RANGES.len(), to.as_int());
                    self.changes[1] += 1;
                }
            }
            _ => {}
        }
    }
}

/// What arrives sets what the parser of others finds in it, on each board.
#[test]
fn what_arrives_is_what_another_parser_reads() {
    for (kind, cores) in [
        (BoardKind::Rp2350, 2),
        (BoardKind::Rp2040, 2),
        (BoardKind::Stm32f4, 1),
    ] {
        let mut rig = listening(kind, RATE_HZ);
        let mut rng = Rng::new(7);
        let (mut stream, mut told) = (MidiStream::new(), Told::default());
        for round in 0..60 {
            let bytes = garbage(&mut rng);
            stream.feed(&bytes, |event| told.hear(event));
            receive(&mut rig, &bytes, 4 * bytes.len() + 20);
            let told = (told.program, told.lives.repeat(cores));
            assert_eq!(state(&rig, cores), told, "{kind:?}, {round}: {bytes:02x?}");
        }
        let changes = told.changes;
        assert!(changes[0] > 10 && changes[1] > 100, "{changes:?}");
        let port = rig.converter();
        assert_eq!(port.overruns(), 0);
    }
}

/// Where ticks are so few that bytes are lost no value is made of two messages, and what comes
/// later is understood.
#[test]
fn after_lost_bytes_the_next_status_counts() {
    let mut rig = listening(BoardKind::Rp2350, 500);
    let mut bytes = Vec::new();
    for number in 0..200 {
        // With and without running status.
        bytes.extend((number % 3 == 0).then_some(0xb0));
        bytes.extend([[102, 127], [103, 90]][number % 2]);
    }
    let may_be = [vec![0, value(0, 127)], vec![3, value(1, 90)], vec![0]];
    receive(&mut rig, &bytes, 0);
    for _ in 0..400 {
        rig.play(vec![20_000; KEYS]);
        let (_, lives) = state(&rig, 2);
        let own = lives
            .chunks(3)
            .step_by(2)
            .flat_map(|own| own.iter().zip(&may_be));
        own.for_each(|(own, may_be)| assert!(may_be.contains(own), "{lives:?}"));
    }
    let uart: &Uart = rig
        .machine
        .bus
        .device(rig.ports.uarts[0])
        .expect("the port");
    assert!(uart.input.is_empty());
    for control in [20, 110] {
        receive(&mut rig, &[0xb5, 103, control], 200);
        let lives = state(&rig, 2).1;
        assert_eq!(lives[1], value(1, control), "{lives:?}");
    }
}
