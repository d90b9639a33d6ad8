//! Loops that find a square root: bit by bit from the top, each kept where the square still fits.
//!
//! ```text
//!   head:  tried = root + bit    root = tried, if tried^2 <= a    bit = bit / 2, again if not 0
//! ```
//!
//!   head:  tried = root + bit   root = tried, if tried^2 <= a   bit = bit / 2, again if not 0
//! else it changes is then unknown. A loop that begins with a root of 0 and a bit of `2^(k-1)`, for
//! a number less than `4^k`, ends with its root: a theorem, and tested with numbers (`tests`). A
//! loop that is not shown, or begins otherwise, is followed as it is.
//!
//! Not here: which code is a loop's is no more than a guess (a branch back to a square).

use std::collections::BTreeSet;

use whippen_isa::reg::SP;
use whippen_isa::{Inst, ItState, Op, decode, is_wide};
use whippen_kernel::{Inst as KernelInst, Op as Operator};

use crate::check::in_order;
use crate::contract::{Contract, in_all_cases, is_same};
use crate::flags::Status;
use crate::machine::{Machine, RunEnd};
use crate::memory::Memory;
use crate::places::{Called, Question};
use crate::stop::{Doubt, Reason, Stop, Told, unproven};
use crate::term::{Base, Function, Kind, Term, Terms};
use crate::truth::Truth;

/// Instructions from the head to the square, at most.
const TO_SQUARE: usize = 10;

/// Words that a round may look at besides its own, so that few roles are tried.
const WORDS_MAX: usize = 8;

/// Instructions of a round, at most.
const STEPS_MAX: usize = 60;

/// Bits of a root, at most: it is a signed word.
const BITS_MAX: u32 = 31;

/// Where a word is: in a register, or on the stack, so far from its pointer.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Word {
    Register(u8),
    Stack(i128),
}

/// A loop that is shown.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct RootLoop {
    head: u32,
    exit: u32,
    /// Root, bit, and the words of the number.
    roles: [Word; 4],
    /// What is other behind it, or may be.
    changed: BTreeSet<Word>,
    /// What of it is the root.
    results: BTreeSet<Word>,
    /// The halfwords of code that it consists of, in order.
    pub looked_at: Vec<u32>,
}

/// All loops of that kind, where a Kernel asks for roots.
pub(crate) fn shown(question: &Question, contracts: &[Contract]) -> Vec<RootLoop> {
    let modes = &question.modes.modes;
    let mut blocks = modes
        .ids()
        .flat_map(|mode| modes[mode].blocks.ids().map(move |at| (mode, at)));
    let is_asked = blocks.any(|(mode, at)| has_root(&modes[mode].blocks[at].insts))
        || has_root(&question.shared.insts)
        || has_root(&question.modes.kernel.init.insts);
    if !is_asked {
        return Vec::new();
    }
    let heads = heads(question).into_iter();
    heads
        .filter_map(|head| loop_at(question, contracts, head))
        .collect()
}

fn has_root(insts: &[KernelInst]) -> bool {
    let is_root = |inst: &KernelInst| {
        inst.op == Operator::Sqrt || inst.regions.iter().any(|region| has_root(&region.insts))
    };
    insts.iter().any(is_root)
}

/// Where branches go back to from which a square is not far.
fn heads(question: &Question) -> BTreeSet<u32> {
    let mut heads = BTreeSet::new();
    for (from, bytes) in &question.code.pieces {
        for at in (*from..from.wrapping_add(bytes.len() as u32)).step_by(2) {
            let Some(inst) = inst_at(question, at) else {
                continue;
            };
            let to = at.wrapping_add(4).wrapping_add(inst.imm);
            if inst.op() == Op::B && to < at && comes_to_square(question, to) {
                heads.insert(to);
            }
        }
    }
    heads
}

fn inst_at(question: &Question, at: u32) -> Option<Inst> {
    let first = question.code.half(at)?;
    let second = match is_wide(first) {
        true => question.code.half(at.wrapping_add(2))?,
        false => 0,
    };
    decode(first, second, question.arch, ItState::OUTSIDE).ok()
}

fn comes_to_square(question: &Question, mut at: u32) -> bool {
    (0..TO_SQUARE).any(|_| {
        let Some(inst) = inst_at(question, at) else {
            return false;
        };
        let to = at.wrapping_add(4).wrapping_add(inst.imm);
        at = at.wrapping_add(inst.size());
        let called = question.symbols.called.iter();
        match inst.op() {
            Op::UMULL => inst.n == inst.m,
            Op::BL => called.clone().any(|own| *own == (Called::TopUnsigned, to)),
            _ => false,
        }
    })
}

/// The loop that begins there, if it is one.
pub(crate) fn loop_at(question: &Question, contracts: &[Contract], head: u32) -> Option<RootLoop> {
    let words = words_of(question, contracts, head)?;
    let mut all = Vec::new();
    for root in &words {
        for bit in &words {
            for low in &words {
                all.extend(words.iter().map(|high| [*root, *bit, *low, *high]));
            }
        }
    }
    let differ = |roles: &[Word; 4]| roles.iter().collect::<BTreeSet<_>>().len() == roles.len();
    let mut all = all.into_iter().filter(differ);
    all.find_map(|roles| {
        let one = Round {
            question,
            contracts,
            head,
            roles,
        };
        one.show().ok()
    })
}

