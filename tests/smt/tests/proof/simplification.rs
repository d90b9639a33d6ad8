//! Simplification: a mode, which partial evaluation has made simpler, leaves what the Kernel's
//! tick leaves.
//!
//! Each rule of `compiler/modes/src/partial_eval` is shown by a Kernel of a line, which goes
//! through the real partial evaluation; what comes out is compared with what went in, for all
//! numbers in the ranges of its cells.

use whippen_kernel::{
    Builder, Inst, Kernel, Live, Op, OpError, Range, Region, Type, Value, verify,
};
use whippen_modes::{ModeId, Modes, specialize_fully};
use whippen_smt::solver::Solver;
use whippen_smt::{Bounded, Query, Term, Verdict, ask, check};

use crate::meaning::{Memory, tick, tick_in_mode};
use crate::selection::{kernels, root};

/// How many instructions the modes of a rule may have.
const INSTRUCTIONS: usize = 1000;

/// What a rule is shown with.
struct Given {
    /// Words, the first two within 30 000 either way.
    a: Value,
    b: Value,
    c: Value,
    /// A long word.
    w: Value,
    /// Truths.
    p: Value,
    q: Value,
    r: Value,
}

type Made = Result<Value, OpError>;
type Rule = (&'static str, fn(&mut Builder, &Given) -> Made);

fn word(b: &mut Builder, number: i64) -> Made {
    b.constant(Type::I32, number)
}

fn op_with(b: &mut Builder, op: Op, value: Value, number: i64) -> Made {
    let ty = b.ty(value);
    let number = b.constant(ty, number)?;
    b.op(op, &[value, number])
}

fn quotient(b: &mut Builder, g: &Given, n: u8, by: i64) -> Made {
    op_with(b, Op::DivRound(n), g.a, by)
}

/// Each rule, in the order of `rules.rs`.
const RULES: &[Rule] = &[
    ("constant_comes_last", |b, g| {
        let two = word(b, 2)?;
        b.op(Op::Add, &[two, g.a])
    }),
    ("add_nothing", |b, g| op_with(b, Op::Add, g.c, 0)),
    ("subtract_nothing", |b, g| op_with(b, Op::Sub, g.c, 0)),
    ("times_one", |b, g| op_with(b, Op::Mul, g.c, 1)),
    ("shift_by_nothing", |b, g| b.op(Op::SarRound(0), &[g.c])),
    ("shift_of_a_word_that_fits", |b, g| {
        let wide = b.op(Op::Widen, &[g.a])?;
        b.op(Op::Shl(9), &[wide])
    }),
    ("shifted_up_and_less_down", |b, g| {
        let up = b.op(Op::Shl(9), &[g.a])?;
        b.op(Op::Sar(4), &[up])
    }),
    ("shifted_up_and_further_down", |b, g| {
        let up = b.op(Op::Shl(4), &[g.a])?;
        b.op(Op::Sar(9), &[up])
    }),
    ("promise_that_is_kept", |b, g| {
        b.op(Op::Assume(-40_000, 40_000), &[g.a])
    }),
    ("narrow_of_widened", |b, g| {
        let wide = b.op(Op::Widen, &[g.c])?;
        b.op(Op::Narrow, &[wide])
    }),
    ("widened_of_narrow", |b, g| {
        let held = b.op(Op::Sar(20), &[g.w])?;
        let narrow = b.op(Op::Narrow, &[held])?;
        b.op(Op::Widen, &[narrow])
    }),
    ("quotient_by_3", |b, g| quotient(b, g, 0, 3)),
    ("quotient_by_7_shifted", |b, g| quotient(b, g, 8, 7)),
    ("quotient_by_1000_shifted", |b, g| quotient(b, g, 15, 1000)),
    ("quotient_by_12345_shifted", |b, g| {
        quotient(b, g, 16, 12_345)
    }),
    ("quotient_by_a_power", |b, g| quotient(b, g, 3, 64)),
    ("product_of_constants_added", |b, g| {
        let (x, y) = (word(b, -70_000)?, word(b, 123_457)?);
        b.op(Op::MacWide, &[g.w, x, y])
    }),
    ("product_with_zero_added", |b, g| {
        let zero = word(b, 0)?;
        b.op(Op::MacWide, &[g.w, zero, g.c])
    }),
    ("product_added_to_zero", |b, g| {
        let zero = b.constant(Type::I64, 0)?;
        b.op(Op::MacWide, &[zero, g.a, g.c])
    }),
    ("top_of_zero_added", |b, g| {
        let zero = word(b, 0)?;
        b.op(Op::MacTop, &[g.a, g.c, zero])
    }),
    ("least_of_ranges_apart", |b, g| {
        op_with(b, Op::Min, g.a, 30_000)
    }),
    ("least_of_ranges_apart_other", |b, g| {
        op_with(b, Op::Min, g.a, -30_001)
    }),
    ("most_of_ranges_apart", |b, g| {
        op_with(b, Op::Max, g.a, -30_000)
    }),
    ("least_of_both_one", |b, g| b.op(Op::Min, &[g.c, g.c])),
    ("limit_before_widening", |b, g| {
        let wide = b.op(Op::Widen, &[g.c])?;
        op_with(b, Op::Min, wide, 77)
    }),
    ("limit_before_shift", |b, g| {
        let up = b.op(Op::Shl(5), &[g.a])?;
        op_with(b, Op::Max, up, -96)
    }),
    ("limit_that_is_no_multiple", |b, g| {
        let up = b.op(Op::Shl(5), &[g.a])?;
        op_with(b, Op::Max, up, -97)
    }),
    ("at_most_is_not_more", |b, g| b.op(Op::Le, &[g.a, g.c])),
    ("less_than_itself", |b, g| b.op(Op::Lt, &[g.c, g.c])),
    ("constant_on_the_left", |b, g| {
        let limit = word(b, 17)?;
        b.op(Op::Lt, &[limit, g.c])
    }),
    ("sum_compared", |b, g| {
        let sum = op_with(b, Op::Add, g.a, 12)?;
        op_with(b, Op::Lt, sum, 100)
    }),
    ("difference_compared", |b, g| {
        let difference = op_with(b, Op::Sub, g.a, 12)?;
        op_with(b, Op::Lt, difference, 100)
    }),
    ("equal_to_itself", |b, g| b.op(Op::Eq, &[g.c, g.c])),
    ("not_not", |b, g| {
        let not = b.op(Op::Not, &[g.p])?;
        b.op(Op::Not, &[not])
    }),
    ("and_with_true", |b, g| op_with(b, Op::And, g.p, 1)),
    ("and_with_false", |b, g| op_with(b, Op::And, g.p, 0)),
    ("or_with_true", |b, g| op_with(b, Op::Or, g.p, 1)),
    ("or_with_false", |b, g| op_with(b, Op::Or, g.p, 0)),
    ("and_of_both_one", |b, g| {
        let both = b.op(Op::And, &[g.p, g.q])?;
        b.op(Op::And, &[g.p, both])
    }),
    ("and_of_opposites", |b, g| {
        let not = b.op(Op::Not, &[g.p])?;
        b.op(Op::And, &[g.p, not])
    }),
    ("or_of_opposites", |b, g| {
        let not = b.op(Op::Not, &[g.p])?;
        b.op(Op::Or, &[not, g.p])
    }),
    ("and_absorbs_or", |b, g| {
        let either = b.op(Op::Or, &[g.p, g.q])?;
        b.op(Op::And, &[g.p, either])
    }),
    ("or_absorbs_and", |b, g| {
        let both = b.op(Op::And, &[g.q, g.p])?;
        b.op(Op::Or, &[g.p, both])
    }),
    ("and_of_an_or_with_the_opposite", |b, g| {
        let not = b.op(Op::Not, &[g.p])?;
        let either = b.op(Op::Or, &[not, g.q])?;
        b.op(Op::And, &[g.p, either])
    }),
    ("or_of_an_and_with_the_opposite", |b, g| {
        let not = b.op(Op::Not, &[g.p])?;
        let both = b.op(Op::And, &[not, g.q])?;
        b.op(Op::Or, &[g.p, both])
    }),
    ("choice_of_both_one", |b, g| {
        b.op(Op::Select, &[g.p, g.c, g.c])
    }),
    ("choice_that_is_known", |b, g| {
        let yes = b.constant(Type::I1, 1)?;
        b.op(Op::Select, &[yes, g.a, g.b])
    }),
    ("choice_by_the_opposite", |b, g| {
        let not = b.op(Op::Not, &[g.p])?;
        b.op(Op::Select, &[not, g.a, g.b])
    }),
    ("choice_in_a_choice", |b, g| {
        let inner = b.op(Op::Select, &[g.p, g.a, g.b])?;
        b.op(Op::Select, &[g.p, inner, g.c])
    }),
    ("choice_in_the_other_choice", |b, g| {
        let inner = b.op(Op::Select, &[g.p, g.a, g.b])?;
        b.op(Op::Select, &[g.p, g.c, inner])
    }),
    ("truth_chosen_yes_or", |b, g| {
        let yes = b.constant(Type::I1, 1)?;
        b.op(Op::Select, &[g.p, yes, g.q])
    }),
    ("truth_chosen_and_else_no", |b, g| {
        let no = b.constant(Type::I1, 0)?;
        b.op(Op::Select, &[g.p, g.q, no])
    }),
    ("truth_chosen_no_and", |b, g| {
        let no = b.constant(Type::I1, 0)?;
        b.op(Op::Select, &[g.p, no, g.r])
    }),
    ("truth_chosen_or_else_yes", |b, g| {
        let yes = b.constant(Type::I1, 1)?;
        b.op(Op::Select, &[g.p, g.r, yes])
    }),
];

/// A Kernel that stores what a rule is about. What it is shown with are live values, which may be
/// anything in every tick: cells that nothing writes would be known.
fn kernel_of(name: &str, made: fn(&mut Builder, &Given) -> Made) -> Kernel {
    let mut b = Builder::new(name, 44_100);
    let small = Range::new(-30_000, 30_000);
    let words = [("a", small), ("b", small), ("c", Type::I32.range())];
    let truths = ["p", "q", "r"].map(|name| (name, small));
    let lives: Vec<u32> = words
        .into_iter()
        .chain(truths)
        .map(|(name, range)| b.live(name, range, 0))
        .collect();
    let results = Type::ALL.map(|ty| (ty, b.cell(&format!("result_{ty}"), ty, ty.range(), 0)));
    b.begin_tick();
    let given = given(&mut b, &lives).expect("they fit");
    let result = made(&mut b, &given).unwrap_or_else(|error| panic!("{name}: {error}"));
    let to = results.iter().find(|(ty, _)| *ty == b.ty(result));
    let (_, to) = to.expect("a cell for each type");
    b.effect(Op::Set(*to), &[result]).expect("it fits");
    b.finish()
}

fn given(b: &mut Builder, lives: &[u32]) -> Result<Given, OpError> {
    let read: Result<Vec<Value>, OpError> = lives
        .iter()
        .map(|live| b.op(Op::Live(*live), &[]))
        .collect();
    let read = read?;
    let limit = word(b, 1)?;
    let mut truth = |at: usize| b.op(Op::Lt, &[read[at], limit]);
    let (p, q, r) = (truth(3)?, truth(4)?, truth(5)?);
    Ok(Given {
        a: read[0],
        b: read[1],
        c: read[2],
        w: b.op(Op::MulWide, &[read[0], read[2]])?,
        p,
        q,
        r,
    })
}

/// The same Kernel with live values for words that nothing writes, which would be known.
fn with_lives(kernel: &Kernel) -> Kernel {
    let mut kernel = kernel.clone();
    for (index, cell) in (0..).zip(kernel.cells.clone()) {
        let writes = |inst: &Inst| matches!(inst.op, Op::Set(own) if own == index);
        let is_written = kernel.tick.all_insts().any(writes);
        if is_written || cell.len != 1 || cell.ty != Type::I32 {
            continue;
        }
        let live = kernel.lives.len() as u32;
        kernel.lives.push(Live {
            name: cell.name,
            range: cell.range,
            init: cell.init as i32,
        });
        replace(&mut kernel.tick, index, live);
    }
    kernel
}

fn replace(region: &mut Region, cell: u32, live: u32) {
    for inst in &mut region.insts {
        if inst.op == Op::Get(cell) {
            inst.op = Op::Live(live);
        }
        let regions = inst.regions.iter_mut();
        regions.for_each(|region| replace(region, cell, live));
    }
}

/// That a mode leaves what the tick leaves; what the mode knows it does not read from memory.
///
/// # Errors
/// An operator that is not followed.
fn claim(name: &str, modes: &Modes, mode: ModeId) -> Result<Query, String> {
    Term::forget_all();
    let kernel = &modes.kernel;
    let own = &modes.modes[mode];
    let before = Memory::free(kernel, &own.cells);
    let wanted = tick(kernel, before.clone())?;
    let mut spoiled = before;
    for (cell, _) in own.stands_for() {
        let ty = kernel.cells[cell].ty;
        let name = format!("spoiled_{cell}");
        spoiled.cells[cell][0] = Bounded::free(&name, ty.bits().max(32), ty.range()).0;
    }
    let found = tick_in_mode(modes, mode, spoiled)?;
    let words = |memory: &Memory| {
        let outputs = memory.outputs.iter().flatten();
        let all = memory.cells.iter().flatten().chain(&memory.probes);
        all.chain(outputs).map(|word| word.word(64)).collect()
    };
    let (wanted_words, found_words): (Vec<Term>, Vec<Term>) = (words(&wanted), words(&found));
    let both = wanted_words.iter().zip(&found_words);
    let same = Term::all(both.map(|(wanted, found)| wanted.equals(*found)));
    let is_complete = wanted_words.len() == found_words.len();
    let claim = same.and(Term::truth(is_complete));
    Ok(Query::new(name, &wanted.assumed, claim))
}

fn queries_of(name: &str, kernel: &Kernel) -> Vec<Query> {
    let Some(modes) = specialize_fully(kernel, INSTRUCTIONS) else {
        return vec![Query::unasked(name, "too many modes")];
    };
    let ids: Vec<ModeId> = modes.modes.ids().collect();
    let of = |mode: ModeId| {
        let name = match ids.len() {
            1 => name.to_string(),
            _ => format!("{name}/{mode}"),
        };
        claim(&name, &modes, mode).unwrap_or_else(|why| Query::unasked(name, &why))
    };
    ids.iter().map(|mode| of(*mode)).collect()
}

/// A mode that shifts by one more.
#[test]
fn a_wrong_mode_is_refuted_with_numbers() {
    let Some(solvers) = Solver::all() else { return };
    let name = "shifted_up_and_further_down";
    let made = RULES.iter().find(|rule| rule.0 == name).expect("a rule").1;
    let kernel = kernel_of(name, made);
    let mut modes = specialize_fully(&kernel, INSTRUCTIONS).expect("few modes");
    let blocks = modes.modes[ModeId(0)].blocks.iter_mut();
    let mut shifts = blocks
        .flat_map(|block| &mut block.insts)
        .filter(|inst| inst.op == Op::Sar(5));
    let shift = shifts.next().expect("what is simpler");
    shift.op = Op::Sar(6);
    let query = claim("fault", &modes, ModeId(0)).expect("it is followed");
    let answer = ask(&solvers, &query, 20);
    assert_eq!(answer.verdict, Verdict::Refuted, "{answer:?}");
    assert!(answer.numbers.contains("in_a_0"), "{answer:?}");
}

#[test]
fn modes_leave_what_ticks_leave() {
    let mut queries = Vec::new();
    for (name, made) in RULES {
        let kernel = kernel_of(name, *made);
        assert!(verify(&kernel).is_ok(), "{name}");
        queries.extend(queries_of(&format!("rule/{name}"), &kernel));
    }
    for (name, kernel) in kernels(&["control", "memory", "modes", "operators", "select"]) {
        queries.extend(queries_of(&name, &with_lives(&kernel)));
    }
    check(&root().join("simplification.txt"), &queries);
}
