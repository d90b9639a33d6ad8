//! The monitor: its own client, over the emulated serial port, to boards that play.

use std::io;
use std::time::Duration;

use crate::rig::{KEYS, Rig, midi, setup};
use whippen_compiler::firmware::{
    Fact, Instrument, Monitor, Setup, captured, core_block, image_identity,
};
use whippen_compiler::kernel::random::Rng;
use whippen_compiler::keyboard::{InstrumentId, Program};
use whippen_compiler::modes::Modes;
use whippen_compiler::pipeline::{Compiled, compile};
use whippen_compiler::source::SourceMap;
use whippen_emulator::{BoardKind, Uart};
use whippen_runtime::device::Device;
use whippen_runtime::gesture::default_gesture;
use whippen_runtime::monitor::{
    BoardMemory, Capture, CapturedRow, Client, CoreStatus, Link, MonitorError, Replay, Trigger,
    capture_room, read_status, rows_of,
};

/// How long an answer may take, of the board's time.
const PATIENCE: Duration = Duration::from_secs(3);

/// Ticks per second at which 88 keys fit that know nothing of their modes.
pub const RATE_HZ: u32 = 5000;

/// The serial port of a board, which plays while somebody waits.
pub struct Wire {
    pub rig: Rig,
    /// Every so many bytes each way one is changed, if any is.
    changes: Option<(u64, Rng)>,
    /// Ticks that were waited for.
    waited: usize,
    /// Of so many answers to come, and of so many requests, a byte is lost.
    loses: [usize; 2],
    /// Whether the answer to come is one of them.
    is_to_lose: bool,
}

impl Wire {
    fn spoil(&mut self, bytes: &mut [u8]) {
        if let Some((one_in, rng)) = &mut self.changes {
            for byte in bytes {
                if rng.chance(1, *one_in) {
                    *byte ^= 1 << rng.below(8);
                }
            }
        }
    }
}

impl Link for Wire {
    fn send(&mut self, bytes: &[u8]) -> io::Result<()> {
        let mut bytes = bytes.to_vec();
        self.spoil(&mut bytes);
        if self.loses[1] > 0 {
            self.loses[1] -= 1;
            bytes.remove(bytes.len() / 2);
        }
        if self.loses[0] > 0 {
            // What is left of an answer that was given up is no part of the next one.
            self.rig.run(40);
            self.rig.sent();
        }
        self.is_to_lose = true;
        let (port, cycle) = (self.rig.ports.uarts[0], self.rig.machine.cycle(0));
        let uart: &mut Uart = self.rig.machine.bus.device_mut(port).expect("the port");
        uart.receive(&bytes, cycle);
        self.rig.machine.bus.reschedule(port);
        self.rig.run(3);
        Ok(())
    }

    fn receive(&mut self, _: Duration) -> io::Result<Vec<u8>> {
        self.rig.run(4);
        self.waited += 4;
        let mut bytes = self.rig.sent();
        self.spoil(&mut bytes);
        if self.is_to_lose && self.loses[0] > 0 && bytes.len() > 8 {
            self.loses[0] -= 1;
            self.is_to_lose = false;
            bytes.remove(8);
        }
        if self.changes.is_some() && bytes.is_empty() {
            // Nobody answers what was changed; a host would wait for its patience.
            self.waited += 1;
        }
        Ok(bytes)
    }

    /// The board's, of about 150 MHz.
    fn time(&self) -> Duration {
        Duration::from_secs_f64(self.rig.machine.cycle(0) as f64 / 150e6)
    }
}

/// The bundled instrument of a file, for the usual device.
pub fn compiled(file: &str, rate_hz: u32) -> Compiled {
    let programs = whippen_compiler::bundled::INSTRUMENTS;
    let found = programs.iter().find(|(name, _)| *name == file);
    let mut map = SourceMap::default();
    map.add(file, found.expect("it is bundled").1);
    let options = whippen_compiler::check::Options {
        rate_hz: Some(rate_hz.into()),
        ..Default::default()
    };
    let (program, _) = whippen_compiler::front::compile_front(&mut map, &options);
    let model = program.expect("it is correct").instruments.remove(0);
    compile(model, Device::mikey().scales(), false).expect("it lowers")
}

