//! The table of operators: name, signature, what it means, which interval its result lies in.
//! Everything else that must know operators (printer, parser, verifier, interpreter, random
//! kernels) asks this table.
//!
//! Meanings are exact: they are written over unbounded integers (`i128` holds every intermediate)
//! and the result is then wrapped to its type. They are written once, for whatever computes like
//! integers ([`Integer`]): numbers, and the terms of which a solver decides what holds for all
//! numbers. That makes two other columns short. Overflow is the
//! exact result not fitting its type (the operators modulo `2^32` have none: they may give any
//! word); and where a meaning is monotone in each operand by itself,
//! the exact interval of the result is spanned by the meaning at the corners of the operands'
//! intervals.
//!
//! One operator is a promise: `assume`. Where it is broken, values are wrong, and not in every
//! engine alike; memory stays safe in all, since an index outside is taken for the nearest inside.
//!
//! Not here: how operators print (`print`), where they may stand (`verify`), what memory looks like
//! (`layout`).

mod apply;
mod error;
mod integer;

pub use apply::Declared;
pub use error::OpError;
pub use integer::Integer;

use super::memory::Key;
use crate::Range;

/// What an immediate of an operator stands for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Immediate {
    /// Any integer.
    Number,
    /// A shift, less than the width of the result.
    Shift,
    /// How many ticks ago, 1 ..= the line's length.
    Ticks,
    /// A column of a table, less than it has.
    Column,
    /// How many rounds of a loop, at least 1.
    Rounds,
    /// Index of an input port.
    Input,
    /// Index of an output port.
    Output,
    /// Index of a live value.
    Live,
    /// Index of a per-key constant.
    Keyed,
    /// Index of a cell.
    Cell,
    /// Index of a delay line.
    Line,
    /// Index of a table.
    Table,
    /// Index of an event.
    Event,
    /// Index of a probe.
    Probe,
}

impl Immediate {
    /// Whether it is the index of something the kernel declares.
    pub fn is_declared(self) -> bool {
        !matches!(
            self,
            Immediate::Number
                | Immediate::Shift
                | Immediate::Ticks
                | Immediate::Column
                | Immediate::Rounds
        )
    }
}

/// What an operand or a result may be.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Sort {
    /// `i1`
    I1,
    /// `i32`
    I32,
    /// `i64`
    I64,
    /// `i32` or `i64`, the same everywhere in a signature.
    N,
    /// Any type, the same everywhere in a signature.
    T,
    /// Type and range of what the immediate names; an operand must be proven to lie in that range.
    Own,
    /// `i32`, proven to be an index into what the immediate names.
    Index,
    /// As many `i32` operands as the event has arguments.
    Args,
    /// `i32`, proven to be at least 0.
    Plus,
    /// `i32`, proven to be at most 0.
    Minus,
    /// `i32`, proven to be 0 (pinned) or to be 2 (clamped): how the end of a string is held.
    End,
}

/// What an operator does besides giving a result.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Effect {
    /// Nothing, and equal operands always give equal results.
    Pure,
    /// Nothing, and equal operands give equal results for all keys of a tick.
    PerTick,
    /// Nothing, and equal operands give equal results for a key throughout a tick.
    PerKey,
    /// Reads what other instructions write.
    Reads,
    /// Writes; stands in `init` and `tick`.
    Writes,
    /// Writes; stands in `tick` only.
    WritesInTick,
    /// Writes; stands in `init` only.
    WritesInInit,
    /// Writes; stands in `tick` only, outside `if` and `loop`, once for what it names.
    WritesOnce,
    /// Owns regions.
    Control,
}

impl Effect {
    /// Whether equal operands give equal results for a key throughout a tick, and nothing else
    /// happens.
    pub fn is_pure(self) -> bool {
        matches!(self, Effect::Pure | Effect::PerTick | Effect::PerKey)
    }
}

