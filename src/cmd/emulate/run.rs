//! Setting a machine up, and running it to its end: in slices, so that output appears and a
//! terminal sees progress.

use std::io::{self, IsTerminal, Write};
use std::path::Path;
use std::time::{Duration, Instant};

#[cfg(target_family = "wasm")]
use crate::cmd::unseen as indicatif;
use indicatif::{ProgressBar, ProgressStyle};
use whippen_compiler::firmware::self_test_block;
use whippen_emulator::elf::{Elf, SourceLines};
use whippen_emulator::{Converter, Machine, Ports, Start, Stop};
use whippen_runtime::files::write_whole;

use super::image::{self, Image};
use super::outside::Outside;
use super::profile::Profile;
use super::trace::Trace;
use super::uart::OpenDoor;
use super::watch::Watch;
use super::{EmulateOutputs, MAX_CYCLES, What, board, ports, value};
use crate::exit::Failure;
use crate::say::{self, tell};

/// So many cycles at a time.
const SLICE: u64 = 2_000_000;
/// And so many while a converter ticks.
pub(super) const CONVERTER_SLICE: u64 = 50_000;

/// What to do with an image, understood and prepared: memory is set and the core stands before its
/// first instruction.
pub struct Task {
    /// The function that is called.
    pub call: Option<String>,
    /// What to read at the end.
    pub reads: Vec<Read>,
    /// Where to stop, if anywhere.
    pub max_cycles: Option<u64>,
}

/// Memory to read back.
pub struct Read {
    /// As it was asked for.
    pub name: String,
    /// First address.
    pub address: u32,
    /// How many bytes.
    pub bytes: u32,
}

/// How a run ended.
pub struct End {
    /// Why.
    pub stop: Stop,
    /// Whether it ended because the converter's samples were over.
    pub over: bool,
    /// Of a self-test that came to its end: how many of its counts differ.
    pub differ: Option<u32>,
    /// Ticks that came before the program had served the one before.
    pub overruns: u32,
    /// Cycles of the function, or of the first core since reset.
    pub cycles: u64,
    /// Instructions of all cores.
    pub instructions: u64,
    /// What the program printed, when it was kept for the report.
    pub output: Vec<u8>,
    /// Where the cycles went.
    pub profile: Option<Profile>,
}

impl End {
    /// The function returned, the program said that all is well, or it served all samples in time.
    pub fn succeeded(&self) -> bool {
        let said = self.over || self.differ == Some(0);
        self.overruns == 0
            && (said || matches!(self.stop, Stop::Returned { .. } | Stop::Exit { code: 0 }))
    }
}

impl Task {
    /// Reads the command line, writes memory, and puts the core before its first instruction.
    pub fn prepare(image: &mut Image, what: &What) -> Result<Self, Failure> {
        let Image { elf, machine, .. } = image;
        if let Some(call) = &what.call {
            let call = FunctionCall::parse(call, elf)
                .map_err(|e| Failure::Usage(format!("--call {call}: {e}")))?;
            elf.load(&mut machine.bus.memory, true).map_err(|e| {
                Failure::Usage(format!(
                    "the image's data does not fit the board: {e}; --ram adds memory"
                ))
            })?;
            let stack = board::stack_top(machine.board());
            let vector_table = machine.board().vector_table;
            machine.start(
                0,
                Start {
                    vector_table,
                    stack,
                    address: call.address,
                },
            );
            machine.prepare_call(call.address, call.arguments);
        } else {
            start(elf, machine)?;
        }
        for text in &what.write {
            write(text, elf, machine)
                .map_err(|e| Failure::Usage(format!("--write {text}: {e}")))?;
        }
        let read = |text: &String| {
            Read::parse(text, elf, machine)
                .map_err(|e| Failure::Usage(format!("--read {text}: {e}")))
        };
        let name = |call: &String| {
            call.split(',')
                .next()
                .unwrap_or_default()
                .trim()
                .to_string()
        };
        Ok(Self {
            call: what.call.as_ref().map(name),
            reads: what.read.iter().map(read).collect::<Result<_, _>>()?,
            max_cycles: what.max_cycles,
        })
    }
}

