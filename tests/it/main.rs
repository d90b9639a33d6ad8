//! Integration tests, one binary: whole instruments through every engine.

mod agree;
mod common;
mod ideal;
mod played;
mod random_programs;
mod strokes;
