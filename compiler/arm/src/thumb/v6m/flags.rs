//! Flags: what makes them is kept, and emitted again where they are read, because nearly every
//! instruction changes them.

use super::Legal;
use crate::thumb::func::{BlockId, Terminator};
use crate::thumb::minst::{MInst, Reg, Role, VReg};
use whippen_isa::{Cond, Op};

/// What makes the flags that the next reader finds.
#[derive(Debug, Clone, Default)]
pub(super) struct Flags {
    made: Made,
    /// The register whose sign they tell, and whether it is zero.
    result: Option<VReg>,
    /// Where they still are: in this block, behind so many instructions.
    here: Option<(BlockId, usize)>,
}

#[derive(Debug, Clone)]
enum Made {
    /// By these, one right after the other.
    By(Vec<MInst>),
    /// By the first ones, and where those give the condition by the others.
    Either {
        first: Vec<MInst>,
        cond: Cond,
        second: Vec<MInst>,
    },
}

impl Default for Made {
    fn default() -> Self {
        Made::By(Vec::new())
    }
}

impl Legal<'_> {
    /// The last instruction has set the flags, and needs those before it if it reads some.
    pub(super) fn flags_made(&mut self, reads: bool) {
        let code = &self.out.blocks[self.at].code;
        let (last, count) = (code.last().copied(), code.len());
        let before = match &self.flags.made {
            Made::By(before) if reads => before.clone(),
            _ => Vec::new(),
        };
        let made = Made::By(before.into_iter().chain(last).collect());
        self.flags = Flags {
            made,
            result: None,
            here: Some((self.at, count)),
        };
    }

    /// What was last emitted left them, and they tell of the result of an instruction.
    pub(super) fn flags_left(&mut self, of: &MInst) {
        self.flags.result = of.writes().next();
        self.flags.here = Some((self.at, self.out.blocks[self.at].code.len()));
    }

    /// Takes the last instruction back: it is to set the flags only where those before give a
    /// condition.
    pub(super) fn flags_made_only(&mut self, before: Flags, cond: Cond) {
        let second = self.out.blocks[self.at].code.pop().into_iter().collect();
        let (Made::By(first) | Made::Either { first, .. }) = before.made;
        self.flags = Flags {
            made: Made::Either {
                first,
                cond,
                second,
            },
            result: None,
            here: None,
        };
    }

    /// The flags are those that were made, for the instruction that comes next.
    pub(super) fn want_flags(&mut self) {
        if !self.flags_are_here()
            && let Made::By(codes) = self.flags.made.clone()
        {
            self.again(&codes);
        }
    }

    fn flags_are_here(&self) -> bool {
        self.flags.here == Some((self.at, self.out.blocks[self.at].code.len()))
    }

    /// The same for a condition. What only asks for the sign or for zero compares the result,
    /// which is kept anyway; the operands that it was made of need not be.
    fn want_condition(&mut self, cond: Cond) {
        let of_result = matches!(cond, Cond::MI | Cond::PL | Cond::EQ | Cond::NE);
        match self.flags.result.filter(|_| of_result) {
            Some(word) if !self.flags_are_here() => {
                self.emit(MInst::new(Op::CMP_immediate).reg(Role::N, word).imm(0));
            }
            _ => self.want_flags(),
        }
    }

    /// The same instructions with results of their own.
    fn again(&mut self, codes: &[MInst]) {
        for code in codes {
            let mut code = *code;
            if let Some(d) = &mut code.operands[Role::D as usize] {
                d.reg = Reg::Virtual(self.out.fresh());
            }
            self.emit(code);
        }
    }

    /// Ends the block by a condition; code goes on nowhere.
    pub(super) fn branch(&mut self, cond: Cond, yes: BlockId, no: BlockId, likely: Option<bool>) {
        let Made::Either {
            first,
            cond: decides,
            second,
        } = self.flags.made.clone()
        else {
            self.want_condition(cond);
            return self.part(cond, yes, no, likely);
        };
        let [holds, fails] = [(); 2].map(|()| self.out.block());
        self.again(&first);
        self.part(decides, holds, fails, None);
        for (block, codes) in [(holds, second), (fails, first)] {
            self.at = block;
            self.again(&codes);
            self.part(cond, yes, no, likely);
        }
    }

    /// A branch to blocks of its own, which lead to where it goes: those may be led to by others.
    fn part(&mut self, cond: Cond, yes: BlockId, no: BlockId, likely: Option<bool>) {
        let from = self.at;
        let [to_yes, to_no] = [yes, no].map(|to| {
            self.at = self.out.block();
            self.jump(to, Vec::new());
            self.at
        });
        self.out.blocks[from].end = Terminator::Branch {
            cond,
            yes: to_yes,
            no: to_no,
            likely,
        };
        self.at = from;
    }
}
