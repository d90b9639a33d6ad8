//! SIMD vectorisation over keys, written without Cranelift: `tick` of sixteen keys at once, in
//! vectors of 512 bits, where a tick is made of words.
//!
//! ```text
//!   i1    a register of masks: a bit a key        i32   a vector: a word a key
//!
//!   rdi   bases of all buffers       rsi   the first key            zmm30   0
//!   r8    its word in the columns    r9    constants                zmm31   the half of a product's top word
//!   rbp   room: addresses of rows, what registers do not hold      k7      even lanes
//! ```
//!
//! **Why.** Cranelift has vectors of 128 bits and 16 registers. Here are four times as many lanes
//! and twice as many registers, a constant is an operand in memory that is spread over the lanes,
//! and a `select` or a write of some keys is one instruction with a mask. Code is written in one
//! walk, which takes a fraction of the time that Cranelift takes.
//!
//! **When.** On x86-64 with AVX-512F, for the operators of [`supports`]; any other kernel runs in
//! four lanes ([`super::lanes`]). Branches and events are as they are there.
//!
//! **Keys left over** run in code of its own, the same with a mask around it: what is left of a
//! keyboard after whole groups, and a group of which one key is observed.

mod control;
mod encoder;
mod memory;
mod operator;
mod registers;

use crate::loop_context::Buffer;
use encoder::{ALL, Address, Gpr, Mask, MaskOp, Operand, Zmm, forms, opcodes};
use registers::{Bank, Constants, Facts, Node, Registers, SLOT_BYTES};
use std::collections::HashMap;
use whippen_ids::IdMap;
use whippen_kernel::layout::Layout;
use whippen_kernel::{Kernel, Op, Region, Type, Value, Walk};

/// How many keys run at once.
pub(super) const WIDTH: usize = 16;

/// The registers that hold the same throughout.
const ZERO: Zmm = Zmm(30);
const HALF: Zmm = Zmm(31);
const EVEN: Mask = Mask(7);
const TAIL: Mask = Mask(6);

/// Which keys of a group one function runs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Groups {
    /// All, of every group from the second argument on and before the third.
    Whole,
    /// Those of one group, at the second argument, whose bits are set in the third.
    Part,
}

/// Machine code of a tick.
pub(super) struct Sixteen {
    pub whole: Vec<u8>,
    pub part: Vec<u8>,
    /// What both read.
    pub constants: Vec<u128>,
    /// How many words of room they need.
    pub room_words: usize,
}

/// Whether this machine runs such code.
#[cfg(all(target_arch = "x86_64", not(windows)))]
pub(super) fn machine_has_it() -> bool {
    is_x86_feature_detected!("avx512f")
}

/// Whether this machine runs such code.
#[cfg(not(all(target_arch = "x86_64", not(windows))))]
pub(super) fn machine_has_it() -> bool {
    false
}

/// Whether a kernel's tick has such a form.
pub(super) fn supports(kernel: &Kernel) -> bool {
    let is_word = |value: &Value| kernel.values[value].ty != Type::I64;
    let has = |op: Op| match op {
        Op::In(_) => kernel.inputs.len() == 1,
        Op::Out(_) => kernel.outputs.len() == 1,
        Op::Const(_) | Op::Assume(..) | Op::If => true,
        Op::Add | Op::Sub | Op::Mul | Op::AddWrap | Op::SubWrap | Op::MulWrap => true,
        Op::MulTop | Op::MacTop | Op::Min | Op::Max => true,
        Op::Shl(_) | Op::ShlWrap(_) | Op::Sar(_) | Op::SarRound(_) => true,
        Op::Eq | Op::Lt | Op::Le | Op::And | Op::Or | Op::Not | Op::Select => true,
        Op::Live(_) | Op::Tick(_) | Op::Keyed(_) | Op::Lookup(..) => true,
        Op::Get(_) | Op::Set(_) | Op::Delay(..) | Op::Push(_) | Op::Emit(_) => true,
        Op::MulWide | Op::MacWide | Op::Widen | Op::Narrow | Op::Low => false,
        Op::DivRound(_) | Op::Quot(_) | Op::Sqrt | Op::AddSat | Op::SubSat => false,
        Op::GetAt(_) | Op::SetAt(_) | Op::DelayAt(_) | Op::Wave(..) => false,
        Op::Fill(_) | Op::Probe(_) | Op::Loop(_) => false,
    };
    kernel.tick.all_insts().all(|inst| {
        has(inst.op) && inst.args.iter().all(is_word) && inst.results.iter().all(is_word)
    })
}

/// Machine code of a kernel's tick; none where it has no such form or registers do not suffice.
pub(super) fn sixteen(kernel: &Kernel, layout: &Layout) -> Option<Sixteen> {
    if !supports(kernel) {
        return None;
    }
    let (whole, constants, room) = function(kernel, layout, Groups::Whole, Constants::default())?;
    let (part, constants, more) = function(kernel, layout, Groups::Part, constants)?;
    Some(Sixteen {
        whole,
        part,
        constants: constants.finish(),
        room_words: ((room.max(more) + SLOT_BYTES) / 4) as usize,
    })
}

