//! A bench of keys, whole: what a finger feels, words and events as the interpreter's, when samples
//! become forces.

use whippen_compiler::firmware::{OwnTexts, core_block};
use whippen_compiler::kernel::Interp;
use whippen_emulator::Finger;

use crate::key_bench::{
    Bench, Built, CYCLES_PER_MS, KEYS, PARTS, PERIOD, START_MS, build_bench, bundled_board,
};

/// Eight keys of a bundled instrument on the bundled board.
pub fn bundled(file: &str) -> Built {
    build_bench(file, bundled_board(), OwnTexts::default())
}

/// Each key under another force is where the program's spring is as strong.
#[test]
fn fingers_feel_the_springs_of_eight_keys() {
    let built = bundled("virtual-spring.whip");
    let mut bench = Bench::started(&built, PARTS);
    // What a motor stands for ever is 0.117 N.
    let force = |key: usize| 0.02 + 0.012 * key as f64;
    for key in 0..KEYS {
        bench.key(key).finger = Finger {
            force_n: force(key),
            damping: 5.0,
            ..Finger::default()
        };
    }
    bench.pass_ms(400);
    for key in 0..KEYS {
        let (place, wanted) = (bench.keys().keys()[key].place_m(), force(key) / 100.0);
        println!("key {key}: {:.3} mm, of {:.3}", 1e3 * place, 1e3 * wanted);
        // A step of the converter is 2.7 um, one of the bridge 0.4 mN.
        assert!((place - wanted).abs() < 15e-6, "key {key}: {place}");
    }
    assert_eq!(bench.faults(), 0);
}

/// Strokes on all keys of a grand, one after the other: in each tick the number of events is that
/// of the interpreter on the words that the board had, and so are the drive words of all keys that
/// are neither hot nor coming up.
#[test]
fn a_grand_plays_as_the_interpreter_on_the_same_words() {
    let built = bundled("grand-piano.whip");
    let mut bench = Bench::new(&built, PARTS);
    bench.pass_ms(START_MS - 3);
    assert_eq!(bench.block(core_block::TICK), 0);
    // The first tick has no keys, and comes anywhere; force has hardly come up in the next one.
    bench.between_ticks();
    bench.between_ticks();
    let rest = bench.sensed();
    let mut interp = Interp::new(&built.kernel, KEYS).expect("it verifies");
    let mut drives = [0; KEYS];
    interp.init(&rest);
    let so_far = bench.word("core0_state", 12);
    assert!((1..4).contains(&so_far), "{so_far}");
    (0..so_far).for_each(|_| interp.tick(&rest, &mut drives));
    assert_eq!(interp.drain_events().len(), 0);
    let ring = built.layouts[0].events().expect("keys have events");
    let mut head = bench.word("core0_state", ring.head);
    let (mut notes, mut spoken, mut full) = (0, 0, 0);
    let ticks = 11_500;
    for tick in 0..ticks {
        for key in 0..KEYS {
            let since = tick as i64 - 1000 - 1000 * key as i64;
            let force_n = match since {
                0..2500 => 2.0,
                _ => 0.0,
            };
            bench.key(key).finger.force_n = force_n;
        }
        let gains = bench.gains();
        bench.pass(PERIOD);
        let words = bench.sensed();
        interp.tick(&words, &mut drives);
        let driven = bench.driven();
        for ((driven, drive), gain) in driven.iter().zip(drives).zip(gains) {
            let most = ((i32::from(drive.unsigned_abs()) * gain) >> 16) + 1;
            assert!(
                i32::from(driven.unsigned_abs()) <= most,
                "tick {tick}: {driven} {drive}"
            );
            let is_full = gain == 1 << 16;
            assert!(
                !is_full || *driven == drive,
                "tick {tick}: {driven} {drive}"
            );
            full += u32::from(is_full);
        }
        let events = interp.drain_events().len() as u32;
        let now = bench.word("core0_state", ring.head);
        assert_eq!((now - head) as u32, events * ring.event, "tick {tick}");
        (head, notes) = (now, notes + events);
        spoken += usize::from(drives.iter().any(|word| *word != 0));
    }
    println!("{notes} events, forces in {spoken} of {ticks} ticks, {full} words at full gain");
    assert!(notes == KEYS as u32 && spoken > ticks / 4);
    // Two amperes are more than a coil stands for ever.
    assert!(full > KEYS as u32 * ticks as u32 / 3);
    assert_eq!(bench.word("core0_state", 12), so_far + ticks as i32);
    assert_eq!(bench.faults() & !8, 0);
}

