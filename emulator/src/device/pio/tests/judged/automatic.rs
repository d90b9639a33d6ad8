//! One machine with automatic pushes and pulls, against `rp2040-pio-emulator`. It fills no OSR
//! beside other instructions than OUT, and notices a full queue an instruction late, so programs
//! begin with an OUT and are compared until the queue is full or the words are over.

use super::*;

/// A program whose first instruction is OUT, its settings and its words.
struct Automatic {
    program: Vec<u32>,
    words: Vec<u32>,
    thresholds: [u32; 2],
    right: [bool; 2],
    side_bits: u32,
}

const DIRECTIONS: u32 = 0xfff;

impl Automatic {
    fn new(case: u64) -> Self {
        let random = &mut Random::new(case + 1_000_000);
        let len = 2 + random.below(12);
        let instruction = |random: &mut Random, i: u32| {
            let (field, count) = (random.below(32) << 8, 1 + random.below(31));
            let kind = if i == 0 { 0 } else { random.below(8) };
            field
                | match kind {
                    0..3 => 0x6000 | random.of(&[0, 1, 2, 3, 6]) << 5 | count,
                    3..5 => 0x4000 | random.of(&[1, 2, 3, 6]) << 5 | count,
                    5 => random.below(6) << 5 | random.below(len),
                    6 => {
                        let target = random.of(&[1, 2, 6]);
                        0xa000 | target << 5 | random.below(2) << 3 | random.of(&[1, 2, 3, 6])
                    }
                    _ => 0xe000 | random.of(&[0, 1, 2]) << 5 | random.below(32),
                }
        };
        Self {
            program: (0..len).map(|i| instruction(random, i)).collect(),
            words: (0..4).map(|_| random.word()).collect(),
            thresholds: [0; 2].map(|_| 1 + random.below(32)),
            right: [0; 2].map(|_| random.below(2) == 1),
            side_bits: random.below(4),
        }
    }

    fn json(&self) -> String {
        let [push, pull] = self.thresholds;
        let [isr, osr] = self.right.map(|right| if right { "true" } else { "false" });
        format!(
            "{{\"cycles\": {CYCLES}, \"program\": {:?}, \"words\": {:?}, \"directions\": {DIRECTIONS}, \
             \"settings\": {{\"auto_push\": true, \"auto_pull\": true, \"push_threshold\": {push}, \
             \"pull_threshold\": {pull}, \"shift_isr_right\": {isr}, \"shift_osr_right\": {osr}, \
             \"out_base\": 0, \"out_count\": 8, \"set_base\": 4, \"set_count\": 4, \
             \"side_set_base\": 8, \"side_set_count\": {}}}}}\n",
            self.program, self.words, self.side_bits
        )
    }

    /// The machine after each cycle, as the judge prints it, without the clock.
    fn run(&self) -> Vec<String> {
        let mut bench = Bench::new(BoardKind::Rp2040);
        let words: Vec<u16> = self.program.iter().map(|word| *word as u16).collect();
        bench.program(&words);
        let [push, pull] = self.thresholds.map(|bits| bits & 31);
        let [isr, osr] = self.right.map(u32::from);
        let shift = pull << 25 | push << 20 | osr << 19 | isr << 18 | 3 << 16;
        bench.write(SHIFTCTRL, shift);
        bench.write(EXECCTRL, (words.len() as u32 - 1) << 12);
        bench.write(PIO, 0x10);
        bench.write(
            PINCTRL,
            self.side_bits << 29 | 4 << 26 | 8 << 20 | 8 << 10 | 4 << 5,
        );
        self.words
            .iter()
            .for_each(|word| bench.write(PIO + 0x10, *word));
        let id = bench.pio();
        let pio = bench.machine.bus.device_mut::<Pio>(id).expect("a block");
        pio.directions = DIRECTIONS;
        bench.write(PIO, 1);
        let state = |cycle| {
            bench.run(cycle);
            let pio = bench.machine.bus.device_mut::<Pio>(id).expect("a block");
            let (levels, m) = (pio.levels & DIRECTIONS, &pio.machines[0]);
            let queues = [m.tx.len() as u32, m.rx.len() as u32];
            let words = [levels, m.x, m.y, m.isr, m.osr, queues[0], queues[1], m.pc];
            hexadecimal(&words, ",")
        };
        (1..=CYCLES).map(state).collect()
    }
}

/// Where a case differs from what the judge says, as far as it can judge.
fn difference(case: &Automatic, theirs: &str, compared: &mut usize) -> Option<String> {
    let ours = case.run();
    let mut clock = 0;
    for step in theirs.split_whitespace() {
        let (end, state) = step.split_once(',')?;
        let words: Vec<&str> = state.split(',').collect();
        if words[5] == "0" || words[6] == "4" {
            return None;
        }
        let mine = ours.get(clock)?;
        if mine != state {
            return Some(format!(
                "cycle {clock}: {mine} for {state}, {:x?}",
                case.program
            ));
        }
        *compared += 1;
        clock = usize::from_str_radix(end, 16).ok()?;
    }
    None
}

#[test]
fn automatic_pushes_and_pulls_are_as_pioemu_says() {
    let cases: Vec<Automatic> = (0..cases()).map(Automatic::new).collect();
    let input: String = cases.iter().map(Automatic::json).collect();
    let Some(theirs) = asked("pioemu", "pio_pioemu.py", &input) else {
        return;
    };
    assert_eq!(theirs.len(), cases.len());
    let mut steps = 0;
    let wrong: Vec<String> = (cases.iter().zip(&theirs))
        .filter_map(|(case, theirs)| difference(case, theirs, &mut steps))
        .collect();
    println!("pioemu: {} cases, {steps} instructions", cases.len());
    assert!(steps > 10 * cases.len(), "hardly anything was compared");
    let first = wrong.first().map_or("", |text| text);
    assert!(wrong.is_empty(), "{} wrong: {first}", wrong.len());
}
