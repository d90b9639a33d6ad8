//! Constants: a byte, shifted, turned round or added to; else a word of the state.

use super::Legal;
use crate::thumb::literal::Literal;
use crate::thumb::minst::{Access, AliasClass, MInst, Reg, Role, VReg};
use crate::thumb::registers::STATE;
use whippen_isa::Op;

/// A step towards a constant in a register.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Step {
    /// This byte.
    Byte(u8),
    Shift(u8),
    Add(u8),
    Not,
    Negate,
}

/// Steps that make a word; more than three for words that are better looked up.
pub fn steps(word: u32) -> Vec<Step> {
    let byte = |word: u32| u8::try_from(word).ok();
    let zeros = word.trailing_zeros() as u8;
    if let Some(byte) = byte(word) {
        return vec![Step::Byte(byte)];
    }
    if let Some(byte) = byte(!word) {
        return vec![Step::Byte(byte), Step::Not];
    }
    if let Some(byte) = byte(word.wrapping_neg()) {
        return vec![Step::Byte(byte), Step::Negate];
    }
    if let Some(byte) = byte(word >> zeros) {
        return vec![Step::Byte(byte), Step::Shift(zeros)];
    }
    if let Some(more) = byte(word.wrapping_sub(255)) {
        return vec![Step::Byte(255), Step::Add(more)];
    }
    // The bytes below the first one, zeros among them together.
    let mut steps = steps(word >> 8);
    match (steps.last_mut(), word as u8) {
        (Some(Step::Shift(by)), 0) => *by += 8,
        (_, 0) => steps.push(Step::Shift(8)),
        (Some(Step::Shift(by)), low) if *by + 8 < 32 => {
            *by += 8;
            steps.push(Step::Add(low));
        }
        (_, low) => steps.extend([Step::Shift(8), Step::Add(low)]),
    }
    steps
}

impl Legal<'_> {
    pub(super) fn constant(&mut self, word: u32) -> VReg {
        let steps = steps(word);
        if steps.len() > 3
            && let Some(reg) = self.literal(Literal::Word(word))
        {
            return reg;
        }
        let mut steps = steps.into_iter();
        let mut reg = match steps.next() {
            Some(Step::Byte(byte)) => self.byte(byte),
            _ => self.byte(0),
        };
        for step in steps {
            reg = match step {
                Step::Byte(byte) => self.byte(byte),
                Step::Shift(by) => self.shift(Op::LSL_immediate, Reg::Virtual(reg), by),
                Step::Add(byte) => self.tied_to(Role::N, Op::ADD_immediate, reg, None, byte.into()),
                Step::Not => self.result(MInst::new(Op::MVN_register).flags().reg(Role::M, reg)),
                Step::Negate => self.result(
                    MInst::new(Op::RSB_immediate)
                        .flags()
                        .reg(Role::N, reg)
                        .imm(0),
                ),
            };
        }
        reg
    }

    fn byte(&mut self, byte: u8) -> VReg {
        self.result(MInst::new(Op::MOV_immediate).flags().imm(byte.into()))
    }

    /// A word of the state that no code changes, if there is room for one more.
    pub(super) fn literal(&mut self, literal: Literal) -> Option<VReg> {
        let place = self.literals.place(literal)?;
        let t = self.out.fresh();
        let load = MInst::new(Op::LDR_immediate)
            .reg(Role::T, t)
            .with(Role::N, Reg::Fixed(STATE));
        self.plain(
            &load.access(Access::Read(AliasClass::Constant)),
            Reg::Fixed(STATE),
            (self.literals_at + 4 * place) as i32,
        );
        Some(t)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_make_their_word() {
        let run = |word: u32| {
            steps(word)
                .into_iter()
                .fold(0_u32, |value, step| match step {
                    Step::Byte(byte) => byte.into(),
                    Step::Shift(by) => value << by,
                    Step::Add(byte) => value.wrapping_add(byte.into()),
                    Step::Not => !value,
                    Step::Negate => value.wrapping_neg(),
                })
        };
        let some = [
            0,
            1,
            255,
            256,
            257,
            300,
            510,
            511,
            0xff00,
            0x1_0000,
            0x1_0001,
            0xab00_cd00,
            0x1234_5678,
            0x8000_0000,
        ];
        let all = some
            .into_iter()
            .flat_map(|word: u32| [word, !word, word.wrapping_neg(), word.wrapping_mul(0x9e37)]);
        all.for_each(|word| assert_eq!(run(word), word, "{word:#x} {:?}", steps(word)));
        assert!((0..=0xffff).all(|word| steps(word).len() <= 3));
    }
}
