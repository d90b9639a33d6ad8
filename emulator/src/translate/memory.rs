//! Loads and stores of one and two registers in place: `exec::memory`, in plain memory.

use super::RunMode;
use super::apart::PagePorts;
use super::emitter::{At, Emitter};
use super::leave::Target;
use super::unit::Time;
use crate::memory::PAGE;
use crate::op::Flow;
use cranelift_codegen::ir::condcodes::IntCC;
use cranelift_codegen::ir::types::{I32, I64};
use cranelift_codegen::ir::{Block, InstBuilder, MemFlagsData, Type, Value};
use std::mem::offset_of;
use whippen_isa::{Class, Op as I, RegSet};

/// What is loaded or stored.
#[derive(Clone, Copy, PartialEq, Eq)]
struct Extent {
    bytes: u32,
    signed: bool,
}

/// Some words or a part of one, one behind the other.
#[derive(Clone, Copy)]
pub(super) struct Span {
    pub address: Value,
    /// The address is a multiple of this.
    pub aligned: u32,
    pub bytes: u32,
    pub write: bool,
}

fn datum(op: I) -> Option<Extent> {
    let (bytes, signed) = match op {
        I::LDR_immediate | I::LDR_literal | I::LDR_register | I::LDRT => (4, false),
        I::LDRB_immediate | I::LDRB_literal | I::LDRB_register | I::LDRBT => (1, false),
        I::LDRH_immediate | I::LDRH_literal | I::LDRH_register | I::LDRHT => (2, false),
        I::LDRSB_immediate | I::LDRSB_literal | I::LDRSB_register | I::LDRSBT => (1, true),
        I::LDRSH_immediate | I::LDRSH_literal | I::LDRSH_register | I::LDRSHT => (2, true),
        I::STR_immediate | I::STR_register | I::STRT => (4, false),
        I::STRB_immediate | I::STRB_register | I::STRBT => (1, false),
        I::STRH_immediate | I::STRH_register | I::STRHT => (2, false),
        _ => return None,
    };
    Some(Extent { bytes, signed })
}

/// Bytes of a page: at any place, and only this code knows them.
pub(super) fn plain() -> MemFlagsData {
    MemFlagsData::new().with_notrap()
}

/// Where a span is on this computer.
#[derive(Clone, Copy)]
pub(super) struct PagePlace {
    pub host: Value,
    pub ports: Option<PagePorts>,
}

impl Emitter<'_, '_> {
    /// Whether it was one of these, and is emitted.
    pub fn memory(&mut self, at: &At) -> bool {
        match (at.inst.class(), datum(at.inst.op())) {
            (Class::Load, Some(datum)) if at.inst.t != 13 => self.load(at, datum),
            (Class::Store, Some(datum)) => self.store(at, datum),
            (Class::LoadDual | Class::StoreDual, _) => self.dual(at),
            (Class::Preload, _) => {}
            _ => return false,
        }
        true
    }

    /// The address, and what is written back to the base.
    fn address(&mut self, at: &At, slow: Block) -> (Value, Option<Value>) {
        let (op, inst) = (at.op, at.inst);
        let loads = matches!(inst.class(), Class::Load | Class::LoadDual);
        if loads && inst.uses().contains(RegSet::core(15)) {
            return (self.constant(op.imm), None);
        }
        let base = self.register(op, op.n);
        if inst.is_by_register() {
            let index = self.register(op, op.m);
            let index = self.f.ins().ishl_imm_u(index, i64::from(op.amount & 31));
            return (self.f.ins().iadd(base, index), None);
        }
        let moved = self.f.ins().iadd_imm_u(base, i64::from(op.imm));
        if inst.index && !inst.wback {
            return (moved, None);
        }
        let back = match op.n {
            13 => self.checked_sp(moved, slow),
            _ => moved,
        };
        (if inst.index { moved } else { base }, Some(back))
    }

    fn load(&mut self, at: &At, datum: Extent) {
        let (before, slow) = (self.kept, self.f.create_block());
        let (address, back) = self.address(at, slow);
        let span = Span {
            address,
            aligned: datum.bytes,
            bytes: datum.bytes,
            write: false,
        };
        let place = self.host(span, slow);
        let value = self.part(place.host, datum.bytes, datum.signed);
        if at.op.t == 15 {
            self.check_branch(value, slow);
        }
        self.note(at, address, 1, place);
        if let Some(back) = back {
            self.set_register(at.op.n, back);
        }
        match at.op.t {
            15 => self.branch_to(at, value),
            t => self.set_register(t, value),
        }
        self.or_interpret(at, slow, before);
    }

    fn store(&mut self, at: &At, datum: Extent) {
        let (before, slow) = (self.kept, self.f.create_block());
        let (address, back) = self.address(at, slow);
        let value = self.register(at.op, at.op.t);
        let span = Span {
            address,
            aligned: datum.bytes,
            bytes: datum.bytes,
            write: true,
        };
        let place = self.host(span, slow);
        self.note(at, address, 1, place);
        self.keep(at, place, 0, datum.bytes);
        let (host, flags) = (place.host, plain());
        match datum.bytes {
            1 => self.f.ins().istore8(flags, value, host, 0),
            2 => self.f.ins().istore16(flags, value, host, 0),
            _ => self.f.ins().store(flags, value, host, 0),
        };
        if let Some(back) = back {
            self.set_register(at.op.n, back);
        }
        self.or_interpret(at, slow, before);
    }

