//! `run [keys=N] [ticks=N] [cells] NAME=1,2,3/4,5,6 ..`: both engines, fed tick by tick.
//!
//! A name is an input, a live value or a cell (its word 0); values stand by tick, the last one
//! stays; those after a slash are the next key's. What is printed comes from the interpreter in
//! checked mode; that the host code does the same, to the byte, is a condition. `cells` prints all
//! cells after the last tick.

use std::fmt::Write;
use whippen_compiler::jit::{JitCode, Options};
use whippen_compiler::kernel::{Interp, Kernel};

/// Values for one name: for each key, tick by tick.
struct Feed {
    name: String,
    target: Target,
    keys: Vec<Vec<i64>>,
}

#[derive(Clone, Copy)]
enum Target {
    Input(usize),
    Live(usize),
    Cell(usize),
}

impl Feed {
    fn parse(kernel: &Kernel, word: &str) -> Result<Feed, String> {
        let (name, values) = word
            .split_once('=')
            .ok_or_else(|| format!("what is `{word}`?"))?;
        let target =
            target(kernel, name).ok_or_else(|| format!("no input, live value or cell `{name}`"))?;
        let number = |text: &str| {
            text.parse::<i64>()
                .map_err(|error| format!("{text}: {error}"))
        };
        let keys = values
            .split('/')
            .map(|key| key.split(',').map(number).collect())
            .collect::<Result<_, _>>()?;
        Ok(Feed {
            name: name.to_string(),
            target,
            keys,
        })
    }

    fn value(&self, key: usize, tick: usize) -> i64 {
        let values = &self.keys[key.min(self.keys.len() - 1)];
        values[tick.min(values.len() - 1)]
    }

    fn ticks(&self) -> usize {
        self.keys.iter().map(Vec::len).max().unwrap_or_default()
    }
}

fn target(kernel: &Kernel, name: &str) -> Option<Target> {
    let input = kernel
        .inputs
        .iter()
        .position(|port| port.name == name)
        .map(Target::Input);
    let live = || {
        kernel
            .lives
            .iter()
            .position(|live| live.name == name)
            .map(Target::Live)
    };
    let cell = || {
        kernel
            .cells
            .iter()
            .position(|cell| cell.name == name)
            .map(Target::Cell)
    };
    input.or_else(live).or_else(cell)
}

/// Runs a kernel.
pub fn run(text: &str, words: &[&str]) -> Result<String, String> {
    let number = |name: &str| {
        words
            .iter()
            .find_map(|word| word.strip_prefix(name)?.parse::<usize>().ok())
    };
    let options = ["keys=", "ticks=", "cells"];
    let feeds: Vec<&str> = words
        .iter()
        .copied()
        .filter(|word| !options.iter().any(|option| word.starts_with(option)))
        .collect();
    let mut session = Session::new(text, &feeds, number("keys=").unwrap_or(1))?;
    session.all_ticks(number("ticks=").unwrap_or(session.longest()))?;
    if words.contains(&"cells") {
        session.print_cells();
    }
    Ok(session.printed)
}

/// A run of one key as rows: what is fed in a tick, and what comes of it; before them the names of
/// both.
pub fn rows(text: &str, feeds: &[&str]) -> Result<Vec<[Vec<String>; 2]>, String> {
    let mut session = Session::new(text, feeds, 1)?;
    let (outputs, probes) = (&session.kernel.outputs, &session.kernel.probes);
    let fed = session.feeds.iter().map(|feed| feed.name.clone());
    let given = outputs.iter().map(|port| port.name.clone());
    let given = given.chain(probes.iter().map(|probe| probe.name.clone()));
    session.rows = vec![[fed.collect(), given.collect()]];
    session.all_ticks(session.longest())?;
    Ok(session.rows)
}

struct Session {
    kernel: Kernel,
    interp: Interp,
    code: JitCode,
    feeds: Vec<Feed>,
    keys: usize,
    printed: String,
    rows: Vec<[Vec<String>; 2]>,
}

impl Session {
    fn new(text: &str, feeds: &[&str], keys: usize) -> Result<Session, String> {
        let kernel = super::kernel::verified(text)?;
        let feeds = feeds
            .iter()
            .map(|word| Feed::parse(&kernel, word))
            .collect::<Result<Vec<_>, _>>()?;
        let error = |error: whippen_compiler::kernel::EngineError| error.to_string();
        Ok(Session {
            interp: Interp::checked(&kernel, keys).map_err(error)?,
            code: JitCode::build(&kernel, keys, Options { probes: true }).map_err(error)?,
            kernel,
            feeds,
            keys,
            printed: String::new(),
            rows: Vec::new(),
        })
    }

    /// Ticks until every value has been fed.
    fn longest(&self) -> usize {
        self.feeds.iter().map(Feed::ticks).max().unwrap_or(1)
    }

