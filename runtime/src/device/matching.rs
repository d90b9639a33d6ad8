//! Which device an instrument is played on, and which port each of its senses is.

use whippen_compiler::model::{Model, Moves, Sense};

use super::{BUNDLED, Device, Drive, Port, Sensor};

/// What an assumed drive gives at most: as much as those of the bundled devices.
const ASSUMED_FORCE_N: f64 = 32.0;
const ASSUMED_TORQUE_N_M: f64 = 0.125;

impl Device {
    /// The device for an instrument whose program names none: the bundled one of a key or a knob
    /// for a single sense, the bundled one with ports of its senses' names for others, and if there
    /// is none, one that is made as the instrument senses.
    pub fn of(model: &Model) -> Device {
        if model.is_of_key() {
            let name = if model.turns() { "knob" } else { "mikey" };
            return Device::bundled(name).expect("both are bundled");
        }
        let fits = |device: &Device| device.fits(model).is_ok();
        Device::all_bundled()
            .find(fits)
            .unwrap_or_else(|| Device::assumed(model))
    }

    /// All bundled devices.
    pub fn all_bundled() -> impl Iterator<Item = Device> {
        let names = BUNDLED
            .iter()
            .map(|(file, _)| file.trim_end_matches(".toml"));
        names.filter_map(Device::bundled)
    }

    /// A device that has a port for everything that an instrument senses, with the range in which
    /// it senses it.
    fn assumed(model: &Model) -> Device {
        let port = |sense: &Sense| Port {
            name: sense.name.clone(),
            dim: sense.dim,
            moves: sense.moves,
            sensor: Sensor {
                bits: 16,
                low: sense.range.low,
                high: sense.range.high,
                delay_samples: 1.0,
                update_hz: None,
                step: None,
                noise_rms: None,
            },
            curve: None,
            drive: match sense.moves {
                Moves::Not => None,
                Moves::Slides => Some(ASSUMED_FORCE_N),
                Moves::Turns => Some(ASSUMED_TORQUE_N_M),
            }
            .map(|full_scale| Drive {
                full_scale,
                delay_samples: 1.0,
                ..Drive::NONE
            }),
            stands: None,
            mechanics: None,
        };
        Device {
            name: Device::ASSUMED.to_string(),
            ports: model.senses.iter().map(port).collect(),
            motor: None,
            passivity_j: None,
        }
    }

    /// The name of a device that is made as an instrument senses.
    pub const ASSUMED: &'static str = "assumed";

    /// What a device that no file describes takes for granted, in words.
    pub fn assumption(&self, model: &Model) -> Option<String> {
        (self.name == Device::ASSUMED).then(|| {
            let names = model.senses.iter().map(|sense| sense.name.as_str());
            let names: Vec<&str> = names.collect();
            format!(
                "no bundled device has the ports `{}`: each is taken as measured in the range that \
                 `{}` senses; give a device of your own with --device FILE.toml",
                names.join("`, `"),
                model.name
            )
        })
    }

    /// A device that was found, such as a keyboard's, if the instrument can be played on it;
    /// otherwise the usual one.
    pub fn fitting(found: Option<&Device>, model: &Model) -> Device {
        let fits = found.filter(|device| device.fits(model).is_ok());
        fits.cloned().unwrap_or_else(|| Device::of(model))
    }

    /// The port that serves a sense: the one of its name, or the only one.
    pub fn port_of(&self, sense: &str) -> Option<&Port> {
        match &self.ports[..] {
            [only] if only.name.is_empty() => Some(only),
            ports => ports.iter().find(|port| port.name == sense),
        }
    }

    /// The ports of the senses of an instrument that fits, in their order.
    pub fn ports_of(&self, model: &Model) -> Vec<&Port> {
        let port = |sense: &Sense| self.port_of(&sense.name).unwrap_or(self.port());
        model.senses.iter().map(port).collect()
    }

    /// The drives of the driven ports of an instrument that fits, in their order.
    pub fn drives_of(&self, model: &Model) -> Vec<Drive> {
        let ports = self.ports_of(model);
        let drive = |port: usize| ports.get(port).map_or(self.drive(), |p| p.drive());
        model.drives().into_iter().map(drive).collect()
    }

    /// Whether an instrument can be played on it.
    ///
    /// # Errors
    /// It has no port for something that is sensed, or one that measures something else, or no
    /// drive where a force acts.
    pub fn fits(&self, model: &Model) -> Result<(), String> {
        let has_one = matches!(&self.ports[..], [only] if only.name.is_empty());
        if has_one && model.senses.len() > 1 {
            let names: Vec<&str> = model.senses.iter().map(|s| s.name.as_str()).collect();
            return Err(format!(
                "the device `{}` has one port, but `{}` senses `{}`",
                self.name,
                model.name,
                names.join("`, `")
            ));
        }
        for (number, sense) in model.senses.iter().enumerate() {
            let is_driven = model.forces.iter().any(|force| force.port == number);
            self.serves(model, sense, is_driven)?;
        }
        Ok(())
    }

