//! `whippen experiment`: plays an experiment, draws its figure, and says whether what it asserts
//! holds.

mod play;
mod shown;

use std::ffi::OsString;
use std::path::{Path, PathBuf};

use clap::ValueHint;
use whippen_runtime::engine::EngineKind;
use whippen_runtime::experiment::{Experiment, bundled::EXPERIMENTS};
use whippen_runtime::files::{InputKind, read_text};
use whippen_runtime::plot;
use whippen_runtime::report::Page;

use super::command;
use super::file_plan::FilePlan;
use crate::exit::{Failure, Outcome};
use crate::interrupt;
use crate::say::{say, tell};
use play::{Places, Played, play};

#[derive(Debug, clap::Args)]
#[command(
    after_help = "Example: whippen experiment figure-16 --plot figure-16.png\n\
                  Example: whippen experiment all --report gallery.html\n\
                  Example: whippen experiment mine.toml --json"
)]
pub struct Args {
    /// Bundled experiments by name, files of your own, or `all` that are bundled; without any, a
    /// list of those
    #[arg(value_name = "NAME|all|FILE.toml", value_hint = ValueHint::FilePath)]
    words: Vec<OsString>,
    /// What runs the instruments: jit (compiled, fixed point), interp (the reference) or ideal
    /// (f64)
    #[arg(long, default_value = "jit")]
    engine: EngineKind,
    /// Folder of the recordings that some experiments play: their descriptions (`kawai.toml`), and
    /// what these describe; without it, that of the experiment's file
    #[arg(long, value_name = "FOLDER", value_hint = ValueHint::DirPath)]
    recordings: Option<PathBuf>,
    /// Picture of the only experiment
    #[arg(long, value_name = "FILE.svg|FILE.png", value_hint = ValueHint::FilePath)]
    plot: Vec<PathBuf>,
    /// Folder for a picture of each, NAME.svg
    #[arg(long, value_name = "FOLDER", value_hint = ValueHint::DirPath)]
    pictures: Option<PathBuf>,
    /// Gallery: all figures and assertions on one page that needs no network
    #[arg(long, value_name = "FILE.html", value_hint = ValueHint::FilePath)]
    report: Option<PathBuf>,
    /// Print a JSON line for each experiment, and nothing else
    #[arg(long)]
    json: bool,
}

/// An experiment, and where it stands.
struct Asked {
    experiment: Experiment,
    /// Its file; none for a bundled one.
    file: Option<PathBuf>,
}

impl Asked {
    fn places<'p>(&'p self, args: &'p Args) -> Places<'p> {
        Places {
            file: self.file.as_deref(),
            recordings: args.recordings.as_deref(),
        }
    }

    /// The picture of `--pictures`.
    fn picture(&self, folder: &Path) -> PathBuf {
        folder.join(format!("{}.svg", self.experiment.name))
    }
}

pub fn run(args: &Args) -> Outcome {
    if args.words.is_empty() {
        return list(args);
    }
    if args.engine.board().is_some() {
        let why = "the engine `emulated` keeps no values from inside of ticks; use jit, which is bit for bit the same";
        return Err(Failure::Usage(why.to_string()));
    }
    let wanted = wanted(args)?;
    if !args.plot.is_empty() && wanted.len() > 1 {
        let why = "--plot draws one experiment; give `--pictures FOLDER` for several";
        return Err(Failure::Usage(why.to_string()));
    }
    plan(args, &wanted)?.check()?;
    let stop = interrupt::stops();
    let (mut all_held, mut done) = (true, 0);
    let mut sections = Vec::new();
    let mut rows = Vec::new();
    for one in &wanted {
        let played = match play(&one.experiment, one.places(args), args.engine, stop) {
            Err(Failure::Interrupted) => break,
            played => played?,
        };
        done += 1;
        all_held &= played.held();
        draw(args, one, &played)?;
        if args.json {
            say!("{}", shown::json(&played));
        } else {
            shown::tell(&played);
        }
        if args.report.is_some() {
            sections.push(shown::section(&played));
            rows.push(shown::row(&played));
        }
    }
    if let Some(path) = &args.report {
        let page = Page {
            title: "Experiments".into(),
            command: command::typed(),
            overview: Some(shown::overview(rows)),
            sections,
        };
        page.save(path).map_err(|e| Failure::Usage(e.to_string()))?;
        written(args, "report", path);
    }
    if done < wanted.len() {
        let all = wanted.len();
        tell!("interrupted: {done} of {all} experiments were played, and are kept");
        return Err(Failure::Interrupted);
    }
    if all_held {
        Ok(())
    } else {
        Err(Failure::Program)
    }
}

