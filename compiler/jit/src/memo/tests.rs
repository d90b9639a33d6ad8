//! Random ticks of which much is decided by inputs and live values that seldom move, against the
//! interpreter.

use super::{Memo, Step, plan};
use crate::random_insts::RandomInsts;
use crate::{JitCode, Options};
use whippen_kernel::random::Rng;
use whippen_kernel::{Builder, Interp, Kernel, Op, Range, Type, Value};

const PORTS: usize = 3;

/// Cells: two that glide, one that counts, one that is written twice, and those that tell what was
/// computed.
const CELLS: usize = 12;

const LIVE_MAX: i64 = 1 << 20;

/// A tick of random instructions on random sources, in stretches that each begin with one of them.
fn tick(rng: &mut Rng) -> Kernel {
    let mut b = Builder::new("tick", 44_100);
    let all = Type::I32.range();
    let live_range = Range::new(0, LIVE_MAX);
    let ports: Vec<u32> = (0..PORTS)
        .map(|n| b.input(&format!("x{n}"), Range::new(0, 65_535)))
        .collect();
    let lives = ["a", "b"].map(|name| b.live(name, live_range, 0));
    let cells: Vec<u32> = (0..CELLS)
        .map(|n| b.cell(&format!("c{n}"), Type::I32, all, 0))
        .collect();
    b.begin_tick();
    let numbers = [0, 4, 1 << 20, -77];
    let numbers = numbers.map(|number| b.constant(Type::I32, number).expect("a word"));
    let mut stretch = RandomInsts {
        b,
        values: Vec::new(),
    };
    let mut told = Vec::new();
    for _ in 0..4 + rng.below(3) {
        stretch.values = numbers.to_vec();
        stretch.values.extend(told.last());
        for _ in 0..1 + rng.below(2) {
            let source = match rng.below(8) {
                0..=3 => Op::In(ports[rng.below(PORTS as u64) as usize]),
                4 | 5 => Op::Live(lives[rng.below(2) as usize]),
                6 => Op::Get(cells[rng.below(2) as usize]),
                _ => Op::Get(cells[2 + rng.below(2) as usize]),
            };
            stretch.add(source, &[]);
        }
        for _ in 0..70 {
            stretch.any_op(rng);
        }
        if rng.below(3) == 0 {
            let value = stretch.any(rng);
            set(&mut stretch, cells[3], value);
        }
        told.extend([(); 2].map(|()| stretch.any(rng)));
    }
    for (cell, live) in cells.iter().zip(lives) {
        glide(&mut stretch, *cell, live);
    }
    let one = stretch.b.constant(Type::I32, 1).expect("a word");
    let counted = stretch.add(Op::Get(cells[2]), &[]).expect("a cell");
    let counted = stretch.add(Op::AddWrap, &[counted, one]).expect("wraps");
    set(&mut stretch, cells[2], counted);
    let less = stretch.b.op(Op::Lt, &told[..2]).expect("compares");
    let only = |b: &mut Builder| b.effect(Op::Set(cells[4]), &[told[2]]).map(|()| Vec::new());
    stretch
        .b
        .if_else(less, only, |_| Ok(Vec::new()))
        .expect("an `if`");
    for (cell, value) in cells[5..].iter().zip(told.iter().rev()) {
        set(&mut stretch, *cell, *value);
    }
    stretch.b.finish()
}

fn set(stretch: &mut RandomInsts, cell: u32, value: Value) {
    let set = stretch.b.effect(Op::Set(cell), &[value]);
    set.expect("a cell of all words");
}

/// A cell goes half of the way to a live value.
fn glide(stretch: &mut RandomInsts, cell: u32, live: u32) {
    let held = stretch.add(Op::Get(cell), &[]).expect("a cell");
    let wanted = stretch.add(Op::Live(live), &[]).expect("a live value");
    let way = stretch.add(Op::SubSat, &[wanted, held]).expect("saturates");
    let half = stretch.add(Op::Sar(1), &[way]).expect("shifts");
    let next = stretch.add(Op::AddSat, &[held, half]).expect("saturates");
    set(stretch, cell, next);
}

