//! Figures: what a run looks like, as SVG and PNG.
//!
//! ```text
//!   key travel      ______/~~~\___      \
//!   force           one line per term    |  one time axis; strikes are marked through all panels
//!   coordinates     hammer, ...          |
//!   sound           level by frequency   |
//!   states          [touching][flying]  /
//!   ---------------- time (s) ---------
//!   string          displacement by place and time, in the window in which it moves most
//!   force over travel: press, return       its own axes
//! ```
//!
//! A [`Figure`] borrows its data, usually from a trace; panels without data are left out. Panels
//! paint shapes into one drawing, which both outputs put on paper, so both show the same. A
//! recording of any length is reduced to what can be seen (`decimate`). Colours can be told apart
//! with any kind of colour vision (Paul Tol's schemes).
//!
//! A [`Map`] is the other kind: lines over two quantities. Not here: interaction, reports.

mod axis;
mod bands;
pub(crate) mod decimate;
mod drawing;
mod font;
pub(crate) mod frame;
mod heat;
pub(crate) mod layout;
mod map;
mod path;
mod png;
mod spectrum;
mod svg;
mod time;
mod vibration;

#[cfg(test)]
mod tests;

use std::path::Path;
use whippen_compiler::rate::Rate;

use crate::files::{FileError, write_whole};
use crate::measured_loop::MeasuredLoop;
use crate::record::Record;
use crate::spectrogram::Spectrogram;
use crate::titles::split_title;
use crate::trace::{Column, EventRow, Trace};
use crate::vibration::Vibration;
pub use heat::HeatMap;
pub use map::{Curve, Map};
pub(crate) use path::stretches_of;

/// One quantity over time.
#[derive(Debug, Clone, PartialEq)]
pub struct Series<'a> {
    /// Its name in the legend.
    pub name: &'a str,
    /// Its unit as titles write it (`m`, `n`, `rad`).
    pub unit: &'a str,
    /// Its values (SI).
    pub record: &'a Record,
}

/// One state machine over time.
#[derive(Debug, Clone, PartialEq)]
pub struct Machine<'a> {
    /// Its name.
    pub name: &'a str,
    /// The names of its states.
    pub states: &'a [String],
    /// The index of its state over time.
    pub record: &'a Record,
}

/// An instant to be marked.
#[derive(Debug, Clone, PartialEq)]
pub struct Mark {
    /// When (s).
    pub t_s: f64,
    /// A number or a word, or nothing.
    pub label: String,
}

/// A place on the way of the key to be marked.
#[derive(Debug, Clone, PartialEq)]
pub struct Place {
    /// Where (SI).
    pub at: f64,
    /// Its name.
    pub label: String,
}

/// What to draw.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Figure<'a> {
    /// Heading.
    pub title: String,
    /// Ticks per second.
    pub rate_hz: Rate,
    /// When the first tick was (s).
    pub start_s: f64,
    /// The port whose position and forces come first; none of a key.
    pub port: Option<&'a str>,
    /// Position of the key, or of that port.
    pub travel: Option<Series<'a>>,
    /// The force terms.
    pub forces: Vec<Series<'a>>,
    /// Their sum.
    pub total: Option<Series<'a>>,
    /// Coordinates of bodies.
    pub coordinates: Vec<Series<'a>>,
    /// What the sound is made of.
    pub spectrograms: Vec<&'a Spectrogram>,
    /// How strings vibrate.
    pub vibrations: Vec<&'a Vibration>,
    /// State machines.
    pub machines: Vec<Machine<'a>>,
    /// What the marks are, for the legend: `note (m/s)`.
    pub mark_name: String,
    /// Instants that are marked through all panels over time, such as strikes.
    pub marks: Vec<Mark>,
    /// Places that are marked in the panel over travel.
    pub places: Vec<Place>,
    /// What was measured, below the loop of force over travel.
    pub measured: Option<&'a MeasuredLoop>,
}

