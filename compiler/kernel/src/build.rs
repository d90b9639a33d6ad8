//! Building a Kernel: every instruction goes through the table, which checks it and gives type and
//! range of its result.
//!
//! ```
//! use whippen_kernel::{Builder, Op, Range};
//!
//! let mut b = Builder::new("spring", 44_100);
//! let x = b.input("x", Range::new(0, 65_535));
//! let force = b.output("f", Range::new(-32_768, 32_767));
//! b.begin_tick();
//! let word = b.op(Op::In(x), &[])?;
//! let half = b.op(Op::Sar(1), &[word])?;
//! b.effect(Op::Out(force), &[half])?;
//! let kernel = b.finish();
//! assert_eq!(kernel.tick.insts.len(), 3);
//! # Ok::<(), whippen_kernel::OpError>(())
//! ```
//!
//! A pure operator applied twice to the same operands gives the same value (local value numbering),
//! so constants need no care. A region that fails half-way is dropped as a whole; the builder can
//! be used on.

mod declare;

use super::op::Effect;
use super::{Inst, Kernel, Op, OpError, Range, Region, Type, Value, ValueInfo};
use std::collections::HashMap;
use whippen_ids::IdMap;
use whippen_rate::Rate;

/// Something computed before: operator, type of the result, operands.
type Known = (Op, Type, Vec<Value>);

/// A region under construction.
#[derive(Debug, Default)]
struct Scope {
    region: Region,
    known: HashMap<Known, Value>,
}

/// Builds one Kernel.
#[derive(Debug)]
pub struct Builder {
    kernel: Kernel,
    /// From the outermost region inwards; never empty.
    scopes: Vec<Scope>,
    /// Whether the outermost region is `tick` (else `init`).
    in_tick: bool,
    origin: Option<u32>,
    /// By value: whether a choice is part of it.
    decided: IdMap<Value, bool>,
    /// By value: what other values than constants it is made of.
    made_of: IdMap<Value, MadeOf>,
}

/// What other values than constants a value is made of.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum MadeOf {
    Nothing,
    Live,
    Others,
}

impl Builder {
    /// A kernel without declarations; instructions go to `init` first.
    pub fn new(name: &str, rate_hz: impl Into<Rate>) -> Builder {
        let kernel = Kernel {
            name: name.to_string(),
            rate_hz: rate_hz.into(),
            ..Kernel::default()
        };
        Builder {
            kernel,
            scopes: vec![Scope::default()],
            in_tick: false,
            origin: None,
            decided: IdMap::new(),
            made_of: IdMap::new(),
        }
    }

    /// Instructions from here on are made for this place of the source; gives the place before.
    pub fn set_origin(&mut self, origin: Option<u32>) -> Option<u32> {
        std::mem::replace(&mut self.origin, origin)
    }

    /// From here on instructions are added to `init`.
    pub fn begin_init(&mut self) {
        self.begin(false);
    }

    /// From here on instructions are added to `tick`.
    pub fn begin_tick(&mut self) {
        self.begin(true);
    }

    /// The finished kernel.
    pub fn finish(mut self) -> Kernel {
        self.close();
        self.kernel
    }

    /// What is declared so far, and every value.
    pub fn kernel(&self) -> &Kernel {
        &self.kernel
    }

    /// Where a value stays.
    pub fn range(&self, value: Value) -> Range {
        self.info(value).range
    }

    /// Type of a value.
    pub fn ty(&self, value: Value) -> Type {
        self.info(value).ty
    }

    /// Whether a choice made in this tick is part of the value.
    pub fn is_decided(&self, value: Value) -> bool {
        self.decided.get(value).copied().unwrap_or(false)
    }

    /// Whether a value is made of live values and constants alone, so that all keys have the same.
    pub fn is_shared(&self, value: Value) -> bool {
        self.made_of.get(value) == Some(&MadeOf::Live)
    }

    /// Adds an instruction and gives its result.
    ///
    /// # Errors
    /// What [`Op::apply`] says; an operator without result.
    pub fn op(&mut self, op: Op, args: &[Value]) -> Result<Value, OpError> {
        let info = self.apply(op, args)?.ok_or(OpError::Misused { op })?;
        Ok(self.append(op, info, args))
    }

