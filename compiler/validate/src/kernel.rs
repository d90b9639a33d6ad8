//! The symbolic run of a mode: its blocks along one path, by the meaning of each operator.
//!
//! Memory is where the state keeps it, so that what the code stores can be compared address by
//! address.

use whippen_ids::IdMap;
use whippen_kernel::{Inst, Op, Range, Region, Type, Value, ValueInfo};
use whippen_modes::{End, Mode, ModeId, Target};

use crate::memory::Memory;
use crate::places::{Question, Shared};
use crate::stop::{Told, unproven};
use crate::term::{Base, Function, Kind, Term, Terms};
use crate::truth::Truth;

/// A value.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Number {
    Whole(Term),
    Truth(Truth),
}

/// A run of Kernel code.
pub(crate) struct KernelRun<'a> {
    pub question: &'a Question<'a>,
    pub values: &'a IdMap<Value, ValueInfo>,
    numbers: IdMap<Value, Option<Number>>,
    pub at: KeyAt,
    pub memory: Memory,
}

/// Where a key finds its memory.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct KeyAt {
    /// Its record.
    pub record: Term,
    /// Its words.
    pub samples: Term,
    /// Its slot in the first line.
    pub history: Term,
}

impl KeyAt {
    /// Whichever key it is.
    fn any(terms: &mut Terms) -> KeyAt {
        let bases = [Base::Record, Base::Samples, Base::History];
        let [record, samples, history] = bases.map(|base| terms.of(Kind::Base(base)));
        KeyAt {
            record,
            samples,
            history,
        }
    }
}

/// The terms of what the tick's entry computes.
pub(crate) fn run_shared<'a>(
    question: &'a Question<'a>,
    terms: &mut Terms,
    shared: &'a Shared,
) -> Told<Vec<Term>> {
    let at = KeyAt::any(terms);
    let mut run = KernelRun::new(question, &shared.values, at);
    for inst in &shared.insts {
        run.inst(terms, inst)?;
    }
    let results = shared.results.iter();
    results.map(|result| run.whole(terms, *result)).collect()
}

/// Runs a mode along the path that the facts tell; gives the mode of the next tick.
pub(crate) fn run_mode<'a>(
    question: &'a Question<'a>,
    terms: &mut Terms,
    mode: &'a Mode,
) -> Told<(Memory, ModeId)> {
    let key = KeyAt::any(terms);
    let mut run = KernelRun::new(question, &mode.values, key);
    let mut at = whippen_modes::BlockId(0);
    loop {
        let block = &mode.blocks[at];
        for inst in &block.insts {
            run.inst(terms, inst)?;
        }
        let target = match &block.end {
            End::Next(next) => return Ok((run.memory, *next)),
            End::Jump(target) => target,
            End::Branch {
                condition, yes, no, ..
            } => {
                let truth = run.truth(*condition)?;
                if terms.decide(truth)? { yes } else { no }
            }
        };
        run.hand_over(terms, mode, target)?;
        at = target.block;
    }
}

/// Runs what prepares a key, from what its memory holds before; gives what it holds then.
pub(crate) fn run_init<'a>(
    question: &'a Question<'a>,
    terms: &mut Terms,
    at: KeyAt,
    before: Memory,
) -> Told<Memory> {
    let kernel = &question.modes.kernel;
    let mut run = KernelRun::new(question, &kernel.values, at);
    run.memory = before;
    for inst in &kernel.init.insts {
        run.inst(terms, inst)?;
    }
    Ok(run.memory)
}

impl<'a> KernelRun<'a> {
    fn new(question: &'a Question<'a>, values: &'a IdMap<Value, ValueInfo>, at: KeyAt) -> Self {
        KernelRun {
            question,
            values,
            at,
            numbers: IdMap::filled(None, values.len()),
            memory: Memory::default(),
        }
    }

    fn hand_over(&mut self, terms: &mut Terms, mode: &Mode, target: &Target) -> Told<()> {
        let args: Vec<Number> = target
            .args
            .iter()
            .map(|arg| self.number(*arg))
            .collect::<Told<_>>()?;
        let params = &mode.blocks[target.block].params;
        for (param, number) in params.iter().zip(args) {
            self.put(terms, *param, number)?;
        }
        Ok(())
    }

