//! The page of a budget: cores as bars, what modes cost, the map of stability, the current over
//! time.
//!
//! It is drawn from what `whippen budget --json` prints, so page and JSON cannot differ. Charts are
//! still pictures (SVG) in the colours of the style; there is nothing to zoom.

use std::fmt::Write;

use serde_json::Value;

use super::html::{Cell, Row, Table, escape};

const STYLE: &str = include_str!("page.css");
/// What only this page has.
const OWN_STYLE: &str = "svg { display: block; max-width: 100%; height: auto; margin: 0.6rem 0; } svg text { fill: var(--text); font-size: 12px; } \
    svg .soft { fill: var(--soft); } svg .back { fill: var(--raised); } svg .bar { fill: var(--line3); } svg .frame { fill: var(--line4); } \
    svg .grid { stroke: var(--grid); } svg .limit { stroke: var(--missed); stroke-dasharray: 5 4; } svg path { fill: none; stroke-width: 1.8; } \
    svg .a { stroke: var(--line0); } svg .b { stroke: var(--line2); } svg .a-text { fill: var(--line0); } svg .b-text { fill: var(--line2); } \
    svg circle { fill: var(--line1); }\n";
const THEME: &str = "document.documentElement.dataset.theme = matchMedia('(prefers-color-scheme: dark)').matches ? 'dark' : 'light';";
const POLICY: &str = "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'";

/// So many modes have a bar.
const MODES_SHOWN: usize = 16;
/// So many characters of a row stand in its width.
const ROW_CHARS: usize = 130;
/// Width of all charts.
const WIDTH: f64 = 900.0;
/// Where bars and fields begin.
const LEFT: f64 = 60.0;

/// The page of some budgets as one HTML document; `command` is what made it.
pub fn budget_page(budgets: &[Value], command: &str) -> String {
    let name = |b: &Value| text(&b["instrument"]).replace('_', " ");
    let title = budgets.iter().map(name).collect::<Vec<_>>().join(", ");
    let mut out = format!(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
         <meta http-equiv=\"Content-Security-Policy\" content=\"{POLICY}\">\n\
         <meta name=\"color-scheme\" content=\"light dark\">\n<title>budget of {}</title>\n\
         <style>\n{STYLE}{OWN_STYLE}</style>\n<script>{THEME}</script>\n</head>\n<body>\n<main>\n",
        escape(&title)
    );
    for budget in budgets {
        let _ = writeln!(
            out,
            "<section>\n<h1>The budget of {}</h1>",
            escape(&name(budget))
        );
        time(&mut out, budget);
        let stability = &budget["stability"];
        match stability
            .as_object()
            .filter(|_| stability["verdict"].is_null())
        {
            // Of an instrument with several ports.
            Some(ports) => ports.iter().for_each(|(port, found)| {
                of_loop(&mut out, &format!("Stability of {port}"), found)
            }),
            None => of_loop(&mut out, "Stability", stability),
        }
        motor(&mut out, &budget["motor"]);
        numbers(&mut out, &budget["numbers"]);
        out.push_str("</section>\n");
    }
    let version = env!("CARGO_PKG_VERSION");
    let _ = write!(
        out,
        "</main>\n<footer><p>Made by whippen {version} with <code>{}</code></p></footer>\n",
        escape(command)
    );
    out + "</body>\n</html>\n"
}

fn text(value: &Value) -> String {
    value.as_str().unwrap_or_default().to_string()
}

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or(0.0)
}

fn list(value: &Value) -> &[Value] {
    value.as_array().map_or(&[], Vec::as_slice)
}

/// Three digits.
fn short(value: f64) -> String {
    let rounded: f64 = format!("{value:.2e}").parse().unwrap_or(value);
    if rounded != 0.0 && !(1e-3..1e6).contains(&rounded.abs()) {
        format!("{rounded:e}")
    } else {
        format!("{rounded}")
    }
}

fn verdict(out: &mut String, name: &str, good: bool, words: &str) {
    let class = if good { "doc" } else { "warn" };
    let _ = writeln!(
        out,
        "<h2>{name}</h2>\n<p class=\"{class}\">{}</p>",
        escape(words)
    );
}

