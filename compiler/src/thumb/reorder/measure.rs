//! What an order of a block's instructions costs, encodings and IT blocks as `emit` makes them, counted by `isa::timing`.

use crate::thumb::allocate::Placed;
use crate::thumb::emit;
use crate::thumb::vcode::{End, template};
use whippen_isa::reg::LR;
use whippen_isa::timing::{Core, Outcome, Pipe, Timed};
use whippen_isa::{Arch, Cond, Flags, Inst, Op};

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
    /// Which of the two forms, by place.
    setting: Vec<bool>,
}

impl Measure {
    pub fn new(block: &Placed, core: &Core) -> Measure {
        let form = |inst: &Inst| {
            let short = inst.shortest(Arch::V8M).unwrap_or(*inst);
            let flags = inst.flags();
            let (reads, writes) = (flags.reads, flags.writes);
            Form { timed: core.prepare(&short), bytes: short.size(), reads, writes }
        };
        let forms = |inst: &Inst| Forms {
            plain: form(inst),
            setting: emit::setting(inst, Arch::V8M).map(|inst| form(&inst)),
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
            setting: vec![false; block.code.len()],
        }
    }

    /// Twice the cycles, so that half of them are for each way of a branch.
    pub fn of(&mut self, order: &[usize]) -> u32 {
        self.choose_forms(order);
        let (mut pipe, mut at, mut sum) = (Pipe::default(), 0, 0);
        let mut issue = |form: &Form, outcome: &Outcome| {
            let (next, cost) = self.core.issue(pipe, &form.timed, at, outcome);
            (pipe, at, sum) = (next, at + form.bytes, sum + 2 * cost.cycles());
        };
        let mut left_in_it = 0;
        for (place, index) in order.iter().enumerate() {
            let forms = &self.forms[*index];
            if forms.cond.is_some() && left_in_it == 0 {
                left_in_it = self.it_block(&order[place..]);
                issue(&self.it, &Outcome::NEXT);
            }
            left_in_it = left_in_it.saturating_sub(1);
            let form = forms.setting.as_ref().filter(|_| self.setting[place]).unwrap_or(&forms.plain);
            issue(form, &Outcome::NEXT);
        }
        match &self.end {
            None => sum,
            Some((form, true)) => {
                issue(form, &Outcome::taken(0, false));
                sum
            }
            Some((form, false)) => {
                let ways = [Outcome::NEXT, Outcome::taken(0, false)];
                let ends = ways.map(|way| self.core.issue(pipe, &form.timed, at, &way).1.cycles());
                sum + ends[0] + ends[1]
            }
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