fn draw(args: &Args, one: &Asked, played: &Played) -> Outcome {
    let of_folder = args.pictures.as_ref().map(|folder| one.picture(folder));
    for path in args.plot.iter().chain(&of_folder) {
        let figure = played.bound.figure(&played.trace);
        plot::save(&figure, path).map_err(|e| Failure::Usage(e.to_string()))?;
        written(args, "plot", path);
    }
    Ok(())
}

fn written(args: &Args, what: &str, path: &Path) {
    if !args.json {
        say!("{what}: {}", path.display());
    }
}

fn list(args: &Args) -> Outcome {
    if !args.plot.is_empty() || args.pictures.is_some() || args.report.is_some() || args.json {
        let why = "name an experiment, or `all`; `whippen experiment` alone lists them";
        return Err(Failure::Usage(why.to_string()));
    }
    for (file, text) in EXPERIMENTS {
        let experiment = bundled(file, text)?;
        let source = &experiment.source;
        let source = if source.is_empty() {
            String::new()
        } else {
            format!(" ({source})")
        };
        say!("{:<20} {}{source}", experiment.name, experiment.title);
    }
    Ok(())
}

/// A bundled experiment can be read, or Whippen is wrong.
fn bundled(file: &str, text: &str) -> Result<Experiment, Failure> {
    let path = Path::new("instruments/experiments").join(file);
    Experiment::read(&path, text).map_err(|e| Failure::Defect(e.to_string()))
}

/// The experiments of the command line; `all` are those whose recordings are at hand.
fn wanted(args: &Args) -> Result<Vec<Asked>, Failure> {
    let mut all = Vec::new();
    for word in &args.words {
        let path = Path::new(word);
        let named = |file: &str| word.to_str() == file.strip_suffix(".toml");
        let found = EXPERIMENTS
            .iter()
            .filter(|(file, _)| word == "all" || named(file));
        let found: Vec<_> = found.collect();
        if path.extension().is_some_and(|ending| ending == "toml") {
            let text = read_text(path, InputKind::DESCRIPTION);
            let text = text.map_err(|e| Failure::Usage(e.to_string()))?;
            let experiment = Experiment::read(path, &text);
            all.push(Asked {
                experiment: experiment.map_err(|e| Failure::Usage(e.to_string()))?,
                file: Some(path.to_path_buf()),
            });
        } else if found.is_empty() {
            return Err(absent(word));
        } else {
            for (file, text) in found {
                let one = Asked {
                    experiment: bundled(file, text)?,
                    file: None,
                };
                if word == "all" && !one.places(args).suffice(&one.experiment) {
                    let name = &one.experiment.name;
                    tell!("left out: {name} plays a recording (--recordings FOLDER)");
                } else {
                    all.push(one);
                }
            }
        }
    }
    Ok(all)
}

fn absent(word: &OsString) -> Failure {
    let names = EXPERIMENTS
        .iter()
        .map(|(file, _)| file.trim_end_matches(".toml"));
    let names: Vec<&str> = names.collect();
    Failure::Usage(format!(
        "there is no experiment `{}`; there are {}; a file of your own ends in .toml (docs/how-to/experiment.md)",
        word.display(),
        names.join(", ")
    ))
}

/// What is read and written.
fn plan(args: &Args, wanted: &[Asked]) -> Result<FilePlan, Failure> {
    let mut plan = FilePlan::default();
    for one in wanted {
        plan = plan.reads(&one.file);
        plan = plan.reads(&play::files(&one.experiment, one.places(args))?);
    }
    let pictures: Vec<PathBuf> = match &args.pictures {
        Some(folder) => wanted.iter().map(|one| one.picture(folder)).collect(),
        None => Vec::new(),
    };
    Ok(plan
        .writes("--plot", &args.plot, &["svg", "png"])
        .writes("--pictures", &pictures, &["svg"])
        .writes("--report", &args.report, &["html"]))
}
