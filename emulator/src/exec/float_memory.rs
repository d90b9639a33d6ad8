//! Floating-point loads and stores. `d` is the first register, `imm` their number or the offset.

use crate::bus::Bus;
use crate::cpu::Cpu;
use crate::op::{Flow, Op, Run};
use whippen_isa::{Class, Inst, Op as I, RegSet};

fn load<const WORDS: u32, const LITERAL: bool>(cpu: &mut Cpu, bus: &mut Bus, op: &Op) -> Flow {
    let address = if LITERAL {
        op.imm
    } else {
        cpu.rn(op).wrapping_add(op.imm)
    };
    done(
        cpu.float_check(bus, op)
            .and_then(|()| cpu.load_singles(bus, u32::from(op.d) * WORDS, WORDS, address)),
    )
}

fn store<const WORDS: u32>(cpu: &mut Cpu, bus: &mut Bus, op: &Op) -> Flow {
    let address = cpu.rn(op).wrapping_add(op.imm);
    done(
        cpu.float_check(bus, op)
            .and_then(|()| cpu.store_singles(bus, u32::from(op.d) * WORDS, WORDS, address)),
    )
}

/// `X`: a word more than its registers, which is not accessed.
fn load_multiple<const WORDS: u32, const DOWN: bool, const X: bool>(
    cpu: &mut Cpu,
    bus: &mut Bus,
    op: &Op,
) -> Flow {
    done(multiple::<WORDS, DOWN, X>(cpu, bus, op, Cpu::load_singles))
}

fn store_multiple<const WORDS: u32, const DOWN: bool, const X: bool>(
    cpu: &mut Cpu,
    bus: &mut Bus,
    op: &Op,
) -> Flow {
    done(multiple::<WORDS, DOWN, X>(cpu, bus, op, Cpu::store_singles))
}

type Transfer = fn(&mut Cpu, &mut Bus, u32, u32, u32) -> Result<(), Flow>;

fn multiple<const WORDS: u32, const DOWN: bool, const X: bool>(
    cpu: &mut Cpu,
    bus: &mut Bus,
    op: &Op,
    transfer: Transfer,
) -> Result<(), Flow> {
    cpu.float_check(bus, op)?;
    let words = op.imm * WORDS;
    let bytes = 4 * (words + u32::from(X));
    let base = cpu.rn(op);
    let (address, after) = match DOWN {
        true => (base.wrapping_sub(bytes), base.wrapping_sub(bytes)),
        false => (base, base.wrapping_add(bytes)),
    };
    // `amount` is whether the base is written back.
    let after = if op.amount != 0 {
        cpu.new_base(after, op)?
    } else {
        base
    };
    transfer(cpu, bus, u32::from(op.d) * WORDS, words, address)?;
    if op.amount != 0 {
        cpu.write(op.n, after);
    }
    Ok(())
}

impl Cpu {
    /// Loads registers from S`first` on; none changes unless all are there.
    fn load_singles(
        &mut self,
        bus: &mut Bus,
        first: u32,
        count: u32,
        address: u32,
    ) -> Result<(), Flow> {
        let mut words = [0; 32];
        for i in 0..count.min(32) {
            words[i as usize] = self.load_aligned::<u32>(bus, address.wrapping_add(4 * i))?;
        }
        for i in 0..count.min(32) {
            self.s[((first + i) & 31) as usize] = words[i as usize];
        }
        Ok(())
    }

    fn store_singles(
        &mut self,
        bus: &mut Bus,
        first: u32,
        count: u32,
        address: u32,
    ) -> Result<(), Flow> {
        for i in 0..count.min(32) {
            self.store_aligned::<u32>(
                bus,
                address.wrapping_add(4 * i),
                self.s[((first + i) & 31) as usize],
            )?;
        }
        Ok(())
    }
}

fn done(result: Result<(), Flow>) -> Flow {
    result.err().unwrap_or(Flow::Next)
}

pub(super) fn select(inst: &Inst) -> Option<Run> {
    let literal = inst.uses().contains(RegSet::core(15));
    Some(match (inst.op(), literal) {
        (I::VLDR, false) => load::<2, false>,
        (I::VLDR, true) => load::<2, true>,
        (I::VLDR_single, false) => load::<1, false>,
        (I::VLDR_single, true) => load::<1, true>,
        (I::VSTR, _) => store::<2>,
        (I::VSTR_single, _) => store::<1>,
        (I::VLDMIA | I::VPOP, _) => load_multiple::<2, false, false>,
        (I::VLDMIA_single | I::VPOP_single, _) => load_multiple::<1, false, false>,
        (I::VLDMDB, _) => load_multiple::<2, true, false>,
        (I::VLDMDB_single, _) => load_multiple::<1, true, false>,
        (I::VSTMIA, _) => store_multiple::<2, false, false>,
        (I::VSTMIA_single, _) => store_multiple::<1, false, false>,
        (I::VSTMDB | I::VPUSH, _) => store_multiple::<2, true, false>,
        (I::VSTMDB_single | I::VPUSH_single, _) => store_multiple::<1, true, false>,
        (I::FLDMIAX, _) => load_multiple::<2, false, true>,
        (I::FLDMDBX, _) => load_multiple::<2, true, true>,
        (I::FSTMIAX, _) => store_multiple::<2, false, true>,
        (I::FSTMDBX, _) => store_multiple::<2, true, true>,
        _ => return None,
    })
}

/// Whether `amount` is the write-back of a list.
pub(super) fn is_list(inst: &Inst) -> bool {
    matches!(
        inst.class(),
        Class::FloatLoadMultiple | Class::FloatStoreMultiple
    )
}
