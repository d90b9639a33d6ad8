//! Keys at columns of converters when something fails: lines, clocks, the DMA, a core; and when
//! samples become forces.

use whippen_compiler::firmware::{OwnTexts, core_block};
use whippen_emulator::{Finger, Register, ScanFault, Stop};

use crate::key_bench::{Built, CYCLES_PER_MS, PERIOD, build_keys};
use crate::key_columns::{
    COLUMN, ColumnBench, KEY_PARTS, RAMP_MS, START_MS, TICK_COMES, board_of, built,
};

const DMA: u32 = 0x5000_0000;
const PIO0: u32 = 0x5020_0000;
const PWM: u32 = 0x400a_8000;
const ENABLE: u32 = 5;
const FAULT: u32 = 28;
/// Two columns.
const KEYS: usize = 2 * COLUMN;
/// Cycles from one frame to the next.
const FRAME: u64 = PERIOD / 8;

/// On both cores each has a column.
fn springs(cores: usize) -> Built {
    built("virtual-spring.whip", KEYS, cores)
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
    let cycle = bench.now();
    let bus = &mut bench.machine.bus;
    bus.write(address, 4, value, cycle).expect("a register");
}

fn read(bench: &mut ColumnBench, address: u32) -> u32 {
    let cycle = bench.now();
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
/// column plays on, of the same core or of the other.
#[test]
fn a_column_without_its_data_goes_free_alone() {
    for (cores, column, fault, word) in [
        (1, 1, ScanFault::Silent, 0),
        (2, 0, ScanFault::Stuck(false), 0),
        (2, 1, ScanFault::Stuck(true), 0xffff),
    ] {
        let built = springs(cores);
        let mut bench = pressed(&built);
        bench.column(column).set_fault(fault);
        bench.pass(2 * PERIOD);
        let own = COLUMN * column..COLUMN * (column + 1);
        let other = COLUMN * (1 - column)..COLUMN * (2 - column);
        assert_eq!(bench.sensed()[own.clone()], [word; COLUMN], "{fault:?}");
        bench.pass_ms(12);
        assert_eq!(bench.faults(), 2, "{fault:?}");
        let put_out = bench.put_out();
        assert!(put_out[other].iter().all(|word| *word > 3000));
        assert_eq!(put_out[own], [0; COLUMN], "{fault:?}");
        assert!(bench.all().is_enabled());
    }
}

/// A channel ahead, or a clock that one column lost: a tick has wrong words, the next one is right
/// again, and nothing is noticed.
#[test]
fn a_slip_is_over_in_the_next_tick() {
    let built = springs(2);
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
    for (cores, column) in [(1, 1), (2, 0), (2, 1)] {
        let built = springs(cores);
        let mut bench = pressed(&built);
        let machines = read(&mut bench, PIO0);
        write(&mut bench, PIO0, machines & !(2 << column));
        bench.pass(FRAME);
        write(&mut bench, PIO0, machines);
        bench.pass(PERIOD);
        // Core 1 learns of it in its tick, and then has no force to give.
        let of_core0 = bench.keys_of(0);
        assert_eq!(bench.driven()[..of_core0], vec![0; of_core0], "{column}");
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
    let built = springs(2);
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
    let built = springs(2);
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
    let built = springs(2);
    let mut bench = pressed(&built);
    write(&mut bench, PWM + 20 * 9, 0);
    bench.pass_ms(8);
    assert_eq!(bench.driven(), [0; KEYS]);
    assert!(plays(&bench) && bench.all().is_enabled());
    bench.pass_ms(3);
    assert_eq!((bench.faults(), bench.all().is_enabled()), (65, false));
    assert!(bench.key(3).current_a().abs() < 1e-3);
}

/// A tick that comes late sends its words so that they go with their frames, or not at all.
#[test]
fn a_late_tick_sends_in_time_or_not_at_all() {
    for cores in [1, 2] {
        let built = built("virtual-spring.whip", 7 * COLUMN, cores);
        let mut bench = ColumnBench::started(&built, KEY_PARTS);
        for key in 0..7 * COLUMN {
            bench.key(key).finger.force_n = 0.1;
        }
        let mut sent_late_by = 0;
        let mut not_sent_by = u64::MAX;
        for late in (0..102).step_by(3).chain((102..180).step_by(10)) {
            bench.before_tick();
            bench.mask_interrupts(0, true);
            // The frames of before are over.
            bench.pass(TICK_COMES + 2);
            let missed = bench.block(core_block::MISSED);
            let sent: Vec<i32> = bench.driven().into_iter().map(i32::from).collect();
            let before = bench.put_out();
            bench.pass(late);
            bench.mask_interrupts(0, false);
            bench.pass(PERIOD - late);
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
        println!("{cores} cores: sent by {sent_late_by} cycles, not by {not_sent_by}");
        assert!((55..100).contains(&sent_late_by) && sent_late_by < not_sent_by);
    }
}

/// Ticks that one core misses, or begins late: no force, on both, and it comes back.
#[test]
fn missed_ticks_of_columns_are_told_and_force_comes_back() {
    for (cores, masked) in [(1, 0), (2, 0), (2, 1)] {
        let built = springs(cores);
        let mut bench = pressed(&built);
        for ticks in [1, 3] {
            for phase in [100, 1500, 3100] {
                bench.before_tick();
                let before = bench.block_of(masked, core_block::MISSED);
                bench.mask_interrupts(masked, true);
                bench.pass(ticks * PERIOD + phase);
                bench.mask_interrupts(masked, false);
                bench.pass(3 * PERIOD);
                let all = bench.put_out();
                assert!(all.iter().all(|word| *word < 2000), "{masked}: {all:?}");
                bench.pass_ms(RAMP_MS);
                let missed = bench.block_of(masked, core_block::MISSED) - before;
                assert!((1..=3 + 2 * ticks as i32).contains(&missed), "{missed}");
                assert_eq!((bench.faults(), bench.all().is_enabled()), (1, true));
                assert!(plays(&bench), "{masked}: {:?}", bench.put_out());
            }
        }
    }
}

/// A line that amplifiers pull down, for a moment: they are off from the next tick on, until the
/// next start, and that tick gives no force. One that is down at the start lets nothing on.
#[test]
fn an_amplifier_s_fault_switches_all_off() {
    for cores in [1, 2] {
        let mut board = board_of(2, cores);
        board.columns.as_mut().expect("columns").fault = Some(FAULT);
        assert_eq!(board.contradiction(), None);
        let built = build_keys("virtual-spring.whip", 16, board, OwnTexts::default());
        let pull = |bench: &mut ColumnBench, down: bool| {
            let cycle = bench.now();
            let pins = &mut bench.machine.bus.pins;
            pins.set_outside(1 << FAULT, Some(u64::from(!down) << FAULT), cycle);
        };
        let mut bench = pressed(&built);
        assert_eq!(bench.faults(), 0);
        pull(&mut bench, true);
        bench.pass(300);
        pull(&mut bench, false);
        assert!(!bench.all().is_enabled());
        assert_eq!(bench.driven()[..COLUMN], [0; COLUMN]);
        bench.pass(3 * PERIOD);
        assert!(bench.put_out().iter().all(|word| *word < 100));
        assert_eq!(bench.block(core_block::FAULTS), 1 | 32);
        bench.pass_ms(30);
        assert!(!bench.all().is_enabled() && bench.key(9).current_a().abs() < 1e-3);
        if cores > 1 {
            let mut bench = ColumnBench::new(&built, KEY_PARTS);
            pull(&mut bench, true);
            bench.pass_ms(START_MS + 10);
            assert_eq!((bench.faults() & 32, bench.all().is_enabled()), (32, false));
        }
    }
}

/// Amplifiers are off in the same tick, and then the DACs have no force either.
#[test]
fn a_processor_s_fault_frees_all_keys() {
    for (cores, faulty) in [(1, 0), (2, 0), (2, 1)] {
        let built = springs(cores);
        let mut bench = pressed(&built);
        let cpu = bench.machine.cpu_mut(faulty);
        cpu.set(Register::core(15), 0x3000_0000);
        bench.pass(PERIOD);
        assert!(!bench.all().is_enabled());
        bench.pass(2 * PERIOD);
        assert!(is_free(&bench), "{faulty}: {:?}", bench.put_out());
        assert_eq!(bench.word("status", 8), 16);
        bench.pass_ms(5);
        assert!(is_free(&bench) && !bench.all().is_enabled());
    }
}

/// A core that hangs: the last forces for 10 ms; then the chip's pins hang free. Where there is
/// another core, that one switches the amplifiers off when the first has stood still for eight
/// ticks.
#[test]
fn a_core_that_hangs_is_reset_and_amplifiers_are_off() {
    for (cores, hangs) in [(1, 0), (2, 0), (2, 1)] {
        let built = springs(cores);
        let mut bench = pressed(&built);
        bench.mask_interrupts(hangs, true);
        match cores {
            1 => bench.pass_ms(8),
            _ => bench.pass(8 * PERIOD),
        }
        assert!(bench.all().is_enabled() && plays(&bench), "{hangs}");
        if cores > 1 {
            bench.pass(3 * PERIOD);
            assert!(!bench.all().is_enabled(), "{hangs}");
            // The other one tells of it.
            assert_eq!(bench.block_of(1 - hangs, core_block::FAULTS), 65);
            bench.pass_ms(8);
        }
        let until = bench.now() + 4 * CYCLES_PER_MS;
        assert_eq!(bench.machine.run(until), Stop::Reset);
        assert_eq!(bench.machine.bus.pins.levels() >> ENABLE & 1, 0);
    }
}

/// DACs that come up with a force in them, as after a reset of the chip alone: they have none when
/// they get their reference, and amplifiers are off for 100 ms more.
#[test]
fn columns_start_without_force() {
    let built = springs(2);
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
    let built = springs(2);
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
            let at = bench.now();
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
