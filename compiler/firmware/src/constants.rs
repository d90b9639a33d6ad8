//! What the texts of the firmware are told: numbers of programs, a keyboard and a board.

use std::collections::BTreeMap;

use whippen_isa::Arch;
use whippen_isa::imm::thumb_shrink_imm;

use super::{FirmwareError, Motor, Passivity, Played, Segment, Setup, Support, distance, zoned};

/// What an access with write-back reaches.
pub(super) const RECORD_MAX: u32 = 252;

/// How many programs an image may have.
pub(super) const PROGRAMS_MAX: usize = 64;

/// Offsets in a core's block, in a key's guard, in a core's program, in what its reader knows of
/// it, in the table of the status; bits of faults.
const PLACES: &[(&str, i64)] = &[
    ("C_CODE", 0),
    ("C_STATE", 4),
    ("C_ROWS", 8),
    ("C_KEYS", 16),
    ("C_GAINS", 20),
    ("C_GUARDS", 24),
    ("C_TICK", 28),
    ("C_ALARM", 32),
    ("C_MISSED", 36),
    ("C_FAULTS", 40),
    ("C_FAULTY", 44),
    ("C_TURN", 48),
    ("C_FIRST", 52),
    ("C_ROW", 56),
    ("C_RAMP", 60),
    ("C_PROGRAM", 64),
    ("C_WANTED", 68),
    ("C_BEGUN", 72),
    ("G_HEAT", 0),
    ("G_CEILING", 4),
    ("G_WORD", 8),
    ("G_DRIVE", 10),
    ("G_SINCE", 12),
    ("P_CORE", 0),
    ("P_STATE", 4),
    ("P_INIT", 8),
    ("P_TICK", 12),
    ("P_BEGIN", 16),
    ("P_GAINS", 20),
    ("P_RECORDS", 24),
    ("P_END", 28),
    ("P_READER", 32),
    ("R_STATE", 0),
    ("R_EVENTS", 4),
    ("R_EVENT", 8),
    ("R_NOTE", 12),
    ("R_RELEASE", 16),
    ("R_SHIFT", 20),
    ("R_VELOCITIES", 24),
    ("R_MASK", 28),
    ("R_NEXT", 32),
    ("S_FAULTS", 8),
    ("FAULT_MISSED", 1),
    ("FAULT_RAIL", 2),
    ("FAULT_FROZEN", 4),
    ("FAULT_HOT", 8),
    ("FAULT_DEAD", 16),
    ("WATCHDOG_US", 10_000),
];

/// The gain of a key in its record.
const GAIN: u32 = 4;
/// Ticks between two turns of a key's service.
const TURNS: u64 = 16;
/// How long force takes to come back.
const RAMP_MS: u64 = 20;

