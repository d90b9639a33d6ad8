//! The modes of a kernel do what the kernel does: outputs, memory and events in every tick; and
//! what they promise holds.

use whippen_compiler::check::Options;
use whippen_compiler::front::compile_front;
use whippen_compiler::kernel::random::{self, Draw, Rng};
use whippen_compiler::kernel::{
    Builder, Interp, Kernel, Op, OpError, Range, Type, Value, without_probes,
};
use whippen_compiler::modes::run::ModesEngine;
use whippen_compiler::modes::verify::verify;
use whippen_compiler::modes::{INSTRUCTIONS, Modes, specialize, specialize_fully};
use whippen_compiler::pipeline;
use whippen_compiler::scales::Scales;
use whippen_compiler::source::SourceMap;

const KEYS: usize = 2;

/// Both engines, on the same kernel and with the same words.
struct Pair {
    kernel: Kernel,
    left: Interp,
    right: ModesEngine,
    name: String,
}

impl Pair {
    fn new(kernel: &Kernel, modes: &Modes, name: &str) -> Pair {
        if let Err(errors) = verify(modes) {
            panic!("{name}: {} errors, {}\n{kernel}", errors.len(), errors[0]);
        }
        let left = Interp::new(kernel, KEYS).expect("verifies");
        let right = ModesEngine::new(modes, KEYS).expect("verifies");
        Pair {
            kernel: kernel.clone(),
            left,
            right,
            name: name.to_string(),
        }
    }

    /// Some ticks from the start; gives how many different modes were met.
    fn run(&mut self, rng: &mut Rng, ticks: usize) -> usize {
        let words = random::inputs(rng, &self.kernel, KEYS);
        self.left.init(&words);
        self.right.init(&words);
        let mut met = Vec::new();
        for tick in 0..ticks {
            self.lives(rng);
            self.tick(&random::inputs(rng, &self.kernel, KEYS), tick);
            met.extend_from_slice(self.right.now());
            met.sort_unstable();
            met.dedup();
        }
        met.len()
    }

    fn lives(&mut self, rng: &mut Rng) {
        for (at, live) in self.kernel.lives.iter().enumerate() {
            if rng.chance(1, 4) {
                let value = rng.interesting(live.range) as i32;
                self.left.set_live(at, value).expect("in range");
                self.right.set_live(at, value).expect("in range");
            }
        }
    }

    fn tick(&mut self, words: &[u16], tick: usize) {
        let count = KEYS * self.kernel.outputs.len();
        let (mut left, mut right) = (vec![0; count], vec![0; count]);
        self.left.tick(words, &mut left);
        self.right.tick(words, &mut right);
        let (name, kernel) = (&self.name, &self.kernel);
        assert_eq!(
            self.right.violation(),
            None,
            "{name}: tick {tick}\n{kernel}"
        );
        assert_eq!(left, right, "{name}: tick {tick}, outputs\n{kernel}");
        assert_eq!(
            self.left.memory(),
            self.right.memory(),
            "{name}: tick {tick}, memory\n{kernel}"
        );
        assert_eq!(
            self.left.drain_events(),
            self.right.drain_events(),
            "{name}: tick {tick}, events"
        );
    }
}

#[test]
fn random_kernels() {
    for seed in 0..2000 {
        let kernel = without_probes(&random::kernel(seed));
        let modes = specialize_fully(&kernel, 5000).unwrap_or_else(|| Modes::single(&kernel));
        Pair::new(&kernel, &modes, &format!("seed {seed}")).run(&mut Rng::new(seed), 8);
    }
}

