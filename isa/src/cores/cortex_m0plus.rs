//! The Cortex-M0+ of RP2040: single-cycle multiplier, one bus port for fetch and data, single-cycle
//! IO port.
//!
//! The numbers are those of Arm DDI 0484, table 3-1, which the RP2040 datasheet repeats as
//! "Instruction set summary". Nothing is late on this core: an instruction is over when its cycles
//! are.

use crate::arch::Arch;
use crate::class::Class::*;
use crate::table::Op;
use crate::timing::Evidence::{Estimate, Rule};
use crate::timing::{Branches, Core, Division, Exceptions, Fact, Kind::*, Line, Rules, Worst};

const LINES: &[Line] = &[
    Line::new(&[Alu, Move], WritesPc, 0).from(Rule, "table 3-1: MOV PC, ADD PC 2, all refill"),
    Line::new(&[Alu, Move, Shift, Extend, Bits], Any, 1).from(Rule, "table 3-1"),
    Line::new(&[Multiply], Any, 1).from(Rule, "table 3-1, fast multiplier"),
    Line::new(&[Load, Store], Any, 2).from(Rule, "table 3-1; 1 on the IO port"),
    Line::new(&[LoadMultiple, StoreMultiple], Any, 1)
        .each(1)
        .from(Rule, "table 3-1: 1 + N"),
    Line::new(&[Branch, BranchRegister], Any, 0).from(Rule, "table 3-1: B, BX 2, all refill"),
    Line::new(&[BranchLink], Op(Op::BLX), 0).from(Rule, "table 3-1: BLX 2, all refill"),
    Line::new(&[BranchLink], Any, 1).from(Rule, "table 3-1: BL 3"),
    Line::new(&[Wait], Op(Op::WFE), 2).from(Rule, "table 3-1, without the waiting"),
    Line::new(&[Wait], Op(Op::WFI), 2).from(Rule, "table 3-1, without the waiting"),
    Line::new(&[Wait, Nop], Any, 1).from(Rule, "table 3-1"),
    Line::new(&[Special], Op(Op::CPS), 1).from(Rule, "table 3-1"),
    Line::new(&[Special], Any, 3).from(Rule, "table 3-1: MRS, MSR 3"),
    Line::new(&[Barrier], Any, 3).from(Rule, "table 3-1: ISB, DMB, DSB 3"),
    Line::new(&[Exception], Any, 1).from(Estimate, "without what follows"),
];

impl Core {
    /// The Cortex-M0+ of RP2040.
    pub const fn cortex_m0plus() -> Self {
        Self {
            name: "cortex-m0plus",
            arch: Arch::V6M,
            lines: LINES,
            branches: Branches {
                taken: Fact::new(2, Rule, "table 3-1"),
                not_taken: Fact::new(1, Rule, "table 3-1"),
                from_load: Fact::new(0, Rule, "table 3-1: POP with PC 3 + N"),
                split_target: Fact::new(
                    0,
                    Estimate,
                    "no source; only BL and the system instructions are 32 bits long",
                ),
                folded: Fact::new(0, Rule, "nothing folds"),
                folded_it: Fact::new(0, Rule, "no IT"),
            },
            skipped: Fact::new(1, Rule, "no IT blocks"),
            late: Fact::new(0, Rule, "nothing is late"),
            divide: Division {
                start: Fact::new(0, Rule, "no divider"),
                bits_per_cycle: Fact::new(1, Rule, "no divider"),
            },
            overlap: Fact::new(0, Rule, "table 3-1"),
            worst: Worst::nothing("table 3-1 leaves nothing open"),
            near: Fact::new(
                1,
                Rule,
                "table 3-1: 1 on the single-cycle IO port, SIO of RP2040",
            ),
            exceptions: Exceptions {
                entry: Fact::new(15, Rule, "DDI 0484: interrupt latency"),
                tail_chain: Fact::new(13, Estimate, "entry without part of the stacking"),
                exit: Fact::new(13, Estimate, "unstacking and a refill"),
            },
            rules: Rules {
                shifted_register_flags: 2,
                at_worst: false,
            },
        }
    }
}
