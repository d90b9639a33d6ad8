//! `whippen budget`: whether every key's tick is in time, proven on the final code; and the other budgets (`beyond`).

mod beyond;
mod motor;
mod numbers;
mod stability;
mod table;

use std::path::PathBuf;

use clap::ValueHint;
use serde_json::{Value, json};
use whippen_compiler::budget::{Bound, Budget, Deadline, NotBounded, Program, Surroundings, Tick, tick};
use whippen_compiler::check::Options;
use whippen_compiler::diag::Severity;
use whippen_compiler::image::{Board, Image, Input, MemoryKind, SectionKind, Start, link, places};
use whippen_compiler::kernel::Kernel;
use whippen_compiler::modes::{INSTRUCTIONS, Modes, specialise};
use whippen_compiler::pipeline::Compiled;
use whippen_compiler::source::SourceMap;
use whippen_compiler::{c, thumb};
use whippen_isa::Arch;
use whippen_runtime::files::write_whole;
use whippen_runtime::report::budget_page;

use self::beyond::{Beyond, BeyondArgs};
use super::{build, command, load};
use crate::exit::{Failure, Outcome};
use crate::say::{self, say};

#[derive(Debug, clap::Args)]
#[command(after_help = "Example: whippen budget instruments/grand-piano.whip --board rp2350 --keys 88")]
pub struct Args {
    /// The files of one program, and the name of an instrument if there are several
    #[arg(required = true, value_name = "FILE.. [INSTRUMENT]", value_hint = ValueHint::FilePath)]
    words: Vec<String>,
    /// The board, by name or as a TOML file; the keyboard's, or rp2350 otherwise
    #[arg(long, value_name = "NAME|FILE.toml")]
    board: Option<String>,
    /// How many keys on all cores; as many as the keyboard has, or 88 otherwise
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=65_536))]
    keys: Option<u32>,
    /// Ticks per second where no keyboard says otherwise
    #[arg(long, value_name = "HZ", default_value_t = 44_100, value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    rate: u32,
    /// Cycles of a tick that a core spends outside of the code that is built here: interrupts, converters
    #[arg(long, value_name = "CYCLES", default_value_t = 0)]
    firmware: u64,
    /// So many instructions for all modes of a key, which are faster the more there may be; 0 for one mode that knows nothing
    #[arg(long, value_name = "INSTRUCTIONS", default_value_t = INSTRUCTIONS)]
    modes: usize,
    /// Give a parameter another value, such as weight=0.4N
    #[arg(long = "set", value_name = "NAME=VALUE")]
    sets: Vec<String>,
    /// Device file with the scales of sensor and drive; the keyboard's device or mikey otherwise
    #[arg(long, value_name = "FILE", value_hint = ValueHint::FilePath)]
    device: Option<PathBuf>,
    #[command(flatten)]
    beyond: BeyondArgs,
    /// Also write a page: cores and modes as bars, the map of stability, the current over time
    #[arg(long, value_name = "FILE.html", value_hint = ValueHint::FilePath)]
    report: Option<PathBuf>,
    /// Print one JSON object instead
    #[arg(long)]
    json: bool,
}

/// Everything that is known of one core's code.
struct Proof {
    name: String,
    modes: Vec<String>,
    image: Image,
    program: Program,
    tick: Tick,
    /// With another core at work in the same banks.
    crowded: Tick,
    budget: Budget,
    board: Board,
    deadline: Deadline,
}

