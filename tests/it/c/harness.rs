//! Runs kernels in C and by the interpreter on the same words. Many kernels go into one program: it reads all words from
//! its input and writes everything it sees to its output.

use std::fmt::Write as _;
use std::io::Write as _;
use std::process::{Command, Stdio};

use whippen_compiler::c::{Layout, Names, Options, source};
use whippen_compiler::kernel::random::{self, Rng};
use whippen_compiler::kernel::{Happened, Interp, Kernel, Type, verify};

/// A C compiler with its flags.
pub struct Compiler {
    name: &'static str,
    flags: Vec<String>,
}

/// The compilers that are installed; which are not is said.
pub fn compilers(flags: &[&str]) -> Vec<Compiler> {
    let installed = |name: &&str| {
        let answer = Command::new(name).arg("--version").stdout(Stdio::null()).stderr(Stdio::null()).status();
        let there = answer.is_ok_and(|status| status.success());
        if !there {
            println!("skipped: {name} is absent");
        }
        there
    };
    let flags: Vec<String> = flags.iter().map(ToString::to_string).collect();
    ["gcc", "clang"].into_iter().filter(installed).map(|name| Compiler { name, flags: flags.clone() }).collect()
}

/// A kernel and what it is fed.
pub struct Case {
    kernel: Kernel,
    options: Options,
    ticks: Vec<Tick>,
}

/// Words of a tick; before it a live value may change.
struct Tick {
    live: Option<(usize, i32)>,
    words: Vec<u16>,
}

impl Case {
    /// Three keys for eight ticks, with words that look for corners.
    pub fn random(kernel: Kernel, layout: Layout, rng: &mut Rng) -> Case {
        let mut tick = |at: usize| {
            let live = at % kernel.lives.len();
            let value = rng.interesting(kernel.lives[live].range) as i32;
            Tick { live: Some((live, value)), words: random::inputs(rng, &kernel, 3) }
        };
        let ticks = (0..8).map(&mut tick).collect();
        Case { ticks, options: Options { keys: 3, layout, events: 64 }, kernel }
    }

    /// Five keys that hear a motion at different times.
    pub fn played(kernel: Kernel, layout: Layout, words: &[u16]) -> Case {
        let at = |tick: usize| (0..5).map(|key| words[(tick + key * 997) % words.len()]).collect();
        let ticks = (0..words.len()).map(|tick| Tick { live: None, words: at(tick) }).collect();
        Case { kernel, options: Options { keys: 5, layout, events: 64 }, ticks }
    }

    /// What the program reads.
    fn input(&self, bytes: &mut Vec<u8>) {
        for tick in &self.ticks {
            let (live, value) = tick.live.map_or((-1, 0), |(live, value)| (live as i32, value));
            bytes.extend([live.to_le_bytes(), value.to_le_bytes()].concat());
            bytes.extend(tick.words.iter().flat_map(|word| word.to_le_bytes()));
        }
    }

    /// What it must write, by the interpreter.
    fn expected(&self) -> Vec<u8> {
        let keys = self.options.keys;
        let mut interp = Interp::new(&self.kernel, keys).unwrap_or_else(|e| panic!("{}: {e}", self.kernel.name));
        let (mut bytes, mut out) = (Vec::new(), vec![0i16; keys * self.kernel.outputs.len()]);
        for (at, tick) in self.ticks.iter().enumerate() {
            if at == 0 {
                interp.init(&tick.words);
            }
            if let Some((live, value)) = tick.live {
                interp.set_live(live, value).expect("in range");
            }
            interp.tick(&tick.words, &mut out);
            bytes.extend(out.iter().flat_map(|word| word.to_le_bytes()));
            bytes.extend(interp.probes().iter().flat_map(|value| value.to_le_bytes()));
            events(&mut bytes, interp.drain_events(), self.options.events);
        }
        for key in 0..keys {
            for (index, cell) in self.kernel.cells.iter().enumerate() {
                let word = |word| interp.cell(key, index, word as usize).expect("a word").to_le_bytes();
                bytes.extend((0..cell.len).flat_map(word));
            }
        }
        bytes
    }