    fn dual(&mut self, at: &At) {
        let (before, slow) = (self.kept, self.f.create_block());
        let (address, back) = self.address(at, slow);
        let write = at.inst.class() == Class::StoreDual;
        let pair = [at.op.t, at.op.a];
        let words = pair.map(|t| {
            if write {
                Some(self.register(at.op, t))
            } else {
                None
            }
        });
        let span = Span {
            address,
            aligned: 4,
            bytes: 8,
            write,
        };
        let place = self.host(span, slow);
        let host = place.host;
        self.note(at, address, 2, place);
        let words = [(0, words[0]), (4, words[1])].map(|(offset, word)| match word {
            Some(word) => {
                self.put_word(at, place, offset, word);
                None
            }
            None => Some(self.word(host, offset as i32)),
        });
        for (register, word) in pair.into_iter().zip(words) {
            if let Some(word) = word {
                self.set_register(register, word);
            }
        }
        if let Some(back) = back {
            self.set_register(at.op.n, back);
        }
        self.or_interpret(at, slow, before);
    }

    /// Where the bytes are on this computer; to `slow` where not all of them can be accessed
    /// without ado.
    pub fn host(&mut self, span: Span, slow: Block) -> PagePlace {
        let Span {
            address,
            aligned,
            bytes,
            write,
        } = span;
        if aligned > 1 {
            let odd = self.f.ins().band_imm_u(address, i64::from(aligned - 1));
            self.unless(odd, slow);
        }
        let at = self.f.ins().band_imm_u(address, PAGE as i64 - 1);
        if bytes > aligned {
            let last = PAGE as i64 - i64::from(bytes);
            let beyond = self
                .f
                .ins()
                .icmp_imm_u(IntCC::UnsignedGreaterThan, at, last);
            self.unless(beyond, slow);
        }
        let map = if write { self.writes } else { self.reads };
        let slot = self
            .f
            .ins()
            .ushr_imm_u(address, PAGE.trailing_zeros() as i64);
        let slot = self.f.ins().uextend(I64, slot);
        let slot = self.f.ins().ishl_imm_u(slot, 2);
        let slot = self.f.ins().iadd(map, slot);
        let number = self.load_map(I32, slot);
        let page = self.f.ins().uextend(I64, number);
        let absent = self.f.ins().icmp_imm_u(IntCC::Equal, number, 0);
        self.unless(absent, slow);
        let ports = match self.mode {
            RunMode::Alone => None,
            RunMode::Apart => Some(self.ports(page, at, slow)),
        };
        let page = self.f.ins().ishl_imm_u(page, PAGE.trailing_zeros() as i64);
        let page = self.f.ins().iadd(self.pages, page);
        let at = self.f.ins().uextend(I64, at);
        PagePlace {
            host: self.f.ins().iadd(page, at),
            ports,
        }
    }

    /// The port of the first word of a page and the mask of its words; to `slow` where it has no
    /// port.
    fn ports(&mut self, page: Value, at: Value, slow: Block) -> PagePorts {
        let trusted = MemFlagsData::trusted();
        let offset = offset_of!(Time, stripes) as i32;
        let stripes = self.f.ins().load(I64, trusted, self.time, offset);
        let stripe = self.f.ins().ishl_imm_u(page, 1);
        let stripe = self.f.ins().iadd(stripes, stripe);
        let first = self.f.ins().uload8(I32, trusted, stripe, -2);
        let mask = self.f.ins().uload8(I32, trusted, stripe, -1);
        let none = i64::from(crate::memory::NO_PORT);
        let none = self.f.ins().icmp_imm_u(IntCC::Equal, first, none);
        self.unless(none, slow);
        PagePorts {
            page,
            at,
            first,
            mask,
        }
    }

    fn load_map(&mut self, of: Type, at: Value) -> Value {
        self.f.ins().load(of, MemFlagsData::trusted(), at, 0)
    }

    /// A word or a part of one, extended.
    pub fn part(&mut self, host: Value, bytes: u32, signed: bool) -> Value {
        let flags = plain();
        match (bytes, signed) {
            (1, false) => self.f.ins().uload8(I32, flags, host, 0),
            (1, true) => self.f.ins().sload8(I32, flags, host, 0),
            (2, false) => self.f.ins().uload16(I32, flags, host, 0),
            (2, true) => self.f.ins().sload16(I32, flags, host, 0),
            _ => self.f.ins().load(I32, flags, host, 0),
        }
    }

    /// A word of a page.
    pub fn word(&mut self, host: Value, offset: i32) -> Value {
        self.f.ins().load(I32, plain(), host, offset)
    }

    /// Writes a word of a page.
    pub fn put_word(&mut self, at: &At, place: PagePlace, offset: u32, word: Value) {
        self.keep(at, place, offset, 4);
        self.f.ins().store(plain(), word, place.host, offset as i32);
    }

    /// To `slow` where something is not zero.
    pub fn unless(&mut self, odd: Value, slow: Block) {
        let next = self.f.create_block();
        self.f.ins().brif(odd, slow, &[], next, &[]);
        self.begin(next);
    }

    /// To `slow` where a branch to an address is more than that (`Cpu::check_branch`).
    pub fn check_branch(&mut self, address: Value, slow: Block) {
        let odd = self.f.ins().band_imm_u(address, 1);
        let even = self.f.ins().bxor_imm_u(odd, 1);
        self.unless(even, slow);
        let special =
            self.f
                .ins()
                .icmp_imm_u(IntCC::UnsignedGreaterThanOrEqual, address, 0xf000_0000_i64);
        self.unless(special, slow);
    }

    /// Leaves with a branch to an odd address.
    pub fn branch_to(&mut self, at: &At, address: Value) {
        let pc = self.f.ins().band_imm_u(address, i64::from(!1_u32));
        self.leave_to(Flow::Branch, at.index, Target::Of(pc));
    }
}