/// A function, the constants with its own, and how many bytes of room it needs.
fn function(
    kernel: &Kernel,
    layout: &Layout,
    groups: Groups,
    constants: Constants,
) -> Option<(Vec<u8>, Constants, i32)> {
    let mut writer = Writer::new(kernel, layout, groups, constants);
    let first = writer.open();
    writer.region(&kernel.tick);
    writer.close(first);
    let Registers {
        e,
        constants,
        room,
        has_failed,
        ..
    } = writer.r;
    (!has_failed).then_some((e.bytes, constants, room))
}

/// Writes one function.
struct Writer<'a> {
    kernel: &'a Kernel,
    layout: &'a Layout,
    r: Registers,
    /// Which node a value is: its own, or that of what it is assumed of.
    nodes: IdMap<Value, Node>,
    /// Where the room has the addresses of rows.
    rows: HashMap<(u32, u32), i32>,
    /// Where the room has the arguments of an event.
    events_at: i32,
    groups: Groups,
    /// Lanes that want what is being computed; none: all that the function runs.
    wanted: Option<Node>,
}

/// Where the room keeps the third argument.
const END: i32 = 0;

/// Bytes of an address.
const WORD_BYTES: i32 = 8;

impl<'a> Writer<'a> {
    fn new(
        kernel: &'a Kernel,
        layout: &'a Layout,
        groups: Groups,
        constants: Constants,
    ) -> Writer<'a> {
        let (nodes, facts) = facts(kernel);
        let slots = kernel.tick.line_slots();
        let slots = slots.into_iter().map(|(line, ticks)| {
            let len = kernel.lines[line as usize].len;
            (line, ticks % len)
        });
        let mut rows = HashMap::new();
        for slot in slots {
            let next = END + WORD_BYTES * (1 + rows.len() as i32);
            rows.entry(slot).or_insert(next);
        }
        let args_max = kernel.events.iter().map(|event| event.args as i32).max();
        let head = WORD_BYTES * (1 + rows.len() as i32);
        let events_at = (head + SLOT_BYTES - 1) / SLOT_BYTES * SLOT_BYTES;
        let room = events_at + SLOT_BYTES * args_max.unwrap_or(0);
        let masks: &[Mask] = match groups {
            Groups::Whole => &[EVEN],
            Groups::Part => &[EVEN, TAIL],
        };
        Writer {
            kernel,
            layout,
            r: Registers::new(facts, room, masks, constants),
            nodes,
            rows,
            events_at,
            groups,
            wanted: None,
        }
    }

    fn node(&self, value: Value) -> Node {
        self.nodes[value]
    }

    /// The lanes that are written.
    fn lanes(&mut self) -> Mask {
        match (self.wanted, self.groups) {
            (Some(node), _) => self.r.mask(node),
            (None, Groups::Part) => TAIL,
            (None, Groups::Whole) => ALL,
        }
    }

    /// The lanes that may be read; and that the others become 0, which is said of no lane where
    /// all are read.
    fn readable(&self) -> (Mask, bool) {
        match self.groups {
            Groups::Part => (TAIL, false),
            Groups::Whole => (ALL, true),
        }
    }

    /// Entry of the function; gives where the next group begins.
    fn open(&mut self) -> usize {
        let room = self.base(Buffer::Room);
        let e = &mut self.r.e;
        // push rbp; push rbx
        e.bytes.extend([0x55, 0x53]);
        e.wide(opcodes::LOAD, Gpr::Rbp as u8, room);
        e.wide(opcodes::ADD_NUMBER, 0, Operand::Gpr(Gpr::Rbp));
        e.number(SLOT_BYTES - 1);
        // and rbp, -64
        e.bytes.extend([0x48, 0x83, 0xE5, 0xC0]);
        self.bases();
        self.rows();
        self.r.e.bytes.len()
    }

    /// What stays the same in all groups.
    fn bases(&mut self) {
        let (columns, constants) = (self.base(Buffer::Columns), self.base(Buffer::Constants));
        let e = &mut self.r.e;
        e.wide(opcodes::STORE, Gpr::Rdx as u8, at(Gpr::Rbp, END));
        e.wide(opcodes::LOAD, Gpr::R8 as u8, columns);
        e.wide(opcodes::LOAD, Gpr::R9 as u8, constants);
        let own = Address::new(Gpr::R8, 0).indexed(Gpr::Rsi, 2);
        e.wide(opcodes::LEA, Gpr::R8 as u8, Operand::Memory(own));
        e.vector(forms::PXORD, ZERO, ZERO, Operand::Zmm(ZERO));
        e.narrow(opcodes::MOVE_NUMBER, 0, Operand::Gpr(Gpr::Rax));
        e.number(0x5555);
        let even = Operand::Gpr(Gpr::Rax);
        e.mask(MaskOp::FromGpr, EVEN.0, ALL, even);
        e.narrow(opcodes::MOVE_NUMBER, 0, Operand::Gpr(Gpr::Rax));
        e.number(i32::MIN);
        let half = Operand::Gpr(Gpr::Rax);
        e.masked(forms::PBROADCASTD_GPR, HALF.0, 0, half, (EVEN, false));
        if self.groups == Groups::Part {
            let mask = Operand::Gpr(Gpr::Rdx);
            e.mask(MaskOp::FromGpr, TAIL.0, ALL, mask);
        }
    }

    /// Addresses of this tick's rows, in the room.
    fn rows(&mut self) {
        let mut rows: Vec<((u32, u32), i32)> = self.rows.iter().map(|(k, v)| (*k, *v)).collect();
        rows.sort_unstable();
        for ((line, ticks), stored) in rows {
            let place = self.layout.lines[line as usize];
            let (width, buffer) = if place.narrow {
                (2, Buffer::Narrow)
            } else {
                (4, Buffer::Wide)
            };
            let (rings, buffer) = (self.base(Buffer::Rings), self.base(buffer));
            let e = &mut self.r.e;
            let [rax, rcx] = [Gpr::Rax as u8, Gpr::Rcx as u8];
            e.wide(opcodes::LOAD, rax, rings);
            e.narrow(opcodes::LOAD, rax, at(Gpr::Rax, 4 * place.ring as i32));
            e.wide(
                opcodes::LEA,
                rcx,
                at(Gpr::Rax, (place.len - ticks as usize) as i32),
            );
            e.wide(opcodes::ADD_NUMBER, 0, Operand::Gpr(Gpr::Rax));
            e.number(-(ticks as i32));
            e.wide(opcodes::CMOVS, rax, Operand::Gpr(Gpr::Rcx));
            e.wide(opcodes::IMUL_NUMBER, rax, Operand::Gpr(Gpr::Rax));
            e.number(width * self.layout.keys as i32);
            e.wide(opcodes::ADD, rax, buffer);
            e.wide(opcodes::ADD_NUMBER, 0, Operand::Gpr(Gpr::Rax));
            e.number(width * place.start as i32);
            e.wide(opcodes::STORE, rax, at(Gpr::Rbp, stored));
        }
    }

    /// Goes on with the next group, or returns.
    fn close(&mut self, first: usize) {
        let e = &mut self.r.e;
        if self.groups == Groups::Whole {
            let (rsi, r8) = (Operand::Gpr(Gpr::Rsi), Operand::Gpr(Gpr::R8));
            e.wide(opcodes::ADD_NUMBER, 0, rsi);
            e.number(WIDTH as i32);
            e.wide(opcodes::ADD_NUMBER, 0, r8);
            e.number(4 * WIDTH as i32);
            e.wide(opcodes::CMP, Gpr::Rsi as u8, at(Gpr::Rbp, END));
            let again = e.jump(opcodes::JL);
            e.land(again, first);
        }
        // vzeroupper; pop rbx; pop rbp; ret
        e.bytes.extend([0xC5, 0xF8, 0x77, 0x5B, 0x5D, 0xC3]);
    }

    /// Where the base of a buffer stands.
    fn base(&self, buffer: Buffer) -> Operand {
        at(Gpr::Rdi, WORD_BYTES * buffer as i32)
    }
}

