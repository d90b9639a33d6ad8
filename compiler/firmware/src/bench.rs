//! Constants and tables of a bench's firmware: when slices of PWM wrap, and from drive words to
//! voltages of bridges.
//!
//! ```text
//!   voltage = gain * word + lead * (word - current)        in 1/32768 of the supply, as far as there is
//!   current = word - left * (voltage that is missing)      in drive words, at the end of the tick
//!
//!   0 ..          pace: eight wraps, an eighth of a period apart           .. period
//!                 last of them --conversion--> tick --ahead--> carriers
//! ```
//!
//! The coil is held for a tick, as that of a knob is, and the lead is the same; but a voltage that
//! the supply cannot give is given in the ticks that follow. What the key's motion induces is not
//! made up for: it brakes the key. Not here: the texts (`bench.s`,
//! `bench_start.s`).

use std::fmt::Write;

use whippen_board::{Bench, CONVERSION_CYCLES, CONVERSIONS, PACE_SLICE, TICK_SLICE};

use super::{Coil, FirmwareError, Setup, Support};

/// The ring of words has 2^13 bytes, which are 512 ticks: more than the watchdog waits, so ticks
/// are counted through whatever is missed.
const RING_BITS: u32 = 13;
/// Both cores before the DMA at memory (RP2350 datasheet 12.15.4): bits 0 and 4.
const BUS_PRIORITIES: u32 = 0x11;
/// How long words may be missing before the bridges are put to sleep.
const WRONG_MS: u64 = 10;
/// How long words are looked at before the bridges wake, and after.
const LOOK_MS: u64 = 100;
const SETTLE_MS: u64 = 5;

/// The nearest whole number of a fraction above 0.
fn divided(dividend: i128, divisor: i128) -> i128 {
    (dividend + divisor / 2) / divisor.max(1)
}

/// Voltages of voltages.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Voltages {
    /// Voltage of a word, and of its distance from the current, in 1/65536 of a step of 32768 for
    /// the supply.
    gain: i128,
    lead: i128,
    /// Current of a voltage that is missing for a tick, in 1/65536 of a drive word.
    left: i128,
}

/// The factors of a coil.
fn factors(bench: &Bench, coil: &Coil) -> Result<Voltages, FirmwareError> {
    let peak_uv = i128::from(coil.resistance_mohm) * i128::from(coil.peak_ma);
    let supply_uv = i128::from(bench.supply_mv) * 1000;
    if peak_uv > supply_uv {
        return Err(FirmwareError::Coil(
            "its peak current asks for more than the supply: lower `motor.peak` (and \
             `drive.full_scale`) or take a higher supply",
        ));
    }
    let gain = divided(peak_uv << 16, supply_uv);
    let kept = i128::from(coil.kept);
    let follows = (1 << 32) - kept;
    let lead = divided(gain * kept, follows);
    let left = divided(follows, gain.max(1));
    if lead >= 1 << 31 || left >= 1 << 15 {
        return Err(FirmwareError::Coil(
            "its inductance over its resistance is too large, or its peak current asks for too \
             little of the supply",
        ));
    }
    Ok(Voltages { gain, lead, left })
}

/// The factors of voltages, where setup and board can be a bench.
fn checked(setup: &Setup, board: &Support, bench: &Bench) -> Result<Voltages, FirmwareError> {
    let keys: u32 = setup.keys.iter().sum();
    if keys > bench.keys() {
        return Err(FirmwareError::BenchKeys(keys, bench.keys()));
    }
    if setup.ports.len() != 1 {
        return Err(FirmwareError::BenchPorts);
    }
    let [ticks, seconds] = setup.rate_hz.fraction().map(u64::from);
    if ticks * u64::from(bench.period_cycles) != u64::from(board.board.clock_hz) * seconds {
        return Err(FirmwareError::Period(bench.period_cycles, setup.rate_hz));
    }
    let coil = setup.coil.ok_or(FirmwareError::NoCoil)?;
    factors(bench, &coil)
}

/// When a slice wraps for the first time after all are started, and which conversion that begins.
struct Pace {
    counter: u32,
    conversion: u32,
}

impl Pace {
    /// So that the last conversion is over when the slice of ticks wraps.
    fn of(bench: &Bench) -> Pace {
        let eighth = bench.period_cycles / CONVERSIONS;
        let last = bench.period_cycles - bench.ahead_cycles - CONVERSION_CYCLES;
        // Wraps are at `first` and every eighth from there: the one at `last` begins conversion 7.
        let first = match last % eighth {
            0 => eighth,
            first => first,
        };
        // Where `last` itself is 0, the one a period later.
        let before = (last + bench.period_cycles - first) / eighth;
        Pace {
            counter: eighth - first,
            conversion: (CONVERSIONS - 1 + CONVERSIONS - before % CONVERSIONS) % CONVERSIONS,
        }
    }
}