/// A board whose keys play this, with the monitor.
pub fn monitored(kind: BoardKind, compiled: &Compiled, baud: u32) -> Client<Wire> {
    let kernel = &compiled.lowered.kernel;
    let (modes, midi) = (Modes::single(kernel), midi(kernel));
    let instruments = [Instrument {
        modes: &modes,
        places: &[],
        midi: &midi,
        parts: None,
    }];
    let programs = vec![Program::of_zones("all", [(KEYS as u32, InstrumentId(0))])];
    let setup = Setup {
        keys: match kind {
            BoardKind::Stm32f4 => vec![88],
            _ => setup().keys,
        },
        rate_hz: compiled.model.rate_hz,
        monitor: Some(Monitor { baud }),
        ..setup()
    };
    let mut rig = Rig::on(kind, programs, &instruments, &setup);
    let rest = Device::mikey().word_of_position(0.0).0;
    rig.play(vec![rest; 300 * KEYS]);
    let wire = Wire {
        rig,
        changes: None,
        waited: 0,
        loses: [0; 2],
        is_to_lose: false,
    };
    Client::new(wire, PATIENCE)
}

/// The boards, and rates of their serial ports.
const BOARDS: [(BoardKind, u32); 3] = [
    (BoardKind::Rp2350, 3_000_000),
    (BoardKind::Rp2040, 1_000_000),
    (BoardKind::Stm32f4, 57_600),
];

/// The number of an image is of its bytes, as they were before it was among them.
fn identity(rig: &Rig) -> u64 {
    let mut image = rig.image.clone();
    let at = rig.symbol("monitor_facts") + 4 * Fact::IdentityLow as u32;
    for segment in &mut image.segments {
        let own = at.wrapping_sub(segment.run) as usize;
        if let Some(place) = segment.bytes.get_mut(own..own.wrapping_add(8)) {
            place.fill(0);
        }
    }
    image_identity(&image)
}

/// The status of a board at rest, on which nothing went wrong.
fn reads_a_status(client: &mut Client<Wire>, at: u32, program: u32) {
    let status = read_status(client, at).expect("a status");
    let keys: u32 = status.cores.iter().map(|core| core.keys).sum();
    assert_eq!(keys, KEYS as u32);
    assert_eq!((status.missed(), status.told_faults()), (0, vec![]));
    assert_eq!(status.held_back(), vec![], "force has come up");
    let plays = |core: &CoreStatus| core.program == Some(program) && core.ticks >= 300;
    assert!(status.cores.iter().all(plays));
}

#[test]
fn it_answers_what_it_is_and_what_it_does() {
    for (kind, baud) in BOARDS {
        // A port that holds a single byte wants ticks that are shorter; its answers take long.
        let is_slow = kind == BoardKind::Stm32f4;
        let rate_hz = if is_slow { 11_025 } else { RATE_HZ };
        let compiled = compiled("hammond.whip", rate_hz);
        let lives = &compiled.lowered.kernel.lives;
        let mut client = monitored(kind, &compiled, baud);
        let facts = client.identify().expect("it answers");
        let status = facts.word(Fact::Status);
        assert_eq!(facts.identity(), identity(&client.link().rig), "{kind:?}");
        assert_eq!(
            (facts.name().as_str(), facts.rate_hz()),
            ("hammond", rate_hz.into())
        );
        if !is_slow {
            reads_a_status(&mut client, status, 0);
        }
        let magic = client.read(status, 1).expect("the status");
        assert_eq!(magic, [u32::from_le_bytes(*b"WHIP")]);
        // Live values, within their range and beyond.
        let high = lives[0].range.high as i32;
        assert_eq!(client.get(0), Ok(lives[0].init));
        assert_eq!(client.set(0, high), Ok(()));
        client.link().rig.run(6);
        assert_eq!(client.get(0), Ok(high));
        let refused = [
            client.set(0, high.wrapping_add(1)),
            client.set(lives.len() as u32, 0),
            client.get(lives.len() as u32).map(drop),
            client.read(0x4000_0000, 1).map(drop),
            client.read(status + 2, 1).map(drop),
            client.play(2),
        ];
        let is_refused = |found: &Result<(), _>| matches!(found, Err(MonitorError::Refused(_)));
        assert!(refused.iter().all(is_refused), "{refused:?}");
        // Anew, by the number behind the last program.
        client.play(1).expect("it begins");
        client.link().rig.run(400);
        if !is_slow {
            reads_a_status(&mut client, status, 1);
        }
        assert_eq!(client.link().rig.converter().overruns(), 0, "{kind:?}");
    }
}

