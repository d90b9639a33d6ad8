//! Random ticks of words, of as many values as registers hold and more, against the interpreter.

use super::{Constants, Groups, Writer, sixteen, supports};
use crate::{JitCode, Options};
use std::collections::BTreeSet;
use whippen_kernel::layout::Layout;
use whippen_kernel::random::Rng;
use whippen_kernel::{
    Builder, Interp, Kernel, Memory, Op, OpError, Range, Type, Value, Walk, without_probes,
    without_probes_in_same_memory,
};

const CELLS: u64 = 6;
const ROWS: i64 = 5;

/// Words and bools in turns.
const PROBES: u64 = 6;

/// What of the declarations the statements name: words, then bools.
const BOOLS: u32 = CELLS as u32;

/// Values in sight.
#[derive(Clone)]
struct InSight {
    words: Vec<Value>,
    bools: Vec<Value>,
}

/// One that was made lately, or any.
fn one_of(values: &[Value], rng: &mut Rng) -> Value {
    let count = values.len() as u64;
    let back = if rng.below(2) == 0 {
        count.min(8)
    } else {
        count
    };
    values[(count - 1 - rng.below(back)) as usize]
}

impl InSight {
    fn word(&self, rng: &mut Rng) -> Value {
        one_of(&self.words, rng)
    }

    fn bool(&self, rng: &mut Rng) -> Value {
        one_of(&self.bools, rng)
    }

    fn add(&mut self, b: &Builder, value: Value) {
        match b.ty(value) {
            Type::I1 => self.bools.push(value),
            _ => self.words.push(value),
        }
    }
}

/// Two lives, a table, events without and with arguments, lines of words and half words.
fn declare(b: &mut Builder, rng: &mut Rng) {
    let all = Type::I32.range();
    let low = rng.below(2) as i64 * 700;
    b.input("x", Range::new(low, 65_535 - low));
    b.output("f", Range::new(-32_768, 32_767));
    b.live("a", all, 5);
    b.live("b", all, i32::MIN);
    b.keyed("k", all, vec![3, -7, 1 << 30, i32::MIN, i32::MAX]);
    b.table("t", 2, vec![7, -1, i32::MAX, 0, 5, i32::MIN, 1, 2, 9, -9]);
    b.table("u", 1, vec![11, 12, 13, 14, -15]);
    (0..CELLS).for_each(|n| {
        b.cell(&format!("c{n}"), Type::I32, all, n as i64);
    });
    (0..CELLS).for_each(|n| {
        b.cell(&format!("s{n}"), Type::I1, Type::I1.range(), n as i64 % 2);
    });
    b.line("near", 3, Range::new(0, 65_535));
    b.line("far", 7, all);
    for n in 0..PROBES {
        let ty = [Type::I32, Type::I1][n as usize % 2];
        b.probe(&format!("p{n}"), ty);
    }
    b.event("none", 0);
    b.event("two", 2);
}

/// An operator on what is in sight; none where it does not fit.
fn operator(b: &mut Builder, rng: &mut Rng, seen: &InSight) -> Result<Value, OpError> {
    let [x, y, z] = std::array::from_fn(|_| seen.word(rng));
    let [p, q, r] = std::array::from_fn(|_| seen.bool(rng));
    let n = rng.below(31) as u8;
    let cell = rng.below(CELLS) as u32;
    match rng.below(34) {
        0 => b.op(Op::Add, &[x, y]),
        1 => b.op(Op::AddWrap, &[x, y]),
        2 => b.op(Op::Sub, &[x, y]),
        3 => b.op(Op::SubWrap, &[x, y]),
        4 => b.op(Op::Mul, &[x, y]),
        5 => b.op(Op::MulWrap, &[x, y]),
        6 => b.op(Op::Min, &[x, y]),
        7 => b.op(Op::Max, &[x, y]),
        8 | 9 => b.op(Op::MulTop, &[x, y]),
        10 => b.op(Op::MulTop, &[x, x]),
        11 | 12 => b.op(Op::MacTop, &[x, y, z]),
        13 => b.op(Op::Shl(n), &[x]),
        14 => b.op(Op::ShlWrap(n), &[x]),
        15 => b.op(Op::Sar(n), &[x]),
        16 => b.op(Op::SarRound(n), &[x]),
        17 => b.op(Op::Eq, &[x, y]),
        18 => b.op(Op::Lt, &[x, y]),
        19 => b.op(Op::Le, &[x, y]),
        20 => b.op(Op::Eq, &[p, q]),
        21 => b.op(Op::And, &[p, q]),
        22 => b.op(Op::Or, &[p, q]),
        23 => b.op(Op::Not, &[p]),
        24 => b.op(Op::Select, &[p, x, y]),
        25 => b.op(Op::Select, &[p, q, r]),
        26 => b.op(Op::Live(u32::from(n % 2)), &[]),
        27 => b.op(Op::Tick(n.into()), &[]),
        28 => b.op(Op::Keyed(0), &[]),
        29 => b.op(Op::Get(cell), &[]),
        30 => b.op(Op::Get(BOOLS + cell), &[]),
        31 => b.op(Op::Delay(0, 1 + u32::from(n % 3)), &[]),
        32 => b.op(Op::Delay(1, 1 + u32::from(n % 7)), &[]),
        _ => looked_up(b, rng, x),
    }
}

