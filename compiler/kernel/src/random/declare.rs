//! Random declarations.

use super::Draw;
use super::Rng;
use crate::{Builder, Range, Type};

/// Declares something of every kind.
pub(super) fn all(rng: &mut Rng, b: &mut Builder) {
    let i32s = Type::I32.range();
    for at in 0..1 + rng.below(3) {
        let full = Range::new(0, 65_535);
        let range = if rng.chance(2, 3) {
            full
        } else {
            rng.range(full)
        };
        b.input(&format!("in{at}"), range);
    }
    for at in 0..1 + rng.below(2) {
        let full = Range::new(-32_768, 32_767);
        let range = if rng.chance(2, 3) {
            full
        } else {
            rng.range(full)
        };
        b.output(&format!("out{at}"), range);
    }
    for at in 0..1 + rng.below(2) {
        let range = rng.range(i32s);
        let init = rng.interesting(range) as i32;
        b.live(&format!("live{at}"), range, init);
    }
    for at in 0..1 + rng.below(2) {
        let range = rng.range(i32s);
        let values = (0..1 + rng.below(4))
            .map(|_| rng.interesting(range) as i32)
            .collect();
        b.keyed(&format!("keyed{at}"), range, values);
    }
    for at in 0..1 + rng.below(5) {
        cell(rng, b, &format!("cell{at}'"));
    }
    if rng.chance(1, 2) {
        string(rng, b);
    }
    for at in 0..1 + rng.below(3) {
        let (narrow, len) = (rng.chance(1, 2), rng.pick(&[1, 2, 3, 3, 5, 31]));
        let range = rng.range(if narrow { Range::new(0, 65_535) } else { i32s });
        b.line(&format!("line.{at}"), len, range);
    }
    for at in 0..1 + rng.below(2) {
        let columns = rng.pick(&[1, 1, 3, 4]);
        let values = (0..columns * rng.pick(&[1, 2, 7, 64]))
            .map(|_| rng.interesting(i32s) as i32)
            .collect();
        b.table(&format!("table {at}"), columns, values);
    }
    for at in 0..1 + rng.below(2) {
        b.event(&format!("event{at}"), rng.below(5) as u32);
    }
    for at in 0..1 + rng.below(3) {
        let ty = rng.ty();
        b.probe(&format!("probe{at}"), ty);
    }
}

fn cell(rng: &mut Rng, b: &mut Builder, name: &str) {
    let ty = rng.ty();
    let range = if ty == Type::I1 {
        ty.range()
    } else {
        rng.range(ty.range())
    };
    let len = rng.pick(&[1, 1, 1, 2, 3, 8, 84]);
    let init = rng.interesting(range);
    b.grid(name, ty, len, range, init);
}

/// The two cells of a string.
fn string(rng: &mut Rng, b: &mut Builder) {
    let (range, len) = (Type::I32.range(), rng.pick(&[5, 6, 7, 8, 9, 12, 31]));
    for (name, len) in [("string.e", len + 1), ("string.v", len)] {
        let init = rng.interesting(range);
        b.grid(name, Type::I32, len, range, init);
    }
}