    fn all_ticks(&mut self, ticks: usize) -> Result<(), String> {
        let words = self.words(0)?;
        self.interp.init(&words);
        self.code.init(&words);
        for tick in 0..ticks {
            let words = self.words(tick)?;
            let mut out = [
                vec![0; self.keys * self.kernel.outputs.len()],
                vec![0; self.keys * self.kernel.outputs.len()],
            ];
            self.feed(tick)?;
            self.interp.tick(&words, &mut out[0]);
            self.code.tick(&words, &mut out[1]);
            if let Some(violation) = self.interp.violation() {
                return Err(format!("tick {tick}: {violation}"));
            }
            if out[0] != out[1] || self.interp.memory() != self.code.memory() {
                let (left, right) = (self.interp.memory(), self.code.memory());
                return Err(format!(
                    "tick {tick}: interp and jit differ\n{out:?}\n{left:?}\n{right:?}"
                ));
            }
            (0..self.keys).for_each(|key| self.print(tick, key, &out[0]));
            self.print_events()?;
        }
        Ok(())
    }

    /// Input words of a tick.
    fn words(&self, tick: usize) -> Result<Vec<u16>, String> {
        let mut words = vec![0; self.keys * self.kernel.inputs.len()];
        for key in 0..self.keys {
            for feed in &self.feeds {
                if let Target::Input(port) = feed.target {
                    let word =
                        u16::try_from(feed.value(key, tick)).map_err(|error| error.to_string())?;
                    words[key * self.kernel.inputs.len() + port] = word;
                }
            }
        }
        Ok(words)
    }

    /// Sets live values and cells.
    fn feed(&mut self, tick: usize) -> Result<(), String> {
        for feed in &self.feeds {
            for key in 0..self.keys {
                let value = feed.value(key, tick);
                let done = match feed.target {
                    Target::Input(_) => Ok(()),
                    Target::Live(live) => self
                        .interp
                        .set_live(live, value as i32)
                        .and_then(|()| self.code.set_live(live, value as i32)),
                    Target::Cell(cell) => self
                        .interp
                        .set_cell(key, cell, 0, value)
                        .and_then(|()| self.code.set_cell(key, cell, 0, value)),
                };
                done.map_err(|error| format!("{}: {error}", feed.name))?;
            }
        }
        Ok(())
    }

    fn print(&mut self, tick: usize, key: usize, out: &[i16]) {
        let _ = write!(self.printed, "tick {tick}");
        if self.keys > 1 {
            let _ = write!(self.printed, " key {key}");
        }
        self.printed.push(':');
        let results = self.results(key, out);
        let fed: Vec<String> = self
            .feeds
            .iter()
            .map(|feed| feed.value(key, tick).to_string())
            .collect();
        for (feed, value) in self.feeds.iter().zip(&fed) {
            let _ = write!(self.printed, " {}={value}", feed.name);
        }
        self.printed += " ->";
        for (name, value) in &results {
            let _ = write!(self.printed, " {name}={value}");
        }
        self.printed.push('\n');
        self.rows
            .push([fed, results.into_iter().map(|(_, value)| value).collect()]);
    }

    /// Outputs and probes of a key, by name.
    fn results(&self, key: usize, out: &[i16]) -> Vec<(String, String)> {
        let (outputs, probes) = (&self.kernel.outputs, &self.kernel.probes);
        let output = |(at, port): (usize, &whippen_compiler::kernel::Port)| {
            (port.name.clone(), out[key * outputs.len() + at].to_string())
        };
        let of_outputs = outputs.iter().enumerate().map(output);
        let of_probes = probes.iter().enumerate().map(|(at, probe)| {
            let value = self.interp.probes()[key * probes.len() + at].to_string();
            (probe.name.clone(), value)
        });
        of_outputs.chain(of_probes).collect()
    }

    fn print_events(&mut self) -> Result<(), String> {
        let events = self.interp.drain_events();
        if events != self.code.drain_events() {
            return Err("events of interp and jit differ".to_string());
        }
        for event in events {
            let name = &self.kernel.events[event.event as usize].name;
            let args: Vec<String> = event.args.iter().map(i32::to_string).collect();
            let _ = writeln!(
                self.printed,
                "tick {} key {}: {name}({})",
                event.tick,
                event.key,
                args.join(", ")
            );
        }
        Ok(())
    }

    fn print_cells(&mut self) {
        for key in 0..self.keys {
            for (at, cell) in self.kernel.cells.iter().enumerate() {
                let words =
                    (0..cell.len as usize).filter_map(|word| self.interp.cell(key, at, word));
                let words: Vec<String> = words.map(|word| word.to_string()).collect();
                let _ = writeln!(self.printed, "key {key} {}: {}", cell.name, words.join(" "));
            }
        }
    }
}
