//! The instruction set: one line per encoding.
//!
//! ```text
//! instruction   class "written = read" {
//!     encoding  first architecture  "bit picture"  "UAL syntax"  "rules";
//! }
//! ```
//!
//! Names are those of the ARMv7-M manual (of the ARMv8-M manual for what is new there), with `_`
//! for the blank and the brackets: `ADD_register` T3 is "ADD (register), encoding T3". Pictures are
//! read by `pattern`, rules by `rules`, effects by `effects`, syntax by `text`; all but the syntax
//! while the crate is compiled.
//!
//! Where two pictures match a word, the one that fixes more places decodes it (CMN is an ADD to PC
//! that sets flags). Two that match the same word and fix equally many are a build error.

use crate::arch::Arch;
use crate::class::Class;
use crate::row::{Form, Row};

macro_rules! instructions {
    ($($op:ident $class:ident $effects:literal {
        $($form:ident $arch:ident $picture:literal $text:literal $rules:literal;)+
    })+) => {
        /// An instruction of the manual: what it does, whatever its encoding.
        #[allow(non_camel_case_types)]
        #[derive(Clone, Copy, PartialEq, Eq, Hash, Debug, PartialOrd, Ord)]
        #[repr(u16)]
        pub enum Op { $($(#[doc = concat!("`", $text, "`\n\n")])+ $op,)+ }

        const OP_NAMES: &[&str] = &[$(stringify!($op)),+];

        impl Op {
            /// All instructions, in the order of the table.
            pub const ALL: &[Self] = &[$(Self::$op),+];
        }

        /// The table.
        pub(crate) static ROWS: [Row; COUNT] = [$($(
            Row::new(Op::$op, Form::$form, Arch::$arch, Class::$class, $effects, $picture, $text, $rules)
        ),+),+];
        const COUNT: usize = [$($(stringify!($op $form)),+),+].len();
    };
}

impl Op {
    /// The name as in `ADD_register`.
    pub const fn identifier(self) -> &'static str {
        OP_NAMES[self as usize]
    }
}

instructions! {
    // Addition and subtraction.
    ADC_immediate Alu "d NZCV = n C" {
        T1 V7EM "11110i01010Snnnn 0iiiddddiiiiiiii" "adc{s}{c} {d}, {n}, {const}" "const dn:r";
    }
    ADC_register Alu "d NZCV = n m C" {
        T1 V6M  "0100000101mmmddd" "adc{s}{c} {d}, {m}" "n=d s=it";
        T2 V7EM "11101011010Snnnn (0)kkkddddkkyymmmm" "adc{s}{c}.w {d}, {n}, {m}{shift}" "dnm:r";
    }
    ADD_immediate Alu "d NZCV = n" {
        T1 V6M  "0001110iiinnnddd" "add{s}{c} {d}, {n}, {const}" "s=it";
        T2 V6M  "00110dddiiiiiiii" "add{s}{c} {d}, {const}" "n=d s=it";
        T3 V7EM "11110i01000Snnnn 0iiiddddiiiiiiii" "add{s}{c}.w {d}, {n}, {const}" "const d:r n:p";
        T4 V7EM "11110i100000nnnn 0iiiddddiiiiiiii" "addw{c} {d}, {n}, {const}" "d:r";
    }
    ADD_register Alu "d NZCV = n m" {
        T1 V6M  "0001100mmmnnnddd" "add{s}{c} {d}, {n}, {m}" "s=it";
        T2 V6M  "01000100dmmmmddd" "add{c} {d}, {m}" "n=d see:m13 pc+pc last-pc";
        T3 V7EM "11101011000Snnnn (0)kkkddddkkyymmmm" "add{s}{c}.w {d}, {n}, {m}{shift}" "dm:r n:p";
    }
    ADD_SP_plus_immediate Alu "d NZCV = n" {
        T1 V6M  "10101dddiiiiiiii" "add{c} {d}, sp, {const}" "n=sp x4";
        T2 V6M  "101100000iiiiiii" "add{c} sp, {const}" "d=sp n=sp x4";
        T3 V7EM "11110i01000S1101 0iiiddddiiiiiiii" "add{s}{c}.w {d}, sp, {const}" "const n=sp d:p";
        T4 V7EM "11110i1000001101 0iiiddddiiiiiiii" "addw{c} {d}, sp, {const}" "n=sp d:p";
    }
    ADD_SP_plus_register Alu "d NZCV = n m" {
        T1 V6M  "01000100d1101ddd" "add{c} {d}, sp, {d}" "m=d n=sp last-pc";
        T2 V6M  "010001001mmmm101" "add{c} sp, {m}" "d=sp n=sp see:m13";
        T3 V7EM "11101011000S1101 (0)kkkddddkkyymmmm" "add{s}{c}.w {d}, sp, {m}{shift}" "n=sp d:p m:r sp:lsl3";
    }
    ADR Alu "d = pc" {
        T1 V6M  "10100dddiiiiiiii" "add{c} {d}, pc, {const}" "x4";
        T2 V7EM "11110i1010101111 0iiiddddiiiiiiii" "subw{c} {d}, pc, {const}" "u=0 d:r";
        T3 V7EM "11110i1000001111 0iiiddddiiiiiiii" "addw{c} {d}, pc, {const}" "d:r";
    }
    CMN_immediate Alu "NZCV = n" {
        T1 V7EM "11110i010001nnnn 0iii1111iiiiiiii" "cmn{c}.w {n}, {const}" "const s=1 n:p";
    }
    CMN_register Alu "NZCV = n m" {
        T1 V6M  "0100001011mmmnnn" "cmn{c} {n}, {m}" "s=1";
        T2 V7EM "111010110001nnnn (0)kkk1111kkyymmmm" "cmn{c}.w {n}, {m}{shift}" "s=1 n:p m:r";
    }
    CMP_immediate Alu "NZCV = n" {
        T1 V6M  "00101nnniiiiiiii" "cmp{c} {n}, {const}" "s=1";
        T2 V7EM "11110i011011nnnn 0iii1111iiiiiiii" "cmp{c}.w {n}, {const}" "const s=1 n:p";
    }
    CMP_register Alu "NZCV = n m" {
        T1 V6M  "0100001010mmmnnn" "cmp{c} {n}, {m}" "s=1";
        T2 V6M  "01000101nmmmmnnn" "cmp{c} {n}, {m}" "s=1 nm:p high";
        T3 V7EM "111010111011nnnn (0)kkk1111kkyymmmm" "cmp{c}.w {n}, {m}{shift}" "s=1 n:p m:r";
    }
    RSB_immediate Alu "d NZCV = n" {
        T1 V6M  "0100001001nnnddd" "rsb{s}{c} {d}, {n}, #0" "s=it";
        T2 V7EM "11110i01110Snnnn 0iiiddddiiiiiiii" "rsb{s}{c}.w {d}, {n}, {const}" "const dn:r";
    }
    RSB_register Alu "d NZCV = n m" {
        T1 V7EM "11101011110Snnnn (0)kkkddddkkyymmmm" "rsb{s}{c} {d}, {n}, {m}{shift}" "dnm:r";
    }
    SBC_immediate Alu "d NZCV = n C" {
        T1 V7EM "11110i01011Snnnn 0iiiddddiiiiiiii" "sbc{s}{c} {d}, {n}, {const}" "const dn:r";
    }
    SBC_register Alu "d NZCV = n m C" {
        T1 V6M  "0100000110mmmddd" "sbc{s}{c} {d}, {m}" "n=d s=it";
        T2 V7EM "11101011011Snnnn (0)kkkddddkkyymmmm" "sbc{s}{c}.w {d}, {n}, {m}{shift}" "dnm:r";
    }
    SUB_immediate Alu "d NZCV = n" {
        T1 V6M  "0001111iiinnnddd" "sub{s}{c} {d}, {n}, {const}" "s=it";
        T2 V6M  "00111dddiiiiiiii" "sub{s}{c} {d}, {const}" "n=d s=it";
        T3 V7EM "11110i01101Snnnn 0iiiddddiiiiiiii" "sub{s}{c}.w {d}, {n}, {const}" "const d:r n:p";
        T4 V7EM "11110i101010nnnn 0iiiddddiiiiiiii" "subw{c} {d}, {n}, {const}" "d:r";
    }
    SUB_register Alu "d NZCV = n m" {
        T1 V6M  "0001101mmmnnnddd" "sub{s}{c} {d}, {n}, {m}" "s=it";
        T2 V7EM "11101011101Snnnn (0)kkkddddkkyymmmm" "sub{s}{c}.w {d}, {n}, {m}{shift}" "dm:r n:p";
    }
    SUB_SP_minus_immediate Alu "d NZCV = n" {
        T1 V6M  "101100001iiiiiii" "sub{c} sp, {const}" "d=sp n=sp x4";
        T2 V7EM "11110i01101S1101 0iiiddddiiiiiiii" "sub{s}{c}.w {d}, sp, {const}" "const n=sp d:p";
        T3 V7EM "11110i1010101101 0iiiddddiiiiiiii" "subw{c} {d}, sp, {const}" "n=sp d:p";
    }
    SUB_SP_minus_register Alu "d NZCV = n m" {
        T1 V7EM "11101011101S1101 (0)kkkddddkkyymmmm" "sub{s}{c}.w {d}, sp, {m}{shift}" "n=sp d:p m:r sp:lsl3";
    }

    // Logic.
    AND_immediate Alu "d NZ c = n" {
        T1 V7EM "11110i00000Snnnn 0iiiddddiiiiiiii" "and{s}{c} {d}, {n}, {const}" "const dn:r";
    }
    AND_register Alu "d NZ c = n m" {
        T1 V6M  "0100000000mmmddd" "and{s}{c} {d}, {m}" "n=d s=it";
        T2 V7EM "11101010000Snnnn (0)kkkddddkkyymmmm" "and{s}{c}.w {d}, {n}, {m}{shift}" "dnm:r";
    }
    BIC_immediate Alu "d NZ c = n" {
        T1 V7EM "11110i00001Snnnn 0iiiddddiiiiiiii" "bic{s}{c} {d}, {n}, {const}" "const dn:r";
    }
    BIC_register Alu "d NZ c = n m" {
        T1 V6M  "0100001110mmmddd" "bic{s}{c} {d}, {m}" "n=d s=it";
        T2 V7EM "11101010001Snnnn (0)kkkddddkkyymmmm" "bic{s}{c}.w {d}, {n}, {m}{shift}" "dnm:r";
    }
    EOR_immediate Alu "d NZ c = n" {
        T1 V7EM "11110i00100Snnnn 0iiiddddiiiiiiii" "eor{s}{c} {d}, {n}, {const}" "const dn:r";
    }
    EOR_register Alu "d NZ c = n m" {
        T1 V6M  "0100000001mmmddd" "eor{s}{c} {d}, {m}" "n=d s=it";
        T2 V7EM "11101010100Snnnn (0)kkkddddkkyymmmm" "eor{s}{c}.w {d}, {n}, {m}{shift}" "dnm:r";
    }
    ORN_immediate Alu "d NZ c = n" {
        T1 V7EM "11110i00011Snnnn 0iiiddddiiiiiiii" "orn{s}{c} {d}, {n}, {const}" "const dn:r";
    }
    ORN_register Alu "d NZ c = n m" {
        T1 V7EM "11101010011Snnnn (0)kkkddddkkyymmmm" "orn{s}{c} {d}, {n}, {m}{shift}" "dnm:r";
    }
    ORR_immediate Alu "d NZ c = n" {
        T1 V7EM "11110i00010Snnnn 0iiiddddiiiiiiii" "orr{s}{c} {d}, {n}, {const}" "const dn:r";
    }
    ORR_register Alu "d NZ c = n m" {
        T1 V6M  "0100001100mmmddd" "orr{s}{c} {d}, {m}" "n=d s=it";
        T2 V7EM "11101010010Snnnn (0)kkkddddkkyymmmm" "orr{s}{c}.w {d}, {n}, {m}{shift}" "dnm:r";
    }
    TEQ_immediate Alu "NZ c = n" {
        T1 V7EM "11110i001001nnnn 0iii1111iiiiiiii" "teq{c}.w {n}, {const}" "const s=1 n:r";
    }
    TEQ_register Alu "NZ c = n m" {
        T1 V7EM "111010101001nnnn (0)kkk1111kkyymmmm" "teq{c}.w {n}, {m}{shift}" "s=1 nm:r";
    }
    TST_immediate Alu "NZ c = n" {
        T1 V7EM "11110i000001nnnn 0iii1111iiiiiiii" "tst{c}.w {n}, {const}" "const s=1 n:r";
    }
    TST_register Alu "NZ c = n m" {
        T1 V6M  "0100001000mmmnnn" "tst{c} {n}, {m}" "s=1";
        T2 V7EM "111010100001nnnn (0)kkk1111kkyymmmm" "tst{c}.w {n}, {m}{shift}" "s=1 nm:r";
    }

    // Moves.
    MOV_immediate Move "d NZ c =" {
        T1 V6M  "00100dddiiiiiiii" "mov{s}{c} {d}, {const}" "s=it";
        T2 V7EM "11110i00010S1111 0iiiddddiiiiiiii" "mov{s}{c}.w {d}, {const}" "const d:r";
        T3 V7EM "11110i100100iiii 0iiiddddiiiiiiii" "movw{c} {d}, {const}" "imm16 d:r";
    }
    MOV_register Move "d NZ = m" {
        T1 V6M  "01000110dmmmmddd" "mov{c} {d}, {m}" "last-pc";
        T2 V6M  "0000000000mmmddd" "movs {d}, {m}" "s=1 no-it";
        T3 V7EM "11101010010S1111 (0)000dddd0000mmmm" "mov{s}{c}.w {d}, {m}" "mov";
    }
    MOVT Move "d = d" {
        T1 V7EM "11110i101100iiii 0iiiddddiiiiiiii" "movt{c} {d}, {const}" "imm16 d:r";
    }
    MVN_immediate Move "d NZ c =" {
        T1 V7EM "11110i00011S1111 0iiiddddiiiiiiii" "mvn{s}{c} {d}, {const}" "const d:r";
    }
    MVN_register Move "d NZ c = m" {
        T1 V6M  "0100001111mmmddd" "mvn{s}{c} {d}, {m}" "s=it";
        T2 V7EM "11101010011S1111 (0)kkkddddkkyymmmm" "mvn{s}{c}.w {d}, {m}{shift}" "dm:r";
    }

    // Shifts.
    ASR_immediate Shift "d NZ c = m" {
        T1 V6M  "00010kkkkkmmmddd" "asr{s}{c} {d}, {m}, #{k}" "asr s=it";
        T2 V7EM "11101010010S1111 (0)kkkddddkk10mmmm" "asr{s}{c}.w {d}, {m}, #{k}" "asr dm:r";
    }
    ASR_register Shift "d NZ C? = n m" {
        T1 V6M  "0100000100mmmddd" "asr{s}{c} {d}, {m}" "n=d s=it";
        T2 V7EM "11111010010Snnnn 1111dddd0000mmmm" "asr{s}{c}.w {d}, {n}, {m}" "dnm:r";
    }
    LSL_immediate Shift "d NZ c = m" {
        T1 V6M  "00000kkkkkmmmddd" "lsl{s}{c} {d}, {m}, #{k}" "s=it";
        T2 V7EM "11101010010S1111 (0)kkkddddkk00mmmm" "lsl{s}{c}.w {d}, {m}, #{k}" "dm:r";
    }
    LSL_register Shift "d NZ C? = n m" {
        T1 V6M  "0100000010mmmddd" "lsl{s}{c} {d}, {m}" "n=d s=it";
        T2 V7EM "11111010000Snnnn 1111dddd0000mmmm" "lsl{s}{c}.w {d}, {n}, {m}" "dnm:r";
    }
    LSR_immediate Shift "d NZ c = m" {
        T1 V6M  "00001kkkkkmmmddd" "lsr{s}{c} {d}, {m}, #{k}" "lsr s=it";
        T2 V7EM "11101010010S1111 (0)kkkddddkk01mmmm" "lsr{s}{c}.w {d}, {m}, #{k}" "lsr dm:r";
    }
    LSR_register Shift "d NZ C? = n m" {
        T1 V6M  "0100000011mmmddd" "lsr{s}{c} {d}, {m}" "n=d s=it";
        T2 V7EM "11111010001Snnnn 1111dddd0000mmmm" "lsr{s}{c}.w {d}, {n}, {m}" "dnm:r";
    }
    ROR_immediate Shift "d NZ c = m" {
        T1 V7EM "11101010010S1111 (0)kkkddddkk11mmmm" "ror{s}{c}.w {d}, {m}, #{k}" "ror dm:r";
    }
    ROR_register Shift "d NZ C? = n m" {
        T1 V6M  "0100000111mmmddd" "ror{s}{c} {d}, {m}" "n=d s=it";
        T2 V7EM "11111010011Snnnn 1111dddd0000mmmm" "ror{s}{c}.w {d}, {n}, {m}" "dnm:r";
    }
    RRX Shift "d NZ c = m" {
        T1 V7EM "11101010010S1111 (0)000dddd0011mmmm" "rrx{s}{c} {d}, {m}" "rrx dm:r";
    }

    // Bit fields and bits.
    BFC Bitfield "d = d" {
        T1 V7EM "11110(0)1101101111 0kkkddddkk(0)iiiii" "bfc{c} {d}, #{k}, #{i}" "msb field d:r";
    }
    BFI Bitfield "d = d n" {
        T1 V7EM "11110(0)110110nnnn 0kkkddddkk(0)iiiii" "bfi{c} {d}, {n}, #{k}, #{i}" "msb field dn:r";
    }
    SBFX Bitfield "d = n" {
        T1 V7EM "11110(0)110100nnnn 0kkkddddkk(0)iiiii" "sbfx{c} {d}, {n}, #{k}, #{i}" "plus1 field dn:r";
    }
    UBFX Bitfield "d = n" {
        T1 V7EM "11110(0)111100nnnn 0kkkddddkk(0)iiiii" "ubfx{c} {d}, {n}, #{k}, #{i}" "plus1 field dn:r";
    }
    CLZ Bits "d = m" { T1 V7EM "111110101011qqqq 1111dddd1000mmmm" "clz{c} {d}, {m}" "dm:r"; }
    RBIT Bits "d = m" { T1 V7EM "111110101001qqqq 1111dddd1010mmmm" "rbit{c} {d}, {m}" "dm:r"; }
    REV Bits "d = m" {
        T1 V6M  "1011101000mmmddd" "rev{c} {d}, {m}" "";
        T2 V7EM "111110101001qqqq 1111dddd1000mmmm" "rev{c}.w {d}, {m}" "dm:r";
    }
    REV16 Bits "d = m" {
        T1 V6M  "1011101001mmmddd" "rev16{c} {d}, {m}" "";
        T2 V7EM "111110101001qqqq 1111dddd1001mmmm" "rev16{c}.w {d}, {m}" "dm:r";
    }
    REVSH Bits "d = m" {
        T1 V6M  "1011101011mmmddd" "revsh{c} {d}, {m}" "";
        T2 V7EM "111110101001qqqq 1111dddd1011mmmm" "revsh{c}.w {d}, {m}" "dm:r";
    }

    // Extension. The rotated operand is Rm.
    SXTAB ExtendAdd "d = n m" {
        T1 V7EM "111110100100nnnn 1111dddd1(0)kkmmmm" "sxtab{c} {d}, {n}, {m}{shift}" "bytes dnm:r";
    }
    SXTAB16 ExtendAdd "d = n m" {
        T1 V7EM "111110100010nnnn 1111dddd1(0)kkmmmm" "sxtab16{c} {d}, {n}, {m}{shift}" "bytes dnm:r";
    }
    SXTAH ExtendAdd "d = n m" {
        T1 V7EM "111110100000nnnn 1111dddd1(0)kkmmmm" "sxtah{c} {d}, {n}, {m}{shift}" "bytes dnm:r";
    }
    SXTB Extend "d = m" {
        T1 V6M  "1011001001mmmddd" "sxtb{c} {d}, {m}" "";
        T2 V7EM "1111101001001111 1111dddd1(0)kkmmmm" "sxtb{c}.w {d}, {m}{shift}" "bytes dm:r";
    }
    SXTB16 Extend "d = m" { T1 V7EM "1111101000101111 1111dddd1(0)kkmmmm" "sxtb16{c} {d}, {m}{shift}" "bytes dm:r"; }
    SXTH Extend "d = m" {
        T1 V6M  "1011001000mmmddd" "sxth{c} {d}, {m}" "";
        T2 V7EM "1111101000001111 1111dddd1(0)kkmmmm" "sxth{c}.w {d}, {m}{shift}" "bytes dm:r";
    }
    UXTAB ExtendAdd "d = n m" {
        T1 V7EM "111110100101nnnn 1111dddd1(0)kkmmmm" "uxtab{c} {d}, {n}, {m}{shift}" "bytes dnm:r";
    }
    UXTAB16 ExtendAdd "d = n m" {
        T1 V7EM "111110100011nnnn 1111dddd1(0)kkmmmm" "uxtab16{c} {d}, {n}, {m}{shift}" "bytes dnm:r";
    }
    UXTAH ExtendAdd "d = n m" {
        T1 V7EM "111110100001nnnn 1111dddd1(0)kkmmmm" "uxtah{c} {d}, {n}, {m}{shift}" "bytes dnm:r";
    }
    UXTB Extend "d = m" {
        T1 V6M  "1011001011mmmddd" "uxtb{c} {d}, {m}" "";
        T2 V7EM "1111101001011111 1111dddd1(0)kkmmmm" "uxtb{c}.w {d}, {m}{shift}" "bytes dm:r";
    }
    UXTB16 Extend "d = m" { T1 V7EM "1111101000111111 1111dddd1(0)kkmmmm" "uxtb16{c} {d}, {m}{shift}" "bytes dm:r"; }
    UXTH Extend "d = m" {
        T1 V6M  "1011001010mmmddd" "uxth{c} {d}, {m}" "";
        T2 V7EM "1111101000011111 1111dddd1(0)kkmmmm" "uxth{c}.w {d}, {m}{shift}" "bytes dm:r";
    }

    // Saturation, packing, selection.
    SSAT Saturate "d Q = n" {
        T1 V7EM "11110(0)1100y0nnnn 0kkkddddkk(0)iiiii" "ssat{c} {d}, #{i}, {n}{shift}" "plus1 dn:r";
    }
    SSAT16 Saturate "d Q = n" {
        T1 V7EM "11110(0)110010nnnn 0000dddd00(0)(0)iiii" "ssat16{c} {d}, #{i}, {n}" "plus1 dn:r";
    }
    USAT Saturate "d Q = n" { T1 V7EM "11110(0)1110y0nnnn 0kkkddddkk(0)iiiii" "usat{c} {d}, #{i}, {n}{shift}" "dn:r"; }
    USAT16 Saturate "d Q = n" { T1 V7EM "11110(0)111010nnnn 0000dddd00(0)(0)iiii" "usat16{c} {d}, #{i}, {n}" "dn:r"; }
    PKHBT Dsp "d = n m" { T1 V7EM "111010101100nnnn (0)kkkddddkk00mmmm" "pkhbt{c} {d}, {n}, {m}{shift}" "dnm:r"; }
    PKHTB Dsp "d = n m" { T1 V7EM "111010101100nnnn (0)kkkddddkk10mmmm" "pkhtb{c} {d}, {n}, {m}{shift}" "asr dnm:r"; }
    SEL Select "d = n m GE" { T1 V7EM "111110101010nnnn 1111dddd1000mmmm" "sel{c} {d}, {n}, {m}" "dnm:r"; }

    // Saturating and parallel arithmetic.
    QADD Dsp "d Q = n m" { T1 V7EM "111110101000nnnn 1111dddd1000mmmm" "qadd{c} {d}, {m}, {n}" "dnm:r"; }
    QDADD Dsp "d Q = n m" { T1 V7EM "111110101000nnnn 1111dddd1001mmmm" "qdadd{c} {d}, {m}, {n}" "dnm:r"; }
    QSUB Dsp "d Q = n m" { T1 V7EM "111110101000nnnn 1111dddd1010mmmm" "qsub{c} {d}, {m}, {n}" "dnm:r"; }
    QDSUB Dsp "d Q = n m" { T1 V7EM "111110101000nnnn 1111dddd1011mmmm" "qdsub{c} {d}, {m}, {n}" "dnm:r"; }
    SADD16 Dsp "d GE = n m" { T1 V7EM "111110101001nnnn 1111dddd0000mmmm" "sadd16{c} {d}, {n}, {m}" "dnm:r"; }
    SASX Dsp "d GE = n m" { T1 V7EM "111110101010nnnn 1111dddd0000mmmm" "sasx{c} {d}, {n}, {m}" "dnm:r"; }
    SSAX Dsp "d GE = n m" { T1 V7EM "111110101110nnnn 1111dddd0000mmmm" "ssax{c} {d}, {n}, {m}" "dnm:r"; }
    SSUB16 Dsp "d GE = n m" { T1 V7EM "111110101101nnnn 1111dddd0000mmmm" "ssub16{c} {d}, {n}, {m}" "dnm:r"; }
    SADD8 Dsp "d GE = n m" { T1 V7EM "111110101000nnnn 1111dddd0000mmmm" "sadd8{c} {d}, {n}, {m}" "dnm:r"; }
    SSUB8 Dsp "d GE = n m" { T1 V7EM "111110101100nnnn 1111dddd0000mmmm" "ssub8{c} {d}, {n}, {m}" "dnm:r"; }
    QADD16 Dsp "d = n m" { T1 V7EM "111110101001nnnn 1111dddd0001mmmm" "qadd16{c} {d}, {n}, {m}" "dnm:r"; }
    QASX Dsp "d = n m" { T1 V7EM "111110101010nnnn 1111dddd0001mmmm" "qasx{c} {d}, {n}, {m}" "dnm:r"; }
    QSAX Dsp "d = n m" { T1 V7EM "111110101110nnnn 1111dddd0001mmmm" "qsax{c} {d}, {n}, {m}" "dnm:r"; }
    QSUB16 Dsp "d = n m" { T1 V7EM "111110101101nnnn 1111dddd0001mmmm" "qsub16{c} {d}, {n}, {m}" "dnm:r"; }
    QADD8 Dsp "d = n m" { T1 V7EM "111110101000nnnn 1111dddd0001mmmm" "qadd8{c} {d}, {n}, {m}" "dnm:r"; }
    QSUB8 Dsp "d = n m" { T1 V7EM "111110101100nnnn 1111dddd0001mmmm" "qsub8{c} {d}, {n}, {m}" "dnm:r"; }
    SHADD16 Dsp "d = n m" { T1 V7EM "111110101001nnnn 1111dddd0010mmmm" "shadd16{c} {d}, {n}, {m}" "dnm:r"; }
    SHASX Dsp "d = n m" { T1 V7EM "111110101010nnnn 1111dddd0010mmmm" "shasx{c} {d}, {n}, {m}" "dnm:r"; }
    SHSAX Dsp "d = n m" { T1 V7EM "111110101110nnnn 1111dddd0010mmmm" "shsax{c} {d}, {n}, {m}" "dnm:r"; }
    SHSUB16 Dsp "d = n m" { T1 V7EM "111110101101nnnn 1111dddd0010mmmm" "shsub16{c} {d}, {n}, {m}" "dnm:r"; }
    SHADD8 Dsp "d = n m" { T1 V7EM "111110101000nnnn 1111dddd0010mmmm" "shadd8{c} {d}, {n}, {m}" "dnm:r"; }
    SHSUB8 Dsp "d = n m" { T1 V7EM "111110101100nnnn 1111dddd0010mmmm" "shsub8{c} {d}, {n}, {m}" "dnm:r"; }
    UADD16 Dsp "d GE = n m" { T1 V7EM "111110101001nnnn 1111dddd0100mmmm" "uadd16{c} {d}, {n}, {m}" "dnm:r"; }
    UASX Dsp "d GE = n m" { T1 V7EM "111110101010nnnn 1111dddd0100mmmm" "uasx{c} {d}, {n}, {m}" "dnm:r"; }
    USAX Dsp "d GE = n m" { T1 V7EM "111110101110nnnn 1111dddd0100mmmm" "usax{c} {d}, {n}, {m}" "dnm:r"; }
    USUB16 Dsp "d GE = n m" { T1 V7EM "111110101101nnnn 1111dddd0100mmmm" "usub16{c} {d}, {n}, {m}" "dnm:r"; }
    UADD8 Dsp "d GE = n m" { T1 V7EM "111110101000nnnn 1111dddd0100mmmm" "uadd8{c} {d}, {n}, {m}" "dnm:r"; }
    USUB8 Dsp "d GE = n m" { T1 V7EM "111110101100nnnn 1111dddd0100mmmm" "usub8{c} {d}, {n}, {m}" "dnm:r"; }
    UQADD16 Dsp "d = n m" { T1 V7EM "111110101001nnnn 1111dddd0101mmmm" "uqadd16{c} {d}, {n}, {m}" "dnm:r"; }
    UQASX Dsp "d = n m" { T1 V7EM "111110101010nnnn 1111dddd0101mmmm" "uqasx{c} {d}, {n}, {m}" "dnm:r"; }
    UQSAX Dsp "d = n m" { T1 V7EM "111110101110nnnn 1111dddd0101mmmm" "uqsax{c} {d}, {n}, {m}" "dnm:r"; }
    UQSUB16 Dsp "d = n m" { T1 V7EM "111110101101nnnn 1111dddd0101mmmm" "uqsub16{c} {d}, {n}, {m}" "dnm:r"; }
    UQADD8 Dsp "d = n m" { T1 V7EM "111110101000nnnn 1111dddd0101mmmm" "uqadd8{c} {d}, {n}, {m}" "dnm:r"; }
    UQSUB8 Dsp "d = n m" { T1 V7EM "111110101100nnnn 1111dddd0101mmmm" "uqsub8{c} {d}, {n}, {m}" "dnm:r"; }
    UHADD16 Dsp "d = n m" { T1 V7EM "111110101001nnnn 1111dddd0110mmmm" "uhadd16{c} {d}, {n}, {m}" "dnm:r"; }
    UHASX Dsp "d = n m" { T1 V7EM "111110101010nnnn 1111dddd0110mmmm" "uhasx{c} {d}, {n}, {m}" "dnm:r"; }
    UHSAX Dsp "d = n m" { T1 V7EM "111110101110nnnn 1111dddd0110mmmm" "uhsax{c} {d}, {n}, {m}" "dnm:r"; }
    UHSUB16 Dsp "d = n m" { T1 V7EM "111110101101nnnn 1111dddd0110mmmm" "uhsub16{c} {d}, {n}, {m}" "dnm:r"; }
    UHADD8 Dsp "d = n m" { T1 V7EM "111110101000nnnn 1111dddd0110mmmm" "uhadd8{c} {d}, {n}, {m}" "dnm:r"; }
    UHSUB8 Dsp "d = n m" { T1 V7EM "111110101100nnnn 1111dddd0110mmmm" "uhsub8{c} {d}, {n}, {m}" "dnm:r"; }
    USAD8 Dsp "d = n m" { T1 V7EM "111110110111nnnn 1111dddd0000mmmm" "usad8{c} {d}, {n}, {m}" "dnm:r"; }
    USADA8 Dsp "d = n m a" { T1 V7EM "111110110111nnnn aaaadddd0000mmmm" "usada8{c} {d}, {n}, {m}, {a}" "dnma:r"; }

    // Multiplication and division. Of a pair RdLo is d and RdHi is a; imm has the halves, the
    // exchange or the rounding.
    MUL Multiply "d NZ = n m" {
        T1 V6M  "0100001101nnnddd" "mul{s}{c} {d}, {n}, {d}" "m=d s=it";
        T2 V7EM "111110110000nnnn 1111dddd0000mmmm" "mul{c} {d}, {n}, {m}" "dnm:r";
    }
    MLA MultiplyAdd "d = n m a" { T1 V7EM "111110110000nnnn aaaadddd0000mmmm" "mla{c} {d}, {n}, {m}, {a}" "dnma:r"; }
    MLS MultiplyAdd "d = n m a" { T1 V7EM "111110110000nnnn aaaadddd0001mmmm" "mls{c} {d}, {n}, {m}, {a}" "dnma:r"; }
    SMULxy Multiply "d = n m" { T1 V7EM "111110110001nnnn 1111dddd00iimmmm" "smul{xy}{c} {d}, {n}, {m}" "dnm:r"; }
    SMLAxy MultiplyAdd "d Q = n m a" {
        T1 V7EM "111110110001nnnn aaaadddd00iimmmm" "smla{xy}{c} {d}, {n}, {m}, {a}" "dnma:r";
    }
    SMUAD Multiply "d Q = n m" { T1 V7EM "111110110010nnnn 1111dddd000immmm" "smuad{x}{c} {d}, {n}, {m}" "dnm:r"; }
    SMLAD MultiplyAdd "d Q = n m a" {
        T1 V7EM "111110110010nnnn aaaadddd000immmm" "smlad{x}{c} {d}, {n}, {m}, {a}" "dnma:r";
    }
    SMULWy Multiply "d = n m" { T1 V7EM "111110110011nnnn 1111dddd000immmm" "smulw{y}{c} {d}, {n}, {m}" "dnm:r"; }
    SMLAWy MultiplyAdd "d Q = n m a" {
        T1 V7EM "111110110011nnnn aaaadddd000immmm" "smlaw{y}{c} {d}, {n}, {m}, {a}" "dnma:r";
    }
    SMUSD Multiply "d = n m" { T1 V7EM "111110110100nnnn 1111dddd000immmm" "smusd{x}{c} {d}, {n}, {m}" "dnm:r"; }
    SMLSD MultiplyAdd "d Q = n m a" {
        T1 V7EM "111110110100nnnn aaaadddd000immmm" "smlsd{x}{c} {d}, {n}, {m}, {a}" "dnma:r";
    }
    SMMUL Multiply "d = n m" { T1 V7EM "111110110101nnnn 1111dddd000immmm" "smmul{r}{c} {d}, {n}, {m}" "dnm:r"; }
    SMMLA MultiplyAdd "d = n m a" {
        T1 V7EM "111110110101nnnn aaaadddd000immmm" "smmla{r}{c} {d}, {n}, {m}, {a}" "dnma:r";
    }
    SMMLS MultiplyAdd "d = n m a" {
        T1 V7EM "111110110110nnnn aaaadddd000immmm" "smmls{r}{c} {d}, {n}, {m}, {a}" "dnma:r";
    }
    SMULL MultiplyLong "d a = n m" {
        T1 V7EM "111110111000nnnn ddddaaaa0000mmmm" "smull{c} {d}, {a}, {n}, {m}" "dnma:r d!=a";
    }
    UMULL MultiplyLong "d a = n m" {
        T1 V7EM "111110111010nnnn ddddaaaa0000mmmm" "umull{c} {d}, {a}, {n}, {m}" "dnma:r d!=a";
    }
    SMLAL MultiplyAddLong "d a = n m d a" {
        T1 V7EM "111110111100nnnn ddddaaaa0000mmmm" "smlal{c} {d}, {a}, {n}, {m}" "dnma:r d!=a";
    }
    SMLALxy MultiplyAddLong "d a = n m d a" {
        T1 V7EM "111110111100nnnn ddddaaaa10iimmmm" "smlal{xy}{c} {d}, {a}, {n}, {m}" "dnma:r d!=a";
    }
    SMLALD MultiplyAddLong "d a = n m d a" {
        T1 V7EM "111110111100nnnn ddddaaaa110immmm" "smlald{x}{c} {d}, {a}, {n}, {m}" "dnma:r d!=a";
    }
    SMLSLD MultiplyAddLong "d a = n m d a" {
        T1 V7EM "111110111101nnnn ddddaaaa110immmm" "smlsld{x}{c} {d}, {a}, {n}, {m}" "dnma:r d!=a";
    }
    UMLAL MultiplyAddLong "d a = n m d a" {
        T1 V7EM "111110111110nnnn ddddaaaa0000mmmm" "umlal{c} {d}, {a}, {n}, {m}" "dnma:r d!=a";
    }
    UMAAL MultiplyAddLong "d a = n m d a" {
        T1 V7EM "111110111110nnnn ddddaaaa0110mmmm" "umaal{c} {d}, {a}, {n}, {m}" "dnma:r d!=a";
    }
    SDIV Divide "d = n m" { T1 V7EM "111110111001nnnn (1)(1)(1)(1)dddd1111mmmm" "sdiv{c} {d}, {n}, {m}" "dnm:r"; }
    UDIV Divide "d = n m" { T1 V7EM "111110111011nnnn (1)(1)(1)(1)dddd1111mmmm" "udiv{c} {d}, {n}, {m}" "dnm:r"; }

    // Loads.
    LDR_immediate Load "t = n" {
        T1 V6M  "01101iiiiinnnttt" "ldr{c} {t}, {mem}" "x4";
        T2 V6M  "10011tttiiiiiiii" "ldr{c} {t}, {mem}" "n=sp x4";
        T3 V7EM "111110001101nnnn ttttiiiiiiiiiiii" "ldr{c}.w {t}, {mem}" "see:n15 last-pc";
        T4 V7EM "111110000101nnnn tttt1PUWiiiiiiii" "ldr{c} {t}, {mem}" "see:n15 see:pw00 wb!=t last-pc";
    }
    LDR_literal Load "t = pc" {
        T1 V6M  "01001tttiiiiiiii" "ldr{c} {t}, {lit}" "x4";
        T2 V7EM "11111000U1011111 ttttiiiiiiiiiiii" "ldr{c}.w {t}, {lit}" "last-pc pc:x4";
    }
    LDR_register Load "t = n m" {
        T1 V6M  "0101100mmmnnnttt" "ldr{c} {t}, [{n}, {m}]" "";
        T2 V7EM "111110000101nnnn tttt000000kkmmmm" "ldr{c}.w {t}, [{n}, {m}{shift}]" "see:n15 m:r last-pc";
    }
    LDRB_immediate Load "t = n" {
        T1 V6M  "01111iiiiinnnttt" "ldrb{c} {t}, {mem}" "";
        T2 V7EM "111110001001nnnn ttttiiiiiiiiiiii" "ldrb{c}.w {t}, {mem}" "see:n15 t:r";
        T3 V7EM "111110000001nnnn tttt1PUWiiiiiiii" "ldrb{c} {t}, {mem}" "see:n15 see:pw00 wb!=t t:r";
    }
    LDRB_literal Load "t = pc" { T1 V7EM "11111000U0011111 ttttiiiiiiiiiiii" "ldrb{c}.w {t}, {lit}" "t:r"; }
    LDRB_register Load "t = n m" {
        T1 V6M  "0101110mmmnnnttt" "ldrb{c} {t}, [{n}, {m}]" "";
        T2 V7EM "111110000001nnnn tttt000000kkmmmm" "ldrb{c}.w {t}, [{n}, {m}{shift}]" "see:n15 tm:r";
    }
    LDRH_immediate Load "t = n" {
        T1 V6M  "10001iiiiinnnttt" "ldrh{c} {t}, {mem}" "x2";
        T2 V7EM "111110001011nnnn ttttiiiiiiiiiiii" "ldrh{c}.w {t}, {mem}" "see:n15 t:r";
        T3 V7EM "111110000011nnnn tttt1PUWiiiiiiii" "ldrh{c} {t}, {mem}" "see:n15 see:pw00 wb!=t t:r";
    }
    LDRH_literal Load "t = pc" { T1 V7EM "11111000U0111111 ttttiiiiiiiiiiii" "ldrh{c}.w {t}, {lit}" "t:r"; }
    LDRH_register Load "t = n m" {
        T1 V6M  "0101101mmmnnnttt" "ldrh{c} {t}, [{n}, {m}]" "";
        T2 V7EM "111110000011nnnn tttt000000kkmmmm" "ldrh{c}.w {t}, [{n}, {m}{shift}]" "see:n15 tm:r";
    }
    LDRSB_immediate Load "t = n" {
        T1 V7EM "111110011001nnnn ttttiiiiiiiiiiii" "ldrsb{c}.w {t}, {mem}" "see:n15 t:r";
        T2 V7EM "111110010001nnnn tttt1PUWiiiiiiii" "ldrsb{c} {t}, {mem}" "see:n15 see:pw00 wb!=t t:r";
    }
    LDRSB_literal Load "t = pc" { T1 V7EM "11111001U0011111 ttttiiiiiiiiiiii" "ldrsb{c}.w {t}, {lit}" "t:r"; }
    LDRSB_register Load "t = n m" {
        T1 V6M  "0101011mmmnnnttt" "ldrsb{c} {t}, [{n}, {m}]" "";
        T2 V7EM "111110010001nnnn tttt000000kkmmmm" "ldrsb{c}.w {t}, [{n}, {m}{shift}]" "see:n15 tm:r";
    }
    LDRSH_immediate Load "t = n" {
        T1 V7EM "111110011011nnnn ttttiiiiiiiiiiii" "ldrsh{c}.w {t}, {mem}" "see:n15 t:r";
        T2 V7EM "111110010011nnnn tttt1PUWiiiiiiii" "ldrsh{c} {t}, {mem}" "see:n15 see:pw00 wb!=t t:r";
    }
    LDRSH_literal Load "t = pc" { T1 V7EM "11111001U0111111 ttttiiiiiiiiiiii" "ldrsh{c}.w {t}, {lit}" "t:r"; }
    LDRSH_register Load "t = n m" {
        T1 V6M  "0101111mmmnnnttt" "ldrsh{c} {t}, [{n}, {m}]" "";
        T2 V7EM "111110010011nnnn tttt000000kkmmmm" "ldrsh{c}.w {t}, [{n}, {m}{shift}]" "see:n15 tm:r";
    }
    LDRT Load "t = n" { T1 V7EM "111110000101nnnn tttt1110iiiiiiii" "ldrt{c} {t}, {mem}" "see:n15 t:r"; }
    LDRBT Load "t = n" { T1 V7EM "111110000001nnnn tttt1110iiiiiiii" "ldrbt{c} {t}, {mem}" "see:n15 t:r"; }
    LDRHT Load "t = n" { T1 V7EM "111110000011nnnn tttt1110iiiiiiii" "ldrht{c} {t}, {mem}" "see:n15 t:r"; }
    LDRSBT Load "t = n" { T1 V7EM "111110010001nnnn tttt1110iiiiiiii" "ldrsbt{c} {t}, {mem}" "see:n15 t:r"; }
    LDRSHT Load "t = n" { T1 V7EM "111110010011nnnn tttt1110iiiiiiii" "ldrsht{c} {t}, {mem}" "see:n15 t:r"; }
    LDRD_immediate LoadDual "t t2 = n" {
        T1 V7EM "1110100PU1W1nnnn ttttuuuuiiiiiiii" "ldrd{c} {t}, {t2}, {mem}" "x4 see:n15 see:pw00 tu:r t!=t2 wb!=t";
    }
    LDRD_literal LoadDual "t t2 = pc" {
        T1 V7EM "1110100PU1W11111 ttttuuuuiiiiiiii" "ldrd{c} {t}, {t2}, {lit}" "x4 see:pw00 tu:r t!=t2 no-wb";
    }
    LDM LoadMultiple "list = n" {
        T1 V6M  "11001nnnrrrrrrrr" "ldm{c} {n}{w}, {list}" "w=list list1";
        T2 V7EM "1110100010W1nnnn rr(0)rrrrrrrrrrrrr" "ldm{c}.w {n}{w}, {list}" "n:p list2 pc|lr wb!=list last-pc";
    }
    LDMDB LoadMultiple "list = n" {
        T1 V7EM "1110100100W1nnnn rr(0)rrrrrrrrrrrrr" "ldmdb{c} {n}{w}, {list}" "n:p list2 pc|lr wb!=list last-pc";
    }
    POP LoadMultiple "list = n" {
        T1 V6M  "1011110rrrrrrrrr" "pop{c} {list}" "n=sp w=1 pc list1 last-pc";
        T2 V7EM "1110100010111101 rr(0)rrrrrrrrrrrrr" "pop{c}.w {list}" "n=sp w=1 list2 pc|lr last-pc";
        T3 V7EM "1111100001011101 rrrr101100000100" "pop{c}.w {list}" "n=sp w=1 one list!=sp last-pc";
    }
    LDREX LoadOrdered "t = n" {
        T1 V7EM "111010000101nnnn tttt(1)(1)(1)(1)iiiiiiii" "ldrex{c} {t}, {mem}" "x4 t:r n:p";
    }
    LDREXB LoadOrdered "t = n" {
        T1 V7EM "111010001101nnnn tttt(1)(1)(1)(1)0100(1)(1)(1)(1)" "ldrexb{c} {t}, [{n}]" "t:r n:p";
    }
    LDREXH LoadOrdered "t = n" {
        T1 V7EM "111010001101nnnn tttt(1)(1)(1)(1)0101(1)(1)(1)(1)" "ldrexh{c} {t}, [{n}]" "t:r n:p";
    }
    LDAB LoadOrdered "t = n" {
        T1 V8M "111010001101nnnn tttt(1)(1)(1)(1)1000(1)(1)(1)(1)" "ldab{c} {t}, [{n}]" "t:r n:p";
    }
    LDAH LoadOrdered "t = n" {
        T1 V8M "111010001101nnnn tttt(1)(1)(1)(1)1001(1)(1)(1)(1)" "ldah{c} {t}, [{n}]" "t:r n:p";
    }
    LDA LoadOrdered "t = n" {
        T1 V8M "111010001101nnnn tttt(1)(1)(1)(1)1010(1)(1)(1)(1)" "lda{c} {t}, [{n}]" "t:r n:p";
    }
    LDAEXB LoadOrdered "t = n" {
        T1 V8M "111010001101nnnn tttt(1)(1)(1)(1)1100(1)(1)(1)(1)" "ldaexb{c} {t}, [{n}]" "t:r n:p";
    }
    LDAEXH LoadOrdered "t = n" {
        T1 V8M "111010001101nnnn tttt(1)(1)(1)(1)1101(1)(1)(1)(1)" "ldaexh{c} {t}, [{n}]" "t:r n:p";
    }
    LDAEX LoadOrdered "t = n" {
        T1 V8M "111010001101nnnn tttt(1)(1)(1)(1)1110(1)(1)(1)(1)" "ldaex{c} {t}, [{n}]" "t:r n:p";
    }

    // Stores.
    STR_immediate Store "= t n" {
        T1 V6M  "01100iiiiinnnttt" "str{c} {t}, {mem}" "x4";
        T2 V6M  "10010tttiiiiiiii" "str{c} {t}, {mem}" "n=sp x4";
        T3 V7EM "111110001100nnnn ttttiiiiiiiiiiii" "str{c}.w {t}, {mem}" "see:n15 t:p";
        T4 V7EM "111110000100nnnn tttt1PUWiiiiiiii" "str{c} {t}, {mem}" "see:n15 see:pw00 wb!=t t:p";
    }
    STR_register Store "= t n m" {
        T1 V6M  "0101000mmmnnnttt" "str{c} {t}, [{n}, {m}]" "";
        T2 V7EM "111110000100nnnn tttt000000kkmmmm" "str{c}.w {t}, [{n}, {m}{shift}]" "see:n15 t:p m:r";
    }
    STRB_immediate Store "= t n" {
        T1 V6M  "01110iiiiinnnttt" "strb{c} {t}, {mem}" "";
        T2 V7EM "111110001000nnnn ttttiiiiiiiiiiii" "strb{c}.w {t}, {mem}" "see:n15 t:r";
        T3 V7EM "111110000000nnnn tttt1PUWiiiiiiii" "strb{c} {t}, {mem}" "see:n15 see:pw00 wb!=t t:r";
    }
    STRB_register Store "= t n m" {
        T1 V6M  "0101010mmmnnnttt" "strb{c} {t}, [{n}, {m}]" "";
        T2 V7EM "111110000000nnnn tttt000000kkmmmm" "strb{c}.w {t}, [{n}, {m}{shift}]" "see:n15 tm:r";
    }
    STRH_immediate Store "= t n" {
        T1 V6M  "10000iiiiinnnttt" "strh{c} {t}, {mem}" "x2";
        T2 V7EM "111110001010nnnn ttttiiiiiiiiiiii" "strh{c}.w {t}, {mem}" "see:n15 t:r";
        T3 V7EM "111110000010nnnn tttt1PUWiiiiiiii" "strh{c} {t}, {mem}" "see:n15 see:pw00 wb!=t t:r";
    }
    STRH_register Store "= t n m" {
        T1 V6M  "0101001mmmnnnttt" "strh{c} {t}, [{n}, {m}]" "";
        T2 V7EM "111110000010nnnn tttt000000kkmmmm" "strh{c}.w {t}, [{n}, {m}{shift}]" "see:n15 tm:r";
    }
    STRT Store "= t n" { T1 V7EM "111110000100nnnn tttt1110iiiiiiii" "strt{c} {t}, {mem}" "see:n15 t:r"; }
    STRBT Store "= t n" { T1 V7EM "111110000000nnnn tttt1110iiiiiiii" "strbt{c} {t}, {mem}" "see:n15 t:r"; }
    STRHT Store "= t n" { T1 V7EM "111110000010nnnn tttt1110iiiiiiii" "strht{c} {t}, {mem}" "see:n15 t:r"; }
    STRD_immediate StoreDual "= t t2 n" {
        T1 V7EM "1110100PU1W0nnnn ttttuuuuiiiiiiii" "strd{c} {t}, {t2}, {mem}" "x4 see:pw00 n:p tu:r wb!=t";
    }
    STM StoreMultiple "= list n" {
        T1 V6M  "11000nnnrrrrrrrr" "stm{c} {n}!, {list}" "w=1 list1";
        T2 V7EM "1110100010W0nnnn (0)r(0)rrrrrrrrrrrrr" "stm{c}.w {n}{w}, {list}" "n:p list2 wb!=list";
    }
    STMDB StoreMultiple "= list n" {
        T1 V7EM "1110100100W0nnnn (0)r(0)rrrrrrrrrrrrr" "stmdb{c} {n}{w}, {list}" "n:p list2 wb!=list";
    }
    PUSH StoreMultiple "= list n" {
        T1 V6M  "1011010rrrrrrrrr" "push{c} {list}" "n=sp w=1 lr list1";
        T2 V7EM "1110100100101101 (0)r(0)rrrrrrrrrrrrr" "push{c}.w {list}" "n=sp w=1 list2";
        T3 V7EM "1111100001001101 rrrr110100000100" "push{c}.w {list}" "n=sp w=1 one list!=sp list!=pc";
    }
    STREX StoreOrdered "d = t n" {
        T1 V7EM "111010000100nnnn ttttddddiiiiiiii" "strex{c} {d}, {t}, {mem}" "x4 dt:r n:p d!=n d!=t";
    }
    STREXB StoreOrdered "d = t n" {
        T1 V7EM "111010001100nnnn tttt(1)(1)(1)(1)0100dddd" "strexb{c} {d}, {t}, [{n}]" "dt:r n:p d!=n d!=t";
    }
    STREXH StoreOrdered "d = t n" {
        T1 V7EM "111010001100nnnn tttt(1)(1)(1)(1)0101dddd" "strexh{c} {d}, {t}, [{n}]" "dt:r n:p d!=n d!=t";
    }
    STLB StoreOrdered "= t n" {
        T1 V8M "111010001100nnnn tttt(1)(1)(1)(1)1000(1)(1)(1)(1)" "stlb{c} {t}, [{n}]" "t:r n:p";
    }
    STLH StoreOrdered "= t n" {
        T1 V8M "111010001100nnnn tttt(1)(1)(1)(1)1001(1)(1)(1)(1)" "stlh{c} {t}, [{n}]" "t:r n:p";
    }
    STL StoreOrdered "= t n" {
        T1 V8M "111010001100nnnn tttt(1)(1)(1)(1)1010(1)(1)(1)(1)" "stl{c} {t}, [{n}]" "t:r n:p";
    }
    STLEXB StoreOrdered "d = t n" {
        T1 V8M "111010001100nnnn tttt(1)(1)(1)(1)1100dddd" "stlexb{c} {d}, {t}, [{n}]" "dt:r n:p d!=n d!=t";
    }
    STLEXH StoreOrdered "d = t n" {
        T1 V8M "111010001100nnnn tttt(1)(1)(1)(1)1101dddd" "stlexh{c} {d}, {t}, [{n}]" "dt:r n:p d!=n d!=t";
    }
    STLEX StoreOrdered "d = t n" {
        T1 V8M "111010001100nnnn tttt(1)(1)(1)(1)1110dddd" "stlex{c} {d}, {t}, [{n}]" "dt:r n:p d!=n d!=t";
    }

    // Memory hints. Those without a name do nothing.
    PLD_immediate Preload "= n" {
        T1 V7EM "111110001001nnnn 1111iiiiiiiiiiii" "pld{c} {mem}" "see:n15";
        T2 V7EM "111110000001nnnn 11111100iiiiiiii" "pld{c} {mem}" "u=0 see:n15";
    }
    PLD_literal Preload "= pc" { T1 V7EM "11111000U0011111 1111iiiiiiiiiiii" "pld{c} {lit}" ""; }
    PLD_register Preload "= n m" {
        T1 V7EM "111110000001nnnn 1111000000kkmmmm" "pld{c} [{n}, {m}{shift}]" "see:n15 m:r";
    }
    PLDW_immediate Preload "= n" {
        T1 V8M "111110001011nnnn 1111iiiiiiiiiiii" "pldw{c} {mem}" "see:n15";
        T2 V8M "111110000011nnnn 11111100iiiiiiii" "pldw{c} {mem}" "u=0 see:n15";
    }
    PLDW_register Preload "= n m" {
        T1 V8M "111110000011nnnn 1111000000kkmmmm" "pldw{c} [{n}, {m}{shift}]" "see:n15 m:r";
    }
    PLI_immediate Preload "= n" {
        T1 V7EM "111110011001nnnn 1111iiiiiiiiiiii" "pli{c} {mem}" "see:n15";
        T2 V7EM "111110010001nnnn 11111100iiiiiiii" "pli{c} {mem}" "u=0 see:n15";
    }
    PLI_literal Preload "= pc" { T3 V7EM "11111001U0011111 1111iiiiiiiiiiii" "pli{c} {lit}" ""; }
    PLI_register Preload "= n m" {
        T1 V7EM "111110010001nnnn 1111000000kkmmmm" "pli{c} [{n}, {m}{shift}]" "see:n15 m:r";
    }
    HINT_memory Nop "=" {
        T1 V7EM "1111100i1011nnnn 1111iiiiiiiiiiii" "{inst}" "see:n15";
        T2 V7EM "1111100i0011nnnn 11111100iiiiiiii" "{inst}" "see:n15";
        T3 V7EM "1111100i0011nnnn 1111000000iimmmm" "{inst}" "see:n15 m:r";
        T4 V7EM "1111100iU0111111 1111iiiiiiiiiiii" "{inst}" "";
    }

    // Branches.
    B Branch "pc =" {
        T1 V6M  "1101cccciiiiiiii" "b{c} {to}" "rel see:c111x no-it";
        T2 V6M  "11100iiiiiiiiiii" "b{c} {to}" "rel last";
        T3 V7EM "11110icccciiiiii 10i0iiiiiiiiiiii" "b{c}.w {to}" "rel20 see:c111x no-it";
        T4 V7EM "11110iiiiiiiiiii 10i1iiiiiiiiiiii" "b{c}.w {to}" "rel24 last";
    }
    BL BranchLink "lr pc =" { T1 V6M "11110iiiiiiiiiii 11i1iiiiiiiiiiii" "bl{c} {to}" "rel24 last"; }
    BLX BranchLink "lr pc = m" { T1 V6M "010001111mmmm(0)(0)(0)" "blx{c} {m}" "m:p last"; }
    BLXNS BranchLink "lr pc = m" { T1 V8M "010001111mmmm1(0)(0)" "blxns{c} {m}" "m:r last"; }
    BX BranchRegister "pc = m" { T1 V6M "010001110mmmm(0)(0)(0)" "bx{c} {m}" "last"; }
    BXNS BranchRegister "pc = m" { T1 V8M "010001110mmmm1(0)(0)" "bxns{c} {m}" "m:r last"; }
    CBZ CompareBranch "pc = n" { T1 V7EM "101100i1iiiiinnn" "cbz {n}, {to}" "x2 no-it"; }
    CBNZ CompareBranch "pc = n" { T1 V7EM "101110i1iiiiinnn" "cbnz {n}, {to}" "x2 no-it"; }
    TBB TableBranch "pc = n m" {
        T1 V7EM "111010001101nnnn (1)(1)(1)(1)(0)(0)(0)(0)0000mmmm" "tbb{c} [{n}, {m}]" "n:s m:r last";
    }
    TBH TableBranch "pc = n m" {
        T1 V7EM "111010001101nnnn (1)(1)(1)(1)(0)(0)(0)(0)0001mmmm" "tbh{c} [{n}, {m}, lsl #1]" "n:s m:r last";
    }
    IT It "=" { T1 V7EM "10111111iiiiiiii" "it{it}" "it no-it"; }

    // Hints and barriers.
    NOP Nop "=" {
        T1 V6M  "1011111100000000" "nop{c}" "";
        T2 V7EM "111100111010(1)(1)(1)(1) 10(0)0(0)00000000000" "nop{c}.w" "";
    }
    YIELD Wait "=" {
        T1 V6M  "1011111100010000" "yield{c}" "";
        T2 V7EM "111100111010(1)(1)(1)(1) 10(0)0(0)00000000001" "yield{c}.w" "";
    }
    WFE Wait "=" {
        T1 V6M  "1011111100100000" "wfe{c}" "";
        T2 V7EM "111100111010(1)(1)(1)(1) 10(0)0(0)00000000010" "wfe{c}.w" "";
    }
    WFI Wait "=" {
        T1 V6M  "1011111100110000" "wfi{c}" "";
        T2 V7EM "111100111010(1)(1)(1)(1) 10(0)0(0)00000000011" "wfi{c}.w" "";
    }
    SEV Wait "=" {
        T1 V6M  "1011111101000000" "sev{c}" "";
        T2 V7EM "111100111010(1)(1)(1)(1) 10(0)0(0)00000000100" "sev{c}.w" "";
    }
    CSDB Barrier "=" { T1 V8M "111100111010(1)(1)(1)(1) 10(0)0(0)00000010100" "csdb" "no-it"; }
    DBG Nop "=" { T1 V7EM "111100111010(1)(1)(1)(1) 10(0)0(0)0001111iiii" "dbg{c} #{i}" ""; }
    HINT Nop "=" {
        T1 V6M  "10111111iiii0000" "nop{c} {hint}" "";
        T2 V7EM "111100111010(1)(1)(1)(1) 10(0)0(0)000iiiiiiii" "nop{c}.w {hint}" "";
    }
    CLREX Barrier "=" { T1 V7EM "111100111011(1)(1)(1)(1) 10(0)0(1)(1)(1)(1)0010(1)(1)(1)(1)" "clrex{c}" ""; }
    DSB Barrier "=" { T1 V6M "111100111011(1)(1)(1)(1) 10(0)0(1)(1)(1)(1)0100iiii" "dsb{c} {barrier}" ""; }
    DMB Barrier "=" { T1 V6M "111100111011(1)(1)(1)(1) 10(0)0(1)(1)(1)(1)0101iiii" "dmb{c} {barrier}" ""; }
    ISB Barrier "=" { T1 V6M "111100111011(1)(1)(1)(1) 10(0)0(1)(1)(1)(1)0110iiii" "isb{c} {barrier}" ""; }

    // System. imm is the special register, amount the mask of MSR.
    CPS Special "=" { T1 V6M "10110110011i(0)(0)kk" "cps{ie} {if}" "no-it cps"; }
    MRS Special "d = banked NZCV Q GE" {
        T1 V6M "11110011111(0)(1)(1)(1)(1) 10(0)0ddddiiiiiiii" "mrs{c} {d}, {special}" "d:r sysm";
    }
    MSR Special "banked = n" {
        T1 V6M "11110011100(0)nnnn 10(0)0kk(0)(0)iiiiiiii" "msr{c} {special}, {n}" "n:r sysm mask";
    }
    MSR_APSR Special "NZCV Q GE = n NZCV Q GE" {
        T1 V6M "11110011100(0)nnnn 10(0)0kk(0)(0)000000ii" "msr{c} {special}{bits}, {n}" "s=1 n:r sysm mask";
    }
    SVC Exception "=" { T1 V6M "11011111iiiiiiii" "svc{c} #{i}" ""; }
    BKPT Exception "=" { T1 V6M "10111110iiiiiiii" "bkpt #{i}" "always"; }
    UDF Exception "=" {
        T1 V6M "11011110iiiiiiii" "udf{c} #{i}" "";
        T2 V6M "111101111111iiii 1010iiiiiiiiiiii" "udf{c}.w #{i}" "";
    }

    // Security extension.
    SG Security "=" { T1 V8M "1110100101111111 1110100101111111" "sg{c}" ""; }
    TT Security "d = n" { T1 V8M "111010000100nnnn 1111dddd00(0)(0)(0)(0)(0)(0)" "tt{c} {d}, {n}" "d:r n:p"; }
    TTT Security "d = n" { T1 V8M "111010000100nnnn 1111dddd01(0)(0)(0)(0)(0)(0)" "ttt{c} {d}, {n}" "d:r n:p"; }
    TTA Security "d = n" { T1 V8M "111010000100nnnn 1111dddd10(0)(0)(0)(0)(0)(0)" "tta{c} {d}, {n}" "d:r n:p"; }
    TTAT Security "d = n" { T1 V8M "111010000100nnnn 1111dddd11(0)(0)(0)(0)(0)(0)" "ttat{c} {d}, {n}" "d:r n:p"; }
    VLSTM Security "= n Sall F" { T1 V8M "111011000010nnnn 00001010(0)(0)(0)(0)(0)(0)(0)(0)" "vlstm{c} {n}" "n:p"; }
    VLLDM Security "Sall F = n" { T1 V8M "111011000011nnnn 00001010(0)(0)(0)(0)(0)(0)(0)(0)" "vlldm{c} {n}" "n:p"; }

    // Coprocessors: a is the coprocessor, d, n and m its registers, imm and amount its opcodes.
    CDP Coprocessor "=" {
        T1 V7EM "11101110iiiinnnn ddddaaaakkk0mmmm" "cdp{c} {cp}, #{i}, {Cd}, {Cn}, {Cm}, #{k}" "see:cp101x";
    }
    CDP2 Coprocessor "=" {
        T2 V7EM "11111110iiiinnnn ddddaaaakkk0mmmm" "cdp2{c} {cp}, #{i}, {Cd}, {Cn}, {Cm}, #{k}" "see:cp101x";
    }
    MCR Coprocessor "= t" {
        T1 V7EM "11101110iii0nnnn ttttaaaakkk1mmmm" "mcr{c} {cp}, #{i}, {t}, {Cn}, {Cm}, #{k}" "see:cp101x t:r";
    }
    MCR2 Coprocessor "= t" {
        T2 V7EM "11111110iii0nnnn ttttaaaakkk1mmmm" "mcr2{c} {cp}, #{i}, {t}, {Cn}, {Cm}, #{k}" "see:cp101x t:r";
    }
    MCRR Coprocessor "= t t2" {
        T1 V7EM "111011000100uuuu ttttaaaaiiiimmmm" "mcrr{c} {cp}, #{i}, {t}, {t2}, {Cm}" "see:cp101x tu:r";
    }
    MCRR2 Coprocessor "= t t2" {
        T2 V7EM "111111000100uuuu ttttaaaaiiiimmmm" "mcrr2{c} {cp}, #{i}, {t}, {t2}, {Cm}" "see:cp101x tu:r";
    }
    MRC Coprocessor "t =" {
        T1 V7EM "11101110iii1nnnn ttttaaaakkk1mmmm" "mrc{c} {cp}, #{i}, {t}, {Cn}, {Cm}, #{k}" "see:cp101x t:r";
    }
    MRC_APSR Coprocessor "NZCV =" {
        T1 V7EM "11101110iii1nnnn 1111aaaakkk1mmmm" "mrc{c} {cp}, #{i}, apsr_nzcv, {Cn}, {Cm}, #{k}" "s=1 see:cp101x";
    }
    MRC2 Coprocessor "t =" {
        T2 V7EM "11111110iii1nnnn ttttaaaakkk1mmmm" "mrc2{c} {cp}, #{i}, {t}, {Cn}, {Cm}, #{k}" "see:cp101x t:r";
    }
    MRC2_APSR Coprocessor "NZCV =" {
        T2 V7EM "11111110iii1nnnn 1111aaaakkk1mmmm" "mrc2{c} {cp}, #{i}, apsr_nzcv, {Cn}, {Cm}, #{k}" "s=1 see:cp101x";
    }
    MRRC Coprocessor "t t2 =" {
        T1 V7EM "111011000101uuuu ttttaaaaiiiimmmm" "mrrc{c} {cp}, #{i}, {t}, {t2}, {Cm}" "see:cp101x tu:r t!=t2";
    }
    MRRC2 Coprocessor "t t2 =" {
        T2 V7EM "111111000101uuuu ttttaaaaiiiimmmm" "mrrc2{c} {cp}, #{i}, {t}, {t2}, {Cm}" "see:cp101x tu:r t!=t2";
    }
    LDC Coprocessor "= n" {
        T1 V7EM "1110110PUkW1nnnn ddddaaaaiiiiiiii" "ldc{l}{c} {cp}, {Cd}, {mem}" "x4 see:puw000 see:cp101x wb!=pc";
    }
    LDC2 Coprocessor "= n" {
        T2 V7EM "1111110PUkW1nnnn ddddaaaaiiiiiiii" "ldc2{l}{c} {cp}, {Cd}, {mem}" "x4 see:puw000 see:cp101x wb!=pc";
    }
    LDC_option Coprocessor "= n" {
        T1 V7EM "111011001k01nnnn ddddaaaaiiiiiiii" "ldc{l}{c} {cp}, {Cd}, [{n}], {option}" "see:cp101x n:p";
    }
    LDC2_option Coprocessor "= n" {
        T2 V7EM "111111001k01nnnn ddddaaaaiiiiiiii" "ldc2{l}{c} {cp}, {Cd}, [{n}], {option}" "see:cp101x n:p";
    }
    STC Coprocessor "= n" {
        T1 V7EM "1110110PUkW0nnnn ddddaaaaiiiiiiii" "stc{l}{c} {cp}, {Cd}, {mem}" "x4 see:puw000 see:cp101x n:p";
    }
    STC2 Coprocessor "= n" {
        T2 V7EM "1111110PUkW0nnnn ddddaaaaiiiiiiii" "stc2{l}{c} {cp}, {Cd}, {mem}" "x4 see:puw000 see:cp101x n:p";
    }
    STC_option Coprocessor "= n" {
        T1 V7EM "111011001k00nnnn ddddaaaaiiiiiiii" "stc{l}{c} {cp}, {Cd}, [{n}], {option}" "see:cp101x n:p";
    }
    STC2_option Coprocessor "= n" {
        T2 V7EM "111111001k00nnnn ddddaaaaiiiiiiii" "stc2{l}{c} {cp}, {Cd}, [{n}], {option}" "see:cp101x n:p";
    }

    // Floating point: arithmetic.
    VABS FloatAlu "Sd = Sm" { T1 V7EM "111011101D110000 DDDD101011M0MMMM" "vabs{c}.f32 {Sd}, {Sm}" ""; }
    VADD FloatAlu "Sd = Sn Sm" { T1 V7EM "111011100D11NNNN DDDD1010N0M0MMMM" "vadd{c}.f32 {Sd}, {Sn}, {Sm}" ""; }
    VDIV FloatDivide "Sd = Sn Sm" { T1 V7EM "111011101D00NNNN DDDD1010N0M0MMMM" "vdiv{c}.f32 {Sd}, {Sn}, {Sm}" ""; }
    VFMA FloatMultiplyAdd "Sd = Sd Sn Sm" {
        T1 V7EM "111011101D10NNNN DDDD1010N0M0MMMM" "vfma{c}.f32 {Sd}, {Sn}, {Sm}" "";
    }
    VFMS FloatMultiplyAdd "Sd = Sd Sn Sm" {
        T1 V7EM "111011101D10NNNN DDDD1010N1M0MMMM" "vfms{c}.f32 {Sd}, {Sn}, {Sm}" "";
    }
    VFNMA FloatMultiplyAdd "Sd = Sd Sn Sm" {
        T1 V7EM "111011101D01NNNN DDDD1010N1M0MMMM" "vfnma{c}.f32 {Sd}, {Sn}, {Sm}" "";
    }
    VFNMS FloatMultiplyAdd "Sd = Sd Sn Sm" {
        T1 V7EM "111011101D01NNNN DDDD1010N0M0MMMM" "vfnms{c}.f32 {Sd}, {Sn}, {Sm}" "";
    }
    VMAXNM FloatAlu "Sd = Sn Sm" { T1 V8M "111111101D00NNNN DDDD1010N0M0MMMM" "vmaxnm.f32 {Sd}, {Sn}, {Sm}" "no-it"; }
    VMINNM FloatAlu "Sd = Sn Sm" { T1 V8M "111111101D00NNNN DDDD1010N1M0MMMM" "vminnm.f32 {Sd}, {Sn}, {Sm}" "no-it"; }
    VMLA FloatMultiplyAdd "Sd = Sd Sn Sm" {
        T1 V7EM "111011100D00NNNN DDDD1010N0M0MMMM" "vmla{c}.f32 {Sd}, {Sn}, {Sm}" "";
    }
    VMLS FloatMultiplyAdd "Sd = Sd Sn Sm" {
        T1 V7EM "111011100D00NNNN DDDD1010N1M0MMMM" "vmls{c}.f32 {Sd}, {Sn}, {Sm}" "";
    }
    VMUL FloatAlu "Sd = Sn Sm" { T1 V7EM "111011100D10NNNN DDDD1010N0M0MMMM" "vmul{c}.f32 {Sd}, {Sn}, {Sm}" ""; }
    VNEG FloatAlu "Sd = Sm" { T1 V7EM "111011101D110001 DDDD101001M0MMMM" "vneg{c}.f32 {Sd}, {Sm}" ""; }
    VNMLA FloatMultiplyAdd "Sd = Sd Sn Sm" {
        T1 V7EM "111011100D01NNNN DDDD1010N1M0MMMM" "vnmla{c}.f32 {Sd}, {Sn}, {Sm}" "";
    }
    VNMLS FloatMultiplyAdd "Sd = Sd Sn Sm" {
        T1 V7EM "111011100D01NNNN DDDD1010N0M0MMMM" "vnmls{c}.f32 {Sd}, {Sn}, {Sm}" "";
    }
    VNMUL FloatAlu "Sd = Sn Sm" { T2 V7EM "111011100D10NNNN DDDD1010N1M0MMMM" "vnmul{c}.f32 {Sd}, {Sn}, {Sm}" ""; }
    VSQRT FloatDivide "Sd = Sm" { T1 V7EM "111011101D110001 DDDD101011M0MMMM" "vsqrt{c}.f32 {Sd}, {Sm}" ""; }
    VSUB FloatAlu "Sd = Sn Sm" { T1 V7EM "111011100D11NNNN DDDD1010N1M0MMMM" "vsub{c}.f32 {Sd}, {Sn}, {Sm}" ""; }

    // Floating point: comparison, rounding, conversion. imm tells signed, amount the rest of the
    // opcode.
    VCMP FloatCompare "F = Sd Sm" {
        T1 V7EM "111011101D110100 DDDD1010k1M0MMMM" "vcmp{e}{c}.f32 {Sd}, {Sm}" "";
    }
    VCMP_zero FloatCompare "F = Sd" {
        T2 V7EM "111011101D110101 DDDD1010k1(0)0(0)(0)(0)(0)" "vcmp{e}{c}.f32 {Sd}, #0.0" "";
    }
    VRINTX FloatAlu "Sd = Sm" { T1 V8M "111011101D110111 DDDD101001M0MMMM" "vrintx{c}.f32 {Sd}, {Sm}" ""; }
    VRINTR FloatAlu "Sd = Sm" { T1 V8M "111011101D110110 DDDD101001M0MMMM" "vrintr{c}.f32 {Sd}, {Sm}" ""; }
    VRINTZ FloatAlu "Sd = Sm" { T1 V8M "111011101D110110 DDDD101011M0MMMM" "vrintz{c}.f32 {Sd}, {Sm}" ""; }
    VRINT_directed FloatAlu "Sd = Sm" {
        T1 V8M "111111101D1110kk DDDD101001M0MMMM" "vrint{anpm}.f32 {Sd}, {Sm}" "no-it";
    }
    VCVT_directed FloatConvert "Sd = Sm" {
        T1 V8M "111111101D1111kk DDDD1010i1M0MMMM" "vcvt{anpm}.{us}32.f32 {Sd}, {Sm}" "no-it";
    }
    VCVT_integer_to_single FloatConvert "Sd = Sm" {
        T1 V7EM "111011101D111000 DDDD1010i1M0MMMM" "vcvt{c}.f32.{us}32 {Sd}, {Sm}" "";
    }
    VCVT_single_to_integer FloatConvert "Sd = Sm" {
        T1 V7EM "111011101D11110i DDDD101011M0MMMM" "vcvt{c}.{us}32.f32 {Sd}, {Sm}" "";
    }
    VCVTR FloatConvert "Sd = Sm" { T1 V7EM "111011101D11110i DDDD101001M0MMMM" "vcvtr{c}.{us}32.f32 {Sd}, {Sm}" ""; }
    VCVT_fixed_to_single FloatConvert "Sd = Sd" {
        T1 V7EM "111011101D11101k DDDD1010k1i0iiii" "vcvt{c}.f32.{fixed} {Sd}, {Sd}, #{i}" "fbits";
    }
    VCVT_single_to_fixed FloatConvert "Sd = Sd" {
        T1 V7EM "111011101D11111k DDDD1010k1i0iiii" "vcvt{c}.{fixed}.f32 {Sd}, {Sd}, #{i}" "fbits";
    }
    VCVT_half_to_single FloatConvert "Sd = Sm" {
        T1 V7EM "111011101D110010 DDDD1010i1M0MMMM" "vcvt{y}{c}.f32.f16 {Sd}, {Sm}" "";
    }
    VCVT_single_to_half FloatConvert "Sd = Sd Sm" {
        T1 V7EM "111011101D110011 DDDD1010i1M0MMMM" "vcvt{y}{c}.f16.f32 {Sd}, {Sm}" "";
    }

    // Floating point: moves. A half of a double register is the single register in its place.
    VMOV_immediate FloatMove "Sd =" {
        T1 V7EM "111011101D11iiii DDDD1010(0)0(0)0iiii" "vmov{c}.f32 {Sd}, {float}" "float";
    }
    VMOV_register FloatMove "Sd = Sm" { T1 V7EM "111011101D110000 DDDD101001M0MMMM" "vmov{c}.f32 {Sd}, {Sm}" ""; }
    VSEL FloatMove "Sd = Sn Sm NZCV" {
        T1 V8M "111111100DiiNNNN DDDD1010N0M0MMMM" "vsel{sel}.f32 {Sd}, {Sn}, {Sm}" "no-it";
    }
    VMOV_core_to_single FloatTransfer "Sn = t" {
        T1 V7EM "111011100000NNNN tttt1010N(0)(0)1(0)(0)(0)(0)" "vmov{c} {Sn}, {t}" "t:r";
    }
    VMOV_single_to_core FloatTransfer "t = Sn" {
        T1 V7EM "111011100001NNNN tttt1010N(0)(0)1(0)(0)(0)(0)" "vmov{c} {t}, {Sn}" "t:r";
    }
    VMOV_core_to_half FloatTransfer "Sd = t" {
        T1 V7EM "1110111000D0DDDD tttt10110001(0)(0)(0)(0)" "vmov{c}.32 {halfd}, {t}" "t:r";
    }
    VMOV_half_to_core FloatTransfer "t = Sm" {
        T1 V7EM "1110111000M1MMMM tttt10110001(0)(0)(0)(0)" "vmov{c}.32 {t}, {halfm}" "t:r";
    }
    VMOV_core_to_singles FloatTransfer "Sm2 = t t2" {
        T1 V7EM "111011000100uuuu tttt101000M1MMMM" "vmov{c} {Sm}, {Sm2}, {t}, {t2}" "tu:r m!=31";
    }
    VMOV_singles_to_core FloatTransfer "t t2 = Sm2" {
        T1 V7EM "111011000101uuuu tttt101000M1MMMM" "vmov{c} {t}, {t2}, {Sm}, {Sm2}" "tu:r t!=t2 m!=31";
    }
    VMOV_core_to_double FloatTransfer "Dm = t t2" {
        T1 V7EM "111011000100uuuu tttt10110001mmmm" "vmov{c} {Dm}, {t}, {t2}" "tu:r";
    }
    VMOV_double_to_core FloatTransfer "t t2 = Dm" {
        T1 V7EM "111011000101uuuu tttt10110001mmmm" "vmov{c} {t}, {t2}, {Dm}" "tu:r t!=t2";
    }
    VMRS FloatTransfer "t = F" { T1 V7EM "1110111011110001 tttt1010(0)(0)(0)1(0)(0)(0)(0)" "vmrs{c} {t}, fpscr" "t:r"; }
    VMRS_APSR FloatTransfer "NZCV = F" {
        T1 V7EM "1110111011110001 11111010(0)(0)(0)1(0)(0)(0)(0)" "vmrs{c} apsr_nzcv, fpscr" "s=1";
    }
    VMSR FloatTransfer "F = t" { T1 V7EM "1110111011100001 tttt1010(0)(0)(0)1(0)(0)(0)(0)" "vmsr{c} fpscr, {t}" "t:r"; }

    // Floating point: loads and stores. d is the first register of a list, imm their number.
    VLDR FloatLoad "Dd = n" { T1 V7EM "11101101U001nnnn dddd1011iiiiiiii" "vldr{c} {Dd}, {mem}" "x4"; }
    VLDR_single FloatLoad "Sd = n" { T2 V7EM "11101101UD01nnnn DDDD1010iiiiiiii" "vldr{c} {Sd}, {mem}" "x4"; }
    VSTR FloatStore "= Dd n" { T1 V7EM "11101101U000nnnn dddd1011iiiiiiii" "vstr{c} {Dd}, {mem}" "x4 n:p"; }
    VSTR_single FloatStore "= Sd n" { T2 V7EM "11101101UD00nnnn DDDD1010iiiiiiii" "vstr{c} {Sd}, {mem}" "x4 n:p"; }
    VLDMIA FloatLoadMultiple "Dlist = n" {
        T1 V7EM "1110110010W1nnnn dddd1011iiiiiii0" "vldmia{c} {n}{w}, {Dlist}" "n:p doubles";
    }
    VLDMIA_single FloatLoadMultiple "Slist = n" {
        T2 V7EM "111011001DW1nnnn DDDD1010iiiiiiii" "vldmia{c} {n}{w}, {Slist}" "n:p singles";
    }
    VLDMDB FloatLoadMultiple "Dlist = n" {
        T1 V7EM "111011010011nnnn dddd1011iiiiiii0" "vldmdb{c} {n}!, {Dlist}" "w=1 n:p doubles";
    }
    VLDMDB_single FloatLoadMultiple "Slist = n" {
        T2 V7EM "111011010D11nnnn DDDD1010iiiiiiii" "vldmdb{c} {n}!, {Slist}" "w=1 n:p singles";
    }
    VPOP FloatLoadMultiple "Dlist = n" {
        T1 V7EM "1110110010111101 dddd1011iiiiiii0" "vpop{c} {Dlist}" "n=sp w=1 doubles";
    }
    VPOP_single FloatLoadMultiple "Slist = n" {
        T2 V7EM "111011001D111101 DDDD1010iiiiiiii" "vpop{c} {Slist}" "n=sp w=1 singles";
    }
    VSTMIA FloatStoreMultiple "= Dlist n" {
        T1 V7EM "1110110010W0nnnn dddd1011iiiiiii0" "vstmia{c} {n}{w}, {Dlist}" "n:p doubles";
    }
    VSTMIA_single FloatStoreMultiple "= Slist n" {
        T2 V7EM "111011001DW0nnnn DDDD1010iiiiiiii" "vstmia{c} {n}{w}, {Slist}" "n:p singles";
    }
    VSTMDB FloatStoreMultiple "= Dlist n" {
        T1 V7EM "111011010010nnnn dddd1011iiiiiii0" "vstmdb{c} {n}!, {Dlist}" "w=1 n:p doubles";
    }
    VSTMDB_single FloatStoreMultiple "= Slist n" {
        T2 V7EM "111011010D10nnnn DDDD1010iiiiiiii" "vstmdb{c} {n}!, {Slist}" "w=1 n:p singles";
    }
    VPUSH FloatStoreMultiple "= Dlist n" {
        T1 V7EM "1110110100101101 dddd1011iiiiiii0" "vpush{c} {Dlist}" "n=sp w=1 doubles";
    }
    VPUSH_single FloatStoreMultiple "= Slist n" {
        T2 V7EM "111011010D101101 DDDD1010iiiiiiii" "vpush{c} {Slist}" "n=sp w=1 singles";
    }
    FLDMIAX FloatLoadMultiple "Dlist = n" {
        T1 V7EM "1110110010W1nnnn dddd1011iiiiiii1" "fldmiax{c} {n}{w}, {Dlist}" "n:p doubles";
    }
    FLDMDBX FloatLoadMultiple "Dlist = n" {
        T1 V7EM "111011010011nnnn dddd1011iiiiiii1" "fldmdbx{c} {n}!, {Dlist}" "w=1 n:p doubles";
    }
    FSTMIAX FloatStoreMultiple "= Dlist n" {
        T1 V7EM "1110110010W0nnnn dddd1011iiiiiii1" "fstmiax{c} {n}{w}, {Dlist}" "n:p doubles";
    }
    FSTMDBX FloatStoreMultiple "= Dlist n" {
        T1 V7EM "111011010010nnnn dddd1011iiiiiii1" "fstmdbx{c} {n}!, {Dlist}" "w=1 n:p doubles";
    }
}