    fn number(&self, value: Value) -> Told<Number> {
        match self.numbers[value] {
            Some(number) => Ok(number),
            None => unproven(format!("{value} is not computed on a path")),
        }
    }

    fn truth(&self, value: Value) -> Told<Truth> {
        match self.number(value)? {
            Number::Truth(truth) => Ok(truth),
            Number::Whole(_) => unproven(format!("{value} is no bool")),
        }
    }

    pub fn whole(&self, terms: &mut Terms, value: Value) -> Told<Term> {
        match self.number(value)? {
            Number::Whole(term) => Ok(term),
            Number::Truth(truth) => terms.bit(truth),
        }
    }

    /// Binds a value; what is declared of it holds.
    fn put(&mut self, terms: &mut Terms, value: Value, number: Number) -> Told<()> {
        let Range { low, high } = self.values[value].range;
        if let Number::Whole(term) = number {
            terms.learn(term, (low.into(), high.into()))?;
        }
        self.numbers[value] = Some(number);
        Ok(())
    }

    fn inst(&mut self, terms: &mut Terms, inst: &Inst) -> Told<()> {
        match (inst.op, &inst.regions[..]) {
            (Op::If, [then, other]) => {
                let holds = self.truth(inst.args[0])?;
                let region = if terms.decide(holds)? { then } else { other };
                self.region(terms, region, &inst.results)
            }
            (Op::Loop(rounds), [body]) => self.repeat(terms, inst, rounds, body),
            _ => match self.plain(terms, inst)? {
                Some(number) => self.put(terms, inst.results[0], number),
                None => Ok(()),
            },
        }
    }

    fn region(&mut self, terms: &mut Terms, region: &Region, results: &[Value]) -> Told<()> {
        for inst in &region.insts {
            self.inst(terms, inst)?;
        }
        for (result, value) in results.iter().zip(&region.yields) {
            let number = self.number(*value)?;
            self.put(terms, *result, number)?;
        }
        Ok(())
    }

    fn repeat(&mut self, terms: &mut Terms, inst: &Inst, rounds: u32, body: &Region) -> Told<()> {
        let mut carried: Vec<Number> = inst
            .args
            .iter()
            .map(|arg| self.number(*arg))
            .collect::<Told<_>>()?;
        for round in 0..rounds {
            let round = Number::Whole(terms.constant(round.into()));
            let all = std::iter::once(round).chain(carried);
            for (param, number) in body.params.iter().zip(all) {
                self.put(terms, *param, number)?;
            }
            for inst in &body.insts {
                self.inst(terms, inst)?;
            }
            let yields = body.yields.iter();
            carried = yields
                .map(|value| self.number(*value))
                .collect::<Told<_>>()?;
        }
        for (result, number) in inst.results.iter().zip(carried) {
            self.put(terms, *result, number)?;
        }
        Ok(())
    }

    fn plain(&mut self, terms: &mut Terms, inst: &Inst) -> Told<Option<Number>> {
        if let Some(truth) = self.truth_of(terms, inst)? {
            return Ok(Some(Number::Truth(truth)));
        }
        if let Some(term) = self.arithmetic(terms, inst)? {
            return Ok(Some(Number::Whole(term)));
        }
        self.on_memory(terms, inst)
    }

