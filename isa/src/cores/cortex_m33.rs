//! The Cortex-M33 (r1p0) of RP2350: DSP extension, single-precision FPU.
//!
//! `3.7.4.9.x` are the sections of the RP2350 datasheet (edition of 29 July 2025), measured by its
//! makers with one core running, no cache misses and no DMA. `jnk0le` are that author's
//! measurements with DWT.CYCCNT on the same silicon (`jnk0le/random`, commit 3dfc2ab);
//! `cortexm-AES` are totals of whole functions that the same author published (commit b18b7a4). The
//! datasheet wins.

use crate::arch::Arch;
use crate::class::Class::*;
use crate::table::Op;
use crate::timing::Evidence::{Estimate, Exact, Rule};
use crate::timing::{
    Branches, Core, Division, Exceptions, Fact, Kind::*, Line, Rules, Takers, Worst,
};

/// Results of the second execute stage: there in time for what enters at that stage.
const SECOND_STAGE: Takers = Takers::OPERAND.and(Takers::ADDRESS);
/// Loads, too late for the shifter of an extend-and-add, in time for an accumulator.
const LOADED: Takers = Takers::ALL.without(Takers::ACCUMULATOR);

const LINES: &[Line] = &[
    // Arithmetic, logic, moves.
    Line::new(&[Alu, Move], WritesPc, 0)
        .from(Rule, "3.7.4.9.7: the time of a branch is its refill"),
    Line::new(&[Alu, Move], ShiftedRegisterFlags, 2).from(
        Rule,
        "3.7.4.9.2: the penalty is always incurred; jnk0le: 1, see Rules",
    ),
    Line::new(&[Alu, Move], ShiftedRegister, 1)
        .late(SECOND_STAGE)
        .from(Exact, "3.7.4.9.2, 3.7.4.9.3"),
    Line::new(&[Move], Op(Op::MOV_immediate), 1).from(Exact, "3.7.4.9.2; cortexm-AES"),
    Line::new(&[Alu, Move], ShiftedConstantFlags, 2).from(Exact, "3.7.4.9.2; cortexm-AES"),
    Line::new(&[Alu, Move], ShiftedConstant, 1)
        .late(SECOND_STAGE)
        .from(Rule, "3.7.4.9.2"),
    Line::new(&[Alu, Move, Shift, Bitfield, Extend], Any, 1).from(Exact, "3.7.4.9.2; cortexm-AES"),
    Line::new(&[Bits], Any, 1).from(Rule, "3.7.4.9.2"),
    Line::new(&[ExtendAdd], Any, 1)
        .late(SECOND_STAGE)
        .from(Rule, "jnk0le"),
    Line::new(&[Select], Any, 1)
        .late(Takers::ALL)
        .from(Rule, "3.7.4.9.2"),
    Line::new(&[Dsp, Saturate], Any, 1)
        .late(Takers::ALL)
        .from(Rule, "jnk0le"),
    // Multiplication and division.
    Line::new(&[Multiply], Flags, 2).from(Rule, "jnk0le; Arm KA001260"),
    Line::new(&[Multiply, MultiplyLong], Any, 1)
        .late(SECOND_STAGE)
        .from(Rule, "3.7.4.9.3"),
    Line::new(&[MultiplyAdd], Op(Op::MLA), 1)
        .late(SECOND_STAGE)
        .from(Exact, "3.7.4.9.3"),
    Line::new(&[MultiplyAddLong], Op(Op::UMLAL), 1)
        .late(SECOND_STAGE)
        .from(Exact, "3.7.4.9.3"),
    Line::new(&[MultiplyAdd, MultiplyAddLong], Any, 1)
        .late(SECOND_STAGE)
        .from(Rule, "3.7.4.9.3"),
    Line::new(&[Divide], Any, 2)
        .late(Takers::ALL)
        .from(Rule, "3.7.4.9.4"),
    // Memory.
    Line::new(&[Load], Any, 1)
        .late(LOADED)
        .from(Exact, "3.7.4.9.5; into an accumulator: jnk0le"),
    Line::new(&[LoadDual], Any, 2)
        .late(LOADED)
        .from(Rule, "3.7.4.9.5; jnk0le"),
    Line::new(&[LoadMultiple], Any, 0)
        .each(1)
        .late(LOADED)
        .from(Exact, "3.7.4.9.5"),
    Line::new(&[LoadOrdered], Any, 1)
        .late(Takers::ALL)
        .from(Estimate, "as LDR"),
    Line::new(&[Store], Any, 1).from(Exact, "3.7.4.9.6; cortexm-AES"),
    Line::new(&[StoreDual], Any, 2).from(Rule, "3.7.4.9.6; jnk0le"),
    Line::new(&[StoreMultiple], Any, 0)
        .each(1)
        .from(Exact, "3.7.4.9.6"),
    Line::new(&[StoreOrdered], Any, 1)
        .late(Takers::ALL)
        .from(Estimate, "as STR"),
    Line::new(&[Preload], Any, 1).from(Estimate, "as NOP.W"),
    // Branches: their time is all refill.
    Line::new(&[Branch, BranchLink, BranchRegister, CompareBranch], Any, 0)
        .from(Exact, "3.7.4.9.7"),
    Line::new(&[TableBranch], Any, 1).from(Estimate, "as LDR R15 of 3.7.4.9.7"),
    Line::new(&[It], Any, 1).from(Exact, "3.7.4.9.9"),
    Line::new(&[Nop], Any, 1).from(Exact, "3.7.4.9.9"),
    // System.
    Line::new(&[Wait, Special], Any, 1).from(Estimate, "no source"),
    Line::new(&[Barrier], Any, 3).from(Estimate, "a refill"),
    Line::new(&[Exception, Security], Any, 1).from(Estimate, "without what follows"),
    Line::new(&[Coprocessor], Op(Op::MRC), 1)
        .late(Takers::ALL)
        .from(Rule, "3.7.4.9.11"),
    Line::new(&[Coprocessor], Op(Op::MRC2), 1)
        .late(Takers::ALL)
        .from(Rule, "3.7.4.9.11"),
    Line::new(&[Coprocessor], Op(Op::MRRC), 1)
        .late(Takers::ALL)
        .from(Rule, "3.7.4.9.11"),
    Line::new(&[Coprocessor], Op(Op::MRRC2), 1)
        .late(Takers::ALL)
        .from(Rule, "3.7.4.9.11"),
    Line::new(&[Coprocessor], Any, 1).from(Rule, "3.7.4.9.11"),
    // Floating point.
    Line::new(&[FloatAlu, FloatConvert], Any, 1)
        .float(1, 1)
        .from(Rule, "3.7.4.9.10"),
    Line::new(&[FloatCompare], Any, 1)
        .float(1, 1)
        .from(Estimate, "as VSUB of 3.7.4.9.10"),
    Line::new(&[FloatMultiplyAdd], Any, 1)
        .float(3, 1)
        .from(Rule, "3.7.4.9.10"),
    Line::new(&[FloatDivide], Any, 1)
        .float(14, 1)
        .from(Rule, "3.7.4.9.10"),
    Line::new(&[FloatMove], Any, 1)
        .float(1, 0)
        .from(Rule, "3.7.4.9.10"),
    Line::new(&[FloatTransfer], Op(Op::VMOV_core_to_double), 1)
        .float(2, 0)
        .from(Rule, "3.7.4.9.10"),
    Line::new(&[FloatTransfer], Op(Op::VMOV_core_to_singles), 1)
        .float(2, 0)
        .from(Estimate, "as VMOV.F64 Dx,Ry,Rz"),
    Line::new(&[FloatTransfer], Op(Op::VMOV_double_to_core), 2)
        .float(2, 0)
        .from(Rule, "3.7.4.9.10"),
    Line::new(&[FloatTransfer], Op(Op::VMOV_singles_to_core), 2)
        .float(2, 0)
        .from(Estimate, "as VMOV.F64 Rx,Ry,Dz"),
    Line::new(&[FloatTransfer], Any, 1)
        .late(Takers::ALL)
        .float(1, 0)
        .from(Rule, "3.7.4.9.10"),
    Line::new(&[FloatLoad], Double, 2)
        .float(2, 0)
        .from(Rule, "jnk0le"),
    Line::new(&[FloatLoad], Any, 1)
        .float(1, 0)
        .from(Rule, "jnk0le"),
    Line::new(&[FloatStore], Double, 2)
        .float(2, 0)
        .from(Rule, "jnk0le"),
    Line::new(&[FloatStore], Any, 1)
        .float(1, 0)
        .from(Rule, "jnk0le"),
    Line::new(&[FloatLoadMultiple, FloatStoreMultiple], Any, 0)
        .each(1)
        .from(Rule, "jnk0le"),
];

