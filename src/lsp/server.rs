//! Requests and notifications: what each asks for and who answers.

use std::collections::{BTreeMap, BTreeSet};
use std::ffi::OsString;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::mpsc::Sender;

use lsp_server::{ErrorCode, Message, Notification, Request, RequestId, Response};
use lsp_types::*;
use serde_json::{Value, json};
use whippen_compiler::diag;
use whippen_compiler::syntax::layout;

use super::analysis::{Analysis, Numbers};
use super::cost::Cost;
use super::prover::{Job, Proven};
use super::world::{Document, World};
use super::{actions, complete, diagnostics, hover, inline, navigate, signature, text, tokens};

/// Whether there is anything further to do.
#[derive(Debug, PartialEq, Eq)]
pub enum Next {
    Go,
    /// The end; `true` if `shutdown` came before `exit`.
    Exit(bool),
}

/// Why a request has no answer.
type Refusal = (ErrorCode, String);

/// What one editor has said so far.
pub struct Server {
    world: World,
    costs: Costs,
    /// Of open documents, as far as they are needed since the last change.
    analyses: BTreeMap<String, Analysis>,
    numbers: BTreeMap<String, Numbers>,
    /// What rings, of documents that are as they were opened or saved; nothing while it is not
    /// known yet.
    rings: BTreeMap<String, Option<Vec<diag::Diagnostic>>>,
    /// Documents of which the editor does not know the diagnostics yet.
    stale: BTreeSet<String>,
    initialized: bool,
    shut_down: bool,
    out: Vec<Message>,
}

/// What is known of costs, where the editor shows them.
struct Costs {
    prover: Sender<Job>,
    /// Of documents as they are, as far as they are proven.
    known: BTreeMap<String, Cost>,
    /// Counts the changes of documents.
    state: u64,
    /// The board where no keyboard names one.
    board: OsString,
    is_wanted: bool,
    /// What the editor is asked to do when a proof is there.
    refreshes: Vec<&'static str>,
    /// Requests to the editor so far.
    requests: i32,
}

impl Server {
    /// A server that has its costs proven there.
    pub fn new(prover: Sender<Job>) -> Server {
        Server {
            world: World::default(),
            costs: Costs {
                prover,
                known: BTreeMap::new(),
                state: 0,
                board: OsString::from("rp2350"),
                is_wanted: false,
                refreshes: Vec::new(),
                requests: 0,
            },
            analyses: BTreeMap::new(),
            numbers: BTreeMap::new(),
            rings: BTreeMap::new(),
            stale: BTreeSet::new(),
            initialized: false,
            shut_down: false,
            out: Vec::new(),
        }
    }

    /// What is to be sent.
    pub fn take(&mut self) -> Vec<Message> {
        std::mem::take(&mut self.out)
    }

    /// Answers something that is no message. The protocol wants the id `null`, which `lsp-server`
    /// cannot write, so the editor's log is told.
    pub fn complain(&mut self, why: &str) {
        let params = LogMessageParams {
            typ: MessageType::ERROR,
            message: format!("whippen lsp: {why}"),
        };
        self.notify("window/logMessage", json!(params));
    }

    fn notify(&mut self, method: &str, params: Value) {
        self.out.push(
            Notification {
                method: method.to_string(),
                params,
            }
            .into(),
        );
    }

    pub fn handle(&mut self, message: Message) -> Next {
        match message {
            Message::Request(request) => {
                let id = request.id.clone();
                let answer = catch_unwind(AssertUnwindSafe(|| self.answer(&request)));
                let defect = |_| {
                    Err((
                        ErrorCode::InternalError,
                        format!("a defect in Whippen: {}", request.method),
                    ))
                };
                self.respond(id, answer.unwrap_or_else(defect));
            }
            Message::Notification(notification) if notification.method == "exit" => {
                return Next::Exit(self.shut_down);
            }
            Message::Notification(notification) => {
                let method = notification.method.clone();
                match catch_unwind(AssertUnwindSafe(|| self.handle_notification(notification))) {
                    Ok(Ok(())) => {}
                    Ok(Err(why)) => self.complain(&format!("{method}: {why}")),
                    Err(_) => self.complain(&format!("a defect in Whippen: {method}")),
                }
            }
            Message::Response(_) => {}
        }
        Next::Go
    }

