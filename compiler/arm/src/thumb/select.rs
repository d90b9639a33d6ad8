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
//! | `plan` | the pass before: uses of values, loads that may be made again, conditional stores |
//! | `operator` | which rule selects each operator |
//! | `arith_i32`, `shift` | arithmetic of words, constants; shifts, alone and of operands |
//! | `arith_i64` | arithmetic of 64 bits, products |
//! | `compare` | comparisons, bools, choices |
//! | `divide`, `quot`, `square_root` | quotients, exact and of 16 bits, and square root |
//! | `memory` | cells, lines, tables, words in and out |
//! | `event` | the ring of events |
//! | `defer` | values that are folded into their user |
//! | `remat` | values that are computed anew in each block |
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
mod line;
mod memory;
mod operator;
pub(super) mod plan;
mod quot;
mod remat;
mod shift;
mod square_root;

use super::func::{BlockId, Func};
use super::literal::Literals;
use super::minst::{MInst, Reg, Role, RowPlace, VReg};
use super::state_layout::StateLayout;
use super::tick_invariant::TickInvariants;
use compare::Relation;
use event::EventEnd;
pub(super) use memory::WORDS_OUT;
use plan::Plan;
use std::collections::BTreeMap;
use whippen_ids::IdMap;
use whippen_isa::Op as Isa;
use whippen_kernel::{Inst, Kernel, Op, Range, Value, ValueInfo, Walk};
use whippen_modes::{Mode, ModeId};

/// A row of a table whose address is in a register, within a block.
struct TableRow {
    table: u32,
    row: Value,
    block: BlockId,
    address: VReg,
}

/// The address of a row of a table that is in a register, within a block.
struct KnownPlace {
    place: RowPlace,
    block: BlockId,
    /// Behind how many instructions of the block it was used last.
    used: usize,
    address: VReg,
}

/// The address of a word of memory beside a key's record, within a block.
struct Element {
    index: Value,
    /// How many there are, if the index is held inside.
    held: Option<u32>,
    size: i64,
    block: BlockId,
    address: VReg,
}

/// How a value is available to its users.
#[derive(Debug, Clone, Copy, Default)]
enum Binding {
    #[default]
    Unbound,
    Const(i64),
    Word(VReg),
    /// The low and the high word.
    Pair(VReg, VReg),
    /// A bool that is computed where it steers.
    Comparison(Relation, [Value; 2]),
    /// Deferred selection: computed at its only user, if possible as a part of that.
    Deferred(Op, [Value; 2]),
    /// Computed anew, by one instruction, in each block that uses it.
    Rematerialize(Op, Value),
    /// A choice that waits for the cell it is stored to: what decides it, and both sides.
    Choice([Value; 3]),
}

/// What selection has done with a value.
#[derive(Debug, Clone, Default)]
struct ValueState {
    binding: Binding,
    /// How many values that are deferred, one to the other, it is made of.
    defer_depth: u8,
    /// Where it lies whatever its operands are, because of the instruction that made it.
    held: Option<Range>,
    /// In which block it was rematerialized last, behind how many instructions, and where the
    /// result is.
    rematerialized: Option<(BlockId, usize, VReg)>,
}

/// Selection for one mode, or for `init`.
/// How far a rematerialized value stays in its register.
#[derive(Debug, Clone, Copy)]
pub(super) struct Near {
    /// Over so many decisions.
    pub decisions: usize,
    /// Of one block over so many instructions.
    pub instructions: usize,
    /// The address of a table's row over so many.
    pub addresses: usize,
}

impl Default for Near {
    fn default() -> Near {
        Near {
            decisions: 0,
            instructions: usize::MAX,
            addresses: 0,
        }
    }
}

pub(super) struct Select<'a> {
    kernel: &'a Kernel,
    layout: &'a StateLayout,
    literals: &'a mut Literals,
    values: &'a IdMap<Value, ValueInfo>,
    plan: &'a Plan,
    state: IdMap<Value, ValueState>,
    /// How far a rematerialized value stays in its register.
    remat_reach: Near,
    /// The only block that leads to a block, of those that were asked about.
    predecessors: BTreeMap<BlockId, Option<BlockId>>,
    /// Constants in registers: which, in which block, behind how many instructions.
    constants: Vec<(i32, BlockId, usize, VReg)>,
    /// Rows of tables whose address is in a register.
    rows: Vec<TableRow>,
    row_places: Vec<KnownPlace>,
    /// Sums of the record's address and an index that are in a register.
    elements: Vec<Element>,
    func: Func,
    /// The block that code goes to.
    at: BlockId,
    origin: Option<u32>,
    /// What the last event left in registers; nothing behind a loop, whose rounds may have events.
    last_event: Option<EventEnd>,
    /// What the last saturation held its operand to.
    last_held: Option<Range>,
    /// The word of the first input port, as it came in.
    first_input: Option<VReg>,
    /// Whether HISTORY goes on with the push.
    push_walks: bool,
    /// The mode, none in `init`.
    own_mode: Option<ModeId>,
}

