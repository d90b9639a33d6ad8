//! Integration tests, one binary: whole instruments through every engine.

mod agree;
mod common;
mod ideal;
mod keyboard;
mod organ_and_plucked;
mod played;
mod random_programs;
mod reference;
mod strokes;
