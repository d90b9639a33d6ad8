//! Programs as text, and a driver that walks through them without executing: the text says what the
//! branches do.
//!
//! ```text
//! == title
//! anything: the count on paper, the source
//! registers r1=20040000 r3=20000011       what a core that executes it needs; all others are 20040000
//! memory 20040000=20000011                and of memory from there on, whose words are that else
//! apart: why no core executes it alone
//! 10000006 d1fd      bne 10000004 x99        taken the first 99 times it is reached, then not
//! 10000008 4788      blx r1 > 10000010       taken every time
//! 10000010 4770      bx lr > back            to behind the last call
//! 10000012 bf08      it eq
//! 10000014 1840      addeq r0, r0, r1 skip   its condition fails
//! = 299
//! ```
//!
//! The text of an instruction is compared with what the halfwords say.

use alloc::format;
use alloc::string::{String, ToString};
use alloc::vec;
use alloc::vec::Vec;

use super::{Core, Evidence, Outcome, Pipe};
use crate::{Arch, Inst, ItState, Op, decode};

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
    code: Vec<u16>,
    text: String,
    inst: Inst,
    does: Does,
}

/// A few instructions with the cycles that they take.
pub struct Program {
    /// What it shows.
    pub title: String,
    /// The count on paper, with its source.
    pub paper: String,
    /// That count.
    pub want: u64,
    /// Numbers of core registers that are not [`DATA`], or [`APSR`], and what they are.
    pub registers: Vec<(u8, u32)>,
    /// Addresses of words that are not [`DATA`], and what they are.
    pub memory: Vec<(u32, u32)>,
    /// Why no core executes it alone.
    pub apart: Option<String>,
    steps: Vec<Step>,
}

/// A walk through a program.
pub struct Run {
    /// What it took.
    pub cycles: u64,
    /// As sure as its least sure part.
    pub evidence: Evidence,
    /// Where it came out.
    pub end: u32,
    /// The last cost of each line, with how often it was executed.
    pub listing: String,
}

/// The number that stands for the flags, which are 0 otherwise.
pub const APSR: u8 = 15;
/// Where the programs begin.
pub const CODE: u32 = 0x2000_0000;
/// Where their memory begins: what registers and words are that nobody speaks of.
pub const DATA: u32 = 0x2004_0000;

/// The programs of the rules of a core: one for each number of its table.
pub const fn rules(arch: Arch) -> &'static str {
    match arch {
        Arch::V6M => include_str!("../cores/cortex_m0plus.txt"),
        Arch::V7EM => include_str!("../cores/cortex_m4.txt"),
        Arch::V8M => include_str!("../cores/cortex_m33.txt"),
    }
}

/// All programs of a text.
///
/// # Errors
/// A line that is malformed.
pub fn programs(text: &str, core: &Core) -> Result<Vec<Program>, String> {
    text.split("\n== ")
        .skip(1)
        .map(|block| program(block, core))
        .collect()
}

fn program(block: &str, core: &Core) -> Result<Program, String> {
    let (title, rest) = block.split_once('\n').unwrap_or((block, ""));
    let mut program = Program {
        title: title.to_string(),
        paper: rest.lines().next().unwrap_or_default().to_string(),
        want: u64::MAX,
        registers: Vec::new(),
        memory: Vec::new(),
        apart: None,
        steps: Vec::new(),
    };
    let mut it = ItState::OUTSIDE;
    for line in rest.lines() {
        if let Some(count) = line.strip_prefix("= ") {
            let count = count.trim().parse();
            program.want = count.map_err(|_| format!("a count: {line}"))?;
        } else if let Some(words) = line.strip_prefix("registers ") {
            for (name, value) in assignments(words, line)? {
                let number = register(name).ok_or_else(|| format!("a register: {line}"))?;
                program.registers.push((number, value));
            }
        } else if let Some(words) = line.strip_prefix("memory ") {
            for (address, value) in assignments(words, line)? {
                program.memory.push((hexadecimal(address, line)?, value));
            }
        } else if let Some(why) = line.strip_prefix("apart: ") {
            program.apart = Some(why.to_string());
        } else if let Some(step) = step(line, core, &mut it)? {
            program.steps.push(step);
        }
    }
    match program.want == u64::MAX || program.steps.is_empty() {
        true => Err(format!("a program without count or code: {title}")),
        false => Ok(program),
    }
}

