//! Routines that code calls: what they give is shown once, of their bytes, and then a call is that
//! function. So a product is one term, however long its factors are, and no call has several paths.
//!
//! | routine | how it is shown |
//! | --- | --- |
//! | the top word of a product with signs | of any two words: sums of products of halves are one product |
//! | saturating sums | in each case of the sum |
//! | leading zeros | in each case of the word there is one number, and all words of the case begin with so many |
//! | quotient without signs | by induction: each round of the loop brings down a bit of the dividend, and takes the divisor from what remains where it is not more; that 32 rounds are the quotient is a theorem (long division in binary digits), and tested with numbers (`tests`) |
//!
//! All leave memory, the stack and R4 to R11, and of flags and those of R1 to R3 and R12 that they
//! do not keep it is not said what they hold. What is not shown is followed as it is.

use rustc_hash::FxHashSet;
use whippen_isa::reg::LR;

use crate::check::{again_with_facts, all_cases, in_order};
use crate::flags::Status;
use crate::kernel::round;
use crate::machine::{Machine, RunEnd};
use crate::places::{Called, Question};
use crate::stop::{Doubt, Reason, Stop, Told, unproven};
use crate::term::{Function, Kind, Term, Terms};

/// Cases of a routine, at most.
const CASES_MAX: usize = 100;

/// Rounds of a division.
const ROUNDS: i128 = 32;

/// A routine of which it is shown what it gives.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Contract {
    at: u32,
    called: Called,
    /// The halfwords of code that it consists of, in order.
    pub looked_at: Vec<u32>,
}

/// All that is shown.
pub(crate) fn shown(question: &Question) -> Vec<Contract> {
    let all = question.symbols.called.iter().filter_map(|(called, at)| {
        let told = match called {
            Called::LeadingZeros => leading_zeros(question, *at),
            Called::Quotient => divide(question, *at),
            _ => plain(question, *called, *at),
        };
        Some(Contract {
            at: *at,
            called: *called,
            looked_at: in_order(told.ok()?),
        })
    });
    all.collect()
}

impl Called {
    /// Registers besides R0 of which it is not said what is left in them.
    fn clobbers(self) -> &'static [u8] {
        match self {
            Called::SumSaturated | Called::DifferenceSaturated => &[1],
            _ => &[1, 2, 3, 12],
        }
    }

    /// What it gives for what R0 and R1 hold.
    fn given(self, terms: &mut Terms, [a, b]: [Term; 2]) -> Told<Term> {
        match self {
            Called::TopRounded => {
                let product = terms.mul(a, b)?;
                round(terms, product, 32)
            }
            Called::Top => {
                let product = terms.mul(a, b)?;
                terms.floor(product, 32)
            }
            Called::TopUnsigned => {
                let (a, b) = (terms.unsigned(a)?, terms.unsigned(b)?);
                let product = terms.mul(a, b)?;
                let top = terms.floor(product, 32)?;
                terms.word(top)
            }
            Called::Quotient => Ok(terms.apply(Function::DivideUnsigned, vec![a, b])),
            Called::LeadingZeros => Ok(terms.apply(Function::LeadingZeros, vec![a])),
            Called::SumSaturated => {
                let sum = terms.add(a, b)?;
                terms.saturate(sum)
            }
            Called::DifferenceSaturated => {
                let difference = terms.sub(a, b)?;
                terms.saturate(difference)
            }
        }
    }
}

impl Machine<'_> {
    /// A call of what is shown, in place of its code; whether it is one.
    pub fn call(&mut self, terms: &mut Terms, to: u32) -> Told<bool> {
        let own = terms.contracts.iter().find(|own| own.at == to);
        let Some(own) = own.filter(|_| !terms.is_sampling()).cloned() else {
            return Ok(false);
        };
        let a = self.register(terms, 0)?;
        let b = match own.called {
            Called::LeadingZeros => a,
            _ => self.register(terms, 1)?,
        };
        let result = own.called.given(terms, [a, b])?;
        self.write(terms, 0, result)?;
        for register in own.called.clobbers() {
            let unknown = self.next_unknown(terms);
            self.write(terms, *register, unknown)?;
        }
        self.flags = Status::default();
        self.looked_at.extend(own.looked_at);
        Ok(true)
    }
}