fn looked_up(b: &mut Builder, rng: &mut Rng, x: Value) -> Result<Value, OpError> {
    let [first, last] = [0, ROWS - 1].map(|row| b.constant(Type::I32, row).expect("a word"));
    let row = b.op(Op::Max, &[x, first])?;
    let row = b.op(Op::Min, &[row, last])?;
    let (table, column) = rng.pick(&[(0, 0), (0, 1), (1, 0)]);
    b.op(Op::Lookup(table, column), &[row])
}

/// Statements, and values to be yielded: a word and a bool.
fn statements(
    b: &mut Builder,
    rng: &mut Rng,
    seen: &InSight,
    (count, depth): (u64, u32),
) -> Result<Vec<Value>, OpError> {
    let mut seen = seen.clone();
    for _ in 0..count {
        match rng.below(16) {
            0 => {
                let (cell, word) = (rng.below(CELLS) as u32, seen.word(rng));
                b.effect(Op::Set(cell), &[word])?;
            }
            1 => {
                let (cell, bool) = (rng.below(CELLS) as u32, seen.bool(rng));
                b.effect(Op::Set(BOOLS + cell), &[bool])?;
            }
            2 if depth > 0 && rng.below(3) == 0 => {
                let args = [seen.word(rng), seen.word(rng)];
                let two = rng.below(2);
                b.effect(Op::Emit(two as u32), &args[..2 * two as usize])?;
            }
            5 => {
                let probe = rng.below(PROBES) as u32;
                let value = match probe % 2 {
                    0 => seen.word(rng),
                    _ => seen.bool(rng),
                };
                b.effect(Op::Probe(probe), &[value])?;
            }
            3 | 4 if depth < 3 => branch(b, rng, &mut seen, depth)?,
            _ => {
                if let Ok(value) = operator(b, rng, &seen) {
                    seen.add(b, value);
                }
            }
        }
    }
    Ok(vec![seen.word(rng), seen.bool(rng), seen.word(rng)])
}

/// An `if` whose arms are nothing, little or much.
fn branch(b: &mut Builder, rng: &mut Rng, seen: &mut InSight, depth: u32) -> Result<(), OpError> {
    let condition = seen.bool(rng);
    let sizes = [(); 2].map(|()| rng.pick(&[0, 0, 2, 4, 25]));
    let [then, other] = sizes.map(|size| b.region(|b| statements(b, rng, seen, (size, depth + 1))));
    for result in b.branch(condition, then?, other?)? {
        seen.add(b, result);
    }
    Ok(())
}

fn tick(rng: &mut Rng) -> Result<Kernel, OpError> {
    let mut b = Builder::new("tick", 44_100);
    declare(&mut b, rng);
    b.begin_tick();
    let word = b.op(Op::In(0), &[])?;
    let no = b.constant(Type::I1, 0)?;
    let less = b.constant(Type::I32, 33_000)?;
    let bool = b.op(Op::Lt, &[word, less])?;
    let mut seen = InSight {
        words: vec![word, less],
        bools: vec![no, bool],
    };
    for number in [0, 1, -1, 1 << 30, i64::from(i32::MIN), -77_777] {
        seen.words.push(b.constant(Type::I32, number)?);
    }
    // What is made first and read last fills the registers.
    for _ in 0..rng.below(60) {
        if let Ok(value) = operator(&mut b, rng, &seen) {
            seen.add(&b, value);
        }
    }
    let size = rng.pick(&[10, 60, 150]);
    statements(&mut b, rng, &seen, (size, 0))?;
    for (cell, word) in seen
        .words
        .iter()
        .rev()
        .step_by(7)
        .take(CELLS as usize)
        .enumerate()
    {
        b.effect(Op::Set(cell as u32), &[*word])?;
    }
    for (cell, bool) in seen
        .bools
        .iter()
        .rev()
        .step_by(3)
        .take(CELLS as usize)
        .enumerate()
    {
        b.effect(Op::Set(BOOLS + cell as u32), &[*bool])?;
    }
    let high = b.op(Op::Sar(16), &[seen.word(rng)])?;
    b.effect(Op::Out(0), &[high])?;
    b.effect(Op::Push(0), &[word])?;
    let pushed = seen.word(rng);
    b.effect(Op::Push(1), &[pushed])?;
    Ok(b.finish())
}

