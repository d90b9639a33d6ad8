//! The closed loop.

pub mod device;
pub mod engine;
pub mod files;
pub mod gesture;
pub mod motion;
pub mod session;
pub mod titles;
pub mod trace;
