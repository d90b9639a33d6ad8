//! Declarations; each gives the index by which operators name it.

use super::Builder;
use crate::{Cell, Event, Keyed, Line, Live, Port, Probe, Range, Table, Type};

/// Appends and gives the index.
fn add<T>(list: &mut Vec<T>, item: T) -> u32 {
    list.push(item);
    list.len() as u32 - 1
}

impl Builder {
    /// Declares an input port: a word `u16`, clamped to `range` when read.
    pub fn input(&mut self, name: &str, range: Range) -> u32 {
        add(
            &mut self.kernel.inputs,
            Port {
                name: name.to_string(),
                range,
            },
        )
    }

    /// Declares an output port: a word `i16`.
    pub fn output(&mut self, name: &str, range: Range) -> u32 {
        add(
            &mut self.kernel.outputs,
            Port {
                name: name.to_string(),
                range,
            },
        )
    }

    /// Declares a live value.
    pub fn live(&mut self, name: &str, range: Range, init: i32) -> u32 {
        add(
            &mut self.kernel.lives,
            Live {
                name: name.to_string(),
                range,
                init,
            },
        )
    }

    /// Declares a constant of each key.
    pub fn keyed(&mut self, name: &str, range: Range, values: Vec<i32>) -> u32 {
        add(
            &mut self.kernel.keyed,
            Keyed {
                name: name.to_string(),
                range,
                values,
            },
        )
    }

    /// Declares memory of one word.
    pub fn cell(&mut self, name: &str, ty: Type, range: Range, init: i64) -> u32 {
        self.grid(name, ty, 1, range, init)
    }

    /// Declares memory of `len` words.
    pub fn grid(&mut self, name: &str, ty: Type, len: u32, range: Range, init: i64) -> u32 {
        add(
            &mut self.kernel.cells,
            Cell {
                name: name.to_string(),
                ty,
                len,
                range,
                init,
            },
        )
    }

    /// Declares a delay line that remembers `len` ticks.
    pub fn line(&mut self, name: &str, len: u32, range: Range) -> u32 {
        add(
            &mut self.kernel.lines,
            Line {
                name: name.to_string(),
                len,
                range,
            },
        )
    }

    /// Declares a table with rows of so many words.
    pub fn table(&mut self, name: &str, columns: u32, values: Vec<i32>) -> u32 {
        add(
            &mut self.kernel.tables,
            Table {
                name: name.to_string(),
                columns,
                values,
            },
        )
    }

    /// Declares a kind of event with so many arguments.
    pub fn event(&mut self, name: &str, args: u32) -> u32 {
        add(
            &mut self.kernel.events,
            Event {
                name: name.to_string(),
                args,
            },
        )
    }

    /// Declares a probe.
    pub fn probe(&mut self, name: &str, ty: Type) -> u32 {
        add(
            &mut self.kernel.probes,
            Probe {
                name: name.to_string(),
                ty,
            },
        )
    }
}
