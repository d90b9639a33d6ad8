//! Constants and tables of a knob's firmware: from drive words to voltages of three phases.
//!
//! ```text
//!   voltage = gain * word + lead * (word - last word) + back * speed     in 1/8192 of what there is
//!   phase k = middle + voltage * sine(angle - k * 120 deg)               in counts of the PWM
//! ```
//!
//! The coil is held for a tick, so the lead that brings its current to where the word wants it by
//! the end of the tick is exact: R a / (1 - a) with a = exp(-R T / L).
//! Not here: the texts (`knob.s`, `knob_start.s`, `knob_store.s`).

use std::fmt::Write;

use whippen_board::{Board, Knob, Shaft};

use super::{FirmwareError, Setup, Support};

/// The coil of a motor whose voltage is made from its force.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Coil {
    /// Resistance of a phase (mOhm).
    pub resistance_mohm: u32,
    /// The part of its current that is left a tick after it has been shorted, of 2^32.
    pub kept: u32,
    /// The current of drive word 32768 (mA).
    pub peak_ma: u32,
    /// Torque of the phases' amplitude (uN*m/A).
    pub torque_constant_un_m: u32,
}

/// Steps of the sensor in a turn.
const STEPS: u32 = 1 << 14;
/// Entries of the table of sines, of a turn; a second phase looks on from there.
const SINES: u32 = 1024;
/// From a phase to the second one: minus a third of a turn.
const SECOND: u32 = 2 * SINES / 3 + 1;
/// Cosine and sine of the turn from an entry to the next, of 2^60.
const ROTATION: [i128; 2] = [0x0fff_ec42_c745_4927, 0x0019_21f0_fe67_0071];
/// A turn (rad), to a ten-millionth.
const TURN_RAD: [i128; 2] = [710, 113];
/// Counts that phases keep from both ends of the PWM.
const KEPT: u32 = 5;
/// What a voltage's factor is multiplied with, and a voltage at its largest.
const FRACTION: i128 = 1 << 28;
const VOLTAGE: i128 = 8192;
/// What a speed's unit is of a step a tick.
const SPEED: i128 = 1024;
/// The most steps of the sensor in a tick that are a motion.
const STEPS_MAX: u32 = 64;
/// How long words may be wrong before the driver is disabled.
const WRONG_MS: u64 = 10;
/// How long the parts of the start take: looking at the sensor, raising the field, waiting for the
/// magnet.
const LOOK_MS: u64 = 10;
const RAISE_MS: u64 = 50;
const WAIT_MS: u64 = 50;
/// How much of an electrical turn the knob goes at the start, at least and at most (%).
const ALIGN_PERCENT: [u32; 2] = [85, 115];
/// How much of an electrical turn it goes at most in a field where its magnet is said to be, and at
/// least and at most where that moves on by a twelfth (%).
const STANDS_PERCENT: u32 = 4;
const FOLLOWS_PERCENT: [u32; 2] = [3, 13];

/// How long the watchdog waits while the flash is written: the slowest sector takes less than half.
const STORE_MS: u32 = 1000;
/// What of the pages of flash a record of alignments takes at most (words), and where flash begins.
const RECORD_WORDS: u32 = 64;
const FLASH: u32 = 0x1000_0000;

/// Whether what is found at a start is kept for the next one.
pub(super) fn is_stored(board: &Board) -> bool {
    board.knob.as_ref().is_some_and(|knob| knob.store.is_some())
}

/// A number for the parts that a stored alignment belongs to: another wiring or another motor has
/// another one. (FNV-1a, of words.)
fn parts_number(knob: &Knob) -> u32 {
    let shared = [knob.clock, knob.select, knob.enable, knob.pole_pairs];
    let shafts = knob.shafts.iter();
    let own = shafts.flat_map(|own| [[own.data].as_slice(), &own.phases].concat());
    let number = shared.into_iter().chain(own);
    number.fold(0x811c_9dc5, |hash, word| {
        (hash ^ word).wrapping_mul(0x0100_0193)
    })
}

