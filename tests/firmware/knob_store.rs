//! What the start of a knob finds of its motor is kept in flash: the next start only tries it with
//! a small motion, unless what is kept is spoiled, is not true of the motor, or somebody asks.

use whippen_compiler::firmware::core_block;
use whippen_emulator::{KnobParts, Stop};

use crate::knob_bench::{AGAIN_MS, Bench, PARTS, START_MS, STORE};

/// The first scratch register of the watchdog.
const SCRATCH: u32 = 0x400d_800c;
/// Bytes of a record of one knob that its check covers, then the check.
const CHECKED: usize = 16;

/// Starts, until force may come up: how far the knob has turned by then (rad), and the largest
/// current (A).
fn start(bench: &mut Bench, ms: u64) -> (f64, f64) {
    let from = bench.angle();
    let (mut turned, mut current) = (0.0_f64, 0.0_f64);
    for _ in 0..ms {
        bench.pass_ms(1);
        turned = turned.max((bench.angle() - from).abs());
        let phases = bench.knob().motor().phase_currents();
        current = phases.iter().fold(current, |most, own| most.max(own.abs()));
    }
    (turned, current)
}

/// A twelfth of an electrical turn (rad), by which what is kept is tried.
const TRIED_RAD: f64 = std::f64::consts::TAU / 12.0 / 7.0;

/// Whether the bench finds its motor anew at once: a field that rises at some angle pulls it there,
/// where one that tries what is kept rises at the magnet's.
fn aligns(bench: &mut Bench) -> bool {
    let (turned, current) = start(bench, 62);
    current > 0.1 && turned > TRIED_RAD
}

/// A first start, millisecond by millisecond; what is stored while the sector is erased, and at the
/// end.
fn first_start(parts: KnobParts) -> (Bench, Vec<u8>, Vec<u8>) {
    let mut bench = Bench::new(parts);
    let mut erased = None;
    for _ in 0..START_MS {
        bench.pass_ms(1);
        let stored = bench.stored();
        if stored.iter().all(|byte| *byte == 0xff) {
            // Nobody sees the sensor meanwhile.
            assert!(!bench.knob().is_driven());
            erased = Some(stored);
        }
    }
    let stored = bench.stored();
    (bench, erased.expect("it is erased first"), stored)
}

#[test]
fn the_next_start_tries_what_is_kept() {
    for (reversed, angle_rad) in [(false, 1.0), (true, 4.0)] {
        let mut parts = PARTS;
        (parts.motor.reversed, parts.angle_rad) = (reversed, angle_rad);
        let (mut bench, erased, stored) = first_start(parts);
        assert_eq!((bench.faults(), bench.knob().is_driven()), (0, true));
        assert_eq!(&stored[..4], b"WHIP");
        // Elsewhere, as somebody has turned it without power.
        let mut next = parts;
        next.angle_rad += 2.0;
        let mut bench = Bench::new(next);
        bench.keep(&stored);
        let from = bench.angle();
        let (turned, current) = start(&mut bench, AGAIN_MS);
        let left = bench.angle() - from;
        println!("reversed {reversed}: {turned} rad, {left} left, {current} A");
        assert!((0.8..1.2).contains(&(turned / TRIED_RAD)), "{turned} rad");
        assert!(left.abs() < 0.2 * TRIED_RAD, "{left} rad");
        assert_eq!((bench.faults(), bench.knob().is_driven()), (0, true));
        assert!(bench.word("core0", core_block::TICK) > 0);
        let error = bench.electrical_error(&next).to_degrees();
        assert!(error.abs() < 5.0, "{error}");
        assert_eq!(bench.stored(), stored);
        // Without power between erasing and writing.
        let mut bench = Bench::new(parts);
        bench.keep(&erased);
        assert!(aligns(&mut bench));
    }
}

/// A magnet that was moved on its shaft, by parts of an electrical turn: what is kept is not true
/// any more, up to the motor that would run away and the one that stands where it is pushed
/// neither way; and a motor that is now wired the other way round.
#[test]
fn a_magnet_that_was_moved_is_noticed() {
    let (_, _, stored) = first_start(PARTS);
    for (part, is_noticed) in [
        (0.01, false),
        (0.06, true),
        (-0.06, true),
        (0.25, true),
        (-0.3, true),
        (0.5, true),
    ] {
        let mut parts = PARTS;
        parts.motor.offset_rad += part * std::f64::consts::TAU;
        check_noticed(
            parts,
            &stored,
            is_noticed,
            &format!("{part} of an electrical turn"),
        );
    }
    let mut parts = PARTS;
    parts.motor.reversed = true;
    check_noticed(parts, &stored, true, "reversed");
}

