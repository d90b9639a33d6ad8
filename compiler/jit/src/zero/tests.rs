//! Random stretches of instructions with two factors, against the interpreter, and one that is
//! looked at.

use super::{WhereZero, branches};
use crate::random_insts::RandomInsts;
use crate::{JitCode, Options};
use whippen_kernel::random::Rng;
use whippen_kernel::{Builder, Interp, Kernel, Op, Range, Type};

/// What a stretch leaves.
const LEFT: u32 = 6;

/// How far from 0 the words of inputs go.
const INPUT_MAX: u64 = 12;

/// Two factors, each of what an input is above a limit, and instructions at random.
fn stretch(rng: &mut Rng) -> Kernel {
    let mut b = Builder::new("stretch", 44_100);
    let all = Type::I32.range();
    let ports = ["x", "y"].map(|name| b.input(name, Range::new(0, INPUT_MAX as i64)));
    let cells: Vec<u32> = (0..LEFT)
        .map(|n| b.cell(&format!("c{n}"), Type::I32, all, 0))
        .collect();
    b.begin_tick();
    let numbers = [0, 4, 1 << 20, -77];
    let values = numbers.map(|number| b.constant(Type::I32, number).expect("a word"));
    let mut stretch = RandomInsts {
        b,
        values: values.to_vec(),
    };
    for port in ports {
        let word = stretch.add(Op::In(port), &[]).expect("a port");
        let above = stretch.add(Op::Sub, &[word, values[1]]).expect("fits");
        let factor = stretch.add(Op::Max, &[values[0], above]).expect("fits");
        stretch.add(Op::Shl(27), &[factor]).expect("fits");
    }
    for cell in &cells[..2] {
        stretch.add(Op::Get(*cell), &[]);
    }
    for _ in 0..60 {
        stretch.any_op(rng);
        if rng.below(12) == 0 {
            let (cell, value) = (cells[rng.below(2) as usize], stretch.any(rng));
            stretch.b.effect(Op::Set(cell), &[value]).expect("a cell");
        }
    }
    let [first, second, third] = std::array::from_fn(|_| stretch.any(rng));
    let mut b = stretch.b;
    let less = b.op(Op::Lt, &[first, second]).expect("compares");
    b.if_else(
        less,
        |b| b.effect(Op::Set(cells[2]), &[third]).map(|()| Vec::new()),
        |_| Ok(Vec::new()),
    )
    .expect("an `if`");
    for (cell, value) in cells[3..].iter().zip(stretch.values.iter().rev()) {
        b.effect(Op::Set(*cell), &[*value]).expect("a cell");
    }
    b.finish()
}

#[test]
fn stretches_at_random() {
    let mut rng = Rng::new(7);
    let (mut made, mut copied, mut same) = (0, 0, 0);
    for number in 0..600 {
        let kernel = stretch(&mut rng);
        for branch in branches(&kernel, &kernel.tick) {
            made += 1;
            let is = |kind: fn(&WhereZero) -> bool| branch.where_zero.iter().any(kind);
            copied += usize::from(is(|one| matches!(one, WhereZero::Copy(..))));
            same += usize::from(is(|one| matches!(one, WhereZero::Same(_))));
        }
        let mut interp = Interp::new(&kernel, 1).expect("verifies");
        let mut code = JitCode::build(&kernel, 1, Options { probes: false }).expect("compiles");
        interp.init(&[0, 0]);
        code.init(&[0, 0]);
        for tick in 0..40 {
            let words = [(); 2].map(|()| rng.below(INPUT_MAX + 1) as u16);
            interp.tick(&words, &mut []);
            code.tick(&words, &mut []);
            let told = || format!("stretch {number}, tick {tick}, {words:?}\n{kernel}");
            assert_eq!(interp.memory(), code.memory(), "{}", told());
        }
    }
    println!("{made} branches, {copied} with copies, {same} with instructions as they are");
    assert!(
        made > 100 && copied > 50 && same > 50,
        "{made}, {copied}, {same}"
    );
}
