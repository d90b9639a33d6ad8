//! Calls that are followed, and those of functions that are bounded by themselves.

use super::proven;
use crate::certificate::{Frame, Function, Kind};
use crate::made::{DATA, HANDLER, Image, STACK, VECTORS, call, function};

/// Other code, for calls.
const CALLEE: u32 = HANDLER + 0x100;

/// A handler that saves LR, calls, and returns.
const CALLS: [&str; 3] = ["push {r4, lr}", "bl .+0xfe", "pop {r4, pc}"];
const SITE: u32 = HANDLER + 2;
const BACK: u32 = HANDLER + 6;

fn calling(contexts: &[[u32; 3]], callee: &[&str]) -> Image {
    let mut handling = function("handler", Kind::Handler, HANDLER);
    handling.contexts.extend_from_slice(contexts);
    Image::with(handling, &CALLS, &[(CALLEE, callee)], Vec::new())
}

/// A call that is followed is its instructions in a row, in the context of its caller.
#[test]
fn a_call_is_followed() {
    let context = [0, BACK, CALLEE];
    let alone = proven(calling(&[context], &["bx lr"])).expect("it is proven");
    let more = proven(calling(&[context], &["udiv r0, r1, r2", "bx lr"]));
    assert_eq!(more, Ok(alone + 11));
    let saves = [
        "push {r4, r5, lr}",
        "bl .+6",
        "pop {r4, r5, pc}",
        "nop",
        "bx lr",
    ];
    let inner = [1, CALLEE + 6, CALLEE + 8];
    let mut image = calling(&[context, inner], &saves)
        .prove()
        .expect("it is proven");
    assert_eq!(image.why(), "");
    // 8 bytes of the handler's, 12 of the callee's.
    assert_eq!(image.function(0).stack, 20);
    assert!(proven(calling(&[context], &saves)).is_err());
    assert!(proven(calling(&[], &["bx lr"])).is_err());
    assert!(proven(calling(&[[0, BACK + 2, CALLEE]], &["bx lr"])).is_err());
    // Nobody calls what may lead to it.
    let again = [1, CALLEE + 6, CALLEE];
    let round = ["push {lr}", "bl .-2", "pop {pc}"];
    let why = proven(calling(&[context, again], &round));
    assert!(why.is_err(), "{why:?}");
    // A callee that leaves the stack lower, or returns past its caller.
    for texts in [
        &["push {r4}", "bx lr"][..],
        &["add sp, #4", "pop {pc}"],
        &["str r0, [sp, #4]", "bx lr"],
    ] {
        assert!(proven(calling(&[context], texts)).is_err(), "{texts:?}");
    }
}

/// A handler that calls once, with this instruction behind the call.
fn calling_once(behind: &'static str) -> [&'static str; 5] {
    [
        "push {r4, lr}",
        "movs r0, #1",
        "bl .+0xfc",
        behind,
        "pop {r4, pc}",
    ]
}

/// A function that is bounded by itself: its cycles are added, its stack lies below the caller's,
/// and afterwards nothing is known of registers.
#[test]
fn a_call_costs_what_its_function_does() {
    let image = |callee: &[&str], behind: &'static str| {
        let mut handling = function("handler", Kind::Handler, HANDLER);
        handling.calls = vec![call(SITE + 2, CALLEE, 0, 0)];
        let plain = function("callee", Kind::Plain, CALLEE);
        let texts = calling_once(behind);
        let others: [(u32, &[&str]); 1] = [(CALLEE, callee)];
        Image::with(handling, &texts, &others, vec![plain])
    };
    let cycles = |callee: &[&str], behind| {
        let image = image(callee, behind).prove().expect("it is proven");
        assert_eq!(image.why(), "");
        (image.cycles(2, 0), image.cycles(0, 0))
    };
    let (callee, caller) = cycles(&["bx lr"], "nop");
    let (longer, whole) = cycles(&["udiv r0, r1, r2", "bx lr"], "nop");
    assert_eq!((longer, whole), (callee + 11, caller + 11));
    let mut deep = image(&["push {r4, r5}", "pop {r4, r5}", "bx lr"], "nop");
    deep = deep.prove().expect("it is proven");
    assert_eq!((deep.why().as_str(), deep.function(0).stack), ("", 16));
    // R0 is 1 before the call, anything behind it.
    let table = image(&["bx lr"], "tbb [pc, r0]").prove().map(|_| ());
    assert!(table.is_err_and(|why| why.why.ends_with("has an index that is not bounded")));
    // What is never called costs nothing, and nothing follows.
    let mut never = image(&["bx lr"], "udiv r0, r1, r2");
    never.function(0).calls[0].costs = None;
    let never = never.prove().expect("it is proven");
    assert_eq!((never.why().as_str(), never.cycles(0, 0)), ("", 0));
    // A number of keys, or another function.
    for (number, keys) in [(0, 1), (1, 0), (2, 0), (9, 0)] {
        let mut other = image(&["bx lr"], "nop");
        other.function(0).calls[0].costs = Some((number, keys));
        assert!(other.prove().is_err(), "{number} {keys}");
    }
}