/// Long answers are what memory has, whatever happens to bytes on the way.
#[test]
fn what_the_line_changes_is_never_taken_for_an_answer() {
    let compiled = compiled("virtual-spring.whip", RATE_HZ);
    let mut client = monitored(BoardKind::Rp2350, &compiled, 3_000_000);
    let facts = client.identify().expect("it answers");
    let at = capture_room(&facts, 0).start;
    let mut rng = Rng::new(5);
    let expected: Vec<u32> = (0..700).map(|_| rng.next() as u32 & 0xff00_ffff).collect();
    for (offset, word) in (0..).step_by(4).zip(&expected) {
        client.link().rig.set(at + offset, *word);
    }
    assert!(client.read(at, 700).as_deref() == Ok(&expected[..]));
    // What is no request is passed over.
    for _ in 0..20 {
        let garbage: Vec<u8> = (0..1 + rng.below(200)).map(|_| rng.next() as u8).collect();
        client.link().send(&garbage).expect("it is sent");
        client.link().rig.run(20);
        assert_eq!(client.identify(), Ok(facts.clone()));
    }
    // Where bytes are changed either way an answer is right, or there is none. At one byte in 800
    // an answer of 1.2 kB comes whole in a fifth of its tries.
    let (mut answered, mut lost) = (0, 0);
    client = Client::new(into_wire(client), Duration::from_millis(100));
    client.link().changes = Some((800, Rng::new(9)));
    for _ in 0..40 {
        match client.read(at, 300) {
            Ok(words) => {
                assert!(words == expected[..300]);
                answered += 1;
            }
            Err(MonitorError::Silent | MonitorError::Garbage(_)) => lost += 1,
            Err(other) => panic!("{other}"),
        }
    }
    assert!(answered > 5 && lost > 0, "{answered} answers, {lost} lost");
    assert_eq!(client.link().rig.converter().overruns(), 0);
}

/// How many answers were lost is known, whether one comes in the end or not.
#[test]
fn lost_answers_are_counted() {
    let compiled = compiled("virtual-spring.whip", RATE_HZ);
    let mut client = monitored(BoardKind::Rp2350, &compiled, 3_000_000);
    let facts = client.identify().expect("it answers");
    let at = capture_room(&facts, 0).start;
    let expected = client.read(at, 200).expect("a whole answer");
    assert_eq!(client.lost_answers(), 0);
    // An answer of four frames, whose first one is spoilt: the second is not the one that is due.
    for (lost, counted) in [(1, 1), (2, 3)] {
        client.link().loses[0] = lost;
        assert!(client.read(at, 200).as_deref() == Ok(&expected[..]));
        assert_eq!(client.lost_answers(), counted);
    }
    client.link().loses[0] = 3;
    let given_up = client.read(at, 200);
    assert!(
        matches!(given_up, Err(MonitorError::Garbage(_))),
        "{given_up:?}"
    );
    assert_eq!(client.lost_answers(), 6);
    assert!(client.read(at, 200).as_deref() == Ok(&expected[..]));
    assert_eq!(client.lost_answers(), 6);
    // A request that does not arrive: its answer does not come.
    client = Client::new(into_wire(client), Duration::from_secs(1));
    client.link().loses[1] = 1;
    assert_eq!(client.identify(), Ok(facts));
    assert!((1..=2).contains(&client.lost_answers()));
}

fn into_wire(client: Client<Wire>) -> Wire {
    client.into_link()
}

