//! Keys at columns of converters when something fails: lines, clocks, the DMA, a core; and when
//! samples become forces.

use whippen_compiler::firmware::core_block;
use whippen_emulator::{Finger, Register, ScanFault, Stop};

use crate::key_bench::{Built, CYCLES_PER_MS, PERIOD};
use crate::key_columns::{COLUMN, ColumnBench, KEY_PARTS, RAMP_MS, START_MS, built};

const DMA: u32 = 0x5000_0000;
const PIO0: u32 = 0x5020_0000;
const PWM: u32 = 0x400a_8000;
const ENABLE: u32 = 5;
/// Two columns.
const KEYS: usize = 2 * COLUMN;
/// Cycles from one frame to the next.
const FRAME: u64 = PERIOD / 8;

fn springs() -> Built {
    built("virtual-spring.whip", KEYS)
}

/// Started, with pressed keys that play.
fn pressed(built: &Built) -> ColumnBench<'_> {
    let mut bench = ColumnBench::started(built, KEY_PARTS);
    for key in 0..KEYS {
        bench.key(key).finger = Finger {
            force_n: 0.08 + 0.002 * key as f64,
            damping: 5.0,
            ..Finger::default()
        };
    }
    bench.pass_ms(50);
    assert!(plays(&bench), "{:?}", bench.put_out());
    bench.between_ticks();
    bench
}

/// Whether all keys have force.
fn plays(bench: &ColumnBench) -> bool {
    bench.put_out().iter().all(|word| *word > 2500)
}

fn is_free(bench: &ColumnBench) -> bool {
    bench.put_out().iter().all(|word| *word == 0)
}

fn write(bench: &mut ColumnBench, address: u32, value: u32) {
    let cycle = bench.machine.cycle(0);
    let bus = &mut bench.machine.bus;
    bus.write(address, 4, value, cycle).expect("a register");
}

fn read(bench: &mut ColumnBench, address: u32) -> u32 {
    let cycle = bench.machine.cycle(0);
    let read = bench.machine.bus.read(address, 4, cycle);
    read.expect("a register")
}

/// A channel of the DMA stands still for so many cycles.
fn stop_channel(bench: &mut ColumnBench, channel: u32, cycles: u64) {
    // CTRL, without a start.
    let control = DMA + 0x40 * channel + 0x10;
    let before = read(bench, control);
    write(bench, control, before & !1);
    bench.pass(cycles);
    write(bench, control, before | 1);
}

/// A line that nobody drives, or that lies high: its eight keys go free after 10 ms, the other
/// column plays on.
#[test]
fn a_column_without_its_data_goes_free_alone() {
    let built = springs();
    for (fault, word) in [
        (ScanFault::Silent, 0),
        (ScanFault::Stuck(false), 0),
        (ScanFault::Stuck(true), 0xffff),
    ] {
        let mut bench = pressed(&built);
        bench.column(1).set_fault(fault);
        bench.pass(2 * PERIOD);
        assert_eq!(bench.sensed()[COLUMN..], [word; COLUMN], "{fault:?}");
        bench.pass_ms(12);
        assert_eq!(bench.faults(), 2, "{fault:?}");
        let put_out = bench.put_out();
        assert!(put_out[..COLUMN].iter().all(|word| *word > 3000));
        assert_eq!(put_out[COLUMN..], [0; COLUMN], "{fault:?}");
        assert!(bench.all().is_enabled());
    }
}

/// A channel ahead, or a clock that one column lost: a tick has wrong words, the next one is right
/// again, and nothing is noticed.
#[test]
fn a_slip_is_over_in_the_next_tick() {
    let built = springs();
    let mut bench = pressed(&built);
    let before = bench.sensed();
    // Half of what is between two keys.
    let near = |a: u16, b: u16| a.abs_diff(b) < 59;
    assert!(!near(before[0], before[1]));
    bench.column(0).slip();
    // The frames of a tick, and the beginning of the next one.
    bench.pass(PERIOD + 300);
    let slipped = bench.sensed();
    for (key, word) in slipped.into_iter().enumerate() {
        let next = if key < COLUMN {
            (key + 1) % COLUMN
        } else {
            key
        };
        assert!(near(word, before[next]), "{key}");
    }
    bench.between_ticks();
    bench.column(0).lost_pulses = 1;
    bench.pass(PERIOD + 300);
    let late = bench.sensed();
    assert!(near(late[0], before[0] / 2), "{} {}", late[0], before[0]);
    assert!((1..KEYS).all(|key| near(late[key], before[key])));
    // The DAC did not take the word of that frame.
    assert_eq!(bench.column(0).refused_and_short(), [0, 1]);
    bench.pass(3 * PERIOD);
    let after = bench.sensed();
    assert!((0..KEYS).all(|key| near(after[key], before[key])));
    bench.pass_ms(10);
    assert!(plays(&bench));
    assert_eq!(bench.faults(), 0);
}

