//! Applying an operator to what is known of its operands: checks types, immediates and ranges, and
//! gives the type and the interval of the result.

use super::{Immediate, Meaning, Op, OpError, QUOTIENTS, Row, Sort, Transfer};
use crate::{Kernel, Range, Type, ValueInfo, wave};

/// What an immediate names in the kernel.
#[derive(Debug, Clone, Copy)]
pub struct Declared<'a> {
    /// Its name.
    pub name: &'a str,
    /// Type of its words.
    pub ty: Type,
    /// Values it holds.
    pub range: Range,
    /// How many words it has; for a line its length in ticks, for an event its arguments.
    pub len: u64,
}

impl Row {
    /// Its operands and result in text, such as `i64 i32 i32 -> i64`, or `cell ->` where the type
    /// is that of the cell.
    pub fn signature(&self) -> String {
        let named = || {
            self.immediates
                .first()
                .map(|immediate| format!("{immediate:?}").to_lowercase())
        };
        let word = |sort: &Sort| match sort {
            Sort::Own => named().unwrap_or_default(),
            other => other.word().to_string(),
        };
        let arrow = std::iter::once("->".to_string());
        let parts: Vec<String> = self
            .args
            .iter()
            .map(word)
            .chain(arrow)
            .chain(self.result.iter().map(word))
            .collect();
        parts.join(" ")
    }
}

impl Sort {
    /// How a signature names it.
    pub(super) fn word(self) -> &'static str {
        match self {
            Sort::I1 => "i1",
            Sort::I32 => "i32",
            Sort::I64 => "i64",
            Sort::N => "n",
            Sort::T => "t",
            Sort::Own => "own",
            Sort::Index => "index",
            Sort::Args => "i32..",
            Sort::Plus => "i32>=0",
            Sort::Minus => "i32<=0",
            Sort::End => "0|2",
        }
    }
}

