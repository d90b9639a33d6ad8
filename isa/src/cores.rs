//! The tables of the cores. No core inherits from another: each number has its own source.

mod cortex_m0plus;
mod cortex_m33;
mod cortex_m4;