    fn respond(&mut self, id: RequestId, answer: Result<Value, Refusal>) {
        self.out.push(match answer {
            Ok(value) => Response::new_ok(id, value).into(),
            Err((code, message)) => Response::new_err(id, code as i32, message).into(),
        });
    }

    fn answer(&mut self, request: &Request) -> Result<Value, Refusal> {
        match request.method.as_str() {
            "initialize" => {
                self.initialized = true;
                self.costs.read_wishes(&request.params);
                return Ok(json!({
                    "capabilities": capabilities(),
                    "serverInfo": { "name": "whippen", "version": env!("CARGO_PKG_VERSION") },
                }));
            }
            _ if !self.initialized => {
                return Err((
                    ErrorCode::ServerNotInitialized,
                    "`initialize` comes first".to_string(),
                ));
            }
            _ if self.shut_down => {
                return Err((ErrorCode::InvalidRequest, "it was shut down".to_string()));
            }
            "shutdown" => {
                self.shut_down = true;
                return Ok(Value::Null);
            }
            _ => {}
        }
        let params = &request.params;
        let Some(uri) = params.pointer("/textDocument/uri").and_then(Value::as_str) else {
            return Err((
                ErrorCode::MethodNotFound,
                format!("`{}` is not known", request.method),
            ));
        };
        let uri = uri.to_string();
        if !self.world.open.contains_key(&uri) {
            return Err((ErrorCode::InvalidParams, format!("`{uri}` is not open")));
        }
        self.analysis(&uri);
        let (analysis, cost) = (&self.analyses[&uri], self.costs.known.get(&uri));
        let place = |params: &Value| -> Result<Position, Refusal> { read(params.get("position")) };
        Ok(match request.method.as_str() {
            "textDocument/hover" => json!(hover::hover(analysis, place(params)?)),
            "textDocument/definition" => json!(navigate::definition(analysis, place(params)?)),
            "textDocument/references" => {
                let declaration = params
                    .pointer("/context/includeDeclaration")
                    .and_then(Value::as_bool);
                json!(navigate::references(
                    analysis,
                    place(params)?,
                    declaration.unwrap_or(true)
                ))
            }
            "textDocument/documentHighlight" => {
                let all = navigate::references(analysis, place(params)?, true).unwrap_or_default();
                let here = all.into_iter().filter(|l| l.uri.as_str() == uri);
                json!(
                    here.map(|l| DocumentHighlight {
                        range: l.range,
                        kind: None
                    })
                    .collect::<Vec<_>>()
                )
            }
            "textDocument/rename" => {
                let new: String = read(params.get("newName"))?;
                let edit = navigate::rename(analysis, place(params)?, &new);
                json!(edit.map_err(|why| (ErrorCode::RequestFailed, why))?)
            }
            "textDocument/documentSymbol" => json!(navigate::outline(analysis)),
            "textDocument/completion" => json!(complete::complete(analysis, place(params)?)),
            "textDocument/signatureHelp" => json!(signature::help(analysis, place(params)?)),
            "textDocument/codeAction" => {
                json!(actions::actions(analysis, read(params.get("range"))?))
            }
            "textDocument/codeLens" => {
                json!(cost.map_or_else(Vec::new, |cost| inline::lenses(analysis, cost)))
            }
            "textDocument/inlayHint" => {
                json!(inline::hints(analysis, cost, read(params.get("range"))?))
            }
            "textDocument/semanticTokens/full" => json!(SemanticTokens {
                result_id: None,
                data: tokens::tokens(analysis),
            }),
            "textDocument/formatting" => json!(formatting(analysis.text(0))),
            other => return Err((ErrorCode::MethodNotFound, format!("`{other}` is not known"))),
        })
    }

