//! What is said of an instruction at memory and of its stack, against an emulated core that
//! executes it: every encoding of the classes that access memory, and what moves the stack pointer
//! or copies pointers, with random operands.

use std::collections::BTreeMap;

use whippen_emulator::{
    Access, Board, Bus, BusError, CoreKind, Device, DeviceId, Machine, Region, Register, Waits,
};
use whippen_isa::{Arch, Class, Encoding, Inst, ItState, Op, RegSet, ShiftType, decode, reg};

use crate::access::addresses;
use crate::facts::Facts;
use crate::place::{Place, Tag};

/// Where instructions stand, and the memory that they access.
const CODE: u32 = 0x2000_0000;
const DATA: u32 = 0x3000_0000;
/// Bytes of it.
const SIZE: u32 = 0x200_0000;
/// Where the stack pointer is when the function is entered, and by how much it is lower now.
const TOP: u32 = DATA + 0x8000;
const BELOW: i32 = 64;
/// The sections that registers and slots point into: `SECTION_SIZE` bytes each, from `SECTIONS` on.
const SECTIONS: u32 = DATA + 0x100_0000;
const SECTION_SIZE: u32 = 0x2000;
/// What stands for the return address of a call.
const RETURNS: u32 = 0x1234_0000;

/// Words that remember who came.
#[derive(Default)]
struct Log {
    bytes: BTreeMap<u32, u8>,
    accesses: Vec<(u32, u32, bool)>,
}

impl Log {
    fn word(&self, at: u32) -> u32 {
        let byte = |nth| self.bytes.get(&(at + nth)).copied().unwrap_or(0);
        u32::from_le_bytes([0, 1, 2, 3].map(byte))
    }

    /// Whether less than words were accessed.
    fn is_small(&self) -> bool {
        self.accesses.iter().any(|(_, size, _)| *size < 4)
    }

    /// Whether a word was accessed by its bytes, as its address was no multiple of its size.
    fn is_split(&self) -> bool {
        self.accesses.len() > 1 && self.accesses.iter().all(|(_, size, _)| *size == 1)
    }

    fn set(&mut self, at: u32, word: u32) {
        self.bytes.extend((at..).zip(word.to_le_bytes()));
    }
}

impl Device for Log {
    fn read(&mut self, access: Access, _: &mut Bus) -> Result<u32, BusError> {
        let at = DATA + access.offset;
        self.accesses.push((at, access.size, false));
        let mask = u64::MAX >> (64 - 8 * access.size);
        Ok(self.word(at) & mask as u32)
    }

    fn write(&mut self, access: Access, value: u32, _: &mut Bus) -> Result<(), BusError> {
        let at = DATA + access.offset;
        self.accesses.push((at, access.size, true));
        let bytes = value.to_le_bytes().into_iter().take(access.size as usize);
        self.bytes.extend((at..).zip(bytes));
        Ok(())
    }
}

pub(crate) struct Random(pub u64);

impl Random {
    pub fn below(&mut self, end: u32) -> u32 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005);
        self.0 = self.0.wrapping_add(1_442_695_040_888_963_407);
        ((self.0 >> 33) as u32) % end
    }
}

/// What stands for a tag in a register or a slot.
fn word_of(tag: Tag) -> u32 {
    match tag {
        // An address of Thumb code is odd.
        Tag::Return(context, _) => RETURNS + 0x1_0000 * context + 1,
        Tag::Section(base) => base + SECTION_SIZE / 2,
    }
}

/// Whether a word is one that a tag may stand for.
fn is_of(word: u32, tag: Tag) -> bool {
    match tag {
        Tag::Return(..) => word == word_of(tag),
        Tag::Section(base) => word.wrapping_sub(base) < SECTION_SIZE,
    }
}

/// The tag of a word that is surely no accident.
fn tag_of(word: u32) -> Option<Tag> {
    let sections = (0..16).map(|nth| Tag::Section(SECTIONS + nth * SECTION_SIZE));
    let returns = (0..16).map(|nth| Tag::Return(nth, 0));
    sections.chain(returns).find(|tag| is_of(word, *tag))
}

