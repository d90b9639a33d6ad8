//! Random programs: loops on a core's own data, and between them what the other one can see or what
//! has to be exact.

#[path = "../../../tests/made/plain.rs"]
mod plain;

use super::Random;
use super::devices;
use plain::is_plain;
use whippen_isa::{Arch, is_wide};

/// Instructions of each kind that is translated in place and is not among the others, with what
/// they need and what undoes what they do to R3 to R14. R7 counts down, so it is odd at times.
const MORE: &[&[u16]] = &[
    &[0x7870],                                 // ldrb r0, [r6, #1]
    &[0x8870],                                 // ldrh r0, [r6, #2]
    &[0x5ff0],                                 // ldrsh r0, [r6, r7]
    &[0x57f0],                                 // ldrsb r0, [r6, r7]
    &[0xf856, 0x0027],                         // ldr r0, [r6, r7, lsl #2]
    &[0x7071],                                 // strb r1, [r6, #1]
    &[0x8071],                                 // strh r1, [r6, #2]
    &[0x53f1],                                 // strh r1, [r6, r7]
    &[0xb407, 0xbc0e],                         // push {r0-r2}; pop {r1-r3}
    &[0xb082, 0x9101, 0xb002],                 // sub sp, #8; str r1, [sp, #4]; add sp, #8
    &[0xf856, 0x0f04, 0xf856, 0x1904],         // ldr r0, [r6, #4]!; ldr r1, [r6], #-4
    &[0xf846, 0x0f04, 0xf846, 0x1904],         // str r0, [r6, #4]!; str r1, [r6], #-4
    &[0x4633, 0xcb07, 0x4633, 0xc307],         // mov r3, r6; ldm r3!, {r0-r2}; the same, stm
    &[0xbf18, 0x6830],                         // it ne; ldrne r0, [r6]
    &[0xbf2c, 0x2001, 0x6031],                 // ite cs; movcs r0, #1; strcc r1, [r6]
    &[0xbfb4, 0x1840, 0x4048],                 // ite lt; addlt r0, r0, r1; eorge r0, r1
    &[0xbf88, 0xfb91, 0xf0f2],                 // it hi; sdivhi r0, r1, r2
    &[0xbf08, 0x4288],                         // it eq; cmpeq r0, r1
    &[0xfbb0, 0xf0f1],                         // udiv r0, r0, r1
    &[0xb100, 0x3001],                         // cbz r0, behind; adds r0, #1
    &[0xb901, 0x3101],                         // cbnz r1, behind; adds r1, #1
    &[0xe7ff],                                 // b behind
    &[0x4673, 0xf000, 0xf800, 0x469e],         // mov r3, lr; bl behind; mov lr, r3
    &[0xa301, 0x3301, 0x4718, 0xbf00],         // adr r3, behind; adds r3, #1; bx r3
    &[0x2301, 0xe8df, 0xf003, 0x0101],         // movs r3, #1; tbb [pc, r3]
    &[0xf301, 0x0007, 0xf382, 0x0045],         // ssat r0, #8, r1; usat r0, #5, r2, lsl #1
    &[0xfb82, 0x0103, 0xfbe2, 0x0103],         // smull, umlal r0, r1, r2, r3
    &[0xfbc2, 0x0103, 0xfba2, 0x0103],         // smlal, umull r0, r1, r2, r3
    &[0xfb51, 0xf012, 0xfb51, 0x2003],         // smmulr r0, r1, r2; smmla r0, r1, r3, r2
    &[0xfb01, 0x2003, 0xfb01, 0x2013, 0x4348], // mla, mls r0, r1, r3, r2; muls r0, r1, r0
    &[0xf3c1, 0x00c4, 0xf341, 0x01c4],         // ubfx r0, r1, #3, #5; sbfx r1, r1, #3, #5
    &[0xf361, 0x1009, 0xf36f, 0x1109],         // bfi r0, r1, #4, #6; bfc r1, #4, #6
    &[0xeac1, 0x0082, 0xfa11, 0xf082],         // pkhbt r0, r1, r2, lsl #2; uxtah r0, r1, r2
    &[0xfab1, 0xf081, 0xfa91, 0xf1a1],         // clz r0, r1; rbit r1, r1
    &[0xba08, 0xb240, 0xb2c9, 0xb212],         // rev r0, r1; sxtb; uxtb; sxth
    &[0xf2c1, 0x2034, 0xea5f, 0x0031],         // movt r0, #0x1234; movs r0, r1, rrx
    &[0x4088, 0x40c8, 0x4108, 0x41c8],         // lsls, lsrs, asrs, rors r0, r1
    &[0x4148, 0x4188, 0x4248, 0x43c8],         // adcs, sbcs r0, r1; rsbs r0, r1; mvns r0, r1
    &[0xea91, 0x00f2, 0xea71, 0x0002],         // eors r0, r1, r2, ror #3; orns r0, r1, r2
];

