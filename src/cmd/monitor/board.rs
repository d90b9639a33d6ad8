//! What is known of the image on a board, because its program is at hand: names, places, units.

use whippen_compiler::firmware::{
    CoreCode, FirmwareImage, ProgramCode, ZoneCode, monitor_identity,
};
use whippen_compiler::keyboard::{CoreId, InstrumentId, ProgramId};
use whippen_compiler::pipeline::Compiled;
use whippen_compiler::units::{shown, unit_suffix};
use whippen_runtime::monitor::{BoardMemory, Client, Facts, Link, MonitorError};

use super::{Lives, failure};
use crate::cmd::option;
use crate::cmd::setup::ImageSetup;
use crate::exit::Failure;

/// An image as the board has it.
pub struct KnownBoard<'a> {
    /// What it was made of.
    pub setup: &'a ImageSetup,
    /// The image.
    image: FirmwareImage,
    /// The program's files.
    pub sources: &'a [(String, String)],
}

/// A live parameter of the image.
struct LiveParam {
    /// Its number over all programs and zones.
    number: u32,
    instrument: InstrumentId,
    /// Its number in its instrument.
    index: usize,
}

/// `NAME=VALUE`
pub fn name_and_value(text: &str) -> Result<(String, String), String> {
    match text.split_once('=') {
        Some((name, value)) if !name.is_empty() && !value.is_empty() => {
            Ok((name.to_string(), value.to_string()))
        }
        _ => Err("wanted is a live parameter and its value, such as volume=0.5".to_string()),
    }
}

fn usage(why: String) -> Failure {
    Failure::Usage(why)
}

impl<'a> KnownBoard<'a> {
    /// Makes the image that the board should have.
    pub fn new(setup: &'a ImageSetup, sources: &'a [(String, String)]) -> Result<Self, Failure> {
        let instruments = setup.image_instruments()?;
        let image = setup.build(&instruments)?;
        Ok(KnownBoard {
            setup,
            image,
            sources,
        })
    }

    /// That the board has it.
    pub fn check(&self, facts: &Facts) -> Result<(), MonitorError> {
        let expected = monitor_identity(&self.image.image).unwrap_or(0);
        match facts.identity() {
            found if found == expected => Ok(()),
            found => Err(MonitorError::OtherImage(found, expected)),
        }
    }

    /// The address of a symbol.
    pub fn symbol(&self, name: &str) -> Option<u32> {
        let mut symbols = self.image.image.symbols.iter();
        let found = symbols.find(|symbol| symbol.name == name);
        found.map(|symbol| symbol.address)
    }

    /// What it is, in a line.
    pub fn told(&self) -> String {
        let keys: Vec<String> = self
            .image
            .keys_of_cores
            .iter()
            .map(u32::to_string)
            .collect();
        format!(
            "{} on {}: {} keys at {} ticks a second",
            self.setup.first().model.name,
            self.setup.board.name,
            keys.join(" and "),
            self.setup.first().model.rate_hz
        )
    }

    /// How many programs there are.
    pub fn programs(&self) -> u32 {
        self.image.programs.len() as u32
    }

    /// Whether a program that plays can begin anew.
    pub fn begins_anew(&self) -> bool {
        !self.image.programs.iter().any(ProgramCode::is_in_parts)
    }

    /// The name of a program that plays, anew or not.
    pub fn program_name(&self, number: u32) -> Option<&str> {
        let programs = &self.setup.layout.programs;
        let number = number % self.programs().max(1);
        Some(programs.get(ProgramId(number))?.name.as_str())
    }

    /// The number of a program.
    pub fn program(&self, name: &str) -> Result<u32, Failure> {
        let mut all = self.setup.layout.programs.iter();
        let named = all.position(|program| program.name == name);
        let numbered = name
            .parse()
            .ok()
            .filter(|number| *number < self.programs() as usize);
        let found = named.or(numbered);
        found.map(|number| number as u32).ok_or_else(|| {
            let all = self.setup.layout.programs.iter();
            let names: Vec<&str> = all.map(|program| program.name.as_str()).collect();
            usage(format!(
                "--play: there is no program `{name}`: there are {}",
                names.join(", ")
            ))
        })
    }

