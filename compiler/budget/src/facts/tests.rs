//! What is known along a path, and of a word that is moved up by its own leading zeros.

use std::collections::BTreeMap;

use whippen_isa::{Arch, Cond, Inst, parse};
use whippen_words::{Claims, Ends};

use super::flags::FlagFacts;
use super::{Facts, Interval, NONE};
use crate::Code;
use crate::relevant::FLAGS;

impl Claims for Facts {
    fn of(known: &[(u8, [i32; 2])]) -> Self {
        let known = known.iter();
        let known = known.map(|&(register, ends)| (register, ends.map(|end| end as u32)));
        Self::of_registers(&known.collect())
    }

    fn execute(&mut self, inst: &Inst) {
        let constant = Code::new(0x108, 0x1234_5678_u32.to_le_bytes().to_vec());
        Self::execute(self, inst, 0x100, &constant);
    }

    fn assume(&mut self, cond: Cond) -> bool {
        Self::assume(self, cond)
    }

    fn assume_zero(&mut self, register: u8, zero: bool) -> bool {
        Self::assume_zero(self, register, zero)
    }

    fn flags(&self) -> u16 {
        self.flags.possible
    }

    fn ends(&self, register: u8) -> Ends {
        let found = self.interval(register);
        [found.low, found.high]
    }
}

#[test]
fn comparisons_and_results_keep_the_words_that_may_be() {
    whippen_words::comparisons_and_results::<Facts>();
}

#[test]
fn instructions_make_what_their_words_make() {
    whippen_words::instructions::<Facts>();
}

/// What a text leaves in R2, with R0 between these two.
fn of_r2(from: Facts, texts: &[&str]) -> Interval {
    let facts = texts.iter().fold(from, |mut facts, text| {
        let inst = parse(text, Arch::V8M, None).expect("an instruction");
        facts.execute(&inst, 0, &Code::default());
        facts
    });
    facts.interval(2)
}

fn with_r0(low: u32, high: u32) -> Facts {
    Facts::of_registers(&BTreeMap::from([(0, [low, high])]))
}

/// Every word above 0, moved up so, has its top bit set.
#[test]
fn a_word_moved_up_by_its_zeros_has_its_top_bit() {
    let normal = ["clz r1, r0", "lsl.w r2, r0, r1"];
    let found = of_r2(with_r0(1, 0x2000), &normal);
    assert_eq!([found.low, found.high], [i64::from(i32::MIN), -1]);
    // Another count that tells nothing leaves the last one that does.
    let other = ["clz r1, r0", "ubfx r4, r0, #0, #5", "clz r3, r4", normal[1]];
    assert_eq!(of_r2(with_r0(1, 0x2000), &other).high, -1);
    let upper = [&normal[..], &["lsr.w r2, r2, #16"]].concat();
    let found = of_r2(with_r0(1, 0x2000), &upper);
    assert_eq!([found.low, found.high], [0x8000, 0xffff]);
}

#[test]
fn the_zeros_of_a_range_are_counted() {
    let found = of_r2(with_r0(0x1000, 0x2_0000), &["clz r2, r0"]);
    assert_eq!([found.low, found.high], [14, 19]);
}

/// What may be 0, other zeros, and a word that has changed since tell nothing.
#[test]
fn other_words_are_not_taken_for_it() {
    let any = |from: Facts, texts: &[&str]| assert_eq!(of_r2(from, texts), Interval::ALL);
    any(with_r0(0, 0x2000), &["clz r1, r0", "lsl.w r2, r0, r1"]);
    let word = || with_r0(1, 0x2000);
    any(word(), &["clz r1, r0", "adds r0, #1", "lsl.w r2, r0, r1"]);
    any(word(), &["clz r1, r0", "adds r1, #1", "lsl.w r2, r0, r1"]);
    any(word(), &["clz r1, r0", "lsl.w r2, r3, r1"]);
    any(word(), &["clz r0, r0", "lsl.w r2, r0, r0"]);
}

/// Where paths meet it is known only if both know it; forgotten registers take it with them.
#[test]
fn it_is_known_where_all_paths_know_it() {
    let run = |texts: &[&str]| {
        texts.iter().fold(with_r0(1, 0x2000), |mut facts, text| {
            let inst = parse(text, Arch::V8M, None).expect("an instruction");
            facts.execute(&inst, 0, &Code::default());
            facts
        })
    };
    let (counted, other) = (run(&["clz r1, r0"]), run(&["movs r1, #20"]));
    let shifted = |facts: Facts| of_r2(facts, &["lsl.w r2, r0, r1"]).high;
    assert_eq!(shifted(counted.join(&counted)), -1);
    assert_ne!(shifted(counted.join(&other)), -1);
    assert!(other.covers(&other) && counted.covers(&counted));
    assert!(!counted.covers(&other));
    let kept = |registers: u32| {
        let mut facts = counted.clone();
        facts.keep(registers);
        shifted(facts)
    };
    assert_eq!(kept(0b11), -1);
    assert_ne!(kept(0b01), -1);
}

