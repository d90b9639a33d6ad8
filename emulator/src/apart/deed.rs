//! What a core may do exactly while the other one waits ahead of it.
//!
//! The other one ran plain instructions only, from and to its ports. What is done here touches none
//! of them: it asks a device that keeps to itself, changes registers of its own core, waits, or
//! returns from an exception. Whether the other core would have noticed is looked at afterwards; it
//! is then taken back to the cycle of this, where nothing of what it lost had an effect.

use super::side::Reach;
use crate::access::is_private;
use crate::board::CoreKind;
use crate::cpu::{Activity, Cpu};
use crate::exception::is_return;
use crate::machine::Machine;
use whippen_isa::{Class, Op as I};

/// Bytes of a block at most.
const BLOCK_BYTES: u32 = 256;
/// Bytes of the largest frame of an exception, and of one without floating point.
const FRAME_BYTES: u32 = 0x6c;
const SMALL_FRAME_BYTES: u32 = 0x20;

impl Machine {
    /// Whether a core that stopped may do what stopped it, while the other one has used some ports.
    /// Code that was not decoded is found.
    pub(super) fn may_act(&mut self, core: usize, reach: Reach, others: u32) -> bool {
        if !self.finds_code(core, others) {
            return false;
        }
        let (bus, of) = (&mut self.bus, &mut self.cores[core]);
        if reach == Reach::Unknown {
            of.find_here(bus);
            return true;
        }
        let (block, index) = of.locate(bus);
        let (block, op) = (&of.code.blocks[block], of.code.blocks[block].ops[index]);
        let Ok((inst, _)) = &block.infos[index].inst else {
            return false;
        };
        let popped = match (inst.class(), inst.op(), reach) {
            (_, I::WFE | I::WFI | I::MSR | I::CPS, _) => return true,
            (Class::Load | Class::Store, _, Reach::Refused(Some(address)))
                if op.t < 15 && op.n != 13 =>
            {
                if bus.keeps_to_itself(address, inst.class() == Class::Store) {
                    return true;
                }
                is_private(address).then_some(0)
            }
            (_, I::BX, Reach::Refused(None)) => popped(&of.cpu, of.cpu.rm(&op)),
            (Class::LoadMultiple, _, Reach::Refused(None)) if op.n == 13 && op.imm >> 15 != 0 => {
                let bytes = 4 * op.imm.count_ones();
                let link = of.cpu.r[13].wrapping_add(bytes - 4);
                let mut word = [0; 4];
                let read = bus.memory.read(link, &mut word).is_ok();
                let frame = popped(&of.cpu, u32::from_le_bytes(word)).filter(|_| read);
                frame.map(|frame| bytes + frame)
            }
            _ => None,
        };
        popped.is_some_and(|bytes| self.uses_none_of(core, bytes, others))
    }

    /// Whether a block may be decoded where a core stands, while the other one has used some ports.
    pub(super) fn finds_code(&self, core: usize, others: u32) -> bool {
        let (memory, of) = (&self.bus.memory, &self.cores[core]);
        let pc = of.cpu.pc;
        let code = memory.page_ports(pc) | memory.page_ports(pc.wrapping_add(BLOCK_BYTES));
        of.cpu.thumb && !of.code.is_full() && code & others == 0
    }

    /// Whether vectors and stacks of a core, of which so many bytes are popped, are at none of some
    /// ports, and stacks hold no code: so may be taken and left what exceptions there are.
    fn uses_none_of(&self, core: usize, popped: u32, ports: u32) -> bool {
        let (cpu, memory) = (&self.cores[core].cpu, &self.bus.memory);
        let table = cpu.system.vtor;
        let vectors = [table, table.wrapping_add(4 * cpu.system.nvic.count - 4)];
        let ends = [FRAME_BYTES.wrapping_neg(), popped.wrapping_sub(1)];
        let stack = |sp: u32| ends.map(|bytes| sp.wrapping_add(bytes));
        let stacks = [cpu.r[13], cpu.other_sp].map(stack);
        let mut stacks = stacks.as_flattened().iter();
        let apart = |at: &u32| memory.page_ports(*at) & ports == 0;
        vectors.iter().all(apart) && stacks.all(|at| apart(at) && !memory.is_beside_code(*at))
    }

    /// Whether the other core would have noticed what was just done. It has heard of lines then.
    pub(super) fn disturbs(&mut self, other: usize, end: u64) -> bool {
        let lines = &self.bus.lines;
        let ordered = lines.cores.iter().any(|of| of.order.is_some());
        let ends = lines.reset || lines.glitch.is_some() || ordered;
        if ends || self.next_due() < end || !self.bus.fabric.is_even() {
            return true;
        }
        self.obey();
        self.is_interrupted(other)
    }

    /// Whether a core takes an exception before its next instruction.
    pub(super) fn is_interrupted(&mut self, core: usize) -> bool {
        let cpu = &mut self.cores[core].cpu;
        let running = cpu.activity == Activity::Running;
        if running && cpu.system.changed && cpu.preempting().is_none() {
            cpu.system.changed = false;
        }
        running && cpu.system.changed
    }
}

/// Bytes that a branch to an address pops where that is the return from an exception.
fn popped(cpu: &Cpu, link: u32) -> Option<u32> {
    let small = link & 1 << 4 != 0 || cpu.kind == CoreKind::CortexM0Plus;
    let frame = if small {
        SMALL_FRAME_BYTES
    } else {
        FRAME_BYTES
    };
    (cpu.in_handler() && is_return(cpu.kind, link)).then_some(frame)
}