/// A function is bounded with the return to one place; others cost no more.
#[test]
fn a_function_returns_for_what_it_is_bounded_with() {
    let image = |returns: Option<(u32, bool)>, behind: &'static str| {
        let mut handling = function("handler", Kind::Handler, HANDLER);
        handling.calls = vec![call(HANDLER + 4, CALLEE, 0, 0)];
        let plain = Function {
            returns,
            ..function("callee", Kind::Plain, CALLEE)
        };
        let texts = calling_once(behind);
        let others: [(u32, &[&str]); 1] = [(CALLEE, &["bx lr"])];
        Image::with(handling, &texts, &others, vec![plain])
    };
    let back = HANDLER + 8;
    let cycles = |returns, behind| {
        image(returns, behind)
            .prove()
            .map(|image| image.cycles(2, 0))
    };
    // Nowhere in particular: a 32-bit instruction in an upper half.
    let (any, lower) = (cycles(None, "nop"), cycles(Some((back, false)), "nop"));
    assert_eq!(
        any.map_err(|why| why.why),
        lower
            .clone()
            .map(|cycles| cycles + 1)
            .map_err(|why| why.why)
    );
    assert_eq!(cycles(Some((back + 2, true)), "nop"), cycles(None, "nop"));
    assert_eq!(cycles(Some((back + 2, false)), "nop"), lower);
    assert_eq!(cycles(Some((back, true)), "movw r0, #1"), lower);
    // The call stands where what is behind it begins in an upper half.
    let upper = |returns| {
        let mut handling = function("handler", Kind::Handler, HANDLER);
        handling.calls = vec![call(HANDLER + 2, CALLEE, 0, 0)];
        let plain = Function {
            returns,
            ..function("callee", Kind::Plain, CALLEE)
        };
        let texts = ["push {r4, lr}", "bl .+0xfe", "movw r0, #1", "pop {r4, pc}"];
        let others: [(u32, &[&str]); 1] = [(CALLEE, &["bx lr"])];
        Image::with(handling, &texts, &others, vec![plain])
            .prove()
            .map(|_| ())
    };
    assert_eq!(upper(None), Ok(()));
    assert_eq!(upper(Some((HANDLER + 6, true))), Ok(()));
    for returns in [(HANDLER + 4, true), (HANDLER + 6, false)] {
        let why = upper(Some(returns)).expect_err("it costs more");
        assert!(
            why.why.ends_with("is returned to at more than is claimed"),
            "{why}"
        );
    }
    // Banks that are fetched from where it returns are fetched from while it runs.
    let mut other = image(Some((back, false)), "nop")
        .prove()
        .expect("it is proven");
    other.function(2).fetched = 0b0111;
    assert!(
        other
            .why()
            .contains("is fetched from a bank that is not claimed")
    );
}

