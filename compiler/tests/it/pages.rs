//! The page of every diagnostic: its wrong program has the mistake and its right program has none.

use std::fmt::Write;
use std::path::Path;

use whippen_compiler::check::Options;
use whippen_compiler::diag::explain::GROUPS;
use whippen_compiler::diag::{Code, Diagnostic, Severity};
use whippen_compiler::front::compile_front;
use whippen_compiler::pipeline::{CompileError, compile};
use whippen_compiler::scales::Scales;
use whippen_compiler::source::SourceMap;
use whippen_compiler::stability::{static_force, too_strong};

/// Programs that have these mistakes do not fit on a page; `check` tests them.
const TOO_LONG: &[Code] = &[Code::TooManyCalls, Code::TooManySteps];

/// Mistakes that only an image has, which needs a board, or that only a simulated key shows:
/// `tests/it/budget.rs` and `tests/it/rings.rs` run these pages.
const OF_RUNS: &[Code] = &[Code::DeadlineMissed, Code::Unstable, Code::NotProvenStable];

const SCALES: Scales = Scales {
    sensor_zero: -0.5e-3,
    sensor_lsb: 11e-3 / 65535.0,
    drive_lsb: 20.0 / 32768.0,
    update_hz: None,
};

/// The force that the motor of `mikey` gives for ever.
const RATED_N: f64 = 8.0;

/// `// whippen check key.whip --set k=90N/m` in the first line.
fn sets(text: &str) -> Vec<(String, String)> {
    let first = text.lines().next().unwrap_or_default();
    let set = first
        .split("--set ")
        .nth(1)
        .and_then(|set| set.split_once('='));
    set.into_iter()
        .map(|(name, value)| (name.to_string(), value.to_string()))
        .collect()
}

/// Everything the compiler says of a program; of a code of `whippen budget` also what that says of
/// its loop.
fn diagnostics(code: Code, text: &str) -> Vec<Diagnostic> {
    let of_budget = code == Code::TooStrong;
    let mut map = SourceMap::default();
    map.add("page.whip", text);
    let (program, mut found) = compile_front(
        &mut map,
        &Options {
            sets: sets(text),
            ..Options::default()
        },
    );
    // That of a device which measures less often than there are ticks.
    let scales = Scales {
        update_hz: (code == Code::ShortWindow).then_some(1000.0),
        ..SCALES
    };
    for model in program.into_iter().flat_map(|p| p.instruments) {
        match compile(model, scales, true) {
            Ok(compiled) => {
                let model = &compiled.model;
                let statics = static_force(model).filter(|_| of_budget);
                found.extend(compiled.warnings.clone());
                found.extend(statics.and_then(|s| too_strong(model, &s, RATED_N)));
            }
            Err(CompileError::Program(errors)) => found.extend(errors),
            Err(CompileError::Defect(why)) => panic!("{why}\n{text}"),
        }
    }
    found
}

#[test]
fn every_page_shows_its_mistake_and_mends_it() {
    let mut failures = String::new();
    for &code in Code::ALL {
        let page = code.page();
        assert!(
            page.starts_with(&format!("# {}: {}\n", code.number(), code.title())),
            "{page}"
        );
        let examples = code.examples();
        let wrong = examples.iter().filter(|(wrong, _)| *wrong).count();
        assert_eq!(
            wrong,
            usize::from(!TOO_LONG.contains(&code)),
            "{}",
            code.number()
        );
        assert_eq!(examples.len(), wrong + 1, "{}", code.number());
        for (wrong, text) in examples {
            let found: Vec<&str> = diagnostics(code, text)
                .iter()
                .map(|d| d.code.number())
                .collect();
            let good = if wrong && OF_RUNS.contains(&code) {
                found.is_empty()
            } else if wrong {
                found.first() == Some(&code.number())
            } else {
                found.is_empty()
            };
            if !good {
                let _ = writeln!(failures, "{} {wrong}: {found:?}", code.number());
            }
        }
    }
    assert!(failures.is_empty(), "{failures}");
}

#[test]
fn codes_are_found_by_what_people_type() {
    for text in [
        "WH0203",
        "wh0203",
        "203",
        "0203",
        "unknown-term",
        " Unknown-Term ",
    ] {
        assert_eq!(Code::find(text), Ok(Code::UnknownTerm), "{text}");
    }
    assert_eq!(Code::find("unknwon-term"), Err(Some(Code::UnknownTerm)));
    assert_eq!(Code::find("lunch"), Err(None));
    assert!(
        Code::ALL
            .iter()
            .all(|code| Code::find(&code.name()) == Ok(*code))
    );
}

/// The list in the documents follows from the table; `WHIPPEN_BLESS=1` rewrites it.
#[test]
fn the_documents_list_every_code() {
    let mut text = String::from(
        "# Diagnostics\n\nEvery message of the compiler has a code, and every code has a page with the mistake and its \
         mend: `whippen explain WH0203`.\n\
         This list follows from `compiler/lang/src/diag/codes.rs`.\n",
    );
    for (group, name) in GROUPS {
        let _ = write!(
            text,
            "\n## {name}\n\n| code | | what |\n| --- | --- | --- |\n"
        );
        for code in Code::ALL
            .iter()
            .filter(|c| c.number()[2..].starts_with(group))
        {
            let severity = match code.severity() {
                Severity::Error => "error",
                Severity::Warning => "warning",
                Severity::Note => "note",
            };
            let (number, title) = (code.number(), code.title());
            let _ = writeln!(
                text,
                "| [{number}](../compiler/lang/src/diag/pages/{number}.md) | {severity} | {title} |"
            );
        }
    }
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/diagnostics.md");
    if std::env::var_os("WHIPPEN_BLESS").is_some() {
        std::fs::write(&path, &text).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    }
    assert_eq!(
        std::fs::read_to_string(&path).unwrap_or_default(),
        text,
        "bless with WHIPPEN_BLESS=1"
    );
}
