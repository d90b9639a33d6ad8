//! What an abstract interpretation claims of registers and flags along a path, against words tried
//! one by one: that every word is in the interval, and that the interval is no wider than it is
//! said to be. Bound and checker have an interpretation each; both are judged here.

mod comparison;
mod effect;

pub use comparison::comparisons_and_results;
pub use effect::instructions;

use whippen_isa::{Arch, Cond, Inst, ItState, parse};

/// From the first to the second, both included.
pub type Ends = [i64; 2];

/// Any word.
pub const ANY: Ends = [i32::MIN as i64, i32::MAX as i64];

/// What is claimed of registers and flags.
pub trait Claims: Clone {
    /// Of each register a word from the first to the last; nothing else is known.
    fn of(known: &[(u8, [i32; 2])]) -> Self;
    /// An instruction at address 0x100 has executed; the only constant is the word 0x12345678 at
    /// 0x108.
    fn execute(&mut self, inst: &Inst);
    /// A condition holds; false where it cannot.
    fn assume(&mut self, cond: Cond) -> bool;
    /// A register is zero, or is not; false where it cannot be so.
    fn assume_zero(&mut self, register: u8, zero: bool) -> bool;
    /// Bit `n << 3 | z << 2 | c << 1 | v` for each combination of flags that may be.
    fn flags(&self) -> u16;
    /// What a register lies between.
    fn ends(&self, register: u8) -> Ends;
}

/// The bytes of texts, each an instruction, those behind an IT with the condition that it gives; a
/// text that begins with `.` is a halfword.
pub fn assembled(texts: &[&str], arch: Arch) -> Vec<u8> {
    let (mut bytes, mut it) = (Vec::new(), ItState::OUTSIDE);
    for text in texts {
        if let Some(half) = text.strip_prefix('.') {
            let half = u16::from_str_radix(half, 16).expect("a halfword");
            bytes.extend(half.to_le_bytes());
            continue;
        }
        let inst = parse(text, arch, it.cond()).unwrap_or_else(|why| panic!("`{text}`: {why:?}"));
        it = inst.it_behind(it).expect("an IT instruction");
        let (first, second) = inst.encode(arch).expect("it has bits").halfwords();
        let halves = [Some(first), second].into_iter().flatten();
        bytes.extend(halves.flat_map(u16::to_le_bytes));
    }
    bytes
}

/// Several texts, one after the other.
pub fn run<C: Claims>(known: &[(u8, [i32; 2])], texts: &[&str]) -> C {
    texts.iter().fold(C::of(known), |mut claims, text| {
        claims.execute(&parse(text, Arch::V8M, None).expect("an instruction"));
        claims
    })
}

/// Where signed and unsigned order begin and end, and some words between.
const PLACES: [i32; 7] = [i32::MIN, -3, -1, 0, 1, 4, i32::MAX];

/// Every interval from one of these to another.
fn intervals() -> impl Iterator<Item = [i32; 2]> {
    let from = |at: usize| PLACES[at..].iter().map(move |&high| [PLACES[at], high]);
    (0..PLACES.len()).flat_map(from)
}

/// Every two of them.
fn pairs_of_intervals() -> impl Iterator<Item = [[i32; 2]; 2]> {
    intervals().flat_map(|a| intervals().map(move |b| [a, b]))
}

/// Words of an interval: its ends, and all that lie beside an end of any.
fn words([low, high]: [i32; 2]) -> Vec<i32> {
    let beside = |end: i32| [end.saturating_sub(1), end, end.saturating_add(1)];
    let mut words: Vec<i32> = PLACES.into_iter().flat_map(beside).collect();
    words.retain(|word| (low..=high).contains(word));
    words.sort_unstable();
    words.dedup();
    words
}

/// Every two words of two intervals.
fn pairs([a, b]: [[i32; 2]; 2]) -> Vec<(i32, i32)> {
    let of_left = |x: i32| words(b).into_iter().map(move |y| (x, y));
    words(a).into_iter().flat_map(of_left).collect()
}

/// From the least to the greatest.
fn hull(numbers: impl Iterator<Item = i64>) -> Option<Ends> {
    numbers
        .map(|number| [number; 2])
        .reduce(|a, b| [a[0].min(b[0]), a[1].max(b[1])])
}

fn covers(outer: Ends, inner: Ends) -> bool {
    outer[0] <= inner[0] && inner[1] <= outer[1]
}

/// Where a condition leaves some registers; nothing where it cannot hold.
fn where_holds<const N: usize>(
    claims: &impl Claims,
    cond: Cond,
    registers: [u8; N],
) -> Option<[Ends; N]> {
    let mut claims = claims.clone();
    let possible = claims.assume(cond);
    possible.then(|| registers.map(|register| claims.ends(register)))
}
