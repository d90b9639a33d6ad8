//! The page in a browser without a window, played by a script.

use std::path::Path;
use std::process::Command;

use serde_json::Value;

use super::page;
use crate::common::instruments;

const FLAGS: &[&str] = &[
    "--headless",
    "--no-sandbox",
    "--disable-gpu",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--window-size=1200,900",
    "--virtual-time-budget=5000",
    "--dump-dom",
];

/// Loads a page, lets a script play it, and gives what the script calls `done` with; none where
/// there is no browser, and the test counts as skipped.
pub fn play(html: &str, script: &str) -> Option<Value> {
    let browser = whippen_need::tool("chromium")?;
    let watch = "<head><script>window.errors = [];
        addEventListener('error', (e) => errors.push(e.message));
        console.error = (...words) => errors.push(words.join(' '));
        window.done = (result) => { document.body.dataset.result = JSON.stringify({ ...result, errors }); };
        window.after = (ms) => new Promise((go) => setTimeout(go, ms));</script>";
    let html = html.replacen("<head>", watch, 1);
    let folder = tempfile::tempdir().expect("a temporary folder");
    let file = folder.path().join("page.html");
    std::fs::write(
        &file,
        format!("{html}<script>(async () => {{ {script} }})();</script>"),
    )
    .expect("writable");
    Some(dumped(&browser, folder.path(), &file))
}

fn dumped(browser: &Path, folder: &Path, file: &Path) -> Value {
    let mut command = Command::new(browser);
    command.args(FLAGS).arg(format!(
        "--user-data-dir={}",
        folder.join("profile").display()
    ));
    let output = command
        .arg(format!("file://{}", file.display()))
        .output()
        .expect("the browser starts");
    let dom = String::from_utf8_lossy(&output.stdout)
        .replace("&quot;", "\"")
        .replace("&amp;", "&");
    let result = dom
        .split("data-result=\"")
        .nth(1)
        .and_then(|rest| rest.split("}\"").next());
    let result =
        result.unwrap_or_else(|| panic!("no result: {}", String::from_utf8_lossy(&output.stderr)));
    serde_json::from_str(&format!("{result}}}")).expect("JSON")
}

#[test]
fn a_browser_shows_it_and_zooms_where_it_is_told() {
    let compiled = &instruments("grand-piano.whip", &[])[0];
    let (run, page) = page(compiled, 2.6);
    let script = "
        await after(300);
        const text = (query) => document.querySelector(query).textContent;
        const press = (key) => document.querySelector('.stack').dispatchEvent(new KeyboardEvent('keydown', { key, bubbles: true }));
        const whole = text('.toolbar output');
        press('n'); await after(200);
        const zoomed = text('.toolbar output');
        const read = Object.fromEntries([...document.querySelectorAll('.legend > *')].map((row) =>
            [row.querySelector('.name').textContent, row.querySelector('output').textContent]));
        press('0'); await after(100);
        const again = text('.toolbar output');
        document.querySelector('.legend button').click();
        const hidden = document.querySelectorAll('.legend button[aria-pressed=false]').length;
        const seen = () => [...document.querySelectorAll('.pair tbody tr')].filter((row) => row.offsetHeight > 0).length;
        const strikes = seen();
        document.querySelector('.all input').click();
        const events = seen();
        document.querySelector('.pair tbody tr:not(.minor)').click(); await after(200);
        const clicked = text('.toolbar output');
        const head = document.querySelectorAll('section > .table th button')[9];
        head.click(); head.click();
        const margins = [...document.querySelectorAll('section > .table tbody tr')].map((row) => Number(row.cells[9].dataset.n));
        document.querySelector('.theme').click();
        done({ whole, zoomed, read, again, hidden, strikes, events, clicked, margins, canvases: document.querySelectorAll('canvas').length,
               wide: document.documentElement.scrollWidth <= innerWidth });";
    let Some(result) = play(&page.html(), script) else {
        return;
    };
    assert_eq!(result["errors"], serde_json::json!([]), "{result}");
    assert_eq!(
        (&result["whole"], &result["again"]),
        (&"0.0000 – 2.6000 s".into(), &"0.0000 – 2.6000 s".into())
    );
    let strike = run
        .trace
        .events
        .iter()
        .find(|e| e.event == "note")
        .expect("a strike");
    let around = format!("{:.5} – {:.5} s", strike.t_s - 0.1, strike.t_s + 0.1);
    assert_eq!(
        (&result["zoomed"], &result["clicked"]),
        (&around.clone().into(), &around.into())
    );
    // The crosshair stands at the strike and reads what the trace holds there.
    let tick = (strike.t_s * 44_100.0).round() as usize;
    let at = |title: &str| run.trace.column(title).expect("a column").values()[tick];
    let read = |name: &str| {
        let text = result["read"][name]
            .as_str()
            .expect("a reading")
            .replace('−', "-");
        text.split(' ')
            .next()
            .and_then(|number| number.parse::<f64>().ok())
            .unwrap_or_else(|| panic!("{name}: {text}"))
    };
    assert!(
        (read("x") - at("x_m") * 1e3).abs() < 2e-3,
        "{} {}",
        read("x"),
        at("x_m")
    );
    assert!((read("phi") - at("phi_rad")).abs() < 2e-4);
    assert_eq!(
        result["read"]["contact"].as_str().map(|s| s.contains(' ')),
        Some(false),
        "the state stands below the force"
    );
    assert_eq!(result["hidden"], 1);
    assert_eq!(
        result["strikes"].as_u64(),
        Some(
            run.trace
                .events
                .iter()
                .filter(|e| e.event == "note")
                .count() as u64
        )
    );
    assert_eq!(
        result["events"].as_u64(),
        Some(run.trace.events.len() as u64)
    );
    let margins: Vec<f64> = result["margins"]
        .as_array()
        .expect("a list")
        .iter()
        .filter_map(Value::as_f64)
        .collect();
    assert!(
        margins.len() > 5 && margins.is_sorted_by(|a, b| a >= b),
        "sorted, the largest first: {margins:?}"
    );
    assert_eq!(
        (&result["canvases"], &result["wide"]),
        (&8.into(), &true.into()),
        "six panels of lines, states, the loop"
    );
}
