//! The table of operators, against the compiler's.

use whippen_kernel::op::{Immediate, ROWS, Sort};

use super::{of_type, of_value, row_of};
use crate::ranges::rule::Interval;

fn letter(sort: &Sort) -> char {
    match sort {
        Sort::I1 => 'b',
        Sort::I64 => 'd',
        Sort::N => 'n',
        Sort::T => 't',
        Sort::Own => 'o',
        Sort::Args => '*',
        Sort::I32 | Sort::Index | Sort::Plus | Sort::Minus | Sort::End => 'w',
    }
}

/// The kind of what an immediate names, or the letter of a number.
fn named(immediate: &Immediate) -> Result<&'static str, char> {
    Ok(match immediate {
        Immediate::Input => "in",
        Immediate::Output => "out",
        Immediate::Live => "live",
        Immediate::Keyed => "keyed",
        Immediate::Cell => "cell",
        Immediate::Line => "line",
        Immediate::Table => "table",
        Immediate::Event => "event",
        Immediate::Probe => "probe",
        Immediate::Shift => return Err('s'),
        _ => return Err('k'),
    })
}

#[test]
fn operators_are_those_of_kernels() {
    let mut count = 0;
    for row in ROWS {
        let own = row_of(row.name);
        if ["if", "loop"].contains(&row.name) {
            assert!(own.is_none());
            continue;
        }
        let own = own.expect(row.name);
        let args: String = row.args.iter().map(letter).collect();
        let result: String = row.result.iter().map(letter).collect();
        let kinds = row.immediates.iter().filter_map(|own| named(own).ok());
        let numbers = row.immediates.iter().filter_map(|own| named(own).err());
        assert_eq!(
            (own.args, own.result),
            (&args[..], &result[..]),
            "{}",
            row.name
        );
        assert!(own.kinds().eq(kinds), "{}", row.name);
        assert_eq!(own.numbers, numbers.collect::<String>(), "{}", row.name);
        count += 1;
    }
    let all = super::ROWS.iter().flat_map(|row| row.ops.split(' '));
    assert_eq!(all.count(), count);
    assert!(row_of("sh").is_none() && row_of("").is_none() && row_of("shl sar").is_none());
}

#[test]
fn ports_hold_half_a_word_of_a_value() {
    let ends = |ty| of_type(ty).map(|all| (all.holds(-1), all.holds(0xffff)));
    assert_eq!(ends("u16"), Some((false, true)));
    assert_eq!(ends("i16"), Some((true, false)));
    assert_eq!(of_type("i16"), Some(Interval::new(-0x8000, 0x7fff)));
    assert_eq!(of_type("u16"), Some(Interval::new(0, 0xffff)));
    assert_eq!(of_type("i8"), None);
    assert_eq!(
        ["i16", "u16", "i1", "i64"].map(of_value),
        ["i32", "i32", "i1", "i64"]
    );
}
