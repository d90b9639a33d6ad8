//! The order of the book: which document stands in which part, as mdBook's `SUMMARY.md`.

use std::collections::BTreeMap;
use std::fmt::Write;

/// Parts, and their documents. A name that ends with `/` stands for the documents of that folder
/// that are named nowhere else; they are chapters below the one before.
pub const PARTS: &[(&str, &[&str])] = &[
    (
        "Begin",
        &[
            "README.md",
            "docs/tutorial.md",
            "docs/tools.md",
            "GLOSSARY.md",
        ],
    ),
    (
        "The language",
        &[
            "docs/language.md",
            "docs/std.md",
            "instruments/std/README.md",
            "docs/diagnostics.md",
            "compiler/lang/src/diag/pages/",
        ],
    ),
    (
        "Instruments",
        &[
            "instruments/README.md",
            "instruments/",
            "instruments/hardware/README.md",
            "instruments/reference/README.md",
            "examples/register/README.md",
            "examples/schelleng/README.md",
        ],
    ),
    (
        "Play, measure, fit",
        &[
            "docs/page.md",
            "docs/studio.md",
            "docs/report.md",
            "docs/traces.md",
            "docs/measure.md",
            "docs/sweep.md",
            "docs/fit.md",
            "docs/import.md",
            "docs/experiments.md",
            "docs/how-to/experiment.md",
            "docs/study.md",
            "docs/python.md",
            "python/README.md",
        ],
    ),
    (
        "Boards and firmware",
        &[
            "docs/build.md",
            "docs/firmware.md",
            "docs/knob.md",
            "docs/bench.md",
            "docs/columns.md",
            "docs/sound-out.md",
            "docs/chips.md",
            "docs/monitor.md",
            "docs/self-test.md",
            "docs/emulator.md",
            "docs/how-to/device.md",
            "examples/firmware/README.md",
            "examples/pico-sdk/README.md",
            "examples/embassy/README.md",
            "examples/smartknob/README.md",
        ],
    ),
    (
        "What is proven and measured",
        &[
            "docs/numbers.md",
            "docs/stability.md",
            "docs/timing.md",
            "docs/budget.md",
            "docs/audit.md",
            "docs/validate.md",
            "docs/proofs.md",
            "docs/bars.md",
            "benches/README.md",
            "benches/peers/README.md",
        ],
    ),
    (
        "How Whippen is made",
        &[
            "ARCHITECTURE.md",
            "docs/modes.md",
            "docs/parts.md",
            "docs/codegen.md",
            "CONTRIBUTING.md",
            "docs/how-to/",
            "docs/release.md",
            "editors/vscode/README.md",
            "editors/tree-sitter-whip/README.md",
            "runtime/src/plot/font/README.md",
            "runtime/src/report/vendor/README.md",
            "runtime/src/studio/vendor/README.md",
            "runtime/src/study/vendor/README.md",
            "SECURITY.md",
            "CHANGELOG.md",
            "docs/log/",
        ],
    ),
];

/// The heading of a document as the text of a link.
fn title(path: &str, text: &str) -> Result<String, String> {
    let first = text.lines().next().unwrap_or_default();
    let heading = first.strip_prefix("# ");
    let heading = heading.ok_or_else(|| format!("{path} does not begin with its heading"))?;
    Ok(heading
        .replace('`', "")
        .replace('*', "\\*")
        .replace('[', "\\[")
        .replace(']', "\\]"))
}

/// The table of contents of these documents, texts by path.
///
/// # Errors
/// A document is in no part, or in two; a part names none that is there.
pub fn summary(documents: &BTreeMap<String, String>) -> Result<String, String> {
    let named: Vec<&str> = PARTS
        .iter()
        .flat_map(|(_, paths)| *paths)
        .copied()
        .collect();
    let mut summary = "# Summary\n".to_string();
    let mut left = documents.clone();
    for (part, paths) in PARTS {
        let _ = write!(summary, "\n# {part}\n\n");
        for name in *paths {
            let chapters: Vec<String> = match name.strip_suffix('/') {
                None => vec![name.to_string()],
                Some(folder) => {
                    let below = |path: &&String| {
                        let own = path.rsplit_once('/').map(|(of, _)| of) == Some(folder);
                        own && !named.contains(&path.as_str())
                    };
                    left.keys().filter(below).cloned().collect()
                }
            };
            if chapters.is_empty() {
                return Err(format!("the part `{part}`: {name} has no document"));
            }
            let indent = if name.ends_with('/') { "    " } else { "" };
            for path in chapters {
                let text = left.remove(&path);
                let text = text.ok_or_else(|| format!("the part `{part}`: no {path} is left"))?;
                let _ = writeln!(summary, "{indent}- [{}]({path})", title(&path, &text)?);
            }
        }
    }
    match left.keys().next() {
        Some(path) => Err(format!("{path} is in no part of the book")),
        None => Ok(summary),
    }
}