/// What each case of a routine or loop gives.
pub(crate) fn in_all_cases<T>(
    terms: &mut Terms,
    run: impl Fn(&mut Terms) -> Told<Vec<T>>,
) -> Result<Vec<T>, Doubt> {
    let all = all_cases(terms, vec![Vec::new()], CASES_MAX, |terms| {
        again_with_facts(terms, &run)
    })?;
    Ok(all.into_iter().flat_map(|(_, own)| own).collect())
}

/// A processor that takes each side of a branch as a case.
fn in_cases<'a>(question: &'a Question<'a>, terms: &mut Terms, at: u32) -> Machine<'a> {
    Machine {
        joins: false,
        ..Machine::new(question, terms, at)
    }
}

/// Whether a routine leaves what is not its own.
fn keeps(terms: &mut Terms, machine: &Machine, called: Called) -> Told<()> {
    if !machine.memory.held.is_empty() {
        return unproven("a routine that stores");
    }
    let own = called.clobbers();
    for register in (1..=LR).filter(|register| !own.contains(register)) {
        if machine.registers[usize::from(register)] != terms.of(Kind::Register(register)) {
            return unproven(format!("a routine that changes r{register}"));
        }
    }
    Ok(())
}

/// Whether a routine goes back to its caller.
fn returns(terms: &mut Terms, machine: &Machine, left: &RunEnd, called: Called) -> Told<()> {
    let back = terms.of(Kind::Register(LR));
    match left {
        RunEnd::For(to) if *to == back => keeps(terms, machine, called),
        _ => unproven("a routine that does not return"),
    }
}

pub(crate) fn is_same(terms: &mut Terms, wanted: Term, found: Term) -> Told<()> {
    let difference = terms.sub(wanted, found)?;
    if terms.bounds(difference) == (0, 0) {
        return Ok(());
    }
    match terms.question_in(difference)? {
        Some(asks) => Err(Stop::Split(asks)),
        None => {
            let (says, does) = (terms.show(wanted), terms.show(found));
            unproven(format!("a routine gives {does} and not {says}"))
        }
    }
}

/// A routine without a loop, of any two words.
fn plain(question: &Question, called: Called, at: u32) -> Result<Vec<u32>, Doubt> {
    in_all_cases(&mut Terms::default(), |terms| {
        let mut machine = Machine::new(question, terms, at);
        let [a, b] = [0, 1].map(|register| machine.registers[register]);
        let left = machine.run_until(terms, |_| false)?;
        returns(terms, &machine, &left, called)?;
        let wanted = called.given(terms, [a, b])?;
        is_same(terms, wanted, machine.registers[0])?;
        Ok(machine.looked_at)
    })
}

fn leading_zeros(question: &Question, at: u32) -> Result<Vec<u32>, Doubt> {
    in_all_cases(&mut Terms::default(), |terms| {
        let mut machine = in_cases(question, terms, at);
        let word = machine.registers[0];
        let left = machine.run_until(terms, |_| false)?;
        returns(terms, &machine, &left, Called::LeadingZeros)?;
        let Some(zeros) = terms.number(machine.registers[0]) else {
            return unproven("it does not say how many zeros there are");
        };
        let word = terms.unsigned(word)?;
        let (low, high) = terms.bounds(word);
        let of = |number: i128| i128::from((number as u32).leading_zeros());
        match of(low) == zeros && of(high) == zeros {
            true => Ok(machine.looked_at),
            false => unproven("a word begins with another number of zeros"),
        }
    })
}

/// Where the loop of a division begins: where a run comes to again first.
fn head_of(question: &Question, at: u32) -> Told<u32> {
    let mut terms = Terms::default();
    let mut machine = in_cases(question, &mut terms, at);
    for register in 0..2 {
        machine.registers[register] = terms.constant(7);
    }
    let mut seen: FxHashSet<u32> = FxHashSet::default();
    match machine.run_until(&mut terms, |machine| !seen.insert(machine.pc))? {
        RunEnd::At(head) => Ok(head),
        RunEnd::For(_) => unproven("a division without a loop"),
    }
}