/// What the texts are told of programs, a keyboard and a board.
///
/// # Errors
/// Programs, keys, records or motor are out of range.
pub fn constants(
    programs: &[Played],
    setup: &Setup,
    board: &Support,
) -> Result<BTreeMap<String, i64>, FirmwareError> {
    let Some(Played { cores, .. }) = programs.first().filter(|_| programs.len() <= PROGRAMS_MAX)
    else {
        return Err(FirmwareError::Programs(programs.len()));
    };
    let stacks = &board.board.stacks;
    if setup.keys.len() != stacks.len() {
        return Err(FirmwareError::Cores(setup.keys.len(), stacks.len()));
    }
    if let Some(keys) = setup.keys.iter().find(|keys| !(1..=255).contains(*keys)) {
        return Err(FirmwareError::Keys(*keys));
    }
    let layouts = programs
        .iter()
        .flat_map(|program| program.cores)
        .flatten()
        .map(|segment| &segment.layout);
    let record = layouts
        .map(|layout| layout.record(1) - layout.record(0))
        .max()
        .unwrap_or(0);
    if record > RECORD_MAX {
        return Err(FirmwareError::Record(record));
    }
    let gain = |segments: &Vec<Segment>| {
        segments
            .first()
            .and_then(|s| s.layout.gain(0))
            .unwrap_or(GAIN)
    };
    let rate = u64::from(setup.rate_hz);
    let heat = heat(&setup.motor, rate)?;
    let ticks = |ms: u64| ms * rate / 1000;
    let mut all: BTreeMap<String, i64> = PLACES
        .iter()
        .map(|(name, value)| (name.to_string(), *value))
        .collect();
    let mut put = |name: &str, value: u64| {
        all.insert(name.to_string(), value as i64);
    };
    put("CORES", stacks.len() as u64);
    for (core, (&keys, segments)) in setup.keys.iter().zip(*cores).enumerate() {
        put(&format!("KEYS{core}"), keys.into());
        put(&format!("DISTANCE{core}"), distance(keys).into());
        put(&format!("GAINS{core}"), gain(segments).into());
        put(&format!("STACK{core}"), stacks[core].into());
    }
    put("RECORD", record.into());
    put("GAIN", GAIN.into());
    put("ZONES", zoned(programs).into());
    put("FIRST_NOTE", setup.first_note.into());
    put("STEP", (65_536 * TURNS).div_ceil(ticks(RAMP_MS).max(TURNS)));
    put("RAMP", (ticks(RAMP_MS) + 3 * TURNS).min(0xffff));
    put("RATED2", heat.rated2);
    put("HEAT_SHIFT", heat.shift);
    put("HEAT_MAX", heat.max);
    put("CEILING_HOT", rounded(2 * setup.motor.rated).into());
    put("MOVED", rounded(setup.motor.newton).into());
    put("AGE_RAIL", ticks(10).min(0xffff));
    put("AGE_FROZEN", ticks(100).min(0xffff));
    let passivity = passivity(setup, board)?;
    put("PAST", passivity.past.into());
    put("DAMPING", passivity.damping.into());
    put("CREDIT", passivity.credit.into());
    // A gain is less than 1 when less than a quarter to a half of the credit is left.
    put("CREDIT_SHIFT", u64::from(passivity.credit.ilog2() - 17));
    put("MID_LOW", setup.mid_travel[0].into());
    put("MID_HIGH", setup.mid_travel[1].into());
    put("RATE", rate);
    all.extend(board.numbers());
    Ok(all)
}

/// What is observed of the keys' energy: nothing where there is no past.
fn passivity(setup: &Setup, board: &Support) -> Result<Passivity, FirmwareError> {
    let off = Passivity {
        credit: 1 << 18,
        past: 0,
        damping: 0,
    };
    let Some(wanted) = setup.passivity else {
        return Ok(off);
    };
    let ranges = [
        (wanted.credit, 1 << 18, 1 << 30),
        (wanted.past, 1, 16),
        (wanted.damping, 0, 8191),
    ];
    let fits = ranges
        .into_iter()
        .all(|(value, low, high)| (low..=high).contains(&value));
    // The frame of an ARMv6-M has none: what was asked for must not be left out in silence.
    match fits {
        _ if board.board.arch == Arch::V6M => Err(FirmwareError::PassivityCore),
        true => Ok(wanted),
        false => Err(FirmwareError::Passivity),
    }
}

/// What the motor's limits are in the units of the service.
struct Heat {
    rated2: u64,
    shift: u64,
    max: u64,
}

fn heat(motor: &Motor, rate: u64) -> Result<Heat, FirmwareError> {
    if !(1..=32_767).contains(&motor.rated) || !(1..=10_000).contains(&motor.peak_ms) {
        return Err(FirmwareError::Motor);
    }
    let rated2 = u64::from(motor.rated).pow(2);
    let turns = u64::from(motor.peak_ms) * rate / 1000 / TURNS;
    let whole = (32_767_u64.pow(2)).saturating_sub(rated2).max(1) * turns.max(1);
    // The sum is kept below 2^30.
    let shift = (0..31)
        .find(|shift| whole >> shift < 1 << 30)
        .unwrap_or(31)
        .max(1);
    Ok(Heat {
        rated2,
        shift,
        max: (whole >> shift).max(1),
    })
}

/// The next number below that an instruction can hold.
fn rounded(number: u32) -> u32 {
    (1..=number)
        .rev()
        .find(|n| thumb_shrink_imm(*n).is_some())
        .unwrap_or(1)
}
