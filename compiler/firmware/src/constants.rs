//! Constants of the firmware's texts: numbers of programs, a keyboard and a board.

use std::collections::BTreeMap;
use whippen_rate::Rate;

use whippen_arm::thumb::Built;
use whippen_isa::Arch;
use whippen_isa::imm::thumb_shrink_imm;
use whippen_kernel::FULL_SCALE;

use super::code::{CoreCode, ProgramCode, begins_later, is_latched, is_split};
use super::emptying::empties;
use super::image::has_helper;
use super::offsets::assembly_constants;
use super::ports::Guards;
use super::sound::channels;
use super::{
    FirmwareError, Motor, Passivity, Setup, Support, bench, columns, drive_offset_bytes, i2s, knob,
};

/// What the offset of a load reaches.
pub(super) const RECORD_MAX: u32 = 4092;

/// How many programs an image may have.
pub(super) const PROGRAMS_MAX: usize = 64;

/// How many messages wait to be passed on, at most: a power of two.
const PASSED_MESSAGES: u64 = 64;
/// Number and kind of a control change 88, as the first two bytes have them above the channel.
const PREFIX: u64 = 88 << 4 | 0xb;

/// How often four words of lines are emptied in a tick.
const EMPTY_ROUNDS: u64 = 32;

/// The gain of a key in its record.
pub(super) const GAIN: u32 = 4;
/// Ticks between two turns of a key's service.
const TURNS: u64 = 16;
/// How long force takes to come back.
const RAMP_MS: u64 = 20;
/// How long a sensor's word stays at a rail, and in mid-travel, before it is judged.
pub(super) const RAIL_MS: u64 = 10;
pub(super) const FROZEN_MS: u64 = 100;

/// The constants that programs, a keyboard and a board give the texts.
///
/// # Errors
/// Programs, keys, records or motor are out of range.
pub fn constants(
    programs: &[ProgramCode],
    setup: &Setup,
    board: &Support,
) -> Result<BTreeMap<String, i64>, FirmwareError> {
    let Some(ProgramCode { cores, .. }) =
        programs.first().filter(|_| programs.len() <= PROGRAMS_MAX)
    else {
        return Err(FirmwareError::Programs(programs.len()));
    };
    let stacks = &board.board.stacks;
    let cores_playing = match setup.guards() {
        Guards::Keys => stacks.len(),
        Guards::Ports => 1,
    };
    if setup.keys.len() != cores_playing {
        return Err(FirmwareError::Cores(setup.keys.len(), cores_playing));
    }
    if let Some(keys) = setup.keys.iter().find(|keys| !(1..=255).contains(*keys)) {
        return Err(FirmwareError::Keys(*keys));
    }
    let bytes = |built: &Built| built.layout.record(1) - built.layout.record(0);
    let all = programs.iter().flat_map(ProgramCode::built);
    let largest = all.map(bytes).max().unwrap_or(0);
    if largest > RECORD_MAX {
        return Err(FirmwareError::Record(largest));
    }
    let zones = programs.iter().flat_map(ProgramCode::zones);
    let record = zones.map(|zone| bytes(&zone.built)).max().unwrap_or(0);
    let gain = |core: &CoreCode| {
        let first = core.zones.first();
        first.and_then(|zone| zone.layout().gain(0)).unwrap_or(GAIN)
    };
    let mut all = assembly_constants();
    all.extend(guard_constants(setup, board.board.arch)?);
    let mut put = |name: &str, value: u64| {
        all.insert(name.to_string(), value as i64);
    };
    put("CORES", cores_playing as u64);
    let helps = has_helper(programs);
    put("HELPER", helps.into());
    if helps {
        put("STACK1", stacks[1].into());
    }
    for (core, (&keys, code)) in setup.keys.iter().zip(cores).enumerate() {
        put(&format!("KEYS{core}"), keys.into());
        let words = setup.words_of(keys);
        put(&format!("WORDS{core}"), words.into());
        put(&format!("GUARDS{core}"), setup.guards_of(keys).into());
        put(&format!("DISTANCE{core}"), drive_offset_bytes(words).into());
        put(&format!("GAINS{core}"), gain(code).into());
        put(&format!("STACK{core}"), stacks[core].into());
    }
    put("RECORD", record.into());
    put("GAIN", GAIN.into());
    put("ZONES", is_split(programs).into());
    put("LATCH", is_latched(programs).into());
    put("SOUND", channels(programs).into());
    let sums = channels(programs) > 0 && !programs.iter().any(|program| program.cut_has_sound());
    put("SUMS", sums.into());
    put("EMPTIES", empties(programs, setup).into());
    put("EMPTY_ROUNDS", EMPTY_ROUNDS);
    put("BEGINS", begins_later(programs, setup).into());
    put("FULL_SCALE", FULL_SCALE as u64);
    put("PROGRAMS", programs.len() as u64);
    put("FIRST_NOTE", setup.first_note.into());
    let ports = match setup.guards() {
        Guards::Keys => 0,
        Guards::Ports => setup.ports.len() as u64,
    };
    put("PORTS", ports);
    put("SMALL", (board.board.arch == Arch::V6M).into());
    put("MONITOR", setup.monitor.is_some().into());
    put("FINE", setup.fine_velocity.into());
    put("PASS", setup.passes_midi.into());
    put("PASSED", PASSED_MESSAGES);
    put("PREFIX", PREFIX);
    put("TUNING", setup.tuning.is_some().into());
    if let Some(tuning) = &setup.tuning {
        tuning.check(setup)?;
        put("TABLE_SPAN", tuning.span().into());
        put("TABLE_FALLS", tuning.falls().into());
        put("TABLE_REST", tuning.rest_scaled() as u64);
    }
    let [ticks, seconds] = setup.rate_hz.fraction();
    put("RATE", ticks.into());
    put("RATE_SECONDS", seconds.into());
    all.extend(board.numbers());
    if let Some(monitor) = &setup.monitor {
        all.extend(monitor.serial_constants(board.board)?);
    }
    all.insert("STORE".into(), knob::is_stored(board.board).into());
    all.extend(knob::constants(setup, board)?);
    all.extend(bench::constants(setup, board)?);
    all.extend(columns::constants(setup, board)?);
    all.extend(i2s::constants(board.board));
    Ok(all)
}