/// A word for each key: some are alike, so that arms are skipped and are not.
fn words(rng: &mut Rng, keys: usize) -> Vec<u16> {
    let all = rng.below(1 << 16) as u16;
    let apart = rng.below(3);
    let word = |rng: &mut Rng| match rng.below(4) {
        0..=1 if apart > 0 => rng.below(1 << 16) as u16,
        _ => all,
    };
    (0..keys).map(|_| word(rng)).collect()
}

/// Plays a kernel on so many keys: all at once, and around a key that is observed.
fn plays_like_the_interpreter(kernel: &Kernel, keys: usize, rng: &mut Rng, name: &str) {
    let mut interp = Interp::new(kernel, keys).expect("verifies");
    let probes = !kernel.probes.is_empty();
    let all = JitCode::build(kernel, keys, Options { probes }).expect("compiles");
    let observed = rng.below(keys as u64) as usize;
    let around = JitCode::build_observing(kernel, keys, observed).expect("compiles");
    let mut engines = [(all, 0..keys), (around, observed..observed + 1)];
    let start = words(rng, keys);
    interp.init(&start);
    engines
        .iter_mut()
        .for_each(|(engine, _)| engine.init(&start));
    for tick in 0..12 {
        let now = words(rng, keys);
        let mut expected = vec![0; keys];
        interp.tick(&now, &mut expected);
        let events = interp.drain_events();
        for (engine, told_of) in &mut engines {
            let mut out = vec![0; keys];
            engine.tick(&now, &mut out);
            let told = || format!("{name}, tick {tick}, {keys} keys, {told_of:?}\n{kernel}");
            assert_eq!(out, expected, "outputs of {}", told());
            assert_eq!(engine.drain_events(), events, "events of {}", told());
            let [left, right] = [engine.memory(), interp.memory()];
            assert_eq!(left.columns, right.columns, "cells of {}", told());
            assert_eq!(left.narrow, right.narrow, "narrow lines of {}", told());
            assert_eq!(left.wide, right.wide, "wide lines of {}", told());
            let count = kernel.probes.len();
            let of_keys = told_of.start * count..told_of.end * count;
            let [left, right] = [engine.probes(), interp.probes()];
            assert_eq!(
                left[of_keys.clone()],
                right[of_keys],
                "probes of {}",
                told()
            );
        }
    }
}

/// Whether more values are alive than registers hold.
fn spills(kernel: &Kernel, layout: &Layout) -> bool {
    let mut writer = Writer::new(kernel, layout, Groups::Whole, Constants::default());
    let before = writer.r.room;
    writer.open();
    writer.region(&kernel.tick);
    writer.r.room > before
}

/// How many kernels, where the environment does not say.
const KERNELS: u64 = 400;

#[test]
fn ticks_at_random() {
    let count = whippen_need::count("WHIPPEN_KERNELS", KERNELS);
    let mut rng = Rng::new(16);
    let (mut made, mut spilled) = (0, 0);
    let mut met = BTreeSet::new();
    for number in 0..count {
        let whole = tick(&mut rng).expect("fits");
        // As the keys around one that is observed run.
        let bare = without_probes_in_same_memory(&whole);
        assert!(supports(&bare), "{bare}");
        let keys = rng.pick(&[4, 15, 16, 17, 37]);
        let memory = Memory::new(&bare, keys).expect("verifies");
        made += u64::from(sixteen(&bare, &memory.layout).is_some());
        spilled += u64::from(spills(&bare, &memory.layout));
        met.extend(bare.tick.all_insts().map(|inst| inst.op.row().name));
        let name = format!("kernel {number}");
        plays_like_the_interpreter(&whole, keys, &mut rng, &name);
        // And with nothing that is not needed.
        let kernel = without_probes(&whole);
        plays_like_the_interpreter(&kernel, keys, &mut rng, &name);
    }
    println!("{made} of {count} in sixteen lanes, {spilled} of them with spills");
    assert_eq!(made, count, "of all there is code");
    assert!(spilled * 10 > count, "{spilled}");
    assert!(met.len() > 30, "{met:?}");
}
