//! `run --report`: the page is sound HTML, its data is the trace's, and a browser shows it without
//! complaint.

pub mod browser;

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use serde_json::Value;
use whippen_compiler::pipeline::Compiled;
use whippen_runtime::device::Device;
use whippen_runtime::engine::EngineKind;
use whippen_runtime::report::{Made, Page, Section};
use whippen_runtime::session::{self, Run};

use crate::common::{all, of_keys, played};

/// A run of the first `seconds` of the bundled gesture and its page.
fn page(compiled: &Compiled, seconds: f64) -> (Run, Page) {
    let (device, run) = (Device::of(&compiled.model), played(compiled, seconds));
    let sources = [(
        "a <b>.whip".to_string(),
        "// </script><script>alert(1)</script>\n".to_string(),
    )];
    let made = Made {
        engine: EngineKind::Jit,
        motion: &[],
        device: &device,
        settings: &[],
        sources: &sources,
    };
    let section = Section::of_run(compiled, &run, &made);
    let page = Page {
        title: "t & u".into(),
        command: "whippen run".into(),
        overview: None,
        sections: vec![section],
    };
    (run, page)
}

/// Names of elements that have no end.
const VOID: &[&str] = &["meta", "input", "br", "link", "img"];

/// Whether all tags are closed in order; scripts and styles are skipped to their ends, as a browser
/// does.
pub fn check_tags(html: &str) {
    let mut open: Vec<&str> = Vec::new();
    let mut rest = html
        .strip_prefix("<!DOCTYPE html>")
        .expect("a document type");
    while let Some(at) = rest.find('<') {
        let tag = &rest[at + 1..];
        let end = tag
            .find('>')
            .unwrap_or_else(|| panic!("`<` in a text: {}", &tag[..40]));
        let inside = &tag[..end];
        rest = &tag[end + 1..];
        match inside.strip_prefix('/') {
            Some(name) => assert_eq!(
                open.pop(),
                Some(name),
                "before {}",
                &rest[..rest.len().min(60)]
            ),
            None => {
                let name = inside.split_ascii_whitespace().next().unwrap_or_default();
                assert!(name.chars().all(|c| c.is_ascii_alphanumeric()), "`<{name}`");
                assert_eq!(inside.matches('"').count() % 2, 0, "quotes of <{inside}>");
                if name == "script" || name == "style" {
                    let close = format!("</{name}>");
                    rest = &rest
                        [rest.find(&close).unwrap_or_else(|| panic!("{close}")) + close.len()..];
                } else if !VOID.contains(&name) {
                    open.push(name);
                }
            }
        }
    }
    assert_eq!(open, [""; 0]);
}

#[test]
fn the_page_is_sound_and_needs_nothing_else() {
    for compiled in all() {
        let (_, page) = page(&compiled, 1.0);
        let html = page.html();
        check_tags(&html);
        assert!(
            html.contains("a &lt;b&gt;.whip") && !html.contains("<script>alert"),
            "texts stay texts"
        );
        let ours = html.replace("https://github.com/leeoniya/uPlot", "");
        for outside in [
            "http:",
            "https:",
            "src=",
            "@import",
            "url(",
            "fetch(",
            "XMLHttpRequest",
            "import(",
        ] {
            assert!(
                !ours.contains(outside),
                "`{outside}` in the page of {}",
                compiled.model.name
            );
        }
        assert_eq!(html, page.html(), "the same bytes again");
    }
}

/// Rising numbers from their differences in LEB128.
fn rising(packed: &Value) -> Vec<usize> {
    let (mut numbers, mut sum, mut part, mut shift) = (Vec::new(), 0, 0, 0);
    for byte in STANDARD
        .decode(packed.as_str().expect("a text"))
        .expect("base64")
    {
        part |= usize::from(byte & 0x7f) << shift;
        shift += 7;
        if byte < 0x80 {
            sum += part;
            numbers.push(sum);
            (part, shift) = (0, 0);
        }
    }
    numbers
}

fn floats(packed: &Value) -> Vec<f32> {
    let bytes = STANDARD
        .decode(packed.as_str().expect("a text"))
        .expect("base64");
    bytes
        .chunks_exact(4)
        .map(|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]]))
        .collect()
}

#[test]
fn its_data_is_the_trace_within_what_it_says() {
    let mut ticks_compared = 0;
    // Of what swings as fast as it sounds a page keeps the extents.
    for compiled in of_keys() {
        let (run, page) = page(&compiled, 2.6);
        let html = page.html();
        let tag = format!(
            "<script type=\"application/json\" id=\"chart-{}\">",
            page.sections[0].id
        );
        let json = html
            .split(&tag)
            .nth(1)
            .and_then(|rest| rest.split("</script>").next())
            .expect("a chart");
        let chart: Value = serde_json::from_str(json).expect("JSON");
        for column in chart["columns"].as_array().expect("columns") {
            let name = column["name"].as_str().expect("a name");
            let values = &run
                .trace
                .columns
                .iter()
                .find(|c| c.heading.name == name && c.heading.labels.is_empty())
                .expect(name)
                .values();
            let (ticks, kept) = (rising(&column["t"]), floats(&column["v"]));
            let within = column["within"].as_f64().expect("smooth enough");
            assert_eq!((ticks[0], ticks[ticks.len() - 1]), (0, values.len() - 1));
            assert!(
                ticks
                    .iter()
                    .zip(&kept)
                    .all(|(&tick, &v)| v == values[tick] as f32),
                "{name}: knots are the trace's"
            );
            for (at, pair) in ticks.windows(2).enumerate() {
                let (a, b) = (f64::from(kept[at]), f64::from(kept[at + 1]));
                for (i, value) in values[pair[0]..=pair[1]].iter().enumerate() {
                    let line = a + (b - a) * i as f64 / (pair[1] - pair[0]) as f64;
                    let rounding = 1e-7 * a.abs().max(b.abs());
                    assert!(
                        (line - value).abs() <= within + rounding,
                        "{name} at {}: {line} {value}",
                        pair[0] + i
                    );
                }
            }
            ticks_compared += values.len();
        }
        for machine in chart["machines"].as_array().expect("machines") {
            let name = machine["name"].as_str().expect("a name");
            let column = run
                .trace
                .columns
                .iter()
                .find(|c| c.heading.name == name && !c.heading.labels.is_empty())
                .expect(name);
            let states = STANDARD
                .decode(machine["s"].as_str().expect("a text"))
                .expect("base64");
            let changes = rising(&machine["t"]);
            for (tick, &value) in column.values().iter().enumerate() {
                let run = changes.partition_point(|&change| change <= tick) - 1;
                assert_eq!(f64::from(states[run]), value, "{name} at {tick}");
            }
        }
        let marked = session::marked(&compiled.model);
        let strikes: Vec<f64> = run
            .trace
            .events
            .iter()
            .filter(|e| e.event == marked)
            .map(|e| e.t_s)
            .collect();
        let marks: Vec<f64> = chart["marks"]
            .as_array()
            .expect("marks")
            .iter()
            .map(|m| m[0].as_f64().expect("s"))
            .collect();
        // The reader of JSON rounds the last bit.
        let same = |(a, b): (&f64, &f64)| (a - b).abs() <= 1e-15 * b;
        assert!(
            marks.len() == strikes.len() && marks.iter().zip(&strikes).all(same),
            "{marks:?} {strikes:?}"
        );
        assert!(html.len() < 600_000, "{} bytes", html.len());
    }
    assert!(ticks_compared > 1_000_000, "{ticks_compared}");
}
