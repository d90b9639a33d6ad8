//! Answers that were given, by the text that was asked.
//!
//! ```text
//! operators/add/0 9c8e..41 proven z3-4.8.12 0.02
//! selection/armv6-m/event 70b1..2f unasked operator `emit`
//! ```
//!
//! A claim whose text has changed has no answer, so a rule that changes must be proven anew. The
//! file is committed; asking takes minutes and solvers, comparing takes neither.
//!
//! ```text
//! WHIPPEN_PROVE=changed    asks what has no answer, and writes the answers down
//! WHIPPEN_PROVE=open       asks again what is open, too
//! WHIPPEN_PROVE=all        asks everything anew
//! WHIPPEN_PROVE_ONLY=TEXT  of `open` and `all` those with the text in their names
//! WHIPPEN_PROVE_SECONDS=N  for how long a solver may take, 20 where nothing is said
//! ```

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::Path;

use crate::query::Query;
use crate::solver::{Solver, Verdict, ask};

/// How long a solver is waited for.
const SECONDS: u64 = 20;

/// FNV-1a in 128 bits.
fn hash(text: &str) -> String {
    let (basis, prime) = (
        0x6c62_272e_07bb_0142_62b8_2175_6295_c58d_u128,
        (1 << 88) + 0x13b,
    );
    let hash = text.bytes().fold(basis, |hash, byte| {
        (hash ^ u128::from(byte)).wrapping_mul(prime)
    });
    format!("{hash:032x}")
}

/// A line of the file.
#[derive(Debug, Clone, PartialEq, Eq)]
struct Line {
    hash: String,
    verdict: Verdict,
    rest: String,
}

fn read(text: &str) -> BTreeMap<String, Line> {
    let line = |line: &str| {
        let mut words = line.splitn(4, ' ');
        let (name, hash) = (words.next()?, words.next()?);
        let verdict = Verdict::of_word(words.next()?)?;
        let rest = words.next().unwrap_or_default().to_string();
        let hash = hash.to_string();
        Some((
            name.to_string(),
            Line {
                hash,
                verdict,
                rest,
            },
        ))
    };
    text.lines().filter_map(line).collect()
}

fn write(lines: &BTreeMap<String, Line>) -> String {
    let mut text = String::new();
    for (name, line) in lines {
        let Line {
            hash,
            verdict,
            rest,
        } = line;
        let _ = writeln!(text, "{name} {hash} {verdict} {rest}");
    }
    text
}

fn asked(solvers: &[Solver], query: &Query, seconds: u64) -> Result<Line, String> {
    if let Some(why) = query.why_unasked() {
        return Ok(Line {
            hash: hash(&query.text),
            verdict: Verdict::Unasked,
            rest: why.to_string(),
        });
    }
    let answer = ask(solvers, query, seconds);
    if answer.verdict == Verdict::Refuted {
        return Err(format!("{} is refuted by {}", query.name, answer.numbers));
    }
    let premises = ask(solvers, &query.premises(), seconds);
    if premises.verdict == Verdict::Proven {
        return Err(format!("{}: no numbers are as it assumes", query.name));
    }
    let rest = format!("{} {:.2}", answer.solver, answer.time.as_secs_f64());
    println!("{} {} {rest}", query.name, answer.verdict);
    Ok(Line {
        hash: hash(&query.text),
        verdict: answer.verdict,
        rest,
    })
}

/// Compares claims with their answers; with `WHIPPEN_PROVE` asks.
///
/// # Panics
///
/// Where a claim has no answer, or one to another text; where an answer is to no claim; where a
/// claim is refuted.
pub fn check(file: &Path, queries: &[Query]) {
    let known = read(&std::fs::read_to_string(file).unwrap_or_default());
    let wanted = std::env::var("WHIPPEN_PROVE").unwrap_or_default();
    let mut wrong = Vec::new();
    if !wanted.is_empty() {
        let Some(solvers) = Solver::all() else { return };
        let seconds = whippen_need::count("WHIPPEN_PROVE_SECONDS", SECONDS);
        let only = std::env::var("WHIPPEN_PROVE_ONLY").unwrap_or_default();
        let is_kept = |line: &&Line, query: &Query| match wanted.as_str() {
            _ if !query.name.contains(&only) => line.hash == hash(&query.text),
            "all" => false,
            "open" if line.verdict == Verdict::Open => false,
            _ => line.hash == hash(&query.text),
        };
        // What was answered stays, so that whoever ends this loses nothing.
        let mut lines = known.clone();
        for query in queries {
            let old = known.get(&query.name);
            let old = old.filter(|line| is_kept(line, query));
            match old.map_or_else(|| asked(&solvers, query, seconds), |line| Ok(line.clone())) {
                Ok(line) => {
                    let was = known.get(&query.name).map(|line| line.verdict);
                    if (was, line.verdict) == (Some(Verdict::Proven), Verdict::Open) {
                        wrong.push(format!("{} was proven and is open", query.name));
                    }
                    lines.insert(query.name.clone(), line);
                }
                Err(why) => {
                    lines.remove(&query.name);
                    wrong.push(why);
                }
            }
            std::fs::write(file, write(&lines)).expect("a file of answers");
        }
        lines.retain(|name, _| queries.iter().any(|query| query.name == *name));
        std::fs::write(file, write(&lines)).expect("a file of answers");
    } else {
        for query in queries {
            match known.get(&query.name) {
                Some(line) if line.hash == hash(&query.text) => {}
                Some(_) => wrong.push(format!(
                    "{}: the text that was proven is another",
                    query.name
                )),
                None => wrong.push(format!("{} was never asked", query.name)),
            }
        }
        let names: Vec<&str> = queries.iter().map(|query| query.name.as_str()).collect();
        let stale = known.keys().filter(|name| !names.contains(&name.as_str()));
        wrong.extend(stale.map(|name| format!("{name} is no claim any more")));
    }
    assert!(
        wrong.is_empty(),
        "{}: prove it with WHIPPEN_PROVE=changed:\n{}",
        file.display(),
        wrong.join("\n")
    );
}
