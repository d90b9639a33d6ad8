//! Loads and stores of lists in place: `exec::multiple`, within a page of plain memory.

use super::emitter::{At, Emitter};
use super::kept::members;
use super::memory::Span;
use cranelift_codegen::ir::{InstBuilder, Value};
use whippen_isa::{Class, Op as I};

impl Emitter<'_, '_> {
    /// Whether it was one of these, and is emitted.
    pub fn multiple(&mut self, at: &At) -> bool {
        let loads = match at.inst.class() {
            Class::LoadMultiple => true,
            Class::StoreMultiple => false,
            _ => return false,
        };
        let (before, slow) = (self.kept, self.f.create_block());
        let (op, list) = (at.op, at.op.imm);
        let bytes = 4 * list.count_ones();
        let base = self.register(op, op.n);
        let down = matches!(at.inst.op(), I::LDMDB | I::STMDB | I::PUSH);
        let moved = if down { bytes.wrapping_neg() } else { bytes };
        let moved = self.f.ins().iadd_imm_u(base, i64::from(moved));
        let back = at.inst.wback.then(|| match op.n {
            13 => self.checked_sp(moved, slow),
            _ => moved,
        });
        let stored: Vec<Value> = match loads {
            true => Vec::new(),
            false => members(list).map(|r| self.register(op, r as u8)).collect(),
        };
        let span = Span {
            address: if down { moved } else { base },
            aligned: 4,
            bytes,
            write: !loads,
        };
        let place = self.host(span, slow);
        let host = place.host;
        for (i, word) in stored.into_iter().enumerate() {
            self.put_word(at, place, 4 * i as u32, word);
        }
        let loaded: Vec<(usize, Value)> = match loads {
            true => {
                let words = members(list).enumerate();
                words
                    .map(|(i, r)| (r, self.word(host, 4 * i as i32)))
                    .collect()
            }
            false => Vec::new(),
        };
        let target = loaded.iter().find(|(r, _)| *r == 15).map(|(_, word)| *word);
        if let Some(target) = target {
            self.check_branch(target, slow);
        }
        self.note(at, span.address, list.count_ones(), place);
        for (register, word) in loaded.into_iter().filter(|(r, _)| *r != 15) {
            self.set_register(register as u8, word);
        }
        if let Some(back) = back {
            self.set_register(op.n, back);
        }
        if let Some(target) = target {
            self.branch_to(at, target);
        }
        self.or_interpret(at, slow, before);
        true
    }
}