    /// The analysis of an open document as it is now.
    fn analysis(&mut self, uri: &str) -> &Analysis {
        let (world, numbers, rings) = (&self.world, &mut self.numbers, &mut self.rings);
        self.analyses.entry(uri.to_string()).or_insert_with(|| {
            let before = numbers.get(uri).cloned().unwrap_or_default();
            let analysis = Analysis::new(
                &world.program(uri),
                before,
                rings.get(uri).cloned().unwrap_or(Some(Vec::new())),
            );
            if let Some(known) = rings.get_mut(uri) {
                *known = Some(analysis.rings.clone());
            }
            numbers.insert(uri.to_string(), analysis.numbers.clone());
            analysis
        })
    }

    fn handle_notification(&mut self, notification: Notification) -> Result<(), String> {
        fn params<T: serde::de::DeserializeOwned>(value: Value) -> Result<T, String> {
            serde_json::from_value(value).map_err(|e| e.to_string())
        }
        match notification.method.as_str() {
            "textDocument/didOpen" => {
                let opened: DidOpenTextDocumentParams = params(notification.params)?;
                let TextDocumentItem {
                    uri, version, text, ..
                } = opened.text_document;
                self.rings.insert(uri.as_str().to_string(), None);
                self.world
                    .open
                    .insert(uri.as_str().to_string(), Document { text, version });
                self.changed();
            }
            "textDocument/didChange" => {
                let changed: DidChangeTextDocumentParams = params(notification.params)?;
                let uri = changed.text_document.uri.as_str();
                let document = self
                    .world
                    .open
                    .get_mut(uri)
                    .ok_or_else(|| format!("`{uri}` is not open"))?;
                document.version = changed.text_document.version;
                self.rings.remove(uri);
                changed
                    .content_changes
                    .into_iter()
                    .for_each(|change| text::apply(&mut document.text, change));
                self.changed();
            }
            "textDocument/didClose" => {
                let closed: DidCloseTextDocumentParams = params(notification.params)?;
                let uri = closed.text_document.uri.as_str();
                self.world.open.remove(uri);
                self.rings.remove(uri);
                self.numbers.remove(uri);
                self.notify(
                    "textDocument/publishDiagnostics",
                    json!({ "uri": uri, "diagnostics": [] }),
                );
                self.changed();
            }
            "textDocument/didSave" => {
                let saved: DidSaveTextDocumentParams = params(notification.params)?;
                self.rings
                    .insert(saved.text_document.uri.as_str().to_string(), None);
                self.changed();
            }
            // A file beside the open ones may have changed.
            "workspace/didChangeWatchedFiles" => self.changed(),
            _ => {}
        }
        Ok(())
    }

    /// Every open document may use what has changed.
    fn changed(&mut self) {
        self.analyses.clear();
        self.costs.known.clear();
        self.costs.state += 1;
        self.stale = self.world.open.keys().cloned().collect();
    }

    /// Tells the diagnostics of all documents that may have changed.
    pub fn publish(&mut self) {
        for uri in std::mem::take(&mut self.stale) {
            let found = catch_unwind(AssertUnwindSafe(|| {
                diagnostics::diagnostics(self.analysis(&uri))
            }));
            let version = self.world.open.get(&uri).map(|document| document.version);
            match found {
                Ok(found) => self.notify(
                    "textDocument/publishDiagnostics",
                    json!({ "uri": uri, "version": version, "diagnostics": found }),
                ),
                Err(_) => self.complain(&format!("a defect in Whippen: the analysis of `{uri}`")),
            }
            if self.costs.is_wanted {
                self.ask_cost(uri);
            }
        }
    }

    /// Has the cost of a program proven that is right.
    fn ask_cost(&self, uri: String) {
        let known = self.analyses.get(&uri);
        let is_right = |analysis: &Analysis| {
            let mut all = analysis.diagnostics.iter();
            all.all(|found| found.code.severity() != diag::Severity::Error)
        };
        if known.is_some_and(is_right) {
            // Where the prover is gone there are no costs.
            let _ = self.costs.prover.send(Job {
                program: self.world.program(&uri),
                uri,
                state: self.costs.state,
                board: self.costs.board.clone(),
            });
        }
    }

