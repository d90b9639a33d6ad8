//! What names of an experiment stand for: columns and events of its instruments.

use whippen_compiler::diag::nearest;
use whippen_compiler::units::{Dim, shown};

use super::file::Experiment;
use crate::fields::Written;
use crate::files::FileError;
use crate::titles::{identifier, unit_of_suffix};
use crate::trace::Heading;

/// What the columns of a recording are preceded by.
pub const MEASURED: &str = "measured";

/// What one instrument of an experiment has, or a recording.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Part {
    /// What its columns and events are preceded by; empty for the only one.
    pub name: String,
    /// Its columns.
    pub headings: Vec<Heading>,
    /// Its events, and the titles of their arguments.
    pub events: Vec<(String, Vec<String>)>,
    /// Whether it turns.
    pub turns: bool,
}

impl Part {
    /// A name as it is called in the experiment.
    pub fn called(&self, name: &str) -> String {
        if self.name.is_empty() {
            name.to_string()
        } else {
            format!("{}.{name}", self.name)
        }
    }
}

/// A column of the trace of all instruments.
#[derive(Debug, Clone, PartialEq)]
pub struct Found {
    /// Its place in the trace.
    pub at: usize,
    pub heading: Heading,
    pub dim: Dim,
}

impl Found {
    /// A value in its unit.
    pub fn shown(&self, value: f64) -> String {
        let label = self.heading.label(value);
        let number = || match &*self.heading.unit {
            "rad" => format!("{} rad", shown(value, self.dim)),
            _ => shown(value, self.dim),
        };
        label.map_or_else(number, String::from)
    }
}

/// Looks names up.
pub struct Names<'a> {
    pub experiment: &'a Experiment,
    pub parts: &'a [Part],
}

impl Names<'_> {
    /// A column by its title, or by its name where only one has it.
    pub fn column(&self, written: &Written) -> Result<Found, FileError> {
        let error = |what: String| Err(self.experiment.error(written.line, what));
        let (part, first, name) = self.part(written)?;
        let named = |heading: &Heading| {
            heading.title() == name || heading.name == name || identifier(&heading.name) == name
        };
        let all: Vec<usize> = (0..part.headings.len())
            .filter(|i| named(&part.headings[*i]))
            .collect();
        let titled = all.iter().find(|i| part.headings[**i].title() == name);
        let at = match (titled, &all[..]) {
            (Some(at), _) | (None, [at]) => *at,
            (None, []) => {
                let known = || {
                    part.headings
                        .iter()
                        .flat_map(|h| [h.name.clone(), h.title()])
                };
                let near = known().find(|known| nearest(name, [known.as_str()]).is_some());
                let titles = part.headings.iter().map(Heading::title);
                let hint = near.map_or_else(
                    || format!("there are {}", titles.collect::<Vec<_>>().join(", ")),
                    |near| format!("did you mean `{}`?", part.called(&near)),
                );
                return error(format!("there is no column `{}`; {hint}", written.text));
            }
            (None, several) => {
                let titles = several
                    .iter()
                    .map(|at| part.called(&part.headings[*at].title()));
                let titles: Vec<String> = titles.collect();
                return error(format!(
                    "`{}` is several columns: {}",
                    written.text,
                    titles.join(", ")
                ));
            }
        };
        let heading = part.headings[at].clone();
        let dim = unit_of_suffix(&heading.unit).map_or(Dim::NUMBER, |unit| unit.dim);
        Ok(Found {
            at: first + at,
            heading,
            dim,
        })
    }

    /// The full name of an event.
    pub fn event(&self, written: &Written) -> Result<String, FileError> {
        let (part, _, name) = self.part(written)?;
        if let Some((event, _)) = part.events.iter().find(|(event, _)| event == name) {
            return Ok(part.called(event));
        }
        let known: Vec<&str> = part
            .events
            .iter()
            .map(|(event, _)| event.as_str())
            .collect();
        let near = nearest(name, known.iter().copied());
        let hint = near.map_or_else(
            || format!("there are {}", known.join(", ")),
            |near| format!("did you mean `{}`?", part.called(near)),
        );
        let what = format!("there is no event `{}`; {hint}", written.text);
        Err(self.experiment.error(written.line, what))
    }

    /// An event and the title and dimension of its argument: `note.speed`.
    pub fn argument(&self, written: &Written) -> Result<(String, String, Dim), FileError> {
        let error = |what: String| Err(self.experiment.error(written.line, what));
        let Some((event, argument)) = written.text.rsplit_once('.') else {
            return error(format!(
                "`{}` is no argument of an event, such as `note.speed`",
                written.text
            ));
        };
        let event = Written {
            text: event.to_string(),
            line: written.line,
        };
        let (part, _, name) = self.part(&event)?;
        let called = self.event(&event)?;
        let titles = part
            .events
            .iter()
            .find(|(event, _)| event == name)
            .map_or(&[][..], |e| &e.1);
        for title in titles {
            let (own, unit) = crate::titles::split_title(title);
            if own == argument {
                return Ok((
                    called,
                    title.clone(),
                    unit.map_or(Dim::NUMBER, |unit| unit.dim),
                ));
            }
        }
        error(format!(
            "the event `{}` has no argument `{argument}`; it has {}",
            event.text,
            match titles {
                [] => "none".to_string(),
                titles => titles.join(", "),
            }
        ))
    }

    /// The instrument that a name speaks of, the place of its first column, and the rest.
    fn part<'w>(&self, written: &'w Written) -> Result<(&Part, usize, &'w str), FileError> {
        if let [only] = self.parts {
            return Ok((only, 0, &written.text));
        }
        let mut first = 0;
        for part in self.parts {
            let rest = written
                .text
                .strip_prefix(&part.name)
                .and_then(|rest| rest.strip_prefix('.'));
            if let Some(rest) = rest {
                return Ok((part, first, rest));
            }
            first += part.headings.len();
        }
        let names: Vec<String> = self
            .parts
            .iter()
            .map(|part| format!("`{}.`", part.name))
            .collect();
        let what = format!(
            "`{}` does not say which run it is of: begin it with {}",
            written.text,
            names.join(" or ")
        );
        Err(self.experiment.error(written.line, what))
    }
}