/// As in `r6=20001001 lr=20000011`.
fn assignments<'a>(words: &'a str, line: &str) -> Result<Vec<(&'a str, u32)>, String> {
    let pair = |word: &'a str| {
        let (name, value) = word
            .split_once('=')
            .ok_or_else(|| format!("a value: {line}"))?;
        Ok((name, hexadecimal(value, line)?))
    };
    words.split_whitespace().map(pair).collect()
}

fn register(name: &str) -> Option<u8> {
    if name == "apsr" {
        return Some(APSR);
    }
    (0..APSR).find(|&number| crate::reg::core_name(number) == name)
}

fn hexadecimal(word: &str, line: &str) -> Result<u32, String> {
    u32::from_str_radix(word, 16).map_err(|_| format!("a hexadecimal number: {line}"))
}

/// A line of code: eight hexadecimal digits first. All others are comment.
fn step(line: &str, core: &Core, it: &mut ItState) -> Result<Option<Step>, String> {
    let address = match line.split_once(' ') {
        Some((address, _)) if address.len() == 8 => u32::from_str_radix(address, 16),
        _ => return Ok(None),
    };
    let Ok(address) = address else {
        return Ok(None);
    };
    let rest = line[8..].trim_start();
    let halfword = |from: usize| {
        let digits = rest.get(from..from + 4);
        let word = digits.and_then(|digits| u16::from_str_radix(digits, 16).ok());
        word.ok_or_else(|| format!("a halfword: {line}"))
    };
    let mut code = vec![halfword(0)?];
    if crate::is_wide(code[0]) {
        code.push(halfword(5)?);
    }
    let said = rest[5 * code.len() - 1..].trim();
    let second = code.get(1).copied().unwrap_or(0);
    let inst = decode(code[0], second, core.arch, *it).map_err(|e| format!("{line}: {e:?}"))?;
    *it = inst
        .it_behind(*it)
        .ok_or_else(|| format!("a block: {line}"))?;
    let text = inst.to_string();
    let does = said
        .strip_prefix(&*text)
        .ok_or_else(|| format!("it says {text}: {line}"))?;
    Ok(Some(Step {
        address,
        code,
        does: parse_does(does, line)?,
        inst,
        text,
    }))
}

fn parse_does(text: &str, line: &str) -> Result<Does, String> {
    let words: Vec<&str> = text.split_whitespace().collect();
    let number = |word: &str| {
        let number = word.trim_start_matches('x').parse::<u16>();
        number.map_err(|_| format!("a number: {line}"))
    };
    Ok(match words[..] {
        [] => Does::Next,
        ["skip"] => Does::Skip,
        [">", "back"] => Does::Back,
        [">", to] => Does::To(hexadecimal(to, line)?, u32::MAX),
        [">", to, times] => Does::To(hexadecimal(to, line)?, number(times)?.into()),
        ["bits", "-1"] => Does::Divide(-1),
        ["bits", n] => Does::Divide(number(n)? as i8),
        ["near"] => Does::Near,
        ["wait", n] => Does::Wait(number(n)?),
        _ => return Err(format!("what does it do: {line}")),
    })
}

impl Program {
    /// Its instructions: addresses and halfwords.
    pub fn code(&self) -> impl Iterator<Item = (u32, &[u16])> {
        self.steps.iter().map(|step| (step.address, &step.code[..]))
    }

    /// Walks from the first line until the code ends, on any core of the architecture.
    pub fn run(&self, core: &Core) -> Run {
        let (mut pipe, mut cycles, mut at) = (Pipe::default(), 0, self.steps[0].address);
        let mut times = vec![0_u32; self.steps.len()];
        let mut last = vec![String::new(); self.steps.len()];
        let (mut back, mut evidence) = (0, Evidence::Exact);
        while let Some(i) = self.steps.iter().position(|s| s.address == at) {
            let step = &self.steps[i];
            let outcome = self.outcome(step, times[i], back);
            let timed = core.prepare(&step.inst);
            let (next, cost) = core.issue(pipe, &timed, at, &outcome);
            (pipe, cycles) = (next, cycles + u64::from(cost.cycles()));
            evidence = evidence.max(core.evidence(&timed, &cost));
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
        Run {
            cycles,
            evidence,
            end: at,
            listing,
        }
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
