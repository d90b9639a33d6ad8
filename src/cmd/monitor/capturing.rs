//! `--capture`: keys in every tick around a trigger, as tables and pages, and beside what the
//! engine `jit` makes of the words that were measured.

use std::path::PathBuf;
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

use clap::ValueHint;
use serde_json::json;
use whippen_compiler::firmware::{Fact, captured};
use whippen_compiler::pipeline::Compiled;
use whippen_compiler::units::{Dim, parse_quantity};
use whippen_runtime::engine::EngineKind;
use whippen_runtime::monitor::{
    BoardMemory, Capture, CapturedRow, CapturedRows, Client, Difference, Facts, Link, MonitorError,
    Replay, Trigger, capture_room, rows_of,
};
use whippen_runtime::report::{Made, Section};
use whippen_runtime::session::{ALL, Recorded, RunError};

use super::board::{KnownBoard, PlacedKey};
use super::{failure, told};
use crate::cmd::load;
use crate::cmd::option;
use crate::cmd::run::{Outputs, report};
use crate::exit::{Failure, Outcome};
use crate::interrupt;
use crate::say::{say, tell};

/// What to capture.
#[derive(Debug, clap::Args)]
#[command(next_help_heading = "A capture")]
pub struct CaptureArgs {
    /// Capture sensor and drive words of these keys in every tick, at most four of each core: keys
    /// are counted from 0
    #[arg(long, value_name = "KEY,..", value_delimiter = ',')]
    pub capture: Vec<u32>,
    /// And what keys remember, such as 40.phi, as the integers that they are; at most four of each
    /// core
    #[arg(
        long,
        value_name = "KEY.NAME,..",
        value_delimiter = ',',
        requires = "capture"
    )]
    cells: Vec<String>,
    /// When: `now`; `begin`, with the program that plays, which begins anew; an event of the first
    /// key, such as `note`; its position or force that comes to this, such as x:4mm or drive:2N
    #[arg(long, value_name = "WHEN", default_value = "now", requires = "capture")]
    trigger: String,
    /// How long
    #[arg(long, value_name = "TIME", default_value = "100ms", value_parser = option::seconds, requires = "capture")]
    seconds: f64,
    /// The part of it that is before the trigger, of `now` and `begin` none
    #[arg(long, value_name = "PART", default_value_t = 0.25, value_parser = part, requires = "capture")]
    before: f64,
    /// How long to wait for the trigger
    #[arg(long, value_name = "TIME", default_value = "30s", value_parser = option::seconds, requires = "capture")]
    wait: f64,
    /// Trace of the capture, a row per tick, with what `jit` computes beside it; of one key
    #[arg(long, value_name = "FILE.csv", value_hint = ValueHint::FilePath, requires = "capture")]
    pub out: Option<PathBuf>,
    /// Page to explore it, with a section for each key
    #[arg(long, value_name = "FILE.html", value_hint = ValueHint::FilePath, requires = "capture")]
    pub report: Option<PathBuf>,
}

/// A part of a whole.
fn part(text: &str) -> Result<f64, String> {
    let number = text.parse().ok().filter(|part| (0.0..=0.95).contains(part));
    number.ok_or_else(|| "wanted is a part from 0 to 0.95".to_string())
}

/// The most words of a core that are captured at once are the firmware's to say; this is a pause
/// between two looks.
const PAUSE: Duration = Duration::from_millis(20);

/// A capture of the whole board.
struct CapturePlan<'k> {
    /// By core.
    captures: Vec<Capture>,
    /// The keys in the order in which they were given.
    keys: Vec<(u32, PlacedKey<'k>)>,
    /// Names of the captured words of memory, by core.
    cells: Vec<Vec<String>>,
    begins: bool,
}

impl CaptureArgs {
    /// What can be judged before there is a board.
    pub fn check(&self, known: &KnownBoard) -> Outcome {
        if self.capture.is_empty() {
            return Ok(());
        }
        if self.out.is_some() && self.capture.len() > 1 {
            let why = "--out is a trace of one key: capture one, or write a --report";
            return Err(Failure::Usage(why.to_string()));
        }
        if !known.setup.first().model.is_of_key() {
            let why = "--capture is for instruments of keys";
            return Err(Failure::Usage(why.to_string()));
        }
        self.wanted(known).map(drop)
    }

