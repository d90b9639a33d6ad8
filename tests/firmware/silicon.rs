//! What the chips ask of an image before and after it plays, on all boards: a start that gets
//! through, a watchdog that bites.

use whippen_compiler::firmware::{Instrument, build_image};
use whippen_compiler::image::Image;
use whippen_compiler::keyboard::Layout;
use whippen_compiler::modes::Modes;
use whippen_emulator::{
    BoardKind, Converter, ConverterSetup, Machine, Ports, Register, Stop, build,
};
use whippen_runtime::board;

use crate::rig::{RATE_HZ, kernel, midi, setup};

/// Keys of each core.
const KEYS: u32 = 8;

/// A spring on every key of a board, started.
struct Played {
    kind: BoardKind,
    machine: Machine,
    ports: Ports,
    image: Image,
}

impl Played {
    fn new(kind: BoardKind) -> Played {
        let kernel = kernel("virtual-spring.whip");
        let board = board::bundled(kind.name()).expect("it is bundled");
        let (modes, notes) = (Modes::single(&kernel), midi(&kernel));
        let instrument = Instrument {
            modes: &modes,
            places: &[],
            midi: &notes,
            parts: None,
        };
        let mut setup = setup();
        setup.keys = vec![KEYS; board.cores as usize];
        let keys = KEYS * board.cores;
        let layout = Layout::of_one_instrument("spring", keys, 21);
        let image = build_image(&layout, &[instrument], &setup, &board)
            .unwrap_or_else(|e| panic!("{e}"))
            .image;
        let converter = ConverterSetup {
            keys,
            rate: [RATE_HZ, 1],
        };
        let (mut machine, ports) = build(kind, kind.board(), converter).expect("the board can be");
        for segment in &image.segments {
            let memory = &mut machine.bus.memory;
            memory.write(segment.load, &segment.bytes).expect("memory");
        }
        machine.reset();
        let mut played = Played {
            kind,
            machine,
            ports,
            image,
        };
        let converter = played.converter();
        converter.recording = true;
        converter.samples.extend((0..keys * 20_000).map(|_| 40_000));
        played
    }

    fn converter(&mut self) -> &mut Converter {
        let machine = &mut self.machine;
        machine.bus.device_mut(self.ports.converter).expect("there")
    }

    /// The cycle of the core that is ahead.
    fn cycle(&self) -> u64 {
        let cores = 0..self.machine.cores();
        cores
            .map(|core| self.machine.cycle(core))
            .max()
            .unwrap_or(0)
    }

    fn cycles_per_ms(&self) -> u64 {
        u64::from(self.kind.board().clock_hz) / 1000
    }

    /// Runs for so long, unless something ends it.
    fn run_ms(&mut self, ms: u64) -> Stop {
        let until = self.cycle() + ms * self.cycles_per_ms();
        self.machine.run(until)
    }

    /// A core is caught in a loop with its interrupts off.
    fn hang(&mut self, core: usize) {
        // Flash that no image reaches.
        let place = self.kind.board().vector_table + (512 << 10);
        let memory = &mut self.machine.bus.memory;
        memory.write(place, &[0xfe, 0xe7]).expect("flash");
        let primask = Register::named("primask").expect("a register");
        self.machine.cpu_mut(core).set(primask, 1);
        self.jump(core, place);
    }

    /// A core goes where no memory is.
    fn fault(&mut self, core: usize) {
        self.jump(core, 0x3000_0000);
    }

    /// What the converter puts out now.
    fn outputs(&mut self) -> Vec<i16> {
        self.converter().outputs().to_vec()
    }

    /// Runs core 0 up to a function.
    fn run_to(&mut self, function: &str) {
        let symbols = &mut self.image.symbols.iter();
        let found = symbols.find(|symbol| symbol.name == function);
        let address = found.expect("it is there").address & !1;
        self.machine.set_breakpoint(address);
        while self.run_ms(100) != (Stop::Breakpoint { core: 0, address }) {}
        self.machine.clear_breakpoint(address);
    }