/// What a round reads: registers before it writes them, and words of the stack.
fn words_of(question: &Question, contracts: &[Contract], head: u32) -> Option<Vec<Word>> {
    let all = in_all_cases(&mut with(contracts), |terms| {
        let mut machine = begin(question, terms, head);
        let mut steps = 0;
        let ran = machine.run_until(terms, |machine| {
            steps += 1;
            machine.pc == head || steps == STEPS_MAX
        });
        match ran {
            Ok(RunEnd::At(at)) if at == head => Ok(words_read(&machine)),
            Err(stop @ (Stop::Split(_) | Stop::Impossible)) => Err(stop),
            // A way out of the loop, which is another matter.
            _ => Ok(Vec::new()),
        }
    });
    let all: BTreeSet<Word> = all.ok()?.into_iter().collect();
    (all.len() <= WORDS_MAX).then(|| all.into_iter().collect())
}

fn words_read(machine: &Machine) -> Vec<Word> {
    let registers = (0..16).filter(|own| *own != SP && machine.read & 1 << own != 0);
    let insts = machine.looked_at.iter();
    let insts = insts.filter_map(|at| inst_at(machine.question, *at));
    let loads = insts.filter(|inst| inst.op() == Op::LDR_immediate && inst.n == SP);
    let slots = loads.map(|inst| Word::Stack(inst.imm.into()));
    registers.map(Word::Register).chain(slots).collect()
}

fn with(contracts: &[Contract]) -> Terms {
    let mut terms = Terms::default();
    terms.contracts = contracts.to_vec();
    terms
}

fn begin<'a>(question: &'a Question<'a>, terms: &mut Terms, at: u32) -> Machine<'a> {
    let mut machine = Machine::new(question, terms, at);
    machine.registers[usize::from(SP)] = terms.of(Kind::Base(Base::Stack));
    machine
}

/// A round that may be one of such a loop.
struct Round<'a> {
    question: &'a Question<'a>,
    contracts: &'a [Contract],
    head: u32,
    roles: [Word; 4],
}

/// What a round leaves.
struct RoundLeft {
    changed: BTreeSet<Word>,
    /// What holds the new root.
    results: BTreeSet<Word>,
    looked_at: Vec<u32>,
    /// Where it goes on.
    to: u32,
}

impl Round<'_> {
    fn show(&self) -> Result<RootLoop, Doubt> {
        let again = self.in_cases(None)?;
        let of_rounds = again.iter().flat_map(|left| &left.looked_at);
        let code: BTreeSet<u32> = of_rounds.copied().collect();
        let last = self.in_cases(Some(&code))?;
        let mut results = last.iter().map(|left| left.results.clone());
        let results = results
            .next()
            .map(|first| results.fold(first, |all, own| all.intersection(&own).copied().collect()));
        let exits: BTreeSet<u32> = last.iter().map(|left| left.to).collect();
        let all = || again.iter().chain(&last);
        let changed = all().flat_map(|left| &left.changed).copied().collect();
        let looked_at = all().flat_map(|left| &left.looked_at).copied().collect();
        match (exits.first(), exits.len(), results) {
            (Some(exit), 1, Some(results)) if !results.is_empty() => Ok(RootLoop {
                head: self.head,
                exit: *exit,
                roles: self.roles,
                changed,
                results,
                looked_at: in_order(looked_at),
            }),
            _ => Err(Doubt::new(
                Reason::Code,
                "a loop with several ends, or without a root",
            )),
        }
    }

    /// All cases of a round that is not the last, or of the last one: it ends where it leaves the
    /// code of the others.
    fn in_cases(&self, others: Option<&BTreeSet<u32>>) -> Result<Vec<RoundLeft>, Doubt> {
        in_all_cases(&mut with(self.contracts), |terms| {
            self.run(terms, others).map(|left| vec![left])
        })
    }

    fn run(&self, terms: &mut Terms, others: Option<&BTreeSet<u32>>) -> Told<RoundLeft> {
        let mut machine = begin(self.question, terms, self.head);
        let [root, bit] = [0, 1].map(|at| terms.of(Kind::Unknown(at)));
        let number = terms.of(Kind::Integer);
        terms.learn(number, (0, (1 << (2 * BITS_MAX)) - 1))?;
        let (low, high) = (terms.word(number)?, terms.floor(number, 32)?);
        let bit = match others {
            None => bit,
            Some(_) => terms.constant(1),
        };
        let own = [root, bit, low, high];
        terms.learn(root, (0, (1 << BITS_MAX) - 1))?;
        terms.learn(
            bit,
            (if others.is_none() { 2 } else { 1 }, 1 << (BITS_MAX - 1)),
        )?;
        let tried = terms.add(root, bit)?;
        terms.learn(tried, (1, (1 << BITS_MAX) - 1))?;
        for (word, value) in self.roles.into_iter().zip(own) {
            machine.put(terms, word, value)?;
        }
        let before = (machine.registers, machine.memory.clone());
        let head = self.head;
        let left = machine.run_until(terms, |machine| match others {
            None => machine.pc == head,
            Some(code) => !code.contains(&machine.pc),
        })?;
        let RunEnd::At(to) = left else {
            return unproven("a loop that is left for elsewhere");
        };
        let square = terms.mul(tried, tried)?;
        let over = terms.sub(number, square)?;
        let fits = terms.at_least(over, 0)?;
        let new = if terms.decide(fits)? { tried } else { root };
        if others.is_none() {
            let half = terms.floor(bit, 1)?;
            for (word, wanted) in self.roles.into_iter().zip([new, half, low, high]) {
                let found = machine.get(terms, word)?;
                is_same(terms, wanted, found)?;
            }
        }
        let changed = changed(terms, &machine, &before)?;
        let mut results = BTreeSet::new();
        for word in changed.iter().chain([&self.roles[0]]) {
            let found = machine.get(terms, *word)?;
            let over = terms.sub(found, new)?;
            if terms.bounds(over) == (0, 0) {
                results.insert(*word);
            }
        }
        Ok(RoundLeft {
            changed,
            results,
            looked_at: machine.looked_at,
            to,
        })
    }
}

