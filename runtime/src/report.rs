//! Reports: a run, or many, as one HTML page that needs nothing else.
//!
//! ```text
//!   Run + Compiled --section--> Section: facts, chart (knots), tables, sources --.
//!   keyboard + MIDI ----------> Section ..                                       +--> Page --> one .html file
//!   tour: many sections, and a table over all ----------------------------------'
//! ```
//!
//! The page holds its data, its style and its scripts, asks nothing of any network, and works from
//! a file. Tables and facts are plain HTML that can be read without a script; the scripts
//! (`report/*.js`, around the plotting library in `vendor/`) draw and zoom. The same run gives the
//! same bytes.
//!
//! Not here: still pictures (`plot`), tables of all ticks (`trace`).

mod budget;
mod chart;
mod html;
mod knots;
mod page;
mod section;
mod strings;

pub use budget::budget_page;
pub use chart::chart;
pub use html::{Cell, Row, Table};
pub(crate) use html::{escape, script_json};
pub use knots::{KNOTS_MAX, Knots, Truth, knots};
pub use page::Page;
pub use section::{Made, Section, id};
