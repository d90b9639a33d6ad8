//! A kernel and the words it is fed: in C, and what the interpreter says.

use std::fmt::Write as _;

use whippen_compiler::c99::{Layout, Names, Options, source};
use whippen_compiler::kernel::random::{self, Draw, Rng};
use whippen_compiler::kernel::{Happened, Interp, Kernel, Type, verify};

use crate::words::Words;

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
            Tick {
                live: Some((live, value)),
                words: random::inputs(rng, &kernel, 3),
            }
        };
        let ticks = (0..8).map(&mut tick).collect();
        Case {
            ticks,
            options: Options {
                keys: 3,
                layout,
                events: 64,
            },
            kernel,
        }
    }

    /// Keys that hear a motion, given by the words of all ports, at different times.
    pub fn played(kernel: Kernel, layout: Layout, words: &[u16], keys: usize) -> Case {
        let ports = kernel.inputs.len();
        let at = |tick: usize| {
            (0..keys)
                .flat_map(|key| (0..ports).map(move |port| (tick + key * 997) * ports + port))
                .map(|place| words[place % words.len()])
                .collect()
        };
        let ticks = (0..words.len() / ports)
            .map(|tick| Tick {
                live: None,
                words: at(tick),
            })
            .collect();
        Case {
            kernel,
            options: Options {
                keys,
                layout,
                events: 64,
            },
            ticks,
        }
    }

    /// One key under words and live values at random.
    pub fn noise(kernel: Kernel, layout: Layout, ticks: usize) -> Case {
        let mut random = Words::new(&kernel);
        let mut turn = |_| {
            let (live, words) = random.turn(&kernel);
            let words = words.to_vec();
            Tick { live, words }
        };
        let ticks = (0..ticks).map(&mut turn).collect();
        let options = Options {
            keys: 1,
            layout,
            events: 64,
        };
        Case {
            kernel,
            options,
            ticks,
        }
    }

    /// What the program reads.
    pub fn input(&self, bytes: &mut Vec<u8>) {
        for tick in &self.ticks {
            let (live, value) = tick
                .live
                .map_or((-1, 0), |(live, value)| (live as i32, value));
            bytes.extend([live.to_le_bytes(), value.to_le_bytes()].concat());
            bytes.extend(tick.words.iter().flat_map(|word| word.to_le_bytes()));
        }
    }

    /// What it must write, by the interpreter.
    pub fn expected(&self) -> Vec<u8> {
        let keys = self.options.keys;
        let mut interp =
            Interp::new(&self.kernel, keys).unwrap_or_else(|e| panic!("{}: {e}", self.kernel.name));
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
                let word = |word| {
                    interp
                        .cell(key, index, word as usize)
                        .expect("a word")
                        .to_le_bytes()
                };
                bytes.extend((0..cell.len).flat_map(word));
            }
        }
        bytes
    }

    /// The type of its state.
    pub fn state(&self, number: usize) -> String {
        format!("{}_{number}_state", Names::new(&self.kernel).kernel)
    }

    /// The kernel, and a function that feeds it, in C.
    pub fn program(&self, number: usize) -> (String, String) {
        let kernel = verify(&self.kernel).unwrap_or_else(|e| panic!("{}: {e:?}", self.kernel.name));
        let Options { keys, layout, .. } = self.options;
        let (names, text) = (Names::new(&self.kernel), source(kernel, self.options));
        let name = &names.kernel;
        // Several cases may share a kernel's name.
        let rename = |text: &str| text.replace(name.as_str(), &format!("{name}_{number}"));
        let capitals =
            |text: String| text.replace(&names.capitals, &format!("{}_{number}", names.capitals));
        let state = format!("{name}_state");
        let lives: String = names
            .lives
            .iter()
            .map(|live| format!("offsetof({state}, {live}), "))
            .collect();
        let mut cells = String::new();
        for (cell, field) in self.kernel.cells.iter().zip(&names.cells) {
            let bytes = if cell.ty == Type::I64 { 8 } else { 4 };
            let (at, word, key) = match layout {
                Layout::Records => (
                    format!("key[0].{field}"),
                    bytes,
                    format!("sizeof({name}_key)"),
                ),
                Layout::Columns => (field.clone(), bytes * keys, bytes.to_string()),
            };
            let _ = writeln!(
                cells,
                "    {{ offsetof({state}, {at}), {}, {bytes}, {word}, {key} }},",
                cell.len
            );
        }
        let (probes, probe_bytes) = match 8 * keys * self.kernel.probes.len() {
            0 => ("0".to_string(), 0),
            bytes => (format!("offsetof({state}, probes)"), bytes),
        };
        let (ins, outs, ticks) = (
            keys * self.kernel.inputs.len(),
            keys * self.kernel.outputs.len(),
            self.ticks.len(),
        );
        let args: String = self
            .kernel
            .events
            .iter()
            .map(|event| format!("{}, ", event.args))
            .collect();
        let feed = format!(
            "static const struct cell cells_{number}[] = {{
{cells}    {{ 0 }} }};
static const size_t lives_{number}[] = {{ {lives}0 }};
static const int args_{number}[] = {{ {args}0 }};
static const struct kernel kernel_{number} = {{
    {ticks}, {keys}, {count}, {in_bytes}, {out_bytes}, {probe_bytes}, sizeof({name}_event),
    {probes}, offsetof({state}, events), offsetof({state}, lost), offsetof({state}, event),
    cells_{number}, lives_{number}, args_{number} }};
static void run_{number}({state} *s)
{{
    {name}_defaults(s);
    for (int t = 0; t < {ticks}; t++) {{
        before(&kernel_{number});
        if (t == 0) {name}_init(s, in);
        turn(s, &kernel_{number});
        {name}_tick(s, in, out);
        after(s, &kernel_{number});
    }}
    at_last(s, &kernel_{number});
}}
",
            count = self.kernel.cells.len(),
            in_bytes = 2 * ins,
            out_bytes = 2 * outs,
        );
        (
            capitals(rename(&(text.header + &text.body))),
            capitals(rename(&feed)),
        )
    }
}

impl std::fmt::Display for Case {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{:?}\n{}", self.options.layout, self.kernel)
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
