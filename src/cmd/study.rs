//! `whippen study`: the page of a plan, its sessions played again, its results.

use std::path::{Path, PathBuf};

use clap::ValueHint;
use whippen_compiler::bundled::INSTRUMENTS;
use whippen_compiler::check::Options;
use whippen_compiler::diag::nearest;
use whippen_compiler::pipeline::Compiled;
use whippen_runtime::device::Device;
use whippen_runtime::files::{FileError, InputKind, read_text, write_whole};
use whippen_runtime::playable::PlayablePage;
use whippen_runtime::preset;
use whippen_runtime::study::{self, Condition, ConditionPage, Plan, SessionRow};

use super::file_plan::FilePlan;
use super::opened::Opened;
use super::{command, page};
use crate::exit::{Failure, Outcome};
use crate::hardware::PRESET;
use crate::say::say;

#[derive(Debug, clap::Args)]
#[command(
    after_help = "Example: whippen study examples/study/rubbing.toml -o study.html\n\
                  Example: whippen study examples/study/rubbing.toml --replay session-1.csv\n\
                  Example: whippen study examples/study/rubbing.toml --results session-*.csv -o results.html"
)]
pub struct Args {
    /// The plan
    #[arg(value_name = "PLAN.toml", value_hint = ValueHint::FilePath)]
    plan: PathBuf,
    /// The page of the study, or of its results
    #[arg(short, long, value_name = "FILE.html", value_hint = ValueHint::FilePath)]
    output: Option<PathBuf>,
    /// Play what was played in these sessions again: the words must be those that the page heard
    #[arg(long, value_name = "SESSION.csv", num_args = 1.., conflicts_with_all = ["output", "results"], value_hint = ValueHint::FilePath)]
    replay: Vec<PathBuf>,
    /// Sum these sessions up: box plots and tests
    #[arg(long, value_name = "SESSION.csv", num_args = 1.., requires = "output", value_hint = ValueHint::FilePath)]
    results: Vec<PathBuf>,
}

pub fn run(args: &Args) -> Outcome {
    FilePlan::default()
        .reads([&args.plan])
        .reads(&args.replay)
        .reads(&args.results)
        .writes("--output", &args.output, &["html"])
        .check()?;
    let text = read_text(&args.plan, InputKind::DESCRIPTION).map_err(usage)?;
    let plan = Plan::read(&args.plan, &text).map_err(usage)?;
    match (&args.output, args.replay.is_empty()) {
        (_, false) => replay(args, &plan),
        (Some(output), _) if !args.results.is_empty() => results(args, &plan, output),
        (Some(output), _) => make(args, &plan, output),
        (None, _) => Err(Failure::Usage(
            "say what to make: `-o study.html`, `--replay SESSION.csv`, or `--results SESSION.csv .. -o results.html`"
                .to_string(),
        )),
    }
}

fn usage(error: FileError) -> Failure {
    Failure::Usage(error.to_string())
}

fn at(args: &Args, condition: &Condition, what: impl Into<String>) -> Failure {
    usage(FileError::new(&args.plan, what).at_line(condition.line))
}

/// What a condition plays.
fn played(args: &Args, condition: &Condition) -> Result<(Compiled, Device, PlayablePage), Failure> {
    let bundled = INSTRUMENTS
        .iter()
        .find(|(file, _)| file.strip_suffix(".whip") == Some(&condition.program));
    let sources = match bundled {
        Some((file, text)) => vec![(file.to_string(), text.to_string())],
        None if condition.program.ends_with(".whip") => {
            let folder = args.plan.parent().unwrap_or(Path::new(""));
            Opened::files(&[folder.join(&condition.program)])?.sources
        }
        None => {
            let names = INSTRUMENTS.iter();
            let names = names.map(|(file, _)| file.trim_end_matches(".whip"));
            let near = nearest(&condition.program, names);
            let near = near.map_or(String::new(), |near| format!("; did you mean `{near}`?"));
            let name = &condition.program;
            let what = format!(
                "there is no bundled program `{name}`{near}; a file of your own ends in .whip"
            );
            return Err(at(args, condition, what));
        }
    };
    let mut sets = match &condition.preset {
        None => Vec::new(),
        Some(named) => {
            let folder = args.plan.parent().unwrap_or(Path::new(""));
            let preset = match PRESET.file(named.as_ref()) {
                Some(path) => preset::load(&folder.join(path)).map_err(usage)?,
                None => preset::bundled(named)
                    .ok_or_else(|| at(args, condition, PRESET.absent(named.as_ref())))?,
            };
            preset.sets
        }
    };
    sets.retain(|(name, _)| condition.sets.iter().all(|(own, _)| own != name));
    sets.extend(condition.sets.iter().cloned());
    let options = Options {
        sets,
        ..Options::default()
    };
    let command = format!("whippen study {}", args.plan.display());
    let (compiled, device, page) = page::of_condition(&sources, &options, &command)?;
    let lives: Vec<&str> = (compiled.model.lives.iter())
        .map(|live| live.name.as_str())
        .collect();
    if let Some(knob) = condition
        .knobs
        .iter()
        .find(|knob| !lives.contains(&knob.as_str()))
    {
        let near = nearest(knob, lives.iter().copied());
        let near = near.map_or(String::new(), |near| format!("; did you mean `{near}`?"));
        let what = format!("`{}` has no live value `{knob}`{near}", compiled.model.name);
        return Err(at(args, condition, what));
    }
    Ok((compiled, device, page))
}

