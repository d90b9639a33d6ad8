//! Whole firmware on the emulated board, with both cores: what it plays, and what it does when
//! something fails.

mod boot2;
mod chips;
mod chips_command;
mod document;
mod example;
mod gnu;
mod key_bench;
mod keys;
mod keys_failing;
mod keys_time;
mod knob;
mod knob_bench;
mod knob_store;
mod knob_time;
mod knob_turns;
mod knob_wall;
mod knobs;
mod linked;
mod midi;
mod monitor;
mod monitor_command;
mod monitor_refused;
mod passivity;
mod play;
mod rig;
mod ring;
mod safety;
mod self_test;
mod silicon;
mod sound;
mod sound_out;
mod switch;
mod talk;
mod tuning;
mod zones;
