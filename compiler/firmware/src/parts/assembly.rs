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
//! Where core 1 has what is heard, it does that while core 0 runs the tail, and writes the sum that
//! is sent with the next tick:
//!
//! ```text
//!   core 0   .. members -> wires -> left --> wait --> tail
//!   core 1   .. members -> wires -> done --> wait --> sound -> sum -> heard
//! ```
//!
//! What is written and who reads it never meet, because one core works on it at a time:
//!
//! | words | written | read |
//! | --- | --- | --- |
//! | live values of core 1's members | by core 0 before `go` (with an early part, `led`) | by core 1 from there to `done` |
//! | those that core 0's parts take of the early part | by core 1 between `go` and `early` | by core 0 behind `early` |
//! | those of the tail | by core 1 between `go` and `done` | by core 0 behind `done` |
//! | those of what is heard | by core 0 between `go` and `left` | by core 1 from there to `heard` |
//! | the sum of a tick | by core 1 before `heard` | by core 0 in the next tick |
//! | `go`, `led`, `left` | by core 0, `go` while `done` (`heard`) is the last number | by core 1 |
//! | `early`, `done`, `heard` | by core 1, once for each `go` | by core 0 |
//!
//! Where `early` or `done` does not come within so many rounds as a tick has cycles, the tick is
//! missed: its drive words are 0, the next one is silent, and no `go` is given until `done`, or
//! `heard`, is there. A sum has the number of its tick, and is silence in any other.

use std::fmt::Write;

use whippen_parts::Role;