/// The constants of what is stored.
fn of_store(knob: &Knob, board: &Board) -> Vec<(String, i64)> {
    let Some(at) = knob.store else {
        return Vec::new();
    };
    let watchdog = board.device("watchdog").unwrap_or_default();
    let all = [
        ("STORE_AT", at),
        ("STORE_OFFSET", at - FLASH),
        ("STORE_NUMBER", parts_number(knob)),
        ("STORE_WATCHDOG", STORE_MS * 1000),
        ("STORE_WORDS", 2 + 2 * knob.count()),
        ("SCRATCH", watchdog + 0xc),
    ];
    debug_assert!(3 + 2 * knob.count() <= RECORD_WORDS);
    let named = |(name, value): (&str, u32)| (name.to_string(), i64::from(value));
    all.map(named).to_vec()
}

/// Counts of the PWM from its middle to what phases reach.
fn reach(knob: &Knob) -> u32 {
    knob.period_cycles / 4 - KEPT
}

/// The nearest whole number of a fraction above 0.
fn divided(dividend: i128, divisor: i128) -> i128 {
    (dividend + divisor / 2) / divisor.max(1)
}

/// Factors of voltages.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Factors {
    gain: i128,
    lead: i128,
    back: i128,
    align: i128,
}

impl Factors {
    fn of(knob: &Knob, coil: &Coil, [ticks, seconds]: [u32; 2]) -> Result<Factors, FirmwareError> {
        let middle = i128::from(knob.period_cycles / 4);
        let most_uv = i128::from(knob.supply_mv) * 500 * i128::from(reach(knob)) / middle;
        let peak_uv = i128::from(coil.resistance_mohm) * i128::from(coil.peak_ma);
        if peak_uv > most_uv {
            return Err(FirmwareError::Coil(
                "its peak current asks for more than half of the supply: lower `motor.peak` (and \
                 `drive.full_scale`) or take a higher supply",
            ));
        }
        let gain = divided(peak_uv * VOLTAGE * FRACTION, most_uv << 15);
        let kept = i128::from(coil.kept);
        let lead = divided(gain * kept, (1 << 32) - kept);
        // A phase's voltage at a speed: two thirds of the torque constant, as energy says.
        let [turn, of_turn] = TURN_RAD;
        let constant_uv = 2 * i128::from(coil.torque_constant_un_m);
        let back = divided(
            constant_uv * turn * i128::from(ticks) * VOLTAGE * FRACTION,
            3 * of_turn * i128::from(seconds) * i128::from(STEPS) * SPEED * most_uv,
        );
        if [lead, back].iter().any(|factor| *factor >= 1 << 31) {
            return Err(FirmwareError::Coil(
                "its inductance over its resistance, or its torque constant, is too large",
            ));
        }
        let align = divided(i128::from(knob.align_mv) * 1000 * VOLTAGE, most_uv);
        Ok(Factors {
            gain,
            lead,
            back,
            align: align.min(VOLTAGE - 1),
        })
    }
}

/// The factors of voltages, where setup and board can be a knob.
fn checked(setup: &Setup, board: &Support, knob: &Knob) -> Result<Factors, FirmwareError> {
    let keys: u32 = setup.keys.iter().sum();
    if keys != knob.count() {
        return Err(FirmwareError::Knobs(keys, knob.count()));
    }
    if setup.tuning.is_some() {
        let why = "the sensor of a knob is not tuned on the board: it reads the angle as it is";
        return Err(FirmwareError::Tuning(why.into()));
    }
    let rate = setup.rate_hz.fraction();
    let [ticks, seconds] = rate.map(u64::from);
    if ticks * u64::from(knob.period_cycles) != u64::from(board.board.clock_hz) * seconds {
        return Err(FirmwareError::Period(knob.period_cycles, setup.rate_hz));
    }
    let coil = setup.coil.ok_or(FirmwareError::NoCoil)?;
    Factors::of(knob, &coil, rate)
}