/// Starts an image as reset does, or where it says that it begins.
fn start(elf: &Elf, machine: &mut Machine) -> Result<(), Failure> {
    let begins = |elf: &Elf| {
        elf.segments
            .iter()
            .any(|s| s.executable && s.contains(elf.entry & !1))
    };
    if whippen_emulator::elf::vector_table(elf).is_some() {
        machine.reset();
    } else if elf.entry != 0 && begins(elf) {
        let address = elf.entry | 1;
        tell!(
            "note: the image has no vector table that could be found; it starts at {:#010x}",
            address & !1
        );
        let stack = board::stack_top(machine.board());
        machine.start(
            0,
            Start {
                vector_table: 0,
                stack,
                address,
            },
        );
    } else {
        let functions = elf
            .symbols
            .iter()
            .filter(|s| s.function && s.global)
            .map(|s| s.name.as_str());
        let some: Vec<&str> = functions.take(8).collect();
        let such = if some.is_empty() {
            String::new()
        } else {
            format!("; it has {}", some.join(", "))
        };
        return Err(Failure::Usage(format!(
            "the image has no start (no vector table, no entry): use --call FUNCTION{such}"
        )));
    }
    Ok(())
}

/// A function and its arguments.
struct FunctionCall {
    address: u32,
    arguments: [u32; 4],
}

impl FunctionCall {
    fn parse(text: &str, elf: &Elf) -> Result<Self, String> {
        let mut words = text.split(',');
        let address = value::place(words.next().unwrap_or_default(), elf)?.address & !1;
        let mut arguments = [0; 4];
        for (i, word) in words.enumerate() {
            let slot = arguments
                .get_mut(i)
                .ok_or("at most four arguments, R0 to R3, can be given")?;
            *slot = value::word(word, elf)?;
        }
        let code = |s: &whippen_emulator::elf::Segment| s.executable && s.contains(address);
        match elf.segments.iter().any(code) {
            true => Ok(Self { address, arguments }),
            false => Err(format!("there is no code of the image at {address:#010x}")),
        }
    }
}

/// `ADDR=HEX` or `ADDR=@FILE`
fn write(text: &str, elf: &Elf, machine: &mut Machine) -> Result<(), String> {
    let (place, bytes) = text.split_once('=').ok_or("write ADDR=HEX or ADDR=@FILE")?;
    let address = value::place(place, elf)?.address;
    let bytes = match bytes.strip_prefix('@') {
        Some(path) => image::read(Path::new(path)).map_err(|e| match e {
            Failure::Usage(message) => message,
            _ => "cannot be read".into(),
        })?,
        None => value::bytes(bytes)?,
    };
    machine
        .bus
        .memory
        .write(address, &bytes)
        .map_err(|e| format!("{e}; --ram adds memory"))
}

impl Read {
    /// `ADDR:LEN`, or a symbol alone.
    fn parse(text: &str, elf: &Elf, machine: &Machine) -> Result<Self, String> {
        let (name, length) = match text.rsplit_once(':') {
            // C++ names have colons in pairs.
            Some((name, length)) if !name.ends_with(':') => (name, Some(length)),
            _ => (text, None),
        };
        let place = value::place(name, elf)?;
        let bytes = match length {
            Some(length) => {
                value::size(length).ok_or_else(|| format!("`{length}` is no number of bytes"))?
            }
            None => place.symbol.map_or(0, |s| s.bytes),
        };
        if bytes == 0 {
            return Err("how many bytes? write ADDR:LEN".into());
        }
        let read = Self {
            name: name.trim().to_string(),
            address: place.address,
            bytes,
        };
        read.now(machine)?;
        Ok(read)
    }