/// A kernel of small machines: bools and counters that step by comparisons of two words and of each
/// other, fire events and set levels.
fn machines(seed: u64) -> Result<Kernel, OpError> {
    let mut rng = Rng::new(seed);
    let mut b = Builder::new(&format!("machines.{seed}"), 44_100);
    let inputs = [
        b.input("x", Range::new(0, 65_535)),
        b.input("y", Range::new(0, 4000)),
    ];
    let out = b.output("f", Range::new(-32_768, 32_767));
    let event = b.event("happened", 1);
    let live = b.live("weight", Range::new(-100, 100), 5);
    let states: Vec<u32> = (0..2 + rng.below(3))
        .map(|at| b.cell(&format!("s{at}"), Type::I1, Type::I1.range(), 0))
        .collect();
    let counters: Vec<u32> = (0..1 + rng.below(2))
        .map(|at| b.cell(&format!("c{at}"), Type::I32, Range::new(0, 9), 0))
        .collect();
    let level = b.cell("level", Type::I32, Range::new(0, 1000), 0);
    b.begin_tick();
    let words = [b.op(Op::In(inputs[0]), &[])?, b.op(Op::In(inputs[1]), &[])?];
    for _ in 0..3 + rng.below(5) {
        let condition = condition(&mut rng, &mut b, &words, &states, &counters)?;
        let cell = rng.pick(&states);
        let (mut then, mut other) = (rng.clone(), rng.clone());
        rng = Rng::new(rng.next());
        b.if_else(
            condition,
            |b| step(&mut then, b, &states, &counters, level, event, cell).map(|()| Vec::new()),
            |b| {
                if other.chance(1, 3) {
                    step(&mut other, b, &states, &counters, level, event, cell)
                } else {
                    Ok(())
                }
                .map(|()| Vec::new())
            },
        )?;
    }
    for counter in &counters {
        count_down(&mut b, *counter)?;
    }
    let (level, live) = (b.op(Op::Get(level), &[])?, b.op(Op::Live(live), &[])?);
    let state = b.op(Op::Get(states[0]), &[])?;
    let force = b.op(Op::Sub, &[live, level])?;
    let force = b.op(Op::Select, &[state, force, live])?;
    b.effect(Op::Out(out), &[force])?;
    Ok(b.finish())
}

fn condition(
    rng: &mut Rng,
    b: &mut Builder,
    words: &[Value],
    states: &[u32],
    counters: &[u32],
) -> Result<Value, OpError> {
    let limit = b.constant(
        Type::I32,
        rng.pick(&[0, 1, 1000, 2000, 3999, 30_000, 65_535]),
    )?;
    let compare = rng.pick(&[Op::Lt, Op::Le]);
    let mut found = b.op(compare, &[rng.pick(words), limit])?;
    for _ in 0..rng.below(3) {
        let other = match rng.below(3) {
            0 => b.op(Op::Get(rng.pick(states)), &[])?,
            1 => {
                let (count, limit) = (
                    b.op(Op::Get(rng.pick(counters)), &[])?,
                    b.constant(Type::I32, 1)?,
                );
                b.op(compare, &[count, limit])?
            }
            _ => b.op(compare, &[limit, rng.pick(words)])?,
        };
        found = b.op(rng.pick(&[Op::And, Op::And, Op::Or]), &[found, other])?;
        if rng.chance(1, 4) {
            found = b.op(Op::Not, &[found])?;
        }
    }
    Ok(found)
}

fn step(
    rng: &mut Rng,
    b: &mut Builder,
    states: &[u32],
    counters: &[u32],
    level: u32,
    event: u32,
    cell: u32,
) -> Result<(), OpError> {
    match rng.below(5) {
        0 | 1 => {
            let value = b.constant(Type::I1, rng.below(2) as i64)?;
            b.effect(Op::Set(cell), &[value])
        }
        2 => {
            let value = b.op(Op::Get(rng.pick(states)), &[])?;
            let value = b.op(Op::Not, &[value])?;
            b.effect(Op::Set(cell), &[value])
        }
        3 => {
            let (count, high) = (b.constant(Type::I32, 5)?, b.constant(Type::I32, 700)?);
            b.effect(Op::Set(rng.pick(counters)), &[count])?;
            b.effect(Op::Set(level), &[high])
        }
        _ => {
            let value = b.op(Op::Get(level), &[])?;
            b.effect(Op::Emit(event), &[value])
        }
    }
}

