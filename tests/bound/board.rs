//! The emulated board with a whole image, and somebody who counts: cycles of each key by its mode,
//! cycles of each frame.

use std::collections::HashMap;

use whippen_compiler::firmware::CORES;
use whippen_emulator::{
    Converter, ConverterSetup, Machine, Observer, Ports, Step, Stop, Uart, build,
};
use whippen_isa::timing::Rules;
use whippen_runtime::monitor::{Capture, Trigger, encode};

use crate::image::Image;

/// Cycles between two looks.
const SLICE: u64 = 4000;
/// Bytes that the firmware keeps for a stack, and what it is painted with.
const STACK_BYTES: u32 = 256;
const PAINT: [u8; 4] = *b"free";
/// Looks at the serial port after which a request is sent again.
const LOOKS: u32 = 200;
/// Offset of the tick's number in a core's block.
const TICK: u32 = 28;

/// The longest of everything.
pub struct Watch {
    places: Vec<HashMap<u32, Option<usize>>>,
    /// The key that is being done: its mode, and when it began.
    open: [Option<(usize, u64)>; 2],
    began: [Option<u64>; 2],
    /// Of each mode, by core.
    pub keys: [Vec<u64>; 2],
    /// Of the handler, by core.
    pub frames: [u64; 2],
    pub frames_seen: [u64; 2],
    pub keys_seen: u64,
}

impl Observer for Watch {
    fn instruction(&mut self, step: &Step<'_>) {
        let core = step.core & 1;
        // A core that plays nothing waits in its ROM.
        let places = self.places.get(core);
        let Some(&place) = places.and_then(|own| own.get(&step.address)) else {
            return;
        };
        if let Some((mode, began)) = self.open[core].take() {
            let longest = &mut self.keys[core][mode];
            *longest = (*longest).max(step.cycle - began);
            self.keys_seen += 1;
        }
        self.open[core] = place.map(|mode| (mode, step.cycle));
    }

    fn exception(&mut self, core: usize, _: u32, cycle: u64) {
        self.began[core & 1] = Some(cycle);
    }

    fn exception_return(&mut self, core: usize, _: u32, cycle: u64) {
        let core = core & 1;
        // Where watching began in the middle of a frame, that one does not count.
        let Some(began) = self.began[core].take() else {
            return;
        };
        self.frames[core] = self.frames[core].max(cycle - began);
        self.frames_seen[core] += 1;
    }
}

impl Watch {
    pub fn new(image: &Image) -> Watch {
        let modes = image.modes.modes.len();
        Watch {
            places: (0..image.keys.len())
                .map(|core| image.places(core))
                .collect(),
            open: [None; 2],
            began: [None; 2],
            keys: [vec![0; modes], vec![0; modes]],
            frames: [0; 2],
            frames_seen: [0; 2],
            keys_seen: 0,
        }
    }
}

pub struct Board<'a> {
    image: &'a Image,
    machine: Machine,
    ports: Ports,
    /// Live values that were set so far.
    asked: u32,
    /// Requests to the monitor that were answered.
    pub answered: u32,
    /// Looks so far, or for the answer to the last one.
    looks: u32,
}

