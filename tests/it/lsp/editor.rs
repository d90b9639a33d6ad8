//! An editor: the real command, spoken to by the protocol.

use std::io::{BufRead, BufReader, Write};
use std::process::{Child, ChildStdin, Command, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::thread;
use std::time::Duration;

use serde_json::{Value, json};
use tempfile::TempDir;

/// Longer than any answer takes.
const PATIENCE: Duration = Duration::from_secs(30);

/// An editor with a folder to work in.
pub struct Editor {
    pub folder: TempDir,
    /// Its user's own folder for what can be made again, and the folder that all users share.
    pub cache: TempDir,
    pub shared: TempDir,
    pub server: Child,
    pub input: Option<ChildStdin>,
    /// What its semantic tokens are.
    pub legend: Value,
    output: Receiver<Value>,
    id: i64,
}

impl Editor {
    /// An editor that says nothing of what it can.
    pub fn new() -> Editor {
        Editor::with(json!({}), Value::Null)
    }

    /// An editor that can do this, with these options.
    pub fn with(capabilities: Value, options: Value) -> Editor {
        let mut command = Command::new(env!("CARGO_BIN_EXE_whippen"));
        let new_folder = || tempfile::tempdir().expect("a temporary folder");
        let (folder, cache, shared) = (new_folder(), new_folder(), new_folder());
        let mut server = command
            .arg("lsp")
            .env("XDG_CACHE_HOME", cache.path())
            .env("TMPDIR", shared.path())
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .expect("starts");
        let mut stdout = BufReader::new(server.stdout.take().expect("piped"));
        let (sender, output) = channel();
        thread::spawn(move || {
            while let Some(message) = message(&mut stdout) {
                if sender.send(message).is_err() {
                    break;
                }
            }
        });
        let input = server.stdin.take();
        let mut editor = Editor {
            folder,
            cache,
            shared,
            server,
            input,
            legend: Value::Null,
            output,
            id: 0,
        };
        let params = json!({ "capabilities": capabilities, "initializationOptions": options });
        let answer = editor.ask("initialize", params);
        let tokens = &answer["result"]["capabilities"]["semanticTokensProvider"];
        editor.legend = tokens["legend"].clone();
        assert_eq!(answer["result"]["serverInfo"]["name"], "whippen");
        editor.tell("initialized", json!({}));
        editor
    }

    pub fn raw(&mut self, bytes: &[u8]) {
        let input = self.input.as_mut().expect("open");
        input
            .write_all(bytes)
            .and_then(|()| input.flush())
            .expect("the server listens");
    }

    pub fn send(&mut self, message: &Value) {
        let text = message.to_string();
        self.raw(format!("Content-Length: {}\r\n\r\n{text}", text.len()).as_bytes());
    }

    pub fn tell(&mut self, method: &str, params: Value) {
        self.send(&json!({ "jsonrpc": "2.0", "method": method, "params": params }));
    }

    pub fn next(&self) -> Value {
        self.output.recv_timeout(PATIENCE).expect("an answer")
    }

    /// Asks and waits for the whole answer.
    pub fn ask(&mut self, method: &str, params: Value) -> Value {
        self.id += 1;
        self.send(&json!({ "jsonrpc": "2.0", "id": self.id, "method": method, "params": params }));
        loop {
            let message = self.next();
            if message["id"] == self.id {
                return message;
            }
        }
    }

    pub fn uri(&self, name: &str) -> String {
        format!("file://{}", self.folder.path().join(name).display())
    }

    /// Opens a document and gives its diagnostics.
    pub fn open(&mut self, name: &str, text: &str) -> Vec<Value> {
        let uri = self.uri(name);
        self.tell(
            "textDocument/didOpen",
            json!({ "textDocument": { "uri": uri, "languageId": "whip", "version": 1, "text": text } }),
        );
        self.diagnostics(name, 1)
    }

    /// The next diagnostics of a document in this version.
    pub fn diagnostics(&self, name: &str, version: i64) -> Vec<Value> {
        loop {
            let message = self.next();
            let params = &message["params"];
            let published = message["method"] == "textDocument/publishDiagnostics";
            if published && params["uri"] == self.uri(name) && params["version"] == version {
                return params["diagnostics"].as_array().expect("a list").clone();
            }
        }
    }

    /// Asks about the place of the n-th occurrence (from 0) of `words`, so many characters into it.
    pub fn at(&mut self, method: &str, name: &str, place: Value, more: Value) -> Value {
        let mut params = json!({ "textDocument": { "uri": self.uri(name) }, "position": place });
        more.as_object()
            .into_iter()
            .flatten()
            .for_each(|(k, v)| params[k] = v.clone());
        let answer = self.ask(&format!("textDocument/{method}"), params);
        assert!(answer.get("error").is_none(), "{method}: {answer}");
        answer["result"].clone()
    }

    pub fn hover(&mut self, name: &str, place: Value) -> String {
        self.at("hover", name, place, json!({}))["contents"]["value"]
            .as_str()
            .unwrap_or_default()
            .to_string()
    }

    pub fn labels(&mut self, name: &str, place: Value) -> Vec<String> {
        let items = self.at("completion", name, place, json!({}));
        items
            .as_array()
            .expect("a list")
            .iter()
            .map(|i| i["label"].as_str().expect("text").to_string())
            .collect()
    }

    /// Ends the server as the protocol says.
    pub fn end(mut self) {
        assert!(self.ask("shutdown", Value::Null)["result"].is_null());
        self.tell("exit", Value::Null);
        assert_eq!(self.server.wait().expect("ends").code(), Some(0));
    }
}

impl Drop for Editor {
    fn drop(&mut self) {
        let _ = self.server.kill();
        let _ = self.server.wait();
    }
}

fn message(input: &mut impl BufRead) -> Option<Value> {
    let mut length = 0;
    loop {
        let mut line = String::new();
        if input.read_line(&mut line).ok()? == 0 {
            return None;
        }
        match line.trim().strip_prefix("Content-Length: ") {
            Some(value) => length = value.parse().ok()?,
            None if line.trim().is_empty() => break,
            None => {}
        }
    }
    let mut body = vec![0; length];
    input.read_exact(&mut body).ok()?;
    serde_json::from_slice(&body).ok()
}
