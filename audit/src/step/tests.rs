//! Where instructions lead and what that takes, in small handlers: cycles are counted on paper by
//! the table of the Cortex-M33 (`isa/src/cores/cortex_m33.txt`). An instruction takes one, a branch
//! that is taken one more, and one more where its target is a 32-bit instruction in an upper half;
//! the return to whatever was interrupted is counted with the interrupt.

mod called;

use super::Stepper;
use crate::certificate::Kind;
use crate::core_of;
use crate::facts::Facts;
use crate::made::{DATA, DEVICES, HANDLER, Image, assemble, function};
use crate::memory::Around;
use crate::place::Tag;

/// Cycles of a handler, or why it is refused.
fn handler(texts: &[&str]) -> Result<u64, String> {
    proven(Image::new(texts, &[], Vec::new()))
}

fn proven(image: Image) -> Result<u64, String> {
    let image = image.prove().map_err(|why| why.why)?;
    match image.judge() {
        Ok(_) => Ok(image.cycles(0, 0)),
        Err(why) => Err(why.why),
    }
}

/// Which ways are followed shows in whether a division is counted, which takes 11 cycles.
#[test]
fn a_branch_goes_both_ways_where_nothing_excludes_one() {
    let divides = |texts: &[&str]| {
        let all = [texts, &["bx lr", "udiv r0, r1, r2", "bx lr"]].concat();
        handler(&all).map(|cycles| cycles > 11)
    };
    for (texts, wanted) in [
        (&["cmp r0, #1", "beq .+4"][..], true),
        (&["movs r0, #1", "cmp r0, #1", "beq .+4"], true),
        (&["movs r0, #2", "cmp r0, #1", "beq .+4"], false),
        (&["movs r0, #2", "cmp r0, #1", "bne .+4"], true),
        (&["b .+4"], true),
        (&["cbz r0, .+4"], true),
        (&["cbnz r0, .+4"], true),
        (&["movs r0, #0", "cbz r0, .+4"], true),
        (&["movs r0, #1", "cbz r0, .+4"], false),
        (&["movs r0, #0", "cbnz r0, .+4"], false),
        (&["movs r0, #1", "cbnz r0, .+4"], true),
        // What a comparison showed holds behind its branch.
        (&["cmp r0, #1", "bne .+4", "cbz r0, .+4"], false),
        (&["cmp r0, #0", "bne .+4", "cbz r0, .+4"], true),
    ] {
        assert_eq!(divides(texts), Ok(wanted), "{texts:?}");
    }
}

/// A branch that is taken takes one cycle more than one that is not; to a 32-bit instruction in an
/// upper half two more.
#[test]
fn a_branch_that_is_taken_takes_longer() {
    let code = |branch, wide| [branch, "bx lr", wide, "bx lr"];
    let not_taken = ["movs r0, #1", "cbz r0, .+4", "bx lr", "bx lr"];
    assert_eq!(handler(&not_taken), Ok(3 - 1));
    assert_eq!(handler(&code("b .+4", "movs r1, #1")), Ok(2 + 1 + 1 - 1));
    assert_eq!(handler(&code("b .+4", "movw r1, #1")), Ok(2 + 1 + 1));
    let upper = ["b .+6", "movs r0, #1", "bx lr", "movw r1, #1", "bx lr"];
    assert_eq!(handler(&upper), Ok(3 + 1 + 1));
}

#[test]
fn a_condition_of_a_block_is_met_or_fails() {
    let both = handler(&["cmp r0, #0", "it eq", "udiveq r0, r1, r2", "bx lr"]);
    assert_eq!(both, Ok(1 + 11 + 1));
    // Of two the second.
    let second = |block| {
        let texts = [
            "movs r0, #1",
            "cmp r0, #0",
            block,
            "mvnne r0, r0",
            "udivne r0, r1, r2",
            "bx lr",
        ];
        let texts = texts.map(|text| match block {
            "ite ne" => text.replace("udivne", "udiveq"),
            _ => text.to_string(),
        });
        handler(&texts.each_ref().map(String::as_str)).map(|cycles| cycles > 11)
    };
    assert_eq!([second("ite ne"), second("itt ne")], [Ok(false), Ok(true)]);
    // A branch is the last of its block.
    let returns = ["cmp r0, #0", "it eq", "bxeq lr", "bx lr"];
    assert!(handler(&returns).is_ok());
    let one = [
        "movs r0, #1",
        "cmp r0, #0",
        "ite eq",
        "udiveq r0, r1, r2",
        "movne r0, #1",
        "bx lr",
    ];
    let never = handler(&one);
    assert!(never.is_ok_and(|cycles| cycles < 11));
    let other = one.map(|text| if text == "ite eq" { "itt ne" } else { text });
    let other = other.map(|text| {
        if text == "udiveq r0, r1, r2" {
            "udivne r0, r1, r2"
        } else {
            text
        }
    });
    assert!(handler(&other).is_ok_and(|cycles| cycles > 11));
}

