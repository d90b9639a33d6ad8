//! Loads and stores.

use whippen_isa::reg::{PC, SP};
use whippen_isa::{Inst, Op};

use crate::machine::Machine;
use crate::stop::{Told, unproven};
use crate::term::{Atom, Base, Kind, Term, Terms};

/// What a load or store moves.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Moved {
    bytes: u8,
    signed: bool,
    stores: bool,
    /// The offset is a register.
    by_register: bool,
}

fn moved(op: Op) -> Option<Moved> {
    let (bytes, signed, stores, by_register) = match op {
        Op::LDR_immediate | Op::LDR_literal => (4, false, false, false),
        Op::LDR_register => (4, false, false, true),
        Op::LDRH_immediate | Op::LDRH_literal => (2, false, false, false),
        Op::LDRH_register => (2, false, false, true),
        Op::LDRSH_immediate | Op::LDRSH_literal => (2, true, false, false),
        Op::LDRSH_register => (2, true, false, true),
        Op::LDRB_immediate | Op::LDRB_literal => (1, false, false, false),
        Op::LDRB_register => (1, false, false, true),
        Op::LDRSB_immediate | Op::LDRSB_literal => (1, true, false, false),
        Op::LDRSB_register => (1, true, false, true),
        Op::STR_immediate => (4, false, true, false),
        Op::STR_register => (4, false, true, true),
        Op::STRH_immediate => (2, false, true, false),
        Op::STRH_register => (2, false, true, true),
        Op::STRB_immediate => (1, false, true, false),
        Op::STRB_register => (1, false, true, true),
        _ => return None,
    };
    Some(Moved {
        bytes,
        signed,
        stores,
        by_register,
    })
}

/// That an address is not between two accesses of so many bytes: a Cortex-M0+ has none there. Where
/// memory begins, and what points into it, is aligned; an address in which something else moves by
/// less than that is taken as it is.
fn aligned(terms: &Terms, address: Term, bytes: u8) -> Told<()> {
    let bytes = i128::from(bytes);
    let sum = terms.sum(address);
    let is_aligned = |(atom, by): &(Atom, i128)| by % bytes == 0 || terms.is_of_region(*atom);
    let is_between = sum.constant % bytes != 0 && sum.parts.iter().all(is_aligned);
    match is_between && !terms.is_sampling() {
        true => unproven("an access that is not aligned"),
        false => Ok(()),
    }
}

