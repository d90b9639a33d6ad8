//! A deadline that is missed, as a diagnostic at the lines that cost most.

use whippen_arm::image::Place;
use whippen_budget::{Bound, Budget, Program};
use whippen_lang::diag::{Code, Diagnostic};
use whippen_source::{SourceMap, Span};

/// Lines that are pointed at.
const LINES: usize = 3;

/// The worst-case mode of a key.
#[derive(Debug, Clone, Copy)]
pub struct WorstMode<'a> {
    /// The mode, in words.
    pub mode: &'a str,
    /// Its bound, with nobody else at the bus.
    pub bound: &'a Bound,
}

/// What is to be said when a budget does not fit: nothing if it does. `instrument` is its name,
/// where it is declared, and whether it is no instrument of a key; so many keys are proven to fit,
/// where that was found out.
pub fn deadline_diagnostic(
    map: &SourceMap,
    instrument: (&str, Span, bool),
    budget: &Budget,
    program: &Program,
    worst: WorstMode,
    keys_fitting: Option<u32>,
) -> Option<Diagnostic> {
    let core = budget.fullest().filter(|_| !budget.fits())?;
    let (key, period, late) = (
        worst.bound.cycles_max,
        budget.period_cycles,
        -core.slack_cycles,
    );
    let (name, declared, is_once) = instrument;
    let takes = match (is_once, core.keys) {
        (true, _) => "it takes".to_string(),
        (false, 1) => "1 key of a core takes".to_string(),
        (false, keys) => format!("{keys} keys of a core take"),
    };
    let message = format!(
        "`{}` misses its deadline by {late} cycles: {takes} up to {} cycles, and a tick has {period}",
        name, core.cycles_max
    );
    let mut lines: Vec<(Span, u64, &str)> = program
        .by_place(&worst.bound.path)
        .into_iter()
        .filter_map(|(place, cycles)| Some((line(map, place?)?, cycles, place?.item.as_str())))
        .collect();
    lines.sort_by_key(|(_, cycles, _)| std::cmp::Reverse(*cycles));
    let of_key = if is_once { "" } else { " of a key" };
    let label = |cycles: u64, item: &str| format!("{cycles} of the {key} cycles{of_key}: {item}");
    let mut lines = lines.into_iter();
    let diagnostic = match lines.next() {
        Some((span, cycles, item)) => {
            Diagnostic::new(Code::DeadlineMissed, span, message, label(cycles, item))
        }
        None => Diagnostic::new(
            Code::DeadlineMissed,
            declared,
            message,
            format!("{key} cycles{of_key}"),
        ),
    };
    let pointed = lines
        .take(LINES - 1)
        .fold(diagnostic, |diagnostic, (span, cycles, item)| {
            diagnostic.also(span, label(cycles, item))
        });
    Some(
        hints(budget, program, worst, keys_fitting, is_once)
            .into_iter()
            .fold(pointed, Diagnostic::hint),
    )
}

/// What would make it fit.
fn hints(
    budget: &Budget,
    program: &Program,
    worst: WorstMode,
    keys_fitting: Option<u32>,
    is_once: bool,
) -> Vec<String> {
    let keys: u32 = budget.cores.iter().map(|core| core.keys).sum();
    let all = match (is_once, keys) {
        (true, _) => "it fits".to_string(),
        (false, 1) => "1 key fits".to_string(),
        (false, keys) => format!("{keys} keys fit"),
    };
    let mhz = budget.clock_hz_min().div_ceil(1_000_000);
    let fitting = keys_fitting.map_or_else(String::new, |fitting| match fitting {
        _ if is_once => String::new(),
        0 => "not even one key a core fits; ".to_string(),
        fitting => format!("{fitting} keys fit as it is (--most-keys); "),
    });
    let (key, contended) = (budget.key_cycles_max, budget.contended_key_cycles_max);
    let waiting = match contended.saturating_sub(key) {
        0 => String::new(),
        waiting => format!(
            ", of which {waiting} are charged for memory that others may use at the same time"
        ),
    };
    let items: Vec<String> = program
        .by_item(&worst.bound.path)
        .into_iter()
        .take(LINES)
        .map(|(item, cycles)| format!("`{item}` {cycles}"))
        .collect();
    vec![
        format!(
            "{fitting}{all} at a rate of {} Hz, or with a clock of {mhz} MHz",
            budget.rate_hz_max()
        ),
        match budget.key_cycles_allowed() {
            0 if is_once => format!(
                "what is around it leaves no cycle for it; it takes up to {contended}{waiting}"
            ),
            allowed if is_once => {
                format!("it fits if it takes at most {allowed} cycles; it is {contended}{waiting}")
            }
            0 => format!(
                "what is around {keys} keys leaves no cycle for them; one takes up to {contended}{waiting}"
            ),
            allowed => {
                format!("{all} if each takes at most {allowed} cycles; it is {contended}{waiting}")
            }
        },
        format!(
            "the worst-case mode takes {} ({}): {}",
            worst.bound.cycles_max,
            worst.mode,
            items.join(", ")
        ),
    ]
}

/// The text of a place's line.
fn line(map: &SourceMap, place: &Place) -> Option<Span> {
    let file = map
        .files()
        .iter()
        .position(|file| file.name == place.file)?;
    let text = &map.files()[file].text;
    let starts = std::iter::once(0).chain(text.match_indices('\n').map(|(at, _)| at + 1));
    let start = starts.take(place.line as usize).last()?;
    let line = text[start..].lines().next()?;
    let (code, lead) = (
        line.split("//").next()?.trim(),
        line.len() - line.trim_start().len(),
    );
    let start = (start + lead) as u32;
    Some(Span {
        file: file as u32,
        start,
        end: start + code.len() as u32,
    })
}
