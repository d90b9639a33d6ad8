//! Integration tests, one binary: whole instruments through every engine, and the command.

mod agree;
mod cli;
mod common;
mod escapement;
mod ideal;
mod keyboard;
mod language;
mod messages;
mod organ_and_plucked;
mod played;
mod player;
mod random_programs;
mod reference;
mod strokes;