    /// The bytes as they are.
    pub fn now(&self, machine: &Machine) -> Result<Vec<u8>, String> {
        let last = self
            .address
            .checked_add(self.bytes - 1)
            .ok_or("goes beyond 32 bits")?;
        let memory = &machine.bus.memory;
        memory.read(last, &mut [0]).map_err(|e| e.to_string())?;
        let mut bytes = vec![0; self.bytes as usize];
        memory
            .read(self.address, &mut bytes)
            .map_err(|e| e.to_string())?;
        Ok(bytes)
    }
}

/// Runs until something ends it; writes the trace.
pub fn to_the_end(
    image: &mut Image,
    task: &Task,
    outputs: &EmulateOutputs,
) -> Result<End, Failure> {
    let Image {
        elf,
        machine,
        lines,
        ports,
        outside,
        door,
    } = image;
    let usual = if door.is_some() { u64::MAX } else { MAX_CYCLES };
    let limit = machine
        .cycle(0)
        .saturating_add(task.max_cycles.unwrap_or(usual));
    let mut run = Run {
        machine,
        ports: *ports,
        outside,
        door: door.as_mut(),
        limit,
        kept: outputs.json.then(Vec::new),
    };
    let (stop, profile) = run.observed(elf, lines, outputs)?;
    let output = run.kept.unwrap_or_default();
    outside.end(machine);
    let cycles = match stop {
        Stop::Returned { cycles, .. } => cycles,
        _ => machine.cycle(0),
    };
    let converter = ports.as_ref().and_then(|p| ports::converter(machine, p));
    let is_over =
        converter.is_some_and(|c| c.words_given() > 0 && c.is_over()) || outside.is_over();
    let has_left = door.as_ref().is_some_and(|door| door.is_closed);
    let over = stop == Stop::Limit && (is_over || has_left);
    let overruns = converter.map_or(0, Converter::overruns);
    Ok(End {
        differ: differ(elf, machine),
        stop,
        over,
        overruns,
        cycles,
        instructions: machine.instructions(),
        output,
        profile,
    })
}

/// What a self-test has found, once it is at its end.
fn differ(elf: &Elf, machine: &Machine) -> Option<u32> {
    let block = elf.symbols.named("self_test").ok()?.address;
    let word = |at: u32| {
        let mut bytes = [0; 4];
        machine.bus.memory.read(block + at, &mut bytes).ok()?;
        Some(u32::from_le_bytes(bytes))
    };
    let is_done = word(0)? == u32::from_le_bytes(*b"WHST") && word(self_test_block::STATE)? == 1;
    let differ = word(self_test_block::DIFFER)? + word(self_test_block::TICKS_DIFFER)?;
    is_done.then_some(differ)
}

/// A run under way.
struct Run<'m> {
    machine: &'m mut Machine,
    ports: Option<Ports>,
    outside: &'m mut Outside,
    door: Option<&'m mut OpenDoor>,
    limit: u64,
    /// What the program prints, when it is not to be passed on at once.
    kept: Option<Vec<u8>>,
}

