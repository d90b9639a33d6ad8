//! Kernels played by the interpreter, and their modules by node: memory is the same.

use std::process::Command;

use serde_json::Value;
use whippen_kernel::{Interp, Kernel, Memory};
use whippen_wasm::{Module, module};

/// Cases for node, and what it must find.
#[derive(Default)]
pub struct Cases {
    script: Vec<u8>,
    expected: Vec<Dump>,
}

/// Memory after a step.
struct Dump {
    name: String,
    parts: Vec<(&'static str, Vec<u8>)>,
}

/// A module beside the interpreter.
pub struct Case<'a> {
    name: String,
    interp: Interp,
    module: Module,
    steps: Vec<u8>,
    count: u32,
    expected: &'a mut Vec<Dump>,
    outputs: Vec<i16>,
}

fn bytes_of<T: Copy, const N: usize>(all: &[T], bytes: impl Fn(T) -> [u8; N]) -> Vec<u8> {
    all.iter().flat_map(|one| bytes(*one)).collect()
}

/// The parts of memory whose places never change, by name.
fn parts(memory: &Memory, outputs: &[i16]) -> Vec<(&'static str, Vec<u8>)> {
    let clock = [memory.clock.tick, memory.clock.events, memory.clock.lost];
    vec![
        ("outputs", bytes_of(outputs, i16::to_le_bytes)),
        ("lives", bytes_of(&memory.lives, i32::to_le_bytes)),
        ("columns", bytes_of(&memory.columns, u32::to_le_bytes)),
        ("narrow", bytes_of(&memory.narrow, u16::to_le_bytes)),
        ("wide", bytes_of(&memory.wide, i32::to_le_bytes)),
        ("rings", bytes_of(&memory.rings, u32::to_le_bytes)),
        ("clock", bytes_of(&clock, u64::to_le_bytes)),
        ("probes", bytes_of(&memory.probes, i64::to_le_bytes)),
    ]
}

impl Case<'_> {
    fn step(&mut self, kind: u32, words: &[u32], bytes: &[u8]) {
        self.count += 1;
        self.steps.extend(kind.to_le_bytes());
        self.steps.extend(bytes_of(words, u32::to_le_bytes));
        self.steps.extend(bytes);
    }

    /// A step that runs, and what memory has then.
    pub fn run(&mut self, is_tick: bool, words: &[u16]) {
        let bytes = bytes_of(words, u16::to_le_bytes);
        self.step(u32::from(is_tick), &[bytes.len() as u32], &bytes);
        if is_tick {
            self.interp.tick(words, &mut self.outputs);
        } else {
            self.interp.init(words);
        }
        let memory = self.interp.memory();
        let mut parts = parts(memory, &self.outputs);
        let kept = memory.clock.events as usize * memory.layout.event_words;
        let events = bytes_of(&memory.events[..kept], u32::to_le_bytes);
        parts.push(("events", events));
        let what = if is_tick { "tick" } else { "init" };
        let name = format!("{}, {what} {}", self.name, memory.tick());
        self.expected.push(Dump { name, parts });
    }

    pub fn set_live(&mut self, live: usize, value: i32) {
        self.step(2, &[live as u32, value as u32], &[]);
        self.interp.set_live(live, value).expect("in range");
    }

    pub fn drain(&mut self) {
        self.step(3, &[], &[]);
        self.interp.drain_events();
    }
}

impl Cases {
    /// Adds what is done with a kernel.
    pub fn add(
        &mut self,
        name: String,
        kernel: &Kernel,
        keys: usize,
        play: impl FnOnce(&mut Case),
    ) {
        let module =
            module(kernel, keys, Value::Null).unwrap_or_else(|error| panic!("{name}: {error}"));
        let interp = Interp::new(kernel, keys).expect("verifies");
        let outputs = vec![0; keys * kernel.outputs.len()];
        let mut case = Case {
            name,
            interp,
            module,
            steps: Vec::new(),
            count: 0,
            expected: &mut self.expected,
            outputs,
        };
        play(&mut case);
        let (bytes, map) = (&case.module.bytes, &case.module.map);
        let memory = case.interp.memory();
        let starts = [
            map.outputs,
            map.lives,
            map.columns,
            map.narrow,
            map.wide,
            map.rings,
            map.clock,
            map.probes,
        ];
        let lens = parts(memory, &case.outputs).into_iter();
        let ranges = starts
            .into_iter()
            .zip(lens.map(|(_, bytes)| bytes.len() as u32));
        let event_bytes = 4 * map.event_words;
        let mut words = vec![starts.len() as u32];
        words.extend(ranges.flat_map(|(at, len)| [at, len]));
        words.extend([
            map.clock,
            map.events,
            event_bytes,
            map.inputs,
            map.lives,
            case.count,
        ]);
        self.script.extend((bytes.len() as u32).to_le_bytes());
        self.script.extend(bytes);
        self.script.extend(bytes_of(&words, u32::to_le_bytes));
        self.script.extend(&case.steps);
    }

    /// Lets node judge.
    pub fn judge(&self) {
        let Some(node) = whippen_need::tool("node") else {
            return;
        };
        let folder = tempfile::tempdir().expect("a folder");
        let [cases, found] = ["cases", "found"].map(|name| folder.path().join(name));
        std::fs::write(&cases, &self.script).expect("written");
        let judge = folder.path().join("judge.mjs");
        std::fs::write(&judge, include_str!("judge.mjs")).expect("written");
        let ran = Command::new(node)
            .arg(judge)
            .arg(&cases)
            .arg(&found)
            .output();
        let ran = ran.expect("node starts");
        assert!(
            ran.status.success(),
            "{}",
            String::from_utf8_lossy(&ran.stderr)
        );
        let found = std::fs::read(&found).expect("written by node");
        let mut at = 0;
        for dump in &self.expected {
            for (part, expected) in &dump.parts {
                let end = at + expected.len();
                let own = found.get(at..end).unwrap_or_default();
                assert!(own == expected, "{}: {part}", dump.name);
                at = end;
            }
        }
        assert_eq!(at, found.len(), "node wrote more");
    }
}