/// What an operator computes.
#[derive(Clone, Copy)]
pub enum Meaning {
    /// From the (first) immediate and up to three operands the exact result, still to be wrapped.
    Exact(fn(i128, i128, i128, i128) -> i128),
    /// From the key, the immediates and the operands.
    Reads(fn(&Key, [usize; 2], &[i64]) -> i64),
    /// Changes the key's memory or what leaves it.
    Writes(fn(&mut Key, [usize; 2], &[i64])),
    /// Runs regions.
    Regions,
}

/// How the interval of the result follows from those of the operands. All are exact, except that
/// operands are taken as independent of each other.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Transfer {
    /// The meaning is monotone in each operand by itself: its values at the corners.
    Corners,
    /// As `Corners` where that fits the type, else all that the type holds.
    Wrapping,
    /// As `Corners`, separately for a negative, a zero and a positive second operand.
    Divide,
    /// As `Divide`, and as much further as roundings reach.
    Quotient,
    /// 1 for two equal points, 0 for disjoint intervals, else either.
    Equal,
    /// The range that what the immediate names declares.
    Declared,
    /// All that its type holds.
    All,
    /// What the operand's range and the two immediates have in common.
    Assumed,
    /// Smallest and largest entry of the table's column within the interval of the index.
    Entries,
    /// No result, or those of the regions.
    None,
}

/// One line of the table.
#[derive(Clone, Copy)]
pub struct Row {
    /// Place in [`ROWS`].
    pub index: usize,
    /// Name in text.
    pub name: &'static str,
    /// Its immediates.
    pub immediates: &'static [Immediate],
    /// Its operands.
    pub args: &'static [Sort],
    /// Its result.
    pub result: Option<Sort>,
    /// What it does besides.
    pub effect: Effect,
    /// What it computes.
    pub meaning: Meaning,
    /// Interval of the result.
    pub transfer: Transfer,
    /// One line for people.
    pub doc: &'static str,
    /// The operator with these immediates; none if their number is wrong or one does not fit.
    pub make: fn(&[i64]) -> Option<Op>,
}

impl Row {
    /// Whether its result is the same wherever in the tick of a key it stands, so that it may be
    /// computed anew anywhere: it is pure and has no operands.
    pub fn is_fixed_in_tick(&self) -> bool {
        self.effect.is_pure() && self.args.is_empty()
    }
}

