//! Strings: two grids of words, one operator `wave` a tick, and what is read and pushed.
//!
//! ```text
//!   v  of a point: displacement a tick, its range is that of the word
//!   e  of a part: how much the displacement grows along it, in halves of v's unit
//!   k0 = p + 2 q    k1 = -q    k2 = v    k3 = -(2 v + r)       p, q in Q31; v, r in Q32
//! ```
//!
//! So k0 is at least 2 |k1| and |k3| at least 2 k2 whatever is rounded, and one sum of the words'
//! largest values proves that the string is stable (`model::strand`).

mod read;
mod rub;

use super::Lowerer;
use super::format::{self, exp2};
use super::real::{Real, Scale};
use std::collections::HashMap;

use whippen_ids::IdMap;
use whippen_kernel::{Op, OpError, Range, Type, Value};
use whippen_lang::model::{End, NodeId, Push, Strand, StrandId};
use whippen_rate::Rate;

/// Integers of what a force changes the rate by in a tick, a quarter of the range: weights have two
/// bits less than a word, and so it is finer than a rate by as many.
const PUSH: Range = Range::new(i32::MIN as i64, i32::MAX as i64);
/// Its unit over that of a rate.
const PUSH_UNIT: f64 = 0.25;
/// Words that stand for what is not negative.
const COEFFICIENT: Range = Range::new(0, i32::MAX as i64);

/// What is known of strings while lowering.
#[derive(Debug, Default)]
pub(super) struct Strands {
    grids: IdMap<StrandId, Grids>,
    /// Words of strings that are rubbed, which have been ticked but for their friction.
    begun: HashMap<StrandId, Begun>,
    /// What is told of each.
    pub lowered: Vec<LoweredStrand>,
}

/// Where a string is kept.
#[derive(Debug, Clone, Copy)]
struct Grids {
    /// Cells of slopes and rates.
    e: u32,
    v: u32,
    /// Points between the ends.
    points: u32,
    /// Unit of v (m a tick).
    lsb: f64,
}

/// A string in integers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LoweredStrand {
    /// Which.
    pub strand: StrandId,
    /// Cells of how much its displacement grows, part by part, and of its displacements a tick,
    /// point by point.
    pub cells: [u32; 2],
    /// Unit of the latter (m a tick); of the former it is half of that (m).
    pub lsb: f64,
    /// The sum that is 2 or less where a string is stable, of its largest integer coefficients.
    pub sum: f64,
    /// Bound on what one tick rounds of a rate (m/s); infinite where the string is rubbed.
    pub error: f64,
}

/// A string in the middle of a tick.
#[derive(Debug, Clone, Copy)]
struct Begun {
    /// The mean of its rates before and after the tick without friction, where it is rubbed.
    mean: Real,
}

/// What a tick of a string takes.
#[derive(Debug, Clone)]
pub(super) struct Words {
    /// `k0` to `k3`; none of a string that has been ticked.
    coefficients: Option<[Value; 4]>,
    pushes: Vec<PushWords>,
    hold: Option<Value>,
}

/// What four points are pushed by.
#[derive(Debug, Clone, Copy)]
struct PushWords {
    /// Index of the first point.
    first: Value,
    changes: [Value; 4],
}

/// Unit of the rates of a string's points (m a tick): the range of the rate is that of the word.
pub(super) fn rate_unit(strand: &Strand, rate_hz: Rate) -> f64 {
    strand.rate / f64::from(rate_hz) * exp2(-31)
}