    /// The kernel and a function that feeds it, in C.
    fn program(&self, number: usize) -> String {
        let kernel = verify(&self.kernel).unwrap_or_else(|e| panic!("{}: {e:?}", self.kernel.name));
        let Options { keys, layout, .. } = self.options;
        let (names, text) = (Names::new(&self.kernel), source(kernel, self.options));
        let name = &names.kernel;
        // Several cases may share a kernel's name.
        let rename = |text: &str| text.replace(name.as_str(), &format!("{name}_{number}"));
        let capitals = |text: String| text.replace(&names.capitals, &format!("{}_{number}", names.capitals));
        let mut lives = String::new();
        for (index, live) in names.lives.iter().enumerate() {
            let _ = writeln!(lives, "if (set[0] == {index}) {{ s->{live} = set[1]; }}");
        }
        let mut cells = String::new();
        for (cell, field) in self.kernel.cells.iter().zip(&names.cells) {
            let word = if cell.len > 1 { "[i]" } else { "" };
            let place = match layout {
                Layout::Records => format!("key[k].{field}{word}"),
                Layout::Columns => format!("{field}{word}[k]"),
            };
            let ty = if cell.ty == Type::I64 { "int64_t" } else { "int32_t" };
            let _ = writeln!(
                cells,
                "for (int i = 0; i < {}; i++) {{ {ty} own = s->{place}; int64_t v = own; put(&v, 8); }}",
                cell.len
            );
        }
        let probes = if self.kernel.probes.is_empty() { "" } else { "put(s->probes, sizeof s->probes);" };
        let (ins, outs, ticks) = (keys * self.kernel.inputs.len(), keys * self.kernel.outputs.len(), self.ticks.len());
        let feed = format!(
            "static {name}_state state_{number};
static void run_{number}(void) {{
    {name}_state *s = &state_{number};
    static uint16_t in[{ins} + 1]; static int16_t out[{outs} + 1]; int32_t set[2];
    {name}_defaults(s);
    for (int t = 0; t < {ticks}; t++) {{
        get(set, 8); get(in, 2 * {ins});
        if (t == 0) {name}_init(s, in);
        {lives}
        {name}_tick(s, in, out);
        put(out, 2 * {outs}); {probes}
        put(&s->events, 4); put(&s->lost, 8); s->lost = 0;
        for (uint32_t e = 0; e < s->events; e++) {{
            {name}_event *h = &s->event[e];
            put(&h->tick, 8); put(&h->key, 4); put(&h->event, 4); put(h->args, 4 * args_{number}[h->event]);
        }}
        s->events = 0;
    }}
    for (int k = 0; k < {keys}; k++) {{
{cells}    }}
}}
"
        );
        let counts: Vec<String> = self.kernel.events.iter().map(|event| event.args.to_string()).collect();
        let counts = format!("static const int args_{number}[] = {{ {} 0 }};\n", counts.join(", ") + ", ");
        let counts = counts.replace("{ , ", "{ ");
        capitals(rename(&format!("{}{}", text.header, text.body)) + &counts + &rename(&feed))
    }
}

/// Events as the program writes them: those that fit, how many were lost, then each.
fn events(bytes: &mut Vec<u8>, all: Vec<Happened>, room: usize) {
    bytes.extend((all.len().min(room) as u32).to_le_bytes());
    bytes.extend((all.len().saturating_sub(room) as u64).to_le_bytes());
    for event in all.into_iter().take(room) {
        bytes.extend(event.tick.to_le_bytes());
        bytes.extend([event.key.to_le_bytes(), event.event.to_le_bytes()].concat());
        bytes.extend(event.args.iter().flat_map(|arg| arg.to_le_bytes()));
    }
}

const PRELUDE: &str = "\
#include <stdio.h>
#include <stdlib.h>
#include <stdint.h>
static void get(void *to, size_t n) { if (n && fread(to, n, 1, stdin) != 1) exit(3); }
static void put(const void *from, size_t n) { if (n && fwrite(from, n, 1, stdout) != 1) exit(4); }
";

/// Compiles all cases into one program, runs it, and compares what it writes with what the interpreter says.
pub fn agree(compiler: &Compiler, cases: &[Case]) {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let (text, binary) = (folder.path().join("kernels.c"), folder.path().join("kernels"));
    let mut program = PRELUDE.to_string();
    let mut main = "int main(void) {\n".to_string();
    for (number, case) in cases.iter().enumerate() {
        program += &case.program(number);
        let _ = writeln!(main, "    run_{number}();");
    }
    std::fs::write(&text, program + &main + "    return 0;\n}\n").expect("writable");
    let built = Command::new(compiler.name).args(&compiler.flags).arg(&text).arg("-o").arg(&binary).output();
    let built = built.unwrap_or_else(|e| panic!("{}: {e}", compiler.name));
    let (name, flags) = (compiler.name, compiler.flags.join(" "));
    assert!(built.status.success(), "{name} {flags}:\n{}", String::from_utf8_lossy(&built.stderr));

    let mut input = Vec::new();
    cases.iter().for_each(|case| case.input(&mut input));
    let mut child = Command::new(&binary)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("runs");
    let mut pipe = child.stdin.take().expect("piped");
    let writer = std::thread::spawn(move || pipe.write_all(&input));
    let output = child.wait_with_output().expect("ends");
    let written = writer.join().expect("a thread");
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{name} {flags}: {}\n{said}", output.status);
    written.expect("all was read");
    compare(&format!("{name} {flags}"), cases, &output.stdout);
    println!("{name} {flags}: {} kernels agree", cases.len());
}

fn compare(compiler: &str, cases: &[Case], mut found: &[u8]) {
    for case in cases {
        let expected = case.expected();
        let (own, rest) = found.split_at(expected.len().min(found.len()));
        let differs = own.iter().zip(&expected).position(|(a, b)| a != b);
        let shape = (case.options.layout, own.len(), expected.len());
        assert!(
            differs.is_none() && own.len() == expected.len(),
            "{compiler}: C and interp differ at byte {differs:?} of {shape:?}\n{}",
            case.kernel
        );
        found = rest;
    }
    assert!(found.is_empty(), "{compiler}: {} bytes too many", found.len());
}
