//! Classes: what an instruction does to the machine, as far as timing and scheduling tell
//! instructions apart.

/// The class of an instruction.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
pub enum Class {
    /// Addition, logic and comparison, ADR included.
    Alu,
    /// MOV, MVN of constants and registers, MOVW, MOVT.
    Move,
    /// Shifts and rotations as instructions of their own.
    Shift,
    /// BFC, BFI, SBFX, UBFX.
    Bitfield,
    /// Sign and zero extension.
    Extend,
    /// Extension and addition.
    ExtendAdd,
    /// CLZ, RBIT and the byte reversals.
    Bits,
    /// SSAT, USAT and their 16-bit pairs.
    Saturate,
    /// Parallel and saturating arithmetic and packing of the DSP extension.
    Dsp,
    /// SEL.
    Select,
    /// Products of 32 bits or less, top words included.
    Multiply,
    /// Such products with an accumulator.
    MultiplyAdd,
    /// Products of 64 bits.
    MultiplyLong,
    /// Such products with an accumulator.
    MultiplyAddLong,
    /// SDIV, UDIV.
    Divide,
    /// One register from memory.
    Load,
    /// Two registers from memory.
    LoadDual,
    /// A list of registers from memory, POP included.
    LoadMultiple,
    /// Load-exclusive and load-acquire.
    LoadOrdered,
    /// One register to memory.
    Store,
    /// Two registers to memory.
    StoreDual,
    /// A list of registers to memory, PUSH included.
    StoreMultiple,
    /// Store-exclusive and store-release.
    StoreOrdered,
    /// B, conditional or not.
    Branch,
    /// Calls: BL, BLX.
    BranchLink,
    /// BX.
    BranchRegister,
    /// CBZ, CBNZ.
    CompareBranch,
    /// TBB, TBH.
    TableBranch,
    /// IT.
    It,
    /// NOP and the hints that do nothing.
    Nop,
    /// WFE, WFI, SEV, YIELD.
    Wait,
    /// PLD, PLI.
    Preload,
    /// DMB, DSB, ISB, CLREX, CSDB.
    Barrier,
    /// MRS, MSR, CPS.
    Special,
    /// SVC, BKPT, UDF.
    Exception,
    /// SG, TT, VLSTM, VLLDM.
    Security,
    /// Coprocessor instructions.
    Coprocessor,
    /// Floating-point addition, multiplication, absolute value, negation, rounding, minimum and
    /// maximum.
    FloatAlu,
    /// Floating-point multiply-add.
    FloatMultiplyAdd,
    /// VDIV, VSQRT.
    FloatDivide,
    /// VCMP.
    FloatCompare,
    /// Conversions.
    FloatConvert,
    /// VMOV between floating-point registers, of a constant, VSEL.
    FloatMove,
    /// Between the two register files, VMRS and VMSR included.
    FloatTransfer,
    /// One floating-point register from memory.
    FloatLoad,
    /// One floating-point register to memory.
    FloatStore,
    /// A list of floating-point registers from memory.
    FloatLoadMultiple,
    /// A list of floating-point registers to memory.
    FloatStoreMultiple,
}

impl Class {
    /// Whether the floating-point unit does it, so that an exception has more to save.
    pub fn is_floating_point(self) -> bool {
        use Class::*;
        matches!(
            self,
            FloatAlu
                | FloatMultiplyAdd
                | FloatDivide
                | FloatCompare
                | FloatConvert
                | FloatMove
                | FloatTransfer
                | FloatLoad
                | FloatStore
                | FloatLoadMultiple
                | FloatStoreMultiple
        )
    }
}
