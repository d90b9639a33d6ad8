//! Load-exclusive, store-exclusive, load-acquire, store-release.
//!
//! Accesses are made in the order of the program anyway; what remains is the monitor. An exclusive
//! store succeeds while its core's tag stands: set by the exclusive load of the same address,
//! cleared by CLREX, by any exclusive store and by exceptions, and by any store of another core to
//! the word.

use crate::access::Datum;
use crate::bus::Bus;
use crate::cpu::Cpu;
use crate::op::{Flow, Op, Run};
use whippen_isa::{Inst, Op as I};

fn load<T: Datum, const EXCLUSIVE: bool>(cpu: &mut Cpu, bus: &mut Bus, op: &Op) -> Flow {
    let address = cpu.rn(op).wrapping_add(op.imm);
    if EXCLUSIVE && bus.apart {
        return Flow::Inexact;
    }
    let value = match cpu.load_aligned::<T>(bus, address) {
        Ok(value) => value,
        Err(flow) => return flow,
    };
    if EXCLUSIVE {
        bus.guard(cpu.index, address);
    }
    cpu.write(op.t, value);
    Flow::Next
}

fn store<T: Datum>(cpu: &mut Cpu, bus: &mut Bus, op: &Op) -> Flow {
    match cpu.store_aligned::<T>(bus, cpu.rn(op), cpu.rt(op)) {
        Ok(()) => Flow::Next,
        Err(flow) => flow,
    }
}

fn store_exclusive<T: Datum>(cpu: &mut Cpu, bus: &mut Bus, op: &Op) -> Flow {
    let address = cpu.rn(op).wrapping_add(op.imm);
    if bus.apart {
        return Flow::Inexact;
    }
    let succeeds = bus.exclusives[cpu.index] == Some(address);
    if succeeds && let Err(flow) = cpu.store_aligned::<T>(bus, address, cpu.rt(op)) {
        return flow;
    }
    bus.exclusives[cpu.index] = None;
    cpu.write(op.d, u32::from(!succeeds));
    Flow::Next
}

fn clear(cpu: &mut Cpu, bus: &mut Bus, _: &Op) -> Flow {
    if bus.apart {
        return Flow::Inexact;
    }
    bus.exclusives[cpu.index] = None;
    Flow::Next
}

pub(super) fn select(inst: &Inst) -> Option<Run> {
    Some(match inst.op() {
        I::LDREX | I::LDAEX => load::<u32, true>,
        I::LDREXH | I::LDAEXH => load::<u16, true>,
        I::LDREXB | I::LDAEXB => load::<u8, true>,
        I::LDA => load::<u32, false>,
        I::LDAH => load::<u16, false>,
        I::LDAB => load::<u8, false>,
        I::STL => store::<u32>,
        I::STLH => store::<u16>,
        I::STLB => store::<u8>,
        I::STREX | I::STLEX => store_exclusive::<u32>,
        I::STREXH | I::STLEXH => store_exclusive::<u16>,
        I::STREXB | I::STLEXB => store_exclusive::<u8>,
        I::CLREX => clear,
        _ => return None,
    })
}