    fn jump(&mut self, core: usize, to: u32) {
        self.machine.cpu_mut(core).set(Register::core(15), to);
    }
}

/// The clocks come up without a glitch, every poll ends, and the keys are played.
#[test]
fn every_board_starts() {
    for kind in BoardKind::ALL {
        let mut played = Played::new(kind);
        let stop = played.run_ms(100);
        assert_eq!(stop, Stop::Limit, "{}", kind.name());
        let (ticks, overruns) = (played.converter().ticks(), played.converter().overruns());
        assert!(ticks > 1000, "{}: {ticks} ticks", kind.name());
        assert_eq!(overruns, 0, "{}", kind.name());
    }
}

/// Whatever stops a core, the watchdog resets the chip after the 10 ms without food, or a turn of
/// the idle loop later.
#[test]
fn every_board_resets_when_a_core_stops() {
    for kind in BoardKind::ALL {
        for core in 0..kind.board().cores {
            for (what, stops) in [
                ("hangs", Played::hang as fn(&mut Played, usize)),
                ("faults", Played::fault),
            ] {
                let mut played = Played::new(kind);
                assert_eq!(played.run_ms(60), Stop::Limit);
                let from = played.cycle();
                stops(&mut played, core);
                let stop = played.run_ms(100);
                let ms = (played.cycle() - from) / played.cycles_per_ms();
                assert!(
                    stop == Stop::Reset && (8..=13).contains(&ms),
                    "{}: core {core} {what}: {stop:?} after {ms} ms",
                    kind.name()
                );
            }
        }
    }
}

/// Before core 0 feeds it for the first time, the watchdog already waits for 10 ms and no longer.
#[test]
fn every_board_resets_when_it_is_never_fed() {
    for kind in BoardKind::ALL {
        let mut played = Played::new(kind);
        played.run_to("board_listen");
        let from = played.cycle();
        played.hang(0);
        let stop = played.run_ms(1000);
        let ms = (played.cycle() - from) / played.cycles_per_ms();
        assert!(
            stop == Stop::Reset && (8..=13).contains(&ms),
            "{}: {stop:?} after {ms} ms",
            kind.name()
        );
    }
}

/// A fault of one core takes the force of all keys away within a tick (it may sleep until then),
/// those of the other core too, and nothing brings it back.
#[test]
fn outputs_are_off_from_a_fault_on() {
    for kind in BoardKind::ALL {
        for core in 0..kind.board().cores {
            let mut played = Played::new(kind);
            assert_eq!(played.run_ms(60), Stop::Limit);
            let words = played.outputs();
            assert!(words.iter().all(|word| *word != 0), "{words:?}");
            let tick_cycles = u64::from(kind.board().clock_hz / RATE_HZ);
            played.fault(core);
            let mut until = played.cycle() + tick_cycles + 200;
            while played.machine.run(until) == Stop::Limit {
                let words = played.outputs();
                let name = kind.name();
                assert!(
                    words.iter().all(|word| *word == 0),
                    "{name}, core {core}: {words:?}"
                );
                until += tick_cycles / 3;
            }
            assert!(played.outputs().iter().all(|word| *word == 0));
        }
    }
}

/// A core that hangs leaves its last words at the outputs, until the watchdog's bite.
#[test]
fn outputs_are_off_after_a_bite() {
    for kind in BoardKind::ALL {
        let mut played = Played::new(kind);
        assert_eq!(played.run_ms(60), Stop::Limit);
        played.hang(0);
        assert_eq!(played.run_ms(7), Stop::Limit);
        assert!(played.outputs().iter().all(|word| *word != 0));
        assert_eq!(played.run_ms(7), Stop::Reset);
        assert!(played.outputs().iter().all(|word| *word == 0));
    }
}