/// Words of all keys for so many ticks from the beginning of the bundled gesture on.
fn gesture(ticks: usize, skipped: usize) -> Vec<u16> {
    let device = Device::mikey();
    let motion = default_gesture().positions(RATE_HZ);
    (0..ticks)
        .flat_map(|tick| {
            let at = (tick + skipped) % motion.len();
            (0..KEYS).map(move |key| (at, key)).collect::<Vec<_>>()
        })
        .map(|(at, key)| {
            device
                .word_of_position(motion[(at + 3 * key) % motion.len()])
                .0
        })
        .collect()
}

/// Waits for a capture's end.
fn captured_rows(client: &mut Client<Wire>, capture: &Capture, block: u32) -> Vec<CapturedRow> {
    for _ in 0..400 {
        let measured = rows_of(client, capture, block).expect("rows");
        if measured.is_over {
            return measured.rows;
        }
        client.link().rig.run(50);
    }
    panic!("the capture has no end: {:?}", client.read(block, 26));
}

/// Keys that begin while they are captured, on each board, played by the gesture: every word is
/// that of the converter, and drive words are those of `jit`, bit for bit.
#[test]
fn a_capture_from_the_beginning_is_what_jit_plays() {
    let device = Device::mikey();
    for (kind, baud, file) in [
        (BoardKind::Rp2350, 3_000_000, "hammond.whip"),
        (BoardKind::Rp2040, 1_000_000, "virtual-spring.whip"),
    ] {
        let compiled = compiled(file, RATE_HZ);
        let mut client = monitored(kind, &compiled, baud);
        let facts = client.identify().expect("it answers");
        let ticks = 1000;
        let capture = |keys: Vec<u32>| Capture {
            keys,
            cells: vec![facts.word(Fact::Capture0) + captured::NEXT],
            ticks,
            after: ticks - 1,
            trigger: Some(Trigger::Now),
            group: 1,
        };
        let captures = [capture(vec![0, 43]), capture(vec![7])];
        for (core, own) in captures.iter().enumerate() {
            let room = capture_room(&facts, core);
            assert!(own.ticks_max(room.end - room.start) >= ticks, "{room:?}");
            let spare = facts.word([Fact::Capture0, Fact::Capture1][core]);
            let setting = own.setting(spare).expect("a setting");
            client.capture(core as u32, &setting).expect("it captures");
        }
        let words = gesture(1400, 0);
        client.link().rig.converter().samples.extend(words);
        client.play(1).expect("it begins");
        for (core, own) in captures.iter().enumerate() {
            let block = [Fact::Capture0, Fact::Capture1][core];
            let rows = captured_rows(&mut client, own, facts.word(block));
            // The tick in which the program is called has no row.
            assert_eq!(rows.len(), ticks as usize - 2, "{kind:?}");
            // In the tick in which the program is called no key plays.
            let gap = rows
                .windows(2)
                .position(|two| two[1].tick != two[0].tick + 1);
            let gap = gap.expect("it began");
            assert_eq!(rows[gap + 1].tick, rows[gap].tick + 2);
            for (key, number) in own.keys.iter().enumerate() {
                let replay = Replay {
                    compiled: &compiled,
                    device: &device,
                    rows: &rows[gap + 1 + *number as usize..],
                    key,
                    begins: true,
                    lives: &[],
                    cells: &[],
                };
                let found = replay.difference().expect("it runs");
                assert!(found.compared > 600, "{found:?}");
                assert_eq!(
                    (found.differ, found.first),
                    (0, None),
                    "{kind:?}, key {number}"
                );
                // With another word in it, it differs: the comparison is one.
                let mut other = rows[gap + 1 + *number as usize..].to_vec();
                let half = other.len() / 2;
                other[half].keys[key].0 ^= 0x4000;
                let replay = Replay {
                    rows: &other,
                    ..replay
                };
                assert!(replay.difference().expect("it runs").differ > 0);
            }
        }
        assert_eq!(client.link().rig.converter().overruns(), 0);
    }
}

