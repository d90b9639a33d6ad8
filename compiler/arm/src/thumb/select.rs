//! From the Kernel's operators to instructions: which, not in which order or registers.
//!
//! ```text
//!   Mode (blocks of Kernel instructions, `if` and `loop` inside)  ->  Func (blocks of Code, flags and jumps)
//! ```
//!
//! Values are bound to what computes them: a constant costs nothing before it is needed in a
//! register, a comparison is made anew wherever its outcome steers (one CMP, where a 0 or 1 in a
//! register would cost three), all else is one register or, of 64 bits, two.
//!
//! | part | what it settles |
//! | --- | --- |
//! | `word` | arithmetic of words, constants, shifts |
//! | `wide` | arithmetic of 64 bits, products |
//! | `test` | comparisons, bools, selection |
//! | `divide`, `root` | quotient and square root |
//! | `memory` | cells, lines, tables, words in and out |
//! | `event` | the ring of events |
//! | `keep` | cells that may keep their word |
//! | `mark` | how often, and as what, values are used |
//! | `late`, `again` | values that wait for their user, or are computed anew |
//! | `control` | `if`, `loop`, blocks, the way to the next key |

mod again;
mod control;
mod divide;
mod event;
mod keep;
mod late;
mod mark;
mod memory;
mod root;
mod test;
mod wide;
mod word;

use super::frame::Frame;
use super::literal::Literals;
use super::minst::{Func, MInst, Reg, Role, VReg};
use super::tick_invariant::TickInvariants;
use event::Written;
use std::collections::BTreeMap;
use whippen_isa::Op as Isa;
use whippen_kernel::{Inst, Kernel, Op, Region, Type, Value, ValueInfo, Walk};
use whippen_modes::{End, Mode};

/// What a value is bound to.
#[derive(Debug, Clone, Copy)]
enum Bound {
    Nothing,
    Const(i64),
    One(VReg),
    /// The low and the high word.
    Two(VReg, VReg),
    /// A bool that is computed where it steers.
    Test(Op, [Value; 2]),
    /// What is used once, and computed there, if possible as a part of its user.
    Later(Op, [Value; 2]),
    /// What costs one instruction in each block that uses it, and no register between them.
    Again(Op, Value),
}

/// How many values may wait one for the other.
const LATE: u8 = 32;

/// Selection for one mode, or for `init`.
pub(super) struct Select<'a> {
    kernel: &'a Kernel,
    frame: &'a Frame,
    literals: &'a mut Literals,
    values: &'a [ValueInfo],
    bound: Vec<Bound>,
    /// Whether a bool is needed as a word.
    as_word: Vec<bool>,
    /// What is loaded wherever it is used.
    again: Vec<bool>,
    /// How many values that wait, one for the other, a value is made of.
    late: Vec<u8>,
    /// Choices that wait until they are stored.
    waiting: Vec<bool>,
    /// Those that are waiting.
    chosen: BTreeMap<Value, [Value; 3]>,
    /// The cell whose word a value is, as it was.
    old: Vec<Option<u32>>,
    /// In which block it was done last, and where the result is.
    done: Vec<Option<(usize, VReg)>>,
    /// Over how many decisions such a result stays in its register.
    near: usize,
    /// The only block that leads to a block, of those that were asked about.
    above: BTreeMap<usize, Option<usize>>,
    /// Constants in registers: which, in which block, behind how many instructions.
    constants: Vec<(i32, usize, usize, VReg)>,
    /// How often each value is used, more than once if in a loop.
    used: Vec<u32>,
    /// How often each value is a term of a sum.
    summed: Vec<u32>,
    func: Func,
    /// The block that code goes to.
    at: usize,
    origin: Option<u32>,
    /// What the last event left in registers; nothing behind a loop, whose rounds may have events.
    written: Option<Written>,
    /// The word of the first input port, as it came in.
    input: Option<VReg>,
    /// Whether indices must be held inside, because an `assume` may be wrong.
    guard: bool,
    /// Whether H walks on with the push.
    push_walks: bool,
    /// The mode, none in `init`.
    mode: Option<usize>,
}

