//! Instruction selection by maximal munch: from the Kernel's operators to instructions over virtual
//! registers.
//!
//! ```text
//!   Mode (blocks of Kernel instructions, `if` and `loop` inside)  ->  Func (blocks of Code, flags and jumps)
//! ```
//!
//! Every value has a binding: a constant costs nothing before it is needed in a register, a
//! comparison is made anew wherever its outcome steers (one CMP, where a 0 or 1 in a register would
//! cost three), a shift or product that is used once is deferred until its user is selected and
//! folded into that, a load is rematerialized in each block; all else is one register or, of 64
//! bits, two.
//!
//! | part | what it settles |
//! | --- | --- |
//! | `use_count` | how often, and as what, values are used: counted before anything is selected |
//! | `operator` | which rule selects each operator |
//! | `arith_i32` | arithmetic of words, constants, shifts |
//! | `arith_i64` | arithmetic of 64 bits, products |
//! | `compare` | comparisons, bools, choices |
//! | `divide`, `square_root` | quotient and square root |
//! | `memory` | cells, lines, tables, words in and out |
//! | `event` | the ring of events |
//! | `defer` | values that are folded into their user |
//! | `remat` | loads that are made again in each block |
//! | `conditional_store` | choices between a new word and the cell's old one |
//! | `control` | `if`, `loop`, blocks, the way to the next key |

mod arith_i32;
mod arith_i64;
mod compare;
mod conditional_store;
mod control;
mod defer;
mod divide;
mod event;
mod memory;
mod operator;
mod remat;
mod square_root;
mod use_count;

use super::func::Func;
use super::literal::Literals;
use super::minst::{MInst, Reg, Role, VReg};
use super::state_layout::StateLayout;
use super::tick_invariant::TickInvariants;
use event::EventEnd;
use std::collections::BTreeMap;
use whippen_isa::Op as Isa;
use whippen_kernel::{Inst, Kernel, Op, Value, ValueInfo, Walk};
use whippen_modes::{End, Mode};

/// How a value is available to its users.
#[derive(Debug, Clone, Copy)]
enum Binding {
    Unbound,
    Const(i64),
    Word(VReg),
    /// The low and the high word.
    Pair(VReg, VReg),
    /// A bool that is computed where it steers.
    Comparison(Op, [Value; 2]),
    /// Deferred selection: computed at its only user, if possible as a part of that.
    Deferred(Op, [Value; 2]),
    /// Computed anew, by one instruction, in each block that uses it.
    Rematerialize(Op, Value),
}

/// How many values may be deferred one to the other.
const DEFER_DEPTH_MAX: u8 = 32;

/// Selection for one mode, or for `init`.
pub(super) struct Select<'a> {
    kernel: &'a Kernel,
    layout: &'a StateLayout,
    literals: &'a mut Literals,
    values: &'a [ValueInfo],
    bindings: Vec<Binding>,
    /// Whether a bool is needed as a word.
    as_word: Vec<bool>,
    /// What is loaded wherever it is used.
    rematerializable: Vec<bool>,
    /// How many values that are deferred, one to the other, a value is made of.
    defer_depth: Vec<u8>,
    /// Choices that are deferred to their store.
    becomes_store: Vec<bool>,
    /// The operands of those that are selected.
    pending_choices: BTreeMap<Value, [Value; 3]>,
    /// The cell whose word a value is, as it was.
    loaded_from: Vec<Option<u32>>,
    /// In which block it was done last, and where the result is.
    rematerialized: Vec<Option<(usize, VReg)>>,
    /// Over how many decisions such a result stays in its register.
    remat_reach: usize,
    /// The only block that leads to a block, of those that were asked about.
    predecessors: BTreeMap<usize, Option<usize>>,
    /// Constants in registers: which, in which block, behind how many instructions.
    constants: Vec<(i32, usize, usize, VReg)>,
    /// How often each value is used, more than once if in a loop.
    use_count: Vec<u32>,
    /// How often each value is a term of a sum.
    sum_uses: Vec<u32>,
    func: Func,
    /// The block that code goes to.
    at: usize,
    origin: Option<u32>,
    /// What the last event left in registers; nothing behind a loop, whose rounds may have events.
    last_event: Option<EventEnd>,
    /// The word of the first input port, as it came in.
    first_input: Option<VReg>,
    /// Whether indices must be held inside, because an `assume` may be wrong.
    clamp_indices: bool,
    /// Whether HISTORY goes on with the push.
    push_walks: bool,
    /// The mode, none in `init`.
    own_mode: Option<usize>,
}

impl<'a> Select<'a> {
    fn new(
        kernel: &'a Kernel,
        layout: &'a StateLayout,
        literals: &'a mut Literals,
        values: &'a [ValueInfo],
        mode: Option<usize>,
    ) -> Self {
        let pushes =
            |inst: &Inst| matches!(inst.op, Op::Push(line) if Some(line) == layout.first_line);
        Select {
            kernel,
            layout,
            literals,
            values,
            bindings: vec![Binding::Unbound; values.len()],
            as_word: vec![false; values.len()],
            rematerializable: vec![false; values.len()],
            defer_depth: vec![0; values.len()],
            becomes_store: vec![false; values.len()],
            pending_choices: BTreeMap::new(),
            loaded_from: vec![None; values.len()],
            rematerialized: vec![None; values.len()],
            remat_reach: 0,
            predecessors: BTreeMap::new(),
            constants: Vec::new(),
            use_count: vec![0; values.len()],
            sum_uses: vec![0; values.len()],
            func: Func::new(),
            at: 0,
            origin: None,
            last_event: None,
            first_input: None,
            clamp_indices: kernel.assumes(),
            push_walks: mode.is_some()
                && layout.pointers.is_empty()
                && kernel.tick.insts.iter().any(pushes),
            own_mode: mode,
        }
    }