impl Core {
    /// The Cortex-M33 of RP2350, with the default [`Rules`].
    pub const fn cortex_m33() -> Self {
        Self {
            name: "cortex-m33",
            arch: Arch::V8M,
            lines: LINES,
            branches: Branches {
                taken: Fact::new(2, Exact, "3.7.4.9.7"),
                not_taken: Fact::new(1, Exact, "3.7.4.9.7"),
                from_load: Fact::new(1, Rule, "L of 3.7.4.9.7"),
                split_target: Fact::new(1, Rule, "U of 3.7.4.9.7"),
                folded: Fact::new(1, Exact, "F of 3.7.4.9.7, 3.7.4.9.9"),
                folded_it: Fact::new(
                    1,
                    Exact,
                    "jnk0le, cortexm-AES; 3.7.4.9.9 names forwards only",
                ),
            },
            skipped: Fact::new(1, Exact, "3.7.4.9.8; cortexm-AES"),
            late: Fact::new(1, Exact, "3.7.4.9.1"),
            divide: Division {
                start: Fact::new(2, Rule, "3.7.4.9.4"),
                bits_per_cycle: Fact::new(4, Rule, "3.7.4.9.4"),
            },
            overlap: Fact::new(0, Rule, "3.7.4.9.5: accesses take one cycle"),
            worst: Worst::nothing("3.7.4.9: measured, and the prefetcher keeps up (.12)"),
            near: Fact::new(0, Rule, "3.7.4.9.5: accesses take one cycle"),
            exceptions: Exceptions {
                entry: Fact::new(12, Estimate, "as Cortex-M4"),
                tail_chain: Fact::new(6, Estimate, "as Cortex-M4"),
                exit: Fact::new(12, Estimate, "as Cortex-M4"),
            },
            rules: Rules {
                shifted_register_flags: 2,
                at_worst: false,
            },
        }
    }
}
