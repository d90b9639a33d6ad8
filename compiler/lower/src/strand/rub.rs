//! Strings that are rubbed: ticked without their friction first, so that this very tick's slip is
//! known before the friction is solved; what that does to the string follows at the tick's end.
//!
//! What is read of such a string is read before, so all readings of it come first.

use super::super::Lowerer;
use super::super::format::{self, exp2};
use super::super::real::Real;
use super::read::{Place, SPREAD_BITS};
use super::{Begun, Grids};
use whippen_kernel::{Op, OpError, Value};
use whippen_lang::model::{Node, NodeId, Strand, StrandId};

impl Lowerer<'_> {
    /// Ticks the strings that are rubbed, without their frictions.
    pub(in super::super) fn begin_strings(&mut self) -> Result<(), OpError> {
        for (id, strand) in self.step.model.strands.enumerated() {
            if strand.friction.is_some() {
                self.mean_of_string(id)?;
            }
        }
        Ok(())
    }

    fn begin_string(
        &mut self,
        id: StrandId,
        strand: &Strand,
        place: NodeId,
    ) -> Result<Real, OpError> {
        let reads = |node: &Node| matches!(node, Node::Read(own, ..) if *own == id);
        let nodes = self.step.model.dag.nodes();
        let all: Vec<NodeId> = nodes.filter(|(_, n)| reads(n)).map(|(id, _)| id).collect();
        self.need(&all)?;
        let words = self.words_without_friction(id, strand)?;
        let place = self.place(id, place)?;
        let before = self.rates_at(id, place)?;
        self.tick_string(id, strand, &words)?;
        let after = self.rates_at(id, place)?;
        let mean = self.mean(id, place, before, after)?;
        self.strands.begun.insert(id, Begun { mean });
        Ok(mean)
    }

    /// The rates of the four points around a place.
    fn rates_at(&mut self, id: StrandId, place: Place) -> Result<[Value; 4], OpError> {
        let v = self.strands.grids[id].v;
        let first = self.first_point(place)?;
        let mut rates = [first; 4];
        for (at, rate) in rates.iter_mut().enumerate() {
            let point = self.offset(first, at as i64)?;
            *rate = self.b.op(Op::GetAt(v), &[point])?;
        }
        Ok(rates)
    }

    /// In halves: weights that add up to less than 5/4, signs aside, leave a quarter of each sum.
    fn mean(
        &mut self,
        id: StrandId,
        place: Place,
        before: [Value; 4],
        after: [Value; 4],
    ) -> Result<Real, OpError> {
        let Grids { lsb, .. } = self.strands.grids[id];
        let weights = self.weights(place)?;
        let mut sum = self.constant(0)?;
        for ((before, after), weight) in before.into_iter().zip(after).zip(weights) {
            let both = self.b.op(Op::AddSat, &[before, after])?;
            sum = self.b.op(Op::MacTop, &[sum, both, weight])?;
        }
        let unit = 2.0 * lsb * f64::from(self.step.model.rate_hz);
        let reach = 2.0 * self.step.model.strands[id].rate;
        let error = 2.5 * unit + reach * self.off_by_place(id, place);
        Ok(Real::new(sum, unit, error))
    }

    /// The mean of the rates before and after this tick, without friction.
    pub(in super::super) fn mean_of_string(&mut self, id: StrandId) -> Result<Real, OpError> {
        if let Some(begun) = self.strands.begun.get(&id) {
            return Ok(begun.mean);
        }
        // What it is made of may want another one first; none wants itself.
        let strand = &self.step.model.strands[id];
        let place = strand.friction.as_ref().map(|rub| rub.push.place);
        let place = place.ok_or(OpError::Misused { op: Op::Wave(0, 0) })?;
        let item = format!("string {}", strand.name);
        self.from_item(&item, |s| s.begin_string(id, strand, place))
    }

    /// The sum of the squares of the weights at a place.
    pub(in super::super) fn spread_of_string(
        &mut self,
        id: StrandId,
        place: NodeId,
    ) -> Result<Real, OpError> {
        let unit = exp2(-i32::from(SPREAD_BITS));
        let place = self.place(id, place)?;
        let centred = match place {
            Place::Constant(_, part) => {
                let value = self.constant(format::quantize(Strand::spread(part), unit))?;
                return Ok(Real::new(value, unit, unit));
            }
            Place::Computed { centred, .. } => centred,
        };
        let value = self.spread(centred)?;
        Ok(Real::new(
            value,
            unit,
            self.off_by_place(id, place) + 16.0 * unit,
        ))
    }
}
