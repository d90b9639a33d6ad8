//! The closed loop: everything around the engines.
//!
//! ```text
//!   recording --motion--.                                        .--> trace --> tables (CSV)
//!                       +--> positions --device--> words  ...  --+
//!   gesture ------------'                                        '--> plot --> figures (SVG, PNG), report --> page (HTML)
//! ```
//!
//! Files are read and written here and nowhere below: [`files`] has the errors and the
//! whole-or-not-at-all writer that all of them share. Every result is a function of its inputs
//! alone, on every machine.
//!
//! Not here: the language (the compiler), what instructions do (the emulator).

pub mod archive;
pub mod automation;
pub mod board;
pub mod closed;
pub mod coil;
pub mod compare;
pub mod decimal;
pub mod device;
pub mod emulated;
pub mod engine;
mod entries;
pub mod experiment;
mod fields;
pub mod files;
pub mod fit;
pub mod fmu;
pub mod gesture;
pub mod image;
pub mod judged;
pub mod keyboard;
pub mod measure;
pub mod measured_loop;
pub mod midi;
pub mod monitor;
pub mod motion;
pub mod motor;
pub mod plant;
pub mod playable;
pub mod plot;
pub mod points;
pub mod preset;
pub mod rate;
pub mod record;
pub mod report;
pub mod resting;
pub mod ringing;
pub mod self_test;
pub mod session;
pub mod sound;
pub mod spectrogram;
pub mod sticking;
pub mod strands;
pub mod stroke;
pub mod struck;
#[cfg(not(target_family = "wasm"))]
pub mod studio;
#[cfg(not(target_family = "wasm"))]
pub mod study;
pub mod titles;
pub mod trace;
pub mod trajectory;
pub mod vibration;
pub mod web;