/// A quotient of few bits takes fewer cycles: both magnitudes are taken from what is known.
#[test]
fn a_division_is_as_long_as_its_quotient() {
    let cycles = |operands: [&str; 2], division: &str| {
        let texts = [operands[0], operands[1], division, "bx lr"];
        handler(&texts).expect("it is proven")
    };
    let known = |dividend: &'static str, divisor: &'static str| {
        ["udiv r2, r0, r1", "sdiv r2, r0, r1"].map(|text| cycles([dividend, divisor], text))
    };
    let least = known("movs r0, #1", "movs r1, #2");
    let [longest, _] = known("movs r3, #1", "movs r4, #2");
    assert_eq!(least[0], least[1]);
    // Nothing is divided where the quotient is 0.
    assert!(least[0] < known("movs r0, #1", "movs r1, #1")[0]);
    assert!(longest > least[0]);
    // The same magnitudes, whatever the signs; a divisor that may be 0 is one at least.
    let negative = cycles(["mvn r0, #255", "mvn r1, #15"], "sdiv r2, r0, r1");
    assert_eq!(known("movw r0, #256", "movs r1, #16")[1], negative);
    assert!(negative > least[1] && negative < longest);
    let unsigned = cycles(["mvn r0, #255", "movs r1, #1"], "udiv r2, r0, r1");
    assert_eq!(unsigned, longest);
    let around = cycles(["movw r0, #256", "ubfx r1, r5, #0, #4"], "udiv r2, r0, r1");
    assert_eq!(around, known("movw r0, #256", "movs r1, #1")[0]);
    assert!(around > negative);
    let signs = cycles(["movw r0, #256", "sbfx r1, r5, #0, #4"], "sdiv r2, r0, r1");
    assert_eq!(signs, around);
    // From -256 to 0.
    let below = [
        "ubfx r0, r5, #0, #1",
        "rsb.w r0, r0, #0",
        "lsls r0, r0, #8",
        "movs r1, #1",
    ];
    let quotient = |division| handler(&[&below[..], &[division, "bx lr"]].concat());
    let [signed, none] = ["sdiv r2, r0, r1", "sdiv r2, r1, r1"].map(quotient);
    let (least, most) = (known("movs r0, #1", "movs r1, #1")[1], signs);
    assert_eq!(
        signed.ok().zip(none.ok()).map(|(a, b)| a - b),
        Some(most - least)
    );
}

/// Entries of a table that its index may have: each is followed, none else.
#[test]
fn a_table_leads_where_its_index_may() {
    // Entry 0 to a return, entry 1 to a division.
    let code = |index: &'static str, branch: &'static str, table: &[&'static str]| {
        let head = [&[index, branch][..], table].concat();
        let all = [&head[..], &["bx lr", "udiv r0, r1, r2", "bx lr"]].concat();
        handler(&all).map(|cycles| cycles > 11)
    };
    let bytes = |index| code(index, "tbb [pc, r0]", &[".0201"]);
    assert_eq!(bytes("ubfx r0, r0, #0, #1"), Ok(true));
    assert_eq!(bytes("movs r0, #0"), Ok(false));
    assert_eq!(bytes("movs r0, #1"), Ok(true));
    let halves = |index| code(index, "tbh [pc, r0, lsl #1]", &[".0002", ".0003"]);
    assert_eq!(halves("ubfx r0, r0, #0, #1"), Ok(true));
    assert_eq!(halves("mov.w r0, #0"), Ok(false));
    assert_eq!(halves("mov.w r0, #1"), Ok(true));
    let why = |index| bytes(index).expect_err("it is refused");
    let unbounded = "`tbb [pc, r0]` has an index that is not bounded";
    assert_eq!(why("mov r0, r1"), unbounded);
    assert_eq!(why("sbfx r0, r0, #0, #1"), unbounded);
    assert_eq!(why("movw r0, #1024"), unbounded);
    let outside = "`tbb [pc, r0]` has a table outside of the code";
    assert_eq!(why("movw r0, #1023"), outside);
    let base = code("movs r0, #0", "tbb [r1, r0]", &[".0201"]).expect_err("it is refused");
    assert_eq!(base, "`tbb [r1, r0]` has an index that is not bounded");
}

