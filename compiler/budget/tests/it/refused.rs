//! What cannot be bounded is refused, with the place and what is missing; and what can be once it
//! is told.

use std::collections::BTreeSet;

use whippen_budget::{Annotations, Bound, Code, NotBounded};

use super::{CODE, bound_of, returning};

/// Of halfwords.
fn asked(halfwords: &[u16], annotations: &Annotations) -> Result<Bound, NotBounded> {
    let bytes = halfwords
        .iter()
        .flat_map(|half| half.to_le_bytes())
        .collect();
    bound_of(&Code::new(CODE, bytes), CODE, annotations)
}

fn refused(halfwords: &[u16]) -> String {
    asked(halfwords, &returning())
        .expect_err("no bound")
        .to_string()
}

#[test]
fn refusals_say_where_and_what_is_missing() {
    let cases: &[(&str, &[u16])] = &[
        ("adds r0, #1, and the end of the bytes", &[0x3001]),
        ("udf", &[0xde00]),
        ("an undefined word", &[0xffff, 0xffff]),
        ("wfi", &[0xbf30, 0x4770]),
        ("ldc p1, c2, [r3, #4]", &[0xed93, 0x2101, 0x4770]),
        ("bx r3", &[0x4718]),
        ("subs r0, #1; bne .-2; bx lr", &[0x3801, 0xd1fd, 0x4770]),
        (
            "cbz r0, 2f; 1: subs r1, #1; 2: subs r2, #1; bne 1b; bx lr",
            &[0xb100, 0x3901, 0x3a01, 0xd1fc, 0x4770],
        ),
        ("push {lr}; bl .-2", &[0xb500, 0xf7ff, 0xfffd, 0xbd00]),
        ("push {r0}; bx lr", &[0xb401, 0x4770]),
        (
            "push {r4}; cbz r0, 1f; push {r5}; 1: pop {r4}; bx lr",
            &[0xb410, 0xb100, 0xb420, 0xbc10, 0x4770],
        ),
        ("mov lr, r0; bx lr", &[0x4686, 0x4770]),
        ("push {r4, lr}; pop {pc}", &[0xb510, 0xbd00]),
        ("mov sp, r0; bx lr", &[0x4685, 0x4770]),
        (
            "tbb [pc, r0] with any r0",
            &[0xe8df, 0xf000, 0x0101, 0x4770],
        ),
        ("b .", &[0xe7fe]),
    ];
    let told: Vec<String> = cases
        .iter()
        .map(|(code, halfwords)| format!("{code}\n    {}", refused(halfwords)))
        .collect();
    insta::assert_snapshot!(told.join("\n"));
}

#[test]
fn a_loop_costs_its_rounds() {
    // MOVS R5, #100; 1: SUBS R5, #1; BNE 1b; BX LR: 299 is published for the loop where SUBS is
    // word aligned.
    let mut annotations = returning();
    annotations.loops.insert(CODE + 4, 100);
    let bound = asked(&[0xbf00, 0x2564, 0x3d01, 0xd1fd, 0x4770], &annotations).expect("a bound");
    let (nop, back) = (0, 2);
    assert_eq!(bound.cycles_max, nop + 299 + 1 + back - 1);
    let head = bound
        .path
        .iter()
        .filter(|step| step.address == CODE + 4)
        .count();
    assert_eq!(head, 100);
}

#[test]
fn many_rounds_are_summed_without_being_written_out() {
    let mut annotations = returning();
    annotations.loops.insert(CODE + 4, 1_000_000);
    let bound = asked(&[0xbf00, 0x2564, 0x3d01, 0xd1fd, 0x4770], &annotations).expect("a bound");
    assert!(
        (2_999_998..=3_000_003).contains(&bound.cycles_max),
        "{}",
        bound.cycles_max
    );
    assert!(bound.merged);
}

#[test]
fn a_bounded_table_is_read() {
    // CMP R0, #2; BHI 1f; TBB [PC, R0]; three entries, one to itself's end; 1: BX LR
    let code = [
        0x2802, 0xd804, 0xe8df, 0xf000, 0x0302, 0x0004, 0x4770, 0x4770, 0x4770,
    ];
    let bound = asked(&code, &returning()).expect("a bound");
    let stops: BTreeSet<u32> = [CODE + 12, CODE + 14, CODE + 16].into();
    let reached = bound.path.iter().any(|step| stops.contains(&step.address));
    assert!(reached, "{:x?}", bound.path);
    assert_eq!(bound.infeasible, 0);
}

/// Three entries, as bytes and as halfwords: to a return, to a sum and one, to a division and one.
/// What the index cannot be does not count, and nothing of what it can be is left out.
#[test]
fn every_entry_that_the_index_may_be_is_followed() {
    let bytes = [
        0x2800, 0xd803, 0xe8df, 0xf000, 0x0302, 0x0005, 0x4770, 0x3101, 0x4770, 0xfbb2, 0xf1f3,
        0x4770,
    ];
    let halves = [
        0x2800, 0xd804, 0xe8df, 0xf010, 3, 4, 6, 0x4770, 0x3101, 0x4770, 0xfbb2, 0xf1f3, 0x4770,
    ];
    for (table, [sum, division]) in [(&bytes[..], [14, 18]), (&halves[..], [16, 20])] {
        let of = |most: u16| {
            let compared = [&[table[0] | most], &table[1..]].concat();
            asked(&compared, &returning()).expect("a bound")
        };
        let [one, two, three] = [0, 1, 2].map(of);
        // BGT in the place of BHI: the index may be below 0.
        let signed = [&[table[0] | 2, table[1] | 0x400], &table[2..]].concat();
        let refused = asked(&signed, &returning()).expect_err("no bound");
        assert!(matches!(refused, NotBounded::NoTable { .. }));
        let passes = |bound: &Bound, at| bound.path.iter().any(|step| step.address == CODE + at);
        assert!(!passes(&one, sum) && !passes(&two, division));
        assert!(passes(&two, sum) && two.cycles_max >= one.cycles_max);
        assert!(passes(&three, division) && three.cycles_max > two.cycles_max + 4);
        assert!(one.code_bytes < two.code_bytes && two.code_bytes < three.code_bytes);
    }
}

/// Where the index is 1 or 2, the first entry, to a division, is led to by none.
#[test]
fn an_entry_that_no_index_leads_to_does_not_count() {
    let code = [0xe8df, 0xf000, 0x0402, 0x0004, 0xfbb2, 0xf1f3, 0x4770];
    let of = |least: u32| {
        let entered = [(0, [least, 2])].into();
        let known = Annotations {
            entered,
            ..returning()
        };
        let bound = asked(&code, &known).expect("a bound");
        bound.path.iter().any(|step| step.address == CODE + 8)
    };
    assert_eq!([0, 1].map(of), [true, false]);
}

#[test]
fn what_a_path_stops_at_is_not_counted() {
    let whole = asked(&[0x3001, 0x3001, 0x4770], &returning())
        .expect("a bound")
        .cycles_max;
    let stopped = Annotations {
        stops: [CODE + 4].into(),
        ..returning()
    };
    let short = asked(&[0x3001, 0x3001, 0x4770], &stopped)
        .expect("a bound")
        .cycles_max;
    assert_eq!((short, whole), (2, 3));
}
