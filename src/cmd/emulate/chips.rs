//! Several chips that have one keyboard, each with its image: their clocks side by side, the serial
//! port of each led to the next one.
//!
//! ```text
//!   words of a tick: | chip 1 | chip 2 |      --serial-in --> chip 1 --> chip 2 --> stdout
//! ```
//!
//! Chips run in turn for a slice of time, so a byte on its way between two is at most that late.

use std::path::Path;

use serde_json::{Value, json};
use whippen_compiler::firmware::{CORES, core_block};
use whippen_compiler::keyboard::KeyRange;
use whippen_emulator::{Converter, Stop, Uart};
use whippen_runtime::files::write_whole;

use super::image::Image;
use super::run::{CONVERTER_SLICE, Task};
use super::{Args, MAX_CYCLES, ports};
use crate::cmd::setup::{file_of_chip, keys_of_chips};
use crate::exit::{Failure, Outcome};
use crate::say::{self, say};

/// A chip with its image.
struct ChipRun {
    /// Its keys, of all.
    keys: KeyRange,
    image: Image,
    /// Why it ended before its samples did.
    stop: Option<Stop>,
}

/// Runs all chips to the end of their samples.
pub fn run(args: &Args) -> Outcome {
    check_options(args)?;
    let keys = args.on.devices.setup()?.keys;
    let mut chips = load(args, keys)?;
    let limit = args.what.max_cycles.unwrap_or(MAX_CYCLES);
    let mut kept = Vec::new();
    let mut until = 0;
    while until < limit && !chips.iter().all(ChipRun::is_over) {
        until = (until + CONVERTER_SLICE).min(limit);
        for at in 0..chips.len() {
            let said = chips[at].run(until);
            match chips.get_mut(at + 1) {
                Some(next) => next.receive(&said),
                None if args.outputs.json => kept.extend(said),
                None => say::bytes(&said),
            }
        }
        if chips.iter().any(|chip| chip.stop.is_some()) {
            break;
        }
    }
    write_drive(args, &chips)?;
    report(args, &chips, &kept);
    match chips.iter().all(ChipRun::succeeded) {
        true => Ok(()),
        false => Err(Failure::Program),
    }
}

/// That nothing is asked for that is of one chip.
fn check_options(args: &Args) -> Outcome {
    let (what, on, outputs) = (&args.what, &args.on, &args.outputs);
    let of_one = [
        ("--call", what.call.is_some()),
        ("--write", !what.write.is_empty()),
        ("--read", !what.read.is_empty()),
        ("--input", what.input.is_some()),
        ("--knob", on.parts.on.knob.is_some()),
        ("--bench", on.parts.on.bench.is_some()),
        ("--columns", on.parts.on.columns.is_some()),
        ("--uart", on.devices.uart.is_some()),
        ("--vcd", on.devices.vcd.is_some()),
        ("--trace", outputs.trace.is_some()),
        ("--profile", outputs.profile.is_some()),
        ("--gdb", outputs.gdb.is_some()),
    ];
    match of_one.into_iter().find(|(_, asked)| *asked) {
        Some((option, _)) => Err(Failure::Usage(format!(
            "{option} is of one chip: leave `*{}` away and give it the image of one",
            args.on.board.chips
        ))),
        None => Ok(()),
    }
}

/// The chips before their first instruction, with their sensor words.
fn load(args: &Args, keys: u32) -> Result<Vec<ChipRun>, Failure> {
    let chips = args.on.board.chips;
    if keys < chips {
        return Err(Failure::Usage(format!("{keys} keys on {chips} chips")));
    }
    let words = match &args.on.devices.sense {
        Some(path) => ports::words(path, keys)?,
        None => Vec::new(),
    };
    let numbered = (1..).zip(keys_of_chips(keys, chips));
    let chips = numbered.map(|(number, own)| {
        let mut on = args.on.clone();
        on.devices.keys = Some(own.count());
        on.devices.sense = None;
        on.devices.serial_in = on.devices.serial_in.filter(|_| number == 1);
        let mut image = Image::load(&file_of_chip(&args.image, number, chips), &on)?;
        Task::prepare(&mut image, &args.what)?;
        let mut chip = ChipRun {
            keys: own,
            image,
            stop: None,
        };
        if let Some(converter) = chip.converter_mut() {
            let rows = words.chunks_exact(keys as usize);
            let part = rows.flat_map(|row| &row[own.indices()]);
            converter.samples.extend(part);
        }
        Ok(chip)
    });
    chips.collect()
}

impl ChipRun {
    fn converter_mut(&mut self) -> Option<&mut Converter> {
        let port = self.image.ports.as_ref()?.converter;
        self.image.machine.bus.device_mut(port)
    }

