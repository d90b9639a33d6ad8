//! The table by itself: what is read is written back bit for bit, and instructions read and write
//! what they should.

use whippen_isa::{
    Arch, Code, Cond, Encoding, FlagUse, Flags, Form, Inst, ItState, NotDecoded, NotEncoded, Op,
    RegSet, ShiftType, Why, decode, is_wide,
};

fn random(state: &mut u64) -> u32 {
    *state = state
        .wrapping_mul(6_364_136_223_846_793_005)
        .wrapping_add(1_442_695_040_888_963_407);
    (*state >> 32) as u32
}

fn code(hw1: u16, hw2: u16) -> Code {
    if is_wide(hw1) {
        Code::Wide(hw1, hw2)
    } else {
        Code::Narrow(hw1)
    }
}

/// Decodes outside an IT block for the Cortex-M33.
fn read(hw1: u16, hw2: u16) -> Inst {
    decode(hw1, hw2, Arch::V8M, ItState::OUTSIDE).expect("a predictable instruction")
}

fn inst(op: Op, form: Form) -> Inst {
    Inst::new(Encoding::new(op, form).expect("the manual has it"))
}

fn core(numbers: &[u8]) -> RegSet {
    numbers
        .iter()
        .fold(RegSet::EMPTY, |set, n| set.union(RegSet::core(*n)))
}

#[test]
fn what_is_read_is_written_back() {
    let mut state = 1;
    let block = ItState::after_it(Cond::NE.bits(), 8).expect("a block of one");
    let narrow = (0..=u16::MAX).map(|hw| (hw, 0));
    let wide = (0..600_000)
        .map(|_| random(&mut state))
        .map(|w| ((w >> 16) as u16 | 0xe000, w as u16));
    let mut read_back = 0;
    for (hw1, hw2) in narrow.chain(wide) {
        for arch in Arch::ALL {
            for it in [ItState::OUTSIDE, block] {
                if let Ok(inst) = decode(hw1, hw2, arch, it) {
                    assert_eq!(
                        inst.encode(arch),
                        Ok(code(hw1, hw2)),
                        "{hw1:04x} {hw2:04x} {inst}"
                    );
                    read_back += 1;
                }
            }
        }
    }
    assert!(read_back > 1_000_000, "{read_back}");
}

/// Operands near valid ones: either they are refused, or the bits are read as the same instruction.
#[test]
fn what_is_written_is_read_back() {
    let mut state = 2;
    let (mut written, mut refused) = (0, 0);
    for encoding in Encoding::all() {
        for _ in 0..1000 {
            let inst = nearby(encoding, &mut state);
            let Ok(code) = inst.encode(Arch::V8M) else {
                refused += 1;
                continue;
            };
            let (hw1, hw2) = code.halfwords();
            let own_cond = encoding.op() == Op::B
                && inst.cond.is_some()
                && encoding != branch_in_block(encoding);
            let block = inst
                .cond
                .filter(|_| !own_cond)
                .and_then(|c| ItState::after_it(c.bits(), 8));
            let again = decode(hw1, hw2.unwrap_or(0), Arch::V8M, block.unwrap_or_default());
            assert_eq!(again, Ok(inst), "{encoding}");
            written += 1;
        }
    }
    assert!(
        written > 50_000 && refused > 50_000,
        "{written} written, {refused} refused"
    );
}

/// T2 for T1 and T4 for T3: the forms of B that take their condition from an IT block.
fn branch_in_block(encoding: Encoding) -> Encoding {
    let form = if matches!(encoding.form(), Form::T1 | Form::T2) {
        Form::T2
    } else {
        Form::T4
    };
    Encoding::new(Op::B, form).expect("B has four forms")
}

/// A word of the encoding as it is read, or its operands at rest, with up to two operands changed.
fn nearby(encoding: Encoding, state: &mut u64) -> Inst {
    let (mask, bits) = encoding.fixed_bits();
    let word = bits | random(state) & !mask;
    let (hw1, hw2) = if encoding.size() == 4 {
        ((word >> 16) as u16, word as u16)
    } else {
        (word as u16, 0)
    };
    let read = decode(hw1, hw2, Arch::V8M, ItState::OUTSIDE);
    let mut inst = read
        .ok()
        .filter(|i| i.encoding == encoding)
        .unwrap_or(Inst::new(encoding));
    for _ in 0..random(state) % 3 {
        let number = random(state);
        change(&mut inst, random(state) % 15, number);
    }
    inst
}