    /// The captures of both cores.
    fn wanted<'k>(&self, known: &'k KnownBoard) -> Result<CapturePlan<'k>, Failure> {
        let place = |key: &u32| Ok((*key, known.place(*key)?));
        let keys: Vec<(u32, PlacedKey)> =
            self.capture.iter().map(place).collect::<Result<_, _>>()?;
        let rate_hz = f64::from(known.setup.first().model.rate_hz);
        let ticks = ((self.seconds * rate_hz).ceil() as u32).max(2);
        let first = &keys[0].1;
        let (trigger, begins) = self.trigger(known.instrument(first), first)?;
        if begins && !known.begins_anew() {
            return Err(Failure::Usage(
                "--trigger begin: an instrument in parts begins once, when the board starts"
                    .to_string(),
            ));
        }
        let waits = !matches!(trigger, Trigger::Now);
        let before = if waits { self.before } else { 0.0 };
        let after = (f64::from(ticks) * (1.0 - before)) as u32;
        let cores = 1 + keys.iter().map(|(_, key)| key.core).max().unwrap_or(0);
        let mut wanted = CapturePlan {
            captures: Vec::new(),
            cells: vec![Vec::new(); cores],
            keys,
            begins,
        };
        for core in 0..cores {
            let of_core = wanted.keys.iter().filter(|(_, key)| key.core == core);
            let of_core: Vec<u32> = of_core.map(|(_, key)| key.on_core).collect();
            let starts = core == wanted.keys[0].1.core || !waits;
            wanted.captures.push(Capture {
                keys: of_core,
                cells: Vec::new(),
                ticks,
                after: after.min(ticks - 1),
                trigger: starts.then_some(trigger),
                group: 1 + std::process::id(),
            });
        }
        for name in &self.cells {
            let cell = known.cell(name)?;
            let of_core = wanted.captures.get_mut(cell.core);
            let own = of_core.filter(|own| !own.keys.is_empty()).ok_or_else(|| {
                Failure::Usage(format!("--cells {name}: no key of its core is captured"))
            })?;
            own.cells.push(cell.address);
            wanted.cells[cell.core].push(name.clone());
        }
        for own in &wanted.captures {
            own.setting(0)
                .map_err(|why| Failure::Usage(why.to_string()))?;
        }
        Ok(wanted)
    }

    /// What it waits for, and whether the program begins anew.
    fn trigger(&self, compiled: &Compiled, first: &PlacedKey) -> Result<(Trigger, bool), Failure> {
        let wrong = |why: &str| Failure::Usage(format!("--trigger {}: {why}", self.trigger));
        let text = self.trigger.as_str();
        match text {
            "now" => return Ok((Trigger::Now, false)),
            "begin" => return Ok((Trigger::Now, true)),
            _ => {}
        }
        let Some((what, level)) = text.split_once(':') else {
            let events = &compiled.lowered.kernel.events;
            let found = events.iter().position(|event| event.name == text);
            let names: Vec<&str> = events.iter().map(|event| event.name.as_str()).collect();
            let index = found.ok_or_else(|| {
                wrong(&format!(
                    "wanted is now, begin, x:4mm, drive:2N or an event: {}",
                    names.join(", ")
                ))
            })?;
            let number = first.zone.layout().number(0).map(|_| first.on_core);
            return Ok((Trigger::Event(index as u32, number), false));
        };
        let dim = |dim: Dim| {
            let quantity = parse_quantity(level).is_ok();
            let value = option::quantity(
                level,
                dim,
                "a position, such as x:4mm, or a force, drive:2N",
            );
            value.map_err(|why| {
                wrong(if quantity {
                    &why
                } else {
                    "the level is no quantity"
                })
            })
        };
        let scales = compiled.scales.first();
        let scales = scales.ok_or_else(|| wrong("the instrument senses nothing"))?;
        let rounded = |value: f64, low: f64, high: f64| value.round().clamp(low, high);
        match what {
            "x" => {
                let place = dim(compiled.model.senses[0].dim)?;
                let word = (place - scales.sensor_zero) / scales.sensor_lsb;
                Ok((
                    Trigger::Sensor(0, rounded(word, 0.0, 65_535.0) as u16),
                    false,
                ))
            }
            "drive" => {
                let force = dim(compiled.model.dim_of_driven(0))?;
                let word = rounded(force / scales.drive_lsb, -32_768.0, 32_767.0);
                Ok((Trigger::Drive(0, word as i16), false))
            }
            _ => Err(wrong("a level is of x or of drive")),
        }
    }

    /// Captures, waits, compares, writes.
    pub fn run<L: Link>(
        &self,
        known: &KnownBoard,
        facts: &Facts,
        client: &mut Client<L>,
        as_json: bool,
    ) -> Outcome {
        let wanted = self.wanted(known)?;
        self.check_room(facts, &wanted)?;
        let block = |core: usize| facts.word([Fact::Capture0, Fact::Capture1][core.min(1)]);
        // The one that waits for its trigger comes last, lest it has it before the other one waits.
        let mut order: Vec<usize> = (0..wanted.captures.len()).collect();
        order.sort_by_key(|core| *core == wanted.keys[0].1.core);
        for core in order {
            let own = &wanted.captures[core];
            if !own.keys.is_empty() {
                let setting = own.setting(block(core)).map_err(failure)?;
                client.capture(core as u32, &setting).map_err(failure)?;
            }
        }
        if wanted.begins {
            self.begin(known, client, facts.word(Fact::Status))?;
        }
        let measured = self.wait(facts, client, &wanted)?;
        let mut differ = 0;
        let mut sections = Vec::new();
        for (number, placed) in &wanted.keys {
            let told = Told {
                args: self,
                known,
                wanted: &wanted,
                key: (*number, placed),
                measured: &measured[placed.core],
                as_json,
            };
            differ += told.tell(client, &mut sections)?;
        }
        told::lost(client.lost_answers(), as_json);
        if let Some(path) = &self.report {
            let title = format!(
                "{} on the board",
                known.setup.first().model.name.replace('_', " ")
            );
            report(path, &title, sections)?;
        }
        match differ {
            0 => Ok(()),
            _ => Err(Failure::Program),
        }
    }

    /// That the board has memory for what is wanted.
    fn check_room(&self, facts: &Facts, wanted: &CapturePlan) -> Outcome {
        for (core, own) in wanted.captures.iter().enumerate() {
            let room = capture_room(facts, core);
            let most = own.ticks_max(room.end.saturating_sub(room.start));
            if own.ticks > most {
                return Err(Failure::Usage(format!(
                    "--seconds {}: core {core} has memory for {:.3} s of these",
                    self.seconds,
                    f64::from(most) / facts.rate_hz()
                )));
            }
        }
        Ok(())
    }

    /// Has the program that plays begin anew.
    fn begin<L: Link>(&self, known: &KnownBoard, client: &mut Client<L>, at: u32) -> Outcome {
        let status = whippen_runtime::monitor::read_status(client, at).map_err(failure)?;
        let playing = status
            .cores
            .first()
            .and_then(|core| core.program)
            .unwrap_or(0);
        let programs = known.programs();
        let other = (playing + programs) % (2 * programs);
        client.play(other).map_err(failure)
    }

    /// Waits for the ends of all captures.
    fn wait<L: Link>(
        &self,
        facts: &Facts,
        client: &mut Client<L>,
        wanted: &CapturePlan,
    ) -> Result<Vec<CapturedRows>, Failure> {
        let deadline = Instant::now() + Duration::from_secs_f64(self.wait + self.seconds);
        let stop = interrupt::stops();
        let mut all = Vec::new();
        for (core, own) in wanted.captures.iter().enumerate() {
            let block = facts.word([Fact::Capture0, Fact::Capture1][core.min(1)]);
            loop {
                if own.keys.is_empty() {
                    let nothing = CapturedRows {
                        rows: Vec::new(),
                        trigger_tick: 0,
                        is_over: true,
                    };
                    all.push(nothing);
                    break;
                }
                let next = client.read(block + captured::NEXT, 1).map_err(failure)?;
                if next.first() == Some(&0) {
                    all.push(rows_of(client, own, block).map_err(failure)?);
                    break;
                }
                if stop.load(Ordering::Relaxed) {
                    return Err(Failure::Interrupted);
                }
                if Instant::now() > deadline {
                    let why = format!("the trigger `{}` did not come", self.trigger);
                    return Err(failure(MonitorError::Refused(why)));
                }
                std::thread::sleep(PAUSE);
            }
        }
        Ok(all)
    }
}

