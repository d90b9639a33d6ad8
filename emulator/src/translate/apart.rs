//! What translated code notes of a core that runs apart (`crate::apart`): ports, accesses, what
//! stores replace, and which blocks ran when.

use super::emitter::{At, Emitter};
use super::kept::fixed;
use super::memory::{PagePlace, plain};
use super::unit::{Time, Way};
use crate::apart::{Before, Stretch, Trail};
use crate::bus::Bus;
use crate::core::Run;
use crate::memory::Replaced;
use crate::op::Flow;
use cranelift_codegen::ir::condcodes::IntCC;
use cranelift_codegen::ir::types::{I8, I16, I32, I64};
use cranelift_codegen::ir::{InstBuilder, Type, Value};
use std::mem::offset_of;

/// Where something of the trail is, on the bus.
const fn of_trail(offset: usize) -> i32 {
    (offset_of!(Bus, trail) + offset) as i32
}

const ACCESSES: i32 = of_trail(Trail::ACCESSES);
const REPLACED: i32 = of_trail(Trail::REPLACED);
const STRETCHES: i32 = of_trail(Trail::STRETCHES);
const PORTS: i32 = of_trail(Trail::PORTS);

/// For a core that runs apart: the number plus one of the page and the offset in it, the port of
/// its first word, and the mask of word numbers.
#[derive(Clone, Copy)]
pub(super) struct PagePorts {
    pub page: Value,
    pub at: Value,
    pub first: Value,
    pub mask: Value,
}

impl Emitter<'_, '_> {
    fn of_bus(&mut self, of: Type, offset: i32) -> Value {
        self.f.ins().load(of, fixed(), self.bus, offset)
    }

    fn of_time(&mut self, offset: usize) -> Value {
        self.f.ins().load(I64, fixed(), self.time, offset as i32)
    }

    /// A block begins.
    pub fn begin_apart(&mut self) {
        for (of, offset) in [
            (ACCESSES, offset_of!(Before, accesses)),
            (REPLACED, offset_of!(Before, replaced)),
        ] {
            let len = self.of_bus(I64, of);
            self.put_before(len, offset);
        }
        let ports = self.of_bus(I32, PORTS);
        self.put_before(ports, offset_of!(Before, ports));
        let own = self.unit.blocks[self.node.block].ports;
        let ports = self.f.ins().bor_imm_u(ports, i64::from(own));
        self.f.def_var(self.ports, ports);
    }

    fn put_before(&mut self, value: Value, offset: usize) {
        let offset = (offset_of!(Time, before) + offset) as i32;
        self.f.ins().store(fixed(), value, self.time, offset);
    }

    /// Reads the ports that the interpreter added to.
    pub fn read_ports(&mut self) {
        let ports = self.of_bus(I32, PORTS);
        self.f.def_var(self.ports, ports);
    }

    /// Writes the ports that were used.
    pub fn write_ports(&mut self) {
        let ports = self.f.use_var(self.ports);
        self.f.ins().store(fixed(), ports, self.bus, PORTS);
    }

    /// Notes the block that ran; whether there is room for what the next one may note.
    pub fn note_stretch(&mut self, way: &Way, flow: Flow, left: Value) -> Value {
        let len = self.of_bus(I64, STRETCHES);
        let room = self.of_time(offset_of!(Time, stretches));
        let to = self.f.ins().imul_imm_u(len, size_of::<Stretch>() as i64);
        let to = self.f.ins().iadd(room, to);
        let end = self.of_time(offset_of!(Time, end));
        let cycle = self.f.ins().isub(end, left);
        let accesses = self.of_time(offset_of!(Time, before) + offset_of!(Before, accesses));
        let ports = (offset_of!(Time, before) + offset_of!(Before, ports)) as i32;
        let ports = self.f.ins().load(I32, fixed(), self.time, ports);
        self.write_ports();
        let mut put = |value: Value, offset: usize| {
            self.f.ins().store(plain(), value, to, offset as i32);
        };
        put(cycle, offset_of!(Stretch, cycle));
        put(accesses, offset_of!(Stretch, accesses));
        put(ports, offset_of!(Stretch, ports));
        let run = |offset: usize| offset_of!(Stretch, run) + offset;
        for (of, value, offset) in [
            (I64, way.outcomes, offset_of!(Stretch, outcomes)),
            (I16, self.node.pipe.into(), offset_of!(Stretch, pipe)),
            (I64, self.node.block as u64, run(offset_of!(Run, block))),
            (I64, 0, run(offset_of!(Run, first))),
            (I64, way.link.done.into(), run(offset_of!(Run, done))),
            (I8, 0, run(offset_of!(Run, single))),
            (I8, flow as u64, run(offset_of!(Run, flow))),
        ] {
            let value = self.f.ins().iconst(of, value as i64);
            self.f.ins().store(plain(), value, to, offset as i32);
        }
        let len = self.f.ins().iadd_imm_u(len, 1);
        self.f.ins().store(fixed(), len, self.bus, STRETCHES);
        let accesses = self.of_bus(I64, ACCESSES);
        let accesses_max = self.of_time(offset_of!(Time, accesses_max));
        let stretches_max = self.of_time(offset_of!(Time, stretches_max));
        let cc = IntCC::UnsignedLessThanOrEqual;
        let few = self.f.ins().icmp(cc, accesses, accesses_max);
        let short = self.f.ins().icmp(cc, len, stretches_max);
        self.f.ins().band(few, short)
    }