/// The constants of the texts, where the board has a bench.
pub(super) fn constants(
    setup: &Setup,
    board: &Support,
) -> Result<Vec<(String, i64)>, FirmwareError> {
    let Some(bench) = &board.board.bench else {
        return Ok(Vec::new());
    };
    let factors = checked(setup, board, bench)?;
    let keys: u32 = setup.keys.iter().sum();
    let ticks_in = |ms: u64| setup.rate_hz.ticks_in(ms) as i64;
    let first = Bench::first_conversion(keys);
    let carriers = bench.bridges.iter().take(keys as usize);
    let slices: Vec<u32> = carriers.map(|pin| Bench::slice(*pin)).collect();
    let mask = slices.iter().fold(0_i64, |mask, slice| mask | 1 << slice);
    let mut all: Vec<(String, i64)> = [
        ("PIN_SLEEP", bench.sleep.into()),
        ("PIN_FAULT", bench.fault.into()),
        ("PERIOD", bench.period_cycles.into()),
        ("TICK_SLICE", TICK_SLICE.into()),
        ("PACE_SLICE", PACE_SLICE.into()),
        ("SLICES_MASK", mask | 1 << TICK_SLICE | 1 << PACE_SLICE),
        ("RING_BITS", RING_BITS.into()),
        ("BUS_PRIORITIES", BUS_PRIORITIES.into()),
        ("FIRST_CONVERSION", first.into()),
        ("CONVERSION_AT_START", Pace::of(bench).conversion.into()),
        ("AGE_WRONG", ticks_in(WRONG_MS)),
        ("LOOK", ticks_in(LOOK_MS)),
        ("SETTLE", ticks_in(SETTLE_MS)),
        ("GAIN0", factors.gain as i64),
        ("LEAD0", factors.lead as i64),
        ("LEFT0", factors.left as i64),
    ]
    .map(|(name, value)| (name.to_string(), value))
    .into();
    for conversion in 0..CONVERSIONS {
        // What comes before and behind the keys' is converted for nobody.
        let key = conversion.saturating_sub(first).min(keys.max(1) - 1);
        let input = Bench::input(bench.sensors[key as usize]);
        all.push((format!("INPUT_{conversion}"), input.into()));
        let slice = slices.get(conversion as usize).copied();
        all.push((format!("SLICE_{conversion}"), slice.unwrap_or(0).into()));
    }
    Ok(all)
}

/// Where slices begin, and what pins are, as assembly.
pub(super) fn tables_as_assembly(bench: &Bench, keys: u32) -> String {
    let period = bench.period_cycles;
    let mut text = String::from(
        "        .section .text.start, \"ax\"\n        .balign 4\n        .global slices, slices_end, pins, pins_end\nslices:\n",
    );
    let mut slice = |number: u32, counter: u32, top: u32, compare: u32| {
        let _ = writeln!(
            text,
            "        .word   PWM + 20 * {number}, {counter}, {top}, {compare}"
        );
    };
    slice(TICK_SLICE, bench.ahead_cycles % period, period - 1, 0);
    let pace = Pace::of(bench);
    slice(PACE_SLICE, pace.counter, period / CONVERSIONS - 1, 0);
    let keys = keys as usize;
    for pin in bench.bridges.iter().take(keys) {
        slice(Bench::slice(*pin), 0, period - 1, period << 16 | period);
    }
    text.push_str("slices_end:\npins:\n");
    // Outputs are not pulled but to ground; sensors have neither input nor output.
    let mut pins = vec![(bench.sleep, 0x56, 5), (bench.fault, 0x5a, 5)];
    let bridges = bench.bridges.iter().take(keys);
    pins.extend(bridges.flat_map(|pin| [(*pin, 0x56, 4), (pin + 1, 0x56, 4)]));
    pins.extend(bench.sensors.iter().take(keys).map(|pin| (*pin, 0x80, 31)));
    for (pin, pad, function) in pins {
        let _ = writeln!(text, "        .byte   {pin}, {pad}, {function}, 0");
    }
    text.push_str("pins_end:\n");
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    fn bench(ahead_cycles: u32) -> Bench {
        Bench {
            sensors: vec![40],
            bridges: vec![16],
            sleep: 8,
            fault: 9,
            psram: None,
            period_cycles: 3400,
            ahead_cycles,
            supply_mv: 12_000,
        }
    }

    #[test]
    fn the_last_conversion_ends_with_the_wrap_of_the_ticks() {
        for ahead in [16, 200, 425, 935, 1360, 1800, 2635, 3060] {
            let bench = bench(ahead);
            let pace = Pace::of(&bench);
            // Ticks are `ahead` before each period's end; go through two periods of wraps.
            let mut conversion = pace.conversion;
            let mut wrap = 425 - pace.counter;
            let mut ends = Vec::new();
            while wrap <= 2 * 3400 {
                if conversion == 7 {
                    ends.push((wrap + CONVERSION_CYCLES + ahead) % 3400);
                }
                conversion = (conversion + 1) % 8;
                wrap += 425;
            }
            assert_eq!(ends, [0, 0], "{ahead}");
        }
    }

    #[test]
    fn a_word_of_the_peak_current_is_its_voltage() {
        let coil = Coil {
            resistance_mohm: 4000,
            kept: 3_922_000_000,
            peak_ma: 2000,
            torque_constant_un_m: 7000,
        };
        let Voltages { gain, lead, left } =
            factors(&bench(1800), &coil).unwrap_or_else(|e| panic!("{e}"));
        // 8 V of 12 V; a change is there at the end of a tick.
        assert_eq!(gain, (65_536 * 8 + 6) / 12);
        let made = ((gain + lead) * ((1 << 32) - i128::from(coil.kept))) >> 32;
        assert!((made - gain).abs() <= 1, "{made}");
        // 12 V for a tick are 3 A * (1 - 0.9132) of 2 A for 32768.
        let all = (32_768 * left) >> 16;
        assert!((all - 4269).abs() <= 2, "{all}");
        let hungry = Coil {
            peak_ma: 3001,
            ..coil
        };
        assert!(factors(&bench(1800), &hungry).is_err());
    }
}