    fn uart(&mut self) -> Option<&mut Uart> {
        let port = self.image.ports.as_ref()?.uarts[0];
        self.image.machine.bus.device_mut(port)
    }

    /// Runs up to a cycle; what its first serial port has sent.
    fn run(&mut self, until: u64) -> Vec<u8> {
        let stop = self.image.machine.run(until);
        self.stop = Some(stop).filter(|stop| *stop != Stop::Limit);
        let uart = self.uart();
        uart.map_or_else(Vec::new, |uart| std::mem::take(&mut uart.output))
    }

    /// Has bytes arrive at its first serial port.
    fn receive(&mut self, bytes: &[u8]) {
        let Some(port) = self.image.ports.as_ref().map(|ports| ports.uarts[0]) else {
            return;
        };
        let cycle = self.image.machine.cycle(0);
        if let Some(uart) = self.uart().filter(|_| !bytes.is_empty()) {
            uart.receive(bytes, cycle);
            self.image.machine.bus.reschedule(port);
        }
    }

    fn is_over(&self) -> bool {
        let converter = self.image.converter();
        converter.is_some_and(|c| c.is_over() && c.words_given() > 0)
    }

    fn succeeded(&self) -> bool {
        let overruns = self.image.converter().map(Converter::overruns);
        self.is_over() && self.stop.is_none() && overruns == Some(0)
    }

    /// Ticks that its firmware has missed, if it is one of ours.
    fn missed(&self) -> Option<u32> {
        let symbols = &self.image.elf.symbols;
        let blocks = CORES.iter().filter_map(|name| symbols.named(name).ok());
        let word = |address: u32| {
            let mut bytes = [0; 4];
            let memory = &self.image.machine.bus.memory;
            memory.read(address, &mut bytes).ok()?;
            Some(u32::from_le_bytes(bytes))
        };
        let all = blocks.map(|block| word(block.address + core_block::MISSED));
        all.reduce(|most, one| most.max(one)).flatten()
    }

    fn told(&self) -> String {
        let Some(converter) = self.image.converter() else {
            return "no ticks".to_string();
        };
        let (ticks, keys) = (converter.ticks(), self.keys.count());
        let missed = self
            .missed()
            .map_or(String::new(), |n| format!(", {n} missed"));
        let overruns = converter.overruns();
        let stop = self.stop.as_ref();
        let stop = stop.map_or(String::new(), |stop| format!("; stopped: {stop}"));
        format!("{ticks} ticks of {keys} keys, {overruns} overruns{missed}{stop}")
    }

    fn json(&self) -> Value {
        let converter = self.image.converter();
        json!({
            "keys": self.keys.count(),
            "ticks": converter.map(Converter::ticks),
            "overruns": converter.map(Converter::overruns),
            "missed": self.missed(),
            "cycles": self.image.machine.cycle(0),
            "instructions": self.image.machine.instructions(),
            "stop": match &self.stop {
                Some(stop) => stop.to_string(),
                None if self.is_over() => "over".to_string(),
                None => "limit".to_string(),
            },
        })
    }
}

/// Writes the drive words of all chips, tick by tick.
fn write_drive(args: &Args, chips: &[ChipRun]) -> Outcome {
    let Some(path) = &args.on.devices.drive else {
        return Ok(());
    };
    let is_given = args.on.devices.sense.is_some();
    let rows = chips.iter().map(|chip| {
        let keys = chip.keys.count() as usize;
        let converter = chip.image.converter();
        let words = converter.map_or(&[][..], |converter| {
            let all = &converter.drives;
            let answered = if is_given {
                converter.words_given()
            } else {
                all.len()
            };
            &all[..answered.min(all.len())]
        });
        words.chunks_exact(keys).collect::<Vec<&[i16]>>()
    });
    let rows: Vec<Vec<&[i16]>> = rows.collect();
    let ticks = rows.iter().map(Vec::len).min().unwrap_or(0);
    let row = |tick: usize| rows.iter().flat_map(move |own| own[tick]);
    let words = (0..ticks).flat_map(row);
    let bytes: Vec<u8> = words.flat_map(|word| word.to_le_bytes()).collect();
    write(path, &bytes)
}

fn write(path: &Path, bytes: &[u8]) -> Outcome {
    write_whole(path, |w| w.write_all(bytes)).map_err(|e| Failure::Usage(e.to_string()))
}

fn report(args: &Args, chips: &[ChipRun], output: &[u8]) {
    if args.outputs.json {
        let all: Vec<Value> = chips.iter().map(ChipRun::json).collect();
        say!(
            "{}",
            json!({ "chips": all, "output": String::from_utf8_lossy(output) })
        );
        return;
    }
    for (number, chip) in (1..).zip(chips) {
        say!("  chip {number}  {}", chip.told());
    }
}