    /// Keeps what a store replaces, where the core runs apart.
    pub fn keep(&mut self, at: &At, place: PagePlace, offset: u32, bytes: u32) {
        let Some(ports) = place.ports else {
            return;
        };
        let room = self.of_time(offset_of!(Time, replaced));
        let len = self.of_bus(I64, REPLACED);
        let to = self.f.ins().imul_imm_u(len, size_of::<Replaced>() as i64);
        let to = self.f.ins().iadd(room, to);
        let host = self.f.ins().iadd_imm_u(place.host, i64::from(offset));
        let before = self.part(host, bytes, false);
        let page = self.f.ins().iadd_imm_s(ports.page, -1);
        let inside = self.f.ins().iadd_imm_u(ports.at, i64::from(offset));
        let about = self.constant(bytes | (at.index as u32) << 8);
        let fields = [offset_of!(Replaced, page), offset_of!(Replaced, bytes)];
        let [page_at, bytes_at] = fields.map(|offset| offset as i32);
        self.f.ins().istore32(plain(), page, to, page_at);
        self.f.ins().store(plain(), before, to, bytes_at);
        let (inside_at, about_at) = (offset_of!(Replaced, at), offset_of!(Replaced, size));
        self.f.ins().istore16(plain(), inside, to, inside_at as i32);
        self.f.ins().istore16(plain(), about, to, about_at as i32);
        let len = self.f.ins().iadd_imm_u(len, 1);
        self.f.ins().store(fixed(), len, self.bus, REPLACED);
    }

    /// Notes the accesses of an instruction, one a word, where the core runs apart: the ports, and
    /// of several which one came when.
    pub fn note(&mut self, at: &At, address: Value, words: u32, place: PagePlace) {
        let Some(PagePorts { first, mask, .. }) = place.ports else {
            return;
        };
        let mut ports = self.f.use_var(self.ports);
        let number = self.f.ins().ushr_imm_u(address, 2);
        let mut entries = Vec::new();
        for word in 0..words {
            let number = self.f.ins().iadd_imm_u(number, i64::from(word));
            let number = self.f.ins().band(number, mask);
            let port = self.f.ins().iadd(first, number);
            let one = self.constant(1);
            let bit = self.f.ins().ishl(one, port);
            ports = self.f.ins().bor(ports, bit);
            entries.push(port);
        }
        self.f.def_var(self.ports, ports);
        if words > 1 {
            self.note_each(at, &entries);
        }
    }

    fn note_each(&mut self, at: &At, ports: &[Value]) {
        let room = self.of_time(offset_of!(Time, accesses));
        let len = self.of_bus(I64, ACCESSES);
        let to = self.f.ins().ishl_imm_u(len, 1);
        let to = self.f.ins().iadd(room, to);
        for (word, port) in ports.iter().enumerate() {
            let port = self.f.ins().ishl_imm_u(*port, 8);
            let access = self.f.ins().bor_imm_u(port, at.index as i64);
            self.f.ins().istore16(plain(), access, to, 2 * word as i32);
        }
        let len = self.f.ins().iadd_imm_u(len, ports.len() as i64);
        self.f.ins().store(fixed(), len, self.bus, ACCESSES);
    }
}