impl<'a> Select<'a> {
    fn new(
        kernel: &'a Kernel,
        frame: &'a Frame,
        literals: &'a mut Literals,
        values: &'a [ValueInfo],
        mode: Option<usize>,
    ) -> Self {
        let pushes =
            |inst: &Inst| matches!(inst.op, Op::Push(line) if Some(line) == frame.first_line);
        Select {
            kernel,
            frame,
            literals,
            values,
            bound: vec![Bound::Nothing; values.len()],
            as_word: vec![false; values.len()],
            again: vec![false; values.len()],
            late: vec![0; values.len()],
            waiting: vec![false; values.len()],
            chosen: BTreeMap::new(),
            old: vec![None; values.len()],
            done: vec![None; values.len()],
            near: 0,
            above: BTreeMap::new(),
            constants: Vec::new(),
            used: vec![0; values.len()],
            summed: vec![0; values.len()],
            func: Func::new(),
            at: 0,
            origin: None,
            written: None,
            input: None,
            guard: assumes(&kernel.init) || assumes(&kernel.tick),
            push_walks: mode.is_some()
                && frame.pointers.is_empty()
                && kernel.tick.insts.iter().any(pushes),
            mode,
        }
    }

    /// The code of one mode; what can be loaded again stays in its register over so many decisions.
    pub(super) fn mode(
        kernel: &'a Kernel,
        frame: &'a Frame,
        literals: &'a mut Literals,
        mode: &'a Mode,
        index: usize,
        near: usize,
    ) -> Func {
        let mut select = Select {
            near,
            ..Select::new(kernel, frame, literals, &mode.values, Some(index))
        };
        for block in &mode.blocks {
            select.mark_words(&block.insts);
            select.mark_summed(&block.insts);
            match &block.end {
                End::Jump(target) => select.mark(&target.args),
                End::Branch {
                    condition, yes, no, ..
                } => {
                    select.used[condition.0 as usize] += 1;
                    [yes, no]
                        .into_iter()
                        .for_each(|target| select.mark(&target.args));
                }
                End::Next(_) => {}
            }
        }
        select.waiting = keep::waiting(mode, &select.used, kernel.cells.len());
        select.again = again::loads(kernel, mode, &select.waiting);
        mode.blocks
            .iter()
            .for_each(|block| select.mark_compared(&block.insts));
        select.blocks(mode);
        select.func
    }

    /// The code of `init`.
    pub(super) fn init(kernel: &'a Kernel, frame: &'a Frame, literals: &'a mut Literals) -> Func {
        let mut select = Select::new(kernel, frame, literals, &kernel.values, None);
        select.mark_words(&kernel.init.insts);
        select.mark_compared(&kernel.init.insts);
        select.at = select.func.block();
        select.enter();
        select.insts(&kernel.init.insts);
        select.init_done();
        select.func
    }

    /// The code of what is the same for all keys: it stores live values.
    pub(super) fn shared(
        kernel: &'a Kernel,
        frame: &'a Frame,
        literals: &'a mut Literals,
        shared: &'a TickInvariants,
    ) -> Func {
        let mut select = Select::new(kernel, frame, literals, &shared.values, None);
        select.mark_words(&shared.insts);
        select.mark(&shared.results);
        select.mark_compared(&shared.insts);
        select.at = select.func.block();
        select.insts(&shared.insts);
        select.store_shared(&shared.results);
        select.func
    }

    fn insts(&mut self, insts: &[Inst]) {
        for inst in insts {
            self.origin = inst.origin.or(self.origin);
            self.inst(inst);
        }
    }

    fn info(&self, value: Value) -> ValueInfo {
        self.values[value.0 as usize]
    }

    fn bind(&mut self, value: Value, bound: Bound) {
        self.bound[value.0 as usize] = bound;
    }

    fn emit(&mut self, code: MInst) {
        let origin = self.origin;
        self.func.blocks[self.at]
            .code
            .push(MInst { origin, ..code });
    }

    /// Emits an instruction whose result in D is new.
    fn result(&mut self, code: MInst) -> VReg {
        let d = self.func.fresh();
        self.emit(code.reg(Role::D, d));
        d
    }

    /// `op d, n, m`
    fn three(&mut self, op: Isa, n: VReg, m: VReg) -> VReg {
        self.result(MInst::new(op).reg(Role::N, n).reg(Role::M, m))
    }

    /// The known value of a constant.
    fn constant(&self, value: Value) -> Option<i64> {
        if let Bound::Const(k) = self.bound[value.0 as usize] {
            return Some(k);
        }
        None
    }

    /// The register of a word, or of a bool as 0 or 1.
    fn reg(&mut self, value: Value) -> VReg {
        match self.bound[value.0 as usize] {
            Bound::One(reg) | Bound::Two(reg, _) => reg,
            Bound::Const(k) => self.load_constant(k as i32),
            Bound::Test(..) => self.test_as_word(value),
            Bound::Later(Op::Not, args) => {
                let bound = self.logic(Op::Not, &args[..1]);
                self.bind(value, bound);
                self.reg(value)
            }
            Bound::Later(op, args) => {
                let word = self.word(op, &args);
                self.bind(value, Bound::One(word));
                word
            }
            Bound::Again(op, arg) => self.once_more(value, op, arg),
            Bound::Nothing => self.load_constant(0),
        }
    }

