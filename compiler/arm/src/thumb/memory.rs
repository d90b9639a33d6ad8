//! What lies in memory before `init`: first values, literals, addresses of modes.

use super::literal::{Literal, Literals};
use super::names;
use super::state_layout::StateLayout;
use crate::image::{Fixup, FixupKind};
use whippen_kernel::{Kernel, Type};
use whippen_modes::ModeId;

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

    pub(super) fn literals(&mut self, layout: &StateLayout, literals: &Literals, name: &str) {
        for (index, literal) in literals.all().iter().enumerate() {
            let at = layout.literals + 4 * index as u32;
            match literal {
                Literal::Word(word) => self.word(at, *word),
                Literal::Mode(mode) => self.address(at, names::mode(name, *mode)),
                Literal::Table(table) => self.address(at, names::table(name, *table)),
            }
        }
    }

    /// The values per key, the only ones in which keys begin otherwise than their neighbours.
    pub(super) fn keyed(&mut self, kernel: &Kernel, layout: &StateLayout) {
        for key in 0..layout.keys {
            let record = layout.records + key * layout.record;
            for (keyed, at) in kernel.keyed.iter().zip(&layout.keyed) {
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
    pub(super) fn numbers(&mut self, layout: &StateLayout, first: u32) {
        let Some(number) = layout.number else { return };
        for key in 0..layout.keys {
            self.word(layout.records + key * layout.record + number, first + key);
        }
    }

    pub(super) fn modes(&mut self, layout: &StateLayout, name: &str) {
        for key in 0..layout.keys {
            self.address(
                layout.records + key * layout.record,
                names::mode(name, ModeId(0)),
            );
        }
        self.address(
            layout.records + layout.keys * layout.record,
            names::end(name),
        );
    }
}

/// The state, and the histories where they lie apart.
pub(super) fn memory(kernel: &Kernel, layout: &StateLayout) -> [Memory; 2] {
    let zeroed = |bytes: u32| Memory {
        bytes: vec![0; bytes as usize],
        fixups: Vec::new(),
    };
    let (mut state, mut histories) = (zeroed(layout.size), zeroed(layout.size_apart));
    for (live, at) in kernel.lives.iter().zip(&layout.live_params) {
        state.word(*at, live.init as u32);
    }
    for key in 0..layout.keys {
        let record = layout.records + key * layout.record;
        if let Some(gain) = layout.gain {
            state.word(record + gain, 1 << 16);
        }
        for (cell, at) in kernel.cells.iter().zip(&layout.cells) {
            let size = if cell.ty == Type::I64 { 8 } else { 4 };
            for word in 0..cell.len {
                state.put(
                    record + at + word * size,
                    &cell.init.to_le_bytes()[..size as usize],
                );
            }
        }
    }
    state.keyed(kernel, layout);
    state.numbers(layout, 0);
    let lines = if layout.apart.is_some() {
        &mut histories
    } else {
        &mut state
    };
    for (line, place) in kernel.lines.iter().zip(&layout.lines) {
        let value = line.first_value();
        let slot = 1 << place.log2();
        for at in (place.at..place.at + place.row * place.len).step_by(slot) {
            lines.put(at, &value.to_le_bytes()[..slot]);
        }
    }
    [state, histories]
}
