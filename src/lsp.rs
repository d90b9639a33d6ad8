//! The language server: what an editor asks about a program while it is typed.
//!
//! ```text
//!   stdin -- wire --> server -- world (open documents, files beside them) -- analysis (one program, one index)
//!                       |  |                                                     |
//!   stdout <------------+--|-- diagnostics, hover, navigate, complete, signature, tokens, inline
//!                          |                                                     |
//!                          +-- prover (its own thread) -- cost (the proof of `whippen budget`)
//! ```
//!
//! A program is small and a full check takes milliseconds, so nothing is kept up to date by parts:
//! after a change every open document is analysed anew, once the editor has nothing further to say.
//! Only the proof of cycles takes longer: it is made beside, and then the editor is told.
//!
//! Not here: what the compiler knows (`whippen_compiler`), the protocol's types (`lsp-types`).

mod actions;
mod analysis;
mod complete;
mod cost;
mod diagnostics;
mod hover;
mod inline;
mod navigate;
mod prover;
mod server;
mod signature;
mod text;
mod tokens;
pub mod uri;
mod wire;
mod words;
mod world;

use std::io::{self, BufReader};
use std::sync::mpsc;
use std::thread;

use lsp_server::Message;

use crate::exit::{Failure, Outcome};
use prover::Proven;
use server::{Next, Server};

/// What the server hears of.
enum Heard {
    /// A message of the editor, or why it is none.
    Editor(Result<Message, String>),
    /// The end of what the editor says.
    HungUp,
    /// A proof that was asked for.
    Proven(Proven),
}

/// Serves one editor over stdin and stdout until it says `exit` or hangs up.
pub fn serve() -> Outcome {
    if cfg!(target_family = "wasm") {
        return serve_alone();
    }
    let (sender, receiver) = mpsc::channel();
    let proofs = sender.clone();
    let mut server = Server::new(prover::start(move |proven| {
        proofs.send(Heard::Proven(proven)).is_ok()
    }));
    thread::spawn(move || {
        let mut input = BufReader::new(io::stdin());
        while let Some(message) = wire::read(&mut input) {
            if sender.send(Heard::Editor(message)).is_err() {
                return;
            }
        }
        let _ = sender.send(Heard::HungUp);
    });
    let mut waiting = receiver.recv().ok();
    while let Some(heard) = waiting {
        match heard {
            Heard::Editor(Ok(message)) => match server.handle(message) {
                Next::Go => {}
                Next::Exit(true) => return Ok(()),
                Next::Exit(false) => return Err(Failure::Program),
            },
            Heard::Editor(Err(why)) => server.complain(&why),
            Heard::HungUp => break,
            Heard::Proven(proven) => server.proven(proven),
        }
        // What was typed meanwhile comes first: diagnostics are for the last state.
        waiting = match receiver.try_recv() {
            Ok(next) => Some(next),
            Err(_) => {
                server.publish();
                send(server.take())?;
                receiver.recv().ok()
            }
        };
    }
    send(server.take())
}

/// The same on one thread, as a module in a browser has it: messages are answered in their order
/// until there are no more, and no costs are proven.
fn serve_alone() -> Outcome {
    let (jobs, _nobody) = mpsc::channel();
    let mut server = Server::new(jobs);
    let mut input = BufReader::new(io::stdin());
    while let Some(message) = wire::read(&mut input) {
        match message.map(|message| server.handle(message)) {
            Ok(Next::Go) => {}
            Ok(Next::Exit(true)) => return Ok(()),
            Ok(Next::Exit(false)) => return Err(Failure::Program),
            Err(why) => server.complain(&why),
        }
        server.publish();
        send(server.take())?;
    }
    send(server.take())
}

fn send(messages: Vec<Message>) -> Outcome {
    let mut output = io::stdout().lock();
    messages
        .into_iter()
        .try_for_each(|message| message.write(&mut output))
        .map_err(|e| Failure::Usage(format!("the editor does not listen any more: {e}")))
}