/// Starts with what is stored of other parts: whether the motor is found anew, which then is right.
fn check_noticed(parts: KnobParts, stored: &[u8], is_noticed: bool, told: &str) {
    let mut bench = Bench::new(parts);
    bench.keep(stored);
    bench.pass_ms(AGAIN_MS + if is_noticed { START_MS } else { 0 });
    assert_eq!(
        (bench.faults(), bench.knob().is_driven()),
        (0, true),
        "{told}"
    );
    let error = bench.electrical_error(&parts).to_degrees();
    println!("{told}: {error} degrees");
    assert!(error.abs() < 6.0, "{told}: {error}");
    assert_eq!(bench.stored() == stored, !is_noticed, "{told}");
}

/// A bit of each word of the record, of its check, and a record of other parts.
#[test]
fn a_spoiled_record_is_not_taken() {
    let (_, _, stored) = first_start(PARTS);
    let mut bench = Bench::new(PARTS);
    bench.keep(&stored);
    assert!(!aligns(&mut bench));
    for byte in (1..CHECKED + 4).step_by(4) {
        let mut spoiled = stored.clone();
        spoiled[byte] ^= 0x10;
        let mut bench = Bench::new(PARTS);
        bench.keep(&spoiled);
        assert!(aligns(&mut bench), "byte {byte}");
    }
    // Its check is right.
    for at in [0, 4] {
        let mut other = stored.clone();
        other[at] ^= 1;
        let check = crc32(&other[..CHECKED]).to_le_bytes();
        other[CHECKED..CHECKED + 4].copy_from_slice(&check);
        let mut bench = Bench::new(PARTS);
        bench.keep(&other);
        assert!(aligns(&mut bench), "word at {at}");
    }
    assert_eq!(
        crc32(&stored[..CHECKED]).to_le_bytes(),
        stored[CHECKED..CHECKED + 4]
    );
}

/// CRC-32 as of Ethernet.
fn crc32(bytes: &[u8]) -> u32 {
    let of_bit = |left: u32, _| left >> 1 ^ if left & 1 != 0 { 0xedb8_8320 } else { 0 };
    let of_byte = |left: u32, byte: &u8| (0..8).fold(left ^ u32::from(*byte), of_bit);
    !bytes.iter().fold(u32::MAX, of_byte)
}

#[test]
fn it_aligns_again_where_somebody_asks() {
    let mut bench = Bench::started();
    let stored = bench.stored();
    // Another value than 1 is refused.
    ask(&mut bench, 1, 2);
    bench.pass_ms(2);
    assert_eq!(bench.word("mailbox", 16), 2);
    assert!(bench.knob().is_driven());
    ask(&mut bench, 2, 1);
    let until = bench.machine.cycle(0) + 300_000;
    assert_eq!(bench.machine.run(until), Stop::Reset);
    let cycle = bench.machine.cycle(0);
    let scratch = bench.machine.bus.read(SCRATCH, 4, cycle).expect("it reads");
    assert_ne!(scratch, 0);
    // The chip starts again: its flash and that register are as they were.
    let mut bench = Bench::new(PARTS);
    bench.keep(&stored);
    let scratch = bench.machine.bus.write(SCRATCH, 4, scratch, 0);
    scratch.expect("it is written");
    bench.pass_ms(50);
    assert!(bench.stored().iter().all(|byte| *byte == 0xff));
    assert!(aligns(&mut bench));
    assert_eq!(bench.machine.bus.read(SCRATCH, 4, 0), Ok(0));
}

/// Asks the mailbox to align, with this number of the request and this value.
fn ask(bench: &mut Bench, request: i32, value: i32) {
    bench.set_word("mailbox", 4, -3);
    bench.set_word("mailbox", 8, value);
    bench.set_word("mailbox", 0, request);
}

/// The image may not lie where the record does.
#[test]
fn the_record_lies_behind_the_image() {
    let built = crate::knob_bench::bundled();
    let mut segments = built.image.segments.iter();
    assert!(
        segments.all(|own| own.load + own.bytes.len() as u32 <= STORE || own.load > 0x2000_0000)
    );
}
