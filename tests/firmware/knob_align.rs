//! A knob that a monitor asks to find its motor anew, over its serial line or in its mailbox: the
//! chip starts again, and plays.

use std::io;
use std::sync::Arc;
use std::time::Duration;

use whippen_compiler::firmware::Monitor;
use whippen_emulator::{KnobParts, Stop, Uart};
use whippen_runtime::monitor::{
    BoardMemory, BoardWrite, Client, Link, MonitorError, align, align_by_mailbox, read_status,
};

use crate::knob_bench::{Bench, Built, CYCLES_PER_MS, PARTS, bundled, bundled_on};
use crate::rig::{KEYS, Rig, kernel};

/// The first scratch register of the watchdog.
const SCRATCH: u32 = 0x400d_800c;
/// How long a start may take here, of this machine's time.
const START: Duration = Duration::from_secs(300);

/// A knob whose chip starts again when it is reset.
struct Restarted {
    bench: Bench,
    built: Arc<Built>,
    /// How long the chip had power before this start.
    before: Duration,
    /// What its motor is from the next start on.
    next: KnobParts,
    starts: usize,
    /// Whether its record was erased.
    is_erased: bool,
}

impl Restarted {
    fn new(built: Arc<Built>) -> Restarted {
        let mut restarted = Restarted {
            bench: Bench::started_with(Arc::clone(&built)),
            built,
            before: Duration::ZERO,
            next: PARTS,
            starts: 0,
            is_erased: false,
        };
        restarted.pass_ms(50);
        restarted
    }

    /// The chip goes on; a reset leaves flash and that register of the watchdog as they are.
    fn pass_ms(&mut self, ms: u64) {
        let machine = &mut self.bench.machine;
        let until = machine.cycle(0) + ms * CYCLES_PER_MS;
        match machine.run(until) {
            Stop::Limit => {}
            Stop::Reset => {
                let cycle = machine.cycle(0);
                let scratch = machine.bus.read(SCRATCH, 4, cycle).expect("it reads");
                let stored = self.bench.stored();
                self.before = self.time();
                self.bench = Bench::with(Arc::clone(&self.built), self.next);
                self.bench.keep(&stored);
                let written = self.bench.machine.bus.write(SCRATCH, 4, scratch, 0);
                written.expect("it is written");
                self.starts += 1;
            }
            other => panic!("{other:?}"),
        }
        let stored = self.bench.stored();
        self.is_erased |= stored.iter().all(|byte| *byte == 0xff);
    }

    fn address(&self, name: &str) -> u32 {
        let mut symbols = self.built.image.symbols.iter();
        symbols.find(|own| own.name == name).expect("there").address
    }

    fn check_aligned(&mut self) {
        assert_eq!((self.starts, self.is_erased), (1, true));
        assert_eq!(
            (self.bench.faults(), self.bench.knob().is_driven()),
            (0, true)
        );
        let error = self.bench.electrical_error(&PARTS).to_degrees();
        assert!(error.abs() < 6.0, "{error}");
    }
}

impl BoardMemory for Restarted {
    fn read(&mut self, address: u32, words: usize) -> Result<Vec<u32>, MonitorError> {
        self.pass_ms(3);
        let mut bytes = vec![0; 4 * words];
        let memory = &self.bench.machine.bus.memory;
        memory.read(address, &mut bytes).expect("memory");
        let words = bytes.chunks_exact(4);
        Ok(words
            .map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]))
            .collect())
    }
}

impl BoardWrite for Restarted {
    fn write(&mut self, address: u32, word: u32) -> Result<(), MonitorError> {
        let memory = &mut self.bench.machine.bus.memory;
        memory.write(address, &word.to_le_bytes()).expect("memory");
        Ok(())
    }
}

impl Link for Restarted {
    fn send(&mut self, bytes: &[u8]) -> io::Result<()> {
        let (port, machine) = (self.bench.ports.uarts[0], &mut self.bench.machine);
        let cycle = machine.cycle(0);
        let uart: &mut Uart = machine.bus.device_mut(port).expect("the port");
        uart.receive(bytes, cycle);
        machine.bus.reschedule(port);
        self.pass_ms(1);
        Ok(())
    }

    fn receive(&mut self, _: Duration) -> io::Result<Vec<u8>> {
        self.pass_ms(1);
        let (port, machine) = (self.bench.ports.uarts[0], &mut self.bench.machine);
        let uart: &mut Uart = machine.bus.device_mut(port).expect("the port");
        Ok(std::mem::take(&mut uart.output))
    }