fn change(inst: &mut Inst, which: u32, number: u32) {
    let shifts = [
        ShiftType::LSL,
        ShiftType::LSR,
        ShiftType::ASR,
        ShiftType::ROR,
        ShiftType::RRX,
    ];
    match which {
        0 => inst.cond = Cond::from_bits((number & 15) as u8),
        1 => inst.s = !inst.s,
        2 => inst.index = !inst.index,
        3 => inst.add = !inst.add,
        4 => inst.wback = !inst.wback,
        5 => inst.d = (number % 33) as u8,
        6 => inst.n = (number % 33) as u8,
        7 => inst.m = (number % 33) as u8,
        8 => inst.a = (number % 17) as u8,
        9 => inst.t = (number % 17) as u8,
        10 => inst.t2 = (number % 17) as u8,
        11 => inst.shift = shifts[number as usize % 5],
        12 => inst.amount = (number % 40) as u8,
        13 => inst.imm = number >> (number % 32),
        _ => inst.imm = inst.imm.wrapping_add(number % 9).wrapping_sub(4),
    }
}

/// Operands that no encoding has are refused, and printed all the same.
#[test]
fn no_operand_makes_it_panic() {
    let mut state = 4;
    let extremes = [0, 1, 15, 31, 255, 1 << 31, u32::MAX];
    for encoding in Encoding::all() {
        for _ in 0..300 {
            let mut inst = Inst::new(encoding);
            for _ in 0..6 {
                let number = extremes[random(&mut state) as usize % extremes.len()];
                set(&mut inst, random(&mut state) % 9, number);
            }
            let text = inst.to_string();
            if let Ok(code) = inst.encode(Arch::V8M) {
                assert_eq!(code.size(), inst.size());
            }
            assert!(
                Flags::NZCV.contains(
                    inst.flags()
                        .writes
                        .without(Flags::Q | Flags::GE | Flags::FPSCR)
                )
            );
            assert!(!text.is_empty() && !text.contains(['<', '>']));
            // In a list or not, a register that is written back is written.
            assert!(!inst.wback || inst.defs().contains(RegSet::core(inst.n)));
        }
    }
}

fn set(inst: &mut Inst, which: u32, number: u32) {
    let byte = number as u8;
    match which {
        0 => inst.d = byte,
        1 => inst.n = byte,
        2 => inst.m = byte,
        3 => inst.a = byte,
        4 => inst.t = byte,
        5 => inst.t2 = byte,
        6 => inst.amount = byte,
        7 => inst.cond = Cond::from_bits(byte & 15),
        _ => inst.imm = number,
    }
}

#[test]
fn a_newer_architecture_reads_what_an_older_one_does() {
    let mut state = 3;
    let narrow = (0..=u16::MAX).map(|hw| (hw, 0));
    let wide = (0..300_000)
        .map(|_| random(&mut state))
        .map(|w| ((w >> 16) as u16 | 0xe800, w as u16));
    for (hw1, hw2) in narrow.chain(wide) {
        let all = Arch::ALL.map(|arch| decode(hw1, hw2, arch, ItState::OUTSIDE));
        for pair in all.windows(2) {
            assert!(
                pair[0].is_err() || pair[0] == pair[1] || is_hint(&pair[0]),
                "{hw1:04x} {hw2:04x}: {pair:?}"
            );
        }
    }
}

/// Hints that a newer architecture gave a name.
fn is_hint(inst: &Result<Inst, NotDecoded>) -> bool {
    inst.is_ok_and(|i| matches!(i.op(), Op::HINT | Op::HINT_memory))
}

#[test]
fn every_instruction_has_its_encodings_narrow_ones_first() {
    assert_eq!(Encoding::all().count(), Encoding::COUNT);
    for op in Op::ALL {
        let sizes: Vec<_> = Encoding::of(*op).map(Encoding::size).collect();
        assert!(!sizes.is_empty() && sizes.is_sorted(), "{op}: {sizes:?}");
    }
    assert_eq!(
        Encoding::new(Op::ADD_register, Form::T3).map(|e| e.to_string()),
        Some("ADD (register) T3".to_string())
    );
    assert_eq!(Encoding::new(Op::ADD_register, Form::T4), None);
}