impl<'a> Board<'a> {
    /// Loaded and reset.
    pub fn new(image: &'a Image) -> Board<'a> {
        let keys = image.keys.iter().sum();
        let converter = ConverterSetup {
            keys,
            rate: image.compiled.model.rate_hz.fraction(),
        };
        let (mut machine, ports) =
            build(image.kind, image.emulated.clone(), converter).expect("a board");
        for segment in &image.whole.image.segments {
            machine
                .bus
                .memory
                .write(segment.load, &segment.bytes)
                .expect("memory");
        }
        for stack in &image.board.stacks {
            for at in (stack - STACK_BYTES..*stack).step_by(4) {
                machine.bus.memory.write(at, &PAINT).expect("memory");
            }
        }
        // What the sources leave open of a core is at its worst, as the bound has it.
        machine.set_rules(Rules {
            at_worst: true,
            ..Rules::default()
        });
        machine.set_meets_fetches(image.board.fetches_apart);
        machine.reset();
        Board {
            image,
            machine,
            ports,
            asked: 0,
            answered: 0,
            looks: 0,
        }
    }

    /// Plays words, so many ticks of all keys, counting from here on, while somebody turns the live
    /// values to and fro, by the mailbox and by MIDI.
    pub fn play(&mut self, words: Vec<u16>, alone: bool, watch: &mut Watch) {
        let ticks = words.len() / self.image.words_each_way();
        self.converter().samples.extend(words);
        let last = self.converter().ticks() + ticks as u32;
        while self.converter().ticks() < last {
            if alone && self.image.keys.len() > 1 {
                self.keep_alive();
            }
            if self.image.whole.monitored {
                // It sets live values too, and has no turn while the mailbox has one.
                self.ask_the_monitor(alone);
            } else {
                // MIDI has no turn while the mailbox has one.
                self.looks += 1;
                if !self.image.whole.passes_midi || self.looks.is_multiple_of(16) {
                    self.set_a_live_value();
                }
                self.turn_a_controller();
            }
            let now = (0..self.machine.cores())
                .map(|core| self.machine.cycle(core))
                .max()
                .unwrap_or(0);
            let until = now + SLICE.min(self.image.period / 2);
            let stop = self.machine.run_observed(until, watch);
            assert!(matches!(stop, Stop::Limit), "{}: {stop}", self.image.name());
        }
    }

    /// One parameter after the other, to either end of its range.
    fn set_a_live_value(&mut self) {
        let lives = &self.image.compiled.lowered.kernel.lives;
        let asked = self.asked as usize;
        let Some(live) = lives.get(asked % lives.len().max(1)) else {
            return;
        };
        let value = match asked / lives.len() % 2 {
            0 => live.range.high,
            _ => live.range.low,
        };
        self.asked += 1;
        let mailbox = self.image.symbol("mailbox");
        let words = [
            (4, (asked % lives.len()) as u32),
            (8, value as u32),
            (0, self.asked),
        ];
        for (at, word) in words {
            let memory = &mut self.machine.bus.memory;
            memory
                .write(mailbox + at, &word.to_le_bytes())
                .expect("memory");
        }
    }

    /// A control change, whenever the one before has arrived, and one of no live value.
    fn turn_a_controller(&mut self) {
        let (port, now) = (self.ports.uarts[0], self.machine.cycle(0));
        let uart: &mut Uart = self.machine.bus.device_mut(port).expect("the port");
        if uart.input.is_empty() {
            let [number, value] = [self.asked % 19, self.asked / 19 % 2];
            let turned = [0xb0, 102 + number as u8, 127 * value as u8];
            uart.receive(&turned, now);
            if self.image.whole.passes_midi {
                uart.receive(&[0xb0, 88, number as u8, 0x90, 60, 1], now);
            }
            self.machine.bus.reschedule(port);
        }
    }

    /// Bytes that it has sent over MIDI.
    pub fn passed(&self) -> usize {
        let uart = self.machine.bus.device::<Uart>(self.ports.uarts[0]);
        uart.map_or(0, |uart| uart.output.len())
    }

    /// The next request, once the one before is answered: captures of both cores that never end,
    /// the other core's memory, live values, what is no request.
    fn ask_the_monitor(&mut self, alone: bool) {
        let (port, now) = (self.ports.uarts[0], self.machine.cycle(0));
        let uart: &mut Uart = self.machine.bus.device_mut(port).expect("the port");
        let is_answered = uart.output.last() == Some(&0);
        self.looks += 1;
        // What came before the port was there is lost, and asked again.
        if !uart.input.is_empty() || !is_answered && !self.looks.is_multiple_of(LOOKS) {
            return;
        }
        uart.output.clear();
        self.answered += u32::from(is_answered);
        let (image, asked) = (self.image, self.answered);
        let cores = if alone { 1 } else { image.keys.len() as u32 };
        let (core, keys) = (asked / 4 % cores, image.keys[0]);
        let own = image.symbol(&format!("captured{core}"));
        let capture = Capture {
            keys: vec![keys - 2],
            cells: vec![own; 4],
            ticks: 40,
            after: 30,
            trigger: (asked % 8 < 4).then_some(Trigger::Sensor(0, 30_000)),
            group: 1,
        };
        let (kind, words) = match asked % 4 {
            0 => {
                let setting = capture.setting(own).expect("a setting");
                (5, [vec![core], setting].concat())
            }
            1 => (2, vec![image.symbol(CORES[core as usize]), 90]),
            2 => {
                let range = image
                    .compiled
                    .lowered
                    .kernel
                    .lives
                    .first()
                    .map(|live| live.range);
                (3, vec![0, range.map_or(0, |range| range.high as u32)])
            }
            _ => (9, vec![]),
        };
        let mut said = vec![kind, asked as u8, 0, 0];
        said.extend(words.iter().flat_map(|word: &u32| word.to_le_bytes()));
        uart.receive(&encode(&said), now);
        self.machine.bus.reschedule(port);
    }

    /// That the start and all ticks so far left some of what is kept for each stack free.
    pub fn has_stack_left(&mut self) {
        for stack in &self.image.board.stacks {
            let mut lowest = [0; 4];
            let memory = &mut self.machine.bus.memory;
            memory
                .read(stack - STACK_BYTES + 32, &mut lowest)
                .expect("memory");
            assert_eq!(
                lowest,
                PAINT,
                "{}: the stack that ends at {stack:#x}",
                self.image.name()
            );
        }
    }

    /// Core 1, if there is one, stops for good, and core 0 waits for nobody.
    pub fn leave_core0_alone(&mut self) {
        self.machine.set_meets_fetches(false);
        if self.image.keys.len() > 1 {
            self.machine.halt(1);
        }
    }

    /// Core 0 feeds the watchdog only while core 1 has ticks: as if it had.
    fn keep_alive(&mut self) {
        let ticks = self.converter().ticks();
        let at = self.image.symbol("core1") + TICK;
        self.machine
            .bus
            .memory
            .write(at, &ticks.to_le_bytes())
            .expect("memory");
    }

    fn converter(&mut self) -> &mut Converter {
        self.machine
            .bus
            .device_mut(self.ports.converter)
            .expect("the converter")
    }
}
