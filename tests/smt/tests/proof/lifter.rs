//! The second source of what instructions mean: p-code, from Ghidra's description of the processor.

use std::collections::HashMap;
use std::io::{BufRead, BufReader, Write as _};
use std::path::Path;
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};
use std::rc::Rc;

/// Where an operation of p-code finds or leaves a word.
#[derive(Debug, Clone, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Varnode {
    /// `register`, `unique`, `const` or `ram`.
    pub space: Rc<str>,
    pub offset: u64,
    pub bytes: u32,
}

/// An operation of p-code.
#[derive(Debug, Clone)]
pub struct Operation {
    pub name: Rc<str>,
    pub output: Option<Varnode>,
    pub inputs: Vec<Varnode>,
    /// Of `CALLOTHER` what is called.
    pub callee: Option<Rc<str>>,
}

/// What an instruction does, and how long it is.
#[derive(Debug, Clone)]
pub struct Lifted {
    pub operations: Vec<Operation>,
    pub bytes: u32,
}

/// A program that lifts.
pub struct Lifter {
    child: Child,
    to: ChildStdin,
    from: BufReader<ChildStdout>,
}

fn varnode(text: &str) -> Option<Varnode> {
    let mut parts = text.split(':');
    let (space, offset, bytes) = (parts.next()?, parts.next()?, parts.next()?);
    Some(Varnode {
        space: space.into(),
        offset: offset.parse().ok()?,
        bytes: bytes.parse().ok()?,
    })
}

fn operation(line: &str) -> Operation {
    let mut words = line.split(' ');
    let name: Rc<str> = words.next().unwrap_or_default().into();
    let output = words.next().and_then(varnode);
    let calls = &*name == "CALLOTHER";
    let callee = calls.then(|| words.next().unwrap_or_default().into());
    Operation {
        name,
        output,
        inputs: words.filter_map(varnode).collect(),
        callee,
    }
}

impl Lifter {
    /// Starts it; none, and the test counts as skipped, where it is absent.
    pub fn start() -> Option<Lifter> {
        let python = whippen_need::python("pypcode")?;
        let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/proof/lift.py");
        let mut child = Command::new(python)
            .arg(script)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .expect("Python");
        let to = child.stdin.take().expect("a pipe");
        let from = BufReader::new(child.stdout.take().expect("a pipe"));
        Some(Lifter { child, to, from })
    }

    fn lift(&mut self, address: u32, code: &[u8]) -> Lifted {
        let hex: String = code.iter().map(|byte| format!("{byte:02x}")).collect();
        writeln!(self.to, "{address} {hex}").expect("the lifter reads");
        self.to.flush().expect("the lifter reads");
        let mut operations = Vec::new();
        loop {
            let mut line = String::new();
            let read = self.from.read_line(&mut line).expect("the lifter writes");
            assert!(read > 0, "the lifter ended at {address:#x}, {hex}");
            let line = line.trim();
            if let Some(bytes) = line.strip_prefix("end ") {
                let bytes = bytes.parse().expect("a length");
                return Lifted { operations, bytes };
            }
            operations.push(operation(line));
        }
    }
}

impl Drop for Lifter {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// The code of one image, lifted where it is run. In an IT block an instruction is lifted after the
/// instruction before it.
pub struct Code<'a> {
    lifter: &'a mut Lifter,
    pieces: &'a [(u32, Vec<u8>)],
    known: HashMap<u32, Rc<Lifted>>,
}

impl<'a> Code<'a> {
    /// Pieces of code by where they run.
    pub fn new(lifter: &'a mut Lifter, pieces: &'a [(u32, Vec<u8>)]) -> Code<'a> {
        writeln!(lifter.to, "reset").expect("the lifter reads");
        Code {
            lifter,
            pieces,
            known: HashMap::new(),
        }
    }

    /// The bytes there, four at most.
    pub fn bytes(&self, address: u32) -> Option<&'a [u8]> {
        self.pieces.iter().find_map(|(from, bytes)| {
            let at = address.checked_sub(*from)? as usize;
            let left = bytes.get(at..)?;
            (left.len() >= 2).then(|| &left[..left.len().min(4)])
        })
    }

    /// The instruction there.
    pub fn at(&mut self, address: u32) -> Result<Rc<Lifted>, String> {
        if let Some(lifted) = self.known.get(&address) {
            return Ok(lifted.clone());
        }
        let bytes = self
            .bytes(address)
            .ok_or(format!("no code at {address:#x}"))?;
        let lifted = Rc::new(self.lifter.lift(address, bytes));
        self.known.insert(address, lifted.clone());
        Ok(lifted)
    }
}