/// What stands so many bytes behind a base.
fn at(base: Gpr, offset: i32) -> Operand {
    Operand::Memory(Address::new(base, offset))
}

/// Which node each value of a tick is, and what is known of the nodes.
fn facts(kernel: &Kernel) -> (IdMap<Value, Node>, Vec<Facts>) {
    let mut nodes: IdMap<Value, Node> = IdMap::filled(0, kernel.values.len());
    let mut facts: Vec<Facts> = Vec::new();
    for (node, info) in kernel.values.iter().enumerate() {
        nodes[&Value(node as u32)] = node;
        facts.push(Facts {
            bank: if info.ty == Type::I1 {
                Bank::Masks
            } else {
                Bank::Words
            },
            known: None,
            uses: Vec::new(),
        });
    }
    for inst in kernel.tick.all_insts() {
        match inst.op {
            Op::Const(number) => facts[nodes[inst.results[0]]].known = Some(number),
            Op::Assume(..) => nodes[inst.results[0]] = nodes[inst.args[0]],
            _ => {}
        }
    }
    uses(&kernel.tick, &nodes, &mut facts, &mut 0);
    (nodes, facts)
}

/// Notes where values are read, in the order in which [`Writer`] comes by: of an `if` the
/// condition, then for the second arm and for the first the condition again, the arm, and what it
/// yields and what takes it.
fn uses(region: &Region, nodes: &IdMap<Value, Node>, facts: &mut [Facts], position: &mut usize) {
    for inst in &region.insts {
        *position += 1;
        read(&inst.args, nodes, facts, *position);
        for arm in inst.regions.iter().rev() {
            *position += 1;
            read(&inst.args, nodes, facts, *position);
            uses(arm, nodes, facts, position);
            *position += 1;
            read(&arm.yields, nodes, facts, *position);
            read(&inst.results, nodes, facts, *position);
        }
    }
}

fn read(values: &[Value], nodes: &IdMap<Value, Node>, facts: &mut [Facts], position: usize) {
    for value in values {
        facts[nodes[value]].uses.push(position);
    }
}

#[cfg(test)]
mod tests;
