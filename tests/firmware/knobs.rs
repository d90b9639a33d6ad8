//! Several knobs on one Pico 2: whole images on the emulated chip, with models of all sensors,
//! drivers and motors on its pins, all in closed loops at once.

use std::f64::consts::{PI, TAU};
use std::sync::Arc;

use whippen_compiler::firmware::{core_block, knob_block};
use whippen_emulator::{
    BoardKind, ConverterSetup, DeviceId, Hand, Knob, KnobParts, KnobPins, Machine, SensorFault,
    Stop, build,
};
use whippen_runtime::board;

use crate::knob_bench::{Built, CYCLES_PER_MS, PARTS, START_MS, bundled_on};

/// From a knob's motor that is found to the next one's.
const NEXT_MS: u64 = START_MS - 10;
/// How large a knob's block is (bytes).
const BLOCK: u32 = 64;

/// Knobs that have power.
struct Several {
    machine: Machine,
    knobs: Vec<DeviceId>,
    built: Arc<Built>,
}

/// Each with a magnet, a wiring and a place of its own.
fn parts_of(number: usize) -> KnobParts {
    let mut parts = PARTS;
    parts.angle_rad = 0.4 + 1.3 * number as f64;
    parts.motor.offset_rad = TAU * 0.381_966 * (number + 1) as f64;
    parts.motor.reversed = number % 2 == 1;
    parts
}

impl Several {
    fn on(name: &str) -> Several {
        let kind = BoardKind::Rp2350;
        let (mut machine, _) =
            build(kind, kind.board(), ConverterSetup::default()).expect("the board can be");
        let built = bundled_on(name);
        for segment in &built.image.segments {
            let memory = &mut machine.bus.memory;
            memory.write(segment.load, &segment.bytes).expect("memory");
        }
        let board = board::bundled(name).expect("it is bundled");
        let wired = board.knob.expect("it has knobs");
        let mut knobs = Vec::new();
        for (number, shaft) in wired.shafts.iter().enumerate() {
            let pins = KnobPins {
                select: wired.select,
                clock: wired.clock,
                data: shaft.data,
                phases: shaft.phases,
                enable: wired.enable,
                fault: wired.fault,
            };
            knobs.push(Knob::attach(&mut machine.bus, pins, parts_of(number)));
        }
        machine.reset();
        let mut all = Several {
            machine,
            knobs,
            built,
        };
        // One after the other.
        all.pass_ms(NEXT_MS * all.knobs.len() as u64 + 10);
        all
    }

    fn pass_ms(&mut self, ms: u64) {
        let until = self.machine.cycle(0) + ms * CYCLES_PER_MS;
        assert_eq!(self.machine.run(until), Stop::Limit);
    }

    fn knob(&mut self, number: usize) -> &mut Knob {
        let id = self.knobs[number];
        self.machine.bus.device_mut(id).expect("a knob")
    }

    fn angles(&mut self) -> Vec<f64> {
        let count = self.knobs.len();
        (0..count)
            .map(|n| self.knob(n).motor().angle_rad())
            .collect()
    }

    fn word(&self, symbol: &str, at: u32) -> i32 {
        let mut symbols = self.built.image.symbols.iter();
        let found = symbols.find(|own| own.name == symbol);
        let mut bytes = [0; 4];
        let memory = &self.machine.bus.memory;
        let address = found.expect("it is there").address + at;
        memory.read(address, &mut bytes).expect("memory");
        i32::from_le_bytes(bytes)
    }

    fn faults(&self) -> i32 {
        self.word("core0", core_block::FAULTS)
    }

    /// By how many electrical degrees the firmware is wrong of a knob's magnet.
    fn electrical_error(&self, number: usize) -> f64 {
        let parts = parts_of(number);
        let at = BLOCK * number as u32;
        let sign = if parts.motor.reversed { -1.0 } else { 1.0 };
        let turn = self.word("knob", at + knob_block::TURN);
        assert_eq!(
            f64::from(turn),
            sign * 4.0 * f64::from(parts.motor.pole_pairs)
        );
        let told = f64::from(self.word("knob", at + knob_block::OFFSET)) / 65_536.0 * TAU - PI;
        let off = told - sign * parts.motor.offset_rad;
        ((off + PI).rem_euclid(TAU) - PI).to_degrees()
    }

    /// Hands hold each knob somewhere within a pitch of its start, all at once; what each must hold
    /// it with there (N*m).
    fn held(&mut self, from: &[f64], places: &[f64]) -> Vec<f64> {
        for step in 1..=40 {
            for (number, (from, place)) in from.iter().zip(places).enumerate() {
                self.knob(number).hand = hand(from + place * f64::from(step) / 40.0);
            }
            self.pass_ms(1);
        }
        self.pass_ms(20);
        let angles = self.angles();
        let hands = from.iter().zip(places).zip(&angles);
        hands
            .map(|((from, place), angle)| STIFFNESS * (from + place - angle))
            .collect()
    }
}

const STIFFNESS: f64 = 2.0;

fn hand(place_rad: f64) -> Hand {
    Hand {
        torque_n_m: 0.0,
        stiffness: STIFFNESS,
        damping: 5e-3,
        place_rad,
    }
}

/// All motors are found, each feels as the program says and as a knob that has the chip to itself,
/// whatever the others do; and what fails of one disables all.
fn all_play(name: &str) {
    let mut all = Several::on(name);
    let count = all.knobs.len();
    for number in 0..count {
        let error = all.electrical_error(number);
        println!("{name}: knob {number} is found within {error:.2} electrical degrees");
        assert!(error.abs() < 5.0, "{number}: {error}");
    }
    assert_eq!(all.faults(), 0);
    all.pass_ms(30);
    let from = all.angles();
    // Parts of a pitch of 15 degrees, another one of each.
    let parts = [0.25, -0.125, 0.125, -0.25];
    let places = parts.map(|part: f64| part * 15_f64.to_radians());
    let torques = all.held(&from, &places[..count]);
    // 8 h u (1 - 2 |u|) at h = 12 mN*m; friction of program and bearing is 2.5 mN*m.
    for ((number, torque), part) in torques.iter().enumerate().zip(parts) {
        let wanted = 8.0 * 12e-3 * part * (1.0 - 2.0 * part.abs());
        println!("{name}: knob {number} at {part} of a pitch: {torque:.4} N*m, of {wanted:.4}");
        assert!((torque - wanted).abs() < 3.5e-3, "{number}: {torque}");
    }
    assert_eq!(all.word("core0", core_block::MISSED), 0);
    // The last one is the one that breaks.
    all.knob(count - 1).set_sensor_fault(SensorFault::Field(1));
    all.pass_ms(1);
    assert_eq!(all.faults(), 64);
    assert!((0..count).all(|number| !all.knob(number).is_driven()));
}

#[test]
fn two_knobs_play_at_once() {
    all_play("pico2_two_knobs");
}

/// The image of four is proven to be in time; it plays with `WHIPPEN_KNOBS=4` alone, as two minutes
/// of a processor are much for every run.
#[test]
fn four_knobs_play_at_once() {
    if std::env::var("WHIPPEN_KNOBS").is_ok_and(|knobs| knobs == "4") {
        all_play("pico2_four_knobs");
        return;
    }
    let bounded = &bundled_on("pico2_four_knobs").bounded;
    assert_eq!(bounded.alone.keys, 4);
}
