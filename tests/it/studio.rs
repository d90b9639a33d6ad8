//! The studio: the command as a module gives, byte for byte, what the command gives; and the page
//! in a browser, where a program is written, mended, played and taken home.

mod board;
mod linked;

use std::collections::BTreeMap;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use serde_json::{Value, json};

use crate::cli::{Shell, bundled};

/// The folder of the scripts.
fn scripts() -> PathBuf {
    root().join("tests/it/studio")
}

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// One command: its words, the bundled files in its folder, and what it reads.
struct Case {
    words: Vec<String>,
    files: BTreeMap<String, Vec<u8>>,
    input: String,
}

/// A command over bundled programs and texts of a test.
fn case(words: &str, programs: &[&str], texts: &[(&str, &str)]) -> Case {
    let of_bundled = programs.iter().map(|name| {
        let bytes = std::fs::read(bundled(name)).expect("a bundled program");
        (name.to_string(), bytes)
    });
    let of_test = texts
        .iter()
        .map(|(name, text)| (name.to_string(), text.as_bytes().to_vec()));
    Case {
        words: words.split(' ').map(str::to_string).collect(),
        files: of_bundled.chain(of_test).collect(),
        input: String::new(),
    }
}

/// A conversation with the language server over a program: hover and completion.
fn conversation(name: &str) -> Case {
    let text = std::fs::read_to_string(bundled(name)).expect("a bundled program");
    let of_text = json!({ "uri": format!("file:///{name}") });
    let opened = json!({ "uri": format!("file:///{name}"), "languageId": "whip", "version": 1, "text": text });
    let line = text.lines().position(|line| line.contains("sense "));
    let at = json!({ "line": line, "character": 10 });
    let asked = json!({ "textDocument": of_text, "position": at });
    let messages = [
        json!({ "jsonrpc": "2.0", "id": 1, "method": "initialize", "params": { "capabilities": {} } }),
        json!({ "jsonrpc": "2.0", "method": "initialized", "params": {} }),
        json!({ "jsonrpc": "2.0", "method": "textDocument/didOpen", "params": { "textDocument": opened } }),
        json!({ "jsonrpc": "2.0", "id": 2, "method": "textDocument/hover", "params": asked }),
        json!({ "jsonrpc": "2.0", "id": 3, "method": "textDocument/completion", "params": asked }),
        json!({ "jsonrpc": "2.0", "id": 4, "method": "shutdown" }),
        json!({ "jsonrpc": "2.0", "method": "exit" }),
    ];
    let framed = messages.iter().map(|message| {
        let body = message.to_string();
        format!("Content-Length: {}\r\n\r\n{body}", body.len())
    });
    Case {
        input: framed.collect(),
        ..case("lsp", &[], &[])
    }
}

/// What a command leaves: exit code, stdout, stderr, all files.
#[derive(Debug, PartialEq)]
struct Left {
    code: i64,
    output: String,
    errors: String,
    files: BTreeMap<String, Vec<u8>>,
}

impl Case {
    /// What the command of this machine leaves, in a folder of its own.
    fn of_command(&self) -> Left {
        let shell = Shell::new();
        for (name, bytes) in &self.files {
            std::fs::write(shell.path(name), bytes).expect("writable");
        }
        let mut child = Command::new(env!("CARGO_BIN_EXE_whippen"))
            .args(&self.words)
            .current_dir(shell.path("."))
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .expect("the command starts");
        let mut input = child.stdin.take().expect("piped");
        // A command that reads nothing has hung up.
        let _ = input.write_all(self.input.as_bytes());
        drop(input);
        let done = child.wait_with_output().expect("the command ends");
        let entries = std::fs::read_dir(shell.path(".")).expect("readable");
        let files = entries.map(|entry| {
            let entry = entry.expect("an entry");
            let bytes = std::fs::read(entry.path()).expect("a file");
            (entry.file_name().display().to_string(), bytes)
        });
        Left {
            code: done.status.code().unwrap_or(-1).into(),
            output: String::from_utf8(done.stdout).expect("UTF-8"),
            errors: String::from_utf8(done.stderr).expect("UTF-8"),
            files: files.collect(),
        }
    }

