//! Which slots hold a return address, how deep the stack gets, and which returns are refused.

use super::*;
use crate::{Annotations, Code};
use whippen_isa::timing::Core;
use whippen_isa::{Arch, parse};
use whippen_words::assembled;

/// Behind these instructions of a function: whether LR holds where it returns to, and which
/// slots do.
fn behind(texts: &[&str]) -> Result<(bool, Vec<i32>), NotBounded> {
    let mut place = StackSlot {
        sp: 0,
        returns: true,
        saved: Vec::new(),
    };
    for text in texts {
        let inst = parse(text, Arch::V8M, None).expect("an instruction");
        let item = Item {
            address: 0,
            inst,
            timed: Core::cortex_m33().prepare(&inst),
            control: Control::Next,
        };
        place.execute(&item, 0)?;
    }
    let slots = place.saved.iter().map(|(at, _)| *at).collect();
    Ok((place.returns, slots))
}

#[test]
fn a_saved_return_address_is_kept_until_something_is_stored_over_it() {
    let push = "push {r4, lr}";
    let kept = Ok((true, vec![-4]));
    for other in [
        "str r4, [sp]",
        "strd r2, r3, [sp, #-8]!",
        "strh r4, [sp, #2]",
        "vstr s0, [sp]",
        "vpush {s0-s1}",
        "str r4, [r3, #4]",
    ] {
        assert_eq!(behind(&[push, other]), kept, "{other}");
    }
    for over in [
        "str r4, [sp, #4]",
        "strb r4, [sp, #5]",
        "strh r4, [sp, #6]",
        "strb r4, [sp, #7]",
        "str r4, [sp, #3]",
        "strd r4, r4, [sp]",
        "vstr s0, [sp, #4]",
        "vstr d0, [sp]",
        "str r4, [sp, r3]",
        "stl r4, [sp]",
    ] {
        assert_eq!(behind(&[push, over]), Ok((true, vec![])), "{over}");
    }
}

#[test]
fn what_is_saved_is_a_whole_word_above_the_stack_pointer() {
    assert_eq!(
        behind(&["sub sp, #8", "str lr, [sp]"]),
        Ok((true, vec![-8]))
    );
    for part in ["strh lr, [sp]", "strb lr, [sp]", "str lr, [sp, r3]"] {
        assert_eq!(behind(&["sub sp, #8", part]), Ok((true, vec![])), "{part}");
    }
    let moved = ["push {r4, lr}", "add sp, #8", "sub sp, #8"];
    assert_eq!(behind(&moved), Ok((true, vec![])));
    assert_eq!(behind(&["str lr, [sp, #-4]"]), Ok((true, vec![])));
    let odd = behind(&["ldr r0, [sp], #2"]);
    assert_eq!(odd, Err(NotBounded::Stack { address: 0 }));
}

#[test]
fn it_comes_back_by_loads_of_that_word_alone() {
    let push = "push {r4, lr}";
    for back in ["ldr lr, [sp, #4]", "ldrd r4, lr, [sp]"] {
        assert_eq!(behind(&[push, back]), Ok((true, vec![-4])), "{back}");
    }
    let popped = ["push {lr}", "pop {lr}"];
    assert_eq!(behind(&popped), Ok((true, vec![])));
    for other in ["ldr lr, [sp]", "ldrh lr, [sp, #4]", "ldr lr, [sp, r3]"] {
        assert_eq!(behind(&[push, other]), Ok((false, vec![-4])), "{other}");
    }
}

/// Of functions, the first of which is the question; each text is an instruction, and each
/// function begins so many bytes behind the one before.
fn of(functions: &[&[&str]], annotations: &Annotations) -> Result<Stack, NotBounded> {
    let mut code = Code::default();
    for (texts, at) in functions.iter().zip((AT..).step_by(APART as usize)) {
        code.add(at, assembled(texts, Arch::V8M));
    }
    let query = Query {
        core: &Core::cortex_m33(),
        code: &code,
        entry: AT,
        annotations,
        interference: None,
    };
    let graph = Graph::build(&query, &crate::graph::Tables::default())?;
    follow(&query, &graph)
}

const AT: u32 = 0x100;
const APART: u32 = 0x20;

fn told(functions: &[&[&str]]) -> Result<(u32, i32), NotBounded> {
    let stack = of(functions, &Annotations::default())?;
    Ok((stack.deepest, stack.left))
}

#[test]
fn the_stack_is_as_deep_as_the_deepest_way() {
    assert_eq!(told(&[&["bx lr"]]), Ok((0, 0)));
    assert_eq!(told(&[&["push {r4, lr}", "pop {r4, pc}"]]), Ok((8, 0)));
    // A branch that stores nothing, and one way deeper than the other.
    let ways = ["cbz r0, .+6", "push {r4, r5}", "pop {r4, r5}", "bx lr"];
    assert_eq!(told(&[&ways]), Ok((8, 0)));
    // A return that is not taken moves nothing, and what is saved stays.
    let maybe = ["push {r4, lr}", "it eq", "popeq {r4, pc}", "pop {r4, pc}"];
    assert_eq!(told(&[&maybe]), Ok((8, 0)));
    // BL from 0x102 to 0x120 and back: both functions' bytes.
    let caller = ["push {r4, lr}", "bl .+30", "pop {r4, pc}"];
    let callee = ["push {r4, r5, r6, lr}", "pop {r4, r5, r6, pc}"];
    assert_eq!(told(&[&caller, &callee]), Ok((24, 0)));
    // Less of it where it comes to an end.
    let stops = Annotations {
        stops: [AT + 4].into(),
        ..Annotations::default()
    };
    let found = of(&[&["push {r4, lr}", "nop", "nop"]], &stops);
    assert_eq!(
        found,
        Ok(Stack {
            deepest: 8,
            left: -8
        })
    );
    // What is bounded elsewhere goes deeper from where it is called.
    let known = crate::Known {
        cycles: 1,
        stack_bytes: 100,
    };
    let known = Annotations {
        known: [((None, AT + APART), known)].into(),
        ..Annotations::default()
    };
    assert_eq!(
        of(&[&caller, &callee], &known),
        Ok(Stack {
            deepest: 108,
            left: 0
        })
    );
}

