//! Studies: people play an instrument under several conditions, in a page that asks them and keeps
//! what they did; what they left is played again, and summed up.
//!
//! ```text
//!   plan.toml --page--> study.html --one file a person--> session.csv --results--> results.html
//!                                                             '--replay--> the same words, or not
//! ```
//!
//! | part | what it settles |
//! | --- | --- |
//! | `plan` | conditions, tasks, items, as TOML |
//! | `order` | who plays what first |
//! | `page` | the page, around jsPsych in `vendor/` |
//! | `session` | the table that a person leaves |
//! | `replay` | whether a session's gestures give the same words again |
//! | `statistics`, `results` | tests, box plots |
//!
//! Not here: the page that plays (`playable`), which stands in a frame of this one.

mod order;
mod page;
mod plan;
mod replay;
mod results;
mod session;
mod statistics;

pub use order::{kind, order, rows};
pub use page::{ConditionPage, page};
pub use plan::{Condition, Item, Plan, StudyTask, Target};
pub use replay::digests;
pub use results::results;
pub use session::{SessionRow, TITLES, read};
pub use statistics::{
    Friedman, SHUFFLES, SignedRanks, friedman, holm, mid_ranks, quartiles, signed_ranks,
};
