//! The Whippen compiler: source text to Model to Kernel to code, and the proof that the code is in
//! time. No input or output, no clock.
//!
//! Each phase is a crate of its own, named here in the order in which a program passes through
//! them.

// Texts and the language: source to Model.
pub use whippen_lang::{bundled, check, diag, front, index, lint, model, range, syntax, units};
pub use whippen_source as source;
// Which keys play what, on which core.
pub use whippen_keyboard as keyboard;
// The loop of key, hand and program.
pub use whippen_stability as stability;
// Model to Kernel.
pub use whippen_kernel as kernel;
pub use whippen_lower as lower;
pub use whippen_lower::{ideal, scales, simplify};
// A Kernel for this machine, as C, and for browsers.
pub use whippen_c99 as c99;
#[cfg(not(target_family = "wasm"))]
pub use whippen_jit as jit;
pub use whippen_wasm as wasm;
// A Kernel as machine code of a Cortex-M, and its image.
pub use whippen_arm::{asm, image, thumb};
pub use whippen_board as board;
pub use whippen_firmware as firmware;
pub use whippen_modes as modes;
pub use whippen_parts as parts;
pub use whippen_rate as rate;
pub use whippen_target_info as target_info;
// The proof on the bytes.
pub use whippen_audit as audit;
pub use whippen_budget as budget;
pub use whippen_validate as validate;

pub use whippen_deterministic::{Memo, Rng, parallel};

pub mod bindings;
pub mod deadline_diagnostic;
pub mod mode_names;
mod partition;
pub mod pipeline;
pub mod validation;
pub mod variables;
