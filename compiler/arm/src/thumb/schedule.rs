//! List scheduling of basic blocks under register pressure, before allocation.
//!
//! ```text
//!   block in selection's order -> dependence graph with stalls -> the best of the ready instructions, one by one
//! ```
//!
//! Stalls are those of `isa::timing`: a candidate behind the instruction issued last costs what
//! [`Core::issue`] says. Candidates that stall come last; of the others the one with the longest
//! path to the block's end comes first. Where as many values are alive as the limit allows, the one
//! that frees most comes first.
//!
//! Not here: the limit of live values (`search` tries some), motion across blocks (`hoist`).

use super::dependence::{Dependences, build_dependences};
use super::func::{Func, Terminator};
use super::liveness::{compute_live_in, live_out_of};
use super::minst::{Access, MInst, Reg, Role, VReg};
use super::registers::RECORD;
use whippen_ids::{IdMap, longest_paths};
use whippen_isa::timing::{Core, Outcome, Pipe, Timed};

/// Schedules every block; about `limit` values are alive at once.
pub(super) fn schedule_blocks(func: &mut Func, core: &Core, limit: usize) {
    let live_in = compute_live_in(func);
    let vregs = func.vregs as usize;
    for block in &mut func.blocks {
        let live_out: Vec<VReg> = live_out_of(block, &live_in).members().map(VReg).collect();
        let graph = StallGraph::new(&block.code, core);
        let scheduler = ListScheduler::new(&block.code, &graph, &live_out, limit, vregs);
        let order = scheduler.run();
        block.code = order.iter().map(|at| block.code[*at]).collect();
    }
}

/// Exchanges the load of the next key's code with the instruction before it, so that the branch
/// finds the address there.
pub(super) fn advance_next_key_loads(func: &mut Func) {
    for block in &mut func.blocks {
        if let Terminator::NextKey(_) = block.end {
            advance_next_key_load(&mut block.code);
        }
    }
}

/// A dependence graph with the cycles that results are waited for.
struct StallGraph {
    dependences: Dependences,
    /// How many cycles each of `after` waits if it comes next.
    stalls: Vec<Vec<u32>>,
    /// Cycles from each instruction to the end along the longest chain.
    height: IdMap<usize, u32>,
}

impl StallGraph {
    fn new(code: &[MInst], core: &Core) -> StallGraph {
        let dependences = build_dependences(code);
        let stalls: Vec<Vec<u32>> = (code.iter().zip(&dependences.after))
            .map(|(from, after)| {
                let pipe = PipelineAfter::new(core, from);
                after
                    .iter()
                    .map(|to| pipe.stall_cycles(core, &code[*to]))
                    .collect()
            })
            .collect();
        let height = longest_paths(
            code.len(),
            (0..code.len()).rev(),
            |_| 1,
            |at, height| {
                let after = dependences.after[at].iter().zip(&stalls[at]);
                after.map(|(next, stall)| height[next] + stall).max()
            },
        );
        StallGraph {
            dependences,
            stalls,
            height,
        }
    }

    /// Cycles that `to` waits right behind `from`.
    fn stall_between(&self, from: usize, to: usize) -> u32 {
        let mut after = self.dependences.after[from].iter().zip(&self.stalls[from]);
        after
            .find(|(at, _)| **at == to)
            .map_or(0, |(_, stall)| *stall)
    }
}

/// The same in one block. The load walks RECORD on, so what the instruction before it accesses by
/// RECORD is then at another offset.
fn advance_next_key_load(code: &mut [MInst]) {
    let [.., before, load] = code else { return };
    let walks = load.inst.wback.then_some(load.inst.imm as i64);
    let by_k = |code: &MInst| code.uses().any(|u| u.operand.reg == Reg::Fixed(RECORD));
    let offset = i64::from(before.inst.imm) * if before.inst.add { 1 } else { -1 };
    // What is called finds its memory by RECORD.
    let stays = before.inst.wback || before.inst.cond.is_some() || before.convention().is_some();
    let (Some(walks), false) = (walks, stays) else {
        return;
    };
    if before.writes().any(|reg| load.reads().any(|r| r == reg)) {
        return;
    }
    if by_k(before) {
        let offset = offset - walks;
        if before.access == Access::None || !(-255..0).contains(&offset) {
            return;
        }
        (before.inst.add, before.inst.imm) = (false, offset.unsigned_abs() as u32);
    }
    std::mem::swap(before, load);
}

/// The pipeline behind an instruction.
struct PipelineAfter {
    /// What it defines.
    results: Vec<VReg>,
    pipe: Pipe,
}

impl PipelineAfter {
    fn new(core: &Core, last: &MInst) -> PipelineAfter {
        let behind = PipelineAfter {
            results: last.writes().collect(),
            pipe: Pipe::default(),
        };
        let (pipe, _) = core.issue(
            behind.pipe,
            &behind.with_result_numbers(core, last, false),
            0,
            &Outcome::NEXT,
        );
        PipelineAfter { pipe, ..behind }
    }

    /// Cycles that `next` waits when it comes right here.
    fn stall_cycles(&self, core: &Core, next: &MInst) -> u32 {
        if self.pipe.delays_nobody() {
            return 0;
        }
        let next = self.with_result_numbers(core, next, true);
        let (_, behind) = core.issue(self.pipe, &next, 4, &Outcome::NEXT);
        let (_, alone) = core.issue(Pipe::default(), &next, 4, &Outcome::NEXT);
        behind.cycles().saturating_sub(alone.cycles())
    }

