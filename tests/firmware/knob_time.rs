//! A knob's ticks: none is longer than its bound, a missed one is told, and a core that hangs is
//! reset.

use whippen_compiler::firmware::core_block;
use whippen_emulator::{Hand, Observer, Register, SensorFault, Step, Stop};

use crate::knob_bench::{Bench, CYCLES_PER_MS, PERIOD, PINS, bundled};

/// From where a handler begins to where the code goes on that it interrupted.
#[derive(Default)]
struct Frames {
    begins: u64,
    longest: u64,
    count: u32,
}

impl Observer for Frames {
    fn instruction(&mut self, _: &Step<'_>) {}

    fn exception(&mut self, _: usize, _: u32, cycle: u64) {
        self.begins = cycle;
    }

    fn resumed(&mut self, _: usize, cycle: u64) {
        self.longest = self.longest.max(cycle - self.begins);
        self.count += 1;
    }
}

/// Detents, both stops and a sensor that is wrong at times: every tick within its bound, of which
/// the way into the handler is left out.
#[test]
fn no_tick_of_a_knob_is_longer_than_its_bound() {
    let built = bundled();
    let bound = &built.bounded.as_ref().expect("it is proven").contended;
    let before = ["the instruction in progress", "entry of the interrupt"];
    let parts = bound.parts.iter();
    let before: u64 = parts
        .filter(|(name, _)| before.contains(&name.as_str()))
        .map(|(_, cycles)| cycles)
        .sum();
    let most = bound.cycles_max - before;
    let mut bench = Bench::started();
    let mut frames = Frames::default();
    let from = bench.angle();
    for step in 0..120_u32 {
        // To and fro, beyond both stops.
        let turn = f64::from(step) / 120.0 * std::f64::consts::TAU;
        bench.knob().hand = Hand {
            torque_n_m: 0.0,
            stiffness: 2.0,
            damping: 5e-3,
            place_rad: from + 150_f64.to_radians() * turn.sin(),
        };
        bench.pass_observed(CYCLES_PER_MS * 7 / 2, &mut frames);
        bench.knob().set_sensor_fault(match step % 10 {
            3 => SensorFault::WrongCrc,
            7 => SensorFault::Jumped(4000),
            _ => SensorFault::None,
        });
        bench.pass_observed(CYCLES_PER_MS / 4, &mut frames);
        bench.knob().set_sensor_fault(SensorFault::None);
        bench.pass_observed(CYCLES_PER_MS / 4, &mut frames);
    }
    assert_eq!((bench.faults(), bench.knob().is_driven()), (0, true));
    println!(
        "{} of {most} cycles, {} ticks",
        frames.longest, frames.count
    );
    assert!(u64::from(frames.count) > 470 * CYCLES_PER_MS / PERIOD);
    assert!(frames.longest <= most && frames.longest > most * 3 / 4);
}

fn mask_interrupts(bench: &mut Bench, masked: bool) {
    let primask = Register::named("primask").expect("a register");
    bench.machine.cpu_mut(0).set(primask, masked.into());
}

/// A core that is late for some ticks.
#[test]
fn missed_ticks_of_a_knob_are_counted_and_told() {
    let mut bench = Bench::started();
    assert_eq!(bench.word("core0", core_block::MISSED), 0);
    mask_interrupts(&mut bench, true);
    bench.pass(3 * PERIOD);
    mask_interrupts(&mut bench, false);
    bench.pass_ms(1);
    let missed = bench.word("core0", core_block::MISSED);
    assert!((1..=3).contains(&missed), "{missed}");
    assert_eq!((bench.faults(), bench.knob().is_driven()), (1, true));
}

/// A core that hangs for longer than the watchdog waits: the chip is reset, and nothing drives.
/// From there it starts as it is tested elsewhere.
#[test]
fn a_core_that_hangs_is_reset() {
    let mut bench = Bench::started();
    assert!(bench.knob().is_driven());
    mask_interrupts(&mut bench, true);
    bench.pass_ms(8);
    assert!(bench.knob().is_driven(), "for 10 ms");
    let until = bench.machine.cycle(0) + 4 * CYCLES_PER_MS;
    assert_eq!(bench.machine.run(until), Stop::Reset);
    let enable = bench.machine.bus.pins.levels() >> PINS.enable & 1;
    assert_eq!(enable, 0, "pulled down, and nobody drives it");
}
