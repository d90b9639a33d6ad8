//! The emulator against QEMU: every encoding of the table with random operands, flags and memory.
//!
//! One image holds the cases and a harness (`harness.s`) that runs them one after another and
//! writes the state after each to its console. It runs under QEMU and here; every byte must agree.
//! What QEMU cannot judge is listed in `cases`, with the reason.

mod cases;
mod harness;
mod programs;
mod random;

use cases::Case;
use harness::{Target, Tools};
use std::collections::BTreeMap;
use whippen_isa::{Arch, Encoding};

/// Cases of each encoding.
const CASES: usize = 24;

fn judge(target: &Target) {
    let Some(tools) = Tools::find() else { return };
    let of_each = whippen_need::count("WHIPPEN_CASES", CASES);
    let cases: Vec<Case> = cases::all(target.arch, of_each);
    let mut wrong: BTreeMap<String, Vec<String>> = BTreeMap::new();
    let mut judged = 0;
    for batch in cases.chunks(target.batch) {
        let image = tools.build(target, batch);
        let (theirs, ours) = (tools.qemu(target, &image), image.emulate(target));
        judged += batch.len();
        let size = target.record_bytes();
        assert_eq!(
            theirs.len(),
            batch.len() * size,
            "{}: QEMU stopped early",
            target.machine
        );
        for (i, case) in batch.iter().enumerate() {
            let at = i * size..(i + 1) * size;
            if theirs.get(at.clone()) != ours.get(at.clone()) {
                let found = harness::differences(&theirs[at.clone()], ours.get(at).unwrap_or(&[]));
                wrong
                    .entry(case.encoding.to_string())
                    .or_default()
                    .push(format!("{case}: {found}"));
            }
        }
    }
    println!(
        "{}: {judged} cases of {} encodings",
        target.machine,
        count(&cases)
    );
    let shown: Vec<String> = wrong
        .iter()
        .map(|(name, all)| {
            format!(
                "{name} ({}):\n    {}",
                all.len(),
                all[..all.len().min(2)].join("\n    ")
            )
        })
        .collect();
    assert!(
        wrong.is_empty(),
        "{} encodings differ:\n{}",
        wrong.len(),
        shown.join("\n")
    );
}

fn count(cases: &[Case]) -> usize {
    cases
        .iter()
        .map(|case| case.encoding)
        .collect::<std::collections::BTreeSet<Encoding>>()
        .len()
}

#[test]
fn cortex_m33_agrees() {
    judge(&harness::MPS2_AN505);
}

#[test]
fn cortex_m4_agrees() {
    judge(&harness::MPS2_AN386);
}

#[test]
fn cortex_m0_agrees() {
    judge(&harness::MICROBIT);
}

#[test]
fn every_encoding_is_judged_or_listed() {
    for arch in Arch::ALL {
        let judged: std::collections::BTreeSet<Encoding> = cases::all(arch, 2)
            .iter()
            .map(|case| case.encoding)
            .collect();
        for encoding in Encoding::all().filter(|e| e.exists_in(arch)) {
            let listed = cases::unjudged(encoding).is_some();
            assert!(
                judged.contains(&encoding) != listed,
                "{encoding} for {arch:?}: listed {listed}"
            );
        }
    }
}