/// A bar for each core and for each of the worst-case modes.
fn time(out: &mut String, budget: &Value) {
    let fits = budget["fits"].as_bool().unwrap_or(false);
    let period = number(&budget["period_cycles"]).max(1.0);
    let words = if fits {
        "Every key's tick is in time."
    } else {
        "The deadline is missed."
    };
    verdict(
        out,
        "Time",
        fits,
        &format!("{words} A tick has {period} cycles."),
    );
    let bars = core_bars(budget);
    let most = bars.iter().map(|bar| bar.0).fold(period, f64::max);
    bar_chart(out, "cycles of a tick, by core", &bars, most, Some(period));
    let mut modes = mode_bars(budget);
    let left = modes.len().saturating_sub(MODES_SHOWN);
    modes.truncate(MODES_SHOWN);
    let most = modes.first().map_or(1.0, |mode| mode.0);
    let more = if left > 0 {
        format!(" ({left} cheaper ones left out)")
    } else {
        String::new()
    };
    let title = format!("cycles of a key, by mode{more}");
    bar_chart(out, &title, &modes, most, None);
}

/// Cycles of each core, with words.
fn core_bars(budget: &Value) -> Vec<(f64, String)> {
    let bar = |(n, core): (usize, &Value)| {
        let cycles = number(&core["cycles_max"]);
        let percent = 100.0 * number(&core["utilization"]);
        let slack = number(&core["slack_cycles"]);
        let left = if slack < 0.0 {
            format!("{} too many", -slack)
        } else {
            format!("{slack} left")
        };
        let keys = &core["keys"];
        let words = format!("core {n}: {keys} keys, {cycles} cycles, {percent:.1} %, {left}");
        (cycles, words)
    };
    list(&budget["cores"]).iter().enumerate().map(bar).collect()
}

/// Cycles of each mode, with words; the worst first.
fn mode_bars(budget: &Value) -> Vec<(f64, String)> {
    let bar = |mode: &Value| {
        let cycles = number(&mode["cycles_max"]);
        (cycles, format!("{cycles} cycles: {}", text(&mode["name"])))
    };
    let mut modes: Vec<(f64, String)> = list(&budget["key"]["modes"]).iter().map(bar).collect();
    modes.sort_by(|a, b| b.0.total_cmp(&a.0));
    modes
}

fn bar_chart(out: &mut String, title: &str, bars: &[(f64, String)], most: f64, limit: Option<f64>) {
    let (row, width) = (34.0, WIDTH - 20.0);
    let height = row * bars.len() as f64 + 8.0;
    let _ = writeln!(
        out,
        "<h3>{}</h3>\n<svg viewBox=\"0 0 {WIDTH} {height}\" role=\"img\">",
        escape(title)
    );
    for (at, (value, words)) in bars.iter().enumerate() {
        let top = row * at as f64;
        let long = width * (value / most.max(1e-9)).clamp(0.0, 1.0);
        // What is too long for its row is drawn narrower, not cut.
        let narrow = words.chars().count() > ROW_CHARS;
        let fitted = if narrow {
            format!(" textLength=\"{width}\" lengthAdjust=\"spacingAndGlyphs\"")
        } else {
            String::new()
        };
        let _ = writeln!(
            out,
            "<text x=\"2\" y=\"{}\"{fitted}>{}</text><rect class=\"back\" x=\"2\" y=\"{}\" width=\"{width}\" height=\"12\"/>\
             <rect class=\"bar\" x=\"2\" y=\"{}\" width=\"{long:.1}\" height=\"12\"/>",
            top + 13.0,
            escape(words),
            top + 18.0,
            top + 18.0
        );
    }
    if let Some(limit) = limit {
        let at = 2.0 + width * (limit / most.max(1e-9)).min(1.0);
        let _ = writeln!(
            out,
            "<line class=\"limit\" x1=\"{at:.1}\" x2=\"{at:.1}\" y1=\"0\" y2=\"{height}\"/>"
        );
    }
    out.push_str("</svg>\n");
}

