//! Programs as text, and a driver that walks through them without executing: the text says what the
//! branches do.
//!
//! ```text
//! == title
//! anything: the count on paper, the source
//! 10000006 d1fd      bne 10000004 x99        taken the first 99 times it is reached, then not
//! 10000008 4788      blx r1 > 10000010       taken every time
//! 10000010 4770      bx lr > back            to behind the last call
//! 10000012 bf08      it eq
//! 10000014 1840      addeq r0, r0, r1 skip   its condition fails
//! = 299
//! ```
//!
//! The text of an instruction is compared with what the halfwords say.

use whippen_isa::timing::{Core, Outcome, Pipe, Timed};
use whippen_isa::{Inst, ItState, Op, decode};

/// What the text says a branch does.
#[derive(Clone, Copy, PartialEq)]
enum Does {
    Next,
    Skip,
    /// Goes there, so many times.
    To(u32, u32),
    Back,
    /// Divides with so many quotient bits.
    Divide(i8),
    /// Waits for memory.
    Wait(u16),
    /// Accesses the single-cycle IO port.
    Near,
}

struct Step {
    address: u32,
    text: String,
    inst: Inst,
    timed: Timed,
    does: Does,
}

pub struct Program {
    pub title: String,
    pub want: u64,
    steps: Vec<Step>,
}

pub struct Run {
    pub cycles: u64,
    /// The last cost of each line, with how often it was executed.
    pub listing: String,
}

/// All programs of a text. Panics with the line at anything malformed.
pub fn parse(text: &str, core: &Core) -> Vec<Program> {
    let mut programs: Vec<Program> = Vec::new();
    let mut it = ItState::OUTSIDE;
    for line in text.lines() {
        if let Some(title) = line.strip_prefix("== ") {
            programs.push(Program {
                title: title.to_string(),
                want: u64::MAX,
                steps: Vec::new(),
            });
            it = ItState::OUTSIDE;
            continue;
        }
        let Some(program) = programs.last_mut() else {
            continue;
        };
        if let Some(count) = line.strip_prefix("= ") {
            program.want = count
                .trim()
                .parse()
                .unwrap_or_else(|_| panic!("a count: {line}"));
        } else if let Some(step) = step(line, core, &mut it) {
            program.steps.push(step);
        }
    }
    assert!(
        programs
            .iter()
            .all(|p| p.want != u64::MAX && !p.steps.is_empty()),
        "a program without count or code"
    );
    programs
}

/// A line of code: eight hexadecimal digits first. All others are comment.
fn step(line: &str, core: &Core, it: &mut ItState) -> Option<Step> {
    let (address, rest) = line.split_once(' ')?;
    let address = if address.len() == 8 {
        u32::from_str_radix(address, 16).ok()?
    } else {
        return None;
    };
    let rest = rest.trim_start();
    let hex = |from: usize| {
        rest.get(from..from + 4)
            .and_then(|h| u16::from_str_radix(h, 16).ok())
    };
    let hw1 = hex(0).unwrap_or_else(|| panic!("a halfword: {line}"));
    let wide = whippen_isa::is_wide(hw1);
    let hw2 = if wide {
        hex(5).unwrap_or_else(|| panic!("a second halfword: {line}"))
    } else {
        0
    };
    let said = rest[if wide { 9 } else { 4 }..].trim();
    let inst = decode(hw1, hw2, core.arch, *it).unwrap_or_else(|e| panic!("{line}: {e:?}"));
    *it = after(*it, &inst);
    let text = inst.to_string();
    let does = said
        .strip_prefix(&*text)
        .unwrap_or_else(|| panic!("it says {text}: {line}"));
    let does = parse_does(does, line);
    Some(Step {
        address,
        timed: core.prepare(&inst),
        inst,
        text,
        does,
    })
}

fn after(it: ItState, inst: &Inst) -> ItState {
    if inst.op() != Op::IT {
        return it.advance();
    }
    ItState::after_it((inst.imm >> 4) as u8, (inst.imm & 15) as u8).expect("a block")
}

fn parse_does(text: &str, line: &str) -> Does {
    let words: Vec<&str> = text.split_whitespace().collect();
    let hex = |w: &str| u32::from_str_radix(w, 16).unwrap_or_else(|_| panic!("an address: {line}"));
    match words[..] {
        [] => Does::Next,
        ["skip"] => Does::Skip,
        [">", "back"] => Does::Back,
        [">", to] => Does::To(hex(to), u32::MAX),
        [">", to, times] => Does::To(
            hex(to),
            times.trim_start_matches('x').parse().expect("a count"),
        ),
        ["bits", n] => Does::Divide(n.parse().expect("a number")),
        ["near"] => Does::Near,
        ["wait", n] => Does::Wait(n.parse().expect("a number")),
        _ => panic!("what does it do: {line}"),
    }
}

impl Program {
    /// The cycles on another core of the same architecture.
    pub fn run_again(&self, core: &Core) -> u64 {
        let prepared = |s: &Step| Step {
            timed: core.prepare(&s.inst),
            text: s.text.clone(),
            ..*s
        };
        let steps = self.steps.iter().map(prepared).collect();
        Self {
            title: self.title.clone(),
            want: self.want,
            steps,
        }
        .run(core)
        .cycles
    }

    /// Walks from the first line until the code ends.
    pub fn run(&self, core: &Core) -> Run {
        let (mut pipe, mut cycles, mut at) = (Pipe::default(), 0, self.steps[0].address);
        let mut times = vec![0_u32; self.steps.len()];
        let mut last = vec![String::new(); self.steps.len()];
        let mut back = 0;
        while let Some(i) = self.steps.iter().position(|s| s.address == at) {
            let step = &self.steps[i];
            let outcome = self.outcome(step, times[i], back);
            let (next, cost) = core.issue(pipe, &step.timed, at, &outcome);
            (pipe, cycles) = (next, cycles + u64::from(cost.cycles()));
            let after = at + step.inst.size();
            back = if matches!(step.inst.op(), Op::BL | Op::BLX) {
                after
            } else {
                back
            };
            at = outcome.target.map_or(after, |t| t.address);
            times[i] += 1;
            last[i] = cost.to_string();
        }
        let line = |(i, s): (usize, &Step)| {
            format!(
                "  {:08x} {:28} x{} {}",
                s.address, s.text, times[i], last[i]
            )
        };
        let listing = self
            .steps
            .iter()
            .enumerate()
            .map(line)
            .collect::<Vec<_>>()
            .join("\n");
        Run { cycles, listing }
    }

    fn outcome(&self, step: &Step, times: u32, back: u32) -> Outcome {
        let taken = |to: u32| {
            let wide = self
                .steps
                .iter()
                .any(|s| s.address == to && s.inst.size() == 4);
            Outcome::taken(to, wide)
        };
        match step.does {
            Does::Skip => Outcome::SKIPPED,
            Does::To(to, limit) if times < limit => taken(to),
            Does::Back => taken(back),
            Does::Divide(quotient_bits) => Outcome {
                quotient_bits,
                ..Outcome::NEXT
            },
            Does::Near => Outcome {
                near: true,
                ..Outcome::NEXT
            },
            Does::Wait(waits) => Outcome {
                waits,
                ..Outcome::NEXT
            },
            Does::Next | Does::To(..) => Outcome::NEXT,
        }
    }
}
