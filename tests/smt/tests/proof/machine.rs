//! A symbolic run of machine code by p-code: registers and memory hold terms, addresses are numbers
//! or are compared with every word there is.

use std::collections::BTreeMap;

use whippen_smt::Term;

use crate::lifter::{Code, Operation, Varnode};
use crate::pcode::{any, called, computed, saturated, saturating};

/// The address to which a run returns.
pub const RETURN: u32 = 0xf000_0000;
/// How many operations a path may have.
const STEPS_MAX: usize = 20_000;
/// How many paths there may be.
const PATHS_MAX: usize = 400;

/// Where p-code keeps register 0; a register has four bytes.
const R0: u64 = 32;

/// A processor on one path.
#[derive(Clone)]
pub struct State {
    places: BTreeMap<Varnode, Term>,
    /// Words by address.
    pub memory: BTreeMap<u32, Term>,
    /// Addresses of words that may be stored to by an address that is not known.
    pub cells: Vec<u32>,
    /// What is true on this path.
    pub condition: Term,
    /// What is to be shown beside: that such an address is one of them.
    pub claims: Vec<Term>,
    pc: u32,
}

fn word(number: u32) -> Term {
    Term::word(number.into(), 32)
}

fn holds(term: Term) -> Term {
    term.equals(Term::word(0, term.bits())).negated()
}

impl State {
    /// At the beginning of a function.
    pub fn new(pc: u32, memory: BTreeMap<u32, Term>) -> State {
        State {
            places: BTreeMap::new(),
            memory,
            cells: Vec::new(),
            condition: Term::truth(true),
            claims: Vec::new(),
            pc,
        }
    }

    fn register_place(number: u8) -> Varnode {
        Varnode {
            space: "register".into(),
            offset: R0 + 4 * u64::from(number),
            bytes: 4,
        }
    }

    /// What a register holds.
    pub fn register(&mut self, number: u8) -> Term {
        self.read(&Self::register_place(number))
    }

    /// Has a register hold something.
    pub fn set_register(&mut self, number: u8, term: Term) {
        self.places.insert(Self::register_place(number), term);
    }

    fn read(&mut self, from: &Varnode) -> Term {
        let bits = 8 * from.bytes;
        match &*from.space {
            "const" => Term::word(from.offset.into(), bits),
            _ => match self.places.get(from) {
                Some(term) => *term,
                None => {
                    let held = any("held", bits);
                    self.places.insert(from.clone(), held);
                    held
                }
            },
        }
    }

    fn write(&mut self, to: &Varnode, term: Term, guard: Term) {
        let term = match guard.number() {
            Some(1) => term,
            _ => {
                let old = self.read(to);
                guard.choose(term, old)
            }
        };
        self.places.insert(to.clone(), term);
    }

    fn aligned(&self, address: u32) -> Result<Term, String> {
        let held = self.memory.get(&(address & !3)).copied();
        held.ok_or(format!("nothing is known of {address:#x}"))
    }

    fn load_known(&self, address: u32, bytes: u32) -> Result<Term, String> {
        let at = 8 * (address & 3);
        match bytes {
            4 if at == 0 => self.aligned(address),
            1 | 2 if at + 8 * bytes <= 32 => {
                let held = self.aligned(address)?;
                Ok(held.extract(at + 8 * bytes - 1, at))
            }
            _ => Err(format!("{bytes} bytes at {address:#x}")),
        }
    }

    fn load(&mut self, address: Term, bytes: u32) -> Result<Term, String> {
        if let Some(address) = address.number() {
            return self.load_known(address as u32, bytes);
        }
        let mut found = any("elsewhere", 8 * bytes);
        for known in self
            .memory
            .keys()
            .flat_map(|at| (*at..at + 4).step_by(bytes as usize))
        {
            let held = self.load_known(known, bytes)?;
            found = address.equals(word(known)).choose(held, found);
        }
        Ok(found)
    }

    fn store_known(&mut self, address: u32, term: Term, guard: Term) -> Result<(), String> {
        let (at, bits) = (8 * (address & 3), term.bits());
        if at + bits > 32 {
            return Err(format!("{bits} bits to {address:#x}"));
        }
        let old = match self.memory.get(&(address & !3)) {
            Some(old) => *old,
            None => any("stack", 32),
        };
        let mut new = term;
        if at > 0 {
            new = new.concat(old.extract(at - 1, 0));
        }
        if at + bits < 32 {
            new = old.extract(31, at + bits).concat(new);
        }
        self.memory.insert(address & !3, guard.choose(new, old));
        Ok(())
    }

    fn store(&mut self, address: Term, term: Term, guard: Term) -> Result<(), String> {
        if let Some(address) = address.number() {
            return self.store_known(address as u32, term, guard);
        }
        if term.bits() != 32 {
            return Err("a part of a word to an address that is not known".to_string());
        }
        let all = self.cells.clone();
        let mut is_known = Term::truth(false);
        for known in all {
            let is_here = address.equals(word(known));
            is_known = is_known.or(is_here);
            let old = self.memory[&known];
            self.memory
                .insert(known, guard.and(is_here).choose(term, old));
        }
        self.claims.push(guard.negated().or(is_known));
        Ok(())
    }