    fn json(&self) -> Value {
        let files = self.files.iter();
        let files: BTreeMap<&String, String> = files
            .map(|(name, bytes)| (name, STANDARD.encode(bytes)))
            .collect();
        json!({ "words": self.words, "files": files, "input": self.input })
    }
}

/// What the module leaves of all cases.
fn of_module(node: &Path, module: &Path, cases: &[Case]) -> Vec<Left> {
    let mut child = Command::new(node)
        .arg(scripts().join("command.mjs"))
        .arg(module)
        .arg(root().join("runtime/src/studio/wasi.js"))
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .expect("node starts");
    let all: Vec<Value> = cases.iter().map(Case::json).collect();
    let mut input = child.stdin.take().expect("piped");
    input
        .write_all(json!(all).to_string().as_bytes())
        .expect("node reads");
    drop(input);
    let done = child.wait_with_output().expect("node ends");
    let told: Vec<Value> = serde_json::from_slice(&done.stdout).expect("JSON");
    let text = |value: &Value| value.as_str().unwrap_or_default().to_string();
    let left = |of: &Value| Left {
        code: of["code"].as_i64().unwrap_or(-1),
        output: text(&of["output"]),
        errors: text(&of["errors"]),
        files: (of["files"].as_object().into_iter().flatten())
            .map(|(name, bytes)| (name.clone(), STANDARD.decode(text(bytes)).expect("base64")))
            .collect(),
    };
    told.iter().map(left).collect()
}

const MISTAKE: &str =
    "instrument a {\n    sense x: length in 0 mm .. 10 mm\n    force f = weigth\n}\n";

/// What the studio asks for, and what else the command can do without a machine around it.
fn cases() -> Vec<Case> {
    let grand = &["grand-piano.whip"];
    let hammond = &["hammond.whip"];
    let split = &["split.whip", "grand-piano.whip", "hammond.whip"];
    vec![
        case("--version", &[], &[]),
        case("explain WH0203", &[], &[]),
        case("check grand-piano.whip --json --numbers", grand, &[]),
        case("check split.whip --json --numbers", split, &[]),
        case("check a.whip --json", &[], &[("a.whip", MISTAKE)]),
        case("check a.whip", &[], &[("a.whip", MISTAKE)]),
        case("check absent.whip", &[], &[]),
        case("check hammond.whip --watching", hammond, &[]),
        case(
            "fmt a.whip",
            &[],
            &[(
                "a.whip",
                "instrument a{sense x:length in 0 mm..10 mm\nforce f=1 N}",
            )],
        ),
        case("budget hammond.whip --json --keys 20", hammond, &[]),
        case("budget hammond.whip --keys 255", hammond, &[]),
        case(
            "build hammond.whip --board rp2350 --keys 8 -o h.uf2",
            hammond,
            &[],
        ),
        case(
            "build hammond.whip --keys 8 -o h.elf --listing h.lst --map h.map",
            hammond,
            &[],
        ),
        case("build grand-piano.whip --keys 8 -o g.uf2", grand, &[]),
        case("build grand-piano.whip --keys 3 -o g.c", grand, &[]),
        case("build grand-piano.whip --keys 3 -o g.wasm", grand, &[]),
        case("page grand-piano.whip -o touch.html", grand, &[]),
        case(
            "run hammond.whip --seconds 0.3 --out t.csv --exact --events e.csv --plot p.svg --json",
            hammond,
            &[],
        ),
        case(
            "run grand-piano.whip --seconds 0.2 --out t.csv --exact --report r.html --json",
            grand,
            &[],
        ),
        case(
            "run hammond.whip --engine emulated --keys 3 --seconds 0.03 --steps s.json --steps-from 1200 --steps-ticks 2 --json",
            hammond,
            &[],
        ),
        conversation("hammond.whip"),
    ]
}

/// Whether two outputs are the same JSON but for the last digits of the loop's stability, whose
/// complex exponentials are those of the machine's library.
fn alike(one: &str, other: &str) -> bool {
    let [mut one, mut other] =
        [one, other].map(|text| serde_json::from_str::<Value>(text).unwrap_or_default());
    let judged = [&mut one, &mut other].map(|budget| budget["stability"].take());
    one.is_object() && one == other && near(&judged[0], &judged[1])
}