/// What is told of a key.
struct Told<'a> {
    args: &'a CaptureArgs,
    known: &'a KnownBoard<'a>,
    wanted: &'a CapturePlan<'a>,
    key: (u32, &'a PlacedKey<'a>),
    measured: &'a CapturedRows,
    as_json: bool,
}

impl Told<'_> {
    /// Compares and writes; how many drive words differ.
    fn tell<L: Link>(
        &self,
        client: &mut Client<L>,
        sections: &mut Vec<Section>,
    ) -> Result<usize, Failure> {
        let (number, placed) = self.key;
        let capture = &self.wanted.captures[placed.core];
        let (rows, begins) = self.rows()?;
        let at = capture.keys.iter().position(|key| *key == placed.on_core);
        let at = at.ok_or_else(|| Failure::Defect("a key that is not captured".to_string()))?;
        let lives = self.known.live_words(client, placed.instrument)?;
        let setup = self.known.setup;
        let model = self.known.instrument(placed).model.clone();
        let observed = load::compiled_silently(&setup.map, model, &setup.device)?;
        let replay = Replay {
            compiled: &observed,
            device: &setup.device,
            rows,
            key: at,
            begins,
            lives: &lives,
            cells: &self.wanted.cells[placed.core],
        };
        let found = replay.difference().map_err(Failure::Defect)?;
        self.say(number, rows, &found);
        if self.args.out.is_some() || self.args.report.is_some() {
            self.write(&replay, number, sections)?;
        }
        Ok(found.differ)
    }

    /// The rows that follow from each other: from the first of the key on, or behind the last tick
    /// that is not there.
    fn rows(&self) -> Result<(&[CapturedRow], bool), Failure> {
        let rows = &self.measured.rows[..];
        let gap = |two: &[CapturedRow]| two[1].tick != two[0].tick.wrapping_add(1);
        let mut gaps = (1..).zip(rows.windows(2)).filter(|(_, two)| gap(two));
        let first = gaps.next().map(|(at, _)| at);
        let last = gaps.last().map(|(at, _)| at).or(first);
        if !self.wanted.begins {
            if let Some(at) = last {
                tell!(
                    "note: ticks are missing before tick {}; rows from there on count",
                    rows[at].tick
                );
            }
            return Ok((&rows[last.unwrap_or(0)..], false));
        }
        let begun = first.map(|at| at + self.key.1.on_core as usize);
        match (begun, first == last) {
            (Some(at), true) if at + 1 < rows.len() => Ok((&rows[at..], true)),
            (_, false) => Err(failure(MonitorError::Refused(
                "ticks were missed while the program began".to_string(),
            ))),
            _ => Err(failure(MonitorError::Refused(
                "the program did not begin while it was captured: give it more --seconds"
                    .to_string(),
            ))),
        }
    }

    fn say(&self, number: u32, rows: &[CapturedRow], found: &Difference) {
        let first = found.first.and_then(|at| rows.get(at)).map(|row| row.tick);
        let rate_hz = f64::from(self.known.setup.first().model.rate_hz);
        let seconds = rows.len() as f64 / rate_hz;
        if self.as_json {
            let object = json!({
                "kind": "capture",
                "key": number,
                "ticks": rows.len(),
                "first_tick": rows.first().map(|row| row.tick),
                "trigger_tick": self.measured.trigger_tick,
                "compared": found.compared,
                "differ": found.differ,
                "most": found.most,
                "first_that_differs": first,
            });
            say!("{object}");
            return;
        }
        say!(
            "key {number}: {} ticks ({:.1} ms), trigger in tick {}; {} of {} drive words differ from \
             jit's on the measured words{}",
            rows.len(),
            1e3 * seconds,
            self.measured.trigger_tick,
            found.differ,
            found.compared,
            match first {
                Some(tick) => format!(", by {} at most, the first in tick {tick}", found.most),
                None => String::new(),
            }
        );
    }

    /// The trace and the section of the page.
    fn write(&self, replay: &Replay, number: u32, sections: &mut Vec<Section>) -> Outcome {
        let outputs = Outputs {
            out: self.args.out.iter().cloned().collect(),
            report: self.args.report.clone(),
            every: 1,
            columns: vec![ALL.to_string()],
            ..Outputs::default()
        };
        let rate_hz = f64::from(replay.compiled.model.rate_hz);
        let first_s = replay.rows.first().map_or(0.0, |row| {
            f64::from(row.tick.wrapping_sub(self.measured.trigger_tick) as i32) / rate_hz
        });
        let mut refused = None;
        let recording = |columns: Vec<Recorded>| {
            let made = outputs.recording(columns, replay.compiled, EngineKind::Jit);
            made.map_err(|why| {
                refused = Some(why);
                RunError::Engine(String::new())
            })
        };
        let run = replay.run(recording, first_s);
        if let Some(why) = refused {
            return Err(why);
        }
        let run = run.map_err(|why| Failure::Usage(why.to_string()))?;
        outputs.finish(replay.compiled, &run)?;
        let motion = [format!(
            "measured on the board, key {number}, in every tick; times are from the trigger on; what is \
             computed is jit's, on the measured words"
        )];
        let made = Made {
            engine: EngineKind::Jit,
            motion: &motion,
            device: replay.device,
            settings: &[],
            sources: self.known.sources,
        };
        sections.push(Section::of_run(replay.compiled, &run, &made));
        if let Some(path) = &self.args.out {
            say!("trace: {}", path.display());
        }
        Ok(())
    }
}