/// What is other than before, of registers and of the stack.
fn changed(
    terms: &mut Terms,
    machine: &Machine,
    (registers, memory): &([Term; 16], Memory),
) -> Told<BTreeSet<Word>> {
    let is_other = |own: &u8| machine.registers[usize::from(*own)] != registers[usize::from(*own)];
    let others = (0..16).filter(is_other);
    let mut changed: BTreeSet<Word> = others.map(Word::Register).collect();
    if machine.it != ItState::OUTSIDE || changed.contains(&Word::Register(SP)) {
        return unproven("a loop that ends within a block, or moves the stack");
    }
    let stack = terms.of(Kind::Base(Base::Stack));
    for held in &machine.memory.held {
        let address = terms.of_address(held.address)?;
        if memory.load(terms, address, held.bytes)? == held.value {
            continue;
        }
        if held.address.moving != stack || held.bytes != 4 {
            return unproven("a loop that stores");
        }
        changed.insert(Word::Stack(held.address.at));
    }
    Ok(changed)
}

/// Both words as one number.
fn number_of(terms: &mut Terms, low: Term, high: Term) -> Told<Term> {
    let low = terms.unsigned(low)?;
    terms.add_scaled(low, high, 1 << 32)
}

impl Machine<'_> {
    fn address_of(&self, terms: &mut Terms, at: i128) -> Told<Term> {
        terms.plus(self.registers[usize::from(SP)], at)
    }

    fn get(&mut self, terms: &mut Terms, word: Word) -> Told<Term> {
        match word {
            Word::Register(register) => self.register(terms, register),
            Word::Stack(at) => {
                let address = self.address_of(terms, at)?;
                self.memory.load(terms, address, 4)
            }
        }
    }

    fn put(&mut self, terms: &mut Terms, word: Word, value: Term) -> Told<()> {
        match word {
            Word::Register(register) => self.write(terms, register, value),
            Word::Stack(at) => {
                let address = self.address_of(terms, at)?;
                self.memory.store(terms, address, 4, value, Truth::YES)
            }
        }
    }

    /// A loop that is shown, from its head, in place of its code; whether it is one.
    pub fn pass_root(&mut self, terms: &mut Terms) -> Told<bool> {
        let own = terms.roots.iter().find(|own| own.head == self.pc);
        let is_outside = self.it == ItState::OUTSIDE && !terms.is_sampling();
        let Some(own) = own.filter(|_| is_outside).cloned() else {
            return Ok(false);
        };
        let mut words = [terms.constant(0); 4];
        for (to, word) in words.iter_mut().zip(own.roles) {
            *to = self.get(terms, word)?;
        }
        let [root, bit, low, high] = words;
        let bits = terms
            .number(bit)
            .filter(|bit| *bit > 0 && bit & (bit - 1) == 0);
        let bits = bits.map(|bit| bit.trailing_zeros() + 1);
        let number = number_of(terms, low, high)?;
        let (least, most) = terms.bounds(number);
        let fits = bits.is_some_and(|k| k <= BITS_MAX && most < 1 << (2 * k));
        if terms.number(root) != Some(0) || least < 0 || !fits {
            return Ok(false);
        }
        let result = terms.apply(Function::SquareRoot, vec![number]);
        self.guard = Truth::YES;
        for word in &own.changed {
            let unknown = self.next_unknown(terms);
            self.put(terms, *word, unknown)?;
        }
        for word in &own.results {
            self.put(terms, *word, result)?;
        }
        self.flags = Status::default();
        self.looked_at.extend(own.looked_at);
        self.pc = own.exit;
        Ok(true)
    }
}
