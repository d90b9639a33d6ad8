//! Integration tests, one binary: whole instruments through every engine, and the command.

mod agree;
mod cli;
mod common;
mod escapement;
mod ideal;
mod language;
mod play;
mod random_programs;