/// The constants of the texts, where the board has a knob.
pub(super) fn constants(
    setup: &Setup,
    board: &Support,
) -> Result<Vec<(String, i64)>, FirmwareError> {
    let Some(knob) = &board.board.knob else {
        return Ok(Vec::new());
    };
    let factors = checked(setup, board, knob)?;
    let whole = |factor: i128| factor as i64;
    let half = knob.period_cycles / 2;
    let (rest, shafts) = (knob.period_cycles - 356, Slices::of(knob));
    let ticks_in = |ms: u64| setup.rate_hz.ticks_in(ms) as i64;
    let turned = |percent: u32| i64::from(STEPS * percent / 100 / knob.pole_pairs);
    let all = [
        ("KNOBS", knob.count().into()),
        ("PIN_CLOCK", knob.clock.into()),
        ("PIN_SELECT", knob.select.into()),
        ("PIN_ENABLE", knob.enable.into()),
        ("PIN_FAULT", knob.fault.into()),
        (
            "SLICES",
            shafts
                .iter()
                .fold(0, |all, own| all | 1 << own.pair | 1 << own.single),
        ),
        ("PWM_TOP", i64::from(half) - 1),
        ("PWM_MIDDLE", i64::from(half / 2)),
        // Between two frames: rounds of 16 cycles, and what is left of them.
        ("IDLE_ROUNDS", i64::from(rest / 16) - 1),
        ("IDLE_REST", i64::from(rest % 16)),
        (
            "FIRST_ROUNDS",
            i64::from((knob.period_cycles - knob.ahead_cycles - 8) / 16) - 1,
        ),
        ("SECOND", SECOND.into()),
        ("STEPS_MAX", STEPS_MAX.into()),
        ("AGE_WRONG", ticks_in(WRONG_MS)),
        ("LOOK", ticks_in(LOOK_MS)),
        ("RAISE", ticks_in(RAISE_MS)),
        ("WAIT", ticks_in(WAIT_MS)),
        ("GAIN0", whole(factors.gain)),
        ("LEAD0", whole(factors.lead)),
        ("BACK0", whole(factors.back)),
        ("ALIGN", whole(factors.align)),
        ("TURN0", 4 * i64::from(knob.pole_pairs)),
        ("TURNED_LOW", turned(ALIGN_PERCENT[0])),
        ("TURNED_HIGH", turned(ALIGN_PERCENT[1])),
        ("STANDS", turned(STANDS_PERCENT)),
        ("FOLLOWS_LOW", turned(FOLLOWS_PERCENT[0])),
        ("FOLLOWS_HIGH", turned(FOLLOWS_PERCENT[1])),
    ];
    let all = all.map(|(name, value)| (name.to_string(), value));
    Ok(all
        .into_iter()
        .chain((0..).zip(&shafts).flat_map(of_shaft))
        .chain(of_store(knob, board.board))
        .collect())
}

/// Slices of a knob's phases.
struct Slices {
    shaft: Shaft,
    pair: u32,
    single: u32,
    /// How far the third phase is shifted in its slice's compare values.
    shift: u32,
}

impl Slices {
    fn of(knob: &Knob) -> Vec<Slices> {
        let of_shaft = |shaft: &Shaft| {
            let [first, _, third] = shaft.phases;
            let [(pair, _), (single, is_second)] = [first, third].map(Knob::slice);
            Slices {
                shaft: *shaft,
                pair,
                single,
                shift: if is_second { 16 } else { 0 },
            }
        };
        knob.shafts.iter().map(of_shaft).collect()
    }
}

/// The constants of a knob, whose number, from the second one on, ends their names.
fn of_shaft((number, own): (u32, &Slices)) -> Vec<(String, i64)> {
    let end = match number {
        0 => String::new(),
        _ => format!("_{number}"),
    };
    let [first, second, third] = own.shaft.phases;
    let all = [
        ("PIN_DATA", own.shaft.data),
        ("PIN_PHASE0", first),
        ("PIN_PHASE1", second),
        ("PIN_PHASE2", third),
        ("SLICE_PAIR", own.pair),
        ("SLICE_SINGLE", own.single),
        ("SINGLE_SHIFT", own.shift),
    ];
    let named = |(name, value): (&str, u32)| (format!("{name}{end}"), i64::from(value));
    all.map(named).to_vec()
}

/// The sine of so many entries of a turn, rounded. The first quarter is turned to step by step;
/// the others are its mirrors, so that no sine is larger than the quarter's.
fn sine(entry: u32, amplitude: u32) -> i128 {
    let half = entry % (SINES / 2);
    let steps = half.min(SINES / 2 - half);
    let [mut cos, mut sin] = [1_i128 << 60, 0];
    for _ in 0..steps {
        let [c, s] = ROTATION;
        [cos, sin] = [(cos * c - sin * s) >> 60, (cos * s + sin * c) >> 60];
    }
    let rounded = (sin * i128::from(amplitude) + (1 << 59)) >> 60;
    if entry < SINES / 2 { rounded } else { -rounded }
}