/// As equal, but numbers to a part in a thousand million.
fn near(one: &Value, other: &Value) -> bool {
    match (one, other) {
        (Value::Array(one), Value::Array(other)) => {
            one.len() == other.len() && one.iter().zip(other).all(|(a, b)| near(a, b))
        }
        (Value::Object(one), Value::Object(other)) => {
            one.len() == other.len()
                && one
                    .iter()
                    .all(|(key, a)| other.get(key).is_some_and(|b| near(a, b)))
        }
        _ => match (one.as_f64(), other.as_f64()) {
            (Some(a), Some(b)) => (a - b).abs() <= 1e-9 * a.abs().max(b.abs()),
            _ => one == other,
        },
    }
}

#[test]
fn the_module_leaves_what_the_command_leaves() {
    let (node, module) = (whippen_need::tool("node"), whippen_need::module());
    let (Some(node), Some(module)) = (node, module) else {
        return;
    };
    let cases = cases();
    let left = of_module(&node, &module, &cases);
    assert_eq!(left.len(), cases.len());
    for (case, of_module) in cases.iter().zip(&left) {
        let of_command = case.of_command();
        let words = case.words.join(" ");
        assert_eq!(of_module.code, of_command.code, "{words}: {of_module:?}");
        assert!(
            of_module.output == of_command.output || alike(&of_module.output, &of_command.output),
            "{words}: {}\n{}",
            of_module.output,
            of_command.output
        );
        assert_eq!(of_module.errors, of_command.errors, "{words}");
        let names = |left: &Left| left.files.keys().cloned().collect::<Vec<_>>();
        assert_eq!(names(of_module), names(&of_command), "{words}");
        for (name, bytes) in &of_command.files {
            assert!(of_module.files[name] == *bytes, "{words}: {name} differs");
        }
    }
}

/// The studio of the module.
fn studio(shell: &Shell, module: &Path) -> PathBuf {
    let module = module.display().to_string();
    let words = ["studio", "--module", &module, "-o", "studio.html"];
    let (out, _) = shell.ends(0, &words);
    assert!(out.contains("open it in a browser"), "{out}");
    shell.path("studio.html")
}

#[test]
fn what_is_no_module_makes_no_studio() {
    let shell = Shell::new().with("x.wasm", "no module");
    let words = |file: &'static str| ["studio", "--module", file, "-o", "studio.html"];
    shell.refuses(2, &words("x.wasm"), &["it is no WebAssembly module"]);
    shell.refuses(2, &words("absent.wasm"), &["absent.wasm"]);
    let shell = Shell::new().with(
        "h.whip",
        &std::fs::read_to_string(bundled("hammond.whip")).expect("a program"),
    );
    shell.ends(0, &["build", "h.whip", "-o", "h.wasm"]);
    shell.refuses(2, &words("h.wasm"), &["something else than WASI"]);
}

/// Plays a script in a page; what it returns.
fn play(node: &Path, chromium: &Path, page: &Path, script: &Path) -> Value {
    let ran = Command::new(node)
        .arg(root().join("tests/it/playable/drive.mjs"))
        .arg(chromium)
        .args([page, script])
        .output()
        .expect("node starts");
    let told: Value = serde_json::from_slice(&ran.stdout)
        .unwrap_or_else(|e| panic!("{e}: {}", String::from_utf8_lossy(&ran.stderr)));
    assert_eq!(told["heard"], json!([]), "{told}");
    assert_eq!(told["exception"], Value::Null, "{told}");
    told["value"].clone()
}

#[test]
fn a_browser_writes_mends_plays_and_builds() {
    let tools = ["node", "chromium"].map(whippen_need::tool);
    let ([Some(node), Some(chromium)], Some(module)) = (tools, whippen_need::module()) else {
        return;
    };
    let shell = Shell::new();
    let page = studio(&shell, &module);
    let size = std::fs::metadata(&page).expect("a page").len();
    assert!(size < 6_000_000, "{size} bytes");
    let value = play(&node, &chromium, &page, &scripts().join("write.js"));
    judge(&shell, &value);
}

