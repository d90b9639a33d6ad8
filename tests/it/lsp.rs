//! The language server, through its protocol: the real command, real messages.

mod costs;
pub mod editor;

use std::path::Path;

use serde_json::{Value, json};

use editor::Editor;

/// The place of the n-th `words` (from 0), so many UTF-16 units into it.
#[track_caller]
fn place(text: &str, words: &str, nth: usize, into: usize) -> Value {
    let (at, _) = text
        .match_indices(words)
        .nth(nth)
        .unwrap_or_else(|| panic!("no `{words}`"));
    let line = text[..at].matches('\n').count();
    let begin = text[..at].rfind('\n').map_or(0, |n| n + 1);
    json!({ "line": line, "character": text[begin..at].encode_utf16().count() + into })
}

const KEY: &str = "/// A key, gel\u{f6}st \u{1d11e}.
instrument key {
    sense x: length in 0 mm .. 10 mm over 1 ms            // how far down
    param k = 75 N/m in 50 N/m .. 150 N/m
    let dome = escapement(x, start: 3 mm, peak: 4 mm, end: 5 mm, height: 0.5 N)
    states latch {
        open   -> closed when x > 6 mm { emit note(speed: x') }
        closed -> open   when x < 5 mm { emit release() }
    }
    let spring = k * x
    force spring = spring + dome.resistance
    force latch  = if latch is closed then 0.5 N else 0 N
}
";

#[test]
fn diagnostics_come_while_typing_and_go_again() {
    let mut editor = Editor::new();
    assert_eq!(editor.open("key.whip", KEY), Vec::<Value>::new());
    let uri = editor.uri("key.whip");
    let change = |version: i64, changes: Value| json!({ "textDocument": { "uri": uri, "version": version }, "contentChanges": changes });
    // Two edits in one message, the first on a line behind non-ASCII text.
    let comment = place(KEY, ".\ninstrument", 0, 1);
    let end = place(KEY, "spring +", 0, 6);
    let edits = json!([
        { "range": { "start": place(KEY, "spring +", 0, 0), "end": end }, "text": "sprig" },
        { "range": { "start": comment, "end": comment }, "text": " \u{1d11e}" },
    ]);
    editor.tell("textDocument/didChange", change(2, edits));
    let found = editor.diagnostics("key.whip", 2);
    let changed = KEY.replace("spring +", "sprig +");
    assert_eq!(found.len(), 1, "{found:#?}");
    assert_eq!(found[0]["code"], "WH0201");
    assert_eq!(found[0]["severity"], 1);
    assert_eq!(found[0]["source"], "whippen");
    assert_eq!(
        found[0]["range"],
        json!({ "start": place(&changed, "sprig", 0, 0), "end": place(&changed, "sprig", 0, 5) })
    );
    assert!(
        found[0]["message"]
            .as_str()
            .is_some_and(|m| m.contains("did you mean `spring`?")),
        "{found:#?}"
    );
    let fix = editor.ask(
        "textDocument/codeAction",
        json!({ "textDocument": { "uri": uri }, "range": found[0]["range"], "context": { "diagnostics": found } }),
    );
    let edit = &fix["result"][0]["edit"]["changes"][&uri][0];
    assert_eq!(
        (&edit["newText"], &edit["range"]),
        (&json!("spring"), &found[0]["range"])
    );
    editor.tell(
        "textDocument/didChange",
        change(3, json!([{ "text": KEY }])),
    );
    assert_eq!(editor.diagnostics("key.whip", 3), Vec::<Value>::new());
    // A range behind a surrogate pair on the same line.
    let text = "instrument i { // \u{1d11e}\n} /* \u{1d11e} */ x";
    editor.tell(
        "textDocument/didChange",
        change(4, json!([{ "text": text }])),
    );
    let found = editor.diagnostics("key.whip", 4);
    assert_eq!(found[0]["range"]["start"], place(text, "/*", 0, 0));
    assert_eq!(found[0]["range"]["end"], place(text, " x", 0, 0));
    editor.end();
}

/// What rings is told of the text as it was opened or saved, and not while it is typed.
#[test]
fn what_rings_is_told_when_a_document_is_saved() {
    let text = |damping: &str| {
        format!(
            "instrument probe {{\n    sense x: length in 0 mm .. 10 mm over 1 ms\n    force brake = {damping} N*s/m * x'\n}}\n"
        )
    };
    let mut editor = Editor::new();
    let found = editor.open("probe.whip", &text("-5"));
    assert_eq!(
        found.iter().map(|d| &d["code"]).collect::<Vec<_>>(),
        ["WH0702"],
        "{found:#?}"
    );
    let uri = editor.uri("probe.whip");
    let change = |version: i64, text: &str| json!({ "textDocument": { "uri": uri, "version": version }, "contentChanges": [{ "text": text }] });
    editor.tell("textDocument/didChange", change(2, &text("-6")));
    assert_eq!(editor.diagnostics("probe.whip", 2), Vec::<Value>::new());
    editor.tell(
        "textDocument/didSave",
        json!({ "textDocument": { "uri": uri } }),
    );
    let found = editor.diagnostics("probe.whip", 2);
    assert_eq!(
        (found.len(), &found[0]["range"]["start"]["line"]),
        (1, &json!(2)),
        "{found:#?}"
    );
    editor.tell("textDocument/didChange", change(3, &text("1")));
    editor.tell(
        "textDocument/didSave",
        json!({ "textDocument": { "uri": uri } }),
    );
    assert_eq!(editor.diagnostics("probe.whip", 3), Vec::<Value>::new());
    editor.end();
}

#[test]
fn hover_tells_declaration_dimension_range_and_format() {
    let mut editor = Editor::new();
    editor.open("key.whip", KEY);
    let spring = editor.hover("key.whip", place(KEY, "spring +", 0, 2));
    for part in [
        "let spring = k * x",
        "force",
        "0 .. 0.75 N",
        "format ~I",
        "error of at most",
    ] {
        assert!(spring.contains(part), "`{part}` in\n{spring}");
    }
    assert_eq!(
        editor.hover("key.whip", place(KEY, "\n    let spring", 0, 0)),
        "",
        "nothing stands there"
    );
    let cases = [
        (place(KEY, "sense x", 0, 6), "how far down"),
        (place(KEY, "sense x", 0, 1), "what is measured"),
        (place(KEY, "75 N/m", 0, 4), "stiffness"),
        (place(KEY, "escapement", 0, 1), "A resistance that rises"),
        (place(KEY, "resistance", 0, 1), "resistance: force"),
        (place(KEY, "is closed", 0, 4), "state"),
        (place(KEY, "length in", 0, 0), "in m"),
    ];
    for (place, part) in cases {
        let told = editor.hover("key.whip", place.clone());
        assert!(told.contains(part), "`{part}` at {place} in\n{told}");
    }
    editor.end();
}

#[test]
fn names_lead_to_their_places_and_take_others() {
    let mut editor = Editor::new();
    editor.open("key.whip", KEY);
    let (uri, name) = (editor.uri("key.whip"), "key.whip");
    let to_x = editor.at("definition", name, place(KEY, "k * x", 0, 4), json!({}));
    assert_eq!(
        (&to_x["uri"], &to_x["range"]["start"]),
        (&json!(uri), &place(KEY, "sense x", 0, 6))
    );
    let to_state = editor.at("definition", name, place(KEY, "is closed", 0, 4), json!({}));
    assert_eq!(to_state["range"]["start"], place(KEY, "closed when", 0, 0));
    let to_std = editor.at(
        "definition",
        name,
        place(KEY, "escapement(", 0, 3),
        json!({}),
    );
    let file = to_std["uri"]
        .as_str()
        .and_then(|u| u.strip_prefix("file://"))
        .expect("a file");
    assert!(Path::new(file).starts_with(editor.cache.path()), "{file}");
    let shared = std::fs::read_dir(editor.shared.path()).expect("readable");
    assert_eq!(shared.count(), 0, "nothing in the folder that users share");
    let std = std::fs::read_to_string(file).expect("readable");
    assert_eq!(std, include_str!("../../instruments/std/escapement.whip"));
    assert_eq!(to_std["range"]["start"], place(&std, "escapement(", 0, 0));

    let all = editor.at(
        "references",
        name,
        place(KEY, "sense x", 0, 6),
        json!({ "context": { "includeDeclaration": true } }),
    );
    assert_eq!(all.as_array().map(Vec::len), Some(6));
    let edit = editor.at(
        "rename",
        name,
        place(KEY, "spring +", 0, 0),
        json!({ "newName": "coil" }),
    );
    assert_eq!(
        edit["changes"][&uri].as_array().map(Vec::len),
        Some(2),
        "the label is another name: {edit}"
    );
    for new in ["let", "1a", "dome", ""] {
        let params = json!({ "textDocument": { "uri": uri }, "position": place(KEY, "spring +", 0, 0), "newName": new });
        assert!(
            editor.ask("textDocument/rename", params)["error"]["message"].is_string(),
            "{new}"
        );
    }
    let outline = editor.ask(
        "textDocument/documentSymbol",
        json!({ "textDocument": { "uri": uri } }),
    );
    let names = |v: &Value| -> Vec<String> {
        v.as_array()
            .expect("a list")
            .iter()
            .map(|s| s["name"].as_str().expect("text").to_string())
            .collect()
    };
    assert_eq!(names(&outline["result"]), ["key"]);
    let children = names(&outline["result"][0]["children"]);
    assert_eq!(
        children,
        ["x", "k", "dome", "latch", "spring", "spring", "latch"]
    );
    editor.end();
}

#[test]
fn completion_and_signatures_know_the_place() {
    let mut editor = Editor::new();
    let text = KEY.replace(
        "force spring = spring + dome.resistance",
        "force spring = 2 N + dome.\n    let y = latch is ",
    );
    editor.open("key.whip", &text);
    let has = |labels: &[String], wanted: &[&str], unwanted: &[&str]| {
        assert!(
            wanted.iter().all(|w| labels.iter().any(|l| l == w)),
            "{wanted:?} in {labels:?}"
        );
        assert!(
            !unwanted.iter().any(|w| labels.iter().any(|l| l == w)),
            "{unwanted:?} in {labels:?}"
        );
    };
    has(
        &editor.labels("key.whip", place(&text, "dome.\n", 0, 5)),
        &["resistance", "out"],
        &["x", "let"],
    );
    has(
        &editor.labels("key.whip", place(&text, "latch is \n", 0, 9)),
        &["open", "closed"],
        &["x"],
    );
    has(
        &editor.labels("key.whip", place(&text, "2 N +", 0, 2)),
        &["N", "mm", "rad"],
        &["x"],
    );
    has(
        &editor.labels("key.whip", place(&text, "N/m in", 0, 2)),
        &["m", "s"],
        &["x"],
    );
    has(
        &editor.labels("key.whip", place(&text, "k * x", 0, 4)),
        &["x", "k", "escapement", "min", "if"],
        &["mm"],
    );
    has(
        &editor.labels("key.whip", place(&text, "start: 3", 0, 0)),
        &["start:", "peak:", "x"],
        &[],
    );
    has(
        &editor.labels("key.whip", place(&text, "length in", 0, 0)),
        &["length", "force", "bool"],
        &["x"],
    );
    has(
        &editor.labels("key.whip", place(&text, "how far", 0, 0)),
        &[],
        &["x", "let"],
    );
    let help = editor.at(
        "signatureHelp",
        "key.whip",
        place(&text, "peak: 4 mm", 0, 8),
        json!({}),
    );
    assert_eq!(help["activeParameter"], 2);
    assert!(
        help["signatures"][0]["label"]
            .as_str()
            .is_some_and(|l| l.starts_with("escapement(x: length, start"))
    );
    assert!(
        editor
            .at(
                "signatureHelp",
                "key.whip",
                place(&text, "k * x", 0, 0),
                json!({})
            )
            .is_null()
    );
    editor.end();
}

#[test]
fn formatting_is_that_of_fmt() {
    let mut editor = Editor::new();
    editor.open(
        "key.whip",
        "instrument key {sense x:length in 0 mm..1 mm // \u{1d11e}\n}",
    );
    let uri = editor.uri("key.whip");
    let options = json!({ "textDocument": { "uri": uri }, "options": { "tabSize": 2, "insertSpaces": false } });
    let edits = editor.ask("textDocument/formatting", options.clone());
    let text = edits["result"][0]["newText"].as_str().expect("an edit");
    assert!(
        text.starts_with("instrument key {\n    sense x: length in 0 mm .. 1 mm "),
        "{text}"
    );
    assert_eq!(
        edits["result"][0]["range"]["end"],
        json!({ "line": 1, "character": 1 })
    );
    editor.open("broken.whip", "instrument {");
    let uri = editor.uri("broken.whip");
    let options = json!({ "textDocument": { "uri": uri }, "options": {} });
    assert_eq!(
        editor.ask("textDocument/formatting", options)["result"],
        json!([])
    );
    editor.end();
}

#[test]
fn a_keyboard_finds_its_instruments_beside_it() {
    let mut editor = Editor::new();
    let write = |folder: &Path, name: &str, text: &str| {
        std::fs::write(folder.join(name), text).expect("writable")
    };
    let board = "keyboard board {\n    device   mikey\n    rate     44100 Hz\n    keys     A0 .. C8\n    programs key\n    key.k = { A0: 60 N/m, C8: 70 N/m }\n}\n";
    assert!(
        !editor.open("board.whip", board).is_empty(),
        "there is no `key`"
    );
    write(editor.folder.path(), "key.whip", KEY);
    write(editor.folder.path(), "other.whip", "instrument {{{");
    editor.tell("workspace/didChangeWatchedFiles", json!({ "changes": [] }));
    assert_eq!(editor.diagnostics("board.whip", 1), Vec::<Value>::new());
    let to_key = editor.at(
        "definition",
        "board.whip",
        place(board, "programs key", 0, 10),
        json!({}),
    );
    assert_eq!(to_key["uri"], editor.uri("key.whip"));
    let to_k = editor.at(
        "definition",
        "board.whip",
        place(board, "key.k", 0, 4),
        json!({}),
    );
    assert_eq!(to_k["range"]["start"], place(KEY, "param k", 0, 6));
    // What is open counts as it is in the editor, not as it is on the disk.
    editor.open(
        "key.whip",
        &KEY.replace(
            "param k = 75 N/m in 50 N/m .. 150 N/m",
            "param stiff = 75 N/m",
        )
        .replace("k * x", "stiff * x"),
    );
    let found = editor.at(
        "definition",
        "board.whip",
        place(board, "key.k", 0, 4),
        json!({}),
    );
    assert!(found.is_null(), "{found}");
    editor.end();
}

#[test]
fn zones_have_a_name_and_instruments() {
    let mut editor = Editor::new();
    std::fs::write(editor.folder.path().join("key.whip"), KEY).expect("writable");
    let board = "keyboard board {\n    rate     44100 Hz\n    keys     A0 .. C8\n    programs split\n    zones    split = { A0 .. C8: key }\n}\n";
    assert_eq!(editor.open("board.whip", board), Vec::<Value>::new());
    let split = editor.at(
        "definition",
        "board.whip",
        place(board, "programs split", 0, 10),
        json!({}),
    );
    assert_eq!(split["range"]["start"], place(board, "split = ", 0, 0));
    let key = editor.at(
        "definition",
        "board.whip",
        place(board, "C8: key", 0, 5),
        json!({}),
    );
    assert_eq!(key["uri"], editor.uri("key.whip"));
    let told = editor
        .at(
            "hover",
            "board.whip",
            place(board, "programs split", 0, 10),
            json!({}),
        )
        .to_string();
    assert!(
        told.contains("zones    split = { A0 .. C8: key }") && told.contains("program of zones"),
        "{told}"
    );
    let word = editor
        .at(
            "hover",
            "board.whip",
            place(board, "zones", 0, 1),
            json!({}),
        )
        .to_string();
    assert!(word.contains("every key is in one zone"), "{word}");
    let words = editor
        .at(
            "completion",
            "board.whip",
            place(board, "programs split", 0, 9),
            json!({}),
        )
        .to_string();
    assert!(
        words.contains("\"split\"") && words.contains("\"zones\""),
        "{words}"
    );
    let edits = editor.at(
        "rename",
        "board.whip",
        place(board, "split = ", 0, 0),
        json!({ "newName": "halves" }),
    );
    let uri = editor.uri("board.whip");
    assert_eq!(
        edits["changes"][&uri].as_array().map(Vec::len),
        Some(2),
        "{edits}"
    );
    editor.end();
}

#[test]
fn nothing_that_is_said_ends_it() {
    let mut editor = Editor::new();
    let body = |text: &str| format!("Content-Length: {}\r\n\r\n{text}", text.len()).into_bytes();
    for bad in [
        "{",
        "[]",
        "null",
        "{\"jsonrpc\":\"2.0\"}",
        "\u{1d11e}",
        "{\"id\":[1],\"method\":3}",
    ] {
        editor.raw(&body(bad));
    }
    editor.raw(b"Content-Length: 3\r\n\r\n\xff\xfe\xfd");
    editor.raw(b"Content-Length: minus one\r\n\r\n");
    editor.raw(b"nonsense\r\n\r\n");
    let uri = editor.uri("key.whip");
    editor.tell(
        "textDocument/didChange",
        json!({ "textDocument": { "uri": uri, "version": 1 }, "contentChanges": [] }),
    );
    editor.tell("textDocument/didOpen", json!({ "textDocument": 3 }));
    editor.tell("no/such/notification", json!([]));
    assert_eq!(
        editor.ask("no/such/method", json!({}))["error"]["code"],
        -32601
    );
    assert!(
        editor.ask(
            "textDocument/hover",
            json!({ "textDocument": { "uri": uri } })
        )["error"]["code"]
            .is_i64()
    );
    editor.open("key.whip", KEY);
    assert_eq!(
        editor.ask(
            "textDocument/hover",
            json!({ "textDocument": { "uri": uri } })
        )["error"]["code"],
        -32602
    );
    assert_eq!(
        editor.ask(
            "textDocument/nothing",
            json!({ "textDocument": { "uri": uri } })
        )["error"]["code"],
        -32601
    );
    // Every place, and places that do not exist.
    for (line, character) in
        (0..20).flat_map(|l| [0, 4, 9, 17, 31, 4_000_000_000u32].map(|c| (l, c)))
    {
        for method in [
            "hover",
            "definition",
            "completion",
            "signatureHelp",
            "references",
        ] {
            editor.at(
                method,
                "key.whip",
                json!({ "line": line, "character": character }),
                json!({}),
            );
        }
    }
    // Every beginning of a program.
    for (version, end) in (0..KEY.len())
        .step_by(7)
        .filter(|end| KEY.is_char_boundary(*end))
        .enumerate()
    {
        let uri = editor.uri("key.whip");
        let changes = json!([{ "text": &KEY[..end] }]);
        editor.tell(
            "textDocument/didChange",
            json!({ "textDocument": { "uri": uri, "version": version }, "contentChanges": changes }),
        );
        editor.at(
            "completion",
            "key.whip",
            json!({ "line": 99, "character": 0 }),
            json!({}),
        );
    }
    let open = editor.folder.path().join("open.whip");
    assert!(!open.exists());
    editor.end();
    // Hanging up is an end too.
    let mut editor = Editor::new();
    editor.input = None;
    assert_eq!(editor.server.wait().expect("ends").code(), Some(0));
}