/// After texts, from R0 between two.
fn after(r0: [i32; 2], texts: &[&str]) -> Facts {
    whippen_words::run(&[(0, r0)], texts)
}

/// Where a condition leaves R0.
fn r0_where(facts: &Facts, cond: Cond) -> Option<Ends> {
    let mut facts = facts.clone();
    facts.assume(cond).then(|| Claims::ends(&facts, 0))
}

/// A comparison is kept as long as one side of it is, a result as long as it is itself.
#[test]
fn what_flags_speak_of_is_kept_where_it_is_of_use() {
    let kept = |texts: &[&str], relevant| {
        let mut facts = after([i32::MIN, i32::MAX], texts);
        facts.keep(relevant);
        facts
    };
    let high = i64::from(i32::MAX);
    let compared = kept(&["cmp r0, #3"], FLAGS | 1);
    assert_eq!(r0_where(&compared, Cond::GT), Some([4, high]));
    assert_eq!(compared.values.len(), 2);
    let of_others = kept(&["cmp r0, #3", "movs r7, #1"], FLAGS | 1 << 6);
    assert!(of_others.values.is_empty() && of_others.flags.names().next().is_none());
    let without_flags = kept(&["cmp r0, #3"], 1);
    assert_eq!(without_flags, Facts::nothing());
    let mut result = kept(&["adds r2, r0, #0"], FLAGS | 1 << 2);
    assert!(result.assume(Cond::MI) && result.interval(2).high == -1);
    let forgotten = kept(&["adds r2, r0, #0"], FLAGS | 1);
    assert!(forgotten.flags.names().next().is_none());
    let same = kept(&["mov r1, r0"], 0b11);
    assert!(same.registers[0] != NONE && same.registers[0] == same.registers[1]);
}

/// Where paths meet a comparison is known that both know, and flags may be what they are on either.
#[test]
fn comparisons_are_joined() {
    let compared = after([-9, 9], &["cmp r0, #3"]);
    let [less, greater] = [Cond::LT, Cond::GT].map(|cond| {
        let mut facts = compared.clone();
        assert!(facts.assume(cond));
        facts
    });
    let joined = less.join(&greater);
    assert_eq!(
        joined.flags.possible,
        less.flags.possible | greater.flags.possible
    );
    assert_eq!(
        [r0_where(&joined, Cond::EQ), r0_where(&joined, Cond::GT)],
        [None, Some([4, 9])]
    );
    assert!(joined.covers(&less) && joined.covers(&greater) && compared.covers(&joined));
    assert!(!less.covers(&joined) && !less.covers(&greater) && !joined.covers(&compared));
    let same = less.join(&less);
    assert!(same.covers(&less) && less.covers(&same));
    let other = compared.join(&after([-9, 9], &["cmp r0, r1"]));
    assert!(other.covers(&compared));
    let unknown = compared.join(&after([-9, 9], &[]));
    assert_eq!(unknown.flags, FlagFacts::UNKNOWN);
    assert_eq!(r0_where(&unknown, Cond::GT), Some([-9, 9]));
    // Words that are the same on one path alone are two.
    let copied = after([-9, 9], &["mov r1, r0"]);
    let apart = <Facts as Claims>::of(&[(0, [-9, 9]), (1, [-9, 9])]);
    let joined = copied.join(&apart);
    assert!(joined.registers[0] != joined.registers[1] && joined.covers(&copied));
    assert!(apart.covers(&copied) && !copied.covers(&apart));
}

/// Flags that nobody follows are any flags, not those of before.
#[test]
fn flags_of_other_instructions_are_unknown() {
    let compared = after([5, 9], &["cmp r0, #3"]);
    assert_eq!(r0_where(&compared, Cond::LE), None);
    for text in [
        "tst r0, r1",
        "teq r0, r1",
        "cmn r0, #1",
        "vmrs apsr_nzcv, fpscr",
    ] {
        let unknown = after([5, 9], &["cmp r0, #3", text]);
        assert_eq!(unknown.flags, FlagFacts::UNKNOWN, "{text}");
        assert_eq!(r0_where(&unknown, Cond::LE), Some([5, 9]), "{text}");
    }
}

/// However many values there were: names are few, and what is known of others is kept.
#[test]
fn a_long_way_has_few_names() {
    for others in [1, 2] {
        let known = [(1, [3, 4]), (2, [5, 6])];
        let mut facts = <Facts as Claims>::of(&known[..others]);
        let inst = parse("subs r0, #1", Arch::V8M, None).expect("an instruction");
        for _ in 0..70_000 {
            Claims::execute(&mut facts, &inst);
            assert!(facts.values.len() < 1010);
        }
        assert_eq!(Claims::ends(&facts, 1), [3, 4]);
    }
}
