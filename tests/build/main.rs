//! Objects become files, judged by others: binutils reads and links them, C compilers take the
//! header, rustc the bindings, gdb stops at source lines, and the emulator runs what comes out.

mod bindings;
mod command;
mod debugger;
mod image;
mod midi;
mod one_interface;
mod origins;
mod own_firmware;
mod program;
mod proven;
mod relocatable;
mod self_test;
mod tools;
mod unwind;
mod zones;
mod zones_safe;
