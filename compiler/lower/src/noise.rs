//! Noise: a word per noise and key, stirred once a tick; its upper 31 bits are the number.

use super::Lowerer;
use super::format::exp2;
use super::real::Real;
use whippen_kernel::{Op, OpError, Range, Type};
use whippen_lang::model::{Noise, NoiseId};

impl Lowerer<'_> {
    /// Declares the words. Names end in a hard keyword, so that they meet no name of the program.
    pub(super) fn declare_noises(&mut self) {
        for noise in &self.step.model.noises {
            let first = i64::from(noise.first(0) as i32);
            let name = format!("{}.next", noise.name);
            let cell = self.b.cell(&name, Type::I32, Type::I32.range(), first);
            self.noises.push(cell);
        }
    }

    /// Each key begins with a word of its own.
    pub(super) fn seed_noises(&mut self) -> Result<(), OpError> {
        for (id, noise) in self.step.model.noises.enumerated() {
            if noise.seeds.len() < 2 {
                continue;
            }
            let words: Vec<i32> = noise.seeds.iter().map(|seed| *seed as i32).collect();
            let ends = words.iter().map(|word| i64::from(*word));
            let range = Range::new(
                ends.clone().min().unwrap_or_default(),
                ends.max().unwrap_or_default(),
            );
            let keyed = self.b.keyed(&format!("{}.let", noise.name), range, words);
            let word = self.b.op(Op::Keyed(keyed), &[])?;
            self.b.effect(Op::Set(self.noises[id]), &[word])?;
        }
        Ok(())
    }

    /// This tick's number.
    pub(super) fn noise(&mut self, noise: NoiseId) -> Result<Real, OpError> {
        let word = self.load(self.noises[noise])?;
        let value = self.b.op(Op::Sar(1), &[word])?;
        Ok(Real::new(value, exp2(-30), 0.0))
    }

    /// The words of the next tick.
    pub(super) fn stir_noises(&mut self) -> Result<(), OpError> {
        for (id, noise) in self.step.model.noises.enumerated() {
            self.from_place(noise.span, None, |s| {
                let word = s.load(s.noises[id])?;
                let factor = s.constant((Noise::FACTOR as i32).into())?;
                let step = s.constant((Noise::STEP as i32).into())?;
                let product = s.b.op(Op::MulWrap, &[word, factor])?;
                let stirred = s.b.op(Op::AddWrap, &[product, step])?;
                s.b.effect(Op::Set(s.noises[id]), &[stirred])
            })?;
        }
        Ok(())
    }
}
