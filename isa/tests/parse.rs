//! Text is read as it is printed: every encoding with random operands, and what people write
//! besides.

use whippen_isa::{Arch, Cond, Encoding, ItRule, ItState, NotParsed, decode, parse};

fn random(state: &mut u64) -> u32 {
    *state = state
        .wrapping_mul(6_364_136_223_846_793_005)
        .wrapping_add(1_442_695_040_888_963_407);
    (*state >> 32) as u32
}

/// Printed, parsed and printed again gives the same text, never in more bytes.
#[test]
fn what_is_printed_is_read() {
    let mut state = 5;
    let (mut read, mut encodings) = (0, 0);
    for encoding in Encoding::all() {
        let (mask, bits) = encoding.fixed_bits();
        let mut met = false;
        for round in 0..60 {
            let word = bits | random(&mut state) & !mask;
            let (hw1, hw2) = if encoding.size() == 4 {
                ((word >> 16) as u16, word as u16)
            } else {
                (word as u16, 0)
            };
            let cond = Cond::from_bits((random(&mut state) % 15) as u8).expect("a condition");
            let block = ItState::after_it(cond.bits(), 8).filter(|_| round % 3 == 0);
            let block = block
                .filter(|_| encoding.it_rule() != ItRule::Never)
                .unwrap_or_default();
            let Ok(inst) = decode(hw1, hw2, Arch::V8M, block) else {
                continue;
            };
            let text = inst.to_string();
            if inst.encoding != encoding || text.starts_with(".inst") {
                continue;
            }
            let again = parse(&text, Arch::V8M, block.cond())
                .unwrap_or_else(|why| panic!("{encoding} `{text}`: {why:?}"));
            assert!(again.size() <= inst.size(), "{encoding} {text}");
            assert_eq!(normal(&again.to_string()), normal(&text), "{encoding}");
            (read, met) = (read + 1, true);
        }
        encodings += usize::from(met);
    }
    assert!(
        read > 12_000 && encodings > Encoding::COUNT - 12,
        "{read} read of {encodings} encodings"
    );
}

/// Without the width, and without the third operand where it repeats the first.
fn normal(text: &str) -> String {
    let text = text.replacen(".w ", " ", 1);
    let (mnemonic, operands) = text.split_once(' ').unwrap_or((&text, ""));
    let mut parts: Vec<_> = operands.split(", ").collect();
    if parts.len() > 2 && parts[0] == parts[1] {
        parts.remove(0);
    }
    format!("{mnemonic} {}", parts.join(", "))
}

#[test]
fn people_write_less() {
    for (text, bits) in [
        ("adds r0, #5", "adds r0, #5"),
        ("adds r0, r0, #5", "adds r0, #5"),
        ("adds r0, r0, #10", "adds r0, #10"),
        ("add sp, sp, #8", "add sp, #8"),
        ("push {r4-r7, lr}", "push {r4, r5, r6, r7, lr}"),
        ("lsls r1, #3", "lsls r1, r1, #3"),
        ("ldr  r0 , [ r1 , #4 ]", "ldr r0, [r1, #4]"),
        ("bhs .+8", "bcs .+8"),
        ("ldr.w r0, [r1]", "ldr.w r0, [r1]"),
        ("mov r8, #0x10000", "mov.w r8, #0x10000"),
        ("stmia r0!, {r1}", "stm r0!, {r1}"),
        ("dsb sy", "dsb sy"),
        ("msr msp, r0", "msr msp, r0"),
    ] {
        assert_eq!(
            parse(text, Arch::V8M, None).map(|inst| inst.to_string()),
            Ok(bits.to_string())
        );
    }
}

#[test]
fn refusals_say_how_far_it_came() {
    let refusal = |text| parse(text, Arch::V8M, None).unwrap_err();
    assert_eq!(refusal("addd r0, r1"), NotParsed::Mnemonic);
    assert!(
        matches!(refusal("smmul r0, [r1]"), NotParsed::Operands(syntax) if syntax.starts_with("smmul"))
    );
    assert_eq!(refusal("moveq r0, r1"), NotParsed::Condition);
    assert!(matches!(
        refusal("mov r0, #0x12345"),
        NotParsed::Encoding(_)
    ));
    assert!(matches!(refusal("adds.n r0, #300"), NotParsed::Encoding(_)));
}
