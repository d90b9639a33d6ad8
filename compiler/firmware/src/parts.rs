//! One instrument in parts: its head, the members of its banks, its tail, called one after the
//! other as one instrument is; on two cores members are divided between them.
//!
//! ```text
//!   core 0   NAME_tick -> head -> wires -> go ------> members -> wires -> wait --> tail
//!   core 1                                  '-> members -> wires -> done --^
//! ```
//!
//! Core 1 has no interrupt and no words of the converter: it looks for a new number in `go`, runs
//! its members and writes the number to `done`. What is written and who reads it never meet,
//! because one core works on it at a time:
//!
//! | words | written | read |
//! | --- | --- | --- |
//! | live values of core 1's members | by core 0 before `go` | by core 1 between `go` and `done` |
//! | those of the tail and of core 0's members | by core 1 between `go` and `done`, the tail's alone | by core 0 behind `done` |
//! | `go` | by core 0, while `done` is the last number | by core 1 |
//! | `done` | by core 1, once for each `go` | by core 0 |
//!
//! Where `done` does not come within so many rounds as a tick has cycles, the tick is missed: its
//! drive words are 0, the next one is silent, and no `go` is given until `done` is there.
//!
//! Not here: what the parts are (`whippen-parts`), cycles (`whippen-budget`).

use std::fmt::Write;

use whippen_arm::image::Symbol;
use whippen_arm::thumb::{Built, ThumbError};
use whippen_kernel::Kernel;
use whippen_modes::Modes;
use whippen_parts::{Of, Parts, Role};

use super::code::{CoreCode, ZoneCode};
use super::{CORES, drive_offset_bytes, wires};

/// An instrument in parts, with the modes of each.
#[derive(Debug, Clone)]
pub struct InParts {
    /// What is cut.
    pub whole: Kernel,
    /// How many instructions the modes of a part may have.
    pub instructions: usize,
    /// The parts.
    pub parts: Parts,
    /// The modes of each, in the same order.
    pub modes: Vec<Modes>,
}

/// The code of a part; the tail is the zone that they belong to.
#[derive(Debug, Clone)]
pub struct PartCode {
    /// The prefix of its symbols.
    pub name: String,
    /// What it is.
    pub role: Role,
    /// The core that runs it.
    pub core: usize,
    /// Code, state, and where the state has what.
    pub built: Built,
}

/// What is in parts.
#[derive(Debug, Clone)]
pub struct Cut {
    /// All parts but the tail, in their order.
    pub parts: Vec<PartCode>,
    /// All of them, by number.
    of: Parts,
}

/// The function in which core 0 starts core 1, runs its own members and waits.
pub const MEMBERS: &str = "core0_members";
/// Where core 1 has been started.
pub const WENT: &str = "core0_went";
/// The loop in which core 0 waits.
pub const WAIT: &str = "core0_wait";
/// Where core 1 begins to look for `go`, and the loop in which it does.
pub const POLL: [&str; 2] = ["core1_poll", "core1_wait"];
/// Where core 1 has written `done`.
pub const FINISHED: &str = "core1_finished";

impl InParts {
    /// The kernel of the tail.
    pub fn tail(&self) -> Option<&Kernel> {
        self.parts.parts.last().map(|part| &part.kernel)
    }

    /// The core of every part, on so many: the most expensive member first, each to the core that
    /// has least, by these cycles. With one core, or nothing to divide, all are on core 0.
    pub fn divided(&self, cores: usize, cycles: impl Fn(usize) -> u64) -> Vec<usize> {
        let parts = &self.parts.parts;
        let is_member = |part: &usize| matches!(parts[*part].role, Role::Member(_));
        let mut members: Vec<usize> = (0..parts.len()).filter(is_member).collect();
        members.sort_by_key(|part| std::cmp::Reverse(cycles(*part)));
        let mut of_core = vec![0; parts.len()];
        let mut taken = [0, 0];
        for part in members {
            let core = usize::from(cores > 1 && taken[1] < taken[0]);
            taken[core] += cycles(part);
            of_core[part] = core;
        }
        of_core
    }

    /// The core of every part, on so many, where each member is all that one core has.
    pub fn on_own_cores(&self, cores: usize) -> Vec<usize> {
        let core = |role| match role {
            Role::Member(number) => cores.saturating_sub(1).min(number as usize),
            _ => 0,
        };
        self.parts
            .parts
            .iter()
            .map(|part| core(part.role))
            .collect()
    }
}