/// That the targets of a plan are events of what is played.
fn check_targets(args: &Args, plan: &Plan, condition: &Condition, of: &Compiled) -> Outcome {
    for target in plan.tasks.iter().filter_map(|task| task.target.as_ref()) {
        let emissions = of.model.emissions.iter();
        let found = emissions.clone().find(|one| one.name == target.event);
        let has = found.is_some_and(|one| one.args.iter().any(|arg| arg.0 == target.argument));
        if !has {
            let what = format!(
                "`{}` emits no `{}` with `{}`, which a task has as its target",
                of.model.name, target.event, target.argument
            );
            return Err(at(args, condition, what));
        }
    }
    Ok(())
}

fn make(args: &Args, plan: &Plan, output: &Path) -> Outcome {
    let mut playing = Vec::new();
    for condition in &plan.conditions {
        let (compiled, _, page) = played(args, condition)?;
        check_targets(args, plan, condition, &compiled)?;
        playing.push(ConditionPage {
            html: page.html,
            rate_hz: f64::from(compiled.model.rate_hz),
        });
    }
    let html = study::page(plan, &playing, &command::typed()).map_err(Failure::Defect)?;
    write_whole(output, |w| w.write_all(html.as_bytes())).map_err(usage)?;
    let count = plan.conditions.len();
    say!(
        "{}: {} bytes; {count} conditions in the order of {}, {} rows: balanced for every {} participants",
        output.display(),
        html.len(),
        study::kind(count),
        study::rows(count),
        study::rows(count)
    );
    Ok(())
}

/// The rows of sessions, each participant once.
fn sessions(paths: &[PathBuf]) -> Result<Vec<SessionRow>, Failure> {
    let mut all: Vec<SessionRow> = Vec::new();
    for path in paths {
        let rows = study::read(path).map_err(usage)?;
        let known =
            |row: &&SessionRow| all.iter().any(|other| other.participant == row.participant);
        if let Some(row) = rows.iter().find(known) {
            let what = format!("participant {} is in two sessions", row.participant);
            return Err(usage(FileError::new(path, what).at_line(row.line)));
        }
        all.extend(rows);
    }
    Ok(all)
}

fn results(args: &Args, plan: &Plan, output: &Path) -> Outcome {
    let rows = sessions(&args.results)?;
    let (html, told) = study::results(plan, &rows, &command::typed()).map_err(Failure::Usage)?;
    write_whole(output, |w| w.write_all(html.as_bytes())).map_err(usage)?;
    say!("{}{}: {} bytes", told, output.display(), html.len());
    Ok(())
}

fn replay(args: &Args, plan: &Plan) -> Outcome {
    let mut all_same = true;
    for path in &args.replay {
        let rows = study::read(path).map_err(usage)?;
        let gestures = rows.iter().filter(|row| row.kind == "gesture");
        let mut count = 0;
        for row in gestures {
            let wrong = |what: String| usage(FileError::new(path, what).at_line(row.line));
            let condition = plan.conditions.iter();
            let condition = condition.clone().find(|one| one.name == row.condition);
            let condition = condition
                .ok_or_else(|| wrong(format!("the plan has no condition `{}`", row.condition)))?;
            let ticks = row.answer.parse();
            let ticks =
                ticks.map_err(|_| wrong(format!("`{}` is no number of ticks", row.answer)))?;
            let (compiled, device, _) = played(args, condition)?;
            let found = study::digests(&compiled, &device, &row.data, ticks).map_err(wrong)?;
            let words = rows.iter().find(|other| {
                other.kind == "words" && other.condition == row.condition && other.item == row.item
            });
            let heard = words.map_or("", |words| words.data.as_str());
            let heard: Vec<&str> = heard.split_whitespace().collect();
            let differs = (0..found.len().max(heard.len()))
                .find(|at| heard.get(*at).copied() != found.get(*at).map(String::as_str));
            let what = format!("{}, {}, {}", path.display(), row.condition, row.item);
            match differs {
                None => say!("{what}: the same words, {ticks} ticks"),
                Some(second) => say!("{what}: other words in second {second}"),
            }
            all_same &= differs.is_none();
            count += 1;
        }
        if count == 0 {
            let what = "there is no gesture in it";
            return Err(usage(FileError::new(path, what)));
        }
    }
    match all_same {
        true => Ok(()),
        false => Err(Failure::Program),
    }
}