/// Cycles from a change of a key's place to the wrap from which on its bridge drives otherwise,
/// wherever in the period the change comes: at most what the board tells, and a period in which
/// nobody looked.
#[test]
fn samples_become_forces_when_the_board_says() {
    let built = bundled("virtual-spring.whip");
    let layout = built.board.bench.as_ref().expect("a bench");
    let mut bench = Bench::started(&built, PARTS);
    bench.machine.bus.pins.record();
    for key in [0, 3, 7] {
        let bridge = layout.bridges[key];
        let told = u64::from(layout.latency_cycles(key as u32, KEYS as u32));
        let mut most = 0;
        for step in 0..20 {
            bench.key(key).stuck_code = Some(1000);
            bench.pass_ms(2);
            bench.machine.bus.pins.take_changes();
            bench.pass(2 * PERIOD + PERIOD / 20 * step + 7 * step);
            let at = bench.machine.cycle(0);
            bench.key(key).stuck_code = Some(1800);
            // At once, and not with the key's next step.
            bench
                .machine
                .bus
                .pins
                .set_analog(layout.sensors[key] as usize, 1800);
            bench.pass(6 * PERIOD);
            most = most.max(first_change(&bench.machine.bus.pins.take_changes(), bridge, at) - at);
        }
        println!("key {key}: {most} cycles, told {told} and {PERIOD}");
        assert!(most <= told + PERIOD, "key {key}: {most}");
        assert!(most + 500 > told + PERIOD, "key {key}: {most}, not {told}");
    }
}

/// The beginning of the first period from a cycle on whose pulse is not as long as that of the
/// first one.
fn first_change(changes: &[whippen_emulator::PinChange], pin: u32, from: u64) -> u64 {
    let mut edges = changes.windows(2).filter_map(|pair| {
        let [before, after] = [pair[0].levels, pair[1].levels].map(|all| all >> pin & 1);
        (before != after).then_some((pair[1].cycle, after == 1))
    });
    let mut first = None;
    let mut rise = None;
    edges
        .find_map(|(cycle, up)| {
            if up {
                rise = Some(cycle);
                return None;
            }
            let width = cycle - rise?;
            let usual = *first.get_or_insert(width);
            rise.filter(|rise| *rise > from && width != usual)
        })
        .unwrap_or_else(|| panic!("no change after {from}"))
}

/// Bridges sleep until the words have been looked at, then no force comes before the ramp.
#[test]
fn a_bench_starts_asleep() {
    let built = bundled("virtual-spring.whip");
    let mut bench = Bench::new(&built, PARTS);
    bench.key(2).finger.force_n = 0.3;
    let mut woke = None;
    for ms in 0..START_MS + 5 {
        bench.pass(CYCLES_PER_MS);
        let awake = bench.keys().is_awake();
        assert!(awake || woke.is_none(), "it sleeps again");
        woke = woke.or(awake.then_some(ms));
        let current = bench.keys().keys()[2].current_a();
        assert!(
            current.abs() < 0.02 || ms >= START_MS - 2,
            "{ms} ms: {current}"
        );
    }
    let woke = woke.expect("it wakes");
    println!("awake after {woke} ms");
    assert!((100..105).contains(&woke));
}
