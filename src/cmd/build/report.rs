//! What is said of an image that is written: what it takes, and what leads where.

use std::path::Path;

use whippen_compiler::board::{Columns, SoundPort, Wire};
use whippen_compiler::image::Image;
use whippen_compiler::pipeline::Compiled;

use super::files::Files;
use crate::say::say;

impl Files<'_> {
    /// What an image is and takes.
    pub(super) fn report_image(&self, path: &Path, image: &Image, keys: &[u32]) {
        let setup = self.setup;
        let names: Vec<&str> = setup
            .layout
            .programs
            .iter()
            .map(|program| program.name.as_str())
            .collect();
        let (stored, run) = (image.stored_bytes(), image.run_bytes());
        let counts: Vec<String> = keys.iter().map(u32::to_string).collect();
        let counts = counts.join(" and ");
        say!(
            "{}: {}{} on {}, {stored} bytes of flash, {run} bytes of RAM",
            path.display(),
            match setup.instruments[0].model.is_of_key() {
                true if counts == "1" => "1 key of ".to_string(),
                true => format!("{counts} keys of "),
                false => String::new(),
            },
            names.join(", "),
            if keys.len() == 1 {
                "one core"
            } else {
                "two cores"
            }
        );
        if names.len() > 1 {
            say!(
                "it begins with {}; programs are numbered from 0 in this order",
                names[0]
            );
        }
        if let Some(baud) = setup.monitor_baud() {
            say!("its serial port is for `whippen monitor`, at {baud} baud; there is no MIDI");
        }
        self.say_wiring(keys.iter().sum());
        self.say_sound();
        if let Some(motor) = &setup.device.motor {
            let (peak, torque) = (motor.peak_a, 1000.0 * motor.peak_a * motor.torque_constant);
            let (force, unit) = (
                setup.device.drive().full_scale,
                if setup.device.turns() { "N*m" } else { "N" },
            );
            say!(
                "the greatest force, {force} {unit}, is taken to need {peak} A ({torque:.1} mN*m of the motor)"
            );
        }
    }

    /// What leads where, on a board with parts on its pins.
    fn say_wiring(&self, keys: u32) {
        let (board, device) = (&self.setup.board, &self.setup.device);
        if let Some(knob) = &board.knob {
            say!("wiring, with the pins of a Raspberry Pi Pico 2:");
            for Wire { gpio, pico_pin, to } in knob.wiring() {
                let pin = pico_pin.map_or("none".to_string(), |pin| pin.to_string());
                say!("  pin {pin:>4}  GPIO {gpio:>2}  {to}");
            }
        }
        if let Some(bench) = &board.bench {
            say!("wiring of an RP2350B:");
            for Wire { gpio, to, .. } in bench.wiring(keys) {
                say!("  GPIO {gpio:>2}  {to}");
            }
            let last = bench.latency_cycles(keys.saturating_sub(1), keys);
            let first = bench.latency_cycles(0, keys);
            let ticks = |cycles: u32| f64::from(cycles) / f64::from(bench.period_cycles);
            say!(
                "from sample to force: {first} cycles of key 0 ({:.2} ticks), {last} of the last key ({:.2})",
                ticks(first),
                ticks(last)
            );
            // The current gets there within a tick.
            let (late, said) = (ticks(first) + 0.5, device.delay_samples());
            if said < late {
                say!(
                    "the device `{}` counts {said:.2} ticks from sensor to force, and these are \
                     {late:.2} with half a tick for the current: its loop was judged with less \
                     delay than it has; raise `sensor.delay` or `drive.delay`",
                    device.name
                );
            }
        }
        if let Some(columns) = &board.columns {
            self.say_columns(columns, keys);
        }
    }

    /// What leads where on a board with columns of converters, and how old a sample is.
    fn say_columns(&self, columns: &Columns, keys: u32) {
        say!("wiring, with the pins of a Raspberry Pi Pico 2:");
        for Wire { gpio, pico_pin, to } in columns.wiring(keys) {
            let pin = pico_pin.map_or("none".to_string(), |pin| pin.to_string());
            say!("  pin {pin:>4}  GPIO {gpio:>2}  {to}");
        }
        let (latency, period) = (columns.latency_cycles(), columns.period_cycles);
        let hz = f64::from(self.setup.board.clock_hz) / f64::from(period);
        let in_parts = hz * f64::from(Columns::parts_delay_ns()) * 1e-9;
        let ticks = f64::from(latency) / f64::from(period);
        say!(
            "from sample to the DAC's update: {latency} cycles of every key ({ticks:.2} ticks); low-pass and settling of \
             the parts add {in_parts:.2} ticks"
        );
        let (late, said) = (ticks + in_parts, self.setup.device.delay_samples());
        if said < late {
            say!(
                "the device `{}` counts {said:.2} ticks from sensor to force, and these are {late:.2}, without the \
                 amplifier: its loop was judged with less delay than it has; raise `sensor.delay` or `drive.delay`",
                self.setup.device.name
            );
        }
    }

    /// Where what is heard leaves, on a board with a DAC on its pins.
    fn say_sound(&self) {
        let (board, programs) = (&self.setup.board, &self.setup.instruments);
        let is_heard = |own: &Compiled| !own.model.channels.is_empty();
        if !programs.iter().any(is_heard) {
            return;
        }
        let Some(port) = &board.i2s else {
            if board.knob.is_some() || board.bench.is_some() || board.columns.is_some() {
                say!("nothing hears what it sounds: the board has no `[i2s]`");
            }
            return;
        };
        for Wire { gpio, pico_pin, to } in port.wiring() {
            match pico_pin.filter(|_| board.bench.is_none()) {
                Some(pin) => say!("  pin {pin:>4}  GPIO {gpio:>2}  {to}"),
                None => say!("  GPIO {gpio:>2}  {to}"),
            }
        }
        let period = SoundPort::period_cycles(board);
        let hz = f64::from(board.clock_hz) / f64::from(period);
        say!(
            "each tick's samples leave in the next one, as a frame of {period} cycles ({hz:.1} Hz)"
        );
    }
}