#[test]
fn a_function_returns_where_it_was_called_from() {
    let refused = |texts: &[&str]| {
        let why = handler(texts).expect_err("it is refused");
        why.split_once("` ")
            .map_or(why.clone(), |(_, why)| why.to_string())
    };
    for texts in [
        &["bx lr"][..],
        &["mov pc, lr"],
        &["push {r4, lr}", "pop {r4, pc}"],
        &["push {lr}", "pop.w {pc}"],
        &["push {r4, lr}", "add sp, #4", "pop {pc}"],
        &["push {r4, lr}", "add sp, #8", "bx lr"],
        &[
            "mov r3, lr",
            "movs r0, #0",
            "mov lr, r0",
            "mov lr, r3",
            "bx lr",
        ],
    ] {
        assert!(handler(texts).is_ok(), "{texts:?}");
    }
    let lost = "does not return to its caller";
    for texts in [
        &["push {r4, lr}", "bx lr"][..],
        &["movs r0, #0", "mov lr, r0", "bx lr"],
        &["push {r4, lr}", "pop {pc}"],
        &["push {r4, lr}", "str r0, [sp, #4]", "pop {r4, pc}"],
        &["push {r4, lr}", "strd r0, r0, [sp]", "pop {r4, pc}"],
        &[
            "push {r4, lr}",
            "add sp, #4",
            "push {r0}",
            "sub sp, #4",
            "pop {r4, pc}",
        ],
        &["pop {pc}"],
    ] {
        assert_eq!(refused(texts), lost, "{texts:?}");
    }
    assert_eq!(refused(&["mov pc, r3"]), "may lead anywhere");
    assert_eq!(refused(&["bx r3"]), "may lead anywhere");
    assert_eq!(refused(&["ldr pc, [r1]"]), "may lead anywhere");
    assert_eq!(refused(&["ldr pc, [sp]"]), "may lead anywhere");
    assert_eq!(refused(&["ldr pc, [r1], #4"]), "may lead anywhere");
    assert_eq!(refused(&["blx r3", "bx lr"]), "may lead anywhere");
    assert_eq!(
        refused(&["str r0, [sp]", "bx lr"]),
        "stores into its caller's stack"
    );
    assert_eq!(
        refused(&["str r0, [sp, #-4]", "bx lr"]),
        "stores below its stack"
    );
    // Above lies what an exception would write over.
    assert_eq!(
        refused(&["add sp, #8", "sub sp, #8", "bx lr"]),
        "moves the stack pointer out of its stack"
    );
    assert_eq!(
        refused(&["mov sp, r0", "bx lr"]),
        "moves the stack pointer nobody knows where"
    );
}

#[test]
fn what_leaves_the_code_is_refused() {
    for (texts, why) in [
        (&["svc #0", "bx lr"][..], "leaves the code's own hands"),
        (&["udf #1"], "leaves the code's own hands"),
        (
            &["ldc p1, c2, [r3, #4]", "bx lr"],
            "accesses memory for a coprocessor",
        ),
        (
            &["stc2 p1, c2, [r3], #4", "bx lr"],
            "accesses memory for a coprocessor",
        ),
        (&["wfe", "bx lr"], "sleeps"),
        (&["wfi", "bx lr"], "sleeps"),
        (&["movs r0, #0"], "is no code of core 0"),
        (&["b .+0x400"], "is no code of core 0"),
        (
            &[".ffff", ".ffff"],
            "is no instruction that may be executed",
        ),
        (
            &["bl .+0x400", "bx lr"],
            "`bl .+1024` calls what the certificate has not",
        ),
    ] {
        assert_eq!(handler(texts), Err(why.to_string()), "{texts:?}");
    }
    assert!(handler(&["mcr p1, #0, r0, c2, c3, #0", "bx lr"]).is_ok());
    // Half of an instruction where the code ends.
    assert_eq!(handler(&[".f000"]), Err("is no code of core 0".to_string()));
    let mut image = Image::new(&["bx lr"], &[], Vec::new());
    image.replace(".text.handler", HANDLER, &[0]);
    assert_eq!(proven(image), Err("is no code".to_string()));
    // An instruction whose end is a constant behind the code.
    let nop = assemble(&["nop.w", "bx lr"]);
    for (name, is_code) in [(".text.more", true), (".rodata", false)] {
        let mut image = Image::new(&["bx lr"], &[], Vec::new());
        image.replace(".text.handler", HANDLER, &nop[..2]);
        image.replace(name, HANDLER + 2, &nop[2..]);
        assert_eq!(proven(image).is_ok(), is_code);
    }
}