macro_rules! operators {
    ($(
        $( #[doc = $doc:literal] )+
        $op:ident $( ( $( $imm:ident: $imm_ty:ident $imm_kind:ident ),+ ) )?
        $name:literal ( $($arg:ident)* -> $($result:ident)? ) $effect:ident $transfer:ident
            $meaning:ident $( ( $($body:tt)+ ) )?;
    )*) => {
        /// Operators with their immediates; types, meaning and range transfer are in the table of
        /// `op`.
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
        pub enum Op {
            $( $( #[doc = $doc] )+ $op $( ( $($imm_ty),+ ) )?, )*
        }

        enum OpIndex { $( $op, )* }

        /// Every operator.
        pub static ROWS: &[Row] = &[ $( Row {
            index: OpIndex::$op as usize,
            name: $name,
            immediates: &[ $( $( Immediate::$imm_kind ),+ )? ],
            args: &[ $( Sort::$arg ),* ],
            result: { let result: &[Sort] = &[ $( Sort::$result )? ]; result.first().copied() },
            effect: Effect::$effect,
            transfer: Transfer::$transfer,
            meaning: $meaning $( ( $($body)+ ) )?,
            doc: concat!($($doc),+).trim_ascii(),
            make: |immediates| {
                let mut immediates = immediates.iter();
                let op = Op::$op $( ( $( $imm_ty::try_from(*immediates.next()?).ok()? ),+ ) )?;
                immediates.next().is_none().then_some(op)
            },
        }, )* ];

        impl Op {
            /// Its line of the table.
            pub fn row(self) -> &'static Row {
                &ROWS[match self { $( Op::$op { .. } => OpIndex::$op as usize, )* }]
            }

            /// The exact result, not wrapped, of the (first) immediate and up to three operands;
            /// none for an operator that works on memory or owns regions.
            pub fn exact<I: Integer>(self, args: [I; 3]) -> Option<I> {
                let [a, b, c] = args;
                let n = I::of(self.immediates()[0].into());
                match self {
                    $( Op::$op { .. } => exact!(I, (n, a, b, c), $meaning $( ( $($body)+ ) )?), )*
                }
            }

            /// Its immediates, in order, then zeros.
            pub fn immediates(self) -> [i64; 2] {
                let given: &[i64] = match self {
                    $( Op::$op $( ( $($imm),+ ) )? => &[ $( $( i64::from($imm) ),+ )? ], )*
                };
                std::array::from_fn(|at| given.get(at).copied().unwrap_or(0))
            }
        }
    };
}

/// The exact result of a meaning that has one.
macro_rules! exact {
    ($integer:ident, ($($operand:expr),+), Exact($meaning:expr)) => {{
        let meaning: fn($integer, $integer, $integer, $integer) -> $integer = $meaning;
        Some(meaning($($operand),+))
    }};
    ($integer:ident, ($($operand:expr),+), $($other:tt)+) => {
        None
    };
}

use Meaning::{Exact, Reads, Regions, Writes};

operators! {
    /// A constant; its type is that of its result.
    Const(k: i64 Number)  "const"     (-> T)               Pure Corners  Exact(|k, _, _, _| k);
    /// The sum.
    Add                   "add"       (N N -> N)           Pure Corners  Exact(|_, a, b, _| a + b);
    /// The difference.
    Sub                   "sub"       (N N -> N)           Pure Corners  Exact(|_, a, b, _| a - b);
    /// The product.
    Mul                   "mul"       (N N -> N)           Pure Corners  Exact(|_, a, b, _| a * b);
    /// The whole product of two words (SMULL).
    MulWide               "mul_wide"  (I32 I32 -> I64)     Pure Corners  Exact(|_, a, b, _| a * b);
    /// Accumulator plus product (SMLAL).
    MacWide               "mac_wide"  (I64 I32 I32 -> I64) Pure Corners  Exact(|_, a, b, c| a + b * c);
    /// The top word of the product, rounding half up: `floor(a * b / 2^32 + 1/2)` (SMMULR).
    MulTop                "mul_top"   (I32 I32 -> I32)     Pure Corners  Exact(|_, a, b, _| sar_round(a * b, word_bits()));
    /// Accumulator plus the top word of the product: `a + floor(b * c / 2^32 + 1/2)` (SMMLAR).
    MacTop                "mac_top"   (I32 I32 I32 -> I32) Pure Corners  Exact(|_, a, b, c| a + sar_round(b * c, word_bits()));
    /// The smaller one.
    Min                   "min"       (N N -> N)           Pure Corners  Exact(|_, a, b, _| a.least(b));
    /// The larger one.
    Max                   "max"       (N N -> N)           Pure Corners  Exact(|_, a, b, _| a.most(b));
    /// Left shift.
    Shl(n: u8 Shift)      "shl"       (N -> N)             Pure Corners  Exact(|n, a, _, _| a << n);
    /// Arithmetic right shift, rounding towards minus infinity.
    Sar(n: u8 Shift)      "sar"       (N -> N)             Pure Corners  Exact(|n, a, _, _| a >> n);
    /// Arithmetic right shift, rounding half up: `floor(a / 2^n + 1/2)`.
    SarRound(n: u8 Shift) "sar_round" (N -> N)             Pure Corners  Exact(|n, a, _, _| sar_round(a, n));
    /// Quotient in fixed point, rounding half up: `floor(a * 2^n / b + 1/2)`; 0 where `b` is 0.
    DivRound(n: u8 Shift) "div_round" (I32 I32 -> I32)     Pure Divide   Exact(|n, a, b, _| div_round(a << n, b));
    /// Quotient for searches, about `a * 2^n / b` with 14 significant bits or more, held to 30
    /// bits; 0 where `b` is not positive. With the dividend `x` and the divisor moved up as far as
    /// words reach, and the 16 highest bits `y` of the latter, it is `x / y` towards zero, moved
    /// back downwards.
    Quot(n: u8 Shift)     "quot"      (I32 I32 -> I32)     Pure Quotient Exact(|n, a, b, _| a.quot(b, n));
    /// `floor(sqrt(a))`; 0 where `a` is negative.
    Sqrt                  "sqrt"      (I64 -> I32)         Pure Corners  Exact(|_, a, _, _| a.root());
    /// The same value in 64 bits.
    Widen                 "widen"     (I32 -> I64)         Pure Corners  Exact(|_, a, _, _| a);
    /// The same value, promised to lie within the immediates by an argument beyond intervals.
    Assume(low: i64 Number, high: i64 Number) "assume"    (N -> N)             Pure Assumed  Exact(|_, a, _, _| a);
    /// The low word.
    Narrow                "narrow"    (I64 -> I32)         Pure Corners  Exact(|_, a, _, _| a);
    /// The low word, modulo `2^32`.
    Low                   "low"       (I64 -> I32)         Pure Wrapping Exact(|_, a, _, _| a);
    /// The sum modulo `2^32`.
    AddWrap               "add_wrap"  (I32 I32 -> I32)     Pure Wrapping Exact(|_, a, b, _| a + b);
    /// The difference modulo `2^32`.
    SubWrap               "sub_wrap"  (I32 I32 -> I32)     Pure Wrapping Exact(|_, a, b, _| a - b);
    /// The product modulo `2^32`.
    MulWrap               "mul_wrap"  (I32 I32 -> I32)     Pure Wrapping Exact(|_, a, b, _| a * b);
    /// The sum, or the end of the type nearest to it (QADD).
    AddSat                "add_sat"   (I32 I32 -> I32)     Pure Corners  Exact(|_, a, b, _| saturated(a + b));
    /// The difference, or the end of the type nearest to it (QSUB).
    SubSat                "sub_sat"   (I32 I32 -> I32)     Pure Corners  Exact(|_, a, b, _| saturated(a - b));
    /// Left shift modulo `2^32`.
    ShlWrap(n: u8 Shift)  "shl_wrap"  (I32 -> I32)         Pure Wrapping Exact(|n, a, _, _| a << n);
    /// Whether both are equal.
    Eq                    "eq"        (T T -> I1)          Pure Equal    Exact(|_, a, b, _| a.equal(b));
    /// Whether the first is less than the second.
    Lt                    "lt"        (N N -> I1)          Pure Corners  Exact(|_, a, b, _| a.less(b));
    /// Whether the first is at most the second.
    Le                    "le"        (N N -> I1)          Pure Corners  Exact(|_, a, b, _| b.less(a).opposite());
    /// Whether both hold.
    And                   "and"       (I1 I1 -> I1)        Pure Corners  Exact(|_, a, b, _| a.least(b));
    /// Whether at least one holds.
    Or                    "or"        (I1 I1 -> I1)        Pure Corners  Exact(|_, a, b, _| a.most(b));
    /// Whether it does not hold.
    Not                   "not"       (I1 -> I1)           Pure Corners  Exact(|_, a, _, _| a.opposite());
    /// The second operand where the first holds, else the third.
    Select                "select"    (I1 T T -> T)        Pure Corners  Exact(|_, a, b, c| a.choose(b, c));
    /// Word of an input port, clamped to the port's range.
    In(i: u32 Input)     "in"     (-> Own)       PerKey       Declared Reads(|k, [i, _], _| k.input(i));
    /// Word of an output port; every port is written exactly once.
    Out(i: u32 Output)   "out"    (Own ->)       WritesOnce   None     Writes(|k, [i, _], v| k.output(i, v[0]));
    /// A live value.
    Live(i: u32 Live)    "live"   (-> Own)       PerTick      Declared Reads(|k, [i, _], _| k.live(i));
    /// The number of the tick that comes so many ticks later, its low word.
    Tick(n: u32 Number)  "tick"   (-> I32)       PerTick      All      Reads(|k, [n, _], _| k.tick(n));
    /// A constant of the key.
    Keyed(i: u32 Keyed)  "keyed"  (-> Own)       PerKey       Declared Reads(|k, [i, _], _| k.keyed(i));
    /// Word 0 of a cell, as stored now.
    Get(i: u32 Cell)     "get"    (-> Own)       Reads        Declared Reads(|k, [i, _], _| k.get(i, 0));
    /// Stores word 0 of a cell.
    Set(i: u32 Cell)     "set"    (Own ->)       Writes       None     Writes(|k, [i, _], v| k.set(i, 0, v[0]));
    /// A word of a cell, as stored now.
    GetAt(i: u32 Cell)   "get_at" (Index -> Own) Reads        Declared Reads(|k, [i, _], v| k.get(i, v[0]));
    /// Stores a word of a cell.
    SetAt(i: u32 Cell)   "set_at" (Index Own ->) Writes       None     Writes(|k, [i, _], v| k.set(i, v[0], v[1]));
    /// One tick of a string: its slopes, its rates, and the coefficients `k0` to `k3` (`wave` says what they are).
    Wave(e: u32 Cell, v: u32 Cell) "wave" (Plus Minus Plus Minus End End ->) Writes None Writes(|k, [e, v], a| k.wave(e, v, a));
    /// What was pushed onto a line so many ticks ago; stands before the line's push.
    Delay(i: u32 Line, n: u32 Ticks) "delay"  (-> Own)       Reads        Declared Reads(|k, [i, n], _| k.delay(i, n));
    /// What was pushed onto a line one tick more than the operand ago; stands before the line's push.
    DelayAt(i: u32 Line) "delay_at" (Index -> Own) Reads       Declared Reads(|k, [i, _], v| k.delay_at(i, v[0]));
    /// Pushes onto a line.
    Push(i: u32 Line)    "push"   (Own ->)       WritesOnce   None     Writes(|k, [i, _], v| k.push(i, v[0]));
    /// Fills a whole line.
    Fill(i: u32 Line)    "fill"   (Own ->)       WritesInInit None     Writes(|k, [i, _], v| k.fill(i, v[0]));
    /// Entry of a table: the row of this index, the column of the immediate.
    Lookup(i: u32 Table, c: u32 Column) "lookup" (Index -> I32) Pure         Entries  Reads(|k, [i, c], v| k.lookup(i, c, v[0]));
    /// An event of this key in this tick.
    Emit(i: u32 Event)   "emit"   (Args ->)      WritesInTick None     Writes(|k, [i, _], v| k.emit(i, v));
    /// Exports a value; a probe not reached in a tick keeps its value.
    Probe(i: u32 Probe)  "probe"  (Own ->)       WritesInTick None     Writes(|k, [i, _], v| k.probe(i, v[0]));
    /// Runs the first region where the operand holds, else the second; results are what the region yields.
    If                   "if"     (I1 ->)        Control      None     Regions;
    /// Runs a region so many times with the round (from 0) and the values carried from round to round.
    Loop(i: u32 Rounds)  "loop"   (->)           Control      None     Regions;
}

/// `floor(a / 2^n + 1/2)`
fn sar_round<I: Integer>(a: I, n: I) -> I {
    (a + ((I::of(1) << n) >> I::of(1))) >> n
}

fn word_bits<I: Integer>() -> I {
    I::of(32)
}

/// The word nearest to `a`.
fn saturated<I: Integer>(a: I) -> I {
    a.most(I::of(i32::MIN.into())).least(I::of(i32::MAX.into()))
}

/// `floor(a / b + 1/2)`, 0 where `b` is 0.
fn div_round<I: Integer>(a: I, b: I) -> I {
    let (zero, two) = (I::of(0), I::of(2));
    // floor((2a + b) / 2b), with the divisor made positive.
    let is_negative = b.less(zero);
    let twice = two * a + b;
    let twice = is_negative.choose(zero - twice, twice);
    let divisor = is_negative.choose(zero - b, b);
    // Nothing is divided by 0.
    let quotient = twice.floor_quotient(two * divisor.most(I::of(1)));
    b.equal(zero).choose(zero, quotient)
}

/// What a quotient for searches is held to.
const QUOTIENTS: Range = Range::new(-(1 << 29), (1 << 29) - 1);

/// The row with this name.
pub fn named(name: &str) -> Option<&'static Row> {
    ROWS.iter().find(|row| row.name == name)
}