    /// What gives a bool.
    fn truth_of(&mut self, terms: &mut Terms, inst: &Inst) -> Told<Option<Truth>> {
        let args = &inst.args;
        let is_truth = |this: &Self, at: usize| {
            args.get(at)
                .is_some_and(|arg| this.values[arg].ty == Type::I1)
        };
        let truth = match inst.op {
            Op::Const(k) if self.values[inst.results[0]].ty == Type::I1 => Truth::of(k == 1),
            Op::And => {
                let (a, b) = (self.truth(args[0])?, self.truth(args[1])?);
                terms.truths.and(a, b)
            }
            Op::Or => {
                let (a, b) = (self.truth(args[0])?, self.truth(args[1])?);
                terms.truths.or(a, b)
            }
            Op::Not => {
                let a = self.truth(args[0])?;
                terms.truths.not(a)
            }
            Op::Eq if is_truth(self, 0) => {
                let (a, b) = (self.truth(args[0])?, self.truth(args[1])?);
                let not = terms.truths.not(b);
                terms.truths.choose(a, b, not)
            }
            Op::Select if is_truth(self, 1) => {
                let (c, a) = (self.truth(args[0])?, self.truth(args[1])?);
                let b = self.truth(args[2])?;
                terms.truths.choose(c, a, b)
            }
            Op::Eq => {
                let (a, b) = (self.whole(terms, args[0])?, self.whole(terms, args[1])?);
                terms.equal(a, b)?
            }
            Op::Lt | Op::Le => {
                let (a, b) = (self.whole(terms, args[0])?, self.whole(terms, args[1])?);
                let over = terms.sub(b, a)?;
                terms.at_least(over, i128::from(inst.op == Op::Lt))?
            }
            _ => return Ok(None),
        };
        Ok(Some(truth))
    }

    /// What computes.
    fn arithmetic(&mut self, terms: &mut Terms, inst: &Inst) -> Told<Option<Term>> {
        let mut args = [terms.constant(0); 3];
        let computes = matches!(inst.op.row().meaning, whippen_kernel::op::Meaning::Exact(_));
        if !computes {
            return Ok(None);
        }
        if inst.op == Op::Select {
            let holds = self.truth(inst.args[0])?;
            let a = self.whole(terms, inst.args[1])?;
            let b = self.whole(terms, inst.args[2])?;
            return terms.select(holds, a, b).map(Some);
        }
        for (to, arg) in args.iter_mut().zip(&inst.args) {
            *to = self.whole(terms, *arg)?;
        }
        let [a, b, c] = args;
        let t = terms;
        Ok(Some(match inst.op {
            Op::Const(k) => t.constant(k.into()),
            Op::Add => t.add(a, b)?,
            Op::Sub => t.sub(a, b)?,
            Op::Mul | Op::MulWide => t.mul(a, b)?,
            Op::MacWide => {
                let product = t.mul(b, c)?;
                t.add(a, product)?
            }
            Op::MulTop => {
                let product = t.mul(a, b)?;
                round(t, product, 32)?
            }
            Op::MacTop => {
                let product = t.mul(b, c)?;
                let top = round(t, product, 32)?;
                t.add(a, top)?
            }
            Op::Min => t.min(a, b)?,
            Op::Max => t.max(a, b)?,
            Op::Shl(n) => t.scale(a, 1 << n)?,
            Op::Sar(n) => t.floor(a, n.into())?,
            Op::SarRound(n) => round(t, a, n.into())?,
            Op::DivRound(n) => self.divide_round(t, inst, n)?,
            Op::Quot(n) => self.quotient(t, inst, n)?,
            Op::Sqrt => {
                let has_root = t.at_least(a, 0)?;
                match t.decide(has_root)? {
                    true => t.apply(Function::SquareRoot, vec![a]),
                    false => t.constant(0),
                }
            }
            Op::Widen | Op::Assume(..) | Op::Narrow => a,
            _ => return wrapping(t, inst.op, a, b),
        }))
    }
}

/// What wraps or saturates.
fn wrapping(t: &mut Terms, op: Op, a: Term, b: Term) -> Told<Option<Term>> {
    let exact = match op {
        Op::Low => a,
        Op::AddWrap | Op::AddSat => t.add(a, b)?,
        Op::SubWrap | Op::SubSat => t.sub(a, b)?,
        Op::MulWrap => t.mul(a, b)?,
        Op::ShlWrap(n) => t.scale(a, 1 << n)?,
        _ => return Ok(None),
    };
    match op {
        Op::AddSat | Op::SubSat => t.saturate(exact),
        _ => t.word(exact),
    }
    .map(Some)
}

/// `floor(term / 2^n + 1/2)`
pub(crate) fn round(terms: &mut Terms, term: Term, n: u32) -> Told<Term> {
    let half = terms.plus(term, 1 << n >> 1)?;
    terms.floor(half, n)
}
