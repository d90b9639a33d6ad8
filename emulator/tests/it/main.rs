//! The machine from outside: calls, cycles, exceptions, two cores, devices, and what no image may
//! do to it.

mod calls;
mod noise;
mod same;
mod support;
mod together;