/// A core in front of an instruction, and what is known of it.
struct Before {
    machine: Machine,
    log: DeviceId,
    place: Place,
}

impl Before {
    /// Some registers hold return addresses or point into sections, others small numbers; of the
    /// words of the stack every other one has a tag.
    fn new(inst: &Inst, bits: [u16; 2], random: &mut Random) -> Self {
        let mut board = Board::generic(CoreKind::CortexM33);
        // Small numbers are no addresses.
        board.regions = vec![Region::ram("code", CODE, 0x1000)];
        board.vector_table = CODE;
        let mut machine = Machine::new(board).expect("a board");
        let bytes: Vec<u8> = bits.iter().flat_map(|half| half.to_le_bytes()).collect();
        machine.bus.memory.write(CODE, &bytes).expect("memory");
        let (mut log, mut place) = (Log::default(), Place::default());
        machine.prepare_call(CODE, [0; 4]);
        place.sp = -BELOW;
        let mut next = 0;
        let mut tag = |random: &mut Random| {
            next += 1;
            match random.below(3) {
                0 => Tag::Return(next % 16, 0),
                _ => Tag::Section(SECTIONS + next % 16 * SECTION_SIZE),
            }
        };
        for register in (0..15).filter(|r| *r != reg::SP) {
            let small = register == inst.m || random.below(4) == 0;
            let tag = Some(tag(random)).filter(|_| !small);
            place.registers[usize::from(register)] = tag;
            let word = tag.map_or_else(|| 4 + 4 * random.below(3), word_of);
            machine.cpu_mut(0).set(Register::core(register), word);
        }
        for slot in (-2 * BELOW..0).step_by(4) {
            let tag = Some(tag(random)).filter(|_| slot >= -BELOW && random.below(2) == 0);
            place.slots.extend(tag.map(|tag| (slot, tag)));
            let word = tag.map_or_else(|| random.below(1 << 16), word_of);
            log.set(TOP.wrapping_add_signed(slot), word);
        }
        machine.cpu_mut(0).set(Register::SP, TOP - BELOW as u32);
        let log = machine
            .bus
            .attach(DATA, SIZE, Waits::default(), Box::new(log));
        Self {
            machine,
            log,
            place,
        }
    }

    fn register(&self, register: u8) -> u32 {
        self.machine.cpu(0).get(Register::core(register))
    }

    fn log(&self) -> &Log {
        self.machine.bus.device(self.log).expect("it is attached")
    }
}

fn is_of_interest(inst: &Inst) -> bool {
    use Class::*;
    let moves = matches!(
        inst.op(),
        Op::MOV_register
            | Op::ADD_register
            | Op::ADD_immediate
            | Op::SUB_immediate
            | Op::ADD_SP_plus_immediate
            | Op::SUB_SP_minus_immediate
            | Op::ADD_SP_plus_register
            | Op::SUB_SP_minus_register
            | Op::VMOV_single_to_core
            | Op::VMOV_core_to_single
    );
    moves
        || matches!(
            inst.class(),
            Load | LoadDual
                | LoadMultiple
                | Store
                | StoreDual
                | StoreMultiple
                | FloatLoad
                | FloatLoadMultiple
                | FloatStore
                | FloatStoreMultiple
                | TableBranch
        ) && inst.n != reg::PC
            && !inst.op().identifier().ends_with("_literal")
        || matches!(inst.op(), Op::LDA | Op::LDAH | Op::STL | Op::STLB)
}

/// Instructions with their bits: of each encoding so many with random operands, half of those that
/// may have it by the stack pointer.
fn instructions(each: usize, random: &mut Random) -> Vec<(Inst, [u16; 2])> {
    let mut all = Vec::new();
    for encoding in Encoding::all() {
        let (mask, fixed) = encoding.fixed_bits();
        for _ in 0..each {
            let word = fixed | !mask & (random.below(1 << 16) << 16 | random.below(1 << 16));
            let bits = match encoding.size() {
                4 => [(word >> 16) as u16, word as u16],
                _ => [word as u16, 0xbf00],
            };
            let Ok(inst) = decode(bits[0], bits[1], Arch::V8M, ItState::OUTSIDE) else {
                continue;
            };
            // A constant that leaves any section is assumed to be none.
            let leaves = inst.op() != Op::MOV_register && inst.imm >= SECTION_SIZE / 2;
            let leaves = leaves && inst.class() == Class::Alu && inst.n != reg::SP;
            if inst.encoding == encoding && is_of_interest(&inst) && !leaves {
                all.push((inst, bits));
                all.extend(by_sp(inst));
            }
        }
    }
    all
}

