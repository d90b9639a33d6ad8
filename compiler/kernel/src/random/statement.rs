//! Random statements: one operator with its operands, an `if`, a loop.

use super::Draw;
use super::Generator;
use crate::op::{Immediate, ROWS, Row, Sort};
use crate::{Builder, Kernel, Op, OpError, Range, Region, Type, Value, wave};

/// How deep regions nest.
const DEPTH_MAX: u32 = 3;

impl Generator {
    pub(super) fn statement(&mut self, b: &mut Builder) -> Result<(), OpError> {
        match self.rng.below(16) {
            0 if self.depth < DEPTH_MAX => self.if_else(b),
            1 if self.depth < DEPTH_MAX => self.repeat(b),
            _ => self.plain(b),
        }?;
        if self.rng.chance(1, 2) {
            self.expose(b)
        } else {
            Ok(())
        }
    }

    /// Makes what was defined last visible outside, so that no engine may drop it.
    fn expose(&mut self, b: &mut Builder) -> Result<(), OpError> {
        let Some(value) = self.pool.last().copied() else {
            return Ok(());
        };
        let ty = b.ty(value);
        if self.tick {
            let probe = b.probe(&format!("seen{}", b.kernel().probes.len()), ty);
            return b.effect(Op::Probe(probe), &[value]);
        }
        let cell = b.cell(
            &format!("seen{}", b.kernel().cells.len()),
            ty,
            ty.range(),
            0,
        );
        b.effect(Op::Set(cell), &[value])
    }

    /// Any operator without regions. What the table refuses even for squeezed operands is given up.
    fn plain(&mut self, b: &mut Builder) -> Result<(), OpError> {
        let row = &ROWS[self.rng.below(ROWS.len() as u64) as usize];
        let Some(op) = self
            .immediates(b.kernel(), row)
            .and_then(|immediates| (row.make)(&immediates))
        else {
            return Ok(());
        };
        match op {
            Op::Const(_) => return self.known(b),
            Op::Assume(..) => return self.assume(b),
            Op::Wave(..) => return self.wave(b),
            _ if !self.allows(op) => return Ok(()),
            _ => {}
        }
        if row.result.is_none() {
            return self.write(b, op);
        }
        let mut args = self.operands(b, op)?;
        for _ in 0..4 {
            if let Ok(result) = b.op(op, &args) {
                self.pool.push(result);
                break;
            }
            for arg in &mut args {
                *arg = self.squeeze(b, *arg)?;
            }
        }
        Ok(())
    }

    /// A constant.
    fn known(&mut self, b: &mut Builder) -> Result<(), OpError> {
        let ty = self.rng.ty();
        let value = self.constant(b, ty.range(), ty)?;
        self.pool.push(value);
        Ok(())
    }

    /// An assumption that is true.
    fn assume(&mut self, b: &mut Builder) -> Result<(), OpError> {
        let ty = self.rng.pick(&[Type::I32, Type::I64]);
        let value = self.value(b, ty)?;
        let Range { low, high } = b.range(value);
        let low = self.rng.interesting(Range::new(i64::MIN, low));
        let high = self.rng.interesting(Range::new(high, i64::MAX));
        let assumed = b.op(Op::Assume(low, high), &[value])?;
        self.pool.push(assumed);
        Ok(())
    }

    /// An operator without result.
    pub(super) fn write(&mut self, b: &mut Builder, op: Op) -> Result<(), OpError> {
        let args = self.operands(b, op)?;
        b.effect(op, &args)?;
        if matches!(op, Op::Out(_) | Op::Push(_)) {
            self.done.push(op);
        }
        Ok(())
    }

    /// Immediates for an operator; none if it would name what is not declared.
    fn immediates(&mut self, kernel: &Kernel, row: &Row) -> Option<Vec<i64>> {
        let index =
            |len: usize, rng: &mut super::Rng| (len > 0).then(|| rng.below(len as u64) as i64);
        let mut all = Vec::new();
        for kind in row.immediates {
            let rng = &mut self.rng;
            all.push(match kind {
                Immediate::Number | Immediate::Rounds => 0,
                Immediate::Shift => {
                    let bits = rng.pick(&[32, 32, 32, 64]);
                    rng.below(bits) as i64
                }
                Immediate::Ticks => {
                    let len = u64::from(kernel.lines[all[0] as usize].len);
                    if rng.chance(1, 2) {
                        len as i64
                    } else {
                        1 + rng.below(len) as i64
                    }
                }
                Immediate::Column => {
                    let columns = kernel.tables[all[0] as usize].columns;
                    rng.below(columns.into()) as i64
                }
                Immediate::Input => index(kernel.inputs.len(), rng)?,
                Immediate::Output => index(kernel.outputs.len(), rng)?,
                Immediate::Live => index(kernel.lives.len(), rng)?,
                Immediate::Keyed => index(kernel.keyed.len(), rng)?,
                Immediate::Cell => index(kernel.cells.len(), rng)?,
                Immediate::Line => index(kernel.lines.len(), rng)?,
                Immediate::Table => index(kernel.tables.len(), rng)?,
                Immediate::Event => index(kernel.events.len(), rng)?,
                Immediate::Probe => index(kernel.probes.len(), rng)?,
            });
        }
        Some(all)
    }