fn divide(question: &Question, at: u32) -> Result<Vec<u32>, Doubt> {
    let head = head_of(question, at);
    let head = head.map_err(|_| Doubt::new(Reason::Code, "a division without a loop"))?;
    let mut all = in_all_cases(&mut Terms::default(), |terms| {
        enter_division(question, terms, [at, head])
    })?;
    all.extend(in_all_cases(&mut Terms::default(), |terms| {
        round_of_division(question, terms, head)
    })?);
    Ok(in_order(all))
}

/// A quotient by 0 is 0; any other one begins with nothing that remains.
fn enter_division(question: &Question, terms: &mut Terms, [at, head]: [u32; 2]) -> Told<Vec<u32>> {
    let mut machine = in_cases(question, terms, at);
    let [of, by] = [machine.registers[0], machine.registers[1]];
    let left = machine.run_until(terms, |machine| machine.pc == head)?;
    let zero = terms.constant(0);
    let is_zero = terms.equal(by, zero)?;
    if terms.decide(is_zero)? {
        returns(terms, &machine, &left, Called::Quotient)?;
        is_same(terms, zero, machine.registers[0])?;
        return Ok(machine.looked_at);
    }
    let RunEnd::At(_) = left else {
        return unproven("a division without a loop");
    };
    keeps(terms, &machine, Called::Quotient)?;
    let rounds = terms.constant(ROUNDS);
    let wanted = [of, by, zero, rounds, terms.of(Kind::Register(LR))];
    for (register, wanted) in [0, 1, 2, 3, LR].into_iter().zip(wanted) {
        is_same(terms, wanted, machine.registers[usize::from(register)])?;
    }
    Ok(machine.looked_at)
}

/// One round: R0 holds what is left of the dividend and the digits so far, R1 the divisor, R2 what
/// remains, less than that, and R3 the rounds that are left.
fn round_of_division(question: &Question, terms: &mut Terms, head: u32) -> Told<Vec<u32>> {
    let mut machine = in_cases(question, terms, head);
    let rounds = machine.registers[3];
    terms.learn(rounds, (1, ROUNDS))?;
    // Words without signs, each with a register of its own.
    let mut all = [rounds; 3];
    for (word, register) in all.iter_mut().zip(&mut machine.registers) {
        *word = terms.plus(*register, 1 << 31)?;
        *register = terms.word(*word)?;
    }
    let ([digits, divisor, remains], by) = (all, machine.registers[1]);
    let back = terms.of(Kind::Register(LR));
    let left_over = terms.sub(divisor, remains)?;
    terms.learn(left_over, (1, 1 << 32))?;
    let left = machine.run_until(terms, |machine| machine.pc == head)?;
    let is_last = terms.at_least(rounds, 2)?;
    match (terms.decide(is_last)?, &left) {
        (true, RunEnd::At(_)) => keeps(terms, &machine, Called::Quotient)?,
        (false, RunEnd::For(_)) => returns(terms, &machine, &left, Called::Quotient)?,
        _ => return unproven("a division of another number of rounds"),
    }
    let top = terms.floor(digits, 31)?;
    let dividend = terms.add_scaled(top, remains, 2)?;
    let over = terms.sub(dividend, divisor)?;
    let goes = terms.at_least(over, 0)?;
    let goes = terms.decide(goes)?;
    let wanted = terms.add_scaled(dividend, divisor, -i128::from(goes))?;
    let left_over = terms.sub(divisor, wanted)?;
    if terms.bounds(left_over).0 < 1 {
        return unproven("more may remain than the divisor");
    }
    let wanted = terms.word(wanted)?;
    is_same(terms, wanted, machine.registers[2])?;
    let wanted = terms.scale(digits, 2)?;
    let wanted = terms.plus(wanted, goes.into())?;
    let wanted = terms.word(wanted)?;
    is_same(terms, wanted, machine.registers[0])?;
    is_same(terms, by, machine.registers[1])?;
    is_same(terms, back, machine.registers[usize::from(LR)])?;
    if let RunEnd::At(_) = left {
        let wanted = terms.plus(rounds, -1)?;
        is_same(terms, wanted, machine.registers[3])?;
    }
    Ok(machine.looked_at)
}