#[test]
fn the_shortest_encoding_depends_on_operands_flags_and_block() {
    let add = Inst {
        d: 1,
        n: 1,
        imm: 5,
        s: true,
        ..inst(Op::ADD_immediate, Form::T3)
    };
    let form = |inst: Inst| inst.shortest(Arch::V8M).map(|i| i.encoding.form());
    assert_eq!(form(add), Some(Form::T1));
    assert_eq!(form(Inst { imm: 200, ..add }), Some(Form::T2));
    assert_eq!(form(Inst { s: false, ..add }), Some(Form::T3));
    assert_eq!(
        form(Inst {
            s: false,
            cond: Some(Cond::EQ),
            ..add
        }),
        Some(Form::T1)
    );
    assert_eq!(
        form(Inst {
            s: false,
            imm: 0xabc,
            ..add
        }),
        Some(Form::T4)
    );
    assert_eq!(
        form(Inst {
            imm: 0x1234_5678,
            ..add
        }),
        None
    );
    assert_eq!(Inst { d: 8, ..add }.shortest(Arch::V6M), None);
    let branch = |form, cond, imm| Inst {
        cond,
        imm,
        ..inst(Op::B, form)
    };
    assert_eq!(form(branch(Form::T3, Some(Cond::EQ), 200)), Some(Form::T1));
    assert_eq!(
        form(branch(Form::T4, Some(Cond::EQ), 200)),
        Some(Form::T2),
        "in a block"
    );
    assert_eq!(form(branch(Form::T2, None, 1 << 20)), Some(Form::T4));
}

#[test]
fn reasons_for_having_no_bits() {
    let orr = Inst {
        d: 1,
        n: 15,
        m: 2,
        ..inst(Op::ORR_register, Form::T2)
    };
    let mov = Encoding::new(Op::MOV_register, Form::T3);
    assert_eq!(orr.encode(Arch::V8M), Err(NotEncoded::Shadowed { by: mov }));
    assert_eq!(orr.encode(Arch::V6M), Err(NotEncoded::Absent));
    assert_eq!(
        Inst { n: 13, ..orr }.encode(Arch::V8M),
        Err(NotEncoded::Unpredictable(Why::Sp))
    );
    let too_far = Inst {
        imm: 1 << 20,
        ..inst(Op::B, Form::T2)
    };
    assert!(matches!(
        too_far.encode(Arch::V8M),
        Err(NotEncoded::DoesNotFit { nearest }) if nearest.imm == 0
    ));
}

#[test]
fn outcomes_of_decoding_are_explicit() {
    assert_eq!(
        decode(0xf800, 0xf000, Arch::V6M, ItState::OUTSIDE)
            .ok()
            .map(|i| i.op()),
        None
    );
    assert_eq!(
        decode(0xeeb0, 0x0b40, Arch::V8M, ItState::OUTSIDE),
        Err(NotDecoded::Undefined),
        "VMOV.F64 D0, D0"
    );
    // ADD.W R13, R0, R1, and POP.W {R0}, {R1} as a list of one.
    let unpredictable = |hw1, hw2| match decode(hw1, hw2, Arch::V8M, ItState::OUTSIDE) {
        Err(NotDecoded::Unpredictable { reading, why }) => Some((reading.to_string(), why)),
        _ => None,
    };
    assert_eq!(
        unpredictable(0xeb00, 0x0d01),
        Some(("add.w sp, r0, r1".to_string(), Why::Sp))
    );
    assert_eq!(
        unpredictable(0xe8bd, 0x0002),
        Some(("pop.w {r1}".to_string(), Why::List))
    );
    // Branches may only end a block.
    let block = ItState::after_it(0, 4).expect("a block of two");
    assert!(matches!(
        decode(0xe000, 0, Arch::V8M, block),
        Err(NotDecoded::Unpredictable { why: Why::It, .. })
    ));
    assert!(decode(0xe000, 0, Arch::V8M, block.advance()).is_ok());
    // ARMv6-M has no blocks.
    assert!(matches!(
        decode(0xbf00, 0, Arch::V6M, block),
        Err(NotDecoded::Unpredictable { why: Why::It, .. })
    ));
}

#[test]
fn text_follows_the_block() {
    let block = ItState::after_it(Cond::HI.bits(), 8).expect("a block of one");
    let inside = decode(0x1888, 0, Arch::V8M, block).expect("ADD in a block");
    assert_eq!(
        (
            read(0x1888, 0).to_string().as_str(),
            inside.to_string().as_str()
        ),
        ("adds r0, r1, r2", "addhi r0, r1, r2")
    );
    assert_eq!(
        (read(0x1888, 0).flags().writes, inside.flags().writes),
        (Flags::NZCV, Flags::NONE)
    );
    assert_eq!(inside.flags().reads, Flags::C | Flags::Z);
}