/// The name of a part.
pub(super) fn part_name(core: usize, part: usize) -> String {
    format!("{}_part{part}", CORES[core])
}

impl Cut {
    /// What is cut so.
    pub(super) fn new(parts: Vec<PartCode>, of: &Parts) -> Cut {
        let of = of.clone();
        Cut { parts, of }
    }

    /// Whether core 1 has a part.
    pub fn has_helper(&self) -> bool {
        self.parts.iter().any(|part| part.core == 1)
    }

    /// Words that core 1 writes to the memory of core 0 in a tick.
    pub fn crossing_back(&self) -> u32 {
        let wires = self.of.wires.iter();
        let from_core1 = wires.filter(|wire| self.core_of(wire.from.part) == 1);
        1 + from_core1.map(|wire| wire.to.len() as u32).sum::<u32>()
    }

    /// The tail is on core 0.
    fn core_of(&self, part: usize) -> usize {
        self.parts.get(part).map_or(0, |part| part.core)
    }

    /// Where a live value of the whole is: name of the state, offset there.
    pub(super) fn live<'a>(&'a self, tail: &'a ZoneCode, live: usize) -> Option<(&'a str, u32)> {
        let Of { part, number } = *self.of.lives.get(live)?;
        let (name, built) = self.part(tail, part);
        Some((name, built.layout.live_param(number as usize)?))
    }

    fn part<'a>(&'a self, tail: &'a ZoneCode, part: usize) -> (&'a str, &'a Built) {
        match self.parts.get(part) {
            Some(own) => (&own.name, &own.built),
            None => (&tail.name, &tail.built),
        }
    }
}

/// Gives the tail the names by which the frame knows the state of the keys, and the function that
/// begins one, which nobody calls where there is one program.
pub(super) fn with_names_of_frame(mut tail: Built, own: &str, frame: &str) -> Built {
    let symbols = &mut tail.object.symbols;
    for what in ["state", "begin"] {
        let found = symbols
            .iter()
            .find(|known| known.name == format!("{own}_{what}"));
        let alias = found.map(|known| Symbol {
            name: format!("{frame}_{what}"),
            ..known.clone()
        });
        symbols.extend(alias);
    }
    tail
}

/// That a wire ends where it is told to.
pub(super) fn check(cut: &Cut, tail: &ZoneCode) -> Result<(), ThumbError> {
    for wire in &cut.of.wires {
        let ends = wire.to.iter().chain([&wire.from]);
        if ends.into_iter().any(|end| end.part > cut.parts.len()) {
            return Err(ThumbError::Bug(format!(
                "a wire of no part of {}",
                tail.name
            )));
        }
    }
    Ok(())
}

/// The calls of a core's parts as assembly, in instructions that all cores have, for a tick of so
/// many cycles and so many words each way.
pub(super) fn as_assembly(core: &CoreCode, cut: &Cut, period: u64, words: u32) -> Vec<String> {
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
        let heads = self.parts(0, |role| role == Role::Head);
        let members = self.parts(0, |role| role != Role::Head);
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
        self.run(&heads);
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
        let members = self.parts(0, |role| role != Role::Head);
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
        self.run(&members);
        self.line(&format!(
            "        ldr     r0, =core0_turn
        ldr     r1, [r0]
        ldr     r0, =core0_done
        ldr     r3, ={period}
        .global {WAIT}
{WAIT}:
@! rounds 1
2:      ldr     r2, [r0]
        cmp     r2, r1
        beq     1f
        subs    r3, #1
        bne     2b
        movs    r0, #1
        pop     {{r1, pc}}
1:      dmb     sy                      @ what its members left is read behind
        movs    r0, #0
        pop     {{r1, pc}}
        .ltorg"
        ));
    }

    /// Core 1: a member's tick is all that it ever does.
    fn helper(&mut self) {
        let members = self.parts(1, |_| true);
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
        // A member takes nothing from the converter's words, and has none on the stack.
        for part in members {
            let (name, _) = self.cut.part(self.tail, part);
            let text = format!(
                "        ldr     r0, ={name}_state\n        movs    r1, #0\n        bl      {name}_tick"
            );
            self.line(&text);
            self.wires(part);
        }
        self.line(&format!(
            "        ldr     r2, =core1_seen
        ldr     r2, [r2]
        ldr     r0, =core0_done
        dmb     sy
        str     r2, [r0]
        dmb     sy
{FINISHED}:
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