pub fn run(args: &Args) -> Outcome {
    let (files, name) = load::split(&args.words)?;
    let options = Options { sets: load::sets(&args.sets)?, rate_hz: args.rate };
    let (map, program) = load::checked(&load::read(&files)?, &options, Severity::Warning)?;
    let keyboard = program.keyboards.first();
    let model = build::instrument(&program, name)?.clone();
    let device = load::device(args.device.as_deref(), &program, &model)?;
    let board = build::board(args.board.as_deref(), keyboard)?;
    let keys = args.keys.or(keyboard.map(|k| k.keys() as u32)).unwrap_or(88);
    let compiled = load::compiled(&map, model, &device, false)?;
    let deadline = Deadline {
        clock_hz: board.clock_hz,
        rate_hz: compiled.model.rate_hz,
        cores: board.cores,
        keys,
        firmware_cycles: args.firmware,
    };
    let proof = Proof::find(&map, &compiled, board, deadline, args.modes)?;
    let beyond = Beyond::find(&map, &compiled.model, &device, &args.beyond)?;
    let mut budget = proof.json();
    beyond.add_to(&map, &mut budget);
    if let Some(path) = &args.report {
        let mut shown = budget.clone();
        beyond.add_map_to(&compiled.model, &mut shown);
        let page = budget_page(&[shown], &command::typed());
        write_whole(path, |w| w.write_all(page.as_bytes())).map_err(|e| Failure::Usage(e.to_string()))?;
    }
    if args.json {
        say!("{budget}");
    } else {
        beyond.warn(&map);
        say::whole(&(proof.table() + &beyond.text(&device)));
    }
    proof.verdict()
}

impl Proof {
    fn find(
        map: &SourceMap,
        compiled: &Compiled,
        board: Board,
        deadline: Deadline,
        instructions: usize,
    ) -> Result<Self, Failure> {
        if board.arch != Arch::V8M {
            return Err(Failure::Usage(format!(
                "code is made for the Cortex-M33, and {} has another core",
                board.name
            )));
        }
        let kernel = &compiled.lowered.kernel;
        let name = c::Names::new(kernel).kernel;
        let keys = deadline.keys.div_ceil(deadline.cores.max(1));
        let (modes, image) = linked(map, compiled, &name, &board, keys, instructions)?;
        let program = Program::of(&image);
        let core = board.timing();
        let bounded = |surroundings: Option<&Surroundings>| {
            let found = tick(&program, &name, &core, surroundings);
            let absent = || Failure::Defect(format!("the code of `{name}` has no tick"));
            found.ok_or_else(absent)?.map_err(|e: NotBounded| Failure::Defect(format!("no bound: {e}")))
        };
        let alone = bounded(None)?;
        let crowded = bounded(Some(&surroundings(&image, deadline.cores)))?;
        let budget = Budget::of(&alone, &deadline);
        let modes = modes.modes.into_iter().map(|mode| mode.name).collect();
        Ok(Self { name, modes, image, program, tick: alone, crowded, budget, board, deadline })
    }

    /// The mode that costs most, and its bound.
    fn dearest(&self) -> (&str, &Bound) {
        let by_cycles = self.modes.iter().zip(&self.tick.modes).max_by_key(|(_, (_, bound))| bound.cycles_max);
        by_cycles.map_or(("none", &self.tick.entry), |(name, (_, bound))| (name.as_str(), bound))
    }

    /// Bytes that the image takes in flash (all that is stored) and in RAM.
    fn bytes(&self) -> (u32, u32) {
        let is_ram = |memory: &str| self.board.memory.iter().any(|m| m.name == memory && m.kind == MemoryKind::Ram);
        let stored = self.image.sections.iter().map(|section| section.bytes.len() as u32).sum();
        let in_ram = self.image.sections.iter().filter(|section| is_ram(&section.memory));
        (stored, in_ram.map(|section| section.size).sum())
    }

