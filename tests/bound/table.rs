//! The table of `docs/bars.md`: how many keys of each instrument are proven to fit.
//! `WHIPPEN_BLESS=1` rewrites it.

use std::path::Path;
use std::process::Command;

use serde_json::Value;
use whippen_compiler::bundled::INSTRUMENTS;

/// Where the table stands.
const BEGIN: &str = "<!-- most keys -->\n";
const END: &str = "<!-- end of most keys -->\n";

/// The boards, in the order of the columns.
const BOARDS: [&str; 3] = ["rp2350", "stm32f4", "rp2040"];

/// `whippen budget FILE --board BOARD --most-keys --json`; none where there is no image.
fn budget(file: &str, name: &str, board: &str) -> Option<Value> {
    let path = format!("instruments/{file}");
    let mut command = Command::new(env!("CARGO_BIN_EXE_whippen"));
    command
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .args(["budget", &path, name, "--board", board]);
    let output = command
        .args(["--most-keys", "--json"])
        .output()
        .expect("the command runs");
    // 1: not even the fewest keys fit.
    matches!(output.status.code(), Some(0 | 1))
        .then(|| serde_json::from_slice(&output.stdout).expect("JSON"))
}

/// Cycles of a key, what it waits, and how many fit.
fn columns(found: &Value) -> String {
    let key = &found["key"];
    let keys = if found["fits"] == Value::Bool(true) {
        found["keys"].to_string()
    } else {
        "none".to_string()
    };
    format!(
        "{} + {} | {keys}",
        key["cycles_max"], key["contention_cycles_max"]
    )
}

fn table() -> String {
    let heads = BOARDS.map(|board| format!("{board}: cycles of a key | keys at 44.1 kHz"));
    let mut text = format!(
        "| instrument | {} |\n| --- | {} |\n",
        heads.join(" | "),
        ["---"; 6].join(" | ")
    );
    for compiled in crate::image::instruments() {
        let name = compiled.model.name.clone();
        let holds = |text: &str| text.contains(&format!("instrument {name} "));
        let file = INSTRUMENTS
            .iter()
            .find(|(_, text)| holds(text))
            .map(|(file, _)| *file)
            .expect("it is bundled");
        let found: Option<Vec<Value>> = BOARDS
            .into_iter()
            .map(|board| budget(file, &name, board))
            .collect();
        let Some(found) = found else { continue };
        let row: Vec<String> = found.iter().map(columns).collect();
        text += &format!(
            "| [{name}](../instruments/{file}) | {} |\n",
            row.join(" | ")
        );
    }
    text
}

#[test]
fn the_table_of_most_keys_is_what_the_command_prints() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/bars.md");
    let document = std::fs::read_to_string(&path).expect("the document");
    let (before, rest) = document.split_once(BEGIN).expect("the table begins");
    let (_, after) = rest.split_once(END).expect("the table ends");
    let new = format!("{before}{BEGIN}{}{END}{after}", table());
    if std::env::var_os("WHIPPEN_BLESS").is_some() {
        std::fs::write(&path, &new).expect("the document can be written");
    }
    let now = std::fs::read_to_string(&path).expect("the document");
    assert!(
        now == new,
        "bless with WHIPPEN_BLESS=1 cargo test --test bound most_keys:\n{}",
        table()
    );
}