/// Sines, the CRC's remainders and what each knob has of PIO and PWM, as assembly.
///
/// ```text
///   knob_pins    of each what its state machine is told of pins
///   knob_wires   of each the slice of two phases, that of the third one, and how far that is shifted
/// ```
pub(super) fn tables_as_assembly(knob: &Knob) -> String {
    let mut text = String::from(
        "        .section .rodata.knob, \"a\"\n        .balign 4\n        .global sines, remainders, knob_pins, knob_wires\nsines:\n",
    );
    for n in 0..SINES + SECOND {
        let _ = writeln!(
            text,
            "        .short  {}",
            sine(n % SINES, 32 * reach(knob))
        );
    }
    text.push_str("        .balign 4\nremainders:\n");
    for six in 0..64u32 {
        // X^6 + X + 1, the highest bit first.
        let remainder = (0..6).fold(six, |left, _| match left >> 5 & 1 {
            1 => left << 1 & 0x3f ^ 0b11,
            _ => left << 1,
        });
        let _ = writeln!(text, "        .byte   {remainder}");
    }
    text.push_str("        .balign 4\nknob_pins:\n");
    for shaft in &knob.shafts {
        let _ = writeln!(
            text,
            "        .word   1 << 29 | 1 << 26 | {} << 15 | PIN_CLOCK << 10 | PIN_SELECT << 5",
            shaft.data
        );
    }
    text.push_str("knob_wires:\n");
    for own in Slices::of(knob) {
        let _ = writeln!(
            text,
            "        .word   PWM + 20 * {}, PWM + 20 * {}, {}",
            own.pair, own.single, own.shift
        );
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    fn knob() -> Knob {
        Knob {
            clock: 2,
            select: 3,
            shafts: Vec::new(),
            enable: 9,
            fault: 10,
            period_cycles: 3400,
            ahead_cycles: 1000,
            supply_mv: 12_000,
            align_mv: 2000,
            pole_pairs: 7,
            store: None,
        }
    }

    /// 5 Ohm, 1 mH, ticks of 3400 cycles: e^-0.1133 of 2^32 is left.
    const COIL: Coil = Coil {
        resistance_mohm: 5000,
        kept: 3_834_774_404,
        peak_ma: 1000,
        torque_constant_un_m: 63_000,
    };
    const RATE: [u32; 2] = [750_000, 17];

    fn is_near(found: i128, wanted: i128, within: i128) {
        assert!((found - wanted).abs() <= within, "{found}, not {wanted}");
    }

    #[test]
    fn factors_make_the_current_of_a_word_within_a_tick() {
        let found = Factors::of(&knob(), &COIL, RATE).unwrap_or_else(|e| panic!("{e}"));
        // 5 V of 5.965 V, of 8192.
        is_near((found.gain << 15) / FRACTION, 6867, 1);
        // Held for a tick it makes (1 - kept) of its current, which is then that of the word.
        let jump = found.gain + found.lead;
        let left = (1 << 32) - i128::from(COIL.kept);
        is_near((jump * left) >> 32, found.gain, found.gain >> 16);
        // 42 mV s/rad at a step a tick, 16.9 rad/s: 0.7106 V of 5.965 V.
        is_near(found.back * SPEED * 1000 / FRACTION, 975_900, 200);
        // 2 V.
        is_near(found.align, 2747, 1);
    }

    #[test]
    fn a_motor_that_asks_for_too_much_is_refused() {
        let of = |coil: Coil| Factors::of(&knob(), &coil, RATE).is_ok();
        assert!(of(COIL));
        let hungry = Coil {
            peak_ma: 1200,
            ..COIL
        };
        // 10 mH: nearly nothing is lost in a tick.
        let slow = Coil {
            kept: 4_246_600_000,
            ..COIL
        };
        assert!(!of(hungry) && !of(slow));
    }

    #[test]
    fn sines_are_on_a_circle() {
        let all: Vec<i128> = (0..SINES).map(|n| sine(n, 27_040)).collect();
        assert_eq!(
            [all[0], all[256], all[512], all[768]],
            [0, 27_040, 0, -27_040]
        );
        // Half of the amplitude at a twelfth of a turn, between two entries.
        assert!(all[85] < 13_520 && all[86] > 13_520);
        for n in 0..1024 {
            let square = all[n].pow(2) + all[(n + 256) % 1024].pow(2);
            is_near(square, 27_040 * 27_040, 2 * 27_040);
        }
    }
}