fn memos(kernel: &Kernel) -> Vec<Memo> {
    let front = plan(kernel).into_iter().flat_map(|plan| plan.front);
    let memo = |step| match step {
        Step::Memo(memo) => Some(memo),
        Step::Inst(_) => None,
    };
    front.filter_map(memo).collect()
}

/// Of a cell that glides to a live value, of one that follows an input and of one that a branch
/// writes, only the first is worth being looked at.
#[test]
fn cells_that_settle() {
    let mut b = Builder::new("settle", 44_100);
    let all = Type::I32.range();
    let (x, live) = (b.input("x", Range::new(0, 9)), b.live("a", all, 0));
    let cells = ["glides", "follows", "branches"].map(|name| b.cell(name, Type::I32, all, 0));
    let ends: Vec<u32> = (0..3)
        .map(|n| b.cell(&format!("end {n}"), Type::I32, all, 0))
        .collect();
    b.begin_tick();
    let [wanted, word] = [Op::Live(live), Op::In(x)].map(|op| b.op(op, &[]).expect("a source"));
    let held = cells.map(|cell| b.op(Op::Get(cell), &[]).expect("a cell"));
    for (start, end) in held.into_iter().zip(ends) {
        let rounds = (0..40).fold(start, |value, _| {
            b.op(Op::MulTop, &[value, start]).expect("fits")
        });
        b.effect(Op::Set(end), &[rounds]).expect("a cell");
    }
    for (at, towards) in [wanted, word].into_iter().enumerate() {
        let next = b.op(Op::AddSat, &[held[at], towards]).expect("saturates");
        b.effect(Op::Set(cells[at]), &[next]).expect("a cell");
    }
    let less = b.op(Op::Lt, &[word, wanted]).expect("compares");
    let only = |b: &mut Builder| b.effect(Op::Set(cells[2]), &[wanted]).map(|()| Vec::new());
    b.if_else(less, only, |_| Ok(Vec::new())).expect("an `if`");
    let memos = memos(&b.finish());
    let sources: Vec<&[Value]> = memos.iter().map(|memo| &memo.sources[..]).collect();
    assert_eq!(sources, [[wanted, held[0]]]);
}

#[test]
fn ticks_at_random() {
    let mut rng = Rng::new(11);
    let (mut made, mut read_by_memos) = (0, 0);
    for number in 0..300 {
        let kernel = tick(&mut rng);
        let memos = memos(&kernel);
        made += memos.len();
        read_by_memos += usize::from(memos.len() > 1);
        let mut interp = Interp::new(&kernel, 1).expect("verifies");
        let mut code = JitCode::build(&kernel, 1, Options { probes: false }).expect("compiles");
        let mut words = [0; PORTS];
        interp.init(&words);
        code.init(&words);
        for tick in 0..60 {
            if rng.below(3) == 0 {
                words[rng.below(PORTS as u64) as usize] = rng.below(1 << 16) as u16;
            }
            if rng.below(6) == 0 {
                let (live, value) = (rng.below(2) as usize, rng.below(LIVE_MAX as u64) as i32);
                interp.set_live(live, value).expect("a live value");
                code.set_live(live, value).expect("a live value");
            }
            if rng.below(12) == 0 {
                let (cell, value) = (rng.below(4) as usize, rng.below(1 << 20) as i64);
                interp.set_cell(0, cell, 0, value).expect("a cell");
                code.set_cell(0, cell, 0, value).expect("a cell");
            }
            interp.tick(&words, &mut []);
            code.tick(&words, &mut []);
            let told = || format!("kernel {number}, tick {tick}, {words:?}\n{kernel}");
            assert_eq!(interp.memory(), code.memory(), "{}", told());
        }
    }
    println!("{made} memos, {read_by_memos} ticks with several");
    assert!(made > 200 && read_by_memos > 50, "{made}, {read_by_memos}");
}
