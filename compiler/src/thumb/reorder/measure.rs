//! What an order of a block's instructions costs, encodings and IT blocks as `emit` makes them, counted by `isa::timing`.

use crate::thumb::allocate::Placed;
use crate::thumb::emit;
use crate::thumb::vcode::{End, template};
use whippen_isa::reg::LR;
use whippen_isa::timing::{Core, Outcome, Pipe, Timed};
use whippen_isa::{Cond, Flags, Inst, Op};

/// One encoding of an instruction.
#[derive(Clone, Copy)]
struct Form {
    timed: Timed,
    bytes: u32,
    reads: Flags,
    writes: Flags,
}

/// An instruction as it is, and as one that sets the flags if that makes it shorter.
struct Forms {
    plain: Form,
    setting: Option<Form>,
    cond: Option<Cond>,
}

/// A block whose orders are measured.
pub(super) struct Measure {
    core: Core,
    forms: Vec<Forms>,
    it: Form,
    /// The branch at the end, and whether it is always taken; none if the next block may just follow.
    end: Option<(Form, bool)>,
    /// The order that others are compared with.
    base: Base,
    /// Which of the two forms, by place, of the order that is measured.
    setting: Vec<bool>,
}

/// An order that was measured: the states before each place and at the end.
#[derive(Default)]
struct Base {
    order: Vec<usize>,
    setting: Vec<bool>,
    states: Vec<State>,
    total: u32,
}

/// Between two instructions.
#[derive(Debug, Clone, Copy, Default)]
struct State {
    pipe: Pipe,
    at: u32,
    /// Twice the cycles so far.
    sum: u32,
    left_in_it: usize,
}

impl State {
    /// Whether what follows costs the same.
    fn is_like(&self, other: &State) -> bool {
        (self.pipe, self.at % 4, self.left_in_it) == (other.pipe, other.at % 4, other.left_in_it)
    }
}

impl Measure {
    pub fn new(block: &Placed, core: &Core) -> Measure {
        let form = |inst: &Inst| {
            let flags = inst.flags();
            Form { timed: core.prepare(inst), bytes: inst.size(), reads: flags.reads, writes: flags.writes }
        };
        let forms = |inst: &Inst| Forms {
            plain: form(inst),
            setting: emit::setting(inst, core.arch).map(|inst| form(&inst)),
            cond: inst.cond,
        };
        let end = match &block.end {
            End::Branch { cond, .. } => Some((form(&emit::branch(Some(*cond), false, 0)), false)),
            End::Next(_) => Some((form(&Inst { m: LR, ..template(Op::BX) }), true)),
            End::Jump(_) | End::InitDone => None,
        };
        Measure {
            core: *core,
            forms: block.code.iter().map(|fixed| forms(&fixed.inst)).collect(),
            it: form(&emit::it(Cond::EQ, &[(template(Op::MOV_register), None, None)])),
            end,
            base: Base::default(),
            setting: vec![false; block.code.len()],
        }
    }

    /// Twice the cycles, so that half of them are for each way of a branch; others are compared with this order from here on.
    pub fn accept(&mut self, order: &[usize]) -> u32 {
        self.choose_forms(order);
        let (mut state, mut states) = (State::default(), Vec::with_capacity(order.len() + 1));
        for place in 0..order.len() {
            states.push(state);
            state = self.step(state, order, place);
        }
        states.push(state);
        let total = state.sum + self.end(state);
        self.base = Base { order: order.to_vec(), setting: self.setting.clone(), states, total };
        total
    }

    /// The same for an order that differs a little.
    pub fn of(&mut self, order: &[usize]) -> u32 {
        self.choose_forms(order);
        let Base { order: known, setting, states, total } = &self.base;
        let differs = |place: &usize| known[*place] != order[*place] || setting[*place] != self.setting[*place];
        let Some(first) = (0..order.len()).find(differs) else { return *total };
        let last = (first..order.len()).rfind(differs).unwrap_or(first);
        // An IT block looks ahead over four instructions.
        let first = first.saturating_sub(4);
        let mut state = states[first];
        for (place, known) in states.iter().enumerate().take(order.len()).skip(first) {
            if place > last && state.is_like(known) {
                return total + state.sum - known.sum;
            }
            state = self.step(state, order, place);
        }
        state.sum + self.end(state)
    }

    /// One instruction, with an IT in front of it if it begins a block.
    fn step(&self, mut state: State, order: &[usize], place: usize) -> State {
        let forms = &self.forms[order[place]];
        if forms.cond.is_some() && state.left_in_it == 0 {
            state = self.issue(state, &self.it);
            state.left_in_it = self.it_block(&order[place..]);
        }
        state.left_in_it = state.left_in_it.saturating_sub(1);
        self.issue(state, forms.setting.as_ref().filter(|_| self.setting[place]).unwrap_or(&forms.plain))
    }

    fn issue(&self, state: State, form: &Form) -> State {
        let (pipe, cost) = self.core.issue(state.pipe, &form.timed, state.at, &Outcome::NEXT);
        State { pipe, at: state.at + form.bytes, sum: state.sum + 2 * cost.cycles(), ..state }
    }

    /// Twice the cycles of the end.
    fn end(&self, state: State) -> u32 {
        let taken = Outcome::taken(0, false);
        let cycles = |form: &Form, way: &Outcome| self.core.issue(state.pipe, &form.timed, state.at, way).1.cycles();
        match &self.end {
            None => 0,
            Some((form, true)) => 2 * cycles(form, &taken),
            Some((form, false)) => cycles(form, &Outcome::NEXT) + cycles(form, &taken),
        }
    }

    /// Flags may be set where nobody reads them.
    fn choose_forms(&mut self, order: &[usize]) {
        let mut live = match self.end {
            Some((_, false)) => Flags::NZCV,
            _ => Flags::NONE,
        };
        for (place, index) in order.iter().enumerate().rev() {
            let Forms { plain, setting, cond } = &self.forms[*index];
            self.setting[place] = live.is_empty() && setting.is_some();
            let form = setting.as_ref().filter(|_| self.setting[place]).unwrap_or(plain);
            live = live.without(form.writes) | form.reads;
            if cond.is_some() {
                live |= form.writes;
            }
        }
    }

    /// How many instructions one IT block holds from here on.
    fn it_block(&self, order: &[usize]) -> usize {
        emit::it_block(order.iter().map(|index| self.forms[*index].cond))
    }
}
