//! The calls of parts, on one core or on two, with all that crosses in between.
//!
//! ```text
//!   core 0   NAME_tick -> head -> wires -> go ------> members -> wires -> wait --> tail
//!   core 1                                  '-> members -> wires -> done --^
//! ```
//!
//! Core 1 has no interrupt and no words of the converter: it looks for a new number in `go`, runs
//! its members and writes the number to `done`. Where it has an early part, that runs at the same
//! time as the head, and each core then waits for what the other leaves:
//!
//! ```text
//!   core 0   NAME_tick -> go -> head --> wires -> led ---> wait -> members -> wires -> wait --> tail
//!                          |                         \      ^                            ^
//!   core 1                 '--> early -> wires -> early ----+-> wait -> members -> wires -> done
//! ```
//!
//! What is written and who reads it never meet, because one core works on it at a time:
//!
//! | words | written | read |
//! | --- | --- | --- |
//! | live values of core 1's members | by core 0 before `go` (with an early part, `led`) | by core 1 from there to `done` |
//! | those that core 0's parts take of the early part | by core 1 between `go` and `early` | by core 0 behind `early` |
//! | those of the tail | by core 1 between `go` and `done` | by core 0 behind `done` |
//! | `go`, `led` | by core 0, while `done` is the last number | by core 1 |
//! | `early`, `done` | by core 1, once for each `go` | by core 0 |
//!
//! Where `early` or `done` does not come within so many rounds as a tick has cycles, the tick is
//! missed: its drive words are 0, the next one is silent, and no `go` is given until `done` is
//! there.

use std::fmt::Write;

use whippen_parts::Role;

use super::{Cut, EARLY, FINISHED, LED, LEFT, MEET, MEMBERS, POLL, WAIT, WENT};
use crate::code::{CoreCode, ZoneCode};
use crate::{drive_offset_bytes, wires};

/// The calls of a core's parts as assembly, in instructions that all cores have, for a tick of so
/// many cycles and so many words each way.
pub(crate) fn as_assembly(core: &CoreCode, cut: &Cut, period: u64, words: u32) -> Vec<String> {
    let Some(tail) = core.zones.first() else {
        return Vec::new();
    };
    let writer = |section: &str| Calls {
        text: format!(
            "        .syntax unified\n        .thumb\n        .section {section}, \"ax\"\n"
        ),
        cut,
        tail,
    };
    let mut first = writer(".text.core0.zones");
    first.tick(&core.name);
    if !cut.has_helper() {
        return vec![first.text];
    }
    first.late(words);
    first.members(period);
    first.text.push_str(WORDS);
    if cut.has_early() {
        first.text.push_str(WORDS_EARLY);
    }
    let mut second = writer(".text.core1.zones");
    second.helper();
    vec![first.text, second.text]
}

/// What crosses besides wires.
const WORDS: &str = "
        .section .bss.near.core0.crossing, \"aw\", %nobits
        .balign 4
        .global core0_turn, core0_done
core0_turn: .space 4                    @ the number that was given last
core0_done: .space 4                    @ the one that core 1 is done with
        .section .bss.near.core1.crossing, \"aw\", %nobits
        .balign 4
        .global core1_go, core1_seen
core1_go: .space 4
core1_seen: .space 4
";

/// The same where core 1 begins while core 0 runs the head.
const WORDS_EARLY: &str = "
        .section .bss.near.core0.crossing, \"aw\", %nobits
        .global core0_early
core0_early: .space 4                   @ the number of what is early that is there
        .section .bss.near.core1.crossing, \"aw\", %nobits
        .global core1_led
core1_led: .space 4                     @ that of what the head leaves
";

struct Calls<'a> {
    text: String,
    cut: &'a Cut,
    tail: &'a ZoneCode,
}