#[test]
fn axe_core_finds_nothing() {
    let tools = ["node", "chromium"].map(whippen_need::tool);
    let ([Some(node), Some(chromium)], Some(module)) = (tools, whippen_need::module()) else {
        return;
    };
    let Some(axe) = whippen_need::npm("axe-core/axe.min.js") else {
        return;
    };
    let read = |path: &Path| std::fs::read_to_string(path).expect("a script");
    let script = format!("{}\n{}", read(&axe), read(&scripts().join("judge.js")));
    let shell = Shell::new().with("script.js", &script);
    let page = studio(&shell, &module);
    let found = play(&node, &chromium, &page, &shell.path("script.js"));
    assert_eq!(found["right"], json!([]), "{found}");
    assert_eq!(found["wrong"], json!([]), "{found}");
    let planted = found["planted"].to_string();
    assert!(planted.contains("image-alt"), "{found}");
}

#[test]
fn a_browser_without_webassembly_is_told_so() {
    let tools = ["node", "chromium"].map(whippen_need::tool);
    let ([Some(node), Some(chromium)], Some(module)) = (tools, whippen_need::module()) else {
        return;
    };
    let shell = Shell::new();
    let page = std::fs::read_to_string(studio(&shell, &module)).expect("a page");
    let refused = "<head>\n<script>delete globalThis.WebAssembly;</script>";
    let shell = shell
        .with("refused.html", &page.replacen("<head>", refused, 1))
        .with(
            "script.js",
            "const status = document.querySelector('#status');\n\
             for (let n = 0; n < 600 && status.textContent.includes('begins'); n++) await after(50);\n\
             return status.textContent;",
        );
    let script = shell.path("script.js");
    let said = play(&node, &chromium, &shell.path("refused.html"), &script);
    let said = said.as_str().unwrap_or_default();
    assert!(said.contains("The compiler cannot begin"), "{said}");
    assert!(said.contains("needs WebAssembly"), "{said}");
}

/// What happened in the page is what had to.
fn judge(shell: &Shell, value: &Value) {
    let text = |name: &str| value[name].as_str().unwrap_or_default().to_string();
    let count = |name: &str| value[name].as_u64().unwrap_or_default();
    assert!(text("version").starts_with("whippen "), "{value}");
    assert!(
        count("cores") >= 2 && text("fits").contains("keys fit"),
        "{value}"
    );
    assert!(count("cycles") > 3 && count("coloured") > 4, "{value}");
    assert_eq!(value["isFirst"], true, "{value}");
    assert!(count("megabyte") > 1_000_000, "{value}");
    assert!(text("tooLong").contains("longer than"), "{value}");
    assert!(!text("empty").contains("panicked"), "{value}");
    assert!(text("mistake").contains("WH"), "{value}");
    assert!(
        count("underlined") > 0 && value["disabled"] == true,
        "{value}"
    );
    assert!(text("explained").contains("WH"), "{value}");
    assert_eq!(text("fix"), "Write param", "{value}");
    assert!(text("alt").contains("hammond"), "{value}");
    assert!(
        value["played"]["events"]
            .as_str()
            .is_some_and(|events| events.contains("note")),
        "{value}"
    );
    assert!(count("hash") > 100, "{value}");
    assert_eq!(value["wide"], true, "{value}");
    let hammond = bundled("hammond.whip");
    std::fs::copy(hammond, shell.path("hammond.whip")).expect("a copy");
    let build = |file: &str| {
        shell.ends(
            0,
            &[
                "build",
                "hammond.whip",
                "--board",
                "rp2350",
                "--keys",
                "8",
                "-o",
                file,
            ],
        );
        std::fs::read(shell.path(file)).expect("is built")
    };
    let uf2 = STANDARD.decode(text("uf2")).expect("base64");
    assert!(uf2 == build("hammond.uf2"), "the firmware differs");
    assert!(
        text("c").as_bytes() == build("hammond.c"),
        "the C text differs"
    );
}
