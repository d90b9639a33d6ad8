//! What lies in memory before `init`: first values, literals, addresses of modes.

use super::frame::Frame;
use super::literal::{Literal, Literals};
use super::names;
use crate::image::{Fixup, FixupKind};
use whippen_kernel::{Kernel, Type};

/// A piece of memory as it is before `init`.
pub(super) struct Memory {
    pub bytes: Vec<u8>,
    pub fixups: Vec<Fixup>,
}

impl Memory {
    fn put(&mut self, at: u32, bytes: &[u8]) {
        self.bytes[at as usize..at as usize + bytes.len()].copy_from_slice(bytes);
    }

    fn word(&mut self, at: u32, word: u32) {
        self.put(at, &word.to_le_bytes());
    }

    pub(super) fn address(&mut self, at: u32, symbol: String) {
        self.fixups.push(Fixup {
            at,
            kind: FixupKind::Abs32,
            symbol,
            addend: 0,
        });
    }

    pub(super) fn literals(&mut self, frame: &Frame, literals: &Literals, name: &str) {
        for (index, literal) in literals.all().iter().enumerate() {
            let at = frame.literals + 4 * index as u32;
            match literal {
                Literal::Word(word) => self.word(at, *word),
                Literal::Mode(mode) => self.address(at, names::mode(name, *mode)),
                Literal::Table(table) => self.address(at, names::table(name, *table)),
            }
        }
    }

    /// The values per key, the only ones in which keys begin otherwise than their neighbours.
    pub(super) fn keyed(&mut self, kernel: &Kernel, frame: &Frame) {
        for key in 0..frame.keys {
            let record = frame.records + key * frame.record;
            for (keyed, at) in kernel.keyed.iter().zip(&frame.keyed) {
                let value = keyed
                    .values
                    .get(key as usize)
                    .or(keyed.values.last())
                    .copied()
                    .unwrap_or_default();
                self.word(record + at, value as u32);
            }
        }
    }

    /// The numbers of the keys, by which events know them.
    pub(super) fn numbers(&mut self, frame: &Frame, first: u32) {
        let Some(number) = frame.number else { return };
        for key in 0..frame.keys {
            self.word(frame.records + key * frame.record + number, first + key);
        }
    }

    pub(super) fn modes(&mut self, frame: &Frame, name: &str) {
        for key in 0..frame.keys {
            self.address(frame.records + key * frame.record, names::mode(name, 0));
        }
        self.address(frame.records + frame.keys * frame.record, names::end(name));
    }
}

/// The state, and the histories where they lie apart.
pub(super) fn memory(kernel: &Kernel, frame: &Frame) -> [Memory; 2] {
    let zeroed = |bytes: u32| Memory {
        bytes: vec![0; bytes as usize],
        fixups: Vec::new(),
    };
    let (mut state, mut histories) = (zeroed(frame.size), zeroed(frame.size_apart));
    for (live, at) in kernel.lives.iter().zip(&frame.lives) {
        state.word(*at, live.init as u32);
    }
    for key in 0..frame.keys {
        let record = frame.records + key * frame.record;
        if let Some(gain) = frame.gain {
            state.word(record + gain, 1 << 16);
        }
        for (cell, at) in kernel.cells.iter().zip(&frame.cells) {
            let size = if cell.ty == Type::I64 { 8 } else { 4 };
            for word in 0..cell.len {
                state.put(
                    record + at + word * size,
                    &cell.init.to_le_bytes()[..size as usize],
                );
            }
        }
    }
    state.keyed(kernel, frame);
    state.numbers(frame, 0);
    let lines = if frame.apart.is_some() {
        &mut histories
    } else {
        &mut state
    };
    for (line, place) in kernel.lines.iter().zip(&frame.lines) {
        let value = 0.clamp(line.range.low, line.range.high);
        let slot = 1 << place.log2();
        for at in (place.at..place.at + place.row * place.len).step_by(slot) {
            lines.put(at, &value.to_le_bytes()[..slot]);
        }
    }
    [state, histories]
}
