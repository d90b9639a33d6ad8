//! Between two frames: a tick of columns sends before the first of its frames begins, and looks for
//! words when those of the last one lie in memory. Both are proven of an image, or it is refused.

use whippen_compiler::pipeline::{self, unobserved};
use whippen_emulator::{Observer, Step};

use crate::key_bench::{PERIOD, own_text, whole_keys};
use crate::key_columns::{COLUMN, ColumnBench, KEY_PARTS, TICK_COMES, board_of, built};

/// Words of the last frame lie in memory as long after its end as the board says, which is before a
/// tick looks for them: a mark in each column's place is overwritten by then, and not long before.
#[test]
fn words_are_there_when_the_board_says() {
    for (columns, cores) in [(1, 1), (7, 1), (7, 2)] {
        let built = built("virtual-spring.whip", columns * COLUMN, cores);
        let wired = built.board.columns.as_ref().expect("columns");
        let words_cycles = u64::from(wired.words_cycles());
        let mut bench = ColumnBench::started(&built, KEY_PARTS);
        let mut last_seen = 0;
        for _ in 0..20 {
            bench.before_tick();
            let end = bench.now() + TICK_COMES;
            // A core would pass an interrupt's entry at once.
            (0..cores).for_each(|core| bench.mask_interrupts(core, true));
            let last = bench.mark_last_words();
            while bench.now() < end + words_cycles {
                if bench.has_marks(&last) {
                    last_seen = last_seen.max(bench.now().saturating_sub(end));
                }
                bench.pass(1);
            }
            assert!(!bench.has_marks(&last), "{columns} columns, {cores} cores");
            (0..cores).for_each(|core| bench.mask_interrupts(core, false));
            bench.pass(PERIOD / 2);
        }
        println!("{columns} columns, {cores} cores: {last_seen} of {words_cycles}");
        // An instruction between ticks is passed at once, too.
        assert!(last_seen + 8 >= words_cycles);
    }
}

/// The cycles in which core 0 comes to an instruction.
struct Comes {
    address: u32,
    cycles: Vec<u64>,
}

impl Observer for Comes {
    fn instruction(&mut self, step: &Step<'_>) {
        if step.core == 0 && step.address == self.address {
            self.cycles.push(step.cycle);
        }
    }
}

/// It reads how late it is no later than is proven, however keys are struck.
#[test]
fn a_tick_has_read_how_late_it_is_within_its_bound() {
    for (file, keys, cores) in [
        ("virtual-spring.whip", COLUMN, 1),
        ("grand-piano.whip", 3 * COLUMN, 1),
        ("grand-piano.whip", 6 * COLUMN, 2),
        ("virtual-spring.whip", 7 * COLUMN, 2),
    ] {
        let built = built(file, keys, cores);
        let proven = built.bounded[0].contended.sending.expect("columns");
        let mut bench = ColumnBench::started(&built, KEY_PARTS);
        bench.machine.set_meets_fetches(true);
        bench.before_tick();
        let mut request = bench.now() + TICK_COMES;
        let mut comes = Comes {
            address: bench.address("board_timed"),
            cycles: Vec::new(),
        };
        for tick in 0..200 {
            for key in 0..keys {
                let is_down = (tick + 7 * key) % 100 < 50;
                bench.key(key).finger.force_n = if is_down { 2.0 } else { 0.0 };
            }
            bench.pass_observed(PERIOD, &mut comes);
        }
        let mut longest = 0;
        assert_eq!(comes.cycles.len(), 200);
        for cycle in comes.cycles {
            longest = longest.max(cycle - request);
            request += PERIOD;
        }
        let (most, until) = (proven.cycles_max, proven.until_cycles);
        println!("{keys} keys of {file}, {cores} cores: {longest} of {most}, sends up to {until}");
        assert!(longest <= most && 3 * longest > most && most <= until);
    }
}

/// Why an image is refused whose text of columns is changed.
fn refused(change: impl Fn(&str) -> String) -> String {
    let text = include_str!("../../compiler/firmware/src/columns.s");
    let changed = change(text);
    assert_ne!(text, changed);
    let texts = own_text("columns.s", changed);
    let board = board_of(7, 2);
    let (image, _, rate_hz) = whole_keys("virtual-spring.whip", 56, &board, texts);
    let proof = pipeline::prove(&image, &board, rate_hz, &mut unobserved);
    proof.expect_err("it is refused").to_string()
}

#[test]
fn a_text_that_sends_late_or_looks_early_is_refused() {
    let timed = "board_timed:\n";
    let slow = format!("        .rept   40\n        nop\n        .endr\n{timed}");
    let late = refused(|text| text.replace(timed, &slow));
    assert!(late.contains("a tick may need 122 cycles"), "{late}");
    let looks = "board_looks:\n";
    let begins = "board_begin:\n";
    let early = refused(|text| {
        let without = text.replace(looks, "");
        without.replace(
            begins,
            &format!("{begins}        .if     CORE == 0\n{looks}        .endif\n"),
        )
    });
    assert!(
        early.contains("may look for words of the converters after 1 cycles"),
        "{early}"
    );
}