    /// One operation that does not branch.
    fn operate(&mut self, own: &Operation, guard: Term) -> Result<(), String> {
        let inputs: Vec<Term> = own.inputs.iter().map(|from| self.read(from)).collect();
        let term = match (&*own.name, &inputs[..]) {
            ("LOAD", [address]) => {
                let bytes = own.output.as_ref().map_or(4, |to| to.bytes);
                self.load(*address, bytes)?
            }
            ("STORE", [address, term]) => return self.store(*address, *term, guard),
            ("CALLOTHER", args) => match own.callee.as_deref() {
                Some("setISAMode" | "setThumbMode") => return Ok(()),
                Some(callee) => called(callee, args)?,
                None => return Err("an operation without a name".to_string()),
            },
            (name, args) => {
                let bytes = own.output.as_ref().map_or(4, |to| to.bytes);
                computed(name, args, bytes)?
            }
        };
        if let Some(to) = &own.output {
            if term.bits() != 8 * to.bytes {
                return Err(format!("{} bits of `{}`", term.bits(), own.name));
            }
            self.write(to, term, guard);
        }
        Ok(())
    }

    /// Runs to the end; gives each way to it.
    ///
    /// # Errors
    /// What is not followed.
    pub fn run(self, code: &mut Code) -> Result<Vec<State>, String> {
        let (mut left, mut ended) = (vec![self], Vec::new());
        while let Some(mut state) = left.pop() {
            let mut steps = 0;
            while state.pc != RETURN {
                steps += 1;
                if steps > STEPS_MAX || left.len() + ended.len() > PATHS_MAX {
                    return Err("too many steps or paths".to_string());
                }
                let at = state.pc;
                let other = state.step(code).map_err(|why| format!("{at:#x}: {why}"))?;
                left.extend(other);
            }
            ended.push(state);
        }
        Ok(ended)
    }

    /// One instruction; where it may go two ways this goes one, and the other one is given.
    fn step(&mut self, code: &mut Code) -> Result<Option<State>, String> {
        let lifted = code.at(self.pc)?;
        let behind = self.pc.wrapping_add(lifted.bytes);
        let own = code.bytes(self.pc).and_then(saturating);
        // Where operations take place, and where the run is not gone elsewhere.
        let (mut guard, mut stays) = (Term::truth(true), Term::truth(true));
        let mut other = None;
        for operation in &lifted.operations {
            if let (Some(([d, m, n], subtracts)), "CALLOTHER") = (own, &*operation.name) {
                // The operands are as they were, since the result comes last.
                let (m, n) = (self.register(m), self.register(n));
                let sum = saturated(m, n, subtracts);
                self.write(&Self::register_place(d), sum, guard);
                break;
            }
            let name = &*operation.name;
            match name {
                "CBRANCH" => {
                    let taken = self.read(&operation.inputs[1]);
                    let to = self.target(operation)?;
                    if to == Some(behind) {
                        guard = guard.and(holds(taken).negated());
                    } else {
                        let to = to.ok_or("a branch within an instruction")?;
                        let goes = guard.and(holds(taken));
                        other = self.fork(goes, to);
                        stays = stays.and(goes.negated());
                        guard = guard.and(holds(taken).negated());
                    }
                }
                "BRANCH" | "BRANCHIND" | "CALL" | "CALLIND" | "RETURN" => {
                    let to = match name {
                        "BRANCH" | "CALL" => word(self.target(operation)?.ok_or("a branch")?),
                        _ => self.read(&operation.inputs[0]),
                    };
                    let to = to.number().ok_or("a branch to anywhere")? as u32 & !1;
                    if guard.number() == Some(1) {
                        self.pc = to;
                        return Ok(other);
                    }
                    if let Some(second) = self.fork(guard, to) {
                        if other.is_some() {
                            return Err("a branch three ways".to_string());
                        }
                        other = Some(second);
                    }
                    stays = stays.and(guard.negated());
                    break;
                }
                _ if guard.number() == Some(0) => {}
                _ => self.operate(operation, guard)?,
            }
        }
        self.pc = behind;
        Ok(self.parted(other, stays))
    }
}

impl State {
    /// Where a direct branch goes; none within the instruction.
    fn target(&self, operation: &Operation) -> Result<Option<u32>, String> {
        let to = operation.inputs.first().ok_or("a branch nowhere")?;
        Ok((&*to.space == "ram").then_some(to.offset as u32 & !1))
    }

    /// This state where a condition holds, at another place; none where it never does.
    fn fork(&self, condition: Term, to: u32) -> Option<State> {
        let mut other = self.clone();
        other.condition = self.condition.and(condition);
        other.pc = to;
        (other.condition.number() != Some(0)).then_some(other)
    }

    /// What is left of two ways: where this one is impossible, the other one is this.
    fn parted(&mut self, other: Option<State>, stays: Term) -> Option<State> {
        let mut other = other?;
        self.condition = self.condition.and(stays);
        if self.condition.number() == Some(0) {
            std::mem::swap(self, &mut other);
            return None;
        }
        Some(other)
    }
}