    /// The code of one mode; what can be loaded again stays in its register over so many decisions.
    pub(super) fn mode(
        kernel: &'a Kernel,
        layout: &'a StateLayout,
        literals: &'a mut Literals,
        mode: &'a Mode,
        index: usize,
        near: usize,
    ) -> Func {
        let mut select = Select {
            remat_reach: near,
            ..Select::new(kernel, layout, literals, &mode.values, Some(index))
        };
        for block in &mode.blocks {
            select.count_uses(&block.insts);
            select.count_sum_terms(&block.insts);
            match &block.end {
                End::Jump(target) => select.count_word_uses(&target.args),
                End::Branch {
                    condition, yes, no, ..
                } => {
                    select.use_count[condition.0 as usize] += 1;
                    [yes, no]
                        .into_iter()
                        .for_each(|target| select.count_word_uses(&target.args));
                }
                End::Next(_) => {}
            }
        }
        select.becomes_store = conditional_store::find(mode, &select.use_count, kernel.cells.len());
        select.rematerializable =
            remat::rematerializable_loads(kernel, mode, &select.becomes_store);
        mode.blocks
            .iter()
            .for_each(|block| select.count_compared(&block.insts));
        select.select_blocks(mode);
        select.func
    }

    /// The code of `init`.
    pub(super) fn init(
        kernel: &'a Kernel,
        layout: &'a StateLayout,
        literals: &'a mut Literals,
    ) -> Func {
        let mut select = Select::new(kernel, layout, literals, &kernel.values, None);
        select.count_uses(&kernel.init.insts);
        select.count_compared(&kernel.init.insts);
        select.at = select.func.block();
        select.load_input();
        select.select_insts(&kernel.init.insts);
        select.init_done();
        select.func
    }

    /// The code of what is the same for all keys: it stores live values.
    pub(super) fn shared(
        kernel: &'a Kernel,
        layout: &'a StateLayout,
        literals: &'a mut Literals,
        shared: &'a TickInvariants,
    ) -> Func {
        let mut select = Select::new(kernel, layout, literals, &shared.values, None);
        select.count_uses(&shared.insts);
        select.count_word_uses(&shared.results);
        select.count_compared(&shared.insts);
        select.at = select.func.block();
        select.select_insts(&shared.insts);
        select.store_shared(&shared.results);
        select.func
    }

    fn select_insts(&mut self, insts: &[Inst]) {
        for inst in insts {
            self.origin = inst.origin.or(self.origin);
            self.inst(inst);
        }
    }

    fn info(&self, value: Value) -> ValueInfo {
        self.values[value.0 as usize]
    }

    fn bind(&mut self, value: Value, bound: Binding) {
        self.bindings[value.0 as usize] = bound;
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
    fn emit_rrr(&mut self, op: Isa, n: VReg, m: VReg) -> VReg {
        self.result(MInst::new(op).reg(Role::N, n).reg(Role::M, m))
    }

    /// The known value of a constant.
    fn constant(&self, value: Value) -> Option<i64> {
        if let Binding::Const(k) = self.bindings[value.0 as usize] {
            return Some(k);
        }
        None
    }

    /// The register of a word, or of a bool as 0 or 1.
    fn reg(&mut self, value: Value) -> VReg {
        match self.bindings[value.0 as usize] {
            Binding::Word(reg) | Binding::Pair(reg, _) => reg,
            Binding::Const(k) => self.load_constant(k as i32),
            Binding::Comparison(..) => self.bool_as_word(value),
            Binding::Deferred(op, args) => {
                self.select_operator(op, &args, Some(value));
                self.reg(value)
            }
            Binding::Rematerialize(op, arg) => self.rematerialize(value, op, arg),
            Binding::Unbound => self.load_constant(0),
        }
    }

    /// The registers of 64 bits.
    fn pair(&mut self, value: Value) -> (VReg, VReg) {
        match self.bindings[value.0 as usize] {
            Binding::Pair(low, high) => (low, high),
            Binding::Const(k) => (
                self.load_constant(k as i32),
                self.load_constant((k >> 32) as i32),
            ),
            Binding::Deferred(op, args) => {
                self.select_operator(op, &args, Some(value));
                self.pair(value)
            }
            Binding::Word(_)
            | Binding::Comparison(..)
            | Binding::Rematerialize(..)
            | Binding::Unbound => {
                let low = self.reg(value);
                (low, self.load_constant(0))
            }
        }
    }

    /// An instruction without regions.
    fn select_inst(&mut self, inst: &Inst) {
        let Some(result) = inst.results.first().copied() else {
            return self.select_operator(inst.op, &inst.args, None);
        };
        if let Op::Get(cell) = inst.op {
            self.loaded_from[result.0 as usize] = Some(cell);
        }
        match self.bind_without_code(inst, result) {
            Some(bound) => self.bind(result, bound),
            None => self.select_operator(inst.op, &inst.args, Some(result)),
        }
        if self.as_word[result.0 as usize] {
            self.bind_comparison_as_word(result);
        }
        self.defer_depth[result.0 as usize] = self.depth_of(inst, result);
    }

    /// The operator and operands of a value that is still to be computed.
    fn deferred(&self, value: Value) -> Option<(Op, [Value; 2])> {
        if let Binding::Deferred(op, args) = self.bindings[value.0 as usize] {
            return Some((op, args));
        }
        None
    }

    fn fixed(reg: u8) -> Reg {
        Reg::Fixed(reg)
    }
}
