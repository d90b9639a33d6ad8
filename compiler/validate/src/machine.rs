//! The symbolic run of machine code: one instruction after the other along one path, from bytes.
//!
//! Registers hold words as signed numbers. What an instruction does is in `alu`, `multiply` and
//! `access`; an instruction that is not there ends the run.

use whippen_isa::reg::{LR, PC};
use whippen_isa::{Inst, ItState, Op, decode, is_wide};

use crate::bounds::WORD;
use crate::check::TERMS_MAX;
use crate::flags::Status;
use crate::memory::Memory;
use crate::places::Question;
use crate::stop::{Doubt, Reason, Stop, Told, unproven, unproven_as};
use crate::term::{Kind, Term, Terms};
use crate::truth::Truth;

/// How many instructions a run may have: more than there are cycles in a tick.
const STEPS_MAX: usize = 10_000;
/// Terms that there may be on a path, which bounds the memory that one takes that never ends: where
/// each store may meet all others, terms are as many as pairs of stores.
const PATH_TERMS_MAX: usize = 2 * TERMS_MAX;

/// A processor.
pub(crate) struct Machine<'a> {
    pub question: &'a Question<'a>,
    pub registers: [Term; 16],
    /// Registers that were read before they were written, and that were written.
    pub read: u16,
    pub written: u16,
    pub flags: Status,
    pub memory: Memory,
    pub pc: u32,
    /// The halfwords of code that the run looked at, by address, some more than once.
    pub looked_at: Vec<u32>,
    pub it: ItState,
    /// How many words that routines have left are not known; each is one of its own.
    pub unknown: u32,
    /// Where the instruction takes place.
    pub guard: Truth,
    /// Whether what sides of a branch leave may be put together.
    pub joins: bool,
}

/// How a run ends.
pub(crate) enum RunEnd {
    /// In code, where it was to end.
    At(u32),
    /// For an address at which there is no code that is known.
    For(Term),
}

/// What comes after an instruction.
pub(crate) enum Next {
    Behind,
    To(u32),
    /// To an address that is in a register.
    Away(Term),
}