/// An indirect branch leads to its targets and nowhere else.
#[test]
fn an_indirect_branch_leads_to_its_targets() {
    let code = |texts: &[&str], at: u32, targets: &[u32]| {
        let tail = ["bx lr", "udiv r0, r1, r2", "bx lr"];
        let mut image = Image::new(&[texts, &tail].concat(), &[], Vec::new());
        let targets = targets.iter().map(|to| HANDLER + to).collect();
        image.certificate.targets = vec![(HANDLER + at, targets)];
        proven(image)
    };
    let jump = |targets: &[u32]| code(&["bx r3"], 0, targets).map(|cycles| cycles > 11);
    assert_eq!(jump(&[2]), Ok(false));
    assert_eq!(jump(&[4]), Ok(true));
    assert_eq!(jump(&[2, 4]), Ok(true));
    let moved = code(&["mov pc, r3"], 0, &[4]).map(|cycles| cycles > 11);
    assert_eq!(moved, Ok(true));
    // Also by LR, where the certificate says where it leads.
    assert_eq!(
        code(&["bx lr"], 0, &[4]).map(|cycles| cycles > 11),
        Ok(true)
    );
    assert!(code(&["bx r3"], 2, &[4]).is_err());
    // Whatever else would be a return, too.
    let moved = code(&["mov pc, lr"], 0, &[4]).map(|cycles| cycles > 11);
    assert_eq!(moved, Ok(true));
}

/// Whoever hands out an address of the stack has to say so, and nobody else.
#[test]
fn addresses_of_the_stack_are_handed_out_as_is_claimed() {
    for (texts, hands) in [
        (&["mov r0, sp", "bx lr"][..], true),
        (&["add r0, sp, #8", "bx lr"], true),
        (&["sub sp, #8", "add sp, #8", "bx lr"], false),
        (&["push {r4}", "ldr r4, [sp]", "pop {r4}", "bx lr"], false),
    ] {
        let mut image = Image::new(texts, &[], Vec::new())
            .prove()
            .expect("it is proven");
        assert_eq!(image.function(0).hands_stack, hands);
        image.function(0).hands_stack = !hands;
        let why = match hands {
            true => "hands out an address of the stack",
            false => "does not hand out addresses of its stack as is claimed",
        };
        assert!(image.why().ends_with(why), "{texts:?}: {}", image.why());
    }
}

/// In the code of keys a register points into the section that its words lie in.
#[test]
fn a_register_points_where_its_words_lie() {
    let image = Image::new(&["bx lr"], &[], Vec::new());
    let around = Around::new(&image.certificate, &image.elf, 0).expect("it is known");
    let core = core_of("cortex-m33").expect("a core");
    let mut facts = Facts::default();
    facts.set(1, [i64::from(DATA), i64::from(DATA) + 8]);
    let points = |kind| {
        let own = function("own", kind, HANDLER);
        let stepper = Stepper {
            core: &core,
            around: &around,
            certificate: &image.certificate,
            function: &own,
            costs: &[],
            room: Default::default(),
        };
        [1, 2].map(|register| stepper.derived(&facts, register))
    };
    assert_eq!(points(Kind::Keys), [Some(Tag::Section(DATA)), None]);
    assert_eq!(points(Kind::Plain), [None, None]);
    assert_eq!(points(Kind::Handler), [None, None]);
}

/// Where an access is known to go decides what it waits for.
#[test]
fn an_access_waits_where_it_is_known_to_go() {
    let high = |address: u32| format!("movt r1, #{}", address >> 16);
    let cycles = |address: u32, access: &str| {
        let low = format!("movw r1, #{}", address & 0xffff);
        let texts = [low.as_str(), &high(address), access, "bx lr"];
        handler(&texts).expect("it is proven")
    };
    let near = cycles(DATA, "ldr r0, [r1]");
    assert_eq!(cycles(DEVICES, "ldr r0, [r1]"), near + 3);
    assert_eq!(
        cycles(DEVICES, "str r0, [r1]"),
        cycles(DATA, "str r0, [r1]") + 2
    );
    // A load whose condition fails accesses nothing.
    let skipped = |text| {
        let low = format!("movw r1, #{}", DEVICES & 0xffff);
        let texts = [
            &low,
            &high(DEVICES),
            "movs r0, #1",
            "cmp r0, #0",
            "it eq",
            text,
            "bx lr",
        ];
        handler(&texts.map(|text| text)).expect("it is proven")
    };
    assert_eq!(skipped("ldreq r0, [r1]"), skipped("moveq r0, r1"));
}

/// Loads of one memory pipeline on a Cortex-M4; those of two do not, nor do those of which nobody
/// knows.
#[test]
fn loads_of_one_memory_overlap() {
    let cycles = |first: &str, second: &str| {
        let texts = [first, second, "bx lr"];
        proven(Image::new(&texts, &[], Vec::new()).on("cortex-m4")).expect("it is proven")
    };
    let one = cycles("ldr r0, [r1]", "ldr r3, [r1, #4]");
    assert_eq!(cycles("ldr r0, [r1]", "ldr r3, [r2, #4]"), one + 1);
    assert_eq!(cycles("ldr r0, [sp]", "ldr r3, [r2, #4]"), one + 1);
    assert_eq!(cycles("ldr r0, [sp]", "ldr r3, [sp, #4]"), one);
}
