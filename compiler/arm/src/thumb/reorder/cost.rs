//! What an order of a block's instructions costs, encodings and IT blocks as `emit` makes them,
//! counted by `isa::timing`.

use super::pipeline_states::{PipelineStates, START};
use crate::thumb::emit;
use crate::thumb::func::{Block, Terminator};
use crate::thumb::minst::{PReg, template};
use whippen_isa::reg::LR;
use whippen_isa::timing::{Core, Outcome};
use whippen_isa::{Cond, Flags, Inst, Op};

/// One encoding of an instruction.
#[derive(Clone, Copy)]
struct Form {
    /// Its number in [`PipelineStates`].
    number: u16,
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
pub(super) struct OrderCost {
    pipes: PipelineStates,
    forms: Vec<Forms>,
    it: Form,
    /// The branch at the end, and whether it is always taken; none if the next block may just
    /// follow.
    end: Option<(Form, bool)>,
    /// The order that others are compared with.
    base: Base,
    /// Which of the two forms, by place: of the base, but while another order is measured.
    setting: Vec<bool>,
}

/// An order that was measured.
#[derive(Default)]
struct Base {
    setting: Vec<bool>,
    /// The flags that are wanted behind each place.
    wanted: Vec<Flags>,
    /// The states before each place and at the end.
    states: Vec<IssueState>,
    total: u32,
}

/// Between two instructions.
#[derive(Debug, Clone, Copy)]
struct IssueState {
    pipe: u16,
    left_in_it: u16,
    /// Twice the cycles so far.
    sum: u32,
}

impl IssueState {
    const START: IssueState = IssueState {
        pipe: START,
        left_in_it: 0,
        sum: 0,
    };

    /// Whether what follows costs the same.
    fn is_like(&self, other: &IssueState) -> bool {
        (self.pipe, self.left_in_it) == (other.pipe, other.left_in_it)
    }
}

impl OrderCost {
    pub fn new(block: &Block<PReg>, core: &Core) -> OrderCost {
        let mut insts = Vec::with_capacity(2 * block.code.len() + 2);
        let mut form = |inst: &Inst| {
            let flags = inst.flags();
            insts.push(core.prepare(inst));
            Form {
                number: insts.len() as u16 - 1,
                reads: flags.reads,
                writes: flags.writes,
            }
        };
        let mut forms = |inst: &Inst| Forms {
            plain: form(inst),
            setting: emit::flag_setting_form(inst, core.arch).map(|inst| form(&inst)),
            cond: inst.cond,
        };
        let all = block.code.iter().map(|fixed| forms(&fixed.inst)).collect();
        let it = form(&emit::it_inst(
            Cond::EQ,
            &[(template(Op::MOV_register), None, None)],
        ));
        let end = match &block.end {
            Terminator::Branch { cond, .. } => {
                Some((form(&emit::branch_inst(Some(*cond), false, 0)), false))
            }
            Terminator::NextKey(_) => Some((
                form(&Inst {
                    m: LR,
                    ..template(Op::BX)
                }),
                true,
            )),
            Terminator::Jump(_) | Terminator::FallThrough => None,
        };
        let pipes = PipelineStates::new(core, insts);
        OrderCost {
            pipes,
            forms: all,
            it,
            end,
            base: Base::default(),
            setting: vec![false; block.code.len()],
        }
    }

    /// Twice the cycles, so that half of them are for each side of a branch; others are compared
    /// with this order from here on.
    pub fn accept(&mut self, order: &[usize]) -> u32 {
        let mut wanted = match self.end {
            Some((_, false)) => Flags::NZCV,
            _ => Flags::NONE,
        };
        self.base.wanted.resize(order.len(), Flags::NONE);
        for place in (0..order.len()).rev() {
            self.base.wanted[place] = wanted;
            wanted = self.choose_form(order, place, wanted);
        }
        self.base.setting.clone_from(&self.setting);
        self.base.states.clear();
        let mut state = IssueState::START;
        for place in 0..order.len() {
            self.base.states.push(state);
            state = self.step(state, order, place);
        }
        self.base.states.push(state);
        self.base.total = state.sum + self.end(state);
        self.base.total
    }

