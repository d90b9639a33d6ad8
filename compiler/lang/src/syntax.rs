//! Text to tree.
//!
//! ```text
//!   text -- token::lex --> tokens -- repair --> balanced tokens -- grammar --> File
//!                             `-> comments                          |-> expected: errors in words
//!                                                                   `<- pretty: text again
//! ```
//!
//! Not here: what names, units and types mean (`check`).

pub mod ast;
mod build;
mod expected;
mod layout;
mod parse;
pub mod pretty;
mod repair;
pub mod token;

pub use layout::{WIDTH, layout};
pub use parse::parse;

#[cfg(test)]
mod tests;