/// The same by the stack pointer, with an offset of a few words; of a sum one with a small index.
fn by_sp(inst: Inst) -> Option<(Inst, [u16; 2])> {
    let is_sum = inst.op() == Op::ADD_register && inst.size() == 4;
    let own = Inst {
        n: if is_sum { inst.n } else { reg::SP },
        shift: if is_sum { ShiftType::LSL } else { inst.shift },
        amount: if is_sum { 2 } else { inst.amount },
        imm: match inst.class() {
            Class::LoadMultiple | Class::StoreMultiple => inst.imm,
            _ => inst.imm & 0x1c,
        },
        ..inst
    };
    let (first, second) = own.encode(Arch::V8M).ok()?.halfwords();
    Some((own, [first, second.unwrap_or(0xbf00)]))
}

#[test]
fn an_emulated_core_does_what_is_said_of_memory_and_stack() {
    let mut random = Random(7);
    let (mut executed, mut accessed, mut refused, mut handed) = (0, 0, 0, 0);
    for (inst, bits) in instructions(12, &mut random) {
        let mut before = Before::new(&inst, bits, &mut random);
        let registers: Vec<u32> = (0..15).map(|register| before.register(register)).collect();
        let mut after = before.place.clone();
        let said = after.execute(&inst, || None);
        let stopped = before.machine.step(0).is_some();
        if stopped || before.machine.cpu(0).exception() != 0 {
            continue;
        }
        executed += 1;
        handed += check_hands(&inst, &before);
        accessed += check_accesses(&inst, &before, &registers);
        match said {
            Ok(()) => check_place(&inst, &before, &after),
            Err(why) => refused += check_refusal(&inst, &before, why),
        }
    }
    println!("{executed} executed, {accessed} accesses, {refused} refused, {handed} hand SP out");
    assert!(executed > 1000 && accessed > 1000 && refused > 20 && handed > 20);
}

/// That an address of the stack is nowhere but in SP, unless it is said to be handed out; a sum
/// with another register's is said to be one whatever that holds.
fn check_hands(inst: &Inst, before: &Before) -> usize {
    let near = |word: u32| word.abs_diff(TOP) < 0x2000;
    let others = (0..15).filter(|register| *register != reg::SP);
    let held = others.filter(|register| near(before.register(*register)));
    let log = before.log();
    let stores = log.accesses.iter().filter(|(_, _, writes)| *writes);
    let count = held.count() + stores.filter(|(at, ..)| near(log.word(at & !3))).count();
    let name = inst.op().identifier();
    let is_sum = name.starts_with("ADD") || name.starts_with("SUB");
    let loads_sp = inst.defs().contains(RegSet::core(reg::SP)) && !inst.wback;
    match inst.hands_stack() {
        true if is_sum || loads_sp || log.is_small() => {}
        true => assert!(count > 0, "`{inst}` hands nothing out"),
        false => assert!(count == 0, "`{inst}` hands an address of the stack out"),
    }
    count
}

/// That as many words are accessed, in the direction and from the address on that are said.
fn check_accesses(inst: &Inst, before: &Before, registers: &[u32]) -> usize {
    let accesses = &before.log().accesses;
    let count = usize::from(inst.words());
    if before.log().is_split() {
        return 0;
    }
    assert_eq!(accesses.len(), count, "`{inst}`: {accesses:x?}");
    let Some(&(first, _, writes)) = accesses.first() else {
        return 0;
    };
    assert_eq!(writes, inst.class().is_store(), "`{inst}`");
    let known = |around: [i64; 2]| {
        let mut facts = Facts::default();
        for (register, word) in (0..).zip(registers) {
            facts.set(register, around.map(|more| i64::from(*word as i32) + more));
        }
        addresses(inst, CODE, &facts)
    };
    let first = i64::from(first as i32);
    for around in [[0, 0], [-3, 8]] {
        let wanted = (!inst.is_by_register()).then_some(around.map(|more| first + more));
        assert_eq!(known(around), wanted, "`{inst}`");
    }
    count
}

