//! What a tick means: a Kernel, or a mode of it, run with terms by the table of operators.

use std::collections::HashMap;

use whippen_kernel::op::Integer;
use whippen_kernel::{Inst, Kernel, Op, Range, Region, Type, Value};
use whippen_modes::{BlockId, End, Mode, ModeId, Modes, Target};
use whippen_smt::{Bounded, Sort, Term};

/// What a tick finds and leaves.
#[derive(Debug, Clone)]
pub struct Memory {
    /// Words of cells.
    pub cells: Vec<Vec<Bounded>>,
    /// Words in, as a host gives them.
    pub inputs: Vec<Term>,
    /// Live values.
    pub lives: Vec<Bounded>,
    /// Constants of the key.
    pub keyed: Vec<Bounded>,
    /// The number of the tick.
    pub tick: Term,
    /// Words out; none where nothing is written.
    pub outputs: Vec<Option<Bounded>>,
    /// What is exported.
    pub probes: Vec<Bounded>,
    /// What is assumed of what it finds, and what the Kernel promises.
    pub assumed: Vec<Term>,
}

impl Memory {
    /// Anything that memory may hold, with word 0 of each cell in such a range.
    pub fn free(kernel: &Kernel, starts: &[Range]) -> Memory {
        let mut all = Vec::new();
        let mut word = |name: &str, at: u32, ty: Type, range: Range| {
            let (free, in_range) = Bounded::free(&named(name, at), ty.bits().max(32), range);
            all.push(in_range);
            free
        };
        let mut cells: Vec<Vec<Bounded>> = Vec::new();
        for (cell, start) in kernel.cells.iter().zip(starts) {
            let range = |at| if at == 0 { *start } else { cell.range };
            let own = (0..cell.len).map(|at| word(&cell.name, at, cell.ty, range(at)));
            cells.push(own.collect());
        }
        let lives = kernel.lives.iter();
        let lives = lives.map(|live| word(&live.name, 0, Type::I32, live.range));
        let lives = lives.collect();
        let probes = kernel.probes.iter();
        let probes = probes.map(|probe| word(&probe.name, 0, probe.ty, probe.ty.range()));
        let probes = probes.collect();
        let keyed = kernel.keyed.iter().map(|keyed| {
            let first = keyed.values.first().copied().unwrap_or_default();
            Bounded::of(first.into())
        });
        let inputs = kernel.inputs.iter();
        Memory {
            cells,
            inputs: inputs
                .map(|port| Term::free(&named(&port.name, 0), Sort::Word(16)))
                .collect(),
            lives,
            keyed: keyed.collect(),
            tick: Term::free("tick", Sort::Word(32)),
            outputs: vec![None; kernel.outputs.len()],
            probes,
            assumed: all,
        }
    }

    /// The ranges that a Kernel declares of its cells.
    pub fn declared(kernel: &Kernel) -> Vec<Range> {
        kernel.cells.iter().map(|cell| cell.range).collect()
    }

    /// One of two memories.
    fn either(condition: Term, yes: &Memory, no: &Memory) -> Memory {
        let one = |(a, b): (&Bounded, &Bounded)| Bounded::either(condition, *a, *b);
        let maybe =
            |(a, b): (&Option<Bounded>, &Option<Bounded>)| Some(one((a.as_ref()?, b.as_ref()?)));
        let words =
            |(a, b): (&Vec<Bounded>, &Vec<Bounded>)| a.iter().zip(b).map(one).collect::<Vec<_>>();
        let both = yes.assumed.iter().zip(&no.assumed);
        let common = both.take_while(|(a, b)| a == b).count();
        let of_yes = yes.assumed[common..].iter();
        let of_no = no.assumed[common..].iter();
        let mut assumed = yes.assumed[..common].to_vec();
        assumed.extend(of_yes.map(|term| condition.negated().or(*term)));
        assumed.extend(of_no.map(|term| condition.or(*term)));
        Memory {
            cells: yes.cells.iter().zip(&no.cells).map(words).collect(),
            outputs: yes.outputs.iter().zip(&no.outputs).map(maybe).collect(),
            probes: words((&yes.probes, &no.probes)),
            assumed,
            ..yes.clone()
        }
    }
}

