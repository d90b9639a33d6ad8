//! Parallel addition and subtraction, and the saturating additions.
//!
//! The 36 parallel instructions are 6 ways to end a sum times 6 ways to pair the lanes.

use super::bits::rd;
use crate::alu::{signed_sat_q, unsigned_sat_q};
use crate::bus::Bus;
use crate::cpu::Cpu;
use crate::op::{Flow, Op, Run};
use whippen_isa::{Inst, Op as I};

/// How lanes are read and a sum becomes a lane again.
trait Ending {
    const SIGNED: bool;
    /// Whether the GE flags are set.
    const FLAGS: bool = false;
    fn end(sum: i32, bits: u32) -> u32;
}

macro_rules! endings {
    ($($name:ident $signed:literal $flags:literal |$sum:ident, $bits:ident| $end:expr;)+) => {
        $(struct $name;
        impl Ending for $name {
            const SIGNED: bool = $signed;
            const FLAGS: bool = $flags;
            fn end($sum: i32, $bits: u32) -> u32 { $end }
        })+
    };
}

endings! {
    S true true |sum, _bits| sum as u32;
    Q true false |sum, bits| signed_sat_q(i64::from(sum), bits).0 as u32;
    SH true false |sum, _bits| (sum >> 1) as u32;
    U false true |sum, _bits| sum as u32;
    UQ false false |sum, bits| unsigned_sat_q(i64::from(sum), bits).0;
    UH false false |sum, _bits| (sum >> 1) as u32;
}

/// How lanes are paired: bits of a lane, whether the halves of Rm are exchanged, subtraction by
/// lane.
struct Shape {
    bits: u32,
    exchange: bool,
    minus: u8,
}

const SHAPES: [Shape; 6] = [
    Shape {
        bits: 16,
        exchange: false,
        minus: 0b00,
    },
    Shape {
        bits: 16,
        exchange: true,
        minus: 0b01,
    },
    Shape {
        bits: 16,
        exchange: true,
        minus: 0b10,
    },
    Shape {
        bits: 16,
        exchange: false,
        minus: 0b11,
    },
    Shape {
        bits: 8,
        exchange: false,
        minus: 0b0000,
    },
    Shape {
        bits: 8,
        exchange: false,
        minus: 0b1111,
    },
];
const ADD16: usize = 0;
const ASX: usize = 1;
const SAX: usize = 2;
const SUB16: usize = 3;
const ADD8: usize = 4;
const SUB8: usize = 5;

fn parallel<E: Ending, const SHAPE: usize>(cpu: &mut Cpu, _: &mut Bus, op: &Op) -> Flow {
    let Shape {
        bits,
        exchange,
        minus,
    } = SHAPES[SHAPE];
    let (x, y) = (
        cpu.rn(op),
        cpu.rm(op).rotate_left(if exchange { 16 } else { 0 }),
    );
    let lane = |value: u32, i: u32| match E::SIGNED {
        true => (value << (32 - bits - i * bits)) as i32 >> (32 - bits),
        false => (value << (32 - bits - i * bits) >> (32 - bits)) as i32,
    };
    let (mut result, mut ge) = (0, 0);
    for i in 0..32 / bits {
        let subtract = minus >> i & 1 != 0;
        let sum = if subtract {
            lane(x, i) - lane(y, i)
        } else {
            lane(x, i) + lane(y, i)
        };
        let at_least = if E::SIGNED || subtract { 0 } else { 1 << bits };
        result |= (E::end(sum, bits) & ((1 << bits) - 1)) << (i * bits);
        ge |= (u8::from(sum >= at_least) * ((1 << (bits / 8)) - 1)) << (i * bits / 8);
    }
    if E::FLAGS {
        cpu.ge = ge;
    }
    cpu.write(op.d, result);
    Flow::Next
}

/// A saturating sum of words that sets Q.
fn saturate(cpu: &mut Cpu, sum: i64) -> i64 {
    let (value, saturated) = signed_sat_q(sum, 32);
    cpu.q |= saturated;
    i64::from(value)
}

fn n(cpu: &Cpu, op: &Op) -> i64 {
    i64::from(cpu.rn(op) as i32)
}

fn m(cpu: &Cpu, op: &Op) -> i64 {
    i64::from(cpu.rm(op) as i32)
}

/// Twice Rn, saturated.
fn doubled(cpu: &mut Cpu, op: &Op) -> i64 {
    let twice = 2 * n(cpu, op);
    saturate(cpu, twice)
}

pub(super) fn select(inst: &Inst) -> Option<Run> {
    Some(match inst.op() {
        I::QADD => rd!(|cpu, op| saturate(cpu, m(cpu, op) + n(cpu, op)) as u32),
        I::QSUB => rd!(|cpu, op| saturate(cpu, m(cpu, op) - n(cpu, op)) as u32),
        I::QDADD => rd!(|cpu, op| {
            let sum = m(cpu, op) + doubled(cpu, op);
            saturate(cpu, sum) as u32
        }),
        I::QDSUB => rd!(|cpu, op| {
            let difference = m(cpu, op) - doubled(cpu, op);
            saturate(cpu, difference) as u32
        }),
        I::SADD16 | I::SASX | I::SSAX | I::SSUB16 | I::SADD8 | I::SSUB8 => by_shape::<S>(inst.op()),
        I::QADD16 | I::QASX | I::QSAX | I::QSUB16 | I::QADD8 | I::QSUB8 => by_shape::<Q>(inst.op()),
        I::SHADD16 | I::SHASX | I::SHSAX | I::SHSUB16 | I::SHADD8 | I::SHSUB8 => {
            by_shape::<SH>(inst.op())
        }
        I::UADD16 | I::UASX | I::USAX | I::USUB16 | I::UADD8 | I::USUB8 => by_shape::<U>(inst.op()),
        I::UQADD16 | I::UQASX | I::UQSAX | I::UQSUB16 | I::UQADD8 | I::UQSUB8 => {
            by_shape::<UQ>(inst.op())
        }
        I::UHADD16 | I::UHASX | I::UHSAX | I::UHSUB16 | I::UHADD8 | I::UHSUB8 => {
            by_shape::<UH>(inst.op())
        }
        _ => return None,
    })
}

/// The shape is the end of the name.
fn by_shape<E: Ending>(op: I) -> Run {
    let name = op.identifier();
    match () {
        () if name.ends_with("ADD16") => parallel::<E, ADD16>,
        () if name.ends_with("ASX") => parallel::<E, ASX>,
        () if name.ends_with("SAX") => parallel::<E, SAX>,
        () if name.ends_with("SUB16") => parallel::<E, SUB16>,
        () if name.ends_with("ADD8") => parallel::<E, ADD8>,
        () => parallel::<E, SUB8>,
    }
}
