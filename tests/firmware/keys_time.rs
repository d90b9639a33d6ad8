//! A bench's ticks and its DMA: none is longer than its bound, a core never waits for the DMA at
//! memory unless its start forgets to say so, and then the bound says that too.

use whippen_compiler::board::Board;
use whippen_compiler::firmware::{OwnTexts, core_block};
use whippen_emulator::{Observer, Step};

use crate::key_bench::{
    Bench, Built, CYCLES_PER_MS, Frames, KEYS, PARTS, PERIOD, START_MS, build_bench, bundled_board,
    own_text,
};
use crate::keys::bundled;

/// Cycles of a core's tick from its handler on, at most.
pub fn bound_of_handler(built: &Built, core: usize) -> u64 {
    let bound = &built.bounded[core].contended;
    let before = ["the instruction in progress", "entry of the interrupt"];
    let parts = bound.parts.iter();
    let before: u64 = parts
        .filter(|(name, _)| before.contains(&name.as_str()))
        .map(|(_, cycles)| cycles)
        .sum();
    bound.cycles_max - before
}

/// Strokes on all keys, for so many ticks.
fn played(built: &Built, ticks: usize) -> (Frames, [u64; 2]) {
    let mut bench = Bench::started(built, PARTS);
    bench.machine.set_meets_fetches(true);
    let mut frames = Frames::default();
    let before = bench.machine.waited_cycles();
    bench.between_ticks();
    for tick in 0..ticks {
        for key in 0..KEYS {
            let is_down = (tick + 211 * key) % 2000 < 900;
            bench.key(key).finger.force_n = if is_down { 2.0 } else { 0.0 };
        }
        bench.pass_observed(PERIOD, &mut frames);
    }
    assert_eq!((bench.faults(), bench.keys().is_awake()), (0, true));
    let after = bench.machine.waited_cycles();
    (frames, [after[0] - before[0], after[1] - before[1]])
}

#[test]
fn no_tick_of_a_bench_is_longer_than_its_bound() {
    let built = bundled("grand-piano.whip");
    let most = bound_of_handler(&built, 0);
    let (frames, waited) = played(&built, 6000);
    println!(
        "{} of {most} cycles, {} ticks, waited {waited:?}",
        frames.longest[0], frames.count[0]
    );
    assert_eq!(frames.count[0], 6000);
    assert!(frames.longest[0] <= most && frames.longest[0] > most / 2);
    // Nothing at memory; at the bridge the DMA is met now and then.
    assert_eq!(waited[0], 0);
}

/// The cycles in which handlers begin.
#[derive(Default)]
struct Begins(Vec<u64>);

impl Observer for Begins {
    fn instruction(&mut self, _: &Step<'_>) {}

    fn exception(&mut self, _: usize, _: u32, cycle: u64) {
        self.0.push(cycle);
    }
}

/// The first tick is no interrupt of before the core listened, which would come in the middle of
/// words: it begins where all others do.
#[test]
fn the_first_tick_begins_where_others_do() {
    let built = bundled("virtual-spring.whip");
    let mut bench = Bench::new(&built, PARTS);
    let mut begins = Begins::default();
    bench.pass_observed((START_MS + 5) * CYCLES_PER_MS, &mut begins);
    let phases: Vec<u64> = begins.0.iter().map(|cycle| cycle % PERIOD).collect();
    let (first, others) = phases.split_first().expect("a tick");
    let (low, high) = (others.iter().min(), others.iter().max());
    let (low, high) = (*low.expect("ticks"), *high.expect("ticks"));
    println!("{first}; {} others {low} to {high}", others.len());
    assert!(others.len() > 100 && high - low < 40, "{low} to {high}");
    assert!((low..=high).contains(first), "{first}: {low} to {high}");
    assert_eq!(bench.block(core_block::MISSED), 0);
}

/// The bundled board, with all that the DMA reads and writes where the core's code and data are.
fn crowded() -> Board {
    let mut board = bundled_board();
    for place in &mut board.places {
        match place.pattern.as_str() {
            ".data.ring" => place.memory = "sram8".into(),
            ".bss.ring" => place.memory = "sram0".into(),
            _ => {}
        }
    }
    board
}

/// The start's text with other priorities.
fn without_priorities() -> OwnTexts {
    let text = include_str!("../../compiler/firmware/src/bench_start.s");
    let changed = text.replace("#BUS_PRIORITIES", "#0");
    assert_ne!(text, changed);
    own_text("bench_start.s", changed)
}

#[test]
fn a_core_waits_for_the_dma_at_memory_only_without_priorities() {
    let build = |own| build_bench("virtual-spring.whip", crowded(), own);
    let [with, without] = [build(OwnTexts::default()), build(without_priorities())];
    let [bound, larger] = [&with, &without].map(|built| bound_of_handler(built, 0));
    // Sixteen accesses, each before a load and a fetch.
    assert_eq!(larger, bound + 32);
    let found = [&with, &without].map(|built| played(built, 3000));
    for ((frames, waited), most) in found.iter().zip([bound, larger]) {
        println!("{} of {most} cycles, waited {waited:?}", frames.longest[0]);
        assert!(frames.longest[0] <= most);
    }
    let [at_memory, more] = found.map(|(_, [at_memory, _])| at_memory);
    assert_eq!(at_memory, 0);
    assert!(more > 20, "{more}");
}
