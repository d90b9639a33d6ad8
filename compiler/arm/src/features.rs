//! Subtarget features: what the code generator may ask of a core, by name.
//!
//! Selection works as if every core had the instructions of ARMv7E-M, and legalization rewrites
//! what ARMv6-M lacks. The code around it (prologue, allocation, branches) asks this table for the
//! one ability that it needs, and never for the architecture. A core is added here by a row of its
//! own, or by that of an architecture whose answers are the same.
//!
//! Not here: which encodings there are (`whippen-isa`), with which the tests compare the table, and
//! cycles.

use whippen_isa::Arch;
use whippen_isa::reg::LR;

/// What a core can do.
#[derive(Debug)]
pub struct Features {
    /// Every instruction of selection has an encoding, so none is legalized.
    pub legal_as_selected: bool,
    /// Loads, stores, PUSH and POP take R8 to R12, and instructions compute in them.
    pub high_registers: bool,
    /// An operand may be shifted as a part of the instruction that reads it.
    pub shifted_operands: bool,
    /// Sums and moves of constants can leave the flags as they are.
    pub keeps_flags: bool,
    /// IT makes instructions conditional.
    pub conditional_instructions: bool,
    /// MLA adds a product.
    pub multiply_accumulate: bool,
    /// MOVW and MOVT move 16 bits, so that a word takes two instructions.
    pub wide_moves: bool,
    /// A conditional branch has an encoding of 32 bits, which reaches all code.
    pub wide_branches: bool,
    /// Results come late, so that the order of instructions counts.
    pub results_wait: bool,
    /// The core may wait for the second half of a 32-bit instruction that is not at a word, so
    /// those are aligned.
    pub aligns_wide_instructions: bool,
    /// Offset that a load or store of a word can hold, in bytes.
    pub load_offset_max: u32,
    /// Words by which one instruction moves the stack pointer.
    pub stack_words_max: usize,
    /// Words from the stack pointer on that loads and stores of a word reach.
    pub stack_slots_max: usize,
    /// Where the address of the next key's code is: in LR `BX` folds, but not every core can load
    /// it.
    pub next_key_register: u8,
}

/// ARMv6-M.
const BASELINE: Features = Features {
    legal_as_selected: false,
    high_registers: false,
    shifted_operands: false,
    keeps_flags: false,
    conditional_instructions: false,
    multiply_accumulate: false,
    wide_moves: false,
    wide_branches: false,
    results_wait: false,
    aligns_wide_instructions: false,
    load_offset_max: 124,
    stack_words_max: 127,
    stack_slots_max: 256,
    next_key_register: 5,
};

/// ARMv8-M Mainline.
const MAINLINE: Features = Features {
    legal_as_selected: true,
    high_registers: true,
    shifted_operands: true,
    keeps_flags: true,
    conditional_instructions: true,
    multiply_accumulate: true,
    wide_moves: true,
    wide_branches: true,
    results_wait: true,
    aligns_wide_instructions: false,
    load_offset_max: 4095,
    stack_words_max: 1023,
    stack_slots_max: 1024,
    next_key_register: LR,
};

/// ARMv7E-M, which the Cortex-M4 alone stands for.
const CORTEX_M4: Features = Features {
    aligns_wide_instructions: true,
    ..MAINLINE
};

impl Features {
    /// What the cores of an architecture can do.
    pub fn of(arch: Arch) -> &'static Features {
        match arch {
            Arch::V6M => &BASELINE,
            Arch::V7EM => &CORTEX_M4,
            Arch::V8M => &MAINLINE,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use whippen_isa::reg::SP;
    use whippen_isa::{Cond, Encoding, Inst, Op};

    fn template(op: Op) -> Inst {
        let mut encodings = Encoding::of(op);
        let first = encodings.next().expect("every instruction has an encoding");
        Inst {
            s: false,
            ..Inst::new(first)
        }
    }

    fn has(arch: Arch, inst: Inst) -> bool {
        inst.shortest(arch).is_some()
    }

    #[test]
    fn instructions_are_there_where_the_table_says_so() {
        let add = template(Op::ADD_register);
        let shifted = Inst { amount: 1, ..add };
        let high = Inst {
            t: 8,
            ..template(Op::LDR_immediate)
        };
        let without_flags = Inst {
            imm: 1,
            ..template(Op::ADD_immediate)
        };
        let condition = Inst {
            imm: u32::from(Cond::EQ.bits()) << 4 | 8,
            ..template(Op::IT)
        };
        for arch in Arch::ALL {
            let features = Features::of(arch);
            let found = [
                has(arch, high),
                has(arch, shifted),
                has(arch, without_flags),
                has(arch, condition),
                has(arch, template(Op::MLA)),
                has(arch, template(Op::MOVT)),
            ];
            let expected = [
                features.high_registers,
                features.shifted_operands,
                features.keeps_flags,
                features.conditional_instructions,
                features.multiply_accumulate,
                features.wide_moves,
            ];
            assert_eq!(found, expected, "{arch:?}");
        }
    }

    #[test]
    fn what_is_aligned_is_what_a_bound_charges() {
        for arch in Arch::ALL {
            let charged = whippen_board::timing(arch).worst.misaligned.cycles != 0;
            let aligned = Features::of(arch).aligns_wide_instructions;
            assert_eq!(aligned, charged, "{arch:?}");
        }
    }

    #[test]
    fn loads_and_stores_reach_as_far_as_the_table_says() {
        for arch in Arch::ALL {
            let max = Features::of(arch).load_offset_max;
            for op in [Op::LDR_immediate, Op::STR_immediate] {
                let at = |imm| Inst {
                    imm,
                    ..template(op)
                };
                assert!(has(arch, at(max)), "{arch:?}");
                assert!(!has(arch, at(max / 4 * 4 + 4)), "{arch:?}");
            }
        }
    }

    #[test]
    fn loads_and_stores_reach_as_many_words_of_the_stack_as_the_table_says() {
        for arch in Arch::ALL {
            let max = Features::of(arch).stack_slots_max as u32;
            for op in [Op::LDR_immediate, Op::STR_immediate] {
                let slot = |at| Inst {
                    n: SP,
                    imm: 4 * at,
                    ..template(op)
                };
                assert!(has(arch, slot(max - 1)), "{arch:?}");
                assert!(!has(arch, slot(max)), "{arch:?}");
            }
        }
    }

    #[test]
    fn the_stack_pointer_moves_as_far_as_the_table_says() {
        for arch in Arch::ALL {
            let max = Features::of(arch).stack_words_max as u32;
            for op in [Op::SUB_SP_minus_immediate, Op::ADD_SP_plus_immediate] {
                let step = Inst {
                    d: SP,
                    n: SP,
                    imm: 4 * max,
                    ..template(op)
                };
                assert!(has(arch, step), "{arch:?}");
            }
        }
    }

    #[test]
    fn conditional_branches_reach_as_far_as_the_table_says() {
        for arch in Arch::ALL {
            let far = Inst {
                cond: Some(Cond::EQ),
                imm: 4096,
                ..template(Op::B)
            };
            assert_eq!(has(arch, far), Features::of(arch).wide_branches, "{arch:?}");
        }
    }
}