/// An indirect call goes on in the context of each of its targets, and comes back.
#[test]
fn an_indirect_call_comes_back() {
    let mut handling = function("handler", Kind::Handler, HANDLER);
    let back = HANDLER + 4;
    let callees = [CALLEE, CALLEE + 2];
    handling.contexts.extend(callees.map(|to| [0, back, to]));
    let texts = ["push {r4, lr}", "blx r3", "pop {r4, pc}"];
    let code: [(u32, &[&str]); 1] = [(CALLEE, &["bx lr", "udiv r0, r1, r2", "bx lr"])];
    let image = Image::with(handling, &texts, &code, Vec::new());
    let with = |targets: &[u32]| {
        let mut image = image.clone();
        image.certificate.targets = vec![(HANDLER + 2, targets.to_vec())];
        proven(image).map(|cycles| cycles > 11)
    };
    assert_eq!(with(&callees[..1]), Ok(false));
    assert_eq!(with(&callees), Ok(true));
}

/// A call is of one function at one place: another one there, and the same elsewhere, is not known.
#[test]
fn a_known_call_is_of_its_place_and_its_callee() {
    let image = |texts: &[&str], targets: &[u32], site: u32| {
        let mut handling = function("handler", Kind::Handler, HANDLER);
        handling.calls = vec![call(HANDLER + site, CALLEE, 0, 0)];
        let plain = function("callee", Kind::Plain, CALLEE);
        let code: [(u32, &[&str]); 1] = [(CALLEE, &["bx lr", "bx lr"])];
        let mut image = Image::with(handling, texts, &code, vec![plain]);
        let targets = targets.iter().map(|to| CALLEE + to).collect();
        image.certificate.targets = vec![(HANDLER + 2, targets)];
        proven(image).err().unwrap_or_default()
    };
    let indirect = ["push {r4, lr}", "blx r3", "pop {r4, pc}"];
    let unknown = "calls what the certificate has not";
    assert_eq!(image(&indirect, &[0], 2), "");
    assert!(image(&indirect, &[0, 2], 2).ends_with(unknown));
    let twice = ["push {r4, lr}", "blx r3", "bl .+0xfc", "pop {r4, pc}"];
    assert!(image(&twice, &[0], 2).ends_with(unknown));
    assert!(image(&twice, &[0], 4).ends_with(unknown));
}

/// A handler whose callee is bounded with the return to that place, where core 1 has a word; what
/// is behind the call begins in the upper half of a word of bank 1.
fn returning(at: u32, callee: u32, call_it: &str, fetched: u32, other: u32) -> String {
    let mut handling = function("handler", Kind::Handler, HANDLER);
    handling.fetched = 0x1f;
    handling.calls = vec![call(HANDLER + 2, callee, 0, 0)];
    let plain = Function {
        returns: Some((at, true)),
        fetched,
        ..function("callee", Kind::Plain, callee)
    };
    let texts = ["push {r4, lr}", call_it, "movw r0, #1", "pop {r4, pc}"];
    let code: [(u32, &[&str]); 1] = [(callee, &["bx lr"])];
    let mut image = Image::with(handling, &texts, &code, vec![plain]);
    image.replace(".data.core1", DATA + other, &[0; 4]);
    let vectors = VECTORS + 0x100;
    image.replace(".vectors", vectors, &(STACK - 0x800).to_le_bytes());
    image.certificate.cores = 2;
    image.certificate.frames.push(Frame {
        core: 1,
        vectors,
        ..Frame::default()
    });
    image.prove().err().map_or(String::new(), |why| why.why)
}

/// Where a function returns a fetch may wait, and other banks may be fetched from, than where it is
/// bounded to.
#[test]
fn a_return_waits_where_it_leads() {
    let more = "is returned to at more than is claimed";
    let near = |at: u32| returning(HANDLER + at, CALLEE, "bl .+0xfe", 0, 0x104);
    assert_eq!([near(0x06), near(0x16)], ["", ""]);
    assert!(near(0x0a).ends_with(more) && near(0x02).ends_with(more));
    // A callee in the bank of the stack, which is fetched from there.
    let (far, all) = (STACK - 0xf00, 0x1f);
    let there = |fetched| returning(STACK - 0xe02, far, "bl .+0x100fe", fetched, 0x108);
    let why = there(0x10);
    assert!(why.ends_with(more), "{why}");
    let own = returning(HANDLER + 6, far, "bl .+0x100fe", all, 0x108);
    assert_eq!(own, "");
}