#[test]
fn accumulators_addresses_and_lists_are_registers_too() {
    /// Halfwords, text, core registers read and written.
    type Case = (u16, u16, &'static str, &'static [u8], &'static [u8]);
    let cases: &[Case] = &[
        (
            0xfbc2,
            0x0103,
            "smlal r0, r1, r2, r3",
            &[0, 1, 2, 3],
            &[0, 1],
        ),
        (0xfb51, 0x3012, "smmlar r0, r1, r2, r3", &[1, 2, 3], &[0]),
        (0xfa51, 0xf082, "uxtab r0, r1, r2", &[1, 2], &[0]),
        (0xeac1, 0x0002, "pkhbt r0, r1, r2", &[1, 2], &[0]),
        (0xf301, 0x000f, "ssat r0, #16, r1", &[1], &[0]),
        (0xf36f, 0x00c7, "bfc r0, #3, #5", &[0], &[0]),
        (0xf841, 0x0b04, "str r0, [r1], #4", &[0, 1], &[1]),
        (0xf801, 0x0e04, "strbt r0, [r1, #4]", &[0, 1], &[]),
        (0xb503, 0, "push {r0, r1, lr}", &[0, 1, 13, 14], &[13]),
        (
            0xe92d,
            0x4003,
            "push.w {r0, r1, lr}",
            &[0, 1, 13, 14],
            &[13],
        ),
        (0xbd10, 0, "pop {r4, pc}", &[13], &[4, 13, 15]),
        (0xc907, 0, "ldm r1, {r0, r1, r2}", &[1], &[0, 1, 2]),
        (0x4801, 0, "ldr r0, [pc, #4]", &[15], &[0]),
        (0xf000, 0xf800, "bl .+4", &[], &[14, 15]),
        (0xf380, 0x8808, "msr msp, r0", &[0], &[13]),
        (0xe840, 0xf100, "tt r1, r0", &[0], &[1]),
    ];
    for (hw1, hw2, text, uses, defs) in cases {
        let inst = read(*hw1, *hw2);
        assert_eq!(
            (inst.to_string().as_str(), inst.uses(), inst.defs()),
            (*text, core(uses), core(defs))
        );
    }
    let load = read(0xecb0, 0x0a03);
    assert_eq!(
        (load.to_string().as_str(), load.defs()),
        (
            "vldmia r0!, {s0-s2}",
            core(&[0]).union(RegSet::singles(0, 3))
        )
    );
}

#[test]
fn flags_of_shifts_depend_on_the_amount() {
    let nz = Flags::N | Flags::Z;
    let cases = [
        ((0xea11, 0x0002), "ands r0, r1, r2", Flags::NONE, nz),
        (
            (0xea11, 0x0042),
            "ands r0, r1, r2, lsl #1",
            Flags::NONE,
            nz | Flags::C,
        ),
        (
            (0xea11, 0x0032),
            "ands r0, r1, r2, rrx",
            Flags::C,
            nz | Flags::C,
        ),
        ((0xf011, 0x0001), "ands r0, r1, #1", Flags::NONE, nz),
        (
            (0xf011, 0x4000),
            "ands r0, r1, #0x80000000",
            Flags::NONE,
            nz | Flags::C,
        ),
        ((0x4088, 0), "lsls r0, r1", Flags::C, nz | Flags::C),
        ((0x4348, 0), "muls r0, r1, r0", Flags::NONE, nz),
        ((0x4148, 0), "adcs r0, r1", Flags::C, Flags::NZCV),
        (
            (0xfa91, 0xf002),
            "sadd16 r0, r1, r2",
            Flags::NONE,
            Flags::GE,
        ),
        ((0xfaa1, 0xf082), "sel r0, r1, r2", Flags::GE, Flags::NONE),
        (
            (0xfb11, 0x3002),
            "smlabb r0, r1, r2, r3",
            Flags::NONE,
            Flags::Q,
        ),
        (
            (0xeeb4, 0x0a60),
            "vcmp.f32 s0, s1",
            Flags::NONE,
            Flags::FPSCR,
        ),
        (
            (0xeef1, 0xfa10),
            "vmrs apsr_nzcv, fpscr",
            Flags::FPSCR,
            Flags::NZCV,
        ),
        ((0xd8fe, 0), "bhi .+0", Flags::C | Flags::Z, Flags::NONE),
    ];
    for ((hw1, hw2), text, reads, writes) in cases {
        let inst = read(hw1, hw2);
        let name = inst.to_string().replace(".w ", " ");
        assert_eq!(
            (name.as_str(), inst.flags()),
            (text, FlagUse { reads, writes })
        );
    }
}