    /// An instruction whose results get the first numbers; all others are one register that nobody
    /// waits for.
    fn with_result_numbers(&self, core: &Core, code: &MInst, reads: bool) -> Timed {
        let number = |reg: Reg| match reg {
            Reg::Virtual(reg) => self
                .results
                .iter()
                .position(|r| *r == reg)
                .map_or(12, |at| at as u8),
            Reg::Fixed(reg) => reg,
        };
        let mut inst = code.inst;
        for role in Role::ALL {
            if let Some(operand) = code.operands[role as usize] {
                let old = operand.old.filter(|_| reads).map(Reg::Virtual);
                *role.of(&mut inst) = number(old.unwrap_or(operand.reg));
            }
        }
        core.prepare(&inst)
    }
}

/// A block being scheduled.
struct ListScheduler<'a> {
    code: &'a [MInst],
    graph: &'a StallGraph,
    limit: usize,
    /// The registers that each instruction reads, with how often.
    reads: Vec<Vec<(VReg, u32)>>,
    /// How many values that somebody needs each instruction defines.
    begun: Vec<isize>,
    /// Uses that are still to come, by register; those behind the block count one.
    left: IdMap<VReg, u32>,
    /// How many predecessors are still to come.
    blocked: Vec<usize>,
    alive: usize,
    order: Vec<usize>,
}

impl<'a> ListScheduler<'a> {
    fn new(
        code: &'a [MInst],
        graph: &'a StallGraph,
        live_out: &[VReg],
        limit: usize,
        vregs: usize,
    ) -> ListScheduler<'a> {
        let reads: Vec<Vec<(VReg, u32)>> = code.iter().map(count_reads).collect();
        let writes: Vec<Vec<VReg>> = code.iter().map(|code| code.writes().collect()).collect();
        let mut left: IdMap<VReg, u32> = IdMap::filled(0, vregs);
        for (reg, times) in reads.iter().flatten() {
            left[reg] += times;
        }
        live_out.iter().for_each(|reg| left[reg] += 1);
        let needed = |reg: &&VReg| left[*reg] > 0;
        let begun = writes
            .iter()
            .map(|regs| regs.iter().filter(needed).count() as isize)
            .collect();
        let mut comes_in: IdMap<VReg, bool> = left.iter().map(|left| *left > 0).collect();
        writes
            .iter()
            .flatten()
            .for_each(|reg| comes_in[reg] = false);
        let alive = comes_in.into_iter().filter(|is| *is).count();
        let blocked = graph.dependences.before.iter().map(Vec::len).collect();
        ListScheduler {
            code,
            graph,
            limit,
            reads,
            begun,
            left,
            blocked,
            alive,
            order: Vec::new(),
        }
    }

    fn run(mut self) -> Vec<usize> {
        let mut ready: Vec<usize> = (0..self.code.len())
            .filter(|at| self.blocked[*at] == 0)
            .collect();
        while let Some(place) = self.pick_ready(&ready) {
            let at = ready.swap_remove(place);
            self.alive = self.alive.saturating_add_signed(self.pressure_change(at));
            for (reg, times) in &self.reads[at] {
                self.left[reg] -= times;
            }
            self.order.push(at);
            for next in &self.graph.dependences.after[at] {
                self.blocked[*next] -= 1;
                if self.blocked[*next] == 0 {
                    ready.push(*next);
                }
            }
        }
        self.order
    }

    fn pick_ready(&self, ready: &[usize]) -> Option<usize> {
        (0..ready.len()).min_by_key(|place| self.rank(ready[*place]))
    }

    /// Less is better.
    fn rank(&self, at: usize) -> (bool, isize, u32, bool, std::cmp::Reverse<u32>, usize) {
        let (waits, apart) = match self.order.last() {
            Some(last) => (
                self.graph.stall_between(*last, at),
                self.breaks_it_block(*last, at),
            ),
            None => (0, false),
        };
        let change = self.pressure_change(at);
        let scarce = self.alive >= self.limit;
        let over = self.alive.saturating_add_signed(change) > self.limit;
        (
            over,
            if scarce { change } else { 0 },
            waits,
            apart,
            std::cmp::Reverse(self.graph.height[at]),
            at,
        )
    }

    /// Whether it would end a run of instructions that can share an IT block.
    fn breaks_it_block(&self, last: usize, at: usize) -> bool {
        let (last, next) = (self.code[last].inst.cond, self.code[at].inst.cond);
        last.is_some_and(|last| next != Some(last) && next != last.invert())
    }

    /// How many more values are alive behind it.
    fn pressure_change(&self, at: usize) -> isize {
        let ended = self.reads[at]
            .iter()
            .filter(|(reg, times)| self.left[reg] == *times)
            .count();
        self.begun[at] - ended as isize
    }
}

/// The registers that an instruction reads, each with how often.
fn count_reads(code: &MInst) -> Vec<(VReg, u32)> {
    let mut all: Vec<(VReg, u32)> = Vec::new();
    for reg in code.reads() {
        match all.iter_mut().find(|(known, _)| *known == reg) {
            Some((_, times)) => *times += 1,
            None => all.push((reg, 1)),
        }
    }
    all
}
