//! A bench of keys when something fails: bridges, the ADC, a sensor, a core.

use whippen_compiler::firmware::core_block;
use whippen_emulator::{Register, Stop};

use crate::key_bench::{
    Bench, CYCLES_PER_MS, FAULT, KEYS, PARTS, PERIOD, RAMP_MS, SLEEP, START_MS,
};
use crate::keys::bundled;

const ADC_FCS: u32 = 0x400a_0008;
const ADC_FIFO: u32 = 0x400a_000c;

/// Pressed keys that play, and how to see whether they do.
fn pressed(bench: &mut Bench) {
    for key in 0..KEYS {
        bench.key(key).finger.force_n = 0.3;
    }
    bench.pass_ms(50);
    assert!(
        currents(bench).iter().all(|a| *a > 0.3),
        "{:?}",
        currents(bench)
    );
}

fn currents(bench: &Bench) -> Vec<f64> {
    let keys = bench.keys().keys().iter();
    keys.map(|key| key.current_a()).collect()
}

fn write(bench: &mut Bench, address: u32, value: u32) {
    let cycle = bench.machine.cycle(0);
    let bus = &mut bench.machine.bus;
    bus.write(address, 4, value, cycle).expect("a register");
}

#[test]
fn a_bridge_s_fault_puts_all_to_sleep_in_the_same_tick() {
    let built = bundled("virtual-spring.whip");
    let mut bench = Bench::started(&built, PARTS);
    pressed(&mut bench);
    bench.keys_mut().set_tripped(true);
    bench.pass(2 * PERIOD);
    bench.keys_mut().set_tripped(false);
    bench.pass_ms(1);
    assert_eq!((bench.faults(), bench.keys().is_awake()), (32, false));
    assert!(currents(&bench).iter().all(|a| *a == 0.0));
    // From the start on: it never wakes.
    let mut bench = Bench::new(&built, PARTS);
    bench.pass_ms(1);
    bench.keys_mut().set_tripped(true);
    bench.pass_ms(START_MS);
    assert_eq!(bench.machine.bus.pins.levels() >> FAULT & 1, 0);
    bench.keys_mut().set_tripped(false);
    assert!(!bench.keys().is_awake());
}

/// The ADC gives no more words: no force from the next tick on, and after 10 ms none until the next
/// start.
#[test]
fn an_adc_that_stands_still_is_no_force_within_a_tick() {
    let built = bundled("virtual-spring.whip");
    let mut bench = Bench::started(&built, PARTS);
    pressed(&mut bench);
    bench.between_ticks();
    write(&mut bench, ADC_FCS, 0);
    bench.pass(PERIOD);
    assert_eq!(bench.driven(), [0; KEYS]);
    assert_eq!((bench.faults(), bench.keys().is_awake()), (1, true));
    bench.pass(6 * PERIOD);
    let left = currents(&bench);
    assert!(left.iter().all(|a| a.abs() < 0.05), "{left:?}");
    bench.pass_ms(11);
    assert_eq!((bench.faults(), bench.keys().is_awake()), (65, false));
}

/// It comes back within 10 ms: force comes up again.
#[test]
fn an_adc_that_comes_back_plays_again() {
    let built = bundled("virtual-spring.whip");
    let mut bench = Bench::started(&built, PARTS);
    pressed(&mut bench);
    bench.between_ticks();
    // Words of exactly two ticks are left out.
    write(&mut bench, ADC_FCS, 0);
    bench.pass(2 * PERIOD);
    write(&mut bench, ADC_FCS, 1 << 24 | 9);
    bench.pass_ms(2 + RAMP_MS);
    assert_eq!((bench.faults(), bench.keys().is_awake()), (1, true));
    assert!(
        currents(&bench).iter().all(|a| *a > 0.2),
        "{:?}",
        currents(&bench)
    );
}

/// A word that somebody else takes: all that follow would be other keys'.
#[test]
fn a_conversion_that_is_lost_is_found() {
    let built = bundled("virtual-spring.whip");
    let mut bench = Bench::started(&built, PARTS);
    pressed(&mut bench);
    bench.between_ticks();
    // The queue holds its word for a cycle: without requests it stays there to be taken.
    write(&mut bench, ADC_FCS, 1);
    bench.pass(425);
    let cycle = bench.machine.cycle(0);
    bench
        .machine
        .bus
        .read(ADC_FIFO, 4, cycle)
        .expect("a register");
    write(&mut bench, ADC_FCS, 1 << 24 | 9);
    bench.pass(PERIOD);
    assert_eq!(bench.driven(), [0; KEYS]);
    assert!(bench.keys().is_awake());
    bench.pass_ms(11);
    assert_eq!((bench.faults(), bench.keys().is_awake()), (65, false));
}

/// A sensor at either end for 10 ms: its key alone goes free.
#[test]
fn a_sensor_at_a_rail_frees_its_key() {
    let built = bundled("virtual-spring.whip");
    for code in [0, 4095] {
        let mut bench = Bench::started(&built, PARTS);
        pressed(&mut bench);
        bench.key(5).stuck_code = Some(code);
        bench.pass_ms(16);
        assert_eq!(bench.faults(), 2, "{code}");
        assert_eq!(bench.block(core_block::FAULTY), 5);
        bench.pass_ms(2);
        let left = currents(&bench);
        for (key, current) in left.iter().enumerate() {
            assert_eq!(current.abs() < 0.02, key == 5, "{code}: {left:?}");
        }
    }
}

#[test]
fn a_processor_s_fault_puts_all_to_sleep() {
    let built = bundled("virtual-spring.whip");
    let mut bench = Bench::started(&built, PARTS);
    pressed(&mut bench);
    bench
        .machine
        .cpu_mut(0)
        .set(Register::core(15), 0x3000_0000);
    // It may wait for the next tick.
    bench.pass(2 * PERIOD);
    assert!(!bench.keys().is_awake());
    assert_eq!(bench.word("status", 8), 16);
}

fn mask_interrupts(bench: &mut Bench, masked: bool) {
    let primask = Register::named("primask").expect("a register");
    bench.machine.cpu_mut(0).set(primask, masked.into());
}

#[test]
fn missed_ticks_of_a_bench_are_told_and_force_comes_back() {
    let built = bundled("virtual-spring.whip");
    for phase in [100, 1500, 3100] {
        let mut bench = Bench::started(&built, PARTS);
        pressed(&mut bench);
        bench.between_ticks();
        mask_interrupts(&mut bench, true);
        bench.pass(3 * PERIOD + phase);
        mask_interrupts(&mut bench, false);
        bench.pass(PERIOD);
        assert!(
            bench.driven().iter().all(|word| *word < 2000),
            "{:?}",
            bench.driven()
        );
        bench.pass_ms(RAMP_MS);
        let missed = bench.block(core_block::MISSED);
        assert!((2..=6).contains(&missed), "{missed}");
        assert_eq!((bench.faults(), bench.keys().is_awake()), (1, true));
        assert!(currents(&bench).iter().all(|a| *a > 0.2));
    }
}

#[test]
fn a_core_that_hangs_is_reset_and_the_bridges_sleep() {
    let built = bundled("virtual-spring.whip");
    let mut bench = Bench::started(&built, PARTS);
    pressed(&mut bench);
    mask_interrupts(&mut bench, true);
    bench.pass_ms(8);
    assert!(bench.keys().is_awake(), "for 10 ms");
    let until = bench.machine.cycle(0) + 4 * CYCLES_PER_MS;
    assert_eq!(bench.machine.run(until), Stop::Reset);
    assert_eq!(bench.machine.bus.pins.levels() >> SLEEP & 1, 0);
}
