//! Traversal of structured control: every instruction of a region, whatever regions it owns.
//!
//! ```text
//!   if v0 { emit a } else { set c v1 }     all_insts: if, emit, set       (pre-order: outer first, text order)
//! ```
//!
//! A translator that makes something of each shape uses [`Walk`](crate::Walk); whoever only looks
//! for instructions, counts them or collects from them uses [`Region::all_insts`]; whoever changes
//! them all uses [`Inst::for_each_value_mut`].

use crate::{Inst, Kernel, Op, Region, Value};
use std::collections::BTreeSet;

/// The instructions of a region and of all regions inside, outer first, in the order of the text.
#[derive(Debug, Clone)]
pub struct AllInsts<'a> {
    /// What is still to be visited, of each open region; the innermost last.
    open: Vec<std::slice::Iter<'a, Inst>>,
}

impl<'a> Iterator for AllInsts<'a> {
    type Item = &'a Inst;

    fn next(&mut self) -> Option<&'a Inst> {
        while let Some(innermost) = self.open.last_mut() {
            let Some(inst) = innermost.next() else {
                self.open.pop();
                continue;
            };
            let inner = inst.regions.iter().rev();
            self.open.extend(inner.map(|region| region.insts.iter()));
            return Some(inst);
        }
        None
    }
}

impl Region {
    /// Every instruction of the region and of all regions inside, outer first.
    pub fn all_insts(&self) -> AllInsts<'_> {
        all_insts(&self.insts)
    }

    /// The most events that one run of the region emits for one key: the greater arm of an `if`,
    /// every round of a `loop`.
    pub fn events_max(&self) -> u32 {
        let of_inst = |inst: &Inst| match inst.op {
            Op::Emit(_) => 1,
            Op::Loop(rounds) => rounds.saturating_mul(inner_events_max(inst)),
            _ => inner_events_max(inst),
        };
        self.insts.iter().map(of_inst).fold(0, u32::saturating_add)
    }

    /// The slots of delay lines that the region reads or writes: line, and how many ticks ago (0
    /// for what is pushed, and where reads at an operand are counted from).
    pub fn line_slots(&self) -> BTreeSet<(u32, u32)> {
        let slot = |inst: &Inst| match inst.op {
            Op::Delay(line, ticks) => Some((line, ticks)),
            Op::DelayAt(line) | Op::Push(line) => Some((line, 0)),
            _ => None,
        };
        self.all_insts().filter_map(slot).collect()
    }
}

/// The most events that one of an instruction's regions emits in one run.
fn inner_events_max(inst: &Inst) -> u32 {
    inst.regions
        .iter()
        .map(Region::events_max)
        .max()
        .unwrap_or(0)
}

/// Every one of these instructions and all inside them, outer first.
pub fn all_insts(insts: &[Inst]) -> AllInsts<'_> {
    AllInsts {
        open: vec![insts.iter()],
    }
}

impl Inst {
    /// The instruction, and every instruction inside it, outer first.
    pub fn all_insts(&self) -> AllInsts<'_> {
        all_insts(std::slice::from_ref(self))
    }

    /// Changes every value that the instruction or one inside it names, in the order of the text:
    /// operands, what regions take, hold and yield, results.
    pub fn for_each_value_mut(&mut self, change: &mut impl FnMut(&mut Value)) {
        self.args.iter_mut().for_each(&mut *change);
        for region in &mut self.regions {
            region.params.iter_mut().for_each(&mut *change);
            for inst in &mut region.insts {
                inst.for_each_value_mut(change);
            }
            region.yields.iter_mut().for_each(&mut *change);
        }
        self.results.iter_mut().for_each(change);
    }
}

impl Kernel {
    /// Every instruction of `init`, then of `tick`, outer first.
    pub fn all_insts(&self) -> impl Iterator<Item = &Inst> {
        self.init.all_insts().chain(self.tick.all_insts())
    }

    /// Whether `init` or `tick` assumes a range that intervals alone do not prove, so that an
    /// engine must guard what could do harm.
    pub fn assumes(&self) -> bool {
        self.all_insts()
            .any(|inst| matches!(inst.op, Op::Assume(..)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::parse;

    const NESTED: &str = "\
kernel nested @44100 {
  in n: u16 [0..9]
  out f: i16 [0..9]
  line far: 4 [0..9]
  event a(0)
  event b(0)
  tick {
    v0: i32 [0..9] = in n
    v1: i32 [0..9] = delay far 3
    v2: i1 [0..1] = lt v0 v1
    if v2 {
      emit a
      emit a
    } else {
      loop 5 (v3: i32 [0..4]) {
        if v2 {
          emit b
        }
      }
    }
    emit b
    push far v0
    out f v0
  }
}
";

    fn nested() -> Kernel {
        parse(NESTED).expect("parses")
    }

    #[test]
    fn instructions_come_outer_first_in_the_order_of_the_text() {
        let kernel = nested();
        let words: Vec<&str> = kernel
            .tick
            .all_insts()
            .map(|inst| inst.op.row().name)
            .collect();
        let expected = "in delay lt if emit emit loop if emit emit push out";
        assert_eq!(words.join(" "), expected);
        assert_eq!(kernel.tick.insts[3].all_insts().count(), 6);
    }

    #[test]
    fn events_are_counted_once_for_each_arm_and_for_every_round() {
        let mut kernel = nested();
        assert_eq!(kernel.tick.events_max(), 5 + 1);
        kernel.tick.insts[3].regions[1].insts[0].op = Op::Loop(1);
        assert_eq!(kernel.tick.events_max(), 2 + 1);
        kernel.tick.insts[3].op = Op::Loop(u32::MAX);
        assert_eq!(kernel.tick.events_max(), u32::MAX);
    }

    #[test]
    fn slots_of_lines_are_those_read_and_those_pushed() {
        let slots: Vec<(u32, u32)> = nested().tick.line_slots().into_iter().collect();
        assert_eq!(slots, [(0, 0), (0, 3)]);
    }

    #[test]
    fn every_value_inside_can_be_renamed() {
        let mut inst = nested().tick.insts[3].clone();
        let mut met = Vec::new();
        inst.for_each_value_mut(&mut |value| {
            met.push(value.0);
            value.0 += 100;
        });
        assert_eq!(met, [2, 3, 2]);
        let inner = &inst.regions[1].insts[0];
        assert_eq!(inner.regions[0].params, [Value(103)]);
        assert_eq!(inner.regions[0].insts[0].args, [Value(102)]);
    }
}
