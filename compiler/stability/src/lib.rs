//! The stability budget: whether the sampled loop of key, hand and program gives energy to the
//! player, and whether it can ring.
//!
//! ```text
//!   Model --pieces--> places where every choice is decided --gradient--> linear discrete systems, coupled bodies included
//!                                                                           |
//!   Key (mass, friction, delay, bandwidth) --------------------- passive: damping that no hand can do without (Colgate & Schenkel)
//!   Hands (a table) --Held--> position for a force -------------- margin: how much larger a force may be before it rings (Nyquist)
//!                                                                           |
//!   what fails --trial--> somebody who runs it (runtime) --> it rings, or is only not proven; advice that passes
//! ```
//!
//! What is claimed and what is not stands in `docs/stability.md`: each piece is judged by itself,
//! as if the key stayed in it; the jumps between pieces are the program's meaning (a pluck gives
//! way) and are judged by simulation alone.
//!
//! Of an instrument with several ports each loop is judged by itself (`port`).
//!
//! Not here: the device file (runtime), motion and heat, words for the terminal.

mod advice;
mod border;
mod gradient;
mod hands;
mod key;
mod linear;
mod loops;
mod margin;
mod modes;
mod passive;
mod pieces;
mod place;
mod pole;
mod port;
mod response;
mod statics;
mod trial;
mod warning;

pub use border::Borders;
pub use hands::{HANDS, hands};
pub use key::{Hand, Key, Resonance};
pub use loops::PerHand;
pub use margin::GROWTH_PER_S;
pub use modes::{Mode, Stability, analyze, analyze_law};
pub use pieces::Law;
pub use place::Place;
pub use port::of_port;
pub use statics::{Static, static_force, static_force_of, too_strong};
pub use trial::{Oscillation, Seen, Trial};
pub use warning::warnings;