/// That every tag is true, and that none is forgotten that the instruction leaves or moves.
fn check_place(inst: &Inst, before: &Before, after: &Place) {
    let told = |at: i32| after.slots.iter().find(|(slot, _)| *slot == at);
    let sp = before.register(reg::SP);
    assert_eq!(sp, TOP.wrapping_add_signed(after.sp), "`{inst}`");
    let defs = inst.defs();
    for register in (0..15).filter(|r| *r != reg::SP) {
        let (word, tag) = (before.register(register), after.tag(register));
        if let Some(tag) = tag {
            assert!(is_of(word, tag), "`{inst}`: r{register} {word:x} {tag:x?}");
        }
        let written = defs.contains(RegSet::core(register));
        let keeps = !written || keeps_tag(inst, register);
        let wanted = tag_of(word).filter(|_| keeps);
        assert!(wanted.is_none() || tag == wanted, "`{inst}`: r{register}");
    }
    let clears = before.log().is_small()
        || inst.class() == Class::StoreDual && inst.t == inst.t2
        || inst.class().is_store()
            && inst.n == reg::SP
            && (inst.class().is_floating_point()
                || inst.class() == Class::StoreOrdered
                || inst.is_by_register());
    for slot in -2 * BELOW..0 {
        let word = before.log().word(TOP.wrapping_add_signed(slot));
        let tag = told(slot).map(|(_, tag)| *tag);
        if let Some(tag) = tag {
            assert!(is_of(word, tag), "`{inst}`: slot {slot} {word:x} {tag:x?}");
        }
        let wanted = tag_of(word).filter(|_| slot % 4 == 0 && slot >= after.sp && !clears);
        assert!(wanted.is_none() || tag == wanted, "`{inst}`: slot {slot}");
    }
    assert!(after.slots.iter().all(|(slot, _)| *slot >= after.sp));
    assert!(after.slots.is_sorted());
}

/// Whether what an instruction leaves in a register may be a tag that it moved there.
fn keeps_tag(inst: &Inst, register: u8) -> bool {
    let loads = inst.n == reg::SP && !inst.is_by_register();
    match inst.class() {
        // A shifted index further.
        _ if inst.op() == Op::ADD_register => inst.shift == ShiftType::LSL && inst.amount > 0,
        // The base, some constant further.
        class if inst.n == register => !class.is_floating_point(),
        Class::Load => loads && inst.op() == Op::LDR_immediate,
        Class::LoadMultiple => loads && inst.op() != Op::LDMDB,
        Class::LoadDual => loads,
        Class::Move => inst.op() == Op::MOV_register && inst.amount == 0,
        _ => false,
    }
}

/// That what is refused moves the stack pointer in a way that functions do not, or writes into the
/// stack of the caller.
fn check_refusal(inst: &Inst, before: &Before, why: &str) -> usize {
    let above = |(at, size, writes): &(u32, u32, bool)| *writes && at + size > TOP;
    match why {
        "stores into its caller's stack" => {
            let accesses = &before.log().accesses;
            assert!(accesses.iter().any(above), "`{inst}`: {accesses:x?}");
        }
        "stores below its stack" => {
            let accesses = &before.log().accesses;
            let sp = before.register(reg::SP);
            let below = |(at, _, writes): &(u32, u32, bool)| *writes && *at < sp;
            assert!(accesses.iter().any(below), "`{inst}`: {accesses:x?}");
        }
        _ => {
            let moved = before.register(reg::SP) != TOP - BELOW as u32;
            let odd = inst.is_by_register();
            assert!(moved || odd, "`{inst}`: {why}");
        }
    }
    1
}
