//! What is claimed along a path, and where one claim holds another.

use whippen_isa::{Arch, Cond, Inst, parse};
use whippen_words::{Claims, Ends};

use super::{ALL, Facts, LEFT, NONE};
use crate::effect;
use crate::elf::Elf;

impl Claims for Facts {
    fn of(known: &[(u8, [i32; 2])]) -> Self {
        let mut facts = Self::default();
        for &(register, ends) in known {
            facts.set(register, ends.map(i64::from));
        }
        facts
    }

    fn execute(&mut self, inst: &Inst) {
        let constant = Elf::of(&[(".rodata", 0x108, &0x1234_5678_u32.to_le_bytes())]);
        effect::execute(self, inst, 0x100, &constant);
    }

    fn assume(&mut self, cond: Cond) -> bool {
        Self::assume(self, cond)
    }

    fn assume_zero(&mut self, register: u8, zero: bool) -> bool {
        Self::assume_zero(self, register, zero)
    }

    fn flags(&self) -> u16 {
        self.flags
    }

    fn ends(&self, register: u8) -> Ends {
        Self::of(self, register)
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

/// After texts, from R0 between two.
fn run(r0: [i32; 2], texts: &[&str]) -> Facts {
    whippen_words::run(&[(0, r0)], texts)
}

/// A word above 0 that is moved up by its own leading zeros has its top bit set; what may be 0,
/// other zeros, and a word that has changed since tell nothing.
#[test]
fn a_word_moved_up_by_its_zeros_has_its_top_bit() {
    let of_r2 = |r0, texts: &[&str]| run(r0, texts).of(2);
    let (count, shift) = ("clz r1, r0", "lsl.w r2, r0, r1");
    assert_eq!(run([0x1000, 0x2_0000], &[count]).of(1), [14, 19]);
    assert_eq!(of_r2([1, 0x2000], &[count, shift]), [ALL[0], -1]);
    // Another count that tells nothing leaves the last one that does.
    let other = ["ubfx r4, r0, #0, #5", "clz r3, r4"];
    let texts = [&[count][..], &other, &[shift]].concat();
    assert_eq!(of_r2([1, 0x2000], &texts), [ALL[0], -1]);
    for (r0, texts) in [
        ([0, 0x2000], &[count, shift][..]),
        ([1, 0x2000], &[count, "adds r0, #1", shift]),
        ([1, 0x2000], &[count, "adds r1, #1", shift]),
        ([1, 0x2000], &[count, "lsl.w r2, r3, r1"]),
        ([1, 0x2000], &[count, "lsl.w r2, r0, r3"]),
        ([1, 0x2000], &["clz r0, r0", "lsl.w r2, r0, r0"]),
    ] {
        assert_eq!(of_r2(r0, texts), ALL, "{texts:?}");
    }
}

/// What claims less, or the same, holds all of it: wider intervals, fewer equal words, more flags.
#[test]
fn a_claim_covers_whoever_claims_more() {
    let any = Facts::default();
    let texts = ["mov r1, r0", "mov r2, r0", "cmp r0, #3", "clz r4, r0"];
    let claims = run([1, 9], &texts);
    assert!(claims.covers(&claims) && any.covers(&claims) && !claims.covers(&any));
    assert!(run([0, 9], &texts[..3]).covers(&claims) && run([1, 10], &texts).covers(&claims));
    assert!(!claims.covers(&run([1, 10], &texts)) && !claims.covers(&run([0, 9], &texts)));
    // Words that are the same, against words between the same ends.
    let apart = run([1, 9], &["movs r3, #1", "cmp r0, #3", "clz r4, r0"]);
    let mut split = claims.clone();
    split.set(1, [1, 9]);
    assert!(split.covers(&claims) && !claims.covers(&split) && !claims.covers(&apart));
    // Flags that cannot be, of the same comparison.
    let mut less = claims.clone();
    assert!(Claims::assume(&mut less, Cond::LT));
    assert!(claims.covers(&less) && !less.covers(&claims));
    let compares = run([1, 9], &["cmp r0, #3"]);
    let mut unknown = compares.clone();
    unknown.show(None, NONE);
    assert!(unknown.covers(&compares) && !compares.covers(&unknown));
}

/// Who writes certificates leaves out what no instruction behind asks for; what is left is claimed
/// as before.
#[test]
fn what_is_trimmed_claims_less() {
    let texts = ["mov r1, r0", "cmp r0, #3", "clz r4, r0", "movs r5, #7"];
    let whole = run([1, 9], &texts[..3]);
    let trimmed = |relevant: u32| {
        let mut facts = whole.clone();
        facts.trim(relevant);
        assert!(facts.covers(&whole), "{relevant:b}");
        facts
    };
    let flags = 1 << 16;
    let all = trimmed(flags | 0xffff);
    assert!(whole.covers(&all) && all.values.len() <= whole.values.len());
    // A register alone; with the comparison that it is in; neither side of it.
    let alone = trimmed(1);
    assert_eq!((alone.of(0), alone.of(1), alone.flags), ([1, 9], ALL, !0));
    let mut compared = trimmed(flags | 1);
    assert!(Claims::assume(&mut compared, Cond::GT));
    assert_eq!(compared.of(0), [4, 9]);
    let mut no_side = trimmed(flags | 1 << 7);
    assert!(no_side.values.is_empty() && Claims::assume(&mut no_side, Cond::GT));
    // A word and its zeros are known together or not at all.
    let shifted = |mut facts: Facts| {
        let shift = parse("lsl.w r2, r0, r4", Arch::V8M, None).expect("an instruction");
        Claims::execute(&mut facts, &shift);
        facts.of(2)
    };
    assert_eq!(
        [shifted(trimmed(1 | 1 << 4)), shifted(trimmed(1))],
        [[ALL[0], -1], ALL]
    );
    // Names are numbered in the order of registers, and one that tells nothing is none.
    let mut facts = Facts::default();
    (0..3).for_each(|register| facts.set(register, [i64::from(register), 9]));
    facts.name_of(3);
    facts.names.swap(0, 2);
    facts.trim(0xffff);
    assert_eq!(
        (&facts.names[..4], facts.values.len()),
        (&[0, 1, 2, NONE][..], 3)
    );
    assert_eq!(
        [facts.of(0), facts.of(2), facts.of(3)],
        [[2, 9], [0, 9], ALL]
    );
}

/// What any word may be is kept where something is known of it by another place.
#[test]
fn what_is_said_of_any_word_is_kept() {
    let any = [i32::MIN, i32::MAX];
    let trimmed = |texts: &[&str], relevant: u32| {
        let mut facts = run(any, texts);
        facts.trim(relevant);
        facts
    };
    let flags = 1 << 16;
    let mut compared = trimmed(&["cmp r0, #3"], flags | 1);
    assert!(Claims::assume(&mut compared, Cond::GT));
    assert_eq!(compared.of(0), [4, ALL[1]]);
    // Of a comparison with a word of which nothing is claimed nothing is told.
    let mut one_side = run(any, &["cmp r1, r0"]);
    one_side.names[LEFT] = NONE;
    assert!(Claims::assume(&mut one_side, Cond::GT));
    assert_eq!(one_side.of(0), ALL);
    let same = trimmed(&["mov r1, r0"], 0b11);
    assert!(same.names[0] != NONE && same.names[0] == same.names[1]);
    // The sign of a result is of use as long as the result is.
    let negative = |relevant| {
        let mut facts = trimmed(&["adds r2, r0, #0"], relevant);
        assert!(Claims::assume(&mut facts, Cond::MI));
        facts.of(2)
    };
    assert_eq!(
        [negative(flags | 1 << 2), negative(flags | 1)],
        [[ALL[0], -1], ALL]
    );
}