    /// Adds an instruction that gives no result.
    ///
    /// # Errors
    /// What [`Op::apply`] says; an operator with a result.
    pub fn effect(&mut self, op: Op, args: &[Value]) -> Result<(), OpError> {
        if self.apply(op, args)?.is_some() {
            return Err(OpError::Misused { op });
        }
        self.push(Inst {
            op,
            args: args.to_vec(),
            results: Vec::new(),
            regions: Vec::new(),
            origin: self.origin,
        });
        Ok(())
    }

    /// A constant.
    ///
    /// # Errors
    /// It does not fit the type.
    pub fn constant(&mut self, ty: Type, value: i64) -> Result<Value, OpError> {
        let info = Op::constant(ty, value)?;
        Ok(self.append(Op::Const(value), info, &[]))
    }

    /// Runs `then` where `condition` holds, else `other`; gives what they return, each in the union
    /// of both ranges.
    ///
    /// # Errors
    /// Those of the closures; a condition that is not `i1`; results that differ in number or type.
    pub fn if_else(
        &mut self,
        condition: Value,
        then: impl FnOnce(&mut Builder) -> Result<Vec<Value>, OpError>,
        other: impl FnOnce(&mut Builder) -> Result<Vec<Value>, OpError>,
    ) -> Result<Vec<Value>, OpError> {
        let then = self.region(then)?;
        let other = self.region(other)?;
        self.branch(condition, then, other)
    }

    /// Builds a region by itself, for [`Builder::branch`]. It may use all values defined before.
    ///
    /// # Errors
    /// Those of the closure.
    pub fn region(
        &mut self,
        fill: impl FnOnce(&mut Builder) -> Result<Vec<Value>, OpError>,
    ) -> Result<Region, OpError> {
        self.region_with(Vec::new(), fill)
    }

    /// As [`Builder::if_else`], of two regions just built here.
    ///
    /// # Errors
    /// A condition that is not `i1`; results that differ in number or type.
    pub fn branch(
        &mut self,
        condition: Value,
        then: Region,
        other: Region,
    ) -> Result<Vec<Value>, OpError> {
        if self.ty(condition) != Type::I1 {
            return Err(OpError::Operands {
                op: Op::If,
                types: vec![self.ty(condition)],
            });
        }
        self.check_yields(&then.yields, &other.yields)?;
        let infos: Vec<ValueInfo> = then
            .yields
            .iter()
            .zip(&other.yields)
            .map(|(a, b)| ValueInfo {
                ty: self.ty(*a),
                range: self.range(*a).union(self.range(*b)),
            })
            .collect();
        let results: Vec<Value> = infos.into_iter().map(|info| self.define(info)).collect();
        results
            .iter()
            .for_each(|result| self.decided[result] = true);
        self.push(Inst {
            op: Op::If,
            args: vec![condition],
            results: results.clone(),
            regions: vec![then, other],
            origin: self.origin,
        });
        Ok(results)
    }

    /// Runs `body` `rounds` times. It gets the round (`i32`, from 0) and the carried values, and
    /// returns their next values. Each carried value comes with the range it keeps: the start must
    /// lie in it, and so must what `body` returns.
    ///
    /// # Errors
    /// Those of the closure; no rounds; a carried value that may leave its range or changes its
    /// type.
    pub fn repeat(
        &mut self,
        rounds: u32,
        carried: &[(Value, Range)],
        body: impl FnOnce(&mut Builder, Value, &[Value]) -> Result<Vec<Value>, OpError>,
    ) -> Result<Vec<Value>, OpError> {
        let op = Op::Loop(rounds);
        let allowed = Range::new(1, i32::MAX.into());
        if !allowed.has(rounds.into()) {
            return Err(OpError::Immediate {
                op,
                value: rounds.into(),
                allowed,
            });
        }
        let starts: Vec<Value> = carried.iter().map(|(start, _)| *start).collect();
        self.check_carried(&starts, carried)?;
        let index = self.define(ValueInfo {
            ty: Type::I32,
            range: Range::new(0, i64::from(rounds) - 1),
        });
        let infos: Vec<ValueInfo> = carried
            .iter()
            .map(|(start, range)| ValueInfo {
                ty: self.ty(*start),
                range: *range,
            })
            .collect();
        let params: Vec<Value> = std::iter::once(index)
            .chain(infos.iter().map(|info| self.define(*info)))
            .collect();
        let inside = params[1..].to_vec();
        let region = self.region_with(params, |b| body(b, index, &inside))?;
        self.check_yields(&region.yields, &starts)?;
        self.check_carried(&region.yields, carried)?;
        let results: Vec<Value> = region
            .yields
            .clone()
            .into_iter()
            .map(|y| self.define(self.info(y)))
            .collect();
        self.push(Inst {
            op,
            args: starts,
            results: results.clone(),
            regions: vec![region],
            origin: self.origin,
        });
        Ok(results)
    }

