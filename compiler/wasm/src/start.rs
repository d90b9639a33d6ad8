//! Memory as before the first tick: cleared, then what is not 0 copied in or filled.

use wasm_encoder::{Instruction, ValType};
use whippen_kernel::{Kernel, Memory};

use crate::body::{Body, at};
use crate::memory_map::{MemoryMap, TICK};

/// Zeros that are cheaper to copy than to leave out (bytes).
const GAP: usize = 16;

/// What memory has before the first tick.
pub(crate) struct Fresh {
    /// Bytes that are cleared, from an address on.
    cleared: Vec<(u32, u32)>,
    /// What is copied into them.
    pub runs: Vec<Run>,
    /// Delay lines that hold something else than 0.
    filled: Vec<Filled>,
}

/// Bytes at an address.
pub(crate) struct Run {
    at: u32,
    pub bytes: Vec<u8>,
}

/// A delay line all of one value.
struct Filled {
    at: u32,
    elements: u32,
    narrow: bool,
    value: i32,
}

impl Fresh {
    /// Of the memory of a kernel that was just made.
    pub fn of(kernel: &Kernel, memory: &Memory, map: &MemoryMap) -> Fresh {
        let columns: Vec<u8> = memory
            .columns
            .iter()
            .flat_map(|word| word.to_le_bytes())
            .collect();
        let filled = kernel
            .lines
            .iter()
            .zip(&memory.layout.lines)
            .map(|(line, place)| {
                let (base, bytes) = match place.narrow {
                    true => (map.narrow, 2),
                    false => (map.wide, 4),
                };
                Filled {
                    at: base + bytes * place.start as u32,
                    elements: (place.len * memory.keys()) as u32,
                    narrow: place.narrow,
                    value: line.first_value() as i32,
                }
            });
        Fresh {
            cleared: vec![
                (map.columns, 4 * memory.columns.len() as u32),
                (map.narrow, 2 * memory.narrow.len() as u32),
                (map.wide, 4 * memory.wide.len() as u32),
                (map.rings, 4 * memory.rings.len() as u32),
                (map.probes, 8 * memory.probes.len() as u32),
            ],
            runs: runs(map.columns, &columns),
            filled: filled.filter(|line| line.value != 0).collect(),
        }
    }

    /// Puts it there.
    pub fn write(&self, body: &mut Body) {
        for (from, bytes) in self.cleared.iter().filter(|(_, bytes)| *bytes > 0) {
            body.code([
                Instruction::I32Const(*from as i32),
                Instruction::I32Const(0),
                Instruction::I32Const(*bytes as i32),
                Instruction::MemoryFill(0),
            ]);
        }
        for (index, run) in self.runs.iter().enumerate() {
            body.code([
                Instruction::I32Const(run.at as i32),
                Instruction::I32Const(0),
                Instruction::I32Const(run.bytes.len() as i32),
                Instruction::MemoryInit {
                    mem: 0,
                    data_index: index as u32,
                },
            ]);
        }
        self.filled.iter().for_each(|line| line.write(body));
    }
}

impl Filled {
    /// Counts elements down to 0.
    fn write(&self, body: &mut Body) {
        let left = body.local(ValType::I32);
        let bytes = if self.narrow { 2 } else { 4 };
        body.word(self.elements as i32);
        body.set(left);
        body.repeat(|body| {
            body.get(left);
            body.word(1);
            body.op(Instruction::I32Sub);
            body.tee(left);
            body.word(bytes);
            body.op(Instruction::I32Mul);
            body.word(self.value);
            body.op(match self.narrow {
                true => Instruction::I32Store16(at(self.at, 1)),
                false => Instruction::I32Store(at(self.at, 2)),
            });
            body.get(left);
        });
    }
}

/// The stretches of bytes that are not 0.
fn runs(from: u32, bytes: &[u8]) -> Vec<Run> {
    let mut runs: Vec<Run> = Vec::new();
    for (place, byte) in bytes.iter().enumerate().filter(|(_, byte)| **byte != 0) {
        let address = from + place as u32;
        match runs.last_mut() {
            Some(run) if (address - run.at) as usize <= run.bytes.len() + GAP => {
                run.bytes.resize((address - run.at) as usize, 0);
                run.bytes.push(*byte);
            }
            _ => runs.push(Run {
                at: address,
                bytes: vec![*byte],
            }),
        }
    }
    runs
}

/// Sets the number of the tick to 0.
pub(crate) fn restart(body: &mut Body, map: &MemoryMap) {
    body.word(0);
    body.op(Instruction::I64Const(0));
    body.op(Instruction::I64Store(at(map.clock + TICK, 3)));
}