    /// Takes over what was proven, unless something was typed meanwhile.
    pub fn proven(&mut self, proven: Proven) {
        if proven.state != self.costs.state {
            return;
        }
        match proven.cost {
            Ok(cost) => drop(self.costs.known.insert(proven.uri, cost)),
            Err(why) => return self.complain(&why),
        }
        for method in self.costs.refreshes.clone() {
            self.costs.requests += 1;
            self.out.push(
                Request {
                    id: RequestId::from(self.costs.requests),
                    method: method.to_string(),
                    params: Value::Null,
                }
                .into(),
            );
        }
    }
}

impl Costs {
    /// What the editor shows of costs, and on which board they are.
    fn read_wishes(&mut self, initialize: &Value) {
        let has = |place: &str| {
            initialize
                .pointer(place)
                .is_some_and(|value| !value.is_null())
        };
        self.is_wanted = has("/capabilities/textDocument/codeLens")
            || has("/capabilities/textDocument/inlayHint");
        for (what, method) in [
            ("codeLens", "workspace/codeLens/refresh"),
            ("inlayHint", "workspace/inlayHint/refresh"),
        ] {
            let place = format!("/capabilities/workspace/{what}/refreshSupport");
            if initialize.pointer(&place) == Some(&Value::Bool(true)) {
                self.refreshes.push(method);
            }
        }
        let board = initialize.pointer("/initializationOptions/board");
        if let Some(board) = board
            .and_then(Value::as_str)
            .filter(|name| !name.is_empty())
        {
            self.board = OsString::from(board);
        }
    }
}

fn read<T: serde::de::DeserializeOwned>(value: Option<&Value>) -> Result<T, Refusal> {
    serde_json::from_value(value.cloned().unwrap_or_default())
        .map_err(|e| (ErrorCode::InvalidParams, e.to_string()))
}

/// One edit for the whole text; none where the text is laid out already, or cannot be read.
fn formatting(source: &str) -> Vec<TextEdit> {
    match layout(0, source) {
        Ok(laid) if laid != source => vec![TextEdit {
            range: text::whole(source),
            new_text: laid,
        }],
        _ => Vec::new(),
    }
}

fn capabilities() -> ServerCapabilities {
    let words = |words: &[&str]| Some(words.iter().map(|w| (*w).to_string()).collect());
    ServerCapabilities {
        text_document_sync: Some(TextDocumentSyncCapability::Options(
            TextDocumentSyncOptions {
                open_close: Some(true),
                change: Some(TextDocumentSyncKind::INCREMENTAL),
                save: Some(TextDocumentSyncSaveOptions::Supported(true)),
                ..TextDocumentSyncOptions::default()
            },
        )),
        hover_provider: Some(HoverProviderCapability::Simple(true)),
        definition_provider: Some(OneOf::Left(true)),
        references_provider: Some(OneOf::Left(true)),
        document_highlight_provider: Some(OneOf::Left(true)),
        rename_provider: Some(OneOf::Left(true)),
        document_symbol_provider: Some(OneOf::Left(true)),
        document_formatting_provider: Some(OneOf::Left(true)),
        code_action_provider: Some(CodeActionProviderCapability::Options(CodeActionOptions {
            code_action_kinds: Some(vec![CodeActionKind::QUICKFIX]),
            ..CodeActionOptions::default()
        })),
        completion_provider: Some(CompletionOptions {
            trigger_characters: words(&[".", " ", "*", "/"]),
            ..CompletionOptions::default()
        }),
        signature_help_provider: Some(SignatureHelpOptions {
            trigger_characters: words(&["(", ",", ":"]),
            ..SignatureHelpOptions::default()
        }),
        code_lens_provider: Some(CodeLensOptions {
            resolve_provider: Some(false),
        }),
        inlay_hint_provider: Some(OneOf::Left(true)),
        semantic_tokens_provider: Some(
            SemanticTokensOptions {
                legend: tokens::legend(),
                full: Some(SemanticTokensFullOptions::Bool(true)),
                ..SemanticTokensOptions::default()
            }
            .into(),
        ),
        ..ServerCapabilities::default()
    }
}
