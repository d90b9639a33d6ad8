//! Names and units of an experiment, judged before it runs.

use whippen_compiler::rate::Rate;
use whippen_compiler::units::Dim;

use super::claims::{Claim, Subject};
use super::columns::{Found, Names, Part};
use super::file::{Experiment, Mover, NamedInstant};
use crate::fields::{Written, quantity, seconds};
use crate::files::FileError;
use crate::trajectory::Trajectory;

/// An experiment whose names and units fit its instruments.
pub struct Bound<'e> {
    pub(super) experiment: &'e Experiment,
    pub(super) instants: Vec<When>,
    pub(super) tests: Vec<Test>,
    pub(super) travel: Option<Found>,
    pub(super) total: Option<Found>,
    pub(super) forces: Vec<Found>,
    pub(super) lines: Vec<Found>,
    pub(super) states: Vec<Found>,
    /// Labels of places on the way of the key, and where they are (SI).
    pub(super) places: Vec<(String, f64)>,
}

/// What an instant is.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum When {
    /// So long after the beginning (s).
    At(f64),
    /// The first event of this name.
    Event(String),
    /// The first tick in which a column is beyond a value.
    Beyond {
        column: usize,
        above: bool,
        value: f64,
    },
}

/// A claim with its columns found and its bounds in SI.
pub(super) struct Test {
    pub subject: Subject,
    /// Columns, as far as it speaks of any.
    pub columns: Vec<Found>,
    /// Events, as far as it speaks of any.
    pub events: Vec<String>,
    /// The title of the argument.
    pub argument: String,
    pub low: f64,
    pub high: f64,
    /// What a peak rises above, and falls below before the next.
    pub threshold: (f64, f64),
    /// In which its values are shown.
    pub dim: Dim,
    /// The instants between which a duration is.
    pub between: Option<(usize, usize)>,
}