    fn json(&self) -> Value {
        let (_, bound) = self.dearest();
        let items =
            self.program.by_item(&bound.path).into_iter().map(|(item, cycles)| (item.to_string(), json!(cycles)));
        let lines = self.program.by_place(&bound.path).into_iter().filter_map(|(place, _)| place);
        let lines: Vec<String> = lines.map(|place| format!("{}:{}", place.file, place.line)).collect();
        let mode =
            |(name, (_, bound)): (&String, &(String, Bound))| json!({ "name": name, "cycles_max": bound.cycles_max });
        let cores: Vec<Value> = self
            .budget
            .cores
            .iter()
            .map(|core| {
                json!({
                    "keys": core.keys, "cycles_max": core.cycles_max, "utilization": core.utilization(),
                    "slack_cycles": core.slack_cycles, "more_keys": core.more_keys,
                })
            })
            .collect();
        let (flash, ram) = self.bytes();
        json!({
            "kind": "budget",
            "instrument": self.name,
            "fits": self.budget.fits(),
            "period_cycles": self.budget.period_cycles,
            "key": {
                "cycles_max": self.budget.key_cycles_max,
                "contention_cycles_max": self.crowded.key_cycles_max() - self.tick.key_cycles_max(),
                "by_item": items.collect::<serde_json::Map<String, Value>>(),
                "worst_path": lines,
                "modes": self.modes.iter().zip(&self.tick.modes).map(mode).collect::<Vec<_>>(),
            },
            "frame_cycles_max": self.budget.frame_cycles_max,
            "cores": cores,
            "stack_bytes_max": self.tick.stack_bytes_max(),
            "flash_bytes": flash,
            "ram_bytes": ram,
            "class": self.budget.class.to_string(),
        })
    }

    /// A deadline that is missed, with the lines that cost most and what would be enough.
    fn verdict(&self) -> Outcome {
        if self.budget.fits() {
            return Ok(());
        }
        let (mode, bound) = self.dearest();
        let missed = self.budget.cores.iter().map(|core| -core.slack_cycles).max().unwrap_or(0);
        eprintln!(
            "error: the deadline is missed by {missed} cycles: a key takes {} in mode `{mode}`",
            bound.cycles_max
        );
        let mut dear: Vec<_> =
            self.program.by_place(&bound.path).into_iter().filter_map(|(p, c)| Some((p?, c))).collect();
        dear.sort_by_key(|(_, cycles)| std::cmp::Reverse(*cycles));
        for (place, cycles) in dear.into_iter().take(3) {
            eprintln!("  {}:{}: {cycles} cycles, {}", place.file, place.line, place.item);
        }
        let keys = self.budget.cores.iter().map(|core| core.keys).max().unwrap_or(0);
        let room = self.budget.period_cycles.saturating_sub(self.budget.frame_cycles_max);
        eprintln!(
            "help: it fits with {} cycles a key, or with {} keys a core instead of {keys}",
            self.budget.key_cycles_allowed(),
            room / self.budget.key_cycles_max.max(1)
        );
        Err(Failure::Program)
    }
}

/// One core's code with addresses as on the board.
fn linked(
    map: &SourceMap,
    compiled: &Compiled,
    name: &str,
    board: &Board,
    keys: u32,
    instructions: usize,
) -> Result<(Modes, Image), Failure> {
    let kernel: &Kernel = &compiled.lowered.kernel;
    let modes = specialise(kernel, instructions);
    let options = thumb::Options { name: name.to_string(), keys, gain: true, probes: false };
    let built = thumb::compile(&modes, &options).map_err(|error| Failure::Defect(error.to_string()))?;
    let places = places(&compiled.lowered.origins, map);
    // Nobody starts here, so nothing is needed to start.
    let board = Board { start: Start::Vectors, ..board.clone() };
    let input = Input { object: &built.object, places: &places };
    let image = link(&board, &[input], &format!("{name}_tick")).map_err(|e| Failure::Usage(e.to_string()))?;
    Ok((modes, image))
}

/// Another core like this one in the same groups of banks: where this one's data is, the other fetches, and the reverse.
fn surroundings(image: &Image, cores: u32) -> Surroundings {
    let banks = |code: bool| {
        let wanted = image.sections.iter().filter(|section| (section.kind == SectionKind::Code) == code);
        wanted.fold(0, |set, section| set | Surroundings::banks(section.run, section.size))
    };
    let others = if cores > 1 { vec![banks(true) | banks(false); 2] } else { Vec::new() };
    Surroundings { data: banks(false), prefetch: true, others }
}
