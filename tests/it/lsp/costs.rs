//! Costs in an editor: what fits above an instrument, cycles and formats in its lines.

use std::collections::BTreeMap;
use std::process::Command;

use serde_json::{Value, json};

use super::editor::Editor;
use super::{KEY, place};

/// An editor that shows costs, and is told when they are there.
fn shows_costs() -> Value {
    let refresh = json!({ "refreshSupport": true });
    json!({
        "textDocument": { "codeLens": {}, "inlayHint": {} },
        "workspace": { "codeLens": refresh, "inlayHint": refresh },
    })
}

/// Waits until the server says that costs are there.
fn wait_for_costs(editor: &Editor) {
    while editor.next()["method"] != "workspace/inlayHint/refresh" {}
}

fn titles(editor: &mut Editor, name: &str) -> Vec<String> {
    let uri = editor.uri(name);
    let answer = editor.ask(
        "textDocument/codeLens",
        json!({ "textDocument": { "uri": uri } }),
    );
    let lenses = answer["result"].as_array().expect("a list");
    let title = |lens: &Value| lens["command"]["title"].as_str().expect("text").to_string();
    lenses.iter().map(title).collect()
}

/// Hints as line (from 0) and label.
fn hints(editor: &mut Editor, name: &str, lines: [u32; 2]) -> Vec<(u64, String)> {
    let uri = editor.uri(name);
    let [start, end] = lines.map(|line| json!({ "line": line, "character": 0 }));
    let range = json!({ "start": start, "end": end });
    let answer = editor.ask(
        "textDocument/inlayHint",
        json!({ "textDocument": { "uri": uri }, "range": range }),
    );
    let one = |hint: &Value| {
        let label = hint["label"].as_str().expect("text").to_string();
        (hint["position"]["line"].as_u64().expect("a line"), label)
    };
    let hints = answer["result"].as_array().expect("a list");
    hints.iter().map(one).collect()
}

/// What `whippen budget` says of a program.
fn budget(editor: &Editor, text: &str, more: &[&str]) -> Value {
    let path = editor.folder.path().join("other.whip");
    std::fs::write(&path, text).expect("written");
    let mut command = Command::new(env!("CARGO_BIN_EXE_whippen"));
    let output = command
        .args(["budget", "--json"])
        .arg(path)
        .args(more)
        .output();
    serde_json::from_slice(&output.expect("runs").stdout).expect("JSON")
}

#[test]
fn what_fits_and_what_lines_take_is_what_the_budget_proves() {
    let mut editor = Editor::with(shows_costs(), Value::Null);
    assert_eq!(editor.open("key.whip", KEY), Vec::<Value>::new());
    wait_for_costs(&editor);
    let found = budget(&editor, KEY, &["--most-keys"]);
    let number = |value: &Value| value.as_u64().expect("a number");
    let (key, keys) = (&found["key"], number(&found["keys"]));
    let [alone, waiting] = ["cycles_max", "contention_cycles_max"].map(|of| number(&key[of]));
    assert_eq!(
        titles(&mut editor, "key.whip"),
        [format!(
            "rp2350: {keys} keys fit, {alone} + {waiting} cycles a key"
        )]
    );
    // Lines of the standard library and what is nobody's are in no line of the document.
    let mut expected = BTreeMap::new();
    for step in key["worst_path"].as_array().expect("steps") {
        let is_here = step["file"]
            .as_str()
            .is_some_and(|f| f.ends_with("other.whip"));
        if let Some(line) = step["line"].as_u64().filter(|_| is_here) {
            *expected.entry(line - 1).or_insert(0) += number(&step["cycles"]);
        }
    }
    let all = hints(&mut editor, "key.whip", [0, 99]);
    let cycles = |(line, label): &(u64, String)| {
        let (cycles, _) = label.split_once(" cycle")?;
        Some((*line, cycles.parse().expect("a number")))
    };
    let shown: BTreeMap<u64, u64> = all.iter().filter_map(cycles).collect();
    assert!(shown.len() > 3, "{all:?}");
    assert_eq!(shown, expected);
    editor.end();
}

#[test]
fn formats_stand_behind_names_and_only_where_they_are_asked_for() {
    let mut editor = Editor::new();
    editor.open("key.whip", KEY);
    let line = KEY.lines().position(|l| l.contains("let spring"));
    let line = line.expect("is there") as u32;
    let found = hints(&mut editor, "key.whip", [line, line + 1]);
    let [(at, format)] = &found[..] else {
        panic!("{found:?}");
    };
    assert_eq!(*at, u64::from(line));
    let hover = editor.hover("key.whip", place(KEY, "spring = k", 0, 1));
    assert!(hover.contains(&format!("format {format},")), "{hover}");
    // This editor shows no costs, and none are proven for it.
    assert_eq!(titles(&mut editor, "key.whip"), Vec::<String>::new());
    editor.end();
}

