//! A bench of keys on the pins of an emulated chip: sensors, bridges, coils and keys, as a board
//! file with `[bench]` and a device file say, and fingers that press.
//!
//! ```text
//!   --motion--> finger --spring--> key <--coil <-- bridge <--pins-- chip
//!                                   '--> sensor --pins--> chip          `--> --out: a row every ten periods
//! ```

use std::ffi::OsStr;
use std::fmt::Write;

use whippen_compiler::board::Bench;
use whippen_compiler::model::Moves;
use whippen_emulator::elf::Elf;
use whippen_emulator::{BenchPins, DeviceId, Finger, KeyBench, KeyParts, KeyPins, Machine};
use whippen_runtime::device::Device;

use super::outside::PartArgs;
use super::rows::Rows;
use crate::device;
use crate::exit::Failure;

/// A finger's spring (N/m) and damper (N*s/m).
pub const FINGER: [f64; 2] = [500.0, 4.0];
/// The current at which a bridge turns itself off: of the class of a DRV8874, which no file tells.
const TRIP_A: f64 = 3.5;

/// A bench on the pins.
pub struct WiredBench {
    id: DeviceId,
    /// The rows of its table, and of its fingers.
    pub rows: Rows,
    /// The keys that are pressed.
    pressed: Vec<usize>,
    /// What is written at the end, if it is wanted.
    table: Option<String>,
}

impl WiredBench {
    /// Wires it.
    ///
    /// # Errors
    /// The device says no key with a coil, or the motion no motion; a key is pressed that is not
    /// there.
    pub fn connect(
        args: &PartArgs,
        machine: &mut Machine,
        elf: &Elf,
        bench: &Bench,
    ) -> Result<WiredBench, Failure> {
        let named = args.device.as_deref();
        let device = device::named(named.unwrap_or(OsStr::new("voice_coil")));
        let device = device.map_err(Failure::Usage)?;
        let clock_hz = f64::from(machine.board().clock_hz);
        let parts = bridge_parts(&device, clock_hz, f64::from(bench.supply_mv) / 1e3)
            .ok_or_else(|| Failure::Usage(unknown_key(&device)))?;
        let keys = bench.sensors.len();
        if let Some(key) = args.pressed.iter().find(|key| **key >= keys) {
            let last = keys - 1;
            let what = format!("--pressed {key}: the bench has keys 0 to {last}");
            return Err(Failure::Usage(what));
        }
        let motion = args.motion.as_deref().map(|path| (path, false));
        let rows = Rows::new(machine, elf, bench.period_cycles, motion)?;
        let table = args.out.is_some().then(|| {
            let columns = (0..keys).map(|key| format!(",x{key}_mm,current{key}_a"));
            format!("t_s{},awake\n", columns.collect::<String>())
        });
        let pins = bench.sensors.iter().zip(&bench.bridges);
        let pins = BenchPins {
            keys: pins
                .map(|(sensor, bridge)| KeyPins {
                    sensor: *sensor,
                    bridge: *bridge,
                })
                .collect(),
            sleep: bench.sleep,
            fault: bench.fault,
        };
        Ok(WiredBench {
            id: KeyBench::attach(&mut machine.bus, pins, parts),
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
        let Some(bench) = machine.bus.device_mut::<KeyBench>(self.id) else {
            return;
        };
        if let Some(table) = &mut self.table {
            let _ = write!(table, "{:.6}", self.rows.time_s());
            for key in bench.keys() {
                let _ = write!(table, ",{:.5},{:.4}", 1e3 * key.place_m(), key.current_a());
            }
            let _ = writeln!(table, ",{}", u8::from(bench.is_awake()));
        }
        for key in &self.pressed {
            if let (Some(finger), Some(key)) = (finger, bench.key_mut(*key)) {
                key.finger = finger;
            }
        }
        self.rows.pass();
    }

    /// The table, if it is wanted.
    pub fn table(&self) -> Option<&str> {
        self.table.as_deref()
    }

    /// In words: how it stands.
    pub fn told(&self, machine: &Machine) -> String {
        let Some(bench) = machine.bus.device::<KeyBench>(self.id) else {
            return String::new();
        };
        let places = bench
            .keys()
            .iter()
            .map(|key| format!("{:.2}", 1e3 * key.place_m()));
        let places: Vec<String> = places.collect();
        let awake = match bench.is_awake() {
            true => "awake",
            false => "asleep",
        };
        format!("keys at {} mm, bridges {awake}", places.join(" "))
    }
}

/// What is told of a device that does not say enough.
pub fn unknown_key(device: &Device) -> String {
    format!(
        "the device `{}` does not say what a key with a coil is: it moves along, and has `[motor]` with `arm`, \
         `[mechanics]` with stops, and on a bridge `drive.resistance` and `drive.inductance`",
        device.name
    )
}

/// The parts of a key on a bridge, of a device that says all of them.
fn bridge_parts(device: &Device, clock_hz: f64, supply_v: f64) -> Option<KeyParts> {
    let parts = key_parts(device, clock_hz)?;
    let winding = device.drive().winding?;
    Some(KeyParts {
        supply_v,
        resistance_ohm: winding.resistance_ohm,
        inductance_h: winding.inductance_h,
        ..parts
    })
}

/// The parts of a key but for its bridge and winding, of a device that says all of them.
pub fn key_parts(device: &Device, clock_hz: f64) -> Option<KeyParts> {
    let [port] = &device.ports[..] else {
        return None;
    };
    let drive = port.drive.as_ref()?;
    let mechanics = port.mechanics?;
    let (motor, stops) = (device.motor?, mechanics.stops?);
    (port.moves != Moves::Turns).then_some(KeyParts {
        clock_hz,
        supply_v: 0.0,
        trip_a: TRIP_A,
        resistance_ohm: 1.0,
        inductance_h: 1.0,
        force_n_per_a: drive.full_scale / motor.peak_a,
        mass_kg: mechanics.mass,
        damping_n_s_m: mechanics.damping,
        friction_n: mechanics.friction,
        stops_m: [stops.low, stops.high],
        stop_n_m: stops.stiffness,
        stop_n_s_m: stops.damping,
        sensed_m: [port.sensor.low, port.sensor.high],
    })
}
