//! A Cortex-M4 with FPU (STM32F4 class) and memory without wait states.
//!
//! Source: Arm DDI 0439, the table of section 3.3.1 and the pairing rules of 3.3.2 and 3.3.3;
//! floating point 7.2.3. P, the refill of a branch, is 1 to 3 there; here 1 where the target is in
//! the instruction, 2 where it is in a register, 3 where it comes from memory, and one more for a
//! 32-bit instruction across two words. `cortexm-AES` are totals of whole functions that jnk0le
//! measured on an STM32F407 without wait states and published (commit b18b7a4); what a round takes,
//! the difference of two totals, confirms the numbers marked exact. `jnk0le` is that author's
//! `pipeline cycle test/doc/cortex_m3m4.md` (commit 3dfc2ab). What these and others show without a
//! rule is counted by bounds alone ([`Core::at_worst`]).

use crate::arch::Arch;
use crate::class::Class::*;
use crate::table::Op;
use crate::timing::Evidence::{Estimate, Exact, Rule};
use crate::timing::{
    Branches, Core, Division, Exceptions, Fact, Kind::*, Line, Rules, Takers, Worst,
};

/// No result of the instruction before reaches the address of a load or store in time.
const ADDRESS: Takers = Takers::ADDRESS;

const LINES: &[Line] = &[
    Line::new(&[Alu, Move], WritesPc, 1)
        .worst(1)
        .from(Rule, "3.3.1: 1 + P, P up to 3"),
    Line::new(&[Alu, Move, Shift, Extend], Any, 1)
        .late(ADDRESS)
        .from(Exact, "3.3.1, 3.3.3; cortexm-AES"),
    Line::new(&[Bitfield, ExtendAdd, Bits], Any, 1)
        .late(ADDRESS)
        .from(Rule, "3.3.1, 3.3.3"),
    Line::new(&[Saturate, Dsp, Select], Any, 1)
        .late(ADDRESS)
        .from(Rule, "3.3.1, 3.3.3"),
    Line::new(
        &[Multiply, MultiplyAdd, MultiplyLong, MultiplyAddLong],
        Any,
        1,
    )
    .late(ADDRESS)
    .from(Rule, "3.3.1, 3.3.3"),
    Line::new(&[Divide], Any, 2)
        .late(ADDRESS)
        .from(Rule, "3.3.1: 2 to 12"),
    Line::new(&[Load], WritesPc, 2).from(Rule, "3.3.3: blocks, 5 in all"),
    Line::new(&[Load], Any, 2)
        .late(ADDRESS)
        .late_base()
        .overlaps()
        .overlapped()
        .from(Exact, "3.3.1, 3.3.3; cortexm-AES"),
    Line::new(&[LoadDual], Any, 3)
        .late(ADDRESS)
        .from(Rule, "3.3.1: 1 + N"),
    Line::new(&[LoadMultiple], Any, 1)
        .each(1)
        .late(ADDRESS)
        .from(Exact, "3.3.1: 1 + N, PC also P; cortexm-AES"),
    Line::new(&[LoadOrdered], Any, 2)
        .late(ADDRESS)
        .overlaps()
        .overlapped()
        .from(Rule, "3.3.1, 3.3.3"),
    Line::new(&[Store], RegisterOffset, 2)
        .overlaps()
        .from(Rule, "3.3.1, 3.3.3"),
    Line::new(&[Store], Any, 1).late(ADDRESS).from(
        Rule,
        "3.3.3: STR with immediate is always one cycle; a base written back: jnk0le",
    ),
    Line::new(&[StoreDual], Any, 3).from(Rule, "3.3.1: 1 + N"),
    Line::new(&[StoreMultiple], Any, 1)
        .each(1)
        .from(Rule, "3.3.1: 1 + N"),
    Line::new(&[StoreOrdered], Any, 2)
        .late(ADDRESS)
        .overlaps()
        .overlapped()
        .from(Rule, "3.3.1, 3.3.3"),
    Line::new(&[Preload], Any, 1).from(Estimate, "as NOP.W"),
    Line::new(&[Branch, CompareBranch], Any, 0).from(Rule, "3.3.1: 1 + P, all refill"),
    Line::new(&[BranchLink], Op(Op::BLX), 1)
        .worst(1)
        .from(Rule, "3.3.1: 1 + P, P up to 3"),
    Line::new(&[BranchLink], Any, 0).from(Rule, "3.3.1: 1 + P, all refill"),
    Line::new(&[BranchRegister], Any, 1)
        .worst(1)
        .from(Rule, "3.3.1: 1 + P, P up to 3"),
    Line::new(&[TableBranch], Any, 2).from(Rule, "3.3.1: 2 + P"),
    Line::new(&[It, Nop], Any, 1).from(Rule, "3.3.1"),
    Line::new(&[Wait], Any, 1).from(Rule, "3.3.1, without the waiting"),
    Line::new(&[Special], Any, 2).from(Rule, "3.3.1: 1 or 2"),
    Line::new(&[Barrier], Any, 3).from(Estimate, "3.3.1: 1 + B; B as P"),
    Line::new(&[Exception], Any, 1).from(Estimate, "without what follows"),
    Line::new(&[Coprocessor], Any, 1).from(Estimate, "there is none"),
    Line::new(&[FloatAlu, FloatConvert], Any, 1)
        .float(1, 1)
        .from(Rule, "7.2.3"),
    Line::new(&[FloatCompare], Any, 1)
        .float(1, 0)
        .from(Rule, "7.2.3"),
    Line::new(&[FloatMultiplyAdd], Any, 3)
        .float(3, 1)
        .from(Rule, "7.2.3"),
    Line::new(&[FloatDivide], Any, 1)
        .float(14, 1)
        .from(Rule, "7.2.3"),
    Line::new(&[FloatMove], Any, 1)
        .float(1, 0)
        .from(Rule, "7.2.3"),
    Line::new(&[FloatTransfer], Op(Op::VMRS), 1)
        .float(1, 0)
        .from(Rule, "7.2.3"),
    Line::new(&[FloatTransfer], Op(Op::VMRS_APSR), 1)
        .float(1, 0)
        .from(Rule, "7.2.3"),
    Line::new(&[FloatTransfer], Op(Op::VMSR), 1)
        .float(1, 0)
        .from(Rule, "7.2.3"),
    Line::new(&[FloatTransfer], Any, 2)
        .float(2, 0)
        .from(Rule, "7.2.3: one or two registers of either file"),
    Line::new(&[FloatLoad, FloatStore], Double, 3)
        .float(3, 0)
        .from(Rule, "7.2.3"),
    Line::new(&[FloatLoad, FloatStore], Any, 2)
        .float(2, 0)
        .from(Rule, "7.2.3"),
    Line::new(&[FloatLoadMultiple, FloatStoreMultiple], Any, 1)
        .each(1)
        .from(Rule, "7.2.3: 1 + N"),
];

