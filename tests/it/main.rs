//! Integration tests, one binary: whole instruments through every engine, and the command.

mod agree;
mod button_and_knob;
mod c;
mod cli;
mod common;
mod cycle;
mod documents;
mod emulate;
mod escapement;
mod first_mechanisms;
mod grammar;
mod ideal;
mod keyboard;
mod language;
mod library;
mod lsp;
mod messages;
mod midi;
mod organ_and_plucked;
mod played;
mod player;
mod random_programs;
mod reference;
mod report;
mod strokes;
