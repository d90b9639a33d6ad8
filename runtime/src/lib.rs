//! The closed loop.

pub mod device;
pub mod files;
pub mod gesture;
pub mod motion;
pub mod titles;
pub mod trace;