impl Run<'_> {
    /// Runs with the profile and the trace that are asked for; gives the end and the profile.
    fn observed(
        &mut self,
        elf: &Elf,
        lines: &SourceLines,
        outputs: &EmulateOutputs,
    ) -> Result<(Stop, Option<Profile>), Failure> {
        let profile = outputs.profile.is_some().then(Profile::default);
        let Some(path) = &outputs.trace else {
            return Ok(match profile {
                None => (self.run(None), None),
                profile => {
                    let trace = None;
                    let (stop, profile, _) = self.watched(Watch { profile, trace });
                    (stop, profile)
                }
            });
        };
        let cores = self.machine.cores();
        if path.as_os_str() == "-" {
            self.kept.get_or_insert_default();
            let mut stdout = io::BufWriter::new(io::stdout().lock());
            let trace = Some(Trace::new(&mut stdout, elf, lines, cores));
            let (stop, profile, written) = self.watched(Watch { profile, trace });
            say::keep(written.and_then(|()| stdout.flush()));
            return Ok((stop, profile));
        }
        let mut end = None;
        let traced = write_whole(path, |writer| {
            let trace = Some(Trace::new(writer, elf, lines, cores));
            let (stop, profile, written) = self.watched(Watch { profile, trace });
            end = Some((stop, profile));
            written
        });
        traced.map_err(|e| Failure::Usage(e.to_string()))?;
        end.ok_or_else(|| Failure::Defect("a trace was written without a run".into()))
    }

    /// The end, the profile, and whether the whole trace could be written.
    fn watched(&mut self, mut watch: Watch<'_>) -> (Stop, Option<Profile>, io::Result<()>) {
        let stop = self.run(Some(&mut watch));
        (
            stop,
            watch.profile,
            watch.trace.map_or(Ok(()), Trace::finish),
        )
    }

    /// Runs in slices. What the program prints goes where it belongs, or is kept.
    fn run(&mut self, mut watch: Option<&mut Watch<'_>>) -> Stop {
        let progress = Spinner::new();
        loop {
            let slice = self.machine.cycle(0).saturating_add(self.slice());
            let until = slice.min(self.outside.next().unwrap_or(slice));
            let until = until.min(self.limit);
            let stop = match &mut watch {
                Some(watch) => self.machine.run_observed(until, *watch),
                None => self.machine.run(until),
            };
            self.outside.pass(self.machine);
            if let (Some(door), Some(ports)) = (&mut self.door, &self.ports) {
                door.pass(self.machine, ports);
            }
            let finished = stop != Stop::Limit || until >= self.limit || self.is_over();
            progress.at(self.machine.cycle(0));
            if finished {
                progress.done();
            }
            self.pass_on(&progress);
            if finished {
                return stop;
            }
        }
    }

    fn converter(&self) -> Option<&Converter> {
        ports::converter(self.machine, self.ports.as_ref()?)
    }

    /// While a converter ticks, so often that the end of its samples ends the run.
    fn slice(&self) -> u64 {
        if self.converter().is_some() {
            CONVERTER_SLICE
        } else {
            SLICE
        }
    }

    fn is_over(&self) -> bool {
        if let Some(door) = &self.door {
            return door.is_closed;
        }
        let converter = self.converter();
        converter.is_some_and(|c| c.is_over() && c.words_given() > 0) || self.outside.is_over()
    }

    /// Takes what the program printed since the last time.
    fn pass_on(&mut self, progress: &Spinner) {
        let semihosting = &mut self.machine.semihosting;
        let (mut output, errors) = (
            std::mem::take(&mut semihosting.output),
            std::mem::take(&mut semihosting.errors),
        );
        if let Some(ports) = &self.ports {
            output.append(&mut ports::printed(self.machine, ports));
        }
        match &mut self.kept {
            Some(kept) => kept.extend(output),
            None if output.is_empty() => {}
            None => progress.aside(|| say::bytes(&output)),
        }
        if !errors.is_empty() {
            progress.aside(|| drop(io::stderr().lock().write_all(&errors)));
        }
    }
}

/// Turns on stderr once a run takes more than a second; on a terminal only.
struct Spinner {
    bar: ProgressBar,
    start: Instant,
}

impl Spinner {
    fn new() -> Self {
        let style = ProgressStyle::with_template("{spinner} {msg}")
            .unwrap_or_else(|_| ProgressStyle::default_spinner());
        Self {
            bar: ProgressBar::hidden().with_style(style),
            start: Instant::now(),
        }
    }

    fn at(&self, cycles: u64) {
        let shown = self.start.elapsed() > Duration::from_secs(1) && io::stderr().is_terminal();
        if shown && self.bar.is_hidden() {
            self.bar
                .set_draw_target(indicatif::ProgressDrawTarget::stderr());
        }
        if shown {
            self.bar
                .set_message(format!("{} Mcycles", cycles / 1_000_000));
            self.bar.tick();
        }
    }

    fn aside(&self, print: impl FnOnce()) {
        self.bar.suspend(print);
    }

    fn done(&self) {
        self.bar.finish_and_clear();
    }
}