impl Machine<'_> {
    /// Whether it was such an instruction.
    pub fn access(&mut self, terms: &mut Terms, inst: &Inst) -> Told<bool> {
        match inst.op() {
            Op::LDRD_immediate | Op::STRD_immediate => self.dual(terms, inst)?,
            Op::LDM | Op::POP | Op::STM | Op::STMDB | Op::PUSH | Op::LDMDB => {
                self.multiple(terms, inst)?;
            }
            Op::ADR => {
                let address = self.behind(inst);
                let address = terms.constant(address);
                self.write(terms, inst.d, address)?;
            }
            op => match moved(op) {
                Some(moved) => self.single(terms, inst, moved)?,
                None => return Ok(false),
            },
        }
        Ok(true)
    }

    /// The address of a literal.
    fn behind(&self, inst: &Inst) -> i128 {
        let pc = i128::from(self.pc.wrapping_add(4) & !3);
        if inst.add {
            pc + i128::from(inst.imm)
        } else {
            pc - i128::from(inst.imm)
        }
    }

    fn base(&mut self, terms: &mut Terms, inst: &Inst) -> Told<Term> {
        match inst.n {
            PC => unproven("an access by PC"),
            n => self.register(terms, n),
        }
    }

    fn single(&mut self, terms: &mut Terms, inst: &Inst, moved: Moved) -> Told<()> {
        let is_literal = matches!(
            inst.op(),
            Op::LDR_literal
                | Op::LDRH_literal
                | Op::LDRSH_literal
                | Op::LDRB_literal
                | Op::LDRSB_literal
        );
        let address = if is_literal {
            let address = self.behind(inst);
            terms.constant(address)
        } else {
            let base = self.base(terms, inst)?;
            let by = self.offset(terms, inst, moved)?;
            let there = terms.add_scaled(base, by, if inst.add { 1 } else { -1 })?;
            let there = self.within_memory(terms, there)?;
            if inst.wback && inst.n != inst.t {
                let value = moved
                    .stores
                    .then(|| self.register(terms, inst.t))
                    .transpose()?;
                self.write(terms, inst.n, there)?;
                let address = if inst.index { there } else { base };
                return self.transfer(terms, inst.t, value, address, moved);
            }
            if inst.wback {
                return unproven("a base that is transferred and written back");
            }
            there
        };
        let value = moved
            .stores
            .then(|| self.register(terms, inst.t))
            .transpose()?;
        self.transfer(terms, inst.t, value, address, moved)
    }

    /// An address of which parts have wrapped, such as a doubled one: the sum wraps, too.
    fn within_memory(&self, terms: &mut Terms, there: Term) -> Told<Term> {
        let mut parts = terms.sum(there).parts.iter();
        match parts.any(|(_, by)| by.trailing_zeros() >= 32) {
            true => terms.word(there),
            false => Ok(there),
        }
    }

    fn offset(&mut self, terms: &mut Terms, inst: &Inst, moved: Moved) -> Told<Term> {
        if !moved.by_register {
            return Ok(terms.constant(inst.imm.into()));
        }
        let m = self.register(terms, inst.m)?;
        terms.scale(m, 1 << inst.amount)
    }

    fn transfer(
        &mut self,
        terms: &mut Terms,
        register: u8,
        value: Option<Term>,
        address: Term,
        moved: Moved,
    ) -> Told<()> {
        aligned(terms, address, moved.bytes)?;
        match value {
            Some(value) => self
                .memory
                .store(terms, address, moved.bytes, value, self.guard),
            None => {
                let word = self.load(terms, address, moved.bytes)?;
                let bits = 8 * u32::from(moved.bytes);
                let word = if moved.signed {
                    terms.wrap(word, bits)?
                } else {
                    word
                };
                self.write(terms, register, word)
            }
        }
    }

    /// What an address holds; of constants, what the image says.
    fn load(&mut self, terms: &mut Terms, address: Term, bytes: u8) -> Told<Term> {
        if terms.is_sampling()
            && bytes == 4
            && let Some(word) = self.constant_at(terms, address)?
        {
            return Ok(terms.constant(i128::from(word as i32)));
        }
        let found = self.memory.load(terms, address, bytes)?;
        let is_old = terms
            .only_atom(found)
            .is_some_and(|atom| *terms.kind(atom) == Kind::Load(address, bytes));
        if !is_old || bytes != 4 {
            return Ok(found);
        }
        match self.constant_at(terms, address)? {
            Some(word) => Ok(terms.constant(i128::from(word as i32))),
            None => Ok(found),
        }
    }

    /// The word at an address where memory never changes: a literal of the state, or code.
    fn constant_at(&mut self, terms: &mut Terms, address: Term) -> Told<Option<u32>> {
        let code = self.question.code;
        if let Some(address) = terms.number(address) {
            let Ok(address) = u32::try_from(address) else {
                return Ok(None);
            };
            self.looked_at.extend([address, address.wrapping_add(2)]);
            return Ok(code.word(address));
        }
        let state = terms.of(Kind::Base(Base::State));
        let at = terms.sub(address, state)?;
        let places = self.question.places;
        let inside = i128::from(places.literals)..i128::from(places.records);
        let at = terms.number(at).filter(|at| inside.contains(at));
        Ok(at.and_then(|at| code.first_word(self.question.symbols.state.wrapping_add(at as u32))))
    }

    fn dual(&mut self, terms: &mut Terms, inst: &Inst) -> Told<()> {
        let base = self.base(terms, inst)?;
        let by = i128::from(inst.imm) * if inst.add { 1 } else { -1 };
        let there = terms.plus(base, by)?;
        let stores = inst.op() == Op::STRD_immediate;
        let moved = Moved {
            bytes: 4,
            signed: false,
            stores,
            by_register: false,
        };
        let mut values = [None; 2];
        for (value, register) in values.iter_mut().zip([inst.t, inst.t2]) {
            *value = stores.then(|| self.register(terms, register)).transpose()?;
        }
        let address = if inst.index { there } else { base };
        if inst.wback {
            self.write(terms, inst.n, there)?;
        }
        let behind = terms.plus(address, 4)?;
        self.transfer(terms, inst.t, values[0], address, moved)?;
        self.transfer(terms, inst.t2, values[1], behind, moved)
    }

    /// A list of registers from the stack, PC the last of them; gives what that is.
    pub fn pop_and_return(&mut self, terms: &mut Terms, inst: &Inst) -> Told<Term> {
        let others = Inst {
            imm: inst.imm & !(1 << PC),
            ..*inst
        };
        if others.imm != 0 {
            self.multiple(terms, &others)?;
        }
        let at = self.register(terms, SP)?;
        aligned(terms, at, 4)?;
        let back = self.load(terms, at, 4)?;
        let behind = terms.plus(at, 4)?;
        self.write(terms, SP, behind)?;
        Ok(back)
    }

    fn multiple(&mut self, terms: &mut Terms, inst: &Inst) -> Told<()> {
        let list = inst.imm as u16;
        if list & 1 << PC != 0 {
            return unproven("a return");
        }
        let base = self.register(terms, inst.n)?;
        let bytes = 4 * i128::from(list.count_ones());
        let before = matches!(inst.op(), Op::PUSH | Op::STMDB | Op::LDMDB);
        let stores = matches!(inst.op(), Op::PUSH | Op::STM | Op::STMDB);
        let first = terms.plus(base, if before { -bytes } else { 0 })?;
        let moved = Moved {
            bytes: 4,
            signed: false,
            stores,
            by_register: false,
        };
        if inst.wback || inst.n == SP {
            let last = terms.plus(base, if before { -bytes } else { bytes })?;
            let registers = (0..16).filter(|register| list & 1 << register != 0);
            if stores && registers.clone().any(|register| register == inst.n) {
                return unproven("a base that is transferred and written back");
            }
            self.write(terms, inst.n, last)?;
        }
        let registers = (0..16).filter(|register| list & 1 << register != 0);
        for (register, at) in registers.zip((0..).step_by(4)) {
            let address = terms.plus(first, at)?;
            let value = stores.then(|| self.register(terms, register)).transpose()?;
            self.transfer(terms, register, value, address, moved)?;
        }
        Ok(())
    }
}
