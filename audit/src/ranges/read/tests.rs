//! Lines that are read, and those that are not.

use crate::ranges::check_ranges;

/// What is declared lies in its type.
#[test]
fn what_is_declared_lies_in_its_type() {
    let declares = |line: &str| {
        let found = check_ranges(&format!("kernel k @44100 {{\n  {line}\n}}\n"));
        found.err().map_or(String::new(), |why| why.why)
    };
    for line in [
        "in z: u16 [0..65535]",
        "out z: i16 [-32768..32767]",
        "live z: i32 [-2147483648..2147483647] = 0",
        "cell z: i64 [-9223372036854775808..9223372036854775807] = 0",
        "cell z: i1 x 4 [0..1] = 0",
        "keyed z: i32 [0..3] = { 1, 2, 3 }",
        "line z: 4 [-7..7]",
        "table z = {  }",
        "table z = { -2147483648, 2147483647 }",
        "event z(3)",
        "probe z: i64",
        "in \"a b\": u16 [0..1]",
    ] {
        assert_eq!(declares(line), "");
    }
    for line in [
        "in z: u16 [0..65536]",
        "in z: u16 [-1..6]",
        "out z: i16 [-32769..0]",
        "live z: i32 [0..2147483648] = 0",
        "cell z: i1 [0..2] = 0",
        "cell z: i8 [0..1] = 0",
        "cell z: i32 [1..0] = 0",
        "line z: 4 [0..2147483648]",
    ] {
        assert!(
            declares(line).contains("`z` has no "),
            "{line}: {}",
            declares(line)
        );
    }
    for line in [
        "keyed z: i32 [0..3] = { 1, 4 }",
        "table z = { 2147483648 }",
        "live z: i32 [0..1] = 2",
    ] {
        assert!(declares(line).contains("`z` begins outside of"), "{line}");
    }
    for line in [
        "in z: u16",
        "in z",
        "in z u16 [0..1]",
        "in z: u16 [0..1] = 0",
        "in z: u16 [0..1",
        "in z: u16 [0-1]",
        "in \"z: u16 [0..1]",
        "cell z: i32 [0..1]",
        "cell z: i32 [0..1] = ",
        "cell z: i32 [0..1] = 0 0",
        "cell z: i32 [0..1] = 999999999999999999999999999999999999999999",
        "cell z: i32 x [0..1] = 0",
        "cell z: i32 x 0 [0..1] = 0",
        "keyed z: i32 [0..3] = 1",
        "keyed z: i32 [0..3] = { 1 2 }",
        "keyed z: i32 [0..3] = { 1, }",
        "keyed z: i32 [0..3] = { 1",
        "keyed z: i32 [0..3] = { 1, 2 } 3",
        "keyed z: i32 [0..3] = { , }",
        "line z: [0..1]",
        "line z 4 [0..1]",
        "table z x = { 1 }",
        "table z x 0 = { 1 }",
        "table z x 2 { 1 }",
        "event z",
        "event z(-1)",
        "event z(1",
        "probe z",
        "probe z: i32 [0..1]",
        "thing z: i32 [0..1]",
    ] {
        assert!(
            declares(line).ends_with("` declares nothing"),
            "{line}: {}",
            declares(line)
        );
    }
    let twice = "in z: u16 [0..1]\n out z: i16 [0..1]";
    assert!(declares(twice).ends_with("`z` is declared twice"));
}

/// A text that is no Kernel's is refused where it is none.
#[test]
fn what_is_no_kernel_is_refused() {
    let read = |text: &str| {
        check_ranges(text)
            .map(|all| all.len())
            .map_err(|why| why.why)
    };
    let err = |why: &str| Err(why.to_string());
    assert_eq!(read(""), Ok(0));
    assert_eq!(
        read("kernel a @1 {\n}\n\nkernel \"b c\" @1 {\n init {\n }\n tick {\n }\n}"),
        Ok(2)
    );
    for line in [
        "kernel",
        "kernel a",
        "kernel a @1",
        "kernel a {",
        "kernel a @1 { }",
        "kernels a @1 {",
    ] {
        let why = format!("`{line}` begins no Kernel");
        assert_eq!(read(&format!("{line}\n}}\n")), Err(why));
    }
    let of = |text: &str| read(&format!("kernel k @1 {{\n{text}"));
    assert_eq!(of(""), err("a Kernel does not end"));
    assert_eq!(of("tick {\n}"), err("a Kernel does not end"));
    assert_eq!(of("tick {"), err("a region does not end"));
    assert_eq!(
        of("tick {\n}\ntick {\n}\n}"),
        err("`tick {` is there twice")
    );
    assert_eq!(
        of("init {\n}\ninit {\n}\n}"),
        err("`init {` is there twice")
    );
    assert_eq!(
        of("tick {\n} else {\n}\n}"),
        err("`} else {` ends no region")
    );
    let tick = |lines: &str| {
        of(&format!(
            "tick {{\nv0: i1 [1..1] = const 1\n{lines}\n}}\n}}"
        ))
    };
    assert_eq!(tick(""), Ok(1));
    assert_eq!(tick("if v0 {\n} else {\n}"), Ok(1));
    assert_eq!(
        tick("if v0 {\n} else {\n} else {\n}"),
        err("`} else {` ends no region")
    );
    assert_eq!(tick("if v0 {\n} or {\n}"), err("`} or {` ends no region"));
    let looped = "loop 2 (v1: i32 [0..1]) {";
    assert_eq!(tick(&format!("{looped}\n}}")), Ok(1));
    assert_eq!(
        tick(&format!("{looped}\n}} else {{\n}}")),
        err("`} else {` ends no region")
    );
    assert_eq!(
        tick("if v0 {\nyield v0\nyield v0\n}"),
        err("a region goes on behind its end")
    );
    for line in [
        "yield v",
        "yield w0",
        "yield v0 [",
        "if v0",
        "if v0 { v1",
        "not v0 {",
        "v1: i1 [0..0] = not v0 [",
        "v1: i1 [0..0] = not v0 \"",
        "v1: i1 [0..0] = not v0 x",
        "v1: i1 [0..0] = not v0 (v2: i32 [0..1])",
        "v1: i1 [0..0] = not v0 x v2: i32 [0..1])",
        "if v0 (v2: i32 [0..1]) {",
        "loop 2 x v2: i32 [0..1]) {",
        "v1: i1 [0..0] = not v4294967296",
        "v1: i1 [0..0] not v0",
        "v1: i1 [0..0], = not v0",
        "v1 i1 [0..0] = not v0",
        "v1: i1 0..0 = not v0",
        "v1: i1 [0..0 = not v0",
        "w1: i1 [0..0] = not v0",
        "= not v0",
        "loop 2 (v1: i32 [0..1] {",
        "loop 2 (v1: i32 [0..1], ) {",
        "loop 2 (v1: i32 [0..1] = 3) {",
        "loop 2 (1: i32 [0..1]) {",
        "loop 2 {",
        "loop",
        "const (",
    ] {
        let found = tick(&format!("{line}\n}}"));
        let refused = found.expect_err(line);
        let none = refused == format!("`{line}` is no instruction");
        assert!(
            none || line == "loop 2 {" && refused.ends_with("has no round"),
            "{line}: {refused}"
        );
    }
}
