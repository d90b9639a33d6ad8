//! The table of what is proven, open and unasked in `docs/proofs.md` is counted from the answers.

use std::path::Path;

use whippen_smt::Verdict;

/// Rows of the table: the file of answers, and how the names of its claims begin.
const ROWS: [(&str, &str, &str); 8] = [
    ("operators", "tests/smt/tests/proof/operators.txt", ""),
    ("second reading", "audit/src/ranges/rule/tests.txt", ""),
    (
        "simplification",
        "tests/smt/tests/proof/simplification.txt",
        "",
    ),
    (
        "quotients",
        "compiler/modes/src/partial_eval/divide/proven.txt",
        "",
    ),
    (
        "selection, Cortex-M33",
        "tests/smt/tests/proof/selection.txt",
        "v8m/",
    ),
    (
        "selection, Cortex-M4",
        "tests/smt/tests/proof/selection.txt",
        "v7em/",
    ),
    (
        "selection, Cortex-M0+",
        "tests/smt/tests/proof/selection.txt",
        "v6m/",
    ),
    ("normal forms", "compiler/validate/src/tests/proven.txt", ""),
];

#[test]
fn the_document_counts_the_answers() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let read = |path: &str| std::fs::read_to_string(root.join(path)).expect("is readable");
    let document = read("docs/proofs.md");
    for (family, file, prefix) in ROWS {
        let answers = read(file);
        let own = answers.lines().filter(|line| line.starts_with(prefix));
        let verdicts: Vec<&str> = own.filter_map(|line| line.split(' ').nth(2)).collect();
        let count = |verdict: Verdict| {
            let same = verdicts.iter().filter(|word| **word == verdict.word());
            same.count()
        };
        let [proven, open, unasked] = [Verdict::Proven, Verdict::Open, Verdict::Unasked].map(count);
        let row = format!("| {family} | {proven} | {open} | {unasked} |");
        assert!(document.contains(&row), "docs/proofs.md lacks `{row}`");
    }
}
