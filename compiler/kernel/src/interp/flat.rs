//! Flattening of structured control: regions as a list of steps with jumps.

use crate::memory::Key;
use crate::op::Meaning;
use crate::{Inst, Kernel, Range, Region, Type, Value, Walk};

/// The most operands an operator may have.
pub(super) const ARGS_MAX: usize = 16;

/// One step. Registers are named by index: values keep their number, room to copy comes after them.
#[derive(Debug, Clone)]
pub(super) enum Step {
    Exact {
        exact: fn(i128, i128, i128, i128) -> i128,
        n: i128,
        ty: Type,
        args: [usize; 3],
        result: usize,
    },
    Read {
        read: fn(&Key, [usize; 2], &[i64]) -> i64,
        immediates: [usize; 2],
        args: Args,
        result: usize,
    },
    Write {
        write: fn(&mut Key, [usize; 2], &[i64]),
        immediates: [usize; 2],
        args: Args,
    },
    Copy {
        from: usize,
        to: usize,
    },
    Zero {
        to: usize,
    },
    Jump {
        to: usize,
    },
    Unless {
        condition: usize,
        to: usize,
    },
    /// The next round; back to its start if there is one.
    Next {
        round: usize,
        rounds: i64,
        to: usize,
    },
    Check {
        value: usize,
        range: Range,
    },
}

/// Where the operands of a step stand in [`Flat::args`].
pub(super) type Args = std::ops::Range<usize>;

/// `init` or `tick` as steps.
#[derive(Debug, Clone)]
pub(super) struct Flat {
    pub steps: Vec<Step>,
    /// Operands of all reads and writes.
    args: Vec<usize>,
    /// How many registers are used.
    pub registers: usize,
}

impl Flat {
    /// Lays out a region of a verified kernel.
    pub fn new(kernel: &Kernel, region: &Region, checked: bool) -> Flat {
        let flat = Flat {
            steps: Vec::new(),
            args: Vec::new(),
            registers: kernel.values.len() + 1,
        };
        let mut flattener = Flattener {
            kernel,
            flat,
            checked,
        };
        flattener.region(region);
        flattener.flat
    }

    /// The operands' values.
    pub fn gather<'a>(
        &self,
        from: &Args,
        registers: &[i64],
        into: &'a mut [i64; ARGS_MAX],
    ) -> &'a [i64] {
        let from = &self.args[from.clone()];
        for (slot, register) in into.iter_mut().zip(from) {
            *slot = registers[*register];
        }
        &into[..from.len()]
    }
}

struct Flattener<'a> {
    kernel: &'a Kernel,
    flat: Flat,
    checked: bool,
}

impl Walk for Flattener<'_> {
    fn region(&mut self, region: &Region) {
        for inst in &region.insts {
            self.inst(inst);
            self.check(&inst.results);
        }
    }

    fn plain(&mut self, inst: &Inst) {
        let args: Vec<usize> = inst.args.iter().copied().map(register).collect();
        let [n, m] = inst.op.immediates();
        let immediates = [n as usize, m as usize];
        let defined = inst.results.first().copied();
        let result = defined.map_or(0, register);
        let step = match inst.op.row().meaning {
            Meaning::Exact(exact) => {
                let ty = defined.map_or(Type::I1, |value| self.kernel.values[value].ty);
                let args = std::array::from_fn(|at| args.get(at).copied().unwrap_or_default());
                Step::Exact {
                    exact,
                    n: n.into(),
                    ty,
                    args,
                    result,
                }
            }
            Meaning::Reads(read) => Step::Read {
                read,
                immediates,
                args: self.operands(args),
                result,
            },
            Meaning::Writes(write) => Step::Write {
                write,
                immediates,
                args: self.operands(args),
            },
            Meaning::Regions => return,
        };
        self.flat.steps.push(step);
    }

    fn if_else(&mut self, inst: &Inst, then: &Region, other: &Region) {
        let condition = register(inst.args[0]);
        let unless = self.hole();
        self.region(then);
        self.copy(&then.yields, &inst.results);
        let jump = self.hole();
        self.flat.steps[unless] = Step::Unless {
            condition,
            to: self.flat.steps.len(),
        };
        self.region(other);
        self.copy(&other.yields, &inst.results);
        self.flat.steps[jump] = Step::Jump {
            to: self.flat.steps.len(),
        };
    }

    fn repeat(&mut self, inst: &Inst, rounds: u32, body: &Region) {
        let (round, carried) = (register(body.params[0]), &body.params[1..]);
        self.flat.steps.push(Step::Zero { to: round });
        self.copy(&inst.args, carried);
        let to = self.flat.steps.len();
        self.check(&body.params);
        self.region(body);
        self.copy_at_once(&body.yields, carried);
        self.flat.steps.push(Step::Next {
            round,
            rounds: rounds.into(),
            to,
        });
        self.copy(carried, &inst.results);
    }
}

impl Flattener<'_> {
    /// A step to be filled in later.
    fn hole(&mut self) -> usize {
        self.flat.steps.push(Step::Jump { to: 0 });
        self.flat.steps.len() - 1
    }

    fn copy(&mut self, from: &[Value], to: &[Value]) {
        for (from, to) in from.iter().zip(to) {
            self.flat.steps.push(Step::Copy {
                from: register(*from),
                to: register(*to),
            });
        }
    }

    /// Copies by way of free registers, since what is yielded may be another parameter.
    fn copy_at_once(&mut self, from: &[Value], to: &[Value]) {
        let free = self.kernel.values.len();
        for (at, from) in from.iter().enumerate() {
            self.flat.steps.push(Step::Copy {
                from: register(*from),
                to: free + at,
            });
        }
        for (at, to) in to.iter().enumerate() {
            self.flat.steps.push(Step::Copy {
                from: free + at,
                to: register(*to),
            });
        }
        self.flat.registers = self.flat.registers.max(free + from.len());
    }

    fn operands(&mut self, args: Vec<usize>) -> Args {
        let start = self.flat.args.len();
        self.flat.args.extend(args);
        start..self.flat.args.len()
    }

    fn check(&mut self, values: &[Value]) {
        for value in values.iter().copied().filter(|_| self.checked) {
            let range = self.kernel.values[value].range;
            self.flat.steps.push(Step::Check {
                value: register(value),
                range,
            });
        }
    }
}

fn register(value: Value) -> usize {
    value.0 as usize
}
