//! What a board's devices say to the host: the serial port to stdout, the converter's words from
//! and to files.

use std::path::Path;

use whippen_compiler::rate::Rate;
use whippen_emulator::{Converter, ConverterSetup, Machine, Ports, Uart, vcd};
use whippen_runtime::files::write_whole;

use super::Devices;
use super::image;
use crate::exit::{Failure, Outcome};

/// More is no keyboard.
const KEYS_MAX: u32 = 1024;

impl Devices {
    /// What the host fixes of the converter.
    pub fn setup(&self) -> Result<ConverterSetup, Failure> {
        let default = ConverterSetup::default();
        let setup = ConverterSetup {
            keys: self.keys.unwrap_or(default.keys),
            rate: (self.rate).map_or(default.rate, Rate::fraction),
        };
        if !(1..=KEYS_MAX).contains(&setup.keys) {
            return Err(Failure::Usage(format!("--keys is 1 to {KEYS_MAX}")));
        }
        Ok(setup)
    }

    /// An option that needs a board with devices, if one was given.
    pub fn wanted(&self) -> Option<&'static str> {
        let given = [
            ("--serial-in", self.serial_in.is_some()),
            ("--uart", self.uart.is_some()),
            ("--sense", self.sense.is_some()),
            ("--drive", self.drive.is_some()),
            ("--vcd", self.vcd.is_some()),
            ("--keys", self.keys.is_some()),
            ("--rate", self.rate.is_some()),
        ];
        given
            .into_iter()
            .find(|(_, given)| *given)
            .map(|(name, _)| name)
    }

    /// Gives the devices what they are to receive.
    pub fn connect(&self, machine: &mut Machine, ports: &Ports) -> Outcome {
        if let (Some(path), Some(uart)) = (
            &self.serial_in,
            machine.bus.device_mut::<Uart>(ports.uarts[0]),
        ) {
            uart.input.extend(image::read(path)?);
        }
        if let (Some(path), Some(converter)) = (
            &self.sense,
            machine.bus.device_mut::<Converter>(ports.converter),
        ) {
            converter.samples.extend(words(path, converter.keys())?);
        }
        if let Some(converter) = machine.bus.device_mut::<Converter>(ports.converter) {
            converter.recording = self.drive.is_some();
        }
        if self.vcd.is_some() {
            if machine.bus.pins.count() == 0 {
                let board = "--vcd needs a board with pins: --board rp2350 or rp2040";
                return Err(Failure::Usage(board.into()));
            }
            machine.bus.pins.record();
        }
        ports
            .uarts
            .iter()
            .for_each(|uart| machine.bus.reschedule(*uart));
        Ok(())
    }

    /// Writes what the converter was given by the program.
    pub fn write_drive(&self, machine: &Machine, ports: &Ports) -> Outcome {
        let Some(path) = &self.drive else {
            return Ok(());
        };
        let Some(converter) = machine.bus.device::<Converter>(ports.converter) else {
            return Ok(());
        };
        // A program may go on for some ticks after the last sample.
        let answered = if self.sense.is_some() {
            converter.words_given()
        } else {
            usize::MAX
        };
        let bytes: Vec<u8> = converter
            .drives
            .iter()
            .take(answered)
            .flat_map(|word| word.to_le_bytes())
            .collect();
        write_whole(path, |w| w.write_all(&bytes)).map_err(|e| Failure::Usage(e.to_string()))
    }

    /// Writes what was on the pins.
    pub fn write_pins(&self, machine: &mut Machine) -> Outcome {
        let Some(path) = &self.vcd else {
            return Ok(());
        };
        let chosen = self.vcd_pins.iter().map(|pin| 1 << pin);
        let end = (0..machine.cores()).map(|core| machine.cycle(core)).max();
        let clock_hz = machine.board().clock_hz;
        let pins = &mut machine.bus.pins;
        let mask = match self.vcd_pins.is_empty() {
            true => pins.used(),
            false => chosen.fold(0, |mask, pin: u64| mask | pin),
        };
        let text = vcd(&pins.take_changes(), mask, clock_hz, end.unwrap_or(0));
        write_whole(path, |w| w.write_all(text.as_bytes()))
            .map_err(|e| Failure::Usage(e.to_string()))
    }
}

/// Sensor words in a file: 16 bits each, the low byte first.
pub fn words(path: &Path, keys: u32) -> Result<Vec<u16>, Failure> {
    let bytes = image::read(path)?;
    let tick = 2 * keys as usize;
    if bytes.is_empty() || !bytes.len().is_multiple_of(tick) {
        return Err(Failure::Usage(format!(
            "--sense `{}`: {} bytes are not whole ticks of {keys} keys, 2 bytes each; --keys says how many there are",
            path.display(),
            bytes.len()
        )));
    }
    Ok(bytes
        .chunks_exact(2)
        .map(|pair| u16::from_le_bytes([pair[0], pair[1]]))
        .collect())
}

/// What the program has printed on its serial ports since the last time.
pub fn printed(machine: &mut Machine, ports: &Ports) -> Vec<u8> {
    let mut output = Vec::new();
    for uart in ports.uarts {
        if let Some(uart) = machine.bus.device_mut::<Uart>(uart) {
            output.append(&mut uart.output);
        }
    }
    output
}

/// The converter, when it has had at least one tick.
pub fn converter<'m>(machine: &'m Machine, ports: &Ports) -> Option<&'m Converter> {
    machine
        .bus
        .device::<Converter>(ports.converter)
        .filter(|c| c.ticks() > 0)
}