fn of_loop(out: &mut String, title: &str, found: &Value) {
    if found.is_null() {
        let why = "Not judged: the device does not say how it moves, \
                   or a force depends on a friction or a string.";
        return verdict(out, title, true, why);
    }
    let word = text(&found["verdict"]);
    let words = format!(
        "{word}: the forces may be {} times what they are before the loop rings in the worst of {} hands. \
         Passivity needs {} of the key's own damping, and it has {}.",
        short(1.0 + number(&found["margin_percent"]) / 100.0),
        number(&found["hands"]) + 1.0,
        short(number(&found["damping_needed"])),
        short(number(&found["key"]["damping"]))
    );
    verdict(out, title, word != "rings", &words);
    if !found["map"].is_null() {
        stability_map(out, found);
    }
    out.push_str(&stability_table(found).html());
}

/// Borders over damping and stiffness, with the modes as dots.
fn stability_map(out: &mut String, found: &Value) {
    let map = &found["map"];
    let field = Field {
        title: "stiffness over damping: borders of a spring with a damper on this device, and the modes",
        ends: [
            round_up(number(&map["damping_end"])),
            round_up(number(&map["stiffness_end"])),
        ],
        names: [text(&map["damping_unit"]), text(&map["stiffness_unit"])],
    };
    let modes: Vec<(f64, f64)> = list(&found["modes"])
        .iter()
        .map(|m| (number(&m["damping"]), number(&m["stiffness"])))
        .collect();
    let lines = [
        ("nobody holds the key", points(&map["nobody"])),
        ("passive below", points(&map["passive"])),
    ];
    field.draw(out, &lines, &modes, None);
}

/// The fields of a mode and the heads of their columns.
const MODE_COLUMNS: [(&str, &str); 6] = [
    ("stiffness", "stiffness"),
    ("damping", "damping"),
    ("mass", "mass"),
    ("factor", "times until it rings"),
    ("ring_hz", "Hz"),
    ("damping_needed", "damping to be passive"),
];

fn stability_table(found: &Value) -> Table {
    let cell = |v: &Value| Cell::number(number(v), short(number(v)));
    let row = |m: &Value| {
        let numbers = MODE_COLUMNS.iter().map(|(field, _)| cell(&m[*field]));
        Row {
            cells: std::iter::once(Cell::text(text(&m["name"])))
                .chain(numbers)
                .collect(),
            ..Row::default()
        }
    };
    let heads = MODE_COLUMNS.iter().map(|(_, head)| head.to_string());
    Table {
        title: "modes".into(),
        note: "the least margin first".into(),
        heads: std::iter::once("where".to_string()).chain(heads).collect(),
        rows: list(&found["modes"]).iter().map(row).collect(),
    }
}

/// The next number whose quarters are round.
fn round_up(value: f64) -> f64 {
    let power = libm::exp10(libm::floor(libm::log10(value.max(1e-12))));
    [1.0, 1.2, 1.6, 2.0, 3.0, 4.0, 6.0, 8.0, 10.0]
        .map(|m| m * power)
        .into_iter()
        .find(|end| *end >= value)
        .unwrap_or(value)
}

fn points(value: &Value) -> Vec<Point> {
    list(value)
        .iter()
        .map(|p| (number(&p[0]), number(&p[1])))
        .collect()
}

/// A field with axes from 0.
struct Field {
    title: &'static str,
    ends: [f64; 2],
    names: [String; 2],
}

/// A point of a field.
type Point = (f64, f64);

impl Field {
    const HEIGHT: f64 = 300.0;
    const BOTTOM: f64 = 260.0;
    const RIGHT: f64 = WIDTH - 20.0;

    fn draw(
        &self,
        out: &mut String,
        lines: &[(&str, Vec<Point>)],
        dots: &[Point],
        limit: Option<f64>,
    ) {
        let _ = writeln!(
            out,
            "<h3>{}</h3>\n<svg viewBox=\"0 0 {WIDTH} {}\" role=\"img\">",
            escape(self.title),
            Self::HEIGHT
        );
        self.draw_axes(out);
        for (at, (name, points)) in lines.iter().enumerate() {
            self.draw_line(out, at, name, points);
        }
        if let Some(limit) = limit {
            let _ = writeln!(
                out,
                "<line class=\"limit\" x1=\"{LEFT}\" x2=\"{}\" y1=\"{1:.1}\" y2=\"{1:.1}\"/>",
                Self::RIGHT,
                self.y(limit)
            );
        }
        for p in dots.iter().filter(|p| self.has(p)) {
            let _ = writeln!(
                out,
                "<circle cx=\"{:.1}\" cy=\"{:.1}\" r=\"4\"/>",
                self.x(p.0),
                self.y(p.1)
            );
        }
        out.push_str("</svg>\n");
    }