    fn info(&self, value: Value) -> ValueInfo {
        self.kernel.values[value]
    }

    fn apply(&self, op: Op, args: &[Value]) -> Result<Option<ValueInfo>, OpError> {
        let infos: Vec<ValueInfo> = args.iter().map(|arg| self.info(*arg)).collect();
        op.apply(&self.kernel, &infos)
    }

    /// Adds an instruction with one result, or finds the value where it is already known.
    fn append(&mut self, op: Op, info: ValueInfo, args: &[Value]) -> Value {
        let key: Known = (op, info.ty, args.to_vec());
        let pure = op.row().effect.is_pure();
        let known = self
            .scopes
            .iter()
            .rev()
            .find_map(|scope| scope.known.get(&key));
        if let (true, Some(value)) = (pure, known) {
            return *value;
        }
        let result = self.define(info);
        self.decided[result] = op == Op::Select || args.iter().any(|arg| self.is_decided(*arg));
        self.made_of[result] = match op.row().effect {
            Effect::Pure => args
                .iter()
                .map(|arg| self.made_of[arg])
                .max()
                .unwrap_or(MadeOf::Nothing),
            Effect::PerTick => MadeOf::Live,
            _ => MadeOf::Others,
        };
        self.push(Inst {
            op,
            args: args.to_vec(),
            results: vec![result],
            regions: Vec::new(),
            origin: self.origin,
        });
        if pure && let Some(scope) = self.scopes.last_mut() {
            scope.known.insert(key, result);
        }
        result
    }

    fn define(&mut self, info: ValueInfo) -> Value {
        self.decided.push(false);
        self.made_of.push(MadeOf::Others);
        self.kernel.values.push(info)
    }

    fn push(&mut self, inst: Inst) {
        if let Some(scope) = self.scopes.last_mut() {
            scope.region.insts.push(inst);
        }
    }

    fn region_with(
        &mut self,
        params: Vec<Value>,
        fill: impl FnOnce(&mut Builder) -> Result<Vec<Value>, OpError>,
    ) -> Result<Region, OpError> {
        self.scopes.push(Scope {
            region: Region {
                params,
                ..Region::default()
            },
            ..Scope::default()
        });
        let yields = fill(self);
        let mut region = self.scopes.pop().unwrap_or_default().region;
        region.yields = yields?;
        Ok(region)
    }

    fn check_yields(&self, left: &[Value], right: &[Value]) -> Result<(), OpError> {
        let types = |values: &[Value]| -> Vec<Type> {
            values.iter().map(|value| self.ty(*value)).collect()
        };
        let (left, right) = (types(left), types(right));
        if left == right {
            Ok(())
        } else {
            Err(OpError::Yields { left, right })
        }
    }

    fn check_carried(&self, values: &[Value], carried: &[(Value, Range)]) -> Result<(), OpError> {
        for (index, (value, (start, declared))) in values.iter().zip(carried).enumerate() {
            let fits = self.ty(*start).range().contains(*declared)
                && declared.contains(self.range(*value));
            if !fits {
                return Err(OpError::Carried {
                    index,
                    value: self.range(*value),
                    declared: *declared,
                });
            }
        }
        Ok(())
    }

    fn begin(&mut self, tick: bool) {
        self.close();
        self.in_tick = tick;
        self.scopes[0].region = std::mem::take(self.outermost());
    }

    /// Puts the outermost region back into the kernel.
    fn close(&mut self) {
        self.scopes.truncate(1);
        let scope = std::mem::take(&mut self.scopes[0]);
        *self.outermost() = scope.region;
    }

    fn outermost(&mut self) -> &mut Region {
        if self.in_tick {
            &mut self.kernel.tick
        } else {
            &mut self.kernel.init
        }
    }
}