    fn serves(&self, model: &Model, sense: &Sense, is_driven: bool) -> Result<(), String> {
        let Some(port) = self.port_of(&sense.name) else {
            let names: Vec<&str> = self.ports.iter().map(|port| port.name.as_str()).collect();
            return Err(format!(
                "the device `{}` has no port `{}`, which `{}` senses; its ports are `{}`",
                self.name,
                sense.name,
                model.name,
                names.join("`, `")
            ));
        };
        let of_port = if port.name.is_empty() {
            format!("the device `{}`", self.name)
        } else {
            format!("the port `{}` of the device `{}`", port.name, self.name)
        };
        if (port.dim, port.moves) != (sense.dim, sense.moves) {
            let senses = match sense.moves {
                Moves::Slides => "a length".to_string(),
                Moves::Turns => "an angle".to_string(),
                Moves::Not if sense.dim.is_number() => "a plain number".to_string(),
                Moves::Not => format!("a value in {}", sense.dim.unit()),
            };
            return Err(format!(
                "{of_port} measures {}, but `{}` senses {senses}",
                port.measures(),
                model.name
            ));
        }
        if is_driven && port.drive.is_none() {
            let word = if port.turns() { "torque" } else { "force" };
            return Err(format!(
                "{of_port} has no drive, but a {word} of `{}` acts on it",
                model.name
            ));
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use whippen_compiler::check::Options;
    use whippen_compiler::front::compile_front;
    use whippen_compiler::source::SourceMap;

    fn model(body: &str) -> Model {
        let mut map = SourceMap::default();
        map.add("test.whip", format!("instrument i {{ {body} }}"));
        let (program, diagnostics) = compile_front(&mut map, &Options::default());
        let program = program.unwrap_or_else(|| panic!("{diagnostics:?}"));
        program.instruments.into_iter().next().expect("one")
    }

    #[test]
    fn every_bundled_device_reads() {
        let ports = |device: Device| {
            let names: Vec<String> = device.ports.iter().map(|port| port.name.clone()).collect();
            format!("{}: {}", device.name, names.join(" "))
        };
        let all: Vec<String> = Device::all_bundled().map(ports).collect();
        assert_eq!(
            all,
            [
                "mikey: ",
                "chain: ",
                "knob: ",
                "gimbal: ",
                "touch: x y z tilt",
                "pad: across height push",
                "mouse: across height",
                "voice_coil: ",
                "column_coil: "
            ]
        );
    }

    #[test]
    fn the_device_that_has_the_ports_is_taken() {
        let taken = |body: &str| Device::of(&model(body)).name;
        let x = "sense x: length in 0 mm .. 10 mm";
        assert_eq!(taken(x), "mikey");
        assert_eq!(taken("sense x: angle in 0 deg .. 10 deg"), "knob");
        let tilt = "sense tilt: angle in 0 deg .. 10 deg";
        assert_eq!(taken(&format!("{x} {tilt} force f on x = 1 N")), "touch");
        assert_eq!(
            taken(&format!("{x} {tilt} torque f on tilt = 1 N*m")),
            "assumed",
            "the arm does not push there"
        );
        assert_eq!(taken("sense push: force in 0 N .. 1 N"), "pad");
        assert_eq!(taken("sense across: number in 0 .. 1"), "mouse");
        assert_eq!(
            taken(&format!("{x} sense w: length in 0 m .. 1 m")),
            "assumed"
        );
    }

    #[test]
    fn what_does_not_fit_is_said() {
        let refused = |device: &str, body: &str| {
            let device = Device::bundled(device).expect("it is bundled");
            device.fits(&model(body)).expect_err("it does not fit")
        };
        let xy = "sense x: length in 0 mm .. 1 mm sense y: length in 0 mm .. 1 mm";
        let messages = [
            refused("mikey", xy),
            refused("mikey", "sense p: pressure in 0 Pa .. 1 Pa"),
            refused("touch", "sense w: length in 0 mm .. 1 mm"),
            refused("touch", "sense x: angle in 0 deg .. 1 deg"),
            refused("mouse", "sense across: angle in 0 deg .. 1 deg"),
            refused("pad", "sense across: length in 0 mm .. 1 mm force f = 1 N"),
        ];
        assert_eq!(
            messages,
            [
                "the device `mikey` has one port, but `i` senses `x`, `y`",
                "the device `mikey` measures lengths, but `i` senses a value in Pa",
                "the device `touch` has no port `w`, which `i` senses; its ports are `x`, `y`, `z`, `tilt`",
                "the port `x` of the device `touch` measures lengths, but `i` senses an angle",
                "the port `across` of the device `mouse` measures plain numbers, but `i` senses an angle",
                "the port `across` of the device `pad` has no drive, but a force of `i` acts on it",
            ]
        );
    }
}
