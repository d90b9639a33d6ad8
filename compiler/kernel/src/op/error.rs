//! Errors of operators: why one cannot be applied.

use super::{Op, Sort};
use crate::{Range, Type};
use std::fmt;

/// Why an operator cannot be applied to these operands.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum OpError {
    /// The exact result need not fit its type.
    Overflow {
        /// The operator.
        op: Op,
        /// Type of the result.
        ty: Type,
        /// Smallest exact result.
        low: i128,
        /// Largest exact result.
        high: i128,
    },
    /// An operand may leave the range that is declared.
    Leaves {
        /// The operator.
        op: Op,
        /// What declares the range.
        name: String,
        /// Where the operand stays.
        operand: Range,
        /// Where it should.
        declared: Range,
    },
    /// An index may leave what it indexes.
    Index {
        /// The operator.
        op: Op,
        /// What is indexed.
        name: String,
        /// Where the index stays.
        index: Range,
        /// Number of words.
        len: u64,
    },
    /// An operand is not proven to be of its sort.
    Unproven {
        /// The operator.
        op: Op,
        /// Where the operand stays.
        operand: Range,
        /// What it should be.
        sort: Sort,
    },
    /// The cells that it names are not of the kind that it takes.
    Cells {
        /// The operator.
        op: Op,
        /// What is wrong with them.
        message: &'static str,
    },
    /// Wrong number or types of operands.
    Operands {
        /// The operator.
        op: Op,
        /// Their types.
        types: Vec<Type>,
    },
    /// An immediate is outside what the operator allows.
    Immediate {
        /// The operator.
        op: Op,
        /// The immediate.
        value: i64,
        /// What is allowed.
        allowed: Range,
    },
    /// The operator gives no result, gives one where none was asked for, or owns regions.
    Misused {
        /// The operator.
        op: Op,
    },
    /// Two regions yield different numbers or types of values.
    Yields {
        /// Types that one yields.
        left: Vec<Type>,
        /// Types that the other yields, or that are carried.
        right: Vec<Type>,
    },
    /// A carried value may leave its declared range.
    Carried {
        /// Which.
        index: usize,
        /// Where the value stays.
        value: Range,
        /// Where it should.
        declared: Range,
    },
}

/// A list of types between parentheses.
struct Types<'a>(&'a [Type]);

impl fmt::Display for Types<'_> {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let names: Vec<String> = self.0.iter().map(Type::to_string).collect();
        write!(f, "({})", names.join(" "))
    }
}

impl fmt::Display for OpError {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let name = |op: &Op| op.row().name;
        match self {
            OpError::Overflow { op, ty, low, high } => {
                write!(
                    f,
                    "the result of `{}` lies in [{low}..{high}], which does not fit {ty}",
                    name(op)
                )
            }
            OpError::Leaves {
                op,
                name: what,
                operand,
                declared,
            } => {
                write!(
                    f,
                    "`{}`: operand in {operand} may leave {declared}, the range of `{what}`",
                    name(op)
                )
            }
            OpError::Index {
                op,
                name: what,
                index,
                len,
            } => {
                write!(
                    f,
                    "`{}`: index in {index} may leave `{what}`, which has {len} words",
                    name(op)
                )
            }
            OpError::Unproven { op, operand, sort } => {
                write!(
                    f,
                    "`{}`: operand in {operand} is not proven to be {}",
                    name(op),
                    sort.word()
                )
            }
            OpError::Cells { op, message } => write!(f, "`{}` {message}", name(op)),
            OpError::Operands { op, types } => {
                write!(
                    f,
                    "`{}` cannot be applied to {}, it is {}",
                    name(op),
                    Types(types),
                    op.row().signature()
                )
            }
            OpError::Immediate { op, value, allowed } => {
                write!(f, "`{}`: {value} is not in {allowed}", name(op))
            }
            OpError::Misused { op } => write!(f, "`{}` cannot stand here", name(op)),
            OpError::Yields { left, right } => {
                write!(
                    f,
                    "yields of types {} do not match {}",
                    Types(left),
                    Types(right)
                )
            }
            OpError::Carried {
                index,
                value,
                declared,
            } => {
                write!(f, "carried value {index} in {value} may leave {declared}")
            }
        }
    }
}

impl std::error::Error for OpError {}