/// Triggers: a word over a level, an event of one key, of any; the other core follows.
#[test]
fn a_trigger_has_what_was_before_it() {
    let compiled = compiled("hammond.whip", RATE_HZ);
    let kernel = &compiled.lowered.kernel;
    let note = kernel.events.iter().position(|event| event.name == "note");
    let note = note.expect("notes") as u32;
    let device = Device::mikey();
    let level = device.word_of_position(4e-3).0;
    let rest = device.word_of_position(0.0).0;
    let mut client = monitored(BoardKind::Rp2350, &compiled, 3_000_000);
    client.link().rig.play(vec![rest; 300 * KEYS]);
    let facts = client.identify().expect("it answers");
    let mut force = 0;
    for group in 1..=4 {
        let trigger = match group {
            1 => Trigger::Sensor(0, level),
            2 => Trigger::Event(note, Some(5)),
            3 => Trigger::Event(note, None),
            _ => Trigger::Drive(0, force),
        };
        let capture = |key: u32, trigger| Capture {
            keys: vec![key],
            cells: vec![],
            ticks: 500,
            after: 150,
            trigger,
            group,
        };
        let own = [capture(5, Some(trigger)), capture(9, None)];
        for core in [1, 0] {
            let spare = facts.word([Fact::Capture0, Fact::Capture1][core]);
            let setting = own[core].setting(spare).expect("a setting");
            client.capture(core as u32, &setting).expect("it captures");
        }
        client.link().rig.run(420);
        let begins = client.link().rig.block(0, core_block::TICK);
        let next = [Fact::Capture0, Fact::Capture1].map(|fact| facts.word(fact) + captured::NEXT);
        assert!(
            next.iter().all(|at| client.link().rig.word(*at) != 0),
            "{trigger:?}"
        );
        // Key 5 is struck, and only it.
        let places = (0..400).map(|tick| f64::from(tick).min(200.0) * 0.04e-3);
        let words = places.flat_map(|place| {
            let word = device.word_of_position(place).0;
            (0..KEYS).map(move |key| if key == 5 { word } else { rest })
        });
        let words: Vec<u16> = words.collect();
        client.link().rig.converter().samples.extend(words);
        let rows = [0, 1].map(|core| {
            let block = [Fact::Capture0, Fact::Capture1][core];
            captured_rows(&mut client, &own[core], facts.word(block))
        });
        let at = client
            .link()
            .rig
            .word(facts.word(Fact::Capture0) + captured::AT);
        assert!(at > begins, "{trigger:?}: {at} after {begins}");
        for rows in &rows {
            assert_eq!(rows.len(), 500, "{trigger:?}");
            assert!(rows.windows(2).all(|two| two[1].tick == two[0].tick + 1));
            assert_eq!(rows.last().map(|row| row.tick), Some(at + 150));
        }
        let of_tick = |tick: u32| &rows[0][(tick - rows[0][0].tick) as usize];
        let drives = rows[0].iter().map(|row| i32::from(row.keys[0].1));
        let (least, most) = (drives.clone().min(), drives.max());
        force = least
            .zip(most)
            .map_or(0, |(least, most)| ((least + most) / 2) as i16);
        if let Trigger::Sensor(..) = trigger {
            assert!(of_tick(at).keys[0].0 >= level && of_tick(at - 1).keys[0].0 < level);
        }
        if let Trigger::Drive(..) = trigger {
            let [before, now] = [at - 1, at].map(|tick| of_tick(tick).keys[0].1);
            assert!(now > before, "{before} {now}");
        }
        assert!(rows[1].iter().all(|row| row.keys[0].0 == rest));
        // A key at rest before it: what it does follows from the words alone.
        let replay = Replay {
            compiled: &compiled,
            device: &device,
            rows: &rows[0],
            key: 0,
            begins: false,
            lives: &[],
            cells: &[],
        };
        let found = replay.difference().expect("it runs");
        assert_eq!(
            (found.compared, found.differ),
            (500, 0),
            "{trigger:?}: {found:?}"
        );
        client.link().rig.play(vec![rest; 600 * KEYS]);
    }
    assert_eq!(client.link().rig.converter().overruns(), 0);
}