impl Lowerer<'_> {
    /// Declares the grids. Names end in a hard keyword, so that they meet no name of the program.
    pub(super) fn declare_strings(&mut self) {
        for strand in &self.step.model.strands {
            let points = strand.parts - 1;
            let word = Type::I32.range();
            let name = format!("{}.body", strand.name);
            let e = self.b.grid(&name, Type::I32, points + 1, word, 0);
            let v = self.b.grid(&format!("{name}'"), Type::I32, points, word, 0);
            self.strands.grids.push(Grids {
                e,
                v,
                points,
                lsb: rate_unit(strand, self.step.model.rate_hz),
            });
        }
    }

    /// What the strings are ticked with, from this tick's values.
    pub(super) fn string_words(&mut self) -> Result<Vec<Words>, OpError> {
        let strands = self.step.model.strands.enumerated();
        strands
            .map(|(id, strand)| {
                let item = format!("string {}", strand.name);
                self.from_item(&item, |s| s.words_of(id, strand))
            })
            .collect()
    }

    fn words_of(&mut self, id: StrandId, strand: &Strand) -> Result<Words, OpError> {
        let mut words = match self.strands.begun.contains_key(&id) {
            false => self.words_without_friction(id, strand)?,
            true => {
                let rub = strand.friction.iter();
                let pushes = rub.map(|rub| self.push_words(id, &rub.push));
                Words {
                    coefficients: None,
                    pushes: pushes.collect::<Result<_, _>>()?,
                    hold: None,
                }
            }
        };
        words.hold = strand.hold.map(|held| self.bool(held)).transpose()?;
        Ok(words)
    }

    fn words_without_friction(&mut self, id: StrandId, strand: &Strand) -> Result<Words, OpError> {
        let coefficients = Some(self.coefficients(id, strand)?);
        let mut pushes = Vec::new();
        for push in &strand.pushes {
            pushes.push(self.push_words(id, push)?);
        }
        Ok(Words {
            coefficients,
            pushes,
            hold: None,
        })
    }

    /// `k0` to `k3`, which are proven to be stable.
    fn coefficients(&mut self, id: StrandId, strand: &Strand) -> Result<[Value; 4], OpError> {
        let [p, q, v, r] = strand.coefficients;
        let (p, p_off) = self.string_coefficient(p, 31)?;
        let (q, q_off) = self.string_coefficient(q, 31)?;
        let (v, v_off) = self.string_coefficient(v, 32)?;
        let (r, r_off) = self.string_coefficient(r, 32)?;
        let zero = self.constant(0)?;
        let twice = self.b.op(Op::Shl(1), &[q])?;
        let k0 = self.b.op(Op::Add, &[p, twice])?;
        let k1 = self.b.op(Op::Sub, &[zero, q])?;
        let twice = self.b.op(Op::Shl(1), &[v])?;
        let lost = self.b.op(Op::Add, &[twice, r])?;
        let k3 = self.b.op(Op::Sub, &[zero, lost])?;
        let size = |value: Value, bits: i32| {
            let range = self.b.range(value);
            range.high.max(-range.low) as f64 * exp2(-bits)
        };
        let sum = 2.0 * (size(k0, 31) + 2.0 * size(k1, 31)) + size(k3, 32) + 2.0 * size(v, 32);
        if sum > 2.0 {
            // `check` has chosen the points so that this cannot be.
            return Err(OpError::Misused { op: Op::Wave(0, 0) });
        }
        let Grids {
            e, v: rates, lsb, ..
        } = self.strands.grids[id];
        // Two products of its own and two of each neighbour, and coefficients that are so many
        // units off times half a word.
        let off = 0.5 * (p_off + 4.0 * q_off + 4.0 * v_off + r_off);
        self.strands.lowered.push(LoweredStrand {
            strand: id,
            cells: [e, rates],
            lsb,
            sum,
            error: match &strand.friction {
                Some(_) => f64::INFINITY,
                None => (3.0 + off) * lsb * f64::from(self.step.model.rate_hz),
            },
        });
        Ok([k0, k1, v, k3])
    }

    /// A coefficient with so many bits behind the point, and how many units it may be off.
    fn string_coefficient(&mut self, node: NodeId, bits: i32) -> Result<(Value, f64), OpError> {
        let unit = exp2(-bits);
        if let Some(constant) = self.step.model.dag.real(node) {
            let word = format::quantize(constant, unit).clamp(0, COEFFICIENT.high);
            return Ok((self.constant(word)?, 0.5));
        }
        let real = self.real(node)?;
        let kept = self.saturated(real, Scale::plain(unit), COEFFICIENT)?;
        Ok((kept.value, kept.error.max(kept.beside) / unit))
    }

    /// A value in a unit, and how many units it may be off.
    fn word_of(&mut self, node: NodeId, unit: f64, range: Range) -> Result<Real, OpError> {
        let real = self.real(node)?;
        let kept = self.saturated(real, Scale::plain(unit), range)?;
        Ok(Real::new(kept.value, unit, kept.error.max(kept.beside)))
    }

    fn push_words(&mut self, id: StrandId, push: &Push) -> Result<PushWords, OpError> {
        let lsb = self.strands.grids[id].lsb;
        let change = self.real(push.change)?;
        let change = self.nearly(change, Scale::plain(PUSH_UNIT * lsb), PUSH)?;
        let inherited = change.error.max(change.beside);
        let change = change.value;
        let size = self.b.range(change);
        let most = size.high.max(-size.low) as f64 * PUSH_UNIT * lsb;
        let place = self.place(id, push.place)?;
        let mut changes = Vec::new();
        for weight in self.weights(place)? {
            changes.push(self.b.op(Op::MulTop, &[change, weight])?);
        }
        let error = inherited + 2.0 * lsb + self.off_by_place(id, place) * most;
        let rate_hz = f64::from(self.step.model.rate_hz);
        if let Some(own) = self.strands.lowered.last_mut() {
            own.error += error * rate_hz;
        }
        let first = self.first_point(place)?;
        let [a, b, c, d] = changes[..] else {
            return Err(OpError::Misused { op: Op::MulTop });
        };
        Ok(PushWords {
            first,
            changes: [a, b, c, d],
        })
    }

    /// Moves the strings one tick on; nothing reads them any more.
    pub(super) fn tick_strings(&mut self, words: &[Words]) -> Result<(), OpError> {
        for ((id, strand), words) in self.step.model.strands.enumerated().zip(words) {
            let item = format!("string {}", strand.name);
            self.from_item(&item, |s| s.tick_string(id, strand, words))?;
        }
        Ok(())
    }

    fn tick_string(&mut self, id: StrandId, strand: &Strand, words: &Words) -> Result<(), OpError> {
        let Grids { e, v, points, .. } = self.strands.grids[id];
        if let Some(coefficients) = words.coefficients {
            let mut operands = coefficients.to_vec();
            for end in strand.ends {
                operands.push(self.constant(match end {
                    End::Pinned => 0,
                    End::Clamped => 2,
                })?);
            }
            self.b.effect(Op::Wave(e, v), &operands)?;
        }
        for push in &words.pushes {
            self.pushed(id, push)?;
        }
        let Some(held) = words.hold else {
            return Ok(());
        };
        self.b.if_else(
            held,
            |b| {
                let zero = b.constant(Type::I32, 0)?;
                b.repeat(points, &[], |b, point, _| {
                    b.effect(Op::SetAt(e), &[point, zero])?;
                    b.effect(Op::SetAt(v), &[point, zero])?;
                    Ok(Vec::new())
                })?;
                let last = b.constant(Type::I32, points.into())?;
                b.effect(Op::SetAt(e), &[last, zero])?;
                Ok(Vec::new())
            },
            |_| Ok(Vec::new()),
        )?;
        Ok(())
    }

    /// Changes the rates of four points, and the five slopes between and beside them.
    fn pushed(&mut self, id: StrandId, push: &PushWords) -> Result<(), OpError> {
        let v = self.strands.grids[id].v;
        let mut way = None;
        for (at, change) in push.changes.into_iter().enumerate() {
            let point = self.offset(push.first, at as i64)?;
            let before = self.b.op(Op::GetAt(v), &[point])?;
            let after = self.b.op(Op::AddSat, &[before, change])?;
            self.b.effect(Op::SetAt(v), &[point, after])?;
            let own = self.b.op(Op::SubWrap, &[after, before])?;
            let grows = match way {
                None => own,
                Some(way) => self.b.op(Op::SubWrap, &[own, way])?,
            };
            let twice = self.b.op(Op::ShlWrap(1), &[grows])?;
            self.tilted(id, point, Op::AddWrap, twice)?;
            way = Some(own);
        }
        let Some(way) = way else {
            return Ok(());
        };
        let behind = self.offset(push.first, push.changes.len() as i64)?;
        let twice = self.b.op(Op::ShlWrap(1), &[way])?;
        self.tilted(id, behind, Op::SubWrap, twice)
    }

    /// Changes the slope of a part.
    fn tilted(&mut self, id: StrandId, part: Value, op: Op, by: Value) -> Result<(), OpError> {
        let e = self.strands.grids[id].e;
        let slope = self.b.op(Op::GetAt(e), &[part])?;
        let slope = self.b.op(op, &[slope, by])?;
        self.b.effect(Op::SetAt(e), &[part, slope])
    }
}
