//! Columns of converters on the pins of an emulated chip, with amplifiers, coils and keys, as a
//! board file with `[columns]` and a device file say, and fingers that press.
//!
//! ```text
//!   --motion--> finger --spring--> key <--coil <-- amplifier <-- DAC <--pins-- chip
//!                                   '--> sensor --> ADC --pins--> chip      `--> --out: a row every ten periods
//! ```

use std::ffi::OsStr;
use std::fmt::Write;

use whippen_compiler::board::{self, COLUMN_KEYS};
use whippen_emulator::elf::Elf;
use whippen_emulator::{
    Column, ColumnErrors, ColumnKeyParts, ColumnKeys, ColumnParts, ColumnPins, Columns,
    ColumnsPins, DeviceId, Finger, Machine,
};
use whippen_runtime::device::Device;

use super::bench::{FINGER, key_parts, unknown_key};
use super::outside::PartArgs;
use super::rows::Rows;
use crate::device;
use crate::exit::Failure;

/// How long an amplifier takes to follow (s): 8 kHz, which no file tells.
const AMPLIFIER_LAG_S: f64 = 20e-6;
/// Cycles from an edge of the clock to the ADC's data: 13 ns.
const DATA_DELAY_CYCLES: u64 = 2;
/// No force.
const MID_SCALE: u16 = 0x8000;

/// Columns on the pins.
pub struct WiredColumns {
    id: DeviceId,
    /// The rows of its table, and of its fingers.
    pub rows: Rows,
    /// The keys that are pressed.
    pressed: Vec<usize>,
    /// What is written at the end, if it is wanted.
    table: Option<String>,
}

impl WiredColumns {
    /// Wires them.
    ///
    /// # Errors
    /// The device says no key with a coil, or the motion no motion; a key is pressed that is not
    /// there.
    pub fn connect(
        args: &PartArgs,
        machine: &mut Machine,
        elf: &Elf,
        columns: &board::Columns,
    ) -> Result<WiredColumns, Failure> {
        let named = args.device.as_deref();
        let device = device::named(named.unwrap_or(OsStr::new("column_coil")));
        let device = device.map_err(Failure::Usage)?;
        let clock_hz = f64::from(machine.board().clock_hz);
        let parts = parts(&device, clock_hz, columns);
        let parts = parts.ok_or_else(|| Failure::Usage(unknown_key(&device)))?;
        let keys = columns.keys() as usize;
        if let Some(key) = args.pressed.iter().find(|key| **key >= keys) {
            let what = format!("--pressed {key}: the columns have keys 0 to {}", keys - 1);
            return Err(Failure::Usage(what));
        }
        let motion = args.motion.as_deref().map(|path| (path, false));
        let rows = Rows::new(machine, elf, columns.period_cycles, motion)?;
        let table = args.out.is_some().then(|| {
            let columns = (0..keys).map(|key| format!(",x{key}_mm,current{key}_a"));
            format!("t_s{},enabled\n", columns.collect::<String>())
        });
        let id = wire(machine, columns);
        let cycle = machine.cycle(0);
        for column in 0..columns.columns.len() {
            let all = machine.bus.device_mut::<Columns>(id);
            if let Some(column) = all.and_then(|all| all.column_mut(column)) {
                column.keys = Some(ColumnKeys::new(parts, cycle));
            }
        }
        Ok(WiredColumns {
            id,
            rows,
            pressed: match args.pressed.is_empty() {
                true => (0..keys).collect(),
                false => args.pressed.clone(),
            },
            table,
        })
    }

    /// A row; then the fingers go on.
    pub fn pass(&mut self, machine: &mut Machine) {
        let finger = self.rows.hand(machine).map(|(place_m, _)| Finger {
            force_n: 0.0,
            stiffness: FINGER[0],
            damping: FINGER[1],
            place_m,
        });
        let Some(all) = machine.bus.device_mut::<Columns>(self.id) else {
            return;
        };
        if let Some(table) = &mut self.table {
            let _ = write!(table, "{:.6}", self.rows.time_s());
            for keys in all.columns().iter().flat_map(|own| &own.keys) {
                for key in &keys.keys {
                    let _ = write!(table, ",{:.5},{:.4}", 1e3 * key.place_m(), key.current_a());
                }
            }
            let _ = writeln!(table, ",{}", u8::from(all.is_enabled()));
        }
        for key in &self.pressed {
            let column = all.column_mut(key / COLUMN_KEYS as usize);
            let keys = column.and_then(|column| column.keys.as_mut());
            if let (Some(finger), Some(keys)) = (finger, keys) {
                keys.keys[key % COLUMN_KEYS as usize].finger = finger;
            }
        }
        self.rows.pass();
    }

    /// The table, if it is wanted.
    pub fn table(&self) -> Option<&str> {
        self.table.as_deref()
    }

    /// In words: how they stand.
    pub fn told(&self, machine: &Machine) -> String {
        let Some(all) = machine.bus.device::<Columns>(self.id) else {
            return String::new();
        };
        let keys = all.columns().iter().flat_map(|own| &own.keys);
        let keys = keys.flat_map(|own| &own.keys);
        let places: Vec<String> = keys
            .map(|key| format!("{:.2}", 1e3 * key.place_m()))
            .collect();
        let enabled = match all.is_enabled() {
            true => "enabled",
            false => "disabled",
        };
        let places = places.join(" ");
        format!(
            "keys at {places} mm, amplifiers {enabled}{}",
            forbidden(all)
        )
    }
}

/// What the parts' documents forbid and was done all the same.
fn forbidden(all: &Columns) -> String {
    let errors = all.errors();
    let refused = |column: &Column| column.refused_and_short().into_iter().sum::<u32>();
    let refused: u32 = all.columns().iter().map(refused).sum();
    match errors == ColumnErrors::default() && refused == 0 {
        true => String::new(),
        false => format!(
            "; against the parts' documents: {} frames too soon, {} times the clock, {} results too early, {refused} \
             words that a DAC did not take",
            errors.hurried, errors.clock, errors.early
        ),
    }
}

/// Wires converters without keys to the pins that a board names.
fn wire(machine: &mut Machine, columns: &board::Columns) -> DeviceId {
    let column = |own: &board::ColumnWires| ColumnPins {
        to_dac: own.to_dac,
        from_adc: own.from_adc,
    };
    let pins = ColumnsPins {
        clock: columns.clock,
        select: columns.select,
        command: columns.command,
        enable: Some(columns.enable),
        columns: columns.columns.iter().map(column).collect(),
    };
    let parts = ColumnParts {
        clock_hz: machine.board().clock_hz.into(),
        data_delay_cycles: DATA_DELAY_CYCLES,
        resets_to: MID_SCALE,
        loads_at_once: true,
    };
    Columns::attach(&mut machine.bus, pins, parts)
}

/// The parts of keys, of a device that says all of them.
fn parts(device: &Device, clock_hz: f64, columns: &board::Columns) -> Option<ColumnKeyParts> {
    let key = key_parts(device, clock_hz)?;
    let peak_a = device.motor?.peak_a;
    let [low, high] = columns.range.ends_mv.map(|mv| f64::from(mv) / 1e3);
    Some(ColumnKeyParts {
        key,
        full_a: if columns.pulls_down { -peak_a } else { peak_a },
        lag_s: AMPLIFIER_LAG_S,
        sensed_v: [low, high],
    })
}
