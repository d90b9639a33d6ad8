//! The programs of the manual.

use super::super::Options;
use crate::front::compile_front;
use crate::source::SourceMap;

const FILES: &[(&str, &str)] = &[
    ("grand-piano.whip", include_str!("../../../../instruments/grand-piano.whip")),
    ("harpsichord.whip", include_str!("../../../../instruments/harpsichord.whip")),
    ("hammond.whip", include_str!("../../../../instruments/hammond.whip")),
    ("mikey.whip", include_str!("../../../../instruments/mikey.whip")),
];

#[test]
fn dump() {
    let mut map = SourceMap::default();
    for (n, t) in FILES {
        map.add(*n, *t);
    }
    let (program, diags) = compile_front(&mut map, &Options::default());
    for d in &diags {
        println!(
            "{} {:?} {} [{}] {:?} {:?}",
            d.code.number(),
            map.line_column(d.span),
            d.message,
            d.label,
            d.others,
            d.hints
        );
    }
    for m in program.iter().flat_map(|p| &p.instruments) {
        println!("{m}");
    }
}
