//! The reference for modes: runs their blocks by the meanings in the table of operators.
//!
//! Like every engine it works on a memory of its own, and after each tick that memory is what the
//! interpreter's is, byte for byte. What modes promise is tested on the way: in each tick cells lie
//! where the mode says, every value lies in its range, and what a mode knows is not read from
//! memory (it is spoiled before each tick).

use super::{BlockId, End, Mode, ModeId, Modes, Target};
use whippen_ids::IdMap;
use whippen_kernel::memory::Key;
use whippen_kernel::op::Meaning;
use whippen_kernel::{
    Code, EngineError, Inst, Interp, Kernel, Loaded, Memory, Op, Range, Region, Value,
};

/// Modes being run.
#[derive(Debug, Clone)]
pub struct ModesEngine(Loaded<Runner>);

whippen_kernel::deref_to_loaded!(ModesEngine, Runner);

/// What runs them.
#[derive(Debug, Clone)]
pub struct Runner {
    modes: Modes,
    init: Interp,
    /// The mode of each key.
    now: Vec<ModeId>,
    registers: IdMap<Value, i64>,
    violation: Option<String>,
}

impl ModesEngine {
    /// An engine for so many keys; `init` comes first.
    ///
    /// # Errors
    /// The kernel does not verify; too many keys or too much memory.
    pub fn new(modes: &Modes, keys: usize) -> Result<ModesEngine, EngineError> {
        let memory = Memory::new(&modes.kernel, keys)?;
        let init = Interp::new(&modes.kernel, keys)?;
        let most = modes
            .modes
            .iter()
            .map(|mode| mode.values.len())
            .max()
            .unwrap_or_default();
        let runner = Runner {
            modes: modes.clone(),
            init,
            now: vec![ModeId(0); keys],
            registers: IdMap::filled(0, most),
            violation: None,
        };
        Ok(ModesEngine(Loaded::new_with(
            modes.kernel.clone(),
            memory,
            runner,
        )))
    }

    /// The first promise that was broken.
    pub fn violation(&self) -> Option<&str> {
        self.code().violation.as_deref()
    }

    /// The mode that each key is in.
    pub fn now(&self) -> &[ModeId] {
        &self.code().now
    }
}

impl Code for Runner {
    fn run(
        &mut self,
        tick: bool,
        kernel: &Kernel,
        memory: &mut Memory,
        inputs: &[u16],
        outputs: &mut [i16],
    ) {
        if !tick {
            self.init.init(inputs);
            let lives = std::mem::take(&mut memory.lives);
            let (events, clock) = (std::mem::take(&mut memory.events), memory.clock.clone());
            *memory = Memory {
                lives,
                events,
                clock,
                ..self.init.memory().clone()
            };
        }
        for index in 0..memory.keys() {
            let mut key = Key {
                kernel,
                memory,
                key: index,
                inputs,
                outputs,
            };
            if !tick {
                let found = self.modes.mode_of(|cell| key.get(cell, 0));
                self.broken(found.is_none(), || {
                    format!("key {index}: no mode after init")
                });
                self.now[index] = found.unwrap_or_default();
            } else {
                self.key(&mut key);
            }
        }
    }
}

impl Runner {
    fn broken(&mut self, broken: bool, message: impl FnOnce() -> String) {
        if broken && self.violation.is_none() {
            self.violation = Some(message());
        }
    }

    fn key(&mut self, key: &mut Key) {
        let at = self.now[key.key];
        let mode = std::mem::take(&mut self.modes.modes[at]);
        self.enter(&mode, key);
        let next = self.blocks(&mode, key);
        self.modes.modes[at] = mode;
        self.now[key.key] = next;
        let stands: Vec<(usize, i64)> = self.modes.modes[next].stands_for().collect();
        stands
            .into_iter()
            .for_each(|(cell, value)| key.set(cell, 0, value));
    }

    /// Tests what the mode promises and spoils what it knows.
    fn enter(&mut self, mode: &Mode, key: &mut Key) {
        for (cell, range) in mode.cells.iter().enumerate() {
            let value = key.get(cell, 0);
            self.broken(!range.has(value), || {
                format!("{}: cell {cell} is {value}, not in {range}", mode.name)
            });
        }
        for (cell, value) in mode.stands_for() {
            let Range { low, high } = key.kernel.cells[cell].range;
            key.set(cell, 0, if value == low { high } else { low });
        }
    }

    fn blocks(&mut self, mode: &Mode, key: &mut Key) -> ModeId {
        let mut at = BlockId(0);
        loop {
            let Some(block) = mode.blocks.get(at) else {
                self.broken(true, || format!("{}: there is no block {at}", mode.name));
                return ModeId(0);
            };
            self.run(mode, &block.insts, key);
            let target = match &block.end {
                End::Next(next) => return *next,
                End::Jump(target) => target,
                End::Branch {
                    condition, yes, no, ..
                } => {
                    if self.registers[condition] == 1 {
                        yes
                    } else {
                        no
                    }
                }
            };
            self.hand_over(mode, target);
            at = target.block;
        }
    }

    fn hand_over(&mut self, mode: &Mode, target: &Target) {
        let values: Vec<i64> = target.args.iter().map(|arg| self.registers[arg]).collect();
        let params = mode
            .blocks
            .get(target.block)
            .map_or(&[][..], |block| &block.params);
        self.put(mode, params, &values);
    }

    fn run(&mut self, mode: &Mode, insts: &[Inst], key: &mut Key) {
        for inst in insts {
            let args: Vec<i64> = inst.args.iter().map(|arg| self.registers[arg]).collect();
            let immediates = inst.op.immediates().map(|immediate| immediate as usize);
            match inst.op.row().meaning {
                Meaning::Exact(_) => {
                    let operands =
                        std::array::from_fn(|at| args.get(at).copied().unwrap_or_default());
                    let ty = mode.values[inst.results[0]].ty;
                    let value = inst.op.evaluate(ty, operands).unwrap_or_default();
                    self.put(mode, &inst.results, &[value]);
                }
                Meaning::Reads(read) => {
                    let value = read(key, immediates, &args);
                    self.put(mode, &inst.results, &[value]);
                }
                Meaning::Writes(write) => write(key, immediates, &args),
                Meaning::Regions => self.regions(mode, inst, &args, key),
            }
        }
    }

    fn regions(&mut self, mode: &Mode, inst: &Inst, args: &[i64], key: &mut Key) {
        match (inst.op, &inst.regions[..]) {
            (Op::If, [then, other]) => {
                let region = if args[0] == 1 { then } else { other };
                self.run(mode, &region.insts, key);
                self.put(mode, &inst.results, &self.yields(region));
            }
            (Op::Loop(rounds), [body]) => {
                let mut carried = args.to_vec();
                for round in 0..i64::from(rounds) {
                    let start: Vec<i64> = std::iter::once(round).chain(carried).collect();
                    self.put(mode, &body.params, &start);
                    self.run(mode, &body.insts, key);
                    carried = self.yields(body);
                }
                self.put(mode, &inst.results, &carried);
            }
            _ => {}
        }
    }

    fn yields(&self, region: &Region) -> Vec<i64> {
        region
            .yields
            .iter()
            .map(|value| self.registers[value])
            .collect()
    }

    fn put(&mut self, mode: &Mode, values: &[Value], to: &[i64]) {
        for (value, number) in values.iter().zip(to) {
            let range = mode.values[value].range;
            self.broken(!range.has(*number), || {
                format!("{}: {value} is {number}, not in {range}", mode.name)
            });
            self.registers[value] = *number;
        }
    }
}