    /// All live parameters, in the order of the firmware's numbers: program by program, zone by
    /// zone.
    fn live_params(&self) -> Vec<LiveParam> {
        let zones = (self.image.programs.iter()).flat_map(|program| &program.zones);
        let of_zones = zones.flat_map(|zone| {
            let count = self.setup.instruments[zone.instrument.index()]
                .model
                .lives
                .len();
            (0..count).map(move |index| (zone.instrument, index))
        });
        let numbered = (0..).zip(of_zones);
        numbered
            .map(|(number, (instrument, index))| LiveParam {
                number,
                instrument,
                index,
            })
            .collect()
    }

    fn compiled(&self, id: InstrumentId) -> &'a Compiled {
        &self.setup.instruments[id.index()]
    }

    /// Sets every live parameter of a name.
    pub fn set_live<L: Link>(
        &self,
        client: &mut Client<L>,
        name: &str,
        text: &str,
    ) -> Result<(), Failure> {
        let all = self.live_params();
        let is_named = |param: &&LiveParam| {
            self.compiled(param.instrument).model.lives[param.index].name == name
        };
        let found: Vec<&LiveParam> = all.iter().filter(is_named).collect();
        if found.is_empty() {
            let name_of = |param: &LiveParam| {
                self.compiled(param.instrument).model.lives[param.index]
                    .name
                    .clone()
            };
            let names: Vec<String> = all.iter().map(name_of).collect();
            let there = match names.is_empty() {
                true => "it has none".to_string(),
                false => format!("there are {}", names.join(", ")),
            };
            return Err(usage(format!(
                "--live: there is no live parameter `{name}`; {there}"
            )));
        }
        for param in found {
            let compiled = self.compiled(param.instrument);
            let live = &compiled.model.lives[param.index];
            let value = match (live.dim, text) {
                (None, "true") => 1.0,
                (None, "false") => 0.0,
                (None, _) => return Err(usage(format!("--live {name}: is true or false"))),
                (Some(dim), _) => option::quantity(text, dim, &format!("a value of `{name}`"))
                    .map_err(|why| usage(format!("--live {name}={text}: {why}")))?,
            };
            if !(live.range.low..=live.range.high).contains(&value) {
                let told = live.dim.map_or(String::new(), |dim| {
                    format!(
                        " {} to {}",
                        shown(live.range.low, dim),
                        shown(live.range.high, dim)
                    )
                });
                return Err(usage(format!("--live {name}={text}: its range is{told}")));
            }
            let word = compiled.lowered.lives[param.index].quantize(value);
            client.set(param.number, word).map_err(failure)?;
        }
        Ok(())
    }

    /// The live values that play.
    pub fn lives<L: Link>(&self, client: &mut Client<L>) -> Result<Lives, Failure> {
        let value = |param: LiveParam| {
            let compiled = self.compiled(param.instrument);
            let live = &compiled.model.lives[param.index];
            let word = client.get(param.number).map_err(failure)?;
            let value = f64::from(word) * compiled.lowered.lives[param.index].lsb;
            let text = match live.dim {
                Some(dim) => shown(value, dim),
                None => (word != 0).to_string(),
            };
            Ok((live.name.clone(), text))
        };
        self.live_params().into_iter().map(value).collect()
    }

    /// The integers of an instrument's live values that play, in its order.
    pub fn live_words<L: Link>(
        &self,
        client: &mut Client<L>,
        instrument: InstrumentId,
    ) -> Result<Vec<i32>, Failure> {
        let all = self.live_params().into_iter();
        let own = all.filter(|param| param.instrument == instrument);
        let count = self.compiled(instrument).model.lives.len();
        let own = own.take(count);
        own.map(|param| client.get(param.number).map_err(failure))
            .collect()
    }

    /// The core of a key, its number there, and the code that plays it in the first program.
    pub fn place(&self, key: u32) -> Result<PlacedKey<'_>, Failure> {
        let mut first = 0;
        for (core, &keys) in self.image.keys_of_cores.iter().enumerate() {
            if key < first + keys {
                let program = self.image.program(ProgramId(0));
                let code: &CoreCode = program.core(CoreId(core as u32));
                let on_core = key - first;
                let is_of = |zone: &&ZoneCode| {
                    (zone.first_on_core..zone.first_on_core + zone.keys()).contains(&on_core)
                };
                let zone = code.zones.iter().find(is_of);
                let zone = zone.ok_or_else(|| Failure::Defect(format!("key {key} has no code")))?;
                return Ok(PlacedKey {
                    core,
                    on_core,
                    zone,
                    instrument: program.instrument_of(zone),
                });
            }
            first += keys;
        }
        Err(usage(format!(
            "there is no key {key}: keys are 0 to {}",
            first - 1
        )))
    }

    /// The instrument of a key, as it is in the image.
    pub fn instrument(&self, placed: &PlacedKey) -> &'a Compiled {
        self.compiled(placed.instrument)
    }

    /// Where what a key remembers is, by its name in the program: its address, the value of 0, that
    /// of a unit, and the unit.
    pub fn cell(&self, name: &str) -> Result<Cell, Failure> {
        let wrong = |why: String| usage(format!("`{name}`: {why}"));
        let (key, own) = name
            .split_once('.')
            .and_then(|(key, own)| Some((key.parse::<u32>().ok()?, own)))
            .ok_or_else(|| wrong("wanted is a key and a name, such as 40.phi".to_string()))?;
        let placed = self.place(key)?;
        let lowered = &self.instrument(&placed).lowered;
        let index = lowered
            .kernel
            .cells
            .iter()
            .position(|cell| cell.name == own);
        let meaning = lowered.memory.iter().find(|cell| cell.name == own);
        let (Some(index), Some(meaning)) = (index, meaning) else {
            let names: Vec<&str> = lowered
                .memory
                .iter()
                .map(|cell| cell.name.as_str())
                .collect();
            return Err(wrong(format!("a key remembers {}", names.join(", "))));
        };
        let zone = placed.zone;
        let at = zone
            .layout()
            .cell(placed.on_core - zone.first_on_core, index);
        let state = format!("{}_state", zone.name);
        match (self.symbol(&state), at) {
            (Some(state), Some(at)) => Ok(Cell {
                core: placed.core,
                address: state + at,
                zero: meaning.zero,
                lsb: meaning.lsb,
                unit: unit_suffix(&meaning.dim.unit()),
            }),
            _ => Err(Failure::Defect(format!("`{name}` has no place"))),
        }
    }

    /// What a key remembers, and its unit.
    pub fn read_cell(
        &self,
        memory: &mut impl BoardMemory,
        name: &str,
    ) -> Result<(f64, String), Failure> {
        let cell = self.cell(name)?;
        let words = memory.read(cell.address, 1).map_err(failure)?;
        let word = words.first().map_or(0, |word| *word as i32);
        Ok((cell.zero + f64::from(word) * cell.lsb, cell.unit))
    }
}

/// Where a key plays.
pub struct PlacedKey<'k> {
    /// The core.
    pub core: usize,
    /// Its number there.
    pub on_core: u32,
    /// Its code.
    pub zone: &'k ZoneCode,
    /// What it plays.
    pub instrument: InstrumentId,
}

/// A word that a key remembers.
#[derive(Debug, Clone, PartialEq)]
pub struct Cell {
    /// The core of its key.
    pub core: usize,
    /// Its address.
    pub address: u32,
    zero: f64,
    lsb: f64,
    unit: String,
}