impl<'a> Select<'a> {
    fn new(
        kernel: &'a Kernel,
        layout: &'a StateLayout,
        plan: &'a Plan,
        literals: &'a mut Literals,
        values: &'a IdMap<Value, ValueInfo>,
        mode: Option<ModeId>,
    ) -> Self {
        let pushes =
            |inst: &Inst| matches!(inst.op, Op::Push(line) if Some(line) == layout.first_line);
        Select {
            kernel,
            layout,
            literals,
            values,
            plan,
            state: IdMap::filled(ValueState::default(), values.len()),
            remat_reach: Near::default(),
            predecessors: BTreeMap::new(),
            constants: Vec::new(),
            rows: Vec::new(),
            elements: Vec::new(),
            row_places: Vec::new(),
            func: Func::new(),
            at: BlockId(0),
            origin: None,
            last_event: None,
            last_held: None,
            first_input: None,
            push_walks: mode.is_some()
                && layout.pointers.is_empty()
                && kernel.tick.insts.iter().any(pushes),
            own_mode: mode,
        }
    }

    /// The code of one mode; what can be loaded again stays in its register while it is near.
    pub(super) fn select_mode(
        kernel: &'a Kernel,
        layout: &'a StateLayout,
        plan: &'a Plan,
        literals: &'a mut Literals,
        mode: &'a Mode,
        index: ModeId,
        near: Near,
    ) -> Func {
        let mut select = Select {
            remat_reach: near,
            ..Select::new(kernel, layout, plan, literals, &mode.values, Some(index))
        };
        select.select_blocks(mode);
        select.func
    }

    /// The code of `init`.
    pub(super) fn select_init(
        kernel: &'a Kernel,
        layout: &'a StateLayout,
        plan: &'a Plan,
        literals: &'a mut Literals,
    ) -> Func {
        let mut select = Select::new(kernel, layout, plan, literals, &kernel.values, None);
        select.at = select.func.block();
        select.load_input();
        select.select_insts(&kernel.init.insts);
        select.init_done();
        select.func
    }

    /// The code of what is the same for all keys: it stores live values.
    pub(super) fn select_invariants(
        kernel: &'a Kernel,
        layout: &'a StateLayout,
        plan: &'a Plan,
        literals: &'a mut Literals,
        shared: &'a TickInvariants,
    ) -> Func {
        let mut select = Select::new(kernel, layout, plan, literals, &shared.values, None);
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
        self.values[value]
    }

    fn bind(&mut self, value: Value, bound: Binding) {
        self.state[value].binding = bound;
    }

    fn binding(&self, value: Value) -> Binding {
        self.state[value].binding
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
        if let Binding::Const(k) = self.binding(value) {
            return Some(k);
        }
        None
    }

    /// The register of a word, or of a bool as 0 or 1.
    fn reg(&mut self, value: Value) -> VReg {
        match self.binding(value) {
            Binding::Word(reg) | Binding::Pair(reg, _) => reg,
            Binding::Const(k) => self.load_constant(k as i32),
            Binding::Comparison(..) => self.bool_as_word(value),
            Binding::Deferred(op, args) => {
                self.select_operator(op, &args, Some(value));
                self.reg(value)
            }
            Binding::Rematerialize(op, arg) => self.rematerialize(value, op, arg),
            Binding::Unbound | Binding::Choice(_) => self.load_constant(0),
        }
    }

    /// The registers of 64 bits.
    fn pair(&mut self, value: Value) -> (VReg, VReg) {
        match self.binding(value) {
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
            | Binding::Unbound
            | Binding::Choice(_) => {
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
        match self.bind_without_code(inst, result) {
            Some(bound) => self.bind(result, bound),
            None => self.select_operator(inst.op, &inst.args, Some(result)),
        }
        if self.plan[result].as_word {
            self.bind_comparison_as_word(result);
        }
        self.state[result].defer_depth = self.depth_of(inst, result);
    }

    /// The operator and operands of a value that is still to be computed.
    fn deferred(&self, value: Value) -> Option<(Op, [Value; 2])> {
        if let Binding::Deferred(op, args) = self.binding(value) {
            return Some((op, args));
        }
        None
    }

    fn fixed(reg: u8) -> Reg {
        Reg::Fixed(reg)
    }
}