impl Core {
    /// A Cortex-M4 with FPU and memory without wait states.
    pub const fn cortex_m4() -> Self {
        Self {
            name: "cortex-m4",
            arch: Arch::V7EM,
            lines: LINES,
            branches: Branches {
                taken: Fact::new(2, Exact, "3.3.1: 1 + P, P = 1; cortexm-AES"),
                not_taken: Fact::new(1, Rule, "3.3.1"),
                from_load: Fact::new(1, Rule, "3.3.3: three cycles for the reload"),
                split_target: Fact::new(
                    1,
                    Rule,
                    "3.3.1: P depends on alignment and width of the target",
                ),
                folded: Fact::new(0, Rule, "3.3.1: only IT folds"),
                folded_it: Fact::new(1, Rule, "3.3.1: IT folds into a 16-bit instruction"),
            },
            skipped: Fact::new(1, Rule, "3.3.1"),
            late: Fact::new(1, Rule, "3.3.3"),
            divide: Division {
                start: Fact::new(3, Estimate, "3.3.1: 2 to 12, by the operands"),
                bits_per_cycle: Fact::new(4, Estimate, "3.3.1: 2 to 12, by the operands"),
            },
            overlap: Fact::new(1, Exact, "3.3.3; cortexm-AES"),
            worst: Worst {
                misaligned: Fact::new(1, Estimate, "jnk0le; ePrint 2025/523; Arm KA006138"),
                load_after_store: Fact::new(1, Estimate, "jnk0le: an extra cycle to the store"),
                dependent_load: Fact::new(1, Estimate, "jnk0le: addresses a cycle earlier"),
                divide: Fact::new(10, Rule, "3.3.1: 2 to 12, by operands"),
            },
            near: Fact::new(0, Rule, "no such port"),
            exceptions: Exceptions {
                entry: Fact::new(12, Rule, "3.9.1: interrupt latency"),
                tail_chain: Fact::new(6, Rule, "3.9.1"),
                exit: Fact::new(10, Estimate, "3.9.1"),
            },
            rules: Rules {
                shifted_register_flags: 2,
                at_worst: false,
            },
        }
    }
}