/// A machine that misses a frame, of one column: all of its words that follow would be other
/// keys'. No force from that tick on, in both columns, and after 10 ms no current.
#[test]
fn a_word_that_is_lost_is_found() {
    let built = springs();
    for column in 0..2 {
        let mut bench = pressed(&built);
        let machines = read(&mut bench, PIO0);
        write(&mut bench, PIO0, machines & !(2 << column));
        bench.pass(FRAME);
        write(&mut bench, PIO0, machines);
        bench.pass(PERIOD);
        assert_eq!(bench.driven(), [0; KEYS], "{column}");
        bench.pass(2 * PERIOD);
        assert!(is_free(&bench), "{column}: {:?}", bench.put_out());
        assert_eq!((bench.faults(), bench.all().is_enabled()), (1, true));
        bench.pass_ms(11);
        assert_eq!((bench.faults(), bench.all().is_enabled()), (65, false));
    }
}

/// A DMA that is late for words of the ADCs: within a tick nothing is lost; where a tick finds them
/// missing it is missed, and force comes back.
#[test]
fn words_that_come_late_are_waited_for_or_missed() {
    let built = springs();
    let mut bench = pressed(&built);
    bench.pass(FRAME);
    stop_channel(&mut bench, 3, 3 * FRAME);
    bench.pass(4 * FRAME);
    assert!(plays(&bench));
    assert_eq!(bench.faults(), 0);
    bench.between_ticks();
    bench.pass(6 * FRAME);
    stop_channel(&mut bench, 3, 3 * FRAME);
    bench.pass(15 * FRAME);
    assert!(is_free(&bench), "{:?}", bench.put_out());
    bench.pass_ms(RAMP_MS + 2);
    assert!(plays(&bench));
    assert_eq!((bench.faults(), bench.all().is_enabled()), (1, true));
}

/// A DMA that is late for words of the DACs: they would be late for ever, so a tick sends none,
/// which is a missed one, and those that follow are on time.
#[test]
fn words_that_are_sent_late_are_not_late_for_ever() {
    let built = springs();
    let mut bench = pressed(&built);
    // Behind the four words that it has fetched ahead, for as many frames and two more.
    bench.pass(200);
    stop_channel(&mut bench, 4, 6 * FRAME);
    bench.pass(PERIOD);
    assert_eq!(bench.faults(), 1);
    bench.pass_ms(RAMP_MS + 2);
    assert!(plays(&bench));
    for _ in 0..20 {
        bench.between_ticks();
        let sent: Vec<i32> = bench.driven().into_iter().map(i32::from).collect();
        bench.pass(PERIOD);
        assert_eq!(bench.put_out(), sent);
    }
    assert_eq!((bench.faults(), bench.all().is_enabled()), (1, true));
}

/// Frames stop: nothing reaches the DACs, so their last forces stay until the amplifiers are off.
#[test]
fn without_frames_amplifiers_are_off_after_10_ms() {
    let built = springs();
    let mut bench = pressed(&built);
    write(&mut bench, PWM + 20 * 9, 0);
    bench.pass_ms(8);
    assert_eq!(bench.driven(), [0; KEYS]);
    assert!(plays(&bench) && bench.all().is_enabled());
    bench.pass_ms(3);
    assert_eq!((bench.faults(), bench.all().is_enabled()), (65, false));
    assert!(bench.key(3).current_a().abs() < 1e-3);
}

fn mask_interrupts(bench: &mut ColumnBench, masked: bool) {
    let primask = Register::named("primask").expect("a register");
    bench.machine.cpu_mut(0).set(primask, masked.into());
}

/// A tick that comes late sends its words so that they go with their frames, or not at all.
#[test]
fn a_late_tick_sends_in_time_or_not_at_all() {
    let built = built("virtual-spring.whip", 7 * COLUMN);
    let mut bench = ColumnBench::started(&built, KEY_PARTS);
    for key in 0..7 * COLUMN {
        bench.key(key).finger.force_n = 0.1;
    }
    bench.between_ticks();
    let mut sent_late_by = 0;
    let mut not_sent_by = u64::MAX;
    for late in (0..140).step_by(3) {
        bench.between_ticks();
        let missed = bench.block(core_block::MISSED);
        let sent: Vec<i32> = bench.driven().into_iter().map(i32::from).collect();
        let before = bench.put_out();
        mask_interrupts(&mut bench, true);
        bench.pass(30 + late);
        mask_interrupts(&mut bench, false);
        bench.pass(PERIOD - 30 - late);
        match bench.block(core_block::MISSED) - missed {
            0 => {
                assert_eq!(bench.put_out(), sent, "{late}");
                sent_late_by = late;
            }
            more => {
                assert_eq!((more, bench.put_out()), (1, before), "{late}");
                not_sent_by = not_sent_by.min(late);
            }
        }
        // Forces go to zero and come back.
        bench.pass(40 * PERIOD);
    }
    println!("sent by {sent_late_by} cycles, not by {not_sent_by}");
    assert!((9..60).contains(&sent_late_by) && sent_late_by < not_sent_by);
}

