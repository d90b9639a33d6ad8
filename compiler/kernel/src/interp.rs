//! The reference interpreter: runs a kernel by the meanings in the table of `op` and nothing else.
//!
//! At construction the regions are laid out flat, with jumps, so that running allocates nothing. In
//! checked mode a step after every definition looks whether the value is where it was proven to be.
//!
//! ```text
//! if c {a yield x} else {b yield y}     unless c -> 1 | a | r = x | jump 2 | 1: b | r = y | 2:
//! loop n (i, p = s) {a yield x}         i = 0 | p = s | 1: a | t = x | p = t | next i < n -> 1 | r = p
//! ```

mod flat;

use super::loaded::{Code, Loaded};
use super::memory::Key;
use super::{EngineError, Inst, Kernel, Memory, Range, Region, Value};
use flat::{Flat, Step};
use std::fmt;

/// A value that left its proven range.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Violation {
    /// The instruction that defines it, as text.
    pub inst: String,
    /// Which value of the kernel.
    pub value: Value,
    /// What it was.
    pub found: i64,
    /// Where it should be.
    pub range: Range,
    /// At which key.
    pub key: usize,
}

impl fmt::Display for Violation {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let Violation {
            inst,
            value,
            found,
            range,
            key,
        } = self;
        write!(f, "key {key}: {value} is {found}, not in {range}: {inst}")
    }
}

/// A kernel being interpreted.
pub type Interp = Loaded<Interpreter>;

/// `init` and `tick` laid out flat, and room to run them.
#[derive(Debug, Clone)]
pub struct Interpreter {
    init: Flat,
    tick: Flat,
    /// Values of the key that runs, then room to copy.
    registers: Vec<i64>,
    violation: Option<Violation>,
}

impl Loaded<Interpreter> {
    /// An interpreter for so many keys; `init` comes first.
    ///
    /// # Errors
    /// The kernel does not verify; too many keys or too much memory.
    pub fn new(kernel: &Kernel, keys: usize) -> Result<Interp, EngineError> {
        Interp::build(kernel, keys, false)
    }

    /// The same, slower: [`Interp::violation`] tells the first value that leaves its range.
    ///
    /// # Errors
    /// As [`Interp::new`].
    pub fn checked(kernel: &Kernel, keys: usize) -> Result<Interp, EngineError> {
        Interp::build(kernel, keys, true)
    }

    fn build(kernel: &Kernel, keys: usize, checked: bool) -> Result<Interp, EngineError> {
        let memory = Memory::new(kernel, keys)?;
        let init = Flat::new(kernel, &kernel.init, checked);
        let tick = Flat::new(kernel, &kernel.tick, checked);
        let registers = vec![0; init.registers.max(tick.registers)];
        Ok(Loaded::new_with(
            kernel.clone(),
            memory,
            Interpreter {
                init,
                tick,
                registers,
                violation: None,
            },
        ))
    }

    /// The first value that left its range, in checked mode.
    pub fn violation(&self) -> Option<&Violation> {
        self.code().violation.as_ref()
    }
}

impl Code for Interpreter {
    fn run(
        &mut self,
        tick: bool,
        kernel: &Kernel,
        memory: &mut Memory,
        inputs: &[u16],
        outputs: &mut [i16],
    ) {
        let flat = if tick { &self.tick } else { &self.init };
        for index in 0..memory.keys() {
            let mut key = Key {
                kernel,
                memory,
                key: index,
                inputs,
                outputs,
            };
            let left = flat.run(&mut key, &mut self.registers);
            if let (Some(value), None) = (left, &self.violation) {
                self.violation = Some(violation(
                    kernel,
                    value,
                    self.registers[value.0 as usize],
                    index,
                ));
            }
        }
    }
}

impl Flat {
    /// Runs all steps; gives the first value outside its range, if steps look for that.
    fn run(&self, key: &mut Key, registers: &mut [i64]) -> Option<Value> {
        let mut args = [0; flat::ARGS_MAX];
        let mut at = 0;
        while let Some(step) = self.steps.get(at) {
            at += 1;
            match *step {
                Step::Exact {
                    exact,
                    n,
                    ty,
                    args: [a, b, c],
                    result,
                } => {
                    let exact = exact(
                        n,
                        registers[a].into(),
                        registers[b].into(),
                        registers[c].into(),
                    );
                    registers[result] = ty.wrap(exact);
                }
                Step::Read {
                    read,
                    immediates,
                    args: ref from,
                    result,
                } => {
                    registers[result] =
                        read(key, immediates, self.gather(from, registers, &mut args));
                }
                Step::Write {
                    write,
                    immediates,
                    args: ref from,
                } => {
                    write(key, immediates, self.gather(from, registers, &mut args));
                }
                Step::Copy { from, to } => registers[to] = registers[from],
                Step::Zero { to } => registers[to] = 0,
                Step::Jump { to } => at = to,
                Step::Unless { condition, to } => {
                    if registers[condition] == 0 {
                        at = to;
                    }
                }
                Step::Next { round, rounds, to } => {
                    registers[round] += 1;
                    if registers[round] < rounds {
                        at = to;
                    }
                }
                Step::Check { value, range } => {
                    if !range.has(registers[value]) {
                        return Some(Value(value as u32));
                    }
                }
            }
        }
        None
    }
}

fn violation(kernel: &Kernel, value: Value, found: i64, key: usize) -> Violation {
    let inst = defining(&kernel.init, value).or_else(|| defining(&kernel.tick, value));
    let inst = inst.map_or_else(String::new, |inst| kernel.headline(inst));
    Violation {
        inst,
        value,
        found,
        range: kernel.values[value].range,
        key,
    }
}

/// The instruction that defines a value, as a result or as a parameter of its region.
fn defining(region: &Region, value: Value) -> Option<&Inst> {
    region.all_insts().find(|inst| {
        let mut params = inst.regions.iter().flat_map(|inner| &inner.params);
        inst.results.contains(&value) || params.any(|param| *param == value)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::parse;

    const FIBONACCI: &str = "\
kernel fibonacci @44100 {
  in n: u16 [0..9]
  out f: i16 [0..1000]
  line last: 2 [0..9]
  event big(1)
  tick {
    v0: i32 [0..0] = const 0
    v1: i32 [1..1] = const 1
    v2: i32 [0..1000], v3: i32 [0..1000] = loop 10 (v4: i32 [0..9], v5: i32 [0..1000] = v0, v6: i32 [0..1000] = v1) {
      v7: i32 [0..2000] = add v5 v6
      v8: i32 [1000..1000] = const 1000
      v9: i32 [0..1000] = min v7 v8
      yield v6 v9
    }
    v10: i32 [0..9] = in n
    v11: i32 [0..9] = delay last 2
    v12: i1 [0..1] = le v1 v11
    if v12 {
      emit big v2
    }
    push last v10
    out f v2
  }
}
";

    #[test]
    fn rounds_carry_values_at_once() {
        let kernel = parse(FIBONACCI).expect("parses");
        let mut interp = Interp::checked(&kernel, 2).expect("verifies");
        let mut out = [0; 2];
        interp.init(&[0, 0]);
        for _ in 0..4 {
            interp.tick(&[0, 12], &mut out);
        }
        assert_eq!(out, [55, 55]);
        let events: Vec<(u64, u32, Vec<i32>)> = interp
            .drain_events()
            .into_iter()
            .map(|e| (e.tick, e.key, e.args))
            .collect();
        assert_eq!(events, [(2, 1, vec![55]), (3, 1, vec![55])]);
        assert_eq!(interp.violation(), None);
    }
}