#[test]
fn a_return_that_may_go_elsewhere_is_refused() {
    let back = |address| Err(NotBounded::Return { address });
    let stack = |address| Err(NotBounded::Stack { address });
    // LR holds what the callee returns to; of two callees each returns to its own caller.
    let lost = ["bl .+32", "bx lr"];
    assert_eq!(told(&[&lost, &["bx lr"]]), back(AT + 4));
    let kept = ["push {r4, lr}", "bl .+30", "bl .+26", "pop {r4, pc}"];
    assert_eq!(told(&[&kept, &["bx lr"]]), Ok((8, 0)));
    // A callee that leaves something, or takes it, and one that returns by the caller's slot.
    assert_eq!(
        told(&[&kept, &["push {r0}", "bx lr"]]),
        back(AT + APART + 2)
    );
    assert_eq!(
        told(&[&kept, &["add sp, #4", "bx lr"]]),
        back(AT + APART + 2)
    );
    assert_eq!(told(&[&kept, &["pop {r4, pc}"]]), back(AT + APART));
    // By a register, or by a word that is not the saved one.
    assert_eq!(
        told(&[&["push {r4, lr}", "add sp, #8", "bx lr"]]),
        Ok((8, 0))
    );
    assert_eq!(
        told(&[&["push {lr}", "pop {r4}", "mov lr, r4", "bx lr"]]),
        back(AT + 6)
    );
    assert_eq!(
        told(&[&["push {r4, lr}", "sub sp, #8", "pop {r4, pc}"]]),
        back(AT + 4)
    );
    // Only one way saves it, or keeps it.
    let way = ["sub sp, #4", "cbz r0, .+6", "str lr, [sp]", "pop {pc}"];
    assert_eq!(told(&[&way]), back(AT + 8));
    let way = ["cbz r0, .+4", "mov lr, r1", "bx lr"];
    assert_eq!(told(&[&way]), back(AT + 4));
    // Where it is found only later that one way has lost it, what follows is looked at again.
    let later = ["cbz r0, .+6", "nop", "b .+4", "mov lr, r1", "bx lr"];
    assert_eq!(told(&[&later]), back(AT + 8));
    // Ways that meet with another stack pointer, and one that nobody knows.
    assert_eq!(
        told(&[&["cbz r0, .+4", "push {r4}", "bx lr"]]),
        stack(AT + 4)
    );
    assert_eq!(told(&[&["add sp, r0", "bx lr"]]), stack(AT));
    // Two ways into one function, at other depths.
    let ways = [
        "push {r4, lr}",
        "bl .+30",
        "push {r0}",
        "bl .+24",
        "pop {r0, r4, pc}",
    ];
    assert_eq!(told(&[&ways, &["bx lr"]]), Ok((12, 0)));
}

#[test]
fn ends_with_another_stack_pointer_are_apart_only_if_that_is_said() {
    let ways: &[&[&str]] = &[&["cbz r0, .+6", "push {r4}", "nop", "nop"]];
    let stops = |ends_apart| Annotations {
        stops: [AT + 4, AT + 6].into(),
        ends_apart,
        ..Annotations::default()
    };
    let at = of(ways, &stops(false));
    assert!(matches!(at, Err(NotBounded::Stack { .. })), "{at:?}");
    assert_eq!(of(ways, &stops(true)).map(|stack| stack.deepest), Ok(4));
    // Inside of a function the return is not asked for, that of a function it calls is.
    let inside = Annotations {
        inside: true,
        ..Annotations::default()
    };
    assert_eq!(
        of(&[&["pop {r4, pc}"]], &inside),
        Ok(Stack {
            deepest: 0,
            left: 8
        })
    );
    let callee: &[&str] = &["mov lr, r0", "bx lr"];
    let found = of(&[&["bl .+32", "pop {r4, pc}"], callee], &inside);
    assert_eq!(
        found,
        Err(NotBounded::Return {
            address: AT + APART + 2
        })
    );
}

/// What lies above belongs to the caller, and an exception writes over it; a piece of a
/// function begins where its caller saved.
#[test]
fn a_function_stays_below_its_caller() {
    let bounded = |texts: &[&str], inside| {
        let bytes = assembled(texts, Arch::V8M);
        let annotations = Annotations {
            inside,
            ..Annotations::default()
        };
        let found = crate::bound(&Query {
            core: &Core::cortex_m33(),
            code: &Code::new(0x2000_0000, bytes),
            entry: 0x2000_0000,
            annotations: &annotations,
            interference: None,
        });
        found.map(|_| ())
    };
    let above = ["nop", "add sp, #8", "sub sp, #8", "bx lr"];
    let address = 0x2000_0002;
    assert_eq!(bounded(&above, false), Err(NotBounded::Stack { address }));
    assert_eq!(bounded(&above, true), Ok(()));
    let below = ["push {r4}", "add sp, #4", "bx lr"];
    assert_eq!(bounded(&below, false), Ok(()));
}
