//! The emulated board in the studio: what is shown is what `run --steps` tells.

use std::path::Path;

use serde_json::{Value, json};

use super::{play, scripts, studio};
use crate::cli::{Shell, bundled};

#[test]
fn a_browser_steps_through_a_tick() {
    let tools = ["node", "chromium"].map(whippen_need::tool);
    let ([Some(node), Some(chromium)], Some(module)) = (tools, whippen_need::module()) else {
        return;
    };
    let Some(axe) = whippen_need::npm("axe-core/axe.min.js") else {
        return;
    };
    let read = |path: &Path| std::fs::read_to_string(path).expect("a script");
    let script = format!("{}\n{}", read(&axe), read(&scripts().join("board.js")));
    let shell = Shell::new().with("script.js", &script);
    let page = studio(&shell, &module);
    let value = play(&node, &chromium, &page, &shell.path("script.js"));
    assert_eq!(value["found"], json!([]), "{value}");
    let said = value["said"].as_str().unwrap_or_default();
    let tick = value["tick"].as_u64().expect("a tick");
    let told = steps(&shell, tick);
    judge_tick(said, tick, &told);
    judge_steps(&value, &told);
    let refused = value["refused"].as_str().unwrap_or_default();
    assert!(refused.contains("cannot be emulated"), "{value}");
    for holds in ["isBusy", "stays", "wide", "cleared"] {
        assert_eq!(value[holds], true, "{holds}: {value}");
    }
    assert!(value["clicked"].as_u64() < Some(tick), "{value}");
    assert_eq!(
        (&value["runs"], &value["paused"]),
        (&"Pause".into(), &"Run".into())
    );
}

/// What the command tells of a tick.
fn steps(shell: &Shell, tick: u64) -> Value {
    let (program, from) = (bundled("hammond.whip"), tick.to_string());
    let run = [
        "run",
        &program,
        "--engine",
        "emulated",
        "--keys",
        "3",
        "--seconds",
        "0.05",
    ];
    let steps = ["--steps", "s.json", "--steps-from", &from];
    shell.ends(0, &[&run[..], &steps].concat());
    let text = std::fs::read_to_string(shell.path("s.json")).expect("written");
    serde_json::from_str(&text).expect("JSON")
}

/// The longest tick, its cycles and the bound.
fn judge_tick(said: &str, tick: u64, told: &Value) {
    let ticks = told["ticks"].as_array().expect("ticks");
    let cores = told["keys"].as_array().expect("cores").len();
    for core in 0..cores {
        let of = |tick: &Value| tick[core].as_u64().expect("cycles");
        let longest = ticks.iter().map(of).max().expect("ticks");
        let first = ticks.iter().position(|tick| of(tick) == longest);
        let bound = told["bound_cycles"][core].as_u64().expect("a bound");
        assert!(longest <= bound, "{longest} of {bound}");
        let first = first.expect("a tick");
        let words =
            format!("took {longest} cycles in its longest tick, {first}, of at most {bound}");
        assert!(said.contains(&words), "`{words}` in `{said}`");
    }
    let most = ticks
        .iter()
        .flat_map(|tick| tick.as_array().expect("cores"));
    let most = most.filter_map(Value::as_u64).max();
    let own = ticks[tick as usize].as_array().expect("cores").iter();
    assert_eq!(own.filter_map(Value::as_u64).max(), most, "tick {tick}");
}

/// The first instructions, those in between and those behind.
fn judge_steps(value: &Value, told: &Value) {
    let text = |of: &Value, name: &str| of[name].as_str().unwrap_or_default().to_string();
    let all = told["steps"].as_array().expect("steps");
    let code = |seen: &Value| text(seen, "code");
    let first = code(&value["first"]);
    let is_first = |step: &&Value| {
        let address = step["address"].as_u64().expect("an address");
        first.contains(&format!("{address:08x}"))
    };
    assert!(all.iter().any(|step| is_first(&step)), "{first}");
    let (later, next) = (&value["later"], &value["next"]);
    assert!(text(later, "line").contains("force"), "{value}");
    assert_ne!(text(later, "where"), text(next, "where"));
    assert_eq!(later, &value["back"], "a step back is where it was");
    assert!(next["changed"].as_u64() > Some(0), "{value}");
    assert!(text(later, "registers").contains("sp2"), "{value}");
    assert!(
        text(&value["nextTick"], "where").contains("instruction 1 of"),
        "{value}"
    );
}