impl Op {
    /// What its first immediate names, if it names anything that is declared.
    pub fn declared(self, kernel: &Kernel) -> Option<Declared<'_>> {
        self.declared_by(kernel, 0)
    }

    /// What an immediate of it names, by its place among them.
    pub fn declared_by(self, kernel: &Kernel, place: usize) -> Option<Declared<'_>> {
        let index = usize::try_from(*self.immediates().get(place)?).ok()?;
        let word = |name, range| Declared {
            name,
            ty: Type::I32,
            range,
            len: 1,
        };
        Some(match self.row().immediates.get(place)? {
            Immediate::Input => kernel
                .inputs
                .get(index)
                .map(|port| word(&port.name, port.range))?,
            Immediate::Output => kernel
                .outputs
                .get(index)
                .map(|port| word(&port.name, port.range))?,
            Immediate::Live => kernel
                .lives
                .get(index)
                .map(|live| word(&live.name, live.range))?,
            Immediate::Keyed => kernel
                .keyed
                .get(index)
                .map(|keyed| word(&keyed.name, keyed.range))?,
            Immediate::Line => kernel.lines.get(index).map(|line| Declared {
                len: line.len.into(),
                ..word(&line.name, line.range)
            })?,
            Immediate::Cell => {
                let cell = kernel.cells.get(index)?;
                Declared {
                    name: &cell.name,
                    ty: cell.ty,
                    range: cell.range,
                    len: cell.len.into(),
                }
            }
            Immediate::Table => {
                let table = kernel.tables.get(index)?;
                Declared {
                    len: table.rows() as u64,
                    ..word(&table.name, Type::I32.range())
                }
            }
            Immediate::Event => {
                let event = kernel.events.get(index)?;
                Declared {
                    len: event.args.into(),
                    ..word(&event.name, Type::I32.range())
                }
            }
            Immediate::Probe => {
                let probe = kernel.probes.get(index)?;
                Declared {
                    name: &probe.name,
                    ty: probe.ty,
                    range: probe.ty.range(),
                    len: 1,
                }
            }
            Immediate::Number
            | Immediate::Shift
            | Immediate::Ticks
            | Immediate::Column
            | Immediate::Rounds => return None,
        })
    }

    /// Type and range of the result for such operands; none for an operator without result.
    ///
    /// # Errors
    /// Operands of wrong types, immediates that do not exist or are too large, a result that need
    /// not fit its type, an operand or index that may leave what is declared. `const` has no
    /// operands that tell its type: see [`Op::constant`].
    pub fn apply(self, kernel: &Kernel, args: &[ValueInfo]) -> Result<Option<ValueInfo>, OpError> {
        if matches!(self, Op::Const(_) | Op::If | Op::Loop(_)) {
            return Err(OpError::Misused { op: self });
        }
        self.check_declared(kernel)?;
        let own = self.declared(kernel);
        let free = self.match_types(args, own)?;
        self.check_operands(args, own)?;
        let Some(sort) = self.row().result else {
            return Ok(None);
        };
        let ty = resolve(sort, free, own).ok_or_else(|| self.operands(args))?;
        self.check_shift(ty)?;
        let range = self.transfer(kernel, ty, args, own)?;
        Ok(Some(ValueInfo { ty, range }))
    }

    /// What is known of a constant of this type.
    ///
    /// # Errors
    /// It does not fit the type.
    pub fn constant(ty: Type, value: i64) -> Result<ValueInfo, OpError> {
        if !ty.range().has(value) {
            return Err(OpError::Overflow {
                op: Op::Const(value),
                ty,
                low: value.into(),
                high: value.into(),
            });
        }
        Ok(ValueInfo {
            ty,
            range: Range::point(value),
        })
    }

    /// The result for these operands, wrapped to its type; none for an operator that works on
    /// memory or owns regions.
    pub fn evaluate(self, ty: Type, args: [i64; 3]) -> Option<i64> {
        let Meaning::Exact(exact) = self.row().meaning else {
            return None;
        };
        let [a, b, c] = args.map(i128::from);
        Some(ty.wrap(exact(self.immediates()[0].into(), a, b, c)))
    }

    fn operands(self, args: &[ValueInfo]) -> OpError {
        OpError::Operands {
            op: self,
            types: args.iter().map(|arg| arg.ty).collect(),
        }
    }

    fn check_declared(self, kernel: &Kernel) -> Result<(), OpError> {
        let outside = |value, allowed| OpError::Immediate {
            op: self,
            value,
            allowed,
        };
        let [first, second] = self.immediates();
        let names_something = self
            .row()
            .immediates
            .first()
            .is_some_and(|immediate| immediate.is_declared());
        let Some(own) = self.declared(kernel) else {
            return if names_something {
                Err(outside(first, Range::new(0, -1)))
            } else {
                Ok(())
            };
        };
        if let Op::Wave(..) = self {
            return wave::check_cells(kernel, self);
        }
        let allowed = match (self.row().immediates.get(1), self) {
            (Some(Immediate::Ticks), _) => Range::new(1, own.len as i64),
            (Some(Immediate::Column), Op::Lookup(table, _)) => {
                Range::new(0, i64::from(kernel.tables[table as usize].columns) - 1)
            }
            _ => return Ok(()),
        };
        if allowed.has(second) {
            Ok(())
        } else {
            Err(outside(second, allowed))
        }
    }

    fn check_shift(self, ty: Type) -> Result<(), OpError> {
        let [value, _] = self.immediates();
        let allowed = Range::new(0, i64::from(ty.bits()) - 1);
        if self.row().immediates.first() == Some(&Immediate::Shift) && !allowed.has(value) {
            return Err(OpError::Immediate {
                op: self,
                value,
                allowed,
            });
        }
        Ok(())
    }

    /// Matches the operands' types against the signature; gives the type that `n` or `t` stands
    /// for.
    fn match_types(
        self,
        args: &[ValueInfo],
        own: Option<Declared>,
    ) -> Result<Option<Type>, OpError> {
        let sorts = self.row().args;
        let mut free = None;
        let fits = |(arg, sort): (&ValueInfo, &Sort)| {
            if matches!(sort, Sort::N | Sort::T)
                && free.is_none()
                && !(*sort == Sort::N && arg.ty == Type::I1)
            {
                free = Some(arg.ty);
            }
            resolve(*sort, free, own) == Some(arg.ty)
        };
        let matched = if sorts == [Sort::Args] {
            own.is_some_and(|own| own.len == args.len() as u64)
                && args.iter().all(|arg| arg.ty == Type::I32)
        } else {
            sorts.len() == args.len() && args.iter().zip(sorts).all(fits)
        };
        if matched {
            Ok(free)
        } else {
            Err(self.operands(args))
        }
    }

    fn check_operands(self, args: &[ValueInfo], own: Option<Declared>) -> Result<(), OpError> {
        let Some(own) = own else { return Ok(()) };
        for (arg, sort) in args.iter().zip(self.row().args) {
            let name = || own.name.to_string();
            if !is_proven(*sort, arg.range) {
                return Err(OpError::Unproven {
                    op: self,
                    operand: arg.range,
                    sort: *sort,
                });
            }
            let words = Range::new(0, own.len as i64 - 1);
            if *sort == Sort::Own && !own.range.contains(arg.range) {
                return Err(OpError::Leaves {
                    op: self,
                    name: name(),
                    operand: arg.range,
                    declared: own.range,
                });
            }
            if *sort == Sort::Index && !words.contains(arg.range) {
                return Err(OpError::Index {
                    op: self,
                    name: name(),
                    index: arg.range,
                    len: own.len,
                });
            }
        }
        Ok(())
    }

    fn transfer(
        self,
        kernel: &Kernel,
        ty: Type,
        args: &[ValueInfo],
        own: Option<Declared>,
    ) -> Result<Range, OpError> {
        let (low, high) = match (self.row().transfer, args, own) {
            (Transfer::Divide, [a, b], _) => divide(self, *a, *b),
            (Transfer::Quotient, [a, b], _) => quotient(self, *a, *b),
            (Transfer::Equal, [a, b], _) => equal(a.range, b.range),
            (Transfer::Assumed, [a], _) => {
                let [low, high] = self.immediates();
                (a.range.low.max(low).into(), a.range.high.min(high).into())
            }
            (Transfer::Declared, _, Some(own)) => return Ok(own.range),
            (Transfer::All, ..) => return Ok(ty.range()),
            (Transfer::Entries, [index], _) => return Ok(entries(kernel, self, index.range)),
            (Transfer::Corners, ..) => corners(self, args),
            (Transfer::Wrapping, ..) => {
                let all = ty.range();
                let fits = |end: i128| i64::try_from(end).is_ok_and(|end| all.has(end));
                match corners(self, args) {
                    (low, high) if fits(low) && fits(high) => (low, high),
                    _ => (all.low.into(), all.high.into()),
                }
            }
            _ => return Err(OpError::Misused { op: self }),
        };
        let bounds = i64::try_from(low).ok().zip(i64::try_from(high).ok());
        bounds
            .map(|(low, high)| Range { low, high })
            .filter(|range| ty.range().contains(*range) && !range.is_empty())
            .ok_or(OpError::Overflow {
                op: self,
                ty,
                low,
                high,
            })
    }
}