/// Which columns and events of a trace play which part; what the trace does not have is left out.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Roles {
    /// Heading.
    pub title: String,
    /// Whether that is a key; a port has a name.
    pub is_of_key: bool,
    /// Title of the column of the key's position (`x_m`), or of a port's.
    pub travel: String,
    /// Titles of the columns of the force terms.
    pub forces: Vec<String>,
    /// Title of the column of their sum.
    pub total: String,
    /// Titles of the columns of coordinates, and of what else is drawn over time.
    pub coordinates: Vec<String>,
    /// Titles of the columns of state machines.
    pub machines: Vec<String>,
    /// Name of the event that is marked (`note`); its first argument, if it has one, is written
    /// beside it.
    pub mark: String,
}

impl<'a> Figure<'a> {
    /// A figure of a trace.
    pub fn of(trace: &'a Trace, roles: &Roles) -> Figure<'a> {
        let series = |name: &String| {
            let column = trace.column(name)?;
            Some(Series {
                name: &column.heading.name,
                unit: &column.heading.unit,
                record: &column.record,
            })
        };
        let column = |name: &String| trace.column(name);
        let machine = |c: &'a Column| Machine {
            name: &c.heading.name,
            states: &c.heading.labels,
            record: &c.record,
        };
        let marked = || trace.events.iter().filter(|e| e.event == roles.mark);
        let label = |e: &EventRow| {
            e.args
                .first()
                .map_or(String::new(), |(_, v)| format!("{v:.2}").replace('-', "−"))
        };
        let argument = marked()
            .find_map(|e| e.args.first())
            .and_then(|(title, _)| split_title(title).1);
        let travel = series(&roles.travel);
        let port = travel.as_ref().map(|series| series.name);
        Figure {
            title: roles.title.clone(),
            rate_hz: trace.rate_hz,
            start_s: trace.start_s,
            port: port.filter(|_| !roles.is_of_key),
            travel,
            forces: roles.forces.iter().filter_map(series).collect(),
            total: series(&roles.total),
            coordinates: roles.coordinates.iter().filter_map(series).collect(),
            spectrograms: trace.spectrograms.iter().collect(),
            vibrations: trace.vibrations.iter().collect(),
            machines: (roles.machines.iter().filter_map(column))
                .map(machine)
                .collect(),
            mark_name: frame::heading(
                &roles.mark,
                &argument.map_or(String::new(), |unit| unit.dim.unit_without_angle()),
            ),
            marks: marked()
                .map(|e| Mark {
                    t_s: e.t_s,
                    label: label(e),
                })
                .collect(),
            places: Vec::new(),
            measured: None,
        }
    }

    /// The number of ticks of the longest series.
    pub fn ticks(&self) -> usize {
        let series = self
            .travel
            .iter()
            .chain(&self.forces)
            .chain(&self.total)
            .chain(&self.coordinates);
        series
            .map(|s| s.record.ticks())
            .chain(self.machines.iter().map(|m| m.record.ticks()))
            .chain(self.spectrograms.iter().map(|s| s.samples()))
            .max()
            .unwrap_or(0)
    }

    /// The figure as an SVG document.
    pub fn svg(&self) -> String {
        svg::print(&layout::draw(self))
    }

    /// The figure as a PNG picture, two pixels per point; `None` if it does not fit into memory.
    pub fn png(&self) -> Option<Vec<u8>> {
        png::paint(&layout::draw(self))
    }
}

/// Writes a figure to a file whose name ends in `.svg` or `.png`.
///
/// # Errors
/// The name ends otherwise, or the file cannot be written.
pub fn save(figure: &Figure, path: &Path) -> Result<(), FileError> {
    save_drawing(&layout::draw(figure), path)
}

/// Writes a drawing as a file's name says.
fn save_drawing(drawing: &drawing::Drawing, path: &Path) -> Result<(), FileError> {
    let bytes = match ending(path).as_str() {
        "svg" => svg::print(drawing).into_bytes(),
        "png" => png::paint(drawing)
            .ok_or_else(|| FileError::new(path, "the figure is too large for a picture"))?,
        _ => {
            return Err(FileError::new(
                path,
                "a figure's name ends in `.svg` or `.png`",
            ));
        }
    };
    write_whole(path, |w| w.write_all(&bytes))
}

fn ending(path: &Path) -> String {
    let ending = path.extension().and_then(|e| e.to_str());
    ending.unwrap_or("").to_ascii_lowercase()
}