#[test]
fn missed_ticks_of_columns_are_told_and_force_comes_back() {
    let built = springs();
    for ticks in [1, 2, 3] {
        for phase in [100, 1500, 3100] {
            let mut bench = pressed(&built);
            mask_interrupts(&mut bench, true);
            bench.pass(ticks * PERIOD + phase);
            mask_interrupts(&mut bench, false);
            bench.pass(2 * PERIOD);
            assert!(bench.put_out().iter().all(|word| *word < 2000));
            bench.pass_ms(RAMP_MS);
            let missed = bench.block(core_block::MISSED);
            assert!((1..=2 + 2 * ticks as i32).contains(&missed), "{missed}");
            assert_eq!((bench.faults(), bench.all().is_enabled()), (1, true));
            assert!(plays(&bench));
        }
    }
}

/// Amplifiers are off in the same tick, and then the DACs have no force either.
#[test]
fn a_processor_s_fault_frees_all_keys() {
    let built = springs();
    let mut bench = pressed(&built);
    let cpu = bench.machine.cpu_mut(0);
    cpu.set(Register::core(15), 0x3000_0000);
    bench.pass(PERIOD);
    assert!(!bench.all().is_enabled());
    bench.pass(2 * PERIOD);
    assert!(is_free(&bench), "{:?}", bench.put_out());
    assert_eq!(bench.word("status", 8), 16);
}

/// A core that hangs: the last forces for 10 ms; then the chip's pins hang free.
#[test]
fn a_core_that_hangs_is_reset_and_amplifiers_are_off() {
    let built = springs();
    let mut bench = pressed(&built);
    mask_interrupts(&mut bench, true);
    bench.pass_ms(8);
    assert!(bench.all().is_enabled() && plays(&bench), "for 10 ms");
    let until = bench.machine.cycle(0) + 4 * CYCLES_PER_MS;
    assert_eq!(bench.machine.run(until), Stop::Reset);
    assert_eq!(bench.machine.bus.pins.levels() >> ENABLE & 1, 0);
}

/// DACs that come up with a force in them, as after a reset of the chip alone: they have none when
/// they get their reference, and amplifiers are off for 100 ms more.
#[test]
fn columns_start_without_force() {
    let built = springs();
    let mut bench = ColumnBench::new(&built, KEY_PARTS);
    bench.key(2).finger.force_n = 0.3;
    assert_eq!(bench.column(1).outputs(), [0x9000; COLUMN]);
    while !bench.column(1).has_reference() {
        bench.pass(100);
    }
    assert!(is_free(&bench), "{:?}", bench.put_out());
    let mut enabled = None;
    for ms in 0..START_MS + 5 {
        bench.pass_ms(1);
        let is_on = bench.all().is_enabled();
        assert!(is_on || enabled.is_none(), "it is off again");
        enabled = enabled.or(is_on.then_some(ms));
        assert!(is_free(&bench) || ms >= START_MS - 3, "{ms} ms");
    }
    let enabled = enabled.expect("it is on");
    println!("amplifiers are on after {enabled} ms");
    assert!((98..105).contains(&enabled));
}

/// Cycles from a change of a sensor's voltage to the update of the DAC that follows it, wherever in
/// the period it comes: at most what the board tells, and a period in which nobody sampled.
#[test]
fn samples_become_forces_when_the_board_says() {
    let built = springs();
    let told = u64::from(
        built
            .board
            .columns
            .as_ref()
            .expect("columns")
            .latency_cycles(),
    );
    assert_eq!(told, 7089);
    let mut bench = ColumnBench::started(&built, KEY_PARTS);
    for key in [0, 3, 15] {
        let (mut least, mut most) = (u64::MAX, 0);
        for step in 0..24 {
            let column = bench.column(key / COLUMN);
            column.keys = None;
            column.volts[key % COLUMN] = 0.8;
            // The program's speed is that of a while.
            bench.pass_ms(3);
            bench.between_ticks();
            bench.pass(PERIOD / 24 * step);
            let at = bench.machine.cycle(0);
            let column = bench.column(key / COLUMN);
            let before = column.outputs()[key % COLUMN];
            column.volts[key % COLUMN] = 1.2;
            column.take_updates();
            bench.pass(4 * PERIOD);
            let updates = bench.column(key / COLUMN).take_updates();
            let changed = |outputs: &[u16; COLUMN]| outputs[key % COLUMN].abs_diff(before) > 300;
            let first = updates.iter().find(|update| changed(&update.outputs));
            let late = first.expect("a change").cycle - at;
            (least, most) = (least.min(late), most.max(late));
        }
        println!("key {key}: {least} to {most} cycles, told {told} and {PERIOD}");
        assert!(least >= told && most <= told + PERIOD, "key {key}");
        assert!(most + 300 > told + PERIOD, "key {key}: {most}");
    }
}