impl<'a> Machine<'a> {
    /// A processor whose registers and memory hold what they hold at the beginning.
    pub fn new(question: &'a Question<'a>, terms: &mut Terms, pc: u32) -> Machine<'a> {
        Machine {
            question,
            registers: std::array::from_fn(|register| terms.of(Kind::Register(register as u8))),
            read: 0,
            written: 0,
            flags: Status::default(),
            memory: Memory::default(),
            pc,
            looked_at: Vec::new(),
            it: ItState::OUTSIDE,
            unknown: 0,
            guard: Truth::YES,
            joins: true,
        }
    }

    /// A word of which nothing is known.
    pub fn next_unknown(&mut self, terms: &mut Terms) -> Term {
        self.unknown += 1;
        terms.of(Kind::Unknown(self.unknown))
    }

    /// In a run with numbers registers hold some, too.
    pub fn draw_registers(&mut self, terms: &mut Terms) {
        for register in &mut self.registers {
            if let Some(number) = terms.drawn(WORD) {
                *register = terms.constant(number);
            }
        }
    }

    /// Runs until the code is left; gives the address to which it goes.
    pub fn run(&mut self, terms: &mut Terms) -> Told<Term> {
        match self.run_until(terms, |_| false)? {
            RunEnd::For(target) => Ok(target),
            RunEnd::At(_) => unproven("nobody asked to stop"),
        }
    }

    /// Runs until the code is left, or until something holds behind an instruction.
    pub fn run_until(
        &mut self,
        terms: &mut Terms,
        mut holds: impl FnMut(&Machine) -> bool,
    ) -> Told<RunEnd> {
        for _ in 0..STEPS_MAX {
            if terms.of_paths() > PATH_TERMS_MAX {
                let why = format!("a path of more than {PATH_TERMS_MAX} terms");
                return unproven_as(Reason::Cases, why);
            }
            if !self.pass_root(terms)?
                && let Some(target) = self.one(terms)?
            {
                return Ok(RunEnd::For(target));
            }
            if holds(self) {
                return Ok(RunEnd::At(self.pc));
            }
        }
        unproven("a path is too long")
    }

    /// Runs an instruction; gives the address to which it goes, if there is no code.
    pub fn one(&mut self, terms: &mut Terms) -> Told<Option<Term>> {
        let (inst, size) = self.fetch()?;
        let next = self
            .step(terms, &inst)
            .map_err(|stop| self.placed(stop, &inst))?;
        match next {
            Next::Behind => self.pc = self.pc.wrapping_add(size),
            Next::To(address) => self.pc = address & !1,
            Next::Away(target) => match terms.number(target) {
                Some(address) if self.question.code.half(address as u32 & !1).is_some() => {
                    self.pc = address as u32 & !1;
                }
                _ => return Ok(Some(target)),
            },
        }
        Ok(None)
    }

    fn placed(&self, stop: Stop, inst: &Inst) -> Stop {
        match stop {
            Stop::Unproven(doubt) => Stop::Unproven(Doubt {
                why: format!("{:#x} `{inst}`: {}", self.pc, doubt.why),
                ..doubt
            }),
            other => other,
        }
    }

    fn fetch(&mut self) -> Told<(Inst, u32)> {
        let code = self.question.code;
        self.looked_at.push(self.pc);
        let Some(first) = code.half(self.pc) else {
            return unproven(format!("there is no code at {:#x}", self.pc));
        };
        let second = match is_wide(first) {
            true => {
                let second = self.pc.wrapping_add(2);
                self.looked_at.push(second);
                code.half(second).unwrap_or_default()
            }
            false => 0,
        };
        match decode(first, second, self.question.arch, self.it) {
            Ok(inst) => Ok((inst, inst.size())),
            Err(why) => unproven(format!("no instruction at {:#x}: {why:?}", self.pc)),
        }
    }

    fn step(&mut self, terms: &mut Terms, inst: &Inst) -> Told<Next> {
        if inst.op() == Op::IT {
            let Some(it) = inst.it_behind(self.it) else {
                return unproven("an IT block without a meaning");
            };
            self.it = it;
            return Ok(Next::Behind);
        }
        self.it = self.it.advance();
        self.guard = match inst.cond {
            Some(cond) if inst.is_conditional() => {
                let truth = self.flags.holds(terms, cond)?;
                terms.settle(truth)
            }
            _ => Truth::YES,
        };
        if self.guard != Truth::YES && inst.op() == Op::B && self.it == ItState::OUTSIDE {
            let (holds, behind) = (self.guard, self.pc.wrapping_add(inst.size()));
            self.guard = Truth::YES;
            let to = self.pc.wrapping_add(4).wrapping_add(inst.imm);
            return self.go(terms, holds, [to, behind]);
        }
        if self.guard != Truth::YES && self.must_decide(terms, inst) {
            self.guard = Truth::of(terms.decide(self.guard)?);
        }
        if self.guard == Truth::NO {
            return Ok(Next::Behind);
        }
        if let Some(next) = self.branch(terms, inst)? {
            return Ok(next);
        }
        let before = (self.guard != Truth::YES && inst.s).then(|| self.flags.clone());
        let is_done = self.alu(terms, inst)?
            || self.bits(terms, inst)?
            || self.multiply(terms, inst)?
            || self.access(terms, inst)?;
        if !is_done {
            return unproven("an instruction that is not followed");
        }
        if let Some(before) = before {
            self.flags = std::mem::take(&mut self.flags).or_else(before, self.guard);
        }
        Ok(Next::Behind)
    }

    fn must_decide(&self, terms: &Terms, inst: &Inst) -> bool {
        inst.s && !terms.by_value
            || inst.wback
            || inst.defs().core_bits() & (1 << PC | 1 << 13) != 0
    }

    fn branch(&mut self, terms: &mut Terms, inst: &Inst) -> Told<Option<Next>> {
        let to = self.pc.wrapping_add(4).wrapping_add(inst.imm);
        let next = match inst.op() {
            Op::B => Next::To(to),
            Op::BL => {
                let back = self.pc.wrapping_add(inst.size()) | 1;
                let term = terms.constant(i128::from(back as i32));
                self.write(terms, LR, term)?;
                match self.call(terms, to)? {
                    true => Next::Behind,
                    false => Next::To(to),
                }
            }
            Op::BX => Next::Away(self.register(terms, inst.m)?),
            Op::POP if inst.imm & 1 << PC != 0 => Next::Away(self.pop_and_return(terms, inst)?),
            Op::CBZ | Op::CBNZ => {
                let value = self.register(terms, inst.n)?;
                let zero = terms.constant(0);
                let is_zero = terms.equal(value, zero)?;
                let goes = match inst.op() {
                    Op::CBZ => is_zero,
                    _ => terms.truths.not(is_zero),
                };
                self.go(terms, goes, [to, self.pc.wrapping_add(inst.size())])?
            }
            Op::NOP => Next::Behind,
            _ => return Ok(None),
        };
        Ok(Some(next))
    }

    /// What a register holds.
    pub fn register(&mut self, terms: &mut Terms, register: u8) -> Told<Term> {
        if register == PC {
            let pc = self.pc.wrapping_add(4) as i32;
            return Ok(terms.constant(pc.into()));
        }
        if self.written & 1 << register == 0 {
            self.read |= 1 << register;
        }
        Ok(self.registers[usize::from(register)])
    }

    /// Writes a register, where the instruction takes place.
    pub fn write(&mut self, terms: &mut Terms, register: u8, value: Term) -> Told<()> {
        if register == PC {
            return unproven("a write to PC");
        }
        let value = terms.word(value)?;
        let value = match self.guard {
            Truth::YES => value,
            guard => {
                let old = self.register(terms, register)?;
                terms.select(guard, value, old)?
            }
        };
        self.written |= 1 << register;
        self.registers[usize::from(register)] = value;
        Ok(())
    }
}