    fn x(&self, value: f64) -> f64 {
        LEFT + (Self::RIGHT - LEFT) * value / self.ends[0].max(1e-12)
    }

    fn y(&self, value: f64) -> f64 {
        Self::BOTTOM - (Self::BOTTOM - 24.0) * value / self.ends[1].max(1e-12)
    }

    fn has(&self, p: &Point) -> bool {
        p.0 <= self.ends[0] && (0.0..=self.ends[1]).contains(&p.1)
    }

    /// The grid with its numbers, and the names of the axes.
    fn draw_axes(&self, out: &mut String) {
        for part in 0..=4 {
            let [vx, vy] = self.ends.map(|end| end * f64::from(part) / 4.0);
            let (x, y) = (self.x(vx), self.y(vy));
            let _ = writeln!(
                out,
                "<line class=\"grid\" x1=\"{LEFT}\" x2=\"{right}\" y1=\"{y:.1}\" y2=\"{y:.1}\"/>\
                 <text class=\"soft\" x=\"{}\" y=\"{:.1}\" text-anchor=\"end\">{}</text>\
                 <text class=\"soft\" x=\"{x:.1}\" y=\"{}\" text-anchor=\"middle\">{}</text>",
                LEFT - 6.0,
                y + 4.0,
                short(vy),
                Self::BOTTOM + 16.0,
                short(vx),
                right = Self::RIGHT,
            );
        }
        let _ = writeln!(
            out,
            "<text x=\"4\" y=\"12\">{}</text><text x=\"{}\" y=\"{}\" text-anchor=\"end\">{}</text>",
            escape(&self.names[1]),
            Self::RIGHT,
            Self::HEIGHT - 4.0,
            escape(&self.names[0])
        );
    }

    /// A line, and its name above the field.
    fn draw_line(&self, out: &mut String, at: usize, name: &str, points: &[Point]) {
        let class = ["a", "b"][at % 2];
        let mut path = String::new();
        for (number, p) in points.iter().filter(|p| self.has(p)).enumerate() {
            let step = if number == 0 { 'M' } else { 'L' };
            let _ = write!(path, "{step}{:.1} {:.1}", self.x(p.0), self.y(p.1));
        }
        let _ = writeln!(
            out,
            "<path class=\"{class}\" d=\"{path}\"/><text class=\"{class}-text\" x=\"{}\" y=\"12\">{}</text>",
            LEFT + 140.0 + 190.0 * at as f64,
            escape(name)
        );
    }
}

fn motor(out: &mut String, found: &Value) {
    if found.is_null() {
        return verdict(
            out,
            "Motor",
            true,
            "Not judged: the device says nothing of its motor.",
        );
    }
    let good = found["within_rating"].as_bool().unwrap_or(false);
    let words = format!(
        "{} Peak {} A, rms {} A in {}; held still between {} and {}, and the motor gives {} for ever.",
        if good {
            "Within its rating."
        } else {
            "More than rated."
        },
        short(number(&found["peak_a"])),
        short(number(&found["rms_a"])),
        text(&found["motion"]),
        short(number(&found["static"][0])),
        short(number(&found["static"][1])),
        short(number(&found["rated_force"]))
    );
    verdict(out, "Motor", good, &words);
    let slices = list(&found["slices"]);
    let (rated, peak) = (number(&found["rated_a"]), number(&found["peak_a"]));
    let current: Vec<(f64, f64)> = slices
        .iter()
        .map(|s| (number(&s[0]), number(&s[1])))
        .collect();
    let field = Field {
        title: "current over time, the largest of each slice; dashed: rated",
        ends: [number(&found["seconds"]), round_up(rated.max(peak))],
        names: ["time (s)".into(), "current (A)".into()],
    };
    field.draw(out, &[("current", current)], &[], Some(rated));
}

fn numbers(out: &mut String, found: &Value) {
    if found.is_null() {
        return;
    }
    let force = &found["force"];
    let words = format!(
        "No overflow, proven for all {} values that are observed. One tick adds at most {} {} of error to the force.",
        number(&found["values"]),
        short(number(&force["error_of_one_tick"])),
        text(&force["unit"])
    );
    verdict(out, "Numbers", true, &words);
}