    fn operands(&mut self, b: &mut Builder, op: Op) -> Result<Vec<Value>, OpError> {
        let (ty, range, len) = op
            .declared(b.kernel())
            .map_or((Type::I32, Type::I32.range(), 1), |own| {
                (own.ty, own.range, own.len as i64)
            });
        let n = self.rng.pick(&[Type::I32, Type::I64]);
        let t = self.rng.ty();
        let sorts = if op.row().args == [Sort::Args] {
            vec![Sort::I32; len as usize]
        } else {
            op.row().args.to_vec()
        };
        let mut args = Vec::new();
        for sort in sorts {
            let arg = match sort {
                Sort::I1 => self.value(b, Type::I1)?,
                Sort::I32 | Sort::Args => self.value(b, Type::I32)?,
                Sort::I64 => self.value(b, Type::I64)?,
                Sort::N => self.value(b, n)?,
                Sort::T => self.value(b, t)?,
                Sort::Own => {
                    let value = self.value(b, ty)?;
                    self.fit(b, value, range)?
                }
                Sort::Plus | Sort::Minus => {
                    let [low, high] = if sort == Sort::Plus {
                        [0, i32::MAX]
                    } else {
                        [i32::MIN, 0]
                    };
                    let value = self.value(b, Type::I32)?;
                    self.fit(b, value, Range::new(low.into(), high.into()))?
                }
                Sort::End => {
                    let end = self.rng.pick(&wave::ENDS);
                    b.constant(Type::I32, end)?
                }
                Sort::Index => {
                    let index = self.value(b, Type::I32)?;
                    self.fit(b, index, Range::new(0, len - 1))?
                }
            };
            args.push(arg);
        }
        Ok(args)
    }

    fn if_else(&mut self, b: &mut Builder) -> Result<(), OpError> {
        let condition = self.value(b, Type::I1)?;
        let types: Vec<Type> = (0..self.rng.below(4)).map(|_| self.rng.ty()).collect();
        let then = self.branch(b, &types)?;
        let other = self.branch(b, &types)?;
        let results = b.branch(condition, then, other)?;
        self.pool.extend(results);
        Ok(())
    }

    fn branch(&mut self, b: &mut Builder, types: &[Type]) -> Result<Region, OpError> {
        b.region(|b| {
            self.inside(b, |generator, b| {
                types.iter().map(|ty| generator.value(b, *ty)).collect()
            })
        })
    }

    fn repeat(&mut self, b: &mut Builder) -> Result<(), OpError> {
        let rounds = self.rng.pick(&[1, 2, 3, 8]);
        let mut carried = Vec::new();
        for _ in 0..self.rng.below(4) {
            let ty = self.rng.ty();
            let start = self.value(b, ty)?;
            let range = b.range(start).union(self.rng.range(ty.range()));
            carried.push((start, range));
        }
        let results = b.repeat(rounds, &carried, |b, round, params| {
            self.inside(b, |generator, b| {
                generator.pool.push(round);
                generator.pool.extend(params);
                generator.body(b, &carried)
            })
        })?;
        self.pool.extend(results);
        Ok(())
    }

    fn body(&mut self, b: &mut Builder, carried: &[(Value, Range)]) -> Result<Vec<Value>, OpError> {
        (0..1 + self.rng.below(3)).try_for_each(|_| self.statement(b))?;
        let mut next = Vec::new();
        for (start, range) in carried {
            let ty = b.ty(*start);
            let value = self.value(b, ty)?;
            next.push(self.fit(b, value, *range)?);
        }
        Ok(next)
    }

    /// Fills a region; what it defines is out of sight afterwards.
    fn inside(
        &mut self,
        b: &mut Builder,
        fill: impl FnOnce(&mut Generator, &mut Builder) -> Result<Vec<Value>, OpError>,
    ) -> Result<Vec<Value>, OpError> {
        let outside = self.pool.len();
        self.depth += 1;
        let statements = self.rng.below(4);
        let filled = (0..statements)
            .try_for_each(|_| self.statement(b))
            .and_then(|()| fill(self, b));
        self.depth -= 1;
        self.pool.truncate(outside);
        filled
    }
}