impl<'e> Bound<'e> {
    /// Finds the names of an experiment in what its instruments have.
    ///
    /// # Errors
    /// A name is unknown or a unit does not fit, in which line.
    pub fn new(experiment: &'e Experiment, parts: &[Part]) -> Result<Bound<'e>, FileError> {
        let names = Names { experiment, parts };
        the_way_fits(experiment, parts)?;
        let plotted = &experiment.plotted;
        let one = |written: &Option<Written>| written.as_ref().map(|w| names.column(w)).transpose();
        let many = |all: &[Written]| {
            all.iter()
                .map(|w| names.column(w))
                .collect::<Result<Vec<_>, _>>()
        };
        let travel = one(&plotted.travel)?;
        let place = |(name, at): &(String, Written)| {
            let dim = travel.as_ref().map(|travel| travel.dim);
            match (quantity(&at.text), dim) {
                (Ok((value, dim)), Some(wanted)) if dim == wanted => Ok((name.clone(), value)),
                (_, None) => Err(experiment.error(
                    at.line,
                    "a [place] is one on the way that `travel` names; there is none",
                )),
                (_, Some(wanted)) => Err(experiment.error(
                    at.line,
                    format!("`{}` is not in {}", at.text, wanted.unit()),
                )),
            }
        };
        Ok(Bound {
            experiment,
            instants: experiment
                .instants
                .iter()
                .map(|i| instant(&names, i))
                .collect::<Result<_, _>>()?,
            tests: experiment
                .claims
                .iter()
                .map(|claim| test(&names, claim))
                .collect::<Result<_, _>>()?,
            places: plotted.places.iter().map(place).collect::<Result<_, _>>()?,
            travel,
            total: one(&plotted.total)?,
            forces: numbers(experiment, &plotted.forces, many(&plotted.forces)?)?,
            lines: numbers(experiment, &plotted.lines, many(&plotted.lines)?)?,
            states: machines(experiment, &plotted.states, many(&plotted.states)?)?,
        })
    }
}

impl Experiment {
    /// The way of the player at a tick rate.
    pub fn trajectory(&self, rate_hz: Rate) -> Trajectory {
        Trajectory::of_gesture(self.way.gesture.clone(), rate_hz)
    }
}

fn the_way_fits(experiment: &Experiment, parts: &[Part]) -> Result<(), FileError> {
    let turns = parts.iter().any(|part| part.turns);
    let wanted = match (&experiment.mover, turns) {
        (Mover::Force, false) => Dim::FORCE,
        (Mover::Force, true) => Dim::TORQUE,
        (_, false) => Dim::LENGTH,
        (_, true) => Dim::NUMBER,
    };
    match experiment.way.dim {
        Some(dim) if dim != wanted => {
            let unit = if wanted.is_number() {
                "rad or deg".to_string()
            } else {
                wanted.unit()
            };
            let what = format!("this player's steps are in {unit} (or with another prefix)");
            Err(experiment.error(experiment.way_line, what))
        }
        _ => Ok(()),
    }
}

fn numbers(
    experiment: &Experiment,
    names: &[Written],
    found: Vec<Found>,
) -> Result<Vec<Found>, FileError> {
    match found
        .iter()
        .position(|found| !found.heading.labels.is_empty())
    {
        Some(at) => Err(experiment.error(
            names[at].line,
            format!("`{}` is a machine: list it in `states`", names[at].text),
        )),
        None => Ok(found),
    }
}

fn machines(
    experiment: &Experiment,
    names: &[Written],
    found: Vec<Found>,
) -> Result<Vec<Found>, FileError> {
    match found
        .iter()
        .position(|found| found.heading.labels.is_empty())
    {
        Some(at) => Err(experiment.error(
            names[at].line,
            format!(
                "`{}` is no machine: list it in `lines` or `forces`",
                names[at].text
            ),
        )),
        None => Ok(found),
    }
}

/// An instant: a time, an event, or a column beyond a value.
fn instant(names: &Names, instant: &NamedInstant) -> Result<When, FileError> {
    let Written { text, line } = &instant.when;
    let wrong = |why: String| names.experiment.error(*line, why);
    if text.starts_with(|c: char| c.is_ascii_digit()) {
        return seconds(text).map(When::At).map_err(wrong);
    }
    let sides = [(" above ", true), (" below ", false)];
    let found = sides
        .iter()
        .find_map(|(word, above)| Some((text.split_once(word)?, *above)));
    let Some(((column, value), above)) = found else {
        return names.event(&instant.when).map(When::Event);
    };
    let written = |text: &str| Written {
        text: text.trim().to_string(),
        line: *line,
    };
    let found = names.column(&written(column))?;
    let value = in_units(names, &found, &written(value))?;
    Ok(When::Beyond {
        column: found.at,
        above,
        value,
    })
}

/// A value of a column: a quantity in its unit, or the name of a state.
fn in_units(names: &Names, column: &Found, written: &Written) -> Result<f64, FileError> {
    let labels = &column.heading.labels;
    if labels.is_empty() {
        return of_dim(names, column.dim, written);
    }
    let state = labels.iter().position(|label| *label == written.text);
    state.map(|state| state as f64).ok_or_else(|| {
        let what = format!(
            "`{}` is no state; there are {}",
            written.text,
            labels.join(", ")
        );
        names.experiment.error(written.line, what)
    })
}

fn of_dim(names: &Names, dim: Dim, written: &Written) -> Result<f64, FileError> {
    match quantity(&written.text) {
        Ok((value, found)) if found == dim => Ok(value),
        Ok((_, found)) => {
            let unit = |dim: Dim| {
                if dim.is_number() {
                    "a plain number".to_string()
                } else {
                    format!("in {}", dim.unit())
                }
            };
            let what = format!(
                "`{}` is {}, and what it is compared with is {}",
                written.text,
                unit(found),
                unit(dim)
            );
            Err(names.experiment.error(written.line, what))
        }
        Err(why) => Err(names.experiment.error(written.line, why)),
    }
}

fn test(names: &Names, claim: &Claim) -> Result<Test, FileError> {
    let mut test = Test {
        subject: claim.subject,
        columns: Vec::new(),
        events: Vec::new(),
        argument: String::new(),
        low: f64::NEG_INFINITY,
        high: f64::INFINITY,
        threshold: (0.0, 0.0),
        dim: Dim::NUMBER,
        between: None,
    };
    match claim.subject {
        Subject::Count | Subject::Order => {
            let events = claim.names.iter().map(|name| names.event(name));
            test.events = events.collect::<Result<_, _>>()?;
        }
        Subject::Argument => {
            let (event, title, dim) = names.argument(&claim.names[0])?;
            (test.events, test.argument, test.dim) = (vec![event], title, dim);
        }
        Subject::Duration => {
            test.between = Some((
                named(names, &claim.names[0])?,
                named(names, &claim.names[1])?,
            ));
            test.dim = Dim::TIME;
        }
        _ => columns(names, claim, &mut test)?,
    }
    bounds(names, claim, &mut test)?;
    Ok(test)
}

fn columns(names: &Names, claim: &Claim, test: &mut Test) -> Result<(), FileError> {
    let columns = claim.names.iter().map(|name| names.column(name));
    test.columns = columns.collect::<Result<_, _>>()?;
    let error = |what: String| Err(names.experiment.error(claim.line, what));
    let first = &test.columns[0];
    if !first.heading.labels.is_empty() && claim.subject != Subject::Every {
        return error(format!(
            "`{}` is a machine: write `every`, or count its transitions",
            claim.names[0].text
        ));
    }
    if test.columns.iter().any(|column| column.dim != first.dim) {
        return error("the two columns have different units".to_string());
    }
    if let Some(over) = &claim.over {
        let above = of_dim(names, first.dim, over)?;
        let below = claim
            .under
            .as_ref()
            .map(|under| of_dim(names, first.dim, under))
            .transpose()?;
        test.threshold = (above, below.unwrap_or(above));
        if test.threshold.1 > above {
            return error("`under` is above `over`".to_string());
        }
    }
    if claim.subject != Subject::Peaks {
        test.dim = first.dim;
    }
    Ok(())
}

fn named(names: &Names, written: &Written) -> Result<usize, FileError> {
    let instants = &names.experiment.instants;
    instants
        .iter()
        .position(|instant| instant.name == written.text)
        .ok_or_else(|| {
            names.experiment.error(
                written.line,
                format!("there is no instant `{}`", written.text),
            )
        })
}

fn bounds(names: &Names, claim: &Claim, test: &mut Test) -> Result<(), FileError> {
    let value = |written: &Written| match test.columns.first() {
        Some(column) if claim.subject == Subject::Every => in_units(names, column, written),
        _ => of_dim(names, test.dim, written),
    };
    let is_state = test
        .columns
        .first()
        .is_some_and(|column| !column.heading.labels.is_empty());
    let is_counted = matches!(claim.subject, Subject::Count | Subject::Peaks);
    let (mut low, mut high) = (test.low, test.high);
    if let Some(is) = &claim.is {
        let within = match &claim.within {
            Some(within) if !is_state => value(within)?,
            Some(within) => {
                return Err(names
                    .experiment
                    .error(within.line, "a state has no `within`"));
            }
            None if is_state || is_counted => 0.0,
            None => {
                let what = "`is` needs `within`: how far a quantity may be off";
                return Err(names.experiment.error(is.line, what));
            }
        };
        if within < 0.0 {
            return Err(names.experiment.error(claim.line, "`within` is below zero"));
        }
        let is = value(is)?;
        (low, high) = (is - within, is + within);
    }
    if let Some(at_least) = &claim.at_least {
        low = value(at_least)?;
    }
    if let Some(at_most) = &claim.at_most {
        high = value(at_most)?;
    }
    if low > high {
        let what = "`at_least` is above `at_most`: nothing can be both";
        return Err(names.experiment.error(claim.line, what));
    }
    (test.low, test.high) = (low, high);
    Ok(())
}