    /// That of the chip, of all its starts.
    fn time(&self) -> Duration {
        let cycle = self.bench.machine.cycle(0);
        self.before + Duration::from_secs_f64(cycle as f64 / 150e6)
    }
}

fn asked(board: &mut Restarted, start: Duration) -> Result<(), MonitorError> {
    let [mailbox, status] = ["mailbox", "status"].map(|name| board.address(name));
    align_by_mailbox(board, mailbox, status, start)
}

#[test]
fn a_knob_finds_its_motor_anew_where_its_mailbox_asks() {
    let mut board = Restarted::new(bundled());
    let stored = board.bench.stored();
    assert_eq!(asked(&mut board, START), Ok(()));
    board.check_aligned();
    // The same motor, found once more.
    let near = |at: usize| {
        let word = |stored: &[u8]| i32::from(i16::from_le_bytes([stored[at], stored[at + 1]]));
        (word(&stored) - word(&board.bench.stored())).abs()
    };
    assert!(near(12) < 400, "{}", near(12));
}

/// Over its serial line, of an image whose monitor leaves too little time for a proof: it is asked
/// once, and nothing that was lost meanwhile is the line's.
#[test]
fn a_knob_finds_its_motor_anew_where_its_line_asks() {
    let monitor = Monitor { baud: 3_000_000 };
    let built = bundled_on("pico2_knob", Some(monitor));
    let board = Restarted::new(built);
    let status = board.address("status");
    let mut client = Client::new(board, Duration::from_millis(30));
    client.identify().expect("it answers");
    assert_eq!(align(&mut client, status, START), Ok(()));
    assert_eq!(client.lost_answers(), 0);
    client.link().check_aligned();
}

/// A motor that is blocked is not found, and that is what is told.
#[test]
fn a_knob_that_does_not_find_its_motor_is_told() {
    let mut board = Restarted::new(bundled());
    board.next.motor.friction_n_m = 1.0;
    let told = asked(&mut board, START).expect_err("it cannot");
    assert_eq!(
        told.to_string(),
        "the board started again, and then: a knob's motor did not turn as its field did at the \
         start: its driver stays disabled"
    );
    assert_eq!(board.starts, 1);
}

/// A board whose memory is not written, as behind a probe that must not.
struct ReadOnly(Restarted);

impl BoardMemory for ReadOnly {
    fn read(&mut self, address: u32, words: usize) -> Result<Vec<u32>, MonitorError> {
        self.0.read(address, words)
    }
}

impl BoardWrite for ReadOnly {
    fn write(&mut self, _: u32, _: u32) -> Result<(), MonitorError> {
        Ok(())
    }
}

#[test]
fn a_board_that_does_not_start_again_is_told() {
    let board = Restarted::new(bundled());
    let [mailbox, status] = ["mailbox", "status"].map(|name| board.address(name));
    let mut board = ReadOnly(board);
    let told = align_by_mailbox(&mut board, mailbox, status, Duration::from_secs(1));
    let told = told.expect_err("nothing was written").to_string();
    assert_eq!(told, "the board did not start again");
}

/// A keyboard, which has a mailbox too.
struct Keys(Rig);

impl BoardMemory for Keys {
    fn read(&mut self, address: u32, words: usize) -> Result<Vec<u32>, MonitorError> {
        self.0.play([20_000; 4 * KEYS]);
        let words = (0..words as u32).map(|nth| self.0.word(address + 4 * nth));
        Ok(words.collect())
    }
}

impl BoardWrite for Keys {
    fn write(&mut self, address: u32, word: u32) -> Result<(), MonitorError> {
        self.0.set(address, word);
        Ok(())
    }
}

#[test]
fn a_keyboard_keeps_no_alignment() {
    let mut rig = Rig::new(&kernel("virtual-spring.whip"), 0);
    rig.play([20_000; 200 * KEYS]);
    let [mailbox, status] = ["mailbox", "status"].map(|name| rig.symbol(name));
    let mut board = Keys(rig);
    let told = align_by_mailbox(&mut board, mailbox, status, START);
    let told = told.expect_err("it is none").to_string();
    assert_eq!(told, "the image on the board keeps no alignment of a motor");
    // It plays on.
    let before = read_status(&mut board, status).expect("a status").cores[0].ticks;
    let after = read_status(&mut board, status).expect("a status").cores[0].ticks;
    assert!(after > before);
}