fn count_down(b: &mut Builder, counter: u32) -> Result<(), OpError> {
    let (count, one, zero) = (
        b.op(Op::Get(counter), &[])?,
        b.constant(Type::I32, 1)?,
        b.constant(Type::I32, 0)?,
    );
    let less = b.op(Op::Sub, &[count, one])?;
    let less = b.op(Op::Max, &[less, zero])?;
    b.effect(Op::Set(counter), &[less])
}

#[test]
fn random_machines() {
    let [mut made, mut met, mut longer, mut large] = [0; 4];
    for seed in 0..600 {
        let kernel = machines(seed).expect("is made of what fits");
        let Some(modes) = specialize_fully(&kernel, 4000) else {
            large += 1;
            continue;
        };
        longer += usize::from(modes.longest() > Modes::single(&kernel).longest());
        made += modes.modes.len();
        met += Pair::new(&kernel, &modes, &format!("seed {seed}")).run(&mut Rng::new(seed), 200);
    }
    assert!(made > 600 * 2, "{made} modes were made");
    assert!(met * 10 > made * 5, "{met} of {made} modes were met");
    assert!(
        longer < 60,
        "{longer} of 600 have a longer path than without modes"
    );
    assert!(large < 60, "{large} of 600 are too large");
}

#[test]
fn limits_are_kept() {
    for seed in 0..60 {
        let kernel = machines(seed).expect("is made of what fits");
        let whole = Modes::single(&kernel);
        for instructions in [0, 100, 1000] {
            let modes = specialize(&kernel, instructions);
            assert!(
                modes == whole || modes.instructions() <= instructions,
                "seed {seed}: {}",
                modes.instructions()
            );
            assert!(modes.longest() <= whole.longest(), "seed {seed}");
        }
    }
}

/// A kernel that remembers of each of many limits whether the input was above it, and tells when it
/// comes to be.
fn thresholds(count: i64) -> Result<Kernel, OpError> {
    let mut b = Builder::new("thresholds", 44_100);
    let input = b.input("x", Range::new(0, 65_535));
    let event = b.event("risen", 1);
    let was: Vec<u32> = (0..count)
        .map(|at| b.cell(&format!("was{at}"), Type::I1, Type::I1.range(), 1))
        .collect();
    b.begin_tick();
    let x = b.op(Op::In(input), &[])?;
    for (at, was) in was.into_iter().enumerate() {
        let limit = b.constant(Type::I32, 200 + 300 * at as i64)?;
        let is = b.op(Op::Lt, &[limit, x])?;
        let before = b.op(Op::Get(was), &[])?;
        let not = b.op(Op::Not, &[before])?;
        let rises = b.op(Op::And, &[is, not])?;
        b.if_else(
            rises,
            |b| {
                b.effect(Op::Emit(event), &[x])?;
                Ok(Vec::new())
            },
            |_| Ok(Vec::new()),
        )?;
        b.effect(Op::Set(was), &[is])?;
    }
    Ok(b.finish())
}

/// Decisions that only save cycles are exponentially many here; with those alone that tell the next
/// mode there is one mode per limit that was passed.
#[test]
fn many_limits_make_few_modes() {
    let kernel = thresholds(40).expect("is made of what fits");
    let modes = specialize(&kernel, 12_000);
    assert!(!modes.work_limited);
    assert_eq!(modes.modes.len(), 41);
    let (with, without) = (modes.longest(), Modes::single(&kernel).longest());
    assert!(2 * with.cycles < without.cycles, "{with} of {without}");
    Pair::new(&kernel, &modes, &kernel.name).run(&mut Rng::new(40), 2000);
}

/// The search ends, and what it ends with is the kernel's tick.
#[test]
fn the_search_is_bounded() {
    let kernel = thresholds(100).expect("is made of what fits");
    let modes = specialize(&kernel, 12_000);
    assert!(modes.work_limited);
    assert!(modes.modes.len() > 1 && modes.instructions() <= 12_000);
    Pair::new(&kernel, &modes, &kernel.name).run(&mut Rng::new(100), 500);
}