/// One instruction or a few of a loop: on registers, or on the core's own data (R6).
fn own(random: &mut Random, kinds: u32, code: &mut Vec<u16>) {
    let (hw1, hw2) = (random.word() as u16, random.word() as u16);
    let offset = hw1 & 0x07c0;
    if kinds > 6 && random.below(3) == 0 {
        return code.extend(MORE[random.below(MORE.len() as u32) as usize]);
    }
    match random.below(kinds) {
        0 => code.extend([0xd000 | (random.below(14) << 8) as u16, 0x3001]), // b<c>; adds r0, #1
        1 => code.extend([0xbf08, 0x3001]),                                  // it eq; addeq r0, #1
        6 => code.push(0x6031 | offset),                                     // str r1, [r6, ..]
        7 => code.push(0x6830 | offset),                                     // ldr r0, [r6, ..]
        8 => code.extend([0xe896, 0x0007]),                                  // ldm r6, {r0-r2}
        9 => code.extend([0xe886, 0x0007]),                                  // stm r6, {r0-r2}
        10 => code.extend([0xe9d6, 0x0100 | hw2 & 31]), // ldrd r0, r1, [r6, ..]
        11 => code.extend([0xe9c6, 0x0100 | hw2 & 31]), // strd r0, r1, [r6, ..]
        // R4 and up are kept.
        _ if is_plain(Arch::V8M, [hw1, hw2], 0xfff0) => {
            code.push(hw1);
            code.extend(is_wide(hw1).then_some(hw2));
        }
        _ => {}
    }
}

/// SysTick interrupts every 2000 cycles: movw, movt r3, #0xe000e010; movs r0, #250;
/// lsls r0, r0, #3; str r0, [r3, #4]; str r0, [r3, #8]; movs r1, #7; str r1, [r3].
const SYSTICK: [u16; 10] = [
    0xf24e, 0x0310, 0xf2ce, 0x0300, 0x20fa, 0x00c0, 0x6058, 0x6098, 0x2107, 0x6019,
];

/// What the other core can see, or what has to be exact.
fn shared(random: &mut Random, code: &mut Vec<u16>) {
    if random.below(2) == 0 {
        return code.extend(devices::access(random));
    }
    let offset = random.word() as u16 & 0x07c0;
    match random.below(21) {
        0 => code.push(0x6029 | offset),     // str r1, [r5, ..]: shared
        1 | 2 => code.push(0x6828 | offset), // ldr r0, [r5, ..]
        3 => code.push(0x6820),              // ldr r0, [r4]: the bell
        4 => code.push(0x6020),              // str r0, [r4]
        5 => code.extend([0xe855, 0x0f00, 0xe845, 0x0100]), // ldrex r0, [r5]; strex r1, r0, [r5]
        6 => code.extend([0xf8d6, 0x0001]),  // ldr r0, [r6, #1]
        7 => code.extend([0xf8a9, 0xa000]),  // strh r10, [r9]: its own code
        8 => code.extend([0xf8ab, 0xc000]),  // strh r12, [r11]: the other's code
        9 => code.extend([0xf8c8, 0x0000]),  // str r0, [r8]: the other's data
        10 => code.extend([0xf8d8, 0x0004]), // ldr r0, [r8, #4]
        11 | 12 => code.extend([0xe898, 0x0007]), // ldm r8, {r0-r2}
        13 => code.extend([0xe885, 0x0007]), // stm r5, {r0-r2}
        14 | 15 => code.push(0x6820),        // the bell again
        16 => code.extend([0xbf40, 0xbf20]), // sev; wfe
        17 => code.extend([0xb672, 0xbf20, 0xb662]), // cpsid i; wfe; cpsie i
        18 => code.extend(SYSTICK),
        19 => code.extend([0xf24e, 0x0310, 0xf2ce, 0x0300, 0x6898]), // ldr r0, SYST_CVR
        _ => code.extend([0xb672, 0xb662]),                          // cpsid i; cpsie i
    }
}

/// A nop that is overwritten, loops on own data, and between them something that is shared.
pub fn program(random: &mut Random) -> Vec<u16> {
    let mut code = vec![0xbf00];
    let often = 1 + random.below(12);
    for _ in 0..10 {
        code.push(0x2700 | (1 + random.below(60)) as u16); // movs r7, ..
        let start = code.len();
        let wanted = start + 5 + random.below(70) as usize;
        let kinds = [6, 12][random.below(2) as usize];
        let rare = [20, 400, 400][random.below(3) as usize];
        while code.len() < wanted {
            own(random, kinds, &mut code);
            if random.below(rare) == 0 {
                shared(random, &mut code);
            }
        }
        let back = start as i32 - (code.len() as i32 + 1) - 2;
        code.extend([0x3f01, 0xd100 | back as u16 & 0xff]); // subs r7, #1; bne
        if random.below(often) == 0 {
            shared(random, &mut code);
        }
    }
    code.push(0x4770); // bx lr: from the beginning
    code
}