#[test]
fn costs_go_with_a_change_and_come_again() {
    let mut editor = Editor::with(shows_costs(), json!({ "board": "stm32f4" }));
    editor.open("key.whip", KEY);
    wait_for_costs(&editor);
    let before = titles(&mut editor, "key.whip");
    assert!(before[0].starts_with("stm32f4: "), "{before:?}");
    let uri = editor.uri("key.whip");
    let change = |version: i64, text: &str| {
        json!({
            "textDocument": { "uri": uri, "version": version },
            "contentChanges": [{ "text": text }],
        })
    };
    editor.tell(
        "textDocument/didChange",
        change(2, &KEY.replace("* x", "* y")),
    );
    assert_eq!(titles(&mut editor, "key.whip"), Vec::<String>::new());
    assert!(
        hints(&mut editor, "key.whip", [0, 99])
            .iter()
            .all(|(_, label)| !label.contains("cycle"))
    );
    editor.tell("textDocument/didChange", change(3, KEY));
    wait_for_costs(&editor);
    assert_eq!(titles(&mut editor, "key.whip"), before);
    editor.end();
}

#[test]
fn a_keyboard_and_what_has_no_budget_are_told() {
    let keyboard = "keyboard small {\n    board rp2040\n    rate 20 kHz\n    keys A0 .. E1\n    programs key\n}\n";
    let mut editor = Editor::with(shows_costs(), Value::Null);
    editor.open("both.whip", &format!("{keyboard}{KEY}"));
    wait_for_costs(&editor);
    let found = titles(&mut editor, "both.whip");
    assert_eq!(found.len(), 2, "{found:?}");
    assert!(found[0].starts_with("rp2040: "), "{found:?}");
    assert!(found[1].starts_with("key: 8 keys, "), "{found:?}");

    // What is played once has no keys.
    let both = json!({ "textDocument": { "uri": editor.uri("both.whip") } });
    editor.tell("textDocument/didClose", both);
    let path = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/tests/programs/two-axis-spring.whip"
    );
    let text = std::fs::read_to_string(path).expect("is there");
    let once = budget(&editor, &text, &[]);
    editor.open("once.whip", &text);
    wait_for_costs(&editor);
    let most = once["cores"].as_array().expect("cores").iter();
    let most = most.filter_map(|core| core["cycles_max"].as_u64()).max();
    let most = most.expect("a number");
    assert_eq!(
        titles(&mut editor, "once.whip"),
        [format!("rp2350: {most} of 3401 cycles a tick")]
    );
    editor.end();

    let mut editor = Editor::with(shows_costs(), json!({ "board": "toaster" }));
    editor.open("key.whip", KEY);
    let said = loop {
        let message = editor.next();
        if message["method"] == "window/logMessage" {
            break message["params"]["message"].to_string();
        }
    };
    assert!(said.contains("toaster"), "{said}");
    assert_eq!(titles(&mut editor, "key.whip"), Vec::<String>::new());
    editor.end();
}

#[test]
fn each_name_has_the_token_of_what_it_stands_for() {
    let mut editor = Editor::new();
    editor.open("key.whip", KEY);
    let uri = editor.uri("key.whip");
    let legend = editor.legend.clone();
    let answer = editor.ask(
        "textDocument/semanticTokens/full",
        json!({ "textDocument": { "uri": uri } }),
    );
    let data: Vec<u64> = (answer["result"]["data"].as_array().expect("numbers").iter())
        .map(|n| n.as_u64().expect("a number"))
        .collect();
    let lines: Vec<Vec<u16>> = KEY.lines().map(|l| l.encode_utf16().collect()).collect();
    let (mut line, mut start) = (0, 0);
    let mut found = Vec::new();
    for token in data.chunks(5) {
        if token[0] > 0 {
            start = 0;
        }
        (line, start) = (line + token[0], start + token[1]);
        let units = &lines[line as usize][start as usize..(start + token[2]) as usize];
        let mut said = String::from_utf16(units).expect("text");
        said += &format!(
            " {}",
            legend["tokenTypes"][token[3] as usize]
                .as_str()
                .expect("a type")
        );
        for (bit, modifier) in legend["tokenModifiers"]
            .as_array()
            .expect("all")
            .iter()
            .enumerate()
        {
            if token[4] >> bit & 1 == 1 {
                said += &format!(" {}", modifier.as_str().expect("a word"));
            }
        }
        found.push(said);
    }
    for wanted in [
        "key class declaration",
        "x variable declaration",
        "k variable declaration readonly",
        "escapement function defaultLibrary",
        "latch enum declaration",
        "closed enumMember declaration",
        "closed enumMember",
        "k variable readonly",
        "spring property declaration",
        "resistance property defaultLibrary",
    ] {
        assert!(found.iter().any(|f| f == wanted), "{wanted}: {found:#?}");
    }
    editor.end();
}