use super::{Cut, DONE, EARLY, FINISHED, LATE, LED, LEFT, MEET, MEMBERS, POLL, WAIT, WENT};
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
    if cut.has_sound() {
        first.text.push_str(WORDS_SOUND);
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

/// The same where core 1 has what is heard while core 0 runs the tail.
const WORDS_SOUND: &str = "
        .section .bss.near.core0.crossing, \"aw\", %nobits
        .global core0_heard
core0_heard: .space 4                   @ the number of the tick whose sum is there
        .section .bss.near.core1.crossing, \"aw\", %nobits
        .global core1_left
core1_left: .space 4                    @ that of what core 0's members leave
";

fn is_member(role: Role) -> bool {
    matches!(role, Role::Member(_))
}

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
        let members = self.parts(0, is_member);
        let sound = self.parts(0, |role| role == Role::Sound);
        let tail = self.cut.parts.len();
        self.function(&format!("{name}_tick"));
        self.line("        push    {r1, lr}");
        if self.cut.has_helper() {
            let last = match self.cut.has_sound() {
                true => "core0_heard",
                false => "core0_done",
            };
            self.line(&format!(
                "        ldr     r0, =core0_turn\n        ldr     r0, [r0]\n        \
                 ldr     r1, ={last}\n        ldr     r1, [r1]\n        \
                 cmp     r0, r1                  @ core 1 is not done with the tick before\n        \
                 beq     1f\n        b       9f\n1:",
            ));
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
        self.run(&sound);
        self.call(tail, "tick");
        self.line("        pop     {r1, pc}\n        .ltorg");
        self.function(&format!("{name}_init"));
        self.line("        push    {r1, lr}");
        (0..=tail).for_each(|part| self.call(part, "init"));
        self.line("        pop     {r1, pc}\n        .ltorg");
    }

    /// Core 1 is late: no force in this tick, and the next one is silent.
    fn late(&mut self, words: u32) {
        self.line(&format!("        .global {LATE}\n{LATE}:\n9:"));
        if self.cut.has_sound() {
            // Core 1 may wait for members that did not run.
            self.line("        ldr     r0, =core0_turn\n        ldr     r1, [r0]");
            self.give("core1_left");
        }
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
        let members = self.parts(0, is_member);
        self.function(MEMBERS);
        self.line("        push    {r1, lr}");
        self.line(match self.cut.has_sound() {
            true => {
                "        ldr     r0, =core0
        ldr     r1, [r0, #C_TICK]       @ which the sum is that of
        ldr     r0, =core0_turn
        str     r1, [r0]"
            }
            false => {
                "        ldr     r0, =core0_turn
        ldr     r1, [r0]
        adds    r1, #1
        str     r1, [r0]"
            }
        });
        self.give("core1_go");
        self.line(&format!("        .global {WENT}\n{WENT}:"));
        if self.cut.has_early() {
            self.meet(period);
        }
        self.run(&members);
        // Behind a barrier nothing is late in the pipeline, or what loads the number is behind it.
        let left = format!("        .global {LEFT}\n{LEFT}:");
        if self.cut.has_sound() {
            self.turn();
            self.give("core1_left");
            self.line(&left);
        } else {
            self.line(&left);
            self.turn();
        }
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
        self.turn();
        self.give("core1_led");
        self.line(&format!("        .global {LED}\n{LED}:"));
        self.wait("core0_early", MEET, period);
    }

    /// The number that was given last, in R1.
    fn turn(&mut self) {
        self.line("        ldr     r1, =core0_turn\n        ldr     r1, [r1]");
    }

    /// Gives core 1 the number in R1: what it takes is there before.
    fn give(&mut self, word: &str) {
        self.line(&format!(
            "        ldr     r0, ={word}\n        dmb     sy\n        str     r1, [r0]\n        dmb     sy"
        ));
    }

    /// Core 0 waits until core 1 has written the number in R1, which was given last; R0 is 1 where
    /// it does not.
    fn wait(&mut self, word: &str, label: &str, period: u64) {
        self.line(&format!(
            "        ldr     r0, ={word}
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

    /// Core 1 writes the number that it has seen, and has it in R1.
    fn tell(&mut self, word: &str) {
        self.line("        ldr     r1, =core1_seen\n        ldr     r1, [r1]");
        self.give(word);
    }

    /// Core 1 writes the number that it has seen, and waits until core 0 has written it, too.
    fn tell_and_wait(&mut self, told: &str, word: &str, [look, wait]: [&str; 2]) {
        self.tell(told);
        self.line(&format!(
            "        .global {look}, {wait}
{look}:
        ldr     r0, ={word}
{wait}:
@! rounds 3
2:      ldr     r2, [r0]
        cmp     r2, r1
        bne     2b
        dmb     sy"
        ));
    }

    /// Core 1 writes what is heard in this tick as the frame's sum does (`sound.s`).
    fn sum(&mut self) {
        let (name, built) = self.cut.heard(self.tail);
        let cells = self.tail.channels.iter();
        let at: Vec<u32> = cells
            .filter_map(|cell| built.layout.cell(0, *cell))
            .collect();
        for (channel, at) in at.iter().enumerate() {
            let (low, high) = (2 * channel, 2 * channel + 1);
            self.line(&format!(
                "        ldr     r{low}, ={name}_state + {at}
        ldr     r{low}, [r{low}]
        asrs    r{high}, r{low}, #31"
            ));
        }
        self.line(
            "        ldr     r7, =core1_seen
        ldr     r7, [r7]
        movs    r6, #1
        ands    r6, r7
        lsls    r6, r6, #5
        ldr     r5, =sound0
        adds    r5, r5, r6",
        );
        for word in 0..2 * at.len() {
            self.line(&format!("        str     r{word}, [r5, #{}]", 4 + 4 * word));
        }
        self.line("        str     r7, [r5]");
    }

    /// Core 1: parts' ticks are all that it ever does.
    fn helper(&mut self) {
        let early = self.parts(1, |role| role == Role::Early);
        let members = self.parts(1, is_member);
        let sound = self.parts(1, |role| role == Role::Sound);
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
            self.tell_and_wait("core0_early", "core1_led", EARLY);
        }
        self.help(&members);
        match self.cut.has_sound() {
            true => {
                self.tell_and_wait("core0_done", "core1_left", DONE);
                self.help(&sound);
                self.sum();
                self.tell("core0_heard");
            }
            false => self.tell("core0_done"),
        }
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
