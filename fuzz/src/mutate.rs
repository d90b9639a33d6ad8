//! New inputs from old ones.

use whippen_compiler::kernel::ROWS;
use whippen_compiler::kernel::random::Rng;
use whippen_compiler::syntax::token::{HARD_KEYWORDS, SIGNS, SOFT_KEYWORDS};
use whippen_compiler::units::{UNITS, dimension_names};

/// Inputs grow no larger.
const LARGEST: usize = 30_000;

/// Numbers where things break, and text that editors and other languages leave behind.
const ODD: &[&str] = &[
    "0",
    "1",
    "-1",
    "0.0",
    "1e308",
    "1e-308",
    "1e15",
    "9999999999999999999999",
    "4294967296",
    "2147483647",
    "-2147483648",
    "65536",
    "0.5",
    "1.5",
    "''",
    "{",
    "}",
    "(",
    ")",
    "((((((((",
    "))))))))",
    "{{{",
    "\u{feff}",
    "\r\n",
    "\t",
    "\0",
    "é",
    "−",
    "’",
    "/*",
    "//",
    "\"",
    ";",
    "nan",
    "inf",
    ",",
    ",,",
    "\n\n",
    " ",
    "e",
    "..",
    "kernel",
    "tick {",
    "yield",
    "loop 3",
];

/// A mutation of one of the seeds.
pub fn mutate(rng: &mut Rng, seeds: &[Vec<u8>]) -> Vec<u8> {
    let pick = |rng: &mut Rng| {
        seeds
            .get(rng.below(seeds.len().max(1) as u64) as usize)
            .cloned()
            .unwrap_or_default()
    };
    let mut input = pick(rng);
    for _ in 0..=rng.below(6) {
        let other = pick(rng);
        one(rng, &mut input, &other);
    }
    input.truncate(LARGEST);
    input
}

fn one(rng: &mut Rng, input: &mut Vec<u8>, other: &[u8]) {
    let (from, to) = piece(rng, input);
    match rng.below(10) {
        0 => drop(input.drain(from..to)),
        1 => input
            .splice(from..from, input[from..to].to_vec())
            .for_each(drop),
        2 if !input.is_empty() => {
            let at = rng.below(input.len() as u64) as usize;
            input[at] ^= 1 << rng.below(8);
        }
        3 | 4 => input.splice(from..to, word(rng).bytes()).for_each(drop),
        5 => input
            .splice(from..from, format!(" {} ", word(rng)).into_bytes())
            .for_each(drop),
        6 | 7 => {
            let (first, last) = lines(rng, other);
            input
                .splice(from..to, other[first..last].to_vec())
                .for_each(drop);
        }
        8 => {
            let (first, last) = lines(rng, input);
            let moved: Vec<u8> = input.drain(first..last).collect();
            let at = rng.below(input.len() as u64 + 1) as usize;
            input.splice(at..at, moved).for_each(drop);
        }
        _ => input.truncate(from),
    }
}

/// A token, a few bytes or some lines.
fn piece(rng: &mut Rng, input: &[u8]) -> (usize, usize) {
    if input.is_empty() {
        return (0, 0);
    }
    let at = rng.below(input.len() as u64) as usize;
    match rng.below(3) {
        0 => (at, (at + rng.below(8) as usize).min(input.len())),
        1 => lines(rng, input),
        _ => {
            let joins = |b: &u8| b.is_ascii_alphanumeric() || *b == b'.' || *b == b'_';
            let start = input[..at]
                .iter()
                .rposition(|b| !joins(b))
                .map_or(0, |p| p + 1);
            let end = input[at..]
                .iter()
                .position(|b| !joins(b))
                .map_or(input.len(), |p| at + p);
            (start, end.max(start))
        }
    }
}

/// One to four whole lines.
fn lines(rng: &mut Rng, input: &[u8]) -> (usize, usize) {
    let starts: Vec<usize> = std::iter::once(0)
        .chain(
            input
                .iter()
                .enumerate()
                .filter(|(_, b)| **b == b'\n')
                .map(|(i, _)| i + 1),
        )
        .collect();
    let first = rng.below(starts.len() as u64) as usize;
    let last = first + 1 + rng.below(4) as usize;
    (
        starts[first],
        starts.get(last).copied().unwrap_or(input.len()),
    )
}

/// A word of the language, an operator of kernels, a unit, or something odd.
fn word(rng: &mut Rng) -> String {
    let dimensions: Vec<&str> = dimension_names().collect();
    match rng.below(8) {
        0 => rng.pick(HARD_KEYWORDS).to_string(),
        1 => rng.pick(SOFT_KEYWORDS).to_string(),
        2 => rng.pick(SIGNS).to_string(),
        3 => rng.pick(&dimensions).to_string(),
        4 => format!(
            "{} {}",
            rng.pick(ODD),
            UNITS[rng.below(UNITS.len() as u64) as usize].name
        ),
        5 => ROWS[rng.below(ROWS.len() as u64) as usize].name.to_string(),
        _ => rng.pick(ODD).to_string(),
    }
}
