//! What all sessions of a study say: box plots, tests, preferences, as one page without scripts.

use std::fmt::Write as _;

use super::plan::Plan;
use super::session::SessionRow;
use super::statistics::{SHUFFLES, friedman, holm, quartiles, signed_ranks};
use crate::report::escape;

const STYLE: &str = include_str!("results.css");
/// The picture of a question: its height, and where the scale begins and ends.
const HIGH: f64 = 240.0;
const TOP: f64 = 16.0;
const BOTTOM: f64 = 200.0;
/// Room of a box, and of the numbers beside the scale.
const ROOM: f64 = 90.0;
const LEFT: f64 = 44.0;

/// What was asked or counted: its name, its question, and whether it is rated.
struct Question<'p> {
    name: &'p str,
    text: String,
    kind: &'static str,
}

/// The page of sessions, and what its tests say as text.
///
/// # Errors
/// Nobody answered everything, in words.
pub fn results(
    plan: &Plan,
    rows: &[SessionRow],
    command: &str,
) -> Result<(String, String), String> {
    let rated = plan.items.iter().map(|item| Question {
        name: &item.name,
        text: item.text.clone(),
        kind: "answer",
    });
    let marked = plan.tasks.iter().filter(|task| task.target.is_some());
    let counted = marked.map(|task| Question {
        name: &task.name,
        text: format!("Errors in {}", task.name),
        kind: "errors",
    });
    let (mut sections, mut told) = (String::new(), String::new());
    for question in rated.chain(counted) {
        let answers = answers(plan, rows, &question)?;
        let _ = write!(
            sections,
            "<section>\n<h2>{}</h2>\n<p>{}</p>\n{}{}</section>\n",
            escape(question.name),
            escape(&question.text),
            boxes(plan, &question, &answers),
            tests(plan, question.name, &answers, &mut told)
        );
    }
    sections.push_str(&said(plan, rows));
    let synthetic = match rows.iter().any(|row| row.kind == "synthetic") {
        true => "<p><strong>Synthetic: these numbers are invented, nobody answered.</strong></p>\n",
        false => "",
    };
    let html = format!(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
         <meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; style-src 'unsafe-inline'\">\n\
         <title>{0}: results</title>\n<style>\n{STYLE}</style>\n</head>\n<body>\n<main>\n<h1>{0}: results</h1>\n{synthetic}\
         <p>Boxes reach from the lower to the upper quartile, with the median in them; whiskers to the last answer within one and a half times their height.\n\
         Friedman's test asks whether conditions differ at all (p by {SHUFFLES} permutations within persons, fixed seed); \
         Wilcoxon's signed ranks ask which pairs do (exact p, two-sided, corrected by Holm within each question).</p>\n{sections}</main>\n\
         <footer>Made by whippen {1} with <code>{2}</code></footer>\n</body>\n</html>\n",
        escape(&plan.title),
        env!("CARGO_PKG_VERSION"),
        escape(command)
    );
    Ok((html, told))
}

/// Answers to a question: a row for each person who gave all, a column for each condition.
fn answers(plan: &Plan, rows: &[SessionRow], question: &Question) -> Result<Vec<Vec<f64>>, String> {
    let mut people: Vec<u32> = rows.iter().map(|row| row.participant).collect();
    people.sort_unstable();
    people.dedup();
    let of_one = |person: &u32| -> Option<Vec<f64>> {
        let of = |name: &str| {
            let found = rows.iter().find(|row| {
                row.participant == *person
                    && row.condition == name
                    && row.kind == question.kind
                    && row.item == question.name
            });
            found?.answer.parse::<f64>().ok().filter(|x| x.is_finite())
        };
        plan.conditions.iter().map(|one| of(&one.name)).collect()
    };
    let all: Vec<Vec<f64>> = people.iter().filter_map(of_one).collect();
    match all.is_empty() {
        true => Err(format!(
            "nobody answered `{}` in every condition",
            question.name
        )),
        false => Ok(all),
    }
}

fn column(answers: &[Vec<f64>], at: usize) -> Vec<f64> {
    answers.iter().map(|row| row[at]).collect()
}

