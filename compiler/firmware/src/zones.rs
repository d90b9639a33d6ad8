//! Keys of a core that play different instruments: the whole is called as one instrument is.
//!
//! ```text
//!   NAME_tick(state, words)  -> NAME_zone0_tick(its state, its words), NAME_zone1_tick(..), ..
//!   NAME_init(state, words)  -> the same of _init
//!   NAME_begin(state, word, key) -> _begin of the zone that has the key
//!   NAME_state               the states of the zones, a word each
//! ```
//!
//! So the frame knows nothing of zones but that records have no common distance:
//! [`records_as_assembly`] lists them.

use std::fmt::Write;

use super::CORES;
use super::code::CoreCode;

/// The name of a core's keys of a program that are one of several zones.
pub fn zone_name(name: &str, zone: usize) -> String {
    format!("{name}_zone{zone}")
}

/// The name of the core's block.
fn core_name(core: &CoreCode) -> &'static str {
    CORES[core.core.index()]
}

/// The calls as assembly, in instructions that all cores have.
pub(super) fn calls_as_assembly(core: &CoreCode) -> String {
    let CoreCode { name, zones, .. } = core;
    let mut text = format!(
        "        .syntax unified\n        .thumb\n        .section .rodata.near.{}.zones, \"a\"\n        .balign 4\n        \
         .global {name}_state\n{name}_state:\n",
        core_name(core)
    );
    let mut line = |words: &str| {
        let _ = writeln!(text, "{words}");
    };
    zones
        .iter()
        .for_each(|zone| line(&format!("        .word   {}_state", zone.name)));
    line(&format!("        .section .text.{name}.zones, \"ax\""));
    for what in ["tick", "init"] {
        function(&mut line, name, what);
        line("        push    {r0, r1, lr}");
        for (at, zone) in zones.iter().enumerate() {
            if at > 0 {
                line("        ldr     r0, [sp]\n        ldr     r1, [sp, #4]");
            }
            line(&format!("        ldr     r0, [r0, #{}]", 4 * at));
            // A word has two bytes, and an instruction eight bits for them.
            let mut bytes = 2 * zones[..at].iter().map(|before| before.keys()).sum::<u32>();
            while bytes > 0 {
                line(&format!("        adds    r1, #{}", bytes.min(254)));
                bytes -= bytes.min(254);
            }
            line(&format!("        bl      {}_{what}", zone.name));
        }
        line("        add     sp, #8\n        pop     {pc}");
    }
    function(&mut line, name, "begin");
    line("        push    {lr}");
    for (at, zone) in zones.iter().enumerate() {
        let last = at + 1 == zones.len();
        if !last {
            line(&format!(
                "        cmp     r2, #{}\n        bhs     1f",
                zone.keys()
            ));
        }
        line(&format!(
            "        ldr     r0, [r0, #{}]\n        bl      {}_begin\n        pop     {{pc}}",
            4 * at,
            zone.name
        ));
        if !last {
            line(&format!("1:      subs    r2, #{}", zone.keys()));
        }
    }
    text
}

fn function(line: &mut impl FnMut(&str), name: &str, what: &str) {
    line(&format!(
        "        .global {name}_{what}\n        .type   {name}_{what}, %function\n{name}_{what}:"
    ));
}

/// The table of a core's records, key by key: the record, and the word that stands behind the last
/// key of its zone.
pub(super) fn records_as_assembly(core: &CoreCode) -> String {
    let CoreCode { name, zones, .. } = core;
    let mut text = format!(
        "        .section .rodata.{}.records, \"a\"\n        .balign 4\n        .global {name}_records\n{name}_records:\n",
        core_name(core)
    );
    for zone in zones {
        let end = zone.layout().record(zone.keys());
        for key in 0..zone.keys() {
            let (state, record) = (format!("{}_state", zone.name), zone.layout().record(key));
            let _ = writeln!(text, "        .word   {state} + {record}, {state} + {end}");
        }
    }
    text
}