impl Calls<'_> {
    fn line(&mut self, text: &str) {
        let _ = writeln!(self.text, "{text}");
    }

    fn function(&mut self, name: &str) {
        self.line(&format!(
            "        .global {name}\n        .type   {name}, %function\n{name}:"
        ));
    }

    /// A part's function, with the words that lie on the stack.
    fn call(&mut self, part: usize, what: &str) {
        let (name, _) = self.cut.part(self.tail, part);
        let text = format!("        ldr     r0, ={name}_state\n        bl      {name}_{what}");
        self.line("        ldr     r1, [sp]");
        self.line(&text);
    }

    /// The parts of a role's kind on a core, in order.
    fn parts(&self, core: usize, is: impl Fn(Role) -> bool) -> Vec<usize> {
        let parts = self.cut.parts.iter().enumerate();
        let own = parts.filter(|(_, part)| part.core == core && is(part.role));
        own.map(|(at, _)| at).collect()
    }

    /// Parts one after the other, each with its wires.
    fn run(&mut self, parts: &[usize]) {
        for part in parts {
            self.call(*part, "tick");
            self.wires(*part);
        }
    }

    /// Copies what a part has left to whoever takes it.
    fn wires(&mut self, from: usize) {
        let (name, built) = self.cut.part(self.tail, from);
        let wires = self.cut.of.wires.iter();
        let words = wires.filter(|wire| wire.from.part == from).map(|wire| {
            let cell = built.layout.cell(0, wire.from.number as usize);
            let taken = wire.to.iter().map(|to| {
                let (name, built) = self.cut.part(self.tail, to.part);
                let at = built.layout.live_param(to.number as usize).unwrap_or(0);
                (name, at)
            });
            (cell.unwrap_or(0) + 4 * wire.word, taken.collect())
        });
        let text = wires::as_assembly(name, words.collect());
        self.text.push_str(&text);
    }

    /// A tick of all parts, and the beginning of all of them.
    fn tick(&mut self, name: &str) {
        let heads = self.parts(0, |role| role <= Role::Head);
        let members = self.parts(0, |role| role > Role::Head);
        let tail = self.cut.parts.len();
        self.function(&format!("{name}_tick"));
        self.line("        push    {r1, lr}");
        if self.cut.has_helper() {
            self.line(
                "        ldr     r0, =core0_turn\n        ldr     r0, [r0]\n        \
                 ldr     r1, =core0_done\n        ldr     r1, [r1]\n        \
                 cmp     r0, r1                  @ core 1 is not done with the tick before\n        \
                 beq     1f\n        b       9f\n1:",
            );
        }
        if self.cut.has_early() {
            self.line("        ldr     r1, [sp]");
        } else {
            self.run(&heads);
        }
        if self.cut.has_helper() {
            self.line(&format!(
                "        bl      {MEMBERS}\n        cmp     r0, #0\n        \
                 beq     1f\n        b       9f\n1:"
            ));
        } else {
            self.run(&members);
        }
        self.call(tail, "tick");
        self.line("        pop     {r1, pc}\n        .ltorg");
        self.function(&format!("{name}_init"));
        self.line("        push    {r1, lr}");
        (0..=tail).for_each(|part| self.call(part, "init"));
        self.line("        pop     {r1, pc}\n        .ltorg");
    }

    /// Core 1 is late: no force in this tick, and the next one is silent.
    fn late(&mut self, words: u32) {
        self.line("9:");
        self.line("        ldr     r1, [sp]\n        movs    r2, #0");
        let distance = drive_offset_bytes(words);
        self.line(&format!(
            "        ldr     r0, ={distance}\n        adds    r1, r1, r0"
        ));
        for _ in 0..words {
            self.line("        strh    r2, [r1]\n        adds    r1, #2");
        }
        self.line(
            "        ldr     r0, =core0
        ldr     r1, [r0, #C_MISSED]
        adds    r1, #1
        str     r1, [r0, #C_MISSED]
        ldr     r1, [r0, #C_FAULTS]
        movs    r2, #FAULT_MISSED
        orrs    r1, r2
        str     r1, [r0, #C_FAULTS]
        ldr     r0, =alarm
        ldr     r1, [r0]
        adds    r1, #1
        str     r1, [r0]
        pop     {r1, pc}
        .ltorg",
        );
    }

    /// What core 0 does from `go` until core 1 is done; R0 is 1 where it is not.
    fn members(&mut self, period: u64) {
        let members = self.parts(0, |role| role > Role::Head);
        self.function(MEMBERS);
        self.line(&format!(
            "        push    {{r1, lr}}
        ldr     r0, =core0_turn
        ldr     r1, [r0]
        adds    r1, #1
        str     r1, [r0]
        ldr     r0, =core1_go
        dmb     sy                      @ what its members take is there before
        str     r1, [r0]
        dmb     sy
        .global {WENT}
{WENT}:"
        ));
        if self.cut.has_early() {
            self.meet(period);
        }
        self.run(&members);
        self.line(&format!("        .global {LEFT}\n{LEFT}:"));
        self.wait("core0_done", WAIT, period);
        self.line(
            "        movs    r0, #0
        pop     {r1, pc}
        .ltorg",
        );
    }

    /// Core 0 runs the head while core 1 does what is early; then each waits for the other.
    fn meet(&mut self, period: u64) {
        self.run(&self.parts(0, |role| role == Role::Head));
        self.line(&format!(
            "        ldr     r0, =core0_turn
        ldr     r1, [r0]
        ldr     r0, =core1_led
        dmb     sy                      @ what the head leaves is there before
        str     r1, [r0]
        dmb     sy
        .global {LED}
{LED}:"
        ));
        self.wait("core0_early", MEET, period);
    }

    /// Core 0 waits until core 1 has written the number that was given last; R0 is 1 where it does
    /// not.
    fn wait(&mut self, word: &str, label: &str, period: u64) {
        self.line(&format!(
            "        ldr     r0, =core0_turn
        ldr     r1, [r0]
        ldr     r0, ={word}
        ldr     r3, ={period}
        .global {label}
{label}:
@! rounds 1
2:      ldr     r2, [r0]
        cmp     r2, r1
        beq     1f
        subs    r3, #1
        bne     2b
        .global {label}_late
{label}_late:
        movs    r0, #1
        pop     {{r1, pc}}
1:      dmb     sy                      @ what core 1 left is read behind"
        ));
    }

    /// Parts on core 1. They take nothing from the converter's words, and have none on the stack.
    fn help(&mut self, parts: &[usize]) {
        for part in parts {
            let (name, _) = self.cut.part(self.tail, *part);
            let text = format!(
                "        ldr     r0, ={name}_state\n        movs    r1, #0\n        bl      {name}_tick"
            );
            self.line(&text);
            self.wires(*part);
        }
    }

    /// Core 1 writes the number that it has seen.
    fn tell(&mut self, word: &str) {
        self.line(&format!(
            "        ldr     r2, =core1_seen
        ldr     r2, [r2]
        ldr     r0, ={word}
        dmb     sy
        str     r2, [r0]
        dmb     sy"
        ));
    }

    /// Core 1: parts' ticks are all that it ever does.
    fn helper(&mut self) {
        let early = self.parts(1, |role| role == Role::Early);
        let members = self.parts(1, |role| role != Role::Early);
        let [poll, wait] = POLL;
        self.function("core1_start");
        self.line(&format!(
            "        cpsid   i
        .global {poll}, {wait}, {FINISHED}
{poll}:
1:      ldr     r0, =core1_go
        ldr     r1, =core1_seen
        ldr     r1, [r1]
{wait}:
@! rounds 3
2:      ldr     r2, [r0]
        cmp     r2, r1
        beq     2b
        dmb     sy
        ldr     r1, =core1_seen
        str     r2, [r1]"
        ));
        self.help(&early);
        if self.cut.has_early() {
            self.tell("core0_early");
            self.line(&format!(
                "        ldr     r0, =core1_led
        ldr     r1, =core1_seen
        ldr     r1, [r1]
        .global {EARLY}
{EARLY}:
@! rounds 3
2:      ldr     r2, [r0]
        cmp     r2, r1
        bne     2b
        dmb     sy"
            ));
        }
        self.help(&members);
        self.tell("core0_done");
        self.line(&format!(
            "{FINISHED}:
        b       1b
        .ltorg"
        ));
        self.text.push_str(
            "        .section .rodata.core1.exceptions, \"a\"
        .balign 512
        .global vectors1
vectors1:
        .word   STACK1, core1_start
        .word   dead, dead, dead, dead, dead, dead
        .word   0, 0, 0
        .word   dead, dead, 0, dead, dead
",
        );
    }
}