/// How long chains are.
const LINKS: i64 = 3000;

/// A kernel where each of many operators is made of the one before.
fn chain(link: usize) -> Result<Kernel, OpError> {
    let mut b = Builder::new(&format!("chain.{link}"), 44_100);
    let (input, out) = (
        b.input("x", Range::new(0, 65_535)),
        b.output("f", Range::new(-32_768, 32_767)),
    );
    let kept = b.cell("kept", Type::I1, Type::I1.range(), 0);
    b.begin_tick();
    let x = b.op(Op::In(input), &[])?;
    let mut word = x;
    let mut holds = b.op(Op::Get(kept), &[])?;
    for at in 0..LINKS {
        let k = b.constant(Type::I32, 1 + at % 7)?;
        match link {
            0 => word = b.op(Op::Add, &[word, k])?,
            1 => {
                let shifted = b.op(Op::Shl(1), &[word])?;
                word = b.op(Op::Sar(1), &[shifted])?;
            }
            2 => word = b.op(if at % 2 == 0 { Op::Min } else { Op::Max }, &[word, k])?,
            3 => holds = b.op(Op::Not, &[holds])?,
            _ => {
                let limit = b.constant(Type::I32, at * 20)?;
                let less = b.op(Op::Lt, &[x, limit])?;
                holds = b.op([Op::And, Op::Or][at as usize % 2], &[holds, less])?;
                if link == 5 {
                    word = b.op(Op::Select, &[holds, word, k])?;
                }
            }
        }
    }
    let limit = b.constant(Type::I32, 9000)?;
    let less = b.op(Op::Lt, &[word, limit])?;
    let less = b.op(Op::And, &[less, holds])?;
    b.effect(Op::Set(kept), &[less])?;
    let zero = b.constant(Type::I32, 0)?;
    let force = b.op(Op::Select, &[less, zero, limit])?;
    b.effect(Op::Out(out), &[force])?;
    Ok(b.finish())
}

/// Whatever goes down such a chain needs no more stack than a thread has.
#[test]
fn long_chains() {
    for link in 0..6 {
        let kernel = chain(link).expect("is made of what fits");
        let modes = specialize(&kernel, 12_000);
        assert!(
            modes.longest() <= Modes::single(&kernel).longest(),
            "link {link}"
        );
        Pair::new(&kernel, &modes, &kernel.name).run(&mut Rng::new(link as u64), 20);
    }
}

/// A program whose modes know of a force what no branch of their code says any more.
#[test]
fn what_is_known_from_a_simplified_condition_is_declared_wider() {
    let text = include_str!("../../../tests/programs/felt_hammer.whip");
    let mut map = SourceMap::default();
    map.add("felt_hammer.whip", text.to_string());
    let (program, diagnostics) = compile_front(&mut map, &Options::default());
    let program = program.unwrap_or_else(|| panic!("{diagnostics:#?}"));
    let model = program.instruments[0].clone();
    // As the device `mikey` has them.
    let scales = Scales {
        sensor_zero: -0.5e-3,
        sensor_lsb: 11e-3 / 65535.0,
        drive_lsb: 32.0 / 32768.0,
        update_hz: None,
    };
    let compiled = pipeline::compile(model, scales, false).expect("it compiles");
    let kernel = without_probes(&compiled.lowered.kernel);
    let before = specialize(&kernel, INSTRUCTIONS);
    assert!(verify(&before).is_err(), "nothing is to be widened here");
    let modes = pipeline::specialize(&compiled, INSTRUCTIONS, &mut pipeline::unobserved)
        .unwrap_or_else(|error| panic!("{error:?}"));
    let mut pair = Pair::new(&kernel, &modes, "felt_hammer");
    pair.run(&mut Rng::new(7), 20_000);
}