/// The type a sort stands for.
fn resolve(sort: Sort, free: Option<Type>, own: Option<Declared>) -> Option<Type> {
    match sort {
        Sort::I1 => Some(Type::I1),
        Sort::I32 | Sort::Index | Sort::Args => Some(Type::I32),
        Sort::Plus | Sort::Minus | Sort::End => Some(Type::I32),
        Sort::I64 => Some(Type::I64),
        Sort::N | Sort::T => free,
        Sort::Own => own.map(|own| own.ty),
    }
}

/// Whether an operand in this interval is one of its sort beyond its type.
fn is_proven(sort: Sort, operand: Range) -> bool {
    match sort {
        Sort::Plus => operand.low >= 0,
        Sort::Minus => operand.high <= 0,
        Sort::End => wave::ENDS.map(Range::point).contains(&operand),
        _ => true,
    }
}

/// Smallest and largest exact result where every operand is at an end of its interval.
fn corners(op: Op, args: &[ValueInfo]) -> (i128, i128) {
    let Meaning::Exact(exact) = op.row().meaning else {
        return (1, 0);
    };
    let n = op.immediates()[0].into();
    let ends = |at: usize| {
        let Range { low, high } = args.get(at).map_or(Range::point(0), |arg| arg.range);
        std::iter::once(low)
            .chain((low != high).then_some(high))
            .map(i128::from)
    };
    let mut bounds = (i128::MAX, i128::MIN);
    for a in ends(0) {
        for b in ends(1) {
            for c in ends(2) {
                let result = exact(n, a, b, c);
                bounds = (bounds.0.min(result), bounds.1.max(result));
            }
        }
    }
    bounds
}

fn divide(op: Op, dividend: ValueInfo, divisor: ValueInfo) -> (i128, i128) {
    let pieces = [(i64::MIN, -1), (0, 0), (1, i64::MAX)];
    let piece = |(low, high): (i64, i64)| {
        Range::new(divisor.range.low.max(low), divisor.range.high.min(high))
    };
    pieces
        .into_iter()
        .map(piece)
        .filter(|range| !range.is_empty())
        .map(|range| corners(op, &[dividend, ValueInfo { range, ..divisor }]))
        .fold((i128::MAX, i128::MIN), |(low, high), (l, h)| {
            (low.min(l), high.max(h))
        })
}

/// About `a 2^n / b`, 0 where `b` is not positive. Its divisor has the 16 highest bits of `b`, so
/// it is at most by 1 in 2^15 too small, and the quotient as much too large; shifts round down.
fn quotient(op: Op, dividend: ValueInfo, divisor: ValueInfo) -> (i128, i128) {
    let n = op.immediates()[0];
    let Range { low, high } = dividend.range;
    if divisor.range.high < 1 {
        return (0, 0);
    }
    let least = i128::from(divisor.range.low.max(1));
    let most = |end: i64| ((i128::from(end).abs() << n) << 15) / (least * ((1 << 15) - 1));
    let below = if low < 0 { -most(low) - 1 } else { 0 };
    let above = if high > 0 { most(high) } else { 0 };
    (
        below.max(QUOTIENTS.low.into()),
        above.min(QUOTIENTS.high.into()),
    )
}

fn equal(a: Range, b: Range) -> (i128, i128) {
    let disjoint = a.high < b.low || b.high < a.low;
    let always = a == b && a.low == a.high;
    (always.into(), (!disjoint).into())
}

/// The entries a proven index reaches.
fn entries(kernel: &Kernel, op: Op, index: Range) -> Range {
    let [table, column] = op.immediates().map(|immediate| immediate as usize);
    let Some(table) = kernel.tables.get(table) else {
        return Range::point(0);
    };
    let reached = (index.low..=index.high).map(|row| table.entry(row as usize, column));
    let reached: Vec<i32> = reached.flatten().collect();
    let low = reached.iter().copied().min().unwrap_or_default();
    let high = reached.iter().copied().max().unwrap_or_default();
    Range::new(low.into(), high.into())
}