/// A name that SMT-LIB takes.
fn named(name: &str, at: u32) -> String {
    let plain = |c: char| if c.is_ascii_alphanumeric() { c } else { '_' };
    let name: String = name.chars().map(plain).collect();
    format!("in_{name}_{at}")
}

/// Values of one run.
type Values = HashMap<Value, Bounded>;

/// A run.
struct Run<'a> {
    kernel: &'a Kernel,
    /// The modes, of a run in one.
    modes: Option<&'a Modes>,
    /// The type of a value.
    types: &'a dyn Fn(Value) -> Type,
    values: Values,
    memory: Memory,
}

type Told<T> = Result<T, String>;

impl Run<'_> {
    fn value(&self, value: Value) -> Told<Bounded> {
        let known = self.values.get(&value).copied();
        known.ok_or(format!("{value} is not defined"))
    }

    fn put(&mut self, value: Value, to: Bounded) {
        self.values.insert(value, to);
    }

    fn insts(&mut self, insts: &[Inst]) -> Told<()> {
        insts.iter().try_for_each(|inst| self.inst(inst))
    }

    fn inst(&mut self, inst: &Inst) -> Told<()> {
        let args: Told<Vec<Bounded>> = inst.args.iter().map(|arg| self.value(*arg)).collect();
        let args = args?;
        if let (Op::If, [then, other]) = (inst.op, &inst.regions[..]) {
            return self.choice(inst, args[0].holds(), then, other);
        }
        if let (Op::Loop(rounds), [body]) = (inst.op, &inst.regions[..]) {
            return self.rounds(inst, args, rounds, body);
        }
        let result = match self.computed(inst, &args)? {
            Some(result) => Some(result),
            None => self.on_memory(inst.op, &args)?,
        };
        if let (Some(result), Some(to)) = (result, inst.results.first()) {
            self.put(*to, result);
        }
        Ok(())
    }

    fn computed(&mut self, inst: &Inst, args: &[Bounded]) -> Told<Option<Bounded>> {
        let [a, b, c] = std::array::from_fn(|at| args.get(at).copied().unwrap_or(Bounded::of(0)));
        if let Op::Assume(low, high) = inst.op {
            let (held, promise) = a.promised(Range::new(low, high));
            self.memory.assumed.push(promise);
            return Ok(Some(held));
        }
        let Some(exact) = inst.op.exact([a, b, c]) else {
            return Ok(None);
        };
        let to = inst.results.first().ok_or("no result")?;
        Ok(Some(exact.wrapped((self.types)(*to))))
    }

    fn on_memory(&mut self, op: Op, args: &[Bounded]) -> Told<Option<Bounded>> {
        let memory = &mut self.memory;
        let number = |at: u32| at as usize;
        Ok(match op {
            Op::In(port) => {
                let Range { low, high } = self.kernel.inputs[number(port)].range;
                let word = memory.inputs[number(port)].widened(32);
                let word = Bounded::known(word, 0, 65_535);
                Some(
                    word.most(Bounded::of(low.into()))
                        .least(Bounded::of(high.into())),
                )
            }
            Op::Live(live) => Some(memory.lives[number(live)]),
            Op::Keyed(keyed) => Some(memory.keyed[number(keyed)]),
            Op::Tick(later) => {
                let later = Term::word(later.into(), 32);
                let tick = Term::apply("bvadd", &[memory.tick, later]);
                Some(Bounded::known(tick, i32::MIN.into(), i32::MAX.into()))
            }
            Op::Get(cell) => Some(memory.cells[number(cell)][0]),
            Op::GetAt(cell) => {
                let words = memory.cells[number(cell)].clone();
                let at = args[0];
                let others = words.iter().enumerate().skip(1);
                Some(others.fold(words[0], |found, (place, word)| {
                    let is_here = at.equal(Bounded::of(place as i128)).holds();
                    Bounded::either(is_here, *word, found)
                }))
            }
            Op::Set(cell) => {
                memory.cells[number(cell)][0] = args[0];
                None
            }
            Op::SetAt(cell) => {
                for (place, word) in memory.cells[number(cell)].iter_mut().enumerate() {
                    let is_here = args[0].equal(Bounded::of(place as i128)).holds();
                    *word = Bounded::either(is_here, args[1], *word);
                }
                None
            }
            Op::Lookup(table, column) => {
                let table = &self.kernel.tables[number(table)];
                let entry = |row: usize| {
                    let entry = table.entry(row, number(column)).unwrap_or_default();
                    Bounded::of(entry.into())
                };
                Some((1..table.rows()).fold(entry(0), |found, row| {
                    let is_here = args[0].equal(Bounded::of(row as i128)).holds();
                    Bounded::either(is_here, entry(row), found)
                }))
            }
            Op::Out(port) => {
                memory.outputs[number(port)] = Some(args[0]);
                None
            }
            Op::Probe(probe) => {
                memory.probes[number(probe)] = args[0];
                None
            }
            other => return Err(format!("operator `{}`", other.row().name)),
        })
    }

    fn region(&mut self, region: &Region) -> Told<Vec<Bounded>> {
        self.insts(&region.insts)?;
        region
            .yields
            .iter()
            .map(|value| self.value(*value))
            .collect()
    }

    fn choice(&mut self, inst: &Inst, holds: Term, then: &Region, other: &Region) -> Told<()> {
        let (values, before) = (self.values.clone(), self.memory.clone());
        let yes = self.region(then)?;
        let after = std::mem::replace(&mut self.memory, before);
        self.values = values;
        let no = self.region(other)?;
        self.memory = Memory::either(holds, &after, &self.memory);
        for ((to, yes), no) in inst.results.iter().zip(yes).zip(no) {
            self.put(*to, Bounded::either(holds, yes, no));
        }
        Ok(())
    }

    fn rounds(&mut self, inst: &Inst, start: Vec<Bounded>, rounds: u32, body: &Region) -> Told<()> {
        let mut carried = start;
        for round in 0..rounds {
            self.put(body.params[0], Bounded::of(round.into()));
            for (param, value) in body.params[1..].iter().zip(&carried) {
                self.put(*param, *value);
            }
            carried = self.region(body)?;
        }
        for (to, value) in inst.results.iter().zip(carried) {
            self.put(*to, value);
        }
        Ok(())
    }

    /// From a block of a mode to the end of the tick.
    fn blocks(&mut self, mode: &Mode, at: BlockId) -> Told<()> {
        let block = &mode.blocks[at];
        self.insts(&block.insts)?;
        match &block.end {
            End::Next(next) => {
                // Memory need not hold what the next mode stands for.
                let next = self.modes.map(|modes| &modes.modes[*next]);
                for (cell, value) in next.iter().flat_map(|next| next.stands_for()) {
                    self.memory.cells[cell][0] = Bounded::of(value.into());
                }
                Ok(())
            }
            End::Jump(target) => self.go(mode, target),
            End::Branch {
                condition, yes, no, ..
            } => {
                let holds = self.value(*condition)?.holds();
                let (values, before) = (self.values.clone(), self.memory.clone());
                self.go(mode, yes)?;
                let after = std::mem::replace(&mut self.memory, before);
                self.values = values;
                self.go(mode, no)?;
                self.memory = Memory::either(holds, &after, &self.memory);
                Ok(())
            }
        }
    }

    fn go(&mut self, mode: &Mode, target: &Target) -> Told<()> {
        let args: Told<Vec<Bounded>> = target.args.iter().map(|arg| self.value(*arg)).collect();
        let params = mode.blocks[target.block].params.clone();
        for (param, value) in params.into_iter().zip(args?) {
            self.put(param, value);
        }
        self.blocks(mode, target.block)
    }
}

/// What memory holds after a tick of the Kernel.
///
/// # Errors
/// An operator that is not followed.
pub fn tick(kernel: &Kernel, memory: Memory) -> Told<Memory> {
    let mut run = Run {
        kernel,
        modes: None,
        types: &|value: Value| kernel.values[value].ty,
        values: Values::new(),
        memory,
    };
    run.insts(&kernel.tick.insts)?;
    Ok(run.memory)
}

/// What memory holds after a tick in a mode.
///
/// # Errors
/// An operator that is not followed.
pub fn tick_in_mode(modes: &Modes, mode: ModeId, memory: Memory) -> Told<Memory> {
    let own = &modes.modes[mode];
    let mut run = Run {
        kernel: &modes.kernel,
        modes: Some(modes),
        types: &|value: Value| own.values[value].ty,
        values: Values::new(),
        memory,
    };
    run.blocks(own, BlockId(0))?;
    Ok(run.memory)
}