/// What guards keys, or ports: how gains move, what a motor stands, when a sensor is judged, what
/// is observed of energy. With these the firmware's texts guard, and so does what is linked
/// ([`safety`](super::safety)).
pub(super) fn guard_constants(
    setup: &Setup,
    arch: Arch,
) -> Result<BTreeMap<String, i64>, FirmwareError> {
    let ticks = |ms: u64| setup.rate_hz.ticks_in(ms);
    let mut all = BTreeMap::new();
    let mut put = |name: &str, value: u64| {
        all.insert(name.to_string(), value as i64);
    };
    let turns = match setup.guards() {
        Guards::Keys => TURNS,
        // One gain is for all ports, and moves in every tick.
        Guards::Ports => 1,
    };
    put("STEP", (65_536 * turns).div_ceil(ticks(RAMP_MS).max(turns)));
    put("RAMP", (ticks(RAMP_MS) + 3 * TURNS).min(0xffff));
    if let Some(motor) = setup.motor_of_keys() {
        let heat = Heat::of(&motor, setup.rate_hz, TURNS)?;
        put("RATED2", heat.rated2);
        put("HEAT_SHIFT", heat.shift);
        put("HEAT_MAX", heat.max);
        put("CEILING_HOT", rounded(2 * motor.rated).into());
        put("MOVED", rounded(motor.newton).into());
        // Twice as much is a word of the texts.
        put("AGE_RAIL", ticks(RAIL_MS).clamp(1, 0x7fff));
        put("AGE_FROZEN", ticks(FROZEN_MS).clamp(1, 0x7fff));
        let [low, high] = setup.ports[0].mid_travel;
        put("MID_LOW", low.into());
        put("MID_HIGH", high.into());
    }
    let passivity = passivity(setup, arch)?;
    put("PAST", passivity.past.into());
    put("DAMPING", passivity.damping.into());
    put("CREDIT", passivity.credit.into());
    // A gain is less than 1 when less than a quarter to a half of the credit is left.
    put("CREDIT_SHIFT", u64::from(passivity.credit.ilog2() - 17));
    Ok(all)
}

/// What is observed of the keys' energy: nothing where there is no past.
fn passivity(setup: &Setup, arch: Arch) -> Result<Passivity, FirmwareError> {
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
        _ if arch == Arch::V6M => Err(FirmwareError::PassivityCore),
        true => Ok(wanted),
        false => Err(FirmwareError::Passivity(wanted)),
    }
}

/// What the motor's limits are in the units of the service.
pub(super) struct Heat {
    pub rated2: u64,
    pub shift: u64,
    pub max: u64,
}

impl Heat {
    /// What never gets warm.
    pub const NONE: Heat = Heat {
        rated2: 0,
        shift: 1,
        max: 1,
    };

    /// Of a motor whose turn comes once in so many ticks.
    pub fn of(motor: &Motor, rate_hz: Rate, between: u64) -> Result<Heat, FirmwareError> {
        if !(1..=32_767).contains(&motor.rated) || !(1..=10_000).contains(&motor.peak_ms) {
            return Err(FirmwareError::Motor(*motor));
        }
        let rated2 = u64::from(motor.rated).pow(2);
        let turns = rate_hz.ticks_in(motor.peak_ms.into()) / between;
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
}

/// The next number below that an instruction can hold.
fn rounded(number: u32) -> u32 {
    (1..=number)
        .rev()
        .find(|n| thumb_shrink_imm(*n).is_some())
        .unwrap_or(1)
}