    /// The registers of 64 bits.
    fn pair(&mut self, value: Value) -> (VReg, VReg) {
        match self.bound[value.0 as usize] {
            Bound::Two(low, high) => (low, high),
            Bound::Const(k) => (
                self.load_constant(k as i32),
                self.load_constant((k >> 32) as i32),
            ),
            Bound::Later(op, args) => {
                let (low, high) = self.wide(op, &args);
                self.bind(value, Bound::Two(low, high));
                (low, high)
            }
            Bound::One(_) | Bound::Test(..) | Bound::Again(..) | Bound::Nothing => {
                let low = self.reg(value);
                (low, self.load_constant(0))
            }
        }
    }

    /// An instruction without regions.
    fn one(&mut self, inst: &Inst) {
        let result = inst.results.first().copied();
        let Some(result) = result else {
            return self.write(inst);
        };
        let info = self.info(result);
        if let Op::Get(cell) = inst.op {
            self.old[result.0 as usize] = Some(cell);
        }
        let bound = match (inst.op, info.ty) {
            (Op::Const(k), _) => Bound::Const(k),
            _ if info.range.low == info.range.high
                && inst.op.row().effect == whippen_kernel::Effect::Pure =>
            {
                Bound::Const(info.range.low)
            }
            (Op::Assume(..), ty) => match self.bound[inst.args[0].0 as usize] {
                // What waits for one user is computed where that stands; several may stand in
                // blocks that do not meet.
                Bound::Later(..) if self.used[result.0 as usize] != 1 && ty == Type::I64 => {
                    self.both(inst.args[0])
                }
                Bound::Later(..) if self.used[result.0 as usize] != 1 => {
                    Bound::One(self.reg(inst.args[0]))
                }
                bound => bound,
            },
            (Op::Lt | Op::Le | Op::Eq, _) => self.test(inst, result),
            (Op::Not, _) if self.used[result.0 as usize] == 1 && self.may_wait(&inst.args) => {
                Bound::Later(Op::Not, [inst.args[0]; 2])
            }
            (Op::And | Op::Or | Op::Not, _) => self.logic(inst.op, &inst.args),
            (Op::Select, _) if self.waits_for_store(inst) => Bound::Nothing,
            (Op::Select, ty) => self.select(ty, &inst.args),
            (Op::Get(_) | Op::Live(_) | Op::Tick(_) | Op::Keyed(_), _)
                if self.again[result.0 as usize] =>
            {
                Bound::Again(inst.op, result)
            }
            (Op::Shl(_) | Op::Sar(_), Type::I32)
                if self.repeats(inst, result) || self.is_part_of_all(inst, result) =>
            {
                Bound::Again(inst.op, inst.args[0])
            }
            (
                Op::In(_)
                | Op::Live(_)
                | Op::Tick(_)
                | Op::Keyed(_)
                | Op::Get(_)
                | Op::GetAt(_)
                | Op::Delay(..)
                | Op::Lookup(_),
                _,
            ) => self.read(inst.op, &inst.args),
            (Op::DivRound(n), _) => Bound::One(self.div_round(inst.args[0], inst.args[1], n)),
            (Op::Sqrt, _) => Bound::One(self.root(inst.args[0])),
            (Op::Narrow, _) => self.narrow(inst.args[0]),
            (op, _) if self.waits(op, result) && self.may_wait(&inst.args) => Bound::Later(
                op,
                [inst.args[0], *inst.args.get(1).unwrap_or(&inst.args[0])],
            ),
            (op, Type::I64) => {
                let (low, high) = self.wide(op, &inst.args);
                Bound::Two(low, high)
            }
            (op, _) => Bound::One(self.word(op, &inst.args)),
        };
        self.late[result.0 as usize] = match bound {
            Bound::Later(..) | Bound::Test(..) | Bound::Again(..) => inst
                .args
                .iter()
                .map(|arg| self.late[arg.0 as usize])
                .max()
                .unwrap_or(0)
                .saturating_add(1),
            _ => 0,
        };
        self.bind(result, bound);
    }

    /// The operator and operands of a value that is still to be computed.
    fn later(&self, value: Value) -> Option<(Op, [Value; 2])> {
        if let Bound::Later(op, args) = self.bound[value.0 as usize] {
            return Some((op, args));
        }
        None
    }

    fn fixed(reg: u8) -> Reg {
        Reg::Fixed(reg)
    }
}

fn assumes(region: &Region) -> bool {
    region
        .insts
        .iter()
        .any(|inst| matches!(inst.op, Op::Assume(..)) || inst.regions.iter().any(assumes))
}