    /// The same for an order that differs from `first` to `last`.
    pub fn cost_of(&mut self, order: &[usize], first: usize, last: usize) -> u32 {
        let first = self.choose_forms(order, first, last);
        let cycles = self.from(order, first, last);
        self.setting[first..=last].copy_from_slice(&self.base.setting[first..=last]);
        cycles
    }

    /// What an order costs that differs, with its forms, from `first` to `last`.
    fn from(&mut self, order: &[usize], first: usize, last: usize) -> u32 {
        // An IT block looks ahead.
        let is_conditional = |place: &usize| self.forms[order[*place]].cond.is_some();
        let first = (0..first)
            .rev()
            .take_while(is_conditional)
            .last()
            .unwrap_or(first);
        let mut state = self.base.states[first];
        for place in first..order.len() {
            let known = &self.base.states[place];
            if place > last && state.is_like(known) {
                return self.base.total + state.sum - known.sum;
            }
            state = self.step(state, order, place);
        }
        state.sum + self.end(state)
    }

    /// One instruction, with an IT in front of it if it begins a block.
    fn step(&mut self, mut state: IssueState, order: &[usize], place: usize) -> IssueState {
        let forms = &self.forms[order[place]];
        let form = forms
            .setting
            .as_ref()
            .filter(|_| self.setting[place])
            .unwrap_or(&forms.plain)
            .number;
        if forms.cond.is_some() && state.left_in_it == 0 {
            state = self.issue(state, self.it.number);
            state.left_in_it = self.it_block(&order[place..]);
        }
        state.left_in_it = state.left_in_it.saturating_sub(1);
        self.issue(state, form)
    }

    fn issue(&mut self, state: IssueState, inst: u16) -> IssueState {
        let (pipe, cycles) = self.pipes.issue(state.pipe, inst);
        IssueState {
            pipe,
            sum: state.sum + 2 * u32::from(cycles),
            ..state
        }
    }

    /// Twice the cycles of the end.
    fn end(&self, state: IssueState) -> u32 {
        let taken = Outcome::taken(0, false);
        let cycles =
            |form: &Form, outcome: &Outcome| self.pipes.cycles(state.pipe, form.number, outcome);
        match &self.end {
            None => 0,
            Some((form, true)) => 2 * cycles(form, &taken),
            Some((form, false)) => cycles(form, &Outcome::NEXT) + cycles(form, &taken),
        }
    }

    /// The forms of an order that differs from `first` to `last`; from where on it does then.
    fn choose_forms(&mut self, order: &[usize], first: usize, last: usize) -> usize {
        let (mut from, mut wanted) = (first, self.base.wanted[last]);
        for place in (0..=last).rev() {
            if place < first && wanted == self.base.wanted[place] {
                break;
            }
            wanted = self.choose_form(order, place, wanted);
            if self.setting[place] != self.base.setting[place] {
                from = from.min(place);
            }
        }
        from
    }

    /// Flags may be set where nobody reads them: given those that are wanted behind a place, gives
    /// those before it.
    fn choose_form(&mut self, order: &[usize], place: usize, wanted: Flags) -> Flags {
        let Forms {
            plain,
            setting,
            cond,
        } = &self.forms[order[place]];
        self.setting[place] = wanted.is_empty() && setting.is_some();
        let form = setting
            .as_ref()
            .filter(|_| self.setting[place])
            .unwrap_or(plain);
        let kept = if cond.is_some() {
            wanted | form.writes
        } else {
            wanted.without(form.writes)
        };
        kept | form.reads
    }

    /// How many instructions one IT block holds from here on.
    fn it_block(&self, order: &[usize]) -> u16 {
        emit::it_block_len(order.iter().map(|index| self.forms[*index].cond)) as u16
    }
}