/// Box plots of a question, side by side.
fn boxes(plan: &Plan, question: &Question, answers: &[Vec<f64>]) -> String {
    let most = answers.iter().flatten().copied().fold(1.0, f64::max);
    let (low, high) = match question.kind {
        "answer" => (1.0, plan.points as f64),
        _ => (0.0, most),
    };
    let y = |value: f64| BOTTOM - (value - low) / (high - low).max(1.0) * (BOTTOM - TOP);
    let wide = LEFT + ROOM * plan.conditions.len() as f64;
    let name = escape(question.name);
    let mut svg = format!(
        "<svg viewBox=\"0 0 {wide} {HIGH}\" role=\"img\" aria-label=\"Box plots of {name}\">\n"
    );
    let steps = ((high - low).max(1.0) / 6.0).ceil();
    for step in 0..=((high - low) / steps) as usize {
        let value = low + step as f64 * steps;
        let _ = writeln!(
            svg,
            "<path class=\"grid\" d=\"M{LEFT} {0:.1}H{wide}\"/><text x=\"{1}\" y=\"{2:.1}\" text-anchor=\"end\">{value}</text>",
            y(value),
            LEFT - 6.0,
            y(value) + 4.0
        );
    }
    for (at, condition) in plan.conditions.iter().enumerate() {
        let values = column(answers, at);
        let [least, lower, median, upper, greatest] = quartiles(&values);
        let reach = 1.5 * (upper - lower);
        let inside = |value: &&f64| (lower - reach..=upper + reach).contains(*value);
        let low_end = values.iter().filter(inside).copied().fold(lower, f64::min);
        let high_end = values.iter().filter(inside).copied().fold(upper, f64::max);
        let middle = LEFT + ROOM * (at as f64 + 0.5);
        let [left, right] = [middle - 24.0, middle + 24.0];
        let _ = writeln!(
            svg,
            "<g><title>{6}: {least} {lower} {median} {upper} {greatest}</title>\
             <path class=\"whisker\" d=\"M{middle} {0:.1}V{1:.1}M{middle} {2:.1}V{3:.1}\"/>\
             <rect class=\"box\" x=\"{left}\" y=\"{2:.1}\" width=\"48\" height=\"{4:.1}\"/>\
             <path class=\"median\" d=\"M{left} {5:.1}H{right}\"/>\
             <text x=\"{middle}\" y=\"220\" text-anchor=\"middle\">{6}</text></g>",
            y(low_end),
            y(lower),
            y(upper),
            y(high_end),
            y(lower) - y(upper),
            y(median),
            escape(&condition.name)
        );
        for value in values.iter().filter(|value| !inside(value)) {
            let _ = writeln!(
                svg,
                "<circle class=\"outlier\" cx=\"{middle}\" cy=\"{:.1}\" r=\"3\"/>",
                y(*value)
            );
        }
    }
    svg.push_str("</svg>\n");
    svg
}

/// A p as tables write it.
fn shown(p: f64) -> String {
    match p < 0.001 {
        true => "p < 0.001".to_string(),
        false => format!("p = {p:.3}"),
    }
}

/// What the tests of a question say, as a table and as lines of text.
fn tests(plan: &Plan, name: &str, answers: &[Vec<f64>], told: &mut String) -> String {
    let people = answers.len();
    let Some(all) = friedman(answers, SHUFFLES) else {
        let _ = writeln!(
            told,
            "{name}: {people} person; two are the fewest to compare"
        );
        return "<p>One person: nothing to compare.</p>\n".to_string();
    };
    let head = format!("Friedman {:.2}, {}", all.statistic, shown(all.p));
    let _ = writeln!(told, "{name}: {people} people, {head}");
    let mut pairs = Vec::new();
    for one in 0..plan.conditions.len() {
        for other in one + 1..plan.conditions.len() {
            let found = signed_ranks(&column(answers, one), &column(answers, other));
            pairs.push((one, other, found));
        }
    }
    let raw: Vec<f64> = pairs
        .iter()
        .map(|(.., of)| of.map_or(1.0, |of| of.p))
        .collect();
    let mut table = format!(
        "<p>{people} people; {head}.</p>\n<table>\n<thead><tr><th scope=\"col\">pair</th>\
         <th scope=\"col\">differ</th><th scope=\"col\">signed ranks</th><th scope=\"col\">corrected</th></tr></thead>\n<tbody>\n"
    );
    for ((one, other, found), p) in pairs.iter().zip(holm(&raw)) {
        let [a, b] = [*one, *other].map(|at| escape(&plan.conditions[at].name));
        let (differ, statistic) = found.map_or((0, 0.0), |of| (of.differing, of.statistic));
        let _ = writeln!(
            table,
            "<tr><th scope=\"row\">{a} and {b}</th><td>{differ}</td><td>{statistic}</td><td>{}</td></tr>",
            shown(p)
        );
        let _ = writeln!(told, "  {a} and {b}: {}", shown(p));
    }
    table.push_str("</tbody>\n</table>\n");
    table
}

/// Preferences and free words.
fn said(plan: &Plan, rows: &[SessionRow]) -> String {
    let mut html = String::new();
    let of = |kind: &'static str| rows.iter().filter(move |row| row.kind == kind);
    if let Some(question) = &plan.preferred {
        let _ = write!(
            html,
            "<section>\n<h2>Preferred</h2>\n<p>{}</p>\n<ul>\n",
            escape(question)
        );
        for condition in &plan.conditions {
            let count = of("preferred").filter(|row| row.answer == condition.name);
            let _ = writeln!(
                html,
                "<li>{}: {}</li>",
                escape(&condition.name),
                count.count()
            );
        }
        html.push_str("</ul>\n</section>\n");
    }
    let words: Vec<&SessionRow> = of("comment").filter(|row| !row.answer.is_empty()).collect();
    if !words.is_empty() {
        html.push_str("<section>\n<h2>In their words</h2>\n<ul>\n");
        for row in words {
            let _ = writeln!(
                html,
                "<li>{}: {}</li>",
                row.participant,
                escape(&row.answer)
            );
        }
        html.push_str("</ul>\n</section>\n");
    }
    html
}
