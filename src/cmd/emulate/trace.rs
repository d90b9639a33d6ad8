//! The trace: one line per instruction.
//!
//! ```text
//! # core   cycle  address    instruction                      cycles  why
//!   0         12  20000104   ldr r0, [r1]                          1  1 issue
//!   0         13  20000106   adds r0, r0, r2                       2  1 issue, 1 late r0
//! ```
//!
//! The line before the first instruction of a function names it. Branch targets are addresses, not
//! offsets.

use std::io::{self, Write};

use whippen_emulator::elf::{Elf, Line, SourceLines};
use whippen_emulator::{Observer, Step};
use whippen_isa::Inst;

/// Writes a trace.
pub struct Trace<'w> {
    writer: &'w mut dyn Write,
    elf: &'w Elf,
    lines: &'w SourceLines,
    /// Per core: the function and the line it was in last.
    last: Vec<(Option<u32>, Option<Line>)>,
    /// The first thing that went wrong.
    error: Option<io::ErrorKind>,
}

impl<'w> Trace<'w> {
    /// Begins a trace.
    pub fn new(
        writer: &'w mut dyn Write,
        elf: &'w Elf,
        lines: &'w SourceLines,
        cores: usize,
    ) -> Self {
        let mut trace = Self {
            writer,
            elf,
            lines,
            last: vec![(None, None); cores],
            error: None,
        };
        trace.write(format_args!(
            "# core     cycle  address   {:<38} cycles  why\n",
            "instruction"
        ));
        trace
    }

    fn write(&mut self, text: std::fmt::Arguments<'_>) {
        if self.error.is_none() {
            self.error = self.writer.write_fmt(text).err().map(|e| e.kind());
        }
    }

    /// Ends the trace; the error that something could not be written.
    pub fn finish(self) -> io::Result<()> {
        self.error.map_or(Ok(()), |kind| Err(kind.into()))
    }

    /// Says where the core is when that is elsewhere than before.
    fn place(&mut self, step: &Step<'_>) {
        let symbol = self
            .elf
            .symbols
            .covering(step.address)
            .map(|(symbol, _)| symbol);
        let line = self.lines.at(step.address);
        let Some(last) = self.last.get_mut(step.core) else {
            return;
        };
        let (moved, line_moved) = (last.0 != symbol.map(|s| s.address), last.1.as_ref() != line);
        if moved || line_moved {
            *last = (symbol.map(|s| s.address), line.cloned());
            let name = symbol.map_or("?", |s| s.name.as_str());
            match line {
                Some(line) => self.write(format_args!("# {name}  {line}\n")),
                None if moved => self.write(format_args!("# {name}\n")),
                None => {}
            }
        }
    }
}

impl Observer for Trace<'_> {
    fn instruction(&mut self, step: &Step<'_>) {
        self.place(step);
        let Step {
            core,
            cycle,
            address,
            inst,
            cost,
            cpu: _,
        } = step;
        let text = assembly(inst, *address);
        // A cost prints as `2: 1 issue, 1 late r0`; a folded instruction as `0`.
        let cost = cost.to_string();
        let (cycles, why) = cost.split_once(": ").unwrap_or((&cost, ""));
        self.write(format_args!(
            "{core:>6} {cycle:>9}  {address:08x}  {text:<38} {cycles:>6}  {why}\n"
        ));
    }

    fn exception(&mut self, core: usize, number: u32, cycle: u64) {
        self.write(format_args!(
            "{core:>6} {cycle:>9}  -- exception {number} ({})\n",
            exception_name(number)
        ));
    }

    fn exception_return(&mut self, core: usize, number: u32, cycle: u64) {
        self.write(format_args!(
            "{core:>6} {cycle:>9}  -- return from exception {number}\n"
        ));
    }
}

/// The instruction with the address that it branches to instead of an offset.
fn assembly(inst: &Inst, address: u32) -> String {
    let text = inst.to_string();
    match text.rfind([' ', '\t']).map(|at| text.split_at(at + 1)) {
        Some((before, last)) if last.starts_with(".+") || last.starts_with(".-") => {
            let target = address.wrapping_add(4).wrapping_add_signed(inst.offset());
            format!("{before}{target:08x}")
        }
        _ => text,
    }
}

/// What exceptions are called.
pub fn exception_name(number: u32) -> String {
    const NAMES: [(u32, &str); 11] = [
        (1, "Reset"),
        (2, "NMI"),
        (3, "HardFault"),
        (4, "MemManage"),
        (5, "BusFault"),
        (6, "UsageFault"),
        (7, "SecureFault"),
        (11, "SVCall"),
        (12, "DebugMonitor"),
        (14, "PendSV"),
        (15, "SysTick"),
    ];
    match NAMES.iter().find(|(n, _)| *n == number) {
        Some((_, name)) => (*name).to_string(),
        None => format!("interrupt {}", i64::from(number) - 16),
    }
}
